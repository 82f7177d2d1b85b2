//! The differential factor F_dA→shape: Lambert's contour integral over the border of what is seen (Lambert 1760; Howell,
//! Mengüç and Siegel 2016, ch. 4), with anything in the way.
//!
//! The border of what is visible is made of outlines: of the shape, of what blocks it and of the horizon. All of them are
//! cut where they cross one another; each piece then counts +1, −1 or 0 as the shape is visible to its left, to its right,
//! or on both sides or neither, which two rays tell. No case of who covers whom is told apart, so none can be forgotten.
//! Fails where outlines run within [`ASIDE`] of one another: what lies between them is missed, a share of at most [`ASIDE`].

use std::f64::consts::TAU;

use glam::DVec3;

use super::body::{Body, Kind};
use super::curve::Curve;
use super::element;
use super::outline::Outlines;

/// How far beside a curve the two rays go, radians. Rounding of silhouettes spans 1e-15; what is narrower is not seen.
const ASIDE: f64 = 1e-9;

/// Cuts closer than this are one where the piece between them runs within [`THIN`] of another curve: a curve that touches
/// another is cut twice, apart by the root of the rounding, and the middle of the two is exact.
const TOUCH: f64 = 1e-4;

/// Separation of two curves, radians, that rounding may feign where they touch close to the eye.
const THIN: f64 = 1e-11;

/// Places along a piece at which its sides may be looked at; the first that is clear of other curves is taken.
const LOOKS: [f64; 5] = [0.5, 0.31, 0.73, 0.12, 0.91];

/// A body as seen from places on another one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen<'a> {
    pub(super) body: &'a Body,
    /// Whether rays start on its surface.
    pub(super) starts_on: bool,
}

/// What is looked at, and what may be in the way.
#[derive(Clone, Debug)]
pub(super) struct View<'a> {
    pub(super) to: Seen<'a>,
    pub(super) blockers: Vec<Seen<'a>>,
}

impl View<'_> {
    /// The share of what an element at `eye` gives off that arrives.
    pub(super) fn factor(&self, eye: DVec3, normal: DVec3) -> f64 {
        if self.blockers.is_empty() && !self.to.starts_on {
            let to = self.to.body;
            match &to.kind {
                Kind::Zone { radius, cos } if *cos <= -1.0 && to.sign > 0.0 => {
                    return element::sphere(to.o - eye, normal, *radius);
                }
                Kind::Polygon(corners) => return element::polygon(to, corners, eye, normal),
                _ => {}
            }
        }
        self.by_outlines(eye, normal)
    }

    /// The same by outlines, whatever the shape.
    pub(super) fn by_outlines(&self, eye: DVec3, normal: DVec3) -> f64 {
        let mut outlines = Outlines::default();
        outlines.curves.push(Curve::horizon(normal));
        for seen in std::iter::once(&self.to).chain(&self.blockers) {
            outlines.add(seen.body, eye, seen.starts_on);
        }
        let mut is_horizon = true;
        outlines.curves.retain(|curve| std::mem::take(&mut is_horizon) || !curve.is_below(normal));
        let Outlines { curves, marks } = outlines;

        let (mut sum, mut cuts, mut found) = (0.0, Vec::new(), Vec::new());
        for (k, curve) in curves.iter().enumerate() {
            // Cut the curve where others cross or touch it.
            cuts.clear();
            for (_, other) in curves.iter().enumerate().filter(|(j, _)| *j != k) {
                found.clear();
                curve.crossings(other, &mut found);
                cuts.extend(found.iter().map(|t| Cut { t: *t, exact: false }));
            }
            cuts.extend(marks.iter().filter_map(|mark| Some(Cut { t: curve.parameter(*mark)?, exact: true })));
            let is_thin = |t: f64| {
                let [d, _] = curve.frame(t);
                curves.iter().enumerate().any(|(j, other)| j != k && other.off(d) < THIN)
            };
            arrange(&mut cuts, curve.span, is_thin);
            for pair in cuts.windows(2).map(|pair| [pair[0].t, pair[1].t]) {
                let side = self.side(&curves, k, pair[0], pair[1], eye, normal);
                if side != 0.0 {
                    sum += side * curve.contour(normal, pair[0], pair[1]);
                }
            }
        }
        sum.clamp(0.0, 1.0)
    }

    /// 1 where the shape is visible to the left of a piece only, −1 to the right only, else 0.
    fn side(&self, curves: &[Curve], k: usize, t0: f64, t1: f64, eye: DVec3, normal: DVec3) -> f64 {
        let curve = &curves[k];
        let mut frame = [DVec3::ZERO; 2];
        let mut clear = false;
        for look in LOOKS {
            frame = curve.frame(t0 + look * (t1 - t0));
            clear = !curves.iter().enumerate().any(|(j, other)| j != k && other.off(frame[0]) < 3.0 * ASIDE);
            if clear {
                break;
            }
        }
        // A piece that runs along another counts once, with the first of them.
        if !clear && curves[..k].iter().any(|other| other.off(frame[0]) < 3.0 * ASIDE) {
            return 0.0;
        }
        let [d, left] = frame;
        let sees = |d: DVec3| f64::from(u8::from(d.dot(normal) > 0.0 && self.is_seen(eye, d.normalize())));
        sees(d + ASIDE * left) - sees(d - ASIDE * left)
    }

    /// Whether the first thing that a ray meets is the active side of the shape.
    fn is_seen(&self, eye: DVec3, direction: DVec3) -> bool {
        let Some(hit) = self.to.body.hit(eye, direction, self.to.starts_on) else { return false };
        let is_before = |seen: &Seen| seen.body.hit(eye, direction, seen.starts_on).is_some_and(|b| b.t < hit.t);
        hit.front && !self.blockers.iter().any(is_before)
    }
}

/// A place where a curve is cut.
#[derive(Clone, Copy, Debug)]
struct Cut {
    t: f64,
    /// Known as the place where curves touch, not found as a root.
    exact: bool,
}

/// Sorts the cuts of a curve, takes those together that mean one place, and adds the ends of the curve.
fn arrange(cuts: &mut Vec<Cut>, span: f64, is_thin: impl Fn(f64) -> bool) {
    cuts.sort_by(|a, b| a.t.total_cmp(&b.t));
    let is_one = |a: f64, b: f64| b - a <= f64::EPSILON || b - a < TOUCH && is_thin(0.5 * (a + b));
    if span < TAU {
        cuts.retain(|cut| cut.t > 0.0 && cut.t < span && !is_one(0.0, cut.t) && !is_one(cut.t, span));
    } else if let Some(first) = cuts.first().copied() {
        // Those just before a full turn belong to those just after its start.
        while let Some(last) = cuts.last().copied().filter(|last| cuts.len() > 1 && is_one(last.t - TAU, first.t)) {
            cuts.pop();
            cuts.insert(0, Cut { t: last.t - TAU, ..last });
        }
    }
    let (mut places, mut from) = (0, 0);
    while from < cuts.len() {
        let mut to = from + 1;
        while to < cuts.len() && is_one(cuts[to - 1].t, cuts[to].t) {
            to += 1;
        }
        let group = &cuts[from..to];
        let any_exact = group.iter().any(|cut| cut.exact);
        let (sum, count) =
            group.iter().filter(|cut| cut.exact == any_exact).fold((0.0, 0.0), |(s, n), c| (s + c.t, n + 1.0));
        cuts[places] = Cut { t: sum / count, exact: any_exact };
        places += 1;
        from = to;
    }
    cuts.truncate(places);
    match cuts.first().copied() {
        Some(first) if span >= TAU => cuts.push(Cut { t: first.t + TAU, ..first }),
        _ => {
            cuts.insert(0, Cut { t: 0.0, exact: true });
            cuts.push(Cut { t: span, exact: true });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pair::shapes::body::Body;
    use crate::pair::shapes::finite::view;
    use crate::pair::shapes::sample::Random;
    use crate::pair::shapes::shape::Shape;
    use std::f64::consts::TAU;

    /// Nusselt's analog taken literally: rays through even points of the unit disc below the hemisphere.
    fn nusselt(view: &View, eye: DVec3, normal: DVec3, n: usize) -> f64 {
        let (u, v) = normal.any_orthonormal_pair();
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let hits = (0..n).filter(|i| {
            let (r, turn) = (((*i as f64 + 0.5) / n as f64).sqrt(), TAU * (*i as f64 * golden).fract());
            let d = r * turn.cos() * u + r * turn.sin() * v + (1.0 - r * r).sqrt() * normal;
            view.is_seen(eye, d)
        });
        hits.count() as f64 / n as f64
    }

    /// Every kind of shape behind every kind of blocker, from any element: outlines and rays agree. The lattice is off by
    /// about the number of points that an outline of length 4 cuts, to the power ½, over n: 5e-4.
    #[test]
    fn catalogue_19_outlines_agree_with_the_projected_hemisphere() {
        let mut random = Random(5);
        let n = 40_000;
        let mut seen = 0;
        let mut worst = 0.0_f64;
        for draw in 0..240 {
            let towards = 2.4 * random.direction();
            let normal = (towards.normalize() + random.direction()).normalize();
            let element = Body::new(&Shape::Element { position: DVec3::ZERO, normal }).unwrap();
            let to = Body::new(&random.shape(draw / 9, towards, 1.2, -towards)).unwrap();
            let side = 0.3 * random.direction();
            let blockers: Vec<Body> = (0..draw % 3)
                .map(|i| random.shape(draw + i, 0.35 * towards + side, 0.3, towards))
                .map(|shape| Body::new(&shape).unwrap())
                .collect();
            let view = view(&element, &to, &blockers);
            let (outlines, rays) = (view.by_outlines(element.o, element.w), nusselt(&view, element.o, element.w, n));
            assert!((view.factor(element.o, element.w) - outlines).abs() < 1e-13, "{to:?}");
            worst = worst.max((outlines - rays).abs());
            seen += usize::from(outlines > 0.0);
        }
        assert!(seen > 150, "{seen}");
        assert!(worst < 1.5e-3, "{worst}");
    }
}
