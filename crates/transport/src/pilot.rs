//! Light that comes from few directions, through a window or from a patch of sun: rays are sent again to where it was found.
//!
//! In a room with a window one cosine ray in a hundred gets out, and a hundred of them do not tell how much sky there is.
//! But they tell where to look: the unit square that cosine rays are drawn from is cut into cells, and new rays are drawn
//! by how much light the first ones brought from each cell and the cells around it, those of receivers beside it and those of a whole group
//! that faces the same way. Some go everywhere all the same, and each weighs the inverse of its density, so the mean is right whatever
//! the first rays missed (importance sampling by a pilot; Kahn and Marshall 1953). Where light comes from all around, the first rays
//! count themselves; with new ones as well as long as there are too few to be sure of it.
//!
//! Rays that agree are believed, which is biased: of a speck of the hemisphere p that N rays of a group that all may see it
//! miss with probability (1 − p)^N, that part is lost, in the mean of the group at most 1/(e N) of the brightest there is. It has to be less than a
//! hundredth of what receivers nearby found, whatever others have. With any 512 rays, 7 lx of a sky of 10,000, a room of 15 lx behind a window a hand wide was
//! 3.4 % too dark, with stains of up to 40 %; by groups it is right within 0.3 %, and a picture of it 1.4 instead of 4.6 % off.

use crate::one_light::luminance_of;
use crate::receivers::Site;
use glam::DVec3;
use radiosity_scene::Bands;
use radiosity_trace::sampling::Sequence;
use std::ops::Range;

/// Most cells along each side of the square.
const MOST_CELLS: usize = 32;

/// Receivers that face the same way up to so many numbers away look for each other first. They are elements or texels side by
/// side, most often, and see a window in the same cells or the next.
const NEIGHBOURS: usize = 4;

/// Steps of a coordinate of normals from 0 to 1. What faces elsewhere would look for light where it is not.
const NORMALS: f64 = 16.0;

/// Shares of the new rays that go everywhere alike, and where the whole group found light; the others go where neighbours did. Of 384 places on a table behind a
/// window a hand wide, 64 rays each, the noise is 26 % so and 28 % with all for the group; 36 % with 0.375 for it, 31 % if a tenth goes everywhere then; 34 % with 0.3 and 0.4.
///
/// First rays that count beside the new ones, by the balance heuristic and a density that does not know what their own half found, leave more noise than those that are
/// thrown away (of 256 rays 8 instead of 6 %): where few rays met the window, each has nobody else that tells of it.
const EVEN: f64 = 0.25;
const OF_GROUP: f64 = 0.5;

/// Where (Σ light)² is this part of rays · Σ light², as if an even light came from that part of the hemisphere, the first
/// rays are good enough. The choice looks at these rays, which biases receivers right at the limit, by less than half of
/// their own standard error.
const OPEN: f64 = 0.1;

/// What the rays of a group may have missed is little where it is less than this part of what those nearby found.
const TRUSTED: f64 = 0.01;

/// Light of rays that is less than this part of what is known beside it, wherever it comes from, needs no others.
const LITTLE: f64 = 0.25;

/// Where rays of a group found nothing at all, so many are believed: a few millionths of the brightest may be there.
const SURE: u32 = 1 << 17;

/// The stream of sample points that the new rays use.
pub(crate) const AGAIN: u32 = 0x0180;

/// Where a receiver faces, about.
pub(crate) type Facing = [i8; 4];

/// What the first rays of some receivers brought, by cells of the unit square that they were drawn from.
#[derive(Default)]
pub(crate) struct Pilot {
    receivers: Vec<Receiver>,
    side: usize,
    /// Most luminance that a ray may bring.
    peak: f64,
    /// Cells that rays were drawn from, and the light they brought: those of one receiver after the other.
    found: Vec<(u16, f32)>,
    /// The group that was asked for last, its sums, and its density over cells, once that was needed.
    group: Range<usize>,
    of_group: Sums,
    of_all: Vec<f64>,
    /// Running sums of a density over cells: of rows, and of the cells in each row; each ends at 1.
    rows: Vec<f64>,
    cells: Vec<f64>,
}

/// What the first rays of one receiver brought.
#[derive(Clone, Default)]
struct Receiver {
    /// Where it faces: receivers that share it draw about the same directions from the same cells.
    facing: Option<Facing>,
    rays: u32,
    halves: [[f64; 3]; 2],
    /// What is known beside that.
    known: [[f64; 3]; 2],
    sums: Sums,
    /// Its part of what was found.
    found: Range<usize>,
}

/// Of the light of rays.
#[derive(Clone, Copy, Default)]
struct Sums {
    rays: u32,
    light: f64,
    square: f64,
    /// What is known beside that of rays.
    known: f64,
}

impl Sums {
    fn of(receivers: &[Receiver]) -> Sums {
        receivers.iter().fold(Sums::default(), |sum, own| Sums {
            rays: sum.rays + own.rays,
            light: sum.light + own.sums.light,
            square: sum.square + own.sums.square,
            known: sum.known + own.sums.known,
        })
    }

    /// (Σ light)² less the part that is asked for: 0 or more where light is even.
    fn margin(&self) -> f64 {
        self.light * self.light - OPEN * f64::from(self.rays) * self.square
    }

    fn is_even(&self) -> bool {
        self.light > 0.0 && self.margin() >= 0.0
    }

    /// Whether it still were if any number of the rays had met the brightest there is, `peak`: whoever sends more rays
    /// only then has no other answer on average.
    fn stays_even(&self, peak: f64) -> bool {
        let lack = OPEN * f64::from(self.rays) * peak - 2.0 * self.light;
        self.is_even() && (lack <= 0.0 || lack * lack <= 4.0 * self.margin())
    }

    /// Mean light of a ray, and what is known beside it.
    fn level(&self) -> f64 {
        (self.light + self.known) / f64::from(self.rays)
    }
}

impl Pilot {
    /// Makes ready for some receivers, of up to `most_rays` rays each that bring up to `peak`, and forgets all others.
    pub fn begin(&mut self, receivers: usize, most_rays: u32, peak: f64) {
        self.peak = peak;
        self.side = 1;
        // A ray to a cell.
        while self.side < MOST_CELLS && 4 * self.side * self.side <= receivers * most_rays as usize {
            self.side *= 2;
        }
        self.found.clear();
        self.group = 0..0;
        self.receivers.clear();
        self.receivers.resize(receivers, Receiver::default());
    }

    /// Where receiver k lies, after all before it, and how many rays it sends.
    pub fn place(&mut self, k: usize, site: &Site, rays: u32) {
        let found = self.found.len()..self.found.len();
        self.receivers[k] = Receiver { facing: Some(facing(site.normal)), rays, found, ..Receiver::default() };
    }

    /// How many receiver k sends.
    pub fn rays(&self, k: usize) -> u32 {
        self.receivers[k].rays
    }

    /// A ray of a half of receiver k, the last one that was placed, drawn from (u, v), brought light. What brings none need not be told.
    pub fn add(&mut self, k: usize, half: usize, [u, v]: [f32; 2], arriving: [f64; 3]) {
        let own = &mut self.receivers[k];
        (0..3).for_each(|band| own.halves[half][band] += arriving[band]);
        let light = luminance_of(arriving);
        own.sums.light += light;
        own.sums.square += light * light;
        let cell = |x: f32| ((x * self.side as f32) as usize).min(self.side - 1);
        if light > 0.0 {
            self.found.push(((cell(v) * self.side + cell(u)) as u16, light as f32));
        }
        own.found.end = self.found.len();
    }

    /// What light receiver k, the last one that was placed, has in either half of what its rays are not told of: the mean over its hemisphere.
    pub fn know(&mut self, k: usize, halves: [[f64; 3]; 2]) {
        let own = &mut self.receivers[k];
        own.known = halves;
        own.sums.known = 0.5 * f64::from(own.rays) * halves.map(luminance_of).iter().sum::<f64>();
    }

    /// Whether the first rays of all receivers are believed.
    pub fn is_clear(&mut self) -> bool {
        (0..self.receivers.len()).all(|k| self.receivers[k].facing.is_none() || self.is_believed(k))
    }

    /// Whether the first rays of receiver k are believed: where they come from all around, and what rays of the whole group may have missed is little beside what
    /// those nearby found.
    fn is_believed(&mut self, k: usize) -> bool {
        if !self.group.contains(&k) {
            self.make_group(k);
        }
        let (near, rays) = (Sums::of(&self.receivers[self.near(k)]), f64::from(self.of_group.rays));
        if near.stays_even(self.peak) {
            return true;
        }
        let missed = self.peak / (std::f64::consts::E * rays);
        let is_little = missed <= TRUSTED * near.level();
        if self.of_group.light <= 0.0 {
            return is_little || self.of_group.rays >= SURE;
        }
        (self.is_even(k) || near.light < LITTLE * near.known) && is_little
    }

    /// Whether rays of receiver k, those nearby and those of the group found light all around.
    fn is_even(&self, k: usize) -> bool {
        Sums::of(&self.receivers[self.near(k)]).is_even() && self.of_group.is_even()
    }

    /// The mean light over the hemisphere of receiver k, by the two halves of its rays, those of new ones, or both. New ones
    /// take the points of a sequence, as many as there were rays. `arriving` is asked for the light of
    /// point (u, v, x, y), u and v drawn by the density.
    pub fn mean(
        &mut self,
        k: usize,
        sequence: &Sequence,
        mut arriving: impl FnMut(u32, [f32; 4]) -> [f64; 3],
    ) -> [Bands; 2] {
        let own = &self.receivers[k];
        let (half_rays, halves) = (own.rays / 2, own.halves);
        if own.facing.is_none() {
            return Default::default();
        }
        let known = own.known;
        let with = |half: usize, mean: [f64; 3]| std::array::from_fn(|band| (mean[band] + known[half][band]) as f32);
        let first = halves.map(|sum| sum.map(|s| s / f64::from(half_rays)));
        if self.is_believed(k) {
            return [0, 1].map(|half| with(half, first[half]));
        }
        let is_even = self.is_even(k);
        self.make_density(k);
        [0u32, 1].map(|half| {
            let mut sum = [0f64; 3];
            for index in half * half_rays..(half + 1) * half_rays {
                let [u, v, x, y] = sequence.point(index);
                let (u, v, density) = self.draw(u, v);
                let light = arriving(index, [u, v, x, y]);
                (0..3).for_each(|band| sum[band] += light[band] / density);
            }
            // The first rays of a light that is even tell as much as these.
            let again = sum.map(|s| s / f64::from(half_rays));
            let part = if is_even { 0.5 } else { 0.0 };
            let half = half as usize;
            with(half, std::array::from_fn(|band| part * first[half][band] + (1.0 - part) * again[band]))
        })
    }

    /// Takes receivers before and after k that face its way together.
    fn make_group(&mut self, k: usize) {
        let facing = self.receivers[k].facing;
        let is_other = |own: &Receiver| own.facing != facing;
        let start = self.receivers[..k].iter().rposition(is_other).map_or(0, |last| last + 1);
        let end = self.receivers[k..].iter().position(is_other).map_or(self.receivers.len(), |next| k + next);
        self.group = start..end;
        self.of_group = Sums::of(&self.receivers[start..end]);
        self.of_all.clear();
    }

    /// By the light of each cell and the eight around it that some receivers found; nothing where they found none.
    fn density_of(&self, receivers: Range<usize>) -> Vec<f64> {
        let side = self.side;
        let mut cells = vec![0.0; side * side];
        let of = |k: usize| self.receivers[k].found.clone();
        for (cell, light) in &self.found[of(receivers.start).start..of(receivers.end - 1).end] {
            cells[usize::from(*cell)] += f64::from(*light);
        }
        spread(&mut cells, side, 1);
        spread(&mut cells, side, side);
        let total: f64 = cells.iter().sum();
        if total > 0.0 {
            cells.iter_mut().for_each(|cell| *cell /= total);
        }
        cells
    }

    /// The density over cells for receiver k: what it and its neighbours found, what the group did, and a part that is even.
    fn make_density(&mut self, k: usize) {
        if self.of_all.is_empty() {
            self.of_all = self.density_of(self.group.clone());
        }
        let near = self.density_of(self.near(k));
        let even = 1.0 / near.len() as f64;
        self.cells.clear();
        let known = |near: f64, of_group: f64| (1.0 - EVEN - OF_GROUP) * near + OF_GROUP * of_group;
        self.cells.extend(near.iter().zip(&self.of_all).map(|(near, of_group)| EVEN * even + known(*near, *of_group)));
        self.rows.clear();
        let mut reached = 0.0;
        for row in self.cells.chunks_exact_mut(self.side) {
            let mut own = 0.0;
            for cell in row.iter_mut() {
                own += *cell;
                *cell = own;
            }
            row.iter_mut().for_each(|cell| *cell /= own);
            reached += own;
            self.rows.push(reached);
        }
        self.rows.iter_mut().for_each(|row| *row /= reached);
    }

    /// Receivers of the group near number k, itself among them.
    fn near(&self, k: usize) -> Range<usize> {
        k.saturating_sub(NEIGHBOURS).max(self.group.start)..(k + NEIGHBOURS + 1).min(self.group.end)
    }

    /// Maps a point of the unit square to one drawn by the density, which is answered with it.
    fn draw(&self, u: f32, v: f32) -> (f32, f32, f64) {
        let (j, v, of_rows) = invert(&self.rows, f64::from(v));
        let (i, u, of_cells) = invert(&self.cells[j * self.side..][..self.side], f64::from(u));
        let place = |k: usize, within: f64| (((k as f64 + within) / self.side as f64) as f32).min(1.0 - f32::EPSILON);
        (place(i, u), place(j, v), of_rows * of_cells)
    }
}

/// A normal to within four degrees, about as wide as a cell, and on which side of a jump of its frame it lies.
pub(crate) fn facing(normal: DVec3) -> Facing {
    let [x, y, z] = normal.to_array().map(|x| (NORMALS * x).round() as i8);
    [x, y, z, normal.z.is_sign_negative().into()]
}

/// Adds to each cell the two beside it, along rows (`step` 1) or across them (`step` = `side`).
fn spread(cells: &mut [f64], side: usize, step: usize) {
    for line in 0..side {
        let start = line * if step == 1 { side } else { 1 };
        let mut before = 0.0;
        for k in 0..side {
            let at = start + k * step;
            let (own, after) = (cells[at], if k + 1 < side { cells[at + step] } else { 0.0 });
            cells[at] = before + own + after;
            before = own;
        }
    }
}

/// The step of a running sum that x falls into, where within the step, and the step's density relative to an even one.
fn invert(running: &[f64], x: f64) -> (usize, f64, f64) {
    let k = running.partition_point(|end| *end <= x).min(running.len() - 1);
    let start = if k == 0 { 0.0 } else { running[k - 1] };
    let share = running[k] - start;
    (k, ((x - start) / share).clamp(0.0, 1.0), share * running.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_trace::sampling::hash;

    /// Even light is taken as it is only where nothing that a ray may bring could make it uneven.
    #[test]
    fn only_what_must_be_even_is_taken_as_it_is() {
        for (peak, again) in [(4.0, 0), (10.0, 0), (1000.0, 64)] {
            let mut pilot = Pilot::default();
            pilot.begin(1, 64, peak);
            pilot.receivers[0] = Receiver { facing: Some(facing(DVec3::Z)), rays: 64, ..Receiver::default() };
            let sequence = Sequence::new(3, 1);
            for index in 0..64 {
                pilot.add(0, usize::from(index >= 32), sequence.pair(index), [1.0; 3]);
            }
            let mut asked = 0;
            let halves = pilot.mean(0, &Sequence::new(3, 2), |_, _| {
                asked += 1;
                [1.0; 3]
            });
            assert_eq!(asked, again, "{peak}");
            assert!(halves.iter().flatten().all(|e| (e - 1.0).abs() < 0.2), "{halves:?}");
        }
    }

    /// What the first rays of many receivers bring from a part of the square that is bright, one ray in five hundred, and from the rest; and that each finds in the end.
    fn group(levels: &[f64], rays: u32, seed: u32, [dim, bright, known]: [f64; 3]) -> (Pilot, Vec<f64>) {
        let light = |k: usize, u: f32, v: f32| {
            let inside = (0.3..0.34).contains(&u) && (0.6..0.65).contains(&v);
            [if levels[k] == dim && inside { bright } else { levels[k] }; 3]
        };
        let mut pilot = Pilot::default();
        pilot.begin(levels.len(), rays, bright);
        for k in 0..levels.len() {
            let own = Receiver { facing: Some(facing(DVec3::Z)), rays, ..Receiver::default() };
            pilot.receivers[k] = Receiver { found: pilot.found.len()..pilot.found.len(), ..own };
            pilot.know(k, [[known; 3]; 2]);
            let sequence = Sequence::new(hash(seed ^ k as u32), 1);
            for index in 0..rays {
                let [u, v] = sequence.pair(index);
                pilot.add(k, usize::from(index >= rays / 2), [u, v], light(k, u, v));
            }
        }
        let mean = |k: usize| {
            let sequence = Sequence::new(hash(seed ^ k as u32), 2);
            let [a, b] = pilot.mean(k, &sequence, |_, [u, v, ..]| light(k, u, v));
            0.5 * f64::from(a[1] + b[1])
        };
        let found = (0..levels.len()).map(mean).collect();
        (pilot, found)
    }

    /// Of 256 receivers none of which meets with its few rays what is bright more than now and then, each finds it by what all found: the squared error is less than a twentieth of
    /// that of first rays, and the mean is right.
    #[test]
    fn a_group_finds_what_its_receivers_miss() {
        let exact = 0.5 + (1000.0 - 0.5) * 0.04 * 0.05;
        for (rays, bound) in [(32, 0.06), (64, 0.03)] {
            let (mut pilot, found) = group(&[0.5; 256], rays, 0, [0.5, 1000.0, 0.0]);
            assert!(!pilot.is_clear());
            let square = |of: &dyn Fn(usize) -> f64| (0..256).map(|k| (of(k) - exact).powi(2)).sum::<f64>();
            let first = square(&|k| pilot.receivers[k].sums.light / f64::from(rays));
            let off = square(&|k| found[k]);
            assert!(off < 0.05 * first, "{rays}: {off} {first}");
            // Of 200 seeds the standard deviation is 1.3 and 0.7 %, and none is more than 4.1 and 2.1 % off.
            let mean = found.iter().sum::<f64>() / 256.0;
            assert!((mean / exact - 1.0).abs() < bound, "{rays}: {mean} for {exact}");
        }
    }

    /// A dim room behind a wall shares a group with a bright one. That its own rays and those nearby met nothing bright is not believed, however sure the
    /// bright ones are of theirs: the mean of its light over two hundred seeds is right within four standard errors.
    #[test]
    fn bright_receivers_do_not_vouch_for_dim_ones() {
        let levels: Vec<f64> = (0..100).map(|k| if k < 90 { 500.0 } else { 4.0 }).collect();
        let exact = 4.0 + (2000.0 - 4.0) * 0.04 * 0.05;
        let means: Vec<f64> = (0..200)
            .map(|seed| group(&levels, 64, hash(seed), [4.0, 2000.0, 0.0]).1[90..].iter().sum::<f64>() / 10.0)
            .collect();
        let mean = means.iter().sum::<f64>() / 200.0;
        let error = (means.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 200.0 / 199.0).sqrt();
        assert!(error < 0.05 * exact, "{error}");
        assert!((mean - exact).abs() < 4.0 * error, "{mean} for {exact} ± {error}");
    }

    /// What is known does not vouch for rays that found little: a few of them miss what is bright, and the mean over two thousand seeds is right within four standard errors.
    /// Many are believed, as they are.
    #[test]
    fn known_light_does_not_vouch_for_few_rays() {
        let exact = 40.0 + 5000.0 * 0.04 * 0.05;
        // One of them has a little light, which is not even among all.
        let levels: Vec<f64> = (0..19).map(|k| if k == 18 { 0.5 } else { 0.0 }).collect();
        let of = |seed| group(&levels, 8, hash(seed), [0.0, 5000.0, 40.0]).1[..18].iter().sum::<f64>() / 18.0;
        let means: Vec<f64> = (0..2000).map(of).collect();
        let mean = means.iter().sum::<f64>() / 2000.0;
        let error = (means.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 2000.0 / 1999.0).sqrt();
        assert!(error < 0.02 * exact && (mean - exact).abs() < 4.0 * error, "{mean} for {exact} ± {error}");
        assert!(group(&[4.0; 256], 64, 0, [4.0, 200.0, 40.0]).0.is_clear());
        assert!(!group(&[4.0; 256], 64, 0, [4.0, 200.0, 0.0]).0.is_clear());
    }

    /// Even light of enough rays is believed, though a ray may bring forty times as much: none are sent again.
    #[test]
    fn enough_rays_are_believed() {
        let (mut pilot, found) = group(&[50.0; 256], 32, 1, [0.0, 2000.0, 0.0]);
        assert!(pilot.is_clear() && found.iter().all(|e| *e == 50.0));
        let (mut pilot, _) = group(&[50.0; 16], 32, 1, [0.0, 2000.0, 0.0]);
        assert!(!pilot.is_clear());
    }

    /// A bright spot of the square: its mean comes out whether the first rays met it or not, and with far less noise.
    #[test]
    fn what_was_missed_is_not_lost() {
        let inside = |u: f32, v: f32| (0.3..0.4).contains(&u) && (0.6..0.76).contains(&v);
        let light = |u, v| if inside(u, v) { [100.0; 3] } else { [0.0; 3] };
        let exact = 100.0 * 0.1 * 0.16;
        for rays in [16, 64, 256, 1024] {
            let (mut plain, mut guided) = ([0.0; 2], [0.0; 2]);
            let count = 4000;
            let mut pilot = Pilot::default();
            for seed in 0..count {
                let sequence = Sequence::new(seed, 1);
                pilot.begin(1, rays, 100.0);
                pilot.receivers[0] = Receiver { facing: Some(facing(DVec3::Z)), rays, ..Receiver::default() };
                let mut sum = 0.0;
                for point in (0..rays).map(|index| sequence.pair(index)).filter(|p| inside(p[0], p[1])) {
                    pilot.add(0, 0, point, light(point[0], point[1]));
                    sum += 100.0;
                }
                let [a, b] = pilot.mean(0, &Sequence::new(seed, 2), |_, [u, v, ..]| light(u, v));
                for (sums, found) in [(&mut plain, sum / f64::from(rays)), (&mut guided, 0.5 * f64::from(a[1] + b[1]))]
                {
                    sums[0] += found / f64::from(count);
                    sums[1] += (found - exact).powi(2) / f64::from(count);
                }
            }
            let error = (guided[1] / f64::from(count)).sqrt();
            assert!((guided[0] - exact).abs() < 4.0 * error, "{rays}: {} for {exact} ± {error}", guided[0]);
            if rays > 64 {
                assert!(guided[1] < 0.1 * plain[1], "{rays}: {guided:?} {plain:?}");
            }
        }
    }
}
