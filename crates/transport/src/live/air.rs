//! Light at points in the air. A point has a row and shadow rays as an element has, of its own, which begin at it and are
//! not kept: H = Σ D + F Y with what surfaces give off, Y, as it is.

use super::body::Site;
use super::chunk::{ROWS, Target, shoot};
use super::{Column, Lanes, Live, Spot};
use glam::DVec3;
use radiosity_scene::{Bands, luminance};
use radiosity_trace::sampling::{Sequence, frame, hash};

/// Places around one another that are looked from before others are taken to see as much of a lamp: half of eight, as of two the line through
/// them may be the edge of a shadow.
const PILOTS: usize = 4;

/// Parts of rays that are told apart for their error.
const EIGHTHS: usize = 8;

/// What arrives at a point.
#[derive(Clone, Debug)]
pub struct Arrival {
    /// What each ray finds, by id.
    pub found: Vec<u32>,
    /// What each column brings directly, lux per band: by the first half of its rays and by the second.
    pub direct: Vec<[[f64; 3]; 2]>,
}

impl Arrival {
    /// What each ray counts, the mean of both halves being the light: [`Live::receive`].
    pub fn shares(&self) -> impl Iterator<Item = (u32, f64)> {
        let halves = shares(self.found.len() as u32);
        let half = self.found.len().div_ceil(2);
        self.found.iter().enumerate().map(move |(m, id)| (*id, 0.5 * halves[usize::from(m >= half)]))
    }

    /// Irradiance by the halves of its rays. `given` is what surfaces give off, by id; columns are multiplied by `factors`.
    pub fn halves(&self, given: &[Lanes<4>], factors: impl Iterator<Item = Bands>) -> [Bands; 2] {
        let mut halves = [[0f64; 3]; 2];
        let first = self.found.len().div_ceil(2);
        for (m, (id, share)) in self.shares().enumerate() {
            let (half, given) = (usize::from(m >= first), given[id as usize].0);
            (0..3).for_each(|band| halves[half][band] += 2.0 * share * f64::from(given[band]));
        }
        for (direct, factor) in self.direct.iter().zip(factors) {
            for (half, direct) in halves.iter_mut().zip(direct) {
                (0..3).for_each(|band| half[band] += direct[band] * f64::from(factor[band]));
            }
        }
        halves.map(|half| half.map(|x| x as f32))
    }

    /// One standard error of illuminance, lx: for rays of one point alone. Half the difference of two halves is often next to nothing by chance; so
    /// what halves, quarters and eighths of the rays differ by counts as well, as if error fell with the root of their number. It falls
    /// faster, and what is told is too much by a third or so.
    pub fn error(&self, given: &[Lanes<4>], factors: impl Iterator<Item = Bands>) -> f32 {
        let n = self.found.len();
        let mut parts = [[0f64; 2]; EIGHTHS];
        for (m, id) in self.found.iter().enumerate() {
            let [r, g, b, _] = given[*id as usize].0;
            let part = &mut parts[m * EIGHTHS / n];
            *part = [part[0] + f64::from(luminance([r, g, b])), part[1] + 1.0];
        }
        let (mut square, mut count) = (0.0, 0.0);
        for width in [EIGHTHS / 2, EIGHTHS / 4, EIGHTHS / 8] {
            for pair in parts.chunks(2 * width) {
                let [a, b] = [&pair[..width], &pair[width..]].map(|half| {
                    let [sum, rays] = half.iter().fold([0.0; 2], |all, part| [all[0] + part[0], all[1] + part[1]]);
                    (rays > 0.0).then(|| sum / rays)
                });
                if let (Some(a), Some(b)) = (a, b) {
                    square += (0.5 * (a - b)).powi(2) * pair.len() as f64 / EIGHTHS as f64;
                    count += 1.0;
                }
            }
        }
        // Each column has its own shadow rays.
        let direct = self.direct.iter().zip(factors).map(|(halves, factor)| {
            let [a, b] =
                halves.map(|half| f64::from(luminance(std::array::from_fn(|band| half[band] as f32 * factor[band]))));
            (0.5 * (a - b)).powi(2)
        });
        (square / f64::max(count, 1.0) + direct.sum::<f64>()).sqrt() as f32
    }
}

impl Live {
    /// Irradiance at a point of the world with a unit normal, lux per band: once by the first half of its rays and once by the
    /// second. The mean of both is the light; half their difference is one standard error of it, or more, as they complement each
    /// other. `given` is what surfaces give off, by id; columns are multiplied and added up.
    pub fn receive(
        &self,
        place: (DVec3, DVec3),
        given: &[Lanes<4>],
        columns: &[(usize, Bands)],
        target: Target,
    ) -> [Bands; 2] {
        assert_eq!(given.len(), self.ids());
        let arrival = self.arrive(place, columns.iter().map(|(column, _)| *column), target);
        arrival.halves(given, columns.iter().map(|(_, factor)| *factor))
    }

    /// What arrives at a point of the world with a unit normal, straight from the lamps of some columns and from what its rays find.
    pub fn arrive(
        &self,
        (point, normal): (DVec3, DVec3),
        columns: impl Iterator<Item = usize>,
        target: Target,
    ) -> Arrival {
        assert!(target.rays >= 2 && target.shadows >= 2, "each half has rays: {target:?}");
        let world = &self.world;
        let site = Site::in_the_air(point - world.middle, normal);
        // From the position, so that a point's answer does not depend on what else is asked.
        let seed = point.to_array().iter().fold(0x0a1f_b0d5, |seed, x| {
            let bits = x.to_bits();
            hash(seed ^ bits as u32 ^ (bits >> 32) as u32)
        });
        let (sequence, frame) = (Sequence::new(seed, ROWS), frame(normal));
        let look = |m| {
            let (ray, direction, salt) = shoot(world, &site, (&sequence, seed), &frame, m);
            world.id(world.first(&ray, salt), direction)
        };
        let found = (0..target.rays).map(look).collect();
        let direct = columns.map(|column| self.direct(&self.columns[column], &site, seed, target.shadows));
        Arrival { found, direct: direct.collect() }
    }

    /// Whether a column has one lamp, and that without area: each shadow ray from a point finds the same.
    pub fn is_certain(&self, column: usize) -> bool {
        !self.columns[column].is_empty() && self.columns[column].is_certain()
    }

    /// The cosine at which the lamp of a column shines on a point of the world with a unit normal, from the middle of it where it has area; 0 from behind.
    pub fn cosine_from(&self, column: usize, (point, normal): (DVec3, DVec3)) -> f64 {
        self.columns[column].cosine(&Site::in_the_air(point - self.world.middle, normal))
    }

    /// Whether a column is one lamp's alone.
    pub fn is_of_one(&self, column: usize) -> bool {
        !self.columns[column].is_empty() && self.columns[column].strength.len() == 1
    }

    /// Spots of a column's lamp, as many in all, for [`Live::receive_around`]; one without area has none.
    pub fn spots(&self, column: usize, count: usize) -> Vec<Spot> {
        self.columns[column].spots(&self.world, count)
    }

    /// What a column brings straight to places of the world around one another, on the mean, lux per band, and how many of the spots of a
    /// lamp with area they see; each is a point with a unit normal. They share the spots out among themselves, each with those it has as if all light
    /// came from them: from the same spots, neighbours differ by what stands between them and these, and by no noise. Nearby, where one would
    /// see that the lamp is made of spots, each place draws its own, as shadow rays do. Where the first few places have either all of
    /// theirs in sight or none, so have the others.
    pub fn receive_around(&self, column: usize, places: &[(DVec3, DVec3)], spots: &[Spot]) -> (Bands, usize) {
        let column = &self.columns[column];
        let site = |(point, normal): (DVec3, DVec3)| Site::in_the_air(point - self.world.middle, normal);
        let mut sum = [0f64; 3];
        let mut add = |light: [f64; 3]| (0..3).for_each(|band| sum[band] += light[band] / places.len() as f64);
        if column.is_certain() {
            places.iter().for_each(|place| add(self.direct(column, &site(*place), 0, 1)[0]));
            return (sum.map(|x| x as f32), 0);
        }
        let (draws, share) = (column.draws(0), (spots.len() / places.len().max(1)).max(1));
        let is_near = places.first().is_some_and(|(point, _)| {
            let point = *point - self.world.middle;
            spots.iter().any(|spot| spot.is_near(point))
        });
        let (mut seen, mut hidden) = (0, 0);
        for (k, (place, own)) in places.iter().zip(spots.chunks(share)).enumerate() {
            // Of fewer that face them nothing follows.
            let is_known = k >= PILOTS && seen + hidden >= share;
            if is_known && seen == 0 {
                break;
            }
            let (site, is_clear) = (site(*place), is_known && hidden == 0);
            for spot in own {
                let sample = if is_near {
                    column.sample(&self.world, &site, &draws, spot.index)
                } else {
                    spot.seen_from(&self.world, &site.place(0.0, 0.0))
                };
                let Some(sample) = sample else { continue };
                if !is_clear && self.world.blocked(&sample.ray, sample.salt) {
                    hidden += 1;
                } else {
                    seen += 1;
                    add(sample.light.map(|light| light / own.len() as f64));
                }
            }
        }
        (sum.map(|x| x as f32), seen)
    }

    /// What a column brings straight to a place, by the halves of its rays.
    fn direct(&self, column: &Column, site: &Site, seed: u32, rays: u32) -> [[f64; 3]; 2] {
        let mut halves = [[0f64; 3]; 2];
        if column.is_empty() {
            return halves;
        }
        let world = &self.world;
        let draws = column.draws(seed);
        // Each ray to one light without area is the same.
        let rays = if column.is_certain() { 1 } else { rays };
        let shares = shares(rays);
        for index in 0..rays {
            let Some(sample) = column.sample(world, site, &draws, index) else { continue };
            if world.blocked(&sample.ray, sample.salt) {
                continue;
            }
            if rays == 1 {
                halves.iter_mut().for_each(|half| (0..3).for_each(|band| half[band] += sample.light[band]));
            } else {
                let half = usize::from(2 * index >= rays);
                (0..3).for_each(|band| halves[half][band] += shares[half] * sample.light[band]);
            }
        }
        halves
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

    /// Below a bright panel off to one side, points are off by about what is told, or less, and no point tells next to nothing.
    #[test]
    fn no_point_knows_its_light_too_well() {
        let mut scene = Scene::default();
        scene.materials.extend([Material::default(), Material { emissive: [1000.0; 3], ..Material::default() }]);
        let square = [[-1., -1., 0.], [1., -1., 0.], [1., 1., 0.], [-1., 1., 0.]].map(DVec3::from);
        scene.add_quad("panel", 0, [0, 3, 2, 1].map(|k| square[k] + DVec3::new(2.0, 0.0, 2.0)));
        let live = Live::new(Arc::new(scene), 4.0, Target { rays: 4, shadows: 4 });
        let bright: Vec<Lanes<4>> = (0..live.ids())
            .map(|id| Lanes([if live.world().bodies[0].has(id as u32) { 1000.0 } else { 0.0 }; 4]))
            .collect();
        let at = |k: u32, rays: u32| {
            let point = DVec3::new(0.01 * f64::from(k), 0.013 * f64::from(k % 7), 0.0);
            let arrival = live.arrive((point, DVec3::Z), std::iter::empty(), Target { rays, shadows: 2 });
            let [a, b] = arrival.halves(&bright, std::iter::empty()).map(|half| f64::from(half[1]));
            (0.5 * (a + b), 0.5 * (a - b).abs(), f64::from(arrival.error(&bright, std::iter::empty())))
        };
        let (mut off, mut told, mut least, mut least_by_halves) = (0.0, 0.0, f64::INFINITY, f64::INFINITY);
        const POINTS: u32 = 100;
        for k in 0..POINTS {
            let ((light, by_halves, error), (truth, ..)) = (at(k, 1024), at(k, 1 << 17));
            off += (light - truth).powi(2) / f64::from(POINTS);
            told += error.powi(2) / f64::from(POINTS);
            (least, least_by_halves) = (least.min(error), least_by_halves.min(by_halves));
        }
        let (off, told) = (off.sqrt(), told.sqrt());
        assert!((1.0..3.0).contains(&(told / off)), "{told} {off}");
        assert!(least > 0.2 * told && least_by_halves < 0.05 * told, "{least} {least_by_halves} {told}");
    }

    /// From some way off the spots of a lamp are the lamp: a square of side 2a at height h gives a point below its middle
    /// E = 4 M/π · (a/√(a² + h²)) · atan(a/√(a² + h²)) (Howell, configuration factor B-4 four times), and one of which half is hidden half of that; and
    /// nearby, where the spots would be seen, they are drawn anew.
    #[test]
    fn spots_of_a_lamp_are_the_lamp() {
        let mut scene = Scene::default();
        scene.materials.extend([Material::default(), Material { emissive: [1000.0; 3], ..Material::default() }]);
        let square = [[-1., -1., 0.], [1., -1., 0.], [1., 1., 0.], [-1., 1., 0.]].map(DVec3::from);
        scene.add_quad("lamp", 1, [0, 3, 2, 1].map(|k| square[k] + 3.0 * DVec3::Z));
        scene.add_quad("sheet", 0, square.map(|corner| 4.0 * corner + DVec3::new(40.0, 0.0, 1.0)));
        let mut live = Live::new(Arc::new(scene), 1.0, Target { rays: 4, shadows: 4 });
        let column = live.add_column(1, &[Lamp::Body(0)]);
        assert!(live.is_of_one(column) && !live.is_certain(column));
        let spots = live.spots(column, 256);
        assert_eq!(spots.len(), 256);
        let exact = |h: f64| {
            let c = 1.0 / (1.0 + h * h).sqrt();
            4000.0 * c * c.atan()
        };
        for height in [0.2, 1.0, 3.0, 10.0] {
            let (found, _) = live.receive_around(column, &[(DVec3::Z * (3.0 - height), DVec3::Z)], &spots);
            assert!((f64::from(found[1]) / exact(height) - 1.0).abs() < 0.01, "{height}: {found:?}");
        }
        // The sheet's edge is above the point, from x = 0 on.
        live.place(1, glam::DAffine3::from_translation(DVec3::new(-36.0, 0.0, 0.0)));
        let (half, seen) = live.receive_around(column, &[(DVec3::ZERO, DVec3::Z)], &spots);
        assert!((f64::from(half[1]) / exact(3.0) - 0.5).abs() < 0.01 && seen == 128, "{half:?} of {seen}");

        // Eight places share the spots; those that need not look find what they would.
        let around = |middle: DVec3| {
            [[-3., -9.], [3., 9.], [9., -3.], [-9., 3.], [-8., -2.], [8., 2.], [2., -8.], [-2., 8.]]
                .map(|[x, y]| (middle + DVec3::new(x, y, 0.0) / 160.0, DVec3::Z))
        };
        for (x, seen) in [(-1.0, 256..=256), (0.0, 100..=156), (0.4, 1..=99), (3.0, 0..=0)] {
            let places = around(DVec3::X * x);
            let found = live.receive_around(column, &places, &spots);
            let one_by_one = places.iter().zip(spots.chunks(32));
            let mean =
                one_by_one.map(|(place, own)| live.receive_around(column, &[*place], own).0[1] / 8.0).sum::<f32>();
            assert!((found.0[1] - mean).abs() <= 1e-4 * mean && seen.contains(&found.1), "{x}: {found:?}, {mean}");
        }
        // Nearby light is as exact, shared out among places; just beyond, each has few spots of its own, 35 cm apart.
        live.remove(1);
        for (height, most) in [(0.05, 0.02), (0.1, 0.02), (0.2, 0.02), (0.3, 0.04), (0.6, 0.01)] {
            let (found, _) = live.receive_around(column, &around(DVec3::Z * (3.0 - height)), &spots);
            assert!((f64::from(found[1]) / exact(height) - 1.0).abs() < most, "{height}: {found:?}");
        }
    }
}
