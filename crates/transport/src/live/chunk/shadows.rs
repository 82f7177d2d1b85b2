//! Shadow rays of a chunk: which came through, and what they bring.

use super::super::body::{Bounds, Site};
use super::dirt::Dirt;
use super::{Chunk, NEAR_SHADOWS, Part, Work};
use glam::DVec3;
use radiosity_scene::Bands;

/// Light of one column.
#[derive(Clone, Debug, Default)]
pub struct Shadows {
    /// Shadow rays so far.
    pub rays: u32,
    /// Which of them came through, by element.
    pub clear: Vec<u64>,
    /// What they bring, lux per band, by element.
    pub light: Vec<Bands>,
    /// Whether only the first of them are in that.
    pub is_rough: Vec<bool>,
}

impl Shadows {
    /// The share of the shadow rays of an element that came through.
    pub fn clear_share(&self, e: usize) -> f32 {
        self.clear[e].count_ones() as f32 / self.rays.max(1) as f32
    }
}

impl Chunk {
    /// Adds up the light of a column anew, whose strengths have changed.
    pub fn add_up(&mut self, work: &Work, column: usize) {
        let body = &work.world.bodies[self.body];
        if !body.is_present {
            return;
        }
        for e in 0..self.len {
            let (site, seed) = self.site(work.world, e);
            let shadows = &self.shadows[column];
            let (n, clear) = (shadows.rays, shadows.clear[e]);
            self.shadows[column].light[e] = bring(work, column, (&site, seed), n, clear);
            self.shadows[column].is_rough[e] = false;
        }
    }

    /// Traces the shadow rays to a column that changes have dirtied.
    pub(super) fn mend_shadows(&mut self, work: &Work, part: Part, dirt: &Dirt, column: usize) -> u64 {
        let known = self.shadows[column].rays;
        let light = &work.columns[column];
        if known == 0 || light.is_empty() {
            return 0;
        }
        let range = match part {
            Part::Near => 0..known.min(NEAR_SHADOWS),
            Part::Far => NEAR_SHADOWS.min(known)..known,
        };
        let (world, margin) = (work.world, work.world.margin());
        // What the first part has made rough the rest makes whole, though nothing of its own is dirty: an object that went away and
        // came back was elsewhere meanwhile, for the first part only.
        let is_rough = |e: usize| part == Part::Far && self.shadows[column].is_rough[e];
        let is_near = |region: &(Bounds, (DVec3, f64))| light.may_meet(self.ball, region);
        if !dirt.before.iter().chain(&dirt.now).any(is_near) && !(0..self.len).any(is_rough) {
            return 0;
        }
        let all = ((1u128 << range.end) - (1u128 << range.start)) as u64;
        let mut rays = 0;
        for e in 0..self.len {
            let (site, seed) = self.site(world, e);
            let is_rough = part == Part::Far && self.shadows[column].is_rough[e];
            let mut clear = self.shadows[column].clear[e];
            let is_near = |region: &(Bounds, (DVec3, f64))| light.may_meet((site.centre, site.radius), region);
            let may_change = light.may_reach(&site)
                && (clear & all != all && dirt.before.iter().any(is_near)
                    || clear & all != 0 && dirt.now.iter().any(is_near));
            if !may_change && !is_rough {
                continue;
            }
            let sequence = light.sequence(seed);
            for index in range.clone().filter(|_| may_change) {
                let Some(sample) = light.sample(world, &site, (seed, &sequence), index) else { continue };
                let bit = 1u64 << index;
                let (origin, direction) = (sample.ray.origin.as_dvec3(), sample.ray.direction.as_dvec3());
                let meets = |(bounds, _): &(Bounds, (DVec3, f64))| {
                    bounds.may_meet(origin, direction, f64::from(sample.ray.t_max), margin)
                };
                if clear & bit == 0 {
                    if dirt.before.iter().any(meets) {
                        rays += 1;
                        if !world.blocked(&sample.ray, sample.salt) {
                            clear |= bit;
                        }
                    }
                } else if dirt.now.iter().any(meets) {
                    rays += 1;
                    if dirt.bodies.iter().any(|dirty| world.blocked_by(dirty.body, &sample.ray, sample.salt)) {
                        clear &= !bit;
                    }
                }
            }
            let own = &mut self.shadows[column];
            if std::mem::replace(&mut own.clear[e], clear) == clear && !is_rough {
                continue;
            }
            own.is_rough[e] = part == Part::Near && known > NEAR_SHADOWS;
            let n = if own.is_rough[e] { NEAR_SHADOWS } else { known };
            own.light[e] = bring(work, column, (&site, seed), n, clear);
        }
        rays
    }

    pub(super) fn trace_shadows(&mut self, work: &Work, column: usize, target: u32) -> u64 {
        let (world, light) = (work.world, &work.columns[column]);
        let from = std::mem::replace(&mut self.shadows[column].rays, target);
        if light.is_empty() {
            return 0;
        }
        let mut rays = 0;
        for e in 0..self.len {
            let (site, seed) = self.site(world, e);
            let sequence = light.sequence(seed);
            let mut clear = self.shadows[column].clear[e];
            let mut sum = [0f64; 3];
            for index in from..target {
                if let Some(sample) = light.sample(world, &site, (seed, &sequence), index) {
                    rays += 1;
                    if !world.blocked(&sample.ray, sample.salt) {
                        clear |= 1 << index;
                        (0..3).for_each(|band| sum[band] += sample.light[band]);
                    }
                }
            }
            self.shadows[column].clear[e] = clear;
            // The same sum by `bring` would draw all samples once more.
            let is_first = from == 0;
            self.shadows[column].light[e] =
                if is_first { mean(sum, target) } else { bring(work, column, (&site, seed), target, clear) };
            self.shadows[column].is_rough[e] = false;
        }
        rays
    }
}

/// What the first `n` shadow rays bring, given which are clear.
fn bring(work: &Work, column: usize, (site, seed): (&Site, u32), n: u32, clear: u64) -> Bands {
    let light = &work.columns[column];
    let sequence = light.sequence(seed);
    let mut sum = [0f64; 3];
    for index in (0..n).filter(|index| clear >> index & 1 == 1) {
        if let Some(sample) = light.sample(work.world, site, (seed, &sequence), index) {
            (0..3).for_each(|band| sum[band] += sample.light[band]);
        }
    }
    mean(sum, n)
}

fn mean(sum: [f64; 3], n: u32) -> Bands {
    sum.map(|s| (s / f64::from(n.max(1))) as f32)
}
