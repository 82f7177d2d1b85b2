//! The truth, mesh included: what the referee says of the exact discrete answer and of the engine as users run it.

use super::problem::{Problem, bright};
use super::reference::Reference;
use crate::answer::Station;
use crate::{Error, Indirect, Monitor, Solution, SolveOptions, stations};
use radiosity_scene::Bands;
use radiosity_trace::Place;
use radiosity_transport::Shadowing;
use radiosity_view::{Audit, Auditor, Field};
use serde::Serialize;
use std::time::Instant;

/// Shadow rays of the engine at each place of the audit.
const SHADOWING: Shadowing = Shadowing { places: 1, rays: 128 };

/// What the mesh costs. Errors are the audit's: relative L2 of illuminance by area.
#[derive(Clone, Debug, Serialize)]
pub struct Truth {
    /// Of the exact discrete answer, constant on elements.
    pub constant: Audit,
    /// Of the same, interpolated as the engine does.
    pub interpolated: Audit,
    /// Of the engine with its own elements and settings.
    pub engine: Audit,
    /// The engine's elements.
    pub engine_elements: usize,
    /// The engine's rays per cell.
    pub engine_rays: usize,
    /// Seconds that the engine took to solve.
    pub engine_seconds: f64,
}

/// The referee with its estimates, and where they were made.
pub(super) struct Witness<'a> {
    auditor: Auditor<'a>,
    /// Element of each place.
    elements: Vec<Option<u32>>,
}

impl Witness<'_> {
    /// Error from the truth of an illuminance by element.
    pub fn error(&self, irradiance: &[[f64; 3]]) -> f64 {
        self.audit(irradiance).error
    }

    fn audit(&self, irradiance: &[[f64; 3]]) -> Audit {
        let of = |e: &Option<u32>| e.map_or([0.0; 3], |e| irradiance[e as usize].map(|x| x as f32));
        self.auditor.judge(&self.elements.iter().map(of).collect::<Vec<Bands>>())
    }
}

/// Asks the referee at `points` places, with `paths` paths each.
///
/// # Errors
/// As [`Solution::new`].
pub(super) fn truth<'a>(
    problem: &Problem<'a>,
    reference: &Reference,
    (points, paths, seed, memory): (usize, u32, u64, usize),
    monitor: &dyn Monitor,
) -> Result<(Witness<'a>, Truth), Error> {
    let tracer = problem.tracer;
    let begun = Instant::now();
    let mut options = SolveOptions { memory, ..SolveOptions::default() };
    options.fit(tracer, monitor);
    let solution = Solution::new(tracer, &options, monitor)?;
    let field = solution.indirect_field(monitor)?;
    let engine_seconds = begun.elapsed().as_secs_f64();
    let places = stations::spread(&solution, points, seed as u32 ^ (seed >> 32) as u32);
    let engine = solution.at(&places, Indirect::Field(&field), &SHADOWING, monitor)?.irradiance;
    monitor.stage("referee");
    let at: Vec<Place> = places.iter().map(|station| station.place).collect();
    let mut auditor = Auditor::new(tracer, at, &engine, seed);
    let total = auditor.estimates();
    if !auditor.trace(paths, &|done| monitor.step(done, total)) {
        return Err(Error::Stopped);
    }
    let element = |s: &Station| problem.elements.at(s.place.triangle, s.uv.x as f32, s.uv.y as f32, s.side);
    let witness = Witness { elements: places.iter().map(element).collect(), auditor };
    let constant = witness.audit(&reference.irradiance);
    let values: Vec<Bands> = reference.irradiance.iter().map(|h| h.map(|x| x as f32)).collect();
    // What is dark lies in solids, and is not to darken what is beside it.
    let lit = |(h, area): (&[f64; 3], &f64)| if bright(*h) > 0.0 { *area } else { 0.0 };
    let weight: Vec<f64> = reference.irradiance.iter().zip(&problem.area).map(lit).collect();
    let field = Field::new(tracer.mesh, &problem.elements, &values, &weight);
    let smooth: Vec<Bands> = places.iter().map(|s| field.at(s.place.triangle as usize, s.uv, s.side)).collect();
    let truth = Truth {
        constant,
        interpolated: witness.auditor.judge(&smooth),
        engine: witness.auditor.judge(&engine),
        engine_elements: solution.elements.len(),
        engine_rays: solution.rays(),
        engine_seconds,
    };
    Ok((witness, truth))
}
