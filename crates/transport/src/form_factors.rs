//! Every method for form factors by its name, and the matrix that any of them makes.
//!
//! Three families: `adaptive`, the default ([`crate::view_factors`]), which stores each pair once; rows ([`RowMethod`]), which
//! look out from one facet at all others; pairs ([`PairMethod`]), which know two facets and what stands between. A new
//! method is a file in one of them and a line in its table.

use crate::pair::blockers::Blockers;
use crate::pair::{Occlusion, PAIRS, PairMethod};
use crate::row::{Look, RowMatrix, RowMethod};
use crate::view_factors::{Choices, Closure, FactorError, ViewFactorOptions, ViewFactors, view_factors};
use crate::{Progress, Stopped};
use radiosity_scene::{Enclosure, Facet};
use radiosity_solve::{SolveError, SparseTransport};
use rayon::prelude::*;
use std::fmt;
use std::str::FromStr;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A method for the form factors of an enclosure.
///
/// ```
/// use radiosity_transport::FormFactorMethod;
/// let method: FormFactorMethod = "hemicube".parse()?;
/// assert_eq!(method.to_string(), "hemicube");
/// assert!(FormFactorMethod::all().count() > 15);
/// # Ok::<(), radiosity_transport::UnknownFormFactorMethod>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum FormFactorMethod {
    /// Chosen pair by pair.
    #[default]
    Adaptive,
    /// All that a facet sees at once.
    Row(RowMethod),
    /// Pair by pair, always the same way.
    Pair(PairMethod),
    /// The hemicube on graphics hardware, in builds with the feature `gpu`; without it, it has its name and an error.
    HemicubeGpu,
}

impl FormFactorMethod {
    /// All that this build has, the default first.
    pub fn all() -> impl Iterator<Item = FormFactorMethod> {
        let rows = RowMethod::all().map(FormFactorMethod::Row);
        let pairs = PAIRS.into_iter().map(FormFactorMethod::Pair);
        let gpu = cfg!(feature = "gpu").then_some(FormFactorMethod::HemicubeGpu);
        std::iter::once(FormFactorMethod::Adaptive).chain(rows).chain(pairs).chain(gpu)
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            FormFactorMethod::Adaptive => "adaptive",
            FormFactorMethod::Row(method) => method.name(),
            FormFactorMethod::Pair(method) => method.name(),
            FormFactorMethod::HemicubeGpu => "hemicube-gpu",
        }
    }

    /// What it does, in a line, and where it is from.
    pub fn description(self) -> &'static str {
        match self {
            FormFactorMethod::Adaptive => {
                "pair by pair as needed: proven blocked or clear by shafts (Haines and Wallace 1991), closed form or cubature, \
                 shadows cut exactly"
            }
            FormFactorMethod::Row(method) => method.description(),
            FormFactorMethod::Pair(method) => method.description(),
            FormFactorMethod::HemicubeGpu => "the hemicube on graphics hardware (Cohen and Greenberg 1985)",
        }
    }

    /// Whether its values take account of what stands between facets.
    pub fn sees_occlusion(self) -> bool {
        match self {
            FormFactorMethod::Pair(method) => method.sees_occlusion(),
            _ => true,
        }
    }
}

impl fmt::Display for FormFactorMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that no method has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no form-factor method is called '{name}'; there are {}", names())]
pub struct UnknownFormFactorMethod {
    /// What was asked for.
    pub name: String,
}

fn names() -> String {
    FormFactorMethod::all().map(FormFactorMethod::name).collect::<Vec<_>>().join(", ")
}

impl FromStr for FormFactorMethod {
    type Err = UnknownFormFactorMethod;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        FormFactorMethod::all()
            .chain([FormFactorMethod::HemicubeGpu])
            .find(|m| m.name() == name)
            .ok_or_else(|| UnknownFormFactorMethod { name: name.to_owned() })
    }
}

/// How methods go about it.
#[derive(Clone, Copy, Debug, Default)]
pub struct FormFactorOptions {
    /// Of the adaptive method.
    pub adaptive: ViewFactorOptions,
    /// Of row methods.
    pub look: Look,
}

/// Form factors F_ij between N facets or surfaces by rows, with what is known of their errors.
#[derive(Clone, Debug, Default)]
pub struct FormFactors {
    /// Areas, m².
    pub areas: Vec<f64>,
    /// Where each row starts in the others, and at last where they end: N + 1 numbers.
    pub starts: Vec<usize>,
    /// The column of each entry, ascending in a row.
    pub columns: Vec<u32>,
    /// F_ij.
    pub values: Vec<f64>,
    /// Bounds of the errors; also of factors that were found to be zero and may not be.
    pub errors: Vec<f32>,
    /// Share of the hemisphere that a row method looks at, by row; empty for others.
    pub captured: Vec<f64>,
    /// How the adaptive method found its pairs.
    pub choices: Option<Choices>,
}

impl FormFactors {
    /// Computes the factors between all facets of an enclosure.
    ///
    /// # Errors
    /// [`FactorError::Stopped`] if `progress` says so; [`FactorError::Memory`] where `options.adaptive.memory` does not
    /// suffice, at once for methods that fill a whole matrix; [`FactorError::Gpu`] where `hemicube-gpu` is asked for and
    /// cannot be had.
    pub fn new(
        method: FormFactorMethod,
        enclosure: &Enclosure,
        options: &FormFactorOptions,
        progress: &dyn Progress,
    ) -> Result<FormFactors, FactorError> {
        let (facets, allowed) = (enclosure.facets.len(), options.adaptive.memory);
        // Values and errors of the whole matrix, and of what is not zero of it.
        let dense = facets.saturating_mul(facets).saturating_mul(2 * size_of::<f64>() + size_of::<(u32, f64, f32)>());
        if method != FormFactorMethod::Adaptive && dense > allowed {
            return Err(FactorError::Memory { facets, allowed });
        }
        match method {
            FormFactorMethod::Adaptive => Ok(view_factors(enclosure, &options.adaptive, progress)?.into()),
            FormFactorMethod::Row(row) => {
                let matrix = row.with(options.look).rows(enclosure, progress)?;
                Ok(FormFactors::from_rows(enclosure, matrix))
            }
            FormFactorMethod::Pair(pair) => Ok(by_pairs(pair, enclosure, progress)?),
            #[cfg(feature = "gpu")]
            FormFactorMethod::HemicubeGpu => {
                let hemicube = crate::row::HemicubeGpu::open(options.look)?;
                Ok(FormFactors::from_rows(enclosure, hemicube.matrix(enclosure, progress)?))
            }
            #[cfg(not(feature = "gpu"))]
            FormFactorMethod::HemicubeGpu => Err(crate::row::GpuError::NotBuilt.into()),
        }
    }

    fn from_rows(enclosure: &Enclosure, matrix: RowMatrix) -> FormFactors {
        let n = enclosure.facets.len();
        let rows = (0..n).map(|i| {
            let range = i * n..(i + 1) * n;
            matrix.factors[range.clone()].iter().copied().zip(matrix.errors[range].iter().copied()).enumerate()
        });
        let mut factors = FormFactors::collect(enclosure, rows);
        factors.captured = matrix.captured;
        factors
    }

    /// From whole rows of values and errors.
    fn collect(
        enclosure: &Enclosure,
        rows: impl Iterator<Item = impl Iterator<Item = (usize, (f64, f64))>>,
    ) -> FormFactors {
        let areas = enclosure.facets.iter().map(Facet::area).collect();
        let mut factors = FormFactors { areas, starts: vec![0], ..FormFactors::default() };
        for row in rows {
            for (j, (value, error)) in row.filter(|(_, (value, error))| *value != 0.0 || *error != 0.0) {
                factors.columns.push(j as u32);
                factors.values.push(value);
                factors.errors.push(round_up(error));
            }
            factors.starts.push(factors.columns.len());
        }
        factors
    }

    /// Number of facets.
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.areas.is_empty()
    }

    /// The entries (column, F_ij, error) of row i.
    pub fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
        let range = self.starts[i]..self.starts[i + 1];
        range.map(|k| (self.columns[k] as usize, self.values[k], f64::from(self.errors[k])))
    }

    /// F_ij; zero where nothing is stored.
    pub fn value(&self, i: usize, j: usize) -> f64 {
        let range = self.starts[i]..self.starts[i + 1];
        self.columns[range.clone()].binary_search(&(j as u32)).map_or(0.0, |k| self.values[range.start + k])
    }

    /// Σ_j F_ij of each row.
    pub fn row_sums(&self) -> Vec<f64> {
        (0..self.len()).map(|i| self.row(i).map(|(_, value, _)| value).sum()).collect()
    }

    /// How far rows are from summing to one, as they were found.
    pub fn closure(&self) -> Closure {
        Closure::of(&self.row_sums())
    }

    /// Largest |A_i F_ij − A_j F_ji| over the smaller area: how far the factors are from reciprocal, as they were found.
    pub fn reciprocity(&self) -> f64 {
        let off = |i: usize| {
            self.row(i).map(move |(j, value, _)| {
                let (a, b) = (self.areas[i], self.areas[j]);
                (a * value - b * self.value(j, i)).abs() / a.min(b)
            })
        };
        (0..self.len()).into_par_iter().map(|i| off(i).fold(0.0, f64::max)).reduce(|| 0.0, f64::max)
    }

    /// As an operator for solvers.
    ///
    /// # Errors
    /// [`SolveError`] if a factor or an area is no finite number.
    pub fn transport(&self) -> Result<SparseTransport<f64>, SolveError> {
        // Entries that are zero and may err are of no use here.
        let mut starts = vec![0];
        let (mut columns, mut values) = (Vec::new(), Vec::new());
        for i in 0..self.len() {
            for (j, value, _) in self.row(i).filter(|(_, value, _)| *value != 0.0) {
                columns.push(j as u32);
                values.push(value);
            }
            starts.push(columns.len());
        }
        SparseTransport::new(self.areas.clone(), starts, columns, values)
    }

    /// All factors, row by row: N × N.
    pub fn dense(&self) -> Vec<f64> {
        let n = self.len();
        let mut dense = vec![0.0; n * n];
        for i in 0..n {
            for (j, value, _) in self.row(i) {
                dense[i * n + j] = value;
            }
        }
        dense
    }

    /// The factors between the surfaces that facets belong to: F_IJ = Σ A_i F_ij/A_I.
    pub fn by_surface(&self, enclosure: &Enclosure) -> FormFactors {
        let n = enclosure.surfaces.len();
        let areas = enclosure.surface_areas();
        let mut rows: Vec<std::collections::BTreeMap<u32, (f64, f64)>> = vec![Default::default(); n];
        for i in 0..self.len() {
            let surface = enclosure.surface_of[i] as usize;
            let share = self.areas[i] / areas[surface];
            for (j, value, error) in self.row(i) {
                let sum = rows[surface].entry(enclosure.surface_of[j]).or_default();
                *sum = (sum.0 + share * value, sum.1 + share * error);
            }
        }
        let mut factors = FormFactors { areas, starts: vec![0], choices: self.choices, ..FormFactors::default() };
        for row in rows {
            for (column, (value, error)) in row {
                factors.columns.push(column);
                factors.values.push(value);
                factors.errors.push(round_up(error));
            }
            factors.starts.push(factors.columns.len());
        }
        factors
    }
}

impl From<ViewFactors> for FormFactors {
    fn from(found: ViewFactors) -> FormFactors {
        let (starts, columns, values, errors) = found.csr();
        let (areas, choices) = (found.areas().to_vec(), Some(found.choices));
        FormFactors { areas, starts, columns, values, errors, captured: Vec::new(), choices }
    }
}

/// Single precision, never below: a bound stays one.
pub(crate) fn round_up(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) < x { near.next_up() } else { near }
}

/// Every pair by one method, each direction for itself: what they are off from reciprocity is theirs.
fn by_pairs(method: PairMethod, enclosure: &Enclosure, progress: &dyn Progress) -> Result<FormFactors, Stopped> {
    let facets = &enclosure.facets;
    let blockers = Blockers::new(facets.iter().chain(&enclosure.obstructions));
    let pair = method.build();
    let done = AtomicUsize::new(0);
    let rows: Vec<Vec<(usize, (f64, f64))>> = (0..facets.len())
        .into_par_iter()
        .map(|i| {
            let own = &facets[i];
            let row = facets.iter().enumerate().filter(|(j, to)| *j != i && own.faces(to));
            let row = row.map(|(j, to)| {
                let factor = pair.factor(own, to, &blockers as &dyn Occlusion);
                (j, (factor.value, factor.error))
            });
            let row = row.collect();
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            progress.step(done, facets.len()).then_some(row).ok_or(Stopped)
        })
        .collect::<Result<_, _>>()?;
    Ok(FormFactors::collect(enclosure, rows.into_iter().map(Vec::into_iter)))
}
