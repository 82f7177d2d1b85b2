//! Frames: parallelograms and triangles, what convex polygons are integrated over.

use super::moments::Moments;
use crate::pair::gauss::gauss;
use glam::DVec3;
use smallvec::SmallVec;

/// The least order of a rule: points along an edge.
pub const LEAST: usize = 2;

/// How many there are, from this on.
pub const ORDERS: usize = 3;

/// A point and its share of the area, m².
pub type Weighted = [f64; 4];

/// A parallelogram or a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// A corner.
    pub origin: DVec3,
    /// The edges that begin there, to the next corner and to the last.
    pub edges: [DVec3; 2],
    /// Whether it is a parallelogram.
    pub is_square: bool,
}

/// Corners off a parallelogram by less than this, relative to its diagonal, are those of one.
const STRAIGHT: f64 = 1e-12;

impl Frame {
    /// A convex polygon as one parallelogram or as triangles.
    pub fn of(polygon: &[DVec3]) -> SmallVec<[Frame; 2]> {
        if let [a, b, c, d] = *polygon
            && (a + c - b - d).length() <= STRAIGHT * (c - a).length()
        {
            return SmallVec::from_slice(&[Frame { origin: a, edges: [b - a, d - a], is_square: true }]);
        }
        let origin = polygon[0];
        let triangle = |p: &[DVec3]| Frame { origin, edges: [p[0] - origin, p[1] - origin], is_square: false };
        polygon[1..].windows(2).map(triangle).collect()
    }

    /// The place at these shares of its edges.
    #[inline]
    pub fn place(&self, x: f64, y: f64) -> DVec3 {
        self.origin + x * self.edges[0] + y * self.edges[1]
    }

    /// Its corners, in turn.
    pub fn corners(&self) -> SmallVec<[DVec3; 4]> {
        let mut corners = SmallVec::new();
        corners.extend([self.origin, self.place(1.0, 0.0)]);
        if self.is_square {
            corners.push(self.place(1.0, 1.0));
        }
        corners.push(self.place(0.0, 1.0));
        corners
    }

    /// Centre of gravity.
    pub fn centre(&self) -> DVec3 {
        let share = if self.is_square { 0.5 } else { 1.0 / 3.0 };
        self.place(share, share)
    }

    /// Area, m².
    pub fn area(&self) -> f64 {
        self.edges[0].cross(self.edges[1]).length() * if self.is_square { 1.0 } else { 0.5 }
    }

    /// Its moments, with its unit normal.
    pub fn moments(&self, normal: DVec3) -> Moments {
        let (centre, [u, v]) = (self.centre(), self.edges);
        let radius = self.corners().iter().map(|c| c.distance(centre)).fold(0.0, f64::max);
        let axes = if self.is_square {
            [u, v].map(|edge| edge / 12f64.sqrt())
        } else {
            [(u - 0.5 * v) / 18f64.sqrt(), v / 24f64.sqrt()]
        };
        Moments { centre, normal, area: self.area(), radius, axes, is_symmetric: self.is_square }
    }

    /// Points of the rule of an order: of squares the product of Gauss's rules, of triangles one of
    /// no lower degree.
    pub fn rule(&self, order: usize) -> SmallVec<[Weighted; 16]> {
        let area = self.area();
        let at = |x: f64, y: f64, share: f64| {
            let p = self.place(x, y);
            [p.x, p.y, p.z, share * area]
        };
        let mut rule = SmallVec::new();
        if self.is_square {
            for [x, of_x] in gauss(order) {
                rule.extend(gauss(order).iter().map(|[y, of_y]| at(*x, *y, of_x * of_y)));
            }
            return rule;
        }
        let Triangle { centre, threes, sixes } = DUNAVANT[order - LEAST];
        for &[s, weight] in threes {
            let last = 1.0 - 2.0 * s;
            rule.extend([[s, last], [last, s], [s, s]].map(|[x, y]| at(x, y, weight)));
        }
        for &[s, t, weight] in sixes {
            let last = 1.0 - s - t;
            let places = [[s, t], [t, s], [s, last], [last, s], [t, last], [last, t]];
            rule.extend(places.map(|[x, y]| at(x, y, weight)));
        }
        if centre > 0.0 {
            rule.push(at(1.0 / 3.0, 1.0 / 3.0, centre));
        }
        rule
    }
}

/// A symmetric rule on triangles.
struct Triangle {
    /// Weight of the centroid.
    centre: f64,
    /// Barycentric a and weight of the three points (a, a, 1 − 2a).
    threes: &'static [[f64; 2]],
    /// Barycentric a, b and weight of the six points (a, b, 1 − a − b).
    sixes: &'static [[f64; 3]],
}

/// Degrees 4, 5 and 8 (Dunavant 1985): no less than Gauss's on squares.
const DUNAVANT: [Triangle; ORDERS] = [
    Triangle {
        centre: 0.0,
        threes: &[[0.445_948_490_915_965, 0.223_381_589_678_011], [0.091_576_213_509_771, 0.109_951_743_655_322]],
        sixes: &[],
    },
    Triangle {
        centre: 0.225,
        threes: &[[0.470_142_064_105_115, 0.132_394_152_788_506], [0.101_286_507_323_456, 0.125_939_180_544_827]],
        sixes: &[],
    },
    Triangle {
        centre: 0.144_315_607_677_787,
        threes: &[
            [0.459_292_588_292_723, 0.095_091_634_267_285],
            [0.170_569_307_751_760, 0.103_217_370_534_718],
            [0.050_547_228_317_031, 0.032_458_497_623_198],
        ],
        sixes: &[[0.263_112_829_634_638, 0.008_394_777_409_958, 0.027_230_314_174_435]],
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Rules are exact for polynomials of their degree: 3, 5 and 7.
    #[test]
    fn rules_integrate_their_degree() {
        let p = |x: f64, y: f64| DVec3::new(x, y, 1.0);
        let frame = |corners: &[DVec3]| Frame::of(corners)[0];
        let triangle = frame(&[p(0., 0.), p(1., 0.), p(0., 1.)]);
        let square = frame(&[p(0., 0.), p(1., 0.), p(1., 1.), p(0., 1.)]);
        let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
        for (order, degree) in [(2, 3), (3, 5), (4, 7)] {
            for a in 0..=degree {
                let b = degree - a;
                let sum = |frame: &Frame| -> f64 {
                    frame.rule(order).iter().map(|[x, y, _, w]| w * x.powi(a as i32) * y.powi(b as i32)).sum()
                };
                let exact = factorial(a) * factorial(b) / factorial(a + b + 2);
                assert!((sum(&triangle) - exact).abs() < 1e-13, "order {order}, x^{a} y^{b}");
                let exact = 1.0 / f64::from((a + 1) * (b + 1));
                assert!((sum(&square) - exact).abs() < 1e-13, "order {order}, x^{a} y^{b}");
            }
        }
    }
}
