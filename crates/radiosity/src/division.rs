//! Smaller elements where direct light varies: the edges of shadows, shelves, the feet of furniture.
//!
//! A receiver far away sees the lit part of an element and not the part that reaches under a desk; a constant gives it
//! the mean of both. Cells whose direct light varies most, by the flux A ρ σ that may go astray, are divided until
//! the rest is small. Pilot samples only choose the cells; their light is worked out anew with other samples, as
//! keeping the pilot where it looked even would keep its errors too.

use radiosity_scene::{Bands, Elements, luminance};
use radiosity_trace::Tracer;
use radiosity_transport::{ElementReceivers, Exposure, Luminaires, Progress, Shadowing, Stopped};
use rayon::prelude::*;

/// Elements along an edge of a divided cell. In a furnished office points are −1.27 % off with 1, −0.72 % with 2,
/// −0.52 % with 4, −0.42 % with 8, which takes half as long again.
const PIECES: u32 = 4;

/// Places in a cell that look how direct light varies, and shadow rays at each: one for each light up to this many.
/// With one ray at each place and twelve lights, points in a furnished office are −0.30 % off instead of −0.22 %.
const PLACES: u32 = 4;
const RAYS: usize = 4;

/// Optical properties by element.
pub(crate) struct Optics {
    /// m².
    pub area: Vec<f64>,
    pub reflectance: Vec<Bands>,
    /// Emitted exitance, lm/m² per band.
    pub exitance: Vec<Bands>,
}

impl Optics {
    pub fn new(tracer: &Tracer, elements: &Elements) -> Optics {
        let ids = 0..elements.len() as u32;
        let area = ids.clone().into_par_iter().map(|e| elements.area(tracer.mesh, e)).collect();
        let (reflectance, exitance) =
            ids.into_par_iter().map(|e| elements.optics(tracer.scene, tracer.mesh, e)).unzip();
        Optics { area, reflectance, exitance }
    }
}

/// Divides cells of one element each until what is left of Σ A ρ σ is at most `variation` times Σ A ρ D.
///
/// # Errors
/// [`Stopped`] if `progress` says so.
pub(crate) fn divided(
    tracer: &Tracer,
    cells: Elements,
    variation: f64,
    progress: &impl Progress,
) -> Result<Elements, Stopped> {
    let Optics { area, reflectance, exitance } = Optics::new(tracer, &cells);
    let luminaires = Luminaires::new(tracer.scene, tracer.mesh, &cells, &area, &exitance);
    // Nothing is known yet of what is buried; such places drop out one by one.
    let exposure = Exposure::default();
    let receivers = ElementReceivers { mesh: tracer.mesh, elements: &cells, exposure: &exposure };
    let looking = Shadowing { places: PLACES, rays: luminaires.lights.len().min(RAYS) as u32 };
    let direct = luminaires.variation(tracer, &receivers, &looking, progress)?;

    let weight = |i: usize| area[i] * f64::from(luminance(reflectance[i]));
    let flux: f64 = (0..cells.len()).map(|i| weight(i) * f64::from(direct[i].mean)).sum();
    let astray: Vec<f64> = (0..cells.len()).map(|i| weight(i) * f64::from(direct[i].variance).sqrt()).collect();
    let mut order: Vec<usize> = (0..cells.len()).filter(|&i| astray[i] > 0.0).collect();
    order.sort_unstable_by(|&a, &b| astray[b].total_cmp(&astray[a]).then(a.cmp(&b)));
    let mut left: f64 = astray.iter().sum();
    let mut pieces = vec![1; cells.cells()];
    for i in order {
        if left <= variation * flux {
            break;
        }
        left -= astray[i];
        pieces[cells.cell(i as u32)] = PIECES;
    }
    Ok(cells.refined(&pieces))
}
