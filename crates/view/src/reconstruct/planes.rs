//! Planes of a mesh: what is found at places of one is shared between them ([`pooled`]).

use super::{edge_key, sides};
use crate::pool::{Pooled, Sample, pooled};
use glam::{DVec2, DVec3};
use radiosity_scene::{Bands, Elements, Mesh, Side, luminance};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Triangles lie on one plane where their normals differ by less than this cosine, of a degree.
pub const FLAT: f64 = 0.9998;

/// Triangles that lie flat beside each other, where light is continuous from one to the next. Planes end where walls part them;
/// where one goes on around the end of a wall or through a door, no places share over the wall.
#[derive(Clone, Debug)]
pub struct Planes {
    /// By triangle and side.
    number: Vec<[Option<usize>; 2]>,
    planes: Vec<Plane>,
}

/// A plane.
#[derive(Clone, Debug, Default)]
struct Plane {
    /// Unit vectors along it, the first along the longest edge.
    axes: [DVec3; 2],
    longest: f64,
    /// m².
    area: f64,
    /// Edges on which another face stands, between two of its own triangles.
    walls: Vec<[DVec3; 2]>,
}

/// What rays found at a place of a mesh.
#[derive(Clone, Copy, Debug)]
pub struct Finding {
    /// Where the place is.
    pub point: DVec3,
    /// Its triangle.
    pub triangle: usize,
    /// Its side of that.
    pub side: Side,
    /// Light, lx per band.
    pub light: Bands,
    /// Standard error of its luminance, lx; negative where it is told by two halves of the rays and the second found more.
    pub noise: f32,
    /// In proportion to the rays, about.
    pub weight: f64,
}

impl Planes {
    /// Of the sides that carry elements.
    pub fn new(mesh: &Mesh, elements: &Elements) -> Planes {
        let n = mesh.triangles.len();
        let mut beside: FxHashMap<((u32, u32), usize), Vec<usize>> = FxHashMap::default();
        for (t, side) in sides(elements, n) {
            for edge in 0..3 {
                beside.entry((edge_key(mesh, t, edge), side as usize)).or_default().push(t);
            }
        }
        let (mut number, mut planes) = (vec![[None; 2]; n], Vec::<Plane>::new());
        for (first, side) in sides(elements, n) {
            let side = side as usize;
            if number[first][side].is_some() {
                continue;
            }
            let (own, mut plane) = (Some(planes.len()), Plane::default());
            number[first][side] = own;
            let mut open = vec![first];
            while let Some(t) = open.pop() {
                plane.extend(mesh, t);
                for edge in 0..3 {
                    for &other in &beside[&(edge_key(mesh, t, edge), side)] {
                        // Flat with the first, or one would come around a pillar facet by facet.
                        if number[other][side].is_none() && mesh.normal(first).dot(mesh.normal(other)) > FLAT {
                            number[other][side] = own;
                            open.push(other);
                        }
                    }
                }
            }
            planes.push(plane);
        }
        for (t, [a, b], other) in walled(mesh) {
            for (own, others) in number[t].iter().zip(number[other]) {
                if let Some(own) = own.filter(|own| others == Some(*own)) {
                    planes[own].walls.push([mesh.vertices[a as usize], mesh.vertices[b as usize]]);
                }
            }
        }
        Planes { number, planes }
    }

    /// Light at all places, shared with others of their plane as far as it is smooth. Places that lie on no plane keep theirs, and
    /// so do those whose light is not finite.
    pub fn pooled(&self, found: &[Finding]) -> Vec<Pooled> {
        let mut by_plane: Vec<Vec<usize>> = vec![Vec::new(); self.planes.len()];
        for (i, finding) in found.iter().enumerate() {
            let is_finite =
                finding.point.is_finite() && finding.noise.is_finite() && finding.light.iter().all(|e| e.is_finite());
            let sides = self.number.get(finding.triangle).filter(|_| is_finite);
            if let Some(plane) = sides.and_then(|sides| sides[finding.side as usize]) {
                by_plane[plane].push(i);
            }
        }
        let mut out: Vec<Pooled> = found.iter().map(|f| Pooled::alone(f.light, f.noise)).collect();
        let of_plane = |(plane, own): (&Plane, &Vec<usize>)| plane.pooled(found, own);
        let all: Vec<Vec<Pooled>> = self.planes.par_iter().zip(&by_plane).map(of_plane).collect();
        for (own, light) in by_plane.iter().zip(all) {
            own.iter().zip(light).for_each(|(&i, light)| out[i] = light);
        }
        out
    }
}

impl Plane {
    fn extend(&mut self, mesh: &Mesh, triangle: usize) {
        self.area += mesh.area(triangle);
        let [a, b, c] = mesh.corners(triangle);
        for edge in [b - a, c - b, a - c] {
            let length = edge.length();
            if length > self.longest {
                let along = edge / length;
                (self.axes, self.longest) = ([along, mesh.normal(triangle).cross(along)], length);
            }
        }
    }

    /// Light of some findings on it, about one to a slot.
    fn pooled(&self, found: &[Finding], own: &[usize]) -> Vec<Pooled> {
        let flat = |point: DVec3| DVec2::from(self.axes.map(|axis| axis.dot(point)));
        let at = |i: &usize| flat(found[*i].point);
        let bounds = |(low, high): (DVec2, DVec2), i: &usize| (low.min(at(i)), high.max(at(i)));
        let (low, high) = own.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), bounds);
        let around = (high - low).element_product();
        let area = if around > 0.0 { around.min(self.area) } else { self.area };
        let width = if area > 0.0 { (area / own.len() as f64).sqrt() } else { 1.0 };
        let sample = |i: &usize| {
            let Finding { light, noise, weight, .. } = found[*i];
            Sample { at: (at(i) - low) / width, light, noise, weight: weight as f32 }
        };
        let walls: Vec<[DVec2; 2]> = self.walls.iter().map(|ends| ends.map(|end| (flat(end) - low) / width)).collect();
        pooled(&own.iter().map(sample).collect::<Vec<_>>(), &walls)
    }
}

/// Edges between two triangles that lie flat beside each other on which a third one stands.
fn walled(mesh: &Mesh) -> Vec<(usize, [u32; 2], usize)> {
    let mut at_edge: FxHashMap<[u32; 2], Vec<usize>> = FxHashMap::default();
    let mut edges = Vec::new();
    for (t, corners) in mesh.triangles.iter().enumerate() {
        for edge in 0..3 {
            let (a, b) = (corners[edge], corners[(edge + 1) % 3]);
            let key = [a.min(b), a.max(b)];
            let beside = at_edge.entry(key).or_default();
            if beside.is_empty() {
                edges.push(key);
            }
            beside.push(t);
        }
    }
    let mut walled = Vec::new();
    for edge in edges {
        let beside = &at_edge[&edge];
        for (i, &t) in beside.iter().enumerate() {
            let is_flat = |other: usize| mesh.normal(t).dot(mesh.normal(other)) > FLAT;
            let partner = beside[i + 1..].iter().find(|other| is_flat(**other));
            if let (Some(&other), true) = (partner, beside.iter().any(|other| !is_flat(*other))) {
                walled.push((t, edge, other));
            }
        }
    }
    walled
}

/// What the elements of a cell found, by two halves of their rays; nothing where all of it is buried.
fn of_cell(mesh: &Mesh, elements: &Elements, cell: usize, halves: &[[Bands; 2]], weight: &[f64]) -> Option<Finding> {
    let (mut sums, mut total, mut rays) = ([[0f64; 3]; 2], 0.0, 0.0);
    for element in elements.of_cell(cell) {
        let w = weight[element as usize];
        total += w;
        rays += if w > 0.0 { elements.share(mesh, element) } else { 0.0 };
        for (sum, half) in sums.iter_mut().zip(&halves[element as usize]) {
            (0..3).for_each(|band| sum[band] += w * f64::from(half[band]));
        }
    }
    let (triangle, side) = elements.place(elements.of_cell(cell).start);
    let [a, b, c] = elements.cell_corners(cell);
    let [first, second] = sums.map(|sum| sum.map(|s| (s / total) as f32));
    (total > 0.0).then_some(Finding {
        point: mesh.point(triangle, (a + b + c) / 3.0),
        triangle,
        side,
        light: std::array::from_fn(|band| 0.5 * (first[band] + second[band])),
        noise: 0.5 * (luminance(first) - luminance(second)),
        weight: rays,
    })
}

/// The light of all cells, shared with others of their plane as far as it is smooth; nothing where a cell is buried.
pub(super) fn shared(mesh: &Mesh, elements: &Elements, halves: &[[Bands; 2]], weight: &[f64]) -> Vec<Option<Pooled>> {
    let found = |cell| Some((cell, of_cell(mesh, elements, cell, halves, weight)?));
    let (cells, found): (Vec<usize>, Vec<Finding>) = (0..elements.cells()).filter_map(found).unzip();
    let mut all = vec![None; elements.cells()];
    for (cell, pooled) in cells.into_iter().zip(Planes::new(mesh, elements).pooled(&found)) {
        all[cell] = Some(pooled);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_scene::{Material, Scene};
    use radiosity_trace::sampling::{hash, unit};

    /// A floor of two quads, a wall beside it, and a wall without thickness that stands on the line between the two.
    fn scene(divided: bool) -> (Scene, Mesh) {
        let mut scene = Scene::default();
        scene.materials.push(Material { double_sided: true, ..Material::default() });
        let corners = |points: [[f64; 3]; 4]| points.map(DVec3::from);
        scene.add_quad("left", 0, corners([[0., 0., 0.], [2., 0., 0.], [2., 3., 0.], [0., 3., 0.]]));
        scene.add_quad("right", 0, corners([[2., 0., 0.], [4., 0., 0.], [4., 3., 0.], [2., 3., 0.]]));
        scene.add_quad("wall", 0, corners([[0., 0., 0.], [0., 3., 0.], [0., 3., 2.], [0., 0., 2.]]));
        if divided {
            scene.add_quad("divider", 0, corners([[2., 0., 0.], [2., 3., 0.], [2., 3., 2.], [2., 0., 2.]]));
        }
        let mesh = Mesh::new(&scene);
        (scene, mesh)
    }

    /// The numbers of the planes of the triangles of each quad.
    fn numbers(scene: &Scene, mesh: &Mesh, side: Side) -> Vec<Vec<usize>> {
        let planes = Planes::new(mesh, &Elements::new(scene, mesh, 0.5));
        let of_object = |object: u32| {
            let is_own = |t: &usize| scene.triangle_object[mesh.source[*t] as usize] == object;
            let mut all: Vec<usize> =
                (0..mesh.triangles.len()).filter(is_own).map(|t| planes.number[t][side as usize].unwrap()).collect();
            all.sort_unstable();
            all.dedup();
            all
        };
        (0..scene.objects.len() as u32).map(of_object).collect()
    }

    #[test]
    fn planes_end_at_corners_and_where_walls_stand() {
        let (open, open_mesh) = scene(false);
        let [left, right, wall] = &numbers(&open, &open_mesh, Side::Front)[..] else { panic!("three objects") };
        assert!(left == right && left != wall && left.len() == 1 && wall.len() == 1);
        assert_ne!(left, &numbers(&open, &open_mesh, Side::Back)[0]);
        let (divided, mesh) = scene(true);
        let found = numbers(&divided, &mesh, Side::Front);
        assert!(found[0] != found[1], "{found:?}");
    }

    /// A pillar of facets so narrow that each is flat beside the next is no plane: its sides look away from each other.
    #[test]
    fn a_pillar_is_no_plane() {
        let mut scene = Scene::default();
        scene.materials.push(Material::default());
        let facets = 720;
        let at = |i: i32, z: f64| {
            let angle = f64::from(i) / f64::from(facets) * std::f64::consts::TAU;
            DVec3::new(angle.cos(), angle.sin(), z)
        };
        for i in 0..facets {
            scene.add_quad("pillar", 0, [at(i, 0.0), at(i + 1, 0.0), at(i + 1, 1.0), at(i, 1.0)]);
        }
        let mesh = Mesh::new(&scene);
        let planes = Planes::new(&mesh, &Elements::new(&scene, &mesh, 1.0));
        assert!(planes.planes.len() > 100, "{}", planes.planes.len());
        for (t, number) in planes.number.iter().enumerate() {
            let same = planes.number.iter().position(|other| other[0] == number[0]).unwrap();
            assert!(mesh.normal(t).dot(mesh.normal(same)) > FLAT);
        }
    }

    /// A wall that leaves a door is between places on either side of it all the same.
    #[test]
    fn a_wall_with_a_door_is_known() {
        let mut scene = Scene::default();
        scene.materials.push(Material { double_sided: true, ..Material::default() });
        let corners = |points: [[f64; 3]; 4]| points.map(DVec3::from);
        scene.add_quad("floor", 0, corners([[0., 0., 0.], [8., 0., 0.], [8., 5., 0.], [0., 5., 0.]]));
        scene.add_quad("wall", 0, corners([[4., 1., 0.], [4., 5., 0.], [4., 5., 3.], [4., 1., 3.]]));
        let mesh = Mesh::new(&scene);
        let planes = Planes::new(&mesh, &Elements::new(&scene, &mesh, 0.5));
        let finding = |i: usize| {
            let (x, y) = ((i % 80) as f64 / 10.0 + 0.05, (i / 80) as f64 / 10.0 + 0.05);
            let point = DVec3::new(x, y, 0.0);
            let is_on = |t: &usize| {
                let uv = mesh.barycentric(*t, point);
                scene.triangle_object[mesh.source[*t] as usize] == 0
                    && uv.min_element() >= 0.0
                    && uv.element_sum() <= 1.0
            };
            let triangle = (0..mesh.triangles.len()).find(is_on).unwrap();
            let light = if x < 4.0 { 1000.0 + 100.0 * (unit(hash(i as u32)) - 0.5) } else { 1.0 };
            let noise = if x < 4.0 { 30.0 } else { 0.0 };
            Finding { point, triangle, side: Side::Front, light: [light; 3], noise, weight: 1.0 }
        };
        let found: Vec<Finding> = (0..80 * 50).map(finding).collect();
        let plane = |f: &Finding| planes.number[f.triangle][0];
        assert!(found.iter().all(|f| plane(f) == plane(&found[0])), "the door joins both sides");
        for (f, pooled) in found.iter().zip(planes.pooled(&found)) {
            if f.point.x > 4.0 && f.point.y > 1.1 {
                assert!((pooled.light[0] - 1.0).abs() < 1e-2, "{} at {}", pooled.light[0], f.point);
            }
        }
    }

    /// Where a band of places ends in which light begins to rise, planes through them alone lie below it; those of wider ones around hold them up.
    #[test]
    fn places_around_a_band_hold_up_its_ends() {
        let (scene, mesh) = scene(false);
        let planes = Planes::new(&mesh, &Elements::new(&scene, &mesh, 0.5));
        let truth = |x: f64| 1.0 + (600.0 * (x - 0.52).max(0.0).powi(2)).min(2.0);
        let finding = |(x, y): (f64, f64), i: usize| {
            let triangle = (0..2).find(|t| mesh.barycentric(*t, DVec3::new(x, y, 0.0)).min_element() >= 0.0).unwrap();
            let light = truth(x) + 0.2 * (f64::from(unit(hash(i as u32))) - 0.5);
            let noise = 0.2 / 12f32.sqrt();
            let point = DVec3::new(x, y, 0.0);
            Finding { point, triangle, side: Side::Front, light: [light as f32; 3], noise, weight: 1.0 }
        };
        let grid = |x: [f64; 2], step: f64| {
            let columns = ((x[1] - x[0]) / step).round() as usize;
            let rows = (1.0 / step).round() as usize;
            let at = move |i: usize| (x[0] + step * (i % columns) as f64, 0.5 + step * (i / columns) as f64);
            (0..columns * rows).map(move |i| (at(i), i))
        };
        let band: Vec<Finding> = grid([0.5, 0.58], 0.01).map(|(at, i)| finding(at, i)).collect();
        let around = grid([0.34, 0.5], 0.02).chain(grid([0.58, 0.74], 0.02)).map(|(at, i)| finding(at, i + 100_000));
        let both: Vec<Finding> = band.iter().copied().chain(around).collect();
        let off = |pooled: &[Pooled]| {
            let first: Vec<usize> = (0..band.len()).filter(|i| band[*i].point.x < 0.515).collect();
            let off = first.iter().map(|i| f64::from(pooled[*i].light[0]) - truth(band[*i].point.x));
            off.sum::<f64>() / first.len() as f64
        };
        let [alone, held] = [&band, &both].map(|places| off(&planes.pooled(places)));
        assert!(alone < -0.008 && held.abs() < 0.5 * alone.abs(), "{alone} alone, {held} held up");
    }

    /// Noise of places of one plane is shared away, and nothing of their light comes to those of another.
    #[test]
    fn only_places_of_one_plane_share() {
        let (scene, mesh) = scene(true);
        let planes = Planes::new(&mesh, &Elements::new(&scene, &mesh, 0.5));
        let truth = |object: u32, p: DVec3| if object == 0 { 100.0 + 5.0 * p.x - 3.0 * p.y } else { 10.0 };
        let mut found = Vec::new();
        for i in 0..4000u32 {
            let draw = |k: u32| f64::from(unit(hash(hash(i) ^ k)));
            let triangle = (i as usize) % mesh.triangles.len();
            let object = scene.triangle_object[mesh.source[triangle] as usize];
            let (u, v) = radiosity_scene::elements::triangle_from_square(draw(1), draw(2));
            let point = mesh.point(triangle, DVec2::new(u, v));
            let noise = if object == 0 { 12f64.sqrt() * (draw(3) - 0.5) } else { 0.0 };
            let light = [(truth(object, point) + noise) as f32; 3];
            let finding = Finding { point, triangle, side: Side::Front, light, noise: 1.0, weight: 1.0 };
            found.push((object, finding));
        }
        let findings: Vec<Finding> = found.iter().map(|(_, finding)| *finding).collect();
        let (mut square, mut count) = (0.0, 0.0);
        for ((object, finding), pooled) in found.iter().zip(planes.pooled(&findings)) {
            let off = f64::from(pooled.light[0]) - truth(*object, finding.point);
            if *object == 0 {
                (square, count) = (square + off * off, count + 1.0);
            } else {
                assert!(off.abs() < 1e-3, "{off}");
            }
        }
        let off: f64 = (square / count).sqrt();
        assert!(off < 0.2, "{off}");
    }
}
