//! Moments: what parts far apart exchange, from their centres and second moments alone.
//!
//! With d from the centre of a part a to that of b, s = d², and the heights p = n_a · d and q = −n_b · d of either centre above
//! the other's plane, the kernel is p q/(π s²). It depends on the difference of two places alone, so its mean over both parts
//! is that at the centres and half its second derivatives times M_a + M_b, and so on. The second moments of a planar part are
//! M = u uᵀ + v vᵀ with two axes u and v in its plane, which M n = 0 leaves of the derivatives:
//!
//! π A_i F_ij/(A_i A_j) = s⁻² { p q + [p q (12 d·M d/s − 2 tr M) − 4 (q n_a·M_b d − p n_b·M_a d)]/s },  M = M_a + M_b.
//!
//! The next terms are third moments, of which parts that are symmetric about their centres have none, and fourth ones.

use super::clear::Exchange;
use super::cluster::LEAF;
use super::frame::Weighted;
use crate::lanes::{Lanes, Vectors, dot, everywhere, minus};
use glam::DVec3;

/// The error is at most this times (R/r)⁴ A_i A_j/(π r²), with the radius R of the larger part: twice the largest that was
/// found among random pairs (test in `clear`).
pub const CONSTANT: f64 = 3.0;

/// And this times (R/r)³ A_i A_j/(π r²) where a part is not symmetric.
pub const CONSTANT_SKEW: f64 = 0.8;

/// Parts with R/r above this are too near.
pub const NEAREST: f64 = 0.45;

/// A planar polygon by its moments.
#[derive(Clone, Copy, Debug)]
pub struct Moments {
    /// Centre.
    pub centre: DVec3,
    /// Unit normal.
    pub normal: DVec3,
    /// Area, m².
    pub area: f64,
    /// Radius about the centre.
    pub radius: f64,
    /// The second moments by area are the sum of the squares of these, m.
    pub axes: [DVec3; 2],
    /// Whether it is symmetric about its centre.
    pub is_symmetric: bool,
}

impl Moments {
    /// Second moments from the points of a rule that is exact for squares.
    pub fn axes(rule: &[Weighted], centre: DVec3, normal: DVec3) -> [DVec3; 2] {
        let (x, y) = normal.any_orthonormal_pair();
        let (mut xx, mut xy, mut yy, mut area) = (0.0, 0.0, 0.0, 0.0);
        for &[px, py, pz, weight] in rule {
            let off = DVec3::new(px, py, pz) - centre;
            let (u, v) = (x.dot(off), y.dot(off));
            (xx, xy, yy, area) = (xx + weight * u * u, xy + weight * u * v, yy + weight * v * v, area + weight);
        }
        // Cholesky's factors; of a sliver the first may be lost in rounding.
        let first = (xx / area).sqrt();
        let along = if first > 0.0 { xy / area / first } else { 0.0 };
        [first * x + along * y, (yy / area - along * along).max(0.0).sqrt() * y]
    }
}

/// The moments of four parts.
#[derive(Clone, Copy, Debug)]
pub struct Four {
    centre: Vectors,
    normal: Vectors,
    area: Lanes,
    radius: Lanes,
    axes: [Vectors; 2],
    /// Squares of both axes together.
    trace: Lanes,
    /// One where a part is not symmetric, else zero.
    skew: Lanes,
}

impl Four {
    /// Of one to four parts; the last one stands for those that are missing.
    pub fn new(of: &[&Moments]) -> Four {
        let number = |f: fn(&Moments) -> f64| Lanes(std::array::from_fn(|k| f(of[k.min(of.len() - 1)])));
        Four {
            centre: [number(|m| m.centre.x), number(|m| m.centre.y), number(|m| m.centre.z)],
            normal: [number(|m| m.normal.x), number(|m| m.normal.y), number(|m| m.normal.z)],
            area: number(|m| m.area),
            radius: number(|m| m.radius),
            axes: [
                [number(|m| m.axes[0].x), number(|m| m.axes[0].y), number(|m| m.axes[0].z)],
                [number(|m| m.axes[1].x), number(|m| m.axes[1].y), number(|m| m.axes[1].z)],
            ],
            trace: number(|m| m.axes[0].length_squared() + m.axes[1].length_squared()),
            skew: number(|m| f64::from(u8::from(!m.is_symmetric))),
        }
    }

    /// What each exchanges with a part, m², and a bound of the error; infinite where that is too near.
    #[inline(always)]
    fn exchange(&self, b: &Moments) -> (Lanes, Lanes) {
        let normal = everywhere(b.normal);
        let d = minus(everywhere(b.centre), self.centre);
        let by = Lanes::of(1.0) / dot(d, d);
        let (p, q) = (dot(self.normal, d), Lanes::of(0.0) - dot(normal, d));
        let ([u, v], [x, y]) = (self.axes, [everywhere(b.axes[0]), everywhere(b.axes[1])]);
        let (of_u, of_v, of_x, of_y) = (dot(u, d), dot(v, d), dot(x, d), dot(y, d));
        // n_a · M_b d and n_b · M_a d.
        let across_b = dot(self.normal, x) * of_x + dot(self.normal, y) * of_y;
        let across_a = dot(normal, u) * of_u + dot(normal, v) * of_v;
        let along = of_u * of_u + of_v * of_v + of_x * of_x + of_y * of_y;
        let trace = self.trace + Lanes::of(b.axes[0].length_squared() + b.axes[1].length_squared());
        let second = p * q * (Lanes::of(12.0) * along * by - Lanes::of(2.0) * trace)
            - Lanes::of(4.0) * (q * across_b - p * across_a);
        let scale = self.area * Lanes::of(b.area / std::f64::consts::PI) * by;
        let value = scale * by * (p * q + second * by);
        let radius = self.radius.max(Lanes::of(b.radius));
        let ratio = radius * radius * by;
        let skew = self.skew.max(Lanes::of(f64::from(u8::from(!b.is_symmetric))));
        let error = scale * ratio * (Lanes::of(CONSTANT) * ratio + Lanes::of(CONSTANT_SKEW) * skew * ratio.sqrt());
        let too_near = ratio - Lanes::of(NEAREST * NEAREST);
        (value, Lanes::above_zero(too_near, Lanes::of(f64::INFINITY), error))
    }
}

/// What the parts of a leaf exchange with one more, m², and bounds of the errors, infinite where that is too near.
#[derive(Clone, Copy, Debug)]
pub struct Far {
    values: [f64; LEAF],
    errors: [f64; LEAF],
}

impl Far {
    /// Of the parts of a leaf in fours, and one more.
    pub fn of(leaf: &[Four], to: &Moments) -> Far {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has it.
            return unsafe { avx2(leaf, to) };
        }
        all(leaf, to)
    }

    /// Of one of them.
    #[inline]
    pub fn exchange(&self, part: usize) -> Exchange {
        Exchange { value: self.values[part], error: self.errors[part] }
    }
}

/// Four lanes of a double are one register there.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn avx2(leaf: &[Four], to: &Moments) -> Far {
    all(leaf, to)
}

#[inline(always)]
fn all(leaf: &[Four], to: &Moments) -> Far {
    let mut far = Far { values: [0.0; LEAF], errors: [0.0; LEAF] };
    let (values, errors) = (far.values.as_chunks_mut::<4>().0, far.errors.as_chunks_mut::<4>().0);
    for ((four, value), error) in leaf.iter().zip(values).zip(errors) {
        let (Lanes(found), Lanes(off)) = four.exchange(to);
        (*value, *error) = (found, off);
    }
    far
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_trace::sampling::Random;

    /// Wide registers change nothing, bit for bit: leaves of one to sixteen parts, near and far, some skew.
    #[test]
    fn moments_are_the_same_in_wide_registers() {
        let mut random = Random::new(7);
        let mut unit = || 2.0 * random.next_unit() - 1.0;
        for n in (1..=LEAF).cycle().take(2000) {
            let mut moments = || {
                let mut vector = || DVec3::new(unit(), unit(), unit());
                let (centre, normal) = (4.0 * vector(), vector().normalize());
                let axes = [normal.cross(vector()), normal.cross(vector())];
                Moments { centre, normal, area: 1.0 + unit(), radius: 1.0 + unit(), axes, is_symmetric: unit() > 0.0 }
            };
            let (leaf, to): (Vec<Moments>, Moments) = ((0..n).map(|_| moments()).collect(), moments());
            let leaf: Vec<&Moments> = leaf.iter().collect();
            let fours: Vec<Four> = leaf.chunks(4).map(Four::new).collect();
            let (wide, plain) = (Far::of(&fours, &to), all(&fours, &to));
            assert_eq!(wide.values.map(f64::to_bits), plain.values.map(f64::to_bits));
            assert_eq!(wide.errors.map(f64::to_bits), plain.errors.map(f64::to_bits));
        }
    }
}
