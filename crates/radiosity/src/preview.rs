//! Pictures on the way (catalogue 43): a coarse solution within moments, then ever better ones, each whole.
//!
//! A picture of a solution as it stands takes no shadow ray and no gather: the irradiance of elements, direct light with
//! it, read as a continuous field. What it misses, the fine edges of shadows, comes with the picture at the end. What a
//! camera sees is found once for all of them.

use crate::monitor::Monitor;
use crate::{Error, Solution, SolveOptions};
use radiosity_scene::{Bands, Camera};
use radiosity_trace::Tracer;
use radiosity_transport::Shadowing;
use radiosity_view::{Field, Picture, ViewRays};
use rayon::prelude::*;

/// Cells of the first pictures, on top of one per triangle: a third of what an answer is begun with.
const CELLS: usize = 3000;

/// Rays per cell at which first pictures end; more would take longer than they are looked at.
const MOST_RAYS: usize = 64;

/// Rays per cell of the second picture; the first has none.
const FIRST_RAYS: usize = 16;

/// What a camera sees, for pictures of solutions as they stand.
pub struct Glimpse {
    view: ViewRays,
}

impl Glimpse {
    /// Casts the camera's rays.
    pub fn new(tracer: &Tracer, camera: &Camera, width: u32, height: u32) -> Glimpse {
        Glimpse { view: ViewRays::new(tracer, camera, width, height) }
    }

    /// The picture of a solution.
    pub fn picture(&self, solution: &Solution) -> Picture {
        let mesh = solution.tracer().mesh;
        let field = Field::new(mesh, &solution.elements, solution.irradiance(), &solution.exposed_area());
        let light = |seen: &radiosity_view::picture::Seen| -> Bands {
            field.at(seen.place.triangle as usize, seen.uv, seen.side)
        };
        self.view.picture(&self.view.seen.par_iter().map(light).collect::<Vec<_>>())
    }
}

/// Shows a monitor coarse solutions, the first before any row is traced, then with 16 rays a cell and ever twice as many up to
/// 64 ([`Monitor::solved`]). They are thrown away: an answer that is asked for afterwards has the bytes that it has without.
///
/// # Errors
/// As [`Solution::new`].
pub fn preview(tracer: &Tracer, options: &SolveOptions, monitor: &dyn Monitor) -> Result<(), Error> {
    let coarse = SolveOptions {
        element_size: None,
        cells: options.cells.min(CELLS),
        variation: f64::INFINITY,
        shadowing: Shadowing { places: 2, rays: 1 },
        form_factors: None,
        displayed: None,
        rays: FIRST_RAYS,
        memory: options.memory,
        ..SolveOptions::default()
    };
    let mut solution = Solution::begin(tracer, &coarse, monitor)?;
    let mut rays = FIRST_RAYS;
    while rays <= MOST_RAYS {
        match solution.refine(rays, monitor) {
            // The answer may still fit, with fewer rays.
            Err(Error::Memory { .. }) => break,
            done => done?,
        }
        rays *= 2;
    }
    Ok(())
}
