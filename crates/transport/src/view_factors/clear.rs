//! Pairs with nothing between them: cubature where they are far apart, the closed form where they are not.
//!
//! A_i F_ij = ∫∫ cos θ_i cos θ_j/(π r²) dA_j dA_i by products of Gauss rules of order n on either part. Their error
//! falls as (R/r)^2n with the radius R of the larger part and the distance r of the centres; which n, or the closed
//! form, is decided pair by pair by what this leaves of the accuracy asked.

use super::frame::{Frame, ORDERS, Weighted};
use super::part::{Four, Part};
use super::visible::Plane;
use crate::pair::exact::exact;
use glam::DVec3;
use radiosity_scene::Facet;
use smallvec::SmallVec;

/// An exchange area A_i F_ij, m², and a bound of its error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Exchange {
    /// A_i F_ij = A_j F_ji.
    pub value: f64,
    /// Bound of the error.
    pub error: f64,
}

impl Exchange {
    /// What is visible is no more than the whole.
    pub fn within(self, whole: Exchange) -> Exchange {
        Exchange { value: self.value.clamp(0.0, whole.value), ..self }
    }
}

/// The error of order n is at most this times (R/r)^2n A_i A_j/(π r²): twice the largest that was found among random
/// pairs (test below).
const CONSTANT: [f64; ORDERS] = [2.0, 0.6, 0.6, 0.3];

/// Parts with R/r above this are too near for the expansion behind the bound.
const NEAREST: f64 = 0.45;

/// The closed form's relative rounding error, and its absolute one relative to the smaller area.
const CLOSED_FORM: [f64; 2] = [1e-11, 1e-13];

/// How the value was found: the order of the rule, or zero for the closed form.
pub type Order = usize;

/// A_i F_ij of two parts that see each other whole where they face each other at all; `tolerance` in m². `cut` says
/// that one reaches behind the other's plane.
pub fn clear(a: &Part, b: &Part, tolerance: f64, cut: bool) -> (Exchange, Order) {
    let bounds = Bounds {
        radius: a.radius.max(b.radius),
        squared: a.shape.centroid().distance_squared(b.shape.centroid()),
        areas: [a.shape.area(), b.shape.area()],
    };
    match bounds.order(tolerance).filter(|_| !cut) {
        Some((order, error)) => {
            let (from, to) = (plane_of(&a.shape), plane_of(&b.shape));
            (Exchange { value: cubature((a.rule(order), from), (b.fours(order), to)).max(0.0), error }, order)
        }
        None => (closed_form(&a.shape, &b.shape), 0),
    }
}

/// The same of a frame with unit `normal` and a part.
pub fn clear_frame(frame: &Frame, normal: DVec3, b: &Part, tolerance: f64) -> Exchange {
    let centre = frame.centre();
    let bounds = Bounds {
        radius: frame.corners().iter().map(|c| c.distance(centre)).fold(b.radius, f64::max),
        squared: centre.distance_squared(b.shape.centroid()),
        areas: [frame.area(), b.shape.area()],
    };
    match bounds.order(tolerance) {
        Some((order, error)) => {
            let from = (normal, normal.dot(centre));
            let value = cubature((&frame.rule(order), from), (b.fours(order), plane_of(&b.shape))).max(0.0);
            Exchange { value, error }
        }
        None => Facet::new(frame.corners().to_vec()).map_or(Exchange::default(), |shape| closed_form(&shape, &b.shape)),
    }
}

/// The closed form, whatever faces what.
pub fn closed_form(a: &Facet, b: &Facet) -> Exchange {
    let value = exact(a, b);
    let [relative, absolute] = CLOSED_FORM;
    Exchange { value, error: relative * value + absolute * a.area().min(b.area()) }
}

/// What the errors of rules go by.
struct Bounds {
    /// Radius of the larger.
    radius: f64,
    /// Distance of the centres, squared.
    squared: f64,
    areas: [f64; 2],
}

impl Bounds {
    /// The least order that meets a tolerance (m²), and the bound of its error.
    fn order(&self, tolerance: f64) -> Option<(Order, f64)> {
        let ratio = self.radius * self.radius / self.squared;
        if ratio >= NEAREST * NEAREST {
            return None;
        }
        let mut bound = self.areas[0] * self.areas[1] / (std::f64::consts::PI * self.squared);
        (1..=ORDERS).find_map(|order| {
            bound *= ratio;
            let error = CONSTANT[order - 1] * bound;
            (error <= tolerance).then_some((order, error))
        })
    }
}

fn plane_of(shape: &Facet) -> Plane {
    (shape.normal(), shape.normal().dot(shape.centroid()))
}

/// The product of two rules. The height of a point above the other's plane is the distance times the cosine there, and the
/// same for all pairs that the point is in.
fn cubature((from, (n_a, of_a)): (&[Weighted], Plane), (to, (n_b, of_b)): (&[Four], Plane)) -> f64 {
    let heights: SmallVec<[[f64; 4]; 4]> = to
        .iter()
        .map(|Four { at: [x, y, z], weights }| {
            std::array::from_fn(|k| weights[k] * (n_a.x * x[k] + n_a.y * y[k] + n_a.z * z[k] - of_a))
        })
        .collect();
    let mut sum = 0.0;
    for &[px, py, pz, w] in from {
        let mut inner = [0.0; 4];
        for (Four { at: [x, y, z], .. }, heights) in to.iter().zip(&heights) {
            for k in 0..4 {
                let (dx, dy, dz) = (x[k] - px, y[k] - py, z[k] - pz);
                let squared = dx * dx + dy * dy + dz * dz;
                inner[k] += heights[k] / (squared * squared);
            }
        }
        let height = n_b.dot(DVec3::new(px, py, pz)) - of_b;
        sum += w * height * ((inner[0] + inner[1]) + (inner[2] + inner[3]));
    }
    sum / std::f64::consts::PI
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_trace::sampling::Random;

    /// Random parallelograms and triangles, about a tenth of them as flat as slats.
    fn part(random: &mut Random, centre: DVec3) -> Part {
        let mut vector = || DVec3::from_array(std::array::from_fn(|_| 2.0 * random.next_unit() - 1.0));
        let (u, v) = (vector(), vector());
        let v = if vector().x > 0.8 { 0.2 * v } else { v };
        let corners = if vector().x > 0.0 { vec![-u - v, u - v, u + v, v - u] } else { vec![-u - v, u, v] };
        let size = corners.iter().map(|c| c.length()).fold(0.0, f64::max);
        let facet = Facet::new(corners.iter().map(|c| centre + *c / size).collect()).unwrap();
        Part::of(0, &facet).remove(0)
    }

    /// The bound holds for random pairs, at distances from the nearest allowed to ten times that.
    #[test]
    fn cubature_is_as_good_as_stated() {
        let mut random = Random::new(1);
        let mut worst = [0f64; ORDERS];
        let mut pairs = 0;
        while pairs < 20_000 {
            let distance = (1.0 + 9.0 * random.next_unit().powi(2)) / NEAREST;
            let direction = DVec3::from_array(std::array::from_fn(|_| 2.0 * random.next_unit() - 1.0)).normalize();
            let (a, b) = (part(&mut random, DVec3::ZERO), part(&mut random, distance * direction));
            let sees = |a: &Part, b: &Part| b.shape.corners().iter().all(|c| a.shape.height(*c) > 0.0);
            if !sees(&a, &b) || !sees(&b, &a) {
                continue;
            }
            pairs += 1;
            let radius = a.radius.max(b.radius);
            let squared = a.shape.centroid().distance_squared(b.shape.centroid());
            let mut bound = a.shape.area() * b.shape.area() / (std::f64::consts::PI * squared);
            let value = exact(&a.shape, &b.shape);
            for order in 1..=ORDERS {
                bound *= radius * radius / squared;
                let found = cubature((a.rule(order), plane_of(&a.shape)), (b.fours(order), plane_of(&b.shape)));
                let off = (found - value).abs() - CLOSED_FORM[0] * value;
                worst[order - 1] = worst[order - 1].max(off / bound);
            }
        }
        for (worst, constant) in worst.into_iter().zip(CONSTANT) {
            assert!(2.0 * worst >= 0.5 * constant && 1.5 * worst <= constant, "{worst} of {constant}");
        }
    }
}
