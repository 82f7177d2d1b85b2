//! What may exchange radiation besides polygons: the shapes of Howell's catalogue, as the user states them.
//!
//! Plain data; [`super::body::Body`] is what a shape becomes once it is checked. Every shape is opaque from both sides
//! and gives off and takes in on its active side only.

use glam::DVec3;
use radiosity_scene::Facet;

/// The active side of a curved shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facing {
    /// Away from the centre or the axis.
    Outside,
    /// Towards the centre or the axis.
    Inside,
}

/// A shape in space; lengths in metres. Directions need not be of unit length.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A surface so small that it has a place and a normal only. It can emit and not be seen.
    Element {
        /// Where it lies.
        position: DVec3,
        /// Its active side.
        normal: DVec3,
    },
    /// A planar polygon.
    Facet(Facet),
    /// A surface spanned over straight edges that need not lie in one plane, as a fan of triangles about the first corner;
    /// active on the side from which the corners run counter-clockwise. It can be seen and not emit.
    Fan(Vec<DVec3>),
    /// A disc, or an annulus where the inner radius is not zero.
    Disc {
        /// Its centre.
        center: DVec3,
        /// Its active side.
        normal: DVec3,
        /// Its outer radius.
        radius: f64,
        /// Radius of its hole; zero for a disc.
        inner_radius: f64,
    },
    /// A planar ellipse.
    Ellipse {
        /// Its centre.
        center: DVec3,
        /// Its active side.
        normal: DVec3,
        /// Direction of the first semi-axis, in the plane.
        axis: DVec3,
        /// The two semi-axes.
        semi_axes: [f64; 2],
    },
    /// A whole sphere.
    Sphere {
        /// Its centre.
        center: DVec3,
        /// Its radius.
        radius: f64,
        /// Its active side.
        facing: Facing,
    },
    /// The part of a sphere within an angle of an axis.
    Cap {
        /// Centre of the sphere.
        center: DVec3,
        /// From the centre to the middle of the cap.
        axis: DVec3,
        /// Radius of the sphere.
        radius: f64,
        /// Angle between the axis and the rim, radians, in (0, π).
        half_angle: f64,
        /// Its active side.
        facing: Facing,
    },
    /// The lateral surface of a right circular cylinder, cone or frustum, open at both ends.
    Frustum {
        /// Centre of the base.
        base: DVec3,
        /// From the base to the top.
        axis: DVec3,
        /// Distance from base to top.
        height: f64,
        /// Radius at the base; zero for a cone that stands on its apex.
        radius_base: f64,
        /// Radius at the top.
        radius_top: f64,
        /// Its active side.
        facing: Facing,
    },
    /// A circular cylinder without ends, active outside. It can be seen and not emit.
    Tube {
        /// A point of its axis.
        point: DVec3,
        /// Direction of the axis.
        axis: DVec3,
        /// Its radius.
        radius: f64,
    },
    /// A plane without bounds. It can be seen and not emit.
    Plane {
        /// One of its points.
        point: DVec3,
        /// Its active side.
        normal: DVec3,
    },
    /// The half of the sky about a direction, infinitely far off. It can be seen and not emit.
    Sky {
        /// Its zenith.
        up: DVec3,
    },
}

impl Shape {
    /// A disc without a hole.
    pub fn disc(center: DVec3, normal: DVec3, radius: f64) -> Shape {
        Shape::Disc { center, normal, radius, inner_radius: 0.0 }
    }

    /// The lateral surface of a cylinder.
    pub fn cylinder(base: DVec3, axis: DVec3, height: f64, radius: f64, facing: Facing) -> Shape {
        Shape::Frustum { base, axis, height, radius_base: radius, radius_top: radius, facing }
    }

    /// The lateral surface of a cone that opens along `axis`.
    pub fn cone(apex: DVec3, axis: DVec3, height: f64, radius: f64, facing: Facing) -> Shape {
        Shape::Frustum { base: apex, axis, height, radius_base: 0.0, radius_top: radius, facing }
    }

    /// The cap that covers this share of its sphere.
    pub fn cap_of_share(center: DVec3, axis: DVec3, radius: f64, share: f64, facing: Facing) -> Shape {
        Shape::Cap { center, axis, radius, half_angle: (1.0 - 2.0 * share).clamp(-1.0, 1.0).acos(), facing }
    }
}

/// Why a factor between shapes has no value.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// A coordinate or a size is NaN or infinite.
    #[error("the {0} is not finite")]
    NotFinite(&'static str),
    /// A size is zero or negative.
    #[error("the {what} must be positive, it is {value}")]
    NotPositive {
        /// Which size.
        what: &'static str,
        /// What it is.
        value: f64,
    },
    /// A direction has no length.
    #[error("the {0} has no direction: its length is zero")]
    NoDirection(&'static str),
    /// The hole of an annulus is as large as the annulus, or of negative size.
    #[error("the inner radius {inner} must lie between zero and the radius {radius}")]
    Hole {
        /// Radius of the hole.
        inner: f64,
        /// Outer radius.
        radius: f64,
    },
    /// An angle of a cap leaves nothing of the sphere, or all of it.
    #[error("the half angle {0} rad of a cap must lie between 0 and pi")]
    HalfAngle(f64),
    /// Nothing arrives at an element or leaves through one as a blocker.
    #[error("a differential element has no area: it can emit only; ask for the factor from it")]
    SeenElement,
    /// The mean over an unbounded shape is not defined, and none is made over a fan.
    #[error("an unbounded shape or a fan cannot emit; ask for the factor towards it")]
    CannotEmit,
    /// Too few corners for a surface.
    #[error("a fan has at least three corners, this one has {0}")]
    Corners(usize),
    /// A tolerance that is not a positive number.
    #[error("the tolerance must be positive, it is {0}")]
    Tolerance(f64),
    /// Three lengths that close no triangle, or tubes that overlap.
    #[error("these lengths do not fit together: {0}")]
    Lengths(&'static str),
    /// The integral did not reach the tolerance within its budget.
    #[error("the integral reached {value} within {error:e} only")]
    NotReached {
        /// The factor as far as it is known.
        value: f64,
        /// How far it may be off.
        error: f64,
    },
}
