//! Blocks of a picture: surfaces within squares of a few pixels, one place of which gathers light for all, and what lies between these.
//!
//! Blocks know no walls: beside a wall that is narrower than a block, light of one side may show on the other, for its pixels. Nor do curved ones know how far behind each other parts of one object are.

use crate::Solution;
use crate::answer::Station;
use crate::believed::Neighbours;
use crate::field::FLAT;
use crate::pixels::{lies_on, pixel, seen};
use radiosity_scene::{Bands, Side};
use radiosity_view::picture::{ViewRays, shading_normal};
use rayon::prelude::*;
use smallvec::SmallVec;
use std::cmp::Reverse;
use std::collections::HashMap;

/// Places that gather for a picture where each block of pixels shows one surface: of larger pictures blocks are wider. And how many times as many gather at
/// most, where blocks show several: of a furnished office at 900 × 600 159,514 in 135,000 blocks.
const PLACES: f64 = 400_000.0;
const SURFACES: usize = 2;

/// The least of them, and bytes that each takes, where memory is short.
const LEAST_PLACES: f64 = 10_000.0;
const PLACE_BYTES: usize = 2000;

/// Squares around a block, to each side, in which others of its surface are looked for.
pub(crate) const AROUND: u32 = 2;

/// Curved surfaces go on from one place to another where normals turn by less than this cosine, of 30 degrees, and both see the other this near to their horizon, by its sine: within blocks of a few pixels,
/// at the limb of a ball or on a thin pole, they turn by as much. With cosines of 0.7 and 0.95 pictures are as near.
const TURNED: f64 = 0.866;
const RISEN: f64 = 0.5;

/// Least weight of a block's own place, where its tent ends before a pixel of the block: something is always there.
const LEAST_WEIGHT: f32 = 1e-3;

/// A surface within a square of some pixels: the places that it shows there, and the one that gathers for them.
pub(crate) struct Block {
    pub square: [u32; 2],
    pub places: SmallVec<[u32; 4]>,
    pub chosen: u32,
}

/// What blocks around a place found.
#[derive(Default)]
struct Between {
    total: f32,
    /// Sum of what is beyond the field.
    beyond: Bands,
    /// Least and most of those that count.
    range: Option<[Bands; 2]>,
}

impl Between {
    fn add(&mut self, weight: f32, found: Bands, field: Bands) {
        if weight > 0.0 {
            self.total += weight;
            self.beyond = std::array::from_fn(|k| self.beyond[k] + weight * (found[k] - field[k]));
            let [low, high] = self.range.unwrap_or([found; 2]);
            self.range =
                Some([std::array::from_fn(|k| low[k].min(found[k])), std::array::from_fn(|k| high[k].max(found[k]))]);
        }
    }

    /// Light at the place by that of the field there.
    fn over(&self, field: Bands) -> Bands {
        std::array::from_fn(|k| (field[k] + self.beyond[k] / self.total).max(0.0))
    }

    /// The same, never more or less than these found: where the field is steep it knows no better.
    fn within(&self, field: Bands) -> Bands {
        let [low, high] = self.range.unwrap_or([field; 2]);
        let light = self.over(field);
        // Light beyond single precision must not end in a panic.
        std::array::from_fn(|k| light[k].max(low[k]).min(high[k]))
    }
}

/// Whether a triangle receives with its own normal all over, or with those of its corners, as part of an object that is round.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Shape {
    Flat,
    Curved { object: u32 },
}

/// What of a picture gathers, and the rest.
pub(crate) struct Blocks<'a> {
    pub view: &'a ViewRays,
    /// Pixels along the side of a square.
    pub side: u32,
    pub blocks: Vec<Block>,
    /// Those in the squares around.
    pub beside: Neighbours,
    /// Shapes of the places that gather, by number.
    pub shapes: Vec<Option<Shape>>,
}

/// Whether a flat surface, or a curved one, goes on from one place of a picture to another.
fn goes_on(view: &ViewRays, shapes: &[Option<Shape>], a: u32, b: u32) -> bool {
    let [shape, other] = [a, b].map(|place| shapes[place as usize]);
    let (a, b) = (seen(view, a), seen(view, b));
    shape == other
        && match shape {
            Some(Shape::Curved { .. }) => {
                let between = b.place.point - a.place.point;
                let risen = between.dot(a.place.normal).abs().max(between.dot(b.place.normal).abs());
                a.behind == b.behind && a.place.normal.dot(b.place.normal) > TURNED && risen <= RISEN * between.length()
            }
            Some(Shape::Flat) => lies_on(a, b),
            None => false,
        }
}

/// Whether the triangle of a station receives with its own normal all over.
pub(crate) fn is_flat(solution: &Solution, Station { place, side, .. }: &Station) -> bool {
    let (tracer, triangle) = (solution.tracer(), place.triangle as usize);
    let own = tracer.mesh.normal(triangle) * if *side == Side::Front { 1.0 } else { -1.0 };
    let corners = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)];
    corners.into_iter().all(|uv| shading_normal(tracer, triangle, uv.into(), *side).dot(own) > FLAT)
}

impl<'a> Blocks<'a> {
    pub fn new(solution: &Solution, view: &'a ViewRays, stations: &[Station], wider: u32) -> Blocks<'a> {
        let tracer = solution.tracer();
        let object = |station: &Station| {
            tracer.scene.triangle_object[tracer.mesh.source[station.place.triangle as usize] as usize]
        };
        let shape = |station: &Station| match is_flat(solution, station) {
            true => Shape::Flat,
            false => Shape::Curved { object: object(station) },
        };
        let shape_of = |station: &Station| solution.options.form_factors.is_none().then(|| shape(station));
        let shapes: Vec<Option<Shape>> = stations.par_iter().map(shape_of).collect();
        let count = shapes.iter().flatten().count() as f64;
        let most = PLACES.min((solution.memory_allowed() / PLACE_BYTES) as f64).max(LEAST_PLACES);
        Blocks::of(view, shapes, wider * (count / most).sqrt().ceil().max(1.0) as u32, SURFACES * most as usize)
    }

    /// Those of places that gather, of so many pixels to a side, no more than `most`.
    pub fn of(view: &'a ViewRays, mut shapes: Vec<Option<Shape>>, side: u32, most: usize) -> Blocks<'a> {
        let first = |row: u32| view.seen.partition_point(|seen| seen.pixel < row * view.width) as u32;
        let of_row = |row: u32| {
            let places = (first(row * side)..first((row + 1) * side)).filter(|place| shapes[*place as usize].is_some());
            Block::all(view, &shapes, places, side)
        };
        let rows: Vec<Vec<Block>> = (0..view.height.div_ceil(side)).into_par_iter().map(of_row).collect();
        let mut blocks: Vec<Block> = rows.into_iter().flatten().collect();
        // Where surfaces are as small as pixels those that show most gather, and the rest has the field.
        if blocks.len() > most {
            blocks.sort_by_key(|block| (Reverse(block.places.len()), block.chosen));
            for block in blocks.drain(most..) {
                block.places.iter().for_each(|place| shapes[*place as usize] = None);
            }
            blocks.sort_by_key(|block| block.chosen);
        }
        let mut at: HashMap<[u32; 2], SmallVec<[u32; 2]>> = HashMap::new();
        for (number, block) in (0..).zip(&blocks) {
            at.entry(block.square).or_default().push(number);
        }
        let beside = |(own, block): (u32, &Block)| {
            let [x, y] = block.square;
            let low = [x, y].map(|k| k.saturating_sub(AROUND));
            let squares = (low[1]..=y + AROUND).flat_map(|y| (low[0]..=x + AROUND).map(move |x| [x, y]));
            let is_beside =
                |other: &u32| *other != own && goes_on(view, &shapes, block.chosen, blocks[*other as usize].chosen);
            squares.filter_map(|square| at.get(&square)).flatten().copied().filter(is_beside).collect()
        };
        let beside = Neighbours((0..blocks.len() as u32).into_par_iter().zip(&blocks).map(beside).collect());
        Blocks { view, side, blocks, beside, shapes }
    }

    /// Whether a block shows a flat surface.
    pub fn is_flat(&self, own: usize) -> bool {
        self.shapes[self.blocks[own].chosen as usize] == Some(Shape::Flat)
    }

    /// Adds to the `light` of all places of the blocks, the field, what lies between what chosen ones `found` beyond theirs, on the same surface in these
    /// and in those around.
    pub fn add(&self, found: &[Bands], field: &[Bands], light: &mut [Bands]) {
        let of_block = |(number, block): (usize, &Block)| -> SmallVec<[(u32, Bands); 4]> {
            let of_place = |&place: &u32| {
                let mut seen = Between::default();
                seen.add(self.tent(place, block.chosen).max(LEAST_WEIGHT), found[number], field[number]);
                for other in self.beside.0[number].iter().map(|other| *other as usize) {
                    seen.add(self.tent(place, self.blocks[other].chosen), found[other], field[other]);
                }
                let field = light[place as usize];
                (place, if self.is_flat(number) { seen.within(field) } else { seen.over(field) })
            };
            block.places.iter().map(of_place).collect()
        };
        let all: Vec<_> = self.blocks.par_iter().enumerate().map(of_block).collect();
        for (place, all) in all.into_iter().flatten() {
            light[place as usize] = all;
        }
    }

    /// What one place counts at another: 1 at its own pixel, less towards those a block's side away.
    fn tent(&self, place: u32, chosen: u32) -> f32 {
        let (a, b) = (pixel(self.view, place), pixel(self.view, chosen));
        [0, 1].map(|k| (1.0 - a[k].abs_diff(b[k]) as f32 / self.side as f32).max(0.0)).into_iter().product()
    }
}

impl Block {
    /// Blocks of some places of the picture.
    fn all(view: &ViewRays, shapes: &[Option<Shape>], places: impl Iterator<Item = u32>, side: u32) -> Vec<Block> {
        let mut blocks: Vec<Block> = Vec::new();
        let mut at: HashMap<[u32; 2], SmallVec<[u32; 2]>> = HashMap::new();
        for place in places {
            let of = at.entry(pixel(view, place).map(|k| k / side)).or_default();
            let is_own = |number: &u32| goes_on(view, shapes, blocks[*number as usize].places[0], place);
            match of.iter().copied().find(is_own) {
                Some(number) => blocks[number as usize].places.push(place),
                None => {
                    of.push(blocks.len() as u32);
                    let square = pixel(view, place).map(|k| k / side);
                    blocks.push(Block { square, places: SmallVec::from_slice(&[place]), chosen: place });
                }
            }
        }
        // The one nearest to the middle: so they are as far apart everywhere.
        for block in &mut blocks {
            let from_middle = |place: &u32| {
                let at = pixel(view, *place);
                [0, 1].map(|k| (at[k] % side).abs_diff(side / 2).pow(2)).into_iter().sum::<u32>()
            };
            block.chosen = block.places.iter().copied().min_by_key(from_middle).unwrap_or(block.chosen);
        }
        blocks
    }
}
