//! Light at points in the air. A point has a row and shadow rays as an element has, of its own, which begin at it and are
//! not kept: H = Σ D + F Y with what surfaces give off, Y, as it is.

use super::body::Site;
use super::chunk::{ROWS, Target, shoot};
use super::{Lanes, Live};
use glam::DVec3;
use radiosity_scene::Bands;
use radiosity_trace::sampling::{Sequence, frame, hash};

impl Live {
    /// Irradiance at a point of the world with a unit normal, lux per band: once by the first half of its rays and once by the
    /// second. The mean of both is the light; half their difference is one standard error of it, or more, as they complement each
    /// other. `given` is what surfaces give off, by id; columns are multiplied and added up.
    pub fn receive(
        &self,
        (point, normal): (DVec3, DVec3),
        given: &[Lanes<4>],
        columns: &[(usize, Bands)],
        target: Target,
    ) -> [Bands; 2] {
        assert_eq!(given.len(), self.ids());
        assert!(target.rays >= 2 && target.shadows >= 2, "each half has rays: {target:?}");
        let world = &self.world;
        let site = Site::in_the_air(point - world.middle, normal);
        // From the position, so that a point's answer does not depend on what else is asked.
        let seed = point.to_array().iter().fold(0x0a1f_b0d5, |seed, x| {
            let bits = x.to_bits();
            hash(seed ^ bits as u32 ^ (bits >> 32) as u32)
        });
        let mut halves = [[0f64; 3]; 2];
        let (sequence, frame) = (Sequence::new(seed, ROWS), frame(normal));
        let share = 2.0 / f64::from(target.rays);
        for m in 0..target.rays {
            let (ray, direction, salt) = shoot(world, &site, (&sequence, seed), &frame, m);
            let found = given[world.id(world.first(&ray, salt), direction) as usize].0;
            let half = &mut halves[usize::from(2 * m >= target.rays)];
            (0..3).for_each(|band| half[band] += share * f64::from(found[band]));
        }
        for (column, factor) in columns {
            let column = &self.columns[*column];
            if column.is_empty() {
                continue;
            }
            let sequence = column.sequence(seed);
            // Each ray to one light without area is the same.
            let rays = if column.is_certain() { 1 } else { target.shadows };
            let share = 2.0 / f64::from(rays);
            for index in 0..rays {
                let Some(sample) = column.sample(world, &site, (seed, &sequence), index) else { continue };
                if world.blocked(&sample.ray, sample.salt) {
                    continue;
                }
                let brings = |band: usize| sample.light[band] * f64::from(factor[band]);
                if rays == 1 {
                    halves.iter_mut().for_each(|half| (0..3).for_each(|band| half[band] += brings(band)));
                } else {
                    let half = &mut halves[usize::from(2 * index >= rays)];
                    (0..3).for_each(|band| half[band] += share * brings(band));
                }
            }
        }
        halves.map(|half| half.map(|x| x as f32))
    }
}
