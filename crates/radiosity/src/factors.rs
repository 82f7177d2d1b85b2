//! View factors of an enclosure, surface by surface, with what is needed to trust them.
//!
//! Closure and reciprocity are told as they were found. Only on request are rows then made to sum to one
//! ([`radiosity_transport::view_factors::Repair`]), and only on request are reflections by the emittances put in (script-F).

use crate::monitor::{Monitor, Watch};
use crate::{Error, Stages};
use radiosity_scene::Enclosure;
use radiosity_solve::{SolveError, script_f};
use radiosity_transport::view_factors::{Closure, Repair, ViewFactors, view_factors};
use radiosity_transport::{FormFactorMethod, FormFactorOptions, FormFactors};

/// How to find the factors of an enclosure.
#[derive(Clone, Copy, Debug, Default)]
pub struct FactorsOptions {
    /// The method.
    pub method: FormFactorMethod,
    /// How it goes about it.
    pub form: FormFactorOptions,
    /// Make rows sum to one. The adaptive method only: it needs factors that are reciprocal, with errors.
    pub close: bool,
}

/// The factors between the surfaces of an enclosure.
#[derive(Clone, Debug)]
pub struct Factors {
    /// By surface.
    pub factors: FormFactors,
    /// How far rows are from summing to one, as they were found.
    pub closure: Closure,
    /// Least and largest sum of a row, as they were found.
    pub row_sums: [f64; 2],
    /// Largest |A_i F_ij − A_j F_ji| over the smaller area, as it was found.
    pub reciprocity: f64,
    /// What making rows sum to one did, where that was asked for.
    pub repair: Option<Repair>,
    /// Time by stage.
    pub stages: Stages,
}

/// Finds the factors between the surfaces of an enclosure.
///
/// ```
/// use radiosity::{Enclosure, Facet, FactorsOptions, factors};
/// let square = |z: f64| [[0., 0., z], [1., 0., z], [1., 1., z], [0., 1., z]].map(Into::into).to_vec();
/// let mut pair = Enclosure::default();
/// pair.add("floor", Facet::new(square(0.0))?);
/// pair.add("ceiling", Facet::new(square(1.0))?.flipped());
/// let found = factors(&pair, &FactorsOptions::default(), &())?;
/// assert!((found.factors.value(0, 1) - 0.199824895698).abs() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error::Empty`] without facets; [`Error::Factors`] where memory does not suffice; [`Error::Stopped`].
pub fn factors(enclosure: &Enclosure, options: &FactorsOptions, monitor: &dyn Monitor) -> Result<Factors, Error> {
    if enclosure.facets.is_empty() {
        return Err(Error::Empty("there is no surface"));
    }
    if options.close && options.method != FormFactorMethod::Adaptive {
        return Err(Error::Empty("only factors of the adaptive method can be closed: others are not reciprocal"));
    }
    let stages = Stages::default();
    let watch = Watch(monitor);
    if options.method != FormFactorMethod::Adaptive {
        let found = stages
            .time(monitor, "form factors", || FormFactors::new(options.method, enclosure, &options.form, &watch))?
            .by_surface(enclosure);
        let (closure, row_sums, reciprocity) = (found.closure(), range(&found.row_sums()), found.reciprocity());
        return Ok(Factors { factors: found, closure, row_sums, reciprocity, repair: None, stages });
    }
    let found = stages.time(monitor, "form factors", || view_factors(enclosure, &options.form.adaptive, &watch))?;
    let mut found: ViewFactors =
        if enclosure.surfaces.len() == enclosure.facets.len() { found } else { found.by_surface(enclosure) };
    let (closure, row_sums) = (found.closure(), range(&found.row_sums()));
    let repair = options.close.then(|| stages.time(monitor, "closing", || found.repair()));
    // Stored once for both directions.
    Ok(Factors { factors: found.into(), closure, row_sums, reciprocity: 0.0, repair, stages })
}

fn range(sums: &[f64]) -> [f64; 2] {
    sums.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], s| [low.min(*s), high.max(*s)])
}

impl Factors {
    /// Script-F of the surfaces, row by row: the exchange with all reflections by the emittances in it.
    ///
    /// # Errors
    /// [`SolveError`] as of [`script_f`].
    pub fn script_f(&self, emittances: &[f64]) -> Result<Vec<f64>, SolveError> {
        script_f(&self.factors.dense(), emittances)
    }
}
