//! Random walk radiosity: particles are shot, reflected and absorbed (catalogue 94; Shirley 1990; Sbert 1997; Bekaert
//! 1999, ch. 4).
//!
//! A walk starts at i with a probability in proportion to its power A_i E_i, and goes on to j with probability F_ij.
//! It scores at each landing what is reflected there (the collision estimator): B_j += ρ_j Φ/A_j for a power Φ, by
//! band. Then it survives with the largest ρ_j of the bands, Φ being weighed so that the expectation stays. On a sheet it
//! scores on both sides, B_o += τ_o Φ/A_o, survives with the largest ρ_j + τ_o, and goes on from one of the two. Unbiased;
//! the variance falls as one over the number of walks. It needs a reciprocal F. It is poor on small unknowns, which
//! few walks meet, and never reaches a small residual: a thousandth takes a million walks or more.

use crate::random::{Random, Walks, deal, repeat};
use crate::{Go, Info, Params, Response, Rows, SolveError};

/// Random walks, [`Params::samples`] for each unknown a step; `b` holds the start and the mean over all steps, and
/// [`Info::standard_error`] how sure that is. The walks of a start carry what its residual leaves.
///
/// # Errors
/// [`SolveError::NotApplicable`] if a response is not self-adjoint or not below one, or an entry of F negative;
/// otherwise as [`crate::jacobi`].
pub fn random_walk<T: Rows>(
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
    let (power, sum) = walks.power(r);
    let mut sources = Vec::new();
    deal(&power, sum, walks.samples, random, |i, count| sources.push((i, count)));
    let mut draws = 0;
    let mut carried = vec![0.0; bands];
    for (source, count) in sources {
        for _ in 0..count {
            // Of the unknown's power, the part that this walk stands for.
            for band in 0..bands {
                carried[band] = walks.area[source] * r[source * bands + band] * sum / (power[source] * walks.samples);
            }
            let mut i = source;
            loop {
                draws += 1;
                let Some((j, times)) = walks.destinations.draw(i, random) else { break };
                let rho = &walks.sheets.reflectance[j * bands..(j + 1) * bands];
                if let Some((other, tau)) = walks.through(j) {
                    for band in 0..bands {
                        carried[band] *= times;
                        found[j * bands + band] += rho[band] * carried[band] / walks.area[j];
                        found[other * bands + band] += tau[band] * carried[band] / walks.area[other];
                    }
                    let most = |of: &[f64]| of.iter().fold(0f64, |m, x| m.max(*x));
                    let survival = rho.iter().zip(tau).fold(0f64, |m, (rho, tau)| m.max(rho + tau));
                    if random.unit() >= survival {
                        break;
                    }
                    let passing = most(tau) / (most(rho) + most(tau));
                    let passes = random.unit() < passing;
                    let (kept, share) = if passes { (tau, passing) } else { (rho, 1.0 - passing) };
                    for band in 0..bands {
                        carried[band] *= kept[band] / (survival * share);
                    }
                    i = if passes { other } else { j };
                    continue;
                }
                for band in 0..bands {
                    carried[band] *= times * rho[band];
                    found[j * bands + band] += carried[band] / walks.area[j];
                }
                let survival = rho.iter().fold(0f64, |m, rho| m.max(*rho));
                if random.unit() >= survival {
                    break;
                }
                carried.iter_mut().for_each(|power| *power /= survival);
                i = j;
            }
        }
    }
    draws
}
