//! Jacobi iteration with the constant deflated: B ← E + R F B, then the energy balance set right at once.
//!
//! Plain Jacobi (gathering) loses one factor ρ per sweep, because one error mode, the constant irradiance, decays as
//! slowly as ρ̄; all others die at about half that rate (a closed cube has eigenvalues 1, 0.51, …). After each sweep
//! the multiple c of v = R 1 that makes the residual's area integral vanish is added: a coarse space of one vector
//! for each part of the scene that sees no other (a two-level method; Nicolaides 1987). One vector for all rooms
//! together would pour a part of a bright room's error into a dark one. On a closed cube at ρ = 0.95 that takes 20
//! sweeps instead of 269.

use crate::gauge::{Gauge, is_done, remainder};
use crate::{Go, Info, Params, Response, SolveError, Space, Transport};

/// Solves B = E + R F B in place; `b` holds the start (warm or zero) and the result. `step` sees each iterate. This is
/// the solver `deflated-jacobi` of the table; the textbook's is [`crate::jacobi`].
///
/// # Errors
/// [`SolveError::NotConverged`] with the last iterate left in `b`; [`SolveError::Stopped`] if `step` says so.
pub fn deflated_jacobi<T: Transport>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    mut step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    let space = transport.space();
    let bands = response.bands();
    let n = b.len();
    let (mut h, mut r) = (vec![0.0; n], vec![0.0; n]);
    let ones = vec![1.0; n];

    // The coarse vector v = R 1, its image under F, and the balance of v itself, part by part.
    let parts = transport.parts();
    let part = |i: usize| parts.map_or(0, |p| p[i / bands] as usize) * bands + i % bands;
    let slots = bands * (1 + parts.and_then(|p| p.iter().max()).map_or(0, |p| *p as usize));
    let balance = |x: &[f64]| {
        // ⟨1, x⟩ by part: the inner product with the part's own indicator, gathered in one pass.
        let mut sums = vec![0.0; slots];
        space.accumulate(x, bands, |i, weighted| sums[part(i)] += weighted);
        sums
    };
    let (mut v, mut fv) = (vec![0.0; n], vec![0.0; n]);
    response.respond(&ones, &mut v);
    transport.apply(&v, &mut fv, bands);
    response.respond(&fv, &mut r);
    let kept: Vec<f64> = v.iter().zip(&r).map(|(v, rfv)| v - rfv).collect();
    let balance_of_v = balance(&kept);

    transport.apply(b, &mut h, bands);
    let gauge = Gauge::new(transport, response, e);
    let mut info = Info { steps: 2, work: 2.0, ..Info::default() };
    loop {
        gauge.measure(transport, response, (e, b, &h), &mut r, &mut info);
        if is_done(b, &info, params, &mut step)? {
            return Ok(info);
        }

        // Sweep: B + r is E + R F B.
        for (b, r) in b.iter_mut().zip(&r) {
            *b += r;
        }
        transport.apply(b, &mut h, bands);
        info.steps += 1;
        info.work += 1.0;

        // Deflate: the share of v that balances the area integral of the new residual. F is linear, so h follows.
        remainder(response, (e, b, &h), &mut r);
        let lacking = balance(&r);
        for i in 0..n {
            let slot = part(i);
            if balance_of_v[slot] > 0.0 {
                let c = lacking[slot] / balance_of_v[slot];
                b[i] += c * v[i];
                h[i] += c * fv[i];
            }
        }
    }
}
