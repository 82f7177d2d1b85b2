//! A column of light: what one light, or a group of them, gives directly to elements.
//!
//! Each element has a fixed list of shadow rays to each column: a place on itself and a place on the light, drawn by the
//! share of power and, on near surfaces, by the solid angle. What became of each is one bit, so that an edit looks only
//! at those that it can have changed, and a dimmed light needs none.
//! Lights beyond the first thirty-odd share columns; to dim one of them means to add up its column anew.

use super::body::{Bounds, Site, bounds_of, given_at};
use super::chunk::ROWS;
use super::world::World;
use crate::luminaires::Piece;
use crate::one_light::{geometry, sample_piece, tiny};
use glam::{DVec2, DVec3};
use radiosity_scene::elements::triangle_from_square;
use radiosity_scene::{Bands, PointLight, PointLightKind, Side, Surface, luminance};
use radiosity_trace::sampling::{Sequence, hash};
use radiosity_trace::{Place, Ray};

/// The stream of sample points that shadow rays use.
const SHADOW: u32 = 0x0700;

/// Distance from a spot of a lamp, over the width of its part of the lamp, below which it is seen that the lamp is made of spots: where
/// eight places share these, light just beyond is 3 % off. With 5.7 ceilings beside windows had streaks: what each place draws for itself is noise.
const NEAR: f64 = 2.0;

/// A light of a column.
#[derive(Clone, Debug)]
pub enum Lamp {
    /// An object that shines.
    Body(usize),
    /// A light without area, where it is now.
    Point(PointLight),
}

/// One light or a group.
#[derive(Clone, Debug)]
pub struct Column {
    key: u32,
    emitters: Vec<Emitter>,
    /// Running sum of the emitters' shares of the power, ending at 1.
    cumulative: Vec<f64>,
    reach: Reach,
    /// By what the light of each lamp is multiplied.
    pub strength: Vec<Bands>,
}

/// Where the ends of shadow rays are.
#[derive(Clone, Copy, Debug)]
enum Reach {
    /// In a ball.
    Ball(DVec3, f64),
    /// Infinitely far in one direction.
    Towards(DVec3),
    /// Anywhere.
    All,
}

#[derive(Clone, Debug)]
struct Emitter {
    lamp: usize,
    source: Source,
}

#[derive(Clone, Debug)]
enum Source {
    /// A triangle; with the first triangle of its object among all, and in the scene.
    Piece(Piece, usize),
    /// With the position about the middle of the scene.
    Point(PointLight),
}

/// What the shadow rays of an element are made from.
pub struct Draws {
    seed: u32,
    /// Where on the light they end.
    spots: Sequence,
    /// Where they begin: as rays of the element's row, of which it is known whether they count.
    places: Sequence,
}

/// One shadow ray.
pub struct Sample {
    /// The ray.
    pub ray: Ray,
    /// What it brings if nothing stops it, lux per band.
    pub light: [f64; 3],
    /// Decides whether blended surfaces stop it.
    pub salt: u32,
}

/// A spot of a lamp with area, with the light of all of it: the mean over many is that of the lamp.
#[derive(Clone, Debug)]
pub struct Spot {
    /// Which sample of the lamp it is.
    pub index: u32,
    place: Place,
    /// Exitance times the area of the lamp, lm per band.
    flux: [f64; 3],
    /// Square of the distance below which it is seen that it is no area.
    near: f64,
    salt: u32,
}

impl Spot {
    /// Whether a point is so near that it is seen that the lamp is made of spots.
    pub fn is_near(&self, point: DVec3) -> bool {
        self.place.point.distance_squared(point) < self.near
    }

    /// The shadow ray from a place.
    pub fn seen_from(&self, world: &World, from: &Place) -> Option<Sample> {
        let weight = geometry(from, &self.place);
        let light = self.flux.map(|flux| weight * flux);
        (weight > 0.0).then(|| Sample { ray: between(world, from, &self.place), light, salt: self.salt })
    }
}

impl Column {
    /// The column of some lamps; `key` fixes its random choices.
    pub fn new(world: &World, key: u32, lamps: &[Lamp]) -> Column {
        let (mut emitters, mut powers) = (Vec::new(), Vec::new());
        let mut bounds = bounds_of(&[]);
        let mut is_bounded = true;
        for (index, lamp) in lamps.iter().enumerate() {
            match lamp {
                Lamp::Body(body) => {
                    let body = &world.bodies[*body];
                    if !body.is_present {
                        continue;
                    }
                    let Bounds { low, high } = body.bounds;
                    bounds = Bounds { low: bounds.low.min(low), high: bounds.high.max(high) };
                    for (t, exitance) in body.shape.exitance.iter().enumerate() {
                        let sides = [Side::Front, Side::Back];
                        for side in sides.into_iter().take(1 + usize::from(body.shape.has_two_sides)) {
                            let [a, b, c] = body.corners[t];
                            let front = side == Side::Front;
                            let area = 0.5 * (b - a).cross(c - a).length();
                            let power = area * f64::from(luminance(*exitance));
                            if power > 0.0 {
                                let piece = Piece {
                                    triangle: body.first_triangle + t as u32,
                                    side,
                                    corners: if front { [a, b, c] } else { [a, c, b] },
                                    normal: if front { body.normals[t] } else { -body.normals[t] },
                                    exitance: *exitance,
                                    area,
                                    varied: body.shape.is_varied,
                                };
                                let triangle = body.shape.triangles.start + t;
                                emitters.push(Emitter { lamp: index, source: Source::Piece(piece, triangle) });
                                powers.push(power);
                            }
                        }
                    }
                }
                Lamp::Point(light) => {
                    let mut light = light.clone();
                    light.position -= world.middle;
                    let intensity = f64::from(luminance(light.intensity));
                    // The flux of a point, and of parallel light into the scene: only shares of a group hang on it.
                    powers.push(match light.kind {
                        PointLightKind::Directional => intensity * 4.0 * world.half * world.half,
                        _ => intensity * 4.0 * std::f64::consts::PI,
                    });
                    if light.kind == PointLightKind::Directional {
                        is_bounded = false;
                    } else {
                        let at = light.position;
                        bounds = Bounds { low: bounds.low.min(at), high: bounds.high.max(at) };
                    }
                    emitters.push(Emitter { lamp: index, source: Source::Point(light) });
                }
            }
        }
        let total: f64 = powers.iter().sum();
        let mut running = 0.0;
        let cumulative = powers
            .iter()
            .map(|power| {
                running += power;
                if total > 0.0 { running / total } else { 0.0 }
            })
            .collect();
        let reach = match emitters.as_slice() {
            [] => Reach::All,
            [Emitter { source: Source::Point(light), .. }] if !is_bounded => Reach::Towards(-light.direction),
            _ if !is_bounded => Reach::All,
            _ => {
                let (centre, radius) = bounds.ball();
                Reach::Ball(centre, radius)
            }
        };
        Column { key, emitters, cumulative, reach, strength: vec![[1.0; 3]; lamps.len()] }
    }

    /// Whether it gives no light.
    pub fn is_empty(&self) -> bool {
        self.cumulative.last().is_none_or(|end| *end <= 0.0)
    }

    /// Whether each of its shadow rays from a point is the same: it is one light without area.
    pub fn is_certain(&self) -> bool {
        matches!(self.emitters.as_slice(), [Emitter { source: Source::Point(_), .. }])
    }

    /// What an element's shadow rays are made from.
    pub fn draws(&self, seed: u32) -> Draws {
        let spots = Sequence::new(seed, SHADOW ^ hash(self.key));
        Draws { seed, spots, places: Sequence::new(seed, ROWS) }
    }

    /// Spots of its lamps that have area, drawn by their shares of the power.
    pub fn spots(&self, world: &World, count: usize) -> Vec<Spot> {
        let Draws { spots: sequence, .. } = self.draws(0);
        let spot = |index: u32| {
            let [u, v, ..] = sequence.point(index).map(f64::from);
            let (Emitter { lamp, source }, share, stretched) = self.pick(u)?;
            let Source::Piece(piece, triangle) = source else { return None };
            let (p, q) = triangle_from_square(stretched, v);
            let [a, b, c] = piece.corners;
            let point = a + p * (b - a) + q * (c - a);
            let place = Place { point, normal: piece.normal, triangle: piece.triangle };
            let given = self.given(world, piece, *triangle, point);
            let strength = self.strength[*lamp];
            let flux = |band: usize| piece.area / share * f64::from(given[band]) * f64::from(strength[band]);
            let near = NEAR * NEAR * piece.area / share / count as f64;
            Some(Spot { index, place, near, flux: std::array::from_fn(flux), salt: hash(self.key ^ index) })
        };
        (0..count as u32).filter_map(spot).collect()
    }

    /// The emitter that u in [0, 1) falls on, its share of the power, and where in that share.
    fn pick(&self, u: f64) -> Option<(&Emitter, f64, f64)> {
        let k = self.cumulative.partition_point(|end| *end <= u).min(self.emitters.len().checked_sub(1)?);
        let below = if k == 0 { 0.0 } else { self.cumulative[k - 1] };
        let share = self.cumulative[k] - below;
        (share > 0.0).then(|| (&self.emitters[k], share, ((u - below) / share).clamp(0.0, 1.0 - 1e-9)))
    }

    /// Exitance of a piece at a point of it.
    fn given(&self, world: &World, piece: &Piece, triangle: usize, point: DVec3) -> Bands {
        if piece.varied { emission_at(world, piece, triangle, point) } else { piece.exitance }
    }

    /// The cosine at which the middle of its lamps shines on a place; 0 from behind, and where there is no middle.
    pub fn cosine(&self, site: &Site) -> f64 {
        let direction = match self.reach {
            Reach::All => return 0.0,
            Reach::Towards(direction) => direction,
            Reach::Ball(centre, _) => (centre - site.centre).normalize_or_zero(),
        };
        direction.dot(site.normal).max(0.0)
    }

    /// Whether shadow rays from a ball may meet what is in a box and in the ball around it; never wrong where it says no.
    pub fn may_meet(&self, (from, start): (DVec3, f64), (bounds, (centre, radius)): &(Bounds, (DVec3, f64))) -> bool {
        let (light, own) = match self.reach {
            Reach::All => return true,
            Reach::Towards(direction) => return bounds.may_meet(from, direction, f64::INFINITY, start),
            Reach::Ball(light, own) => (light, own),
        };
        let along = light - from;
        let length = along.length();
        // The hull of two balls is a ball that grows from one to the other; where it comes nearest to a point lies a little
        // further towards the larger end than the point's foot on the axis.
        let slope = (own - start) / length;
        if slope.is_nan() || slope.abs() >= 1.0 {
            return true;
        }
        let away = *centre - from;
        let foot = away.dot(along) / length;
        let height = (away.length_squared() - foot * foot).max(0.0).sqrt();
        let share = ((foot + height * slope / (1.0 - slope * slope).sqrt()) / length).clamp(0.0, 1.0);
        let width = start + share * (own - start);
        (from + share * along).distance(*centre) <= 1.001 * (radius + width)
            && bounds.may_meet(from, along / length, length, 1.001 * start.max(own))
    }

    /// Whether it may shine on the front of an element; never wrong where it says no.
    pub fn may_reach(&self, site: &Site) -> bool {
        match self.reach {
            Reach::All => true,
            Reach::Towards(direction) => direction.dot(site.normal) > 0.0,
            Reach::Ball(light, own) => (light - site.centre).dot(site.normal) > -1.001 * own,
        }
    }

    /// Shadow ray `index` of an element; none where nothing can arrive.
    pub fn sample(&self, world: &World, site: &Site, draws: &Draws, index: u32) -> Option<Sample> {
        let ([u, v], [_, _, x, y]) = (draws.spots.pair(index), draws.places.point(index));
        let place = site.place(x, y);
        let (Emitter { lamp, source }, share, stretched) = self.pick(f64::from(u))?;
        let salt = hash(draws.seed ^ hash(self.key ^ index));
        let strength = self.strength[*lamp];
        let lit = |weight: f64, given: Bands| -> [f64; 3] {
            std::array::from_fn(|band| weight * f64::from(given[band]) * f64::from(strength[band]))
        };
        match source {
            Source::Piece(piece, triangle) => {
                let (target, weight) = sample_piece(piece, &place, tiny(piece), [stretched, f64::from(v)]);
                if weight <= 0.0 {
                    return None;
                }
                let given = self.given(world, piece, *triangle, target.point);
                let ray = between(world, &place, &target);
                Some(Sample { ray, light: lit(weight / share, given), salt })
            }
            Source::Point(light) => {
                let (direction, distance, arriving) = light.arrival(place.point);
                let cosine = direction.dot(place.normal);
                if cosine <= 0.0 || luminance(arriving) <= 0.0 {
                    return None;
                }
                let ray = world.ray(&place, direction, (distance - world.offset).max(0.0));
                Some(Sample { ray, light: lit(cosine / share, arriving), salt })
            }
        }
    }
}

/// The ray between two places, both moved off their surfaces.
fn between(world: &World, from: &Place, to: &Place) -> Ray {
    let origin = from.point + world.offset * from.normal;
    let along = to.point + world.offset * to.normal - origin;
    let length = along.length();
    world.ray(from, along / length.max(f64::MIN_POSITIVE), length)
}

/// Exitance of a piece at a point of it, where the emission is a picture.
fn emission_at(world: &World, piece: &Piece, triangle: usize, point: DVec3) -> Bands {
    let [a, b, c] = piece.corners;
    let normal = (b - a).cross(c - a);
    let (from, square) = (point - a, normal.length_squared());
    let uv = DVec2::new(from.cross(c - a).dot(normal), (b - a).cross(from).dot(normal)) / square;
    let uv = if piece.side == Side::Front { uv } else { DVec2::new(uv.y, uv.x) };
    given_at(&world.scene, Surface { triangle, uv: uv.clamp(DVec2::ZERO, DVec2::ONE) })
}
