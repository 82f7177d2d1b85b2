//! Differences of displayed colours as eyes tell them: ΔE*ab, the distance in CIE 1976 L*a*b* (CIE 15:2004, sect. 8.2.1), white
//! being that of the display. A difference of 2.3 is just noticed (Mahy, Van Eycken & Oosterlinck 1994); 100 is black against
//! white. It overrates differences of saturated colours, which later formulas mend; but it is a metric, so that
//! differences can be bounded.

use crate::Bands;

/// X, Y, Z of the primaries of Rec. 709 with white D65 (IEC 61966-2-1), each row relative to its sum, the white.
const XYZ: [[f64; 3]; 3] = [
    [0.412_456_4, 0.357_576_1, 0.180_437_5],
    [0.212_672_9, 0.715_152_2, 0.072_175_0],
    [0.019_333_9, 0.119_192_0, 0.950_304_1],
];

/// Where the cube root gives way to its tangent, (6/29)³.
const TANGENT: f64 = 216.0 / 24_389.0;

/// The cube root of a share of white, and near black a line.
fn root(share: f64) -> f64 {
    if share > TANGENT { share.cbrt() } else { share * (24_389.0 / 27.0 / 116.0) + 16.0 / 116.0 }
}

/// The roots of X/X_n, Y/Y_n and Z/Z_n. Each grows with every channel.
fn roots(shown: Bands) -> [f64; 3] {
    XYZ.map(|row| {
        let sum: f64 = row.iter().zip(shown).map(|(weight, c)| weight * f64::from(c)).sum();
        root(sum / row.iter().sum::<f64>())
    })
}

/// L*, a*, b* of displayed light, linear Rec. 709 from 0 to 1.
///
/// ```
/// use radiosity_scene::lab::lab;
/// assert!((lab([1.0; 3])[0] - 100.0).abs() < 1e-9 && lab([1.0; 3])[1].abs() < 1e-9);
/// ```
pub fn lab(shown: Bands) -> [f64; 3] {
    let [x, y, z] = roots(shown);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// ΔE*ab of two displayed colours.
pub fn delta_e(a: Bands, b: Bands) -> f64 {
    let (a, b) = (lab(a), lab(b));
    (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f64>().sqrt()
}

/// A bound of the ΔE*ab of any two displayed colours that lie between `low` and `high`, channel by channel. Differences of
/// the three roots are taken as independent, for which it is some four times the largest where all channels err together.
pub fn delta_e_within(low: Bands, high: Bands) -> f64 {
    let (low, high) = (roots(low), roots(high));
    let [x, y, z] = [0, 1, 2].map(|k| high[k] - low[k]);
    ((116.0 * y).powi(2) + (500.0 * (x + y)).powi(2) + (200.0 * (y + z)).powi(2)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of the primaries, as colour tables have them (D65, to their rounding).
    #[test]
    fn primaries_have_their_coordinates() {
        let cases = [
            ([1.0, 0.0, 0.0], [53.24, 80.09, 67.20]),
            ([0.0, 1.0, 0.0], [87.73, -86.18, 83.18]),
            ([0.0, 0.0, 1.0], [32.30, 79.19, -107.86]),
            ([0.0; 3], [0.0; 3]),
        ];
        for (shown, expected) in cases {
            let found = lab(shown);
            assert!((0..3).all(|k| (found[k] - expected[k]).abs() < 0.02), "{found:?} for {expected:?}");
        }
    }

    #[test]
    fn colours_between_two_differ_by_no_more_than_the_bound() {
        for (low, high) in
            [([0.1, 0.2, 0.3], [0.11, 0.22, 0.33]), ([0.0; 3], [1e-3; 3]), ([0.0; 3], [1.0; 3]), ([0.5; 3], [0.5; 3])]
        {
            let bound = delta_e_within(low, high);
            let corner = |bits: usize| [0, 1, 2].map(|k| if bits >> k & 1 == 0 { low[k] } else { high[k] });
            let largest = (0..64).map(|pair| delta_e(corner(pair & 7), corner(pair >> 3))).fold(0.0, f64::max);
            assert!(largest <= bound && bound <= 4.0 * largest, "{largest} of {bound}");
        }
    }
}
