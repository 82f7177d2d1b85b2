//! The factor between two bodies of finite size: the differential factor of [`super::view`] integrated over one of them.
//!
//! A₁F₁₂ = ∫ F_dA₁→2 dA₁ = ∫ F_dA₂→1 dA₂, so either body may be the one that is integrated over: the one whose first
//! estimate is better, or the smaller one where the two disagree and so one of them has missed something. Where all
//! bodies share an axis, one turn about it is like any other and the integral runs along a meridian only.

use super::body::{Body, Place, common_axis};
use super::gauss::{Adaptive, Integral};
use super::shape::ShapeError;
use super::view::{Seen, View};
use crate::pair::Factor;

/// Places looked from before the tolerance is given up: seconds of work.
const MOST_PLACES: usize = 1_500_000;

/// Cells about a round body to start with. An odd number, so that their borders do not all lie in planes of symmetry.
const TURNS: usize = 3;

/// Error of a differential factor: rounding of a dozen contours.
pub(super) const ELEMENT_ERROR: f64 = 1e-13;

/// What is seen of `to` from places on `from`.
pub(super) fn view<'a>(from: &'a Body, to: &'a Body, blockers: &'a [Body]) -> View<'a> {
    let seen = |body: &'a Body| Seen { body, starts_on: from.shares_surface(body) };
    let mut all: Vec<Seen> = blockers.iter().map(seen).collect();
    if from.is_hollow() && !std::ptr::eq(from, to) {
        all.push(Seen { body: from, starts_on: true });
    }
    View { to: seen(to), blockers: all }
}

/// The integral over one body, being refined.
enum Side<'a> {
    Line(Adaptive<1, Box<dyn Fn(usize, [f64; 1]) -> f64 + 'a>>),
    Square(Adaptive<2, Box<dyn Fn(usize, [f64; 2]) -> f64 + 'a>>),
}

impl<'a> Side<'a> {
    fn new(from: &'a Body, to: &'a Body, blockers: &'a [Body]) -> Side<'a> {
        let view = view(from, to, blockers);
        let at = move |place: Place| place.area * view.factor(place.point, place.normal);
        let all: Vec<&Body> = [from, to].into_iter().chain(blockers).collect();
        match common_axis(&all) {
            Some(axis) => {
                let turned = from.about(axis);
                Side::Line(Adaptive::line(Box::new(move |_, [s]| at(turned.place(0, s, 0.0))), &[0.0, 1.0]))
            }
            None => {
                let charts = from.charts();
                let turns = if from.is_round() { TURNS } else { 1 };
                Side::Square(Adaptive::charts(Box::new(move |chart, [s, t]| at(from.place(chart, s, t))), charts, turns))
            }
        }
    }

    fn integral(&self) -> Integral {
        match self {
            Side::Line(line) => line.integral(),
            Side::Square(square) => square.integral(),
        }
    }

    fn refine(&mut self, tolerance: f64) -> Integral {
        match self {
            Side::Line(line) => line.refine(tolerance, MOST_PLACES),
            Side::Square(square) => square.refine(tolerance, MOST_PLACES),
        }
    }
}

/// F from one body to another by integration, to an absolute tolerance.
pub(super) fn factor(from: &Body, to: &Body, blockers: &[Body], tolerance: f64) -> Result<Factor, ShapeError> {
    if from.charts() == 0 {
        if !from.area.is_finite() {
            return Err(ShapeError::CannotEmit);
        }
        let value = view(from, to, blockers).factor(from.o, from.w);
        return reached(Factor { value, error: ELEMENT_ERROR }, tolerance);
    }
    let goal = tolerance * from.area;
    let mut side = Side::new(from, to, blockers);
    if to.charts() > 0 && !std::ptr::eq(from, to) {
        let other = Side::new(to, from, blockers);
        let (one, two) = (side.integral(), other.integral());
        let agree = (one.value - two.value).abs() <= one.error + two.error;
        if if agree { two.error < one.error } else { to.area < from.area } {
            side = other;
        }
    }
    let integral = side.refine(goal);
    let value = (integral.value / from.area).clamp(0.0, 1.0);
    reached(Factor { value, error: integral.error / from.area + ELEMENT_ERROR }, tolerance)
}

/// The factor, or that it is not good enough.
pub(super) fn reached(factor: Factor, tolerance: f64) -> Result<Factor, ShapeError> {
    if factor.error <= tolerance + ELEMENT_ERROR {
        Ok(factor)
    } else {
        Err(ShapeError::NotReached { value: factor.value, error: factor.error })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pair::shapes::{Facing, Shape};
    use glam::DVec3;

    #[test]
    fn dbg() {
        let wall = Body::new(&Shape::Frustum { base: DVec3::ZERO, axis: DVec3::Z, height: 1.5, radius_base: 2.0, radius_top: 1.0, facing: Facing::Inside }).unwrap();
        let view = view(&wall, &wall, &[]);
        let f = |s: f64| { let p = wall.place(0, s, 0.0); view.factor(p.point, p.normal) };
        for i in 1..200 {
            let s = i as f64 / 200.0;
            let e = 1e-4;
            let d2 = f(s + e) - 2.0 * f(s) + f(s - e);
            println!("{s} {} {d2:e}", f(s));
        }
    }
}
