//! One contender at one setting: what it cost and how far off it is.
//!
//! Errors are against the exact discrete answer: of F by ‖F − F*‖/‖F*‖ over all entries, of light by area-weighted
//! relative L2 of illuminance (the errors of the audit) and of reflected radiosity. One solver, at one tolerance far below
//! anything else, solves for all.

use super::attempt::{Apart, Made};
use super::contender::{Contender, Kind, Setting};
use super::difference::{Difference, light_error};
use super::problem::Problem;
use super::reference::Reference;
use crate::{Error, Monitor};
use radiosity_solve::{Go, Params, SolveError, Solver, Transport, solve};
use radiosity_transport::FormFactors;
use radiosity_transport::view_factors::Closure;
use serde::Serialize;
use std::time::Instant;

/// The solver of all trials: it needs no more of F than to be applied, and is quick in white rooms too.
pub(super) const SOLVER: Solver = Solver::DeflatedJacobi;

/// Its tolerance: a hundredth of the best contender's error.
const TOLERANCE: f64 = 1e-10;

/// What came of a contender at a setting.
#[derive(Clone, Debug, Serialize)]
pub struct Trial {
    /// Its name.
    pub method: &'static str,
    /// How it works.
    pub kind: Kind,
    /// Its setting.
    pub setting: Setting,
    /// Its setting in words.
    pub label: String,
    /// Wall-clock seconds for all factors.
    pub seconds: f64,
    /// Processor seconds, where the system tells and there were enough to tell.
    pub processor_seconds: Option<f64>,
    /// Seconds to solve the equation with them.
    pub solve_seconds: f64,
    /// Share of the factors in the time of both.
    pub factor_share: f64,
    /// Bytes of what is kept.
    pub bytes: usize,
    /// Factors that are not zero, or numbers of rays' hits.
    pub entries: usize,
    /// Rays or cells of a row.
    pub samples: Option<usize>,
    /// Row sums against one, as found. In an open scene they are less by right.
    pub closure: Closure,
    /// Root mean square of the row sums' differences from the exact ones.
    pub row_sum_error: f64,
    /// Largest |A_i F_ij − A_j F_ji| over the smaller area.
    pub reciprocity: f64,
    /// ‖F − F*‖/‖F*‖.
    pub factor_error: f64,
    /// Largest |F − F*|.
    pub largest_factor_error: f64,
    /// Share of the pairs of which the stated error, with the reference's own, covers the true one; for methods that
    /// state errors.
    pub covered: Option<f64>,
    /// Relative L2 error of illuminance by area.
    pub light_error: f64,
    /// ‖B − B*‖/‖B* − E‖ by area and luminance.
    pub radiosity_error: f64,
    /// Mean difference of illuminance over its mean, by area.
    pub bias: f64,
    /// Error from the truth by the referee, mesh included, constant on elements.
    pub error_from_truth: f64,
    /// What it got wrong.
    pub wrong: super::causes::Wrong,
    /// Illuminance by element, lux per band.
    #[serde(skip)]
    pub irradiance: Vec<[f64; 3]>,
}

/// A contender that was not let finish.
#[derive(Clone, Debug, Serialize)]
pub struct Skipped {
    /// Its name.
    pub method: &'static str,
    /// Its setting in words.
    pub label: String,
    /// Wall-clock seconds that it would take on this mesh.
    pub estimated_seconds: f64,
}

/// Judges what was made. `from_truth` tells the error from the truth of an illuminance by element.
///
/// # Errors
/// [`Error::Solve`], [`Error::Stopped`].
pub(super) fn judge(
    (contender, setting): (Contender, Setting),
    made: Made,
    problem: &Problem,
    reference: &Reference,
    from_truth: &dyn Fn(&[[f64; 3]]) -> f64,
    monitor: &dyn Monitor,
) -> Result<Trial, Error> {
    let Made { factors, apart, bytes, seconds, processor_seconds } = made;
    let begun = Instant::now();
    let (radiosity, gathered) = solved(&factors, apart.as_ref(), problem, monitor)?;
    let solve_seconds = begun.elapsed().as_secs_f64();
    let irradiance = problem.irradiance(&gathered);
    let states_errors = contender != Contender::Rays;
    let difference = Difference::new(&factors, &reference.factors);
    let light = light_error(&irradiance, &reference.irradiance, &problem.area);
    let samples = contender.samples(setting);
    Ok(Trial {
        method: contender.name(),
        kind: contender.kind(),
        setting,
        label: setting.to_string(),
        seconds,
        processor_seconds,
        solve_seconds,
        factor_share: seconds / (seconds + solve_seconds),
        bytes,
        entries: seen(&factors),
        samples,
        closure: factors.closure(),
        row_sum_error: difference.row_sums,
        reciprocity: factors.reciprocity(),
        factor_error: difference.relative,
        largest_factor_error: difference.largest,
        covered: states_errors.then_some(difference.covered),
        light_error: light.relative,
        radiosity_error: reference.radiosity_error(&radiosity, problem),
        bias: light.bias,
        error_from_truth: from_truth(&irradiance),
        wrong: super::causes::wrong(&factors, &irradiance, samples, problem, reference),
        irradiance,
    })
}

/// B and F B. What is carried apart, P, leaves the unknown: X = (E − P) + R (D_P + F X), B = X + P, F B = D_P + F X.
fn solved(
    factors: &FormFactors,
    apart: Option<&Apart>,
    problem: &Problem,
    monitor: &dyn Monitor,
) -> Result<(Vec<f64>, Vec<f64>), Error> {
    let transport = factors.transport()?;
    let response = problem.response(false);
    let params = Params { tolerance: TOLERANCE, max_steps: 10_000, ..Params::default() };
    let mut e = problem.emission.clone();
    if let Some(Apart { carried, direct }) = apart {
        let returned = problem.returned(direct);
        for k in 0..e.len() {
            e[k] += returned[k] - carried[k];
        }
    }
    let mut b = e.clone();
    let step = |_: &[f64], info: &radiosity_solve::Info| {
        if monitor.step(info.steps, info.steps + 1) { Go::On } else { Go::Stop }
    };
    match solve(SOLVER, &transport, &response, &e, &mut b, &params, step) {
        // Rows that sum to more than one may keep light from coming to rest; what was reached shows it.
        Ok(_) | Err(SolveError::NotConverged { .. }) => {}
        Err(SolveError::Stopped) => return Err(Error::Stopped),
        Err(other) => return Err(Error::Solve(other)),
    }
    let mut h = vec![0.0; b.len()];
    transport.apply(&b, &mut h, 3)?;
    if let Some(Apart { carried, direct }) = apart {
        for k in 0..b.len() {
            b[k] += carried[k];
            h[k] += direct[k];
        }
    }
    Ok((b, h))
}

/// Factors that are not zero.
fn seen(factors: &FormFactors) -> usize {
    factors.values.iter().filter(|value| **value != 0.0).count()
}
