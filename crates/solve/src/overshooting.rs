//! Overshooting: an unknown shoots in advance what it will have to shoot later (Feda & Purgathofer 1992,
//! "Accelerating radiosity by overshooting", Eurographics Workshop on Rendering; Gortler, Cohen & Slusallek 1994
//! place it among the relaxations).
//!
//! Unknown i shoots ΔB_i + ρ_i a, with a = ΔB̄/(1 − ρ̄) the ambient irradiance that all unshot light will make: what
//! i is going to receive and reflect on. What it shot too early stands in ΔB_i as a debt, −ρ_i a, which arriving
//! light pays; as ΔB̄ tends to zero, so does what is shot in advance. i has the largest A_i |ΔB_i + ρ_i a|. The
//! energy that is unshot need not fall at every shot, and no proof of convergence is known to us. Therefore N shots that
//! have not brought the residual down by a tenth are followed by N without advance, and after the third time there is
//! none any more: plain shooting always converges. ΔB̄ is taken with its sign, so that debts are settled early; by its
//! positive part alone the end takes up to three times as many shots.

use crate::gauge::is_done;
use crate::shot::{Ambient, Shots};
use crate::{Go, Info, Params, Response, Shoot, SolveError};

/// What N shots may at most leave of the residual for the next N to shoot in advance: what plain ones leave at ρ =
/// 0.9, so that an advance which does worse is given up. With 0.5 it would be given up where it works, with 0.99 only
/// after it has long stood still.
const PROGRESS: f64 = 0.9;

/// How often that may fail before it is given up for good. Closed cubes up to ρ = 0.99 never fail; what fails again after
/// rounds without advance does not converge with it.
const PATIENCE: usize = 3;

/// Progressive refinement with overshooting; `b` holds the start and the result.
///
/// # Errors
/// As [`crate::progressive`].
pub fn overshooting<T: Shoot>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    mut step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    let bands = response.bands();
    let ambient = Ambient::new(transport, response, b.len());
    let (mut shots, mut info) = Shots::new(transport, response, e, b)?;
    for (b, unshot) in b.iter_mut().zip(shots.unshot()) {
        *b += unshot;
    }
    let unknowns = b.len() / bands;
    let worst = |info: &Info| info.residual.iter().fold(0f64, |m, r| m.max(*r));
    let (mut advance, mut failures, mut before) = (true, 0, f64::INFINITY);
    let mut extra = vec![0.0; b.len()];
    loop {
        shots.account(&mut info);
        if is_done(b, &info, params, &mut step)? {
            return Ok(info);
        }
        // The first round builds up the debts, more of them the whiter the room, and is not judged.
        if info.steps > 0 && info.steps.is_multiple_of(unknowns) {
            let now = worst(&info);
            let failed = advance && now > PROGRESS * before;
            failures += usize::from(failed);
            advance = !failed && failures < PATIENCE;
            before = now;
        }
        if advance {
            ambient.reflected(&ambient.irradiance(transport, shots.unshot()), &mut extra);
        } else {
            extra.fill(0.0);
        }
        let source = shots.brightest(Some(&extra));
        let range = source * bands..(source + 1) * bands;
        let amount: Vec<f64> =
            shots.unshot()[range.clone()].iter().zip(&extra[range]).map(|(own, extra)| own + extra).collect();
        shots.shoot(source, &amount, &mut info);
        for (b, reflected) in b.iter_mut().zip(shots.reflected()) {
            *b += reflected;
        }
    }
}
