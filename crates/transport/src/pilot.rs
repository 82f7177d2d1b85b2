//! Light that comes from few directions, through a window or from a patch of sun: rays are sent again to where it was found.
//!
//! In a room with a window one cosine ray in a hundred gets out, and a hundred of them do not tell how much sky there is.
//! But they tell where to look: the unit square that cosine rays are drawn from is cut into cells, and new rays are drawn
//! by how much light the first ones, and those of receivers nearby, brought from each cell and the cells around it. Some
//! go everywhere all the same, and each weighs the inverse of its density, so the mean is right whatever the first rays
//! missed (importance sampling by a pilot; Kahn and Marshall 1953). Where light comes from all around, the first rays
//! count themselves; with new ones as well as long as there are too few to be sure of it.
//!
//! Rays that agree are believed, which is biased: of a speck of the hemisphere p that N rays, the neighbours' included,
//! miss with probability (1 − p)^N, that part is lost: of a sky of 10,000 lx less than 8 lx at N = 512, 1 lx at 4,096.

use crate::one_light::luminance_of;
use crate::receivers::Site;
use glam::DVec3;
use radiosity_scene::Bands;
use radiosity_trace::sampling::Sequence;

/// Most cells along each side of the square.
const MOST_CELLS: usize = 32;

/// Receivers on the same triangle up to so many numbers away look for each other. They are elements or texels side by
/// side, most often, and see a window in the same cells or the next.
const NEIGHBOURS: usize = 4;

/// Share of the new rays that go everywhere alike.
const EVEN: f64 = 0.25;

/// Where (Σ light)² is this part of rays · Σ light², as if an even light came from that part of the hemisphere, the first
/// rays are good enough. The choice looks at these rays, which biases receivers right at the limit, by less than half of
/// their own standard error.
const OPEN: f64 = 0.1;

/// So many rays, those of neighbours included, are trusted to have missed nothing that matters.
const TRUSTED: u32 = 512;

/// The stream of sample points that the new rays use.
pub(crate) const AGAIN: u32 = 0x0180;

/// What the first rays of some receivers brought, by cells of the unit square that they were drawn from.
#[derive(Default)]
pub(crate) struct Pilot {
    receivers: Vec<Receiver>,
    side: usize,
    /// Most luminance that a ray may bring.
    peak: f64,
    /// Light by receiver and cell.
    light: Vec<f32>,
    /// Running sums of a density over cells: of rows, and of the cells in each row; each ends at 1.
    rows: Vec<f64>,
    cells: Vec<f64>,
}

/// What the first rays of one receiver brought.
#[derive(Clone, Copy, Default)]
struct Receiver {
    /// Its triangle and normal: receivers that share them draw the same directions from the same cells, or similar ones where
    /// each place has a normal of its own.
    plane: Option<(u32, DVec3)>,
    rays: u32,
    halves: [[f64; 3]; 2],
    sum: f64,
    square: f64,
}

impl Pilot {
    /// Makes ready for some receivers, of up to `most_rays` rays each that bring up to `peak`, and forgets all others.
    pub fn begin(&mut self, receivers: usize, most_rays: u32, peak: f64) {
        self.peak = peak;
        self.side = 1;
        // One ray to a cell.
        while self.side < MOST_CELLS && 4 * self.side * self.side <= most_rays as usize {
            self.side *= 2;
        }
        self.light.clear();
        self.light.resize(receivers * self.side * self.side, 0.0);
        self.receivers.clear();
        self.receivers.resize(receivers, Receiver::default());
    }

    /// Where receiver k lies, and how many rays it sends.
    pub fn place(&mut self, k: usize, site: &Site, rays: u32) {
        self.receivers[k] = Receiver { plane: Some((site.triangle(), site.normal)), rays, ..Receiver::default() };
    }

    /// A ray of a half of receiver k, drawn from (u, v), brought light. What brings none need not be told.
    pub fn add(&mut self, k: usize, half: usize, [u, v]: [f32; 2], arriving: [f64; 3]) {
        let own = &mut self.receivers[k];
        (0..3).for_each(|band| own.halves[half][band] += arriving[band]);
        let light = luminance_of(arriving);
        own.sum += light;
        own.square += light * light;
        let cell = |x: f32| ((x * self.side as f32) as usize).min(self.side - 1);
        let (i, j) = (cell(u), cell(v));
        self.light[(k * self.side + j) * self.side + i] += light.max(0.0) as f32;
    }

    /// The mean light over the hemisphere of receiver k, by the two halves of its rays, those of new ones, or both. New ones
    /// take the points of a sequence from a given one on, as many as there were rays. `arriving` is asked for the light of
    /// point (u, v, x, y), u and v drawn by the density.
    pub fn mean(
        &mut self,
        k: usize,
        (sequence, from): (&Sequence, u32),
        mut arriving: impl FnMut(u32, [f32; 4]) -> [f64; 3],
    ) -> [Bands; 2] {
        let own = self.receivers[k];
        if own.plane.is_none() {
            return Default::default();
        }
        let (mut rays, mut sum, mut square) = (0, 0.0, 0.0);
        for other in self.neighbours(k).map(|other| self.receivers[other]) {
            (rays, sum, square) = (rays + other.rays, sum + other.sum, square + other.square);
        }
        // (Σ light)² less the part that is asked for: 0 or more where light is even.
        let margin = sum * sum - OPEN * f64::from(rays) * square;
        let is_even = sum > 0.0 && margin >= 0.0;
        // Whether it still were if any number of the rays had met the brightest there is: whoever sends more rays
        // only then has no other answer on average.
        let lack = OPEN * f64::from(rays) * self.peak - 2.0 * sum;
        let stays_even = is_even && (lack <= 0.0 || lack * lack <= 4.0 * margin);
        let first = own.halves.map(|sum| sum.map(|s| 2.0 * s / f64::from(own.rays)));
        if stays_even || rays >= TRUSTED && (is_even || sum <= 0.0) {
            return first.map(|half| half.map(|e| e as f32));
        }
        let half_rays = own.rays / 2;
        self.make_density(k);
        [0u32, 1].map(|half| {
            let mut sum = [0f64; 3];
            for index in (0..half_rays).map(|i| from + half * half_rays + i) {
                let [u, v, x, y] = sequence.point(index);
                let (u, v, density) = self.draw(u, v);
                let light = arriving(index, [u, v, x, y]);
                (0..3).for_each(|band| sum[band] += light[band] / density);
            }
            // The first rays of a light that is even tell as much as these.
            let again = sum.map(|s| s / f64::from(half_rays));
            let part = if is_even { 0.5 } else { 0.0 };
            std::array::from_fn(|band| (part * first[half as usize][band] + (1.0 - part) * again[band]) as f32)
        })
    }

    /// The density over cells for receiver k: by the light of each cell and the eight around it, as the receiver and its
    /// neighbours found it, and a part that is even.
    fn make_density(&mut self, k: usize) {
        let side = self.side;
        let cells = side * side;
        self.cells.clear();
        self.cells.resize(cells, 0.0);
        for other in self.neighbours(k) {
            if self.receivers[other].sum > 0.0 {
                for (sum, light) in self.cells.iter_mut().zip(&self.light[other * cells..][..cells]) {
                    *sum += f64::from(*light);
                }
            }
        }
        spread(&mut self.cells, side, 1);
        spread(&mut self.cells, side, side);
        let total: f64 = self.cells.iter().sum();
        let even = 1.0 / cells as f64;
        self.rows.clear();
        let mut reached = 0.0;
        for row in self.cells.chunks_exact_mut(side) {
            let mut own = 0.0;
            for cell in row.iter_mut() {
                let share = if total > 0.0 { *cell / total } else { even };
                own += EVEN * even + (1.0 - EVEN) * share;
                *cell = own;
            }
            row.iter_mut().for_each(|cell| *cell /= own);
            reached += own;
            self.rows.push(reached);
        }
        self.rows.iter_mut().for_each(|row| *row /= reached);
    }

    /// Receivers near number k on its plane, itself among them.
    fn neighbours(&self, k: usize) -> impl Iterator<Item = usize> + use<> {
        let plane = self.receivers[k].plane;
        let near = k.saturating_sub(NEIGHBOURS)..(k + NEIGHBOURS + 1).min(self.receivers.len());
        let on_plane: [bool; 2 * NEIGHBOURS + 1] =
            std::array::from_fn(|i| near.start + i < near.end && self.receivers[near.start + i].plane == plane);
        near.clone().filter(move |other| on_plane[other - near.start])
    }

    /// Maps a point of the unit square to one drawn by the density, which is answered with it.
    fn draw(&self, u: f32, v: f32) -> (f32, f32, f64) {
        let (j, v, of_rows) = invert(&self.rows, f64::from(v));
        let (i, u, of_cells) = invert(&self.cells[j * self.side..][..self.side], f64::from(u));
        let place = |k: usize, within: f64| (((k as f64 + within) / self.side as f64) as f32).min(1.0 - f32::EPSILON);
        (place(i, u), place(j, v), of_rows * of_cells)
    }
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

    /// Even light is taken as it is only where nothing that a ray may bring could make it uneven.
    #[test]
    fn only_what_must_be_even_is_taken_as_it_is() {
        for (peak, again) in [(4.0, 0), (10.0, 0), (1000.0, 64)] {
            let mut pilot = Pilot::default();
            pilot.begin(1, 64, peak);
            pilot.receivers[0] = Receiver { plane: Some((0, DVec3::Z)), rays: 64, ..Receiver::default() };
            let sequence = Sequence::new(3, 1);
            for index in 0..64 {
                pilot.add(0, usize::from(index >= 32), sequence.pair(index), [1.0; 3]);
            }
            let mut asked = 0;
            let halves = pilot.mean(0, (&Sequence::new(3, 2), 0), |_, _| {
                asked += 1;
                [1.0; 3]
            });
            assert_eq!(asked, again, "{peak}");
            assert!(halves.iter().flatten().all(|e| (e - 1.0).abs() < 0.2), "{halves:?}");
        }
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
                pilot.receivers[0] = Receiver { plane: Some((0, DVec3::Z)), rays, ..Receiver::default() };
                let mut sum = 0.0;
                for point in (0..rays).map(|index| sequence.pair(index)).filter(|p| inside(p[0], p[1])) {
                    pilot.add(0, 0, point, light(point[0], point[1]));
                    sum += 100.0;
                }
                let [a, b] = pilot.mean(0, (&Sequence::new(seed, 2), 0), |_, [u, v, ..]| light(u, v));
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
