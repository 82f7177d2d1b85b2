//! Surfaces that light can be continuous on: welded vertices, no T-vertices, smooth where the surface is smooth.
//!
//! Objects, instances and separate primitives that touch are sewn together by position, so that neither rays nor
//! interpolated light find a crack between them. A vertex that lies on a neighbour's edge (a T-vertex; Baum, Mann,
//! Smith and Winget 1991, "Making radiosity usable", §4) splits that neighbour. Only edges without a partner are
//! examined, and where a wall stands on or goes through a floor that would carry light past it (`mesh/contacts.rs`).

mod boxes;
mod contacts;
mod cut;
mod edges;
mod weld;

use crate::{Scene, Surface};
use contacts::Contacts;
pub use edges::EdgeSide;
use edges::{is_balanced, ordered};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
pub use weld::Weld;

/// Vertices closer than this share of the scene's largest extent are one vertex. Single precision resolves 6e-8 of
/// it; exporters that place instances by single-precision matrices miss by some 3e-7. Ten times more would weld
/// millimetre details of a building; ten times less leaves hairline cracks.
const WELD: f64 = 1e-6;

/// Faces that meet at less than this angle are smooth where the author gave no normals (radians; 30°, the usual
/// auto-smooth angle of modelling programs).
const CREASE: f64 = 30.0 * std::f64::consts::PI / 180.0;

/// Most faces on one edge that light may be continuous across. Each is compared with each other in view of all: 500
/// steps per face at 32, which is what sixteen walls of two layers have that meet on a line; twice as many cost four
/// times as much. Beyond it every face ends at the edge.
const MAX_FACES_ON_EDGE: usize = 32;

/// A surface stands on another if they meet at more than this angle (radians; what lies flat on it hides it).
const STANDING: f64 = 0.02;

/// Corner normals of the author that differ by less than this belong to one smooth surface (radians; 2°: quantised
/// normals of 8 bits are up to 0.7° off).
const SAME_NORMAL: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// One of the two sides of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Side {
    /// The side from which the corners run counter-clockwise.
    Front,
    /// The other one.
    Back,
}

impl Side {
    /// The opposite side.
    pub fn other(self) -> Side {
        match self {
            Side::Front => Side::Back,
            Side::Back => Side::Front,
        }
    }
}

/// The scene's triangles, sewn together. Rays, elements and outputs all refer to these triangles.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Welded positions.
    pub vertices: Vec<DVec3>,
    /// Welded corner indices.
    pub triangles: Vec<[u32; 3]>,
    /// Index of the scene triangle that each comes from.
    pub source: Vec<u32>,
    /// Barycentric coordinates of each corner in its source triangle; empty when no triangle was split.
    split: Vec<[DVec2; 3]>,
    /// For each corner the smooth vertex it belongs to: corners with the same number share one light value.
    pub smooth: Vec<[u32; 3]>,
    /// How many smooth vertices there are.
    pub smooth_count: usize,
    /// Distance within which vertices were welded, metres.
    pub tolerance: f64,
    /// Scene triangles that are missing here: two of their corners were welded into one.
    pub dropped: Vec<u32>,
    /// Whether so many surfaces go through each other that not all were cut where they do: light may pass below walls.
    pub uncut: bool,
}

const WHOLE: [DVec2; 3] = [DVec2::ZERO, DVec2::X, DVec2::Y];

impl Mesh {
    /// Welds a scene.
    pub fn new(scene: &Scene) -> Mesh {
        let mut weld = Weld::new(weld_distance(scene));
        let mut mesh = Mesh { tolerance: weld.tolerance, ..Mesh::default() };
        let welded: Vec<u32> = scene.positions.iter().map(|&p| weld.vertex(&mut mesh.vertices, p)).collect();
        for (index, corners) in scene.triangles.iter().enumerate() {
            let corners = corners.map(|v| welded[v as usize]);
            if corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0] {
                mesh.triangles.push(corners);
                mesh.source.push(index as u32);
            } else {
                mesh.dropped.push(index as u32);
            }
        }
        let contacts = mesh.cut_along_contacts(scene, &mut weld);
        mesh.conform(&contacts);
        mesh.smoothen(scene);
        mesh
    }

    /// What [`Mesh::dropped`] of a scene will be, and the distance within which its vertices are welded: for readers,
    /// who can say so while the names of the file are at hand.
    pub fn would_drop(scene: &Scene) -> (Vec<u32>, f64) {
        let tolerance = weld_distance(scene);
        // Both ends of an edge that vanishes are within the distance of one vertex. Few scenes have one so short, and
        // only those are welded here.
        let short = |&t: &usize| {
            let [a, b, c] = scene.corners(t);
            [(a, b), (b, c), (c, a)].iter().any(|(p, q)| p.distance(*q) <= 2.0 * tolerance)
        };
        let suspects: Vec<usize> = (0..scene.triangles.len()).filter(short).collect();
        if suspects.is_empty() {
            return (Vec::new(), tolerance);
        }
        let (mut weld, mut vertices) = (Weld::new(tolerance), Vec::new());
        let welded: Vec<u32> = scene.positions.iter().map(|&p| weld.vertex(&mut vertices, p)).collect();
        let vanishes = |&t: &usize| {
            let [a, b, c] = scene.triangles[t].map(|v| welded[v as usize]);
            a == b || b == c || c == a
        };
        (suspects.into_iter().filter(vanishes).map(|t| t as u32).collect(), tolerance)
    }

    /// Memory that it takes, bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.vertices)
            + size_of_val(&*self.triangles)
            + size_of_val(&*self.source)
            + size_of_val(&*self.split)
            + size_of_val(&*self.smooth)
    }

    /// Corner positions of a triangle.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }

    /// Area of a triangle, m².
    pub fn area(&self, triangle: usize) -> f64 {
        let [a, b, c] = self.corners(triangle);
        0.5 * (b - a).cross(c - a).length()
    }

    /// Area of all triangles, m².
    pub fn whole_area(&self) -> f64 {
        (0..self.triangles.len()).map(|triangle| self.area(triangle)).sum()
    }

    /// Unit normal of a triangle's front.
    pub fn normal(&self, triangle: usize) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// World position of barycentric coordinates `uv` (weights of corners 1 and 2).
    pub fn point(&self, triangle: usize, uv: DVec2) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        a + uv.x * (b - a) + uv.y * (c - a)
    }

    /// Barycentric coordinates (weights of corners 1, 2) of the foot of a point on a triangle's plane.
    pub fn barycentric(&self, triangle: usize, point: DVec3) -> DVec2 {
        let [a, b, c] = self.corners(triangle);
        let normal = (b - a).cross(c - a);
        let (from, square) = (point - a, normal.length_squared());
        DVec2::new(from.cross(c - a).dot(normal), (b - a).cross(from).dot(normal)) / square
    }

    /// The same point on the scene's own triangle, where pictures and colours are looked up.
    pub fn surface(&self, triangle: usize, uv: DVec2) -> Surface {
        let [a, b, c] = *self.split.get(triangle).unwrap_or(&WHOLE);
        Surface { triangle: self.source[triangle] as usize, uv: a + uv.x * (b - a) + uv.y * (c - a) }
    }

    /// Whether the triangle was cut from a larger one of the scene.
    pub fn is_split(&self) -> bool {
        !self.split.is_empty()
    }

    /// Splits every triangle at the T-vertices on its edges.
    fn conform(&mut self, contacts: &Contacts) {
        let hanging = self.hanging_vertices(contacts);
        if hanging.is_empty() {
            return;
        }
        let (triangles, source) = (std::mem::take(&mut self.triangles), std::mem::take(&mut self.source));
        let split = std::mem::take(&mut self.split);
        for (t, (corners, source)) in triangles.into_iter().zip(source).enumerate() {
            let edges = std::array::from_fn(|i| {
                let (a, b) = (corners[i], corners[(i + 1) % 3]);
                let mut list = hanging.get(&ordered(a, b)).cloned().unwrap_or_default();
                let start = self.vertices[a as usize];
                list.retain(|v| !corners.contains(v));
                list.sort_by(|&p, &q| {
                    let distance = |v: u32| self.vertices[v as usize].distance_squared(start);
                    distance(p).total_cmp(&distance(q))
                });
                list
            });
            self.bisect(source, corners, *split.get(t).unwrap_or(&WHOLE), edges);
        }
    }

    /// Adds a triangle, bisected at the vertices on its edges until none is left.
    fn bisect(&mut self, source: u32, corners: [u32; 3], bary: [DVec2; 3], edges: [Vec<u32>; 3]) {
        let Some(longest) = (0..3).max_by_key(|&i| edges[i].len()).filter(|&i| !edges[i].is_empty()) else {
            self.triangles.push(corners);
            self.source.push(source);
            self.split.push(bary);
            return;
        };
        // Turn the triangle so that the edge to cut runs from corner 0 to corner 1, and cut at its middle vertex.
        let turn = |i: usize| (i + longest) % 3;
        let [a, b, c] = [0, 1, 2].map(|i| corners[turn(i)]);
        let [bary_a, bary_b, bary_c] = [0, 1, 2].map(|i| bary[turn(i)]);
        let [ab, bc, ca] = [0, 1, 2].map(|i| edges[turn(i)].clone());
        let middle = ab.len() / 2;
        let p = ab[middle];
        let (start, along) = (self.vertices[a as usize], self.vertices[b as usize] - self.vertices[a as usize]);
        let share = (self.vertices[p as usize] - start).dot(along) / along.length_squared();
        let bary_p = bary_a + share * (bary_b - bary_a);
        self.bisect(source, [a, p, c], [bary_a, bary_p, bary_c], [ab[..middle].to_vec(), Vec::new(), ca]);
        self.bisect(source, [p, b, c], [bary_p, bary_b, bary_c], [ab[middle + 1..].to_vec(), bc, Vec::new()]);
    }

    /// For every edge without a partner, the vertices of other such edges that lie on it; where surfaces stand on
    /// others, for the edges there and the vertices there too.
    fn hanging_vertices(&self, contacts: &Contacts) -> FxHashMap<(u32, u32), Vec<u32>> {
        // A surface's inner edges are walked once each way.
        let sides = self.sides_of_edges();
        let unbalanced = sides.chunk_by(|a, b| a.edge == b.edge).filter(|faces| !is_balanced(faces));
        let mut loose: Vec<(u32, u32)> = unbalanced.map(|faces| faces[0].edge).collect();
        loose.extend(contacts.edges.iter().filter(|edge| sides.binary_search_by_key(edge, |side| &side.edge).is_ok()));
        loose.sort_unstable();
        loose.dedup();
        if loose.is_empty() {
            return FxHashMap::default();
        }
        let length = |&(a, b): &(u32, u32)| self.vertices[a as usize].distance(self.vertices[b as usize]);

        // A grid over the ends of these edges, its cells as long as the edges' mean.
        let mean = loose.iter().map(length).sum::<f64>() / loose.len() as f64;
        let cell = mean.max(8.0 * self.tolerance);
        let key = |p: DVec3| (p / cell).floor().as_i64vec3().to_array();
        let mut ends: Vec<u32> =
            loose.iter().flat_map(|&(a, b)| [a, b]).chain(contacts.vertices.iter().copied()).collect();
        ends.sort_unstable();
        ends.dedup();
        let mut grid: FxHashMap<[i64; 3], Vec<u32>> = FxHashMap::default();
        for &v in &ends {
            grid.entry(key(self.vertices[v as usize])).or_default().push(v);
        }

        let mut hanging = FxHashMap::default();
        for &(a, b) in &loose {
            let (start, end) = (self.vertices[a as usize], self.vertices[b as usize]);
            let along = end - start;
            let length = along.length();
            let mut found = Vec::new();
            // Walk the edge in half cells; every point of it is then within one cell of a visited one.
            let steps = (2.0 * length / cell).ceil().max(1.0) as usize;
            let mut visited = None;
            for step in 0..=steps {
                let home = key(start + along * (step as f64 / steps as f64));
                if visited == Some(home) {
                    continue;
                }
                visited = Some(home);
                for near in 0..27 {
                    let near_key = [home[0] + near % 3 - 1, home[1] + near / 3 % 3 - 1, home[2] + near / 9 - 1];
                    for &v in grid.get(&near_key).into_iter().flatten() {
                        let offset = self.vertices[v as usize] - start;
                        let share = offset.dot(along) / (length * length);
                        let margin = 2.0 * self.tolerance;
                        let inside = share * length > margin && (1.0 - share) * length > margin;
                        if v != a && v != b && inside && offset.distance(share * along) <= margin {
                            found.push(v);
                        }
                    }
                }
            }
            found.sort_unstable();
            found.dedup();
            if !found.is_empty() {
                hanging.insert((a, b), found);
            }
        }
        hanging
    }

    /// Joins the corners around each vertex across the edges at which the surface is smooth.
    fn smoothen(&mut self, scene: &Scene) {
        let normals: Vec<DVec3> = (0..self.triangles.len()).into_par_iter().map(|t| self.normal(t)).collect();
        let mut joined = Union::new(3 * self.triangles.len());
        let all = self.sides_of_edges();
        for sides in all.chunk_by(|a, b| a.edge == b.edge) {
            if sides.len() > MAX_FACES_ON_EDGE {
                continue;
            }
            for (n, (t, i)) in sides.iter().map(|side| side.place()).enumerate() {
                for (s, j) in sides[n + 1..].iter().map(|side| side.place()) {
                    // Two faces continue each other when they walk their common edge in opposite directions.
                    let opposite = self.triangles[t][i] == self.triangles[s][(j + 1) % 3];
                    if !opposite {
                        continue;
                    }
                    let around = sides.iter().map(|side| side.place());
                    let separated = sides.len() > 2 && self.is_separated(scene, &normals, (t, i), s, around);
                    for (tc, sc) in [(i, (j + 1) % 3), ((i + 1) % 3, j)] {
                        if !separated && self.is_smooth(scene, &normals, (t, tc), (s, sc)) {
                            joined.join(3 * t + tc, 3 * s + sc);
                        }
                    }
                }
            }
        }
        let names = joined.names();
        self.smooth_count = names.iter().map(|name| *name as usize + 1).max().unwrap_or_default();
        self.smooth = names.as_chunks::<3>().0.to_vec();
    }

    /// Whether a surface stands on the edge `i` of triangle `t` between it and its neighbour `s`, where both are lit: a
    /// wall without thickness on a floor that goes on behind it.
    fn is_separated(
        &self,
        scene: &Scene,
        normals: &[DVec3],
        (t, i): (usize, usize),
        s: usize,
        around: impl Iterator<Item = (usize, usize)>,
    ) -> bool {
        let corners = self.corners(t);
        let along = (corners[(i + 1) % 3] - corners[i]).normalize_or_zero();
        let (up, into) = (normals[t], normals[t].cross(along));
        // Angle about the edge from t, through the half space that its front looks into.
        let angle = |triangle: usize, edge: usize| {
            let away = self.corners(triangle)[(edge + 2) % 3] - corners[i];
            let angle = away.dot(up).atan2(away.dot(into));
            if angle < 0.0 { angle + std::f64::consts::TAU } else { angle }
        };
        let around: Vec<(usize, f64)> = around.map(|(r, k)| (r, angle(r, k))).collect();
        let to_neighbour = around.iter().find(|(r, _)| *r == s).map_or(std::f64::consts::PI, |(_, angle)| *angle);
        let double_sided = |r: usize| scene.material(self.source[r] as usize).has_two_sides();
        let both_sides = double_sided(t) && double_sided(s);
        around.iter().filter(|(r, _)| *r != t && *r != s).any(|(_, angle)| {
            let in_front = *angle > STANDING && *angle < to_neighbour - STANDING;
            let behind = *angle > to_neighbour + STANDING && *angle < std::f64::consts::TAU - STANDING;
            in_front || (both_sides && behind)
        })
    }

    /// Whether light is continuous from a corner of one triangle to the corner of its neighbour at the same vertex.
    fn is_smooth(&self, scene: &Scene, normals: &[DVec3], a: (usize, usize), b: (usize, usize)) -> bool {
        let cosine = normals[a.0].dot(normals[b.0]);
        if cosine > SAME_NORMAL.cos() {
            return true;
        }
        let authored = |(t, corner): (usize, usize)| {
            let at = self.split.get(t).unwrap_or(&WHOLE)[corner];
            scene.shading_normal(Surface { triangle: self.source[t] as usize, uv: at })
        };
        match (authored(a), authored(b)) {
            (Some(m), Some(n)) => cosine > 0.0 && m.dot(n) > SAME_NORMAL.cos(),
            (None, None) => cosine > CREASE.cos(),
            _ => false,
        }
    }
}

fn weld_distance(scene: &Scene) -> f64 {
    let extent = scene.bounding_box().map_or(0.0, |[lo, hi]| (hi - lo).max_element());
    (extent * WELD).max(f64::MIN_POSITIVE)
}

/// Disjoint sets with path halving.
struct Union(Vec<u32>);

impl Union {
    fn new(len: usize) -> Union {
        Union((0..len as u32).collect())
    }

    fn root(&mut self, mut i: usize) -> u32 {
        while self.0[i] as usize != i {
            self.0[i] = self.0[self.0[i] as usize];
            i = self.0[i] as usize;
        }
        i as u32
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        let (low, high) = (a.min(b), a.max(b));
        self.0[high as usize] = low;
    }

    /// The number of the set that each is in, in the order of their first members.
    fn names(mut self) -> Vec<u32> {
        let mut next = 0;
        let mut names: Vec<u32> = Vec::with_capacity(self.0.len());
        for i in 0..self.0.len() {
            // The root of a set is its first member.
            let root = self.root(i) as usize;
            names.push(if root < i { names[root] } else { next });
            next += u32::from(root == i);
        }
        names
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Material;

    fn quad(scene: &mut Scene, corners: [[f64; 3]; 4]) {
        if scene.materials.is_empty() {
            scene.materials.push(Material::default());
        }
        scene.add_quad("quad", 0, corners.map(DVec3::from));
    }

    #[test]
    fn quads_that_meet_within_rounding_are_sewn_and_smooth() {
        let mut scene = Scene::default();
        quad(&mut scene, [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]);
        quad(&mut scene, [[1.0 + 3e-7, 0., 0.], [2., 0., 0.], [2., 1., 0.], [1.0 - 2e-7, 1., 0.]]);
        let mesh = Mesh::new(&scene);
        assert_eq!(mesh.vertices.len(), 6);
        assert_eq!(mesh.smooth_count, 6);
        assert!(!mesh.is_split());
    }

    /// A wall without thickness breaks the light of the floor that goes on behind it; one below the floor does not.
    #[test]
    fn a_wall_on_an_edge_breaks_the_light() {
        // Six or eight of the floor, four of the wall.
        for (top, expected) in [(1.0, 12), (-1.0, 10)] {
            let mut scene = Scene::default();
            quad(&mut scene, [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]);
            quad(&mut scene, [[1., 0., 0.], [2., 0., 0.], [2., 1., 0.], [1., 1., 0.]]);
            quad(&mut scene, [[1., 0., 0.], [1., 1., 0.], [1., 1., top], [1., 0., top]]);
            assert_eq!(Mesh::new(&scene).smooth_count, expected);
        }
    }

    /// Time went with the cube of the number of faces on one edge: this test took minutes then.
    #[test]
    fn thousands_of_faces_on_one_edge_end_there() {
        let mut scene = Scene::default();
        let count = 3000;
        for i in 0..count {
            let (sin, cos) = (f64::from(i) / f64::from(count) * std::f64::consts::TAU).sin_cos();
            let (top, bottom) = if i % 2 == 0 { (1., 0.) } else { (0., 1.) };
            quad(&mut scene, [[0., 0., bottom], [cos, sin, bottom], [cos, sin, top], [0., 0., top]]);
        }
        // Each quad keeps its four smooth vertices.
        assert_eq!(Mesh::new(&scene).smooth_count, 4 * count as usize);
    }

    /// A scene with 100 km of ground is welded within 10 cm: what is smaller went without a word.
    #[test]
    fn triangles_that_welding_drops_are_named() {
        let mut scene = Scene::default();
        quad(&mut scene, [[0., 0., 0.], [1e5, 0., 0.], [1e5, 1e5, 0.], [0., 1e5, 0.]]);
        quad(&mut scene, [[5., 5., 1.], [5.05, 5., 1.], [5.05, 5.05, 1.], [5., 5.05, 1.]]);
        quad(&mut scene, [[8., 5., 1.], [8.15, 5., 1.], [8.15, 5.15, 1.], [8., 5.15, 1.]]);
        let mesh = Mesh::new(&scene);
        assert_eq!((mesh.dropped.as_slice(), mesh.triangles.len()), (&[2, 3][..], 4));
        assert_eq!(Mesh::would_drop(&scene), (vec![2, 3], mesh.tolerance));
        assert!((mesh.tolerance - 0.1).abs() < 1e-12);
        scene.positions.truncate(6);
        scene.triangles.truncate(2);
        assert_eq!(Mesh::would_drop(&scene).0, []);
    }

    #[test]
    fn a_right_angle_breaks_the_light() {
        let mut scene = Scene::default();
        quad(&mut scene, [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]);
        quad(&mut scene, [[1., 0., 0.], [1., 0., 1.], [1., 1., 1.], [1., 1., 0.]]);
        let mesh = Mesh::new(&scene);
        assert_eq!(mesh.vertices.len(), 6);
        assert_eq!(mesh.smooth_count, 8);
    }

    /// Catalogue 49: one quad beside two half as wide has a T-vertex; after splitting every inner edge has a partner.
    #[test]
    fn t_vertices_split_their_neighbour() {
        let mut scene = Scene::default();
        quad(&mut scene, [[0., 0., 0.], [2., 0., 0.], [2., 1., 0.], [0., 1., 0.]]);
        for x in 0..4 {
            let x = 0.5 * f64::from(x);
            quad(&mut scene, [[x, 1., 0.], [x + 0.5, 1., 0.], [x + 0.5, 2., 0.], [x, 2., 0.]]);
        }
        let mesh = Mesh::new(&scene);
        assert!(mesh.is_split());
        assert_eq!(mesh.triangles.len(), 10 + 3);
        let area = mesh.whole_area();
        assert!((area - 4.0).abs() < 1e-12, "{area}");
        assert!(mesh.hanging_vertices(&Contacts::default()).is_empty());
        // Points keep their place on the source triangle.
        for t in 0..mesh.triangles.len() {
            let uv = DVec2::new(0.3, 0.2);
            let at = mesh.surface(t, uv);
            let [a, b, c] = scene.corners(at.triangle);
            let there = a + at.uv.x * (b - a) + at.uv.y * (c - a);
            assert!(there.distance(mesh.point(t, uv)) < 1e-12);
        }
    }

    /// Of each half of the floor what is lit hangs together around the corner of the box.
    #[test]
    fn a_box_across_the_diagonal_of_the_floor_does_not_cut_it() {
        let mut scene = Scene::default();
        quad(&mut scene, [[0., 0., 0.], [4., 0., 0.], [4., 4., 0.], [0., 4., 0.]]);
        let p = |x: f64, y: f64, z: f64| [x, y, z];
        let (l, h) = (1.0, 2.0);
        quad(&mut scene, [p(l, l, 0.), p(l, h, 0.), p(h, h, 0.), p(h, l, 0.)]);
        quad(&mut scene, [p(l, l, 1.), p(h, l, 1.), p(h, h, 1.), p(l, h, 1.)]);
        quad(&mut scene, [p(l, l, 0.), p(h, l, 0.), p(h, l, 1.), p(l, l, 1.)]);
        quad(&mut scene, [p(h, l, 0.), p(h, h, 0.), p(h, h, 1.), p(h, l, 1.)]);
        quad(&mut scene, [p(h, h, 0.), p(l, h, 0.), p(l, h, 1.), p(h, h, 1.)]);
        quad(&mut scene, [p(l, h, 0.), p(l, l, 0.), p(l, l, 1.), p(l, h, 1.)]);
        assert_eq!(Mesh::new(&scene).triangles.len(), 14);
    }
}
