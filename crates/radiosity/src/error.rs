//! What can go wrong between a scene and its light.

use radiosity_scene::size;

/// Why no answer came.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The run was stopped from outside.
    #[error("stopped on request")]
    Stopped,
    /// The solver did not reach its tolerance.
    #[error("the radiosity equation was not solved: {0}")]
    Solve(#[from] radiosity_solve::SolveError),
    /// What is displayed was not brought as near as asked.
    #[error(
        "after {steps} steps of the solver what is displayed is only known to be within ΔE {reached:.3} of the solution, not \
         within {asked}{}", if reached.is_finite() { "" } else { ": a surface gives back all its light, and no bound is known" }
    )]
    Displayed {
        /// ΔE*ab asked for.
        asked: f64,
        /// What is guaranteed; infinite where nothing is.
        reached: f64,
        /// Steps of the solver.
        steps: usize,
    },
    /// The residual asked for is less than single precision can tell.
    #[error(
        "a relative residual of {asked:e} is asked for, and hit tables in single precision tell {least:e} at best (a solver \
         that needs rows, such as gauss-seidel, keeps them in double precision)"
    )]
    Tolerance {
        /// Relative residual asked for.
        asked: f64,
        /// The least that can be.
        least: f64,
    },
    /// The time was over before there was an answer of the kind that was asked for.
    #[error("the time was over before {0} were found, and without them there is no answer; allow more")]
    Time(&'static str),
    /// The memory that was allowed does not suffice.
    #[error(
        "{elements} elements{} and the scene, need {}; {} allowed (allow more, or ask for larger elements: {} MB hold the largest)",
        rays.map_or(",".to_owned(), |rays| format!(" with {rays} rays each,")), size(*needed), are(*allowed), least.div_ceil(1 << 20)
    )]
    Memory {
        /// Elements asked for.
        elements: usize,
        /// Rays per cell, where these have to be in memory.
        rays: Option<usize>,
        /// Bytes needed.
        needed: usize,
        /// Bytes allowed.
        allowed: usize,
        /// Bytes that the scene needs with the largest elements.
        least: usize,
    },
    /// The memory that was allowed does not hold the rays, and a file for them failed.
    #[error("{0}")]
    File(#[from] radiosity_transport::FileError),
    /// The memory that was allowed does not hold form factors between all elements.
    #[error(
        "form factors between {elements} elements need {}; {} allowed (ask for fewer elements than {asked}, though each \
         triangle is one at least, or allow more)",
        size(*needed), are(*allowed)
    )]
    Matrix {
        /// Elements there would be.
        elements: usize,
        /// Elements asked for.
        asked: usize,
        /// Bytes needed.
        needed: usize,
        /// Bytes allowed.
        allowed: usize,
    },
    /// The memory that was allowed does not hold the full matrices of elimination.
    #[error(
        "{solver} eliminates in full matrices, which for {elements} elements need {}; {} allowed",
        size(*needed), are(*allowed)
    )]
    Elimination {
        /// The solver.
        solver: radiosity_solve::Solver,
        /// Elements there would be.
        elements: usize,
        /// Bytes needed.
        needed: usize,
        /// Bytes allowed.
        allowed: usize,
    },
    /// The solver needs factors that are the same in both directions, and the method gives others.
    #[error(
        "{solver} needs form factors that agree in both directions (A_i F_ij = A_j F_ji), and those by {method} do not"
    )]
    Reciprocity {
        /// The solver.
        solver: radiosity_solve::Solver,
        /// The method's name.
        method: &'static str,
    },
    /// The solver needs an equation that is symmetric, and sheets that transmit light make it another.
    #[error("{solver} cannot solve for surfaces that transmit light (use gmres, gauss-seidel, lu or the default)")]
    Transmission {
        /// The solver.
        solver: radiosity_solve::Solver,
    },
    /// An element is no polygon that form factors can be asked of.
    #[error("{0}")]
    Element(radiosity_scene::ElementError),
    /// The lightmap cannot be laid out.
    #[error("lightmap: {0}")]
    Lightmap(radiosity_view::lightmap::LightmapError),
    /// A page of a lightmap cannot be encoded.
    #[error("page of a lightmap: {0}")]
    Picture(#[from] radiosity_io::image_out::EncodeError),
    /// Form factors do not fit into the memory allowed.
    #[error("{0}")]
    Factors(radiosity_transport::FactorError),
    /// The scene has nothing to compute.
    #[error("{0}")]
    Empty(&'static str),
}

/// A size that is allowed, with its verb.
fn are(allowed: usize) -> String {
    size(allowed) + if allowed == 1 { " is" } else { " are" }
}

impl From<radiosity_transport::Stopped> for Error {
    fn from(_: radiosity_transport::Stopped) -> Self {
        Error::Stopped
    }
}

impl From<radiosity_transport::ExtendError> for Error {
    fn from(error: radiosity_transport::ExtendError) -> Self {
        match error {
            radiosity_transport::ExtendError::Stopped(_) => Error::Stopped,
            radiosity_transport::ExtendError::File(error) => Error::File(error),
        }
    }
}

impl From<radiosity_transport::FactorError> for Error {
    fn from(error: radiosity_transport::FactorError) -> Self {
        match error {
            radiosity_transport::FactorError::Stopped => Error::Stopped,
            other => Error::Factors(other),
        }
    }
}
