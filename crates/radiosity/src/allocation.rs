//! Optimal allocation: places that ask for more rays get more.
//!
//! Of n rays a place keeps the variance s² ∝ 1/n^p. What counts is Σ A s² over places of areas A, and the least Σ n
//! for it has n in proportion to (A s²)^(1/(1 + p)) (Neyman 1934, where p is 1). s² is what two halves of the first rays say, and
//! those of places that are likely to be as noisy.
//!
//! First rays are kept beside those that they ask for. Where they missed what is bright and small all around, none are asked
//! for: an audit, which knows nothing of this, tells how much that is.

use crate::Error;
use crate::believed::apart;
use radiosity_scene::{Bands, luminance};
use radiosity_transport::HalvedLight;
use std::collections::BTreeMap;

/// Doublings of the rays at a time at most: what asks for more than thirty-two times as many is a place with a lamp in its face.
pub(crate) const MOST_DOUBLINGS: u32 = 5;

/// Most rays of a place: with 64 times as many, the few places that see a bulb behind a shade took 19 s instead of 2.5.
const MOST_RAYS: u32 = 1 << 16;

/// p of what gather rays and shadow rays leave: of 64 to 2,048 in a furnished office variances fall with n^1.07 and n^1.5.
pub(crate) const GATHERED_POWER: f64 = 1.0;
pub(crate) const DIRECT_POWER: f64 = 1.4;

/// Light of some receivers, lx per band, and which of it is known without any chance.
pub(crate) struct Lit {
    pub light: Vec<Bands>,
    pub is_exact: Vec<bool>,
}

impl Lit {
    /// The mean of two halves.
    pub fn of_halves(halves: &[HalvedLight]) -> Lit {
        let (light, is_exact) = halves.iter().map(|half| (mean(half.light), half.is_exact)).unzip();
        Lit { light, is_exact }
    }
}

/// What rays found so far.
#[derive(Default)]
pub(crate) struct Found {
    /// Lx per band.
    pub light: Vec<Bands>,
    /// Standard error of each one's own light by what is known of places like it, lx.
    pub noise: Vec<f32>,
    /// How far halves of the rays are [`apart`] in it, lx; by the first ones alone where [`Found::grow`] sent more.
    pub apart: Vec<f32>,
    pub rays: Vec<u32>,
}

impl Found {
    /// By two halves, of so many rays together, and whether what they say is known without any chance. `evened` makes standard errors, lx, of
    /// the light and what halves differ by from it, which is no number where it is known that they do not.
    pub fn of_halves(halves: &[HalvedLight], rays: u32, evened: impl FnOnce(&[Bands], &[f32]) -> Vec<f32>) -> Found {
        let off = |half: &HalvedLight| if half.is_exact { f32::NAN } else { halved(half.light) };
        let (light, off): (Vec<Bands>, Vec<f32>) = halves.iter().map(|half| (mean(half.light), off(half))).unzip();
        let mut noise = evened(&light, &off);
        halves.iter().zip(&mut noise).filter(|(half, _)| half.is_exact).for_each(|(_, noise)| *noise = 0.0);
        let apart = halves.iter().map(|half| apart(half.light)).collect();
        Found { rays: vec![rays; light.len()], light, noise, apart }
    }

    /// Takes in what further rays of all places found, and what these say of the noise, of which they know more.
    pub fn join(&mut self, more: Found) {
        for i in 0..self.light.len() {
            let part = more.rays[i] as f32 / (self.rays[i] + more.rays[i]) as f32;
            let (own, new) = (self.light[i], more.light[i]);
            self.light[i] = std::array::from_fn(|k| own[k] + part * (new[k] - own[k]));
            self.noise[i] = more.noise[i] * part.sqrt();
            self.apart[i] += part * (more.apart[i] - self.apart[i]);
            self.rays[i] += more.rays[i];
        }
    }

    /// Sends more rays from the places that are to have more, as many times as many, up to 2^[`MOST_DOUBLINGS`] ([`curb`]). Whether
    /// any were sent.
    pub fn grow(
        &mut self,
        (times, power): (&[f64], f64),
        mut send: impl FnMut(&[usize], u32) -> Result<Lit, Error>,
    ) -> Result<bool, Error> {
        let possible = |i: usize| (MOST_RAYS / self.rays[i].max(1)).checked_ilog2().unwrap_or(0);
        let doublings = |i: usize| (times[i].log2().round() as u32).min(MOST_DOUBLINGS).min(possible(i));
        let mut groups: BTreeMap<(u32, u32), Vec<usize>> = BTreeMap::new();
        for i in (0..times.len()).filter(|i| doublings(*i) > 0) {
            groups.entry((doublings(i), self.rays[i])).or_default().push(i);
        }
        let any = !groups.is_empty();
        for ((doubled, had), own) in groups {
            let (all, more) = (had << doubled, (had << doubled) - had);
            let part = more as f32 / all as f32;
            // Those before and those that are added are a set each, and independent.
            let variance = f64::from(1.0 - part).powi(2)
                + f64::from(part).powi(2) * (f64::from(had) / f64::from(more)).powf(power);
            let Lit { light, is_exact } = send(&own, more)?;
            for ((&i, new), is_exact) in own.iter().zip(light).zip(is_exact) {
                if is_exact {
                    (self.light[i], self.noise[i], self.rays[i]) = (new, 0.0, all);
                    continue;
                }
                self.light[i] = std::array::from_fn(|k| self.light[i][k] + part * (new[k] - self.light[i][k]));
                self.noise[i] *= variance.sqrt() as f32;
                self.rays[i] = all;
            }
        }
        Ok(any)
    }

    /// The same of rays with halves, which go on to tell how far they are apart.
    pub fn grow_by_halves(
        &mut self,
        growth: (&[f64], f64),
        mut send: impl FnMut(&[usize], u32) -> Result<Vec<HalvedLight>, Error>,
    ) -> Result<bool, Error> {
        let mut told = Vec::new();
        let any = self.grow(growth, |own, rays| {
            let halves = send(own, rays)?;
            told.extend(own.iter().zip(&halves).map(|(i, half)| (*i, rays, apart(half.light))));
            Ok(Lit::of_halves(&halves))
        })?;
        for (i, rays, apart) in told {
            self.apart[i] += rays as f32 / self.rays[i] as f32 * (apart - self.apart[i]);
        }
        Ok(any)
    }
}

/// What two halves differ by from their mean.
fn halved([a, b]: [Bands; 2]) -> f32 {
    0.5 * luminance(std::array::from_fn(|k| (a[k] - b[k]).abs()))
}

/// The mean of two halves.
pub(crate) fn mean([a, b]: [Bands; 2]) -> Bands {
    std::array::from_fn(|k| 0.5 * (a[k] + b[k]))
}

/// Lets `rays` grow nowhere to more than 2^[`MOST_DOUBLINGS`] times as many, and to `most` times as many in all at most; how many times as many they would be
/// without the latter.
pub(crate) fn curb(times: &mut [f64], rays: &[u32], most: Option<f64>) -> f64 {
    times.iter_mut().for_each(|t| *t = t.min(f64::from(1 << MOST_DOUBLINGS)));
    let had: f64 = rays.iter().map(|rays| f64::from(*rays)).sum();
    let all = times.iter().zip(rays).map(|(t, rays)| t * f64::from(*rays)).sum::<f64>() / had.max(1.0);
    if let Some(most) = most.filter(|most| all > *most) {
        let part = if all > 1.0 { (most - 1.0).max(0.0) / (all - 1.0) } else { 0.0 };
        times.iter_mut().for_each(|t| *t = 1.0 + part * (*t - 1.0));
    }
    all
}

/// How many times as many rays each place is to have, so that the root mean square of `noise` over `area` becomes `target`, lx, with the
/// fewest rays, and that of none is more than its ceiling, lx.
pub(crate) fn growth(noise: &[f32], area: &[f64], ceilings: &[f64], target: f64, power: f64) -> Vec<f64> {
    let key: Vec<f64> =
        noise.iter().zip(area).map(|(s, a)| (a * f64::from(*s).powi(2)).powf(1.0 / (1.0 + power))).collect();
    // With n in proportion to the key of those that grow, Σ A s² is νᵖ Σ key over these and Σ key^(1 + p) over the others, and
    // those grow whose key is above ν.
    let allowed = target.powi(2) * area.iter().sum::<f64>();
    let mut order: Vec<usize> = (0..key.len()).collect();
    order.sort_unstable_by(|&i, &j| key[j].total_cmp(&key[i]).then(i.cmp(&j)));
    let mut rest: f64 = key.iter().map(|k| k.powf(1.0 + power)).sum();
    let (mut grown, mut limit) = (0.0, if rest <= allowed { f64::INFINITY } else { 0.0 });
    for i in order {
        if key[i] <= limit {
            break;
        }
        rest -= key[i].powf(1.0 + power);
        grown += key[i];
        limit = ((allowed - rest).max(0.0) / grown).powf(1.0 / power);
    }
    let own = |i: usize| (key[i] / limit).max((f64::from(noise[i]) / ceilings[i]).powf(2.0 / power)).max(1.0);
    (0..key.len()).map(own).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_trace::sampling::{hash, unit};

    /// Places of all sizes, most of them quiet.
    fn some() -> (Vec<f32>, Vec<f64>) {
        let draw = |i: u32, k: u32| unit(hash(hash(i) ^ k));
        let noise = |i| draw(i, 1) * if draw(i, 2) < 0.05 { 20.0 } else { 1.0 };
        ((0..4000).map(noise).collect(), (0..4000).map(|i| 0.1 + f64::from(draw(i, 3))).collect())
    }

    fn left(noise: &[f32], area: &[f64], times: &[f64], power: f64) -> f64 {
        let square = |i: usize| area[i] * f64::from(noise[i]).powi(2) / times[i].powf(power);
        ((0..times.len()).map(square).sum::<f64>() / area.iter().sum::<f64>()).sqrt()
    }

    #[test]
    fn noise_falls_to_what_is_asked_with_fewer_rays_than_all_alike_would_take() {
        let (noise, area) = some();
        let none = vec![f64::INFINITY; noise.len()];
        for power in [1.0, 1.4] {
            let first = left(&noise, &area, &vec![1.0; noise.len()], power);
            for part in [0.7, 0.3, 0.1] {
                let times = growth(&noise, &area, &none, part * first, power);
                assert!(times.iter().all(|t| *t >= 1.0));
                assert!((left(&noise, &area, &times, power) / (part * first) - 1.0).abs() < 1e-6);
                let alike = f64::powf(part, -2.0 / power) * noise.len() as f64;
                assert!(times.iter().sum::<f64>() < 0.7 * alike, "{part}: {} of {alike}", times.iter().sum::<f64>());
            }
        }
    }

    /// However often rays are added, halves are as far apart as if all had been sent at once.
    #[test]
    fn halves_go_on_to_be_told_apart() {
        let value = |place: usize, ray: u32| unit(hash(hash(place as u32) ^ ray));
        // Of each place the first half has the rays of even numbers.
        let halves = |place: usize, from: u32, to: u32| {
            let half = |k: u32| {
                let own = (from..to).filter(|ray| ray % 2 == k);
                own.map(|ray| value(place, ray)).sum::<f32>() / ((to - from) / 2) as f32
            };
            HalvedLight { light: [0, 1].map(|k| [half(k); 3]), is_exact: false }
        };
        let first: Vec<HalvedLight> = (0..10).map(|place| halves(place, 0, 4)).collect();
        let mut found = Found::of_halves(&first, 4, |_, apart| apart.to_vec());
        for times in [[1.0, 2.0, 4.0, 1.0, 8.0, 2.0, 1.0, 1.0, 4.0, 2.0], [2.0; 10]] {
            let had = found.rays.clone();
            let send = |own: &[usize], rays: u32| Ok(own.iter().map(|i| halves(*i, had[*i], had[*i] + rays)).collect());
            assert!(found.grow_by_halves((&times, 1.0), send).unwrap());
        }
        for place in 0..10 {
            let all = halves(place, 0, found.rays[place]).light;
            assert!((found.apart[place] - apart(all)).abs() < 1e-6 && found.rays[place] >= 8, "{place}");
            assert!((found.light[place][1] - mean(all)[1]).abs() < 1e-6, "{place}");
        }
    }

    #[test]
    fn quiet_places_grow_only_where_noise_is_seen() {
        let (noise, area) = some();
        let ceilings: Vec<f64> = (0..noise.len()).map(|i| if i % 2 == 0 { 1.0 } else { f64::INFINITY }).collect();
        let times = growth(&noise, &area, &ceilings, 100.0, 1.0);
        for (i, times) in times.iter().enumerate() {
            let is_seen = i % 2 == 0 && noise[i] > 1.0;
            assert!(if is_seen { (f64::from(noise[i]).powi(2) - times).abs() < 1e-3 } else { *times == 1.0 });
        }
        // What a deadline allows is shared by those that grow.
        let mut curbed = times.clone();
        let rays: Vec<u32> = (0..noise.len() as u32).map(|i| 1 + i % 2 * 9).collect();
        let mean = |times: &[f64]| {
            let all: f64 = times.iter().zip(&rays).map(|(t, rays)| t * f64::from(*rays)).sum();
            all / f64::from(rays.iter().sum::<u32>())
        };
        let asked = curb(&mut curbed, &rays, Some(1.05));
        let to = mean(&curbed);
        assert!((to - 1.05).abs() < 1e-9 && curbed.iter().zip(&times).all(|(c, t)| *c >= 1.0 && c <= t), "{to}");
        let doubled: Vec<f64> = times.iter().map(|t| t.min(32.0)).collect();
        assert!(asked > 1.1 && (asked / mean(&doubled) - 1.0).abs() < 1e-9, "{asked}");
        // In the dark nothing is asked for.
        let dark = growth(&[0.0; 3], &[1.0; 3], &[0.0; 3], 0.0, 1.0);
        assert_eq!(dark, [1.0; 3]);
    }
}
