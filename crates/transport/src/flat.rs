//! Coordinates in a plane, for what is cut out of polygons there.

use glam::DVec3;

/// A polygon.
pub type Contour = Vec<[f64; 2]>;
/// An outline, counter-clockwise, and the holes in it.
pub type Shape = Vec<Contour>;

/// Coordinates in a plane about a place in it: no larger than what lies around that, so that areas keep their digits.
#[derive(Clone, Copy)]
pub struct Flat {
    origin: DVec3,
    x: DVec3,
    y: DVec3,
}

impl Flat {
    pub fn new(normal: DVec3, origin: DVec3) -> Flat {
        let (x, y) = normal.any_orthonormal_pair();
        Flat { origin, x, y }
    }

    pub fn flat(&self, p: DVec3) -> [f64; 2] {
        [self.x.dot(p - self.origin), self.y.dot(p - self.origin)]
    }

    pub fn back(&self, p: [f64; 2]) -> DVec3 {
        self.origin + p[0] * self.x + p[1] * self.y
    }
}

/// Twice the area of a polygon, negative if it goes clockwise.
pub fn twice_area(contour: &[[f64; 2]]) -> f64 {
    let n = contour.len();
    (0..n).map(|i| (contour[i], contour[(i + 1) % n])).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum()
}

/// The area of an outline less its holes.
pub fn shape_area(shape: &Shape) -> f64 {
    0.5 * shape.iter().map(|contour| twice_area(contour)).sum::<f64>()
}
