//! A picture of a solution: direct light evaluated for each pixel, indirect light from the continuous field.

use crate::answer::Station;
use crate::measure::{certify, most_paths};
use crate::monitor::Monitor;
use crate::{Baked, Error, Indirect};
use radiosity_scene::{Bands, Camera, luminance};
use radiosity_trace::Place;
use radiosity_trace::sampling::{hash, unit};
use radiosity_transport::Shadowing;
use radiosity_view::{Audit, Auditor, Picture, ViewRays};

/// How to make a picture.
#[derive(Clone, Copy, Debug)]
pub struct RenderOptions {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Shadow rays per pixel, over all lights; with 128 walls near a lamp are sandy.
    pub shadowing: Shadowing,
}

impl Default for RenderOptions {
    fn default() -> Self {
        RenderOptions { width: 1280, height: 720, shadowing: Shadowing { places: 1, rays: 256 } }
    }
}

/// What a camera sees.
#[derive(Clone, Debug)]
pub struct View {
    /// Luminances.
    pub picture: Picture,
    /// Illuminance of the surface that fills most of each pixel, lx; not a number where there is none.
    pub illuminance: Vec<f32>,
    /// Places that are seen, spread over the pixels, and their irradiance there.
    pub watched: Vec<(Place, Bands)>,
}

impl View {
    /// What the referee says of the irradiance that is seen.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub fn audit(&self, baked: &Baked, monitor: &dyn Monitor) -> Result<Audit, Error> {
        let (places, light): (Vec<Place>, Vec<Bands>) = self.watched.iter().copied().unzip();
        let mut auditor = Auditor::new(baked.solution.tracer(), places, &light, u64::from(baked.seed));
        let judge = |auditor: &Auditor| auditor.judge(&light);
        certify(&mut auditor, judge, baked.error, most_paths(baked.error), &baked.stages, monitor)
    }
}

/// Looks at a solution. Cells that are seen gather their indirect light until its noise is below the error that the solution was
/// made for, as far as some thousands of rays bring it.
///
/// # Errors
/// [`Error::Stopped`].
pub fn render(baked: &Baked, camera: &Camera, options: &RenderOptions, monitor: &dyn Monitor) -> Result<View, Error> {
    monitor.stage("picture");
    let solution = &baked.solution;
    let view = ViewRays::new(solution.tracer(), camera, options.width, options.height);
    let stations: Vec<Station> =
        view.seen.iter().map(|seen| Station { place: seen.place, uv: seen.uv, side: seen.side }).collect();
    let mut looks = vec![0; solution.elements.cells()];
    for Station { place, uv, side } in &stations {
        if let Some(element) = solution.elements.at(place.triangle, uv.x as f32, uv.y as f32, *side) {
            looks[solution.elements.cell(element)] += 1;
        }
    }
    let field = solution.field_on(&looks, baked.received.clone(), baked.error, monitor)?;
    let answer = solution.at(&stations, Indirect::Field(&field), &options.shadowing, monitor)?;
    let pixels = view.own.len();
    let (mut illuminance, mut share) = (vec![f32::NAN; pixels], vec![-1f32; pixels]);
    for (seen, e) in view.seen.iter().zip(&answer.irradiance) {
        let (pixel, response) = (seen.pixel as usize, luminance(seen.response));
        if response > share[pixel] && !seen.behind {
            (share[pixel], illuminance[pixel]) = (response, luminance(*e));
        }
    }
    // One of each of as many runs of places; at equal steps they might all lie in one column.
    let count = baked.watched.len().min(stations.len());
    let pick = |i: usize| {
        let jitter = f64::from(unit(hash(baked.seed ^ hash(i as u32))));
        ((i as f64 + jitter) / count as f64 * stations.len() as f64) as usize
    };
    let watched = (0..count).map(pick).map(|i| (stations[i].place, answer.irradiance[i])).collect();
    Ok(View { picture: view.picture(&answer.irradiance), illuminance, watched })
}
