//! Light of points and of elements: a few rays for each, then more for those whose first ones disagree ([`crate::allocation`]). All
//! that were sent count, until another solution takes the place of the one that they looked up.

use crate::allocation::{DIRECT_POWER, Found, GATHERED_POWER, Lit, curb, growth};
use crate::answer::Places;
use crate::{Error, Monitor, Solution};
use glam::DVec3;
use radiosity_scene::{Bands, Side, luminance};
use radiosity_trace::Place;
use radiosity_transport::{Receivers, Shadowing};
use radiosity_view::{FLAT, Finding, Planes, Pooled};
use std::time::Instant;

/// Gather rays and shadow rays of a receiver to begin with.
pub(crate) type Rays = [usize; 2];

/// Root mean square noise over all points, lx, in what is gathered and in direct light.
type Noise = [f64; 2];

/// p of either kind.
const POWERS: [f64; 2] = [GATHERED_POWER, DIRECT_POWER];

/// Noise of a point relative to its own light at most, over the noise that is asked, relative to the mean; and the part of the mean below which light
/// counts as if it was as much. In a furnished office at 1 % one place in a hundred is 14 % off so, and 16 % without; with 3 instead of 5 it is
/// 11 %, with 0.05 instead of 0.1 as well, and either takes a third more time.
const VISIBLE: f64 = 5.0;
const DARK: f64 = 0.1;

/// Of the noise that there was more than this is left where more rays bring nothing: rays are doubled or not, and where most receivers need
/// a little more, those of a few would be doubled again and again (in the Cornell box for eleven steps and 20 s more, which took 2 % of the noise).
const WORTH: f64 = 0.97;

/// Two halves of a point say little of its noise: as much as those of points with about as much light, this many on either side.
const ALIKE: usize = 32;

/// What is off in all after sharing over its noise, in squares: planes are laid so wide that what they have wrong is half as much.
const UNTOLD: f64 = 1.5;

/// Whose light is asked for.
pub(crate) trait Asked {
    /// Whether direct light is shared on planes as what is gathered is. It pays where receivers lie close to each other.
    const SHARES_DIRECT: bool;

    /// Noise of any of them relative to its own light at most, over the noise that is asked, relative to the mean.
    const MOST_NOISE: f64;

    /// How many.
    fn len(&self) -> usize;

    /// By how much one of them counts.
    fn weight(&self, i: usize) -> f64;

    /// Where one of them lies on a side of a triangle, if it shares with others of that plane.
    fn on(&self, solution: &Solution, i: usize) -> Option<(DVec3, usize, Side)>;

    /// Planes on which they share.
    fn planes(&self, solution: &Solution) -> Planes;

    /// Some of them as receivers; each salt has rays of its own.
    type Some<'s>: Receivers
    where
        Self: 's;
    fn some<'s>(&'s self, solution: &Solution, own: &'s [usize], salt: u32) -> Self::Some<'s>;

    /// So many shadow rays of a receiver, by its places.
    fn shadowing(rays: usize) -> Shadowing;
}

/// Points.
impl Asked for &[Place] {
    const SHARES_DIRECT: bool = false;
    const MOST_NOISE: f64 = VISIBLE;

    fn len(&self) -> usize {
        <[Place]>::len(self)
    }

    fn weight(&self, _i: usize) -> f64 {
        1.0
    }

    fn on(&self, solution: &Solution, i: usize) -> Option<(DVec3, usize, Side)> {
        let place = &self[i];
        Some((place.point, place.triangle as usize, side_of(solution, place)?))
    }

    fn planes(&self, solution: &Solution) -> Planes {
        Planes::new(solution.tracer().mesh, &solution.elements)
    }

    type Some<'s>
        = Places
    where
        Self: 's;
    fn some<'s>(&'s self, solution: &Solution, own: &'s [usize], salt: u32) -> Places {
        solution.places(own.iter().map(|i| self[*i]).collect(), salt)
    }

    fn shadowing(rays: usize) -> Shadowing {
        shadowing(rays)
    }
}

/// Light of receivers, and what it was found with.
pub(crate) struct Light<A> {
    asked: A,
    /// Where each lies on a plane, if it shares there with others.
    on: Vec<Option<(DVec3, usize, Side)>>,
    planes: Option<Planes>,
    direct: Found,
    gathered: Found,
    /// Both, shared.
    lit: Vec<Pooled>,
    pooled: Vec<Pooled>,
    /// Numbers of sets of rays that were sent.
    sets: u32,
    /// Seconds that all rays that count have taken.
    pub seconds: f64,
}

impl<A: Asked> Light<A> {
    /// With the first rays.
    pub fn new(solution: &Solution, asked: A, rays: Rays, monitor: &dyn Monitor) -> Result<Light<A>, Error> {
        let on: Vec<_> = (0..asked.len()).map(|i| asked.on(solution, i)).collect();
        // Nothing is shared in the open: planes of a million triangles would take 360 MB and four seconds.
        let planes = on.iter().any(Option::is_some).then(|| asked.planes(solution));
        let (direct, gathered, lit, pooled) = Default::default();
        let mut light = Light { asked, on, planes, direct, gathered, lit, pooled, sets: 0, seconds: 0.0 };
        light.begin(solution, rays, monitor)?;
        Ok(light)
    }

    /// Begins anew with another solution: what it leaves to direct light may be something else.
    pub fn begin(&mut self, solution: &Solution, [gather, shadow]: Rays, monitor: &dyn Monitor) -> Result<(), Error> {
        let began = Instant::now();
        let all: Vec<usize> = (0..self.asked.len()).collect();
        let (shadowing, set) = (A::shadowing(shadow / 2), self.sets + 1);
        let halves = solution.direct_halves_of(&self.asked.some(solution, &all, set), &shadowing, monitor)?;
        self.direct = Found::of_halves(&halves, shadow as u32, evened);
        self.sets += 3;
        let halves = solution.halves_of(&self.asked.some(solution, &all, self.sets), gather, monitor)?;
        self.gathered = Found::of_halves(&halves, gather as u32, evened);
        self.share();
        self.seconds = began.elapsed().as_secs_f64();
        Ok(())
    }

    /// Sends more gather rays, from all alike, so that no more `noise` is left in all, lx, or until each has `most`. Before that a few
    /// tell too little of who is noisy, but enough of what is left when all have shared.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub fn raise(&mut self, solution: &Solution, noise: f64, most: usize, monitor: &dyn Monitor) -> Result<(), Error> {
        let began = Instant::now();
        let [of_gathered, of_direct] = self.noise_by_kind();
        let [had, _] = self.rays();
        // Direct light may take half of it.
        let allowed = noise.powi(2) - of_direct.powi(2).min(0.5 * noise.powi(2));
        let wanted = (had as f64 * UNTOLD * of_gathered.powi(2) / allowed).min(most as f64) as usize;
        let more = wanted.next_power_of_two().min(most).saturating_sub(had);
        self.seconds += began.elapsed().as_secs_f64();
        if more == 0 { Ok(()) } else { self.add(solution, more, monitor) }
    }

    /// Sends so many more gather rays, from all alike.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub fn add(&mut self, solution: &Solution, more: usize, monitor: &dyn Monitor) -> Result<(), Error> {
        let began = Instant::now();
        self.sets += 1;
        let all: Vec<usize> = (0..self.asked.len()).collect();
        let halves = solution.halves_of(&self.asked.some(solution, &all, self.sets), more, monitor)?;
        self.gathered.join(Found::of_halves(&halves, more as u32, evened));
        self.share();
        self.seconds += began.elapsed().as_secs_f64();
        Ok(())
    }

    /// Gather rays of those that have fewest.
    pub fn fewest(&self) -> usize {
        self.gathered.rays.iter().copied().min().unwrap_or(0) as usize
    }

    /// Sends more rays, so that no more `noise` is left in all, lx; up to `most` times as many as there are, if that is said. Whether
    /// that brought anything.
    pub fn grow(
        &mut self,
        solution: &Solution,
        noise: f64,
        most: Option<f64>,
        monitor: &dyn Monitor,
    ) -> Result<bool, Error> {
        let (began, before) = (Instant::now(), self.noise());
        let [of_gathered, of_direct] = split(self.noise_by_kind(), self.rays(), noise);
        self.sets += 1;
        let (asked, set) = (&self.asked, self.sets);
        let weights: Vec<f64> = (0..asked.len()).map(|i| asked.weight(i)).collect();
        let light: Vec<f64> = self.irradiance().iter().map(|e| f64::from(luminance(*e))).collect();
        let average = self.mean(|i| light[i]);
        let ceilings: Vec<f64> = light.iter().map(|e| A::MOST_NOISE * noise * (e / average).max(DARK)).collect();
        let [for_gathered, for_direct] = POWERS;
        let spread = |pooled: &[Pooled]| -> Vec<f32> { pooled.iter().map(|p| p.spread).collect() };
        let mut times = growth(&spread(&self.lit), &weights, &ceilings, of_direct, for_direct);
        curb(&mut times, &self.direct.rays, most);
        let more_direct = self.direct.grow((&times, for_direct), |own, rays| {
            solution.direct_of(&asked.some(solution, own, set), &A::shadowing(rays as usize), monitor)
        })?;
        let mut times = growth(&spread(&self.pooled), &weights, &ceilings, of_gathered, for_gathered);
        curb(&mut times, &self.gathered.rays, most);
        let more_gathered = self.gathered.grow((&times, for_gathered), |own, rays| {
            Ok(Lit::of_halves(&solution.halves_of(&asked.some(solution, own, set), rays as usize, monitor)?))
        })?;
        self.share();
        self.seconds += began.elapsed().as_secs_f64();
        Ok((more_direct || more_gathered) && self.noise() < WORTH * before)
    }

    /// Has receivers on a plane share what they found, as far as it is smooth.
    fn share(&mut self) {
        self.lit =
            if A::SHARES_DIRECT { unless_dark(&self.direct, self.shared(&self.direct)) } else { alone(&self.direct) };
        self.pooled = self.shared(&self.gathered);
    }

    fn shared(&self, found: &Found) -> Vec<Pooled> {
        let mut pooled = alone(found);
        let Some(planes) = &self.planes else { return pooled };
        let finding = |i: usize| {
            let (point, triangle, side) = self.on[i]?;
            // Noisier ones have more rays, so that all weigh about the same.
            Some((i, Finding { point, triangle, side, light: found.light[i], noise: found.noise[i], weight: 1.0 }))
        };
        let (own, findings): (Vec<usize>, Vec<Finding>) = (0..self.on.len()).filter_map(finding).unzip();
        own.into_iter().zip(planes.pooled(&findings)).for_each(|(i, shared)| pooled[i] = shared);
        pooled
    }

    /// Irradiance, lx per band.
    pub fn irradiance(&self) -> Vec<Bands> {
        // What paths find beyond what they look up may be less than nothing.
        let all = |(d, p): (&Pooled, &Pooled)| std::array::from_fn(|k| (d.light[k] + p.light[k]).max(0.0));
        self.lit.iter().zip(&self.pooled).map(all).collect()
    }

    /// Mean over all by their weights.
    fn mean(&self, of: impl Fn(usize) -> f64) -> f64 {
        let weights = || (0..self.asked.len()).map(|i| (i, self.asked.weight(i)));
        let total: f64 = weights().map(|(_, weight)| weight).sum();
        weights().map(|(i, weight)| weight * of(i)).sum::<f64>() / total.max(f64::MIN_POSITIVE)
    }

    /// Those whose light it is.
    pub fn asked(&self) -> &A {
        &self.asked
    }

    /// Root mean square illuminance, lx.
    pub fn size(&self) -> f64 {
        let light = self.irradiance();
        self.mean(|i| f64::from(luminance(light[i])).powi(2)).sqrt()
    }

    /// The noise that is left.
    fn noise_by_kind(&self) -> Noise {
        [&self.pooled, &self.lit].map(|pooled| self.mean(|i| f64::from(pooled[i].spread).powi(2)).sqrt())
    }

    /// The same in all, lx.
    pub fn noise(&self) -> f64 {
        let [gathered, direct] = self.noise_by_kind();
        gathered.hypot(direct)
    }

    /// Gather rays and shadow rays of a receiver, on average.
    pub fn rays(&self) -> Rays {
        [&self.gathered, &self.direct].map(|found| {
            let all: usize = found.rays.iter().map(|rays| *rays as usize).sum();
            all.div_ceil(found.rays.len().max(1))
        })
    }
}

/// Shared direct light, but where it is known it stays as it is, and where no ray found any there is none: what is shared from beyond an edge of shadow, however little, would
/// be all that a dark room has.
pub(crate) fn unless_dark(found: &Found, shared: Vec<Pooled>) -> Vec<Pooled> {
    let own = found.light.iter().zip(&found.noise);
    let of = |((light, noise), shared): ((&Bands, &f32), Pooled)| match *noise > 0.0 && luminance(*light) > 0.0 {
        true => shared,
        false => Pooled::alone(*light, *noise),
    };
    own.zip(shared).map(of).collect()
}

/// What each found by itself.
fn alone(found: &Found) -> Vec<Pooled> {
    found.light.iter().zip(&found.noise).map(|(light, noise)| Pooled::alone(*light, *noise)).collect()
}

/// Seconds of a shadow ray over those of a gather ray with what follows it, about: in the Cornell box and in a furnished office.
const SHADOW_RAY: f64 = 0.33;

/// What noise of either kind is to become, lx, so that both together are as asked with the least work, where rays are as many now as
/// they are. By Lagrange's multiplier: another second takes as much from the variance of either.
fn split(now: Noise, rays: Rays, asked: f64) -> Noise {
    let costs = [1.0, SHADOW_RAY];
    let variances = |price: f64| -> Noise {
        std::array::from_fn(|k| {
            let (variance, n, p) = (now[k].powi(2), rays[k] as f64, POWERS[k]);
            let wanted = (p * variance * n.powf(p) / (costs[k] * price)).powf(1.0 / (1.0 + p));
            variance * (n / wanted.max(n)).powf(p)
        })
    };
    let all = |price: f64| variances(price).iter().sum::<f64>();
    // In logarithms, as prices may be of any size.
    let (mut low, mut high) = (f64::MIN_POSITIVE.ln(), f64::MAX.ln());
    for _ in 0..64 {
        let middle = 0.5 * (low + high);
        if all(middle.exp()) > asked.powi(2) { high = middle } else { low = middle }
    }
    variances(low.exp()).map(f64::sqrt)
}

/// That many shadow rays at a point.
pub(crate) fn shadowing(rays: usize) -> Shadowing {
    Shadowing { places: 1, rays: rays as u32 }
}

/// The side of a triangle that a place lies on and receives like; none in the open, and where it has a normal of its own.
fn side_of(solution: &Solution, place: &Place) -> Option<Side> {
    let mesh = solution.tracer().mesh;
    let triangle = place.triangle as usize;
    let cosine = (triangle < mesh.triangles.len()).then(|| mesh.normal(triangle).dot(place.normal))?;
    (cosine.abs() > FLAT).then_some(if cosine > 0.0 { Side::Front } else { Side::Back })
}

/// Standard errors of receivers whose halves are `apart` from their mean, lx, unless that is no number: each one's own and those of
/// others that are about as bright count the same.
pub(crate) fn evened(light: &[Bands], apart: &[f32]) -> Vec<f32> {
    let mut order: Vec<usize> = (0..light.len()).filter(|i| apart[*i].is_finite()).collect();
    order.sort_by(|&i, &j| luminance(light[i]).total_cmp(&luminance(light[j])));
    let square = |i: usize| f64::from(apart[i]).powi(2);
    let mut sums = vec![0.0];
    order.iter().for_each(|&i| sums.push(sums[sums.len() - 1] + square(i)));
    let mut noise = vec![f32::NAN; light.len()];
    for (rank, &i) in order.iter().enumerate() {
        let (low, high) = (rank.saturating_sub(ALIKE), (rank + ALIKE + 1).min(order.len()));
        let of_alike = (sums[high] - sums[low]) / (high - low) as f64;
        noise[i] = (0.5 * (square(i) + of_alike)).sqrt() as f32;
    }
    noise
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_scene::Mesh;
    use radiosity_trace::Tracer;

    /// Any other share of the work that leaves as much noise costs more.
    #[test]
    fn noise_is_split_where_both_together_cost_least() {
        let work = |now: Noise, rays: Rays, left: Noise| -> f64 {
            let times = |k: usize| (now[k] / left[k]).powf(2.0 / POWERS[k]);
            rays[0] as f64 * times(0) + SHADOW_RAY * rays[1] as f64 * times(1)
        };
        for (now, rays, asked) in
            [([3.0, 2.0], [256, 128], 1.0), ([1.0, 9.0], [64, 512], 0.3), ([5.0, 0.1], [256, 128], 0.5)]
        {
            let left = split(now, rays, asked);
            assert!((left[0].hypot(left[1]) / asked - 1.0).abs() < 1e-6, "{left:?} for {asked}");
            let best = work(now, rays, left);
            for k in 1..40 {
                let (sin, cos) = (std::f64::consts::FRAC_PI_2 * f64::from(k) / 40.0).sin_cos();
                let other = [asked * sin, asked * cos];
                let is_reached = other[0] <= now[0] && other[1] <= now[1];
                assert!(!is_reached || work(now, rays, other) > 0.999 * best, "{other:?} before {left:?}");
            }
        }
        // What is quiet is left alone, and so are points without any noise.
        assert_eq!(split([1.0, 2.0], [64, 64], 9.0), [1.0, 2.0]);
        assert_eq!(split([0.0; 2], [64, 64], 0.0), [0.0; 2]);
    }

    /// Noise is as told, more rays bring it to what is asked, and light has no bias.
    #[test]
    fn more_rays_leave_the_noise_that_is_asked() {
        let scene = crate::cornell_box();
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let solve = crate::SolveOptions { looked_up: true, cells: 500, rays: 16, ..Default::default() };
        let solution = Solution::new(&tracer, &solve, &()).unwrap();
        let places: Vec<Place> = crate::stations::spread(&solution, 400, 5).iter().map(|s| s.place).collect();
        let truth = Light::new(&solution, &places[..], [8192, 8192], &()).unwrap().irradiance();
        let off = |points: &Light<&[Place]>| {
            let pairs = points.irradiance().into_iter().zip(&truth);
            let off: Vec<f64> = pairs.map(|(e, t)| f64::from(luminance(e) - luminance(*t))).collect();
            let n = off.len() as f64;
            ((off.iter().map(|x| x * x).sum::<f64>() / n).sqrt(), off.iter().sum::<f64>() / n)
        };
        // All alike at first, as many as are needed and no more than are allowed.
        let mut points = Light::new(&solution, &places[..], [64, 1024], &()).unwrap();
        let (before, enough) = (off(&points).0, 2.0 * points.noise());
        points.raise(&solution, enough, 512, &()).unwrap();
        assert_eq!(points.rays()[0], 64);
        let asked = 0.6 * points.noise();
        points.raise(&solution, asked, 512, &()).unwrap();
        let ((after, bias), rays) = (off(&points), points.rays()[0]);
        assert!(
            (128..=512).contains(&rays) && after < 0.8 * before && bias.abs() < 0.3 * after,
            "{rays} {after} {bias}"
        );
        assert!((0.5..2.0).contains(&(points.noise() / after)), "{} {after}", points.noise());
        points.raise(&solution, 0.0, 1024, &()).unwrap();
        assert!(points.rays()[0] == 1024 && off(&points).0 < after);
        let mut points = Light::new(&solution, &places[..], [64, 64], &()).unwrap();
        let (before, _) = off(&points);
        assert!(points.noise() > 0.5 * before && points.noise() < 2.0 * before, "{} {before}", points.noise());
        let asked = 0.3 * points.noise();
        while points.noise() > 1.1 * asked && points.grow(&solution, asked, None, &()).unwrap() {}
        let (after, bias) = off(&points);
        assert!((0.7..1.2).contains(&(points.noise() / asked)), "{} {asked}", points.noise());
        assert!(after < 0.6 * before && bias.abs() < 0.2 * after, "{before} {after} {bias}");
        assert!(points.rays()[0] > 64 && points.rays()[0] < 64 * 64, "{:?}", points.rays());
    }
}
