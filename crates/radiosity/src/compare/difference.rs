//! How far light and factors are from the exact ones.

use super::problem::bright;
use radiosity_transport::FormFactors;
use rayon::prelude::*;

/// How illuminances differ.
pub(super) struct LightError {
    pub relative: f64,
    pub bias: f64,
}

/// Relative L2 and bias of `h` against `exact`, by area and luminance.
pub(super) fn light_error(h: &[[f64; 3]], exact: &[[f64; 3]], area: &[f64]) -> LightError {
    let (mut square, mut norm, mut shift, mut level) = (0.0, 0.0, 0.0, 0.0);
    for ((h, exact), area) in h.iter().zip(exact).zip(area) {
        let (h, exact) = (bright(*h), bright(*exact));
        square += area * (h - exact) * (h - exact);
        norm += area * exact * exact;
        shift += area * (h - exact);
        level += area * exact;
    }
    LightError { relative: (square / norm.max(f64::MIN_POSITIVE)).sqrt(), bias: shift / level.max(f64::MIN_POSITIVE) }
}

/// How factors differ from exact ones.
pub(super) struct Difference {
    /// ‖F − F*‖/‖F*‖ over all entries.
    pub relative: f64,
    /// Largest |F − F*|.
    pub largest: f64,
    /// Share of the pairs whose stated errors cover the true one.
    pub covered: f64,
    /// Root mean square of the row sums' differences.
    pub row_sums: f64,
}

/// What rounding leaves of a factor.
const ROUNDING: f64 = 1e-12;

impl Difference {
    pub fn new(factors: &FormFactors, exact: &FormFactors) -> Difference {
        // By row: squared difference, squared exact factor, largest difference, pairs, those covered, the row sum's.
        let row = |i: usize| {
            let mut sums = [0f64; 6];
            each_pair(factors, exact, i, |_, [value, stated], [truth, own]| {
                let off = value - truth;
                sums[0] += off * off;
                sums[1] += truth * truth;
                sums[2] = sums[2].max(off.abs());
                sums[3] += 1.0;
                sums[4] += f64::from(u8::from(off.abs() <= stated + own + ROUNDING));
                sums[5] += off;
            });
            sums
        };
        let rows: Vec<[f64; 6]> = (0..factors.len()).into_par_iter().map(row).collect();
        let sum = |k: usize| rows.iter().map(|row| row[k]).sum::<f64>();
        let row_sums = rows.iter().map(|row| row[5] * row[5]).sum::<f64>() / rows.len().max(1) as f64;
        Difference {
            relative: (sum(0) / sum(1).max(f64::MIN_POSITIVE)).sqrt(),
            largest: rows.iter().map(|row| row[2]).fold(0.0, f64::max),
            covered: sum(4) / sum(3).max(1.0),
            row_sums: row_sums.sqrt(),
        }
    }
}

/// Calls back with j, value and error of F_ij by both, for all j that either sees in row i.
pub(super) fn each_pair(a: &FormFactors, b: &FormFactors, i: usize, mut visit: impl FnMut(usize, [f64; 2], [f64; 2])) {
    let (mut left, mut right) = (a.row(i).peekable(), b.row(i).peekable());
    loop {
        let column = match (left.peek(), right.peek()) {
            (None, None) => return,
            (Some(x), None) => x.0,
            (None, Some(y)) => y.0,
            (Some(x), Some(y)) => x.0.min(y.0),
        };
        let own = left.next_if(|x| x.0 == column).map_or([0.0; 2], |(_, value, error)| [value, error]);
        let other = right.next_if(|y| y.0 == column).map_or([0.0; 2], |(_, value, error)| [value, error]);
        if own[0] != 0.0 || other[0] != 0.0 {
            visit(column, own, other);
        }
    }
}
