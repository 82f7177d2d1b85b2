//! Direct light as two halves of the shadow rays tell it, by which their noise is known.

use super::{Asked, CHUNK, RATIO, Shadowing};
use crate::{Luminaires, Progress, Receivers, Stopped};
use radiosity_scene::Bands;
use radiosity_trace::Tracer;
use radiosity_trace::sampling::hash;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Irradiance of a receiver from all lights as two halves of its shadow rays tell it.
#[derive(Clone, Copy, Debug, Default)]
pub struct HalvedLight {
    /// Lux per band.
    pub light: [Bands; 2],
    /// Whether it is known without any chance ([`Columns::is_exact`](crate::Columns::is_exact)), so that the halves are the same.
    pub is_exact: bool,
}

impl HalvedLight {
    /// Two estimates that nothing but chance keeps apart.
    pub fn sampled(light: [Bands; 2]) -> HalvedLight {
        HalvedLight { light, is_exact: false }
    }
}

impl Luminaires {
    /// Irradiance of every receiver from all lights, by halves that have `shadowing` each. At a point what is known without rays is found
    /// once for both, and as if all their rays were to be saved; a receiver with an area has other places in either.
    ///
    /// # Errors
    /// [`Stopped`] if `progress` says so.
    pub fn halves(
        &self,
        tracer: &Tracer,
        receivers: &impl Receivers,
        shadowing: &Shadowing,
        progress: &dyn Progress,
    ) -> Result<Vec<HalvedLight>, Stopped> {
        let n = receivers.len();
        let mut halves = vec![HalvedLight { is_exact: true, ..HalvedLight::default() }; n];
        if self.lights.is_empty() {
            return Ok(halves);
        }
        let done = AtomicUsize::new(0);
        halves.par_chunks_mut(CHUNK).enumerate().try_for_each(|(chunk, out)| {
            let mut scratch = self.scratch(RATIO);
            for (k, out) in out.iter_mut().enumerate() {
                let i = chunk * CHUNK + k;
                let is_point = receivers.site(i).is_some_and(|site| site.point().is_some());
                let times = if is_point { 2 } else { 1 };
                let here = Shadowing { rays: times * shadowing.rays, ..*shadowing };
                for half in 0..2 {
                    let set = half as u32 + 1;
                    if half == 0 || !is_point {
                        let seed = hash(receivers.seed(i) ^ hash(set));
                        self.go_to((tracer, receivers), (i, seed), (&here, Asked::Mean), &mut scratch);
                    }
                    let (mut sum, mut whole) = ([0f64; 3], 0.0);
                    scratch.look(tracer, receivers, (i, set), shadowing.rays, |_, spot, visible| {
                        whole += spot.weight;
                        let all = visible.iter().fold([0.0; 3], |all, e| std::array::from_fn(|k| all[k] + e[k]));
                        (0..3).for_each(|band| sum[band] += spot.weight * all[band]);
                    });
                    out.light[half] = sum.map(|sum| (sum / f64::max(whole, f64::MIN_POSITIVE)) as f32);
                    out.is_exact = scratch.is_exact();
                    if half == 0 && out.is_exact {
                        out.light[1] = out.light[0];
                        break;
                    }
                }
            }
            progress.step(done.fetch_add(out.len(), Ordering::Relaxed) + out.len(), n).then_some(()).ok_or(Stopped)
        })?;
        Ok(halves)
    }
}
