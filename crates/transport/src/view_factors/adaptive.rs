//! Adaptive integration of a function with kinks over a convex polygon.
//!
//! A cell (parallelogram or triangle) has the mean T of its corners and the value M at its centre. Where the function is
//! convex or concave in the cell, the integral lies between the two; their weighted mean, exact for quadratics, is
//! taken. A single kink leaves it wrong by a third of their difference at most. Cells with the largest errors are divided into four; corners
//! and centres are corners of the next cells, so nothing is evaluated twice. Two functions go along, of which the one that
//! settles first is of use: where one is singular the other may be smooth.

use super::part::parallelogram;
use glam::DVec3;
use radiosity_scene::Facet;
use rustc_hash::FxHashMap;

/// Halvings of an edge at most: 2^-12 of it is below what any accuracy needs.
const DEPTH: i32 = 12;

/// Least error of the whole by the difference of its corners. Where a shadow's edge halves a cell, the mean of the corners
/// is the value at the centre by symmetry, and neither is the mean.
const CHANCE: f64 = 0.05;

/// Least error of the pieces of a cell by what its division changed: kinks settle as the square of the width, so a quarter
/// of the change is left. After two divisions none is more than the larger of their changes: where the function is
/// smooth, T and M are far apart long after their mean has settled. One small change may be chance.
const LEFT: f64 = 0.25;

/// Cells at which the division ends, whatever the error: some hundred thousand places, a tenth of a second.
const MOST: usize = 65_536;

/// Integrals of two functions and estimates of their errors, on the safe side.
#[derive(Clone, Copy, Debug, Default)]
pub struct Integrals {
    /// ∫ f dA.
    pub values: [f64; 2],
    /// Bounds of their errors.
    pub errors: [f64; 2],
}

/// A cell: its corners on a grid of 2^[`DEPTH`] along the edges of a frame.
#[derive(Clone, Copy)]
struct Cell {
    frame: usize,
    /// Least corner; of a triangle that stands on its head the greatest.
    at: [i32; 2],
    /// Length of an edge, negative for a triangle on its head.
    size: i32,
    values: [f64; 2],
    errors: [f64; 2],
    /// What the divisions above it changed, a sixteenth by level: a quarter for its share of them, and one for the width.
    changed: [f64; 2],
    /// Differences of the corners, times the area.
    spread: [f64; 2],
}

/// The polygon as frames (corner and two edges): one parallelogram or some triangles.
struct Domain<F> {
    frames: Vec<[DVec3; 3]>,
    square: bool,
    f: F,
    known: FxHashMap<(usize, [i32; 2]), [f64; 2]>,
}

impl<F: FnMut(DVec3) -> [f64; 2]> Domain<F> {
    fn value(&mut self, frame: usize, x: f64, y: f64) -> [f64; 2] {
        let [origin, u, v] = self.frames[frame];
        let scale = 1.0 / f64::from(1 << DEPTH);
        (self.f)(origin + x * scale * u + y * scale * v)
    }

    fn corner(&mut self, frame: usize, at: [i32; 2]) -> [f64; 2] {
        if let Some(known) = self.known.get(&(frame, at)) {
            return *known;
        }
        let value = self.value(frame, f64::from(at[0]), f64::from(at[1]));
        self.known.insert((frame, at), value);
        value
    }

    fn cell(&mut self, frame: usize, at: [i32; 2], size: i32) -> Cell {
        let [x, y] = at;
        let mut corners = [[x, y], [x + size, y], [x, y + size], [x, y]].map(|at| self.corner(frame, at));
        let (centre, weight) = if self.square {
            corners[3] = self.corner(frame, [x + size, y + size]);
            (self.corner(frame, [x + size / 2, y + size / 2]), 2.0 / 3.0)
        } else {
            let third = f64::from(size) / 3.0;
            (self.value(frame, f64::from(x) + third, f64::from(y) + third), 0.75)
        };
        let corners = if self.square { &corners[..] } else { &corners[..3] };
        let [_, u, v] = self.frames[frame];
        let side = f64::from(size) / f64::from(1 << DEPTH);
        let area = u.cross(v).length() * side * side * if self.square { 1.0 } else { 0.5 };
        let mut cell =
            Cell { frame, at, size, values: [0.0; 2], errors: [0.0; 2], changed: [0.0; 2], spread: [0.0; 2] };
        for k in 0..2 {
            let rim = corners.iter().map(|c| c[k]).sum::<f64>() / corners.len() as f64;
            let (low, high) =
                corners.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), c| (l.min(c[k]), h.max(c[k])));
            cell.values[k] = area * (rim + weight * (centre[k] - rim));
            cell.errors[k] = area * (centre[k] - rim).abs() / 3.0;
            cell.spread[k] = area * (high - low);
        }
        cell
    }

    fn divided(&mut self, cell: &Cell) -> [Cell; 4] {
        let ([x, y], half) = (cell.at, cell.size / 2);
        let last = if self.square { half } else { -half };
        let mut pieces = [([x, y], half), ([x + half, y], half), ([x, y + half], half), ([x + half, y + half], last)]
            .map(|(at, size)| self.cell(cell.frame, at, size));
        for k in 0..2 {
            let change = pieces.iter().map(|p| p.values[k]).sum::<f64>() - cell.values[k];
            for piece in &mut pieces {
                let change = change.abs();
                let most = if cell.size == 1 << DEPTH { f64::INFINITY } else { change.max(cell.changed[k] / 16.0) };
                piece.errors[k] = piece.errors[k].clamp(0.25 * LEFT * change, most);
                piece.changed[k] = change.max(cell.changed[k] / 16.0);
            }
        }
        pieces
    }
}

/// Integrates over a convex polygon until the lesser of the two errors meets the tolerance, or the cells run out.
pub fn integrate(shape: &Facet, tolerance: f64, f: impl FnMut(DVec3) -> [f64; 2]) -> Integrals {
    let square = parallelogram(shape);
    let frames = match square {
        Some(frame) => vec![frame],
        None => shape.triangles().into_iter().map(|[a, b, c]| [a, b - a, c - a]).collect(),
    };
    let mut domain = Domain { square: square.is_some(), frames, f, known: FxHashMap::default() };
    let mut cells: Vec<Cell> = (0..domain.frames.len())
        .map(|frame| {
            let mut cell = domain.cell(frame, [0, 0], 1 << DEPTH);
            for k in 0..2 {
                cell.errors[k] = cell.errors[k].max(CHANCE * cell.spread[k]);
            }
            cell
        })
        .collect();
    loop {
        // A plain sum: along a kink parallel to an edge all cells err alike.
        let errors = [0, 1].map(|k| cells.iter().map(|c| c.errors[k]).sum::<f64>());
        let k = usize::from(errors[1] < errors[0]);
        let largest = cells.iter().map(|c| c.errors[k]).fold(0.0, f64::max);
        let is_divisible = |c: &Cell| c.errors[k] >= 0.25 * largest && c.size.abs() > 2;
        if errors[k] <= tolerance || cells.len() > MOST || !cells.iter().any(is_divisible) {
            let values = [0, 1].map(|k| cells.iter().map(|c| c.values[k]).sum());
            return Integrals { values, errors };
        }
        let mut next = Vec::with_capacity(4 * cells.len());
        for cell in cells {
            if is_divisible(&cell) {
                next.extend(domain.divided(&cell));
            } else {
                next.push(cell);
            }
        }
        cells = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Functions with kinks along slanting lines: the stated error holds the true one, and tolerances are met.
    #[test]
    fn kinks_are_integrated_as_well_as_stated() {
        let p = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let square = Facet::new(vec![p(0., 0.), p(1., 0.), p(1., 1.), p(0., 1.)]).unwrap();
        let triangle = Facet::new(vec![p(0., 0.), p(1., 0.), p(0., 1.)]).unwrap();
        // ∫ max(0, x + y − c) over the unit square and the unit triangle, for c ≤ 1.
        let over_square = |c: f64| 1.0 - c + c.powi(3) / 6.0;
        let over_triangle = |c: f64| {
            let moment = |c: f64| c.powi(3) / 3.0 - c * c * c / 2.0;
            (1.0 / 3.0 - c / 2.0) - moment(c)
        };
        let (mut missed, mut all) = (0, 0);
        for i in 0..200 {
            let c = (f64::from(i) + 0.37) / 200.0;
            for tolerance in [1e-2, 1e-3, 1e-4, 1e-5] {
                for (shape, exact) in [(&square, over_square(c)), (&triangle, over_triangle(c))] {
                    let found = integrate(shape, tolerance, |x| [(x.x + x.y - c).max(0.0); 2]);
                    assert!(found.errors[0] <= tolerance);
                    all += 1;
                    missed += usize::from((found.values[0] - exact).abs() > found.errors[0].max(1e-14));
                }
            }
        }
        assert!(200 * missed <= all, "{missed} of {all}");
    }
}
