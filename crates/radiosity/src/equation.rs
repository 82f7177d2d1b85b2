//! The equation of a solution: which F, which solver.
//!
//! F is the table of hit ids, or the matrix of another method for form factors. Solvers that only apply F run on the
//! table as it is; those that need rows or columns get it as a stored matrix.

use crate::Error;
use crate::displayed::{Displayed, Screen};
use crate::monitor::{Monitor, is_over};
use crate::solution::FEW;
use radiosity_scene::{Bands, Elements, Enclosure, Mesh};
use radiosity_solve::{
    Go, Info, Params, SheetResponse, SolveError, Solver, SparseTransport, Transport, solve as solve_stored,
    solve_operator,
};
use radiosity_transport::view_factors::ViewFactorOptions;
use radiosity_transport::{FileError, FormFactorMethod, FormFactorOptions, FormFactors, HitTable, Progress};
use std::time::Instant;

/// Accuracy of adaptive factors. Light is asked for to a percent or so, and a row has hundreds of entries that err either
/// way.
const ACCURACY: f64 = 1e-4;

/// Form factors between elements.
pub(crate) struct Matrix {
    factors: SparseTransport<f64>,
    /// Whether A_i F_ij = A_j F_ji holds by the way they are stored.
    pub is_reciprocal: bool,
}

impl Matrix {
    /// The factors of all elements by a method.
    pub fn new(
        method: FormFactorMethod,
        mesh: &Mesh,
        elements: &Elements,
        memory: usize,
        progress: &dyn Progress,
    ) -> Result<Matrix, Error> {
        let enclosure = Enclosure::of_elements(mesh, elements).map_err(Error::Element)?;
        let adaptive = ViewFactorOptions { accuracy: ACCURACY, clear_accuracy: 0.01 * ACCURACY, memory };
        let options = FormFactorOptions { adaptive, ..FormFactorOptions::default() };
        let factors = FormFactors::new(method, &enclosure, &options, progress)?;
        Ok(Matrix { factors: factors.transport()?, is_reciprocal: method == FormFactorMethod::Adaptive })
    }

    /// F times a field of four bands.
    pub fn gather(&self, values: &[[f32; 4]]) -> Result<Vec<[f32; 4]>, SolveError> {
        let b: Vec<f64> = values.iter().flatten().map(|x| f64::from(*x)).collect();
        let mut h = vec![0.0; b.len()];
        self.factors.apply(&b, &mut h, 4)?;
        Ok(h.chunks_exact(4).map(|h| std::array::from_fn(|k| h[k] as f32)).collect())
    }
}

/// Parts that a solver's way is told in.
const PARTS: usize = 1000;

/// What the work alone can tell of the way: at its end it was not enough.
const MOST_BY_WORK: f64 = 0.9;

/// How far a solver is on its way to the tolerance, by its residual: that of steps falls by a factor at a time, that of
/// random runs with the root of their number. Shooting in advance leaves the residual as it is for some sweeps; by then
/// the work tells, of which light with a mean reflectance ρ needs ln(tolerance)/ln ρ sweeps.
struct Way {
    is_random: bool,
    tolerance: f64,
    sweeps: f64,
    first: Option<f64>,
    done: usize,
    begun: Option<(Instant, f64)>,
    /// Whether it has been told how long it takes.
    is_told: bool,
}

/// Seconds after which a solver's speed is known, and what it may then take without being told of.
const KNOWN: f64 = 1.0;
const SHORT: f64 = 30.0;

/// Seconds as people say them.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 100.0 => format!("{s:.0} s"),
        s if s < 6000.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.0} h", s / 3600.0),
    }
}

impl Way {
    fn new(is_random: bool, tolerance: f64, reflectance: &[f64]) -> Way {
        let mean = reflectance.iter().sum::<f64>() / reflectance.len().max(1) as f64;
        // Light that hardly comes to rest is expected to take a hundred sweeps or so.
        let sweeps = tolerance.ln() / mean.clamp(0.1, 0.9).ln();
        Way { is_random, tolerance, sweeps, first: None, done: 0, begun: None, is_told: false }
    }

    /// The seconds that a solver is going to take, told once, in its first seconds, if they are many: by the work so far, of
    /// that which light with this reflectance needs. Random methods take what their noise needs, which nobody knows.
    fn slow(&mut self, info: &Info) -> Option<f64> {
        let (begun, work) = *self.begun.get_or_insert_with(|| (Instant::now(), info.work));
        let passed = begun.elapsed().as_secs_f64();
        if self.is_told || self.is_random || passed < KNOWN || info.work <= work {
            return None;
        }
        self.is_told = true;
        Some(passed * (self.sweeps - info.work) / (info.work - work)).filter(|seconds| *seconds > SHORT)
    }

    /// Parts of [`PARTS`] done, never fewer than before, as a residual may rise for a while.
    fn done(&mut self, info: &Info) -> usize {
        let residual = info.residual.iter().fold(0f64, |worst, r| worst.max(*r)).max(f64::MIN_POSITIVE);
        let first = *self.first.get_or_insert(residual);
        let share = if residual <= self.tolerance {
            1.0
        } else if self.is_random {
            (self.tolerance / residual).powi(2)
        } else {
            let by_residual = (first / residual).ln() / (first / self.tolerance).ln();
            by_residual.max((info.work / self.sweeps).min(MOST_BY_WORK))
        };
        // The cast saturates, and makes no number zero.
        self.done = self.done.max((share * PARTS as f64).round() as usize).min(PARTS);
        self.done
    }
}

/// Relative residual that random methods are asked for where nothing else is: it falls with the root of the work, and 1e-4
/// would take ten thousand sweeps. Light errs by less, as most of the residual is noise from element to element; the audit
/// sees what is left.
pub const RANDOM_TOLERANCE: f64 = 5e-3;

/// Least relative residual that can be asked of a table of hit ids that is only applied: its values are in single precision,
/// and asking for more than they can tell would never end.
pub const TABLE_TOLERANCE: f64 = 1e-6;

/// Work between two looks at what is displayed, applications of F: a look costs about as much as a tenth of one.
const LOOK: f64 = 0.5;

/// Sweeps that are made whether or not there is time, where one is a step: without some there is no reflected light, and so many solve a
/// room, where one of so many rays takes some milliseconds.
const FIRST_SWEEPS: f64 = 4.0;
const SOLVING_SWEEPS: f64 = 32.0;
const FEW_RAYS: usize = 64 * FEW;

/// How to solve, and when an iterate will do.
pub(crate) struct Task<'a> {
    pub solver: Solver,
    pub params: &'a Params,
    /// What is displayed, how near it has to be.
    pub displayed: Option<(&'a Screen, Displayed)>,
}

/// Solves X = E + R F X in place, by the matrix if there is one. When the monitor's time is over, the iterate by then is the
/// answer.
pub(crate) fn solve(
    (table, matrix): (&HitTable, Option<&Matrix>),
    response: &SheetResponse,
    (e, x): (&[f64], &mut [f64]),
    task: &Task,
    monitor: &dyn Monitor,
) -> Result<Info, Error> {
    let solver = task.solver;
    let mut way = Way::new(solver.is_random(), task.params.tolerance, &response.diffuse.reflectance);
    let (mut looked, mut reached) = (f64::NEG_INFINITY, f64::INFINITY);
    let is_quick = x.len() / 3 * table.columns() <= FEW_RAYS;
    let first_sweeps = if is_quick { SOLVING_SWEEPS } else { FIRST_SWEEPS };
    let step = |x: &[f64], info: &Info| {
        if !monitor.step(way.done(info), PARTS) {
            return Go::Stop;
        }
        // The count of sweeps is that of plain ones, far too many for the default.
        if solver != Solver::DeflatedJacobi
            && let Some(seconds) = way.slow(info)
        {
            monitor.warn(&format!(
                "{solver} will take about {} for {} elements; deflated-jacobi, the default, takes moments",
                duration(seconds),
                x.len() / 3
            ));
        }
        if is_over(monitor) && (info.work >= first_sweeps || !solver.applies_only()) {
            return Go::Enough;
        }
        if let Some((screen, asked)) = task.displayed {
            if info.work >= looked + LOOK || solver.is_direct() {
                looked = info.work;
                reached = screen.shown(&single(x), &info.bound, asked.exposure).delta_e;
            }
            if reached <= asked.delta_e {
                return Go::Enough;
            }
        }
        Go::On
    };
    // Where the display decides, the residual does not.
    let tolerance = if task.displayed.is_some() { 0.0 } else { task.params.tolerance };
    let params = Params { tolerance, ..*task.params };
    let solved = match matrix {
        Some(matrix) => solve_stored(solver, &matrix.factors, response, e, x, &params, step),
        None if solver.applies_only() => solve_operator(solver, table, response, e, x, &params, step),
        None => table.matrix().and_then(|stored| solve_stored(solver, &stored, response, e, x, &params, step)),
    };
    solved.map_err(|error| match (error, task.displayed) {
        (SolveError::Stopped, _) => Error::Stopped,
        (SolveError::Transport(error), _) => match error.downcast::<FileError>() {
            Ok(error) => Error::File(*error),
            Err(other) => Error::Solve(SolveError::Transport(other)),
        },
        (SolveError::NotConverged { info, .. }, Some((_, Displayed { delta_e, .. }))) => {
            Error::Displayed { asked: delta_e, reached, steps: info.steps }
        }
        (other, _) => Error::Solve(other),
    })
}

/// A field of three bands in single precision, as it is kept.
pub(crate) fn single(x: &[f64]) -> Vec<Bands> {
    x.chunks_exact(3).map(|x| [x[0] as f32, x[1] as f32, x[2] as f32]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_of_a_solver_is_told_by_its_residual() {
        let at = |residual: f64| Info { residual: vec![0.1 * residual, residual], ..Info::default() };
        let mut steps = Way::new(false, 1e-4, &[0.5; 3]);
        assert_eq!([1.0, 1e-1, 1e-2, 1e-1, 1e-3, 1e-5].map(|r| steps.done(&at(r))), [0, 250, 500, 500, 750, 1000]);
        // ½¹⁰ is a thousandth: ten sweeps, of which five are half the way, although the residual has not moved.
        let mut stuck = Way::new(false, 0.5f64.powi(10), &[0.5; 3]);
        let after = |work: f64| Info { work, residual: vec![1.0], ..Info::default() };
        assert_eq!([0.0, 5.0, 8.0, 20.0].map(|work| stuck.done(&after(work))), [0, 500, 800, 900]);
        let mut random = Way::new(true, 1e-2, &[0.5; 3]);
        assert_eq!([1.0, 0.1, 0.02, 0.005].map(|r| random.done(&at(r))), [0, 10, 250, 1000]);
    }

    /// It filled a matrix of 48 GB for the elements of the default table, and panicked.
    #[test]
    fn elimination_is_asked_of_no_more_elements_than_its_matrices_fit() {
        use crate::{Solution, SolveOptions, Tracer, cornell_box};
        let scene = cornell_box();
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let options = SolveOptions { rays: 32, solver: Solver::Lu, ..SolveOptions::default() };
        let few = Solution::begin(&tracer, &options, &()).unwrap();
        assert!(few.elements.len() < 5000, "{}", few.elements.len());
        let small = SolveOptions { element_size: Some(0.002), ..options };
        let Err(error) = Solution::begin(&tracer, &small, &()) else { panic!("allowed") };
        assert!(matches!(error, Error::Elimination { needed, allowed, .. } if needed > allowed), "{error}");
        // Those that take steps need no such matrix.
        assert!(small.memory > Solver::Gmres.matrix_bytes(1_000_000));
    }

    #[test]
    fn solvers_that_need_reciprocity_are_refused_other_factors() {
        use crate::{Solution, SolveOptions, Tracer, cornell_box};
        let scene = cornell_box();
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let method = |name: &str| (name != "rays").then(|| name.parse().unwrap());
        for solver in Solver::ALL {
            for name in ["rays", "hemicube", "adaptive"] {
                let small = SolveOptions { element_size: Some(0.3), rays: 32, ..SolveOptions::default() };
                let params = Params { tolerance: 0.3, ..small.params };
                let options = SolveOptions { solver: *solver, form_factors: method(name), params, ..small };
                let is_refused = match Solution::begin(&tracer, &options, &()) {
                    Ok(_) => false,
                    Err(Error::Reciprocity { .. }) => true,
                    Err(error) => panic!("{solver} with {name}: {error}"),
                };
                assert_eq!(is_refused, solver.needs_reciprocity() && name != "adaptive", "{solver} with {name}");
                // What is not refused works, and what is would have failed after the rays.
                if solver.needs_reciprocity() && name == "adaptive" {
                    Solution::new(&tracer, &options, &()).unwrap_or_else(|error| panic!("{solver}: {error}"));
                }
            }
        }
    }
}
