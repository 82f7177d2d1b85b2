//! The exact discrete answer: factors by `adaptive` at the tightest accuracy that the time allows, and B by conjugate
//! gradients to rounding (generalised minimal residuals where sheets transmit light).

use super::contender::{Contender, Setting};
use super::difference::light_error;
use super::problem::{Problem, bright};
use crate::monitor::Watch;
use crate::{Error, Monitor};
use radiosity_solve::{Params, Solver, SparseTransport, Transport, solve};
use radiosity_transport::view_factors::Closure;
use radiosity_transport::{FormFactorMethod, FormFactors};
use serde::Serialize;
use std::time::Instant;

/// Accuracies one after the other; the first is taken whatever it costs, the next while there is time. Errors of single
/// factors are independent, so that light is better by far.
const ACCURACIES: [f64; 4] = [1e-3, 1e-4, 1e-5, 1e-6];

/// How much longer the next is expected to take: 1.3, 2.7 and 5.5 times in the Cornell box.
const LONGER: f64 = 4.0;

/// Relative residual of B.
const TOLERANCE: f64 = 1e-12;

/// How exact the reference is.
#[derive(Clone, Debug, Serialize)]
pub struct ReferenceAccount {
    /// Bound asked of the error of each factor of a pair that is partly hidden; 1e-4 of it for the others.
    pub accuracy: f64,
    /// Seconds for its factors.
    pub seconds: f64,
    /// Factors that are not zero.
    pub entries: usize,
    /// Relative L2 difference of illuminance from what ten times looser factors give: what is left is less.
    pub uncertainty: f64,
    /// Largest error that is stated of a factor.
    pub largest_stated_error: f64,
    /// Row sums against one, before any repair. In an open scene they are less by right.
    pub closure: Closure,
    /// Largest |A_i F_ij − A_j F_ji| over the smaller area.
    pub reciprocity: f64,
    /// Relative residual of B, the worst band.
    pub residual: f64,
    /// Guaranteed bound of what the residual leaves of B, lm/m², the worst band; infinite (in JSON: null) where it
    /// promises nothing.
    pub bound: f64,
    /// Mean illuminance by area, lx.
    pub mean_illuminance: f64,
}

/// F*, B* and what follows from them.
pub(super) struct Reference {
    pub factors: FormFactors,
    pub transport: SparseTransport<f64>,
    pub radiosity: Vec<f64>,
    pub irradiance: Vec<[f64; 3]>,
    pub account: ReferenceAccount,
}

impl Reference {
    /// Of a problem; its factors are as exact as asked, or as can be had within some `seconds`.
    pub fn new(problem: &Problem, (tightest, seconds): (f64, f64), monitor: &dyn Monitor) -> Result<Reference, Error> {
        let begun = Instant::now();
        let mut found: Option<Reference> = None;
        let (mut before, mut last) = (0.0, 0.0);
        for accuracy in ACCURACIES {
            // What was given up half-way would be time lost; so the next is begun only if it will end.
            if found.is_some() && (accuracy < tightest || before + last + LONGER * last > seconds) {
                break;
            }
            let next = Reference::at(accuracy, problem, monitor)?;
            let passed = begun.elapsed().as_secs_f64();
            (before, last) = (passed, passed - before);
            let uncertainty = found.as_ref().map_or(f64::INFINITY, |looser| {
                light_error(&looser.irradiance, &next.irradiance, &problem.area).relative
            });
            let account = ReferenceAccount { uncertainty, ..next.account.clone() };
            found = Some(Reference { account, ..next });
        }
        found.ok_or(Error::Stopped)
    }

    fn at(accuracy: f64, problem: &Problem, monitor: &dyn Monitor) -> Result<Reference, Error> {
        let begun = Instant::now();
        let options = Contender::options(Setting::Accuracy(accuracy), problem.memory);
        let factors = FormFactors::new(FormFactorMethod::Adaptive, &problem.enclosure, &options, &Watch(monitor))?;
        let seconds = begun.elapsed().as_secs_f64();
        let transport = factors.transport()?;
        let mut radiosity = vec![0.0; problem.emission.len()];
        let params = Params { tolerance: TOLERANCE, max_steps: 10_000, ..Params::default() };
        let response = problem.response(true);
        let step = |_: &[f64], _: &radiosity_solve::Info| radiosity_solve::Go::On;
        let solver = if problem.sheets.is_empty() { Solver::Cg } else { Solver::Gmres };
        let info = solve(solver, &transport, &response, &problem.emission, &mut radiosity, &params, step)?;
        let mut gathered = vec![0.0; radiosity.len()];
        transport.apply(&radiosity, &mut gathered, 3)?;
        let irradiance = problem.irradiance(&gathered);
        let total: f64 = problem.area.iter().sum();
        let flux: f64 = irradiance.iter().zip(&problem.area).map(|(h, area)| area * bright(*h)).sum();
        let account = ReferenceAccount {
            accuracy,
            seconds,
            uncertainty: f64::INFINITY,
            entries: factors.values.len(),
            largest_stated_error: factors.errors.iter().fold(0.0, |m, e| f64::from(*e).max(m)),
            closure: factors.closure(),
            reciprocity: factors.reciprocity(),
            residual: info.residual.iter().copied().fold(0.0, f64::max),
            bound: info.bound.iter().copied().fold(0.0, f64::max),
            mean_illuminance: flux / total,
        };
        Ok(Reference { factors, transport, radiosity, irradiance, account })
    }

    /// ‖B − B*‖/‖B* − E‖ by area and luminance: how much of the reflected light is wrong.
    pub fn radiosity_error(&self, b: &[f64], problem: &Problem) -> f64 {
        let (mut square, mut norm) = (0.0, 0.0);
        for (i, area) in problem.area.iter().enumerate() {
            let at = |of: &[f64]| bright([of[3 * i], of[3 * i + 1], of[3 * i + 2]]);
            let exact = at(&self.radiosity);
            square += area * (at(b) - exact).powi(2);
            norm += area * (exact - at(&problem.emission)).powi(2);
        }
        (square / norm.max(f64::MIN_POSITIVE)).sqrt()
    }
}
