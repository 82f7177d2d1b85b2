//! The equation B = E + R F B and its solvers. This crate knows vectors and operators, and no geometry.
//!
//! A field is a flat slice of `dim × bands` numbers, bands interleaved: one transport carries all bands at once.
//! A solver asks for the smallest trait it needs: [`Transport`] gives h = F b, [`Response`] gives R h, [`Space`] the
//! inner product. Parameters go in, the field and an [`Info`] come out; not reaching the tolerance is an error that
//! carries what was reached.
//!
//! [`Solver`] names all solvers; [`solve`] runs any of them on a stored matrix ([`DenseTransport`],
//! [`SparseTransport`]), [`solve_operator`] those that need no more than [`Transport`]. Each is a function of its
//! own, too.

mod bicgstab;
mod conjugate_gradient;
mod deflated_jacobi;
mod dense;
mod direct;
mod gauge;
mod gmres;
mod jacobi;
mod krylov;
mod neumann;
mod overshooting;
mod progressive;
mod random;
mod random_walk;
mod script_f;
mod shot;
mod solver;
mod sor;
mod southwell;
mod sparse;
mod stochastic_jacobi;
mod substructure;
mod traits;

pub use bicgstab::bicgstab;
pub use conjugate_gradient::conjugate_gradient;
pub use deflated_jacobi::deflated_jacobi;
pub use dense::DenseTransport;
pub use direct::{cholesky, lu};
pub use gmres::gmres;
pub use jacobi::jacobi;
pub use neumann::{bounces, neumann};
pub use overshooting::overshooting;
pub use progressive::{progressive, shooting_ambient, shooting_cyclic};
pub use random_walk::random_walk;
pub use script_f::script_f;
pub use solver::{Solver, solve, solve_operator};
pub use sor::{gauss_seidel, sor};
pub use southwell::southwell;
pub use sparse::SparseTransport;
pub use stochastic_jacobi::stochastic_jacobi;
pub use substructure::Substructure;
pub use traits::{AreaSpace, DiffuseResponse, Response, Rows, SheetResponse, Sheets, Shoot, Space, Transport};

use serde::Serialize;

/// When to stop, and what single solvers want to know.
#[derive(Clone, Copy, Debug)]
pub struct Params {
    /// The residual E + R F B − B, in the space's norm, relative to that of E, in every band. The default 1e-6 is a
    /// hundred times below what the transport's own error leaves visible. At 0 only [`Go::Enough`] ends a solver, or
    /// a residual of nothing at all.
    pub tolerance: f64,
    /// Largest amount of work, in applications of the transport ([`Info::work`]). It is looked at after each step, so
    /// that the last one may go beyond it.
    pub max_steps: usize,
    /// ω of `sor`. The default 1.1 is near the best where reflectances are around one half: 1.07 for two unknowns
    /// that keep half, three sweeps instead of four in catalogue R1. White rooms would like more; from 2 on it
    /// diverges.
    pub relaxation: f64,
    /// Directions that `gmres` keeps before it begins anew, each two vectors of memory. Closed cubes need ten or less
    /// at any reflectance; 30 leaves room for scenes of several rooms.
    pub restart: usize,
    /// Samples for each unknown in a step of a random method. With the default 64 a step costs as much as measuring its
    /// residual where there are some hundred unknowns.
    pub samples: usize,
    /// What the random numbers come from: the same seed, the same answer.
    pub seed: u64,
}

impl Default for Params {
    fn default() -> Self {
        Params { tolerance: 1e-6, max_steps: 500, relaxation: 1.1, restart: 30, samples: 64, seed: 1 }
    }
}

/// What a solver did.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Info {
    /// Steps of the method: applications of the transport where they are the steps, sweeps, shots, or random runs.
    pub steps: usize,
    /// What that cost, in applications of the transport, so that methods compare: a shot is one N-th of one, a random
    /// draw one N²-th, the factors of an N × N matrix N/3 (Cholesky N/6).
    pub work: f64,
    /// Relative residual of each band, ‖E + R F B − B‖/‖E‖ in the space's norm. Of shooting it is that of the light
    /// that has been shot: the unshot energy.
    pub residual: Vec<f64>,
    /// Σ A r/Σ A E of each band for that residual r: the share of the emitted energy that is still to be shot.
    pub unshot: Vec<f64>,
    /// Guaranteed bound of the largest error of B in each band: ‖r‖∞/(1 − ρ_max ‖F‖∞) (catalogue 35), for the
    /// discrete equation; infinite where that promises nothing. It rests on [`Transport::row_sum`].
    pub bound: Vec<f64>,
    /// Standard error of each number of the field, for random methods; empty for others, infinite after one run.
    #[serde(skip)]
    pub standard_error: Vec<f64>,
}

/// Why a solver gave up.
#[derive(Debug, thiserror::Error)]
pub enum SolveError {
    /// The steps ran out.
    #[error("not converged after {} steps: relative residual {:?}, asked for {asked:e}", info.steps, info.residual)]
    NotConverged {
        /// What was reached; the field holds the last iterate.
        info: Box<Info>,
        /// The tolerance asked for.
        asked: f64,
    },
    /// The callback asked to stop.
    #[error("stopped on request")]
    Stopped,
    /// A solver was used where it has no right to converge.
    #[error("{0}")]
    NotApplicable(&'static str),
    /// A reflectance with which no light comes to rest, or none at all.
    #[error("reflectance {value} of unknown {unknown}, band {band}, is not between 0 and 1")]
    Reflectance {
        /// The unknown.
        unknown: usize,
        /// The band.
        band: usize,
        /// What was given.
        value: f64,
    },
    /// A transmittance that with its reflectance gives back more light than arrives, or none at all.
    #[error(
        "reflectance {reflectance} and transmittance {transmittance} of unknown {unknown}, band {band}, are not both 0 or \
         more and at most 1 together"
    )]
    Transmittance {
        /// The unknown.
        unknown: usize,
        /// The band.
        band: usize,
        /// Its reflectance.
        reflectance: f64,
        /// What it passes on from its other side.
        transmittance: f64,
    },
    /// The transport cannot be applied.
    #[error(transparent)]
    Transport(Box<dyn std::error::Error + Send + Sync>),
    /// No solver has this name.
    #[error("no solver is called \"{0}\"; there are {known}", known = Solver::names())]
    Unknown(String),
}

/// What a callback answers after each step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Go {
    /// Carry on.
    On,
    /// This iterate will do, whatever its residual: it is the answer, and its [`Info`] says how good it is. So a solver
    /// stops by any criterion (catalogue 42): the unshot share, the guaranteed bound, what is displayed, a clock.
    Enough,
    /// Stop now, without an answer.
    Stop,
}

#[cfg(test)]
mod tests;
