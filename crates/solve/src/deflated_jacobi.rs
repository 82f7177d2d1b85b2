//! Jacobi iteration with the constant deflated: B ← E + R F B, then the energy balance set right at once.
//!
//! Plain Jacobi (gathering) loses one factor ρ per sweep, because one error mode, the constant irradiance, decays as
//! slowly as ρ̄; all others die at about half that rate (a closed cube has eigenvalues 1, 0.51, …). After each sweep
//! the multiple c of a vector v that makes the residual's area integral vanish is added: a coarse space of one vector
//! for each part of the scene that sees no other (a two-level method; Nicolaides 1987). Where sheets pass light from part to part, the
//! multiples c of all parts follow from one another ([`Coarse`]).
//!
//! v is what is reflected so far, B − E: so dim places get in proportion to what they have. The textbook's v = R 1 pours a part of a bright place's error into all that
//! is joined to it, and what has a thousandth of its light is far off when the residual, of all, is small. That of the first sweep alone is R 1 wherever there is a tenth of the mean light, or the
//! pattern of one sweep, many times too large, would have to die away first. On a closed cube at ρ = 0.95 1e-6 takes 12 sweeps or fewer instead of 269.

use crate::gauge::{Gauge, is_done, remainder};
use crate::{Go, Info, Params, Response, Sheets, SolveError, Space, Transport};
use std::collections::BTreeMap;

/// Solves B = E + R F B in place; `b` holds the start (warm or zero) and the result. `step` sees each iterate. This is
/// the solver `deflated-jacobi` of the table; the textbook's is [`crate::jacobi`]. Up to a work of 64 it goes on where the residual is small enough but dim unknowns have not settled.
///
/// # Errors
/// [`SolveError::NotConverged`] with the last iterate left in `b`; [`SolveError::Stopped`] if `step` says so.
pub fn deflated_jacobi<T: Transport>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    mut step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    let space = transport.space();
    let bands = response.bands();
    let n = b.len();
    let (mut h, mut r) = (vec![0.0; n], vec![0.0; n]);

    // A response that mixes unknowns at will leaves no part to itself.
    let sheets = response.sheets();
    let parts = transport.parts().filter(|_| sheets.is_some());
    let part = |i: usize, band: usize| parts.map_or(0, |p| p[i] as usize) * bands + band;
    let slots = bands * (1 + parts.and_then(|p| p.iter().max()).map_or(0, |p| *p as usize));
    let balance = |x: &[f64]| {
        // ⟨1, x⟩ by part: the inner product with the part's own indicator, gathered in one pass.
        let mut sums = vec![0.0; slots];
        space.accumulate(x, bands, |i, band, weighted| sums[part(i, band)] += weighted);
        sums
    };
    // The first sweep from nothing.
    if b.iter().all(|b| *b == 0.0) {
        b.copy_from_slice(e);
    }
    transport.apply(b, &mut h, bands)?;
    let is_cold = b == e;
    let gauge = Gauge::new(transport, response, e);
    let mut info = Info { steps: 1, work: 1.0, ..Info::default() };
    let apply = |x: &[f64], fx: &mut [f64], info: &mut Info| {
        (info.steps, info.work) = (info.steps + 1, info.work + 1.0);
        transport.apply(x, fx, bands)
    };
    // R F x summed up part by part, for an x of which F x is known.
    let reflected = |fx: &[f64]| {
        let mut reflected = vec![0.0; n];
        response.respond(fx, &mut reflected);
        balance(&reflected)
    };
    // F E and its sum, once there is one.
    let (mut fe, mut rfe) = (Vec::new(), Vec::new());
    let mut changed = f64::INFINITY;
    for sweep in 0.. {
        gauge.measure(transport, response, (e, b, &h), &mut r, &mut info);
        // Changes that fall by a factor q from sweep to sweep come to q/(1 − q) times the last one.
        let now = change(b, &r, bands);
        let factor = (now / changed).clamp(0.0, SLOWEST);
        let left = now * (factor / (1.0 - factor)).max(1.0);
        changed = now;
        let is_long = info.work >= MOST_LOCAL.min(params.max_steps as f64);
        let is_settled = is_long || left <= SETTLED * params.tolerance;
        let tolerance = if is_settled { params.tolerance } else { 0.0 };
        if is_done(b, &info, &Params { tolerance, ..*params }, &mut step)? {
            break;
        }
        // The coarse vector of a first sweep from E and its image under F, which is linear.
        let mut first = None;
        if sweep == 0 {
            if is_cold {
                fe.clone_from(&h);
                let [mut v, mut fv] = [vec![0.0; n], vec![0.0; n]];
                even(space, response, &h, bands, (&mut v, &mut fv));
                apply(&v, &mut fv, &mut info)?;
                first = Some((v, fv));
            } else {
                fe = vec![0.0; n];
                apply(e, &mut fe, &mut info)?;
            }
            rfe = reflected(&fe);
        }

        // Sweep: B + r is E + R F B.
        for (b, r) in b.iter_mut().zip(&r) {
            *b += r;
        }
        apply(b, &mut h, &mut info)?;

        // Deflate: the share of v that balances the area integral of the new residual.
        remainder(response, (e, b, &h), &mut r);
        let lacking = balance(&r);
        let kept = match &first {
            Some((v, fv)) => balance(v).iter().zip(reflected(fv)).map(|(v, rfv)| v - rfv).collect(),
            // v is B − E, so that v − R F v is R F E less the residual.
            None => rfe.iter().zip(&lacking).map(|(rfe, lacking)| rfe - lacking).collect(),
        };
        let mut coarse = Coarse { balance: kept, links: Vec::new() };
        if let Some(sheets) = sheets.filter(|sheets| slots > bands && sheets.sides() > 0) {
            let fv = || h.iter().zip(&fe).map(|(h, fe)| h - fe).collect();
            coarse.link(space, sheets, &first.as_ref().map_or_else(fv, |(_, fv)| fv.clone()), bands, part);
        }
        let multiples = coarse.solve(lacking);
        for k in 0..n {
            if let Some(c) = multiples[part(k / bands, k % bands)] {
                let c = if first.is_some() { c } else { c.clamp(LEAST_MULTIPLE, MOST_MULTIPLE) };
                let (v, fv) = first.as_ref().map_or_else(|| (b[k] - e[k], h[k] - fe[k]), |(v, fv)| (v[k], fv[k]));
                b[k] += c * v;
                h[k] += c * fv;
            }
        }
    }
    Ok(info)
}

/// What sweeps still change of each unknown, relative to itself, over the tolerance: at most this in the mean of fourth powers, so that a room of a hundredth of all unknowns lacks three times as much
/// at most. The residual is that of the brightest and says nothing of dim places: of 3 km of open site with a house nothing was left after two sweeps, and its rooms were up to a quarter too dark.
const SETTLED: f64 = 30.0;

/// Work after which the residual is enough.
const MOST_LOCAL: f64 = 64.0;

/// The slowest that changes are believed to fall from sweep to sweep.
const SLOWEST: f64 = 0.95;

/// The multiple of reflected light that a sweep adds: no more than half of it is taken away, and rows of few rays, in which next to none of it may come to rest, do not make it
/// explode.
const LEAST_MULTIPLE: f64 = -0.5;
const MOST_MULTIPLE: f64 = 100.0;

/// Light beside the brightest below which nobody asks.
const DARK: f64 = 1e-6;

/// What the next sweep changes of each unknown, relative to itself, in the mean of fourth powers.
fn change(b: &[f64], r: &[f64], bands: usize) -> f64 {
    let mut least = vec![f64::MIN_POSITIVE; bands];
    for b in b.chunks_exact(bands) {
        least.iter_mut().zip(b).for_each(|(least, b)| *least = least.max(DARK * b.abs()));
    }
    let relative = |(k, (b, r)): (usize, (&f64, &f64))| (r / b.abs().max(least[k % bands])).powi(4);
    (b.iter().zip(r).enumerate().map(relative).sum::<f64>() / b.len().max(1) as f64).powf(0.25)
}

/// Irradiance beside the mean of lit places from which on they are given the same.
const LIT: f64 = 0.1;

/// What surfaces reflect of an irradiance that is the same wherever there is a tenth of the mean, and less in proportion where there is less.
fn even(
    space: &impl Space,
    response: &(impl Response + ?Sized),
    h: &[f64],
    bands: usize,
    (v, shape): (&mut [f64], &mut [f64]),
) {
    let mut sums = vec![[0.0; 2]; bands];
    space.accumulate(h, bands, |i, band, weighted| {
        let own = h[i * bands + band];
        if own > 0.0 {
            sums[band] = [sums[band][0] + weighted, sums[band][1] + weighted / own];
        }
    });
    for (k, (shape, h)) in shape.iter_mut().zip(h).enumerate() {
        let [sum, area] = sums[k % bands];
        *shape = if sum > 0.0 { (h * area / (LIT * sum)).clamp(0.0, 1.0) } else { 1.0 };
    }
    response.respond(shape, v);
}

/// The balance of the parts: a_p c_p − Σ_q l_pq c_q = what part p lacks, with a_p the balance of its own coarse vector and
/// l_pq what sheets pass from q to p. Columns sum to what is absorbed, so that sweeps in sequence converge; that they
/// are left where they are after a while costs sweeps of the iteration, no accuracy.
struct Coarse {
    balance: Vec<f64>,
    /// (p, q, l_pq), in order.
    links: Vec<(usize, usize, f64)>,
}

/// Sweeps over the parts at most. Rooms that pass each other fifty times as much light as they absorb need that many.
const COARSE_SWEEPS: usize = 200;

impl Coarse {
    /// Takes what sheets pass from part to part of R F v, given F v, out of the balance of the parts' own vectors.
    fn link(
        &mut self,
        space: &impl Space,
        sheets: Sheets<'_>,
        fv: &[f64],
        bands: usize,
        part: impl Fn(usize, usize) -> usize,
    ) {
        let mut passed = vec![0.0; fv.len()];
        for (k, passed) in passed.iter_mut().enumerate() {
            if let Some((other, tau)) = sheets.passed(k / bands, bands) {
                *passed = tau[k % bands] * fv[other * bands + k % bands];
            }
        }
        let mut links = BTreeMap::new();
        space.accumulate(&passed, bands, |i, band, weighted| {
            if let Some((other, _)) = sheets.passed(i, bands) {
                let (to, from) = (part(i, band), part(other, band));
                if to != from {
                    *links.entry((to, from)).or_insert(0.0) += weighted;
                    self.balance[to] += weighted;
                }
            }
        });
        self.links = links.into_iter().map(|((to, from), weight)| (to, from, weight)).collect();
    }

    /// c by part; none where nothing is balanced.
    fn solve(&self, lacking: Vec<f64>) -> Vec<Option<f64>> {
        let positive = |p: usize| self.balance[p] > 0.0;
        let mut c: Vec<f64> =
            lacking.iter().enumerate().map(|(p, l)| if positive(p) { l / self.balance[p] } else { 0.0 }).collect();
        for _ in 0..COARSE_SWEEPS {
            let mut moved = 0f64;
            for row in self.links.chunk_by(|a, b| a.0 == b.0) {
                let p = row[0].0;
                if positive(p) {
                    let passed: f64 = row.iter().map(|(_, q, l)| l * c[*q]).sum();
                    let next = (lacking[p] + passed) / self.balance[p];
                    moved = moved.max((next - c[p]).abs());
                    c[p] = next;
                }
            }
            if moved <= 1e-3 * c.iter().fold(0f64, |m, c| m.max(c.abs())) {
                break;
            }
        }
        (0..c.len()).map(|p| positive(p).then_some(c[p])).collect()
    }
}
