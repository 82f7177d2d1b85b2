//! Adaptive integration of what is visible and what is hidden over a convex polygon.
//!
//! A cell (parallelogram or triangle) has the mean T of its corners and the value M at its centre. Where the function is
//! convex or concave in the cell, the integral lies between the two; their weighted mean, exact for quadratics, is
//! taken. A single kink leaves it wrong by a third of their difference at most. Cells with the largest errors are divided
//! into four; corners and centres are corners of the next cells, so nothing is evaluated twice.
//!
//! Places tell nothing of what lies between them. So each cell is first judged as a whole: one that is proven clear has
//! nothing hidden, one that is proven blocked nothing visible, and what is left of it has a closed form. In others a
//! shadow that no place saw counts as an error, by what it could hide at most.
//!
//! Visible and hidden together have a closed form. Where places miss that, as they do between parts that touch or cross
//! each other, it is taken for each cell, and the places tell its visible share alone.

use super::part::parallelogram;
use super::visible::Sight;
use glam::DVec3;
use radiosity_scene::Facet;
use rustc_hash::FxHashMap;
use smallvec::SmallVec;

/// Halvings of an edge at most: 2^-12 of it is below what any accuracy needs.
const DEPTH: i32 = 12;

/// Least error by the difference of the corners, of the whole and where a shadow begins or ends. Where its edge halves a
/// cell, the mean of the corners is the value at the centre by symmetry, and neither is the mean.
const KINK: f64 = 0.1;

/// Least error of the pieces of a cell by what its division changed: kinks settle as the square of the width, so a quarter
/// of the change is left. After two divisions none is more than the larger of their changes: where the function is
/// smooth, T and M are far apart long after their mean has settled. One small change may be chance.
const LEFT: f64 = 0.25;

/// The whole by this much less certain than its pieces: no division has told how its places mislead.
const UNDIVIDED: f64 = 2.0;

/// Error of what places did not see hidden, by what might be at most.
const DOUBT: f64 = 0.25;

/// The same of what they did not see visible past several panels, by all that there is; a sixteenth with each division.
const GAP: f64 = 0.1;

/// What may be is no more than this times the most that a place saw.
const MORE: f64 = 4.0;

/// Share of all below which what is visible is next to nothing.
const LITTLE: f64 = 1e-6;

/// Share of the tolerance by which places may miss the closed form of all.
const MISS: f64 = 0.1;

/// Least of all that reaches a corner, by the most that does: below it, all changes too fast for places to tell.
const STEEP: f64 = 1e-3;

/// Least error of a share by what places miss of all.
const UNKNOWN: f64 = 0.25;

/// Relative error of the closed form.
const CLOSED_FORM: f64 = 1e-11;

/// Cells at which the division ends, whatever the error: some hundred thousand places, a tenth of a second.
const MOST: usize = 65_536;

/// Integrals of what is visible and what is hidden, with estimates of their errors, on the safe side.
#[derive(Clone, Copy, Debug, Default)]
pub struct Integrals {
    /// ∫ f dA.
    pub values: [f64; 2],
    /// Bounds of their errors.
    pub errors: [f64; 2],
}

/// Panels that may matter, by index.
pub type List = SmallVec<[u16; 16]>;

/// What stands before a cell.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Before {
    /// Proven: nothing.
    Nothing,
    /// Proven: nothing gets past.
    All,
    /// Some panels that may hide a part.
    Some(List),
    /// What it was is of no more interest: the integrals are exact.
    #[default]
    Settled,
}

/// What is integrated: by places, and by cells (their corners).
pub trait Shaded {
    /// What is visible and hidden from a place, past the panels listed.
    fn sight(&mut self, x: DVec3, list: &[u16]) -> Sight;

    /// Judges a cell as a whole, of a larger one past the panels listed, at first sight.
    fn before(&mut self, cell: &[DVec3], list: &[u16]) -> Before;

    /// Whether nothing is hidden from any of a cell, which it is not from its corners.
    fn is_clear(&mut self, cell: &[DVec3], list: &[u16]) -> bool;

    /// Whether all is hidden from all of a cell, which it is from its corners.
    fn is_hidden(&mut self, cell: &[DVec3], list: &[u16]) -> bool;

    /// The most that the panels listed might hide from the centre of a cell, seen from any of its places.
    fn possible(&mut self, cell: &[DVec3], list: &[u16]) -> f64;

    /// Visible and hidden together, over a cell.
    fn whole(&mut self, cell: &[DVec3]) -> f64;
}

/// A cell: its corners on a grid of 2^[`DEPTH`] along the edges of a frame.
#[derive(Clone, Default)]
struct Cell {
    frame: usize,
    /// Least corner; of a triangle that stands on its head the greatest.
    at: [i32; 2],
    /// Length of an edge, negative for a triangle on its head.
    size: i32,
    values: [f64; 2],
    errors: [f64; 2],
    /// What places cannot tell: no division above says anything about it.
    doubts: [f64; 2],
    /// What the divisions above it changed, a sixteenth by level: a quarter for its share of them, and one for the width.
    changed: [f64; 2],
    /// Least error where a shadow begins or ends.
    least: [f64; 2],
    before: Before,
}

/// The polygon as frames (corner and two edges): one parallelogram or some triangles.
struct Domain<'a, S> {
    frames: Vec<[DVec3; 3]>,
    square: bool,
    shaded: &'a mut S,
    /// Whether cells take the closed form of all that they see.
    is_known: bool,
    sights: FxHashMap<(usize, [i32; 2]), Sight>,
}

impl<S: Shaded> Domain<'_, S> {
    fn place(&self, frame: usize, x: f64, y: f64) -> DVec3 {
        let [origin, u, v] = self.frames[frame];
        let scale = 1.0 / f64::from(1 << DEPTH);
        origin + x * scale * u + y * scale * v
    }

    fn corner(&mut self, frame: usize, at: [i32; 2], list: &[u16]) -> Sight {
        if let Some(known) = self.sights.get(&(frame, at)) {
            return *known;
        }
        let place = self.place(frame, f64::from(at[0]), f64::from(at[1]));
        let value = self.shaded.sight(place, list);
        self.sights.insert((frame, at), value);
        value
    }

    fn corners(&self, frame: usize, [x, y]: [i32; 2], size: i32) -> SmallVec<[DVec3; 4]> {
        let place = |x: i32, y: i32| self.place(frame, f64::from(x), f64::from(y));
        let mut corners = SmallVec::new();
        corners.extend([place(x, y), place(x + size, y)]);
        if self.square {
            corners.push(place(x + size, y + size));
        }
        corners.push(place(x, y + size));
        corners
    }

    /// A cell of one past the panels listed.
    fn cell(&mut self, frame: usize, at: [i32; 2], size: i32, list: &[u16]) -> Cell {
        let places = self.corners(frame, at, size);
        // The whole is judged before.
        let is_whole = self.frames.len() == 1 && size == 1 << DEPTH;
        let before = if is_whole { Before::Some(list.into()) } else { self.shaded.before(&places, list) };
        if self.is_known && !matches!(before, Before::Some(_)) {
            return self.settled(&Cell { frame, at, size, before, ..Cell::default() });
        }
        let list: &[u16] = if let Before::Some(list) = &before { list } else { &[] };
        let [x, y] = at;
        let mut corners = [[x, y], [x + size, y], [x, y + size], [x, y]].map(|at| self.corner(frame, at, list));
        let (centre, weight) = if self.square {
            corners[3] = self.corner(frame, [x + size, y + size], list);
            (self.corner(frame, [x + size / 2, y + size / 2], list), 2.0 / 3.0)
        } else {
            let third = f64::from(size) / 3.0;
            let place = self.place(frame, f64::from(x) + third, f64::from(y) + third);
            (self.shaded.sight(place, list), 0.75)
        };
        let corners = if self.square { &corners[..] } else { &corners[..3] };
        let [_, u, v] = self.frames[frame];
        let side = f64::from(size) / f64::from(1 << DEPTH);
        let area = u.cross(v).length() * side * side * if self.square { 1.0 } else { 0.5 };
        let mut cell = Cell { frame, at, size, before, ..Cell::default() };
        // Where some places see a shadow and others not, it begins or ends between them.
        let is_bent = corners.iter().any(|c| c.hiding != centre.hiding) || size.abs() == 1 << DEPTH;
        let mean = |f: &dyn Fn(&Sight) -> f64| {
            let rim = corners.iter().map(f).sum::<f64>() / corners.len() as f64;
            (rim, area * (rim + weight * (f(&centre) - rim)))
        };
        for k in 0..2 {
            cell.values[k] = mean(&|c| c.factors[k]).1;
        }
        // What is known of both together is taken off what places tell.
        let all = cell.values[0] + cell.values[1];
        let both = |c: &Sight| c.factors[0] + c.factors[1];
        let range = |f: &dyn Fn(&Sight) -> f64| {
            corners.iter().map(f).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
        };
        let mut shares = [0.0; 2];
        let bend = if is_bent { KINK } else { 0.0 };
        if self.is_known && matches!(cell.before, Before::Some(_)) {
            let whole = self.shaded.whole(&places);
            shares = if all > 0.0 { cell.values.map(|v| (v / all).clamp(0.0, 1.0)) } else { [0.5; 2] };
            cell.values = shares.map(|share| share * whole);
            cell.doubts = [(whole - all).abs() * (UNKNOWN + shares[0].min(shares[1])); 2];
            // Where all changes from place to place, its share is no plain mean.
            let (low, high) = range(&both);
            let uneven = if high > 0.0 { 1.0 - low / high } else { 1.0 };
            let (least, most) = range(&|c| if both(c) > 0.0 { c.factors[0] / both(c) } else { shares[0] });
            cell.least = [bend.max(KINK * uneven) * whole * (most - least); 2];
        } else {
            cell.least = [0, 1].map(|k| range(&|c| c.factors[k])).map(|(low, high)| bend * area * (high - low));
        }
        let times = if size.abs() == 1 << DEPTH { UNDIVIDED } else { 1.0 };
        for (k, share) in shares.into_iter().enumerate() {
            let f = |c: &Sight| c.factors[k] - share * both(c);
            cell.errors[k] = times * (area * (f(&centre) - mean(&f).0).abs() / 3.0).max(cell.least[k]);
        }
        let sees = |k: usize| corners.iter().chain([&centre]).map(|c| c.factors[k]).fold(0.0, f64::max);
        let (seen, hidden) = (sees(0), sees(1));
        match &cell.before {
            Before::Nothing => cell.clear(1),
            Before::All => cell.clear(0),
            Before::Some(list) => {
                let all = cell.values[0] + cell.values[1];
                let is_dark = seen < LITTLE * (seen + hidden);
                if is_dark && self.shaded.is_hidden(&places, list) {
                    cell.before = Before::All;
                    cell.clear(0);
                } else if hidden == 0.0 && self.shaded.is_clear(&places, list) {
                    cell.before = Before::Nothing;
                    cell.clear(1);
                } else {
                    let level = f64::from(size.abs()) / f64::from(1 << DEPTH);
                    let gap = GAP * all * level.powi(4) * (1.0 - MORE * seen / (seen + hidden)).max(0.0);
                    let shadow = if MORE * hidden < seen + hidden {
                        (area * (self.shaded.possible(&places, list) - MORE * hidden)).clamp(0.0, cell.values[0])
                    } else {
                        0.0
                    };
                    cell.doubts = cell.doubts.map(|d| d + gap + DOUBT * shadow);
                }
            }
            Before::Settled => {}
        }
        cell
    }

    /// The cells that together are all of it.
    fn whole(&mut self, list: &[u16]) -> Vec<Cell> {
        (0..self.frames.len()).map(|frame| self.cell(frame, [0, 0], 1 << DEPTH, list)).collect()
    }

    /// Whether next to nothing reaches a corner, all told, that reaches others: it lies in the plane of the other polygon.
    fn is_steep(&self) -> bool {
        let all = self.sights.values().map(|s| s.factors[0] + s.factors[1]);
        let (low, high) = all.fold((f64::INFINITY, 0.0f64), |(low, high), f| (low.min(f), high.max(f)));
        low < STEEP * high
    }

    /// A cell that is proven clear or blocked, exactly.
    fn settled(&mut self, cell: &Cell) -> Cell {
        let whole = self.shaded.whole(&self.corners(cell.frame, cell.at, cell.size));
        let values = if cell.before == Before::Nothing { [whole, 0.0] } else { [0.0, whole] };
        let errors = values.map(|v| CLOSED_FORM * v);
        Cell { values, errors, doubts: [0.0; 2], before: Before::Settled, ..cell.clone() }
    }

    fn divided(&mut self, cell: &Cell, list: &[u16]) -> [Cell; 4] {
        let ([x, y], half) = (cell.at, cell.size / 2);
        let last = if self.square { half } else { -half };
        let mut pieces = [([x, y], half), ([x + half, y], half), ([x, y + half], half), ([x + half, y + half], last)]
            .map(|(at, size)| self.cell(cell.frame, at, size, list));
        for k in 0..2 {
            let change = (pieces.iter().map(|p| p.values[k]).sum::<f64>() - cell.values[k]).abs();
            let changed = change.max(cell.changed[k] / 16.0);
            let most = if cell.size.abs() == 1 << DEPTH { f64::INFINITY } else { changed };
            for piece in &mut pieces {
                if !piece.is_proven(k) {
                    piece.errors[k] = piece.errors[k].clamp(0.25 * LEFT * change, most).max(piece.least[k]);
                }
                piece.changed[k] = changed;
            }
        }
        pieces
    }
}

impl Cell {
    /// One of the two is proven to be nothing.
    fn clear(&mut self, k: usize) {
        self.values[k] = 0.0;
        self.errors[k] = 0.0;
        self.doubts[k] = 0.0;
        self.least[k] = 0.0;
    }

    fn is_proven(&self, k: usize) -> bool {
        matches!((&self.before, k), (Before::Nothing, 1) | (Before::All, 0) | (Before::Settled, _))
    }

    fn error(&self, k: usize) -> f64 {
        self.errors[k] + self.doubts[k]
    }
}

/// Integrates over a convex polygon past the panels listed until the lesser of the two errors meets the tolerance, or
/// the cells run out; `whole` is the integral of both.
pub fn integrate(shape: &Facet, (whole, tolerance): (f64, f64), shaded: &mut impl Shaded, list: &[u16]) -> Integrals {
    let square = parallelogram(shape);
    let frames = match square {
        Some(frame) => vec![frame],
        None => shape.triangles().into_iter().map(|[a, b, c]| [a, b - a, c - a]).collect(),
    };
    let mut domain = Domain { square: square.is_some(), frames, shaded, is_known: false, sights: FxHashMap::default() };
    let mut cells = domain.whole(list);
    let sum = |cells: &[Cell]| cells.iter().map(|c| c.values[0] + c.values[1]).sum::<f64>();
    let mut missed = (sum(&cells) - whole).abs();
    if missed > MISS * tolerance || domain.is_steep() {
        (domain.is_known, missed) = (true, 0.0);
        cells = domain.whole(list);
    }
    loop {
        // A plain sum: along a kink parallel to an edge all cells err alike.
        let errors = [0, 1].map(|k| missed + cells.iter().map(|c| c.error(k)).sum::<f64>());
        let k = usize::from(errors[1] < errors[0]);
        let is_open = |c: &Cell| c.before != Before::Settled && c.size.abs() > 2;
        let largest = cells.iter().filter(|c| is_open(c)).map(|c| c.error(k)).fold(0.0, f64::max);
        if errors[k] <= tolerance || cells.len() > MOST || largest == 0.0 {
            let values = [0, 1].map(|k| cells.iter().map(|c| c.values[k]).sum());
            return Integrals { values, errors };
        }
        let mut next = Vec::with_capacity(4 * cells.len());
        for cell in cells {
            if !is_open(&cell) || cell.error(k) < 0.25 * largest {
                next.push(cell);
                continue;
            }
            match &cell.before {
                Before::Some(list) => next.extend(domain.divided(&cell, list)),
                _ => next.push(domain.settled(&cell)),
            }
        }
        cells = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A function of places alone that is visible, of two that reach each, and of which nothing is proven.
    struct Plain<F>(F);

    impl<F: Fn(DVec3) -> f64> Shaded for Plain<F> {
        fn sight(&mut self, x: DVec3, _: &[u16]) -> Sight {
            let seen = (self.0)(x);
            Sight { factors: [seen, 2.0 - seen], hiding: u64::MAX }
        }

        fn before(&mut self, _: &[DVec3], list: &[u16]) -> Before {
            Before::Some(list.into())
        }

        fn is_clear(&mut self, _: &[DVec3], _: &[u16]) -> bool {
            false
        }

        fn is_hidden(&mut self, _: &[DVec3], _: &[u16]) -> bool {
            false
        }

        fn possible(&mut self, _: &[DVec3], _: &[u16]) -> f64 {
            0.0
        }

        fn whole(&mut self, cell: &[DVec3]) -> f64 {
            Facet::new(cell.to_vec()).map_or(0.0, |cell| 2.0 * cell.area())
        }
    }

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
                    let found = integrate(
                        shape,
                        (2.0 * shape.area(), tolerance),
                        &mut Plain(|x: DVec3| (x.x + x.y - c).max(0.0)),
                        &[],
                    );
                    assert!(found.errors[0] <= tolerance);
                    all += 1;
                    missed += usize::from((found.values[0] - exact).abs() > found.errors[0].max(1e-14));
                }
            }
        }
        assert!(200 * missed <= all, "{missed} of {all}");
    }
}
