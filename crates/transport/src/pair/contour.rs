//! The contour double line integral by plain Gauss: 2π A_i F_ij = ∮∮ ln r dr_i·dr_j (Sparrow 1963, "A new and simpler
//! formulation for radiative angle factors"; catalogue 17), n points on every edge of one outline times n + 1 on every
//! edge of the other, so that no two coincide on a shared edge.
//!
//! Twelve digits for facets as far apart as they are wide; two where they share an edge, on which the logarithm is
//! singular and the error falls only like 1/n. The error is predicted from the rule of half as many points. Sees
//! nothing between: where something may stand there, the error says so. [`super::exact`] needs no points.

use super::exact::facing;
use super::gauss::{MOST, gauss};
use super::{Factor, Occlusion, Pair};
use glam::DVec3;
use radiosity_scene::Facet;
use std::f64::consts::TAU;

/// What the difference from half as many points is multiplied by: where the error falls like 1/n they are equal, but for
/// oscillations up to twice as much.
const SAFETY: f64 = 4.0;

/// The contour integral by Gauss.
#[derive(Clone, Copy, Debug)]
pub struct Contour {
    /// Points on an edge, at most 63.
    pub points: usize,
}

impl Default for Contour {
    /// Ten points: 1e-10 for unit squares at distance one.
    fn default() -> Self {
        Contour { points: 10 }
    }
}

impl Pair for Contour {
    fn factor(&self, from: &Facet, to: &Facet, occlusion: &dyn Occlusion) -> Factor {
        let Some([a, b]) = facing(from, to) else { return Factor::default() };
        let n = self.points.clamp(2, MOST - 1);
        let [value, coarse] = [n, n / 2].map(|n| integral(&a, &b, n) / from.area());
        let error = SAFETY * (value - coarse).abs() + 1e-14;
        let value = value.max(0.0);
        Factor { value, error: if occlusion.may_block(from, to) { value + error } else { error } }
    }
}

fn integral(a: &[DVec3], b: &[DVec3], n: usize) -> f64 {
    let edges =
        |c: &[DVec3]| -> Vec<[DVec3; 2]> { (0..c.len()).map(|i| [c[i], c[(i + 1) % c.len()] - c[i]]).collect() };
    let (of_a, of_b) = (edges(a), edges(b));
    let mut sum = 0.0;
    for [start_a, along_a] in &of_a {
        for [start_b, along_b] in &of_b {
            let mut inner = 0.0;
            for [s, weight_s] in gauss(n) {
                let p = *start_a + *s * *along_a;
                for [t, weight_t] in gauss(n + 1) {
                    let squared = p.distance_squared(*start_b + *t * *along_b).max(f64::MIN_POSITIVE);
                    inner += weight_s * weight_t * 0.5 * squared.ln();
                }
            }
            sum += along_a.dot(*along_b) * inner;
        }
    }
    sum / TAU
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pair::Unoccluded;
    use crate::pair::exact::exact;

    fn rectangle(origin: DVec3, u: DVec3, v: DVec3) -> Facet {
        Facet::new(vec![origin, origin + u, origin + u + v, origin + v]).unwrap()
    }

    #[test]
    fn catalogue_17_the_error_covers_facets_apart_and_touching() {
        let floor = rectangle(DVec3::ZERO, DVec3::X, DVec3::Y);
        let v = |x, y, z| DVec3::new(x, y, z);
        for (other, digits) in [
            (rectangle(DVec3::Z, DVec3::Y, DVec3::X), 1e-10),
            (rectangle(v(0., 0., 0.1), DVec3::Y, DVec3::X), 0.05),
            (rectangle(v(3., 2., 0.5), v(-0.2, 0.7, 0.1), v(-0.5, 0., 1.)), 1e-13),
            (rectangle(DVec3::ZERO, DVec3::Y, DVec3::Z), 1e-2),
            (rectangle(DVec3::ZERO, DVec3::Y, v(0.7, 0., 0.7)), 1e-2),
        ] {
            let truth = exact(&floor, &other);
            for points in [4, 8, 10, 20, 60] {
                let factor = Contour { points }.factor(&floor, &other, &Unoccluded);
                assert!((factor.value - truth).abs() <= factor.error, "{points}: {factor:?} for {truth}");
            }
            let off = (Contour::default().factor(&floor, &other, &Unoccluded).value - truth).abs();
            assert!(off < digits, "{off:e} {digits:e} {other:?}");
        }
    }
}
