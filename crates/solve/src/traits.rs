//! What solvers ask of the world: a space, a transport, a response; and the plainest of each.

use crate::SolveError;
use rayon::prelude::*;

/// A vector space with its own inner product.
pub trait Space {
    /// Number of unknowns per band.
    fn dim(&self) -> usize;
    /// Inner product of two fields, band by band.
    fn inner(&self, x: &[f64], y: &[f64], bands: usize) -> Vec<f64>;
    /// Hands out each number of a field times its weight in the inner product.
    fn accumulate(&self, x: &[f64], bands: usize, add: impl FnMut(usize, f64));
}

/// h = F b for all bands at once.
pub trait Transport: Sync {
    /// The space of its fields.
    type Space: Space;
    /// The space of its fields.
    fn space(&self) -> &Self::Space;
    /// Writes F b into `h`; both have `dim × bands` numbers.
    fn apply(&self, b: &[f64], h: &mut [f64], bands: usize);
    /// Labels 0.. of the unknowns such that no row of F reaches from one label to another: rooms that do not see each
    /// other. `None` where that is not known.
    fn parts(&self) -> Option<&[u32]> {
        None
    }
}

/// R: what surfaces make of the light that they receive.
pub trait Response: Sync {
    /// Number of bands.
    fn bands(&self) -> usize;
    /// Writes R h into `b`.
    fn respond(&self, h: &[f64], b: &mut [f64]);
    /// Largest reflectance of each band: ‖R‖∞.
    fn largest(&self) -> Vec<f64>;
    /// The weight (A/ρ by entry) in whose inner product I − R F is symmetric, if F is reciprocal and R diagonal; CG is
    /// offered only then.
    fn self_adjoint_weight(&self) -> Option<Vec<f64>>;
}

/// Fields over elements, weighted by area.
#[derive(Clone, Debug, Default)]
pub struct AreaSpace {
    /// Area of each element, m².
    pub area: Vec<f64>,
}

impl Space for AreaSpace {
    fn dim(&self) -> usize {
        self.area.len()
    }

    fn inner(&self, x: &[f64], y: &[f64], bands: usize) -> Vec<f64> {
        let mut sum = vec![0.0; bands];
        for ((x, y), area) in x.chunks_exact(bands).zip(y.chunks_exact(bands)).zip(&self.area) {
            for band in 0..bands {
                sum[band] += area * x[band] * y[band];
            }
        }
        sum
    }

    fn accumulate(&self, x: &[f64], bands: usize, mut add: impl FnMut(usize, f64)) {
        for (i, x) in x.iter().enumerate() {
            add(i, self.area[i / bands] * x);
        }
    }
}

/// Ideal diffuse reflection: a reflectance for each element and band.
#[derive(Clone, Debug)]
pub struct DiffuseResponse {
    /// Reflectances, bands interleaved.
    pub reflectance: Vec<f64>,
    /// Number of bands.
    pub bands: usize,
    /// Areas, if the transport that this goes with is reciprocal (A_i F_ij = A_j F_ji).
    pub reciprocal_area: Option<Vec<f64>>,
}

impl Response for DiffuseResponse {
    fn bands(&self) -> usize {
        self.bands
    }

    fn respond(&self, h: &[f64], b: &mut [f64]) {
        for ((b, h), rho) in b.iter_mut().zip(h).zip(&self.reflectance) {
            *b = rho * h;
        }
    }

    fn largest(&self) -> Vec<f64> {
        (0..self.bands)
            .map(|band| self.reflectance.iter().skip(band).step_by(self.bands).fold(0f64, |m, &r| m.max(r)))
            .collect()
    }

    fn self_adjoint_weight(&self) -> Option<Vec<f64>> {
        let area = self.reciprocal_area.as_ref()?;
        // Where nothing is reflected the unknown is known (B = E) and takes no part in the inner product.
        let weight = |(i, &rho): (usize, &f64)| if rho > 0.0 { area[i / self.bands] / rho } else { 0.0 };
        Some(self.reflectance.iter().enumerate().map(weight).collect())
    }
}

/// A full matrix of form factors, row by row: F_ij is the share of what leaves i that reaches j, and equally the
/// weight of b_j in h_i.
#[derive(Clone, Debug)]
pub struct DenseTransport {
    space: AreaSpace,
    rows: Vec<f64>,
}

impl DenseTransport {
    /// From areas and the N × N factors, row-major.
    ///
    /// # Errors
    /// If the number of factors is not the square of the number of areas.
    pub fn new(area: Vec<f64>, rows: Vec<f64>) -> Result<DenseTransport, SolveError> {
        if rows.len() != area.len() * area.len() {
            return Err(SolveError::NotApplicable("a form-factor matrix needs as many rows and columns as areas"));
        }
        Ok(DenseTransport { space: AreaSpace { area }, rows })
    }
}

impl Transport for DenseTransport {
    type Space = AreaSpace;

    fn space(&self) -> &AreaSpace {
        &self.space
    }

    fn apply(&self, b: &[f64], h: &mut [f64], bands: usize) {
        let n = self.space.dim();
        h.par_chunks_exact_mut(bands).zip(self.rows.par_chunks_exact(n.max(1))).for_each(|(h, row)| {
            h.fill(0.0);
            for (factor, b) in row.iter().zip(b.chunks_exact(bands)) {
                for (h, b) in h.iter_mut().zip(b) {
                    *h += factor * b;
                }
            }
        });
    }
}
