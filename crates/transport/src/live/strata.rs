//! Which rays of an element may meet a box, without looking at each.
//!
//! The points that rays are drawn from are a (0, 2)-sequence: of the first 4^s, each of 2^s × 2^s cells of the unit square
//! has exactly one, and scrambling permutes the cells ([`Sequence::intervals`]). A cell's directions lie in a cone, the
//! same for all elements in their own frames. So an element tests 2^2s cones against the ball around the box and knows the
//! numbers of the few rays that may meet it; for a chair in a room that is one ray in some thirty.

use glam::DVec3;
use radiosity_trace::sampling::{Sequence, cosine_direction, strata};

/// Most cells along a side: 256 cones are tested in the time of two rays.
const MOST_BITS: u32 = 4;

/// Added to the angles of cones, radians, for what lies between the places where they were measured, and for rounding.
const MARGIN: f64 = 0.02;

/// The cells of the unit square, for rows of a certain number of rays.
#[derive(Clone, Debug)]
pub struct Strata {
    bits: u32,
    /// Axes of the cones, by axis and cell.
    axis: [Vec<f32>; 3],
    /// Cosine and sine of the cones' half angles.
    angle: [Vec<f32>; 2],
    /// Rays by cell before scrambling.
    rays: Vec<Vec<u32>>,
}

/// Cells that may hold rays towards something.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cells([u64; 4]);

impl Cells {
    /// All there are.
    pub const ALL: Cells = Cells([u64::MAX; 4]);

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0 == [0; 4]
    }
}

impl Strata {
    /// For rows of `rays` rays, a power of two.
    pub fn new(rays: u32) -> Strata {
        let bits = (rays.trailing_zeros() / 2).min(MOST_BITS);
        let side = 1usize << bits;
        let mut all =
            Strata { bits, axis: Default::default(), angle: Default::default(), rays: vec![Vec::new(); side * side] };
        let frame = [DVec3::X, DVec3::Y, DVec3::Z];
        const STEPS: usize = 16;
        for cell in 0..side * side {
            let (a, b) = (cell % side, cell / side);
            let at = |i: usize, j: usize| {
                let coordinate = |cell: usize, k: usize| (cell as f64 + k as f64 / STEPS as f64) / side as f64;
                cosine_direction(&frame, coordinate(a, i), coordinate(b, j))
            };
            let places = || (0..=STEPS).flat_map(|j| (0..=STEPS).map(move |i| (i, j)));
            let axis = places().map(|(i, j)| at(i, j)).sum::<DVec3>().normalize();
            let half = places().map(|(i, j)| at(i, j).dot(axis).clamp(-1.0, 1.0).acos()).fold(0.0, f64::max) + MARGIN;
            for (list, x) in all.axis.iter_mut().zip(axis.to_array()) {
                list.push(x as f32);
            }
            all.angle[0].push(half.cos() as f32);
            all.angle[1].push(half.sin() as f32);
        }
        for ray in 0..rays {
            let [a, b] = strata(ray, bits);
            all.rays[usize::from(b) * side + usize::from(a)].push(ray);
        }
        all
    }

    /// Adds the cells whose directions, in an element's frame, come within an angle of a direction.
    pub fn towards(&self, direction: DVec3, (cosine, sine): (f64, f64), cells: &mut Cells) {
        let [x, y, z] = direction.as_vec3().to_array();
        let (cosine, sine) = (cosine as f32, sine as f32);
        let n = self.angle[0].len();
        let [ax, ay, az] = [0, 1, 2].map(|k| &self.axis[k][..n]);
        let [ca, sa] = [0, 1].map(|k| &self.angle[k][..n]);
        for (word, first) in (0..n).step_by(64).enumerate() {
            let mut bits = 0u64;
            for k in 0..64.min(n - first) {
                let i = first + k;
                let toward = ax[i] * x + ay[i] * y + az[i] * z;
                // cos of the sum of both angles; where that is above a half turn everything is within it, and the cosine of
                // the difference would be no bound: sines are not negative, so that only happens past a half turn.
                let limit = cosine * ca[i] - sine * sa[i];
                let wide = cosine * sa[i] + sine * ca[i] <= 0.0;
                bits |= u64::from(toward >= limit || wide) << k;
            }
            cells.0[word] |= bits;
        }
    }

    /// Calls back with the numbers of the rays of a sequence that were drawn from cells.
    pub fn rays(&self, cells: &Cells, sequence: &Sequence, mut visit: impl FnMut(u32)) {
        let side = 1usize << self.bits;
        let to = sequence.intervals(self.bits);
        let mut from = [[0u8; 32]; 2];
        for d in 0..2 {
            for k in 0..side {
                from[d][usize::from(to[d][k])] = k as u8;
            }
        }
        for (word, bits) in cells.0.iter().enumerate() {
            let mut bits = *bits;
            while bits != 0 {
                let cell = word * 64 + bits.trailing_zeros() as usize;
                bits &= bits - 1;
                if cell >= side * side {
                    break;
                }
                let (a, b) = (from[0][cell % side], from[1][cell / side]);
                for ray in &self.rays[usize::from(b) * side + usize::from(a)] {
                    visit(*ray);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_trace::sampling::hash;

    /// No ray within an angle of a direction is missed, and most others are.
    #[test]
    fn rays_towards_something_are_found() {
        let frame = [DVec3::X, DVec3::Y, DVec3::Z];
        for rays in [4u32, 8, 64, 128, 256, 512] {
            let strata = Strata::new(rays);
            let (mut found, mut wanted) = (0, 0);
            for seed in 0..200u32 {
                let number = |k: u32| f64::from(hash(seed ^ hash(k))) / f64::from(u32::MAX);
                let z = 1.2 * number(1) - 0.2;
                let turn = std::f64::consts::TAU * number(2);
                let r = (1.0 - z * z).sqrt();
                let direction = DVec3::new(r * turn.cos(), r * turn.sin(), z);
                let angle: f64 = if seed % 10 == 0 { 2.5 } else { 0.3 * number(3) };
                let sequence = Sequence::new(seed, 5);
                let mut cells = Cells::default();
                strata.towards(direction, (angle.cos(), angle.sin()), &mut cells);
                let mut seen = vec![false; rays as usize];
                strata.rays(&cells, &sequence, |ray| {
                    assert!(!seen[ray as usize]);
                    seen[ray as usize] = true;
                });
                for ray in 0..rays {
                    let [u, v, ..] = sequence.point(ray);
                    let d = cosine_direction(&frame, f64::from(u), f64::from(v));
                    if d.dot(direction) >= angle.cos() {
                        wanted += 1;
                        assert!(seen[ray as usize], "{rays} {seed} {ray}");
                    }
                }
                found += seen.iter().filter(|s| **s).count();
            }
            if rays >= 256 {
                assert!(found < 3 * wanted, "{found} of {wanted}");
            }
        }
    }
}
