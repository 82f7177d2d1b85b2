//! BiCGSTAB: a Krylov method for systems that are not symmetric (van der Vorst 1992).
//!
//! For a table of hit ids, a mixing response, patches with elements. Two applications of F a step and seven vectors,
//! whatever the number of steps. Its residual does not fall evenly, and it can break down: a band whose shadow
//! residual becomes orthogonal to the residual begins anew from where it is. All bands run side by side with their
//! own coefficients, in the space's inner product.

use crate::gauge::{Gauge, begin, is_done, remainder};
use crate::krylov::{image, ratio};
use crate::{Go, Info, Params, Response, SolveError, Space, Transport};

/// |⟨r̂, r⟩| below this share of ‖r̂‖‖r‖ is a breakdown: √ε leaves half the digits to the coefficients that follow.
const BREAKDOWN: f64 = 1.5e-8;

/// Solves B = E + R F B in place; `b` holds the start and the result. `step` sees the field after each pair of
/// applications.
///
/// # Errors
/// As [`crate::jacobi`].
pub fn bicgstab<T: Transport>(
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
    let mut shadow = r.clone();
    let (mut p, mut v, mut t) = (r.clone(), vec![0.0; n], vec![0.0; n]);
    let mut rho = dot(&shadow, &r);
    let mut info = Info { steps: begun, work: begun as f64, ..Info::default() };
    loop {
        gauge.enter(transport, &r, &mut info);
        if is_done(b, &info, params, &mut step)? {
            return Ok(info);
        }

        // Along p, as far as the shadow says; s is left in r.
        image(transport, response, &p, &mut h, &mut v)?;
        let along = dot(&shadow, &v);
        let alpha: Vec<f64> = (0..bands).map(|band| ratio(rho[band], along[band])).collect();
        for k in 0..n {
            r[k] -= alpha[k % bands] * v[k];
        }
        // Along s, to the smallest residual.
        image(transport, response, &r, &mut h, &mut t)?;
        let (ts, tt) = (dot(&t, &r), dot(&t, &t));
        let omega: Vec<f64> = (0..bands).map(|band| ratio(ts[band], tt[band])).collect();
        for k in 0..n {
            b[k] += alpha[k % bands] * p[k] + omega[k % bands] * r[k];
            r[k] -= omega[k % bands] * t[k];
        }
        info.steps += 2;
        info.work += 2.0;

        // The next direction; a band that broke down begins anew from its residual.
        let (next, size, shadow_size) = (dot(&shadow, &r), dot(&r, &r), dot(&shadow, &shadow));
        let anew: Vec<bool> = (0..bands)
            .map(|band| next[band].abs() <= BREAKDOWN * (size[band] * shadow_size[band]).sqrt() || omega[band] == 0.0)
            .collect();
        for k in 0..n {
            let band = k % bands;
            if anew[band] {
                (shadow[k], p[k]) = (r[k], r[k]);
            } else {
                let beta = ratio(next[band], rho[band]) * ratio(alpha[band], omega[band]);
                p[k] = r[k] + beta * (p[k] - omega[band] * v[k]);
            }
        }
        rho = (0..bands).map(|band| if anew[band] { size[band] } else { next[band] }).collect();
    }
}
