//! Direct light of pixels: found at some of the places that a picture shows, told for the rest by planes through these where
//! light is smooth.
//!
//! What reaches a place from lamps past what stands in the way is known without noise nearly everywhere
//! (`transport::eclipse`), so that a few places tell whether it is smooth between them. Where it is not, a square of the picture is
//! quartered (as Whitted 1980, "An improved illumination model for shaded display", quarters pixels by the colours of their corners),
//! and what is around it is looked at more closely, as edges of shadows go on.
//!
//! Shadows that are narrower than the four pixels between places, and pass between all of those that are looked at, are lost.

use crate::Error;
use crate::allocation::Lit;
use glam::{DMat3, DVec2, DVec3};
use radiosity_scene::{Bands, luminance};
use radiosity_trace::sampling::frame;
use radiosity_view::picture::{Seen, ViewRays};
use rayon::prelude::*;
use smallvec::SmallVec;
use std::collections::HashMap;

/// Sides of squares, pixels. In smaller ones light is found at each place, and where they show less than half of a surface.
const SIDES: [u32; 2] = [8, 4];

/// Where in a square light is found, in halves of its side: in the smallest its corners and its middle. Those on its far sides are the
/// first ones of the next squares.
const LATTICE: [[u32; 2]; 9] = [[0, 0], [2, 0], [0, 2], [2, 2], [1, 1], [1, 0], [0, 1], [2, 1], [1, 2]];
const FOUND: [usize; 2] = [9, 5];

/// So many places tell of a plane at least: two more than it has unknowns.
const ENOUGH: usize = 5;

/// By how much light may be off the plane, relative to all the light there: half a step of what a display of 8 bits shows.
const SMOOTH: f32 = 0.004;

/// The same where shadow rays leave noise: some three times that of 256, and of others by their root; no more than twice that, as with four
/// times, which 16 rays would have, squares were seen in penumbrae.
const NOISE_OF_A_RAY: f32 = 0.012 * 16.0;
const NOISIEST: f32 = 0.024;

/// Light below this part of the mean counts as if it was as much: in the dark little is seen.
pub(crate) const DARK: f64 = 0.1;

/// Squared distances of places, m², below which they count as one.
const NEAREST: f64 = 1e-30;

/// Places lie on one surface if their normals differ by less than this cosine, that of two degrees and a half, and so does the way from
/// one to the other from being along it.
const FLAT: f64 = 0.999;
const ALONG: f64 = 0.045;

/// Places at which light is found, over those at which it is first looked for, about, with some left over.
const FOLLOWING: f64 = 2.0;

/// What a square of the picture shows of a surface; places by number.
#[derive(Clone)]
struct Tile {
    /// Pixels from the top left over its side.
    square: [u32; 2],
    level: usize,
    /// Number of the largest square's one that it was cut from.
    whole: usize,
    places: Vec<u32>,
    /// Those of that surface that the next squares begin with.
    beside: Vec<u32>,
}

/// What is known of the direct light of places.
struct Light<'a> {
    view: &'a ViewRays,
    indirect: &'a [Bands],
    /// No place counts as if it had less: a part of the mean over those that were found first.
    dark: f32,
    /// Where light was found, and by what part of all it may be off a plane.
    found: Vec<Option<(Bands, f32)>>,
    /// What planes tell, and whether one did: where time was over, it lies between what was found.
    told: Vec<Option<(Bands, bool)>>,
}

/// A plane of light over a surface.
struct Plane {
    origin: DVec3,
    /// Along the surface, over its extent.
    axes: [DVec3; 2],
    bands: [DVec3; 3],
}

/// What a picture shows, by squares and surfaces.
pub(crate) struct Tiles<'a> {
    view: &'a ViewRays,
    wholes: Vec<Tile>,
}

impl<'a> Tiles<'a> {
    pub fn new(view: &'a ViewRays) -> Tiles<'a> {
        let side = SIDES[0];
        let first = |row: u32| view.seen.partition_point(|seen| seen.pixel < row * view.width) as u32;
        let of_row = |row: u32| {
            let [begin, end, beside] = [row * side, (row + 1) * side, (row + 1) * side + 1].map(first);
            deal(view, (begin..end, end..beside), 0, 0)
        };
        let rows: Vec<Vec<Tile>> = (0..view.height.div_ceil(side)).into_par_iter().map(of_row).collect();
        let number = |(whole, tile): (usize, Tile)| Tile { whole, ..tile };
        Tiles { view, wholes: rows.into_iter().flatten().enumerate().map(number).collect() }
    }

    /// The part of all places at which light will be found, about.
    pub fn part(&self) -> f64 {
        let first = asked(self.view, &self.wholes).len() as f64;
        (FOLLOWING * first / self.view.seen.len().max(1) as f64).min(1.0)
    }

    /// Direct light of all places, beside which there is `indirect` light, and whether its noise is gone: it is exact, or a plane evened it
    /// out. `light_of` finds it at some of them, and says with how many shadow rays; or nothing where there is no time for it, and it is told
    /// by what is around.
    ///
    /// # Errors
    /// Those of `light_of`.
    pub fn direct(
        &self,
        indirect: &[Bands],
        mut light_of: impl FnMut(&[u32]) -> Result<Option<(Lit, u32)>, Error>,
    ) -> Result<Lit, Error> {
        let Tiles { view, wholes } = self;
        let mut at: HashMap<[u32; 2], Vec<usize>> = HashMap::new();
        wholes.iter().for_each(|tile| at.entry(tile.square).or_default().push(tile.whole));
        let mut is_quartered = vec![false; wholes.len()];
        let mut light = Light::new(view, indirect);
        let mut tiles = wholes.clone();
        while !tiles.is_empty() {
            let asked: Vec<u32> = asked(view, &tiles).into_iter().filter(|place| !light.is_found(*place)).collect();
            if !asked.is_empty() {
                let Some((lit, rays)) = light_of(&asked)? else {
                    tiles.iter().for_each(|tile| light.spread(tile, &wholes[tile.whole]));
                    break;
                };
                light.add(&asked, lit, rays);
            }
            let mut quartered = light.tell(&tiles);
            quartered.iter().for_each(|tile| is_quartered[tile.whole] = true);
            let mut rough: Vec<usize> = quartered.iter().map(|tile| tile.whole).collect();
            rough.dedup();
            for tile in rough.into_iter().map(|whole| &wholes[whole]) {
                for &whole in around(tile.square).filter_map(|square| at.get(&square)).flatten() {
                    let beside = &wholes[whole];
                    if !is_quartered[whole] && tile.lies_on(view, beside) {
                        is_quartered[whole] = true;
                        quartered.push(beside);
                    }
                }
            }
            tiles = quartered.into_par_iter().flat_map_iter(|tile| tile.quarters(view)).collect();
        }
        Ok(light.all())
    }
}

/// Places of tiles at which light is to be found, in order.
fn asked(view: &ViewRays, tiles: &[Tile]) -> Vec<u32> {
    let mut asked: Vec<u32> = tiles.par_iter().flat_map_iter(|tile| tile.asked(view)).collect();
    asked.par_sort_unstable();
    asked.dedup();
    asked
}

/// Deals places out to squares and surfaces, and to each those `beside` it.
fn deal(
    view: &ViewRays,
    (places, beside): (impl Iterator<Item = u32> + Clone, impl Iterator<Item = u32>),
    level: usize,
    whole: usize,
) -> Vec<Tile> {
    let side = SIDES[level];
    let mut tiles: Vec<Tile> = Vec::new();
    let mut at: HashMap<[u32; 2], SmallVec<[usize; 4]>> = HashMap::new();
    let on = |tiles: &[Tile], of: &[usize], place: u32| {
        of.iter().copied().find(|tile| lies_on(seen(view, tiles[*tile].places[0]), seen(view, place)))
    };
    for place in places.clone() {
        let square = pixel(view, place).map(|k| k / side);
        let of = at.entry(square).or_default();
        match on(&tiles, of, place) {
            Some(tile) => tiles[tile].places.push(place),
            None => {
                of.push(tiles.len());
                tiles.push(Tile { square, level, whole, places: vec![place], beside: Vec::new() });
            }
        }
    }
    for place in places.chain(beside) {
        let at_pixel = pixel(view, place);
        let is_first = at_pixel.map(|k| k > 0 && k % side == 0);
        let square = at_pixel.map(|k| k / side);
        for [left, up] in [[true, false], [false, true], [true, true]] {
            if (left && !is_first[0]) || (up && !is_first[1]) {
                continue;
            }
            let before = [square[0] - u32::from(left), square[1] - u32::from(up)];
            if let Some(tile) = at.get(&before).and_then(|of| on(&tiles, of, place)) {
                tiles[tile].beside.push(place);
            }
        }
    }
    tiles
}

pub(crate) fn seen(view: &ViewRays, place: u32) -> &Seen {
    &view.seen[place as usize]
}

/// Column and row of the pixel that shows a place.
pub(crate) fn pixel(view: &ViewRays, place: u32) -> [u32; 2] {
    let pixel = seen(view, place).pixel;
    [pixel % view.width, pixel / view.width]
}

/// Whether two places lie on a surface that is nearly flat there, on the same side of it.
pub(crate) fn lies_on(a: &Seen, b: &Seen) -> bool {
    let between = b.place.point - a.place.point;
    let off = between.dot(a.place.normal).abs().max(between.dot(b.place.normal).abs());
    a.behind == b.behind && a.place.normal.dot(b.place.normal) > FLAT && off <= ALONG * between.length()
}

/// Squares, or pixels, around one; those past the right and lower border, too.
pub(crate) fn around([x, y]: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
    (0..9u32).filter(|k| *k != 4).filter_map(move |k| Some([(x + k % 3).checked_sub(1)?, (y + k / 3).checked_sub(1)?]))
}

impl Tile {
    fn lies_on(&self, view: &ViewRays, other: &Tile) -> bool {
        lies_on(seen(view, self.places[0]), seen(view, other.places[0]))
    }

    fn quarters(&self, view: &ViewRays) -> Vec<Tile> {
        let level = self.level + 1;
        match level < SIDES.len() {
            true => deal(view, (self.places.iter().copied(), self.beside.iter().copied()), level, self.whole),
            false => vec![Tile { level, ..self.clone() }],
        }
    }

    /// Places at which light is to be found: near the lattice, or all of them.
    fn asked(&self, view: &ViewRays) -> SmallVec<[u32; 9]> {
        let is_shown = |side: &&u32| 2 * self.places.len() as u32 >= side.pow(2);
        let Some(&side) = SIDES.get(self.level).filter(is_shown) else { return SmallVec::from_slice(&self.places) };
        let nearest = |halves: &[u32; 2]| {
            let [x, y] = [0, 1].map(|k| self.square[k] * side + halves[k] * side / 2);
            let distance = |place: &&u32| {
                let at = pixel(view, **place);
                at[0].abs_diff(x).pow(2) + at[1].abs_diff(y).pow(2)
            };
            self.places.iter().chain(&self.beside).min_by_key(distance).copied()
        };
        LATTICE[..FOUND[self.level]].iter().filter_map(nearest).collect()
    }
}

impl<'a> Light<'a> {
    fn new(view: &'a ViewRays, indirect: &'a [Bands]) -> Light<'a> {
        let n = view.seen.len();
        Light { view, indirect, dark: 0.0, found: vec![None; n], told: vec![None; n] }
    }

    fn is_found(&self, place: u32) -> bool {
        self.found[place as usize].is_some()
    }

    fn add(&mut self, places: &[u32], Lit { light, is_exact }: Lit, rays: u32) {
        let noise = (NOISE_OF_A_RAY / (rays.max(1) as f32).sqrt()).clamp(SMOOTH, NOISIEST);
        for ((place, light), is_exact) in places.iter().zip(light).zip(is_exact) {
            self.found[*place as usize] = Some((light, if is_exact { SMOOTH } else { noise }));
        }
        if self.dark == 0.0 {
            let all = |&place: &u32| {
                let direct = self.found[place as usize].map_or(0.0, |(light, _)| luminance(light));
                f64::from(direct + luminance(self.indirect[place as usize]))
            };
            self.dark = (DARK * places.iter().map(all).sum::<f64>() / places.len().max(1) as f64) as f32;
        }
    }

    /// What was found in a tile and beside it.
    fn found_in(&self, tile: &Tile) -> SmallVec<[(&Seen, Bands, Bands); 16]> {
        let of = |&place: &u32| {
            let (light, part) = self.found[place as usize]?;
            let all: Bands = std::array::from_fn(|band| light[band] + self.indirect[place as usize][band]);
            let off = all.map(|e| part * e.max(luminance(all)).max(self.dark));
            Some((seen(self.view, place), light, off))
        };
        tile.places.iter().chain(&tile.beside).filter_map(of).collect()
    }

    /// Tells light of tiles where it is smooth; those where it is not.
    fn tell<'t>(&mut self, tiles: &'t [Tile]) -> Vec<&'t Tile> {
        let planes: Vec<Option<Plane>> = tiles.par_iter().map(|tile| self.plane(tile)).collect();
        let mut rough = Vec::new();
        for (tile, plane) in tiles.iter().zip(planes) {
            match plane {
                Some(plane) => {
                    for &place in &tile.places {
                        let light = plane.at(seen(self.view, place)).map(|e| e.max(0.0));
                        self.told[place as usize] = Some((light, true));
                    }
                    continue;
                }
                // Few places say nothing, and light is found at all of them.
                None if tile.level < SIDES.len() && tile.places.len() >= ENOUGH => rough.push(tile),
                None => {}
            }
            tile.places.iter().for_each(|place| self.told[*place as usize] = None);
        }
        rough
    }

    /// The plane through what was found in a tile, if light is smooth there.
    fn plane(&self, tile: &Tile) -> Option<Plane> {
        let found = self.found_in(tile);
        if found.len() < ENOUGH {
            return None;
        }
        let plane = Plane::through(&found);
        let is_near = |(seen, light, off): &(&Seen, Bands, Bands)| {
            let told = plane.at(seen);
            (0..3).all(|band| (light[band] - told[band]).abs() <= off[band])
        };
        // Beyond what was found nothing is known.
        let low = found.iter().map(|(_, light, off)| luminance(*light) - luminance(*off)).fold(f32::INFINITY, f32::min);
        let high = found.iter().map(|(_, light, off)| luminance(*light) + luminance(*off)).fold(0.0, f32::max);
        let is_between = |place: &u32| (low..=high).contains(&luminance(plane.at(seen(self.view, *place))));
        (found.iter().all(is_near) && tile.places.iter().all(is_between)).then_some(plane)
    }

    /// Tells light of a tile where no plane does by what was found in it, the more the nearer; of few places, in the `whole` that it is of.
    fn spread(&mut self, tile: &Tile, whole: &Tile) {
        let is_known = |place: u32| self.is_found(place) || self.told[place as usize].is_some();
        let unknown: Vec<u32> = tile.places.iter().copied().filter(|place| !is_known(*place)).collect();
        let lit: Vec<Bands> = {
            let own = self.found_in(tile);
            let found = if own.len() < ENOUGH { self.found_in(whole) } else { own };
            let of = |place: &u32| {
                let point = seen(self.view, *place).place.point;
                let (mut sum, mut weights) = ([0.0; 3], 0.0);
                for (seen, light, _) in &found {
                    let weight = 1.0 / seen.place.point.distance_squared(point).max(NEAREST);
                    weights += weight;
                    (0..3).for_each(|band| sum[band] += weight * f64::from(light[band]));
                }
                sum.map(|sum| (sum / f64::max(weights, f64::MIN_POSITIVE)) as f32)
            };
            unknown.iter().map(of).collect()
        };
        for (place, light) in unknown.into_iter().zip(lit) {
            self.told[place as usize] = Some((light, false));
        }
    }

    /// Light of all places: what is exact, or else what planes tell, which have less noise than what was found.
    fn all(self) -> Lit {
        let of = |place: usize| match (self.found[place], self.told[place]) {
            (Some((light, off)), told) if off <= SMOOTH || told.is_none() => (light, off <= SMOOTH),
            (_, told) => told.unwrap_or(([0.0; 3], false)),
        };
        let (light, is_exact) = (0..self.found.len()).map(of).unzip();
        Lit { light, is_exact }
    }
}

impl Plane {
    /// The plane that is nearest to light at some places, in squares.
    fn through(found: &[(&Seen, Bands, Bands)]) -> Plane {
        let n = found.len() as f64;
        let origin = found.iter().map(|(seen, ..)| seen.place.point).sum::<DVec3>() / n;
        let extent = found.iter().map(|(seen, ..)| seen.place.point.distance(origin)).fold(f64::MIN_POSITIVE, f64::max);
        let [u, v, _] = frame(found[0].0.place.normal);
        let mut plane = Plane { origin, axes: [u / extent, v / extent], bands: [DVec3::ZERO; 3] };
        // Places in one line leave a direction open, in which light does not change then.
        let mut squares = DMat3::from_diagonal(DVec3::splat(1e-9 * n));
        let mut sums = [DVec3::ZERO; 3];
        for (seen, light, _) in found {
            let at = plane.flat(seen);
            squares += DMat3::from_cols(at.x * at, at.y * at, at.z * at);
            (0..3).for_each(|band| sums[band] += f64::from(light[band]) * at);
        }
        let inverse = squares.inverse();
        plane.bands = sums.map(|sum| inverse * sum);
        plane
    }

    fn flat(&self, seen: &Seen) -> DVec3 {
        let from = seen.place.point - self.origin;
        let [x, y] = self.axes.map(|axis| axis.dot(from));
        DVec2::new(x, y).extend(1.0)
    }

    fn at(&self, seen: &Seen) -> Bands {
        let at = self.flat(seen);
        self.bands.map(|band| band.dot(at) as f32)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::{Mesh, Solution, SolveOptions, Tracer, cornell_box};
    use radiosity_scene::{Camera, Side};
    use radiosity_trace::Place;
    use radiosity_transport::Shadowing;

    pub(crate) const SIZE: u32 = 96;

    /// A picture of a floor, of which the pixels from some column on show a part that lies lower.
    pub(crate) fn floors(step: u32) -> ViewRays {
        let place = |pixel: u32| {
            let [x, y] = [pixel % SIZE, pixel / SIZE];
            let point = DVec3::new(f64::from(x), f64::from(y), if x < step { 0.0 } else { -30.0 });
            let place = Place { point, normal: DVec3::Z, triangle: 0 };
            Seen {
                pixel,
                place,
                uv: DVec2::ZERO,
                side: Side::Front,
                response: [1.0; 3],
                behind: false,
                share: 1.0,
                emitted: [0.0; 3],
            }
        };
        let n = SIZE * SIZE;
        let (seen, sky) = ((0..n).map(place).collect(), vec![[0.0; 3]; n as usize]);
        ViewRays { width: SIZE, height: SIZE, grid: 1, seen, sky }
    }

    /// The light that is told where `light` is what each pixel has, whether exactly, and of how many pixels it was asked.
    fn told(view: &ViewRays, light: impl Fn(u32, u32) -> f32, is_exact: bool) -> (Vec<f32>, usize) {
        let mut count = 0;
        let light_of = |places: &[u32]| {
            count += places.len();
            let light = places.iter().map(|&place| pixel(view, place)).map(|[x, y]| [light(x, y); 3]).collect();
            Ok(Some((Lit { light, is_exact: vec![is_exact; places.len()] }, 256)))
        };
        let told = Tiles::new(view).direct(&vec![[0.0; 3]; view.seen.len()], light_of).unwrap();
        (told.light.into_iter().map(|[e, ..]| e).collect(), count)
    }

    /// The largest part by which told light is off, and the part of the pixels that it was found at.
    fn off(view: &ViewRays, light: impl Fn(u32, u32) -> f32) -> [f32; 2] {
        let (told, count) = told(view, &light, true);
        let of = |(place, told): (u32, &f32)| {
            let [x, y] = pixel(view, place);
            (told - light(x, y)).abs() / light(x, y).max(1.0)
        };
        [(0..).zip(&told).map(of).fold(0.0, f32::max), count as f32 / view.seen.len() as f32]
    }

    /// Where light is smooth one place in sixteen tells it; where surfaces meet it is found at each of the few places there.
    #[test]
    fn smooth_light_is_told_by_few_places() {
        let slope = |x: u32, y: u32| 100.0 + 0.5 * x as f32 + 0.2 * y as f32;
        let [error, part] = off(&floors(SIZE), slope);
        assert!(error < 1e-5 && part < 0.08, "{error} {part}");
        let [error, part] = off(&floors(43), |x, y| if x < 43 { slope(x, y) } else { 9.0 });
        assert!(error < 1e-5 && part < 0.12, "{error} {part}");
        // A plane fits what is bent, up to half a step of a display.
        let bent = |x: u32, y: u32| 100.0 * (1.0 + (x as f32 / 40.0).sin() * (y as f32 / 30.0).cos()) + 10.0;
        let [error, part] = off(&floors(SIZE), bent);
        assert!(error < 2.0 * SMOOTH && part < 0.35, "{error} {part}");
    }

    /// Edges of shadows are as sharp as if each pixel was asked, and thin lines are followed from end to end.
    #[test]
    fn edges_and_lines_are_found() {
        for slope in [0.0, 0.31, 1.0, 3.7] {
            let from = |x: u32, y: u32| (x as f32 - 40.5 - (y as f32 - 48.0) * slope) / slope.hypot(1.0);
            let [error, part] = off(&floors(SIZE), |x, y| if from(x, y) < 0.0 { 100.0 } else { 20.0 });
            assert!(error == 0.0 && part < 0.45, "edge {slope}: {error} {part}");
            let [error, part] = off(&floors(SIZE), |x, y| if from(x, y).abs() < 1.0 { 20.0 } else { 100.0 });
            assert!(error == 0.0 && part < 0.55, "line {slope}: {error} {part}");
        }
    }

    /// Noise of shadow rays is taken for what it is: planes have less of it.
    #[test]
    fn noise_is_evened_out_and_edges_are_not() {
        use radiosity_trace::sampling::{hash, unit};
        let noise = |x: u32, y: u32| 0.012 * (unit(hash(x ^ hash(y))) - 0.5);
        let view = floors(SIZE);
        let light = |x: u32, y: u32| if x < 50 { 100.0 * (1.0 + noise(x, y)) } else { 20.0 };
        let (told, count) = told(&view, light, false);
        let off = |x: u32, y: u32| f64::from(told[(y * SIZE + x) as usize] / 100.0 - 1.0).powi(2);
        let lit = (0..SIZE * 40).map(|k| off(k % 40, k / 40)).sum::<f64>() / f64::from(SIZE * 40);
        let alone = 0.012f64.powi(2) / 12.0;
        assert!(lit < 0.6 * alone, "{lit} of {alone}");
        // What was found in a smooth square is no noisier than what is told around it.
        let found = (0..24 * 10).map(|k| off(4 * (k % 10), 4 * (k / 10))).sum::<f64>() / 240.0;
        assert!(found < 0.75 * alone, "{found} of {alone}");
        assert!((0..SIZE).all(|y| told[(y * SIZE + 50) as usize] == 20.0));
        assert!(count < view.seen.len() / 4, "{count}");
    }

    /// Where time is over after the first look, what is left lies between what is known around it.
    #[test]
    fn what_there_is_no_time_for_is_told_by_what_is_around() {
        let view = floors(60);
        let light = |[x, y]: [u32; 2]| if (x + y) % 23 < 9 { 50.0 } else { 80.0 };
        for is_exact in [true, false] {
            let mut first = Vec::new();
            let told = Tiles::new(&view).direct(&vec![[0.0; 3]; view.seen.len()], |places| {
                let light = places.iter().map(|&place| [light(pixel(&view, place)); 3]).collect();
                let found = Lit { light, is_exact: vec![is_exact; places.len()] };
                let is_first = first.is_empty();
                first.extend(places.iter().copied().filter(|_| is_first));
                Ok(is_first.then_some((found, 16)))
            });
            let told = told.unwrap().light;
            assert!(told.iter().all(|[e, ..]| (49.9..80.1).contains(e)));
            assert!(told.iter().any(|[e, ..]| (60.0..70.0).contains(e)));
            // What was found stays, unless a plane has less noise.
            let stays = |&&place: &&u32| (told[place as usize][0] - light(pixel(&view, place))).abs() < 2.0;
            assert_eq!(first.iter().filter(stays).count(), first.len());
        }
    }

    /// A picture of the Cornell box with light found at some places is the one with light found at all, as far as one can see.
    #[test]
    fn pictures_are_those_of_light_found_at_all_places() {
        let scene = cornell_box();
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let options = SolveOptions { element_size: Some(0.2), ..SolveOptions::default() };
        let solution = Solution::new(&tracer, &options, &()).unwrap();
        let camera: &Camera = &scene.cameras[0];
        let view = ViewRays::new(&tracer, camera, 160, 160);
        let places: Vec<Place> = view.seen.iter().map(|seen| seen.place).collect();
        let shadowing = Shadowing { places: 1, rays: 256 };
        let field = solution.indirect_field(&()).unwrap();
        let indirect: Vec<Bands> =
            view.seen.iter().map(|s| field.at(s.place.triangle as usize, s.uv, s.side)).collect();
        let all = solution.direct_at(&places, &shadowing, &()).unwrap();
        let mut count = 0;
        let some = Tiles::new(&view).direct(&indirect, |own| {
            count += own.len();
            let places: Vec<Place> = own.iter().map(|place| places[*place as usize]).collect();
            Ok(Some((solution.direct_by(&places, &shadowing, 0, &())?, shadowing.rays)))
        });
        let some = some.unwrap().light;
        let squares = |of: &dyn Fn(usize) -> f32| (0..all.len()).map(|i| f64::from(of(i)).powi(2)).sum::<f64>();
        let off = squares(&|i| luminance(some[i]) - luminance(all[i]));
        let whole = squares(&|i| luminance(all[i]) + luminance(indirect[i]));
        assert!((off / whole).sqrt() < 1e-3, "{}", (off / whole).sqrt());
        assert!(count < all.len() / 2, "{count} of {}", all.len());
    }
}
