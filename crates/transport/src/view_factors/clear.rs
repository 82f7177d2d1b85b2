//! Pairs with nothing between them: by their moments where they are far apart, cubature where they are nearer, the closed
//! form where they are near.
//!
//! A_i F_ij = ∫∫ cos θ_i cos θ_j/(π r²) dA_j dA_i by products of Gauss rules of order n on either part. Their error
//! falls as (R/r)^2n with the radius R of the larger part and the distance r of the centres; which n, or the closed
//! form, is decided pair by pair by what this leaves of the accuracy asked.

use super::frame::{Frame, LEAST, ORDERS, Weighted};
use super::moments::{self, Far, Moments, NEAREST};
use super::part::{Four, Part};
use super::visible::Plane;
use crate::pair::exact::exact_within;
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
const CONSTANT: [f64; ORDERS] = [0.6, 0.6, 0.3];

/// The closed form's relative rounding error, and its absolute one relative to the smaller area.
const CLOSED_FORM: [f64; 2] = [1e-11, 1e-13];

/// How the value was found: zero by the closed form, one by moments, else the order of the rule.
pub type Order = usize;

/// A_i F_ij of two parts that see each other whole where they face each other at all; `far` is what their moments tell, and
/// `tolerance` in m². `cut` says that one reaches behind the other's plane.
pub fn clear(a: &Part, b: &Part, far: Exchange, tolerance: f64, cut: bool) -> (Exchange, Order) {
    if far.error <= tolerance && !cut {
        return (Exchange { value: far.value.max(0.0), ..far }, 1);
    }
    match order([&a.moments, &b.moments], tolerance).filter(|_| !cut) {
        Some((order, error)) => {
            let from = a.rule(order).iter().flat_map(Four::points);
            let value = cubature((from, plane_of(&a.moments)), (b.rule(order), plane_of(&b.moments)));
            (Exchange { value: value.max(0.0), error }, order)
        }
        None => (closed_form(&a.shape, &b.shape, tolerance), 0),
    }
}

/// The same of a frame with unit `normal` and a part.
pub fn clear_frame(frame: &Frame, normal: DVec3, b: &Part, tolerance: f64) -> Exchange {
    let of_frame = frame.moments(normal);
    let far = Far::of(&[moments::Four::new(&[&of_frame])], &b.moments).exchange(0);
    if far.error <= tolerance {
        return Exchange { value: far.value.max(0.0), ..far };
    }
    match order([&of_frame, &b.moments], tolerance) {
        Some((order, error)) => {
            let from = frame.rule(order).into_iter();
            let value = cubature((from, plane_of(&of_frame)), (b.rule(order), plane_of(&b.moments))).max(0.0);
            Exchange { value, error }
        }
        None => Facet::new(frame.corners().to_vec())
            .map_or(Exchange::default(), |shape| closed_form(&shape, &b.shape, tolerance)),
    }
}

/// The closed form, whatever faces what; within a tolerance (m²) if its rounding allows.
pub fn closed_form(a: &Facet, b: &Facet, tolerance: f64) -> Exchange {
    let [value, rounding] = exact_within(a, b, tolerance);
    let [relative, absolute] = CLOSED_FORM;
    Exchange { value, error: rounding.max(relative * value + absolute * a.area().min(b.area())) }
}

/// The least order of a rule that meets a tolerance (m²), and the bound of its error.
fn order([a, b]: [&Moments; 2], tolerance: f64) -> Option<(Order, f64)> {
    let (radius, squared) = (a.radius.max(b.radius), a.centre.distance_squared(b.centre));
    let ratio = radius * radius / squared;
    if ratio >= NEAREST * NEAREST {
        return None;
    }
    let mut bound = a.area * b.area / (std::f64::consts::PI * squared) * ratio;
    CONSTANT.iter().zip(LEAST..).find_map(|(constant, order)| {
        bound *= ratio;
        let error = constant * bound;
        (error <= tolerance).then_some((order, error))
    })
}

fn plane_of(of: &Moments) -> Plane {
    (of.normal, of.normal.dot(of.centre))
}

/// The product of two rules. The height of a point above the other's plane is the distance times the cosine there, and the
/// same for all pairs that the point is in.
fn cubature((from, (n_a, of_a)): (impl Iterator<Item = Weighted>, Plane), (to, (n_b, of_b)): (&[Four], Plane)) -> f64 {
    let heights: SmallVec<[[f64; 4]; 4]> = to
        .iter()
        .map(|Four { at: [x, y, z], weights }| {
            std::array::from_fn(|k| weights[k] * (n_a.x * x[k] + n_a.y * y[k] + n_a.z * z[k] - of_a))
        })
        .collect();
    let mut sum = 0.0;
    for [px, py, pz, w] in from {
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
    use crate::pair::exact::exact;
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

    /// The bounds of rules and moments hold for random pairs, at distances from the nearest allowed to ten times that.
    #[test]
    fn cubature_and_moments_are_as_good_as_stated() {
        let mut random = Random::new(1);
        let (mut worst, mut far_worst) = ([0f64; ORDERS], [0f64; 2]);
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
            let bound = |power: f64| {
                let (radius, squared) =
                    (a.moments.radius.max(b.moments.radius), a.shape.centroid().distance_squared(b.shape.centroid()));
                a.shape.area() * b.shape.area() / (std::f64::consts::PI * squared)
                    * (radius * radius / squared).powf(power)
            };
            let value = exact(&a.shape, &b.shape);
            let off = |found: f64| (found - value).abs() - CLOSED_FORM[0] * value;
            for (order, worst) in (LEAST..).zip(&mut worst) {
                let from = (a.rule(order).iter().flat_map(Four::points), plane_of(&a.moments));
                let found = cubature(from, (b.rule(order), plane_of(&b.moments)));
                *worst = worst.max(off(found) / bound(order as f64));
            }
            let far = Far::of(&[moments::Four::new(&[&a.moments])], &b.moments).exchange(0);
            let are_symmetric = a.moments.is_symmetric && b.moments.is_symmetric;
            let (far_of, power) = if are_symmetric { (&mut far_worst[0], 2.0) } else { (&mut far_worst[1], 1.5) };
            *far_of = far_of.max(off(far.value) / bound(power));
            assert!(off(far.value) <= far.error);
        }
        let constants = CONSTANT.into_iter().chain([moments::CONSTANT, moments::CONSTANT_SKEW]);
        for (worst, constant) in worst.into_iter().chain(far_worst).zip(constants) {
            assert!(2.0 * worst >= 0.5 * constant && 1.5 * worst <= constant, "{worst} of {constant}");
        }
    }
}
