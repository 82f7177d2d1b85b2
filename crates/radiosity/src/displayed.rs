//! When what is displayed is near enough (catalogue 42): a solver's bound in colours.
//!
//! An iterate X is within ε = ‖r‖∞/(1 − ρ_max ‖F‖∞) of the solution of its equation, band by band (catalogue 35), and so are the
//! light that is read of it and the exact one. Displayed is B/π with B = X + P, exposed, tone-mapped, on an sRGB screen
//! before it is cut into 8 bits. Of every element the least and the most that B ± ε may be displayed as are as far apart
//! as ΔE*ab says at most; the largest of all elements is the number here. It is guaranteed, and larger than the true
//! difference by a factor of ten and more. What rays, elements and interpolation get wrong is not in it: the audit
//! tells that.

use radiosity_scene::display::tone_map_between;
use radiosity_scene::lab::delta_e_within;
use radiosity_scene::{Bands, luminance};
use rayon::prelude::*;
use serde::Serialize;
use std::f32::consts::PI;

/// Stop solving when what is displayed is as near as this.
#[derive(Clone, Copy, Debug)]
pub struct Displayed {
    /// Largest ΔE*ab of an element from the solution of the equation.
    pub delta_e: f64,
    /// log2 of the factor from cd/m² to display; none for that of a picture that shows all surfaces alike.
    pub exposure: Option<f64>,
}

/// How far what is displayed may be from what would be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Shown {
    /// Bound of the largest ΔE*ab of an element; infinite where none is known.
    pub delta_e: f64,
    /// At which exposure, log2.
    pub exposure: f64,
}

/// A solution's light on a screen.
pub(crate) struct Screen {
    /// P, what is carried directly, and what of it is read otherwise than the equation has it: lm/m².
    pub apart: Vec<Bands>,
    /// Exposed area of elements, which exposure is metered by.
    pub weight: Vec<f64>,
}

/// Luminance that the median is exposed to, and that which nine tenths stay below: as `Picture::exposure` has them.
const MIDDLE: f64 = 0.24;
const BRIGHT: f64 = 0.8;

impl Screen {
    /// The bound for X known within `bound` of each band.
    pub fn shown(&self, x: &[Bands], bound: &[f64], exposure: Option<f64>) -> Shown {
        let b = |i: usize| -> Bands { std::array::from_fn(|k| (x[i][k] + self.apart[i][k]).max(0.0)) };
        let exposure = exposure.unwrap_or_else(|| self.metered(&b));
        if bound.iter().any(|bound| !bound.is_finite()) {
            return Shown { delta_e: f64::INFINITY, exposure };
        }
        let factor = exposure.exp2() as f32 / PI;
        let within: Bands = std::array::from_fn(|k| bound[k] as f32 * (1.0 + f32::EPSILON));
        let of = |i: usize| {
            let b = b(i);
            let [low, high] = [-1.0, 1.0].map(|sign| std::array::from_fn(|k| factor * (b[k] + sign * within[k])));
            let [low, high] = tone_map_between(low, high);
            delta_e_within(low, high)
        };
        // A surface that is buried or has no area shows nothing.
        let seen = (0..x.len()).into_par_iter().filter(|i| self.weight[*i] > 0.0);
        Shown { delta_e: seen.map(of).reduce(|| 0.0, f64::max), exposure }
    }

    /// The exposure of a picture that shows all surfaces, each as large as it is.
    fn metered(&self, b: &impl Fn(usize) -> Bands) -> f64 {
        let mut lit: Vec<(f32, f64)> = (0..self.weight.len())
            .map(|i| (luminance(b(i)) / PI, self.weight[i]))
            .filter(|(light, weight)| *light > 0.0 && *weight > 0.0)
            .collect();
        lit.sort_by(|a, b| a.0.total_cmp(&b.0));
        let total: f64 = lit.iter().map(|(_, weight)| weight).sum();
        let at = |share: f64| {
            let mut sum = 0.0;
            let found = lit.iter().find(|(_, weight)| {
                sum += weight;
                sum >= share * total
            });
            found.or(lit.last()).map(|(light, _)| f64::from(*light).max(1e-30))
        };
        match (at(0.5), at(0.9)) {
            (Some(middle), Some(bright)) => (MIDDLE / middle).min(BRIGHT / bright).log2(),
            _ => 0.0,
        }
    }
}
