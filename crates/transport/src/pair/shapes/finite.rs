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

/// The integrand at a place of a chart.
type Integrand<'a, const N: usize> = Box<dyn Fn(usize, [f64; N]) -> f64 + 'a>;

/// The integral over one body, being refined.
enum Side<'a> {
    Line(Adaptive<1, Integrand<'a, 1>>),
    Square(Adaptive<2, Integrand<'a, 2>>),
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
                Side::Square(Adaptive::charts(
                    Box::new(move |chart, [s, t]| at(from.place(chart, s, t))),
                    charts,
                    turns,
                ))
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
    use crate::pair::shapes::sample::Random;
    use glam::DVec3;

    /// A₁F₁₂ integrated over one body is A₂F₂₁ integrated over the other, for every pair of kinds and with blockers: the
    /// two integrals share no point of view, no outline and no horizon.
    #[test]
    fn catalogue_30_reciprocity_of_every_pair_of_kinds() {
        let mut random = Random(11);
        let (mut seen, mut worst) = (0, 0.0_f64);
        for pair in 0..9 * 9 {
            let towards = DVec3::new(3.0, random.between(-1.0, 1.0), random.between(-1.0, 1.0));
            let one = Body::new(&random.shape(pair / 9, DVec3::ZERO, 1.0, towards)).unwrap();
            let two = Body::new(&random.shape(pair, towards, 1.3, -towards)).unwrap();
            let kind = (8.99 * random.next()) as usize;
            let blocker = Body::new(&random.shape(kind, 0.5 * towards, 0.35, towards)).unwrap();
            let blockers = if pair % 2 == 0 { vec![] } else { vec![blocker] };
            let tolerance = if pair % 2 == 0 { 1e-7 } else { 1e-5 };
            let mut a = Side::new(&one, &two, &blockers);
            let mut b = Side::new(&two, &one, &blockers);
            let (a, b) = (a.refine(tolerance * one.area), b.refine(tolerance * one.area));
            let off = (a.value - b.value).abs() / one.area;
            assert!(off <= (a.error + b.error) / one.area + 1e-10, "{pair}: {a:?} {b:?} {one:?} {two:?} {blockers:?}");
            worst = worst.max(off);
            seen += usize::from(a.value > 0.0);
        }
        assert!(seen > 50, "{seen}");
        assert!(worst < 1e-5, "{worst}");
    }
}
