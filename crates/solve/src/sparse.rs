//! F as compressed rows: only the pairs that see each other (CSR; Saad 2003, §3.4).
//!
//! Values may be single or double precision; sums are always double. Single precision halves the memory and moves the
//! answer by some 1e-7; it does so for F_ij and F_ji apart, so that columns are then kept beside the rows as soon as
//! one is asked for.

use crate::dense::{RECIPROCAL, check_numbers};
use crate::{AreaSpace, Rows, Shoot, SolveError, Space, Transport};
use rayon::prelude::*;
use std::sync::OnceLock;

/// A matrix of form factors of which only the entries that are not zero are stored, with values of type `V`: `f32` or
/// `f64`.
#[derive(Clone, Debug)]
pub struct SparseTransport<V = f64> {
    space: AreaSpace,
    rows: Compressed<V>,
    row_sum: f64,
    /// The columns, found when one is first asked for; `None` inside if rows do for them by reciprocity.
    columns: OnceLock<Option<Compressed<V>>>,
}

#[derive(Clone, Debug)]
struct Compressed<V> {
    /// Where each row starts, and the end.
    starts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<V>,
}

impl<V: Copy + Into<f64>> Compressed<V> {
    fn row(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[i]..self.starts[i + 1];
        self.columns[range.clone()].iter().zip(&self.values[range]).map(|(j, v)| (*j as usize, (*v).into()))
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        let first = self.starts[i];
        let found = self.columns[first..self.starts[i + 1]].binary_search(&(j as u32));
        found.map_or(0.0, |k| self.values[first + k].into())
    }

    fn transposed(&self) -> Compressed<V> {
        let n = self.starts.len() - 1;
        let mut starts = vec![0; n + 1];
        for j in &self.columns {
            starts[*j as usize + 1] += 1;
        }
        for i in 0..n {
            starts[i + 1] += starts[i];
        }
        let mut next = starts.clone();
        let mut columns = vec![0; self.columns.len()];
        let mut values = self.values.clone();
        for i in 0..n {
            for k in self.starts[i]..self.starts[i + 1] {
                let place = &mut next[self.columns[k] as usize];
                (columns[*place], values[*place]) = (i as u32, self.values[k]);
                *place += 1;
            }
        }
        Compressed { starts, columns, values }
    }
}

impl<V: Copy + Into<f64> + Send + Sync> SparseTransport<V> {
    /// From areas and compressed rows: row i has the entries `starts[i]..starts[i + 1]` of `columns` and `values`.
    ///
    /// # Errors
    /// If the lengths do not agree, a column does not exist, the columns of a row do not rise, or an area or a factor is
    /// no finite number.
    pub fn new(
        area: Vec<f64>,
        starts: Vec<usize>,
        columns: Vec<u32>,
        values: Vec<V>,
    ) -> Result<SparseTransport<V>, SolveError> {
        let n = area.len();
        let fits = starts.len() == n + 1
            && starts.first() == Some(&0)
            && starts.last() == Some(&columns.len())
            && starts.is_sorted()
            && columns.len() == values.len();
        if !fits {
            return Err(SolveError::NotApplicable("compressed rows need one start for each area, and a last one"));
        }
        let rising = |row: &[usize]| columns[row[0]..row[1]].is_sorted_by(|a, b| a < b);
        if !starts.windows(2).all(rising) || columns.iter().any(|j| *j as usize >= n) {
            return Err(SolveError::NotApplicable("the columns of a compressed row must rise and exist"));
        }
        check_numbers(&area, values.iter().map(|value| (*value).into()))?;
        let rows = Compressed { starts, columns, values };
        let row_sum = (0..n).map(|i| rows.row(i).map(|(_, f)| f.abs()).sum::<f64>()).fold(0f64, f64::max);
        Ok(SparseTransport { space: AreaSpace { area }, rows, row_sum, columns: OnceLock::new() })
    }

    /// Number of entries stored.
    pub fn entries(&self) -> usize {
        self.rows.values.len()
    }

    fn is_reciprocal(&self) -> bool {
        let area = &self.space.area;
        (0..area.len()).into_par_iter().all(|i| {
            self.rows.row(i).all(|(j, factor)| {
                let (there, back) = (area[i] * factor, area[j] * self.rows.at(j, i));
                (there - back).abs() <= RECIPROCAL * there.abs().max(back.abs())
            })
        })
    }
}

impl SparseTransport<f64> {
    /// The entries of another transport that are not zero.
    ///
    /// # Errors
    /// As [`SparseTransport::new`].
    pub fn from_rows(transport: &impl Rows<Space = AreaSpace>) -> Result<SparseTransport<f64>, SolveError> {
        let area = transport.space().area.clone();
        let (mut starts, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
        for i in 0..area.len() {
            transport.row(i, |j, factor| {
                if factor != 0.0 {
                    columns.push(j as u32);
                    values.push(factor);
                }
            });
            starts.push(values.len());
        }
        SparseTransport::new(area, starts, columns, values)
    }

    /// The same with values in single precision.
    pub fn to_single(&self) -> SparseTransport<f32> {
        let Compressed { starts, columns, values } = self.rows.clone();
        let rows = Compressed { starts, columns, values: values.into_iter().map(|v| v as f32).collect() };
        let sum = |i: usize| rows.row(i).map(|(_, f)| f.abs()).sum::<f64>();
        let row_sum = (0..self.space.dim()).map(sum).fold(0f64, f64::max);
        SparseTransport { space: self.space.clone(), rows, row_sum, columns: OnceLock::new() }
    }
}

impl<V: Copy + Into<f64> + Send + Sync> Transport for SparseTransport<V> {
    type Space = AreaSpace;

    fn space(&self) -> &AreaSpace {
        &self.space
    }

    fn apply(&self, b: &[f64], h: &mut [f64], bands: usize) -> Result<(), SolveError> {
        h.par_chunks_exact_mut(bands).enumerate().with_min_len(64).for_each(|(i, h)| {
            h.fill(0.0);
            for (j, factor) in self.rows.row(i) {
                for (h, b) in h.iter_mut().zip(&b[j * bands..(j + 1) * bands]) {
                    *h += factor * b;
                }
            }
        });
        Ok(())
    }

    fn row_sum(&self) -> f64 {
        self.row_sum
    }
}

impl<V: Copy + Into<f64> + Send + Sync> Rows for SparseTransport<V> {
    fn row(&self, i: usize, mut entry: impl FnMut(usize, f64)) {
        for (j, factor) in self.rows.row(i) {
            entry(j, factor);
        }
    }
}

impl<V: Copy + Into<f64> + Send + Sync> Shoot for SparseTransport<V> {
    fn shoot(&self, source: usize, unshot: &[f64], h: &mut [f64]) {
        let area = &self.space.area;
        let columns =
            self.columns.get_or_init(|| if self.is_reciprocal() { None } else { Some(self.rows.transposed()) });
        h.fill(0.0);
        let mut add = |j: usize, factor: f64| {
            for (h, unshot) in h[j * unshot.len()..].iter_mut().zip(unshot) {
                *h = factor * unshot;
            }
        };
        match columns {
            None => self.rows.row(source).for_each(|(j, factor)| add(j, factor * (area[source] / area[j]))),
            Some(columns) => columns.row(source).for_each(|(j, factor)| add(j, factor)),
        }
    }
}
