//! Progressive refinement: light is shot, and every shot leaves a picture (Cohen, Chen, Wallace & Greenberg 1988).
//!
//! B = ΔB = E; repeat: choose i; for all j: rad = ΔB_i ρ_j F_ji, ΔB_j += rad, B_j += rad; ΔB_i = 0 (catalogue 38; the
//! self-share of a curved facet stays unshot). Three ways to choose and to show:
//! - sorted (catalogue 40): i has the greatest unshot energy A_i ΔB_i, summed over the bands;
//! - cyclic: i runs through all that have anything to shoot;
//! - sorted, shown with an ambient term (catalogue 41): B_i + ρ_i ΔB̄/(1 − ρ̄) stands in for what is still to come.
//!   It is for show only and never shot.
//!
//! The residual told is that of what has been shot, B − ΔB: exactly ΔB. The field shown includes ΔB, which has
//! arrived but not left, so its own residual R F ΔB is smaller still, and the bound holds for it too. It takes as
//! long to converge as gathering does; use it for the picture on the way.

use crate::gauge::is_done;
use crate::shot::{Ambient, Shots};
use crate::{Go, Info, Params, Response, Shoot, SolveError};

/// Progressive refinement, the greatest unshot energy first; `b` holds the start and the result.
///
/// # Errors
/// As [`crate::jacobi`]; the most shots are [`Params::max_steps`] times the number of unknowns.
pub fn progressive<T: Shoot>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    mut step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    let (mut shots, mut info) = Shots::new(transport, response, e, b)?;
    add(b, shots.unshot());
    loop {
        shots.account(&mut info);
        if is_done(b, &info, params, &mut step)? {
            return Ok(info);
        }
        let source = shots.brightest(None);
        shots.shoot_all(source, &mut info);
        add(b, shots.reflected());
    }
}

/// Progressive refinement in the order of the unknowns, round and round; those with nothing to shoot are passed over.
///
/// # Errors
/// As [`progressive`].
pub fn shooting_cyclic<T: Shoot>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    mut step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    let (mut shots, mut info) = Shots::new(transport, response, e, b)?;
    add(b, shots.unshot());
    let bands = response.bands();
    let unknowns = b.len() / bands;
    let mut source = 0;
    loop {
        shots.account(&mut info);
        if is_done(b, &info, params, &mut step)? {
            return Ok(info);
        }
        // Not done means that something is unshot; after one round at the latest it is found.
        let has_light = |i: &usize| shots.unshot()[i * bands..(i + 1) * bands].iter().any(|x| *x != 0.0);
        let next = (source..unknowns).chain(0..source).find(has_light);
        source = next.unwrap_or(source);
        shots.shoot_all(source, &mut info);
        add(b, shots.reflected());
        source = (source + 1) % unknowns;
    }
}

/// Progressive refinement, sorted, with the ambient term in what `step` sees. `b` ends without it: the same numbers as
/// [`progressive`] gives.
///
/// # Errors
/// As [`progressive`].
pub fn shooting_ambient<T: Shoot>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    mut step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    let largest = response.largest();
    let ambient = Ambient::new(transport, response, b.len());
    let (mut shots, mut info) = Shots::new(transport, response, e, b)?;
    add(b, shots.unshot());
    let mut shown = vec![0.0; b.len()];
    loop {
        shots.account(&mut info);
        // What is missing is within the bound, what stands in for it within ρ_max times the ambient irradiance; of
        // one sign, their difference is no larger than the larger.
        let one_sign = shots.unshot().iter().all(|x| *x >= 0.0) || shots.unshot().iter().all(|x| *x <= 0.0);
        let standing_in = ambient.irradiance(transport, shots.unshot());
        for ((bound, largest), irradiance) in info.bound.iter_mut().zip(&largest).zip(&standing_in) {
            let own = largest * irradiance.abs();
            *bound = if one_sign { bound.max(own) } else { *bound + own };
        }
        ambient.reflected(&standing_in, &mut shown);
        add(&mut shown, b);
        if is_done(&shown, &info, params, &mut step)? {
            // What was found good enough early is what was shown.
            if info.residual.iter().any(|x| *x > params.tolerance) {
                b.copy_from_slice(&shown);
            }
            return Ok(info);
        }
        let source = shots.brightest(None);
        shots.shoot_all(source, &mut info);
        add(b, shots.reflected());
    }
}

fn add(b: &mut [f64], more: &[f64]) {
    for (b, more) in b.iter_mut().zip(more) {
        *b += more;
    }
}
