//! A checked shape in a frame of its own: area, axis of symmetry, and the charts over which it is integrated.
//!
//! Letters: `o` origin, (u, v, w) the orthonormal frame; w is the normal of what is planar and the axis of what is round.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::shape::{Facing, Shape, ShapeError};

/// How far two axes may be apart, relative to the size of what they carry, and still be one: rounding of coordinates.
/// A larger value would call shapes coaxial that are not, at an error of its own size.
const SAME: f64 = 1e-13;

/// What a body is, in its frame.
#[derive(Clone, Debug)]
pub(super) enum Kind {
    Element,
    /// Corners in the plane of u and v.
    Polygon(Vec<DVec2>),
    /// Corners in space, relative to the first.
    Fan(Vec<DVec3>),
    /// Semi-axes along u and v, and the size of the hole relative to the whole.
    Ellipse {
        a: f64,
        b: f64,
        hole: f64,
    },
    /// What lies at cos θ ≥ `cos` of a sphere, θ from w.
    Zone {
        radius: f64,
        cos: f64,
    },
    /// From radius `r0` at the origin to `r1` at `height` along w.
    Frustum {
        height: f64,
        r0: f64,
        r1: f64,
    },
    Tube {
        radius: f64,
    },
    Plane,
    Sky,
}

/// A checked shape.
#[derive(Clone, Debug)]
pub(super) struct Body {
    pub(super) kind: Kind,
    pub(super) o: DVec3,
    pub(super) u: DVec3,
    pub(super) v: DVec3,
    pub(super) w: DVec3,
    /// 1 where the active side is the outer or upper one, else −1.
    pub(super) sign: f64,
    /// m²; infinite for unbounded bodies, zero for an element.
    pub(super) area: f64,
    triangles: Vec<[DVec3; 3]>,
}

/// A place on a body: where, which way the active side looks, and the area per unit of the chart.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) point: DVec3,
    pub(super) normal: DVec3,
    pub(super) area: f64,
}

/// Rotations that leave a body as it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Symmetry {
    None,
    /// About every axis through a point.
    Point(DVec3),
    /// About one line.
    Line(DVec3, DVec3),
    /// About every line of this direction.
    Direction(DVec3),
}

fn finite(what: &'static str, v: DVec3) -> Result<DVec3, ShapeError> {
    if v.is_finite() { Ok(v) } else { Err(ShapeError::NotFinite(what)) }
}

fn direction(what: &'static str, v: DVec3) -> Result<DVec3, ShapeError> {
    finite(what, v)?.try_normalize().ok_or(ShapeError::NoDirection(what))
}

fn positive(what: &'static str, value: f64) -> Result<f64, ShapeError> {
    if !value.is_finite() {
        return Err(ShapeError::NotFinite(what));
    }
    if value > 0.0 { Ok(value) } else { Err(ShapeError::NotPositive { what, value }) }
}

fn sign(facing: Facing) -> f64 {
    if facing == Facing::Outside { 1.0 } else { -1.0 }
}

impl Body {
    /// The body of a shape.
    pub(super) fn new(shape: &Shape) -> Result<Body, ShapeError> {
        let body = |kind, o, w: DVec3, sign, area| {
            let (u, v) = w.any_orthonormal_pair();
            Body { kind, o, u, v, w, sign, area, triangles: Vec::new() }
        };
        Ok(match shape {
            Shape::Element { position, normal } => {
                body(Kind::Element, finite("position", *position)?, direction("normal", *normal)?, 1.0, 0.0)
            }
            Shape::Facet(facet) => {
                let mut made = body(Kind::Polygon(Vec::new()), facet.centroid(), facet.normal(), 1.0, facet.area());
                let flat = |p: DVec3| {
                    let p = p - made.o;
                    DVec2::new(p.dot(made.u), p.dot(made.v))
                };
                let corners: Vec<DVec2> = facet.corners().iter().map(|c| flat(*c)).collect();
                // Corners a little off the plane are moved into it, so that edges and area are of one surface.
                let lift = |p: DVec3| made.o + flat(p).x * made.u + flat(p).y * made.v;
                made.triangles = facet.triangles().iter().map(|t| t.map(lift)).collect();
                made.kind = Kind::Polygon(corners);
                made
            }
            Shape::Fan(corners) => {
                if corners.len() < 3 {
                    return Err(ShapeError::Corners(corners.len()));
                }
                let from = corners[0];
                let corners = corners.iter().map(|c| finite("corner", *c - from)).collect::<Result<_, _>>()?;
                let flat = body(Kind::Fan(corners), finite("corner", from)?, DVec3::Z, 1.0, f64::INFINITY);
                // The frame is the world's, so that corners need no turning.
                Body { u: DVec3::X, v: DVec3::Y, ..flat }
            }
            Shape::Disc { center, normal, radius, inner_radius } => {
                let (r, inner) = (positive("radius", *radius)?, *inner_radius);
                if !(0.0..r).contains(&inner) {
                    return Err(ShapeError::Hole { inner, radius: r });
                }
                let kind = Kind::Ellipse { a: r, b: r, hole: inner / r };
                body(
                    kind,
                    finite("center", *center)?,
                    direction("normal", *normal)?,
                    1.0,
                    PI * (r - inner) * (r + inner),
                )
            }
            Shape::Ellipse { center, normal, axis, semi_axes: [a, b] } => {
                let (a, b) = (positive("semi-axis", *a)?, positive("semi-axis", *b)?);
                let w = direction("normal", *normal)?;
                let axis = finite("axis", *axis)?;
                let u = direction("axis in the plane", axis - axis.dot(w) * w)?;
                let kind = Kind::Ellipse { a, b, hole: 0.0 };
                Body { u, v: w.cross(u), ..body(kind, finite("center", *center)?, w, 1.0, PI * a * b) }
            }
            Shape::Sphere { center, radius, facing } => {
                let radius = positive("radius", *radius)?;
                let kind = Kind::Zone { radius, cos: -1.0 };
                body(kind, finite("center", *center)?, DVec3::Z, sign(*facing), 4.0 * PI * radius * radius)
            }
            Shape::Cap { center, axis, radius, half_angle, facing } => {
                let radius = positive("radius", *radius)?;
                if !(*half_angle > 0.0 && *half_angle < PI) {
                    return Err(ShapeError::HalfAngle(*half_angle));
                }
                let kind = Kind::Zone { radius, cos: half_angle.cos() };
                let area = 4.0 * PI * (radius * (0.5 * half_angle).sin()).powi(2);
                body(kind, finite("center", *center)?, direction("axis", *axis)?, sign(*facing), area)
            }
            Shape::Frustum { base, axis, height, radius_base, radius_top, facing } => {
                let (height, r0, r1) = (positive("height", *height)?, *radius_base, *radius_top);
                positive("larger radius", r0.max(r1))?;
                if !(r0.is_finite() && r1.is_finite()) {
                    return Err(ShapeError::NotFinite("radius"));
                }
                if r0.min(r1) < 0.0 {
                    return Err(ShapeError::NotPositive { what: "smaller radius", value: r0.min(r1) });
                }
                let area = PI * (r0 + r1) * height.hypot(r1 - r0);
                let kind = Kind::Frustum { height, r0, r1 };
                body(kind, finite("base", *base)?, direction("axis", *axis)?, sign(*facing), area)
            }
            Shape::Tube { point, axis, radius } => {
                let kind = Kind::Tube { radius: positive("radius", *radius)? };
                body(kind, finite("point", *point)?, direction("axis", *axis)?, 1.0, f64::INFINITY)
            }
            Shape::Plane { point, normal } => {
                body(Kind::Plane, finite("point", *point)?, direction("normal", *normal)?, 1.0, f64::INFINITY)
            }
            Shape::Sky { up } => body(Kind::Sky, DVec3::ZERO, direction("zenith", *up)?, 1.0, f64::INFINITY),
        })
    }

    /// A point in the frame of the body.
    pub(super) fn local(&self, point: DVec3) -> DVec3 {
        self.turned(point - self.o)
    }

    /// A direction in the frame of the body.
    pub(super) fn turned(&self, d: DVec3) -> DVec3 {
        DVec3::new(d.dot(self.u), d.dot(self.v), d.dot(self.w))
    }

    /// A point of the frame in the world.
    pub(super) fn world(&self, p: DVec3) -> DVec3 {
        self.o + p.x * self.u + p.y * self.v + p.z * self.w
    }

    /// Whether the body can stand in the way of what leaves it.
    pub(super) fn is_hollow(&self) -> bool {
        self.sign < 0.0
    }

    /// Whether a place of one body lies on the surface that the other is cut from, so that rays leave it there.
    pub(super) fn shares_surface(&self, other: &Body) -> bool {
        match (&self.kind, &other.kind) {
            (Kind::Zone { radius: a, .. }, Kind::Zone { radius: b, .. }) => {
                (a - b).abs() <= SAME * a && self.o.distance(other.o) <= SAME * a
            }
            (Kind::Frustum { height: h, r0, r1 }, Kind::Frustum { height, r0: s0, r1: s1 }) => {
                // Both ends of the other lie on this cone.
                let size = r0.max(*r1) + h;
                let on = |z: f64, s: f64| {
                    let p = self.local(other.o + z * other.w);
                    p.truncate().length() <= SAME * size && (r0 + (r1 - r0) / h * p.z - s).abs() <= SAME * size
                };
                self.w.cross(other.w).length() <= SAME && on(0.0, *s0) && on(*height, *s1)
            }
            _ => false,
        }
    }

    /// Rotations that leave the body as it is.
    pub(super) fn symmetry(&self) -> Symmetry {
        match self.kind {
            Kind::Zone { cos, .. } if cos <= -1.0 => Symmetry::Point(self.o),
            Kind::Ellipse { a, b, .. } if a == b => Symmetry::Line(self.o, self.w),
            Kind::Zone { .. } | Kind::Frustum { .. } | Kind::Tube { .. } => Symmetry::Line(self.o, self.w),
            Kind::Plane | Kind::Sky => Symmetry::Direction(self.w),
            Kind::Element | Kind::Polygon(_) | Kind::Fan(_) | Kind::Ellipse { .. } => Symmetry::None,
        }
    }

    /// Size of the body, metres.
    fn size(&self) -> f64 {
        if self.area.is_finite() { self.area.sqrt() } else { 1.0 }
    }

    /// The same body with its axis along `axis`; only for what may be turned.
    pub(super) fn about(&self, axis: DVec3) -> Body {
        if matches!(self.symmetry(), Symmetry::Point(_)) {
            let (u, v) = axis.any_orthonormal_pair();
            return Body { u, v, w: axis, ..self.clone() };
        }
        self.clone()
    }

    /// Whether its chart runs about an axis.
    pub(super) fn is_round(&self) -> bool {
        matches!(self.kind, Kind::Ellipse { .. } | Kind::Zone { .. } | Kind::Frustum { .. })
    }

    /// Number of charts, each over the unit square.
    pub(super) fn charts(&self) -> usize {
        match &self.kind {
            Kind::Polygon(_) => self.triangles.len(),
            Kind::Element | Kind::Fan(_) | Kind::Tube { .. } | Kind::Plane | Kind::Sky => 0,
            _ => 1,
        }
    }

    /// The place at (s, t) of a chart. Where the body is round, t is the turn about its axis.
    pub(super) fn place(&self, chart: usize, s: f64, t: f64) -> Place {
        let (sin, cos) = (TAU * t).sin_cos();
        match &self.kind {
            Kind::Polygon(_) => {
                let [a, b, c] = self.triangles[chart];
                let point = a + s * (b - a) + s * t * (c - b);
                Place { point, normal: self.w, area: s * (b - a).cross(c - a).length() }
            }
            Kind::Ellipse { a, b, hole } => {
                let r = hole + (1.0 - hole) * s;
                let point = self.world(DVec3::new(a * r * cos, b * r * sin, 0.0));
                Place { point, normal: self.w, area: TAU * a * b * r * (1.0 - hole) }
            }
            Kind::Zone { radius, cos: rim } => {
                let most = rim.clamp(-1.0, 1.0).acos();
                let (sin_polar, cos_polar) = (most * s).sin_cos();
                let n = DVec3::new(sin_polar * cos, sin_polar * sin, cos_polar);
                let point = self.world(*radius * n);
                let normal = self.sign * (self.world(n) - self.o);
                Place { point, normal, area: TAU * most * radius * radius * sin_polar }
            }
            Kind::Frustum { height, r0, r1 } => {
                let (r, slant) = (r0 + (r1 - r0) * s, height.hypot(r1 - r0));
                let n = DVec3::new(height * cos, height * sin, r0 - r1) / slant;
                let point = self.world(DVec3::new(r * cos, r * sin, height * s));
                Place { point, normal: self.sign * (self.world(n) - self.o), area: TAU * r * slant }
            }
            // What cannot be integrated has no charts; an element is its one place.
            Kind::Element | Kind::Fan(_) | Kind::Tube { .. } | Kind::Plane | Kind::Sky => {
                Place { point: self.o, normal: self.w, area: 0.0 }
            }
        }
    }
}

/// The axis about which all bodies may be turned together, if there is one.
pub(super) fn common_axis(bodies: &[&Body]) -> Option<DVec3> {
    let symmetries: Vec<(Symmetry, f64)> = bodies.iter().map(|b| (b.symmetry(), b.size())).collect();
    let line = symmetries.iter().find_map(|(s, _)| if let Symmetry::Line(p, d) = s { Some((*p, *d)) } else { None });
    let points = || symmetries.iter().filter_map(|(s, _)| if let Symmetry::Point(p) = s { Some(*p) } else { None });
    let towards = symmetries.iter().find_map(|(s, _)| if let Symmetry::Direction(d) = s { Some(*d) } else { None });
    // A line of symmetry, else the line through two centres, else any line through the one centre.
    let (origin, axis) = line.or_else(|| {
        let first = points().next()?;
        let far = points().max_by(|a, b| a.distance(first).total_cmp(&b.distance(first)))?;
        Some((first, (far - first).try_normalize().or(towards).unwrap_or(DVec3::Z)))
    })?;
    let is_on = |p: DVec3, size: f64| (p - origin).cross(axis).length() <= SAME * (size + p.distance(origin));
    let is_along = |d: DVec3| d.cross(axis).length() <= SAME;
    let fits = symmetries.iter().all(|(s, size)| match s {
        Symmetry::None => false,
        Symmetry::Point(p) => is_on(*p, *size),
        Symmetry::Line(p, d) => is_on(*p, *size) && is_along(*d),
        Symmetry::Direction(d) => is_along(*d),
    });
    fits.then_some(axis)
}
