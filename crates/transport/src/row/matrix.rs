//! All rows of an enclosure: F_ij as a dense matrix, with what is not known about it.

use super::RowFactors;
use crate::{Progress, Stopped};
use radiosity_scene::Enclosure;
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// F_ij of N facets, row by row, and the account of each row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RowMatrix {
    /// F_ij at `i * N + j`.
    pub factors: Vec<f64>,
    /// How far each entry may be off.
    pub errors: Vec<f64>,
    /// What each row loses: [`RowFactors::lost`].
    pub lost: Vec<f64>,
    /// What each row looks at: [`RowFactors::captured`].
    pub captured: Vec<f64>,
}

impl RowMatrix {
    /// Asks `row` for every row, with working memory from `scratch` for each thread.
    pub(super) fn collect<S>(
        enclosure: &Enclosure,
        progress: &dyn Progress,
        scratch: impl Fn() -> S + Sync + Send,
        row: impl Fn(&mut S, usize) -> RowFactors + Sync + Send,
    ) -> Result<RowMatrix, Stopped> {
        let n = enclosure.facets.len();
        let done = AtomicUsize::new(0);
        let mut matrix = RowMatrix {
            factors: vec![0.0; n * n],
            errors: vec![0.0; n * n],
            lost: vec![0.0; n],
            captured: vec![0.0; n],
        };
        let entries = matrix.factors.par_chunks_mut(n.max(1)).zip(matrix.errors.par_chunks_mut(n.max(1)));
        let accounts = matrix.lost.par_iter_mut().zip(&mut matrix.captured);
        let all = entries.zip(accounts).enumerate();
        all.try_for_each_init(scratch, |scratch, (i, ((factors, errors), (lost, captured)))| {
            let found = row(scratch, i);
            for ((value, error), factor) in factors.iter_mut().zip(errors).zip(&found.factors) {
                (*value, *error) = (factor.value, factor.error);
            }
            (*lost, *captured) = (found.lost, found.captured);
            progress.step(done.fetch_add(1, Ordering::Relaxed) + 1, n).then_some(()).ok_or(Stopped)
        })?;
        Ok(matrix)
    }

    /// Number of facets.
    pub fn len(&self) -> usize {
        self.lost.len()
    }

    /// Whether there is no facet.
    pub fn is_empty(&self) -> bool {
        self.lost.is_empty()
    }

    /// Row i.
    pub fn row(&self, i: usize) -> &[f64] {
        &self.factors[i * self.len()..][..self.len()]
    }
}
