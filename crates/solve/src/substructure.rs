//! Substructuring: N patches shoot, M > N elements receive (catalogue 47; Cohen, Greenberg, Immel & Brock 1986).
//!
//! G is M × N: h_e = Σ_p G_ep B_p, with G_ep the form factor from element e to patch p, and a patch's radiosity is
//! the mean of its elements' by area, B_p = Σ_e A_e B_e/A_p. As a transport over the elements this is F = G P with P
//! that mean: it costs M N instead of M². Where the reflectance is constant on each patch, the N × N factors P G of
//! the patches may be solved by any solver instead, and one gather G B gives the elements. It is blind to gradients
//! of what shoots: a patch shines evenly. F is not reciprocal between elements, so of the Krylov methods take
//! bicgstab or gmres for it.

use crate::dense::check_numbers;
use crate::{AreaSpace, DenseTransport, SolveError, Transport};
use rayon::prelude::*;

/// Patches that shoot, cut into elements that receive; a [`Transport`] over the elements.
///
/// ```
/// use radiosity_solve::{DiffuseResponse, Go, Params, Substructure, bicgstab};
///
/// // A lamp above a floor of two elements, of which the first is nearer: factors to lamp and floor.
/// let scene = Substructure::new(vec![1.0, 1.0, 1.0], vec![0, 1, 1], vec![0.0, 0.4, 0.3, 0.0, 0.1, 0.0])?;
/// let response = DiffuseResponse { reflectance: vec![0.0, 0.5, 0.5], bands: 1, reciprocal_area: None };
/// let mut b = [0.0; 3];
/// bicgstab(&scene, &response, &[1.0, 0.0, 0.0], &mut b, &Params::default(), |_, _| Go::On)?;
/// assert!((b[1] - 0.15).abs() < 1e-6 && (b[2] - 0.05).abs() < 1e-6);
/// # Ok::<(), radiosity_solve::SolveError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Substructure {
    space: AreaSpace,
    patch: Vec<u32>,
    patch_area: Vec<f64>,
    factors: Vec<f64>,
}

impl Substructure {
    /// From the area and the patch of each element, and the M × N factors from elements to patches, row-major.
    ///
    /// # Errors
    /// If the lengths do not agree, a patch has no element, or an area or a factor is no finite number.
    pub fn new(area: Vec<f64>, patch: Vec<u32>, factors: Vec<f64>) -> Result<Substructure, SolveError> {
        let patches = patch.iter().max().map_or(0, |last| *last as usize + 1);
        if patch.len() != area.len() || factors.len() != area.len() * patches {
            return Err(SolveError::NotApplicable("each element needs an area, a patch, and a factor to every patch"));
        }
        check_numbers(&area, factors.iter().copied())?;
        let mut patch_area = vec![0.0; patches];
        for (area, patch) in area.iter().zip(&patch) {
            patch_area[*patch as usize] += area;
        }
        if patch_area.contains(&0.0) {
            return Err(SolveError::NotApplicable("each patch needs an element with an area"));
        }
        Ok(Substructure { space: AreaSpace { area }, patch, patch_area, factors })
    }

    /// Number of patches.
    pub fn patches(&self) -> usize {
        self.patch_area.len()
    }

    /// P x: the mean of each patch's elements, by area.
    pub fn mean(&self, elements: &[f64], bands: usize) -> Vec<f64> {
        let mut mean = vec![0.0; self.patches() * bands];
        for ((x, area), patch) in elements.chunks_exact(bands).zip(&self.space.area).zip(&self.patch) {
            let at = *patch as usize;
            for (mean, x) in mean[at * bands..].iter_mut().zip(x) {
                *mean += x * (area / self.patch_area[at]);
            }
        }
        mean
    }

    /// G x: the irradiance of the elements by the radiosities of the patches.
    pub fn gather(&self, patches: &[f64], elements: &mut [f64], bands: usize) {
        elements.par_chunks_exact_mut(bands).zip(self.factors.par_chunks_exact(self.patches().max(1))).for_each(
            |(h, row)| {
                h.fill(0.0);
                for (factor, b) in row.iter().zip(patches.chunks_exact(bands)) {
                    for (h, b) in h.iter_mut().zip(b) {
                        *h += factor * b;
                    }
                }
            },
        );
    }

    /// P G: the form factors among the patches, each the mean of its elements'.
    pub fn between_patches(&self) -> DenseTransport {
        let rows = self.mean(&self.factors, self.patches());
        DenseTransport::new(self.patch_area.clone(), rows).expect("N rows of N factors")
    }
}

impl Transport for Substructure {
    type Space = AreaSpace;

    fn space(&self) -> &AreaSpace {
        &self.space
    }

    fn apply(&self, b: &[f64], h: &mut [f64], bands: usize) -> Result<(), SolveError> {
        self.gather(&self.mean(b, bands), h, bands);
        Ok(())
    }

    fn row_sum(&self) -> f64 {
        let sum = |row: &[f64]| row.iter().map(|f| f.abs()).sum::<f64>();
        self.factors.chunks_exact(self.patches().max(1)).map(sum).fold(0f64, f64::max)
    }
}
