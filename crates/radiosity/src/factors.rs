//! View factors of an enclosure, surface by surface, with what is needed to trust them.
//!
//! Closure and reciprocity are told as they were found. Only on request are rows then made to sum to one
//! ([`radiosity_transport::view_factors::Repair`]), and only on request are reflections by the emittances put in (script-F).

use crate::monitor::{Monitor, Watch};
use crate::{Error, Stages};
use radiosity_scene::Enclosure;
use radiosity_solve::{SolveError, script_f};
use radiosity_transport::view_factors::{Closure, Repair, ViewFactors, surface_factors};
use radiosity_transport::{FormFactorMethod, FormFactorOptions, FormFactors};
use serde::Serialize;

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
    /// The factor with the largest stated error.
    pub largest_error: Doubt,
    /// What was asked and not reached, where [`Factors::largest_error`] is more than that; of the adaptive method alone, which
    /// is asked.
    pub missed: Option<Missed>,
    /// Rows that sum to more than one by more than their errors allow: there surfaces overlap, or errors are too small.
    pub excess: Option<Excess>,
    /// What making rows sum to one did, where that was asked for.
    pub repair: Option<Repair>,
    /// Time by stage.
    pub stages: Stages,
}

/// A factor and its stated error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Doubt {
    /// The error.
    pub error: f64,
    /// The surfaces of the row and of the column.
    pub pair: [usize; 2],
}

/// An accuracy that was not reached.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Missed {
    /// Pairs of surfaces whose stated error, of the factor from the smaller one, is larger than asked.
    pub pairs: usize,
    /// What was asked.
    pub asked: f64,
}

/// Rows that sum to more than one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Excess {
    /// How many do.
    pub rows: usize,
    /// The worst of them.
    pub row: usize,
    /// Its sum.
    pub sum: f64,
    /// The sum of its stated errors.
    pub errors: f64,
}

/// Sums above one that are no news: rounding of a row of some million factors.
const ROUNDING: f64 = 1e-9;

impl Missed {
    fn of(found: &ViewFactors, asked: f64) -> Option<Missed> {
        let areas = found.areas();
        // Errors are stored in single precision, rounded up.
        let bound = asked * (1.0 + 4.0 * f64::from(f32::EPSILON));
        let pairs = found.entries().filter(|(i, j, _, error)| error / areas[*i].min(areas[*j]) > bound).count();
        (pairs > 0).then_some(Missed { pairs, asked })
    }
}

impl Excess {
    fn of(factors: &FormFactors) -> Option<Excess> {
        let mut found: Option<Excess> = None;
        for row in 0..factors.len() {
            let (sum, errors) = factors.row(row).fold((0.0, 0.0), |(s, e), (_, value, error)| (s + value, e + error));
            let over = sum - errors - 1.0;
            if over > ROUNDING {
                let worst = found.filter(|worst| worst.sum - worst.errors - 1.0 >= over);
                let rows = found.map_or(0, |found| found.rows) + 1;
                found = Some(worst.map_or(Excess { rows, row, sum, errors }, |worst| Excess { rows, ..worst }));
            }
        }
        found
    }
}

/// The factor with the largest stated error.
fn largest_error(factors: &FormFactors) -> Doubt {
    let entries = (0..factors.len()).flat_map(|i| factors.row(i).map(move |(j, _, error)| ([i, j], error)));
    entries
        .fold(Doubt::default(), |worst, (pair, error)| if error > worst.error { Doubt { error, pair } } else { worst })
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
        let reciprocity = found.reciprocity();
        return Ok(Factors::of(found, reciprocity, stages));
    }
    let form = &options.form.adaptive;
    let mut found = stages.time(monitor, "form factors", || surface_factors(enclosure, form, &watch))?;
    let missed = Missed::of(&found, form.accuracy);
    // Stored once for both directions.
    let raw = |found: ViewFactors| Factors { missed, ..Factors::of(found.into(), 0.0, stages) };
    if !options.close {
        return Ok(raw(found));
    }
    let raw = raw(found.clone());
    let repair = raw.stages.time(monitor, "closing", || found.repair());
    Ok(Factors { factors: found.into(), repair: Some(repair), ..raw })
}

fn range(sums: &[f64]) -> [f64; 2] {
    sums.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], s| [low.min(*s), high.max(*s)])
}

impl Factors {
    /// Factors as they were found, and what they say of themselves.
    fn of(factors: FormFactors, reciprocity: f64, stages: Stages) -> Factors {
        Factors {
            closure: factors.closure(),
            row_sums: range(&factors.row_sums()),
            reciprocity,
            largest_error: largest_error(&factors),
            missed: None,
            excess: Excess::of(&factors),
            repair: None,
            stages,
            factors,
        }
    }

    /// Script-F of the surfaces, row by row: the exchange with all reflections by the emittances in it.
    ///
    /// # Errors
    /// [`SolveError`] as of [`script_f`].
    pub fn script_f(&self, emittances: &[f64]) -> Result<Vec<f64>, SolveError> {
        script_f(&self.factors.dense(), emittances)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_scene::Facet;

    fn square(low: [f64; 3], side: f64) -> Facet {
        let at = |x: f64, y: f64| [low[0] + x, low[1] + y, low[2]].into();
        Facet::new(vec![at(0., 0.), at(side, 0.), at(side, side), at(0., side)]).unwrap()
    }

    fn plates() -> Enclosure {
        let mut plates = Enclosure::default();
        plates.add("floor", square([0.0; 3], 1.0));
        plates.add("ceiling", square([0.0, 0.0, 1.0], 1.0).flipped());
        plates.obstructions.push(square([0.21, 0.34, 0.5], 0.4));
        plates
    }

    fn with_accuracy(accuracy: f64) -> Factors {
        let mut options = FactorsOptions::default();
        options.form.adaptive.accuracy = accuracy;
        factors(&plates(), &options, &()).unwrap()
    }

    /// It was kept silent.
    #[test]
    fn an_accuracy_that_is_not_reached_is_told_with_its_pair() {
        let reached = with_accuracy(1e-4);
        assert_eq!(reached.missed, None, "{:?}", reached.largest_error);
        assert!(reached.largest_error.error > 0.0 && reached.largest_error.error < 1.001e-4);
        let off = with_accuracy(1e-30);
        assert_eq!(off.missed, Some(Missed { pairs: 1, asked: 1e-30 }), "no sum of doubles is as exact");
        let Doubt { error, pair } = off.largest_error;
        assert!(error > 1e-30 && pair[0] + pair[1] == 1, "{off:?}");
    }

    /// Two floors in one place, each seen whole.
    #[test]
    fn rows_of_surfaces_that_overlap_sum_to_too_much() {
        let mut box_ = Enclosure::default();
        box_.add("floor", square([0.0; 3], 1.0));
        box_.add("above", square([0.0, 0.0, 0.01], 1.0).flipped());
        assert_eq!(factors(&box_, &FactorsOptions::default(), &()).unwrap().excess, None);
        box_.add("again", square([0.0; 3], 1.0));
        let excess = factors(&box_, &FactorsOptions::default(), &()).unwrap().excess.unwrap();
        assert!(excess.rows == 1 && excess.row == 1 && excess.sum > 1.9, "{excess:?}");
    }
}
