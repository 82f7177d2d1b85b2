//! The double-area integral by adaptive cubature (catalogue 17): F = (1/A_i) ∫ F_dA(x) dA_i, where the outer integral is
//! adaptive and the inner one is Lambert's formula for what is seen: the whole, what shadows of polygons leave of it
//! (`shadow.rs`), or what segments find (`segments.rs`) where polygons are not all there is, or are many.
//!
//! The outer rule has seventeen points, of degree 7 with one of degree 5 among them, in the unit squares that
//! quadrilaterals of `from` are mapped to (Genz and Malik 1980, "An adaptive algorithm for numerical integration over an
//! N-dimensional rectangular region"). The region with the largest error is halved along the axis in which the fourth
//! difference is larger, until the sum keeps the tolerance. A region's error is the larger of the difference between its
//! two rules and what it and its twin together differ from the region that they were: far above the truth where F_dA is
//! smooth, and above it at the kinks that shadows make and at corners that touch.

use super::exact::{before, touch};
use super::segments::Segments;
use super::shadow::{cut_where_standing, seen};
use super::smooth::gap;
use super::{Factor, Occlusion, Pair};
use crate::polygon::{point_to_polygon, twice_area};
use glam::DVec3;
use radiosity_scene::Facet;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Share of the tolerance that the inner integral may use up; the outer one has the rest.
const INNER: f64 = 0.25;

/// What rounding leaves of any tolerance.
const ROUNDING: f64 = 1e-14;

/// Adaptive cubature.
#[derive(Clone, Copy, Debug)]
pub struct Cubature {
    /// Largest |value − F| wanted; the error that comes back is no larger unless the budget ran out.
    pub tolerance: f64,
    /// Most evaluations: points of the outer integral, and segments of the inner one. What is known by then comes back
    /// with the error that it has.
    pub budget: usize,
}

impl Default for Cubature {
    /// Four digits after the point, as engineers write factors, and some seconds at most.
    fn default() -> Self {
        Cubature { tolerance: 1e-5, budget: 4_000_000 }
    }
}

impl Pair for Cubature {
    fn factor(&self, from: &Facet, to: &Facet, occlusion: &dyn Occlusion) -> Factor {
        let parts = |f: &Facet, other: &Facet| -> Vec<Vec<DVec3>> {
            let whole = if f.is_convex() {
                vec![f.corners().to_vec()]
            } else {
                f.triangles().into_iter().map(Vec::from).collect()
            };
            let plane = (other.corners()[0], other.normal());
            whole.into_iter().filter_map(|part| before(&part, plane.0, plane.1, touch(f, other))).collect()
        };
        let (of_from, of_to) = (parts(from, to), parts(to, from));
        // The outer integral is over the smaller of what is left before the planes, A_i F_ij being A_j F_ji: seen from
        // there the larger has no peak that points could miss.
        let area = |parts: &[Vec<DVec3>]| parts.iter().map(|part| area(part)).sum::<f64>();
        let is_swapped = area(&of_to) < area(&of_from);
        let (outer, inner, of_outer, of_inner) =
            if is_swapped { (to, from, &of_to, &of_from) } else { (from, to, &of_from, &of_to) };
        let normal = outer.normal();
        let halvings = if gap(from, to) < outer.radius() { NEAR } else { FIRST };
        let domain = Domain { parts: of_outer, normal, unit: from.area(), halvings };
        let tolerance = self.tolerance.max(2.0 * ROUNDING) - ROUNDING;
        if !occlusion.may_block(from, to) {
            let lambert = |x: DVec3| [of_inner.iter().map(|part| point_to_polygon(x, normal, part)).sum(), 0.0];
            return adaptive(&domain, lambert, tolerance, |points| points >= self.budget);
        }
        if let Some(blockers) = occlusion.polygons(from, to) {
            let shadowed = |x: DVec3| [seen(x, normal, of_inner, &blockers), 0.0];
            let parts = cut_where_standing(of_outer, (outer.corners()[0], normal), &blockers);
            let domain = Domain { parts: &parts, ..domain };
            return adaptive(&domain, shadowed, tolerance, |points| points >= self.budget);
        }
        let of_points = INNER * tolerance * (from.area() / area(of_outer)).max(1.0);
        let segments = Segments::new(of_inner, outer, inner, occlusion, of_points);
        let is_spent = |points: usize| points + segments.count() >= self.budget;
        adaptive(&domain, |x| segments.from(x), (1.0 - INNER) * tolerance, is_spent)
    }
}

/// Area of a convex polygon.
fn area(corners: &[DVec3]) -> f64 {
    0.5 * twice_area(corners).length()
}

/// What is integrated over.
struct Domain<'a> {
    /// Convex polygons.
    parts: &'a [Vec<DVec3>],
    normal: DVec3,
    /// The area that integrals are divided by, m².
    unit: f64,
    /// Times that every quadrilateral is halved at first.
    halvings: usize,
}

/// The integral of a function of points that comes with its error.
fn adaptive(
    domain: &Domain,
    f: impl Fn(DVec3) -> [f64; 2],
    tolerance: f64,
    is_spent: impl Fn(usize) -> bool,
) -> Factor {
    let (mut regions, mut points) = (BinaryHeap::<Region>::new(), 0);
    for corners in domain.parts {
        for i in (1..corners.len() - 1).step_by(2) {
            let [p, q, r] = [corners[0], corners[i], corners[i + 1]];
            let s = *corners.get(i + 2).unwrap_or(&p);
            let whole = Region::new([p, q, r, s], [0.0; 2], [1.0; 2], domain, &f);
            let mut parts = vec![whole];
            for level in 0..domain.halvings {
                points += 2 * POINTS * parts.len();
                parts = parts.iter().flat_map(|part| part.halves(level % 2, domain, &f)).collect();
            }
            regions.extend(parts);
        }
    }
    let total = |regions: &BinaryHeap<Region>| {
        regions.iter().fold([0.0; 3], |sum, r| [sum[0] + r.value, sum[1] + r.error, sum[2] + r.inner])
    };
    let mut error = total(&regions)[1];
    while error > tolerance && !is_spent(points) {
        let Some(worst) = regions.pop() else { break };
        error -= worst.error;
        for half in worst.halves(worst.axis, domain, &f) {
            error += half.error;
            regions.push(half);
        }
        points += 2 * POINTS;
        // Differences of many terms forget small ones; before it counts, the sum is taken anew.
        if error <= tolerance {
            error = total(&regions)[1];
        }
    }
    let [value, error, inner] = total(&regions);
    Factor { value, error: error + inner + ROUNDING }
}

/// Times that every quadrilateral is halved at first, for facets apart and for those nearer than they are wide: one region
/// alone is off by chance more than it says, sixteen that know where they come from are not; a corner that comes near
/// makes a peak, which takes more of them to be noticed.
const FIRST: usize = 4;
const NEAR: usize = 6;

/// What differences of rules are multiplied by to be errors: along the line where planes cross inside both facets they
/// are off by less than two.
const SAFETY: f64 = 4.0;

/// Points of the rule.
const POINTS: usize = 17;

/// A rectangle of the unit square that a quadrilateral is mapped to, with the integral over it.
struct Region {
    corners: [DVec3; 4],
    low: [f64; 2],
    high: [f64; 2],
    value: f64,
    error: f64,
    /// Error of the function itself.
    inner: f64,
    /// Axis to halve along.
    axis: usize,
}

impl Region {
    fn new(
        corners: [DVec3; 4],
        low: [f64; 2],
        high: [f64; 2],
        domain: &Domain,
        f: &impl Fn(DVec3) -> [f64; 2],
    ) -> Region {
        let [p, q, r, s] = corners;
        let half = [0, 1].map(|k| 0.5 * (high[k] - low[k]));
        let mut inner: f64 = 0.0;
        // The function times the rate of area at (x, y) of the square [-1, 1]².
        let mut at = |x: f64, y: f64| {
            let (u, v) = (low[0] + half[0] * (1.0 + x), low[1] + half[1] * (1.0 + y));
            let along_u = (1.0 - v) * (q - p) + v * (r - s);
            let along_v = (1.0 - u) * (s - p) + u * (r - q);
            let rate = along_u.cross(along_v).dot(domain.normal) / domain.unit;
            let [value, error] = f(p + u * (q - p) + v * (s - p) + u * v * (r - q - s + p));
            inner = inner.max(error * rate);
            value * rate
        };
        // Abscissas of Genz and Malik, and their weights in two dimensions.
        let [near, far, corner] = [9.0 / 70.0, 9.0 / 10.0, 9.0 / 19.0].map(f64::sqrt);
        let middle = at(0.0, 0.0);
        let near_pairs = [at(near, 0.0) + at(-near, 0.0), at(0.0, near) + at(0.0, -near)];
        let far_pairs = [at(far, 0.0) + at(-far, 0.0), at(0.0, far) + at(0.0, -far)];
        let sum = |at: &mut dyn FnMut(f64, f64) -> f64, z: f64| at(z, z) + at(z, -z) + at(-z, z) + at(-z, -z);
        let (far_corners, corners_sum) = (sum(&mut at, far), sum(&mut at, corner));
        let [nears, fars] = [near_pairs, far_pairs].map(|pairs| pairs[0] + pairs[1]);
        let seventh = (-3816.0 * middle + 2940.0 * nears + 1020.0 * fars + 200.0 * far_corners + 1714.75 * corners_sum)
            / 19_683.0;
        let fifth = (-971.0 * middle + 367.5 * nears + 32.5 * fars + 25.0 * far_corners) / 729.0;
        let fourth = [0, 1].map(|k| (near_pairs[k] - 2.0 * middle - (far_pairs[k] - 2.0 * middle) / 7.0).abs());
        let area = 4.0 * half[0] * half[1];
        Region {
            corners,
            low,
            high,
            value: area * seventh,
            error: SAFETY * area * (seventh - fifth).abs(),
            inner: area * inner,
            axis: if fourth[0] > fourth[1] || (fourth[0] == fourth[1] && half[0] >= half[1]) { 0 } else { 1 },
        }
    }

    fn halves(&self, axis: usize, domain: &Domain, f: &impl Fn(DVec3) -> [f64; 2]) -> [Region; 2] {
        let middle = 0.5 * (self.low[axis] + self.high[axis]);
        let (mut low, mut high) = (self.low, self.high);
        high[axis] = middle;
        low[axis] = middle;
        let mut halves = [
            Region::new(self.corners, self.low, high, domain, f),
            Region::new(self.corners, low, self.high, domain, f),
        ];
        let off = (halves[0].value + halves[1].value - self.value).abs();
        for half in &mut halves {
            half.error = half.error.max(SAFETY * off);
        }
        halves
    }
}

impl PartialEq for Region {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Region {}

impl PartialOrd for Region {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Region {
    fn cmp(&self, other: &Self) -> Ordering {
        self.error.total_cmp(&other.error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pair::Unoccluded;
    use crate::pair::blockers::Blockers;
    use crate::pair::exact::exact;
    use crate::pair::polygons::{ceiling, floor, parallelogram};
    use crate::pair::sampled::Malley;

    /// The tolerance is kept decade by decade, apart, touching, hinged and across planes.
    #[test]
    fn catalogue_17_the_tolerance_is_kept() {
        let others = [
            ceiling(),
            parallelogram([0., 0., 0.], [0., 1., 0.], [0., 0., 1.]),
            parallelogram([0., 0., 0.], [0., 1., 0.], [0.9, 0., 0.1]),
            parallelogram([0.5, -1., -0.5], [0., 3., 0.], [-1., 0.3, 1.]),
            parallelogram([1., 1., 0.], [0.7, 0.2, 0.], [-0.3, 0.4, 1.]),
        ];
        for other in others {
            for (a, b) in [(floor(), other.clone()), (other, floor())] {
                let truth = exact(&a, &b) / a.area();
                for k in 1..11 {
                    let tolerance = 0.1_f64.powi(k);
                    let factor = Cubature { tolerance, ..Cubature::default() }.factor(&a, &b, &Unoccluded);
                    let off = (factor.value - truth).abs();
                    assert!(off <= factor.error && factor.error <= tolerance, "{off:e} {factor:?} {tolerance:e}");
                }
            }
        }
    }

    /// A half-size square midway between unit squares: at the corner three quarters of the free factor, centred less.
    #[test]
    fn catalogue_18_a_square_between_squares() {
        for (low, truth) in [(0.0, 0.149_868_671_8), (0.25, 0.099_506_294_6)] {
            let blocker = Blockers::new([&parallelogram([low, low, 0.5], [0.5, 0., 0.], [0., 0.5, 0.])]);
            for k in 1..6 {
                let tolerance = 0.1_f64.powi(k);
                let factor = Cubature { tolerance, ..Cubature::default() }.factor(&floor(), &ceiling(), &blocker);
                let off = (factor.value - truth).abs();
                assert!(off <= factor.error && factor.error <= tolerance, "{off:e} {factor:?} {tolerance:e}");
                assert!(factor.value <= exact(&floor(), &ceiling()));
            }
        }
    }

    /// Pairs at random, with a square at random between them: tolerances are kept by blockers cut out and by segments.
    #[test]
    fn catalogue_18_shadows_at_random() {
        /// Blockers that keep their polygons to themselves.
        struct Hidden(Blockers);
        impl Occlusion for Hidden {
            fn is_clear(&self, a: DVec3, b: DVec3) -> bool {
                self.0.is_clear(a, b)
            }
        }
        let mut random = radiosity_trace::sampling::Random::new(4);
        let mut next = |low: f64, high: f64| low + (high - low) * random.next_unit();
        let mut partial = 0;
        for k in 0..40 {
            let mut vector = |size: f64| [next(-size, size), next(-size, size), next(-size, size)];
            let to = parallelogram([0.5, 0.5, 1.5], vector(1.0), vector(1.0));
            let blocker = Blockers::new([&parallelogram([0.5, 0.5, 0.7], vector(0.6), vector(0.6))]);
            let free = exact(&floor(), &to);
            let at = |tolerance: f64, occlusion: &dyn Occlusion| {
                let factor = Cubature { tolerance, ..Cubature::default() }.factor(&floor(), &to, occlusion);
                assert!(factor.error <= tolerance, "{factor:?} {tolerance}");
                factor.value
            };
            let truth = at(1e-6, &blocker);
            assert!(truth <= free + 1e-6, "{truth} {free}");
            partial += usize::from(truth > 0.0 && truth < 0.99 * free);
            for tolerance in [1e-2, 1e-3, 1e-4, 1e-5] {
                let off = (at(tolerance, &blocker) - truth).abs();
                assert!(off <= tolerance + 1e-6, "{k}: {off:e} {tolerance:e}");
            }
            if k % 8 == 0 {
                let off = (at(1e-2, &Hidden(blocker)) - truth).abs();
                assert!(off <= 1e-2, "{k}: by segments {off:e}");
            }
        }
        assert!(partial > 8, "{partial}");
    }

    /// Triangles at random between two squares, few and many: as rays find them.
    #[test]
    fn catalogue_18_many_blockers_as_rays_find_them() {
        let mut random = radiosity_trace::sampling::Random::new(6);
        for (count, size, tolerance) in [(12, 0.6, 1e-3), (60, 0.2, 4e-3)] {
            let mut point = || DVec3::new(random.next_unit(), random.next_unit(), random.next_unit());
            let triangles = (0..count).filter_map(|_| {
                let p = 0.6 * point() + 0.2;
                Facet::new(vec![p, p + size * (point() - 0.5), p + size * (point() - 0.5)]).ok()
            });
            let triangles: Vec<Facet> = triangles.collect();
            let blockers = Blockers::new(&triangles);
            assert!(blockers.polygons(&floor(), &ceiling()).is_some_and(|polygons| polygons.len() > count / 2));
            let factor = Cubature { tolerance, ..Cubature::default() }.factor(&floor(), &ceiling(), &blockers);
            let rays = Malley { rays: 1 << 16, seed: 1 }.factor(&floor(), &ceiling(), &blockers);
            let off = (factor.value - rays.value).abs();
            assert!(off <= factor.error + rays.error, "{count}: {factor:?} {rays:?}");
            assert!(factor.error <= tolerance && factor.value > 0.02 && factor.value < 0.19, "{factor:?}");
        }
    }

    /// Pairs of any size and turn, half of them with a corner near the other facet or through its plane.
    #[test]
    fn catalogue_17_the_error_covers_pairs_at_random() {
        let mut random = radiosity_trace::sampling::Random::new(42);
        let mut next = |low: f64, high: f64| low + (high - low) * random.next_unit();
        for k in 0..400 {
            let size = 10f64.powf(next(-1.5, 1.0));
            let gap = if k % 2 == 0 { 10f64.powf(next(-6.0, 0.0)) } else { next(-0.5, 1.5) };
            let mut vector = |size: f64| [next(-size, size), next(-size, size), next(-size, size)];
            let [x, y, _] = vector(1.0);
            let to = parallelogram([x, y, gap], vector(size), vector(size));
            let truth = exact(&floor(), &to);
            for tolerance in [1e-2, 1e-4, 1e-6, 1e-8] {
                let factor = Cubature { tolerance, ..Cubature::default() }.factor(&floor(), &to, &Unoccluded);
                let off = (factor.value - truth).abs();
                assert!(off <= factor.error && factor.error <= tolerance, "{off:e} {factor:?} of {truth}: {to:?}");
            }
        }
    }

    #[test]
    fn an_exhausted_budget_shows_in_the_error() {
        let wall = parallelogram([0., 0., 0.], [0., 1., 0.], [0., 0., 1.]);
        let factor = Cubature { tolerance: 1e-12, budget: 200 }.factor(&floor(), &wall, &Unoccluded);
        let off = (factor.value - exact(&floor(), &wall)).abs();
        assert!(factor.error > 1e-12 && off <= factor.error, "{off:e} {factor:?}");
    }
}
