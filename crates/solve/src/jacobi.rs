//! Jacobi iteration, gathering simultaneously: B ← E + R F B (catalogue 32; Cohen & Greenberg 1985; Cohen & Wallace
//! 1993, §5.3.1).
//!
//! The residual r = E + R F B − B is the step itself, so each sweep costs one application of F. The error loses a
//! factor ρ_max or more in each. It fails where that is near one: 1374 sweeps to 1e-6 on a closed cube with ρ = 0.99;
//! see [`crate::deflated_jacobi`], which deflates the constant.

use crate::gauge::{Gauge, begin, is_done};
use crate::{Go, Info, Params, Response, SolveError, Transport};

/// Solves B = E + R F B in place by the textbook's Jacobi iteration; `b` holds the start and the result.
///
/// # Errors
/// [`SolveError::NotConverged`] with the last iterate left in `b`; [`SolveError::Stopped`] if `step` says so.
pub fn jacobi<T: Transport>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    mut step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    let (bands, n) = (response.bands(), b.len());
    let gauge = Gauge::new(transport, response, e);
    let (mut h, mut r) = (vec![0.0; n], vec![0.0; n]);
    let begun = begin(transport, b, &mut h, bands)?;
    let mut info = Info { steps: begun, work: begun as f64, ..Info::default() };
    loop {
        gauge.measure(transport, response, (e, b, &h), &mut r, &mut info);
        if is_done(b, &info, params, &mut step)? {
            return Ok(info);
        }
        for (b, r) in b.iter_mut().zip(&r) {
            *b += r;
        }
        transport.apply(b, &mut h, bands)?;
        info.steps += 1;
        info.work += 1.0;
    }
}
