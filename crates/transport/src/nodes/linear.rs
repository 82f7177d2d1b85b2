//! Linear form factors: what a differential area receives of each of the three hats of a triangle,
//! F_k = ∫ N_k(y) cos θ cos θ' V/(π r²) dA.
//!
//! Lambert's formula gives their sum exactly, over the triangle and over any part of it, and a linear function needs no
//! more than its mean: F_k = Σ_parts F_part N_k(ȳ_part) with ȳ the mean of the part's points weighted by the kernel, by
//! Radon's seven points of degree 5. So F_0 + F_1 + F_2 is the closed form to rounding, whatever the rule leaves of each.
//! What lies below the horizon is cut off first, and so are shadows (`pair/shadow.rs`): on what remains the kernel is
//! smooth. Parts are halved across their longest edge until the rule reproduces Lambert's value, the free check of the
//! rule, or the hats vary so little that their mean does not matter; towards a point that touches the triangle parts
//! become smaller in proportion to their distance, which takes as many halvings as the tolerance has digits.
//!
//! Where only segments can tell what stands between, the visible share of each part is that of its seven points; parts
//! that are seen partly are halved [`SEGMENT_HALVINGS`] times, and sums are no longer exact.

use crate::pair::Occlusion;
use crate::pair::shadow::visible;
use crate::polygon::{above, point_to_triangle, twice_area};
use glam::DVec3;
use radiosity_scene::Facet;
use std::f64::consts::PI;

/// Height of the point above the triangle's plane, relative to the farthest corner, below which it is in the plane and
/// receives nothing: what rounding leaves.
const IN_PLANE: f64 = 1e-12;

/// Halvings after which nothing is halved any more: parts 2⁻³⁰ as long, beyond any tolerance.
const MOST_HALVINGS: u32 = 60;

/// Halvings at first, and at most, where segments find shadows: sixteen parts notice what hides a tenth of the triangle,
/// and what an edge of shadow passes is a 2⁻⁵th of it at the end.
const FIRST_HALVINGS: u32 = 4;
const SEGMENT_HALVINGS: u32 = 10;

/// What the rule is taken to leave at least, relative to the sixth power of size over distance, and what its difference
/// from Lambert is multiplied by. Of a thousand triangles drawn at random none misses its tolerance with a third of the
/// first or half of the second; without the first a quarter do, as the rule's total may be right by chance.
const RULE: f64 = 0.03;
const SAFETY: f64 = 4.0;

/// What roundings of Lambert's formula are taken to be.
const ROUNDING: f64 = 1e-15;

/// Barycentric coordinates and weights of Radon's rule of degree 5 (1948).
fn radon() -> [([f64; 3], f64); 7] {
    let root = 15f64.sqrt();
    let orbit =
        |a: f64, weight: f64| [0, 1, 2].map(|k| ([0, 1, 2].map(|m| if m == k { 1.0 - 2.0 * a } else { a }), weight));
    let [p, q, r] = orbit((6.0 - root) / 21.0, (155.0 - root) / 1200.0);
    let [s, t, u] = orbit((6.0 + root) / 21.0, (155.0 + root) / 1200.0);
    [([1.0 / 3.0; 3], 9.0 / 40.0), p, q, r, s, t, u]
}

/// Linear form factors from the differential area at `point` with unit `normal` to the hats of the corners of a
/// triangle, which emits towards the side from which they run counter-clockwise, with nothing between. They sum to
/// Lambert's value; each is off by about `tolerance` of it.
///
/// ```
/// use glam::DVec3;
/// use radiosity_transport::nodes::linear_form_factors;
///
/// // Over the origin, facing down: the corner overhead receives most.
/// let triangle = [DVec3::Z, DVec3::new(0., 1., 1.), DVec3::new(1., 0., 1.)];
/// let [overhead, one, other] = linear_form_factors(DVec3::ZERO, DVec3::Z, triangle, 1e-9);
/// assert!((one - other).abs() < 1e-12 && overhead > 1.3 * one);
/// ```
pub fn linear_form_factors(point: DVec3, normal: DVec3, corners: [DVec3; 3], tolerance: f64) -> [f64; 3] {
    let view = View { point, normal, tolerance, rule: radon() };
    view.factors(corners, &[], None)
}

/// How a node looks.
pub(super) struct View {
    pub point: DVec3,
    pub normal: DVec3,
    pub tolerance: f64,
    rule: [([f64; 3], f64); 7],
}

/// A corner of a part: where it is, as seen from the point, and its barycentric coordinates in the triangle.
#[derive(Clone, Copy)]
struct Corner {
    at: DVec3,
    hats: DVec3,
}

/// A whole whose parts are summed: the triangle, or a piece of it.
struct Whole<'a> {
    /// Height of the point above the plane.
    height: f64,
    /// What may be lost of it.
    allowed: f64,
    occlusion: Option<&'a dyn Occlusion>,
}

impl View {
    pub fn new(point: DVec3, normal: DVec3, tolerance: f64) -> View {
        View { point, normal, tolerance, rule: radon() }
    }

    /// The linear form factors to a facet of three corners, past what stands between. `own` is a facet about the point.
    pub fn past(&self, occlusion: &dyn Occlusion, own: &Facet, to: &Facet) -> [f64; 3] {
        let &[a, b, c] = to.corners() else { return [0.0; 3] };
        match occlusion.polygons(own, to) {
            Some(blockers) => self.factors([a, b, c], &blockers, None),
            None if occlusion.may_block(own, to) => self.factors([a, b, c], &[], Some(occlusion)),
            None => self.factors([a, b, c], &[], None),
        }
    }

    fn factors(&self, corners: [DVec3; 3], blockers: &[&[DVec3]], occlusion: Option<&dyn Occlusion>) -> [f64; 3] {
        let [a, b, c] = corners.map(|p| p - self.point);
        let twice = (b - a).cross(c - a);
        let area = twice.length();
        // Behind the triangle, in its plane, or all of it below the horizon: nothing arrives.
        let height = -a.dot(twice) / area;
        let extent = a.length().max(b.length()).max(c.length());
        let heights = [a, b, c].map(|p| p.dot(self.normal));
        if height.is_nan() || height <= IN_PLANE * extent || heights.iter().all(|h| *h <= 0.0) {
            return [0.0; 3];
        }
        let hats = [DVec3::X, DVec3::Y, DVec3::Z];
        let whole: [Corner; 3] = std::array::from_fn(|k| Corner { at: [a, b, c][k], hats: hats[k] });
        let mut sum = DVec3::ZERO;
        if blockers.is_empty() && heights.iter().all(|h| *h >= 0.0) {
            self.add(whole, height, occlusion, &mut sum);
        } else {
            let to_hats = |p: DVec3| {
                let hat = |from: DVec3, to: DVec3| (to - from).cross(p - from).dot(twice) / (area * area);
                let hats = DVec3::new(hat(b, c), hat(c, a), hat(a, b)).max(DVec3::ZERO);
                Corner { at: p, hats: hats / hats.element_sum() }
            };
            let blockers = self.before(blockers);
            let blockers: Vec<&[DVec3]> = blockers.iter().map(Vec::as_slice).collect();
            for piece in visible(DVec3::ZERO, &above(&[a, b, c], &heights), &blockers) {
                let piece: Vec<Corner> = piece.into_iter().map(to_hats).collect();
                for k in 1..piece.len().saturating_sub(1) {
                    self.add([piece[0], piece[k], piece[k + 1]], height, occlusion, &mut sum);
                }
            }
        }
        sum.to_array()
    }

    /// Adds a triangle above the horizon.
    fn add(&self, corners: [Corner; 3], height: f64, occlusion: Option<&dyn Occlusion>, sum: &mut DVec3) {
        let total = self.lambert(&corners);
        if total > 0.0 {
            let whole = Whole { height, allowed: self.tolerance * total, occlusion };
            self.refine(&whole, corners, total, 0, sum);
        }
    }

    fn lambert(&self, corners: &[Corner; 3]) -> f64 {
        point_to_triangle(DVec3::ZERO, self.normal, corners.map(|c| c.at))
    }

    /// Adds a part whose factor is `total`, halved as often as it needs.
    fn refine(&self, whole: &Whole, corners: [Corner; 3], total: f64, halvings: u32, sum: &mut DVec3) {
        let [a, b, c] = corners;
        let lengths = [b.at - c.at, c.at - a.at, a.at - b.at].map(DVec3::length_squared);
        let longest = (0..3).fold(0, |k, m| if lengths[m] > lengths[k] { m } else { k });
        // The rule: its total, its mean of the hats, and how much of it is visible.
        let twice_area = (b.at - a.at).cross(c.at - a.at).length();
        let (mut all, mut seen, mut mean) = (0.0, 0.0, DVec3::ZERO);
        let mut hidden = 0;
        for ([u, v, w], weight) in &self.rule {
            let at = *u * a.at + *v * b.at + *w * c.at;
            let square = at.length_squared();
            let value = weight * at.dot(self.normal).max(0.0) / (square * square);
            all += value;
            if whole.occlusion.is_none_or(|o| o.is_clear(self.point, self.point + at)) {
                seen += value;
                mean += value * (*u * a.hats + *v * b.hats + *w * c.hats);
            } else {
                hidden += 1;
            }
        }
        let quadrature = all * 0.5 * twice_area * whole.height / PI;
        let spread = (a.hats.max(b.hats).max(c.hats) - a.hats.min(b.hats).min(c.hats)).max_element();
        // A part answers for its share of what may be lost, by area and by factor in halves.
        let share = 0.5 * (whole.allowed * 0.5f64.powi(halvings as i32) + self.tolerance * total) + ROUNDING;
        let middle = (a.at + b.at + c.at) / 3.0;
        let near = lengths[longest] / middle.length_squared();
        // The rule's total knows one power of the kernel less than its mean of the hats, and may be right by chance; far
        // from the part it is not, as what it leaves falls with the sixth power.
        let checked = SAFETY * (quadrature - total).abs() / near.sqrt();
        let lost = total.min(checked.max(RULE * near.powi(3) * total));
        let is_good = lost * spread <= share;
        let is_told = match whole.occlusion {
            Some(_) if halvings < FIRST_HALVINGS => false,
            Some(_) => hidden == 0 || hidden == self.rule.len() || halvings >= SEGMENT_HALVINGS,
            None => true,
        };
        if (is_good && is_told) || halvings >= MOST_HALVINGS {
            if seen > 0.0 {
                let mean = mean.max(DVec3::ZERO);
                *sum += total * (seen / all) * (mean / mean.element_sum());
            } else if all <= 0.0 {
                *sum += total * (a.hats + b.hats + c.hats) / 3.0;
            }
            return;
        }
        let [top, from, to] = [0, 1, 2].map(|k| corners[(longest + k) % 3]);
        let half = Corner { at: 0.5 * (from.at + to.at), hats: 0.5 * (from.hats + to.hats) };
        for part in [[top, from, half], [top, half, to]] {
            let total = self.lambert(&part);
            if total > 0.0 {
                self.refine(whole, part, total, halvings + 1, sum);
            }
        }
    }

    /// Blockers as seen from the point, without those whose plane it lies in: they hide nothing.
    fn before(&self, blockers: &[&[DVec3]]) -> Vec<Vec<DVec3>> {
        let relative = blockers.iter().map(|blocker| blocker.iter().map(|c| *c - self.point).collect::<Vec<_>>());
        let is_before = |blocker: &Vec<DVec3>| {
            let twice = twice_area(blocker);
            let extent = blocker.iter().map(|c| c.length()).fold(0.0, f64::max);
            blocker[0].dot(twice).abs() > IN_PLANE * extent * twice.length()
        };
        relative.filter(is_before).collect()
    }
}
