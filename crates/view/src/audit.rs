//! The audit: how wrong is an answer, everything included?
//!
//! At K points, spread by area, the referee makes two independent unbiased estimates a and b of the irradiance E. For
//! an answer h, (h − a)(h − b) has the expectation (h − E)²: its mean is an unbiased estimate of the squared error of
//! everything — mesh, rows, solver, interpolation, leaks — and a·b is one of E². The cost does not depend on the size
//! of the scene. Its resolution is about σ/K^¼, σ being the referee's own relative noise.
//!
//! Where light m is handed out that was read from an answer h, (m − a)(m − b) = (m − h)² + (m − h)(2h − a − b) + (h − a)(h − b), and
//! the first part needs no referee: its mean is taken over many more places. That is where edges of shadows are, which
//! hold most of the error on a hundredth of the area, so that K points alone bound it badly.

use crate::Referee;
use radiosity_scene::{Bands, luminance};
use radiosity_trace::{Place, Tracer};
use rayon::prelude::*;
use serde::Serialize;

/// Standard normal quantile of the one-sided 95 % bound.
const ONE_SIDED_95: f64 = 1.645;

/// Standard errors beyond which an answer is wrong for certain.
const CERTAIN: f64 = 3.0;

/// Fewer points than this get no bound: the spread of heavy-tailed products cannot be told from a handful.
pub const FEWEST_POINTS: usize = 30;

/// What the audit found.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Audit {
    /// Points examined.
    pub points: usize,
    /// Paths per estimate, two estimates per point.
    pub paths: u32,
    /// Estimated relative L2 error of irradiance (luminance-weighted): ‖h − E‖/‖E‖. An estimate below zero, which
    /// noise can produce, is given as zero.
    pub error: f64,
    /// One-sided 95 % upper bound of the error.
    pub upper: f64,
    /// One-sided 95 % lower bound of the error.
    pub lower: f64,
    /// Mean of h − E over mean of E.
    pub bias: f64,
    /// Standard error of `bias`.
    pub bias_error: f64,
    /// Mean illuminance at the points by the referee, lux.
    pub mean_illuminance: f64,
    /// Further places at which what is handed out was compared with the answer that it was read from.
    pub compared: usize,
}

impl Audit {
    /// Whether the error is larger than `target` beyond doubt: by three standard errors of its square. A few bright paths of
    /// the referee raise the estimate and its standard error alike, and never come to more than one or two.
    pub fn is_above(&self, target: f64) -> bool {
        let square = |x: f64| x * x;
        let deviation = (square(self.upper) - square(self.error)) / ONE_SIDED_95;
        square(self.error) - CERTAIN * deviation > square(target)
    }
}

/// Referee estimates at a fixed set of points, kept and refined while answers come and go. Judging several answers by
/// the same estimates is fair to each, and costs the referee's paths once.
#[derive(Clone)]
pub struct Auditor<'a> {
    referee: Referee<'a>,
    places: Vec<Place>,
    /// Sums of the two independent estimates of illuminance at each place.
    sums: Vec<[f64; 2]>,
    paths: u32,
    seed: u64,
}

impl<'a> Auditor<'a> {
    /// An auditor of places that are spread evenly by area. Different seeds are independent.
    pub fn new(tracer: &'a Tracer<'a>, places: Vec<Place>, seed: u64) -> Auditor<'a> {
        let sums = vec![[0.0; 2]; places.len()];
        Auditor { referee: Referee::new(tracer), places, sums, paths: 0, seed }
    }

    /// The places, in the order in which answers are expected.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// Paths per estimate so far.
    pub fn paths(&self) -> u32 {
        self.paths
    }

    /// Traces until each estimate has `paths` paths. `step` is told how many places are done and may end it, which
    /// leaves the estimates as they were.
    pub fn trace(&mut self, paths: u32, step: impl Fn(usize) -> bool + Sync) -> bool {
        let more = paths.saturating_sub(self.paths);
        if more == 0 {
            return true;
        }
        let done = std::sync::atomic::AtomicUsize::new(0);
        let (referee, places, first) = (&self.referee, &self.places, self.paths);
        let seed = self.seed;
        let added: Option<Vec<[f64; 2]>> = (0..places.len())
            .into_par_iter()
            .map(|i| {
                let pair = std::array::from_fn(|half| {
                    let seed = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15)
                        ^ (i as u64) << 32
                        ^ u64::from(first) << 1
                        ^ half as u64;
                    f64::from(luminance(referee.irradiance(&places[i], more, seed))) * f64::from(more)
                });
                let so_far = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
                step(so_far).then_some(pair)
            })
            .collect();
        let Some(added) = added else { return false };
        for (sum, added) in self.sums.iter_mut().zip(added) {
            sum[0] += added[0];
            sum[1] += added[1];
        }
        self.paths += more;
        true
    }

    /// Judges an answer `h`: lux per band at each place.
    pub fn judge(&self, h: &[Bands]) -> Audit {
        assert_eq!(self.places.len(), h.len());
        if self.paths == 0 || h.is_empty() {
            return Audit { upper: f64::INFINITY, ..Audit::default() };
        }
        judge(&self.sums, h, None, self.paths)
    }

    /// Judges light `read` from an answer `h` and handed out, both at each place, by what it differs from that answer at
    /// other places as well: `squares` are squared differences in luminance, lx², at places spread evenly by area.
    pub fn judge_read(&self, h: &[Bands], read: &[Bands], squares: &[f64]) -> Audit {
        assert_eq!((self.places.len(), self.places.len()), (h.len(), read.len()));
        if self.paths == 0 || h.is_empty() || squares.len() < FEWEST_POINTS {
            return self.judge(read);
        }
        judge(&self.sums, read, Some((h, squares)), self.paths)
    }
}

fn judge(sums: &[[f64; 2]], m: &[Bands], from: Option<(&[Bands], &[f64])>, paths: u32) -> Audit {
    let n = sums.len() as f64;
    let paths_each = f64::from(paths);
    // Both estimates, the light judged, and what it was read from.
    let places: Vec<[f64; 4]> = (0..sums.len())
        .map(|i| {
            let m_i = f64::from(luminance(m[i]));
            let h_i = from.map_or(m_i, |(h, _)| f64::from(luminance(h[i])));
            [sums[i][0] / paths_each, sums[i][1] / paths_each, m_i, h_i]
        })
        .collect();
    let mean = |f: &dyn Fn(&[f64; 4]) -> f64| places.iter().map(f).sum::<f64>() / n.max(1.0);
    let deviation = |f: &dyn Fn(&[f64; 4]) -> f64, mean: f64| {
        (places.iter().map(|p| (f(p) - mean).powi(2)).sum::<f64>() / (n * (n - 1.0)).max(1.0)).sqrt()
    };
    let product = |[a, b, m, h]: &[f64; 4]| (m - a) * (m - b) - (m - h) * (m - h);
    let square = mean(&|[a, b, ..]| a * b).max(f64::MIN_POSITIVE);
    let squares = from.map_or(&[][..], |(_, squares)| squares);
    let count = squares.len() as f64;
    let apart = squares.iter().sum::<f64>() / count.max(1.0);
    let spread = squares.iter().map(|s| (s - apart).powi(2)).sum::<f64>() / (count * (count - 1.0)).max(1.0);
    let by_referee = mean(&product);
    let squared_error = by_referee + apart;
    let noise = deviation(&product, by_referee).hypot(spread.sqrt());
    let level = mean(&|[a, b, ..]| 0.5 * (a + b));
    let shift = |[a, b, m, _]: &[f64; 4]| m - 0.5 * (a + b);
    let bias = mean(&shift);
    if sums.iter().all(|[a, b]| *a == 0.0 && *b == 0.0) {
        // Where the referee finds no light at all, no light is right and any other answer infinitely wrong.
        let is_dark = places.iter().all(|[_, _, m, _]| *m == 0.0);
        let error = if is_dark { 0.0 } else { f64::INFINITY };
        return Audit { points: sums.len(), paths, error, upper: error, ..Audit::default() };
    }
    let root = |x: f64| (x.max(0.0) / square).sqrt();
    Audit {
        points: sums.len(),
        paths,
        error: root(squared_error),
        // A handful of products says nothing of their spread: no bound is better than a false one.
        upper: if sums.len() < FEWEST_POINTS {
            f64::INFINITY
        } else {
            root(squared_error.max(0.0) + ONE_SIDED_95 * noise)
        },
        lower: if sums.len() < FEWEST_POINTS { 0.0 } else { root(squared_error - ONE_SIDED_95 * noise) },
        bias: bias / level.max(f64::MIN_POSITIVE),
        bias_error: deviation(&shift, bias) / level.max(f64::MIN_POSITIVE),
        mean_illuminance: level,
        compared: squares.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A few bright paths of the referee are no proof that an answer is wrong; that all places say so is.
    #[test]
    fn few_bright_paths_prove_no_error() {
        let audit = |h: f32, bright: usize| {
            let sums: Vec<[f64; 2]> = (0..500).map(|i| if i < bright { [1.6, 1.6] } else { [1.0, 1.0] }).collect();
            judge(&sums, &vec![[h; 3]; 500], None, 1)
        };
        let lucky = audit(1.0, 2);
        assert!(lucky.error > 0.03 && !lucky.is_above(0.01), "{lucky:?}");
        let wrong = audit(1.03, 0);
        assert!((wrong.error - 0.03).abs() < 1e-6 && wrong.is_above(0.01), "{wrong:?}");
    }
}
