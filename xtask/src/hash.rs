//! Numbers that look random and are the same everywhere: SplitMix64 (Steele, Lea & Flood 2014, OOPSLA), used both as
//! a generator and as a hash of lattice coordinates for value noise.

/// A stream of pseudo-random numbers.
pub struct Random(u64);

impl Random {
    /// The stream of a seed.
    pub fn new(seed: u64) -> Random {
        Random(seed)
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        mix(self.0)
    }

    /// Uniform in `low..high`.
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.bits() >> 11) as f64 / (1u64 << 53) as f64)
    }
}

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number in 0..1 for a point of the integer lattice.
pub fn lattice(cell: [i64; 3]) -> f64 {
    let key = cell.iter().fold(0x1234_5678, |key, &i| mix(key ^ (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)));
    (key >> 11) as f64 / (1u64 << 53) as f64
}

/// Smooth noise in 0..1 with features one unit wide.
pub fn noise(x: f64, y: f64, z: f64) -> f64 {
    let at = [x, y, z];
    let cell = at.map(|x| x.floor() as i64);
    let part: [f64; 3] = std::array::from_fn(|axis| {
        let t = at[axis] - at[axis].floor();
        t * t * (3.0 - 2.0 * t)
    });
    let mut sum = 0.0;
    for corner in 0..8 {
        let side: [i64; 3] = std::array::from_fn(|axis| corner >> axis & 1);
        let weight: f64 = (0..3).map(|axis| if side[axis] == 1 { part[axis] } else { 1.0 - part[axis] }).product();
        sum += weight * lattice(std::array::from_fn(|axis| cell[axis] + side[axis]));
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_continuous_and_takes_the_lattice_values() {
        assert_eq!(noise(3.0, -2.0, 7.0), lattice([3, -2, 7]));
        assert!((noise(3.0 - 1e-9, -2.0, 7.0) - lattice([3, -2, 7])).abs() < 1e-6);
        assert!(lattice([0, 0, 0]) != lattice([0, 0, 1]));
    }

    /// Mean of 10^4 uniform numbers: standard error 0.0029, so 0.015 is five of them (chance of a false alarm 6e-7).
    #[test]
    fn numbers_fill_their_range_evenly() {
        let mut random = Random::new(1);
        let numbers: Vec<f64> = (0..10_000).map(|_| random.range(-1.0, 3.0)).collect();
        assert!(numbers.iter().all(|x| (-1.0..3.0).contains(x)));
        let mean = numbers.iter().sum::<f64>() / 4e4;
        assert!((mean - 0.25).abs() < 0.015, "{mean}");
    }
}
