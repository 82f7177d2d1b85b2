//! Pairs with something between them: the form factor of what is visible, exact from each point of one part, averaged
//! over its points.
//!
//! From a point, panels are cut out of the other part exactly, so shadow edges on it cost nothing. Over the points the
//! visible factor is continuous with kinks, and cells are divided where it bends. The part that lies farther from the
//! panels, by its own size, is divided: what stands close to a part throws sharp shadows there, which only the exact
//! side resolves.

use super::clear::Exchange;
use super::panel::Panel;
use super::part::{Part, parallelogram};
use super::visible::{Loop, Shadows, keep_above};
use glam::DVec3;
use radiosity_scene::Facet;
use rustc_hash::FxHashMap;

/// Halvings of an edge at most: 2^-12 of it is below what any accuracy needs.
const DEPTH: i32 = 12;

/// Least error of a cell by the difference of its corners. Where a shadow's edge halves a cell, the mean of the corners is
/// the value at the centre by symmetry, and neither is the mean.
const CHANCE: f64 = 0.02;

/// Cells at which the division ends, whatever the error: some ten thousand places, a few milliseconds.
const MOST: usize = 4096;

/// A_i F_ij of two parts past panels; `tolerance` and the answer in m², `whole` is the answer without panels.
pub fn mixed(
    shadows: &mut Shadows,
    [a, b]: [&Part; 2],
    panels: &[&Panel],
    whole: Exchange,
    tolerance: f64,
    touch: f64,
) -> (Exchange, bool) {
    let (outer, inner) = if distance(a, b, panels, touch) >= distance(b, a, panels, touch) { (a, b) } else { (b, a) };
    let above = |part: &Part, other: &Part| {
        let mut left: Loop = part.shape.corners().iter().copied().collect();
        let normal = other.shape.normal();
        keep_above(&mut left, normal, normal.dot(other.shape.corners()[0])).then_some(left)
    };
    let (Some(from), Some(target)) = (above(outer, inner), above(inner, outer)) else {
        return (Exchange::default(), false);
    };
    let Ok(from) = Facet::new(from.to_vec()) else { return (Exchange::default(), false) };
    let normal = outer.shape.normal();

    let mut visible = Visible { shadows, normal, target: &target, panels, touch, hidden: false };
    let [value, error] = integrate(&from, tolerance, |x| visible.factor(x));
    let value = value.clamp(0.0, whole.value);
    (Exchange { value, error: error + whole.error }, visible.hidden)
}

/// The visible factor of a target as a function of the place.
struct Visible<'a> {
    shadows: &'a mut Shadows,
    normal: DVec3,
    target: &'a [DVec3],
    panels: &'a [&'a Panel],
    touch: f64,
    hidden: bool,
}

impl Visible<'_> {
    fn factor(&mut self, x: DVec3) -> f64 {
        let (factor, hidden) = self.shadows.factor(x, self.normal, self.target, self.panels, self.touch);
        self.hidden |= hidden;
        factor
    }
}

/// How far the nearest panel stands from a part on the way to another, by the part's size.
fn distance(part: &Part, other: &Part, panels: &[&Panel], touch: f64) -> f64 {
    let (p, q) = (part.shape.centroid(), other.shape.centroid());
    let share = |panel: &&Panel| {
        let through = |part: &Part| {
            let heights = part.shape.corners().iter().map(|c| panel.height(*c));
            heights.clone().any(|h| h > touch) && heights.clone().any(|h| h < -touch)
        };
        let (h, k) = (panel.height(p), panel.height(q));
        if through(part) || h == k { 0.0 } else { (h / (h - k)).clamp(0.0, 1.0) }
    };
    panels.iter().map(share).fold(1.0, f64::min) / part.radius
}

/// A cell of the division: its corners on a grid of 2^[`DEPTH`] along an edge.
#[derive(Clone, Copy)]
struct Cell {
    /// Least corner; of a triangle that stands on its head the greatest.
    at: [i32; 2],
    /// Length of an edge, negative for a triangle on its head.
    size: i32,
    value: f64,
    error: f64,
}

/// Integral and error bound of a function over a polygon, by cells that are divided where the function bends.
///
/// A cell has the mean T of its corners and the value M at its centre. For a function that is convex or concave in the
/// cell the integral lies between the two; their weighted mean, exact for quadratics, is taken and half their difference
/// stands for its error.
fn integrate(shape: &Facet, tolerance: f64, mut f: impl FnMut(DVec3) -> f64) -> [f64; 2] {
    if let Some([origin, u, v]) = parallelogram(shape) {
        return over_cells(shape.area(), tolerance, true, |x, y| f(origin + x * u + y * v));
    }
    let mut sum = [0.0; 2];
    for [a, b, c] in shape.triangles() {
        let area = 0.5 * (b - a).cross(c - a).length();
        let share = tolerance * area / shape.area();
        let [value, error] = over_cells(area, share, false, |x, y| f(a + x * (b - a) + y * (c - a)));
        sum = [sum[0] + value, sum[1] + error];
    }
    sum
}

fn over_cells(area: f64, tolerance: f64, square: bool, mut f: impl FnMut(f64, f64) -> f64) -> [f64; 2] {
    let whole = 1 << DEPTH;
    let mut known: FxHashMap<[i32; 2], f64> = FxHashMap::default();
    let mut judge = |at: [i32; 2], size: i32| {
        let mut corner = |x: i32, y: i32| {
            *known.entry([x, y]).or_insert_with(|| f(f64::from(x) / f64::from(whole), f64::from(y) / f64::from(whole)))
        };
        let [x, y] = at;
        let side = f64::from(size) / f64::from(whole);
        let [a, b, c] = [corner(x, y), corner(x + size, y), corner(x, y + size)];
        let d = if square { corner(x + size, y + size) } else { c };
        let spread = a.max(b).max(c).max(d) - a.min(b).min(c).min(d);
        let (rim, centre, weight) = if square {
            (0.25 * (a + b + c + d), corner(x + size / 2, y + size / 2), 2.0 / 3.0)
        } else {
            let middle = |k: i32| (f64::from(k) + f64::from(size) / 3.0) / f64::from(whole);
            ((a + b + c) / 3.0, f(middle(x), middle(y)), 0.75)
        };
        let area = area * side * side;
        let error = area * (0.5 * (centre - rim).abs()).max(CHANCE * spread);
        Cell { at, size, value: area * (rim + weight * (centre - rim)), error }
    };
    let mut cells = vec![judge([0, 0], whole)];
    loop {
        let error: f64 = cells.iter().map(|c| c.error).sum();
        let largest = cells.iter().map(|c| c.error).fold(0.0, f64::max);
        let divisible = |c: &Cell| c.error >= 0.25 * largest && c.size.abs() > 2;
        if error <= tolerance || cells.len() > MOST || !cells.iter().any(divisible) {
            return [cells.iter().map(|c| c.value).sum(), error];
        }
        let mut next = Vec::with_capacity(4 * cells.len());
        for cell in cells {
            if !divisible(&cell) {
                next.push(cell);
                continue;
            }
            let ([x, y], half) = (cell.at, cell.size / 2);
            next.extend([judge([x, y], half), judge([x + half, y], half), judge([x, y + half], half)]);
            next.push(judge([x + half, y + half], if square { half } else { -half }));
        }
        cells = next;
    }
}
