//! GMRES(m): the smallest residual over the Krylov space, begun anew every m steps (Saad & Schultz 1986), in the form
//! of generalised conjugate residuals (Eisenstat, Elman & Schultz 1983).
//!
//! Both forms give the same iterates where the symmetric part of I − R F is positive definite; this one has field and
//! residual at hand after each step, for 2 m vectors instead of m. Each direction's image A p_k is made orthogonal to
//! those before, and B and r move along to where ‖r‖ is least, so the residual never grows. It can stand still where
//! the symmetric part is indefinite, which needs ρ and areas far from each other; bicgstab is the way out. One
//! application of F a step.

use crate::gauge::{Gauge, begin, is_done, remainder};
use crate::krylov::{image, ratio};
use crate::{Go, Info, Params, Response, SolveError, Space, Transport};

/// Solves B = E + R F B in place, with [`Params::restart`] directions; `b` holds the start and the result.
///
/// # Errors
/// As [`crate::jacobi`].
pub fn gmres<T: Transport>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    mut step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    let (bands, n) = (response.bands(), b.len());
    let gauge = Gauge::new(transport, response, e);
    let dot = |x: &[f64], y: &[f64]| transport.space().inner(x, y, bands);
    let (mut h, mut r) = (vec![0.0; n], vec![0.0; n]);
    let begun = begin(transport, b, &mut h, bands)?;
    remainder(response, (e, b, &h), &mut r);
    let mut info = Info { steps: begun, work: begun as f64, ..Info::default() };
    // Directions p, their images A p, and the squares of these by band.
    let mut kept: Vec<(Vec<f64>, Vec<f64>, Vec<f64>)> = Vec::new();
    loop {
        gauge.enter(transport, &r, &mut info);
        if is_done(b, &info, params, &mut step)? {
            return Ok(info);
        }
        if kept.len() >= params.restart.max(1) {
            kept.clear();
        }

        // The residual is the new direction, once its image has lost what the others' have.
        let (mut p, mut own) = (r.clone(), vec![0.0; n]);
        image(transport, response, &p, &mut h, &mut own)?;
        for (other, of_other, square) in &kept {
            let share = dot(&own, of_other);
            for k in 0..n {
                let c = ratio(share[k % bands], square[k % bands]);
                p[k] -= c * other[k];
                own[k] -= c * of_other[k];
            }
        }
        let (square, along) = (dot(&own, &own), dot(&r, &own));
        for k in 0..n {
            let alpha = ratio(along[k % bands], square[k % bands]);
            b[k] += alpha * p[k];
            r[k] -= alpha * own[k];
        }
        kept.push((p, own, square));
        info.steps += 1;
        info.work += 1.0;
    }
}
