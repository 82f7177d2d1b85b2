//! Script-F: the exchange of heat between grey surfaces with all reflections in it (Hottel and Sarofim 1967, sect. 3.6).
//!
//! Surfaces of emittance ε give off J = ε E_b + (1 − ε) F J. What i absorbs is then Σ_j 𝓕_ij E_b,j with
//! 𝓕 = ε F (I − (1 − ε) F)⁻¹ ε; A_i 𝓕_ij = A_j 𝓕_ji, and in an enclosure rows sum to ε_i. By elimination, N³.

use crate::SolveError;
use crate::direct::eliminate;
use nalgebra::DMatrix;

/// 𝓕 of N surfaces, row by row, from their form factors (row by row) and emittances.
///
/// ```
/// // Two large plates face to face: 1/𝓕 = 1/ε₁ + 1/ε₂ − 1.
/// let f = radiosity_solve::script_f(&[0.0, 1.0, 1.0, 0.0], &[0.8, 0.4])?;
/// assert!((f[1] - 1.0 / (1.0 / 0.8 + 1.0 / 0.4 - 1.0)).abs() < 1e-15);
/// # Ok::<(), radiosity_solve::SolveError>(())
/// ```
///
/// # Errors
/// [`SolveError::NotApplicable`] where the numbers do not fit, an emittance is outside [0, 1], or surfaces that absorb
/// nothing see only each other.
pub fn script_f(factors: &[f64], emittances: &[f64]) -> Result<Vec<f64>, SolveError> {
    let n = emittances.len();
    if factors.len() != n * n {
        return Err(SolveError::NotApplicable("script-F needs as many rows and columns as emittances"));
    }
    if !emittances.iter().all(|e| (0.0..=1.0).contains(e)) {
        return Err(SolveError::NotApplicable("script-F needs emittances from 0 to 1"));
    }
    let matrix =
        DMatrix::from_fn(n, n, |i, j| f64::from(u8::from(i == j)) - (1.0 - emittances[i]) * factors[i * n + j]);
    let mut x = DMatrix::from_fn(n, n, |i, j| if i == j { emittances[i] } else { 0.0 });
    eliminate(matrix, &mut x);
    let product = DMatrix::from_fn(n, n, |i, j| factors[i * n + j]) * x;
    let script: Vec<f64> = (0..n * n).map(|k| emittances[k / n] * product[(k / n, k % n)]).collect();
    if script.iter().all(|f| f.is_finite()) {
        Ok(script)
    } else {
        Err(SolveError::NotApplicable("surfaces of emittance 0 see only each other: their radiosity is undetermined"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Concentric spheres (radii 1 and 2): 1/𝓕₁₂ = 1/ε₁ + (A₁/A₂)(1/ε₂ − 1); rows sum to ε, and reciprocity holds.
    #[test]
    fn catalogue_82_concentric_spheres() {
        let (factors, emittances, areas) = ([0.0, 1.0, 0.25, 0.75], [0.5, 0.8], [1.0, 4.0]);
        let script = script_f(&factors, &emittances).unwrap();
        assert!((script[1] - 1.0 / (1.0 / 0.5 + 0.25 * (1.0 / 0.8 - 1.0))).abs() < 1e-15);
        assert!((areas[0] * script[1] - areas[1] * script[2]).abs() < 1e-15);
        for i in 0..2 {
            assert!((script[2 * i] + script[2 * i + 1] - emittances[i]).abs() < 1e-15);
        }
    }

    #[test]
    fn what_cannot_be_is_refused() {
        assert!(script_f(&[0.0; 3], &[0.5, 0.5]).is_err());
        assert!(script_f(&[0.0; 4], &[0.5, 1.5]).is_err());
        assert!(script_f(&[0.0, 1.0, 1.0, 0.0], &[0.0, 0.0]).is_err());
    }
}
