//! Where a ray meets a body: planes, quadrics and outlines in their plane, in closed form.
//!
//! A quadric gives a t² + 2 b t + c = 0. A ray that starts on the quadric has c = 0 exactly: `starts_on` says so, for the
//! rounded c would put a false root where a grazing ray's true one lies.

use glam::{DVec2, DVec3};

use super::body::{Body, Kind};

/// Where a ray meets a body.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hit {
    /// Length of the ray; infinite at the sky.
    pub(super) t: f64,
    /// Whether the active side is met.
    pub(super) front: bool,
}

/// Positive roots of a t² + 2 b t + c, in order; infinity for none.
fn roots(a: f64, b: f64, c: f64) -> [f64; 2] {
    let none = f64::INFINITY;
    let root = b * b - a * c;
    if root < 0.0 {
        return [none; 2];
    }
    // The root of larger magnitude first, the other without cancellation.
    let q = -(b + root.sqrt().copysign(b));
    let [x, y] = [q / a, if q == 0.0 { none } else { c / q }].map(|t| if t > 0.0 { t } else { none });
    if x < y { [x, y] } else { [y, x] }
}

/// Whether a point lies in a polygon: an odd number of edges on its right.
fn contains(corners: &[DVec2], p: DVec2) -> bool {
    let mut inside = false;
    let mut a = corners[corners.len() - 1];
    for &b in corners {
        if (a.y > p.y) != (b.y > p.y) && p.x - a.x < (p.y - a.y) / (b.y - a.y) * (b.x - a.x) {
            inside = !inside;
        }
        a = b;
    }
    inside
}

/// Where a ray meets a triangle: the signed volumes that it makes with the edges are of one sign.
fn triangle_hit(corners: [DVec3; 3], p: DVec3, d: DVec3) -> Option<Hit> {
    let [a, b, c] = corners.map(|q| q - p);
    let volumes = [d.dot(b.cross(a)), d.dot(c.cross(b)), d.dot(a.cross(c))];
    let is_inside = volumes.iter().all(|v| *v >= 0.0) || volumes.iter().all(|v| *v <= 0.0);
    let normal = (b - a).cross(c - a);
    let (down, t) = (d.dot(normal), a.dot(normal) / d.dot(normal));
    (is_inside && t > 0.0 && t.is_finite()).then_some(Hit { t, front: down < 0.0 })
}

impl Body {
    /// The first place that the ray from `origin` along the unit vector `direction` meets.
    pub(super) fn hit(&self, origin: DVec3, direction: DVec3, starts_on: bool) -> Option<Hit> {
        let d = self.turned(direction);
        if let Kind::Sky = self.kind {
            return (d.z > 0.0).then_some(Hit { t: f64::INFINITY, front: true });
        }
        let p = self.local(origin);
        let in_plane = || {
            let t = -p.z / d.z;
            (t > 0.0 && t.is_finite()).then(|| (Hit { t, front: d.z < 0.0 }, (p + t * d).truncate()))
        };
        match &self.kind {
            Kind::Element | Kind::Sky => None,
            Kind::Plane => in_plane().map(|(hit, _)| hit),
            Kind::Polygon(corners) => in_plane().filter(|(_, at)| contains(corners, *at)).map(|(hit, _)| hit),
            Kind::Fan(corners) => {
                let triangles =
                    corners[1..].windows(2).filter_map(|pair| triangle_hit([corners[0], pair[0], pair[1]], p, d));
                triangles.min_by(|a, b| a.t.total_cmp(&b.t))
            }
            Kind::Ellipse { a, b, hole } => {
                let inside = |at: DVec2| (hole * hole..=1.0).contains(&(at / DVec2::new(*a, *b)).length_squared());
                in_plane().filter(|(_, at)| inside(*at)).map(|(hit, _)| hit)
            }
            Kind::Zone { radius, cos } => {
                let far = p.length();
                let c = if starts_on { 0.0 } else { (far - radius) * (far + radius) };
                let t = roots(1.0, p.dot(d), c)
                    .into_iter()
                    .find(|t| t.is_finite() && (*cos <= -1.0 || p.z + t * d.z >= radius * cos))?;
                Some(Hit { t, front: (p + t * d).dot(d) * self.sign < 0.0 })
            }
            Kind::Frustum { height, r0, r1 } => {
                let k = (r1 - r0) / height;
                self.cone_hit(p, d, [*r0, k], [0.0, *height], starts_on)
            }
            Kind::Tube { radius } => self.cone_hit(p, d, [*radius, 0.0], [f64::NEG_INFINITY, f64::INFINITY], starts_on),
        }
    }

    /// The first place on the cone of radius r₀ + k z between two heights.
    fn cone_hit(&self, p: DVec3, d: DVec3, [r0, k]: [f64; 2], [low, high]: [f64; 2], starts_on: bool) -> Option<Hit> {
        let (r, rho) = (r0 + k * p.z, p.truncate().length());
        let a = d.truncate().length_squared() - (k * d.z).powi(2);
        let b = p.truncate().dot(d.truncate()) - k * r * d.z;
        let c = if starts_on { 0.0 } else { (rho - r) * (rho + r) };
        let on = |t: f64| {
            let z = p.z + t * d.z;
            t.is_finite() && z >= low && z <= high && r0 + k * z >= 0.0
        };
        let t = roots(a, b, c).into_iter().find(|t| on(*t))?;
        let q = p + t * d;
        // The gradient of x² + y² − r² points outwards.
        let outwards = q.truncate().dot(d.truncate()) - k * (r0 + k * q.z) * d.z;
        Some(Hit { t, front: outwards * self.sign < 0.0 })
    }
}
