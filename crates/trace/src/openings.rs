//! Small openings through which the sky shines in: windows, roof lights, gaps between boards.
//!
//! Of the rays that go everywhere from the floor of a hall one in ten thousand meets a roof light of a hand's breadth, and all the light of the hall
//! may come from there. So it is looked for where it can be: past each edge, in the plane of a triangle beside that. Where a ray from there gets out,
//! and back again meets a place that sees nearly nothing of the sky, there is an opening, as large as cells of that plane are open that
//! lie side by side. Whoever sends rays through openings, too, weighs what is found either way (Veach 1997, §9.2): what is taken for an opening changes
//! what is found by chance, and nothing else.

use crate::edges::{Edges, MOST_TRIANGLES, PAST, spread, thin};
use crate::grid::{Extent, Grid, Rectangle};
use crate::sampling::{Sequence, cosine_direction, frame, hash, unit};
use crate::{Emitter, EmitterTree, Found, Place, Ray, Tracer};
use glam::DVec3;
use radiosity_scene::luminance;
use rayon::prelude::*;
use smallvec::SmallVec;
use std::f64::consts::PI;

/// Rays past edges, about.
const PROBES: f64 = (1 << 17) as f64;

/// Triangles beside an edge are parts of one flat surface where the cosine between what they lie on either side is nearer to -1.
const FLAT: f64 = 0.999_999;

/// Of so many rays from within an opening out at least so many meet the sky, or it lies before the opening.
const OUTWARD: u32 = 8;
const FREE: usize = 2;

/// A place sees nearly nothing of the sky where of so many rays fewer than so many meet it: whoever has more rays there finds the rest by chance.
const AROUND: u32 = 64;
const MANY: usize = 4;

/// The coarsest cells are so wide that so many of them are the radius of a disc of this part of all surfaces: of a room of 4 × 5 m a quarter of a wall, or what stands free in
/// it would have openings around it that are half of the room.
const LARGEST: f64 = 1.0 / 64.0;
const COARSEST: f64 = 8.0;

/// How many places past one edge may be no part of an opening: where one is not, the others seldom are, and each takes some milliseconds.
const FAILURES: usize = 1;

/// Places that tell whether any of a cell is open, and how much.
const GLANCES: u32 = 4;
const LOOKS: u32 = 16;

/// Rays through an opening, half of them from a place that sees the sky there, half from those that this place sees; and the part of them at least that gets out.
/// Less, and most rays would be spent on what stands before it.
const THROUGH: u32 = 256;
const WORTH: f64 = 0.125;

/// The part where a small and deep one has less than this of all rays by cosine: it lights a spot, where nothing else would find it.
const LEAST: f64 = 1.0 / 32.0;
const SMALL: f64 = 1.0 / 1024.0;

/// Lines across a rectangle that tell where it is closed along its sides, to this part of a cell.
const LINES: u32 = 32;
const FINE: f64 = 1.0 / 64.0;

/// An opening is one rectangle where at least this part of so many places of it is open, else a few, to waste fewer rays on its corners.
const EVEN: f64 = 0.9;
const FILLED: u32 = 256;

/// Rectangles of one opening, and of all, at most.
const OF_ONE: usize = 4;
const OF_ALL: usize = 64;

/// The strongest of about so many are taken.
const MOST_TOLD: usize = 512;

/// The streams of sample points that these use.
const PAST_EDGE: u32 = 0x0510;
const OUT: u32 = 0x0511;
const IN_CELL: u32 = 0x0512;
const INWARD: u32 = 0x0513;

/// A rectangle through which the sky shines in.
#[derive(Clone, Debug)]
struct Opening {
    corner: DVec3,
    sides: [DVec3; 2],
    /// Unit normal, outward.
    normal: DVec3,
    area: f64,
    /// Area of as large a one through which all rays get out.
    power: f64,
}

impl Opening {
    /// How far a ray goes that leaves through it; `None` for others.
    fn crossed(&self, from: DVec3, direction: DVec3) -> Option<f64> {
        let (before, outward) = ((self.corner - from).dot(self.normal), direction.dot(self.normal));
        if !(before > 0.0 && outward > 0.0) {
            return None;
        }
        let distance = before / outward;
        let within = from + distance * direction - self.corner;
        let is_within = |side: &DVec3| (0.0..=side.length_squared()).contains(&within.dot(*side));
        self.sides.iter().all(is_within).then_some(distance)
    }

    /// A point of it, by (x, y) in the unit square.
    fn point(&self, x: f64, y: f64) -> DVec3 {
        self.corner + x * self.sides[0] + y * self.sides[1]
    }
}

/// All that were found.
#[derive(Clone, Debug, Default)]
pub struct Openings {
    list: Vec<Opening>,
    /// Which of them to go to from where.
    tree: EmitterTree,
}

impl Openings {
    pub(crate) fn find(tracer: &Tracer) -> Openings {
        let (scene, mesh) = (tracer.scene, tracer.mesh);
        if scene.sky.is_black() || mesh.triangles.len() > MOST_TRIANGLES {
            return Openings::default();
        }
        let mut seeds = seeds(tracer);
        thin(&mut seeds);
        let coarsest = (LARGEST * mesh.whole_area() / PI).sqrt() / COARSEST;
        let groups: Vec<&[Seed]> = seeds.chunk_by(|a, b| a.edge == b.edge).collect();
        let grown = |group: &&[Seed]| {
            let mut found: Vec<Hole> = Vec::new();
            let mut failures = 0;
            for seed in *group {
                if failures > FAILURES {
                    break;
                }
                if found.iter().any(|hole| hole.grid.is_about(seed.point)) {
                    continue;
                }
                let axes = [seed.along, seed.normal.cross(seed.along)];
                let grid = Grid::new(seed.point, axes, PAST * tracer.offset());
                let hole = grid.grown(&Plane { tracer, normal: seed.normal }, coarsest);
                match hole.and_then(|grid| Hole::new(tracer, grid, seed)) {
                    Some(hole) => found.push(hole),
                    None => failures += 1,
                }
            }
            found
        };
        let mut holes: Vec<Hole> = groups.par_iter().flat_map_iter(grown).collect();
        // One behind the other they are the same light: those are taken through which most of the rays get out, and of about as good ones the largest, as
        // a frame in front of many gaps is all of them.
        let grade = |hole: &Hole| hole.part.log2().round();
        holes.sort_by(|a, b| grade(b).total_cmp(&grade(a)).then(b.grid.area_within().total_cmp(&a.grid.area_within())));
        let mut list: Vec<Opening> = Vec::new();
        for hole in &holes {
            if list.len() > MOST_TOLD {
                break;
            }
            let is_told = |(from, direction): &&(DVec3, DVec3)| {
                list.iter().any(|opening| opening.crossed(*from, *direction).is_some())
            };
            if 2 * hole.lines.iter().filter(is_told).count() < hole.lines.len() {
                list.extend(hole.openings(tracer));
            }
        }
        list.sort_by(|a, b| b.power.total_cmp(&a.power));
        list.truncate(OF_ALL);
        Openings::of(list)
    }

    fn of(list: Vec<Opening>) -> Openings {
        let emitter = |opening: &Opening| {
            let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(|[x, y]| opening.point(x, y));
            let bounds = [
                corners.into_iter().fold(DVec3::INFINITY, DVec3::min),
                corners.into_iter().fold(DVec3::NEG_INFINITY, DVec3::max),
            ];
            Emitter { bounds, normal: -opening.normal, power: opening.power }
        };
        let emitters: Vec<Emitter> = list.iter().map(emitter).collect();
        Openings { tree: EmitterTree::new(&emitters, 1), list }
    }

    /// Memory that they take, bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.list) + self.tree.bytes()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// What counts of the light that a ray by cosine has from the sky, where `more` directions are sought beside each: the rest is [`Openings::counted`].
    pub fn found(&self, place: &Place, direction: DVec3, more: f64) -> f64 {
        1.0 / (1.0 + more * self.density(place, direction) * PI / direction.dot(place.normal).max(f64::MIN_POSITIVE))
    }

    /// A direction through one of them from a place, by a point of the unit square, and what counts of the sky's light there, of `more` that are
    /// sought beside each ray by cosine; in the mean over those sought that is what [`Openings::found`] lacks.
    pub fn counted(&self, place: &Place, choice: [f64; 2], more: f64) -> Option<(DVec3, f64)> {
        let (direction, density) = self.sought(place, choice)?;
        Some((direction, more / (1.0 + more * density * PI / direction.dot(place.normal))))
    }

    /// A direction through one of them from a place, by a point of the unit square, and how densely such directions are chosen, by solid angle.
    pub fn sought(&self, place: &Place, [mut u, v]: [f64; 2]) -> Option<(DVec3, f64)> {
        let (leaf, _) = self.tree.pick(0, place.point, place.normal, &mut u)?;
        let opening = &self.list[self.tree.order()[leaf] as usize];
        let direction = (opening.point(u, v) - place.point).try_normalize()?;
        // Who is in front of it may see another one behind it, by ways that are not told as dense as they would be.
        opening.crossed(place.point, direction)?;
        let density = self.density(place, direction);
        (density > 0.0 && direction.dot(place.normal) > 0.0).then_some((direction, density))
    }

    /// How densely a direction is chosen, by solid angle.
    pub fn density(&self, place: &Place, direction: DVec3) -> f64 {
        let of = |(number, opening): (u32, &Opening)| {
            let distance = opening.crossed(place.point, direction)?;
            let probability = self.tree.probability(number, place.point, place.normal);
            Some(probability * distance * distance / (opening.area * direction.dot(opening.normal)))
        };
        (0..).zip(&self.list).filter_map(of).sum()
    }
}

/// A place past an edge through which the sky shines in.
struct Seed {
    /// Number of the edge.
    edge: u32,
    point: DVec3,
    /// Unit direction of the edge.
    along: DVec3,
    /// Unit normal of the triangle, outward.
    normal: DVec3,
    /// A place inside.
    inside: Place,
}

/// Those past all edges.
fn seeds(tracer: &Tracer) -> Vec<Seed> {
    // What fills an opening and lets light pass has no edges that count.
    let edges = Edges::of(tracer.mesh, |triangle| !tracer.is_see_through(triangle));
    let vertex = |v: u32| tracer.mesh.vertices[v as usize];
    // Those within a flat surface have nothing open beside them.
    let of_edge = |own: &[[u32; 3]]| {
        let [a, b, _] = own[0].map(vertex);
        let of = |side: &[u32; 3]| {
            let aside = (vertex(side[2]) - a).reject_from(b - a);
            Some(Side { from: a, along: b - a, away: -aside.try_normalize()? })
        };
        let found: SmallVec<[Side; 2]> = own.iter().filter_map(of).collect();
        let is_free = |side: &&Side| found.iter().all(|other| other.away.dot(side.away) > -FLAT);
        found.iter().filter(is_free).copied().collect::<SmallVec<[Side; 2]>>()
    };
    let lengths: Vec<f32> = edges.all().flat_map_iter(of_edge).map(|side| side.along.length() as f32).collect();
    // Of many sides few get a ray.
    let counted = edges.each().flat_map(of_edge).zip(spread(&lengths, PROBES)).zip(0..);
    let probed: Vec<((Side, u32), u32)> = counted.filter(|((_, count), _)| *count > 0).collect();
    let seeds = |((side, count), number): ((Side, u32), u32)| {
        (0..count).filter_map(move |k| side.seed(tracer, number, (k, count)))
    };
    probed.into_par_iter().flat_map_iter(seeds).collect()
}

/// An edge of a triangle, and the direction past it in the triangle's plane.
#[derive(Clone, Copy)]
struct Side {
    from: DVec3,
    along: DVec3,
    away: DVec3,
}

impl Side {
    /// The k-th of some places past it, if the sky shines in there to what sees nearly nothing of it.
    fn seed(&self, tracer: &Tracer, edge: u32, (k, count): (u32, u32)) -> Option<Seed> {
        let salt = hash(edge ^ hash(k));
        let share = (f64::from(k) + f64::from(unit(salt))) / f64::from(count);
        let point = self.from + share * self.along + PAST * tracer.offset() * self.away;
        let along = self.along.try_normalize()?;
        let normal = along.cross(self.away);
        if !is_open(tracer, point, normal) {
            return None;
        }
        let [u, v] = Sequence::new(salt, PAST_EDGE).pair(0).map(f64::from);
        let direction = cosine_direction(&frame(normal), u, v);
        let ahead = tracer.first(&tracer.free_ray(point, direction), salt);
        let behind = tracer.first(&tracer.free_ray(point, -direction), salt);
        let (normal, direction, met) = match (ahead, behind) {
            (Found::Escaped, met @ Found::Surface { .. }) => (normal, direction, met),
            (met @ Found::Surface { .. }, Found::Escaped) => (-normal, -direction, met),
            _ => return None,
        };
        let scene = tracer.scene;
        let inside = tracer.place(met)?;
        if luminance(scene.sky.luminance(direction, scene.up.direction())) <= 0.0 {
            return None;
        }
        let open = Place { point, normal, triangle: u32::MAX };
        let is_out = escapes(tracer, &open, OUTWARD, salt).take(FREE).count() == FREE;
        let is_dark = || escapes(tracer, &inside, AROUND, salt).take(MANY).count() < MANY;
        (is_out && is_dark()).then_some(Seed { edge, point, along, normal, inside })
    }
}

/// Whether nothing lies in a plane at a place.
fn is_open(tracer: &Tracer, point: DVec3, normal: DVec3) -> bool {
    let off = PAST * tracer.offset();
    is_free(tracer, point - off * normal, point + off * normal)
}

/// Whether nothing lies between two points. Where panes let light pass by chance, each place has its own.
fn is_free(tracer: &Tracer, from: DVec3, to: DVec3) -> bool {
    let length = from.distance(to);
    let ray = tracer.free_ray(from, (to - from) / length);
    let salt = to.to_array().into_iter().fold(0, |salt, x| hash(salt ^ (x as f32).to_bits()));
    length == 0.0 || !tracer.blocked(&Ray { t_max: length as f32, ..ray }, salt)
}

/// The numbers of the rays by cosine from a place that meet the sky.
fn escapes(tracer: &Tracer, from: &Place, rays: u32, salt: u32) -> impl Iterator<Item = u32> {
    let (sequence, axes) = (Sequence::new(salt, OUT), frame(from.normal));
    (0..rays).filter(move |index| {
        let [u, v] = sequence.pair(*index).map(f64::from);
        let ray = tracer.ray(from, cosine_direction(&axes, u, v), f64::INFINITY);
        tracer.first(&ray, hash(salt ^ index)) == Found::Escaped
    })
}

/// The plane of a triangle, where there may be an opening.
struct Plane<'t> {
    tracer: &'t Tracer<'t>,
    normal: DVec3,
}

impl Plane<'_> {
    /// Places that are spread over a cell.
    fn places(&self, grid: &Grid, at: [i32; 2], count: u32) -> impl Iterator<Item = DVec3> {
        let [i, j] = at.map(|x| x as u32);
        let sequence = Sequence::new(hash(i ^ hash(j)), IN_CELL);
        (0..count).map(move |look| {
            let [x, y] = sequence.pair(look).map(f64::from);
            grid.within(at, x, y)
        })
    }
}

impl Extent for Plane<'_> {
    fn glance(&self, grid: &Grid, at: [i32; 2], beside: DVec3) -> Option<DVec3> {
        let is_within =
            |point: &DVec3| is_open(self.tracer, *point, self.normal) && is_free(self.tracer, beside, *point);
        self.places(grid, at, GLANCES).find(is_within)
    }

    fn share(&self, grid: &Grid, at: [i32; 2]) -> f32 {
        let is_within = |place: &DVec3| is_open(self.tracer, *place, self.normal);
        self.places(grid, at, LOOKS).filter(is_within).count().max(1) as f32 / LOOKS as f32
    }
}

/// An opening, and rays from places inside through it, by where they begin and go.
struct Hole {
    grid: Grid,
    normal: DVec3,
    lines: Vec<(DVec3, DVec3)>,
    /// Part of the rays through it that meets the sky.
    part: f64,
}

impl Hole {
    /// It as a rectangle, or a few if that would be wide of it.
    fn openings(&self, tracer: &Tracer) -> Vec<Opening> {
        let opening = |rectangle: &Rectangle| self.trimmed(tracer, rectangle);
        let whole: Vec<Opening> = self.grid.rectangles(1).iter().map(opening).collect();
        let is_open = |opening: &Opening| {
            let sequence = Sequence::new(1, IN_CELL);
            let point = |index: u32| sequence.pair(index).map(f64::from);
            let open = (0..FILLED).map(point).filter(|[x, y]| is_open(tracer, opening.point(*x, *y), self.normal));
            open.count() as f64 >= EVEN * f64::from(FILLED)
        };
        if whole.iter().all(is_open) { whole } else { self.grid.rectangles(OF_ONE).iter().map(opening).collect() }
    }

    /// A rectangle of cells without what is closed along its sides.
    fn trimmed(&self, tracer: &Tracer, Rectangle { corners: [a, b, _, d], .. }: &Rectangle) -> Opening {
        let sides = [*b - *a, *d - *a];
        let cell = [0, 1].map(|axis| (self.grid.widths()[axis] / sides[axis].length()).min(1.0));
        // From where to where it is open along each axis.
        let range = [0, 1].map(|axis| {
            // How far it is closed from the first side, or from the last one inwards.
            let closed = |is_last: bool| {
                let is_open = |x: f64, line: u32| {
                    let mut at = [(f64::from(line) + 0.5) / f64::from(LINES); 2];
                    at[axis] = if is_last { 1.0 - x } else { x };
                    is_open(tracer, *a + at[0] * sides[0] + at[1] * sides[1], self.normal)
                };
                let of_line = |line: u32| {
                    let (mut low, mut high) = (0.0, cell[axis]);
                    let begins = is_open(high, line);
                    while begins && high - low > FINE * cell[axis] {
                        let middle = 0.5 * (low + high);
                        if is_open(middle, line) { high = middle } else { low = middle }
                    }
                    begins.then_some(low)
                };
                let least = (0..LINES).filter_map(of_line).fold(f64::INFINITY, f64::min);
                if least.is_finite() { (least - FINE * cell[axis]).max(0.0) } else { 0.0 }
            };
            // Within one cell that is closed in the middle the lines that tell of its sides are others.
            if cell[axis] <= 0.5 { [closed(false), 1.0 - closed(true)] } else { [0.0, 1.0] }
        });
        let corner = *a + range[0][0] * sides[0] + range[1][0] * sides[1];
        let sides = [0, 1].map(|axis| (range[axis][1] - range[axis][0]) * sides[axis]);
        let area = sides[0].cross(sides[1]).length();
        Opening { corner, sides, normal: self.normal, area, power: self.part * area }
    }

    /// `None` where what it opens to is nearly none of the sky.
    fn new(tracer: &Tracer, grid: Grid, seed: &Seed) -> Option<Hole> {
        let normal = seed.normal;
        // The place where it was seen from, and what that sees.
        let (sequence, axes) = (Sequence::new(seed.edge, INWARD), frame(seed.inside.normal));
        let place = |index: u32| {
            let [u, v] = sequence.pair(index).map(f64::from);
            let ray = tracer.ray(&seed.inside, cosine_direction(&axes, u, v), f64::INFINITY);
            tracer.place(tracer.first(&ray, hash(index)))
        };
        let others: Vec<Place> = (0..THROUGH / 2).filter_map(place).collect();
        let cells = grid.cells();
        let (mut lines, mut count, mut share) = (Vec::new(), 0, 0.0);
        for index in 0..THROUGH {
            let other = others.get(index as usize / 2).filter(|_| index % 2 == 1);
            let place = *other.unwrap_or(&seed.inside);
            let along = cells[index as usize * cells.len() / THROUGH as usize].point - place.point;
            let distance = along.length();
            let direction = along / distance;
            let cosines = direction.dot(normal).max(0.0) * direction.dot(place.normal);
            if !(distance > 0.0 && cosines > 0.0) {
                continue;
            }
            count += 1;
            share += cosines * grid.area_within() / (PI * distance * distance);
            let ray = tracer.ray(&place, direction, f64::INFINITY);
            if tracer.first(&ray, hash(seed.edge ^ hash(index))) == Found::Escaped {
                lines.push((place.point, direction));
            }
        }
        let part = lines.len() as f64 / f64::from(count.max(1));
        let share = share / f64::from(count.max(1));
        (part >= if share < SMALL { LEAST } else { WORTH }).then_some(Hole { grid, normal, lines, part })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Random;
    use radiosity_scene::{AlphaMode, Material, Mesh, Scene, Sky};

    /// The parts of a rectangle around a hole in it, by two opposite corners of either in the plane at a height.
    fn around(scene: &mut Scene, [low, high]: [[f64; 2]; 2], [from, to]: [[f64; 2]; 2], z: f64, is_up: bool) {
        let mut quad = |[a, b]: [f64; 2], [c, d]: [f64; 2]| {
            let corners = [[a, b], [c, b], [c, d], [a, d]].map(|[x, y]| DVec3::new(x, y, z));
            let [a, b, c, d] = corners;
            scene.add_quad("slab", 0, if is_up { [a, b, c, d] } else { [a, d, c, b] });
        };
        quad(low, [from[0], high[1]]);
        quad([to[0], low[1]], high);
        quad([from[0], low[1]], [to[0], from[1]]);
        quad([from[0], to[1]], [to[0], high[1]]);
    }

    /// A room of 20 × 20 × 10 m whose roof is so thick and has such an opening, under an even sky.
    fn hall(hole: [[f64; 2]; 2], thick: f64) -> Scene {
        let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
        scene.sky = Sky::Uniform([1000.0; 3]);
        let corner = |k: usize| DVec3::new([0.0, 20.0][k & 1], [0.0, 20.0][k >> 1 & 1], [0.0, 10.0][k >> 2]);
        for face in [[0, 1, 3, 2], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]] {
            scene.add_quad("shell", 0, face.map(corner));
        }
        around(&mut scene, [[0.0; 2], [20.0; 2]], hole, 10.0, false);
        if thick > 0.0 {
            around(&mut scene, [[0.0; 2], [20.0; 2]], hole, 10.0 + thick, true);
            let [[x, y], [end, top]] = hole;
            let (low, high) = (10.0, 10.0 + thick);
            let mut reveal = |[a, b]: [f64; 2], [c, d]: [f64; 2]| {
                let corners = [(a, b, low), (c, d, low), (c, d, high), (a, b, high)];
                scene.add_quad("reveal", 0, corners.map(|(x, y, z)| DVec3::new(x, y, z)));
            };
            reveal([x, top], [x, y]);
            reveal([end, y], [end, top]);
            reveal([x, y], [end, y]);
            reveal([end, top], [x, top]);
        }
        scene
    }

    fn openings(scene: &Scene) -> Vec<f64> {
        let mesh = Mesh::new(scene);
        Tracer::new(scene, &mesh).openings().list.iter().map(|opening| opening.area).collect()
    }

    /// Each is found once and as large as it is, however small, long and deep, though four edges lead there.
    #[test]
    fn openings_are_found_as_they_are() {
        let holes = [
            ([[9.95, 9.95], [10.05, 10.05]], 0.0),
            ([[12.0, 3.0], [12.5, 4.5]], 0.3),
            ([[9.999, 8.0], [10.001, 12.0]], 0.0),
            ([[9.0, 1.0], [9.0005, 18.0]], 0.0),
            ([[6.0, 4.0], [6.01, 4.005]], 0.02),
            ([[3.0, 3.0], [6.0, 5.0]], 0.5),
        ];
        for (hole, thick) in holes {
            let [[x, y], [end, top]] = hole;
            let (found, area) = (openings(&hall(hole, thick)), (end - x) * (top - y));
            let is_right = matches!(found[..], [found] if (0.98..1.05).contains(&(found / area)));
            assert!(is_right, "{hole:?}, {thick}: {found:?} of {area} m²");
        }
    }

    /// Who looks through one opening from in front of it and out of another one behind it, around a corner, has the ways through the second as dense as told.
    #[test]
    fn openings_around_a_corner_do_not_add_to_each_other() {
        let opening = |corner: DVec3, sides: [DVec3; 2], normal: DVec3| {
            let area = sides[0].cross(sides[1]).length();
            Opening { corner, sides, normal, area, power: area }
        };
        let front = opening(DVec3::ZERO, [DVec3::X, DVec3::Z], -DVec3::Y);
        let side = opening(DVec3::X, [DVec3::Y, DVec3::Z], DVec3::X);
        let openings = Openings::of(vec![front, side.clone()]);
        let place = Place { point: DVec3::new(0.2, -0.3, 0.1), normal: DVec3::Y, triangle: u32::MAX };
        let (mut random, axes, count) = (Random::new(3), frame(place.normal), 100_000);
        let [mut by_chance, mut sought] = [0.0; 2];
        for _ in 0..count {
            let direction = cosine_direction(&axes, random.next_unit(), random.next_unit());
            by_chance += f64::from(u8::from(side.crossed(place.point, direction).is_some()));
            if let Some((direction, density)) = openings.sought(&place, [random.next_unit(), random.next_unit()]) {
                sought += direction.dot(place.normal) / (PI * density);
            }
        }
        // A tenth of the rays.
        assert!((sought / by_chance - 1.0).abs() < 0.03, "{sought} {by_chance}");
    }

    /// A window behind a pane that lets two thirds of the light pass is one, and is told to let so much out, be the pane in its plane or behind that.
    #[test]
    fn panes_are_no_walls() {
        a_pane_is_no_wall(10.0, 0.0);
        a_pane_is_no_wall(10.1, 0.3);
    }

    fn a_pane_is_no_wall(height: f64, thick: f64) {
        let mut scene = hall([[9.0, 9.0], [10.0, 10.5]], thick);
        let base_color = [1.0, 1.0, 1.0, 1.0 / 3.0];
        scene.materials.push(Material {
            base_color,
            alpha_mode: AlphaMode::Blend,
            double_sided: true,
            ..Material::default()
        });
        let pane = [[9.0, 9.0], [10.0, 9.0], [10.0, 10.5], [9.0, 10.5]].map(|[x, y]| DVec3::new(x, y, height));
        scene.add_quad("pane", 1, pane);
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let list = &tracer.openings().list;
        let (area, power) = list.iter().fold((0.0, 0.0), |(area, power), one| (area + one.area, power + one.power));
        assert!((1.45..1.6).contains(&area), "{list:?}");
        // The edges of the roof hide some of it from the walls.
        let part = power / area;
        assert!(if thick > 0.0 { (0.3..0.6).contains(&part) } else { (0.6..0.73).contains(&part) }, "{list:?}");
    }

    /// Two holes that lie across the one cell of a rectangle leave it as it is.
    #[test]
    fn what_is_closed_across_is_not_trimmed_away() {
        let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
        // Open before 1 m and after 1.5 m.
        for [x, y, end, top] in [[1.0, -1.0, 3.0, 1.0], [-1.0, 1.0, 1.5, 3.0]] {
            let corners = [[x, y], [end, y], [end, top], [x, top]].map(|[x, y]| DVec3::new(x, y, 0.0));
            scene.add_quad("part", 0, corners);
        }
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let grid = Grid::new(DVec3::ZERO, [DVec3::X, DVec3::Y], 9.0);
        let hole = Hole { grid, normal: DVec3::Z, lines: Vec::new(), part: 1.0 };
        let corners = [[0.0, 0.0], [2.5, 0.0], [2.5, 2.0], [0.0, 2.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
        let rectangle = Rectangle { corners, cells: Vec::new(), count: 1.0 };
        assert_eq!(hole.trimmed(&tracer, &rectangle).area, 5.0);
    }

    /// None are where the sky is seen from all over the room, where there is no sky, and around what stands on a lawn.
    #[test]
    fn what_is_open_has_none() {
        assert_eq!(openings(&hall([[3.0; 2], [17.0; 2]], 0.3)), [0.0; 0]);
        let dark = Scene { sky: Sky::Black, ..hall([[9.95; 2], [10.05; 2]], 0.0) };
        assert_eq!(openings(&dark), [0.0; 0]);
        let mut lawn = Scene { materials: vec![Material::default()], ..Scene::default() };
        lawn.sky = Sky::Uniform([1000.0; 3]);
        around(&mut lawn, [[-50.0; 2], [50.0; 2]], [[0.0; 2], [1.0; 2]], 0.0, true);
        around(&mut lawn, [[-3.0; 2], [3.0; 2]], [[-1.0; 2], [1.0; 2]], 2.0, true);
        assert_eq!(openings(&lawn), [0.0; 0]);
    }

    /// Directions come as densely as told, and through openings only; what is found and what is sought make up the whole.
    #[test]
    fn directions_are_as_dense_as_told() {
        let mut scene = hall([[9.0, 9.0], [11.0, 10.5]], 0.0);
        // Another one, seen from the same places.
        around(&mut scene, [[9.0, 9.0], [11.0, 10.5]], [[9.2, 9.5], [9.7, 10.0]], 10.0, false);
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let openings = tracer.openings();
        assert!(!openings.is_empty());
        let place = Place { point: DVec3::new(8.0, 9.0, 8.0), normal: DVec3::new(0.6, 0.0, 0.8), triangle: u32::MAX };
        let (mut random, count) = (Random::new(1), 200_000);
        let axes = frame(place.normal);
        let is_out =
            |direction: DVec3| tracer.first(&tracer.ray(&place, direction, f64::INFINITY), 0) == Found::Escaped;
        let [mut whole, mut sky, mut parts] = [0.0; 3];
        for _ in 0..count {
            let direction = cosine_direction(&axes, random.next_unit(), random.next_unit());
            let by_cosine = direction.dot(place.normal) / PI;
            whole += openings.density(&place, direction) / by_cosine;
            if is_out(direction) {
                sky += 1.0;
                parts += openings.found(&place, direction, 0.25);
            }
            let drawn = [random.next_unit(), random.next_unit()];
            let (direction, counts) = openings.counted(&place, drawn, 0.25).unwrap();
            if is_out(direction) {
                parts += counts;
            }
        }
        let [whole, sky, parts] = [whole, sky, parts].map(|sum| sum / f64::from(count));
        assert!((whole - 1.0).abs() < 0.02, "{whole}");
        assert!((parts / sky - 1.0).abs() < 0.02, "{parts} {sky}");
    }
}
