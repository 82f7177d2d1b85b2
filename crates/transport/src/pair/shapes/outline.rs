//! The outlines of a body from a point: its rims and edges, and the silhouettes where its surface turns away.
//!
//! A sphere shows the circle in which the tangent cone touches it; a cone or cylinder the two lines along which a plane
//! through the eye touches: n(φ)·(x − P(φ)) = 0, so cos(φ − φₓ) = r(zₓ)/ρₓ with r the radius continued to the eye's height.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use super::body::{Body, Kind};
use super::curve::Curve;

/// Height of the eye over the plane of a rim, relative to its size, below which the rim is seen as part of a great circle.
/// The sliver neglected is of this width.
const IN_PLANE: f64 = 1e-10;

/// What is seen of a scene's outlines from a point.
#[derive(Clone, Debug, Default)]
pub(super) struct Outlines {
    pub(super) curves: Vec<Curve>,
    /// Directions in which two curves touch without crossing.
    pub(super) marks: Vec<DVec3>,
}

impl Outlines {
    fn edge(&mut self, from: DVec3, to: DVec3) {
        if let Some(curve) = Curve::edge(from, to) {
            self.marks.extend(curve.ends().into_iter().flatten());
            self.curves.push(curve);
        }
    }

    /// Adds the outlines of a body seen from `eye`, which may lie on it.
    pub(super) fn add(&mut self, body: &Body, eye: DVec3, starts_on: bool) {
        let p = body.local(eye);
        let relative = |q: DVec3| body.turned_back(q - p);
        match &body.kind {
            Kind::Element => {}
            Kind::Plane | Kind::Sky => self.curves.push(Curve::horizon(body.w)),
            Kind::Polygon(corners) => {
                let n = corners.len();
                for i in 0..n {
                    let [a, b] = [corners[i], corners[(i + 1) % n]];
                    self.edge(relative(a.extend(0.0)), relative(b.extend(0.0)));
                }
            }
            Kind::Fan(corners) => {
                for pair in corners[1..].windows(2) {
                    self.edge(relative(corners[0]), relative(pair[0]));
                    self.edge(relative(pair[0]), relative(pair[1]));
                }
                self.edge(relative(corners[corners.len() - 1]), relative(corners[0]));
            }
            Kind::Ellipse { a, b, hole } => {
                for size in [1.0, *hole].into_iter().filter(|s| *s > 0.0) {
                    self.curves.extend(Curve::ellipse(relative(DVec3::ZERO), a * size * body.u, b * size * body.v));
                }
            }
            Kind::Zone { radius, cos } => self.zone(body, p, *radius, *cos, starts_on),
            Kind::Frustum { height, r0, r1 } => {
                for (z, r) in [(0.0, *r0), (*height, *r1)].into_iter().filter(|(_, r)| *r > 0.0) {
                    self.rim(body, p, z, r);
                }
                let Some(sides) = silhouettes(p, r0 + (r1 - r0) / height * p.z, starts_on) else { return };
                for side in sides {
                    self.edge(relative(*r0 * side), relative(*r1 * side + *height * DVec3::Z));
                }
            }
            Kind::Tube { radius } => {
                for side in silhouettes(p, *radius, starts_on).into_iter().flatten() {
                    // Two quarters, as a half turn has no plane.
                    let foot = relative((*radius * side).truncate().extend(p.z));
                    self.edge(-body.w, foot);
                    self.edge(foot, body.w);
                }
            }
        }
    }

    fn zone(&mut self, body: &Body, p: DVec3, radius: f64, cos: f64, starts_on: bool) {
        let far = p.length();
        let rim = (radius * cos, radius * (1.0 - cos * cos).max(0.0).sqrt());
        if cos > -1.0 {
            self.rim(body, p, rim.0, rim.1);
        }
        if starts_on || far <= radius {
            return;
        }
        // The tangent cone touches in the plane q·p = R².
        let towards = p / far;
        let (a, b) = towards.any_orthonormal_pair();
        let size = radius * ((far - radius) * (far + radius)).sqrt() / far;
        let center = towards * (radius * radius / far) - p;
        self.curves.extend(Curve::ellipse(
            body.turned_back(center),
            body.turned_back(size * a),
            body.turned_back(size * b),
        ));
        let rho = p.truncate().length();
        let ratio = (radius * radius - rim.0 * p.z) / (rim.1 * rho);
        if cos > -1.0 && ratio.abs() <= 1.0 {
            let (middle, half) = (p.y.atan2(p.x), ratio.acos());
            for angle in [middle - half, middle + half] {
                let touch = DVec3::new(rim.1 * angle.cos(), rim.1 * angle.sin(), rim.0);
                self.marks.extend(body.turned_back(touch - p).try_normalize());
            }
        }
    }

    /// The circle of radius r about the axis at height z.
    fn rim(&mut self, body: &Body, p: DVec3, z: f64, r: f64) {
        let rho = p.truncate().length();
        if (p.z - z).abs() > IN_PLANE * (r + rho) {
            let center = body.turned_back(DVec3::new(0.0, 0.0, z) - p);
            self.curves.extend(Curve::ellipse(center, r * body.u, r * body.v));
        } else if rho < r {
            self.curves.push(Curve::horizon(body.w));
        } else if let Some([one, two]) = silhouettes(p, r, false) {
            let [from, to] = [one, two].map(|side| body.turned_back((r * side - p).truncate().extend(0.0)));
            self.edge(from, to);
        }
    }
}

/// Unit vectors from the axis to the two lines along which planes through the eye touch a cone of radius r at the eye's
/// height; `None` from within and from on it.
fn silhouettes(p: DVec3, r: f64, starts_on: bool) -> Option<[DVec3; 2]> {
    let rho = p.truncate().length();
    if starts_on || rho <= r.abs() {
        return None;
    }
    // asin keeps the digits of a small angle where the eye is close to the surface.
    let sine = ((rho - r) * (rho + r)).sqrt() / rho;
    let half = if r >= 0.0 { sine.min(1.0).asin() } else { 2.0 * FRAC_PI_2 - sine.min(1.0).asin() };
    let middle = p.y.atan2(p.x);
    Some([middle - half, middle + half].map(|t| DVec3::new(t.cos(), t.sin(), 0.0)))
}

impl Body {
    /// A direction of the frame in the world.
    pub(super) fn turned_back(&self, d: DVec3) -> DVec3 {
        d.x * self.u + d.y * self.v + d.z * self.w
    }
}
