//! Where beams end: what a lamp without area lights through an opening so small that nobody would look there by chance.
//!
//! A sun spot of a hand's breadth on the floor of a hall may be all the light there is in it, and neither shadow rays from all over the floor nor paths
//! meet it. Its outline is the shadow of edges, so it is looked for past each edge that has nothing of its surfaces on one side as the lamp sees it: a ray
//! that passes there goes on to where it ends. Where the lamp reaches that place, and about the ray nearly nothing, there is a beam. Its end
//! is told by cells of a grid on the triangle, as many as reach from one lit cell to the next, which are made larger until they are few.
//!
//! What is cut out of a surface by its opacity has no edges, and is not looked for; nor is anything where panes let a part of the light pass by chance, or
//! where there are millions of triangles.

use crate::edges::{Edges, MOST_TRIANGLES, PAST, spread, thin};
use crate::grid::{Extent, Grid};
use crate::sampling::{Sequence, cosine_direction, frame, hash, unit};
use crate::{Found, Place, Tracer};
use glam::DVec3;
use radiosity_scene::{PointLight, Side, luminance};
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// Rays past edges for all lights, about.
const PROBES: f64 = (1 << 17) as f64;

/// No beams are looked for past the edges of more triangles than so many, each for one light, and a few more. The brightest lights are taken.
const MOST_LOOKS: usize = 1 << 25;

/// A beam is narrow where of so many places on a disc around it fewer than so many are lit. The disc has this part of the area of all surfaces at most, and a
/// radius of this part of how far the place sees, or a hall on a wide site would be taken for the site.
const AROUND: u32 = 32;
const MANY: usize = 2;
const DISC: f64 = 1.0 / 64.0;
const REACH: f64 = 0.5;

/// The ends of beams are found by chance where more than this part of the rays would meet them that come from as far away as half of what they light is, by
/// some rays; then they are left to it.
const SMALL: f64 = 1.0 / 128.0;
const SIGHTS: u32 = 16;

/// How many places on one triangle may be too much to be the end of a beam.
const FAILURES: usize = 16;

/// Rays that look whether any of a cell is lit, and those that tell how much.
const GLANCES: u32 = 4;
const LOOKS: u32 = 16;

/// The streams of sample points that these use.
const ON_DISC: u32 = 0x0500;
const IN_CELL: u32 = 0x0501;
const FROM_END: u32 = 0x0502;

/// Cells along the radius of the disc, at least.
const COARSEST: f64 = 8.0;

/// A part of a triangle that a lamp lights through a small opening.
#[derive(Clone, Debug)]
pub struct Beam {
    /// The lamp, by its number in the scene.
    pub light: u32,
    /// Mesh triangle.
    pub triangle: u32,
    /// Its side that is lit.
    pub side: Side,
    /// Unit normal of that side.
    pub normal: DVec3,
    /// Where it ends; cells may reach beyond the triangle.
    pub end: Grid,
}

impl Beam {
    /// What is lit, m².
    pub fn lit(&self) -> f64 {
        self.end.area_within()
    }

    /// A place where it ends.
    pub fn middle(&self) -> Place {
        let cells = self.end.cells();
        Place { point: cells[cells.len() / 2].point, normal: self.normal, triangle: self.triangle }
    }

    /// The surfaces that some rays by cosine meet from there: how far away, and where.
    pub fn sights(&self, tracer: &Tracer) -> Vec<(f64, Place)> {
        sights(tracer, &self.middle(), self.triangle)
    }

    /// Whether few rays would meet its end from where its light goes.
    fn is_small(&self, tracer: &Tracer) -> bool {
        self.lit() < SMALL * PI * middle_of(self.sights(tracer)).powi(2)
    }

    /// Whether it ends at a place of its triangle.
    pub fn holds(&self, place: &Place) -> bool {
        self.normal.dot(place.normal) > 0.0 && self.end.cell(place.point).is_some()
    }
}

/// The surface on which a beam may end.
struct Target<'t> {
    tracer: &'t Tracer<'t>,
    light: u32,
    triangle: u32,
    normal: DVec3,
    /// Beams that end there already.
    earlier: &'t [Beam],
}

impl Target<'_> {
    /// The places of a cell that are lit and that no earlier beam has, of some that are spread over it.
    fn lit_of<'s>(&'s self, grid: &'s Grid, at: [i32; 2], looks: u32) -> impl Iterator<Item = DVec3> + 's {
        let Target { tracer, light, triangle, normal, earlier } = *self;
        let [i, j] = at.map(|x| x as u32);
        let seed = hash(i ^ hash(j ^ hash(triangle)));
        let sequence = Sequence::new(seed, IN_CELL);
        let light = &tracer.scene.lights[light as usize];
        let places = (0..looks).map(move |look| {
            let [x, y] = sequence.pair(look).map(f64::from);
            Place { point: grid.within(at, x, y), normal, triangle }
        });
        let is_on = move |place: &Place| {
            let uv = tracer.mesh.barycentric(triangle as usize, place.point);
            uv.x >= 0.0 && uv.y >= 0.0 && uv.x + uv.y <= 1.0
        };
        let is_free = move |place: &Place| !earlier.iter().any(|beam| beam.holds(place));
        places
            .filter(move |place| is_on(place) && is_free(place) && reaches(tracer, light, place, seed))
            .map(|place| place.point)
    }
}

impl Extent for Target<'_> {
    fn glance(&self, grid: &Grid, at: [i32; 2], _: DVec3) -> Option<DVec3> {
        self.lit_of(grid, at, GLANCES).next()
    }

    fn share(&self, grid: &Grid, at: [i32; 2]) -> f32 {
        self.lit_of(grid, at, LOOKS).count().max(1) as f32 / LOOKS as f32
    }
}

/// The ends of all beams that were found.
#[derive(Clone, Debug, Default)]
pub struct Beams {
    /// By triangle.
    list: Vec<Beam>,
}

/// A place where a narrow beam ends.
struct Seed {
    light: u32,
    side: Side,
    place: Place,
    /// Unit direction of the edge's shadow there.
    along: DVec3,
    /// The radius of the disc that tells what is narrow there.
    radius: f64,
}

impl Beams {
    pub(crate) fn find(tracer: &Tracer) -> Beams {
        let triangles = tracer.mesh.triangles.len();
        let power = |light: &PointLight| luminance(light.intensity);
        let mut lights: Vec<(u32, &PointLight)> =
            (0..).zip(&tracer.scene.lights).filter(|(_, l)| power(l) > 0.0).collect();
        if lights.is_empty() || triangles > MOST_TRIANGLES || tracer.has_panes() {
            return Beams::default();
        }
        lights.sort_by(|(_, a), (_, b)| power(b).total_cmp(&power(a)));
        lights.truncate(MOST_LOOKS / triangles.max(1) + 1);
        let edges = Edges::of(tracer.mesh, |_| true);
        let radius = (DISC * tracer.mesh.whole_area() / PI).sqrt();
        let probes = PROBES / lights.len() as f64;
        let mut seeds: Vec<Seed> =
            lights.into_iter().flat_map(|light| edges.seeds((tracer, radius), light, probes)).collect();
        thin(&mut seeds);
        seeds.sort_by_key(|seed| (seed.place.triangle, seed.light));
        let groups: Vec<&[Seed]> =
            seeds.chunk_by(|a, b| (a.place.triangle, a.light) == (b.place.triangle, b.light)).collect();
        let grown = |group: &&[Seed]| {
            let mut beams: Vec<Beam> = Vec::new();
            let mut failures = 0;
            for seed in *group {
                let Seed { side, place, radius, .. } = seed;
                if beams.iter().any(|beam| beam.side == *side && beam.end.is_about(place.point)) {
                    continue;
                }
                let Place { point, normal, triangle } = *place;
                let axes = [seed.along, normal.cross(seed.along)];
                let target = Target { tracer, light: seed.light, triangle, normal, earlier: &beams };
                let grid = Grid::new(point, axes, PAST * tracer.offset());
                match grid.grown(&target, radius / COARSEST) {
                    Some(end) => beams.push(Beam { light: seed.light, triangle, side: *side, normal, end }),
                    None => failures += 1,
                }
                if failures > FAILURES {
                    break;
                }
            }
            beams.retain(|beam| beam.is_small(tracer));
            beams
        };
        Beams { list: groups.par_iter().flat_map_iter(grown).collect() }
    }

    /// Memory that they take, bytes.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.list) + self.list.iter().map(|beam| beam.end.bytes()).sum::<usize>()
    }

    /// All of them.
    pub fn all(&self) -> &[Beam] {
        &self.list
    }

    /// Those that end on a triangle, by their numbers.
    pub fn on(&self, triangle: u32) -> Range<usize> {
        if self.list.is_empty() {
            return 0..0;
        }
        let start = self.list.partition_point(|beam| beam.triangle < triangle);
        start..start + self.list[start..].iter().take_while(|beam| beam.triangle == triangle).count()
    }
}

/// The surfaces that some rays by cosine meet from a place: how far away, and where.
fn sights(tracer: &Tracer, from: &Place, salt: u32) -> Vec<(f64, Place)> {
    let (sequence, axes) = (Sequence::new(salt, FROM_END), frame(from.normal));
    let sight = |index: u32| {
        let [u, v] = sequence.pair(index).map(f64::from);
        let found = tracer.first(&tracer.ray(from, cosine_direction(&axes, u, v), f64::INFINITY), hash(index));
        let Found::Surface { distance, .. } = found else { return None };
        Some((f64::from(distance), tracer.place(found)?))
    };
    (0..SIGHTS).filter_map(sight).collect()
}

/// How far most of what a place sees is away; without end where half of it is nothing at all.
fn middle_of(sights: Vec<(f64, Place)>) -> f64 {
    let mut distances: Vec<f64> = sights.into_iter().map(|(far, _)| far).collect();
    distances.sort_by(f64::total_cmp);
    distances.get(SIGHTS as usize / 2).copied().unwrap_or(f64::INFINITY)
}

/// Whether a lamp lights a place.
fn reaches(tracer: &Tracer, light: &PointLight, place: &Place, seed: u32) -> bool {
    let (towards, distance, arriving) = light.arrival(place.point);
    let falls = towards.dot(place.normal) > 0.0 && luminance(arriving) > 0.0;
    falls && tracer.sees_lamp(place, (towards, distance), seed)
}

impl Edges<'_> {
    /// Where narrow beams end that pass an edge which has nothing of its surfaces on one side, as the light sees it.
    fn seeds(&self, of: (&Tracer, f64), (number, light): (u32, &PointLight), probes: f64) -> Vec<Seed> {
        let outlines: Vec<Outline> = self.all().filter_map(|own| self.outline(own, light)).collect();
        let lengths: Vec<f32> = outlines.iter().map(|outline| outline.along.length() as f32).collect();
        let counted: Vec<(&Outline, u32)> = outlines.iter().zip(spread(&lengths, probes)).collect();
        let seeds = |(index, (outline, count)): (usize, &(&Outline, u32))| {
            let (count, salt) = (*count, hash(index as u32 ^ hash(number)));
            let seed = move |k: u32| outline.seed(of, (number, light), (k, count), hash(salt ^ k));
            (0..count).filter_map(seed).collect::<Vec<_>>()
        };
        counted.par_iter().enumerate().flat_map_iter(seeds).collect()
    }

    /// What is told of an edge by its triangles; `None` if these lie on both sides of it.
    fn outline(&self, own: &[[u32; 3]], light: &PointLight) -> Option<Outline> {
        let [a, b, _] = own[0].map(|v| self.mesh.vertices[v as usize]);
        let along = b - a;
        let (towards, ..) = light.arrival(a + 0.5 * along);
        let across = along.cross(towards);
        let turned = |corner: &[u32; 3]| {
            let aside = self.mesh.vertices[corner[2] as usize] - a;
            let turned = aside.dot(across);
            // Of what is seen edge-on nothing lies on either side.
            if turned.abs() > 1e-6 * along.length() * aside.length() { turned.signum() } else { 0.0 }
        };
        let (low, high) =
            own.iter().map(turned).fold((0.0, 0.0), |(low, high), x| (f64::min(low, x), f64::max(high, x)));
        let away = if high > 0.0 { -across } else { across };
        let away = away.try_normalize().filter(|_| low == 0.0 || high == 0.0)?;
        Some(Outline { from: a, along, away, has_sides: low == 0.0 && high == 0.0 })
    }
}

/// An edge that hides what lies behind it, and the direction past it.
struct Outline {
    from: DVec3,
    along: DVec3,
    away: DVec3,
    /// Whether there is nothing on either side.
    has_sides: bool,
}

impl Outline {
    /// Where a ray past it ends, at the k-th of some places along it, if that is the end of a narrow beam.
    fn seed(
        &self,
        (tracer, radius): (&Tracer, f64),
        (number, light): (u32, &PointLight),
        (k, count): (u32, u32),
        salt: u32,
    ) -> Option<Seed> {
        let share = (f64::from(k) + f64::from(unit(salt))) / f64::from(count);
        let away = if self.has_sides && salt & 1 == 1 { -self.away } else { self.away };
        let beside = self.from + share * self.along + PAST * tracer.offset() * away;
        let (towards, ..) = light.arrival(beside);
        let found = tracer.first(&tracer.free_ray(beside, -towards), salt);
        let Found::Surface { side, .. } = found else { return None };
        let place = tracer.place(found)?;
        if !reaches(tracer, light, &place, salt) {
            return None;
        }
        let radius = radius.min(REACH * middle_of(sights(tracer, &place, salt)));
        let is_end = is_narrow(tracer, light, &place, radius, salt);
        let along = place.normal.cross(self.along.cross(towards)).try_normalize()?;
        is_end.then_some(Seed { light: number, side, place, along, radius })
    }
}

/// Whether nearly nothing is lit of a disc around the place that faces the lamp.
fn is_narrow(tracer: &Tracer, light: &PointLight, place: &Place, radius: f64, salt: u32) -> bool {
    let (towards, distance, _) = light.arrival(place.point);
    let radius = radius.min(0.5 * distance);
    let [along, across, _] = frame(towards);
    let sequence = Sequence::new(salt, ON_DISC);
    let is_lit = |index: &u32| {
        let [x, y] = sequence.pair(*index).map(f64::from);
        let turn = TAU * y;
        let point = place.point + radius * x.sqrt() * (turn.cos() * along + turn.sin() * across);
        reaches(tracer, light, &Place { point, normal: towards, triangle: u32::MAX }, salt)
    };
    (0..AROUND).filter(is_lit).take(MANY).count() < MANY
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rectangle;
    use radiosity_scene::{Material, Mesh, PointLightKind, Scene};

    /// A floor of 20 × 20 m, 10 m below a roof with an opening, walls, and the sun above.
    fn hall([x, end]: [f64; 2], [y, top]: [f64; 2]) -> Scene {
        let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
        let corner = |k: usize| DVec3::new([0.0, 20.0][k & 1], [0.0, 20.0][k >> 1 & 1], [0.0, 10.0][k >> 2]);
        for face in [[0, 1, 3, 2], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]] {
            scene.add_quad("shell", 0, face.map(corner));
        }
        let mut roof = |[x, end]: [f64; 2], [y, top]: [f64; 2]| {
            let corners = [[x, y], [x, top], [end, top], [end, y]].map(|[x, y]| DVec3::new(x, y, 10.0));
            scene.add_quad("roof", 0, corners);
        };
        roof([0.0, x], [0.0, 20.0]);
        roof([end, 20.0], [0.0, 20.0]);
        roof([x, end], [0.0, y]);
        roof([x, end], [top, 20.0]);
        scene.lights.push(PointLight {
            name: "sun".to_owned(),
            kind: PointLightKind::Directional,
            position: DVec3::ZERO,
            direction: DVec3::new(0.2, 0.1, -1.0).normalize(),
            intensity: [1e5; 3],
            range: None,
        });
        scene
    }

    /// On wide sunlit ground it is the same hall.
    #[test]
    fn a_wide_site_hides_no_beam() {
        let mut scene = hall([9.95, 10.05], [9.95, 10.05]);
        let ground = [[-300.0, -300.0], [300.0, -300.0], [300.0, 300.0], [-300.0, 300.0]];
        scene.add_quad("ground", 0, ground.map(|[x, y]| DVec3::new(x, y, -0.1)));
        assert!((lit(&scene) - 0.01).abs() < 0.0005, "{}", lit(&scene));
    }

    /// Of two spots side by side each is told once.
    #[test]
    fn spots_beside_each_other_are_told_once() {
        let mut scene = hall([9.95, 10.05], [9.9, 10.1]);
        let bar = [[9.9, 9.99], [9.9, 10.03], [10.1, 10.03], [10.1, 9.99]];
        scene.add_quad("bar", 0, bar.map(|[x, y]| DVec3::new(x, y, 10.1)));
        let lit = lit(&scene);
        assert!((lit - 0.016).abs() < 0.0006, "{lit}");
    }

    fn lit(scene: &Scene) -> f64 {
        let mesh = Mesh::new(scene);
        let tracer = Tracer::new(scene, &mesh);
        tracer.beams().all().iter().map(Beam::lit).sum()
    }

    /// Each is found as large as it is, however small and long; and once, though two triangles share it and four edges lead there.
    #[test]
    fn ends_of_beams_are_as_large_as_their_openings() {
        let openings = [
            ([9.95, 10.05], [9.95, 10.05]),
            ([12.0, 12.5], [3.0, 4.5]),
            ([9.999, 10.001], [8.0, 12.0]),
            ([9.0, 9.0005], [1.0, 18.0]),
            ([6.0, 6.01], [4.0, 4.005]),
        ];
        for (x, y) in openings {
            let (area, lit) = ((x[1] - x[0]) * (y[1] - y[0]), lit(&hall(x, y)));
            assert!((lit - area).abs() < 0.03 * area, "{x:?} × {y:?}: {lit}, {area} m²");
        }
    }

    /// No beams are where light falls widely: through a large opening, and around a table beneath a lamp.
    #[test]
    fn wide_light_is_no_beam() {
        assert_eq!(lit(&hall([5.0, 15.0], [5.0, 15.0])), 0.0);
        let mut room = hall([9.95, 10.05], [9.95, 10.05]);
        room.lights[0].kind = PointLightKind::Point;
        room.lights[0].position = DVec3::new(10.0, 10.0, 6.0);
        let table = [[8.0, 9.0], [9.0, 9.0], [9.0, 10.0], [8.0, 10.0]].map(|[x, y]| DVec3::new(x, y, 0.8));
        room.add_quad("table", 0, table);
        assert_eq!(lit(&room), 0.0);
    }

    /// Rectangles hold what the cells do, also of what is long and lies across the grid.
    #[test]
    fn rectangles_have_the_light_of_their_cells() {
        let scene = hall([9.999, 10.001], [8.0, 12.0]);
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        for beam in tracer.beams().all() {
            for turned in [0.0, 0.7] {
                // As if the grid lay otherwise.
                let (sin, cos) = f64::sin_cos(turned);
                let x = DVec3::X.reject_from_normalized(beam.normal).normalize();
                let y = beam.normal.cross(x);
                let axes = [cos * x + sin * y, cos * y - sin * x];
                let Beam { light, triangle, normal, .. } = *beam;
                let target = Target { tracer: &tracer, light, triangle, normal, earlier: &[] };
                let end = Grid::new(beam.middle().point, axes, 0.02).grown(&target, 1.0).unwrap();
                let rectangles = end.rectangles(8);
                assert!(rectangles.len() <= 8);
                let area = |[a, b, _, d]: &[DVec3; 4]| (*b - *a).cross(*d - *a).length();
                let share = |r: &Rectangle| r.cells.iter().map(|c| f64::from(c.share)).sum::<f64>() / r.count;
                let lit: f64 = rectangles.iter().map(|r| share(r) * area(&r.corners)).sum();
                assert!((lit - end.area_within()).abs() < 1e-9 * lit, "{lit}, {}", end.area_within());
            }
        }
    }
}
