//! A continuous field from values that are constant on elements.
//!
//! Values sit on the corners of the cells of each triangle and are interpolated linearly. A corner's value is the
//! area-weighted mean of the elements around it, over all triangles that are smooth there, moved towards what keeps the means of
//! cells, and made equal across slivers; so constants stay constant, and light is continuous where the surface is. Where two triangles of different division share an edge, the coarser
//! one's corners count and the finer one's others on that edge are interpolated between them (anchored hanging nodes),
//! so that no crack opens (catalogue 49, 61).

mod corners;
mod planes;

use crate::pool::Pooled;
use corners::{Cell, Corners};
use glam::DVec2;
pub use planes::{FLAT, Finding, Planes};
use radiosity_scene::{Bands, Elements, Mesh, Side};

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
        let cells = Cell::all(elements, values, weight);
        let values = corners.fitted(&corners.fit(&cells, None), &cells);
        Field { base: corners.base, division: corners.division, values }
    }

    /// The same from two halves of the rays that found the values: cells of a plane share them first, as far as their light is
    /// smooth.
    pub fn pooled(mesh: &Mesh, elements: &Elements, halves: &[[Bands; 2]], weight: &[f64]) -> Field {
        let [field] = Field::moved(mesh, elements, halves, weight, [0.0]);
        field
    }

    /// That light as either half of the rays alone would have it, shared as both together are: half the difference of the two
    /// is the noise that sharing and interpolation leave.
    pub fn pooled_halves(mesh: &Mesh, elements: &Elements, halves: &[[Bands; 2]], weight: &[f64]) -> [Field; 2] {
        Field::moved(mesh, elements, halves, weight, [1.0, -1.0])
    }

    /// Pooled light, and as many times its noise.
    fn moved<const N: usize>(
        mesh: &Mesh,
        elements: &Elements,
        halves: &[[Bands; 2]],
        weight: &[f64],
        times: [f32; N],
    ) -> [Field; N] {
        let corners = Corners::new(mesh, elements);
        let mean = |[a, b]: &[Bands; 2]| std::array::from_fn(|band| 0.5 * (a[band] + b[band]));
        let mut cells = Cell::all(elements, &halves.iter().map(mean).collect::<Vec<Bands>>(), weight);
        let shared = planes::shared(mesh, elements, halves, weight);
        for (cell, Pooled { light, .. }) in
            cells.iter_mut().zip(&shared).filter_map(|(cell, shared)| Some((cell, shared.as_ref()?)))
        {
            cell.value = light.map(f64::from);
        }
        let noise: Vec<f32> = shared.iter().map(|shared| shared.map_or(0.0, |shared| shared.noise)).collect();
        let fit = corners.fit(&cells, Some(&noise));
        times.map(|times| {
            let with = |(cell, noise): (&Cell, &f32)| cell.with(times * noise);
            let cells: Vec<Cell> = cells.iter().zip(&noise).map(with).collect();
            let values = corners.fitted(&fit, &cells);
            Field { base: corners.base.clone(), division: corners.division.clone(), values }
        })
    }

    /// By cell, whether it shares a corner with one of `cells`, or is one.
    pub fn around(mesh: &Mesh, elements: &Elements, cells: &[bool]) -> Vec<bool> {
        let corners = Corners::new(mesh, elements);
        let mut touched = vec![false; corners.count];
        let number = |lattice: usize| corners.number[lattice] as usize;
        corners.each_cell(|cell, around| {
            if cells[cell] {
                around.into_iter().for_each(|lattice| touched[number(lattice)] = true);
            }
        });
        let mut all = vec![false; cells.len()];
        corners.each_cell(|cell, around| all[cell] = around.into_iter().any(|lattice| touched[number(lattice)]));
        all
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
    use radiosity_trace::sampling::{hash, unit};

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

    /// A wall with another one beside it that is a little lower: the vertex on its edge cuts off a sliver along the diagonal.
    /// Light that is linear stays so there, and however rough it is it comes out equal on both sides of the sliver.
    #[test]
    fn slivers_do_not_show() {
        let mut scene = Scene::default();
        scene.materials.push(Material::default());
        scene.add_quad("wall", 0, [[0., 0., 0.], [4.5, 0., 0.], [4.5, 2.8, 0.], [0., 2.8, 0.]].map(DVec3::from));
        scene.add_quad("side", 0, [[4.5, 0., 0.], [4.5, 0., 1.], [4.5, 2.71, 1.], [4.5, 2.71, 0.]].map(DVec3::from));
        let mesh = Mesh::new(&scene);
        let elements = Elements::new(&scene, &mesh, 0.3);
        let n = elements.len() as u32;
        let weight: Vec<f64> = (0..n).map(|e| elements.area(&mesh, e)).collect();
        let field = |value: &dyn Fn(u32) -> f64| {
            Field::new(&mesh, &elements, &(0..n).map(|e| [value(e) as f32; 3]).collect::<Vec<_>>(), &weight)
        };
        let linear = |p: DVec3| 1.0 + 0.4 * p.x - 0.3 * p.y;
        let smooth = field(&|e| linear(elements.centre(&mesh, e)));
        let wall: Vec<usize> = (0..mesh.triangles.len()).filter(|t| mesh.source[*t] < 2).collect();
        for &t in &wall {
            for (u, v) in (0..=40).flat_map(|i| (0..=40 - i).map(move |j| (f64::from(i) / 40.0, f64::from(j) / 40.0))) {
                let uv = DVec2::new(u, v);
                let p = mesh.point(t, uv);
                let off = (f64::from(smooth.at(t, uv, Side::Front)[0]) - linear(p)).abs();
                assert!(off < 0.02 || p.x.min(p.y).min(4.5 - p.x).min(2.8 - p.y) < 0.3, "{off} at {p}");
            }
        }

        let rough = field(&|e| f64::from(e.wrapping_mul(2_654_435_769) >> 8) / f64::from(1 << 24));
        let at = |p: DVec3| {
            let uv = |t: &usize| mesh.barycentric(*t, p);
            let t = wall.iter().find(|t| uv(t).min_element() >= 0.0 && uv(t).element_sum() <= 1.0).unwrap();
            rough.at(*t, uv(t), Side::Front)[0]
        };
        let half_lit = field(&|e| f64::from(e % 2) * 100.0);
        for (t, uv) in wall.iter().flat_map(|t| [(0.1, 0.1), (0.0, 1.0), (0.5, 0.5)].map(|uv| (*t, DVec2::from(uv)))) {
            assert!(half_lit.at(t, uv, Side::Front)[0] >= 0.0);
        }
        let across = DVec3::new(2.8, -4.5, 0.0).normalize();
        for share in [0.3, 0.5, 0.7, 0.9] {
            let p = DVec3::new(4.5, 2.755, 0.0) * share;
            let (above, below) = (at(p - 0.05 * across), at(p + 0.05 * across));
            assert!((above - below).abs() < 0.1, "{above} and {below} at {p}");
        }
    }

    /// A fan of needles, ten times as long as wide, from one point down to a line, in cells of an eighth of that.
    fn fan() -> (Mesh, Elements) {
        let mut scene = Scene::default();
        scene.materials.push(Material::default());
        let below = |i: i32| DVec3::new(0.1 * f64::from(i), 0.0, 0.0);
        let needles: Vec<[DVec3; 3]> = (-4..4).map(|i| [below(i), below(i + 1), DVec3::Y]).collect();
        scene.add_triangles("fan", 0, &needles);
        let mesh = Mesh::new(&scene);
        let elements = Elements::new(&scene, &mesh, 0.08);
        assert!((0..8).all(|t| elements.division(t) == 8));
        (mesh, elements)
    }

    /// The field through corners of cells with some noise, if that is told.
    fn fitted(mesh: &Mesh, elements: &Elements, value: impl Fn(u32) -> f64, noise: Option<&[f32]>) -> Field {
        let n = elements.len() as u32;
        let values: Vec<Bands> = (0..n).map(|e| [value(e) as f32; 3]).collect();
        let area: Vec<f64> = (0..n).map(|e| elements.area(mesh, e)).collect();
        let (corners, cells) = (Corners::new(mesh, elements), Cell::all(elements, &values, &area));
        let values = corners.fitted(&corners.fit(&cells, noise), &cells);
        Field { base: corners.base, division: corners.division, values }
    }

    /// The root mean square of what a field on a fan is off, off its border.
    fn off(field: &Field, mesh: &Mesh, exact: impl Fn(DVec3) -> f64) -> f64 {
        let lattice = (0..=40).flat_map(|i| (0..=40 - i).map(move |j| DVec2::new(f64::from(i), f64::from(j)) / 40.0));
        let within = |uv: &DVec2| uv.y > 0.1 && uv.y < 0.8;
        let miss = |t: usize, uv: DVec2| f64::from(field.at(t, uv, Side::Front)[0]) - exact(mesh.point(t, uv));
        let squares: Vec<f64> = lattice
            .filter(within)
            .flat_map(|uv| (1..7).map(move |t| (t, uv)))
            .map(|(t, uv)| miss(t, uv).powi(2))
            .collect();
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    /// Light that is bent keeps its course across needles, whatever way they lie.
    #[test]
    fn fans_of_needles_do_not_show() {
        let (mesh, elements) = fan();
        let bent = |p: DVec3| 1.0 + 2.0 * p.y - p.y * p.y;
        let mean = |e: u32| {
            let (t, _) = elements.place(e);
            let [a, b, c] = elements.corners(e).map(|uv| mesh.point(t, uv));
            [(a, b), (b, c), (c, a)].map(|(p, q)| bent(0.5 * (p + q))).iter().sum::<f64>() / 3.0
        };
        let none = vec![0.0; elements.cells()];
        let [sure, unsure] =
            [Some(&none[..]), None].map(|noise| off(&fitted(&mesh, &elements, mean, noise), &mesh, bent));
        assert!(sure < 0.7 * unsure && sure < 0.007, "{sure}, {unsure} where noise is not known");
    }

    /// Noise that is told is not taken for light that the means of cells miss.
    #[test]
    fn noise_is_not_fitted() {
        let (mesh, elements) = fan();
        let draw = |e: u32, k: u32| 2.0 * unit(hash(hash(e) ^ k)) - 1.0;
        let noisy = |e: u32| f64::from(1.0 + 0.1 * draw(e, 1));
        let noise: Vec<f32> = (0..elements.len() as u32).map(|e| 0.1 * draw(e, 2)).collect();
        let none = vec![0.0; noise.len()];
        let [told, denied, unsure] = [Some(&noise[..]), Some(&none), None]
            .map(|noise| off(&fitted(&mesh, &elements, noisy, noise), &mesh, |_| 1.0));
        assert!(told < 1.2 * unsure && denied > 1.5 * unsure, "{told}, {denied} and {unsure}");
    }

    /// Beside a step light does not ring: it stays between what it is on either side.
    #[test]
    fn steps_do_not_ring() {
        let mut scene = Scene::default();
        scene.materials.push(Material::default());
        let corners = [[0., 0., 0.], [4., 0., 0.], [4., 4., 0.], [0., 4., 0.]].map(DVec3::from);
        scene.add_quad("wall", 0, corners);
        let mesh = Mesh::new(&scene);
        let elements = Elements::new(&scene, &mesh, 0.25);
        let none = vec![0.0; elements.cells()];
        let step = |e: u32| if elements.centre(&mesh, e).x < 2.0 { 1.0 } else { 0.05 };
        let field = fitted(&mesh, &elements, step, Some(&none));
        let range = field.values.iter().fold([f32::INFINITY, 0.0], |[low, high], v| [low.min(v[0]), high.max(v[0])]);
        assert!(range[0] >= 0.05 - 1e-6 && range[1] <= 1.0 + 1e-6, "{range:?}");
    }

    #[test]
    fn cells_around_are_those_that_share_corners() {
        let (scene, mesh) = two_quads(false);
        let elements = Elements::new(&scene, &mesh, 0.2);
        let corners_of = |cell: usize| {
            let (t, _) = elements.place(elements.of_cell(cell).start);
            elements.cell_corners(cell).map(|uv| mesh.point(t, uv))
        };
        let mut cells = vec![false; elements.cells()];
        let seen = elements.cell(elements.at(0, 0.6, 0.2, Side::Front).unwrap());
        cells[seen] = true;
        let around = Field::around(&mesh, &elements, &cells);
        for (cell, is_around) in around.iter().enumerate() {
            let touches = corners_of(cell).iter().any(|p| corners_of(seen).iter().any(|q| p.distance(*q) < 1e-9));
            assert_eq!(*is_around, touches, "{cell}");
        }
    }
}
