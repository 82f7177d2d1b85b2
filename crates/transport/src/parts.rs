//! What has shadow rays of its own at a place: a light, or of one with many triangles groups of them.

use crate::Luminaires;
use crate::luminaires::{Light, Piece};
use crate::one_light::{Samples, from_few, from_many, from_point, luminance_of, unshadowed};
use crate::polygon::Four;
use radiosity_scene::{PointLight, luminance};
use radiosity_trace::{EmitterTree, Place, Tracer};

/// Most groups that a light of many triangles is taken apart into: a lamp of a box and the eleven levels of halves above it among
/// 1,200 of them.
const GROUPS: usize = 24;

/// Something that could give light to a place.
pub struct Part<'l> {
    /// The light that it is or belongs to.
    pub light: usize,
    /// What it gives unshadowed, luminance-weighted, or about that; more than zero.
    pub weight: f64,
    what: What<'l>,
}

enum What<'l> {
    Point(&'l PointLight),
    /// Triangles whose factors are known: where these begin, and what the triangles give together, lux per band.
    Few(&'l [Piece], usize, [f64; 3]),
    /// Triangles of a light below a node of its tree.
    Many(&'l [Piece], &'l [Four], &'l EmitterTree, u32),
}

/// The parts of lights at one place, and the room to find them.
#[derive(Default)]
pub struct Parts<'l> {
    list: Vec<Part<'l>>,
    total: f64,
    /// What each triangle gives of those for which that is known, luminance-weighted.
    factors: Vec<f64>,
    /// Nodes of a tree, with their importance.
    cut: Vec<(u32, f64)>,
}

impl<'l> Parts<'l> {
    /// Those of all lights, at another place.
    pub fn find(&mut self, luminaires: &'l Luminaires, place: &Place) {
        self.clear();
        for four in &luminaires.few {
            self.factors.extend(four.seen_from(place.point, place.normal));
        }
        let mut first = 0;
        for (number, light) in luminaires.lights.iter().enumerate() {
            match light.few() {
                [] => self.add(number, light, place),
                pieces => {
                    self.add_few(number, pieces, first, place);
                    first += pieces.len();
                }
            }
        }
    }

    /// Those of one light, by its number, at another place.
    pub fn find_one(&mut self, luminaires: &'l Luminaires, number: usize, place: &Place) {
        self.clear();
        self.add(number, &luminaires.lights[number], place);
    }

    fn clear(&mut self) {
        self.list.clear();
        self.factors.clear();
        self.total = 0.0;
    }

    fn add(&mut self, number: usize, light: &'l Light, place: &Place) {
        match light {
            Light::Point(light) => {
                let (direction, _, arriving) = light.arrival(place.point);
                let cosine = direction.dot(place.normal).max(0.0);
                self.push(number, cosine * f64::from(luminance(arriving)), What::Point(light));
            }
            Light::Area { pieces, fours, tree: None, .. } => self.add_seen(number, pieces, fours, place),
            Light::Area { pieces, fours, tree: Some(tree), .. } => {
                let mut cut = std::mem::take(&mut self.cut);
                cut.clear();
                tree.cut(place.point, place.normal, GROUPS, &mut cut);
                for &(node, importance) in &cut {
                    match tree.leaf(node) {
                        Some(leaf) => {
                            let own = &pieces[tree.leaves()[leaf].start as usize..tree.leaves()[leaf].end as usize];
                            self.add_seen(number, own, &fours[leaf..=leaf], place);
                        }
                        None => self.push(number, importance, What::Many(pieces, fours, tree, node)),
                    }
                }
                self.cut = cut;
            }
        }
    }

    fn add_seen(&mut self, number: usize, pieces: &'l [Piece], fours: &[Four], place: &Place) {
        let first = self.factors.len();
        for four in fours {
            self.factors.extend(four.seen_from(place.point, place.normal));
        }
        self.add_few(number, pieces, first, place);
    }

    /// Adds triangles whose form factors are known from `first` on.
    fn add_few(&mut self, number: usize, pieces: &'l [Piece], first: usize, place: &Place) {
        let here = unshadowed(pieces, place, &mut self.factors[first..][..pieces.len()]);
        self.push(number, luminance_of(here), What::Few(pieces, first, here));
    }

    fn push(&mut self, light: usize, weight: f64, what: What<'l>) {
        if weight > 0.0 {
            self.total += weight;
            self.list.push(Part { light, weight, what });
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &Part<'l>> {
        self.list.iter()
    }

    /// The sum of their weights.
    pub fn total(&self) -> f64 {
        self.total
    }

    /// One of them by its weight, with a number in [0, 1), and how probable that was.
    pub fn pick(&self, u: f32) -> Option<(&Part<'l>, f64)> {
        let mut rest = f64::from(u) * self.total;
        let picked = self.list.iter().find(|part| {
            rest -= part.weight;
            rest < 0.0
        });
        picked.or(self.list.last()).map(|part| (part, part.weight / self.total))
    }

    /// Irradiance of the place from one of the parts, by some samples, and what became of their rays. From `ratio` samples on
    /// the share that is visible is a ratio of sums.
    pub fn irradiance(
        &self,
        part: &Part,
        tracer: &Tracer,
        place: &Place,
        samples: Samples,
        (ratio, salt): (u32, u32),
    ) -> ([f64; 3], u8) {
        match part.what {
            What::Point(light) => from_point(light, tracer, place, samples.2, salt),
            What::Few(pieces, first, here) => {
                let factors = &self.factors[first..][..pieces.len()];
                from_few((pieces, factors), here, tracer, place, samples, (ratio, salt))
            }
            What::Many(pieces, fours, tree, node) => {
                from_many((pieces, fours, tree, node), tracer, place, samples, salt)
            }
        }
    }
}
