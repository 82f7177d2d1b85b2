//! How much the kernel k = cos θ_i cos θ_j/(π r²) may vary over a pair of facets.
//!
//! With x and y about the centroids, a mean over both facets differs from the value at the centroids by the remainder of
//! Taylor's series: the first-order terms vanish, and |mean − k| ≤ ½ (m_i + m_j) max |∇²k|, m the mean squared distances
//! from the centroids. Where a plane cuts the other facet the kernel has a kink; there only its slope counts. The maxima
//! are taken at the least distance between the convex hulls.

use glam::DVec3;
use radiosity_scene::Facet;
use std::f64::consts::PI;

/// Largest |∇f| r³ and |∇²f| r⁴ of f = (u·r)(v·r)/r⁴ for unit u and v, both along r; other directions have less.
const SLOPE: f64 = 2.0;
const CURVATURE: f64 = 6.0;

/// The kernel between two points with their unit normals, 1/m².
pub fn kernel(x: DVec3, normal_x: DVec3, y: DVec3, normal_y: DVec3) -> f64 {
    let r = y - x;
    let squared = r.length_squared();
    let cosines = r.dot(normal_x).max(0.0) * -r.dot(normal_y).min(0.0);
    if squared > 0.0 { cosines / (PI * squared * squared) } else { 0.0 }
}

/// Largest value that F can have: all, or by reciprocity the share that the areas allow.
pub fn largest(from: &Facet, to: &Facet) -> f64 {
    (to.area() / from.area()).min(1.0)
}

/// Bound of |F − A_j k| for k at some points, whose mean squared distances from the points of the facets sum to `spread`,
/// m². Infinite where the facets may touch.
pub fn variation(from: &Facet, to: &Facet, spread: f64) -> f64 {
    let gap = gap(from, to);
    let bound =
        if is_cut(from, to) { SLOPE * spread.sqrt() / gap.powi(3) } else { 0.5 * CURVATURE * spread / gap.powi(4) };
    to.area() / PI * bound
}

/// Whether one facet reaches behind the other's plane, beyond rounding.
pub fn is_cut(from: &Facet, to: &Facet) -> bool {
    let cuts = |a: &Facet, b: &Facet| {
        let rounding = -1e-12 * (a.radius() + b.radius());
        b.corners().iter().any(|c| a.height(*c) < rounding)
    };
    cuts(from, to) || cuts(to, from)
}

/// Mean squared distance of a facet's points from its centroid, m².
pub fn spread(facet: &Facet) -> f64 {
    let triangle = |[a, b, c]: [DVec3; 3]| {
        let [a, b, c] = [a, b, c].map(|p| p - facet.centroid());
        let area = 0.5 * (b - a).cross(c - a).dot(facet.normal());
        area / 6.0 * (a.dot(a) + b.dot(b) + c.dot(c) + a.dot(b) + b.dot(c) + c.dot(a))
    };
    facet.triangles().into_iter().map(triangle).sum::<f64>() / facet.area()
}

/// A lower bound of the distance between the convex hulls of two facets: the widest of some gaps between planes.
pub fn gap(from: &Facet, to: &Facet) -> f64 {
    let between = |direction: DVec3| {
        let along = |f: &Facet, pick: fn(f64, f64) -> f64| {
            f.corners().iter().map(|c| c.dot(direction)).reduce(pick).unwrap_or(0.0)
        };
        let above = along(to, f64::min) - along(from, f64::max);
        let below = along(from, f64::min) - along(to, f64::max);
        above.max(below)
    };
    let axis = (to.centroid() - from.centroid()).normalize_or_zero();
    [axis, from.normal(), to.normal(), DVec3::X, DVec3::Y, DVec3::Z].map(between).into_iter().fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_trace::sampling::Random;

    fn direction(random: &mut Random) -> DVec3 {
        let mut next = || 2.0 * random.next_unit() - 1.0;
        DVec3::new(next(), next(), next()).normalize_or(DVec3::Z)
    }

    /// Slopes and curvatures by differences, for directions at random: below the constants, and not far below.
    #[test]
    fn the_kernel_varies_no_more_than_said() {
        let mut random = Random::new(5);
        let (mut slope, mut curvature): (f64, f64) = (0.0, 0.0);
        for _ in 0..20_000 {
            let [u, v, d] = [(); 3].map(|()| direction(&mut random));
            let f = |h: f64| {
                let r = DVec3::Z + h * d;
                u.dot(r) * v.dot(r) / r.length_squared().powi(2)
            };
            let h = 1e-3;
            slope = slope.max(((f(h) - f(-h)) / (2.0 * h)).abs());
            curvature = curvature.max(((f(h) - 2.0 * f(0.0) + f(-h)) / (h * h)).abs());
        }
        assert!(slope <= SLOPE && slope > 0.8 * SLOPE, "{slope}");
        assert!(curvature <= CURVATURE && curvature > 0.8 * CURVATURE, "{curvature}");
    }

    #[test]
    fn spread_and_gap_of_squares() {
        let square = |z: f64| {
            let corners = [[0., 0.], [1., 0.], [1., 1.], [0., 1.]];
            Facet::new(corners.iter().map(|[x, y]| DVec3::new(*x, *y, z)).collect()).unwrap()
        };
        assert!((spread(&square(0.0)) - 1.0 / 6.0).abs() < 1e-15);
        assert_eq!(gap(&square(0.0), &square(3.0)), 3.0);
        assert_eq!(gap(&square(0.0), &square(0.0)), 0.0);
    }
}
