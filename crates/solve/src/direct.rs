//! The full matrix method: elimination, with LU or Cholesky factors (catalogue 31; Goral, Torrance, Greenberg &
//! Battaile 1984).
//!
//! LU with partial pivoting solves (I − R F) B = E as it stands. Cholesky takes the symmetric form (catalogue 8),
//! (A_i/ρ_i) B_i − Σ_j A_i F_ij B_j = A_i E_i/ρ_i, at half the cost; black unknowns, known beforehand, go to the
//! right-hand side. Both need N³ time for each band, N/3 and N/6 applications of F, and 24 N² and 16 N² bytes at most
//! ([`crate::Solver::matrix_bytes`]); they serve as the oracle of all others. A start is of no use to them. The factors
//! are faer's.

use crate::gauge::{Gauge, is_done};
use crate::{Go, Info, Params, Response, Rows, SolveError, Space};
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

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
        let mut matrix = Mat::<f64>::identity(n, n);
        for i in 0..n {
            transport.row(i, |j, factor| matrix[(i, j)] -= rho[i * bands + band] * factor);
            if let Some((other, tau)) = sheets.passed(i, bands) {
                transport.row(other, |j, factor| matrix[(i, j)] -= tau[band] * factor);
            }
        }
        let mut x = Mat::from_fn(n, 1, |i, _| e[i * bands + band]);
        eliminate(&matrix, &mut x);
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
        let mut matrix = Mat::<f64>::zeros(bright.len(), bright.len());
        let mut x = Mat::<f64>::zeros(bright.len(), 1);
        for (k, &i) in bright.iter().enumerate() {
            let (at, area) = (i * bands + band, weight[i * bands + band] * rho[i * bands + band]);
            matrix[(k, k)] = weight[at];
            x[(k, 0)] = weight[at] * e[at];
            transport.row(i, |j, factor| match place[j] {
                usize::MAX => x[(k, 0)] += area * factor * e[j * bands + band],
                place => matrix[(k, place)] -= area * factor,
            });
        }
        eliminate_symmetric(&matrix, &mut x)?;
        for i in 0..n {
            let at = i * bands + band;
            b[at] = if place[i] == usize::MAX { e[at] } else { x[(place[i], 0)] };
        }
    }
    finish(transport, response, e, b, params, n as f64 / 6.0, step)
}

/// Solves for the columns of `x` in place. (That faer is called from what is not generic spares callers' crates its translation.)
pub(crate) fn eliminate(matrix: &Mat<f64>, x: &mut Mat<f64>) {
    matrix.partial_piv_lu().solve_in_place(x);
}

/// The same with a matrix that is symmetric and positive definite.
fn eliminate_symmetric(matrix: &Mat<f64>, x: &mut Mat<f64>) -> Result<(), SolveError> {
    let Ok(factors) = matrix.llt(Side::Lower) else {
        return Err(SolveError::NotApplicable("the symmetric form is not positive definite; use lu"));
    };
    factors.solve_in_place(x);
    Ok(())
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
