//! The audit: how wrong is an answer, everything included?
//!
//! At K points, spread by area, the referee makes two independent unbiased estimates a and b of the irradiance E. For
//! an answer h, (h − a)(h − b) has the expectation (h − E)²: its mean is an unbiased estimate of the squared error of
//! everything — mesh, rows, solver, interpolation, leaks — and a·b is one of E². The cost does not depend on the size
//! of the scene. Its resolution is about σ/K^¼, σ being the referee's own relative noise.
//!
//! Where points are few, each is looked at more often: of n estimates, all pairs are multiplied, ((Σd)² − Σd²)/(n(n − 1)) with
//! d = h − a, which is what one product is for two (a U-statistic: Hoeffding 1948). Its variance is 2s⁴/(n(n − 1)) + 4μ²s²/n at each point, s² being the variance of an
//! estimate and μ the error; n/2 separate pairs of them would have n − 1 times as much of the first. The bound is then about these points, not about those that they might stand for.
//!
//! Where light m is handed out that was read from an answer h, (m − a)(m − b) = (m − h)² + (m − h)(2h − a − b) + (h − a)(h − b), and
//! the first part needs no referee: its mean is taken over many more places. That is where edges of shadows are, which
//! hold most of the error on a hundredth of the area, so that K points alone bound it badly. So it is with E², which is ab − h² + h²: half of it may be on a band
//! beside a lamp that K points miss.

use crate::Referee;
use radiosity_scene::{Bands, luminance};
use radiosity_trace::{Place, Tracer};
use rayon::prelude::*;
use serde::Serialize;

/// Standard errors of the one-sided 95 % bound. The normal quantile, 1.645, held in 90 of 96 runs in hard rooms (bench `hard`): few
/// bright paths are in the spread only when they are in the mean, too, and audits end as soon as the bound meets what was asked.
const ONE_SIDED_95: f64 = 2.0;

/// Standard errors beyond which an answer is wrong for certain.
const CERTAIN: f64 = 3.0;

/// How many times the paths of an audit grow at least and at most, and how many more than it seems to need it gets: with less, it would often have to look
/// again, and each look is a chance to be wrong.
const LEAST_GROWTH: f64 = 1.5;
const MOST_GROWTH: f64 = 2.0;
const TO_SPARE: f64 = 1.1;

/// Least part of the variance of the squared error that is of paths for more of them to be worth their while: where it is all gone, what the bound has above
/// the estimate is a twentieth less.
const WORTH: f64 = 0.1;

/// Fewest and most paths of a place, relative to `paths`, as powers of two: a sixteenth of the mean light and less, 256 times as much and more. Without a
/// most, the few places beside a lamp would take all the time.
const DOUBLINGS: [i32; 2] = [-2, 4];

/// Fewer pairs of estimates than this give no bound: the spread of heavy-tailed products cannot be told from a handful.
pub const FEWEST_PAIRS: usize = 30;

/// What the audit found.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Audit {
    /// Points examined.
    pub points: usize,
    /// Paths per estimate where light is as bright as on average; two estimates per point, more where points are few.
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
    /// Part of the variance of the squared error that is of paths, and falls with more of them; the rest is of which places there are.
    pub of_paths: f64,
    /// Mean illuminance at the points by the referee, lux.
    pub mean_illuminance: f64,
    /// Further places at which what is handed out was compared with the answer that it was read from.
    pub compared: usize,
    /// What is said of dim places alone, which hardly count in the error of all; none where they are few.
    pub dim: Option<Dim>,
}

/// What an audit says of places that were answered to have less than a tenth of the root mean square light. What is dim and was answered bright is not among them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Dim {
    /// Illuminance below which they are, lux.
    pub below: f64,
    /// Part of all places that they are.
    pub share: f64,
    /// Estimated relative L2 error of irradiance there, relative to what is there; infinite where paths tell nothing.
    pub error: f64,
    /// One-sided 95 % bound of that from above.
    pub upper: f64,
    /// One-sided 95 % bound of that from below.
    pub lower: f64,
}

/// How many times less light than the root mean square makes places dim: together they are a hundredth of the squared norm at most. With a hundred times, rooms behind windows
/// count as bright.
const DIM: f64 = 10.0;

/// Part of all places that dim ones are at least where they are told of: fifty of a thousand, of which two estimates each say something.
const FEWEST_DIM: f64 = 0.05;

impl Audit {
    /// Whether the error is larger than `target` beyond doubt: by three standard errors of its square. A few bright paths of
    /// the referee raise the estimate and its standard error alike, and never come to more than one or two.
    pub fn is_above(&self, target: f64) -> bool {
        let square = |x: f64| x * x;
        let deviation = (square(self.upper) - square(self.error)) / ONE_SIDED_95;
        square(self.error) - CERTAIN * deviation > square(target)
    }

    /// Whether more paths would make it surer; if not, other places may.
    pub fn is_of_paths(&self) -> bool {
        self.of_paths >= WORTH
    }

    /// Whether paths leave open whether an answer meets the `target`, and would of any: their noise alone comes to more.
    pub fn is_left_open(&self, target: f64) -> bool {
        let square = |x: f64| x * x;
        let noise = (square(self.upper) - square(self.error)) * self.of_paths.max(0.0).sqrt();
        self.upper.is_finite() && self.lower <= target && noise > square(target)
    }

    /// How many times the paths are to be there to bring the bound to `target`, if the error's estimate stays where it is: what the paths
    /// have to do with the noise of its square falls with their number.
    pub fn growth(&self, target: f64) -> f64 {
        let square = |x: f64| x * x;
        let (noise, room) = (square(self.upper) - square(self.error), square(target) - square(self.error));
        if room > 0.0 { (TO_SPARE * noise / room).clamp(LEAST_GROWTH, MOST_GROWTH) } else { MOST_GROWTH }
    }
}

/// Referee estimates at a fixed set of points, kept and refined while answers come and go. Judging several answers by
/// the same estimates is fair to each, and costs the referee's paths once.
#[derive(Clone)]
pub struct Auditor<'a> {
    referee: Referee<'a>,
    places: Vec<Place>,
    /// By how many powers of two more paths than `paths` go to each place.
    doublings: Vec<i32>,
    /// How many independent estimates there are of each place.
    looks: usize,
    /// Those of illuminance, lx, `looks` of each place.
    estimates: Vec<f64>,
    paths: u32,
    seed: u64,
}

impl<'a> Auditor<'a> {
    /// An auditor of places that are spread evenly by area. `light` is the irradiance expected at each, 0 where nothing is known.
    /// Bright places get more paths: the variance of (h − a)(h − b) is about σ⁴/n², σ being the noise of one of n paths, and is
    /// least, over all places, with n ∝ σ^(4/3); and σ goes with light to the power 0.42 in a furnished office, 0.21 in the Cornell
    /// box. By the root of light it takes 0.86 and 1.01 times the paths that it takes with as many everywhere; by its power 4/3, 1.31 and 1.49 times.
    /// Whatever is expected, estimates are unbiased. Different seeds are independent.
    pub fn new(tracer: &'a Tracer<'a>, places: Vec<Place>, light: &[Bands], seed: u64) -> Auditor<'a> {
        Auditor::closer(tracer, places, light, 2, seed)
    }

    /// The same with so many estimates at each place, two or more; with more, what is judged is the light at these places alone.
    pub fn closer(tracer: &'a Tracer<'a>, places: Vec<Place>, light: &[Bands], looks: usize, seed: u64) -> Auditor<'a> {
        assert!(looks >= 2);
        assert_eq!(places.len(), light.len());
        let light: Vec<f64> = light.iter().map(|&e| f64::from(luminance(e))).collect();
        let known = light.iter().filter(|e| **e > 0.0).count();
        let mean = light.iter().sum::<f64>() / known.max(1) as f64;
        let [least, most] = DOUBLINGS.map(f64::from);
        let doublings = |e: &f64| match *e > 0.0 {
            true => (0.5 * (e / mean).log2()).round().clamp(least, most) as i32,
            false => 0,
        };
        let estimates = vec![0.0; looks * places.len()];
        let doublings = light.iter().map(doublings).collect();
        Auditor { referee: Referee::new(tracer), places, doublings, looks, estimates, paths: 0, seed }
    }

    /// The places, in the order in which answers are expected.
    pub fn places(&self) -> &[Place] {
        &self.places
    }

    /// Paths per estimate so far.
    pub fn paths(&self) -> u32 {
        self.paths
    }

    /// How many estimates there are, over all places.
    pub fn estimates(&self) -> usize {
        self.estimates.len()
    }

    /// Traces until each estimate has `paths` paths, or as many times more or less as its place gets. `step` is told how many
    /// estimates are done and may end it, which leaves them as they were.
    pub fn trace(&mut self, paths: u32, step: &(dyn Fn(usize) -> bool + Sync)) -> bool {
        if paths <= self.paths {
            return true;
        }
        let done = std::sync::atomic::AtomicUsize::new(0);
        let (this, first, seed) = (&*self, self.paths, self.seed);
        let refined: Option<Vec<f64>> = (0..this.estimates.len())
            .into_par_iter()
            .map(|k| {
                let (place, look) = (k / this.looks, k % this.looks);
                let [had, has] = [first, paths].map(|paths| this.paths_at(place, paths));
                let seed = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15)
                    ^ (place as u64) << 32
                    ^ (u64::from(first) * this.looks as u64 + look as u64);
                let added = f64::from(luminance(this.referee.irradiance(&this.places[place], has - had, seed)));
                let share = f64::from(had) / f64::from(has);
                let so_far = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
                step(so_far).then_some(share * this.estimates[k] + (1.0 - share) * added)
            })
            .collect();
        let Some(refined) = refined else { return false };
        self.estimates = refined;
        self.paths = paths;
        true
    }

    /// Paths of each estimate at a place when those of an average one has `paths`: none, or at least one.
    fn paths_at(&self, place: usize, paths: u32) -> u32 {
        let wanted = f64::from(paths) * 2f64.powi(self.doublings[place]);
        wanted.ceil().min(f64::from(u32::MAX)) as u32
    }

    /// Judges an answer `h`: lux per band at each place.
    pub fn judge(&self, h: &[Bands]) -> Audit {
        assert_eq!(self.places.len(), h.len());
        if self.paths == 0 || h.is_empty() {
            return Audit { upper: f64::INFINITY, ..Audit::default() };
        }
        judge_with_dim((&self.estimates, self.looks), h, None, self.paths)
    }

    /// Judges light `read` from an answer `h` and handed out, both at each place, by what it differs from that answer at
    /// other places as well: `squares` are squared differences in luminance, and the squared luminance of the answer, lx², at places spread evenly by area.
    pub fn judge_read(&self, h: &[Bands], read: &[Bands], squares: &[[f64; 2]]) -> Audit {
        assert_eq!((self.places.len(), self.places.len()), (h.len(), read.len()));
        if self.paths == 0 || h.is_empty() || squares.len() < FEWEST_PAIRS {
            return self.judge(read);
        }
        judge_with_dim((&self.estimates, self.looks), read, Some((h, squares)), self.paths)
    }
}

/// Mean of the products of all pairs of different numbers, an unbiased estimate of the square of what they are estimates of; two or more.
fn mean_product(x: impl Iterator<Item = f64> + Clone) -> f64 {
    let n = x.clone().count() as f64;
    let [sum, squares] = x.fold([0.0; 2], |[sum, squares], x| [sum + x, squares + x * x]);
    (sum * sum - squares) / (n * (n - 1.0))
}

/// What estimates say of a place.
struct Judged {
    /// Of the square of the light, less the part that needs no referee.
    square: f64,
    /// Of the squared error, less the part that needs no referee.
    error: f64,
    /// The variance of that by the estimates, if there were no error.
    noise: f64,
    /// Of the light itself.
    level: f64,
    /// Of the error, and its variance.
    shift: [f64; 2],
}

impl Judged {
    /// By estimates of a place where light `m` is handed out, maybe read from `h`.
    fn new(estimates: &[f64], m: f64, h: Option<f64>) -> Judged {
        let n = estimates.len() as f64;
        let level = estimates.iter().sum::<f64>() / n;
        let spread = estimates.iter().map(|a| (a - level).powi(2)).sum::<f64>() / (n - 1.0);
        Judged {
            square: mean_product(estimates.iter().copied()) - h.map_or(0.0, |h| h * h),
            error: mean_product(estimates.iter().map(|a| m - a)) - h.map_or(0.0, |h| (m - h).powi(2)),
            noise: 2.0 * spread * spread / (n * (n - 1.0)),
            level,
            shift: [m - level, spread / n],
        }
    }
}

/// Variance of an estimate of a squared error x: so much, and so much for each unit of x.
#[derive(Clone, Copy)]
struct Noise {
    fixed: f64,
    growing: f64,
}

impl Noise {
    fn at(&self, square: f64) -> f64 {
        (self.fixed + self.growing * square.max(0.0)).sqrt()
    }

    /// The x that is so far above its estimate, in standard errors of an estimate of x itself (Wilson 1927): where there may be no error at all, what is
    /// estimated says least of how far off it is.
    fn bound(&self, estimate: f64) -> f64 {
        let (estimate, half) = (estimate.max(0.0), 0.5 * ONE_SIDED_95.powi(2) * self.growing);
        estimate + half + half.hypot(ONE_SIDED_95 * self.at(estimate))
    }
}

/// Judges all places, and those alone that are dim by what was answered, which is independent of what it is judged by.
fn judge_with_dim(estimates: (&[f64], usize), m: &[Bands], from: Option<(&[Bands], &[[f64; 2]])>, paths: u32) -> Audit {
    Audit { dim: judge_dim(estimates, m, from, paths), ..judge(estimates, m, from, paths) }
}

/// Judges dim places, unless they are few or black.
fn judge_dim(
    (estimates, looks): (&[f64], usize),
    m: &[Bands],
    from: Option<(&[Bands], &[[f64; 2]])>,
    paths: u32,
) -> Option<Dim> {
    let answered = from.map_or(m, |(h, _)| h);
    let light: Vec<f64> = answered.iter().map(|h| f64::from(luminance(*h))).collect();
    let mean_of = |squares: &mut dyn Iterator<Item = f64>, count: usize| squares.sum::<f64>() / count.max(1) as f64;
    let square = match from {
        Some((_, squares)) if !squares.is_empty() => mean_of(&mut squares.iter().map(|s| s[1]), squares.len()),
        _ => mean_of(&mut light.iter().map(|h| h * h), light.len()),
    };
    let below = square.sqrt() / DIM;
    let dim: Vec<usize> = (0..light.len()).filter(|i| light[*i] < below).collect();
    let share = dim.len() as f64 / light.len() as f64;
    let own: Vec<f64> = dim.iter().flat_map(|i| &estimates[looks * i..looks * (i + 1)]).copied().collect();
    let is_black = own.iter().all(|a| *a == 0.0) && dim.iter().all(|i| luminance(m[*i]) == 0.0);
    if share < FEWEST_DIM || own.len() < 2 * FEWEST_PAIRS || is_black {
        return None;
    }
    let untold = Dim { below, share, error: f64::INFINITY, upper: f64::INFINITY, lower: 0.0 };
    let Some(least) = least_norm(&own, looks) else { return Some(untold) };
    let at = |of: &[Bands]| dim.iter().map(|i| of[*i]).collect::<Vec<Bands>>();
    let (m, h) = (at(m), at(answered));
    let squares: Vec<[f64; 2]> =
        from.map_or(Vec::new(), |(_, all)| all.iter().filter(|s| s[1] < below * below).copied().collect());
    // A handful says nothing, as of all places.
    let from = (squares.len() >= FEWEST_PAIRS).then_some((&h[..], &squares[..]));
    let Audit { error, upper, lower, .. } = judge((&own, looks), &m, from, paths);
    Some(Dim { error, upper: upper / least, lower: lower * least, ..untold })
}

/// How little light there may be beside what estimates say of all the places together, that is, by what an error relative to it is divided at least; none where they do not tell.
fn least_norm(estimates: &[f64], looks: usize) -> Option<f64> {
    let squares: Vec<f64> = estimates.chunks_exact(looks).map(|own| mean_product(own.iter().copied())).collect();
    let n = squares.len() as f64;
    let mean = squares.iter().sum::<f64>() / n;
    let variance = squares.iter().map(|square| (square - mean).powi(2)).sum::<f64>() / (n * (n - 1.0)).max(1.0);
    let deviation = variance.sqrt();
    (mean > CERTAIN * deviation).then(|| (1.0 - ONE_SIDED_95 * deviation / mean).sqrt())
}

/// Judges by so many estimates of each place: two, by what they scatter over places, or more, by what they scatter at each.
fn judge((estimates, looks): (&[f64], usize), m: &[Bands], from: Option<(&[Bands], &[[f64; 2]])>, paths: u32) -> Audit {
    let points = m.len();
    let places: Vec<Judged> = estimates
        .chunks_exact(looks)
        .enumerate()
        .map(|(i, estimates)| {
            let m_i = f64::from(luminance(m[i]));
            Judged::new(estimates, m_i, from.map(|(h, _)| f64::from(luminance(h[i]))))
        })
        .collect();
    if estimates.iter().all(|a| *a == 0.0) {
        // Where the referee finds no light at all, no light is right and any other answer infinitely wrong.
        let is_dark = m.iter().all(|m| luminance(*m) == 0.0);
        let error = if is_dark { 0.0 } else { f64::INFINITY };
        return Audit { points, paths, error, upper: error, of_paths: 1.0, ..Audit::default() };
    }
    if m.iter().flatten().any(|e| !e.is_finite()) {
        return Audit { points, paths, error: f64::INFINITY, upper: f64::INFINITY, ..Audit::default() };
    }
    let n = points as f64;
    let mean = |f: &dyn Fn(&Judged) -> f64| places.iter().map(f).sum::<f64>() / n.max(1.0);
    let over_places = |f: &dyn Fn(&Judged) -> f64| {
        let mean = mean(f);
        places.iter().map(|p| (f(p) - mean).powi(2)).sum::<f64>() / (n * (n - 1.0)).max(1.0)
    };
    let (mut noise, shifted) = if looks == 2 {
        (Noise { fixed: over_places(&|p| p.error), growing: 0.0 }, over_places(&|p| p.shift[0]))
    } else {
        // As much as if all of the error were at the place that is known worst.
        let growing = 4.0 * places.iter().map(|p| p.shift[1]).fold(0.0, f64::max) / n;
        (Noise { fixed: mean(&|p| p.noise) / n, growing }, mean(&|p| p.shift[1]) / n)
    };
    // The mean of this product is 2 μ² σ² + σ⁴, of an error μ and noise σ of either estimate that is normal: the variance of the product of the two.
    let of_pair = |p: &Judged| 4.0 * p.shift[1] * p.shift[0].powi(2);
    let of_places = if looks == 2 { (noise.fixed - mean(&of_pair) / n).max(0.0) } else { 0.0 };
    let squares = from.map_or(&[][..], |(_, squares)| squares);
    let count = squares.len() as f64;
    let [apart, known] = [0, 1].map(|k| squares.iter().map(|s| s[k]).sum::<f64>() / count.max(1.0));
    let spread = squares.iter().map(|s| (s[0] - apart).powi(2)).sum::<f64>() / (count * (count - 1.0)).max(1.0);
    let square = (mean(&|p| p.square) + known).max(f64::MIN_POSITIVE);
    let squared_error = mean(&|p| p.error) + apart;
    noise.fixed += spread;
    let level = mean(&|p| p.level).max(f64::MIN_POSITIVE);
    let root = |x: f64| (x.max(0.0) / square).sqrt();
    let of_paths = 1.0 - (of_places + spread) / noise.at(squared_error).powi(2).max(f64::MIN_POSITIVE);
    // A handful of products says nothing of their spread: no bound is better than a false one.
    let is_handful = estimates.len() < 2 * FEWEST_PAIRS;
    Audit {
        points,
        paths,
        error: root(squared_error),
        upper: if is_handful { f64::INFINITY } else { root(noise.bound(squared_error)) },
        lower: if is_handful { 0.0 } else { root(squared_error - ONE_SIDED_95 * noise.at(squared_error)) },
        bias: mean(&|p| p.shift[0]) / level,
        bias_error: shifted.sqrt() / level,
        of_paths,
        mean_illuminance: level,
        compared: squares.len(),
        dim: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use radiosity_scene::{Material, Mesh, Scene};
    use radiosity_trace::sampling::Random;

    /// Of dim places it is told how far off they are in their own light, which says next to nothing of all; nothing where they are few or black, and no
    /// number where paths tell none.
    #[test]
    fn dim_places_are_judged_by_themselves() {
        let dim = |share: f64, light: [f64; 2], estimates: [f64; 2]| {
            let is_dim = |k: usize| (k as f64) < share * 1000.0;
            let m: Vec<Bands> = (0..1000).map(|k| [light[usize::from(!is_dim(k))] as f32; 3]).collect();
            let estimates: Vec<f64> =
                (0..2000).map(|k| if is_dim(k / 2) { estimates[k % 2] } else { 1000.0 }).collect();
            judge_with_dim((&estimates, 2), &m, None, 1)
        };
        let audit = dim(0.4, [1.1, 1000.0], [1.0, 1.0]);
        assert!(audit.upper < 2e-4, "{audit:?}");
        let told = audit.dim.unwrap();
        assert!((told.error - 0.1).abs() < 1e-6 && (told.share - 0.4).abs() < 1e-9 && told.upper >= told.error);
        assert!((told.below - 100.0 * 0.6f64.sqrt()).abs() < 0.01, "{told:?}");
        assert_eq!(dim(0.4, [1.1, 1000.0], [0.0, 9.0]).dim.map(|dim| dim.upper), Some(f64::INFINITY));
        // However wrong it is, if paths are sure.
        assert!((dim(0.4, [3.0, 1000.0], [1.0; 2]).dim.unwrap().error - 2.0).abs() < 1e-6);
        for audit in
            [dim(0.02, [1.1, 1000.0], [1.0; 2]), dim(0.4, [0.0, 1000.0], [0.0; 2]), dim(0.4, [200.0, 1e3], [200.; 2])]
        {
            assert_eq!(audit.dim, None);
        }
        // Light read back differs from the answer in dim places at further places, too.
        let h: Vec<Bands> = (0..1000).map(|k| [if k < 400 { 1.0 } else { 1000.0 }; 3]).collect();
        let estimates: Vec<f64> = h.iter().flat_map(|h| [f64::from(h[0]); 2]).collect();
        let squares: Vec<[f64; 2]> = (0..500).map(|k| if k < 200 { [0.04, 1.0] } else { [0.0, 1e6] }).collect();
        let told = judge_with_dim((&estimates, 2), &h, Some((&h, &squares)), 1).dim.unwrap();
        assert!((told.error - 0.2).abs() < 1e-6, "{told:?}");
        assert!((told.below - 0.1 * 6e5f64.sqrt()).abs() < 0.1, "by further places: {told:?}");
        // None of them dim: what is known of these places alone is told.
        let told = judge_with_dim((&estimates, 2), &h, Some((&h, &[[0.0, 1e6]; 500])), 1).dim.unwrap();
        assert!((told.share - 0.4).abs() < 1e-9 && told.error < 1e-6, "{told:?}");
    }

    /// Where one path in twenty finds light, what is told of dim places holds all the same, however wrong the answer is: in 95 % of cases less three standard errors of what is counted.
    #[test]
    fn bounds_of_dim_places_hold() {
        let mut random = Random::new(3);
        for off in [0.0, 0.1, 0.3, 1.0] {
            let (mut told, mut held) = (0, 0);
            for _ in 0..400 {
                let mut mean = || (0..100).filter(|_| random.next_unit() < 0.05).count() as f64 / 5.0;
                let estimates: Vec<f64> = (0..600).map(|k| if k < 300 { mean() } else { 1000.0 }).collect();
                let m: Vec<Bands> = (0..300).map(|k| [if k < 150 { 1.0 + off as f32 } else { 1000.0 }; 3]).collect();
                let dim = judge_with_dim((&estimates, 2), &m, None, 1).dim.unwrap();
                told += usize::from(dim.upper.is_finite());
                held += usize::from(dim.upper >= off);
            }
            assert!(told > 380 && held >= 367, "{off}: {held} of {told} told");
        }
    }

    /// A few bright paths of the referee are no proof that an answer is wrong; that all places say so is.
    #[test]
    fn few_bright_paths_prove_no_error() {
        let audit = |h: f32, bright: usize| {
            let estimates: Vec<f64> = (0..1000).map(|k| if k < 2 * bright { 1.6 } else { 1.0 }).collect();
            judge((&estimates, 2), &[[h; 3]; 500], None, 1)
        };
        let lucky = audit(1.0, 2);
        assert!(lucky.error > 0.03 && !lucky.is_above(0.01), "{lucky:?}");
        let wrong = audit(1.03, 0);
        assert!((wrong.error - 0.03).abs() < 1e-6 && wrong.is_above(0.01), "{wrong:?}");
    }

    /// An answer that is no number at one place is infinitely wrong; it was 0 % off.
    #[test]
    fn what_is_no_number_is_wrong() {
        for e in [f32::NAN, f32::INFINITY] {
            let light: Vec<Bands> = (0..500).map(|k| [if k == 7 { e } else { 1.0 }; 3]).collect();
            let audit = judge((&[1.0; 1000], 2), &light, None, 1);
            assert!(audit.error.is_infinite() && audit.upper.is_infinite(), "{audit:?}");
        }
    }

    /// Of few points that are looked at often the bound is above the error in 95 % of cases at least, however large that is and wherever: less three
    /// standard errors of what is counted, 0.5 % each.
    #[test]
    fn bounds_of_few_points_hold() {
        let mut random = Random::new(7);
        let mut normal = || (0..12).map(|_| random.next_unit()).sum::<f64>() - 6.0;
        const NOISE: f64 = 0.3;
        for (points, looks) in [(1usize, 128usize), (4, 32), (20, 8), (50, 4)] {
            for (share, is_one) in [0.0, 1.0, 1.7, 2.5, 3.5, 8.0].into_iter().flat_map(|d| [(d, false), (d, true)]) {
                // In standard errors of the mean of all estimates of a place; at one of them, or at all.
                let off = share * NOISE / (looks as f64).sqrt();
                let m: Vec<Bands> =
                    (0..points).map(|k| [1.0 + if is_one && k > 0 { 0.0 } else { off as f32 }; 3]).collect();
                let error = if is_one { off / (points as f64).sqrt() } else { off };
                let holds = |_: &u32| {
                    let estimates: Vec<f64> = (0..points * looks).map(|_| 1.0 + NOISE * normal()).collect();
                    judge((&estimates, looks), &m, None, 1).upper >= error
                };
                let held = (0..2000u32).filter(holds).count();
                assert!(held >= 1870, "{points} points, {share} off, at one: {is_one}: {held} of 2,000");
            }
        }
    }

    /// Where both estimates of a place say that it alone is wrong, other places tell more than paths; where they differ, paths do, and what more places say
    /// of light read back is of places.
    #[test]
    fn noise_is_of_paths_or_of_places() {
        let audit = |alone: [f64; 2], noise: f64, squares: &[[f64; 2]]| {
            let mut estimates: Vec<f64> =
                (0..1000).map(|k| 1.0 + if k % 3 == 0 { noise } else { -0.5 * noise }).collect();
            estimates[..2].copy_from_slice(&alone);
            let m = [[1.0; 3]; 500];
            judge((&estimates, 2), &m, Some((&m, squares)), 1)
        };
        assert!(!audit([3.0, 3.01], 0.01, &[]).is_of_paths());
        assert!(audit([1.0, 1.0], 0.1, &[]).is_of_paths() && audit([3.0, 0.5], 0.01, &[]).is_of_paths());
        // All are off by as much: of that paths alone make noise.
        let shifted: Vec<f64> =
            (0..1000).map(|k: u32| 1.1 + 0.01 * f64::from(k.wrapping_mul(2_654_435_769) >> 16) / 65_536.0).collect();
        assert!(judge((&shifted, 2), &[[1.0; 3]; 500], None, 1).is_of_paths());
        let few_are_off: Vec<[f64; 2]> = (0..100).map(|k| [if k < 2 { 1.0 } else { 0.0 }, 1.0]).collect();
        assert!(!audit([1.0, 1.0], 0.1, &few_are_off).is_of_paths());
    }

    /// What paths leave open is neither known to be worse, nor open by the places alone.
    #[test]
    fn noise_of_paths_leaves_answers_open() {
        let open = |lower: f64, upper: f64, of_paths: f64| {
            Audit { error: 0.01, lower, upper, of_paths, ..Audit::default() }.is_left_open(0.02)
        };
        assert!(open(0.0, 0.05, 1.0) && open(0.0, 0.05, 0.2));
        assert!(
            !open(0.03, 0.05, 1.0)
                && !open(0.0, 0.05, 0.01)
                && !open(0.0, 0.021, 1.0)
                && !open(0.0, f64::INFINITY, 1.0)
        );
    }

    /// As many more paths as bring the bound to the target by what is known, half as many at least, and twice as many where nothing would.
    #[test]
    fn paths_grow_as_the_bound_asks() {
        let growth = |error: f64, upper: f64| Audit { error, upper, ..Audit::default() }.growth(0.01);
        assert!((growth(0.008, 0.011) - 1.1 * 0.57 / 0.36).abs() < 1e-9, "{}", growth(0.008, 0.011));
        assert_eq!([growth(0.005, 0.0101), growth(0.009, 0.03), growth(0.011, 0.02)], [1.5, 2.0, 2.0]);
        assert_eq!([growth(0.005, f64::INFINITY), growth(f64::INFINITY, f64::INFINITY)], [2.0, 2.0]);
    }

    /// Bright places get more paths and dark ones fewer; whatever is expected, estimates have the same mean.
    #[test]
    fn what_is_expected_moves_paths_and_no_estimate() {
        let lamp = Material { emissive: [100.0; 3], base_color: [0.0, 0.0, 0.0, 1.0], ..Material::default() };
        let mut scene = Scene { materials: vec![Material::default(), lamp], ..Scene::default() };
        let square = |half: f64, y: f64| {
            [[-1., -1.], [-1., 1.], [1., 1.], [1., -1.]].map(|[x, z]| DVec3::new(half * x, y, half * z))
        };
        scene.add_quad("floor", 0, square(3.0, 0.0));
        let [a, b, c, d] = square(0.5, 1.0);
        scene.add_quad("lamp", 1, [d, c, b, a]);
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let at = |k: u32| {
            let point = DVec3::new(0.05 * f64::from(k), 0.0, 0.1);
            Place { point, normal: DVec3::Y, triangle: u32::MAX }
        };
        let places: Vec<Place> = (0..40).map(at).collect();
        let light: Vec<Bands> = (0..40).map(|k| [if k < 10 { 100.0 } else { 5.0 }; 3]).collect();
        let mut reversed = light.clone();
        reversed.reverse();
        let levels = [light, reversed].map(|light| {
            let mut auditor = Auditor::new(&tracer, places.clone(), &light, 3);
            let paths = |a: &Auditor, k: usize| a.paths_at(k, 256);
            let (bright, dark) = if light[0][0] > 50.0 { (0, 39) } else { (39, 0) };
            assert_eq!((paths(&auditor, bright), paths(&auditor, dark)), (256 << 1, 256 >> 1));
            assert!(auditor.trace(64, &|_| true) && auditor.trace(4096, &|_| true));
            auditor.judge(&vec![[1.0; 3]; 40]).mean_illuminance
        });
        assert!((levels[0] / levels[1] - 1.0).abs() < 0.005, "{levels:?}");
    }
}
