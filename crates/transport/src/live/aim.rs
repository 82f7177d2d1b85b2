//! Which rays of an element may meet something, without drawing each of them exactly.
//!
//! The directions of a row are worked out eight at a time in single precision, in the element's own frame, and those far from all
//! of some cones are left out: for an armchair in a furnished room, of 64 rays of an element all but four. These are drawn as they were
//! traced.

use radiosity_trace::sampling::Sequence;
use std::f32::consts::FRAC_PI_4;

/// Rays that are looked at together.
const WIDTH: usize = 8;

/// Words of a bit for each ray of a row, at most.
pub const MOST_WORDS: usize = 16;

/// Slack for cosines of angles. A direction along the surface has its third part from 1 less two squares, which are off by up to
/// 4e-7: it is off by the root of that, 6e-4.
const SLACK: f32 = 1e-3;

/// Directions in an element's frame.
#[derive(Clone, Copy, Debug)]
pub struct Aim {
    /// Unit axis.
    axis: [f32; 3],
    /// Cosine of half the angle, less the slack.
    least: f32,
}

impl Aim {
    /// Directions within an angle of an axis, of which the cosine is given.
    pub fn new(axis: [f64; 3], cosine: f64) -> Aim {
        Aim { axis: axis.map(|x| x as f32), least: cosine as f32 - SLACK }
    }

    /// All directions.
    pub const ALL: Aim = Aim { axis: [0.0; 3], least: f32::NEG_INFINITY };
}

/// A bit for each ray from number `first` of a sequence on that may go where some aims have it, given how far each ray came: less
/// than `nearest` and there was nothing to be met. Never wrong where it leaves one out.
pub fn towards(sequence: &Sequence, first: u32, reached: &[f32], nearest: f32, aims: &[Aim]) -> [u64; MOST_WORDS] {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has it.
        return unsafe { avx2(sequence, first, reached, nearest, aims) };
    }
    all(sequence, first, reached, nearest, aims)
}

/// Eight numbers are one register there.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn avx2(sequence: &Sequence, first: u32, reached: &[f32], nearest: f32, aims: &[Aim]) -> [u64; MOST_WORDS] {
    all(sequence, first, reached, nearest, aims)
}

// All is inlined and without closures, so that it has wide registers to its end.
#[inline(always)]
fn all(sequence: &Sequence, first: u32, reached: &[f32], nearest: f32, aims: &[Aim]) -> [u64; MOST_WORDS] {
    let mut bits = [0; MOST_WORDS];
    for (block, reached) in reached.chunks(WIDTH).enumerate() {
        // Past the last one nothing is as far.
        let mut far = [f32::NEG_INFINITY; WIDTH];
        far[..reached.len()].copy_from_slice(reached);
        let [x, y, z] = directions(sequence.pairs(first + (block * WIDTH) as u32));
        let mut most = [f32::NEG_INFINITY; WIDTH];
        for Aim { axis, least } in aims {
            for k in 0..WIDTH {
                let over = axis[0] * x[k] + axis[1] * y[k] + axis[2] * z[k] - least;
                most[k] = if over > most[k] { over } else { most[k] };
            }
        }
        let mut own = 0u64;
        for k in 0..WIDTH {
            own |= u64::from((most[k] >= 0.0) & (far[k] >= nearest)) << k;
        }
        bits[block * WIDTH / 64] |= own << (block * WIDTH % 64);
    }
    bits
}

/// Directions of places in the unit square as [`cosine_direction`](radiosity_trace::sampling::cosine_direction) has them, about the
/// third axis.
#[inline(always)]
fn directions([u, v]: [[f32; WIDTH]; 2]) -> [[f32; WIDTH]; 3] {
    let mut directions = [[0.0; WIDTH]; 3];
    for k in 0..WIDTH {
        let (a, b) = (2.0 * u[k] - 1.0, 2.0 * v[k] - 1.0);
        let is_first = a * a > b * b;
        let (long, short) = if is_first { (a, b) } else { (b, a) };
        // In the middle both are nothing.
        let angle = FRAC_PI_4 * (short / if long == 0.0 { 1.0 } else { long });
        let q = angle * angle;
        let sine = angle * (1.0 + q * (-1.0 / 6.0 + q * (1.0 / 120.0 + q * (-1.0 / 5040.0 + q / 362_880.0))));
        let cosine = 1.0 + q * (-0.5 + q * (1.0 / 24.0 + q * (-1.0 / 720.0 + q / 40_320.0)));
        let (x, y) = if is_first { (long * cosine, long * sine) } else { (long * sine, long * cosine) };
        let square = 1.0 - x * x - y * y;
        directions[0][k] = x;
        directions[1][k] = y;
        directions[2][k] = if square > 0.0 { square } else { 0.0 }.sqrt();
    }
    directions
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use radiosity_trace::sampling::{cosine_direction, hash};

    /// The frame of directions about the third axis.
    const FRAME: [DVec3; 3] = [DVec3::X, DVec3::Y, DVec3::Z];

    /// Directions that hardly leave the surface are those that single precision knows least of.
    #[test]
    fn no_ray_within_an_angle_is_left_out_and_most_others_are() {
        let (mut inside, mut found, mut all) = (0, 0, 0);
        for seed in 0..400 {
            let sequence = Sequence::new(hash(seed), 5);
            let unit = |k: u32| f64::from(hash(seed ^ hash(k))) / f64::from(u32::MAX);
            let axis = DVec3::new(unit(1) - 0.5, unit(2) - 0.5, unit(3) - 0.3).normalize();
            let axis = if seed % 4 == 0 { DVec3::new(axis.x, axis.y, 0.0).normalize() } else { axis };
            let cosine = 1.0 - unit(4).powi(6);
            let (first, count) = [(0, 4), (0, 64), (64, 192), (64, 960), (17, 100)][seed as usize % 5];
            let reached: Vec<f32> = (0..count).map(|k| unit(100 + k) as f32).collect();
            let nearest = 0.25;
            let bits = towards(&sequence, first, &reached, nearest, &[Aim::new(axis.to_array(), cosine)]);
            for m in 0..64 * MOST_WORDS as u32 {
                let is_found = bits[m as usize / 64] >> (m % 64) & 1 == 1;
                if m >= count {
                    assert!(!is_found, "there is no ray {m} of {count}");
                    continue;
                }
                let [u, v] = sequence.pair(first + m).map(f64::from);
                let direction = cosine_direction(&FRAME, u, v);
                let is_inside = direction.dot(axis) >= cosine && reached[m as usize] >= nearest;
                assert!(is_found || !is_inside, "ray {m} of {seed}");
                (inside, found, all) = (inside + u32::from(is_inside), found + u32::from(is_found), all + 1);
            }
        }
        assert!(inside > 500 && found < inside + inside / 10 && found < all / 4, "{inside} {found} {all}");
    }

    /// At the rim of the square, whose directions are along the surface, and elsewhere.
    #[test]
    fn single_precision_is_as_good_as_is_said() {
        const LAST: f32 = 1.0 - 1.0 / 16_777_216.0;
        let mut worst: f64 = 0.0;
        for k in 0..100_000u32 {
            let x = f32::from_bits((hash(k) >> 9) | 0x3f80_0000) - 1.0;
            let near = x.powi(8);
            let [mut u, mut v] = [[x; WIDTH]; 2];
            (u[0], v[1], u[2], v[3], u[4], v[5]) = (0.0, 0.0, LAST, LAST, near, LAST - near);
            v[7] = f32::from_bits((hash(!k) >> 9) | 0x3f80_0000) - 1.0;
            let found = directions([u, v]);
            for k in 0..WIDTH {
                let own = DVec3::from(found.map(|lanes| f64::from(lanes[k])));
                worst = worst.max(own.distance(cosine_direction(&FRAME, f64::from(u[k]), f64::from(v[k]))));
            }
        }
        assert!(worst > 1e-4 && worst < 0.8 * f64::from(SLACK), "{worst}");
    }

    #[test]
    fn several_aims_have_what_each_has_and_one_may_be_all() {
        let sequence = Sequence::new(3, 5);
        let reached = [1.0; 256];
        let of = |aims: &[Aim]| towards(&sequence, 0, &reached, 0.0, aims);
        let [a, b] = [[0.6, 0.0, 0.8], [0.0, -0.6, 0.8]].map(|axis| Aim::new(axis, 0.9));
        let [one, other, both] = [of(&[a]), of(&[b]), of(&[a, b])];
        for word in 0..MOST_WORDS {
            assert_eq!(both[word], one[word] | other[word]);
        }
        let all = of(&[a, Aim::ALL]);
        assert_eq!(all.map(u64::count_ones).iter().sum::<u32>(), 256);
        assert_eq!(of(&[]), [0; MOST_WORDS]);
    }
}
