//! A picture of a solution: direct light evaluated for each pixel, indirect light from the continuous field.

use crate::answer::Station;
use crate::monitor::Monitor;
use crate::{Error, Indirect, Solution};
use glam::DVec3;
use radiosity_scene::{Camera, Side, luminance};
use radiosity_trace::sampling::{Sequence, cosine_direction, frame};
use radiosity_trace::{Found, Tracer};
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

/// A camera for a scene that has none: inside for interiors, from a corner towards the middle; from above and aside
/// for objects.
pub fn place_camera(tracer: &Tracer) -> Camera {
    let up = tracer.scene.up.direction();
    let Some([low, high]) = tracer.scene.bounding_box() else {
        return Camera::look_at("outside", DVec3::ONE, DVec3::ZERO, up, 0.9);
    };
    let (size, centre) = (high - low, 0.5 * (low + high));
    let across = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * (1.0 - axis.dot(up).abs()));

    // Candidates at eye height, 1.6 m or 45 % of a lower room, on a grid over the plan.
    let height = (1.6 / size.dot(up)).min(0.45);
    let mut best: Option<(f64, DVec3, DVec3)> = None;
    const GRID: i32 = 9;
    for i in 0..GRID * GRID {
        let (x, y) = ((f64::from(i % GRID) + 0.5) / f64::from(GRID), (f64::from(i / GRID) + 0.5) / f64::from(GRID));
        let mut shares = [x, y].into_iter();
        let mut eye = low + up * height * size.dot(up);
        for axis in across.iter().filter(|axis| axis.length_squared() > 0.5) {
            eye += *axis * shares.next().unwrap_or(0.5) * size.dot(*axis);
        }
        // Towards the middle, a little down, so that the floor shows.
        let away = centre - eye - up * (centre - eye).dot(up);
        let target = eye + away - up * DOWN * away.length();
        let plan = size - up * size.dot(up);
        if away.length() < 0.1 * plan.length() {
            continue;
        }
        let score = inside_score(tracer, eye, target, &size);
        if score > best.map_or(0.0, |(s, _, _)| s) {
            best = Some((score, eye, target));
        }
    }
    if let Some((_, eye, target)) = best {
        return Camera::look_at("inside", eye, target, up, 1.1);
    }
    let side = across.iter().find(|axis| axis.length_squared() > 0.5).copied().unwrap_or(DVec3::X);
    let direction = (side * 0.6 + up.cross(side) * 0.8 + up * 0.45).normalize();
    let distance = 0.5 * size.length() / (0.5f64 * 0.7).sin();
    Camera::look_at("outside", centre + distance * direction, centre, up, 0.7)
}

/// A camera that the program places looks down by this much for each metre ahead.
const DOWN: f64 = 0.12;

/// How good a place inside is: zero unless most of what is seen from it are fronts; higher for a farther view towards
/// the target with nothing right in front of the lens.
fn inside_score(tracer: &Tracer, eye: DVec3, target: DVec3, size: &DVec3) -> f64 {
    const RAYS: u32 = 128;
    let towards = (target - eye).normalize_or(DVec3::X);
    let sequence = Sequence::new(7, 7);
    let (mut fronts, mut nearest, mut ahead, mut ahead_count) = (0, f64::INFINITY, 0.0, 0);
    for i in 0..RAYS {
        let [u, v, w, _] = sequence.point(i);
        let pole = if w < 0.5 { towards } else { -towards };
        let direction = cosine_direction(&frame(pole), f64::from(u), f64::from(v));
        // The far side of a double-sided surface may be the inside of a solid; a room shows its fronts.
        if let Found::Surface { distance, side: Side::Front, .. } = tracer.first(&tracer.free_ray(eye, direction), i) {
            fronts += 1;
            nearest = nearest.min(f64::from(distance));
            if direction.dot(towards) > 0.8 {
                ahead += f64::from(distance);
                ahead_count += 1;
            }
        }
    }
    let scale = size.length();
    if f64::from(fronts) < 0.7 * f64::from(RAYS) || nearest < 0.02 * scale || ahead_count == 0 {
        return 0.0;
    }
    ahead / f64::from(ahead_count) / scale
}
