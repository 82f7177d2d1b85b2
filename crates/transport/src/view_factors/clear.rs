//! Pairs with nothing between them: cubature where they are far apart, the closed form where they are not.
//!
//! A_i F_ij = ∫∫ cos θ_i cos θ_j/(π r²) dA_j dA_i by products of Gauss rules of order n on either part. Their error falls
//! as (R/r)^2n with the radius R of the larger part and the distance r of the centres; which n, or the closed form,
//! is decided pair by pair by what this leaves of the accuracy asked.

use super::part::{ORDERS, Part};
use crate::pair::exact::exact;
use glam::DVec3;

/// An exchange area A_i F_ij, m², and a bound of its error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Exchange {
    /// A_i F_ij = A_j F_ji.
    pub value: f64,
    /// Bound of the error.
    pub error: f64,
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
    let between = b.shape.centroid() - a.shape.centroid();
    let squared = between.length_squared();
    let radius = a.radius.max(b.radius);
    let ratio = radius * radius / squared;
    if !cut && ratio < NEAREST * NEAREST {
        let mut bound = a.shape.area() * b.shape.area() / (std::f64::consts::PI * squared);
        for order in 1..=ORDERS {
            bound *= ratio;
            let error = CONSTANT[order - 1] * bound;
            if error <= tolerance {
                return (Exchange { value: cubature(a, b, order), error }, order);
            }
        }
    }
    let value = exact(&a.shape, &b.shape);
    let [relative, absolute] = CLOSED_FORM;
    (Exchange { value, error: relative * value + absolute * a.shape.area().min(b.shape.area()) }, 0)
}

/// The product rule of an order.
fn cubature(a: &Part, b: &Part, order: usize) -> f64 {
    let (n_a, n_b) = (a.shape.normal(), b.shape.normal());
    let to = b.rule(order);
    let mut sum = 0.0;
    for &[x, y, z, w] in a.rule(order) {
        let from = DVec3::new(x, y, z);
        let mut inner = 0.0;
        for &[x, y, z, w] in to {
            let d = DVec3::new(x, y, z) - from;
            let squared = d.length_squared();
            inner += w * n_a.dot(d) * n_b.dot(d) / (squared * squared);
        }
        sum -= w * inner;
    }
    sum / std::f64::consts::PI
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_scene::Facet;
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
                let off = (cubature(&a, &b, order) - value).abs() - CLOSED_FORM[0] * value;
                worst[order - 1] = worst[order - 1].max(off / bound);
            }
        }
        for (worst, constant) in worst.into_iter().zip(CONSTANT) {
            assert!(2.0 * worst >= 0.5 * constant && 1.5 * worst <= constant, "{worst} of {constant}");
        }
    }
}
