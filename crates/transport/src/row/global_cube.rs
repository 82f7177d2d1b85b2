//! The global cube: all facets look at one cube whose faces keep to the world's axes (Immel, Cohen and Greenberg 1986;
//! Xu, Peng and Liang 1989/1990; catalogue 26, 27).
//!
//! A pixel p is a direction that means the same to every facet, of solid angle ω_p = ΔA/(1 + x² + y²)^{3/2}; a facet of
//! normal m gets ΔF_p = max(0, cos θ_p) ω_p/π from it. Grouped by directions l, the same pixels give directional form
//! factors F^l_ij = Σ_{p in l} [p shows j] ΔF_p with Σ_l F^l_ij = F_ij, from which scenes are put together and glossy
//! surfaces computed. Pixels that the horizon cuts count by their centre; what is lost and gained by that, n⁻², is shared
//! out. It costs up to six faces where the hemicube has three cubes' faces worth of cells, and cannot be turned.

use super::face::{Face, Weights};
use super::glance::{Scratch, quantised};
use super::look::{Gaze, Look, Repair};
use super::surface::{Atlas, Projection};
use super::view::View;
use glam::DVec3;
use radiosity_scene::Enclosure;

/// The global cube.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GlobalCube {
    /// How it is looked at; `resolution` is that of each face. `spin` is without effect.
    pub look: Look,
    /// What pixels weigh.
    pub weights: Weights,
}

/// The row of a facet, split by direction.
#[derive(Clone, Debug, PartialEq)]
pub struct DirectionalRow {
    /// Directions along a side of a face of the cube: there are 6 times their square.
    pub side: usize,
    /// F^l_ij, `factors[j * directions + l]`; faces look along +x, +y, +z, −x, −y, −z.
    pub factors: Vec<f64>,
    /// F_ij from the same pixels.
    pub diffuse: Vec<f64>,
}

impl GlobalCube {
    /// Directional form factors of facet `from`, the directions being `side`² squares on each face of the cube. The eye
    /// points are those of `look`; nothing is repaired.
    pub fn directional(&self, from: usize, enclosure: &Enclosure, side: usize) -> DirectionalRow {
        let plain = GlobalCube { look: Look { repair: Repair::None, ..self.look }, ..*self };
        let (atlas, view, mut scratch) = (Atlas::new(&plain), View::new(enclosure), Scratch::default());
        let n = atlas.level(1).faces[0].cells[0];
        let side = side.clamp(1, n);
        let directions = 6 * side * side;
        let mut factors = vec![0.0; enclosure.facets.len() * directions];
        let mut gaze = Gaze::new(&atlas, &view, from, &mut scratch);
        let average = gaze.average(self.look.points.max(1), 1, &mut |face, items, weights, share| {
            for (cell, (item, weight)) in items.iter().zip(weights).enumerate() {
                let direction = (face * side + cell / n * side / n) * side + cell % n * side / n;
                if let Some(factor) = factors.get_mut(*item as usize * directions + direction) {
                    *factor += quantised(share * weight);
                }
            }
        });
        DirectionalRow { side, factors, diffuse: average.values }
    }
}

impl Projection for GlobalCube {
    fn look(&self) -> Look {
        self.look
    }

    fn weights(&self) -> Weights {
        self.weights
    }

    fn is_world_aligned(&self) -> bool {
        true
    }

    fn faces(&self, n: usize) -> Vec<Face> {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let face = |k: usize| {
            let (right, up, forward) = (axes[(k + 1) % 3], axes[(k + 2) % 3], axes[k % 3]);
            let frame = if k < 3 { [right, up, forward] } else { [up, right, -forward] };
            Face { frame, window: [-1.0, 1.0, -1.0, 1.0], cells: [n, n] }
        };
        (0..6).map(face).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::tests::{box_of, room_with_block};
    use std::f64::consts::PI;

    /// Pixels fill the sphere, by the midpoint with an error of n⁻²; exactly, the vector of the pixels of a face is
    /// that of its solid angle.
    #[test]
    fn catalogue_26_pixels_fill_the_sphere() {
        let sum = |n: usize| -> f64 {
            let faces = GlobalCube::default().faces(n);
            let solid_angle = |face: &Face| -> f64 {
                let area = face.pitch()[0] * face.pitch()[1];
                (0..n * n).map(|i| area / face.centre(i % n, i / n).length().powi(3)).sum()
            };
            faces.iter().map(solid_angle).sum()
        };
        let off: Vec<f64> = [16, 32, 64, 128, 256].map(|n| (sum(n) - 4.0 * PI).abs()).to_vec();
        assert!(off[4] < 1e-4, "{off:?}");
        assert!(off.windows(2).all(|pair| (pair[0] / pair[1] - 4.0).abs() < 0.1), "{off:?}");
    }

    #[test]
    fn catalogue_26_pixels_sum_to_one_for_any_normal() {
        let cube = GlobalCube::default();
        let midpoint = GlobalCube { weights: Weights::Midpoint, look: Look { resolution: 256, ..Look::default() } };
        let (exact, classic) = (Atlas::new(&cube), Atlas::new(&midpoint));
        for k in 0..20 {
            let (z, turn) = (1.0 - f64::from(k) / 9.5, 2.4 * f64::from(k));
            let normal =
                DVec3::new((1.0 - z * z).max(0.0).sqrt() * turn.cos(), (1.0 - z * z).max(0.0).sqrt() * turn.sin(), z);
            let sum = |weights: Vec<Vec<f64>>| -> f64 { weights.into_iter().flatten().sum() };
            let raw: f64 = {
                let level = classic.level(1);
                sum(level.weights(&midpoint, normal))
            };
            assert!((raw - 1.0).abs() < 2e-5, "{normal}: {raw}");
            assert!((sum(exact.level(1).weights(&cube, normal)) - 1.0).abs() < 1e-12, "{normal}");
        }
    }

    /// Sums of the same pixels, in another order, come out the same to the last bit.
    #[test]
    fn catalogue_27_directional_factors_sum_to_the_diffuse_one() {
        let room = room_with_block(2);
        for (points, side) in [(1, 1), (1, 8), (2, 5)] {
            let cube = GlobalCube { look: Look { resolution: 64, points, ..Look::default() }, ..GlobalCube::default() };
            for from in [0, 5, 9] {
                let row = cube.directional(from, &room, side);
                let directions = 6 * side * side;
                for (j, diffuse) in row.diffuse.iter().enumerate() {
                    let sum: f64 = row.factors[j * directions..][..directions].iter().sum();
                    assert_eq!(sum.to_bits(), diffuse.to_bits(), "{from} to {j}: {sum} {diffuse}");
                }
            }
        }
        // Each direction belongs where it points: the floor of a cube sees its ceiling upwards only.
        let row = GlobalCube::default().directional(0, &box_of(DVec3::ONE, 1), 1);
        assert_eq!(row.factors[6..12], [0.0, 0.0, row.diffuse[1], 0.0, 0.0, 0.0]);
    }
}
