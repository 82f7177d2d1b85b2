//! Factors between finite shapes that have a closed form (Howell's catalogue; numbers there), with nothing in the way:
//! coaxial discs (C-41), sphere and planar polygon or coaxial disc (C-121, C-127: the solid angle at the centre over 4π),
//! spheres in a sphere, parts of one sphere, and the inside of a cylinder, cone or frustum by closure with its openings
//! (C-78, C-111).

use std::f64::consts::PI;

use glam::DVec3;

use super::body::{Body, Kind};
use crate::pair::Factor;
use crate::polygon::solid_angle;

/// Lengths that agree to this share are one length: rounding of coordinates.
const SAME: f64 = 1e-13;

/// Error of a closed form, relative to its value plus that of what it is the difference of.
const ROUNDING: f64 = 1e-14;

/// The factor, where one of the forms applies.
pub(super) fn factor(from: &Body, to: &Body, blockers: &[Body]) -> Option<Factor> {
    let value = if blockers.is_empty() {
        forward(from, to).or_else(|| Some(forward(to, from)? * to.area / from.area))
    } else {
        self_of_hollow_sphere(from, to, blockers)
    }?;
    Some(Factor { value, error: ROUNDING * (1.0 + if from.area > 0.0 { to.area / from.area } else { 0.0 }).min(10.0) })
}

fn forward(from: &Body, to: &Body) -> Option<f64> {
    match (&from.kind, &to.kind) {
        (Kind::Ellipse { .. }, Kind::Ellipse { .. }) => discs(disc(from)?, disc(to)?),
        (Kind::Zone { radius, cos }, Kind::Polygon(corners)) if *cos <= -1.0 && from.sign > 0.0 => {
            let center = to.local(from.o);
            if center.z < *radius {
                return None;
            }
            // Signed by turn, so that a concave polygon may be a fan about any point: here the foot of the centre.
            let foot = DVec3::new(0.0, 0.0, -center.z);
            let at = |i: usize| corners[i % corners.len()].extend(0.0) - center;
            let part = |i: usize| {
                let (a, b) = (at(i), at(i + 1));
                solid_angle([foot, a, b]).copysign(a.truncate().perp_dot(b.truncate()))
            };
            Some((0..corners.len()).map(part).sum::<f64>() / (4.0 * PI))
        }
        (Kind::Zone { radius, cos }, Kind::Ellipse { .. }) if *cos <= -1.0 && from.sign > 0.0 => {
            let (center, normal, r) = disc(to)?;
            let (h, off) = ((from.o - center).dot(normal), (from.o - center).cross(normal).length());
            let share = r * r / (h.hypot(r) * (h + h.hypot(r)));
            (h >= *radius && off <= SAME * (h + r)).then_some(0.5 * share)
        }
        (Kind::Zone { radius: inner, cos: whole }, Kind::Zone { radius, cos }) => {
            if from.sign < 0.0 && to.sign < 0.0 && from.shares_surface(to) {
                // The kernel inside a sphere is constant.
                return Some(to.area / (4.0 * PI * radius * radius));
            }
            let is_within = *whole <= -1.0 && *cos <= -1.0 && from.o.distance(to.o) + inner <= *radius;
            (is_within && from.sign > 0.0 && to.sign < 0.0).then_some(1.0)
        }
        (Kind::Frustum { height, r0, r1 }, Kind::Frustum { .. }) if std::ptr::eq(from, to) && from.sign < 0.0 => {
            let across = coaxial(*r0, *r1, *height);
            let [bottom, top] = [PI * r0 * r0, PI * r1 * r1];
            Some(1.0 - (bottom + top - 2.0 * across) / from.area)
        }
        // From an opening to the wall: all that does not leave by the other opening.
        (Kind::Ellipse { .. }, Kind::Frustum { height, r0, r1 }) if to.sign < 0.0 => {
            let (center, normal, r) = disc(from)?;
            let size = height + r0.max(*r1);
            let is_opening = |z: f64, end: f64, side: f64| {
                (end - r).abs() <= SAME * size
                    && center.distance(to.o + z * to.w) <= SAME * size
                    && (normal - side * to.w).length() <= SAME
            };
            (is_opening(0.0, *r0, 1.0) || is_opening(*height, *r1, -1.0))
                .then(|| 1.0 - coaxial(*r0, *r1, *height) / from.area)
        }
        _ => None,
    }
}

/// Centre, normal and radius of what is a full disc.
fn disc(body: &Body) -> Option<(DVec3, DVec3, f64)> {
    match body.kind {
        Kind::Ellipse { a, b, hole } if a == b && hole == 0.0 => Some((body.o, body.w, a)),
        _ => None,
    }
}

/// A₁F₁₂ of coaxial discs h apart: (π/2)(s − √(s² − 4 r₁² r₂²)), s = r₁² + r₂² + h², without the cancellation.
fn coaxial(r1: f64, r2: f64, h: f64) -> f64 {
    let product = r1 * r2;
    if product == 0.0 {
        return 0.0;
    }
    let s = r1 * r1 + r2 * r2 + h * h;
    let root = ((h * h + (r1 - r2) * (r1 - r2)) * (h * h + (r1 + r2) * (r1 + r2))).sqrt();
    2.0 * PI * product * product / (s + root)
}

/// F of discs that face one another along one axis.
fn discs((c1, n1, r1): (DVec3, DVec3, f64), (c2, n2, r2): (DVec3, DVec3, f64)) -> Option<f64> {
    let across = c2 - c1;
    let h = across.dot(n1);
    let is_coaxial = (n1 + n2).length() <= SAME && across.cross(n1).length() <= SAME * (across.length() + r1 + r2);
    (is_coaxial && h > 0.0).then(|| coaxial(r1, r2, h) / (PI * r1 * r1))
}

/// What a hollow sphere sees of itself past one sphere in it, which sees nothing but the hollow one.
fn self_of_hollow_sphere(from: &Body, to: &Body, blockers: &[Body]) -> Option<f64> {
    let [blocker] = blockers else { return None };
    let (Kind::Zone { radius, cos }, Kind::Zone { radius: inner, cos: whole }) = (&from.kind, &blocker.kind) else {
        return None;
    };
    let fits = *cos <= -1.0 && *whole <= -1.0 && from.o.distance(blocker.o) + inner <= *radius;
    (std::ptr::eq(from, to) && from.sign < 0.0 && fits).then(|| 1.0 - blocker.area / from.area)
}
