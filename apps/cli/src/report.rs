//! The account of a run, as data; [`crate::html`] makes a page of it.

use radiosity::Balance;
use radiosity::measure::Round;
use radiosity::{Audit, Faults};
use serde::Serialize;

/// What was asked, what came out, and how far to trust it.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// Name and version of the program.
    pub program: String,
    /// File of the scene, or the name of the built-in one.
    pub scene: String,
    /// Triangles, materials, lights.
    pub triangles: usize,
    /// Materials.
    pub materials: usize,
    /// Lights, with and without area.
    pub lights: Vec<String>,
    /// Area of all surfaces, m².
    pub area: f64,
    /// Relative error that was asked for.
    pub asked_error: f64,
    /// Whether the audit's upper bound meets it.
    pub achieved: bool,
    /// The audit.
    pub audit: Audit,
    /// Rounds of refinement.
    pub rounds: Vec<Round>,
    /// Elements.
    pub elements: usize,
    /// Width of an element, metres.
    pub element_size: f64,
    /// Elements that lie inside solids, wholly and in part.
    pub buried: [usize; 2],
    /// Rays per element.
    pub rays_per_element: usize,
    /// Largest difference of a row sum from one, before any repair.
    pub raw_closure: f64,
    /// Solver: applications of the transport, relative residual, guaranteed bound (lm/m²) by band.
    pub solver: radiosity::solve::Info,
    /// Where the light goes.
    pub balance: Balance,
    /// Least, mean and largest illuminance of the elements, lux.
    pub illuminance: [f32; 3],
    /// Seconds by stage.
    pub stages: Vec<(String, f64)>,
    /// Seconds in all.
    pub seconds: f64,
    /// Threads.
    pub threads: usize,
    /// Peak memory of the process, MB; zero where the system does not tell.
    pub peak_memory_mb: f64,
    /// Files that were written.
    pub outputs: Vec<String>,
    /// Lightmap: texels per metre, texels, seam difference before and after fitting (lx), if there is one.
    pub lightmap: Option<LightmapReport>,
    /// Faults of the input.
    pub faults: Faults,
}

/// What is said of a lightmap.
#[derive(Clone, Debug, Serialize)]
pub struct LightmapReport {
    /// Texels per metre.
    pub density: f64,
    /// Texels computed.
    pub texels: usize,
    /// Pages, width and height.
    pub pages: Vec<[u32; 2]>,
    /// Root mean square difference across seams, lx, before fitting.
    pub seams_before: f64,
    /// The same after fitting.
    pub seams_after: f64,
}

/// Peak memory of this process in MB, where the system tells (Linux).
pub fn peak_memory_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.trim().trim_end_matches("kB").trim().parse::<f64>().ok()).map_or(0.0, |kb| kb / 1024.0)
}
