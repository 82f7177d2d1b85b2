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
        let shares = shares(target.rays);
        for m in 0..target.rays {
            let (ray, direction, salt) = shoot(world, &site, (&sequence, seed), &frame, m);
            let found = given[world.id(world.first(&ray, salt), direction) as usize].0;
            let half = usize::from(2 * m >= target.rays);
            (0..3).for_each(|band| halves[half][band] += shares[half] * f64::from(found[band]));
        }
        for (column, factor) in columns {
            let column = &self.columns[*column];
            if column.is_empty() {
                continue;
            }
            let sequence = column.sequence(seed);
            // Each ray to one light without area is the same.
            let rays = if column.is_certain() { 1 } else { target.shadows };
            let shares = self::shares(rays);
            for index in 0..rays {
                let Some(sample) = column.sample(world, &site, (seed, &sequence), index) else { continue };
                if world.blocked(&sample.ray, sample.salt) {
                    continue;
                }
                let brings = |band: usize| sample.light[band] * f64::from(factor[band]);
                if rays == 1 {
                    halves.iter_mut().for_each(|half| (0..3).for_each(|band| half[band] += brings(band)));
                } else {
                    let half = usize::from(2 * index >= rays);
                    (0..3).for_each(|band| halves[half][band] += shares[half] * brings(band));
                }
            }
        }
        halves.map(|half| half.map(|x| x as f32))
    }
}

/// What a ray counts in the first half of so many and in the second, which has one ray less if they are odd.
fn shares(rays: u32) -> [f64; 2] {
    [rays.div_ceil(2), rays / 2].map(|half| 1.0 / f64::from(half))
}

#[cfg(test)]
mod tests {
    use super::super::Lamp;
    use super::*;
    use radiosity_scene::{Material, Scene};
    use std::sync::Arc;

    /// However many rays there are, each half of them tells the same where all of them do: below a lamp that is far away and small,
    /// E = L A/d², and where all that is seen gives off the same.
    #[test]
    fn halves_of_odd_rays_are_both_right() {
        let mut scene = Scene::default();
        scene.materials.extend([Material::default(), Material { emissive: [1000.0; 3], ..Material::default() }]);
        let square = [[-1., -1., 0.], [1., -1., 0.], [1., 1., 0.], [-1., 1., 0.]].map(DVec3::from);
        scene.add_quad("floor", 0, square);
        scene.add_quad("lamp", 1, [0, 3, 2, 1].map(|k| 0.01 * square[k] + 2.0 * DVec3::Z));
        let mut live = Live::new(Arc::new(scene), 1.0, Target { rays: 4, shadows: 4 });
        let column = live.add_column(1, &[Lamp::Body(1)]);
        let (dark, even) = (vec![Lanes::default(); live.ids()], vec![Lanes([70.0; 4]); live.ids()]);
        for n in 2..9 {
            let target = Target { rays: n, shadows: n };
            let receive = |given: &[_], columns: &[_]| live.receive((DVec3::Z, DVec3::Z), given, columns, target);
            for half in receive(&dark, &[(column, [1.0; 3])]) {
                assert!((half[1] / (1000.0 * 4e-4) - 1.0).abs() < 1e-3, "{n}: {half:?}");
            }
            for half in receive(&even, &[]) {
                assert!((half[1] / 70.0 - 1.0).abs() < 1e-6, "{n}: {half:?}");
            }
        }
    }
}
