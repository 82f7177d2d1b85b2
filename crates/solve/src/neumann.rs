//! The Neumann series B = Σ (R F)^k E, bounce by bounce (catalogue 9, 10; Kajiya 1986; Cohen & Wallace 1993, §5.3.1).
//!
//! Term k is the light after k reflections. With r_0 = E + R F B_0 − B_0 for a start B_0, the terms r_{k+1} = R F r_k
//! sum up to the solution, and r_k is the residual after k of them. Truncation after k leaves at most ρ_max^{k+1} of
//! a furnace's light out. It converges as slowly as Jacobi iteration, whose iterates it repeats but for rounding.

use crate::gauge::{Gauge, begin, is_done, remainder};
use crate::{Go, Info, Params, Response, SolveError, Transport};

/// Solves B = E + R F B in place, a bounce a step; `b` holds the start and the result.
///
/// # Errors
/// [`SolveError::NotConverged`] with the sum so far left in `b`; [`SolveError::Stopped`] if `step` says so.
pub fn neumann<T: Transport>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    mut step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    let (bands, n) = (response.bands(), b.len());
    let gauge = Gauge::new(transport, response, e);
    let (mut h, mut layer) = (vec![0.0; n], vec![0.0; n]);
    let begun = begin(transport, b, &mut h, bands)?;
    remainder(response, (e, b, &h), &mut layer);
    let mut info = Info { steps: begun, work: begun as f64, ..Info::default() };
    loop {
        gauge.enter(transport, &layer, &mut info);
        if is_done(b, &info, params, &mut step)? {
            return Ok(info);
        }
        for (b, layer) in b.iter_mut().zip(&layer) {
            *b += layer;
        }
        transport.apply(&layer, &mut h, bands)?;
        response.respond(&h, &mut layer);
        info.steps += 1;
        info.work += 1.0;
    }
}

/// The light of each bounce by itself: layer 0 is E, layer k what was reflected k times, up to `count` times. The
/// layers up to the convergence of [`neumann`] sum to its solution.
///
/// # Errors
/// [`SolveError::Transport`].
///
/// ```
/// use radiosity_solve::{DenseTransport, DiffuseResponse, bounces};
///
/// // A furnace of one element that sees itself: bounce k carries ρ^k.
/// let sphere = DenseTransport::new(vec![1.0], vec![1.0])?;
/// let half = DiffuseResponse { reflectance: vec![0.5], bands: 1, reciprocal_area: None };
/// assert_eq!(bounces(&sphere, &half, &[1.0], 3)?, [[1.0], [0.5], [0.25], [0.125]]);
/// # Ok::<(), radiosity_solve::SolveError>(())
/// ```
pub fn bounces<T: Transport>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    count: usize,
) -> Result<Vec<Vec<f64>>, SolveError> {
    let mut layers = vec![e.to_vec()];
    let mut h = vec![0.0; e.len()];
    for bounce in 0..count {
        let mut layer = vec![0.0; e.len()];
        transport.apply(&layers[bounce], &mut h, response.bands())?;
        response.respond(&h, &mut layer);
        layers.push(layer);
    }
    Ok(layers)
}
