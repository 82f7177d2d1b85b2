//! GMRES(m): the smallest residual over the Krylov space, begun anew every m steps (Saad & Schultz 1986), in the form
//! of generalised conjugate residuals (Eisenstat, Elman & Schultz 1983).
//!
//! Both forms give the same iterates where the symmetric part of I − R F is positive definite; this one has field and
//! residual at hand after each step, for 2 m vectors instead of m. Each direction's image A p_k is made orthogonal to
//! those before, and B and r move along to where ‖r‖ is least, so the residual never grows. It can stand still where
//! the symmetric part is indefinite, which needs ρ and areas far from each other; bicgstab is the way out. One
//! application of F a step.

use crate::gauge::{Gauge, begin, is_done, remainder};
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
    let begun = begin(transport, b, &mut h, bands);
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
        let (mut p, mut image) = (r.clone(), vec![0.0; n]);
        transport.apply(&p, &mut h, bands);
        response.respond(&h, &mut image);
        for (image, p) in image.iter_mut().zip(&p) {
            *image = p - *image;
        }
        for (other, others_image, square) in &kept {
            let share = dot(&image, others_image);
            for k in 0..n {
                let c = ratio(share[k % bands], square[k % bands]);
                p[k] -= c * other[k];
                image[k] -= c * others_image[k];
            }
        }
        let (square, along) = (dot(&image, &image), dot(&r, &image));
        for k in 0..n {
            let alpha = ratio(along[k % bands], square[k % bands]);
            b[k] += alpha * p[k];
            r[k] -= alpha * image[k];
        }
        kept.push((p, image, square));
        info.steps += 1;
        info.work += 1.0;
    }
}

/// A band that is solved has nothing left to divide.
fn ratio(num: f64, den: f64) -> f64 {
    if den == 0.0 { 0.0 } else { num / den }
}
