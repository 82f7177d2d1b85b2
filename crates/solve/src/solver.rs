//! Every solver by its name. A new one is a new file and a line in the table below.

use crate::*;
use std::fmt;
use std::str::FromStr;

/// Makes [`Solver`], its names and descriptions, and the two functions that choose, from one line for each solver:
/// those that need a transport that can be applied and no more, those that need a stored matrix, and those that draw
/// from it at random.
macro_rules! table {
    (
        applied { $($applied:ident $applied_name:literal $applied_fn:ident $applied_text:literal;)* }
        stored { $($stored:ident $stored_name:literal $stored_fn:ident $stored_text:literal;)* }
        random { $($random:ident $random_name:literal $random_fn:ident $random_text:literal;)* }
    ) => {
        /// A solver of B = E + R F B, by the name that the literature knows it by.
        ///
        /// ```
        /// use radiosity_solve::Solver;
        ///
        /// let solver: Solver = "gauss-seidel".parse()?;
        /// assert_eq!(solver.to_string(), "gauss-seidel");
        /// for solver in Solver::ALL {
        ///     assert!(!solver.description().is_empty());
        /// }
        /// assert!("gauss".parse::<Solver>().unwrap_err().to_string().contains("gauss-seidel"));
        /// # Ok::<(), radiosity_solve::SolveError>(())
        /// ```
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Solver {
            $(#[doc = $applied_text] $applied,)*
            $(#[doc = $stored_text] $stored,)*
            $(#[doc = $random_text] $random,)*
        }

        impl Solver {
            /// All of them.
            pub const ALL: &[Solver] = &[
                $(Solver::$applied,)* $(Solver::$stored,)* $(Solver::$random,)*
            ];

            /// Its name.
            pub fn name(self) -> &'static str {
                match self {
                    $(Solver::$applied => $applied_name,)*
                    $(Solver::$stored => $stored_name,)*
                    $(Solver::$random => $random_name,)*
                }
            }

            /// What it is and where it comes from, in one line.
            pub fn description(self) -> &'static str {
                match self {
                    $(Solver::$applied => $applied_text,)*
                    $(Solver::$stored => $stored_text,)*
                    $(Solver::$random => $random_text,)*
                }
            }

            /// Whether it needs no more than to apply F, so that [`solve_operator`] takes it.
            pub fn applies_only(self) -> bool {
                match self {
                    $(Solver::$applied => true,)*
                    $(Solver::$stored => false,)*
                    $(Solver::$random => false,)*
                }
            }

            /// Whether its answer has a standard error.
            pub fn is_random(self) -> bool {
                match self {
                    $(Solver::$applied => false,)*
                    $(Solver::$stored => false,)*
                    $(Solver::$random => true,)*
                }
            }
        }

        /// Solves B = E + R F B for a stored matrix by any solver of the table; `b` holds the start (warm or zero)
        /// and the result, `step` sees each iterate.
        ///
        /// ```
        /// use radiosity_solve::{DenseTransport, DiffuseResponse, Go, Params, Solver, solve};
        ///
        /// // Two plates that face each other; the first emits.
        /// let plates = DenseTransport::new(vec![1.0, 2.0], vec![0.0, 0.2, 0.1, 0.0])?;
        /// let half = DiffuseResponse { reflectance: vec![0.5; 2], bands: 1, reciprocal_area: Some(vec![1.0, 2.0]) };
        /// let mut b = [0.0; 2];
        /// let info = solve(Solver::Progressive, &plates, &half, &[1.0, 0.0], &mut b, &Params::default(), |_, _| Go::On)?;
        /// assert!((b[0] - 1.0 / 0.995).abs() < 1e-6 && (b[1] - 0.05 / 0.995).abs() < 1e-6);
        /// assert_eq!((info.steps, info.work), (6, 3.0));
        /// # Ok::<(), radiosity_solve::SolveError>(())
        /// ```
        ///
        /// # Errors
        /// [`SolveError::Reflectance`] for a reflectance that is not between 0 and 1; [`SolveError::NotApplicable`]
        /// where the solver does not fit the response or the matrix; [`SolveError::NotConverged`] with the last
        /// iterate left in `b`; [`SolveError::Stopped`] if `step` says [`Go::Stop`]. [`Go::Enough`] ends it with the
        /// iterate that `step` saw.
        pub fn solve<T: Rows + Shoot>(
            solver: Solver,
            transport: &T,
            response: &(impl Response + ?Sized),
            e: &[f64],
            b: &mut [f64],
            params: &Params,
            step: impl FnMut(&[f64], &Info) -> Go,
        ) -> Result<Info, SolveError> {
            check(transport, response, e, b)?;
            match solver {
                $(Solver::$applied => $applied_fn(transport, response, e, b, params, step),)*
                $(Solver::$stored => $stored_fn(transport, response, e, b, params, step),)*
                $(Solver::$random => $random_fn(transport, response, e, b, params, step),)*
            }
        }

        /// [`solve`] for a transport that can be applied and no more, such as a table of hit ids.
        ///
        /// # Errors
        /// As [`solve`]; [`SolveError::NotApplicable`] for solvers that need a stored matrix.
        pub fn solve_operator<T: Transport>(
            solver: Solver,
            transport: &T,
            response: &(impl Response + ?Sized),
            e: &[f64],
            b: &mut [f64],
            params: &Params,
            step: impl FnMut(&[f64], &Info) -> Go,
        ) -> Result<Info, SolveError> {
            check(transport, response, e, b)?;
            match solver {
                $(Solver::$applied => $applied_fn(transport, response, e, b, params, step),)*
                _ => Err(SolveError::NotApplicable(concat!(
                    "this solver needs a stored matrix; a transport that is only applied takes one of" $(, " ", $applied_name)*
                ))),
            }
        }
    };
}

table! {
    applied {
        Jacobi "jacobi" jacobi "Gathering simultaneously, B ← E + R F B (Cohen & Greenberg 1985)";
        DeflatedJacobi "deflated-jacobi" deflated_jacobi "Jacobi with the energy balanced at every sweep (Nicolaides 1987)";
        Neumann "neumann" neumann "Neumann series, a bounce a step (Kajiya 1986)";
        Cg "cg" conjugate_gradient "Conjugate gradients in the inner product weighted by A/ρ (Hestenes & Stiefel 1952)";
        Bicgstab "bicgstab" bicgstab "Stabilised biconjugate gradients, for what is not symmetric (van der Vorst 1992)";
        Gmres "gmres" gmres "Smallest residual over a Krylov space, restarted (Saad & Schultz 1986)";
    }
    stored {
        GaussSeidel "gauss-seidel" gauss_seidel "Gathering in sequence, new values used at once (Cohen & Greenberg 1985)";
        Sor "sor" sor "Gauss–Seidel with overrelaxation (Young 1950; Cohen & Wallace 1993)";
        Southwell "southwell" southwell "Relaxation of the largest residual (Southwell 1946; Gortler, Cohen & Slusallek 1994)";
        Progressive "progressive" progressive "Progressive refinement: shooting, sorted by unshot energy (Cohen, Chen, Wallace & Greenberg 1988)";
        ShootingCyclic "shooting-cyclic" shooting_cyclic "Shooting in the order of the unknowns (Cohen, Chen, Wallace & Greenberg 1988)";
        ShootingAmbient "shooting-ambient" shooting_ambient "Progressive refinement shown with an ambient term (Cohen, Chen, Wallace & Greenberg 1988)";
        Overshooting "overshooting" overshooting "Shooting in advance what is going to be received (Feda & Purgathofer 1992)";
        Lu "lu" lu "Gaussian elimination, LU with partial pivoting (Goral, Torrance, Greenberg & Battaile 1984)";
        Cholesky "cholesky" cholesky "Cholesky factors of the symmetric form (A/ρ)(I − ρF) (Cohen & Wallace 1993)";
    }
    random {
        RandomWalk "random-walk" random_walk "Shooting random walks with collision estimator (Shirley 1990; Bekaert 1999)";
        StochasticJacobi "stochastic-jacobi" stochastic_jacobi "Incremental power shooting with random targets (Neumann 1995; Bekaert 1999)";
    }
}

impl Solver {
    /// Whether it needs A_i F_ij = A_j F_ji, to about rounding: of factors that are stored once for both directions.
    pub fn needs_reciprocity(self) -> bool {
        matches!(self, Solver::Cg | Solver::Cholesky | Solver::RandomWalk | Solver::StochasticJacobi)
    }

    /// Whether it solves for sheets that pass light from one side to the other: I − R F is not symmetric in any positive
    /// weight then.
    pub fn takes_sheets(self) -> bool {
        !matches!(self, Solver::Cg | Solver::Cholesky)
    }

    /// Whether it eliminates: in a full matrix, whatever is zero in F.
    pub fn is_direct(self) -> bool {
        matches!(self, Solver::Lu | Solver::Cholesky)
    }

    /// Bytes of the full matrix that it fills for so many unknowns, and eliminates in place; none where it takes F as it is
    /// stored.
    pub fn matrix_bytes(self, unknowns: usize) -> usize {
        if self.is_direct() { unknowns.saturating_mul(unknowns).saturating_mul(size_of::<f64>()) } else { 0 }
    }

    /// All names, separated by commas.
    pub(crate) fn names() -> String {
        Solver::ALL.iter().map(|solver| solver.name()).collect::<Vec<_>>().join(", ")
    }
}

impl fmt::Display for Solver {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Solver {
    type Err = SolveError;

    fn from_str(name: &str) -> Result<Solver, SolveError> {
        let known = Solver::ALL.iter().find(|solver| solver.name() == name);
        known.copied().ok_or_else(|| SolveError::Unknown(name.to_string()))
    }
}

/// Refuses fields of the wrong length or of what is no number, and reflectances that no surface has (catalogue 35). One is allowed, for
/// surfaces that give back all they receive in an enclosure that is otherwise open or grey; the bound is infinite
/// then.
fn check<T: Transport>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &[f64],
) -> Result<(), SolveError> {
    let bands = response.bands();
    if bands == 0 {
        return Err(SolveError::NotApplicable("a response needs one band at least"));
    }
    if e.len() != transport.space().dim() * bands || b.len() != e.len() {
        return Err(SolveError::NotApplicable("emission and field need one number for each unknown and band"));
    }
    if !e.iter().chain(b).all(|x| x.is_finite()) {
        return Err(SolveError::NotApplicable("emission and the start must be finite numbers"));
    }
    if let Some(sheets) = response.sheets() {
        let rho = sheets.reflectance;
        if rho.len() != e.len() {
            return Err(SolveError::NotApplicable("a response needs one reflectance for each unknown and band"));
        }
        if let Some(k) = rho.iter().position(|rho| !(0.0..=1.0).contains(rho)) {
            return Err(SolveError::Reflectance { unknown: k / bands, band: k % bands, value: rho[k] });
        }
        check_sheets(sheets, e.len(), bands)?;
    }
    Ok(())
}

/// By how much ρ + τ may be above one: what sums of a few numbers in single precision leave.
const ROUNDING: f64 = 1e-6;

/// Refuses sheets whose sides do not name each other, or that give back more light than they get (catalogue 12).
fn check_sheets(sheets: Sheets<'_>, entries: usize, bands: usize) -> Result<(), SolveError> {
    let (rho, tau, opposite) = (sheets.reflectance, sheets.transmittance, sheets.opposite);
    if opposite.is_empty() && tau.is_empty() {
        return Ok(());
    }
    if tau.len() != entries || opposite.len() * bands != entries {
        return Err(SolveError::NotApplicable(
            "sheets need an other side and a transmittance by band for each unknown",
        ));
    }
    let is_pair = |(i, other): (usize, &u32)| opposite.get(*other as usize).is_some_and(|back| *back as usize == i);
    if !opposite.iter().enumerate().all(is_pair) {
        return Err(SolveError::NotApplicable("the two sides of a sheet must name each other"));
    }
    match (0..entries).find(|&k| !(0.0..=1.0).contains(&tau[k]) || rho[k] + tau[k] > 1.0 + ROUNDING) {
        None => Ok(()),
        Some(k) => Err(SolveError::Transmittance {
            unknown: k / bands,
            band: k % bands,
            reflectance: rho[k],
            transmittance: tau[k],
        }),
    }
}
