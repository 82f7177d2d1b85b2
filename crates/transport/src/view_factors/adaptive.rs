//! Adaptive integration of what is visible and what is hidden over a polygon: cells with the largest errors are divided
//! into four, until the error is as asked. Corners of cells are corners of the next, so hardly anything is evaluated
//! twice.

use super::cell::{Cell, Domain, Piece, Shaded, Sights};
use super::clear::Exchange;

/// Share of the tolerance by which places may miss the closed form of all.
const MISS: f64 = 0.1;

/// Cells from which on nothing more is divided, whatever the error: some hundred thousand places, a tenth of a second.
const MOST: usize = 65_536;

/// What is asked of an integral.
#[derive(Clone, Copy)]
pub struct Goal {
    /// The integral of what is visible and what is hidden.
    pub whole: f64,
    /// The error that is allowed.
    pub tolerance: f64,
    /// Whether cells are divided until it is met; else the answer is none where the places at corners and centres of the
    /// pieces do not meet it.
    pub may_divide: bool,
}

/// Integrates over the pieces of a polygon past the panels listed until the error meets the tolerance, or the cells run out.
/// The answer is the integral of what is visible.
pub fn integrate(
    pieces: &[Piece],
    Goal { whole, tolerance, may_divide }: Goal,
    (shaded, sights): (&mut impl Shaded, &mut Sights),
    list: &[u16],
) -> Option<Exchange> {
    let is_steep = shaded.is_steep();
    if is_steep && !may_divide {
        return None;
    }
    let mut domain = Domain::new(pieces, shaded, sights);
    domain.limit = if may_divide { f64::INFINITY } else { tolerance };
    let mut cells = domain.whole(list, false);
    if cells.iter().all(Cell::is_hidden) {
        return Some(Exchange::default());
    }
    let mut missed = (cells.iter().map(|c| c.values[0] + c.values[1]).sum::<f64>() - whole).abs();
    if may_divide && (missed > MISS * tolerance || is_steep) {
        missed = 0.0;
        cells = domain.whole(list, true);
    }
    loop {
        // A plain sum: along a kink parallel to an edge all cells err alike.
        let error = missed + cells.iter().map(Cell::error).sum::<f64>();
        let largest = cells.iter().filter(|c| c.is_open()).map(Cell::error).fold(0.0, f64::max);
        if error <= tolerance || (may_divide && (cells.len() > MOST || largest == 0.0)) {
            return Some(Exchange { value: cells.iter().map(|c| c.values[0]).sum(), error });
        }
        if !may_divide {
            return None;
        }
        let mut next = Vec::with_capacity(4 * cells.len());
        for cell in cells {
            if cell.is_open() && cell.error() >= 0.25 * largest {
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
    use crate::view_factors::cell::List;
    use crate::view_factors::frame::Frame;
    use crate::view_factors::visible::Sight;
    use glam::DVec3;

    /// A function of places alone that is visible, of two that reach each, and of which nothing is proven.
    struct Plain<F>(F);

    impl<F: Fn(DVec3) -> f64> Shaded for Plain<F> {
        fn sight(&mut self, _: u16, x: DVec3, _: &[u16]) -> Sight {
            let seen = (self.0)(x);
            Sight::Partly { factors: [seen, 2.0 - seen], bodies: 1, how: u64::from(seen > 0.0) }
        }

        fn all(&mut self, _: DVec3) -> f64 {
            2.0
        }

        fn before(&mut self, _: &[DVec3], list: &[u16]) -> List {
            list.into()
        }

        fn is_clear(&mut self, _: &[DVec3], _: &[u16]) -> bool {
            false
        }

        fn possible(&mut self, _: &[DVec3], _: &[u16], _: u64) -> f64 {
            0.0
        }

        fn whole(&mut self, cell: &Frame) -> Exchange {
            Exchange { value: 2.0 * cell.area(), error: 0.0 }
        }

        fn is_steep(&self) -> bool {
            false
        }
    }

    /// Functions with kinks along slanting lines: the stated error holds the true one, and tolerances are met.
    #[test]
    fn kinks_are_integrated_as_well_as_stated() {
        let p = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let frame = |corners: &[DVec3]| Frame::of(corners)[0];
        let square = frame(&[p(0., 0.), p(1., 0.), p(1., 1.), p(0., 1.)]);
        let triangle = frame(&[p(0., 0.), p(1., 0.), p(0., 1.)]);
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
                    let mut plain = Plain(|x: DVec3| (x.x + x.y - c).max(0.0));
                    let mut sights = Sights::default();
                    sights.clear(&shape.corners());
                    let pieces = [Piece { frame: *shape, side: 0 }];
                    let goal = Goal { whole: 2.0 * shape.area(), tolerance, may_divide: true };
                    let found = integrate(&pieces, goal, (&mut plain, &mut sights), &[]).unwrap();
                    assert!(found.error <= tolerance);
                    all += 1;
                    missed += usize::from((found.value - exact).abs() > found.error.max(1e-14));
                }
            }
        }
        assert!(200 * missed <= all, "{missed} of {all}");
    }
}
