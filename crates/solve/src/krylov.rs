//! What Krylov methods share: the image of a field under I − R F, and coefficients of bands that are done.

use crate::{Response, SolveError, Transport};

/// A x = x − R F x, with `h` for F x.
pub(crate) fn image<T: Transport>(
    transport: &T,
    response: &(impl Response + ?Sized),
    x: &[f64],
    h: &mut [f64],
    ax: &mut [f64],
) -> Result<(), SolveError> {
    transport.apply(x, h, response.bands())?;
    response.respond(h, ax);
    for (ax, x) in ax.iter_mut().zip(x) {
        *ax = x - *ax;
    }
    Ok(())
}

/// A band that is solved has nothing left to divide.
pub(crate) fn ratio(num: f64, den: f64) -> f64 {
    if den == 0.0 { 0.0 } else { num / den }
}
