//! The full matrix method: elimination, with LU or Cholesky factors (catalogue 31; Goral, Torrance, Greenberg &
//! Battaile 1984).
//!
//! LU with partial pivoting solves (I − R F) B = E as it stands. Cholesky takes the symmetric form (catalogue 8),
//! (A_i/ρ_i) B_i − Σ_j A_i F_ij B_j = A_i E_i/ρ_i, at half the cost; black unknowns, known beforehand, go to the
//! right-hand side. Both need N³ time for each band, N/3 and N/6 applications of F, and 8 N² bytes
//! ([`crate::Solver::matrix_bytes`]); they serve as the oracle of all others. A start is of no use to them. Factors of
//! panels, and products of matrices, are nalgebra's.

use crate::gauge::{Gauge, is_done};
use crate::{Go, Info, Params, Response, Rows, SolveError, Space};
use nalgebra::DMatrix;

/// Columns whose pivots are found one by one; whatever is beside them follows in one product of matrices, which takes so many at once well.
const PANEL: usize = 64;

/// LU factors with partial pivoting; `b` receives the result.
///
/// # Errors
/// [`SolveError::NotApplicable`] if the response is not one of sheets; otherwise as [`crate::jacobi`].
pub fn lu<T: Rows>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    let Some(sheets) = response.sheets() else {
        return Err(SolveError::NotApplicable(
            "elimination needs a response of plain surfaces and sheets; use bicgstab",
        ));
    };
    let rho = sheets.reflectance;
    let (bands, n) = (response.bands(), transport.space().dim());
    for band in 0..bands {
        let mut matrix = DMatrix::<f64>::identity(n, n);
        for i in 0..n {
            transport.row(i, |j, factor| matrix[(i, j)] -= rho[i * bands + band] * factor);
            if let Some((other, tau)) = sheets.passed(i, bands) {
                transport.row(other, |j, factor| matrix[(i, j)] -= tau[band] * factor);
            }
        }
        let mut x = DMatrix::from_fn(n, 1, |i, _| e[i * bands + band]);
        eliminate(matrix, &mut x);
        for i in 0..n {
            b[i * bands + band] = x[(i, 0)];
        }
    }
    finish(transport, response, e, b, params, n as f64 / 3.0, step)
}

/// Cholesky factors of the symmetric form; `b` receives the result.
///
/// # Errors
/// [`SolveError::NotApplicable`] if the response is not self-adjoint or the symmetric form not positive definite;
/// otherwise as [`crate::jacobi`].
pub fn cholesky<T: Rows>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    let (Some(rho), Some(weight)) = (response.diagonal(), response.self_adjoint_weight()) else {
        return Err(SolveError::NotApplicable(
            "Cholesky factors need a reciprocal transport and a response without transmission; use lu",
        ));
    };
    let (bands, n) = (response.bands(), transport.space().dim());
    for band in 0..bands {
        // Place of each unknown that reflects; the black ones are solved by B = E.
        let bright: Vec<usize> = (0..n).filter(|i| weight[i * bands + band] > 0.0).collect();
        let mut place = vec![usize::MAX; n];
        for (k, i) in bright.iter().enumerate() {
            place[*i] = k;
        }
        let mut matrix = DMatrix::<f64>::zeros(bright.len(), bright.len());
        let mut x = DMatrix::<f64>::zeros(bright.len(), 1);
        for (k, &i) in bright.iter().enumerate() {
            let (at, area) = (i * bands + band, weight[i * bands + band] * rho[i * bands + band]);
            matrix[(k, k)] = weight[at];
            x[(k, 0)] = weight[at] * e[at];
            transport.row(i, |j, factor| match place[j] {
                usize::MAX => x[(k, 0)] += area * factor * e[j * bands + band],
                place => matrix[(k, place)] -= area * factor,
            });
        }
        if !eliminate_symmetric(matrix, &mut x) {
            return Err(SolveError::NotApplicable("the symmetric form is not positive definite; use lu"));
        }
        for i in 0..n {
            let at = i * bands + band;
            b[at] = if place[i] == usize::MAX { e[at] } else { x[(place[i], 0)] };
        }
    }
    finish(transport, response, e, b, params, n as f64 / 6.0, step)
}

/// Solves for the columns of `x` in place: panel by panel of the matrix, by partial pivoting (Golub and Van Loan 2013,
/// sect. 3.4). Where a pivot is nothing, nothing finite comes.
pub(crate) fn eliminate(mut matrix: DMatrix<f64>, x: &mut DMatrix<f64>) {
    let n = matrix.nrows();
    for start in (0..n).step_by(PANEL) {
        let end = n.min(start + PANEL);
        let panel = matrix.view_range(start.., start..end).into_owned().lu();
        let factors = panel.lu_internal();
        matrix.view_range_mut(start..end, start..end).copy_from(&factors.rows(0, end - start));
        for mut beside in [matrix.view_range_mut(start.., end..), x.rows_range_mut(start..)] {
            panel.p().permute_rows(&mut beside);
            let (mut above, mut below) = beside.rows_range_pair_mut(..end - start, end - start..);
            factors.rows(0, end - start).solve_lower_triangular_with_diag_mut(&mut above, 1.0);
            below.gemm(-1.0, &factors.rows_range(end - start..), &above, 1.0);
        }
    }
    for start in (0..n).step_by(PANEL).rev() {
        let end = n.min(start + PANEL);
        let (mut above, mut own) = x.rows_range_pair_mut(..start, start..end);
        if !matrix.view_range(start..end, start..end).solve_upper_triangular_mut(&mut own) {
            x.fill(f64::NAN);
            return;
        }
        above.gemm(-1.0, &matrix.view_range(..start, start..end), &own, 1.0);
    }
}

/// The same of a matrix that is symmetric, of which only what is on and below the diagonal is looked at; whether it is
/// positive definite, without which `x` is spoilt.
fn eliminate_symmetric(mut matrix: DMatrix<f64>, x: &mut DMatrix<f64>) -> bool {
    let n = matrix.nrows();
    for start in (0..n).step_by(PANEL) {
        let end = n.min(start + PANEL);
        let Some(factor) = matrix.view_range(start..end, start..end).into_owned().cholesky() else { return false };
        let factor = factor.unpack();
        // The rows below are solved for as columns, and every block of columns of what is left takes its product with them.
        let mut across = matrix.view_range(end.., start..end).transpose();
        factor.solve_lower_triangular_mut(&mut across);
        let below = across.transpose();
        for left in (end..n).step_by(PANEL) {
            let right = n.min(left + PANEL);
            let columns = across.columns_range(left - end..right - end);
            matrix.view_range_mut(left.., left..right).gemm(-1.0, &below.rows_range(left - end..), &columns, 1.0);
        }
        let (mut above, mut rest) = x.rows_range_pair_mut(start..end, end..);
        factor.solve_lower_triangular_mut(&mut above);
        rest.gemm(-1.0, &below, &above, 1.0);
        matrix.view_range_mut(start..end, start..end).copy_from(&factor);
        matrix.view_range_mut(end.., start..end).copy_from(&below);
    }
    matrix.tr_solve_lower_triangular_mut(x)
}

/// Measures what elimination left, by one application.
fn finish<T: Rows>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &[f64],
    params: &Params,
    work: f64,
    mut step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    let (mut h, mut r) = (vec![0.0; b.len()], vec![0.0; b.len()]);
    transport.apply(b, &mut h, response.bands())?;
    let mut info = Info { steps: 1, work: work + 1.0, ..Info::default() };
    Gauge::new(transport, response, e).measure(transport, response, (e, b, &h), &mut r, &mut info);
    // There is no second step: what is not done now never will be.
    if is_done(b, &info, &Params { max_steps: usize::MAX, ..*params }, &mut step)? {
        return Ok(info);
    }
    Err(SolveError::NotConverged { info: Box::new(info), asked: params.tolerance })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Panels of all widths, with pivots that are not where they stand, against elimination in one piece.
    #[test]
    fn panels_give_what_one_piece_gives() {
        for n in [1, 2, PANEL - 1, PANEL, PANEL + 1, 3 * PANEL + 7] {
            let random = |i: usize, j: usize| ((i * 7919 + j * 104_729 + 13) % 1009) as f64 / 1009.0 - 0.5;
            let matrix = DMatrix::from_fn(n, n, |i, j| random(i, j) + f64::from(u8::from(i + j + 1 == n)));
            let given = DMatrix::from_fn(n, 3, |i, j| random(j, i + 5));
            let mut found = given.clone();
            eliminate(matrix.clone(), &mut found);
            let expected = matrix.lu().solve(&given).unwrap();
            assert!((&found - &expected).amax() < 1e-10 * expected.amax(), "{n}: {}", (found - expected).amax());
        }
    }

    #[test]
    fn symmetric_panels_give_what_one_piece_gives() {
        for n in [1, PANEL, PANEL + 1, 3 * PANEL + 7] {
            let random = |i: usize, j: usize| ((i * 7919 + j * 104_729 + 13) % 1009) as f64 / 1009.0 - 0.5;
            let matrix = DMatrix::from_fn(n, n, |i, j| random(i + j, i * j) + f64::from(u8::from(i == j)) * n as f64);
            let given = DMatrix::from_fn(n, 3, |i, j| random(j, i + 5));
            let mut found = given.clone();
            assert!(eliminate_symmetric(matrix.clone(), &mut found));
            let expected = matrix.clone().lu().solve(&given).unwrap();
            assert!((&found - &expected).amax() < 1e-12 * expected.amax(), "{n}: {}", (found - expected).amax());
            let mut indefinite = matrix;
            indefinite[(n - 1, n - 1)] *= -1.0;
            assert!(!eliminate_symmetric(indefinite, &mut given.clone()));
        }
    }

    #[test]
    fn nothing_finite_comes_of_no_pivots() {
        let mut x = DMatrix::repeat(2 * PANEL, 1, 1.0);
        eliminate(DMatrix::zeros(2 * PANEL, 2 * PANEL), &mut x);
        assert!(x.iter().all(|x| x.is_nan()));
    }
}
