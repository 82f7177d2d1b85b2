//! Which texels are ever read, and the surface point that each stands for.
//!
//! A bilinear look-up at p reads the texels whose centre c has |p − c| < 1 along both axes. So a triangle reads every
//! texel whose open square of side 2 around the centre it enters. A texel whose centre lies off the chart stands for
//! the nearest point of the triangles that read it, at most √2 texels away.

use super::{Atlas, Placed};
use glam::{DVec2, Vec2};
use rayon::prelude::*;

/// A texel to evaluate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texel {
    /// Column.
    pub x: u16,
    /// Row, from the top.
    pub y: u16,
    /// Index of the triangle it stands for.
    pub triangle: u32,
    /// The point in the triangle: barycentric weights of corners 1 and 2, inside.
    pub uv: Vec2,
}

/// Look-ups that give a texel less weight than this do not count as reading it: rounding of texture coordinates.
const READ: f64 = 1e-3;

/// Points on a side of a triangle are drawn in by this many texels, so that they do not lie in the plane of the
/// wall they touch. It moves a value by that share of the difference between two texels.
const INSET: f64 = 1.0 / 32.0;

impl Atlas {
    /// Every texel of a page that a bilinear look-up on it can read, chart by chart; empty for no such page.
    pub fn texels(&self, page: usize) -> Vec<Texel> {
        let charts: Vec<&Placed> = self.charts.iter().filter(|chart| chart.at.page as usize == page).collect();
        let by_chart: Vec<Vec<Texel>> = charts.par_iter().map(|chart| chart.texels()).collect();
        by_chart.concat()
    }
}

/// The best point for one texel so far.
#[derive(Clone, Copy)]
struct Found {
    distance: f64,
    triangle: usize,
    weights: [f64; 3],
}

impl Placed {
    fn texels(&self) -> Vec<Texel> {
        let [width, height] = self.size.map(|side| side as usize);
        // A collapsed axis has one row, which stands for the middle and is read from everywhere.
        let middle = self.collapsed.map(|width| width.map(|width| 0.5 * width));
        let reach = DVec2::from_array(middle.map(|m| if m.is_some() { f64::INFINITY } else { 1.0 - READ }));
        let centre = |x: usize, y: usize| DVec2::new(middle[0].unwrap_or(x as f64), middle[1].unwrap_or(y as f64));

        let mut found: Vec<Option<Found>> = vec![None; width * height];
        for (triangle, corners) in self.local.iter().enumerate() {
            let low = corners[0].min(corners[1]).min(corners[2]) - reach;
            let high = corners[0].max(corners[1]).max(corners[2]) + reach;
            let range = |low: f64, high: f64, count: usize| {
                let first = low.ceil().clamp(0.0, count as f64) as usize;
                let last = (high.floor() + 1.0).clamp(0.0, count as f64) as usize;
                first..last
            };
            for y in range(low.y, high.y, height) {
                for x in range(low.x, high.x, width) {
                    let (slot, c) = (&mut found[y * width + x], centre(x, y));
                    if slot.is_some_and(|found| found.distance == 0.0) || !enters(corners, c, reach) {
                        continue;
                    }
                    let (distance, weights) = nearest(corners, c);
                    if slot.is_none_or(|found| distance < found.distance) {
                        *slot = Some(Found { distance, triangle, weights });
                    }
                }
            }
        }

        let mut texels = Vec::new();
        for (index, found) in found.iter().enumerate() {
            let Some(found) = found else { continue };
            let (x, y) = ((index % width) as u32, (index / width) as u32);
            let (x, y) = if self.at.rotated { (y, x) } else { (x, y) };
            let weights = drawn_in(&self.local[found.triangle], found.weights);
            texels.push(Texel {
                x: (self.at.x + x) as u16,
                y: (self.at.y + y) as u16,
                triangle: self.triangles[found.triangle],
                uv: Vec2::new(weights[1] as f32, weights[2] as f32),
            });
        }
        texels
    }
}

/// Whether a triangle enters the open box of half sides `reach` around `c` (separating axes).
fn enters(corners: &[DVec2; 3], c: DVec2, reach: DVec2) -> bool {
    let [a, b, d] = corners.map(|p| p - c);
    let (low, high) = (a.min(b).min(d), a.max(b).max(d));
    if low.cmpge(reach).any() || high.cmple(-reach).any() {
        return false;
    }
    [(a, b), (b, d), (d, a)].into_iter().all(|(from, to)| {
        let normal = (to - from).perp();
        // 0 · ∞ must be 0: a side along a collapsed axis separates nothing on it.
        let radius = [(normal.x, reach.x), (normal.y, reach.y)]
            .map(|(n, r)| if n == 0.0 { 0.0 } else { n.abs() * r })
            .iter()
            .sum::<f64>();
        let sides = [a, b, d].map(|p| normal.dot(p));
        let (least, most) = (sides[0].min(sides[1]).min(sides[2]), sides[0].max(sides[1]).max(sides[2]));
        normal == DVec2::ZERO || least < radius && most > -radius
    })
}

/// Distance to the triangle and the weights of its nearest point; works for triangles without area.
pub(super) fn nearest([a, b, c]: &[DVec2; 3], p: DVec2) -> (f64, [f64; 3]) {
    let area = (b - a).perp_dot(c - a);
    let weights = [(b - p).perp_dot(c - p), (c - p).perp_dot(a - p), (a - p).perp_dot(b - p)].map(|w| w / area);
    if area != 0.0 && weights.iter().all(|&w| (0.0..=1.0).contains(&w)) {
        return (0.0, weights);
    }
    let mut best = (f64::INFINITY, [1.0, 0.0, 0.0]);
    for (from, to, i, j) in [(a, b, 0, 1), (b, c, 1, 2), (c, a, 2, 0)] {
        let along = *to - *from;
        let length = along.length_squared();
        let t = if length > 0.0 { ((p - *from).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
        let distance = p.distance(*from + t * along);
        if distance < best.0 {
            let mut weights = [0.0; 3];
            weights[i] = 1.0 - t;
            weights[j] = t;
            best = (distance, weights);
        }
    }
    // Exactly 0 is kept for centres inside, so that they win over a touching neighbour.
    (best.0.max(f64::MIN_POSITIVE), best.1)
}

/// Moves a point that lies (almost) on a side towards the centroid by [`INSET`] texels, at most half the way.
pub(super) fn drawn_in(corners: &[DVec2; 3], weights: [f64; 3]) -> [f64; 3] {
    let [a, b, c] = *corners;
    let doubled = (b - a).perp_dot(c - a).abs();
    let on_side = [(b, c), (c, a), (a, b)]
        .into_iter()
        .zip(weights)
        .any(|((from, to), weight)| weight * doubled <= INSET * from.distance(to));
    if !on_side {
        return weights;
    }
    let point = a * weights[0] + b * weights[1] + c * weights[2];
    let way = ((a + b + c) / 3.0).distance(point);
    let share = if way > 0.0 { (INSET / way).min(0.5) } else { 0.0 };
    weights.map(|w| w + share * (1.0 / 3.0 - w))
}
