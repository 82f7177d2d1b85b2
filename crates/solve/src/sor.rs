//! Gauss–Seidel and successive overrelaxation: gathering in sequence (catalogue 33, 36; Young 1950; Cohen & Wallace
//! 1993, §5.3.2).
//!
//! Unknown after unknown, B_i ← (1 − ω) B_i + ω (E_i + ρ_i Σ_{j≠i} F_ij B_j)/(1 − ρ_i F_ii), new values being used at
//! once; ω = 1 is Gauss–Seidel. On a symmetrisable system it converges for 0 < ω < 2 (Ostrowski 1954). It needs rows
//! in turn, so it does not run in parallel, and a response that is diagonal.
//!
//! The residual costs nothing. The sum over row i is split at the diagonal: the part beyond it, taken after a sweep,
//! is what the next sweep needs, and the part before it was summed over new values during this one. So a sweep with
//! its residual reads each entry once.

use crate::gauge::{Gauge, is_done};
use crate::{Go, Info, Params, Response, Rows, SolveError, Space};

/// Gauss–Seidel iteration; `b` holds the start and the result.
///
/// # Errors
/// [`SolveError::NotApplicable`] if the response is not diagonal; otherwise as [`crate::jacobi`].
pub fn gauss_seidel<T: Rows>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    sor(transport, response, e, b, &Params { relaxation: 1.0, ..*params }, step)
}

/// Successive overrelaxation with ω = [`Params::relaxation`]; `b` holds the start and the result.
///
/// # Errors
/// [`SolveError::NotApplicable`] if the response is not diagonal or ω is not between 0 and 2; otherwise as
/// [`crate::jacobi`].
pub fn sor<T: Rows>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    mut step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    let Some(rho) = response.diagonal() else {
        return Err(SolveError::NotApplicable("sweeps need a diagonal response; use bicgstab"));
    };
    let omega = params.relaxation;
    if !(omega > 0.0 && omega < 2.0) {
        return Err(SolveError::NotApplicable("overrelaxation needs a parameter between 0 and 2"));
    }
    let (bands, unknowns) = (response.bands(), transport.space().dim());
    let gauge = Gauge::new(transport, response, e);
    // Parts of h = F b: before the diagonal, at it and beyond it.
    let mut before = vec![0.0; b.len()];
    let mut beyond = vec![0.0; b.len()];
    let mut own = vec![0.0; unknowns];
    let mut r = vec![0.0; b.len()];

    // What the first sweep finds: each half is read once, and a start from zero is not read at all.
    let cold = b.iter().all(|b| *b == 0.0);
    for (i, own) in own.iter_mut().enumerate() {
        let at = i * bands;
        transport.row(i, |j, factor| {
            if j == i {
                *own = factor;
            } else if !cold {
                let part = if j < i { &mut before } else { &mut beyond };
                for band in 0..bands {
                    part[at + band] += factor * b[j * bands + band];
                }
            }
        });
    }
    let mut info = Info { work: if cold { 0.0 } else { 1.0 }, ..Info::default() };
    loop {
        for k in 0..b.len() {
            r[k] = e[k] + rho[k] * (before[k] + own[k / bands] * b[k] + beyond[k]) - b[k];
        }
        gauge.enter(transport, &r, &mut info);
        if is_done(b, &info, params, &mut step)? {
            return Ok(info);
        }

        // Sweep: the new values before the diagonal, the old ones beyond it.
        for (i, own) in own.iter().enumerate() {
            let range = i * bands..(i + 1) * bands;
            let sum = &mut before[range.clone()];
            sum.fill(0.0);
            transport.row(i, |j, factor| {
                if j < i {
                    for (sum, b) in sum.iter_mut().zip(&b[j * bands..]) {
                        *sum += factor * b;
                    }
                }
            });
            for k in range {
                let relaxed = (e[k] + rho[k] * (before[k] + beyond[k])) / (1.0 - rho[k] * own);
                b[k] = (1.0 - omega) * b[k] + omega * relaxed;
            }
        }
        // Beyond the diagonal, for the residual and for the sweep to come.
        for i in 0..unknowns {
            let sum = &mut beyond[i * bands..(i + 1) * bands];
            sum.fill(0.0);
            transport.row(i, |j, factor| {
                if j > i {
                    for (sum, b) in sum.iter_mut().zip(&b[j * bands..]) {
                        *sum += factor * b;
                    }
                }
            });
        }
        info.steps += 1;
        info.work += 1.0;
    }
}
