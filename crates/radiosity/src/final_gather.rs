//! Indirect light of a picture by a final gather (Reichert 1992, "A two-pass radiosity method driven by lights and viewer position"; catalogue 63):
//! places that pixels show look up what a solution has around them, so that contacts and corners are as sharp as pixels, however coarse
//! its elements are.
//!
//! One place in a block of a few pixels gathers for each surface that the block shows; those of a plane share what they found ([`Planes`]), and the
//! noisy ones send more rays ([`crate::allocation`]). Of what they found is shown what stands out from noise ([`crate::believed`]). Between them light is interpolated over the picture, and where it is steep every pixel gathers, shares with what blocks around found, and shows
//! what stands out over what lies between these. Places of curved surfaces share on their facets alone. Light changes with the normal there: between them lies what they found beyond the field, whether or not that is within what they found.

use crate::allocation::{Found, GATHERED_POWER, curb, growth};
use crate::answer::Station;
use crate::believed::GATHERED;
use crate::blocks::{Blocks, Shape};
use crate::pace::{self, Cost};
use crate::pixels::{DARK, seen};
use crate::points::evened;
use crate::{Baked, Error, Monitor, Solution, Timed};
use radiosity_scene::{Bands, luminance};
use radiosity_trace::Place;
use radiosity_view::picture::ViewRays;
use radiosity_view::{Finding, Planes, Pooled};
use rayon::prelude::*;
use std::f64::consts::FRAC_1_SQRT_2;
use std::time::Duration;

/// How many times as wide blocks are where time does not do for these: a sixteenth of the places, at last, takes less than the field of elements that are only
/// looked up, which is mottled.
const WIDER: [u32; 2] = [2, 4];

/// First rays of each, and the fewest where there is little time. What is smooth shares with hundreds, but how far light is smooth has to be told from noise: with 32 instead a furnished
/// room at 5 % takes 8.6 instead of 10.3 s and is 1.29 instead of 0.68 % off, in the root mean square of pixels, each relative to its own light.
const FIRST: usize = 128;
const FEWEST: usize = 16;

/// Most rays of each, in the mean: where light comes by bright paths that few rays meet, more would take minutes.
const MOST: f64 = 256.0;

/// Rays of the part that is timed.
const TIMED: usize = 64;

/// Noise that is left, relative to the error asked: in a furnished office at 2 % half as much again leaves the picture 2.0 % off instead of 1.35. And the most,
/// whatever is asked: it is seen.
const NOISE: f64 = 0.4;
const MOST_NOISE: f64 = 0.01;

/// Most noise of a place relative to its own light, over the noise asked of all.
const VISIBLE: f64 = 4.0;

/// Noise within this of what it is to be is not worth another step: what is shared falls more slowly than what each has.
const ENOUGH: f64 = 1.2;

/// A step that leaves more than this of the noise is the last, if it is a small one, too: in a hall that has light through a door 280 rays left as much as 45, and a picture of it takes 19
/// instead of 25 s where steps go on that take half of what is promised, and is as near.
const PAYS: f64 = 0.85;

/// Steps by which rays become more, at most.
const STEPS: u32 = 4;

/// Within a time limit a step is worth its while from so many times as many rays on.
const WORTH: f64 = 1.1;

/// Light that is by so much of all light unlike that of a block around is steep, and not interpolated: every pixel there gathers. With 0.1 a bright
/// slit is as near (0.81 instead of 0.87 % off, 1.26 where all is interpolated), and twice as many pixels of the Cornell box gather; with 0.3 it is 1.10 % off.
const STEEP: f32 = 0.15;

/// And by so many standard errors of the difference, or every pixel would gather where there is nothing but noise. Others were not tried.
const CLEAR: f32 = 3.0;

/// And part of those around that are steep, too: two fifths beside a straight edge, a third at the corner of something bright, next to nothing where a few are unlike each other alone, which is noise. Where one
/// is unlike all others, these are steep as well; to ask that each is unlike three of them makes the bands beside shadows ragged.
const BACKED: f32 = 0.25;

/// Blocks up to so many times [`AROUND`](crate::blocks::AROUND) from steep ones share what they found with the pixels that gather there: where these end, planes through their light alone lie below it where it is bent, which left a dark
/// line. With half and with twice as many nothing was tried.
const RIM: usize = 4;

/// Light by block.
pub(crate) struct Gathered {
    /// What all shared, lx per band.
    pub light: Vec<Bands>,
    /// What each found by itself.
    pub found: Found,
    /// Standard errors of the light, lx.
    pub noise: Vec<f32>,
    /// How far halves are [`apart`] in it, lx.
    pub apart: Vec<f32>,
    /// Whether there was time for all rays.
    pub is_whole: bool,
}

/// Noise that is asked of blocks.
struct Wanted {
    /// Root mean square by the weights, lx.
    noise: f64,
    /// By block.
    weights: Vec<f64>,
    /// Most of each, lx.
    ceilings: Vec<f64>,
}

impl Wanted {
    /// Root mean square of so much noise of each, lx.
    fn of(&self, noise: &[f32]) -> f64 {
        let squares = noise.iter().zip(&self.weights).map(|(noise, weight)| weight * f64::from(*noise).powi(2));
        (squares.sum::<f64>() / self.weights.iter().sum::<f64>()).sqrt()
    }
}

/// Indirect light of all that is seen, and whether there was time to gather it as it should be. Of a solution by a matrix of form factors the field is
/// shown as it is: what the method does not see is not put right.
///
/// # Errors
/// [`Error::Stopped`].
pub(crate) fn indirect(
    baked: &Baked,
    view: &ViewRays,
    stations: &[Station],
    monitor: &dyn Monitor,
) -> Result<(Vec<Bands>, bool), Error> {
    let solution = &baked.solution;
    let mut blocks = Blocks::new(solution, view, stations, 1);
    // Within a time limit the field has its part of the time: by what it alone shows, or half where it is shown everywhere.
    let alone = blocks.shapes.iter().filter(|shape| shape.is_none()).count() as f64 / stations.len().max(1) as f64;
    let part = if solution.options.looked_up { 1.0 - alone } else { 0.5 };
    let own = match pace::left(monitor) {
        Some(left) => Timed::new(monitor, Duration::from_secs_f64(part * left)),
        None => Timed::unlimited(monitor),
    };
    let timed = |blocks: &Blocks, is_least: bool| {
        let (seconds, gathered) = pace::timed(|| blocks.gathered(baked, stations, &[], is_least, &own));
        gathered.map(|gathered| (seconds, gathered))
    };
    let (mut seconds, mut gathered) = timed(&blocks, false)?;
    let mut is_whole = gathered.as_ref().map_or(blocks.blocks.is_empty(), |gathered| gathered.is_whole);
    for wider in WIDER {
        if gathered.is_some() || blocks.blocks.is_empty() {
            break;
        }
        blocks = Blocks::new(solution, view, stations, wider);
        let is_least = solution.options.looked_up && wider == WIDER[WIDER.len() - 1];
        (seconds, gathered) = timed(&blocks, is_least)?;
    }
    let closer = gathered.as_ref().and_then(|gathered| blocks.closer(solution, stations, gathered));
    // A deadline has to leave as much time again: the rest of the picture needs it more.
    let has_time = pace::left(&own).is_none_or(|left| pace::suffices(left, seconds));
    let closely = match &closer {
        Some((closer, rim)) if has_time => closer.gathered(baked, stations, rim, false, &own)?,
        _ => None,
    };
    let closer = closer.map(|(closer, _)| closer);
    is_whole &= closer.is_none() || closely.as_ref().is_some_and(|gathered| gathered.is_whole);
    // Elements that are only looked up make no field that is worth a look.
    let is_shown = |place: usize| !(solution.options.looked_up && gathered.is_some() && blocks.shapes[place].is_some());
    let mut looks = vec![0; solution.elements.cells()];
    for Station { place, uv, side } in (0..stations.len()).filter(|place| is_shown(*place)).map(|i| stations[i]) {
        if let Some(element) = solution.elements.at(place.triangle, uv.x as f32, uv.y as f32, side) {
            looks[solution.elements.cell(element)] += 1;
        }
    }
    let mut light = vec![[0.0; 3]; stations.len()];
    if looks.iter().any(|looks| *looks > 0) {
        let field = solution.field_on(&looks, baked.received.clone(), baked.error, monitor)?;
        light.par_iter_mut().zip(stations).enumerate().filter(|(i, _)| is_shown(*i)).for_each(|(_, (light, s))| {
            *light = field.at(s.place.triangle as usize, s.uv, s.side);
        });
    }
    let chosen = |blocks: &Blocks, light: &[Bands]| -> Vec<Bands> {
        blocks.blocks.iter().map(|block| light[block.chosen as usize]).collect()
    };
    if let Some(mut gathered) = gathered {
        let field = chosen(&blocks, &light);
        let below = (!solution.options.looked_up).then_some(&field[..]);
        gathered.light = blocks.beside.by_scales(&gathered.light, &gathered.apart, below, &GATHERED);
        blocks.add(&gathered.light, &field, &mut light);
    }
    if let Some((closer, Gathered { light: found, apart: noise, .. })) = closer.zip(closely) {
        let found = closer.beside.by_scales(&found, &noise, Some(&chosen(&closer, &light)), &GATHERED);
        for (block, found) in closer.blocks.iter().zip(found) {
            block.places.iter().for_each(|place| light[*place as usize] = found);
        }
    }
    Ok((light, is_whole))
}

/// What the rays of a place found.
fn finding(Station { place, side, .. }: &Station, found: &Found, own: usize) -> Finding {
    let (point, triangle) = (place.point, place.triangle as usize);
    Finding { point, triangle, side: *side, light: found.light[own], noise: found.apart[own], weight: 1.0 }
}

impl<'a> Blocks<'a> {
    /// Blocks of a pixel where what these gathered of flat surfaces is steep, no more than there are of these, where it is steepest, and what others around them found; nothing where it is nowhere.
    fn closer(
        &self,
        solution: &Solution,
        stations: &[Station],
        gathered: &Gathered,
    ) -> Option<(Blocks<'a>, Vec<Finding>)> {
        if self.side == 1 {
            return None;
        }
        let level = |own: usize| luminance(gathered.light[own]);
        let steepness = |own: usize| {
            let direct = solution.element_at(&seen(self.view, self.blocks[own].chosen).place);
            let all = level(own) + luminance(direct.map_or([0.0; 3], |e| solution.columns.mean(e as usize)));
            let to = |other: usize| {
                let off = (level(own) - level(other)).abs();
                let is_clear = off > CLEAR * gathered.noise[own].hypot(gathered.noise[other]);
                if is_clear { off / all.max(f32::MIN_POSITIVE) } else { 0.0 }
            };
            self.beside.0[own].iter().map(|other| to(*other as usize)).fold(0.0, f32::max)
        };
        let steepness: Vec<f32> = (0..self.blocks.len()).into_par_iter().map(steepness).collect();
        let is_steep = |own: usize| steepness[own] > STEEP && self.is_flat(own);
        // Those of which few around are steep as well are unlike each other by their noise, and would be dots.
        let is_backed = |own: &usize| {
            let beside = &self.beside.0[*own];
            let backing = beside.iter().filter(|other| is_steep(**other as usize)).count();
            backing as f32 >= BACKED * beside.len() as f32
        };
        let mut steep: Vec<usize> = (0..self.blocks.len()).filter(|own| is_steep(*own) && is_backed(own)).collect();
        steep.sort_by(|a, b| steepness[*b].total_cmp(&steepness[*a]).then(a.cmp(b)));
        let mut shapes = vec![None; self.shapes.len()];
        let mut left = self.blocks.len();
        let mut is_near = vec![false; self.blocks.len()];
        for own in &steep {
            let places = &self.blocks[*own].places;
            let Some(rest) = left.checked_sub(places.len()) else { break };
            left = rest;
            is_near[*own] = true;
            places.iter().for_each(|place| shapes[*place as usize] = Some(Shape::Flat));
        }
        if steep.is_empty() {
            return None;
        }
        for _ in 0..RIM {
            let reaches = |own: usize| is_near[own] || self.beside.0[own].iter().any(|other| is_near[*other as usize]);
            is_near = (0..is_near.len()).into_par_iter().map(reaches).collect();
        }
        let is_rim = |own: &usize| is_near[*own] && shapes[self.blocks[*own].chosen as usize].is_none();
        let found = |own: usize| finding(&stations[self.blocks[own].chosen as usize], &gathered.found, own);
        // All together no more than there were: memory was asked for as many.
        let rim = (0..is_near.len()).filter(is_rim).take(left).map(found).collect();
        Some((Blocks::of(self.view, shapes, 1, self.blocks.len()), rim))
    }

    /// Light that the chosen places gather, and share with each other and with what a `rim` around them found; nothing where time does not do for the fewest rays, unless this `is_least` that is done.
    fn gathered(
        &self,
        baked: &Baked,
        stations: &[Station],
        rim: &[Finding],
        is_least: bool,
        monitor: &dyn Monitor,
    ) -> Result<Option<Gathered>, Error> {
        let solution = &baked.solution;
        let at: Vec<Station> = self.blocks.iter().map(|block| stations[block.chosen as usize]).collect();
        if at.is_empty() {
            return Ok(None);
        }
        let places: Vec<Place> = at.iter().map(|station| station.place).collect();
        let mut first = FIRST;
        if let Some(left) = pace::left(monitor) {
            let cost = cost(solution, &places, monitor)?;
            if !is_least && !pace::suffices(left, cost.seconds(FEWEST as f64)) {
                return Ok(None);
            }
            first = cost.rays(left, [FEWEST, FIRST].map(|rays| rays as f64)) as usize;
        }

        let planes = Planes::new(solution.tracer().mesh, &solution.elements);
        let share = |found: &Found| -> Vec<Pooled> {
            // Those of one plane that receive with other normals are not alike.
            let (flat, curved): (Vec<usize>, Vec<usize>) = (0..at.len()).partition(|own| self.is_flat(*own));
            let mut shared = vec![Pooled::alone([0.0; 3], 0.0); at.len()];
            for (own, rim) in [(flat, rim), (curved, &[])] {
                let findings = own.iter().map(|i| finding(&at[*i], found, *i)).chain(rim.iter().copied());
                let pooled = planes.pooled(&findings.collect::<Vec<_>>());
                own.into_iter().zip(pooled).for_each(|(own, pooled)| shared[own] = pooled);
            }
            shared
        };
        let (seconds, halves) = pace::timed(|| solution.halves_at(&places, first, 0, monitor));
        let each = seconds / first as f64;
        let mut found = Found::of_halves(&halves?, first as u32, evened);
        // Halves of places around together tell the noise, bright paths and all; what is evened out by light takes part of these for detail.
        let mut pooled = share(&found);
        let wanted = self.wanted(baked, &places, &pooled);
        let none = vec![f64::INFINITY; at.len()];
        let mut is_whole = first == FIRST;
        let noise = |pooled: &[Pooled], found: &Found| -> Vec<f32> {
            // Two halves alone say little of a place that shares with none.
            let noise = |(pooled, noise): (&Pooled, &f32)| if pooled.own < 1.0 { pooled.spread } else { *noise };
            pooled.iter().zip(&found.noise).map(noise).collect()
        };
        let mut noise_left = f64::INFINITY;
        for step in 1..=STEPS {
            let spread = noise(&pooled, &found);
            let noise_before = std::mem::replace(&mut noise_left, wanted.of(&spread));
            if step > 1 && (noise_left <= ENOUGH * wanted.noise || noise_left > PAYS * noise_before) {
                break;
            }
            // Once the noisiest have had their share, what counts is the noise of all.
            let ceilings = if step == 1 { &wanted.ceilings } else { &none };
            let mut times = growth(&spread, &wanted.weights, ceilings, wanted.noise, GATHERED_POWER);
            let had = found.rays.iter().map(|rays| f64::from(*rays)).sum::<f64>() / at.len() as f64;
            let most = MOST / had;
            // Rays are doubled or not, so that they may become √2 times as many as is said.
            let there_is_time = |left| (1.0 + pace::affordable(left, each) as f64 / had) * FRAC_1_SQRT_2;
            let allowed = pace::left(monitor).map_or(most, |left| most.min(there_is_time(left)));
            let all = curb(&mut times, &found.rays, Some(allowed));
            is_whole &= all.min(most) <= allowed.max(1.0);
            if allowed < WORTH {
                break;
            }
            let any = found.grow_by_halves((&times, GATHERED_POWER), |own, rays| {
                let at: Vec<Place> = own.iter().map(|i| places[*i]).collect();
                solution.halves_at(&at, rays as usize, step, monitor)
            })?;
            if !any {
                break;
            }
            pooled = share(&found);
        }
        // What paths find beyond what they look up may be less than nothing.
        let light = pooled.iter().map(|p| p.light.map(|e| e.max(0.0))).collect();
        let apart = pooled.iter().map(|pooled| pooled.noise).collect();
        let noise = noise(&pooled, &found);
        Ok(Some(Gathered { light, found, noise, apart, is_whole }))
    }

    /// What noise is asked of `places`, one for each block, by what they found so far: it counts as the audit has it and as the eye does, relative to what light there is.
    fn wanted(&self, baked: &Baked, places: &[Place], pooled: &[Pooled]) -> Wanted {
        let solution = &baked.solution;
        let direct = |place: &Place| solution.element_at(place).map_or([0.0; 3], |e| solution.columns.mean(e as usize));
        let all = |(place, pooled): (&Place, &Pooled)| f64::from(luminance(direct(place)) + luminance(pooled.light));
        let size: Vec<f64> = places.iter().zip(pooled).map(all).collect();
        let pixels: Vec<f64> = self.blocks.iter().map(|block| block.places.len() as f64).collect();
        let count: f64 = pixels.iter().sum();
        let mean_of = |of: &dyn Fn(f64) -> f64| size.iter().zip(&pixels).map(|(e, n)| n * of(*e)).sum::<f64>() / count;
        let (average, square) = (mean_of(&|e| e), mean_of(&|e| e * e));
        let counted: Vec<f64> = size.iter().map(|e| e.max(DARK * average)).collect();
        let weight = |(e, n): (&f64, &f64)| 0.5 * n * (1.0 / square + 1.0 / (e * e));
        let weights: Vec<f64> = counted.iter().zip(&pixels).map(weight).collect();
        let asked = (NOISE * baked.error).min(MOST_NOISE);
        Wanted {
            noise: asked * (count / weights.iter().sum::<f64>()).sqrt(),
            ceilings: counted.iter().map(|e| VISIBLE * asked * e).collect(),
            weights,
        }
    }
}

/// What places take to gather by their rays, by a part of them.
fn cost(solution: &Solution, places: &[Place], monitor: &dyn Monitor) -> Result<Cost, Error> {
    let (some, parts) = pace::sample(places);
    let time = |rays: usize| {
        let (seconds, halves) = pace::timed(|| solution.halves_at(&some, rays, 0, monitor).map(drop));
        halves.map(|()| (rays as f64, seconds))
    };
    Ok(Cost::new([time(FEWEST)?, time(TIMED)?], parts))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::allocation::mean;
    use crate::blocks::{AROUND, is_flat};
    use crate::pixels::pixel;
    use crate::{BakeOptions, Mesh, SolveOptions, Tracer, bake, cornell_box};
    use glam::{DVec3, Quat, Vec3};
    use radiosity_scene::Scene;
    use radiosity_trace::sampling::{hash, unit};
    use std::collections::HashMap;
    use std::f32::consts::TAU;

    /// The Cornell box, with a pillar beside its blocks that is round by the normals of its corners.
    fn with_pillar(radius: f64) -> Scene {
        let mut scene = cornell_box();
        let middle = DVec3::new(0.42, 0.0, 0.12);
        let outwards = |i: usize| DVec3::from(Quat::from_rotation_y(-TAU * i as f32 / 12.0) * Vec3::X);
        let at = |i: usize, y: f64| middle + radius * outwards(i) + DVec3::new(0.0, y, 0.0);
        for i in 0..12 {
            let first = scene.positions.len();
            scene.add_quad("pillar", 0, [at(i, 0.0), at(i, 0.4), at(i + 1, 0.4), at(i + 1, 0.0)]);
            let normal = |corner: usize| (scene.positions[corner] - middle).with_y(0.0).normalize().as_vec3();
            let normals: Vec<Vec3> = (first..scene.positions.len()).map(normal).collect();
            scene.normals.splice(first.., normals);
        }
        scene
    }

    /// Pillars, as wide as some pixels and as many, that are round by their normals are nearer to what many rays gather at their pixels than the field of
    /// elements is, and smooth from one pixel to the next.
    #[test]
    fn curved_surfaces_gather_too() {
        for radius in [0.012, 0.06] {
            let scene = with_pillar(radius);
            let mesh = Mesh::new(&scene);
            let tracer = Tracer::new(&scene, &mesh);
            let baked = bake(&tracer, &coarse(SolveOptions::default().memory), &()).unwrap();
            let view = ViewRays::new(&tracer, &scene.cameras[0], 96, 96);
            let stations = stations(&view);
            let (light, _) = indirect(&baked, &view, &stations, &()).unwrap();
            let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
            assert!(one.install(|| indirect(&baked, &view, &stations, &())).unwrap().0 == light);
            let is_curved = |i: &usize| !is_flat(&baked.solution, &stations[*i]);
            let curved: Vec<usize> = (0..stations.len()).filter(is_curved).collect();
            let places: Vec<Place> = curved.iter().map(|i| stations[*i].place).collect();
            let truth = baked.solution.halves_at(&places, 1024, 99, &()).unwrap();
            let off = |light: &dyn Fn(usize) -> Bands| {
                let squares = curved.iter().zip(&truth).map(|(i, truth)| {
                    let light = luminance(light(*i));
                    (light / luminance(mean(truth.light)) - 1.0).powi(2)
                });
                (squares.sum::<f32>() / curved.len() as f32).sqrt()
            };
            let gathered = off(&|i| light[i]);
            let field = off(&|i| baked.field.at(stations[i].place.triangle as usize, stations[i].uv, stations[i].side));
            let at: HashMap<[u32; 2], f32> =
                curved.iter().map(|i| (pixel(&view, *i as u32), luminance(light[*i]))).collect();
            let rough = curved.iter().filter_map(|i| {
                let [x, y] = pixel(&view, *i as u32);
                let beside = 0.5 * (at.get(&[x, y.checked_sub(1)?])? + at.get(&[x, y + 1])?);
                Some((at[&[x, y]] / beside - 1.0).powi(2))
            });
            let rough: Vec<f32> = rough.collect();
            let rough = (rough.iter().sum::<f32>() / rough.len() as f32).sqrt();
            assert!(
                gathered < 0.11 && gathered < 0.3 * field && rough < 0.05,
                "{gathered} instead of {field}, rough {rough}"
            );
        }
    }

    /// What a camera sees of the Cornell box, whose elements are as wide as a quarter of its walls, is nearer to what many rays gather than the field of
    /// these elements, and about half as far off.
    #[test]
    fn catalogue_63_contacts_are_as_sharp_as_pixels() {
        let scene = cornell_box();
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let baked = bake(&tracer, &coarse(SolveOptions::default().memory), &()).unwrap();
        let view = ViewRays::new(&tracer, &scene.cameras[0], 64, 64);
        let stations = stations(&view);
        let (light, is_whole) = indirect(&baked, &view, &stations, &()).unwrap();
        assert!(is_whole);
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert!(one.install(|| indirect(&baked, &view, &stations, &())).unwrap().0 == light);
        let nothing = ViewRays { seen: Vec::new(), ..view.clone() };
        assert_eq!(indirect(&baked, &nothing, &[], &()).unwrap(), (Vec::new(), true));

        let some: Vec<usize> = (0..stations.len()).step_by(16).collect();
        let places: Vec<Place> = some.iter().map(|i| stations[*i].place).collect();
        let truth = baked.solution.halves_at(&places, 1024, 99, &()).unwrap();
        let off = |light: &dyn Fn(usize) -> Bands| {
            let squares = some.iter().zip(&truth).map(|(i, truth)| {
                let truth = f64::from(luminance(mean(truth.light)));
                [(f64::from(luminance(light(*i))) - truth).powi(2), truth.powi(2)]
            });
            let [off, all] = squares.fold([0.0; 2], |sum, square| [sum[0] + square[0], sum[1] + square[1]]);
            (off / all).sqrt()
        };
        let gathered = off(&|i| light[i]);
        let field = off(&|i| baked.field.at(stations[i].place.triangle as usize, stations[i].uv, stations[i].side));
        assert!(gathered < 0.45 * field && gathered < 0.04, "{gathered} instead of {field}");
    }

    /// Elements of the box as wide as a quarter of its walls.
    fn coarse(memory: usize) -> BakeOptions {
        let solve = SolveOptions { element_size: Some(0.14), memory, ..SolveOptions::default() };
        BakeOptions { error: 0.02, solve, rounds: 0, ..BakeOptions::default() }
    }

    fn stations(view: &ViewRays) -> Vec<Station> {
        view.seen.iter().map(|seen| Station { place: seen.place, uv: seen.uv, side: seen.side }).collect()
    }

    /// Pixels gather, each, where light falls from one block to another by more than a seventh, unless that may be noise; and not those of the top alone
    /// where it is steep everywhere.
    #[test]
    fn pixels_gather_where_light_is_steep() {
        let scene = cornell_box();
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let solve = SolveOptions { element_size: Some(0.14), ..SolveOptions::default() };
        let solution = Solution::new(&tracer, &solve, &()).unwrap();
        let view = ViewRays::new(&tracer, &scene.cameras[0], 64, 64);
        let blocks = Blocks::new(&solution, &view, &stations(&view), 2);
        let closer = |level: &dyn Fn(u32, [u32; 2]) -> f32, noise: f32| {
            let light: Vec<Bands> = (0..).zip(&blocks.blocks).map(|(i, block)| [level(i, block.square); 3]).collect();
            let noise = vec![noise; light.len()];
            let found = Found { light: light.clone(), apart: noise.clone(), ..Found::default() };
            let gathered = Gathered { light, apart: noise.clone(), found, noise, is_whole: true };
            blocks.closer(&solution, &stations(&view), &gathered)
        };
        // Far more than the direct light there.
        let step = |by: f32| move |_, [x, _]: [u32; 2]| if x < 16 { 1e6 } else { 1e6 * (1.0 + by) };
        let steep = closer(&step(0.2), 0.0).unwrap().0.blocks;
        let reach = 16 - AROUND..16 + AROUND;
        assert!((460..540).contains(&steep.len()), "{} of 8 columns", steep.len());
        assert!(steep.iter().all(|block| reach.contains(&(block.square[0] / 2))));
        assert!(closer(&step(0.1), 0.0).is_none() && closer(&step(0.2), 1e5).is_none());
        // Two that differ by a sixth, and from all others by half of that, would be dots.
        let number = |square: [u32; 2]| blocks.blocks.iter().position(|block| block.square == square).unwrap() as u32;
        let two = [[15, 15], [16, 15]].map(number);
        let pair = |i: u32, _| {
            let by = if i == two[0] { 0.09 } else { -0.09 };
            1e6 * if two.contains(&i) { 1.0 + by } else { 1.0 }
        };
        assert!(closer(&pair, 0.0).is_none());

        // What others found lies around, not far away.
        let (own, rim) = closer(&step(0.2), 0.0).unwrap();
        let is_rim = |finding: &Finding| {
            let seen = view.seen.iter().position(|seen| seen.place.point == finding.point).unwrap();
            let x = pixel(&view, seen as u32)[0] / 2;
            own.shapes[seen].is_none() && (16 - 5 * AROUND..16 + 5 * AROUND).contains(&x)
        };
        assert!(rim.len() > 100 && rim.iter().all(is_rim), "{}", rim.len());

        let steep = closer(&|i, _| 1e6 * (1.0 + unit(hash(i))), 0.0).unwrap().0.blocks;
        let row = steep.iter().map(|block| f64::from(block.square[1])).sum::<f64>() / steep.len() as f64;
        assert!(steep.len() <= blocks.blocks.len() && 10 * steep.len() > 9 * blocks.blocks.len());
        assert!((24.0..40.0).contains(&row), "{row}");
    }

    /// What every pixel gathers where light is steep is near to what many rays find there, and the same on any number of threads.
    #[test]
    fn steep_light_is_what_pixels_find() {
        let scene = cornell_box();
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        // So little memory that blocks are two pixels wide.
        let baked = bake(&tracer, &coarse(30 << 20), &()).unwrap();
        let view = ViewRays::new(&tracer, &scene.cameras[0], 128, 128);
        let stations = stations(&view);
        let (light, is_whole) = indirect(&baked, &view, &stations, &()).unwrap();
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        assert!(is_whole && one.install(|| indirect(&baked, &view, &stations, &())).unwrap().0 == light);

        let blocks = Blocks::new(&baked.solution, &view, &stations, 1);
        assert_eq!(blocks.side, 2);
        let gathered = blocks.gathered(&baked, &stations, &[], false, &()).unwrap().unwrap();
        let (closer, _) = blocks.closer(&baked.solution, &stations, &gathered).unwrap();
        // What lies between blocks, over the field that the picture has: without pixels that gather all of it would be that.
        let solution = &baked.solution;
        assert!(!solution.options.looked_up);
        let mut looks = vec![0; solution.elements.cells()];
        for s in &stations {
            let element = solution.elements.at(s.place.triangle, s.uv.x as f32, s.uv.y as f32, s.side).unwrap();
            looks[solution.elements.cell(element)] += 1;
        }
        let field = solution.field_on(&looks, baked.received.clone(), baked.error, &()).unwrap();
        let at = |s: &Station| field.at(s.place.triangle as usize, s.uv, s.side);
        let mut between: Vec<Bands> = stations.iter().map(at).collect();
        let field: Vec<Bands> = blocks.blocks.iter().map(|block| between[block.chosen as usize]).collect();
        let shown = blocks.beside.by_scales(&gathered.light, &gathered.apart, Some(&field), &GATHERED);
        blocks.add(&shown, &field, &mut between);
        assert!((0..light.len()).all(|i| closer.shapes[i].is_some() || light[i] == between[i]));
        let some: Vec<usize> = closer.blocks.iter().step_by(4).map(|block| block.chosen as usize).collect();
        let places: Vec<Place> = some.iter().map(|i| stations[*i].place).collect();
        let truth = baked.solution.halves_at(&places, 1024, 99, &()).unwrap();
        let off = |light: &[Bands]| {
            let squares = some.iter().zip(&truth).map(|(i, truth)| {
                let truth = luminance(mean(truth.light));
                [(luminance(light[*i]) - truth).powi(2), truth.powi(2)]
            });
            let [off, all] = squares.fold([0.0; 2], |sum, square| [sum[0] + square[0], sum[1] + square[1]]);
            (off / all).sqrt()
        };
        let [own, interpolated] = [off(&light), off(&between)];
        assert!(some.len() > 500 && own < 0.025 && own < 0.7 * interpolated, "{own} instead of {interpolated}");
    }

    /// What places count by the noise of each relative to its light is the same for some that have ten times as much as others.
    #[test]
    fn noise_counts_relative_to_each_places_own_light() {
        let scene = cornell_box();
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let baked = bake(&tracer, &coarse(SolveOptions::default().memory), &()).unwrap();
        let view = ViewRays::new(&tracer, &scene.cameras[0], 16, 16);
        let stations = stations(&view);
        let blocks = Blocks::new(&baked.solution, &view, &stations, 1);
        let places: Vec<Place> = blocks.blocks.iter().map(|block| stations[block.chosen as usize].place).collect();
        // Far more than the direct light there.
        let level = |i: usize| if i.is_multiple_of(50) { 1e9 } else { 1e8 };
        let pooled: Vec<Pooled> = (0..places.len()).map(|i| Pooled::alone([level(i); 3], 0.0)).collect();
        let wanted = blocks.wanted(&baked, &places, &pooled);
        let part = |own: usize| wanted.weights[own] * f64::from(level(own)).powi(2);
        let square = (0..places.len()).map(|i| f64::from(level(i)).powi(2)).sum::<f64>() / places.len() as f64;
        let expected = |own: usize| 0.5 * (f64::from(level(own)).powi(2) / square + 1.0);
        for own in [0, 1] {
            assert!((part(own) / expected(own) - 1.0).abs() < 0.02, "{} {}", part(own), expected(own));
        }
    }
}
