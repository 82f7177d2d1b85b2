//! Shapes as something that stands between two points, for methods that ask by segments ([`crate::pair::Occlusion`]).

use glam::DVec3;

use super::body::Body;
use super::shape::{Shape, ShapeError};
use crate::pair::Occlusion;

/// Share of a segment at either end in which a hit is a touch: rounding of points on curved shapes.
const TOUCHING: f64 = 1e-9;

/// Opaque shapes; exact for each segment but for the touching ends.
#[derive(Clone, Debug, Default)]
pub struct Blockers {
    bodies: Vec<Body>,
}

impl Blockers {
    /// The shapes that stand in the way. What is seen as a point only stands in nobody's way.
    ///
    /// # Errors
    /// [`ShapeError`] where a shape is none.
    pub fn new(shapes: &[Shape]) -> Result<Blockers, ShapeError> {
        Ok(Blockers { bodies: shapes.iter().map(Body::new).collect::<Result<_, _>>()? })
    }
}

impl Occlusion for Blockers {
    fn is_clear(&self, a: DVec3, b: DVec3) -> bool {
        let length = a.distance(b);
        let Some(direction) = (b - a).try_normalize() else { return true };
        // Away from the end, so that where the segment touches its own start is not met.
        let from = a + TOUCHING * (b - a);
        let reach = length * (1.0 - 2.0 * TOUCHING);
        !self.bodies.iter().any(|body| body.hit(from, direction, false).is_some_and(|hit| hit.t < reach))
    }

    fn is_empty(&self) -> bool {
        self.bodies.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pair::shapes::Facing;

    #[test]
    fn segments_meet_spheres_discs_and_cylinders() {
        let sphere = Shape::Sphere { center: DVec3::ZERO, radius: 1.0, facing: Facing::Outside };
        let disc = Shape::disc(DVec3::new(0.0, 0.0, 3.0), DVec3::X + DVec3::Z, 0.5);
        let tube = Shape::cylinder(DVec3::new(4.0, 0.0, -1.0), DVec3::Z, 2.0, 0.5, Facing::Inside);
        let all = Blockers::new(&[sphere, disc, tube]).unwrap();
        let clear = |a: [f64; 3], b: [f64; 3]| all.is_clear(DVec3::from(a), DVec3::from(b));
        assert!(!clear([-2.0, 0.0, 0.0], [2.0, 0.0, 0.0]) && clear([-2.0, 0.0, 0.0], [-1.0, 0.0, 0.0]));
        assert!(!clear([0.0, 0.0, 2.0], [0.0, 0.0, 4.0]) && clear([0.6, 0.0, 2.0], [0.6, 0.0, 4.0]));
        // Through the open ends of a cylinder, and through its wall.
        assert!(clear([4.0, 0.0, -2.0], [4.0, 0.0, 2.0]) && !clear([4.0, 0.0, 0.0], [6.0, 0.0, 0.0]));
        assert!(clear([1.0, 0.0, 0.0], [3.5, 0.0, 0.0]), "from surface to surface");
        assert!(Blockers::default().is_empty() && !all.is_empty());
    }
}
