//! A continuous field from values that are constant on elements.
//!
//! Values sit on the corners of the cells of each triangle and are interpolated linearly. A corner's value is the
//! area-weighted mean of the elements around it, over all triangles that are smooth there; so constants stay constant,
//! and light is continuous where the surface is. Where two triangles of different division share an edge, the coarser
//! one's corners count and the finer one's others on that edge are interpolated between them (anchored hanging nodes),
//! so that no crack opens (catalogue 49, 61).

use glam::DVec2;
use radiosity_scene::{Bands, Elements, Mesh, Side};
use rustc_hash::FxHashMap;

/// Continuous values over the sides of a mesh.
#[derive(Clone, Debug)]
pub struct Field {
    /// First corner value of each triangle's front and back; `usize::MAX` where there is none.
    base: Vec<[usize; 2]>,
    /// Cells along an edge of each triangle.
    division: Vec<u32>,
    values: Vec<Bands>,
}

/// What corners of cells of several triangles share where light is continuous.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Shared {
    /// A smooth vertex.
    Vertex(u32, Side),
    /// Place `1..=k−1` of `k` along the edge between two smooth vertices, the lower number first.
    Edge(u32, u32, u32, u32, Side),
}

/// Index of the lattice corner in column `i` (by u) of row `j` (by v) of a triangle with k cells along its edges.
fn corner(i: u32, j: u32, k: u32) -> usize {
    (j * (2 * k + 3 - j) / 2 + i) as usize
}

/// How far corners on the border of a smooth surface are moved towards what keeps the means of the cells: there all cells
/// lie to one side, and their mean is the value a third of a cell further in. 1.8 is exact where light is linear and the
/// border straight, and takes the noise along. 1.5 leaves 0.80 % of error in the Cornell box where none leaves 0.86 % (128 rays).
const BORDER: f64 = 1.5;

/// A corner on the border is not moved to less than this part of its mean, nor by more than to twice of it.
const LEAST: f64 = 0.5;

/// The corners of all triangles, those that several share counted once.
struct Corners<'a> {
    mesh: &'a Mesh,
    elements: &'a Elements,
    /// First lattice corner of each triangle's front and back; `usize::MAX` where there is none.
    base: Vec<[usize; 2]>,
    /// Cells along an edge of each triangle.
    division: Vec<u32>,
    /// The number of each lattice corner.
    number: Vec<u32>,
    /// The numbers of those on the borders of triangles.
    shared: FxHashMap<Shared, u32>,
    /// By number, whether a smooth surface ends there.
    is_border: Vec<bool>,
    /// By edge, the coarsest division of the triangles that share it, and how many do.
    edges: FxHashMap<(u32, u32), (u32, u32)>,
}

impl<'a> Corners<'a> {
    fn new(mesh: &'a Mesh, elements: &'a Elements) -> Corners<'a> {
        let division: Vec<u32> = (0..mesh.triangles.len()).map(|t| elements.division(t)).collect();
        let mut edges: FxHashMap<(u32, u32), (u32, u32)> = FxHashMap::default();
        for (t, &k) in division.iter().enumerate() {
            for e in 0..3 {
                let (coarsest, count) = edges.entry(edge_key(mesh, t, e)).or_insert((k, 0));
                *coarsest = (*coarsest).min(k);
                *count += 1;
            }
        }
        let mut base = vec![[usize::MAX; 2]; division.len()];
        let (mut number, mut shared, mut is_border) = (Vec::new(), FxHashMap::default(), Vec::new());
        for (t, side) in sides(elements, division.len()) {
            let k = division[t];
            base[t][side as usize] = number.len();
            let ends = [0, 1, 2].map(|e| edges[&edge_key(mesh, t, e)].1 == 1);
            for (i, j) in lattice(k) {
                let new = is_border.len() as u32;
                let own = match shared_corner(mesh, t, side, (i, j), k) {
                    Some(key) => *shared.entry(key).or_insert(new),
                    None => new,
                };
                if own == new {
                    is_border.push(false);
                }
                is_border[own as usize] |= (ends[0] && j == 0) || (ends[1] && i + j == k) || (ends[2] && i == 0);
                number.push(own);
            }
        }
        Corners { mesh, elements, base, division, number, shared, is_border, edges }
    }

    /// Calls back with every cell and the lattice corners around it.
    fn each_cell(&self, mut visit: impl FnMut(usize, [usize; 3])) {
        for (t, side) in sides(self.elements, self.division.len()) {
            let k = self.division[t];
            let first = self.elements.cells_of(t, side).start;
            let base = self.base[t][side as usize];
            for_each_cell(k, |cell, around| {
                visit(first + cell as usize, around.map(|(i, j)| base + corner(i, j, k)));
            });
        }
    }

    /// The mean of the cells around each corner, by number; nothing where none of them weighs anything.
    fn mean(&self, cells: &[Cell]) -> Vec<Option<[f64; 3]>> {
        let mut sums = vec![Cell::default(); self.is_border.len()];
        self.each_cell(|cell, around| {
            let Cell { weight, value } = cells[cell];
            for number in around.map(|lattice| self.number[lattice] as usize) {
                let sum = &mut sums[number];
                sum.weight += weight;
                (0..3).for_each(|band| sum.value[band] += weight * value[band]);
            }
        });
        sums.iter().map(|sum| (sum.weight > 0.0).then(|| sum.value.map(|v| v / sum.weight))).collect()
    }

    /// The mean of a field over each cell; weights are those of `cells`.
    fn on_cells(&self, field: &[Bands], cells: &[Cell]) -> Vec<Cell> {
        let mut out = cells.to_vec();
        self.each_cell(|cell, around| {
            out[cell].value = std::array::from_fn(|band| {
                around.map(|lattice| f64::from(field[lattice][band])).iter().sum::<f64>() / 3.0
            });
        });
        out
    }

    /// The mean of the cells around each corner; on borders moved towards what keeps their values.
    fn fitted(&self, cells: &[Cell]) -> Vec<Bands> {
        let mut means = self.mean(cells);
        let mut missing = self.on_cells(&self.anchored(&means), cells);
        for (missing, cell) in missing.iter_mut().zip(cells) {
            (0..3).for_each(|band| missing.value[band] = cell.value[band] - missing.value[band]);
        }
        for ((mean, missing), is_border) in means.iter_mut().zip(self.mean(&missing)).zip(&self.is_border) {
            if let (Some(mean), Some(missing), true) = (mean, missing, is_border) {
                for (mean, missing) in mean.iter_mut().zip(missing) {
                    let (least, most) = (LEAST * mean.abs(), mean.abs() / LEAST);
                    *mean = (*mean + BORDER * missing).max(least).min(most);
                }
            }
        }
        self.anchored(&means)
    }

    /// The value of every lattice corner: on the finer side of each edge the coarser side's interpolation.
    fn anchored(&self, values: &[Option<[f64; 3]>]) -> Vec<Bands> {
        let mut out = Vec::with_capacity(self.number.len());
        for (t, side) in sides(self.elements, self.division.len()) {
            let k = self.division[t];
            let at_edge = |place: u32, of: u32, e: usize| {
                let key = shared_corner(self.mesh, t, side, edge_corner(e, place, of), of)?;
                values[*self.shared.get(&key)? as usize]
            };
            for (i, j) in lattice(k) {
                let value = match edge_of(i, j, k) {
                    None => values[self.number[out.len()] as usize],
                    Some((e, place)) => {
                        let (coarsest, _) = self.edges[&edge_key(self.mesh, t, e)];
                        // All divisions are powers of two, so coarse places are fine places.
                        let step = k / coarsest;
                        let (low, rest) = (place / step, place % step);
                        let below = at_edge(low, coarsest, e);
                        if rest == 0 {
                            below
                        } else {
                            let share = f64::from(rest) / f64::from(step);
                            let above = at_edge(low + 1, coarsest, e);
                            below
                                .zip(above)
                                .map(|(a, b)| std::array::from_fn(|band| a[band] + share * (b[band] - a[band])))
                        }
                    }
                };
                out.push(value.map_or([0.0; 3], |v| v.map(|v| v as f32)));
            }
        }
        out
    }
}

/// The mean over a cell and what it weighs.
#[derive(Clone, Copy, Default)]
struct Cell {
    weight: f64,
    value: [f64; 3],
}

impl Cell {
    /// The means over the exposed part of each cell's elements.
    fn all(elements: &Elements, values: &[Bands], weight: &[f64]) -> Vec<Cell> {
        let cell = |cell: usize| {
            let mut mean = Cell::default();
            for element in elements.of_cell(cell).map(|e| e as usize) {
                let (weight, value) = (weight[element], values[element]);
                mean.weight += weight;
                (0..3).for_each(|band| mean.value[band] += weight * f64::from(value[band]));
            }
            if mean.weight > 0.0 {
                mean.value = mean.value.map(|v| v / mean.weight);
            }
            mean
        };
        (0..elements.cells()).map(cell).collect()
    }
}

/// The sides of triangles that carry values.
fn sides(elements: &Elements, triangles: usize) -> impl Iterator<Item = (usize, Side)> {
    let both = |t| [(t, Side::Front), (t, Side::Back)];
    (0..triangles).flat_map(both).filter(|&(t, side)| elements.has(t, side))
}

/// The corners of k × k cells, in the order of their numbers.
fn lattice(k: u32) -> impl Iterator<Item = (u32, u32)> {
    (0..=k).flat_map(move |j| (0..=k - j).map(move |i| (i, j)))
}

impl Field {
    /// Interpolates `values` (by element) with the given weights: the exposed area of each element, zero for those
    /// that are buried and must not darken their neighbours.
    pub fn new(mesh: &Mesh, elements: &Elements, values: &[Bands], weight: &[f64]) -> Field {
        let corners = Corners::new(mesh, elements);
        let values = corners.fitted(&Cell::all(elements, values, weight));
        Field { base: corners.base, division: corners.division, values }
    }

    /// The value at barycentric coordinates of a triangle's side; zero where that side carries nothing.
    pub fn at(&self, triangle: usize, uv: DVec2, side: Side) -> Bands {
        let first = self.base[triangle][side as usize];
        if first == usize::MAX {
            return [0.0; 3];
        }
        let k = self.division[triangle];
        let n = f64::from(k);
        let (x, y) = (uv.x.clamp(0.0, 1.0) * n, uv.y.clamp(0.0, 1.0) * n);
        let j = (y as u32).min(k - 1);
        let i = (x as u32).min(k - 1 - j);
        let (fx, fy) = ((x - f64::from(i)) as f32, (y - f64::from(j)) as f32);
        let value = |i: u32, j: u32| self.values[first + corner(i, j, k)];
        if fx + fy > 1.0 && i + j + 2 <= k {
            return combine(value(i + 1, j + 1), value(i, j + 1), value(i + 1, j), 1.0 - fx, 1.0 - fy);
        }
        combine(value(i, j), value(i + 1, j), value(i, j + 1), fx, fy)
    }
}

fn combine(a: Bands, b: Bands, c: Bands, s: f32, t: f32) -> Bands {
    std::array::from_fn(|band| a[band] + s * (b[band] - a[band]) + t * (c[band] - a[band]))
}

/// Calls back with each cell's number and its lattice corners.
fn for_each_cell(k: u32, mut visit: impl FnMut(u32, [(u32, u32); 3])) {
    let mut cell = 0;
    for j in 0..k {
        for i in 0..k - j {
            visit(cell, [(i, j), (i + 1, j), (i, j + 1)]);
            cell += 1;
            if i + j + 2 <= k {
                visit(cell, [(i + 1, j + 1), (i, j + 1), (i + 1, j)]);
                cell += 1;
            }
        }
    }
}

/// The edge that an inner-edge or end corner lies on and its place along it; vertices belong to the edge they start.
fn edge_of(i: u32, j: u32, k: u32) -> Option<(usize, u32)> {
    // Edge 0 runs from corner 0 to 1 (v = 0), edge 1 from 1 to 2, edge 2 from 2 to 0 (u = 0).
    if j == 0 && i < k {
        Some((0, i))
    } else if i + j == k && j < k {
        Some((1, j))
    } else if i == 0 && j > 0 {
        Some((2, k - j))
    } else {
        None
    }
}

fn edge_corner(edge: usize, place: u32, k: u32) -> (u32, u32) {
    match edge {
        0 => (place, 0),
        1 => (k - place, place),
        _ => (0, k - place),
    }
}

fn edge_key(mesh: &Mesh, t: usize, edge: usize) -> (u32, u32) {
    let (a, b) = (mesh.smooth[t][edge], mesh.smooth[t][(edge + 1) % 3]);
    (a.min(b), a.max(b))
}

/// What corner (i, j) of the k × k cells on a triangle's side is called by all triangles that share it; nothing where it
/// lies inside.
pub fn shared_corner(mesh: &Mesh, t: usize, side: Side, (i, j): (u32, u32), k: u32) -> Option<Shared> {
    let smooth = mesh.smooth[t];
    match (i, j) {
        (0, 0) => return Some(Shared::Vertex(smooth[0], side)),
        _ if i == k => return Some(Shared::Vertex(smooth[1], side)),
        _ if j == k => return Some(Shared::Vertex(smooth[2], side)),
        _ => {}
    }
    let (edge, place) = edge_of(i, j, k)?;
    let (a, b) = (smooth[edge], smooth[(edge + 1) % 3]);
    // Reduce the fraction: k is a power of two, so halving as far as possible names the place uniquely.
    let (mut place, mut of) = if a < b { (place, k) } else { (k - place, k) };
    while place % 2 == 0 {
        place /= 2;
        of /= 2;
    }
    Some(Shared::Edge(a.min(b), a.max(b), place, of, side))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use radiosity_scene::{Material, Scene};

    fn two_quads(double_sided: bool) -> (Scene, Mesh) {
        let mut scene = Scene::default();
        scene.materials.push(Material { double_sided, ..Material::default() });
        let quad = |x: f64, w: f64| [[x, 0., 0.], [x + w, 0., 0.], [x + w, 1., 0.], [x, 1., 0.]].map(DVec3::from);
        scene.add_quad("large", 0, quad(0.0, 3.0));
        scene.add_quad("small", 0, quad(3.0, 0.3));
        let mesh = Mesh::new(&scene);
        (scene, mesh)
    }

    #[test]
    fn constants_stay_constant_on_both_sides() {
        let (scene, mesh) = two_quads(true);
        let elements = Elements::new(&scene, &mesh, 0.2);
        let values: Vec<Bands> = (0..elements.len() as u32)
            .map(|e| if elements.place(e).1 == Side::Front { [2.0; 3] } else { [5.0; 3] })
            .collect();
        let weight = vec![1.0; elements.len()];
        let field = Field::new(&mesh, &elements, &values, &weight);
        for t in 0..mesh.triangles.len() {
            for (u, v) in [(0.1, 0.1), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.45, 0.5)] {
                let uv = DVec2::new(u, v);
                assert!((field.at(t, uv, Side::Front)[0] - 2.0).abs() < 1e-6);
                assert!((field.at(t, uv, Side::Back)[1] - 5.0).abs() < 1e-6);
            }
        }
    }

    /// Catalogue 49: no jump across the shared edge, although the divisions differ; catalogue 61: linear fields are
    /// reproduced in the interior.
    #[test]
    fn catalogue_49_no_jump_across_edges_of_different_division() {
        let (scene, mesh) = two_quads(false);
        let elements = Elements::new(&scene, &mesh, 0.1);
        assert_ne!(elements.division(0), elements.division(2));
        let area: Vec<f64> = (0..elements.len() as u32).map(|e| elements.area(&mesh, e)).collect();
        let linear = |p: DVec3| (1.0 + 2.0 * p.x + 3.0 * p.y) as f32;
        let values: Vec<Bands> =
            (0..elements.len() as u32).map(|e| [linear(elements.centre(&mesh, e)), 0.0, 0.0]).collect();
        let field = Field::new(&mesh, &elements, &values, &area);
        let value_at = |p: DVec3, large: bool| {
            let range = if large { 0..2 } else { 2..4 };
            let (t, uv) = range
                .filter_map(|t| {
                    let [a, b, c] = mesh.corners(t);
                    let n = (b - a).cross(c - a);
                    let u = (p - a).cross(c - a).dot(n) / n.length_squared();
                    let v = (b - a).cross(p - a).dot(n) / n.length_squared();
                    (u >= -1e-9 && v >= -1e-9 && u + v <= 1.0 + 1e-9).then_some((t, DVec2::new(u, v)))
                })
                .next()
                .unwrap();
            field.at(t, uv, Side::Front)[0]
        };
        for step in 0..=50 {
            let p = DVec3::new(3.0, f64::from(step) / 50.0, 0.0);
            let jump = (value_at(p, true) - value_at(p, false)).abs();
            assert!(jump < 1e-5, "{jump} at {p}");
        }
        for (x, y) in [(1.0, 0.5), (1.53, 0.4), (2.1, 0.61)] {
            let p = DVec3::new(x, y, 0.0);
            assert!((value_at(p, true) - linear(p)).abs() < 1e-4, "{} for {}", value_at(p, true), linear(p));
        }
    }

    #[test]
    fn buried_elements_do_not_darken_their_neighbours() {
        let (scene, mesh) = two_quads(false);
        let elements = Elements::new(&scene, &mesh, 0.2);
        let buried = |e: u32| elements.centre(&mesh, e).x > 3.0;
        let values: Vec<Bands> =
            (0..elements.len() as u32).map(|e| if buried(e) { [0.0; 3] } else { [1.0; 3] }).collect();
        let weight: Vec<f64> = (0..elements.len() as u32).map(|e| f64::from(!buried(e))).collect();
        let field = Field::new(&mesh, &elements, &values, &weight);
        assert!((field.at(0, DVec2::new(0.99, 0.005), Side::Front)[0] - 1.0).abs() < 1e-6);
    }
}
