//! The equation B = E + R F B and its solvers. This crate knows vectors and operators, and no geometry.
//!
//! A field is a flat slice of `dim × bands` numbers, bands interleaved: one transport carries all bands at once.
//! A solver asks for the smallest trait it needs: [`Transport`] gives h = F b, [`Response`] gives R h, [`Space`] the
//! inner product. Parameters go in, the field and an [`Info`] come out; not reaching the tolerance is an error that
//! carries what was reached.

mod conjugate_gradient;
mod jacobi;
mod traits;

pub use conjugate_gradient::conjugate_gradient;
pub use jacobi::jacobi;
pub use traits::{AreaSpace, DenseTransport, DiffuseResponse, Response, Space, Transport};

use serde::Serialize;

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Params {
    /// The residual E + R F B − B, in the space's norm, relative to that of E, in every band. The default 1e-6 is a
    /// hundred times below what the transport's own error leaves visible.
    pub tolerance: f64,
    /// Largest number of applications of the transport.
    pub max_steps: usize,
}

impl Default for Params {
    fn default() -> Self {
        Params { tolerance: 1e-6, max_steps: 500 }
    }
}

/// What a solver did.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Info {
    /// Applications of the transport.
    pub steps: usize,
    /// Relative residual of each band at the end, in the space's norm.
    pub residual: Vec<f64>,
    /// Guaranteed bound of the largest error of B in each band: ‖r‖∞/(1 − ρ_max) (catalogue 35). It holds for the
    /// discrete equation when no row of F sums to more than one.
    pub bound: Vec<f64>,
}

/// Why a solver gave up.
#[derive(Debug, thiserror::Error)]
pub enum SolveError {
    /// The steps ran out.
    #[error("not converged after {} steps: relative residual {:?}, asked for {asked:e}", info.steps, info.residual)]
    NotConverged {
        /// What was reached; the field holds the last iterate.
        info: Info,
        /// The tolerance asked for.
        asked: f64,
    },
    /// The callback asked to stop.
    #[error("stopped on request")]
    Stopped,
    /// A solver was used where it has no right to converge.
    #[error("{0}")]
    NotApplicable(&'static str),
}

/// What a callback answers after each step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Go {
    /// Carry on.
    On,
    /// Stop now.
    Stop,
}

/// Residuals of a field: fills `residual` with E + R F B − B from `h = F b`, returns the relative norms by band.
fn residual(
    space: &impl Space,
    response: &(impl Response + ?Sized),
    (e, b, h): (&[f64], &[f64], &[f64]),
    residual: &mut [f64],
) -> Vec<f64> {
    response.respond(h, residual);
    for ((r, e), b) in residual.iter_mut().zip(e).zip(b) {
        *r += e - b;
    }
    let bands = response.bands();
    let (own, scale) = (space.inner(residual, residual, bands), space.inner(e, e, bands));
    own.iter().zip(scale).map(|(r, s)| relative(r.sqrt(), s.sqrt())).collect()
}

/// The norm of a residual relative to that of the right-hand side; nothing is left of nothing.
fn relative(residual: f64, scale: f64) -> f64 {
    if residual == 0.0 { 0.0 } else { residual / scale.max(f64::MIN_POSITIVE) }
}

/// Shows the caller an iterate and says whether the solver is done with it.
fn is_done(
    b: &[f64],
    info: &Info,
    params: &Params,
    step: &mut impl FnMut(&[f64], &Info) -> Go,
) -> Result<bool, SolveError> {
    if step(b, info) == Go::Stop {
        return Err(SolveError::Stopped);
    }
    if info.residual.iter().all(|x| *x <= params.tolerance) {
        return Ok(true);
    }
    if info.steps >= params.max_steps {
        return Err(SolveError::NotConverged { info: info.clone(), asked: params.tolerance });
    }
    Ok(false)
}

/// The guaranteed bound ‖r‖∞/(1 − ρ_max) of each band.
fn bound(response: &(impl Response + ?Sized), residual: &[f64]) -> Vec<f64> {
    let bands = response.bands();
    let largest = response.largest();
    (0..bands)
        .map(|band| {
            let worst = residual.iter().skip(band).step_by(bands).fold(0f64, |m, r| m.max(r.abs()));
            if largest[band] < 1.0 { worst / (1.0 - largest[band]) } else { f64::INFINITY }
        })
        .collect()
}

#[cfg(test)]
mod tests;
