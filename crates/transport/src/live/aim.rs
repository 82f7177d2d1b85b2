//! Which rays of an element may meet something, without drawing each of them exactly.
//!
//! The directions of a row are worked out eight at a time in single precision, in the element's own frame, and those far from all
//! of some cones are left out: for an armchair in a furnished room, of 64 rays of an element all but four. These are drawn as they were
//! traced.

use radiosity_trace::sampling::{EIGHT as WIDTH, Sequence, cosine_directions};

/// Words of a bit for each ray of a row, at most.
pub const MOST_WORDS: usize = 16;

/// Slack for cosines of angles: directions, axes and the sums of products are off by 1e-6 together, and what rays are drawn by,
/// [`cosine_direction`](radiosity_trace::sampling::cosine_direction), along the surface by the root of 1e-11.
const SLACK: f32 = 1e-5;

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
        let [x, y, z] = cosine_directions::<WIDTH>(sequence.pairs(first + (block * WIDTH) as u32));
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
