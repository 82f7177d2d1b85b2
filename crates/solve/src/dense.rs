//! F as a full matrix of form factors, row by row (Goral et al. 1984).
//!
//! F_ij is the share of what leaves i that reaches j, and equally the weight of b_j in h_i. It takes 8 N² bytes: 800
//! MB for ten thousand unknowns.

use crate::{AreaSpace, Rows, Shoot, SolveError, Space, Transport};
use rayon::prelude::*;
use std::sync::OnceLock;

/// Largest |A_i F_ij − A_j F_ji|, relative to the larger of the two, at which a column is still read as a row by
/// reciprocity. It is rounding in double precision; with a looser one, shooting would solve another equation than
/// gathering.
pub(crate) const RECIPROCAL: f64 = 1e-12;

/// Refuses areas that are negative or no finite numbers, and factors that are none: bounds and norms rest on them.
pub(crate) fn check_numbers(area: &[f64], mut factors: impl Iterator<Item = f64>) -> Result<(), SolveError> {
    if !area.iter().all(|area| area.is_finite() && *area >= 0.0) {
        return Err(SolveError::NotApplicable("areas must be finite numbers from 0"));
    }
    if !factors.all(f64::is_finite) {
        return Err(SolveError::NotApplicable("form factors must be finite numbers"));
    }
    Ok(())
}

/// A full matrix of form factors.
///
/// ```
/// use radiosity_solve::{DenseTransport, Transport};
///
/// // Two parallel plates with areas 1 and 2: F_12 = 0.2, and F_21 = 0.1 by reciprocity.
/// let plates = DenseTransport::new(vec![1.0, 2.0], vec![0.0, 0.2, 0.1, 0.0])?;
/// let mut h = [0.0; 2];
/// plates.apply(&[1.0, 0.0], &mut h, 1)?;
/// assert_eq!(h, [0.0, 0.1]);
/// # Ok::<(), radiosity_solve::SolveError>(())
/// ```
#[derive(Clone, Debug)]
pub struct DenseTransport {
    space: AreaSpace,
    rows: Vec<f64>,
    row_sum: f64,
    reciprocal: OnceLock<bool>,
}

impl DenseTransport {
    /// From areas and the N × N factors, row-major.
    ///
    /// # Errors
    /// If the number of factors is not the square of the number of areas, or an area or a factor is no finite number.
    pub fn new(area: Vec<f64>, rows: Vec<f64>) -> Result<DenseTransport, SolveError> {
        if rows.len() != area.len() * area.len() {
            return Err(SolveError::NotApplicable("a form-factor matrix needs as many rows and columns as areas"));
        }
        check_numbers(&area, rows.iter().copied())?;
        let row_sum = rows
            .chunks_exact(area.len().max(1))
            .map(|row| row.iter().map(|f| f.abs()).sum::<f64>())
            .fold(0f64, f64::max);
        Ok(DenseTransport { space: AreaSpace { area }, rows, row_sum, reciprocal: OnceLock::new() })
    }

    /// Whether A_i F_ij = A_j F_ji to rounding; looked at once.
    fn is_reciprocal(&self) -> bool {
        *self.reciprocal.get_or_init(|| {
            let (n, area) = (self.space.dim(), &self.space.area);
            (0..n).into_par_iter().all(|i| {
                (0..i).all(|j| {
                    let (there, back) = (area[i] * self.rows[i * n + j], area[j] * self.rows[j * n + i]);
                    (there - back).abs() <= RECIPROCAL * there.abs().max(back.abs())
                })
            })
        })
    }
}

impl Transport for DenseTransport {
    type Space = AreaSpace;

    fn space(&self) -> &AreaSpace {
        &self.space
    }

    fn apply(&self, b: &[f64], h: &mut [f64], bands: usize) -> Result<(), SolveError> {
        let n = self.space.dim();
        h.par_chunks_exact_mut(bands).zip(self.rows.par_chunks_exact(n.max(1))).for_each(|(h, row)| {
            h.fill(0.0);
            for (factor, b) in row.iter().zip(b.chunks_exact(bands)) {
                for (h, b) in h.iter_mut().zip(b) {
                    *h += factor * b;
                }
            }
        });
        Ok(())
    }

    fn row_sum(&self) -> f64 {
        self.row_sum
    }
}

impl Rows for DenseTransport {
    fn row(&self, i: usize, mut entry: impl FnMut(usize, f64)) {
        let n = self.space.dim();
        for (j, &factor) in self.rows[i * n..(i + 1) * n].iter().enumerate() {
            entry(j, factor);
        }
    }
}

impl Shoot for DenseTransport {
    fn shoot(&self, source: usize, unshot: &[f64], h: &mut [f64]) {
        let (n, area) = (self.space.dim(), &self.space.area);
        // F_ji = F_ij A_i/A_j reads a row, which lies together; a matrix that is not reciprocal has its column read.
        let reciprocal = self.is_reciprocal();
        for (j, h) in h.chunks_exact_mut(unshot.len()).enumerate() {
            let factor = if reciprocal {
                self.rows[source * n + j] * (area[source] / area[j])
            } else {
                self.rows[j * n + source]
            };
            for (h, unshot) in h.iter_mut().zip(unshot) {
                *h = factor * unshot;
            }
        }
    }
}
