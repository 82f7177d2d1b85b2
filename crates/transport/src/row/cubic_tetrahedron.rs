//! The cubic tetrahedron: the corner of a cube that stands over the facet, its diagonal along the normal (Beran-Koehn and
//! Pavicic 1991, "A cubic tetrahedral adaptation of the hemi-cube algorithm", Graphics Gems II; 1992, "Delta form-factor
//! calculation for the cubic tetrahedral algorithm", Graphics Gems III).
//!
//! Three faces instead of five. On each, (x, y) run from −2 to 1 and the horizon is the diagonal x + y + 1 = 0, so half of
//! the cells count: ΔF = (x + y + 1) ΔA/(√3 π(x² + y² + 1)²). Cells on the diagonal are cut by the horizon and weigh
//! nothing; theirs is n⁻² of all and goes to the others. Otherwise it fails where the hemicube fails.

use super::face::Face;
use super::look::Look;
use super::surface::Projection;
use glam::DVec3;

/// The cubic tetrahedron.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CubicTetrahedron {
    /// How it is looked at; `resolution` is that of the legs of the triangular faces.
    pub look: Look,
}

impl Projection for CubicTetrahedron {
    fn look(&self) -> Look {
        self.look
    }

    fn faces(&self, n: usize) -> Vec<Face> {
        // Edges of the cube, orthonormal, all at the same angle to the normal z.
        let (third, rise) = (std::f64::consts::TAU / 3.0, 1.0 / 3f64.sqrt());
        let edge = |k: i32| {
            let (sine, cosine) = (third * f64::from(k)).sin_cos();
            DVec3::new(cosine, sine, 0.0) * (2.0f64 / 3.0).sqrt() + DVec3::Z * rise
        };
        let face =
            |k| Face { frame: [edge(k + 1), edge(k + 2), edge(k)], window: [-2.0, 1.0, -2.0, 1.0], cells: [n, n] };
        (0..3).map(face).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::Weights;

    /// The published delta factors, and what they sum to: one, but for the cells that the horizon cuts.
    #[test]
    fn catalogue_91_cells_of_the_cubic_tetrahedron_are_as_published() {
        let sum = |n: usize, weights: Weights| -> f64 {
            let faces = CubicTetrahedron::default().faces(n);
            faces.iter().flat_map(|face| face.weights(&face.vectors(weights), DVec3::Z)).sum()
        };
        let face = &CubicTetrahedron::default().faces(10)[1];
        let weights = face.weights(&face.vectors(Weights::Midpoint), DVec3::Z);
        let (x, y, area) = (-2.0 + 8.5 * 0.3, -2.0 + 3.5 * 0.3, 0.09);
        let published = (x + y + 1.0) * area / (3f64.sqrt() * std::f64::consts::PI * (x * x + y * y + 1.0f64).powi(2));
        assert!((weights[38] - published).abs() < 1e-15, "{} {published}", weights[38]);
        assert_eq!(weights.iter().filter(|w| **w > 0.0).count(), 45);
        for n in [32, 64, 128] {
            let off = (1.0 - sum(n, Weights::Exact)) * (n * n) as f64;
            assert!(off > 0.0 && off < 2.0, "{n}: {off}");
            assert!((1.0 - sum(n, Weights::Midpoint)).abs() < 2.0 / (n * n) as f64, "{n}");
        }
    }
}
