//! Each solver on the exact factors: what residual, what error and what picture it has after how much work.
//!
//! Work is counted in applications of F, a sweep: a shot is an N-th of one. The picture is what the solver shows, with an
//! ambient term where it has one.

use super::contender::Family;
use super::look::Look;
use super::problem::Problem;
use super::reference::Reference;
use crate::{Error, Monitor};
use radiosity_solve::{Go, Info, Params, SolveError, Solver, solve};
use serde::Serialize;
use std::time::Instant;

/// Relative residual at which a solver is done.
const TOLERANCE: f64 = 1e-8;

/// Applications of F after which it is left where it is.
const MOST_WORK: usize = 60;

/// Marks are set where work has grown by this factor: twenty to a decade.
const STRIDE: f64 = 1.122;

/// Amounts of work at which solvers are ranked.
pub const RANKED_AT: [f64; 3] = [0.1, 1.0, 10.0];

/// Where a solver is after some work.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mark {
    /// Applications of F.
    pub work: f64,
    /// Seconds.
    pub seconds: f64,
    /// Relative residual, the worst band.
    pub residual: f64,
    /// ‖B − B*‖/‖B* − E‖ by area and luminance.
    pub error: f64,
    /// Displayed error: root mean square over the picture, 1 for white instead of black.
    pub displayed: f64,
}

/// A solver's way.
#[derive(Clone, Debug, Serialize)]
pub struct March {
    /// Its name.
    pub solver: &'static str,
    /// Its family.
    pub family: Family,
    /// What it is and where it is from.
    pub description: &'static str,
    /// Where it was on the way; the last is the end.
    pub marks: Vec<Mark>,
    /// Steps of the method.
    pub steps: usize,
    /// Whether the residual came below 1e-8.
    pub converged: bool,
    /// Why it did not run, or ended early; empty where it converged.
    pub remark: String,
}

impl March {
    /// What it has after `work`: the last mark until then.
    pub fn at(&self, work: f64) -> Option<&Mark> {
        self.marks.iter().take_while(|mark| mark.work <= work * (1.0 + 1e-9)).last()
    }
}

/// Runs a solver for at most `seconds`.
///
/// # Errors
/// [`Error::Stopped`].
pub(super) fn march(
    solver: Solver,
    problem: &Problem,
    reference: &Reference,
    look: &Look,
    seconds: f64,
    monitor: &dyn Monitor,
) -> Result<March, Error> {
    let params = Params { tolerance: TOLERANCE, max_steps: MOST_WORK, ..Params::default() };
    // Gathering starts from E, which it would find in its first sweep; what shoots begins with nothing shot.
    let is_late = matches!(solver, Solver::Jacobi | Solver::Neumann);
    let starts_lit = is_late || solver == Solver::DeflatedJacobi;
    let mut b = if starts_lit { problem.emission.clone() } else { vec![0.0; problem.emission.len()] };
    // Their residual takes the application that the next iterate is made of: the iterate shown had one less.
    let behind = if is_late { 1.0 } else { 0.0 };
    let mut marks: Vec<Mark> = Vec::new();
    let mut steps = 0;
    let (mut is_stopped, mut is_over) = (false, false);
    let mark = |b: &[f64], info: &Info, seconds: f64| Mark {
        work: (info.work - behind).max(0.0),
        seconds,
        residual: info.residual.iter().copied().fold(0.0, f64::max),
        error: reference.radiosity_error(b, problem),
        displayed: look.error(b),
    };
    // The clock stands still while marks are set.
    let (mut own, mut since) = (0.0, Instant::now());
    let step = |b: &[f64], info: &Info| {
        own += since.elapsed().as_secs_f64();
        steps = info.steps;
        let residual = info.residual.iter().copied().fold(0.0, f64::max);
        let is_due = marks.last().is_none_or(|last| info.work - behind >= STRIDE * last.work || residual <= TOLERANCE);
        if is_due {
            marks.push(mark(b, info, own));
        }
        is_over = own > seconds;
        is_stopped = !monitor.step((100.0 * info.work) as usize, 100 * MOST_WORK);
        since = Instant::now();
        if is_stopped || is_over { Go::Stop } else { Go::On }
    };
    let response = problem.response(true);
    let result = solve(solver, &reference.transport, &response, &problem.emission, &mut b, &params, step);
    own += since.elapsed().as_secs_f64();
    if is_stopped {
        return Err(Error::Stopped);
    }
    let (converged, remark, info) = match result {
        Ok(info) => (true, String::new(), Some(info)),
        Err(SolveError::NotConverged { info, .. }) => (false, "left after as much work as all".to_owned(), Some(*info)),
        Err(SolveError::Stopped) => (false, "left when its time was over".to_owned(), None),
        Err(SolveError::NotApplicable(why)) => (false, why.to_owned(), None),
        Err(other) => return Err(Error::Solve(other)),
    };
    if let Some(info) = info {
        steps = info.steps;
        if marks.last().is_none_or(|last| last.work < info.work - behind) {
            marks.push(mark(&b, &info, own));
        }
    }
    let (name, description) = (solver.name(), solver.description());
    Ok(March { solver: name, family: Family::of(solver), description, marks, steps, converged, remark })
}

/// Who is ahead after some work.
#[derive(Clone, Debug, Serialize)]
pub struct Lead {
    /// Applications of F.
    pub work: f64,
    /// The best solver of each family that has anything by then, and its displayed error; the best family first.
    pub ranks: Vec<(Family, &'static str, f64)>,
}

/// Ranks families by what they display after 0.1, 1 and 10 applications of F. Elimination has nothing on the way.
pub(super) fn leads(marches: &[March]) -> Vec<Lead> {
    let lead = |work: f64| {
        let mut ranks: Vec<(Family, &'static str, f64)> = Vec::new();
        for march in marches {
            let Some(mark) = march.at(work) else { continue };
            match ranks.iter_mut().find(|(family, ..)| *family == march.family) {
                Some(best) if mark.displayed < best.2 => (best.1, best.2) = (march.solver, mark.displayed),
                Some(_) => {}
                None => ranks.push((march.family, march.solver, mark.displayed)),
            }
        }
        ranks.sort_by(|a, b| a.2.total_cmp(&b.2));
        Lead { work, ranks }
    };
    RANKED_AT.map(lead).to_vec()
}

/// Where a solver that starts slower passes one that has a picture earlier.
#[derive(Clone, Debug, Serialize)]
pub struct Crossing {
    /// The solver that shoots.
    pub early: &'static str,
    /// The other.
    pub late: &'static str,
    /// Work from which on the other displays less error, for good; none where it does not before both are right to a tenth
    /// of a step of 8 bits.
    pub work: Option<f64>,
    /// The same in seconds, on stored factors.
    pub seconds: Option<f64>,
}

/// Pairs that are asked about: the plain ones, and the best of either side.
const RIVALS: [(Solver, Solver); 5] = [
    (Solver::Progressive, Solver::Jacobi),
    (Solver::Progressive, Solver::GaussSeidel),
    (Solver::Progressive, Solver::Cg),
    (Solver::ShootingAmbient, Solver::GaussSeidel),
    (Solver::Overshooting, Solver::Sor),
];

/// Displayed error that nobody sees any more: a tenth of a step of 8 bits.
const UNSEEN: f64 = 0.1 / 255.0;

/// Where rivals cross.
pub(super) fn crossings(marches: &[March]) -> Vec<Crossing> {
    let find = |solver: Solver| marches.iter().find(|m| m.solver == solver.name() && !m.marks.is_empty());
    let cross = |(early, late): (Solver, Solver)| {
        let (a, b) = (find(early)?, find(late)?);
        let passes = |of: fn(&Mark) -> f64| {
            let at = |march: &March, until: f64| {
                let last = march.marks.iter().take_while(|mark| of(mark) <= until * (1.0 + 1e-9)).last();
                last.map_or(f64::INFINITY, |mark| mark.displayed)
            };
            let mut places: Vec<f64> = a.marks.iter().chain(&b.marks).map(of).collect();
            places.sort_by(f64::total_cmp);
            places.retain(|x| at(a, *x).max(at(b, *x)) > UNSEEN);
            // From the last place at which the early one is not worse.
            let last = places.iter().rposition(|x| at(a, *x) <= at(b, *x));
            places.get(last.map_or(0, |last| last + 1)).copied()
        };
        let (early, late) = (early.name(), late.name());
        Some(Crossing { early, late, work: passes(|mark| mark.work), seconds: passes(|mark| mark.seconds) })
    };
    RIVALS.into_iter().filter_map(cross).collect()
}
