//! Light of texels: a few rays for each, then more for those whose first ones disagree.
//!
//! Of n rays a texel keeps the variance s² ∝ 1/n^p. What counts is Σ A s² over the areas A of the texels that are lit, and the least Σ n
//! for it has n in proportion to (A s²)^(1/(1 + p)): optimal allocation (Neyman 1934, where p is 1). s² is what two halves of
//! the first rays, and those of the texels around, say; for what is gathered, after it was shared ([`Atlas::pooled`]). In a furnished office a
//! twentieth of the texels has two thirds of the squared error, if all have as many rays.
//!
//! First rays are kept beside those that they ask for. Where they missed what is bright and small all around, none are asked
//! for: the audit of the map, which knows nothing of this, tells how much that is.

use crate::answer::Station;
use crate::bake::{Baked, gather_rays};
use crate::judge::{root_mean_square, thinned as thin};
use crate::measure::rays_for;
use crate::pace;
use crate::{Error, Monitor};
use radiosity_scene::{Bands, luminance};
use radiosity_trace::Place;
use radiosity_transport::Shadowing;
use radiosity_view::Pooled;
use radiosity_view::lightmap::{Atlas, Texel};

/// First gather rays of a texel, at most. Those of neighbours count with them where light comes in through a window, which takes
/// some hundreds in all; and small things have few texels to share with: with half as many they are as different as checks are.
const FIRST_GATHERED: usize = 64;

/// First shadow rays of a texel at 1 %, of both halves; at the least, as fewer would leave many of a dozen lamps without any; and at the most: more
/// go where they are needed.
const FIRST_SHADOW: f64 = 128.0;
const LEAST_SHADOW: usize = 32;
const MOST_SHADOW: usize = 1024;

/// Noise that is left in what is gathered, and in direct light, relative to the error asked: two fifths of the squared error
/// together, the rest of what solutions may have ([`crate::judge`]) is for what is not noise.
const GATHERED_NOISE: f64 = 0.5;
const DIRECT_NOISE: f64 = 0.4;

/// p of gathers and of shadow rays: what 64 to 1,024 of them leave in a furnished office.
const GATHERED_POWER: f64 = 1.0;
const DIRECT_POWER: f64 = 1.4;

/// Noise of one texel relative to its own light at most, about, in errors asked. In a furnished office at 2 % twice as much saves a fifteenth of
/// the gather rays, and two thirds of it take a third more of them.
const VISIBLE: f64 = 3.0;

/// Light below this part of the mean counts as if it was as much: in the dark little is seen. In a furnished office at 2 % the noise of
/// small dark things that this allows takes a fifteenth of the rays; with a tenth, more than twice as many are needed in all.
const DARK: f64 = 0.25;

/// Doublings of the first rays at most: what is noisy after thirty-two times as many is a texel with a lamp in its face.
const MOST_DOUBLINGS: u32 = 5;

/// A page and those of its texels that are lit, none of them inside a solid.
#[derive(Clone, Copy)]
pub(crate) struct Sheet<'a> {
    pub atlas: &'a Atlas,
    pub page: usize,
    pub texels: &'a [Texel],
}

/// Light by texel, lx per band.
pub(crate) struct TexelLight {
    pub direct: Vec<Bands>,
    pub indirect: Vec<Pooled>,
}

/// What rays found so far.
struct Found {
    light: Vec<Bands>,
    /// Standard error of one texel's own light by what is known around it, lx.
    noise: Vec<f32>,
    rays: Vec<u32>,
}

impl Found {
    /// By two halves.
    fn of_halves(sheet: Sheet, halves: impl Iterator<Item = [Bands; 2]>, rays: u32) -> Found {
        let told = |[a, b]: [Bands; 2]| {
            let mean: Bands = std::array::from_fn(|k| 0.5 * (a[k] + b[k]));
            (mean, 0.5 * luminance(std::array::from_fn(|k| (a[k] - b[k]).abs())))
        };
        let (light, apart): (Vec<Bands>, Vec<f32>) = halves.map(told).unzip();
        let noise = sheet.atlas.evened(sheet.page, sheet.texels, &apart);
        Found { rays: vec![rays; light.len()], light, noise }
    }

    /// Sends more rays from the texels that are to have more, as many times as many, up to 2^[`MOST_DOUBLINGS`] ([`curb`]).
    fn grow(
        &mut self,
        (times, power): (&[f64], f64),
        mut send: impl FnMut(&[usize], u32) -> Result<Vec<Bands>, Error>,
    ) -> Result<(), Error> {
        let doublings: Vec<u32> = times.iter().map(|t| t.log2().round() as u32).collect();
        for doubled in 1..=MOST_DOUBLINGS {
            let own: Vec<usize> = (0..times.len()).filter(|&i| doublings[i] == doubled).collect();
            let Some(first) = own.first().map(|&i| self.rays[i]) else { continue };
            let (all, more) = (first << doubled, (first << doubled) - first);
            for (&i, new) in own.iter().zip(send(&own, more)?) {
                let part = more as f32 / all as f32;
                self.light[i] = std::array::from_fn(|k| self.light[i][k] + part * (new[k] - self.light[i][k]));
                self.noise[i] *= 2f64.powf(-0.5 * power * f64::from(doubled)) as f32;
                self.rays[i] = all;
            }
        }
        Ok(())
    }
}

/// Gather rays and shadow rays that are planned for a texel within a deadline (in a furnished office at 2 % texels have 158 and 161 in the mean
/// without one, and these are 128 and 256); and those of the further points of one texel together.
pub(crate) fn usual_rays(error: f64) -> [usize; 2] {
    [1, 2].map(|times| times * gather_rays(error))
}

/// Lights the texels of a page that lie at stations. Where they are `thinned`, each has that part of the usual rays, and none more.
///
/// # Errors
/// [`Error::Stopped`].
pub(crate) fn light(
    baked: &Baked,
    sheet: Sheet,
    at: &[Station],
    (gathers, thinned): (bool, f64),
    monitor: &dyn Monitor,
) -> Result<TexelLight, Error> {
    let (solution, error) = (&baked.solution, baked.error);
    let places: Vec<Place> = at.iter().map(|station| station.place).collect();
    let of = |own: &[usize]| -> Vec<Place> { own.iter().map(|i| places[*i]).collect() };
    let pooled = |found: &Found| sheet.atlas.pooled(sheet.page, sheet.texels, &found.light, &found.noise, &found.rays);

    let shadowing = |rays: usize| Shadowing { places: 1, rays: rays as u32 };
    let shared = |rays: usize| -> Result<(Option<Found>, Vec<Pooled>), Error> {
        if !gathers {
            let told = |s: &Station| baked.field.at(s.place.triangle as usize, s.uv, s.side);
            let alone = |s: &Station| Pooled { light: told(s), own: 1.0, noise: 0.0, spread: 0.0 };
            return Ok((None, at.iter().map(alone).collect()));
        }
        let halves = solution.halves_at(&places, rays, 0, monitor)?;
        let gathered = Found::of_halves(sheet, halves.into_iter(), rays as u32);
        let indirect = pooled(&gathered);
        Ok((Some(gathered), indirect))
    };
    if thinned < 1.0 {
        let [gather, shadow] = usual_rays(error).map(|rays| thin(rays, thinned));
        let direct = solution.direct_at(&places, &shadowing(shadow), monitor)?;
        return Ok(TexelLight { direct, indirect: shared(gather)?.1 });
    }

    let first = gather_rays(error).min(FIRST_GATHERED);
    let shadow = rays_for(error, FIRST_SHADOW, LEAST_SHADOW, MOST_SHADOW);
    let half = |salt| solution.direct_by(&places, &shadowing(shadow / 2), salt, monitor);
    let halves = half(1)?.into_iter().zip(half(2)?).map(|(a, b)| [a, b]);
    let mut direct = Found::of_halves(sheet, halves, shadow as u32);
    let (mut gathered, mut indirect) = shared(first)?;
    let area = sheet.atlas.areas(sheet.texels);
    let mean = root_mean_square(solution);
    let ceiling =
        |(d, p): (&Bands, &Pooled)| VISIBLE * error * f64::from(luminance(*d) + luminance(p.light)).max(DARK * mean);
    let ceilings: Vec<f64> = direct.light.iter().zip(&indirect).map(ceiling).collect();
    // What is planned within a deadline are the usual rays, and no more are sent.
    let [most_gathered, most_shadow] = usual_rays(error).map(|rays| pace::left(monitor).map(|_| rays as f64));
    let mut times = growth(&direct.noise, &area, &ceilings, DIRECT_NOISE * error * mean, DIRECT_POWER);
    curb(&mut times, most_shadow.map(|most| most / shadow as f64));
    direct.grow((&times, DIRECT_POWER), |own, rays| {
        solution.direct_by(&of(own), &shadowing(rays as usize), 3, monitor)
    })?;
    if let Some(gathered) = &mut gathered {
        let spread: Vec<f32> = indirect.iter().map(|p| p.spread).collect();
        let mut times = growth(&spread, &area, &ceilings, GATHERED_NOISE * error * mean, GATHERED_POWER);
        curb(&mut times, most_gathered.map(|most| most / first as f64));
        gathered.grow((&times, GATHERED_POWER), |own, rays| {
            let halves = solution.halves_at(&of(own), rays as usize, 1, monitor)?;
            Ok(halves.into_iter().map(|[a, b]| std::array::from_fn(|k| 0.5 * (a[k] + b[k]))).collect())
        })?;
        indirect = pooled(gathered);
    }
    Ok(TexelLight { direct: direct.light, indirect })
}

/// Lets rays grow to so many times as many in the mean at most, and nowhere to more than 2^[`MOST_DOUBLINGS`].
fn curb(times: &mut [f64], most: Option<f64>) {
    times.iter_mut().for_each(|t| *t = t.min(f64::from(1 << MOST_DOUBLINGS)));
    let mean = times.iter().sum::<f64>() / times.len().max(1) as f64;
    let Some(most) = most.filter(|most| mean > *most) else { return };
    let part = (most - 1.0).max(0.0) / (mean - 1.0);
    times.iter_mut().for_each(|t| *t = 1.0 + part * (*t - 1.0));
}

/// How many times as many rays each texel is to have, so that the root mean square of `noise` over `area` becomes `target`, lx, with the
/// fewest rays, and that of none is more than its ceiling, lx.
fn growth(noise: &[f32], area: &[f64], ceilings: &[f64], target: f64, power: f64) -> Vec<f64> {
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

    /// Texels of all sizes, most of them quiet.
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

    #[test]
    fn quiet_maps_grow_only_where_noise_is_seen() {
        let (noise, area) = some();
        let ceilings: Vec<f64> = (0..noise.len()).map(|i| if i % 2 == 0 { 1.0 } else { f64::INFINITY }).collect();
        let times = growth(&noise, &area, &ceilings, 100.0, 1.0);
        for (i, times) in times.iter().enumerate() {
            let is_seen = i % 2 == 0 && noise[i] > 1.0;
            assert!(if is_seen { (f64::from(noise[i]).powi(2) - times).abs() < 1e-3 } else { *times == 1.0 });
        }
        // What a deadline allows is shared by those that grow.
        let mut curbed = times.clone();
        curb(&mut curbed, Some(1.2));
        let mean = curbed.iter().sum::<f64>() / curbed.len() as f64;
        assert!((mean - 1.2).abs() < 1e-9 && curbed.iter().zip(&times).all(|(c, t)| *c >= 1.0 && c <= t), "{mean}");
        // In the dark nothing is asked for.
        let dark = growth(&[0.0; 3], &[1.0; 3], &[0.0; 3], 0.0, 1.0);
        assert_eq!(dark, [1.0; 3]);
    }
}
