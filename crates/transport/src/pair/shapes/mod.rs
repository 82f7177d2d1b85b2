//! Form factors between analytic shapes: discs, ellipses, spheres and their caps, cylinders, cones, frusta, polygons and
//! differential elements, each of them also as a blocker (Howell, Mengüç and Siegel, "A catalog of radiation
//! configuration factors"; catalogue 16, 19, 21, 30).
//!
//! [`factor`] takes a closed form where there is one (`closed`) and else integrates the exact differential factor
//! (`view`) over one of the two shapes (`finite`). [`integrated`] skips the closed forms: the second of two
//! independent methods. [`flat`] holds the two-dimensional cases. Shapes may touch; they must not cut through one
//! another, and shapes that are far smaller than the nodes of the first rule are apart may be missed.
//!
//! ```
//! use glam::DVec3;
//! use radiosity_transport::pair::shapes::{Shape, factor};
//! let lower = Shape::disc(DVec3::ZERO, DVec3::Z, 1.0);
//! let upper = Shape::disc(DVec3::Z, -DVec3::Z, 1.0);
//! let f = factor(&lower, &upper, &[], 1e-10)?;
//! assert!((f.value - 0.381_966_011_250_105_15).abs() < 1e-10);
//! # Ok::<(), radiosity_transport::pair::shapes::ShapeError>(())
//! ```

mod blockers;
mod body;
mod closed;
mod curve;
mod element;
mod finite;
pub mod flat;
mod gauss;
mod hit;
mod outline;
#[cfg(test)]
mod sample;
mod shape;
mod strings;
mod view;

pub use blockers::Blockers;
pub use shape::{Facing, Shape, ShapeError};

use crate::pair::Factor;
use body::Body;

/// F from one shape to another past `blockers`, within `tolerance` of the true value.
///
/// `from` and `to` may be the same shape: what it sees of itself. The blockers are opaque from both sides.
///
/// # Errors
/// [`ShapeError`] where a shape is none, or the tolerance is not reached.
pub fn factor(from: &Shape, to: &Shape, blockers: &[Shape], tolerance: f64) -> Result<Factor, ShapeError> {
    let (from, to, blockers) = checked(from, to, blockers, tolerance)?;
    let to = to.as_ref().unwrap_or(&from);
    match closed::factor(&from, to, &blockers) {
        Some(factor) => finite::reached(factor, tolerance),
        None => finite::factor(&from, to, &blockers, tolerance),
    }
}

/// The same as [`factor`] by integration, even where a closed form is known: its independent check.
///
/// # Errors
/// [`ShapeError`] as for [`factor`].
pub fn integrated(from: &Shape, to: &Shape, blockers: &[Shape], tolerance: f64) -> Result<Factor, ShapeError> {
    let (from, to, blockers) = checked(from, to, blockers, tolerance)?;
    finite::factor(&from, to.as_ref().unwrap_or(&from), &blockers, tolerance)
}

/// The bodies of shapes; none for `to` where it is `from` itself.
fn checked(
    from: &Shape,
    to: &Shape,
    blockers: &[Shape],
    tolerance: f64,
) -> Result<(Body, Option<Body>, Vec<Body>), ShapeError> {
    if tolerance.is_nan() || tolerance <= 0.0 {
        return Err(ShapeError::Tolerance(tolerance));
    }
    if [to].into_iter().chain(blockers).any(|shape| matches!(shape, Shape::Element { .. })) {
        return Err(ShapeError::SeenElement);
    }
    let other = if from == to { None } else { Some(Body::new(to)?) };
    let blockers = blockers.iter().map(Body::new).collect::<Result<_, _>>()?;
    Ok((Body::new(from)?, other, blockers))
}
