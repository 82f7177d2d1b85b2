//! A picture of a solution: direct light evaluated for each pixel, indirect light from the continuous field.

use crate::answer::Station;
use crate::monitor::Monitor;
use crate::{Error, Indirect, Solution};
use radiosity_scene::{Camera, luminance};
use radiosity_transport::Shadowing;
use radiosity_view::{Field, Picture, ViewRays};

/// How to make a picture.
#[derive(Clone, Copy, Debug)]
pub struct RenderOptions {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Shadow rays per pixel, over all lights.
    pub shadowing: Shadowing,
}

impl Default for RenderOptions {
    fn default() -> Self {
        RenderOptions { width: 1280, height: 720, shadowing: Shadowing { places: 1, rays: 128 } }
    }
}

/// What a camera sees.
#[derive(Clone, Debug)]
pub struct View {
    /// Luminances.
    pub picture: Picture,
    /// Illuminance of the surface that fills most of each pixel, lx; not a number where there is none.
    pub illuminance: Vec<f32>,
}

/// Looks at a solution; `field` is its indirect field.
///
/// # Errors
/// [`Error::Stopped`].
pub fn render(
    solution: &Solution,
    field: &Field,
    camera: &Camera,
    options: &RenderOptions,
    monitor: &dyn Monitor,
) -> Result<View, Error> {
    monitor.stage("picture");
    let view = ViewRays::new(solution.tracer(), camera, options.width, options.height);
    let stations: Vec<Station> =
        view.seen.iter().map(|seen| Station { place: seen.place, uv: seen.uv, side: seen.side }).collect();
    let answer = solution.at(&stations, Indirect::Field(field), &options.shadowing, monitor)?;
    let pixels = view.own.len();
    let (mut illuminance, mut share) = (vec![f32::NAN; pixels], vec![-1f32; pixels]);
    for (seen, e) in view.seen.iter().zip(&answer.irradiance) {
        let (pixel, response) = (seen.pixel as usize, luminance(seen.response));
        if response > share[pixel] {
            (share[pixel], illuminance[pixel]) = (response, luminance(*e));
        }
    }
    Ok(View { picture: view.picture(&answer.irradiance), illuminance })
}
