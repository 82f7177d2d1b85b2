//! Pictures on the way (catalogue 43): a first one within moments, then those of ever better coarse solutions, each whole.
//!
//! The first asks no more of the scene than what the camera sees of it: direct light there, and for the rest the ambient term
//! H = Σ A B₀/Σ A (1 − ρ) (Cohen et al. 1988, sect. 4.2), B₀ being what elements give off without indirect light. The sums are
//! over all elements; direct light is asked of those that are seen and of one in [`EACH`] of the others, which stands for them.
//! Nothing is examined for being buried, so where things touch it may be too dark. Sky light comes with the rays.
//!
//! A picture of a solution as it stands takes no shadow ray and no gather: the irradiance of elements, direct light with
//! it, read as a continuous field. What it misses, the fine edges of shadows, comes with the picture at the end. What a
//! camera sees is found once for all of them.

use crate::division::Optics;
use crate::monitor::{Monitor, Watch};
use crate::solution::cell_width;
use crate::{Error, Solution, SolveOptions};
use glam::DVec3;
use radiosity_scene::{Bands, Camera, Elements};
use radiosity_trace::Tracer;
use radiosity_trace::sampling::{hash, unit};
use radiosity_transport::{ElementReceivers, Exposure, Luminaires, ShadedReceivers, Shadowing};
use radiosity_view::{Field, Picture, ViewRays};
use rayon::prelude::*;

/// Cells of the first pictures, on top of one per triangle: a third of what an answer is begun with.
const CELLS: usize = 3000;

/// Rays per cell at which first pictures end; more would take longer than they are looked at.
const MOST_RAYS: usize = 64;

/// Rays per cell of the third picture; those before have none.
const FIRST_RAYS: usize = 16;

/// Of the elements that the camera does not see, one for the area of so many tells how much light they reflect in the first
/// picture. Of 40,000 these are 2,500, whose mean is known to some percent; more would make the picture wait for what it does not
/// show.
const EACH: f64 = 16.0;

/// What a camera sees, for pictures of solutions as they stand.
pub struct Glimpse {
    view: ViewRays,
}

impl Glimpse {
    /// Casts the camera's rays.
    pub fn new(tracer: &Tracer, camera: &Camera, width: u32, height: u32) -> Glimpse {
        Glimpse { view: ViewRays::new(tracer, camera, width, height) }
    }

    /// The first picture, before there is any solution.
    ///
    /// # Errors
    /// [`Error::Empty`], [`Error::Stopped`].
    pub fn first(&self, tracer: &Tracer, options: &SolveOptions, monitor: &dyn Monitor) -> Result<Picture, Error> {
        let (scene, mesh) = (tracer.scene, tracer.mesh);
        if mesh.triangles.is_empty() {
            return Err(Error::Empty("the scene has no surface"));
        }
        let options = coarse(options);
        let elements = Elements::new(scene, mesh, cell_width(mesh, tracer.scales(), &options));
        let Optics { area, reflectance, sheets, exitance } = Optics::new(tracer, &elements);
        let luminaires = Luminaires::new(tracer, &elements, &area, &exitance);

        // Which elements to ask, and the area that each stands for.
        let mut is_seen = vec![false; elements.len()];
        for seen in &self.view.seen {
            for cell in elements.cells_of(seen.place.triangle as usize, seen.side) {
                elements.of_cell(cell).for_each(|element| is_seen[element as usize] = true);
            }
        }
        let mut stands_for: Vec<f64> =
            area.iter().zip(&is_seen).map(|(a, seen)| if *seen { *a } else { 0.0 }).collect();
        let unseen = || (0..elements.len()).filter(|e| !is_seen[*e]);
        let step = EACH * unseen().map(|e| area[e]).sum::<f64>() / unseen().count().max(1) as f64;
        // One in each stretch of the area, at a place of its own: at equal ones, the fronts of sheets alone might be met.
        let (mut end, mut stretch) = (0.0, 0u32);
        let place = |stretch: u32| (f64::from(stretch) + f64::from(unit(hash(stretch)))) * step;
        for e in unseen() {
            end += area[e];
            while place(stretch) < end {
                stands_for[e] += step;
                stretch += 1;
            }
        }
        let flat = |e: u32| (e, [elements.normal(mesh, e); 3]);
        let asked: Vec<(u32, [DVec3; 3])> =
            (0..elements.len() as u32).filter(|e| stands_for[*e as usize] > 0.0).map(flat).collect();
        let exposure = Exposure::default();
        let all = ElementReceivers { mesh, elements: &elements, exposure: &exposure };
        let receivers = ShadedReceivers { all: &all, shaded: &asked, salt: 0 };
        let columns = luminaires.columns(tracer, &receivers, &options.shadowing, &Watch(monitor))?;

        // What arrives at a sheet leaves it on both sides. Only direct light has to be asked for; the rest is known of all.
        let (mut given, mut kept) = ([0.0; 3], [0.0; 3]);
        let back = |e: usize, band: usize| {
            f64::from(reflectance[e][band] + sheets.passed(e).map_or(0.0, |(_, tau)| tau[band]))
        };
        for e in 0..elements.len() {
            for band in 0..3 {
                given[band] += area[e] * f64::from(exitance[e][band] - luminaires.promoted[e][band]);
                kept[band] += area[e] * (1.0 - back(e, band));
            }
        }
        for (i, e) in asked.iter().map(|(e, _)| *e as usize).enumerate() {
            let direct = columns.seen(i);
            for band in 0..3 {
                given[band] += stands_for[e] * back(e, band) * f64::from(direct[band]);
            }
        }
        let ambient: Bands = std::array::from_fn(|k| if kept[k] > 0.0 { (given[k] / kept[k]) as f32 } else { 0.0 });
        let (mut irradiance, mut weight) = (vec![[0f32; 3]; elements.len()], vec![0.0; elements.len()]);
        for (i, e) in asked.iter().map(|(e, _)| *e as usize).enumerate() {
            let direct = columns.mean(i);
            irradiance[e] = std::array::from_fn(|band| direct[band] + ambient[band]);
            weight[e] = area[e];
        }
        Ok(self.of(&Field::new(mesh, &elements, &irradiance, &weight)))
    }

    /// The picture of a solution.
    pub fn picture(&self, solution: &Solution) -> Picture {
        let mesh = solution.tracer().mesh;
        self.of(&Field::new(mesh, &solution.elements, solution.irradiance(), &solution.exposed_area()))
    }

    fn of(&self, field: &Field) -> Picture {
        let light = |seen: &radiosity_view::picture::Seen| -> Bands {
            field.at(seen.place.triangle as usize, seen.uv, seen.side)
        };
        self.view.picture(&self.view.seen.par_iter().map(light).collect::<Vec<_>>())
    }
}

/// How first pictures are solved: few cells, none divided, and as few shadow rays as there can be.
fn coarse(options: &SolveOptions) -> SolveOptions {
    SolveOptions {
        element_size: None,
        cells: options.cells.min(CELLS),
        variation: f64::INFINITY,
        shadowing: Shadowing { places: 2, rays: 1 },
        form_factors: None,
        displayed: None,
        rays: FIRST_RAYS,
        memory: options.memory,
        ..SolveOptions::default()
    }
}

/// Shows a monitor coarse solutions, the first before any row is traced, then with 16 rays a cell and ever twice as many up to
/// 64 ([`Monitor::solved`]). They are thrown away: an answer that is asked for afterwards has the bytes that it has without.
///
/// # Errors
/// As [`Solution::new`].
pub fn preview(tracer: &Tracer, options: &SolveOptions, monitor: &dyn Monitor) -> Result<(), Error> {
    let mut solution = Solution::begin(tracer, &coarse(options), monitor)?;
    let mut rays = FIRST_RAYS;
    while rays <= MOST_RAYS {
        match solution.refine(rays, monitor) {
            // The answer may still fit, with fewer rays.
            Err(Error::Memory { .. }) => break,
            done => done?,
        }
        rays *= 2;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Mesh, cornell_box};
    use radiosity_scene::luminance;

    /// The first picture, for which the camera's part of the scene and one in sixteen of the rest are asked, is nearly that of all
    /// elements, which comes later; the same on any number of threads.
    #[test]
    fn catalogue_43_the_first_picture_is_like_that_of_all_elements() {
        let scene = cornell_box();
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let glimpse = Glimpse::new(&tracer, &scene.cameras[0], 64, 64);
        let options = SolveOptions::default();
        let first = glimpse.first(&tracer, &options, &()).unwrap();
        let all = glimpse.picture(&Solution::begin(&tracer, &coarse(&options), &()).unwrap());
        let pixels = || first.pixels.iter().zip(&all.pixels).map(|(a, b)| [a, b].map(|p| f64::from(luminance(*p))));
        let mean = pixels().map(|[_, b]| b).sum::<f64>() / 4096.0;
        let off = (pixels().map(|[a, b]| (a - b).powi(2)).sum::<f64>() / 4096.0).sqrt() / mean;
        let bias = pixels().map(|[a, b]| a - b).sum::<f64>() / 4096.0 / mean;
        assert!(off < 0.1 && bias.abs() < 0.02, "{off} {bias}");
        // The lamp fills a part of it: what is seen without light from elsewhere is not all.
        assert!(pixels().filter(|[a, _]| *a > 0.1 * mean).count() > 3000);

        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let alone = one.install(|| glimpse.first(&tracer, &options, &()).unwrap());
        assert_eq!(alone.pixels, first.pixels);
    }
}
