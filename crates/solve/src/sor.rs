//! Gauss–Seidel and successive overrelaxation: gathering in sequence (catalogue 33, 36; Young 1950; Cohen & Wallace
//! 1993, §5.3.2).
//!
//! Unknown after unknown, B_i ← (1 − ω) B_i + ω (E_i + ρ_i Σ_{j≠i} F_ij B_j)/(1 − ρ_i F_ii), new values being used at
//! once; ω = 1 is Gauss–Seidel. On a symmetrisable system it converges for 0 < ω < 2 (Ostrowski 1954). It needs rows
//! in turn, so it does not run in parallel, and a response of plain surfaces and sheets. One side of a sheet reads the
//! row of the other as well: ρ_i F_ij becomes ρ_i F_ij + τ_i F_oj.
//!
//! The residual costs nothing. The sum over row i is split at the diagonal: the part beyond it, taken after a sweep,
//! is what the next sweep needs, and the part before it was summed over new values during this one. So a sweep with
//! its residual reads each entry once.

use crate::gauge::{Gauge, is_done};
use crate::{Go, Info, Params, Response, Rows, SolveError, Space};

/// Gauss–Seidel iteration; `b` holds the start and the result.
///
/// # Errors
/// [`SolveError::NotApplicable`] if the response is not one of sheets; otherwise as [`crate::jacobi`].
pub fn gauss_seidel<T: Rows>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    sor(transport, response, e, b, &Params { relaxation: 1.0, ..*params }, step)
}

/// Successive overrelaxation with ω = [`Params::relaxation`]; `b` holds the start and the result.
///
/// # Errors
/// [`SolveError::NotApplicable`] if the response is not one of sheets or ω is not between 0 and 2; otherwise as
/// [`crate::jacobi`].
pub fn sor<T: Rows>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    mut step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    let Some(sheets) = response.sheets() else {
        return Err(SolveError::NotApplicable("sweeps need a response of plain surfaces and sheets; use bicgstab"));
    };
    let rho = sheets.reflectance;
    let omega = params.relaxation;
    if !(omega > 0.0 && omega < 2.0) {
        return Err(SolveError::NotApplicable("overrelaxation needs a parameter between 0 and 2"));
    }
    let (bands, unknowns) = (response.bands(), transport.space().dim());
    let gauge = Gauge::new(transport, response, e);
    let mut own_row = Split::new(b.len(), unknowns);
    // The same of the row of the other side, where there is any.
    let sides = sheets.sides();
    let mut other_row = if sides > 0 { Split::new(b.len(), unknowns) } else { Split::new(0, 0) };
    let sweep = 1.0 + sides as f64 / unknowns.max(1) as f64;
    let mut r = vec![0.0; b.len()];

    // What the first sweep finds: each half is read once, and a start from zero is not read at all.
    let cold = b.iter().all(|b| *b == 0.0);
    for i in 0..unknowns {
        let start = (!cold).then_some(&*b);
        own_row.begin(transport, (i, i), start, bands);
        if let Some((other, _)) = sheets.passed(i, bands) {
            other_row.begin(transport, (i, other), start, bands);
        }
    }
    let mut info = Info { work: if cold { 0.0 } else { sweep }, ..Info::default() };
    loop {
        for k in 0..b.len() {
            let arriving = own_row.before[k] + own_row.own[k / bands] * b[k] + own_row.beyond[k];
            let mut gathered = e[k] + rho[k] * arriving;
            if let Some((_, tau)) = sheets.passed(k / bands, bands) {
                gathered +=
                    tau[k % bands] * (other_row.before[k] + other_row.own[k / bands] * b[k] + other_row.beyond[k]);
            }
            r[k] = gathered - b[k];
        }
        gauge.enter(transport, &r, &mut info);
        if is_done(b, &info, params, &mut step)? {
            return Ok(info);
        }

        // Sweep: the new values before the diagonal, the old ones beyond it.
        for i in 0..unknowns {
            own_row.add_before(transport, (i, i), b, bands);
            let passed = sheets.passed(i, bands);
            if let Some((other, _)) = passed {
                other_row.add_before(transport, (i, other), b, bands);
            }
            for band in 0..bands {
                let k = i * bands + band;
                let mut gathered = e[k] + rho[k] * (own_row.before[k] + own_row.beyond[k]);
                let mut diagonal = 1.0 - rho[k] * own_row.own[i];
                if let Some((_, tau)) = passed {
                    gathered += tau[band] * (other_row.before[k] + other_row.beyond[k]);
                    diagonal -= tau[band] * other_row.own[i];
                }
                b[k] = (1.0 - omega) * b[k] + omega * (gathered / diagonal);
            }
        }
        // Beyond the diagonal, for the residual and for the sweep to come.
        for i in 0..unknowns {
            own_row.add_beyond(transport, (i, i), b, bands);
            if let Some((other, _)) = sheets.passed(i, bands) {
                other_row.add_beyond(transport, (i, other), b, bands);
            }
        }
        info.steps += 1;
        info.work += sweep;
    }
}

/// Σ_j F_rj b_j for a row r of each unknown i, its own or that of its other side, split at j = i.
struct Split {
    before: Vec<f64>,
    beyond: Vec<f64>,
    /// F_ri.
    own: Vec<f64>,
}

impl Split {
    fn new(entries: usize, unknowns: usize) -> Split {
        Split { before: vec![0.0; entries], beyond: vec![0.0; entries], own: vec![0.0; unknowns] }
    }

    /// All three parts; of a start from zero, the factor alone.
    fn begin<T: Rows>(&mut self, transport: &T, (i, row): (usize, usize), b: Option<&[f64]>, bands: usize) {
        let at = i * bands;
        transport.row(row, |j, factor| {
            if j == i {
                self.own[i] = factor;
            } else if let Some(b) = b {
                let part = if j < i { &mut self.before } else { &mut self.beyond };
                for band in 0..bands {
                    part[at + band] += factor * b[j * bands + band];
                }
            }
        });
    }

    fn add_before<T: Rows>(&mut self, transport: &T, (i, row): (usize, usize), b: &[f64], bands: usize) {
        let sum = &mut self.before[i * bands..(i + 1) * bands];
        sum.fill(0.0);
        transport.row(row, |j, factor| {
            if j < i {
                add(sum, factor, &b[j * bands..]);
            }
        });
    }

    fn add_beyond<T: Rows>(&mut self, transport: &T, (i, row): (usize, usize), b: &[f64], bands: usize) {
        let sum = &mut self.beyond[i * bands..(i + 1) * bands];
        sum.fill(0.0);
        transport.row(row, |j, factor| {
            if j > i {
                add(sum, factor, &b[j * bands..]);
            }
        });
    }
}

fn add(sum: &mut [f64], factor: f64, b: &[f64]) {
    for (sum, b) in sum.iter_mut().zip(b) {
        *sum += factor * b;
    }
}
