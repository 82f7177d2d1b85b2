//! Light of texels: a few rays for each, then more for those whose first ones disagree
//! ([`crate::allocation`]), by what halves differ by after light was shared ([`Atlas::pooled`]); direct light of thinned ones is not. In a furnished office a
//! twentieth of the texels has two thirds of the squared error, if all have as many rays.

use crate::allocation::{DIRECT_POWER, Found, GATHERED_POWER, curb, growth};
use crate::answer::Station;
use crate::bake::{Baked, gather_rays};
use crate::believed::{GATHERED, Neighbours};
use crate::judge::{root_mean_square, thinned as thin};
use crate::measure::rays_for;
use crate::pace;
use crate::points::{shadowing, unless_dark};
use crate::{Error, Monitor};
use radiosity_scene::{Bands, luminance};
use radiosity_trace::Place;
use radiosity_view::Pooled;
use radiosity_view::lightmap::{Atlas, Texel};

/// First gather rays of a texel, at most. Those of neighbours count with them where light comes in through a window, which takes
/// some hundreds in all; and small things have few texels to share with: with half as many they are as different as checks are.
const FIRST_GATHERED: usize = 64;

/// First shadow rays of a texel at 1 %, of both halves; at the least, as fewer would leave many of a dozen lamps without any; and at the most: more
/// go where they are needed.
const FIRST_SHADOW: f64 = 128.0;
const LEAST_SHADOW: usize = 32;
const MOST_SHADOW: usize = 1024;

/// Noise that is left in what is gathered, and in direct light, relative to the error asked: two fifths of the squared error
/// together, the rest of what solutions may have ([`crate::judge`]) is for what is not noise.
const GATHERED_NOISE: f64 = 0.5;
const DIRECT_NOISE: f64 = 0.4;

/// Noise of one texel relative to its own light at most, about, in errors asked. In a furnished office at 2 % twice as much saves a fifteenth of
/// the gather rays, and two thirds of it take a third more of them.
const VISIBLE: f64 = 3.0;

/// Light below this part of the mean counts as if it was as much: in the dark little is seen. In a furnished office at 2 % the noise of
/// small dark things that this allows takes a fifteenth of the rays; with a tenth, more than twice as many are needed in all.
const DARK: f64 = 0.25;

/// A page and those of its texels that are lit, none of them inside a solid.
#[derive(Clone, Copy)]
pub(crate) struct Sheet<'a> {
    pub atlas: &'a Atlas,
    pub page: usize,
    pub texels: &'a [Texel],
}

/// Light by texel, lx per band.
pub(crate) struct TexelLight {
    pub direct: Vec<Bands>,
    pub indirect: Vec<Pooled>,
}

/// Gather rays and shadow rays that are planned for a texel within a deadline (in a furnished office at 2 % texels have 158 and 161 in the mean
/// without one, and these are 128 and 256); and those of the further points of one texel together.
pub(crate) fn usual_rays(error: f64) -> [usize; 2] {
    [1, 2].map(|times| times * gather_rays(error))
}

/// Lights the texels of a page that lie at stations. Where they are `thinned`, each has that part of the usual rays, and none more.
///
/// # Errors
/// [`Error::Stopped`].
pub(crate) fn light(
    baked: &Baked,
    sheet: Sheet,
    at: &[Station],
    (gathers, thinned): (bool, f64),
    monitor: &dyn Monitor,
) -> Result<TexelLight, Error> {
    let (solution, error) = (&baked.solution, baked.error);
    let places: Vec<Place> = at.iter().map(|station| station.place).collect();
    let of = |own: &[usize]| -> Vec<Place> { own.iter().map(|i| places[*i]).collect() };
    let evened = |_: &[Bands], apart: &[f32]| sheet.atlas.evened(sheet.page, sheet.texels, apart);
    let pooled = |found: &Found| sheet.atlas.pooled(sheet.page, sheet.texels, &found.light, &found.noise, &found.rays);
    // Noisier ones have more shadow rays, so that all weigh about the same.
    let alike = vec![1; at.len()];
    let shared_direct = |found: &Found| {
        unless_dark(found, sheet.atlas.pooled(sheet.page, sheet.texels, &found.light, &found.noise, &alike))
    };

    // By scales, as far as halves of the rays agree ([`crate::believed`]).
    let believed = |found: &Found| -> Vec<Pooled> {
        let mut shared = sheet.atlas.pooled(sheet.page, sheet.texels, &found.light, &found.apart, &found.rays);
        let (light, apart): (Vec<Bands>, Vec<f32>) = shared.iter().map(|p| (p.light, p.noise)).unzip();
        let beside = Neighbours(sheet.atlas.beside(sheet.page, sheet.texels));
        let light = beside.by_scales(&light, &apart, None, &GATHERED);
        let is_finite = |shared: &Pooled| shared.light.iter().all(|e| e.is_finite());
        let finite = shared.iter_mut().zip(light).filter(|(shared, _)| is_finite(shared));
        finite.for_each(|(shared, light)| shared.light = light);
        shared
    };
    let gathered = |rays: usize| -> Result<Option<Found>, Error> {
        if !gathers {
            return Ok(None);
        }
        let halves = solution.halves_at(&places, rays, 0, monitor)?;
        Ok(Some(Found::of_halves(&halves, rays as u32, evened)))
    };
    let of_field = || {
        let told = |s: &Station| baked.field.at(s.place.triangle as usize, s.uv, s.side);
        at.iter().map(|s| Pooled { light: told(s), own: 1.0, noise: 0.0, spread: 0.0 }).collect()
    };
    if thinned < 1.0 {
        let [gather, shadow] = usual_rays(error).map(|rays| thin(rays, thinned));
        let direct = solution.direct_at(&places, &shadowing(shadow), monitor)?;
        let indirect = gathered(gather)?.as_ref().map_or_else(of_field, believed);
        return Ok(TexelLight { direct, indirect });
    }

    let first = gather_rays(error).min(FIRST_GATHERED);
    let shadow = rays_for(error, FIRST_SHADOW, LEAST_SHADOW, MOST_SHADOW);
    let halves = solution.direct_halves_of(&solution.places(places.clone(), 1), &shadowing(shadow / 2), monitor)?;
    let mut direct = Found::of_halves(&halves, shadow as u32, evened);
    let mut gathered = gathered(first)?;
    let mut indirect = gathered.as_ref().map_or_else(of_field, pooled);
    let mut area = sheet.atlas.areas(sheet.texels);
    area.iter_mut().zip(&places).for_each(|(area, place)| *area *= solution.counts(place.triangle as usize));
    let size = root_mean_square(solution);
    let ceiling =
        |(d, p): (&Bands, &Pooled)| VISIBLE * error * f64::from(luminance(*d) + luminance(p.light)).max(DARK * size);
    let mut lit = shared_direct(&direct);
    let ceilings: Vec<f64> = direct.light.iter().zip(&indirect).map(ceiling).collect();
    // What is planned within a deadline are the usual rays, and no more are sent.
    let [most_gathered, most_shadow] = usual_rays(error).map(|rays| pace::left(monitor).map(|_| rays as f64));
    let spread: Vec<f32> = lit.iter().map(|p| p.spread).collect();
    let mut times = growth(&spread, &area, &ceilings, DIRECT_NOISE * error * size, DIRECT_POWER);
    curb(&mut times, &direct.rays, most_shadow.map(|most| most / shadow as f64));
    direct.grow((&times, DIRECT_POWER), |own, rays| {
        solution.direct_by(&of(own), &shadowing(rays as usize), 3, monitor)
    })?;
    lit = shared_direct(&direct);
    if let Some(gathered) = &mut gathered {
        let spread: Vec<f32> = indirect.iter().map(|p| p.spread).collect();
        let mut times = growth(&spread, &area, &ceilings, GATHERED_NOISE * error * size, GATHERED_POWER);
        curb(&mut times, &gathered.rays, most_gathered.map(|most| most / first as f64));
        gathered.grow_by_halves((&times, GATHERED_POWER), |own, rays| {
            solution.halves_at(&of(own), rays as usize, 1, monitor)
        })?;
        indirect = believed(gathered);
    }
    Ok(TexelLight { direct: lit.into_iter().map(|p| p.light).collect(), indirect })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::allocation::mean;
    use crate::canvas::Canvas;
    use crate::{AlphaMode, BakeOptions, Material, Mesh, Scene, Sky, SolveOptions, Tracer, bake};
    use glam::DVec3;
    use radiosity_view::lightmap::UnwrapParams;

    /// A room that is lit through a window of 40 × 40 cm, in a wall that might be cut out by its opacity and is not: past its edges no opening is looked for.
    fn room() -> Scene {
        let mut scene = Scene { sky: Sky::Uniform([1000.0; 3]), ..Scene::default() };
        scene.materials.push(Material { base_color: [0.6, 0.6, 0.6, 1.0], ..Material::default() });
        let base_color = [0.6, 0.6, 0.6, 0.9];
        let alpha_mode = AlphaMode::Mask { cutoff: 0.5 };
        scene.materials.push(Material { base_color, alpha_mode, ..Material::default() });
        let mut quad = |corners: [[f64; 3]; 4]| {
            let is_front = corners.iter().all(|[.., z]| *z == 0.0);
            scene.add_quad("room", usize::from(is_front), corners.map(DVec3::from));
        };
        quad([[0., 0., 0.], [0., 0., 4.], [4., 0., 4.], [4., 0., 0.]]);
        quad([[0., 3., 0.], [4., 3., 0.], [4., 3., 4.], [0., 3., 4.]]);
        quad([[0., 0., 0.], [0., 3., 0.], [0., 3., 4.], [0., 0., 4.]]);
        quad([[4., 0., 0.], [4., 0., 4.], [4., 3., 4.], [4., 3., 0.]]);
        quad([[0., 0., 4.], [0., 3., 4.], [4., 3., 4.], [4., 0., 4.]]);
        let pieces = [([0., 1.8], [0., 3.]), ([2.2, 4.], [0., 3.]), ([1.8, 2.2], [0., 1.3]), ([1.8, 2.2], [1.7, 3.])];
        for ([x0, x1], [y0, y1]) in pieces {
            quad([[x0, y0, 0.], [x1, y0, 0.], [x1, y1, 0.], [x0, y1, 0.]]);
        }
        scene
    }

    /// What few rays found through a small window is believed as far as halves of them agree, over what texels share.
    #[test]
    fn dots_of_gathered_light_do_not_show() {
        let scene = room();
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        assert!(tracer.openings().is_empty());
        let solve = SolveOptions { element_size: Some(0.4), ..SolveOptions::default() };
        let baked =
            bake(&tracer, &BakeOptions { error: 0.05, solve, rounds: 0, ..BakeOptions::default() }, &()).unwrap();
        let params = UnwrapParams { texels_per_metre: 10.0, ..UnwrapParams::default() };
        let canvas = Canvas::new(&baked.solution, &params).unwrap();
        let atlas = canvas.charts.pack(&params).unwrap();
        let texels = atlas.texels(0);
        let at = canvas.stations(&texels);
        let places: Vec<Place> = at.iter().map(|station| station.place).collect();
        let truth = baked.solution.halves_at(&places, 2048, 99, &()).unwrap();
        let truth: Vec<f32> = truth.iter().map(|half| luminance(mean(half.light))).collect();
        let size = (truth.iter().map(|e| e * e).sum::<f32>() / truth.len() as f32).sqrt();
        let sheet = Sheet { atlas: &atlas, page: 0, texels: &texels };
        let off = |of: &dyn Fn(usize) -> Bands| {
            let square = |i: usize| (luminance(of(i)) - truth[i]).powi(2);
            ((0..truth.len()).map(square).sum::<f32>() / truth.len() as f32).sqrt() / size
        };
        let rays = thin(usual_rays(baked.error)[0], 0.5);
        let halves = baked.solution.halves_at(&places, rays, 0, &()).unwrap();
        let found = Found::of_halves(&halves, rays as u32, |_, apart| atlas.evened(0, &texels, apart));
        let shared = atlas.pooled(0, &texels, &found.light, &found.noise, &found.rays);
        let believed = light(&baked, sheet, &at, (true, 0.5), &()).unwrap().indirect;
        let [shared, believed] = [shared, believed].map(|pooled| off(&|i| pooled[i].light));
        assert!(believed < 0.75 * shared, "{believed} and {shared}");
        // Those that had more rays by their noise, too.
        let grown = light(&baked, sheet, &at, (true, 1.0), &()).unwrap().indirect;
        let grown = off(&|i| grown[i].light);
        assert!(grown < 0.11, "{grown}");
    }
}
