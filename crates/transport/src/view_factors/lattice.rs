//! Lattices: the places from which the parts of a leaf look, each once however many parts meet there.

use super::frame::Frame;
use super::part::Part;
use glam::DVec3;
use rustc_hash::FxHashMap;

/// Where the places of a part lie along both edges of its parallelogram: its corners in turn and its centre.
const CELL: [[f64; 2]; 5] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]];

/// Places of a lattice of n, of which one is the centre: no two lie on one line along either edge, and these lines are an n-th apart. The k-th is at (k, g k) modulo n, where g² + 1 is a multiple of n, so that a quarter of a
/// turn changes nothing.
const fn lattice<const N: usize>(g: usize) -> [[f64; 2]; N] {
    let n = N + 1;
    let mut at = [[0.0; 2]; N];
    let mut k = 0;
    while k < N {
        // All but the centre.
        let off = if k < N / 2 { n + k - N / 2 } else { k + 1 - N / 2 };
        let (x, y) = ((off + N / 2) % n, (g * off + N / 2) % n);
        at[k] = [(x as f64 + 0.5) / n as f64, (y as f64 + 0.5) / n as f64];
        k += 1;
    }
    at
}

/// Those of the lattices of five and of thirteen, but for the centre.
const FIVE: [[f64; 2]; 4] = lattice(2);
const THIRTEEN: [[f64; 2]; 12] = lattice(5);

/// The places of a part.
#[derive(Clone, Copy, Debug)]
pub struct Of {
    pub corners: [u16; 4],
    pub centre: u16,
    /// Those of a lattice of five, and of one of thirteen, but for the centre.
    pub five: [u16; 4],
    pub thirteen: [u16; 12],
}

/// Lines along the extent of a leaf of the grid that places are rounded to, so fine that only rounding is forgiven.
const LINES: f64 = 1e10;

/// The places of the parts of a leaf.
#[derive(Clone, Debug, Default)]
pub struct Lattice {
    /// Where they are.
    pub places: Vec<DVec3>,
    /// Those of each part; none of one that is no parallelogram.
    pub of: Vec<Option<Of>>,
}

impl Lattice {
    /// Of the parts of a leaf, which extends over `extent`.
    pub fn new(parts: &[Part], extent: f64) -> Lattice {
        let mut lattice = Lattice::default();
        let mut known: FxHashMap<[i64; 3], u16> = FxHashMap::default();
        let origin = parts[0].shape.corners()[0];
        let mut number = |place: DVec3| {
            let key = ((place - origin) * (LINES / extent)).to_array().map(|x| x.round() as i64);
            *known.entry(key).or_insert_with(|| {
                lattice.places.push(place);
                (lattice.places.len() - 1) as u16
            })
        };
        for part in parts {
            let of = match Frame::of(part.shape.corners())[..] {
                [frame] if frame.is_square => {
                    let mut at = |[x, y]: [f64; 2]| number(frame.place(x, y));
                    let [a, b, c, d, centre] = CELL.map(&mut at);
                    Some(Of { corners: [a, b, c, d], centre, five: FIVE.map(&mut at), thirteen: THIRTEEN.map(&mut at) })
                }
                _ => None,
            };
            lattice.of.push(of);
        }
        lattice
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Along either edge, places of a lattice and the centre lie as far apart as they can.
    #[test]
    fn places_of_a_lattice_lie_evenly_along_both_edges() {
        for at in [&FIVE[..], &THIRTEEN[..]] {
            let n = at.len() + 1;
            for axis in 0..2 {
                let mut along: Vec<f64> = at.iter().chain([&[0.5; 2]]).map(|place| place[axis]).collect();
                along.sort_by(f64::total_cmp);
                let evenly = along.iter().enumerate().map(|(k, x)| (x - (k as f64 + 0.5) / n as f64).abs());
                assert!(evenly.fold(0.0, f64::max) < 1e-15, "{along:?}");
            }
        }
    }
}
