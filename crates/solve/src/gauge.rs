//! How far an iterate is from the solution: the one residual and the one bound that all solvers report.
//!
//! The residual of B is r = E + R F B − B, its size the space's norm of r relative to that of E, band by band. The
//! error obeys (I − R F)(B* − B) = r, hence ‖B* − B‖∞ ≤ ‖r‖∞/(1 − ρ_max ‖F‖∞) (catalogue 35): guaranteed, and
//! infinite where ρ_max ‖F‖∞ ≥ 1 promises nothing.

use crate::{Go, Info, Params, Response, SolveError, Space, Transport};

/// What stays the same from step to step: the norm and the energy of E and the contraction ρ_max ‖F‖∞ of each band.
pub(crate) struct Gauge {
    scale: Vec<f64>,
    emitted: Vec<f64>,
    contraction: Vec<f64>,
}

impl Gauge {
    pub fn new<T: Transport>(transport: &T, response: &(impl Response + ?Sized), e: &[f64]) -> Gauge {
        let scale = transport.space().inner(e, e, response.bands()).into_iter().map(f64::sqrt).collect();
        let row_sum = transport.row_sum();
        let emitted = energy(transport, e, response.bands());
        Gauge { scale, emitted, contraction: response.largest().into_iter().map(|rho| rho * row_sum).collect() }
    }

    /// Fills `r` with E + R F B − B from `h = F b` and enters it in the account.
    pub fn measure<T: Transport>(
        &self,
        transport: &T,
        response: &(impl Response + ?Sized),
        (e, b, h): (&[f64], &[f64], &[f64]),
        r: &mut [f64],
        info: &mut Info,
    ) {
        remainder(response, (e, b, h), r);
        self.enter(transport, r, info);
    }

    /// Enters a residual that is known already in the account.
    pub fn enter<T: Transport>(&self, transport: &T, r: &[f64], info: &mut Info) {
        let bands = self.scale.len();
        let own = transport.space().inner(r, r, bands);
        info.residual = own.iter().zip(&self.scale).map(|(r, scale)| relative(r.sqrt(), *scale)).collect();
        let unshot = energy(transport, r, bands);
        info.unshot = unshot.iter().zip(&self.emitted).map(|(own, all)| relative(*own, *all)).collect();
        let mut worst = vec![0f64; bands];
        for r in r.chunks_exact(bands) {
            worst.iter_mut().zip(r).for_each(|(worst, r)| *worst = worst.max(r.abs()));
        }
        let bound = |(worst, contraction): (f64, &f64)| {
            let left = 1.0 - contraction;
            if left > 0.0 { worst / left } else { f64::INFINITY }
        };
        info.bound = worst.into_iter().zip(&self.contraction).map(bound).collect();
    }
}

/// Σ A_i x_i by band: the energy of a radiosity.
pub(crate) fn energy<T: Transport>(transport: &T, x: &[f64], bands: usize) -> Vec<f64> {
    let mut sums = vec![0.0; bands];
    transport.space().accumulate(x, bands, |_, band, weighted| sums[band] += weighted);
    sums
}

/// Fills `r` with E + R F B − B from `h = F b`.
pub(crate) fn remainder(response: &(impl Response + ?Sized), (e, b, h): (&[f64], &[f64], &[f64]), r: &mut [f64]) {
    response.respond(h, r);
    for ((r, e), b) in r.iter_mut().zip(e).zip(b) {
        *r += e - b;
    }
}

/// Writes h = F b for the start of an iteration and says how many applications that took: none for a start from zero.
pub(crate) fn begin<T: Transport>(transport: &T, b: &[f64], h: &mut [f64], bands: usize) -> Result<usize, SolveError> {
    if b.iter().all(|b| *b == 0.0) {
        h.fill(0.0);
        return Ok(0);
    }
    transport.apply(b, h, bands)?;
    Ok(1)
}

/// The norm of a residual relative to that of the right-hand side; nothing is left of nothing.
fn relative(residual: f64, scale: f64) -> f64 {
    if residual == 0.0 { 0.0 } else { residual / scale.max(f64::MIN_POSITIVE) }
}

/// Shows the caller an iterate and says whether the solver is done with it.
pub(crate) fn is_done(
    b: &[f64],
    info: &Info,
    params: &Params,
    step: &mut impl FnMut(&[f64], &Info) -> Go,
) -> Result<bool, SolveError> {
    match step(b, info) {
        Go::On => {}
        Go::Enough => return Ok(true),
        Go::Stop => return Err(SolveError::Stopped),
    }
    if info.residual.iter().all(|x| *x <= params.tolerance) {
        return Ok(true);
    }
    if info.work >= params.max_steps as f64 {
        return Err(SolveError::NotConverged { info: Box::new(info.clone()), asked: params.tolerance });
    }
    Ok(false)
}
