//! What a point sees of a facet, found by segments, for whatever it is that stands between.
//!
//! The facet is parametrised by its spherical triangles, nearly in proportion to the cosine, so that the integrand is
//! near a constant where the facet is seen and zero where it is not, however near it is. Along a line of one parameter
//! the places where the view changes are found by bisection; across, the lengths of the lines, which are continuous but
//! have kinks, are integrated by Simpson's rule on halved intervals until two levels agree. What falls between the
//! segments is missed; the error counts a quarter of a cell of their grid, what a corner that comes in unseen may hide.

use super::Occlusion;
use super::gauss::gauss;
use crate::polygon::{CosineTriangle, point_to_polygon};
use glam::DVec3;
use radiosity_scene::Facet;
use std::cell::Cell;

/// Fewest and most segments along a line before bisection, and lines across before halving: in between as many as make a
/// quarter of a cell count for the tolerance. More than the most would take seconds for each point of the outer integral.
const FEWEST: usize = 8;
const MOST: usize = 64;

/// Points of the rule along a line: the integrand's smooth part.
const POINTS: usize = 5;

/// Most halvings across: a jump counts for one part in 4 · 2¹².
const DEEPEST: u32 = 12;

/// The segments that look at a facet.
pub struct Segments<'a> {
    triangles: Vec<[DVec3; 3]>,
    normal: DVec3,
    to: &'a Facet,
    occlusion: &'a dyn Occlusion,
    tolerance: f64,
    /// Width to which changes of view are bisected.
    width: f64,
    count: Cell<usize>,
}

impl<'a> Segments<'a> {
    /// The view from points of the facet `from` of convex `parts` of `to`, each point's to `tolerance`.
    pub fn new(
        parts: &[Vec<DVec3>],
        from: &Facet,
        to: &'a Facet,
        occlusion: &'a dyn Occlusion,
        tolerance: f64,
    ) -> Segments<'a> {
        let fan = |part: &Vec<DVec3>| {
            let first = part[0];
            part[1..].windows(2).map(|pair| [first, pair[0], pair[1]]).collect::<Vec<_>>()
        };
        let triangles: Vec<[DVec3; 3]> = parts.iter().flat_map(fan).collect();
        let tolerance = tolerance / triangles.len().max(1) as f64;
        let width = (0.1 * tolerance).clamp(1e-12, 1e-3);
        Segments { triangles, normal: from.normal(), to, occlusion, tolerance, width, count: Cell::new(0) }
    }

    /// Segments traced so far.
    pub fn count(&self) -> usize {
        self.count.get()
    }

    /// The form factor from the differential area at a point to what it sees, and its error.
    pub fn from(&self, point: DVec3) -> [f64; 2] {
        let sums = self.triangles.iter().map(|corners| self.triangle(point, *corners));
        sums.fold([0.0; 2], |sum, [value, error]| [sum[0] + value, sum[1] + error])
    }

    fn triangle(&self, point: DVec3, corners: [DVec3; 3]) -> [f64; 2] {
        let whole = point_to_polygon(point, self.normal, &corners);
        let Some(map) = CosineTriangle::new(point, self.normal, corners).filter(|_| whole > 0.0) else {
            return [0.0; 2];
        };
        // An even number of intervals across, for Simpson's rule.
        let along = ((whole / (4.0 * self.tolerance)).sqrt().ceil() as usize).clamp(FEWEST, MOST).next_multiple_of(2);
        let line = |y: f64| self.line(point, &map, y, along);
        let step = 1.0 / along as f64;
        let ends: Vec<[f64; 2]> = (0..=along).map(|i| line(i as f64 * step)).collect();
        let unseen = 0.25 * whole * step * step;
        // All seen or nothing: no quadrature.
        let seen: f64 = ends.iter().map(|[_, share]| share).sum();
        if seen == 0.0 {
            return [0.0, unseen];
        }
        if seen == ends.len() as f64 {
            return [whole, unseen];
        }
        let panel = |i: usize| {
            let [a, m, b] = [0, 1, 2].map(|k| ends[2 * i + k][0]);
            self.simpson(&line, [2.0 * i as f64 * step, 2.0 * step], [a, m, b], DEEPEST)
        };
        let sums = (0..along / 2).map(panel).fold([0.0; 2], |sum, [value, error]| [sum[0] + value, sum[1] + error]);
        [sums[0].clamp(0.0, whole), sums[1] + unseen]
    }

    /// ∫ over an interval [start, length] across, from the values at its ends and in its middle.
    fn simpson(
        &self,
        line: &impl Fn(f64) -> [f64; 2],
        [start, length]: [f64; 2],
        [a, m, b]: [f64; 3],
        depth: u32,
    ) -> [f64; 2] {
        let [p, q] = [0.25, 0.75].map(|x| line(start + x * length)[0]);
        let coarse = length / 6.0 * (a + 4.0 * m + b);
        let fine = length / 12.0 * (a + 4.0 * p + 2.0 * m + 4.0 * q + b);
        let error = (fine - coarse).abs();
        // At a kink the difference is about the error; a smooth function has a fifteenth of it.
        if error <= self.tolerance * length || depth == 0 {
            return [fine, error];
        }
        let half = 0.5 * length;
        let low = self.simpson(line, [start, half], [a, p, m], depth - 1);
        let high = self.simpson(line, [start + half, half], [m, q, b], depth - 1);
        [low[0] + high[0], low[1] + high[1]]
    }

    /// ∫ cos θ/π over the density along a line, where the facet is seen, and the share of segments that are clear.
    fn line(&self, point: DVec3, map: &CosineTriangle, y: f64, along: usize) -> [f64; 2] {
        let sees = |x: f64| {
            let (direction, _) = map.direction(x, y);
            let distance = -self.to.height(point) / direction.dot(self.to.normal());
            self.count.set(self.count.get() + 1);
            self.occlusion.is_clear(point, point + distance * direction)
        };
        let seen = |low: f64, high: f64| {
            let weights = gauss(POINTS).iter().map(|[x, w]| w * map.direction(low + x * (high - low), y).1);
            (high - low) * weights.sum::<f64>()
        };
        // The ends too, for shadows that come in over a side.
        let place = |i: usize| i as f64 / (along - 1) as f64;
        let (mut sum, mut clear) = (0.0, 0);
        let (mut start, mut visible) = (0.0, sees(place(0)));
        clear += usize::from(visible);
        for i in 1..along {
            let next = sees(place(i));
            clear += usize::from(next);
            if next != visible {
                let [mut low, mut high] = [place(i - 1), place(i)];
                while high - low > self.width {
                    let middle = 0.5 * (low + high);
                    if sees(middle) == visible { low = middle } else { high = middle }
                }
                let change = 0.5 * (low + high);
                if visible {
                    sum += seen(start, change);
                }
                (start, visible) = (change, next);
            }
        }
        if visible {
            sum += seen(start, 1.0);
        }
        [sum, clear as f64 / along as f64]
    }
}
