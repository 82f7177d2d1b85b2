//! Who takes part: every form-factor method by its name, and the engine's own table of hit ids, `rays`; each at several
//! settings, so that its error can be drawn against its time.

use radiosity_solve::Solver;
use radiosity_transport::row::{Look, RowMethod};
use radiosity_transport::view_factors::ViewFactorOptions;
use radiosity_transport::{FormFactorMethod, FormFactorOptions};
use serde::Serialize;
use std::fmt;
use std::str::FromStr;

/// A way to F.
///
/// ```
/// use radiosity::compare::Contender;
/// let rays: Contender = "rays".parse().unwrap();
/// assert_eq!(rays, Contender::Rays);
/// assert!("ray".parse::<Contender>().unwrap_err().to_string().contains("hemicube"));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Contender {
    /// The table of hit ids that the engine uses.
    Rays,
    /// A form-factor method of the table.
    Method(FormFactorMethod),
}

/// How a contender comes by its factors; those of a kind fail alike.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Each pair as it needs.
    Adaptive,
    /// Cells of a surface about a point.
    Projection,
    /// Rays from all over the facet.
    Sampling,
    /// Each pair by one formula.
    Pair,
}

/// How finely a contender works.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Setting {
    /// Bound asked of the error of each factor.
    Accuracy(f64),
    /// Cells along a side of the projection surface, and eye points along a side of the facet.
    Cells {
        /// Cells along a side.
        resolution: usize,
        /// Eye points along a side.
        points: usize,
    },
    /// Rays of a row.
    Rays(usize),
    /// There is one only.
    Only,
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Setting::Accuracy(bound) => f.pad(&format!("to {bound:e}")),
            Setting::Cells { resolution, points: 1 } => f.pad(&format!("{resolution} cells")),
            Setting::Cells { resolution, points } => f.pad(&format!("{resolution} cells, {points} × {points} points")),
            Setting::Rays(rays) => f.pad(&format!("{rays} rays")),
            Setting::Only => f.pad(""),
        }
    }
}

/// Cells along a side, the least as in the first papers. Twice as many are four times the work.
const RESOLUTIONS: [usize; 4] = [64, 128, 256, 512];

/// Eye points along a side of a facet that show what one point in its middle costs; sixteen of them see what is near as
/// large as it is.
const POINTS: usize = 4;

impl Contender {
    /// All that run on any machine, the engine's own first: graphics hardware takes part where it is named.
    pub fn all() -> impl Iterator<Item = Contender> {
        let methods = FormFactorMethod::all().filter(|method| *method != FormFactorMethod::HemicubeGpu);
        std::iter::once(Contender::Rays).chain(methods.map(Contender::Method))
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Contender::Rays => "rays",
            Contender::Method(method) => method.name(),
        }
    }

    /// What it does, in a line, and where it is from.
    pub fn description(self) -> &'static str {
        match self {
            Contender::Rays => {
                "the engine's table of hit ids, with bright sources apart as direct light (this program's own)"
            }
            Contender::Method(method) => method.description(),
        }
    }

    /// How it works.
    pub fn kind(self) -> Kind {
        match self {
            Contender::Rays | Contender::Method(FormFactorMethod::Row(RowMethod::Hemisphere)) => Kind::Sampling,
            Contender::Method(FormFactorMethod::Adaptive) => Kind::Adaptive,
            Contender::Method(FormFactorMethod::Row(_) | FormFactorMethod::HemicubeGpu) => Kind::Projection,
            Contender::Method(FormFactorMethod::Pair(_)) => Kind::Pair,
        }
    }

    /// Its settings, each costing more than the one before.
    pub fn settings(self) -> Vec<Setting> {
        let cells = |points| RESOLUTIONS.map(|resolution| Setting::Cells { resolution, points });
        match self {
            Contender::Rays => [16, 64, 256, 1024, 4096].map(Setting::Rays).to_vec(),
            Contender::Method(FormFactorMethod::Adaptive) => [1e-3, 1e-4, 1e-5].map(Setting::Accuracy).to_vec(),
            Contender::Method(FormFactorMethod::Row(RowMethod::Hemisphere)) => {
                [256, 1024, 4096, 16384].map(Setting::Rays).to_vec()
            }
            Contender::Method(FormFactorMethod::Row(RowMethod::Hemicube)) => {
                let mut all = cells(1).to_vec();
                // As many cells in all as with 256.
                all.insert(2, Setting::Cells { resolution: 64, points: POINTS });
                all
            }
            Contender::Method(FormFactorMethod::Row(_) | FormFactorMethod::HemicubeGpu) => cells(1).to_vec(),
            Contender::Method(FormFactorMethod::Pair(_)) => vec![Setting::Only],
        }
    }

    /// The setting by which its growth with the mesh is told.
    pub(super) fn usual(self) -> Setting {
        match self {
            Contender::Rays => Setting::Rays(64),
            _ => self.settings()[0],
        }
    }

    /// As the transport takes a setting.
    pub(super) fn options(setting: Setting, memory: usize) -> FormFactorOptions {
        let mut options = FormFactorOptions::default();
        options.adaptive.memory = memory;
        match setting {
            // Pairs that see each other whole cost little more when they are asked for far more exactly.
            Setting::Accuracy(accuracy) => {
                options.adaptive = ViewFactorOptions { accuracy, clear_accuracy: 1e-4 * accuracy, memory };
            }
            Setting::Cells { resolution, points } => options.look = Look { resolution, points, ..Look::default() },
            Setting::Rays(rays) => {
                options.look = Look { resolution: rays.isqrt(), points: 1, ..Look::default() };
            }
            Setting::Only => {}
        }
        options
    }

    /// Rays or cells of a row, where there are any.
    pub(super) fn samples(self, setting: Setting) -> Option<usize> {
        let share = |resolution: usize| match self {
            Contender::Method(
                FormFactorMethod::Row(RowMethod::Hemicube | RowMethod::HemicubeMidpoint)
                | FormFactorMethod::HemicubeGpu,
            ) => Some(3 * resolution * resolution),
            Contender::Method(FormFactorMethod::Row(RowMethod::SinglePlane | RowMethod::SinglePlaneAdaptive)) => {
                Some(resolution * resolution)
            }
            Contender::Method(FormFactorMethod::Row(RowMethod::GlobalCube)) => Some(3 * resolution * resolution),
            _ => None,
        };
        match setting {
            Setting::Cells { resolution, points } => share(resolution).map(|cells| cells * points * points),
            Setting::Rays(rays) => Some(rays),
            _ => None,
        }
    }
}

impl fmt::Display for Contender {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that no contender has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no form-factor method is called \"{name}\"; there are {}", names())]
pub struct UnknownContender {
    /// What was asked for.
    pub name: String,
}

fn names() -> String {
    Contender::all().map(Contender::name).collect::<Vec<_>>().join(", ")
}

impl FromStr for Contender {
    type Err = UnknownContender;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let mut all = Contender::all().chain([Contender::Method(FormFactorMethod::HemicubeGpu)]);
        all.find(|c| c.name() == name).ok_or_else(|| UnknownContender { name: name.to_owned() })
    }
}

/// How a solver goes about it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Family {
    /// Each unknown collects from all others.
    Gathering,
    /// One unknown at a time gives to all others.
    Shooting,
    /// The best that the sweeps so far can be combined to.
    Krylov,
    /// Elimination.
    Direct,
    /// Samples drawn from F.
    Random,
}

impl Family {
    /// That of a solver.
    pub fn of(solver: Solver) -> Family {
        match solver {
            Solver::Jacobi | Solver::DeflatedJacobi | Solver::Neumann | Solver::GaussSeidel | Solver::Sor => {
                Family::Gathering
            }
            // Southwell's relaxation is shooting by another name (Gortler, Cohen & Slusallek 1994).
            Solver::Southwell
            | Solver::Progressive
            | Solver::ShootingCyclic
            | Solver::ShootingAmbient
            | Solver::Overshooting => Family::Shooting,
            Solver::Cg | Solver::Bicgstab | Solver::Gmres => Family::Krylov,
            Solver::Lu | Solver::Cholesky => Family::Direct,
            Solver::RandomWalk | Solver::StochasticJacobi => Family::Random,
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Family::Gathering => "gathering",
            Family::Shooting => "shooting",
            Family::Krylov => "Krylov",
            Family::Direct => "elimination",
            Family::Random => "random",
        }
    }
}
