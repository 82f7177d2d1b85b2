//! Where the light comes from that is looked at, and smaller cells there.
//!
//! Cells share the area evenly, but all light of a room may come through a shaft, a slit or a door ajar, on a hundredth of it, where light falls off
//! within the width of a cell: constants carry it on too far, and a room behind a window of 20 × 120 cm in a wall of 80 cm was 10 to 25 % too bright, whatever
//! number of rays was sent. So a solution is asked what of the light that is looked at was on each surface: its radiosity by its importance
//! (Smits, Arvo and Salesin 1992, "An importance-driven radiosity algorithm", §3), which is light that goes backwards through the same rows. A surface that matters more than
//! four times as much as it has cells has as many of them, in the next solution, as a quarter of that. There is one only where cells of such surfaces are wide beside the distance of what they see: in an
//! open room all is as it ought to be.

use super::{FEW, Solution, SolveOptions};
use crate::Error;
use crate::monitor::{Monitor, Stages, has_time};
use glam::DVec3;
use radiosity_scene::{Bands, luminance};
use radiosity_trace::sampling::{Random, cosine_direction, frame};
use radiosity_trace::{Place, Tracer, narrowed};
use radiosity_transport::IdSpace;
use rayon::prelude::*;
use std::time::Instant;

/// Rays that look for what is seen, and the streams of numbers that they use.
const RAYS: usize = 1 << 14;
const PATHS: u64 = 0xf0c5 << 32;

/// Of each row so many rays tell where importance goes on to: all rows together tell enough.
const OF_ROW: usize = 16;

/// What of the contributions may be missing, and the most sweeps for that.
const MISSING: f64 = 1e-3;
const MOST_SWEEPS: usize = 64;

/// Cells are narrower where they are so much narrower than before, and part of the light that has to come by such places for another solution to be worth it.
const NARROWER: f32 = 0.75;
const BY_FEW: f64 = 0.25;

/// Width of elements over the distance of what they see from which on they are wide.
const WIDE: f64 = 0.125;

/// How many times as many cells and rays for each that has, as far as all of them are no more than so many: where light comes by few places they are wide at first beside
/// what they see, and their noise does not average out.
const MORE_CELLS: usize = 4;
const MOST_CELLS: usize = 20_000;
const MORE_RAYS: usize = 64;
const MOST_RAYS: f64 = 1.6e7;

/// Rays of all rows that later solutions may have: what is left is not noise of rows, or the audit's own.
const MOST_IN_ALL: f64 = 2e7;

/// How often a solution is looked at so.
const MOST_LOOKS: usize = 2;

/// Vectors of a number for each element that looking takes at once.
const MOST_VECTORS: usize = 8;

/// The first ids of a row.
#[derive(Clone, Copy, Default)]
struct Row {
    ids: [u32; OF_ROW],
    count: usize,
}

/// From where light is looked at.
pub(crate) enum Looking<'l> {
    /// From surfaces or points that receive it.
    Places(&'l [Place]),
    /// All around.
    Eyes(&'l [DVec3]),
}

impl Looking<'_> {
    fn is_nowhere(&self) -> bool {
        match self {
            Looking::Places(places) => places.is_empty(),
            Looking::Eyes(eyes) => eyes.is_empty(),
        }
    }
}

impl<'a> Solution<'a> {
    /// Solves, and if much of the light that is looked at turns out to come by few places, again with smaller cells there and more rays: what all light comes by has
    /// noise that does not average out over what is seen.
    ///
    /// # Errors
    /// As [`Solution::new`].
    pub(crate) fn focused(
        tracer: &'a Tracer<'a>,
        options: &SolveOptions,
        looking: &Looking,
        (stages, monitor): (&Stages, &dyn Monitor),
    ) -> Result<Solution<'a>, Error> {
        let mut began = Instant::now();
        let mut solution = Solution::new(tracer, options, monitor)?;
        // Sizes that were asked for stay, and matrices grow with the square of the elements.
        if options.element_size.is_some() || options.form_factors.is_some() || !options.solver.applies_only() {
            return Ok(solution);
        }
        // What wide cells tell of narrow places is little.
        for _ in 0..MOST_LOOKS {
            if !has_time(monitor, began.elapsed().as_secs_f64()) {
                break;
            }
            let looked = Stages::default();
            let narrowed = looked.time(monitor, "importance", || solution.narrowed(looking))?;
            stages.absorb(&looked);
            let Some(scales) = narrowed else { break };
            let cells = options.cells.max((MORE_CELLS * options.cells).min(MOST_CELLS));
            let rays = (MOST_RAYS * solution.share_of_rays(cells)) as usize;
            let next = SolveOptions { cells, rays: rays.clamp(options.rays, MORE_RAYS * options.rays), ..*options };
            let takes = next.rays as f64 / (solution.share_of_rays(cells) * solution.rays_in_all());
            if !has_time(monitor, takes.max(1.0) * began.elapsed().as_secs_f64()) {
                break;
            }
            began = Instant::now();
            stages.absorb(&solution.stages);
            drop(solution);
            solution = match Solution::scaled(tracer, scales, &next, monitor) {
                // How much room they take is known once they are made.
                Err(Error::Memory { .. } | Error::File(_)) => return Solution::new(tracer, options, monitor),
                again => again?,
            };
        }
        Ok(solution)
    }

    /// Rays per cell that another solution of so many cells is worth: as many as there may be, but where cells are narrow already because light comes by few places, and have many.
    pub(crate) fn most_rays(&self, cells: usize) -> usize {
        if self.scales == self.tracer.scales() {
            return usize::MAX;
        }
        (MOST_IN_ALL * self.share_of_rays(cells)) as usize
    }

    /// What each of so many cells would have of all rays, of parts of cells as there are.
    fn share_of_rays(&self, cells: usize) -> f64 {
        let fewer = self.options.cells.max(1) as f64 / cells.max(1) as f64;
        fewer * self.rays().max(1) as f64 / self.rays_in_all().max(1.0)
    }

    /// For each triangle how wide its cells are to be, relative to the widest, so that they are small where light comes from that is looked at; none where it comes by
    /// cells that are as they ought to be, as far as this solution tells.
    fn narrowed(&self, looking: &Looking) -> Result<Option<Vec<f32>>, Error> {
        if looking.is_nowhere() {
            return Ok(None);
        }
        let Some(mut shares) = self.importance(looking)? else { return Ok(None) };
        // Light that several gave in turn counts for each.
        shares.iter_mut().zip(self.reflected()).for_each(|(share, b)| *share *= b);
        let all: f64 = shares.iter().sum();
        if all <= 0.0 {
            return Ok(None);
        }
        let mesh = self.tracer.mesh;
        let mut visits = vec![0.0; mesh.triangles.len()];
        for (element, share) in shares.iter().enumerate() {
            visits[self.elements.place(element as u32).0] += share / all * RAYS as f64;
        }
        let scales = narrowed(mesh, &visits, &self.scales);
        let before = |t: usize| self.scales.get(t).copied().unwrap_or(1.0);
        let mut is_wide: Vec<bool> = (0..visits.len())
            .map(|t| visits[t] > 0.0 && scales.get(t).is_some_and(|scale| *scale < NARROWER * before(t)))
            .collect();
        self.keep_wide(&mut is_wide)?;
        let by_few: f64 = visits.iter().zip(&is_wide).filter(|(_, is_wide)| **is_wide).map(|(visits, _)| visits).sum();
        Ok((by_few > BY_FEW * RAYS as f64).then_some(scales))
    }

    /// Keeps of some triangles those whose elements are wide beside the distance of what they see: the harmonic mean, as it is what is near that makes light vary (Ward and
    /// Heckbert 1992, "Irradiance gradients", §2).
    fn keep_wide(&self, some: &mut [bool]) -> Result<(), Error> {
        let mesh = self.tracer.mesh;
        let middle = |id: u32| self.elements.centre(mesh, id);
        let n = self.elements.len();
        let is_asked = |i: u32| some[self.elements.place(i).0];
        let near = self.table.map_rows(|row| {
            let i = row.row() as u32;
            let seen = row.some(OF_ROW).filter(|id| is_asked(i) && (*id as usize) < n);
            seen.fold([0.0; 2], |[sum, count], id| [sum + middle(i).distance(middle(id)).recip(), count + 1.0])
        })?;
        let mut all = vec![[0.0; 3]; some.len()];
        for (i, [sum, count]) in near.into_iter().enumerate().filter(|(_, near)| near[1] > 0.0) {
            let own = &mut all[self.elements.place(i as u32).0];
            // By as many as each element met: the width of most.
            *own = [own[0] + sum, own[1] + count, own[2] + count * (2.0 * self.area[i]).sqrt()];
        }
        let is_wide = |[sum, count, widths]: [f64; 3]| widths * sum > WIDE * count * count;
        some.iter_mut().zip(all).for_each(|(some, all)| *some &= is_wide(all));
        Ok(())
    }

    /// By how much the radiosity of each element counts in what is looked at, seen at once or after others. None where rows are not those of the table, or elements so many that most are
    /// triangles as they are, or more than there is room for.
    fn importance(&self, looking: &Looking) -> Result<Option<Vec<f64>>, Error> {
        let n = self.elements.len();
        let has_room = n * size_of::<Row>() + MOST_VECTORS * n * size_of::<f64>() <= self.memory_allowed();
        if self.matrix.is_some() || self.rays() == 0 || n > FEW || !has_room {
            return Ok(None);
        }
        let rows = self.table.map_rows(|row| {
            let mut own = Row::default();
            for (id, place) in row.some(OF_ROW).zip(&mut own.ids) {
                *place = id;
                own.count += 1;
            }
            own
        })?;
        let mut arriving = self.seen(looking);
        let given = self.reflected();
        let mut importance = vec![0.0; n];
        for _ in 0..MOST_SWEEPS {
            let worth = |importance: &[f64]| importance.iter().zip(&given).map(|(y, b)| y * b).sum::<f64>();
            importance.iter_mut().zip(&arriving).for_each(|(sum, more)| *sum += more);
            if worth(&arriving) <= MISSING * worth(&importance) {
                break;
            }
            let mut next = vec![0.0; n];
            for (i, row) in rows.iter().enumerate() {
                let through = self
                    .sheets
                    .passed(i)
                    .map_or(0.0, |(other, _)| f64::from(luminance(self.transmittance(other))) * arriving[other]);
                let share =
                    (f64::from(luminance(self.reflectance[i])) * arriving[i] + through) / row.count.max(1) as f64;
                if share > 0.0 {
                    let met = row.ids[..row.count].iter().filter(|id| (**id as usize) < n);
                    met.for_each(|id| next[*id as usize] += share);
                }
            }
            arriving = next;
        }
        Ok(Some(importance))
    }

    /// Luminous exitance of each element without its own emission, lm/m².
    fn reflected(&self) -> Vec<f64> {
        let reflected = |(b, e): (&Bands, &Bands)| f64::from(luminance(*b) - luminance(*e)).max(0.0);
        self.radiosity().iter().zip(&self.exitance).map(reflected).collect()
    }

    /// What part of all that is looked at each element is.
    fn seen(&self, looking: &Looking) -> Vec<f64> {
        let tracer = self.tracer();
        let ids = IdSpace { elements: &self.elements, sky: self.sky };
        let look = |k: usize| {
            let mut random = Random::new(PATHS ^ k as u64);
            let (ray, direction) = match looking {
                Looking::Places(places) => {
                    let place = places.get(k * places.len() / RAYS)?;
                    let direction = cosine_direction(&frame(place.normal), random.next_unit(), random.next_unit());
                    (tracer.ray(place, direction, f64::INFINITY), direction)
                }
                Looking::Eyes(eyes) => {
                    let direction = random.next_direction();
                    (tracer.free_ray(*eyes.get(k * eyes.len() / RAYS)?, direction), direction)
                }
            };
            Some(ids.id(tracer.first(&ray, random.next_bits()), direction) as usize)
        };
        let mut seen = vec![0.0; self.elements.len()];
        let found: Vec<Option<usize>> = (0..RAYS).into_par_iter().map(look).collect();
        for id in found.into_iter().flatten().filter(|id| *id < self.elements.len()) {
            seen[id] += 1.0 / RAYS as f64;
        }
        seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cornell_box;
    use radiosity_scene::{Material, Mesh, Scene, Transmission};

    /// A gray room of 4 × 2.5 × 3 m with a lamp below its ceiling and an opal sheet across.
    fn room() -> Scene {
        let gray = |rho: f32| Material { base_color: [rho, rho, rho, 1.0], ..Material::default() };
        let sheet = Transmission { transmittance: [0.5; 3], texture: None, replaced: 0.0, share_texture: None };
        let lamp = Material { emissive: [500.0; 3], ..gray(0.0) };
        let materials = vec![gray(0.7), lamp, Material { transmission: Some(sheet), ..gray(0.3) }];
        let mut scene = Scene { materials, ..Scene::default() };
        let [x, y, z] = [DVec3::X * 4.0, DVec3::Y * 2.5, DVec3::Z * 3.0];
        let o = DVec3::ZERO;
        for (u, v, w) in [(x, y, z), (y, z, x), (z, x, y)] {
            scene.add_quad("room", 0, [o, u, u + v, v]);
            scene.add_quad("room", 0, [w, w + v, w + u + v, w + u]);
        }
        let across = |x: [f64; 2], z: [f64; 2], y: f64| {
            [(x[0], z[0]), (x[1], z[0]), (x[1], z[1]), (x[0], z[1])].map(|(x, z)| DVec3::new(x, y, z))
        };
        scene.add_quad("lamp", 1, across([1.0, 3.0], [1.0, 2.0], 2.4));
        scene.add_quad("sheet", 2, across([0.5, 3.5], [0.5, 2.5], 1.2));
        scene
    }

    /// What is seen is the same by the light that all give and by the importance of where it begins: s·X = y·E for X = E + R F X and y = s + (R F)ᵀ y.
    #[test]
    fn importance_is_light_that_goes_backwards() {
        let scene = room();
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let eyes = [DVec3::new(1.0, 0.5, 1.0), DVec3::new(2.0, 2.0, 2.5)];
        let looking = Looking::Eyes(&eyes);
        // Of longer rows some ids stand for all.
        for (rays, within) in [(OF_ROW, 0.01), (16 * OF_ROW, 0.03)] {
            let options = SolveOptions { cells: 500, rays, variation: f64::INFINITY, ..SolveOptions::default() };
            let solution = Solution::new(&tracer, &options, &()).unwrap();
            let (seen, importance) = (solution.seen(&looking), solution.importance(&looking).unwrap().unwrap());
            let h = solution.table.rows_mean(&solution.of_elements()).unwrap();
            let n = seen.len();
            let sum =
                |weights: &[f64], light: &dyn Fn(usize) -> f64| (0..n).map(|i| weights[i] * light(i)).sum::<f64>();
            let x = |i: usize| f64::from(solution.values[i][0]);
            let reflected = |i: usize| {
                let passed = solution.sheets.passed(i);
                let through = passed.map_or(0.0, |(other, tau)| f64::from(tau[0]) * f64::from(h[other][0]));
                f64::from(solution.reflectance[i][0]) * f64::from(h[i][0]) + through
            };
            let own = |i: usize| x(i) - reflected(i);
            let [by_light, by_importance] = [sum(&seen, &x), sum(&importance, &own)];
            assert!((by_importance / by_light - 1.0).abs() < within, "{rays}: {by_light} {by_importance}");
            assert!(by_light > 2.0 * sum(&seen, &own), "light that is seen at once alone");
        }
    }

    /// Rooms that are lit all over are solved once.
    #[test]
    fn a_room_without_narrow_places_keeps_its_cells() {
        for (scene, eye) in [(cornell_box(), [0.1, 0.4, 0.1]), (room(), [1.0, 1.8, 0.6])] {
            let mesh = Mesh::new(&scene);
            let tracer = Tracer::new(&scene, &mesh);
            let options = SolveOptions { cells: 1000, rays: 16, ..SolveOptions::default() };
            let solution = Solution::new(&tracer, &options, &()).unwrap();
            assert!(solution.narrowed(&Looking::Eyes(&[eye.into()])).unwrap().is_none());
            // Nor is anything known to who looks from nowhere.
            assert!(solution.narrowed(&Looking::Eyes(&[])).unwrap().is_none());
        }
    }
}
