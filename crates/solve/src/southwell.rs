//! Southwell's relaxation: always the largest residual (catalogue 37; Southwell 1946; Gortler, Cohen & Slusallek 1994).
//!
//! i = argmax A_i |r_i|, then B_i ← B_i + r_i; that changes the residual by one column, r_j ← r_j + ρ_j F_ji r_i, and
//! sets r_i to its self-share. Started from zero its residuals are the unshot radiosities of progressive refinement,
//! number by number; only what is shown differs, by just these. It converges as slowly as that does.

use crate::gauge::is_done;
use crate::shot::Shots;
use crate::{Go, Info, Params, Response, Shoot, SolveError};

/// Solves B = E + R F B in place; `b` holds the start and the result. `step` sees the field after each relaxation.
///
/// # Errors
/// As [`crate::jacobi`].
pub fn southwell<T: Shoot>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    mut step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    let (mut shots, mut info) = Shots::new(transport, response, e, b)?;
    loop {
        shots.account(&mut info);
        if is_done(b, &info, params, &mut step)? {
            return Ok(info);
        }
        let i = shots.brightest(None);
        let amount = shots.shoot_all(i, &mut info);
        for (b, r) in b[i * amount.len()..].iter_mut().zip(amount) {
            *b += r;
        }
    }
}
