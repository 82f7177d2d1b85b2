//! A curve that fills a box and keeps what is near together (Morton 1966, "A computer oriented geodetic data base"), mostly: where it leaves
//! an eighth of the box, neighbours on either side of the border may be far apart on it.

use glam::DVec3;

/// Bits of a number along each axis.
const BITS: u32 = 16;

/// A curve through a cube: a 65,536th of its side is not told apart.
pub struct Curve {
    low: DVec3,
    scale: f64,
}

impl Curve {
    /// Bits of a number; those above are free.
    pub const BITS: u32 = 3 * BITS;

    /// Through a cube whose lowest corner is that of a box from `low` to `high`, m, and whose side is the longest of that.
    pub fn new([low, high]: [DVec3; 2]) -> Curve {
        let extent = (high - low).max_element().max(f64::MIN_POSITIVE);
        Curve { low, scale: f64::from((1 << BITS) - 1) / extent }
    }

    /// Where on the curve a point lies, in [`Curve::BITS`]. What is outside the box lies where it is nearest.
    pub fn number(&self, point: DVec3) -> u64 {
        let most = DVec3::splat(f64::from((1 << BITS) - 1));
        let place = ((point - self.low) * self.scale).clamp(DVec3::ZERO, most).as_u64vec3().to_array();
        let mut number = 0;
        for bit in (0..BITS).rev() {
            for axis in place {
                number = number << 1 | axis >> bit & 1;
            }
        }
        number
    }

    /// The numbers of points, by the order in which the curve through all of them comes by.
    pub fn order(points: &[DVec3]) -> Vec<usize> {
        let nothing = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let bounds = points.iter().fold(nothing, |[low, high], p| [low.min(*p), high.max(*p)]);
        let curve = Curve::new(bounds);
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_by_cached_key(|&i| curve.number(points[i]));
        order
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The corners of a cube of eight cells come cell by cell, whatever their order was, and equals in that.
    #[test]
    fn what_is_near_comes_together() {
        let cells = [[0, 0, 0], [0, 0, 1], [0, 1, 0], [0, 1, 1], [1, 0, 0], [1, 0, 1], [1, 1, 0], [1, 1, 1]];
        let at = |cell: [i32; 3], shift: f64| DVec3::from(cell.map(f64::from)) * 2.0 + shift;
        let points: Vec<DVec3> = cells.iter().rev().flat_map(|c| [at(*c, 0.9), at(*c, 0.0), at(*c, 0.0)]).collect();
        let order = Curve::order(&points);
        let expected: Vec<usize> = (0..8).rev().flat_map(|c| [3 * c + 1, 3 * c + 2, 3 * c]).collect();
        assert_eq!(order, expected);
    }

    #[test]
    fn numbers_stay_within_their_bits() {
        let curve = Curve::new([DVec3::ZERO, DVec3::ONE]);
        let all = (1 << Curve::BITS) - 1;
        let numbers = [0.0, 1.0, 2.0, -1.0, f64::INFINITY].map(|x| curve.number(DVec3::splat(x)));
        assert_eq!(numbers, [0, all, all, 0, all]);
        // A single point has no extent, and none at all no bounds.
        assert_eq!(Curve::order(&[DVec3::ONE]), [0]);
        assert!(Curve::order(&[]).is_empty());
    }
}
