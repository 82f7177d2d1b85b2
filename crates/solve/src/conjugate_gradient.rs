//! Conjugate gradients in the inner product weighted by A/ρ, in which I − R F is symmetric and positive definite.
//!
//! With A_i F_ij = A_j F_ji the matrix (A/ρ)(I − ρF) is symmetric (catalogue 8); without that weight CG has no right to
//! converge. Entries with ρ = 0 are known beforehand (B = E there) and kept fixed. Hestenes and Stiefel 1952;
//! all bands run side by side with their own step lengths.

use crate::gauge::{Gauge, is_done, remainder};
use crate::krylov::image;
use crate::{Go, Info, Params, Response, SolveError, Transport};

/// Solves B = E + R F B in place; `b` holds the start and the result. `step` sees each iterate.
///
/// # Errors
/// [`SolveError::NotApplicable`] if the response is not self-adjoint; otherwise as [`crate::deflated_jacobi`].
pub fn conjugate_gradient<T: Transport>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    mut step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    let Some(weight) = response.self_adjoint_weight() else {
        return Err(SolveError::NotApplicable(
            "conjugate gradients need a reciprocal transport and a response without transmission; use gmres",
        ));
    };
    let bands = response.bands();
    let n = b.len();
    let dot = |x: &[f64], y: &[f64]| {
        let mut sum = vec![0.0; bands];
        for i in 0..n {
            sum[i % bands] += weight[i] * x[i] * y[i];
        }
        sum
    };
    let ratio = |num: f64, den: f64| if den > 0.0 { num / den } else { 0.0 };

    for i in 0..n {
        if weight[i] == 0.0 {
            b[i] = e[i];
        }
    }
    let (mut h, mut r, mut ap) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    transport.apply(b, &mut h, bands)?;
    remainder(response, (e, b, &h), &mut r);
    let gauge = Gauge::new(transport, response, e);
    let mut info = Info { steps: 1, work: 1.0, ..Info::default() };
    let mut p = r.clone();
    let mut rr = dot(&r, &r);
    loop {
        gauge.enter(transport, &r, &mut info);
        if is_done(b, &info, params, &mut step)? {
            return Ok(info);
        }

        image(transport, response, &p, &mut h, &mut ap)?;
        info.steps += 1;
        info.work += 1.0;
        let pap = dot(&p, &ap);
        let alpha: Vec<f64> = (0..bands).map(|band| ratio(rr[band], pap[band])).collect();
        for i in 0..n {
            b[i] += alpha[i % bands] * p[i];
            r[i] -= alpha[i % bands] * ap[i];
        }
        let next = dot(&r, &r);
        for i in 0..n {
            p[i] = r[i] + ratio(next[i % bands], rr[i % bands]) * p[i];
        }
        rr = next;
    }
}
