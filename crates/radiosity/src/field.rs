//! Indirect light as a continuous field, as points of the surfaces receive it: by the author's normals, and without visible
//! noise where it is looked at.

use crate::measure::brought_nothing;
use crate::monitor::{Monitor, Watch, is_over};
use crate::pace;
use crate::{Error, Solution};
use glam::DVec3;
use radiosity_scene::{Bands, luminance};
use radiosity_transport::{ElementReceivers, ShadedReceivers};
use radiosity_view::Field;
use radiosity_view::picture::shading_normal;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Elements, and triangles that pictures show, are flat where normals differ from theirs by less than this cosine, that of half a degree: light that comes from
/// one side changes by less than one percent.
pub(crate) const FLAT: f64 = 0.99996;

/// Fewest rays that gather for an element of a divided cell: what is left of 128 for the smallest of 16.
const FEWEST_RAYS: usize = 8;

/// Rays from which on a cell that is looked at gathers no more.
const MOST_RAYS: usize = 4096;

/// Rays that each cell that is looked at gathers with, however little time there is: elements that are looked up alone may have sixteen
/// for a cell, and are mottled then. They take a twentieth of the time of what is done without a limit.
const LEAST_SEEN: usize = 64;

/// Noise that is seen on a smooth wall, relative to its light: pictures have no more, whatever error is asked for.
const VISIBLE: f64 = 0.01;

/// Rays that a pass adds, over those so far: fewer would not be worth judging it anew, and more not be planned by noise that is told
/// roughly.
const LEAST_MORE: f64 = 0.25;
const MOST_MORE: f64 = 1.0;

/// An element, and the unit normals at its corners that it receives with.
type Shaded = (u32, [DVec3; 3]);

/// Rays that bring the noise of those that cells had, so many times as much as is wanted, down to that: it falls with their root at least.
fn further(had: usize, over: f64) -> usize {
    let more = (over * over - 1.0).clamp(LEAST_MORE, MOST_MORE);
    ((more * had as f64) as usize).max(1).next_multiple_of(FEWEST_RAYS)
}

impl Solution<'_> {
    /// The continuous field of the indirect irradiance.
    ///
    /// # Errors
    /// [`Error::Stopped`]; [`Error::File`].
    pub fn indirect_field(&self, monitor: &dyn Monitor) -> Result<Field, Error> {
        Ok(self.field_of(&self.received(monitor)?))
    }

    /// Indirect irradiance of each element, by two halves of its rays. Elements that stand for a curved surface gather it anew
    /// with its normals: by those of its facets it would show bands.
    pub(crate) fn received(&self, monitor: &dyn Monitor) -> Result<Vec<[Bands; 2]>, Error> {
        let curved: Vec<Shaded> = (0..self.elements.len() as u32)
            .into_par_iter()
            .map(|element| (element, self.shading_normals(element)))
            .filter(|(element, normals)| {
                let own = self.elements.normal(self.tracer().mesh, *element);
                normals.iter().any(|normal| normal.dot(own) < FLAT)
            })
            .collect();
        let mut light = self.indirect_halves()?;
        let mut rays = self.rays();
        if let Some(left) = pace::left(monitor)
            && rays > LEAST_SEEN
            && !curved.is_empty()
        {
            let each = self.seconds_to_gather(&curved, LEAST_SEEN, &light, monitor)?;
            // Half of the time at most: an audit follows.
            rays = pace::affordable(0.5 * left, each).clamp(LEAST_SEEN, rays);
        }
        self.gather_on(&curved, (rays, 0), &mut light, monitor)?;
        Ok(light)
    }

    /// The field of `light` by element, in halves, where cells are looked at, each as often as `looks` says. Where its noise
    /// there is more than `error`, or than is visible, these and what is around them gather anew, adding to those rays
    /// until it is not, or that brings nothing, or there are 4,096 or more for each cell.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub(crate) fn field_on(
        &self,
        looks: &[u32],
        mut light: Vec<[Bands; 2]>,
        error: f64,
        monitor: &dyn Monitor,
    ) -> Result<Field, Error> {
        let mesh = self.tracer().mesh;
        let is_seen: Vec<bool> = looks.iter().map(|looks| *looks > 0).collect();
        // A corner at which cells lie to one side is moved by what those beside it say.
        let around = Field::around(mesh, &self.elements, &Field::around(mesh, &self.elements, &is_seen));
        let elements = (0..around.len()).filter(|cell| around[*cell]).flat_map(|cell| self.elements.of_cell(cell));
        let seen: Vec<Shaded> = elements.map(|element| (element, self.shading_normals(element))).collect();
        let noise = |light: &[[Bands; 2]]| self.noise(light, |cell, _| f64::from(looks[cell]));
        let (wanted, first) = (error.min(VISIBLE), (2 * self.rays()).max(FEWEST_RAYS));
        // Within a time limit, seconds for each ray.
        let mut each = match pace::left(monitor) {
            Some(_) => Some(self.seconds_to_gather(&seen, first.min(LEAST_SEEN), &light, monitor)?),
            None => None,
        };
        // Rays of each cell so far; those that the light came with are left out.
        let mut had = 0;
        if each.is_some() && is_over(monitor) && first <= LEAST_SEEN {
            self.gather_on(&seen, (LEAST_SEEN, 0), &mut light, monitor)?;
            had = LEAST_SEEN;
        }
        let mut noises = vec![noise(&light)];
        while let Some(&last) = noises.last().filter(|last| **last > wanted)
            && had < MOST_RAYS
            && first <= MOST_RAYS
            && !brought_nothing(&noises)
        {
            let [least, mut rays] = match had {
                0 => [first, first],
                _ => [(LEAST_MORE * had as f64) as usize, further(had, last / wanted)],
            };
            if let (Some(each), Some(left)) = (each, pace::left(monitor)) {
                let affordable = pace::affordable(left, each);
                rays = match affordable >= least {
                    true => rays.min(affordable),
                    // The least is gathered in any case, once.
                    false if had == 0 && first <= LEAST_SEEN => LEAST_SEEN,
                    false => break,
                };
            }
            let mut more = light.clone();
            let gather = || self.gather_on(&seen, (rays, noises.len() as u32), &mut more, monitor);
            let (took, gathered) = pace::timed(gather);
            gathered?;
            each = each.map(|_| took / rays as f64);
            let share = rays as f32 / (had + rays) as f32;
            for element in seen.iter().map(|(element, _)| *element as usize) {
                for (all, more) in light[element].iter_mut().flatten().zip(more[element].iter().flatten()) {
                    *all = (1.0 - share) * *all + share * more;
                }
            }
            had += rays;
            noises.push(noise(&light));
        }
        Ok(self.field_of(&light))
    }

    /// Seconds that elements take to gather for each ray, by a part of them that gathers with so many; nothing is kept.
    fn seconds_to_gather(
        &self,
        elements: &[Shaded],
        rays: usize,
        light: &[[Bands; 2]],
        monitor: &dyn Monitor,
    ) -> Result<f64, Error> {
        let (some, parts) = pace::sample(elements);
        let mut thrown_away = light.to_vec();
        let (seconds, gathered) = pace::timed(|| self.gather_on(&some, (rays, 0), &mut thrown_away, monitor));
        gathered?;
        Ok(parts * seconds / rays as f64)
    }

    /// The field of light by element, in halves.
    pub(crate) fn field_of(&self, light: &[[Bands; 2]]) -> Field {
        Field::pooled(self.tracer().mesh, &self.elements, light, &self.exposed_area())
    }

    /// Noise that rays leave in the field of `light`: root mean square over the exposed area as it counts.
    pub(crate) fn field_noise(&self, light: &[[Bands; 2]]) -> f64 {
        let triangle = |cell: usize| self.elements.place(self.elements.of_cell(cell).start).0;
        self.noise(light, |cell, exposed| exposed * self.counts(triangle(cell)))
    }

    /// The noise that is left in the field of light by element, in halves, as half the difference of the fields of either half
    /// tells it, 15 to 40 % too large.
    fn noise(&self, light: &[[Bands; 2]], weight: impl Fn(usize, f64) -> f64) -> f64 {
        let halves = Field::pooled_halves(self.tracer().mesh, &self.elements, light, &self.exposed_area());
        self.noise_between(&halves, weight)
    }

    /// Half the difference of two fields: root mean square over the middles of cells, by the weight that is given for a cell
    /// and its exposed area, each relative to its own irradiance E, as the eye takes it, and by E/(E + mean E), so that neither
    /// the dark insides of furniture nor a bright garden decide.
    fn noise_between(&self, fields: &[Field; 2], weight: impl Fn(usize, f64) -> f64) -> f64 {
        let exposed = self.exposed_area();
        // By cell: weight, irradiance, standard error.
        let cell = |cell: usize| {
            let (mut area, mut direct) = (0.0, 0.0);
            for e in self.elements.of_cell(cell).map(|e| e as usize) {
                area += exposed[e];
                direct += exposed[e] * f64::from(luminance(self.columns.mean(e)));
            }
            let (triangle, side) = self.elements.place(self.elements.of_cell(cell).start);
            let [a, b, c] = self.elements.cell_corners(cell);
            let middle = (a + b + c) / 3.0;
            let [first, second] = [0, 1].map(|k| f64::from(luminance(fields[k].at(triangle, middle, side))));
            let e = direct / area + 0.5 * (first + second);
            (area > 0.0 && e > 0.0).then(|| (weight(cell, area), e, 0.5 * (first - second)))
        };
        let cells: Vec<(f64, f64, f64)> = (0..self.elements.cells()).filter_map(cell).collect();
        let total: f64 = cells.iter().map(|(weight, ..)| weight).sum();
        let mean = cells.iter().map(|(weight, e, _)| weight * e).sum::<f64>() / total.max(f64::MIN_POSITIVE);
        let (mut noise, mut sum) = (0.0, 0.0);
        for (weight, e, error) in cells {
            let counted = weight * e / (e + mean);
            noise += counted * (error / e).powi(2);
            sum += counted;
        }
        (noise / sum.max(f64::MIN_POSITIVE)).sqrt()
    }

    /// Puts what elements gather with `rays` rays per cell into `light`; each `salt` has rays of its own.
    fn gather_on(
        &self,
        elements: &[Shaded],
        (rays, salt): (usize, u32),
        light: &mut [[Bands; 2]],
        monitor: &dyn Monitor,
    ) -> Result<(), Error> {
        let all = ElementReceivers { mesh: self.tracer().mesh, elements: &self.elements, exposure: &self.exposure };
        // Elements of a divided cell share its rays.
        let mut by_pieces: BTreeMap<u32, Vec<Shaded>> = BTreeMap::new();
        for element in elements {
            by_pieces.entry(self.elements.pieces(element.0)).or_default().push(*element);
        }
        for (pieces, shaded) in &by_pieces {
            let receivers = ShadedReceivers { all: &all, shaded, salt };
            let rays = (rays / *pieces as usize).max(FEWEST_RAYS);
            let gather = || self.gather().irradiance(&receivers, rays, &Watch(monitor));
            for ((element, _), halves) in shaded.iter().zip(self.stages.time(monitor, "gather on surfaces", gather)?) {
                light[*element as usize] = halves;
            }
        }
        Ok(())
    }

    /// The normals that light is received with at an element's corners.
    fn shading_normals(&self, element: u32) -> [DVec3; 3] {
        let (triangle, side) = self.elements.place(element);
        self.elements.corners(element).map(|uv| shading_normal(self.tracer(), triangle, uv, side))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, Mesh, Scene, Sky, SolveOptions, Tracer, cornell_box};
    use radiosity_trace::Place;
    use radiosity_trace::sampling::{hash, unit};
    use radiosity_transport::{Receivers, Site};

    /// Elements that look in other directions than usual.
    struct Reseeded<'a>(ElementReceivers<'a>, u32);

    impl Receivers for Reseeded<'_> {
        fn len(&self) -> usize {
            self.0.len()
        }
        fn site(&self, i: usize) -> Option<Site> {
            self.0.site(i)
        }
        fn buried(&self, tracer: &Tracer, place: &Place, seed: u32) -> bool {
            self.0.buried(tracer, place, seed)
        }
        fn places(&self, i: usize, wanted: u32) -> u32 {
            self.0.places(i, wanted)
        }
        fn near(&self, i: usize) -> Option<f64> {
            self.0.near(i)
        }
        fn seed(&self, i: usize) -> u32 {
            hash(hash(self.0.seed(i)) ^ self.1)
        }
    }

    /// The noise that is told of the field of so many rays for each element, and how far two of them are apart that have no ray in
    /// common, over √2: both at the middles of cells, weighted alike.
    fn told_and_true(solution: &Solution, rays: usize) -> [f64; 2] {
        let (mesh, elements) = (solution.tracer().mesh, &solution.elements);
        let light = |salt: u32| {
            let all = ElementReceivers { mesh, elements, exposure: &solution.exposure };
            solution.gather().irradiance(&Reseeded(all, salt), rays, &Watch(&())).unwrap()
        };
        let [first, second] = [light(1), light(2)];
        let told = [&first, &second].map(|light| solution.field_noise(light));
        // As if the two were halves of one: what is left of their difference.
        let fields = [&first, &second].map(|light| solution.field_of(light));
        let apart = solution.noise_between(&fields, |_, exposed| exposed) * std::f64::consts::SQRT_2;
        [0.5 * (told[0] + told[1]), apart]
    }

    /// Boxes under an even sky whose sides are too small to share.
    fn pebbles() -> Scene {
        let mut scene = Scene { sky: Sky::Uniform([1000.0; 3]), ..Scene::default() };
        scene.materials.push(Material::default());
        let draw = |i: u32, k: u32| f64::from(unit(hash(hash(i) ^ k)));
        for i in 0..300 {
            let low = DVec3::new(draw(i, 0), draw(i, 1), draw(i, 2));
            for axis in 0..3 {
                let [x, y, z] = [0, 1, 2].map(|k| 0.04 * DVec3::AXES[(axis + k) % 3]);
                scene.add_quad("pebble", 0, [low, low + y, low + x + y, low + x]);
                scene.add_quad("pebble", 0, [low + z, low + x + z, low + x + y + z, low + y + z]);
            }
        }
        scene
    }

    /// What is told of the noise of a field is about what it is: where walls share their rays, and where nothing does.
    /// It was taken for that of cells alone, over a constant.
    #[test]
    fn the_noise_of_a_field_is_as_told() {
        for scene in [cornell_box(), pebbles()] {
            let mesh = Mesh::new(&scene);
            let tracer = Tracer::new(&scene, &mesh);
            let options = SolveOptions { element_size: Some(0.05), ..SolveOptions::default() };
            let solution = Solution::new(&tracer, &options, &()).unwrap();
            for rays in [32, 256] {
                let [told, apart] = told_and_true(&solution, rays);
                assert!(told < 1.5 * apart && apart < 1.5 * told, "{rays} rays: told {told}, true {apart}");
            }
        }
    }
}
