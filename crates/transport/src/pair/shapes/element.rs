//! Differential factors that need no outlines: the sphere (Howell B-43; Naraghi and Chung 1982) and the polygon (Lambert
//! 1760), neither with anything in the way. Both also stand as references for the general method in [`super::view`].

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::{DVec2, DVec3};

use super::body::Body;

/// From an element with unit `normal` to the sphere of this radius with its centre at `center` relative to it. With
/// H = h/R and the centre at θ from the normal: cos θ/H² above the horizon, the longer form where the horizon cuts.
pub(super) fn sphere(center: DVec3, normal: DVec3, radius: f64) -> f64 {
    let distance = center.length();
    let (h, cos) = (distance / radius, center.dot(normal) / distance);
    if distance <= radius || cos * h <= -1.0 {
        return 0.0;
    }
    if cos * h >= 1.0 {
        return cos / (h * h);
    }
    let sin = center.cross(normal).length() / distance;
    let tangent = ((distance - radius) * (distance + radius)).sqrt() / radius;
    let unit = |x: f64| x.clamp(-1.0, 1.0);
    let root = ((1.0 - h * cos) * (1.0 + h * cos)).max(0.0).sqrt();
    let outer = 0.5 - FRAC_1_PI * unit(tangent / (h * sin)).asin();
    let inner = cos * unit(-tangent * cos / sin).acos() - tangent * root;
    (outer + FRAC_1_PI * inner / (h * h)).max(0.0)
}

/// From an element to the active side of a polygon: the contour of what is left of it above the horizon.
pub(super) fn polygon(body: &Body, corners: &[DVec2], eye: DVec3, normal: DVec3) -> f64 {
    let p = body.local(eye);
    if p.z <= 0.0 {
        return 0.0;
    }
    let n = body.turned(normal);
    let at = |i: usize| corners[i % corners.len()].extend(0.0) - p;
    let mut sum = 0.0;
    // Along the horizon the contour advances by the angle between where the outline sinks and where it rises again;
    // pieces of a concave outline cancel as they must, once all of them close through the same point of the horizon.
    let mut sunk: Option<DVec3> = None;
    let mut first_rise = None;
    for i in 0..corners.len() {
        let (a, b) = (at(i), at(i + 1));
        let (ha, hb) = (a.dot(n), b.dot(n));
        if ha <= 0.0 && hb <= 0.0 {
            continue;
        }
        let cross = || a + ha / (ha - hb) * (b - a);
        let (from, to) = (if ha <= 0.0 { cross() } else { a }, if hb <= 0.0 { cross() } else { b });
        if ha <= 0.0 {
            match sunk.take() {
                Some(s) => sum += edge(s, from, n),
                None => first_rise = Some(from),
            }
        }
        sum += edge(from, to, n);
        if hb <= 0.0 {
            sunk = Some(to);
        }
    }
    if let (Some(s), Some(rise)) = (sunk, first_rise) {
        sum += edge(s, rise, n);
    }
    (sum / TAU).clamp(0.0, 1.0)
}

/// Γ·n of one edge of an outline that runs counter-clockwise about the polygon's normal, towards the eye.
fn edge(a: DVec3, b: DVec3, n: DVec3) -> f64 {
    let cross = (b - a).cross(a);
    let sine = cross.length();
    if sine > 0.0 { sine.atan2(a.dot(b)) / sine * cross.dot(n) } else { 0.0 }
}
