//! Stochastic Jacobi radiosity: incremental power shooting with random targets (catalogue 94; Neumann 1995; Neumann,
//! Purgathofer, Tobler et al. 1995; Bekaert 1999, ch. 5).
//!
//! A round shoots the unshot power of all unknowns at once: N_i samples leave i, in proportion to A_i ΔB_i, each
//! lands at j with probability F_ij, and what lands is the next round's unshot power. All samples stand for the same
//! power, so rounds get shorter as ρ^k. When less than one sample's power is left, it goes on with the probability of
//! its share, so that the end is not a bias. The variance falls as one over the number of samples; like random walks
//! it needs a reciprocal F and is poor on small unknowns.

use crate::random::{Random, Walks, deal, repeat};
use crate::{Go, Info, Params, Response, Rows, SolveError};

/// Stochastic Jacobi runs, [`Params::samples`] in the first round for each unknown; a step is a whole run. `b` holds
/// the start and the mean over all runs, [`Info::standard_error`] how sure that is.
///
/// # Errors
/// As [`crate::random_walk`].
pub fn stochastic_jacobi<T: Rows>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    step: impl FnMut(&[f64], &Info) -> Go,
) -> Result<Info, SolveError> {
    repeat(transport, response, e, b, params, step, run)
}

fn run(walks: &Walks, r: &[f64], random: &mut Random, found: &mut [f64]) -> u64 {
    let bands = walks.bands;
    found.copy_from_slice(r);
    let mut unshot = r.to_vec();
    let (_, first) = walks.power(&unshot);
    let mut draws = 0;
    loop {
        let (power, sum) = walks.power(&unshot);
        if sum == 0.0 {
            return draws;
        }
        let mut samples = walks.samples * sum / first;
        if samples < 1.0 {
            // Russian roulette on the whole rest.
            if random.unit() >= samples {
                return draws;
            }
            unshot.iter_mut().for_each(|x| *x /= samples);
            samples = 1.0;
        }
        let mut next = vec![0.0; unshot.len()];
        let mut sources = Vec::new();
        deal(&power, sum, samples, random, |i, count| sources.push((i, count)));
        for (i, count) in sources {
            // The power of i by band, over the number of samples that it gets in expectation.
            let share = sum / (power[i] * samples);
            for _ in 0..count {
                draws += 1;
                let Some((j, times)) = walks.destinations.draw(i, random) else { continue };
                for band in 0..bands {
                    let landed = walks.area[i] * unshot[i * bands + band] * share * times;
                    next[j * bands + band] += walks.sheets.reflectance[j * bands + band] * landed / walks.area[j];
                    if let Some((other, tau)) = walks.through(j) {
                        next[other * bands + band] += tau[band] * landed / walks.area[other];
                    }
                }
            }
        }
        for (found, next) in found.iter_mut().zip(&next) {
            *found += next;
        }
        unshot = next;
    }
}
