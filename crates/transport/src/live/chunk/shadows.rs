//! Shadow rays of a chunk: which came through, and what they bring.

use super::super::body::Bounds;
use super::dirt::Dirt;
use super::{Chunk, NEAR_SHADOWS, Part, Work, ones};
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
    /// Adds up the light of a column anew where its strengths have changed or other rays count; a bit for each element.
    pub fn add_up(&mut self, work: &Work, column: usize, elements: u64) {
        if !work.world.bodies[self.body].is_present || work.columns[column].is_empty() {
            return;
        }
        for e in (0..self.len).filter(|e| elements >> e & 1 == 1) {
            self.bring(work, column, e, self.shadows[column].rays);
            self.shadows[column].is_rough[e] = false;
        }
    }

    /// Adds up what the first `n` shadow rays of an element bring.
    fn bring(&mut self, work: &Work, column: usize, e: usize, n: u32) {
        let (site, seed) = self.site(work.world, e);
        let (light, shadows) = (&work.columns[column], &self.shadows[column]);
        let (draws, counting) = (light.draws(seed), self.counting(e, n));
        let mut sum = [0f64; 3];
        for index in ones(counting & shadows.clear[e]) {
            if let Some(sample) = light.sample(work.world, &site, &draws, index) {
                (0..3).for_each(|band| sum[band] += sample.light[band]);
            }
        }
        self.shadows[column].light[e] = mean(sum, counting);
    }

    /// Which of the first `n` shadow rays of an element count; where none does, so few are not enough to choose from.
    fn counting(&self, e: usize, n: u32) -> u64 {
        let all = ((1u128 << n) - 1) as u64;
        match all & self.kept[e * self.words] {
            0 => all,
            kept => kept,
        }
    }

    /// Traces the shadow rays to a column that changes have dirtied. Other rays than before count for elements whose bit is set in
    /// `replaced`.
    pub(super) fn mend_shadows(
        &mut self,
        work: &Work,
        part: Part,
        (dirt, replaced): (&Dirt, u64),
        column: usize,
    ) -> u64 {
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
        if !dirt.before.iter().chain(&dirt.now).any(is_near) && !(0..self.len).any(is_rough) && replaced == 0 {
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
            let is_replaced = replaced >> e & 1 == 1;
            if !may_change && !is_rough && !is_replaced {
                continue;
            }
            let draws = light.draws(seed);
            for index in range.clone().filter(|_| may_change) {
                let Some(sample) = light.sample(world, &site, &draws, index) else { continue };
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
            let has_changed = std::mem::replace(&mut own.clear[e], clear) != clear;
            if !has_changed && !is_rough && !is_replaced {
                continue;
            }
            // What only counts otherwise is known of all of them.
            own.is_rough[e] = part == Part::Near && known > NEAR_SHADOWS && (has_changed || own.is_rough[e]);
            let n = if own.is_rough[e] { NEAR_SHADOWS } else { known };
            self.bring(work, column, e, n);
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
            let draws = light.draws(seed);
            let mut clear = self.shadows[column].clear[e];
            let counting = self.counting(e, target);
            let mut sum = [0f64; 3];
            for index in from..target {
                if let Some(sample) = light.sample(world, &site, &draws, index) {
                    rays += 1;
                    if !world.blocked(&sample.ray, sample.salt) {
                        clear |= 1 << index;
                        if counting >> index & 1 == 1 {
                            (0..3).for_each(|band| sum[band] += sample.light[band]);
                        }
                    }
                }
            }
            self.shadows[column].clear[e] = clear;
            if from == 0 {
                // The same sum by `bring` would draw all samples once more.
                self.shadows[column].light[e] = mean(sum, counting);
            } else {
                self.bring(work, column, e, target);
            }
            self.shadows[column].is_rough[e] = false;
        }
        rays
    }
}

/// Of rays for each of which a bit is set.
fn mean(sum: [f64; 3], counting: u64) -> Bands {
    sum.map(|s| (s / f64::from(counting.count_ones().max(1))) as f32)
}
