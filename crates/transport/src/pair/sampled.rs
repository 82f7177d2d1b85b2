//! Stochastic form factors (catalogue 28): rays, pairs of points, and lines.
//!
//! * [`Malley`]: directions with density cos θ/π from points uniform on `from` (Malley 1988, "A shading method for
//!   computer generated images"); F is the share of rays that arrive. A ray counts once, so the standard error is at most
//!   √(F(1 − F)/n), whatever the distance.
//! * [`AreaSamples`]: points uniform on both facets; F is A_j times the mean kernel. Good for facets apart; for touching
//!   ones the variance is infinite, and the error an understatement.
//! * [`GlobalLines`]: uniform lines through the ball around both facets (Sbert 1993, "An integral geometry based method
//!   for fast form-factor computation"): of the lines through a ball of radius R, the share A_i F_ij/(2πR²) runs between
//!   the fronts of i and j. Wasteful for one pair; the same lines would serve all pairs of a scene.
//!
//! Points are Sobol' points with Owen scrambling, in independent replicates: errors fall like n^-5/8 for hits, and like
//! 1/n or faster for the kernel of facets apart. Without bias; the error is three standard
//! errors of the replicates' mean, and for hits no less than three hits in all would make.

use super::area::Places;
use super::blockers::is_inside;
use super::smooth::kernel;
use super::{Factor, Occlusion, Pair};
use glam::DVec3;
use radiosity_scene::Facet;
use radiosity_trace::sampling::{Sequence, cosine_direction, frame};
use std::f64::consts::TAU;

/// Independent replicates: enough for a standard error of 18 %; more would shorten the sequences, which gain by length.
const REPLICATES: u32 = 16;

/// Samples of a default estimate: an error of 0.3 % of all that leaves by random points, several times less by these.
const SAMPLES: u32 = 1 << 14;

/// Chance of 5 % to see nothing of what happens three times in all trials on average.
const UNSEEN: f64 = 3.0;

/// Cosine-distributed rays.
#[derive(Clone, Copy, Debug)]
pub struct Malley {
    /// Rays in all.
    pub rays: u32,
    /// Which points.
    pub seed: u32,
}

/// Pairs of points on both facets.
#[derive(Clone, Copy, Debug)]
pub struct AreaSamples {
    /// Pairs in all.
    pub samples: u32,
    /// Which points.
    pub seed: u32,
}

/// Uniform lines.
#[derive(Clone, Copy, Debug)]
pub struct GlobalLines {
    /// Lines in all.
    pub lines: u32,
    /// Which lines.
    pub seed: u32,
}

impl Default for Malley {
    fn default() -> Self {
        Malley { rays: SAMPLES, seed: 0 }
    }
}

impl Default for AreaSamples {
    fn default() -> Self {
        AreaSamples { samples: SAMPLES, seed: 0 }
    }
}

impl Default for GlobalLines {
    /// Sixteen times as many lines as rays, as most lines miss.
    fn default() -> Self {
        GlobalLines { lines: 16 * SAMPLES, seed: 0 }
    }
}

impl Pair for Malley {
    fn factor(&self, from: &Facet, to: &Facet, occlusion: &dyn Occlusion) -> Factor {
        let (places, frame, traces) = (Places::new(from), frame(from.normal()), occlusion.may_block(from, to));
        let sample = |[x, y, u, v]: [f64; 4]| {
            let point = places.at(x, y);
            let direction = cosine_direction(&frame, u, v);
            let arrives = hit(point, direction, to).is_some_and(|q| !traces || occlusion.is_clear(point, q));
            f64::from(u8::from(arrives))
        };
        mean(self.rays, self.seed, 0, sample).with_unseen(1.0)
    }
}

impl Pair for AreaSamples {
    fn factor(&self, from: &Facet, to: &Facet, occlusion: &dyn Occlusion) -> Factor {
        let (of_from, of_to, traces) = (Places::new(from), Places::new(to), occlusion.may_block(from, to));
        let sample = |[x, y, u, v]: [f64; 4]| {
            let (p, q) = (of_from.at(x, y), of_to.at(u, v));
            let value = to.area() * kernel(p, from.normal(), q, to.normal());
            if value > 0.0 && (!traces || occlusion.is_clear(p, q)) { value } else { 0.0 }
        };
        mean(self.samples, self.seed, 1, sample).factor
    }
}

impl Pair for GlobalLines {
    fn factor(&self, from: &Facet, to: &Facet, occlusion: &dyn Occlusion) -> Factor {
        // The ball about the middle between the facets' balls.
        let apart = to.centroid() - from.centroid();
        let radius = (0.5 * (apart.length() + from.radius() + to.radius())).max(from.radius()).max(to.radius());
        let along = apart.normalize_or_zero();
        let centre = (0.5 * (from.centroid() - from.radius() * along)) + 0.5 * (to.centroid() + to.radius() * along);
        // A centre pulled to one side by unequal facets still holds both.
        let reach = |f: &Facet| f.centroid().distance(centre) + f.radius();
        let radius = radius.max(reach(from)).max(reach(to));
        let traces = occlusion.may_block(from, to);
        let scale = TAU * radius * radius / from.area();
        let sample = |[x, y, u, v]: [f64; 4]| {
            let height = 2.0 * x - 1.0;
            let (sine, cosine) = (TAU * y).sin_cos();
            let across = (1.0 - height * height).max(0.0).sqrt();
            let direction = DVec3::new(across * cosine, across * sine, height);
            let [s, t, _] = frame(direction);
            let (sine, cosine) = (TAU * v).sin_cos();
            let start = centre + radius * u.sqrt() * (cosine * s + sine * t);
            // The line runs both ways; it may leave a front and arrive at the other in one of them only.
            let crossing = |f: &Facet| {
                let slope = direction.dot(f.normal());
                let point = start - f.height(start) / slope * direction;
                (slope != 0.0 && is_inside(f, point)).then_some((point, slope))
            };
            let (Some((p, leaves)), Some((q, arrives))) = (crossing(from), crossing(to)) else { return 0.0 };
            let forward = (q - p).dot(direction);
            let meets = leaves * forward > 0.0 && arrives * forward < 0.0 && (!traces || occlusion.is_clear(p, q));
            f64::from(u8::from(meets)) * scale
        };
        mean(self.lines, self.seed, 2, sample).with_unseen(scale)
    }
}

/// Where a ray meets the front of a facet.
fn hit(point: DVec3, direction: DVec3, to: &Facet) -> Option<DVec3> {
    let (height, slope) = (to.height(point), direction.dot(to.normal()));
    let q = point - height / slope * direction;
    (height > 0.0 && slope < 0.0 && is_inside(to, q)).then_some(q)
}

/// The mean of samples and how many there were.
struct Mean {
    factor: Factor,
    count: f64,
}

impl Mean {
    /// For samples that are nothing or `hit`: few hits make few differences, which is no certainty.
    fn with_unseen(self, hit: f64) -> Factor {
        Factor { error: self.factor.error.max(UNSEEN * hit / self.count), ..self.factor }
    }
}

/// The mean over replicates of scrambled points, and three standard errors.
fn mean(samples: u32, seed: u32, stream: u32, sample: impl Fn([f64; 4]) -> f64) -> Mean {
    let each = samples.div_ceil(REPLICATES).max(1);
    let replicate = |k: u32| {
        let sequence = Sequence::new(seed, stream + 3 * k);
        (0..each).map(|i| sample(sequence.point(i).map(f64::from))).sum::<f64>() / f64::from(each)
    };
    let means: Vec<f64> = (0..REPLICATES).map(replicate).collect();
    let n = f64::from(REPLICATES);
    let value = means.iter().sum::<f64>() / n;
    let variance = means.iter().map(|m| (m - value).powi(2)).sum::<f64>() / (n - 1.0);
    Mean { factor: Factor { value, error: 3.0 * (variance / n).sqrt() }, count: n * f64::from(each) }
}

/// Standard error of `rays` independent rays for a factor.
pub fn standard_error(factor: f64, rays: u32) -> f64 {
    (factor * (1.0 - factor) / f64::from(rays)).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pair::Unoccluded;
    use crate::pair::blockers::Blockers;
    use crate::pair::exact::exact;
    use crate::pair::polygons::{ceiling, floor, parallelogram};

    fn methods(seed: u32, samples: u32) -> [(&'static str, Box<dyn Pair>); 3] {
        [
            ("malley", Box::new(Malley { rays: samples, seed })),
            ("area samples", Box::new(AreaSamples { samples, seed })),
            ("global lines", Box::new(GlobalLines { lines: samples, seed })),
        ]
    }

    /// Over many seeds the mean is the truth, to four standard errors of the seeds' spread (a false alarm in 16,000 for
    /// each method and pair; the seeds are fixed), and the stated errors cover all but a few in a hundred.
    #[test]
    fn catalogue_28_unbiased_with_honest_errors() {
        let wall = parallelogram([0., 0., 0.], [0., 1., 0.], [0., 0., 1.]);
        let tilted = parallelogram([0.3, -2., 0.5], [0.5, 0.1, 0.2], [0.1, 0.8, 1.]);
        let concave = Facet::new(
            [[0., 0.], [0., 2.], [1., 2.], [1., 1.], [2., 1.], [2., 0.]]
                .iter()
                .map(|[x, y]| DVec3::new(*x, *y, 1.0))
                .collect(),
        )
        .unwrap();
        let blocker = Blockers::new([&parallelogram([0.25, 0.25, 0.5], [0.5, 0., 0.], [0., 0.5, 0.])]);
        let free = |to: &Facet| exact(&floor(), to);
        let cases: [(Facet, &dyn Occlusion, f64); 5] = [
            (ceiling(), &Unoccluded, free(&ceiling())),
            (wall.clone(), &Unoccluded, free(&wall)),
            (tilted.clone(), &Unoccluded, free(&tilted)),
            (concave.clone(), &Unoccluded, free(&concave)),
            (ceiling(), &blocker, 0.099_506_294_6),
        ];
        for (to, occlusion, truth) in cases {
            for (name, _) in methods(0, 1) {
                // Touching facets have no variance to speak of with pairs of points.
                if name == "area samples" && to == wall {
                    continue;
                }
                let runs: Vec<Factor> = (0..100)
                    .map(|seed| {
                        let [method] = methods(seed, 1024)
                            .into_iter()
                            .filter(|(n, _)| *n == name)
                            .map(|(_, m)| m)
                            .collect::<Vec<_>>()
                            .try_into()
                            .ok()
                            .unwrap();
                        method.factor(&floor(), &to, occlusion)
                    })
                    .collect();
                let n = runs.len() as f64;
                let mean = runs.iter().map(|f| f.value).sum::<f64>() / n;
                let spread = (runs.iter().map(|f| (f.value - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt();
                assert!((mean - truth).abs() < 4.0 * spread + 1e-6, "{name}: {mean} for {truth} ± {spread}");
                let missed = runs.iter().filter(|f| (f.value - truth).abs() > f.error).count();
                assert!(missed <= 4, "{name}: {missed}");
            }
        }
    }

    /// The spread over seeds falls faster than that of independent samples: for rays, which hit or miss across a surface
    /// in four dimensions, like n^-5/8 (sixteen replicates of few rays gain little, of many more); for the smooth kernel
    /// far faster.
    #[test]
    fn catalogue_28_points_converge_faster_than_random_ones() {
        let truth = exact(&floor(), &ceiling());
        let spread = |method: &dyn Fn(u32) -> Factor| {
            ((0..60).map(|seed| (method(seed).value - truth).powi(2)).sum::<f64>() / 60.0).sqrt()
        };
        let rays = |rays: u32| spread(&|seed| Malley { rays, seed }.factor(&floor(), &ceiling(), &Unoccluded));
        let pairs =
            |samples: u32| spread(&|seed| AreaSamples { samples, seed }.factor(&floor(), &ceiling(), &Unoccluded));
        let slope = |few: f64, many: f64| (many / few).ln() / 64f64.ln();
        let (few, many) = (rays(1 << 8), rays(1 << 14));
        assert!(few < 1.2 * standard_error(truth, 1 << 8) && many < 0.6 * standard_error(truth, 1 << 14));
        assert!(slope(few, many) < -0.6, "{}", slope(few, many));
        let (few, many) = (pairs(1 << 8), pairs(1 << 14));
        assert!(slope(few, many) <= -0.75, "{}", slope(few, many));
    }

    #[test]
    fn nothing_seen_is_no_certainty() {
        let speck = parallelogram([0.5, 0.5, 50.], [0., 1e-3, 0.], [1e-3, 0., 0.]);
        let factor = Malley::default().factor(&floor(), &speck, &Unoccluded);
        assert!(factor.value == 0.0 && factor.error >= exact(&floor(), &speck), "{factor:?}");
        assert_eq!(Malley::default().factor(&floor(), &ceiling().flipped(), &Unoccluded).value, 0.0);
    }
}
