//! What goes into the tree of boxes and what comes out.

use glam::Vec3;

/// A ray. It hits at distances `0 < t < t_max`.
///
/// A ray with a number that is not finite (other than `t_max`), or that starts more than 2^60 from the scene, hits
/// nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Where it goes, unit length.
    pub direction: Vec3,
    /// Hits lie before this distance; may be infinite.
    pub t_max: f32,
    /// A triangle that cannot be hit; `u32::MAX`: none.
    pub skip: u32,
}

/// Where a ray met a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the ray's origin.
    pub t: f32,
    /// Index of the triangle, as given to [`Tree::new`](crate::Tree::new).
    pub triangle: u32,
    /// Weight of corner 1.
    pub u: f32,
    /// Weight of corner 2.
    pub v: f32,
    /// The ray met the back: the side from which the corners run clockwise.
    pub back: bool,
}

impl Hit {
    /// Whether this hit counts before another, which lies at `other_key` on `other_triangle`.
    pub(crate) fn precedes(&self, tie: f32, other_key: f32, other_triangle: u32) -> bool {
        let key = self.key(tie);
        key < other_key || (key == other_key && self.triangle < other_triangle)
    }

    /// The distance by which hits compete: backs stand `tie` further away than they are.
    pub(crate) fn key(&self, tie: f32) -> f32 {
        if self.back { self.t + tie } else { self.t }
    }
}
