//! The equation of a solution: which F, which solver.
//!
//! F is the table of hit ids, or the matrix of another method for form factors. Solvers that only apply F run on the
//! table as it is; those that need rows or columns get it as a stored matrix.

use crate::Error;
use crate::monitor::Monitor;
use radiosity_scene::{Elements, Enclosure, Mesh};
use radiosity_solve::{
    DiffuseResponse, Go, Info, Params, SolveError, Solver, SparseTransport, Transport, solve as solve_stored,
    solve_operator,
};
use radiosity_transport::view_factors::ViewFactorOptions;
use radiosity_transport::{FormFactorMethod, FormFactorOptions, FormFactors, HitTable, Progress};

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
        progress: &impl Progress,
    ) -> Result<Matrix, Error> {
        let enclosure = Enclosure::of_elements(mesh, elements).map_err(Error::Element)?;
        let adaptive = ViewFactorOptions { accuracy: ACCURACY, clear_accuracy: 0.01 * ACCURACY, memory };
        let options = FormFactorOptions { adaptive, ..FormFactorOptions::default() };
        let factors = FormFactors::new(method, &enclosure, &options, progress)?;
        Ok(Matrix { factors: factors.transport()?, is_reciprocal: method == FormFactorMethod::Adaptive })
    }

    /// F times a field of four bands.
    pub fn gather(&self, values: &[[f32; 4]]) -> Vec<[f32; 4]> {
        let b: Vec<f64> = values.iter().flatten().map(|x| f64::from(*x)).collect();
        let mut h = vec![0.0; b.len()];
        self.factors.apply(&b, &mut h, 4);
        h.chunks_exact(4).map(|h| std::array::from_fn(|k| h[k] as f32)).collect()
    }
}

/// Solves X = E + R F X in place, by the matrix if there is one.
pub(crate) fn solve(
    (table, matrix): (&HitTable, Option<&Matrix>),
    response: &DiffuseResponse,
    (e, x): (&[f64], &mut [f64]),
    (solver, params): (Solver, &Params),
    monitor: &dyn Monitor,
) -> Result<Info, Error> {
    let step = |_: &[f64], info: &Info| {
        let go = monitor.step(info.steps, info.steps + 1);
        if go { Go::On } else { Go::Stop }
    };
    let solved = match matrix {
        Some(matrix) => solve_stored(solver, &matrix.factors, response, e, x, params, step),
        None => {
            // Rows keep their values in single precision: asking for more than they can tell would never end.
            let params = Params { tolerance: params.tolerance.max(1e-6), ..*params };
            if solver.applies_only() {
                solve_operator(solver, table, response, e, x, &params, step)
            } else {
                solve_stored(solver, &table.matrix()?, response, e, x, &params, step)
            }
        }
    };
    solved.map_err(|error| match error {
        SolveError::Stopped => Error::Stopped,
        other => Error::Solve(other),
    })
}
