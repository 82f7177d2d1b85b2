//! What an eye sees of it: one camera for all, elements in one colour each.
//!
//! Shown light of an element is what a display makes of its luminance B/π: exposed as the exact picture wants it, tone-mapped,
//! the luminance of that encoded as sRGB, from 0 to 1. The displayed error of B is the root mean square difference of that
//! over the pixels that show a surface; a 255th of it is one step of 8 bits.

use super::problem::Problem;
use crate::place_camera;
use radiosity_scene::display::{srgb, tone_map};
use radiosity_scene::{Bands, Camera, luminance};
use radiosity_view::{Picture, ViewRays};
use serde::Serialize;
use std::f64::consts::PI;

/// Illuminance below this part of the mean counts as this much: relative differences in the dark say nothing.
const DARK: f64 = 1e-3;

/// Relative difference of illuminance from the exact one, as a camera sees it.
#[derive(Clone, Debug, Serialize)]
pub struct DifferenceView {
    /// Index of the trial.
    pub trial: usize,
    /// (H − H*)/H* by pixel, row-major from the top left; not a number where there is no surface.
    #[serde(skip)]
    pub pixels: Vec<f32>,
}

/// What the camera sees of the elements.
pub(super) struct Look {
    view: ViewRays,
    /// Element of each place that is seen.
    element: Vec<Option<u32>>,
    /// Share of the pixels that show each element.
    share: Vec<f64>,
    exposure: f64,
    /// Shown light of the exact answer.
    shown: Vec<f64>,
    exact: Vec<f64>,
    floor: f64,
}

impl Look {
    /// Through the scene's first camera, or one that is placed; `side` is the longer side of the picture.
    pub fn new(problem: &Problem, radiosity: &[f64], irradiance: &[[f64; 3]], side: u32) -> Look {
        let tracer = problem.tracer;
        let camera: Camera = tracer.scene.cameras.first().cloned().unwrap_or_else(|| place_camera(tracer, None));
        let aspect = camera.aspect.filter(|a| a.is_finite() && *a > 0.0).unwrap_or(4.0 / 3.0).clamp(0.25, 4.0);
        let sides = if aspect >= 1.0 { [1.0, 1.0 / aspect] } else { [aspect, 1.0] };
        let [width, height] = sides.map(|s| ((f64::from(side) * s).round() as u32).max(8));
        let view = ViewRays::new(tracer, &camera, width, height);
        let element: Vec<Option<u32>> = view
            .seen
            .iter()
            .map(|s| problem.elements.at(s.place.triangle, s.uv.x as f32, s.uv.y as f32, s.side))
            .collect();
        let mut share = vec![0.0; problem.len()];
        let seen = view.seen.iter().zip(&element).filter(|(seen, _)| !seen.behind);
        seen.filter_map(|(_, e)| *e).for_each(|e| share[e as usize] += 1.0);
        let all: f64 = share.iter().sum();
        // Where a camera sees nothing, all is shown by its area.
        let (share, all) = if all > 0.0 { (share, all) } else { (problem.area.clone(), problem.area.iter().sum()) };
        let share = share.into_iter().map(|s| s / all).collect();
        let mean = |(h, area): (&[f64; 3], &f64)| area * super::problem::bright(*h);
        let level: f64 = irradiance.iter().zip(&problem.area).map(mean).sum::<f64>() / problem.area.iter().sum::<f64>();
        let exact: Vec<f64> = irradiance.iter().map(|h| super::problem::bright(*h)).collect();
        let mut look = Look { view, element, share, exposure: 0.0, shown: Vec::new(), exact, floor: DARK * level };
        look.exposure = look.picture(irradiance).exposure();
        look.shown = look.display(radiosity);
        look
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.view.width, self.view.height]
    }

    /// The picture of an illuminance that is constant on elements, and the exposure of the exact one.
    pub fn picture(&self, irradiance: &[[f64; 3]]) -> Picture {
        let of = |e: &Option<u32>| e.map_or([0.0; 3], |e| irradiance[e as usize].map(|x| x as f32));
        self.view.picture(&self.element.iter().map(of).collect::<Vec<Bands>>())
    }

    /// Exposure of the exact picture.
    pub fn exposure(&self) -> f64 {
        self.exposure
    }

    fn display(&self, b: &[f64]) -> Vec<f64> {
        let factor = self.exposure.exp2() / PI;
        b.chunks_exact(3)
            .map(|b| {
                let exposed = [b[0], b[1], b[2]].map(|x| (x * factor) as f32);
                f64::from(srgb(luminance(tone_map(exposed))))
            })
            .collect()
    }

    /// Displayed error of a radiosity.
    pub fn error(&self, b: &[f64]) -> f64 {
        let shown = self.display(b);
        let squares = shown.iter().zip(&self.shown).zip(&self.share).map(|((a, b), share)| share * (a - b) * (a - b));
        squares.sum::<f64>().sqrt()
    }

    /// Relative difference of an illuminance from the exact one, by pixel.
    pub fn difference(&self, irradiance: &[[f64; 3]]) -> Vec<f32> {
        let pixels = self.view.sky.len();
        let (mut sum, mut weight) = (vec![0f64; pixels], vec![0f64; pixels]);
        for (seen, element) in self.view.seen.iter().zip(&self.element) {
            let Some(e) = element.map(|e| e as usize) else { continue };
            let off = (super::problem::bright(irradiance[e]) - self.exact[e]) / self.exact[e].max(self.floor);
            // A black surface shows as well what arrives.
            let response = f64::from(luminance(seen.response)).max(1e-6);
            sum[seen.pixel as usize] += response * off;
            weight[seen.pixel as usize] += response;
        }
        sum.iter().zip(&weight).map(|(s, w)| if *w > 0.0 { (s / w) as f32 } else { f32::NAN }).collect()
    }
}
