//! Feet: edges at which a sheet ends on another surface, as a wall without thickness does on a floor.
//!
//! Where the floor goes on below the wall in one polygon, its elements would lie on both sides and carry light from one
//! room into the next. So the floor is cut along the foot, and floor and wall have the same vertices there.
//!
//! A foot is an edge that lies on a triangle of which it is no edge itself, and none of whose faces lies flat there: the
//! bottom of a box closes its feet. Only sheets have feet, surfaces that end somewhere or fold back onto themselves. What
//! is not opaque has none: grass would cut the ground to pieces, and light goes through it. Surfaces that go through each
//! other, without an edge there, are left as they are.

use super::boxes::Boxes;
use super::cut::Cutter;
use super::edges::{EdgeSide, is_balanced, ordered, sides_of_edges};
use super::{Mesh, STANDING, WHOLE, Weld};
use crate::{AlphaMode, Scene};
use glam::DVec3;

/// Boxes that the search for feet looks into: this many at most for each triangle of the scene, and [`LEAST_SEARCH`].
/// Beyond it, where long edges lie across everything, feet are no longer looked for. It keeps the time linear in the
/// triangles; twice as many take twice as long in such a scene, and any other never gets there.
const SEARCH: u64 = 500;

/// Small scenes may look into so many: of the order of a second.
const LEAST_SEARCH: u64 = 1 << 27;

/// Where sheets stand on other surfaces.
#[derive(Default)]
pub(super) struct Feet {
    /// Vertices on feet.
    pub vertices: Vec<u32>,
    /// The feet, and the edges of what they stand on, as they were.
    pub edges: Vec<(u32, u32)>,
}

impl Mesh {
    /// Cuts surfaces along the feet of sheets on them.
    pub(super) fn cut_along_feet(&mut self, scene: &Scene, weld: &mut Weld) -> Feet {
        let sides = self.edges_of_sheets();
        if sides.is_empty() {
            return Feet::default();
        }
        let boxes = Boxes::new(self);
        let most = (SEARCH * self.triangles.len() as u64).max(LEAST_SEARCH);
        let mut looked = 0;
        let mut standing: Vec<(u32, (u32, u32))> = Vec::new();
        for faces in sides.chunk_by(|a, b| a.edge == b.edge) {
            let opaque = |face: &EdgeSide| self.is_opaque(scene, face.place().0);
            if looked < most && faces.iter().any(opaque) {
                let (a, b) = faces[0].edge;
                let line = [a, b].map(|v| self.vertices[v as usize]);
                looked += boxes.near(line, self.tolerance, |host| {
                    if self.stands_on(scene, faces, host as usize) {
                        standing.push((host, (a, b)));
                    }
                });
            }
        }
        standing.sort_unstable();

        // Cut what they stand on, each triangle in its place.
        let mut feet = Feet::default();
        let mut pieces: Vec<(u32, Vec<[u32; 3]>)> = Vec::new();
        let mut cutter = Cutter::new(&mut self.vertices, weld);
        for run in standing.chunk_by(|a, b| a.0 == b.0) {
            let host = run[0].0;
            let corners = self.triangles[host as usize];
            let edges: Vec<(u32, u32)> = run.iter().map(|foot| foot.1).collect();
            if let Some(list) = cutter.cut(corners, &edges, &mut feet.vertices) {
                pieces.push((host, list));
            }
            feet.edges.extend((0..3).map(|i| ordered(corners[i], corners[(i + 1) % 3])));
            feet.edges.extend(edges);
        }
        if !pieces.is_empty() {
            self.replace(&pieces);
        }
        feet
    }

    /// Puts pieces in the place of triangles, which come in ascending order.
    fn replace(&mut self, pieces: &[(u32, Vec<[u32; 3]>)]) {
        let (mut triangles, mut source, mut split) = (Vec::new(), Vec::new(), Vec::new());
        let mut pieces = pieces.iter().peekable();
        for (t, corners) in self.triangles.iter().enumerate() {
            let whole = std::slice::from_ref(corners);
            let list = pieces.next_if(|(host, _)| *host as usize == t).map_or(whole, |(_, list)| list);
            let place = |v: u32| match corners.iter().position(|c| *c == v) {
                Some(corner) => WHOLE[corner],
                None => self.barycentric(t, self.vertices[v as usize]),
            };
            for piece in list {
                triangles.push(*piece);
                source.push(self.source[t]);
                split.push(if piece == corners { WHOLE } else { piece.map(place) });
            }
        }
        (self.triangles, self.source, self.split) = (triangles, source, split);
    }

    /// The edges at which a sheet can stand on something, with their sides: those where it ends or folds back, and those
    /// that begin there, as where a wall of one storey stands on that of another. Edges deeper within a surface are not
    /// looked at, for it would cost as much as all the rest of the mesh.
    fn edges_of_sheets(&self) -> Vec<EdgeSide> {
        let mut sides = sides_of_edges(&self.triangles, self.vertices.len());
        let mut is_end = vec![false; self.vertices.len()];
        for faces in sides.chunk_by(|a, b| a.edge == b.edge).filter(|faces| self.is_open(faces)) {
            let (a, b) = faces[0].edge;
            (is_end[a as usize], is_end[b as usize]) = (true, true);
        }
        sides.retain(|side| is_end[side.edge.0 as usize] || is_end[side.edge.1 as usize]);
        sides
    }

    /// Whether a surface ends at an edge, or folds back there as two faces back to back do.
    fn is_open(&self, faces: &[EdgeSide]) -> bool {
        let [a, b] = faces else { return !is_balanced(faces) };
        let (start, end) = (self.vertices[a.edge.0 as usize], self.vertices[a.edge.1 as usize]);
        let along = (end - start).normalize_or_zero();
        let away = |face: &EdgeSide| (self.third(face) - start).reject_from_normalized(along);
        let (p, q) = (away(a), away(b));
        let folds = p.dot(q) > 0.0 && p.cross(q).length() < STANDING * p.length() * q.length();
        folds || a.forward == b.forward
    }

    /// The corner of a triangle off its edge.
    fn third(&self, face: &EdgeSide) -> DVec3 {
        let (t, corner) = face.place();
        self.corners(t)[(corner + 2) % 3]
    }

    fn is_opaque(&self, scene: &Scene, triangle: usize) -> bool {
        scene.material(self.source[triangle] as usize).alpha_mode == AlphaMode::Opaque
    }

    /// Whether an edge is a foot on a triangle, given its faces.
    fn stands_on(&self, scene: &Scene, faces: &[EdgeSide], host: usize) -> bool {
        let (a, b) = faces[0].edge;
        let corners = self.triangles[host];
        if corners.contains(&a) && corners.contains(&b) {
            return false;
        }
        let [start, end] = [a, b].map(|v| self.vertices[v as usize]);
        let triangle = self.corners(host);
        let doubled = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
        let up = doubled.normalize_or_zero();
        let [from, to] = [start, end].map(|p| (p - triangle[0]).dot(up));
        if from.min(to) > self.tolerance || from.max(to) < -self.tolerance {
            return false;
        }

        // The part of the edge above the triangle lies on it, and is more than a point.
        let length = start.distance(end);
        let (mut first, mut last) = (0.0_f64, 1.0_f64);
        for i in 0..3 {
            let side = triangle[(i + 1) % 3] - triangle[i];
            // A sliver has no inside to cut.
            if doubled.length() < 8.0 * self.tolerance * side.length() {
                return false;
            }
            let inward = up.cross(side).normalize_or_zero();
            let [p, q] = [start, end].map(|end| (end - triangle[i]).dot(inward) + self.tolerance);
            if p < 0.0 && q < 0.0 {
                return false;
            } else if p < 0.0 {
                first = first.max(p / (p - q));
            } else if q < 0.0 {
                last = last.min(p / (p - q));
            }
        }
        let height = |share: f64| (from + share * (to - from)).abs();
        if (last - first) * length <= 2.0 * self.tolerance || height(first).max(height(last)) > self.tolerance {
            return false;
        }

        // No face lies flat on it, and one that stops light rises from a side that is lit.
        let along = (end - start) / length;
        let rise = |face: &EdgeSide| {
            let away = (self.third(face) - start).reject_from_normalized(along);
            away.dot(up) / away.length().max(f64::MIN_POSITIVE)
        };
        let double_sided = scene.material(self.source[host] as usize).double_sided;
        let stands = |face: &EdgeSide| self.is_opaque(scene, face.place().0) && (double_sided || rise(face) > 0.0);
        faces.iter().all(|face| rise(face).abs() > STANDING) && faces.iter().any(stands)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Material;
    use glam::DVec2;

    fn scene(quads: &[[[f64; 3]; 4]]) -> Scene {
        let materials = vec![Material { double_sided: true, ..Material::default() }];
        let mut scene = Scene { materials, ..Scene::default() };
        for corners in quads {
            scene.add_quad("quad", 0, corners.map(DVec3::from));
        }
        scene
    }

    const FLOOR: [[f64; 3]; 4] = [[0., 0., 0.], [4., 0., 0.], [4., 3., 0.], [0., 3., 0.]];

    /// A wall, one high, from one point of the floor to another.
    fn wall([x, y]: [f64; 2], [u, v]: [f64; 2]) -> [[f64; 3]; 4] {
        [[x, y, 0.], [u, v, 0.], [u, v, 1.], [x, y, 1.]]
    }

    /// The mesh, after what must hold of any: every part of the scene is there once, points keep their place on it, and
    /// no vertex lies within an edge.
    fn checked(scene: &Scene) -> Mesh {
        let mesh = Mesh::new(scene);
        let mut area = vec![0.0; scene.triangles.len()];
        for t in 0..mesh.triangles.len() {
            area[mesh.source[t] as usize] += mesh.area(t);
            assert!(mesh.area(t) > 0.0);
            assert!(mesh.normal(t).dot(mesh_normal(scene, mesh.source[t] as usize)) > 0.999);
            for uv in [DVec2::new(0.3, 0.2), DVec2::ZERO, DVec2::X, DVec2::Y] {
                let at = mesh.surface(t, uv);
                let [a, b, c] = scene.corners(at.triangle);
                let there = a + at.uv.x * (b - a) + at.uv.y * (c - a);
                assert!(there.distance(mesh.point(t, uv)) < 2.0 * mesh.tolerance, "{there} {}", mesh.point(t, uv));
            }
        }
        for (t, area) in area.into_iter().enumerate() {
            assert!((area / scene.area(t) - 1.0).abs() < 1e-5, "{t}: {area} of {}", scene.area(t));
        }
        for corners in &mesh.triangles {
            for i in 0..3 {
                let [a, b] = [corners[i], corners[(i + 1) % 3]].map(|v| mesh.vertices[v as usize]);
                let used = mesh.triangles.iter().flatten().filter(|v| !corners.contains(v));
                for p in used.map(|v| mesh.vertices[*v as usize]) {
                    let share = (p - a).dot(b - a) / a.distance_squared(b);
                    let hangs = (0.0..=1.0).contains(&share) && p.distance(a.lerp(b, share)) < mesh.tolerance;
                    assert!(!hangs, "{p} on {a} {b}");
                }
            }
        }
        mesh
    }

    fn mesh_normal(scene: &Scene, t: usize) -> DVec3 {
        let [a, b, c] = scene.corners(t);
        (b - a).cross(c - a).normalize()
    }

    /// The smooth vertices of the floor (the first two triangles of the scene) that a place of it has.
    fn names_at(mesh: &Mesh, p: [f64; 3]) -> usize {
        let on_floor = (0..mesh.triangles.len()).filter(|t| mesh.source[*t] < 2);
        let corners = on_floor.flat_map(|t| (0..3).map(move |i| (t, i)));
        let here = corners.filter(|&(t, i)| mesh.corners(t)[i].distance(p.into()) < 1e-5);
        let mut names: Vec<u32> = here.map(|(t, i)| mesh.smooth[t][i]).collect();
        names.sort_unstable();
        names.dedup();
        names.len()
    }

    #[test]
    fn a_wall_across_one_polygon_cuts_it() {
        for turned in [false, true] {
            let mut floor = FLOOR;
            floor.rotate_left(usize::from(turned));
            let mesh = checked(&scene(&[floor, wall([2., 0.], [2., 3.])]));
            // The wall has two triangles and gets a vertex where the floor's diagonal is; so has each half of the floor three.
            assert_eq!(mesh.triangles.len(), 3 + 6);
            for y in [0.0, 1.5, 3.0] {
                assert_eq!(names_at(&mesh, [2., y, 0.]), 2);
            }
        }
    }

    #[test]
    fn an_oblique_wall_cuts_the_floor() {
        let mesh = checked(&scene(&[FLOOR, wall([0.3, 0.], [3.1, 3.])]));
        assert_eq!((names_at(&mesh, [0.3, 0., 0.]), names_at(&mesh, [3.1, 3., 0.])), (2, 2));
        // From corner to corner, along and across the diagonal.
        checked(&scene(&[FLOOR, wall([0., 0.], [4., 3.])]));
        let mesh = checked(&scene(&[FLOOR, wall([4., 0.], [0., 3.])]));
        assert_eq!(names_at(&mesh, [4., 0., 0.]), 2);
    }

    /// It separates nothing, but the edge of its shadow is an edge of the floor.
    #[test]
    fn a_wall_that_ends_within_the_floor_cuts_it_as_far() {
        let mesh = checked(&scene(&[FLOOR, wall([1., 2.], [2.5, 1.])]));
        assert!(mesh.is_split());
        assert_eq!((names_at(&mesh, [1., 2., 0.]), names_at(&mesh, [2.5, 1., 0.])), (1, 1));
    }

    #[test]
    fn walls_that_cross_or_meet_share_a_vertex() {
        let mesh = checked(&scene(&[FLOOR, wall([1., 0.], [1., 3.]), wall([0., 2.], [4., 2.])]));
        assert_eq!(names_at(&mesh, [1., 2., 0.]), 4);
        let mesh = checked(&scene(&[FLOOR, wall([1., 0.], [1., 3.]), wall([1., 2.], [4., 2.])]));
        assert_eq!(names_at(&mesh, [1., 2., 0.]), 3);
        // Short of it by what is one place.
        let mesh = checked(&scene(&[FLOOR, wall([1., 0.], [1., 3.]), wall([1. + 3e-6, 2.], [4., 2.])]));
        assert_eq!(names_at(&mesh, [1., 2., 0.]), 3);
    }

    #[test]
    fn a_subdivided_wall_divides_the_edge_below_it() {
        let left = [[0., 0., 0.], [2., 0., 0.], [2., 3., 0.], [0., 3., 0.]];
        let right = [[2., 0., 0.], [4., 0., 0.], [4., 3., 0.], [2., 3., 0.]];
        let tenth = |i: i32| 0.3 * f64::from(i);
        let mut quads = vec![left, right];
        quads.extend((0..10).map(|i| wall([2., tenth(i)], [2., tenth(i + 1)])));
        let mut scene = scene(&quads);
        let mesh = checked(&scene);
        assert_eq!(mesh.triangles.len(), 20 + 4 + 18);
        // The other way round: a wall in one piece on tiles.
        scene.objects.clear();
        quads = vec![wall([2., 0.], [2., 3.])];
        quads.extend((0..10).flat_map(|i| {
            let tile =
                |x: f64| [[x, tenth(i), 0.], [x + 2., tenth(i), 0.], [x + 2., tenth(i + 1), 0.], [x, tenth(i + 1), 0.]];
            [tile(0.), tile(2.)]
        }));
        let mesh = checked(&self::scene(&quads));
        assert_eq!(mesh.triangles.len(), 40 + 2 + 9);
    }

    /// Walls of one-sided faces back to back have no edge without a partner.
    #[test]
    fn walls_of_two_layers_cut_the_floor() {
        let mut back = wall([2., 0.], [2., 3.]);
        back.reverse();
        let mut scene = scene(&[FLOOR, wall([2., 0.], [2., 3.]), back]);
        scene.materials[0].double_sided = false;
        let mesh = checked(&scene);
        assert_eq!(mesh.triangles.len(), 6 + 3 + 3);
        assert_eq!(names_at(&mesh, [2., 1.5, 0.]), 2);
    }

    #[test]
    fn what_does_not_stand_does_not_cut() {
        let whole = |quads: &[[[f64; 3]; 4]]| {
            let mesh = checked(&scene(quads));
            assert_eq!(mesh.triangles.len(), 2 * quads.len());
        };
        // Above the floor, beside it, through it, flat on it, and touching it with a corner.
        let lifted = |z: f64| wall([1., 1.], [3., 2.]).map(|[x, y, h]| [x, y, h + z]);
        whole(&[FLOOR, lifted(0.01)]);
        whole(&[FLOOR, lifted(-0.01)]);
        whole(&[FLOOR, wall([5., 0.], [5., 3.])]);
        whole(&[FLOOR, [[1., 1., 0.], [2., 1., 0.], [2., 2., 0.], [1., 2., 0.]]]);
        whole(&[FLOOR, [[1., 1., 0.], [2., 1., 1.], [2., 1., 2.], [1., 1., 1.]]]);
        // On the black back of the floor, and of glass.
        let mut below = scene(&[FLOOR, wall([2., 1.], [2., 2.]).map(|[x, y, z]| [x, y, -z])]);
        below.materials[0].double_sided = false;
        assert_eq!(checked(&below).triangles.len(), 4);
        let mut glass = scene(&[FLOOR, wall([2., 1.], [2., 2.])]);
        glass.materials[0].alpha_mode = AlphaMode::Blend;
        assert_eq!(checked(&glass).triangles.len(), 4);
    }

    /// Walls at all angles and places, near each other and the floor's edges by less than is told apart, and slivers.
    #[test]
    fn any_walls_leave_a_whole_floor() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        };
        for round in 0..200 {
            let mut quads = vec![FLOOR];
            let mut last = [1.0, 1.0];
            for _ in 0..1 + round % 8 {
                let mut end =
                    || [5.0 * random() - 0.5, 4.0 * random() - 0.5].map(|x| if random() < 0.3 { x.round() } else { x });
                let (from, to) = (end(), end());
                let jitter = 1e-5 * (random() - 0.5);
                let from = if random() < 0.4 { [last[0] + jitter, last[1] - jitter] } else { from };
                if (from[0] - to[0]).abs() + (from[1] - to[1]).abs() > 1e-3 {
                    quads.push(wall(from, to));
                }
                last = to;
            }
            let scene = scene(&quads);
            let mesh = Mesh::new(&scene);
            let floor = (0..mesh.triangles.len()).filter(|t| mesh.source[*t] < 2);
            let area: f64 = floor.map(|t| mesh.area(t)).sum();
            assert!((area - 12.0).abs() < 1e-4, "{round}: {area}");
        }
    }
}
