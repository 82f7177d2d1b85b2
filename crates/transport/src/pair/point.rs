//! Point to point: the kernel at the centroids times the area, F = A_j cos θ_i cos θ_j V/(π r²) (catalogue 15), and the
//! same with `to` taken for a disc that faces `from`, F = A_j cos θ_i cos θ_j V/(π r² + A_j) (Wallace, Elmquist and
//! Haines 1989, "A ray tracing algorithm for progressive radiosity"), which never exceeds one. V is one segment between
//! the centroids. Good for small facets far apart: for parallel unit squares at distances 1, 2, 5 and 10 off by 59, 16,
//! 2.7 and 0.7 %, as a disc by 21, 7.5, 1.4 and 0.35 %. The error that comes with each is a bound.

use super::sight::obstructed;
use super::smooth::{kernel, largest, spread, variation};
use super::{Factor, Occlusion, Pair};
use radiosity_scene::Facet;
use std::f64::consts::PI;

/// Point to point, plain or as a disc.
#[derive(Clone, Copy, Debug, Default)]
pub struct Point {
    /// Whether `to` is taken for a disc.
    pub is_disc: bool,
}

impl Pair for Point {
    fn factor(&self, from: &Facet, to: &Facet, occlusion: &dyn Occlusion) -> Factor {
        let (x, y) = (from.centroid(), to.centroid());
        let plain = to.area() * kernel(x, from.normal(), y, to.normal());
        let circle = PI * x.distance_squared(y);
        let value = if self.is_disc { plain * (circle / (circle + to.area())) } else { plain };
        // The bound holds for the plain form, and the forms differ by what they differ.
        let bound = variation(from, to, spread(from) + spread(to)) + (plain - value);
        let free = Factor { value, error: bound.min(value.max(largest(from, to) - value)) };
        if !occlusion.may_block(from, to) {
            return free;
        }
        obstructed(free, f64::from(u8::from(occlusion.is_clear(x, y))), from, to, occlusion)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pair::Unoccluded;
    use crate::pair::blockers::Blockers;
    use crate::pair::exact::exact;
    use crate::pair::polygons::{moved, rectangle};
    use glam::{DQuat, DVec3};
    use radiosity_trace::sampling::Random;

    fn above(height: f64) -> Facet {
        moved(&rectangle(1.0, 1.0).flipped(), DQuat::IDENTITY, DVec3::Z * height)
    }

    /// The percentages of the catalogue, and the error covers them.
    #[test]
    fn catalogue_15_parallel_squares() {
        let square = rectangle(1.0, 1.0);
        for (distance, plain, disc, digit) in
            [(1.0, 59.3, 20.8, 0.1), (2.0, 16.0, 7.5, 0.1), (5.0, 2.65, 1.36, 0.01), (10.0, 0.67, 0.35, 0.01)]
        {
            let truth = exact(&square, &above(distance));
            for (is_disc, percent) in [(false, plain), (true, disc)] {
                let factor = Point { is_disc }.factor(&square, &above(distance), &Unoccluded);
                let off = 100.0 * (factor.value / truth - 1.0);
                assert!((off - percent).abs() <= 0.51 * digit, "{distance}: {off} for {percent}");
                assert!((factor.value - truth).abs() <= factor.error, "{distance}: {factor:?}");
                // The bound tells something: it is within a few times of the truth.
                assert!(factor.error <= 12.0 * (factor.value - truth).abs(), "{distance}: {factor:?} {truth}");
            }
        }
    }

    /// Facets of any size, any turn, apart, near and touching.
    #[test]
    fn catalogue_15_the_error_is_a_bound() {
        let mut random = Random::new(2);
        let mut next = || random.next_unit();
        let mut seen = 0;
        for k in 0..3000 {
            let from = rectangle(0.2 + 2.0 * next(), 0.2 + 2.0 * next());
            let axis = DVec3::new(next() - 0.5, next() - 0.5, next() - 0.5).normalize();
            let turn = if k % 3 == 0 { DQuat::IDENTITY } else { DQuat::from_axis_angle(axis, 6.3 * next()) };
            let distance = 10f64.powf(2.0 * next() - 1.0);
            let shift = distance * DVec3::new(next() - 0.5, next() - 0.5, next());
            let to = moved(&rectangle(0.2 + 2.0 * next(), 0.2 + 2.0 * next()).flipped(), turn, shift);
            let truth = exact(&from, &to) / from.area();
            seen += usize::from(truth > 0.0);
            for is_disc in [false, true] {
                let factor = Point { is_disc }.factor(&from, &to, &Unoccluded);
                assert!((factor.value - truth).abs() <= factor.error * (1.0 + 1e-12), "{truth} {factor:?} {k}");
            }
        }
        assert!(seen > 1000, "{seen}");
    }

    /// A blocker that hides the centroids from each other, or all but them.
    #[test]
    fn partial_occlusion_shows_in_the_error() {
        let (from, to) = (rectangle(1.0, 1.0), above(4.0));
        let blocker = |low: f64, high: f64| {
            let size = high - low;
            Blockers::new([&moved(&rectangle(size, size), DQuat::IDENTITY, DVec3::new(low, low, 2.0))])
        };
        let free = exact(&from, &to);
        let behind = Point::default().factor(&from, &to, &blocker(0.25, 0.75));
        assert_eq!(behind.value, 0.0);
        assert!(behind.error >= free);
        let beside = Point::default().factor(&from, &to, &blocker(0.6, 1.0));
        assert!(beside.value > 0.0 && beside.error >= beside.value);
        let hidden = Point::default().factor(&from, &to, &blocker(-9.0, 9.0));
        assert!(hidden.value == 0.0 && hidden.error < 0.2 * free, "{hidden:?}");
    }
}
