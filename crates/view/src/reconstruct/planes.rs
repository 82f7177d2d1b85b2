//! Planes of a mesh: what is found at places of one is shared between them ([`pooled`]).

use super::{edge_key, sides};
use crate::pool::{Pooled, Sample, pooled};
use glam::{DVec2, DVec3};
use radiosity_scene::{Bands, Elements, Mesh, Side, luminance};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Triangles lie on one plane where their normals differ by less than this cosine, of a degree.
pub(super) const FLAT: f64 = 0.9998;

/// Triangles that lie flat beside each other, where light is continuous from one to the next: planes end where walls stand on
/// them.
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
    /// Standard error of its luminance, lx.
    pub noise: f32,
    /// In proportion to the rays.
    pub weight: f64,
}

impl Planes {
    /// Of the sides that carry elements.
    pub fn new(mesh: &Mesh, elements: &Elements) -> Planes {
        let n = mesh.triangles.len();
        let mut parent: Vec<usize> = (0..2 * n).collect();
        let mut beside: FxHashMap<((u32, u32), usize), Vec<usize>> = FxHashMap::default();
        for (t, side) in sides(elements, n) {
            for edge in 0..3 {
                let others = beside.entry((edge_key(mesh, t, edge), side as usize)).or_default();
                for &other in others.iter().filter(|other| mesh.normal(t).dot(mesh.normal(**other)) > FLAT) {
                    let [a, b] = [t, other].map(|t| root(&mut parent, 2 * t + side as usize));
                    parent[a.max(b)] = a.min(b);
                }
                others.push(t);
            }
        }
        let (mut number, mut planes) = (vec![[None; 2]; n], Vec::<Plane>::new());
        let mut of_root: FxHashMap<usize, usize> = FxHashMap::default();
        for (t, side) in sides(elements, n) {
            let own = *of_root.entry(root(&mut parent, 2 * t + side as usize)).or_insert(planes.len());
            if own == planes.len() {
                planes.push(Plane::default());
            }
            planes[own].extend(mesh, t);
            number[t][side as usize] = Some(own);
        }
        Planes { number, planes }
    }

    /// Light at all places, shared with others of their plane as far as it is smooth.
    pub fn pooled(&self, found: &[Finding]) -> Vec<Pooled> {
        let mut by_plane: Vec<Vec<usize>> = vec![Vec::new(); self.planes.len()];
        for (i, finding) in found.iter().enumerate() {
            if let Some(plane) = self.number[finding.triangle][finding.side as usize] {
                by_plane[plane].push(i);
            }
        }
        let mut out: Vec<Pooled> = found.iter().map(|f| Pooled { light: f.light, own: 1.0 }).collect();
        let of_plane = |(plane, own): (&Plane, &Vec<usize>)| pooled(&plane.samples(found, own));
        let all: Vec<Vec<Pooled>> = self.planes.par_iter().zip(&by_plane).map(of_plane).collect();
        for (own, light) in by_plane.iter().zip(all) {
            own.iter().zip(light).for_each(|(&i, light)| out[i] = light);
        }
        out
    }
}

/// The least member of a set, whose ways there become shorter.
fn root(parent: &mut [usize], mut i: usize) -> usize {
    while parent[i] != i {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    i
}

impl Plane {
    fn extend(&mut self, mesh: &Mesh, triangle: usize) {
        self.area += mesh.area(triangle);
        let [a, b, c] = mesh.corners(triangle);
        for edge in [b - a, c - b, a - c] {
            let length = edge.length();
            if length > self.longest {
                let along = edge / length;
                *self = Plane { axes: [along, mesh.normal(triangle).cross(along)], longest: length, ..*self };
            }
        }
    }

    /// Some findings on it, about one to a slot.
    fn samples(&self, found: &[Finding], own: &[usize]) -> Vec<Sample> {
        let at = |i: &usize| DVec2::from(self.axes.map(|axis| axis.dot(found[*i].point)));
        let bounds = |(low, high): (DVec2, DVec2), i: &usize| (low.min(at(i)), high.max(at(i)));
        let (low, high) = own.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), bounds);
        let around = (high - low).element_product();
        let area = if around > 0.0 { around.min(self.area) } else { self.area };
        let width = (area / own.len() as f64).sqrt().max(f64::MIN_POSITIVE);
        let sample = |i: &usize| {
            let Finding { light, noise, weight, .. } = found[*i];
            Sample { at: (at(i) - low) / width, light, noise, weight: weight as f32 }
        };
        own.iter().map(sample).collect()
    }
}

/// What the elements of a cell found, by two halves of their rays; nothing where all of it is buried.
fn of_cell(mesh: &Mesh, elements: &Elements, cell: usize, halves: &[[Bands; 2]], weight: &[f64]) -> Option<Finding> {
    let (mut sums, mut total, mut rays) = ([[0f64; 3]; 2], 0.0, 0.0);
    for element in elements.of_cell(cell) {
        let w = weight[element as usize];
        total += w;
        rays += elements.share(mesh, element);
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
        noise: 0.5 * (luminance(first) - luminance(second)).abs(),
        weight: rays,
    })
}

/// The light of all cells, shared with others of their plane as far as it is smooth; nothing where a cell is buried.
pub(super) fn shared(mesh: &Mesh, elements: &Elements, halves: &[[Bands; 2]], weight: &[f64]) -> Vec<Option<[f64; 3]>> {
    let found = |cell| Some((cell, of_cell(mesh, elements, cell, halves, weight)?));
    let (cells, found): (Vec<usize>, Vec<Finding>) = (0..elements.cells()).filter_map(found).unzip();
    let mut light = vec![None; elements.cells()];
    for (cell, pooled) in cells.into_iter().zip(Planes::new(mesh, elements).pooled(&found)) {
        light[cell] = Some(pooled.light.map(f64::from));
    }
    light
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
