//! What has shadow rays of its own at a place: a light, or of one with many triangles groups of them.

use crate::Luminaires;
use crate::luminaires::{Light, Panel, Piece, PieceTree};
use crate::one_light::{DARK, LIT, Samples, from_known, from_many, from_point, luminance_of, unshadowed};
use crate::polygon::Four;
use radiosity_scene::{PointLight, luminance};
use radiosity_trace::{Place, Tracer};

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
    Known(&'l [Piece], usize, [f64; 3]),
    /// Triangles of a light below a node of its tree.
    Many(&'l [Piece], &'l PieceTree, u32),
}

/// Up to so many triangles of lights with a tree, for each shadow ray that a place would have if anything were in the way, have their factors evaluated
/// there: what is fully lit has no noise then. 64 factors take as long as some four rays, half of that where half of the triangles look away. Of a
/// room with a bulb of 960 triangles a picture within three seconds is 1.8 % off; with 16 for each ray, where these are left to rays there, 3.6 %, with stains
/// all over. Where a thousand lamps hang side by side it takes an eighth longer.
pub(crate) const FOR_A_RAY: usize = 64;

/// A place that sees less than this share of a lamp is asked whether it is buried, as one is of whose rays none came through: beneath a
/// lid with a gap of a tenth of a millimetre some light comes in.
const GLIMPSE: f64 = 1.0 / 64.0;

/// How many of so many rays one of some parts, of a weight among all, is to have: half of them go by what the parts would give and half to all
/// alike, as a lamp that had a ray now and then would sparkle in sunlight.
fn expected((count, total): (usize, f64), weight: f64, rays: u32) -> f64 {
    0.5 * f64::from(rays) * (weight / total + 1.0 / count as f64)
}

/// The parts of lights at one place, and the room to find them.
#[derive(Default)]
pub struct Parts<'l> {
    list: Vec<Part<'l>>,
    /// How many there were, and the sum of their weights, before any was settled.
    count: usize,
    total: f64,
    /// What each triangle gives of those for which that is known, luminance-weighted.
    factors: Vec<f64>,
    /// Nodes of a tree, with their importance.
    cut: Vec<(u32, f64)>,
}

impl<'l> Parts<'l> {
    /// Those of all lights, at another place that would have so many shadow rays if anything were in the way.
    pub fn find(&mut self, luminaires: &'l Luminaires, place: &Place, rays: u32) {
        let sums_all = luminaires.many <= FOR_A_RAY * rays as usize;
        self.clear();
        for four in &luminaires.few {
            self.factors.extend(four.seen_from(place.point, place.normal));
        }
        let mut first = 0;
        for (number, light) in luminaires.lights.iter().enumerate() {
            match light {
                Light::Area { pieces, tree: None, .. } => {
                    self.add_known(number, pieces, first, place);
                    first += pieces.len();
                }
                Light::Area { pieces, fours, .. } if sums_all => self.add_seen(number, pieces, fours, place),
                _ => self.add(number, light, place),
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
        (self.count, self.total) = (0, 0.0);
    }

    fn add(&mut self, number: usize, light: &'l Light, place: &Place) {
        match light {
            Light::Point(light) => {
                let (direction, _, arriving) = light.arrival(place.point);
                let cosine = direction.dot(place.normal).max(0.0);
                self.push(number, cosine * f64::from(luminance(arriving)), What::Point(light));
            }
            Light::Area { pieces, fours, tree: None, .. } => self.add_seen(number, pieces, fours, place),
            Light::Area { pieces, tree: Some(all @ PieceTree { tree, leaves }), .. } => {
                let mut cut = std::mem::take(&mut self.cut);
                cut.clear();
                tree.cut(place.point, place.normal, GROUPS, &mut cut);
                for &(node, importance) in &cut {
                    match tree.leaf(node) {
                        Some(leaf) => {
                            let own = &pieces[tree.leaves()[leaf].start as usize..tree.leaves()[leaf].end as usize];
                            self.add_seen(number, own, &leaves[leaf..=leaf], place);
                        }
                        None => self.push(number, importance, What::Many(pieces, all, node)),
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
        self.add_known(number, pieces, first, place);
    }

    /// Adds triangles whose form factors are known from `first` on.
    fn add_known(&mut self, number: usize, pieces: &'l [Piece], first: usize, place: &Place) {
        let here = unshadowed(pieces, place, &mut self.factors[first..][..pieces.len()]);
        self.push(number, luminance_of(here), What::Known(pieces, first, here));
    }

    fn push(&mut self, light: usize, weight: f64, what: What<'l>) {
        if weight > 0.0 {
            self.total += weight;
            self.count += 1;
            self.list.push(Part { light, weight, what });
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// How many of so many rays a part is to have on average; those of what is settled are saved.
    pub fn expected(&self, part: &Part, rays: u32) -> f64 {
        expected((self.count, self.total), part.weight, rays)
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &Part<'l>> {
        self.list.iter()
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

    /// Takes out of the parts what panels give whose visible `share` is known: it is asked by light, panel, and how many of so many
    /// `rays` the panel would have, and what they give is added to `e` by light. Answers what became of it.
    pub fn settle(
        &mut self,
        luminaires: &Luminaires,
        rays: u32,
        e: &mut [[f64; 3]],
        mut share: impl FnMut(usize, &Panel, usize, f64) -> Option<f64>,
    ) -> u8 {
        let Parts { list, factors, count, total, .. } = self;
        let expected = |weight: f64| expected((*count, *total), weight, rays);
        let mut outcome = 0;
        list.retain_mut(|part| {
            let What::Known(pieces, first, here) = &mut part.what else { return true };
            let panels = &luminaires.panels[part.light];
            let (mut is_left, mut is_settled) = (panels.is_empty(), false);
            for (k, panel) in panels.iter().enumerate() {
                let own = &mut factors[*first..][panel.pieces.clone()];
                let factor: f64 = own.iter().sum();
                if factor <= 0.0 {
                    continue;
                }
                let Some(visible) = share(part.light, panel, k, expected(part.weight) * factor / part.weight) else {
                    is_left = true;
                    continue;
                };
                own.fill(0.0);
                is_settled = true;
                let exitance = pieces[panel.pieces.start].exitance;
                let whole = factor / f64::from(luminance(exitance));
                for (band, exitance) in exitance.into_iter().enumerate() {
                    here[band] -= whole * f64::from(exitance);
                    e[part.light][band] += visible * whole * f64::from(exitance);
                }
                outcome |= if visible > GLIMPSE { LIT } else { 0 } | if visible < 1.0 { DARK } else { 0 };
            }
            if is_left && is_settled {
                part.weight = factors[*first..][..pieces.len()].iter().sum();
            }
            is_left
        });
        outcome
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
            What::Known(pieces, first, here) => {
                let factors = &self.factors[first..][..pieces.len()];
                from_known((pieces, factors), here, tracer, place, samples, (ratio, salt))
            }
            What::Many(pieces, tree, node) => from_many((pieces, tree, node), tracer, place, samples, salt),
        }
    }
}
