//! View factors between surfaces of many facets: pair by pair of facets, or by rays from all over each surface.
//!
//! Pairs of facets grow as the square of their number, and with what stands between them so does the work for each; rays only ask how many
//! surfaces there are and how exact factors are to be. So furniture goes by rays, at least where no more than some digits are asked for, and
//! walls that are cut into patches go pair by pair. Rays are those of the hemisphere (Malley 1988; catalogue 28) from places on all facets
//! of a surface, doubled until the stated errors of its factors are as asked. Either direction tells of a pair: A_i F_ij is what the rays of
//! both together tell, and is stored once.

use super::clear::Exchange;
use super::contact::exposed;
use super::store::Entry;
use super::{BYTES, Choices, FactorError, Planes, TOUCH, ViewFactorOptions, ViewFactors, panels, view_factors};
use crate::pair::Factor;
use crate::pair::blockers::is_inside;
use crate::row::RowFactors;
use crate::row::around::Around;
use crate::row::hemisphere::Counts;
use crate::row::points::{Places, is_coplanar};
use crate::{Progress, Stopped};
use glam::DVec3;
use radiosity_scene::{Curve, Enclosure, Facet};
use radiosity_trace::sampling::{Sequence, cosine_direction, frame, hash};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The stream of sample points.
const STREAM: u32 = 0x0202;

/// First rays of a surface, and those beyond which it has no more: a quarter of an hour of one thread.
const FIRST: usize = 1 << 13;
const MOST: usize = 1 << 31;

/// Sets of rays that know nothing of each other, each a sequence of its own: they tell how far a surface's factors are off, if those are few, too.
const SETS: usize = 16;

/// Rays of one task at most, and tasks whose hits are kept until they are counted.
const TASK: usize = 1 << 12;
const BATCH: usize = 1 << 10;

/// Bytes for a factor in one direction: its counts, it and its error, and half of what is stored of a pair.
const ROOM: usize = SETS * size_of::<u32>() + size_of::<Factor>() + (size_of::<Entry>() + BYTES) / 2;

/// Where this is asked for, a pair of facets takes about as long for each panel that may stand between as below, and a ray, s; and a surface
/// needs about as many rays. By furniture of 300 to 6,000 facets.
const ACCURACY: f64 = 1e-3;
const PAIR: f64 = 4.5e-8;
const RAY: f64 = 4e-7;
const RAYS: f64 = 4e5;

/// How either grows as the accuracy falls: as its power.
const PAIR_GROWS: f64 = 0.8;
const RAYS_GROW: f64 = 1.5;

/// What may be waited for unasked, s; of surfaces of so many facets each, of which no more unite to one panel.
const PATIENCE: f64 = 60.0;
const MESH: usize = 4;

/// The view factors between all surfaces of an enclosure, by rays where that takes less.
///
/// # Errors
/// As of [`view_factors`].
pub fn surface_factors(
    enclosure: &Enclosure,
    options: &ViewFactorOptions,
    progress: &dyn Progress,
) -> Result<ViewFactors, FactorError> {
    if takes_less_by_rays(enclosure, options) {
        return Rays::new(enclosure).factors(options, progress);
    }
    let found = view_factors(enclosure, options, progress)?;
    Ok(if enclosure.surfaces.len() == enclosure.facets.len() { found } else { found.by_surface(enclosure) })
}

impl ViewFactorOptions {
    /// These options for who asks for no accuracy: 10⁻³ where rays would be sent for that of these options, which would take hours, and for
    /// meshes of which it would take minutes pair by pair. Of a chair of 528 facets 10⁻⁵ took three, and 10⁻³ takes a tenth of a second.
    pub fn usual(self, enclosure: &Enclosure) -> ViewFactorOptions {
        let Some(Work { rays, pairs, panels }) = Work::of(enclosure, &self) else { return self };
        let (surfaces, facets) = (enclosure.surfaces.len(), enclosure.facets.len());
        // Patches of walls take far less than is thought of meshes, whose facets look all ways.
        let is_mesh = MESH * surfaces <= facets && facets <= MESH * panels;
        let takes_long = rays <= pairs || is_mesh && pairs > PATIENCE;
        if takes_long { ViewFactorOptions { accuracy: self.accuracy.max(ACCURACY), ..self } } else { self }
    }
}

fn takes_less_by_rays(enclosure: &Enclosure, options: &ViewFactorOptions) -> bool {
    Work::of(enclosure, options).is_some_and(|work| work.rays <= work.pairs)
}

/// What rays and pairs of facets are going to take, s, about. Rays that are too many, or for which there is no memory, take for ever.
struct Work {
    rays: f64,
    pairs: f64,
    /// What facets in planes unite to, that may stand between others.
    panels: usize,
}

impl Work {
    /// None where nothing is to be summed up.
    fn of(enclosure: &Enclosure, options: &ViewFactorOptions) -> Option<Work> {
        let (surfaces, facets) = (enclosure.surfaces.len(), enclosure.facets.len());
        let [low, high] = enclosure.bounds().filter(|_| surfaces < facets)?;
        let extent = high.distance(low);
        let finer = ACCURACY / options.accuracy;
        let rays = RAYS * finer.powf(RAYS_GROW);
        let is_possible = rays <= MOST as f64
            && surfaces.saturating_mul(surfaces).saturating_mul(ROOM) <= options.memory
            && enclosure.surface_areas().iter().all(|area| *area > 0.0);
        let panels = panels(enclosure, &mut Planes::new(extent, TOUCH * extent)).len();
        Some(Work {
            rays: if is_possible { RAY * rays * surfaces as f64 } else { f64::INFINITY },
            pairs: PAIR * 0.5 * (facets as f64).powi(2) * panels as f64 * finer.powf(PAIR_GROWS),
            panels,
        })
    }
}

/// A surface that rays start from: places on what is exposed of its facets, which come along a curve, so that numbers that are near are places that are.
struct Source {
    places: Places,
    /// The facet of each triangle.
    facets: Vec<u32>,
    /// Of what is exposed, m².
    area: f64,
    counts: Counts<SETS>,
    /// Rays that are counted, and that there are to be.
    counted: usize,
    rays: usize,
}

/// Rays from all surfaces.
struct Rays<'a> {
    around: Around<'a>,
    /// What is not covered of facets, as by [`exposed`].
    exposed: Vec<Option<Vec<Facet>>>,
    sources: Vec<Source>,
    areas: Vec<f64>,
}

impl<'a> Rays<'a> {
    fn new(enclosure: &'a Enclosure) -> Rays<'a> {
        let (centroids, surfaces): (Vec<DVec3>, _) =
            (enclosure.facets.iter().map(Facet::centroid).collect(), enclosure.surfaces.len());
        let [low, high] = enclosure.bounds().unwrap_or_default();
        let touch = TOUCH * high.distance(low);
        let exposed = exposed(enclosure, &mut Planes::new(high.distance(low), touch), touch);
        let mut of = vec![(Vec::new(), Vec::new(), 0.0); surfaces];
        for facet in Curve::order(&centroids) {
            let whole = std::slice::from_ref(&enclosure.facets[facet]);
            let (triangles, facets, area) = &mut of[enclosure.surface_of[facet] as usize];
            for piece in exposed[facet].as_deref().unwrap_or(whole) {
                triangles.extend(piece.triangles());
                facets.resize(triangles.len(), facet as u32);
                *area += piece.area();
            }
        }
        let source = |(triangles, facets, area)| Source {
            places: Places::of(triangles),
            facets,
            area,
            counts: Counts::new(surfaces),
            counted: 0,
            rays: if area > 0.0 { FIRST } else { 0 },
        };
        let sources = of.into_iter().map(source).collect();
        Rays { around: Around::new(enclosure), exposed, sources, areas: enclosure.surface_areas() }
    }

    fn factors(mut self, options: &ViewFactorOptions, progress: &dyn Progress) -> Result<ViewFactors, FactorError> {
        let expected = RAYS * (ACCURACY / options.accuracy).powf(RAYS_GROW) * self.sources.len() as f64;
        loop {
            self.trace(expected as usize, progress)?;
            let entries = self.entries();
            if !self.ask_for_more(&entries, options.accuracy) {
                let choices =
                    Choices { rays: self.sources.iter().map(|source| source.counted).sum(), ..Choices::default() };
                return Ok(ViewFactors::new(self.areas, std::iter::once(entries), choices));
            }
        }
    }

    /// Traces what is not yet counted; `expected` is about how many rays there will be in the end.
    fn trace(&mut self, expected: usize, progress: &dyn Progress) -> Result<(), Stopped> {
        let done = AtomicUsize::new(self.sources.iter().map(|source| source.counted).sum());
        let expected = expected.max(self.sources.iter().map(|source| source.rays).sum());
        let scene = (&self.around, &self.exposed[..]);
        for (k, source) in self.sources.iter_mut().enumerate() {
            let [from, to] = [source.counted / SETS, source.rays / SETS];
            let Source { places, facets, counts, .. } = source;
            let from_all_over = (&*places, &facets[..]);
            let task = |&(set, first): &(usize, usize)| {
                let range = first..to.min(first + TASK);
                let done = done.fetch_add(range.len(), Ordering::Relaxed) + range.len();
                let sequence = Sequence::new(hash(hash(set as u32) ^ k as u32), STREAM);
                progress.step(done, expected).then(|| meet(scene, from_all_over, &sequence, range)).ok_or(Stopped)
            };
            let tasks: Vec<_> = (0..SETS).flat_map(|set| (from..to).step_by(TASK).map(move |i| (set, i))).collect();
            for batch in tasks.chunks(BATCH) {
                let met: Vec<Vec<[u32; 2]>> = batch.par_iter().map(task).collect::<Result<_, _>>()?;
                for ((set, _), met) in batch.iter().zip(met) {
                    met.into_iter().for_each(|[item, times]| counts.add(item as usize, *set, times));
                }
            }
            source.counted = source.rays;
        }
        Ok(())
    }

    /// The exchange areas of all pairs, by the rays of either surface: their variances are as A_i/M_i.
    fn entries(&self) -> Vec<Entry> {
        let row = |source: &Source| (source.rays > 0).then(|| source.counts.row(source.rays));
        let rows: Vec<Option<RowFactors>> = self.sources.iter().map(row).collect();
        let told = |i: usize, j: usize| {
            let (Factor { value, error }, Source { area, rays, .. }) = (rows[i].as_ref()?.factors[j], &self.sources[i]);
            Some((*rays as f64 / area, area * value, area * error))
        };
        let exchange = |i: usize, j: usize| match (told(i, j), told(j, i)) {
            (Some((_, value, error)), _) if i == j => Exchange { value, error },
            (Some((w, value, error)), Some((v, other, other_error))) => {
                let value = (w * value + v * other) / (w + v);
                Exchange { value, error: (w * error).hypot(v * other_error) / (w + v) }
            }
            // One of them is covered.
            _ => Exchange::default(),
        };
        let pairs = (0..rows.len()).flat_map(|i| (i..rows.len()).map(move |j| (i, j)));
        pairs.map(|(i, j)| Entry::new(i as u32, j as u32, exchange(i, j))).collect()
    }

    /// Twice the rays for the smaller surface of each pair that is not as exact as asked: they tell most for their number. Whether there are any.
    fn ask_for_more(&mut self, entries: &[Entry], accuracy: f64) -> bool {
        let mut is_wanted = false;
        for entry in entries {
            let [i, j] = entry.pair().map(|surface| surface as usize);
            let small = if self.sources[j].area < self.sources[i].area { j } else { i };
            let least = self.areas[i].min(self.areas[j]);
            let source = &mut self.sources[small];
            if entry.error() > accuracy * least && source.rays < MOST {
                source.rays = 2 * source.counted;
                is_wanted = true;
            }
        }
        is_wanted
    }
}

/// What some rays of a surface meet: surfaces, or their number for nothing, and how many times. What is covered is only met from within bodies,
/// where these go through others.
fn meet(
    (around, exposed): (&Around, &[Option<Vec<Facet>>]),
    (places, facet_of): (&Places, &[u32]),
    sequence: &Sequence,
    range: Range<usize>,
) -> Vec<[u32; 2]> {
    let Enclosure { facets, surface_of, surfaces, .. } = around.enclosure;
    let mut items: Vec<u32> = range
        .map(|index| {
            let [u, v, x, y] = sequence.point(index as u32).map(f64::from);
            let (triangle, place) = places.find(x, y);
            let own = &facets[facet_of[triangle] as usize];
            let direction = cosine_direction(&frame(own.normal()), u, v);
            let place = own.centroid() + around.inwards(own.radius()) * (place - own.centroid());
            let is_own = |facet: usize| is_coplanar(own, facets[facet].corners().iter().copied());
            let met = around.first(place, direction, is_own).filter(|(_, hit)| !hit.back);
            let met = met.filter(|(facet, hit)| {
                let pieces = exposed.get(*facet).and_then(Option::as_ref);
                pieces.is_none_or(|pieces| {
                    pieces.iter().any(|piece| is_inside(piece, place + f64::from(hit.t) * direction))
                })
            });
            met.and_then(|(facet, _)| surface_of.get(facet)).copied().unwrap_or(surfaces.len() as u32)
        })
        .collect();
    items.sort_unstable();
    items.chunk_by(|a, b| a == b).map(|same| [same[0], same.len() as u32]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::tests::{box_of, room_with_block};
    use crate::view_factors::contact::tests::add_box;

    /// Facets of each surface one after another, so many each.
    fn grouped(mut room: Enclosure, facets: usize) -> Enclosure {
        room.surfaces = room.surfaces.into_iter().step_by(facets).collect();
        room.surface_of = (0..room.facets.len()).map(|facet| (facet / facets) as u32).collect();
        room
    }

    fn asked(accuracy: f64) -> ViewFactorOptions {
        ViewFactorOptions { accuracy, ..ViewFactorOptions::default() }
    }

    fn by_rays(room: &Enclosure, accuracy: f64) -> ViewFactors {
        Rays::new(room).factors(&asked(accuracy), &()).unwrap()
    }

    /// Strips of walls around a block: stated errors are as asked, and hold by factors that are a hundred times as exact.
    #[test]
    fn catalogue_28_surfaces_are_as_exact_by_rays_as_asked_and_stated() {
        let room = grouped(room_with_block(6), 6);
        let exact = view_factors(&room, &asked(1e-5), &()).unwrap().by_surface(&room);
        let (mut all, mut held) = (0, 0);
        for accuracy in [1e-2, 3e-3] {
            let found = by_rays(&room, accuracy);
            for (i, j, ..) in found.entries() {
                for (i, j) in [(i, j), (j, i)] {
                    let (told, truth) = (found.factor(i, j), exact.factor(i, j));
                    assert!(told.error <= accuracy, "{i} {j}: {told:?}");
                    let off = (told.value - truth.value).abs() - truth.error;
                    // Six standard errors.
                    assert!(off <= 2.0 * told.error, "{i} {j}: {told:?} of {truth:?}");
                    (all, held) = (all + 1, held + usize::from(off <= told.error));
                }
            }
        }
        assert!(100 * held >= 99 * all, "{held} of {all}");
    }

    /// Whole walls of a cube: few factors, of which pooled errors tell little.
    #[test]
    fn catalogue_28_errors_of_few_surfaces_hold() {
        let cube = grouped(box_of(DVec3::ONE, 4), 16);
        let exact = view_factors(&cube, &asked(1e-6), &()).unwrap().by_surface(&cube);
        for accuracy in [1e-2, 1e-3] {
            let found = by_rays(&cube, accuracy);
            assert!(found.choices.rays > 0 && found.choices.total() == 0);
            let off = |(i, j, value, error): (usize, usize, f64, f64)| (value - exact.factor(i, j).value).abs() / error;
            let worst = found.entries().map(off).fold(0.0, f64::max);
            assert!(worst <= 1.0, "{accuracy}: {worst} times the stated error");
            assert!(found.row_sums().iter().all(|sum| (sum - 1.0).abs() < 5.0 * accuracy));
        }
    }

    /// A book on a board whose end touches a wall, and a peg through both, in a room: faces of the peg within the others see, and
    /// are seen by, what touches these nowhere.
    #[test]
    fn rays_and_pairs_agree_where_bodies_touch() {
        let mut scene = box_of(DVec3::new(4.0, 3.0, 2.5), 1);
        let at = DVec3::new;
        add_box(&mut scene, at(1.0, 0.5, 0.5), at(4.0, 1.5, 0.7));
        add_box(&mut scene, at(1.5, 0.7, 0.7), at(2.0, 1.3, 1.2));
        add_box(&mut scene, at(1.6, 0.9, 0.3), at(1.8, 1.1, 1.5));
        let scene = grouped(scene, 6);
        let exact = view_factors(&scene, &asked(1e-4), &()).unwrap().by_surface(&scene);
        let found = by_rays(&scene, 2e-3);
        for (i, j, value, error) in found.entries() {
            let (factor, area) = (exact.factor(i, j), exact.areas()[i]);
            let (truth, uncertain) = (area * factor.value, area * factor.error);
            // Three standard errors, of ten factors, always by the same rays.
            assert!((value - truth).abs() <= error + uncertain, "{i} {j}: {value} ± {error} of {truth}");
        }
    }

    /// Pads on a board, their faces turned into it.
    #[test]
    fn surfaces_that_are_covered_see_nothing() {
        let mut scene = box_of(DVec3::splat(2.0), 1);
        add_box(&mut scene, DVec3::splat(0.5), DVec3::new(1.5, 1.5, 0.7));
        let pad = [[0.0, 0.0], [0.0, 0.1], [0.1, 0.1], [0.1, 0.0]].map(|[x, y]| DVec3::new(0.6 + x, 0.6 + y, 0.7));
        let pad = |k: usize| pad.map(|corner| corner + 0.12 * k as f64 * DVec3::X);
        (0..6).for_each(|k| scene.add("pad", Facet::new(pad(k).to_vec()).unwrap()));
        let scene = grouped(scene, 6);
        let exact = view_factors(&scene, &asked(1e-4), &()).unwrap().by_surface(&scene);
        let found = by_rays(&scene, 1e-2);
        assert_eq!([&exact, &found].map(|of| of.row_sums()[2]), [0.0; 2]);
        assert!([&exact, &found].iter().all(|of| of.factor(1, 0).value > 0.9));
    }

    /// Patches of walls go pair by pair, a mesh goes by rays, but where more is asked than rays can.
    #[test]
    fn what_takes_less_is_chosen() {
        let walls = grouped(box_of(DVec3::ONE, 8), 64);
        assert!(!takes_less_by_rays(&walls, &asked(1e-3)));
        let usual = |asked_for: f64, room: &Enclosure| asked(asked_for).usual(room).accuracy;
        assert_eq!(usual(1e-5, &walls), 1e-5);
        let patches = grouped(room_with_block(12), 144);
        let work = Work::of(&patches, &asked(1e-7)).unwrap();
        assert!(
            work.pairs > PATIENCE && MESH * work.panels < patches.facets.len(),
            "{} s, {} panels",
            work.pairs,
            work.panels
        );
        assert_eq!(usual(1e-7, &patches), 1e-7);
        let heap = |facets: usize, of_each: usize| {
            let mut heap = Enclosure::default();
            for k in 0..facets {
                let [x, y, z, a, b, c] = [1, 2, 3, 5, 7, 11].map(|m| (k * m * 617 % 9973) as f64 / 9973.0);
                let corner = 4.0 * DVec3::new(x, y, z);
                let corners = vec![corner, corner + DVec3::new(a, b, 0.1), corner + DVec3::new(0.1, b - 1.0, c)];
                heap.add(k.to_string(), Facet::new(corners).unwrap());
            }
            grouped(heap, of_each)
        };
        let body = heap(500, 500);
        let heap = heap(1000, 100);
        assert!(takes_less_by_rays(&heap, &asked(1e-3)) && !takes_less_by_rays(&heap, &asked(1e-9)));
        assert!(!takes_less_by_rays(&heap, &ViewFactorOptions { memory: 1000, ..asked(1e-3) }));
        // Unasked nobody waits for long, and nobody who asks for little gets more.
        assert_eq!([1e-5, 1e-2].map(|accuracy| usual(accuracy, &heap)), [1e-3, 1e-2]);
        // One body: pairs at 1e-5 take less than rays at that, but minutes.
        assert!(!takes_less_by_rays(&body, &asked(1e-5)) && usual(1e-5, &body) == 1e-3);
    }

    #[test]
    fn any_number_of_threads_finds_the_same() {
        let room = grouped(room_with_block(2), 4);
        let by = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| by_rays(&room, 3e-3).entries().collect::<Vec<_>>())
        };
        assert_eq!(by(1), by(3));
    }
}
