//! Closure: how far rows are from summing to one, and a repair that moves uncertain entries and no others.
//!
//! In a closed enclosure Σ_j F_ij = 1. The repair is the least change that makes it so: Σ (ΔS_ij/σ_ij)² is least under
//! Σ_j S_ij = A_i, where S is the symmetric exchange area and σ its error (van Leersum 1989, "A method for determining
//! a consistent set of radiation view factors", with errors for weights). Its solution is ΔS_ij = σ_ij² (λ_i + λ_j);
//! the multipliers λ come from a symmetric system, by conjugate gradients. Entries stay at or above zero and within
//! twice their stated errors. What is certain does not move, so a gap in the enclosure does not close: the defect that
//! is left is reported.

use super::ViewFactors;
use serde::Serialize;

/// How far the rows of an enclosure are from summing to one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Closure {
    /// Root of the mean square of Σ_j F_ij − 1.
    pub rms: f64,
    /// Largest |Σ_j F_ij − 1|.
    pub largest: f64,
    /// The row of it.
    pub row: usize,
    /// Mean of Σ_j F_ij − 1.
    pub mean: f64,
}

impl Closure {
    /// Of rows with the given sums.
    pub fn of(sums: &[f64]) -> Closure {
        let mut closure = Closure::default();
        for (row, sum) in sums.iter().enumerate() {
            let off = sum - 1.0;
            closure.mean += off;
            closure.rms += off * off;
            if off.abs() > closure.largest {
                (closure.largest, closure.row) = (off.abs(), row);
            }
        }
        let n = sums.len().max(1) as f64;
        (closure.mean, closure.rms) = (closure.mean / n, (closure.rms / n).sqrt());
        closure
    }
}

/// What a repair did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Repair {
    /// Before.
    pub before: Closure,
    /// After.
    pub after: Closure,
    /// Largest change of a factor.
    pub largest_change: f64,
    /// Largest change relative to the entry's stated error: where it is as large as is allowed, two, the enclosure is
    /// not closed, or errors were stated too small.
    pub largest_relative: f64,
    /// Rows that lack more than their errors allow, where the enclosure has a gap; they stay as they are.
    pub open_rows: usize,
    /// Rounds that the bounds of entries took.
    pub rounds: usize,
}

/// How far an entry may be moved, in its stated errors: those are on the safe side. What lies beyond is no error but a
/// gap in the enclosure.
const REACH: f64 = 2.0;

/// Steps of conjugate gradients in a round; rows of a room are closed to rounding after some thirty.
const STEPS: usize = 300;

/// Rounds after which rows are left as they are.
const ROUNDS: usize = 20;

impl ViewFactors {
    /// How far rows are from summing to one.
    pub fn closure(&self) -> Closure {
        Closure::of(&self.row_sums())
    }

    /// Makes rows sum to one by moving uncertain entries.
    pub fn repair(&mut self) -> Repair {
        let mut repair = Repair { before: self.closure(), ..Repair::default() };
        let before = self.stored_values().0.to_vec();
        // σ², zero where an entry is to stay: where it reached the end of its range.
        let mut weights: Vec<f64> = self.stored_values().1.iter().map(|e| f64::from(*e).powi(2)).collect();
        let is_open = self.open_rows();
        repair.open_rows = is_open.iter().filter(|open| **open).count();
        self.each(|i, j, k| {
            if is_open[i] && is_open[j] {
                weights[k] = 0.0;
            }
        });
        for round in 1..=ROUNDS {
            repair.rounds = round;
            let sums = self.row_sums();
            let lacks = sums.iter().zip(self.areas()).zip(&is_open);
            let off: Vec<f64> = lacks.map(|((sum, a), open)| if *open { 0.0 } else { a * (1.0 - sum) }).collect();
            let lambda = self.multipliers(&weights, &off, &is_open);
            let (mut values, mut has_stopped) = (self.stored_values().0.to_vec(), false);
            let errors = self.stored_values().1;
            self.each(|i, j, k| {
                let reach = REACH * f64::from(errors[k]);
                let (low, high) = ((before[k] - reach).max(0.0), before[k] + reach);
                let wanted = values[k] + weights[k] * (lambda[i] + lambda[j]);
                values[k] = wanted.clamp(low, high);
                if weights[k] > 0.0 && values[k] != wanted {
                    (weights[k], has_stopped) = (0.0, true);
                }
            });
            self.set_values(values);
            if !has_stopped {
                break;
            }
        }
        repair.after = self.closure();
        let (values, errors) = self.stored_values();
        self.each(|i, j, k| {
            let change = (values[k] - before[k]).abs();
            if change > 0.0 {
                repair.largest_change = repair.largest_change.max(change / self.areas()[i].min(self.areas()[j]));
                repair.largest_relative = repair.largest_relative.max(change / f64::from(errors[k]));
            }
        });
        repair
    }

    /// Rows that lack more than all their entries may be moved: the enclosure has a gap there.
    fn open_rows(&self) -> Vec<bool> {
        let mut reach = vec![0.0; self.len()];
        let errors = self.stored_values().1;
        self.each(|i, j, k| {
            reach[i] += REACH * f64::from(errors[k]);
            if i != j {
                reach[j] += REACH * f64::from(errors[k]);
            }
        });
        let lacks = self.row_sums().into_iter().zip(self.areas()).map(|(sum, a)| a * (1.0 - sum).abs());
        lacks.zip(reach).map(|(lacks, reach)| lacks > reach).collect()
    }

    /// λ of Σ_j w_ij (λ_i + λ_j) = off_i, zero on open rows, by conjugate gradients with the diagonal as
    /// preconditioner.
    fn multipliers(&self, weights: &[f64], off: &[f64], is_open: &[bool]) -> Vec<f64> {
        let n = self.len();
        let apply = |x: &[f64]| {
            let mut y = vec![0.0; n];
            self.each(|i, j, k| {
                let weight = weights[k] * (x[i] + x[j]);
                y[i] += weight;
                if i != j {
                    y[j] += weight;
                }
            });
            y
        };
        let mut diagonal = vec![0.0; n];
        self.each(|i, j, k| {
            diagonal[i] += weights[k] * if i == j { 2.0 } else { 1.0 };
            if i != j {
                diagonal[j] += weights[k];
            }
        });
        let scaled = |r: &[f64]| -> Vec<f64> {
            let scaled = |((r, d), open): ((&f64, &f64), &bool)| if *d > 0.0 && !open { r / d } else { 0.0 };
            r.iter().zip(&diagonal).zip(is_open).map(scaled).collect()
        };
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        let mut lambda = vec![0.0; n];
        // Rows without an uncertain entry cannot be moved.
        let mut r: Vec<f64> = off.iter().zip(&diagonal).map(|(r, d)| if *d > 0.0 { *r } else { 0.0 }).collect();
        let mut z = scaled(&r);
        let mut p = z.clone();
        let mut rz = dot(&r, &z);
        let target = 1e-24 * rz;
        for _ in 0..STEPS {
            if rz <= target || rz == 0.0 {
                break;
            }
            let ap = apply(&p);
            let pap = dot(&p, &ap);
            if pap <= 0.0 {
                break;
            }
            let alpha = rz / pap;
            for i in 0..n {
                lambda[i] += alpha * p[i];
                r[i] -= alpha * ap[i];
            }
            z = scaled(&r);
            let next = dot(&r, &z);
            for i in 0..n {
                p[i] = z[i] + next / rz * p[i];
            }
            rz = next;
        }
        lambda
    }
}
