//! Elements: the pieces of surface whose radiosity is one number per band.
//!
//! They are implicit. A triangle of the [`Mesh`] is divided into k × k congruent cells, and a cell into d × d elements,
//! both powers of two; rays see the input triangles only, and a hit costs a few multiplications and two loads to name
//! its element. Cells have the size that smooth light needs; d is 1 but where direct light changes within a cell
//! ([`Elements::refined`]). Double-sided triangles own a second run of cells for their back.

use crate::{AlphaMode, Bands, Mesh, Scene, Side, Surface};
use glam::{DVec2, DVec3};
use std::ops::Range;

/// Index into the elements.
pub type ElementId = u32;

/// No cell: the back of a one-sided triangle.
const NO_CELL: u32 = u32::MAX;

/// Cells along an edge never exceed this: 64² cells keep ids within a triangle in 12 bits and stop a single huge
/// triangle from taking the whole budget; larger surfaces are rare and smooth.
const MAX_DIVISION: u32 = 64;

/// Area of the smallest cells of a square, relative to that of a square as wide as they are asked to be: half of it, as
/// divisions go up by twos.
const SMALLEST_CELL: f64 = 0.125;

/// How wide cells are to be.
#[derive(Clone, Copy, Debug)]
pub struct CellWidth<'a> {
    /// Metres, where scales are 1.
    pub size: f64,
    /// Width on each triangle relative to that; empty where it is the same on all.
    pub scales: &'a [f32],
}

impl From<f64> for CellWidth<'_> {
    fn from(size: f64) -> Self {
        CellWidth { size, scales: &[] }
    }
}

impl CellWidth<'_> {
    /// Width of cells of a triangle, metres.
    pub fn on(&self, triangle: usize) -> f64 {
        self.size * self.scales.get(triangle).map_or(1.0, |scale| f64::from(*scale))
    }
}

/// The elements of a mesh.
#[derive(Clone, Debug, Default)]
pub struct Elements {
    /// Cells along an edge of each triangle.
    division: Vec<u32>,
    /// First cell of the front and of the back of each triangle; [`NO_CELL`] where there is none.
    base: Vec<[u32; 2]>,
    /// Triangle of each cell.
    triangle: Vec<u32>,
    /// First element of each cell, and at the end the number of elements.
    first: Vec<ElementId>,
    /// Cell of each element.
    cell: Vec<u32>,
    /// Area from which on a cell counts as a whole one, m², one for all or one for each triangle; empty where all count.
    whole: Vec<f64>,
}

impl Elements {
    /// Divides every triangle into cells about as wide, of one element each.
    pub fn new<'a>(scene: &Scene, mesh: &Mesh, width: impl Into<CellWidth<'a>>) -> Elements {
        let width = width.into();
        let mut elements = Elements::default();
        for t in 0..mesh.triangles.len() {
            let division = division(mesh, t, &width);
            let mut run = || {
                let base = elements.triangle.len() as u32;
                elements.triangle.extend(std::iter::repeat_n(t as u32, (division * division) as usize));
                base
            };
            let front = run();
            let two_sides = scene.material(mesh.source[t] as usize).has_two_sides();
            let back = if two_sides { run() } else { NO_CELL };
            elements.division.push(division);
            elements.base.push([front, back]);
        }
        let cells = elements.triangle.len() as u32;
        elements.first = (0..=cells).collect();
        elements.cell = (0..cells).collect();
        elements
    }

    /// The same cells, cell c divided into `pieces[c]` × `pieces[c]` elements (powers of two).
    pub fn refined(&self, pieces: &[u32]) -> Elements {
        assert_eq!(pieces.len(), self.cells());
        let mut first = Vec::with_capacity(pieces.len() + 1);
        let mut cell = Vec::new();
        for (c, &d) in pieces.iter().enumerate() {
            assert!(d.is_power_of_two());
            first.push(cell.len() as ElementId);
            cell.extend(std::iter::repeat_n(c as u32, (d * d) as usize));
        }
        first.push(cell.len() as ElementId);
        Elements { first, cell, ..self.clone() }
    }

    /// The same elements, where triangles too small to be cut into cells so wide count by their area: for light that is
    /// only looked up, so that the noise of many small ones averages out.
    pub fn shared(self, width: &CellWidth) -> Elements {
        let whole = |t: usize| SMALLEST_CELL * width.on(t) * width.on(t);
        Elements { whole: (0..width.scales.len().max(1)).map(whole).collect(), ..self }
    }

    /// Share of the rays of a cell that an element gets: all, or as many as the pieces of a divided cell leave it, or what
    /// its area tells ([`Elements::shared`]).
    pub fn share(&self, mesh: &Mesh, element: ElementId) -> f64 {
        let even = 1.0 / f64::from(self.pieces(element));
        let whole = match self.whole.as_slice() {
            [] => return even,
            [whole] => whole,
            each => &each[self.place(element).0],
        };
        even.min(self.area(mesh, element) / whole)
    }

    /// How many elements a width would give, without making them.
    pub fn count<'a>(scene: &Scene, mesh: &Mesh, width: impl Into<CellWidth<'a>>) -> usize {
        let width = width.into();
        let sides = |t: usize| 1 + usize::from(scene.material(mesh.source[t] as usize).has_two_sides());
        (0..mesh.triangles.len()).map(|t| (division(mesh, t, &width) as usize).pow(2) * sides(t)).sum()
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.cell.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.cell.is_empty()
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.triangle.len()
    }

    /// The elements of a cell.
    pub fn of_cell(&self, cell: usize) -> Range<ElementId> {
        self.first[cell]..self.first[cell + 1]
    }

    /// The cells of a triangle's side; empty if that side carries none.
    pub fn cells_of(&self, triangle: usize, side: Side) -> Range<usize> {
        let base = self.base[triangle][side as usize];
        if base == NO_CELL {
            return 0..0;
        }
        base as usize..base as usize + (self.division[triangle] as usize).pow(2)
    }

    /// The cell of an element.
    pub fn cell(&self, element: ElementId) -> usize {
        self.cell[element as usize] as usize
    }

    /// Into how many elements the cell of an element is divided: d².
    pub fn pieces(&self, element: ElementId) -> u32 {
        self.of_cell(self.cell(element)).len() as u32
    }

    /// Cells along an edge of a triangle.
    pub fn division(&self, triangle: usize) -> u32 {
        self.division[triangle]
    }

    /// Whether the triangle has elements on that side.
    pub fn has(&self, triangle: usize, side: Side) -> bool {
        self.base[triangle][side as usize] != NO_CELL
    }

    /// The element at barycentric coordinates `uv` of a triangle's side, if that side carries any.
    #[inline]
    pub fn at(&self, triangle: u32, u: f32, v: f32, side: Side) -> Option<ElementId> {
        let base = self.base[triangle as usize][side as usize];
        if base == NO_CELL {
            return None;
        }
        let (cell, u, v) = locate(u, v, self.division[triangle as usize]);
        let cell = (base + cell) as usize;
        let (first, end) = (self.first[cell], self.first[cell + 1]);
        let pieces = end - first;
        Some(if pieces == 1 { first } else { first + locate(u, v, 1 << (pieces.trailing_zeros() / 2)).0 })
    }

    /// Triangle and side of an element.
    pub fn place(&self, element: ElementId) -> (usize, Side) {
        let cell = self.cell[element as usize];
        let t = self.triangle[cell as usize] as usize;
        let back = self.base[t][1] <= cell && self.base[t][1] != NO_CELL;
        (t, if back { Side::Back } else { Side::Front })
    }

    /// Barycentric corners of a cell.
    pub fn cell_corners(&self, cell: usize) -> [DVec2; 3] {
        let (t, side) = self.place(self.first[cell]);
        corners(cell as u32 - self.base[t][side as usize], self.division[t])
    }

    /// Barycentric corners of an element.
    pub fn corners(&self, element: ElementId) -> [DVec2; 3] {
        let cell = self.cell(element);
        let [a, b, c] = self.cell_corners(cell);
        let Range { start, end } = self.of_cell(cell);
        if end - start == 1 {
            return [a, b, c];
        }
        corners(element - start, (end - start).isqrt()).map(|p| a + p.x * (b - a) + p.y * (c - a))
    }

    /// Barycentric coordinates of the point of an element that (x, y) in the unit square maps to, area-uniform.
    pub fn sample(&self, element: ElementId, x: f64, y: f64) -> DVec2 {
        let [a, b, c] = self.corners(element);
        let (u, v) = triangle_from_square(x, y);
        a + u * (b - a) + v * (c - a)
    }

    /// Area of an element, m².
    pub fn area(&self, mesh: &Mesh, element: ElementId) -> f64 {
        let t = self.triangle[self.cell(element)] as usize;
        let k = f64::from(self.division[t]);
        mesh.area(t) / (k * k * f64::from(self.pieces(element)))
    }

    /// The cell at the same place on the other side of the triangle, if that has elements.
    pub fn opposite_cell(&self, cell: usize) -> Option<usize> {
        let [front, back] = self.base[self.triangle[cell] as usize];
        let cell = cell as u32;
        match back {
            NO_CELL => None,
            _ if cell >= back => Some((cell - back + front) as usize),
            _ => Some((cell - front + back) as usize),
        }
    }

    /// The element at the same place on the other side, if there is one and both sides are divided alike.
    pub fn opposite(&self, element: ElementId) -> Option<ElementId> {
        let cell = self.cell(element);
        let (own, other) = (self.of_cell(cell), self.of_cell(self.opposite_cell(cell)?));
        (own.len() == other.len()).then_some(other.start + (element - own.start))
    }

    /// Unit normal on an element's own side.
    pub fn normal(&self, mesh: &Mesh, element: ElementId) -> DVec3 {
        match self.place(element) {
            (t, Side::Front) => mesh.normal(t),
            (t, Side::Back) => -mesh.normal(t),
        }
    }

    /// World position of an element's centroid.
    pub fn centre(&self, mesh: &Mesh, element: ElementId) -> DVec3 {
        let [a, b, c] = self.corners(element);
        mesh.point(self.place(element).0, (a + b + c) / 3.0)
    }

    /// Mean reflectance and emitted exitance (π × luminance, lm/m² per band) of what of an element stops a ray: places
    /// count by their opacity, since rays that look the element up have stopped there. They are averaged over
    /// [`Elements::places`].
    pub fn optics(&self, scene: &Scene, mesh: &Mesh, element: ElementId) -> (Bands, Bands) {
        let (mut reflectance, mut exitance, mut opaque) = ([0.0; 3], [0.0; 3], 0.0);
        self.sample_optics(scene, mesh, element, |at, share| {
            let weight = share * scene.opacity(at);
            if weight > 0.0 {
                let (r, l) = (scene.reflectance(at), scene.emitted_luminance(at));
                opaque += weight;
                for band in 0..3 {
                    reflectance[band] += weight * r[band];
                    exitance[band] += weight * std::f32::consts::PI * l[band];
                }
            }
        });
        if opaque > 0.0 {
            (reflectance.map(|r| r / opaque), exitance.map(|e| e / opaque))
        } else {
            (reflectance, exitance)
        }
    }

    /// Mean transmittance of what of an element stops a ray, as [`Elements::optics`] has its reflectance: of the light
    /// that falls on its other side, the share that leaves it.
    pub fn transmittance(&self, scene: &Scene, mesh: &Mesh, element: ElementId) -> Bands {
        let (mut transmittance, mut opaque) = ([0.0; 3], 0.0);
        if scene.material(mesh.source[self.place(element).0] as usize).transmission.is_none() {
            return transmittance;
        }
        self.sample_optics(scene, mesh, element, |at, share| {
            let weight = share * scene.opacity(at);
            if weight > 0.0 {
                opaque += weight;
                for (sum, t) in transmittance.iter_mut().zip(scene.transmittance(at)) {
                    *sum += weight * t;
                }
            }
        });
        if opaque > 0.0 { transmittance.map(|t| t / opaque) } else { transmittance }
    }

    /// Mean opacity of an element. An area emits its exitance times this.
    pub fn opacity(&self, scene: &Scene, mesh: &Mesh, element: ElementId) -> f32 {
        let (t, _) = self.place(element);
        if scene.material(mesh.source[t] as usize).alpha_mode == AlphaMode::Opaque {
            return 1.0;
        }
        let mut opacity = 0.0;
        self.sample_optics(scene, mesh, element, |at, share| opacity += share * scene.opacity(at));
        opacity
    }

    /// Calls back with [`Elements::places`] and the share of the element that each stands for.
    fn sample_optics(&self, scene: &Scene, mesh: &Mesh, element: ElementId, mut visit: impl FnMut(Surface, f32)) {
        let places = self.places(scene, mesh, element);
        let share = 1.0 / places.len() as f32;
        places.for_each(|at| visit(at, share));
    }

    /// Places all over an element at which its optics are looked up, on either side of a sheet the same ([`Scene::places_for_mean`]).
    pub fn places(&self, scene: &Scene, mesh: &Mesh, element: ElementId) -> impl ExactSizeIterator<Item = Surface> {
        let (t, _) = self.place(element);
        let piece = self.corners(element);
        let count = scene.places_for_mean(piece.map(|uv| mesh.surface(t, uv)));
        let seed = self.opposite(element).map_or(element, |other| other.min(element));
        places_over(piece, count, seed).map(move |uv| mesh.surface(t, uv))
    }
}

/// Barycentric coordinates of places all over a piece of a triangle: its middle, or the sequence of the plastic number (Roberts
/// 2018, "The unreasonable effectiveness of quasirandom sequences"), begun where `seed` says. They lie on no grid: pictures
/// of tiles are grids too, and one finds tiles of one colour on the other.
pub fn places_over([a, b, c]: [DVec2; 3], count: u32, seed: u32) -> impl ExactSizeIterator<Item = DVec2> {
    // 1/φ and 1/φ², φ³ = φ + 1.
    const STEP: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_3];
    (0..count).map(move |i| {
        if count == 1 {
            return (a + b + c) / 3.0;
        }
        // Far along the same sequence: pieces beside each other begin at places as different as those of one piece.
        let k = f64::from(i) + 64.0 * f64::from(seed);
        let (u, v) = triangle_from_square((k * STEP[0]).fract(), (k * STEP[1]).fract());
        a + u * (b - a) + v * (c - a)
    })
}

/// Maps the unit square to barycentric coordinates (weights of corners 1, 2), uniformly and without tearing
/// neighbouring points apart (Heitz 2019, "A low-distortion map between triangle and square").
pub fn triangle_from_square(x: f64, y: f64) -> (f64, f64) {
    if y > x { (0.5 * x, y - 0.5 * x) } else { (x - 0.5 * y, 0.5 * y) }
}

/// Cells along an edge: the geometric mean of the longest edge and √(2 area) over the size, so that squares come
/// out as asked and slivers do not explode; the next power of two, because powers of two nest along shared edges.
fn division(mesh: &Mesh, triangle: usize, width: &CellWidth) -> u32 {
    division_of(mesh.corners(triangle), width.on(triangle))
}

/// Cells along an edge of a triangle that is cut into cells about `size` wide: a power of two.
pub fn division_of([a, b, c]: [DVec3; 3], size: f64) -> u32 {
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let area = 0.5 * (b - a).cross(c - a).length();
    let width = (longest * (2.0 * area).sqrt()).sqrt();
    // Rounding at √2 keeps the mean size as asked.
    let wanted = (width / size / std::f64::consts::SQRT_2).ceil().clamp(1.0, f64::from(MAX_DIVISION));
    (wanted as u32).next_power_of_two()
}

/// The piece at barycentric (u, v) of k × k, and the coordinates within it. Row j (0-based, by v) holds 2(k−j)−1
/// pieces: upright and inverted in turn.
#[inline]
pub fn locate(u: f32, v: f32, k: u32) -> (u32, f32, f32) {
    if k == 1 {
        return (0, u, v);
    }
    let n = k as f32;
    let (x, y) = (u * n, v * n);
    let row = (y as u32).min(k - 1);
    let column = (x as u32).min(k - 1 - row);
    let (u, v) = (x - column as f32, y - row as f32);
    let upright = row * (2 * k - row) + 2 * column;
    if u + v > 1.0 && column + row + 2 <= k { (upright + 1, 1.0 - u, 1.0 - v) } else { (upright, u, v) }
}

/// Barycentric corners of a piece of k × k, in the order that [`locate`]'s coordinates within it refer to.
pub fn corners(piece: u32, k: u32) -> [DVec2; 3] {
    // Rows before row r hold r (2k − r) = k² − (k − r)² pieces.
    let row = k - f64::from(k * k - piece).sqrt().ceil() as u32;
    let within = piece - row * (2 * k - row);
    let (column, inverted) = (within / 2, within % 2 == 1);
    let corner = |i: u32, j: u32| DVec2::new(f64::from(i), f64::from(j)) / f64::from(k);
    if inverted {
        [corner(column + 1, row + 1), corner(column, row + 1), corner(column + 1, row)]
    } else {
        [corner(column, row), corner(column + 1, row), corner(column, row + 1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, Texture, TextureRef};
    use glam::DAffine2;

    #[test]
    fn every_cell_contains_its_own_points_and_no_others() {
        for k in [1, 2, 4, 16, 64] {
            for id in 0..k * k {
                let [a, b, c] = corners(id, k);
                for (u, v) in [(0.3, 0.3), (0.05, 0.05), (0.9, 0.05), (0.05, 0.9)] {
                    let p = a + u * (b - a) + v * (c - a);
                    assert_eq!(locate(p.x as f32, p.y as f32, k).0, id, "k {k} at {p}");
                }
                let area = 0.5 * (b - a).perp_dot(c - a);
                assert!((area - 0.5 / f64::from(k * k)).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn elements_of_divided_cells_contain_their_own_points() {
        let mut scene = Scene::default();
        scene.materials.push(Material { double_sided: true, ..Material::default() });
        scene.add_triangles("t", 0, &[[DVec3::ZERO, DVec3::X, DVec3::Y], [DVec3::Z, DVec3::X, DVec3::Y]]);
        let mesh = Mesh::new(&scene);
        let whole = Elements::new(&scene, &mesh, 0.3);
        let pieces: Vec<u32> = (0..whole.cells()).map(|c| [1, 2, 8, 4][c % 4]).collect();
        let elements = whole.refined(&pieces);
        assert_eq!(elements.len(), pieces.iter().map(|d| (d * d) as usize).sum::<usize>());
        let mut total = 0.0;
        for e in 0..elements.len() as u32 {
            let (t, side) = elements.place(e);
            assert!(elements.cells_of(t, side).contains(&elements.cell(e)));
            assert!(elements.of_cell(elements.cell(e)).contains(&e));
            for (x, y) in [(0.3, 0.3), (0.05, 0.9), (0.9, 0.05)] {
                let p = elements.sample(e, x, y);
                assert_eq!(elements.at(t as u32, p.x as f32, p.y as f32, side), Some(e));
            }
            total += elements.area(&mesh, e);
        }
        let both_sides = 2.0 * (mesh.area(0) + mesh.area(1));
        assert!((total - both_sides).abs() < 1e-12);
    }

    #[test]
    fn points_outside_by_rounding_still_have_a_cell() {
        for (u, v) in [(-1e-7, 0.0), (1.0, 1e-7), (1e-7, 1.0), (0.5, 0.5), (0.500001, 0.500001)] {
            assert!(locate(u, v, 16).0 < 256);
        }
    }

    #[test]
    fn both_sides_of_a_double_sided_triangle_have_elements() {
        let mut scene = Scene::default();
        scene.materials.push(Material { double_sided: true, ..Material::default() });
        scene.add_triangles("t", 0, &[[DVec3::ZERO, DVec3::X, DVec3::Y]]);
        let mesh = Mesh::new(&scene);
        let elements = Elements::new(&scene, &mesh, 0.3);
        assert_eq!(elements.len(), 2 * Elements::new(&scene, &mesh, 0.3).division(0).pow(2) as usize);
        assert_eq!(elements.len(), Elements::count(&scene, &mesh, 0.3));
        let back = elements.at(0, 0.2, 0.2, Side::Back).unwrap();
        assert_eq!(elements.place(back), (0, Side::Back));
        assert_eq!(elements.normal(&mesh, back), -DVec3::Z);
        let total: f64 = (0..elements.len() as u32).map(|e| elements.area(&mesh, e)).sum();
        assert!((total - 1.0).abs() < 1e-12);
    }

    /// A square floor so wide, of a material with a picture of `side` × `side` squares, black and white in turn.
    fn tiled(side: u32, width: f64, material: impl FnOnce(TextureRef) -> Material) -> Scene {
        let white = |k: u32| (k % side + k / side).is_multiple_of(2);
        let texels = (0..side * side).map(|k| if white(k) { [255; 4] } else { [0, 0, 0, 255] }).collect();
        let tiles = Texture { name: String::new(), width: side, height: side, texels };
        let wrap = [crate::Wrap::Repeat; 2];
        let picture = TextureRef { texture: 0, uv_set: 0, transform: DAffine2::IDENTITY, wrap, nearest: true };
        let mut scene = Scene { materials: vec![material(picture)], textures: vec![tiles], ..Scene::default() };
        let corners = [[0., 0., 0.], [0., 0., 1.], [1., 0., 1.], [1., 0., 0.]].map(|p| width * DVec3::from(p));
        scene.add_quad("floor", 0, corners);
        scene.uvs[0] = scene.positions.iter().map(|p| glam::DVec2::new(p.x, p.z).as_vec2() / width as f32).collect();
        scene
    }

    /// Squares of a picture that elements divide evenly: a grid of places found one colour in all elements.
    #[test]
    fn the_mean_of_tiles_is_that_of_both_colours() {
        let scene = tiled(64, 4.0, |picture| Material { base_color_texture: Some(picture), ..Material::default() });
        let mesh = Mesh::new(&scene);
        for (size, most_off) in [(0.25, 0.3), (0.5, 0.25), (1.0, 0.15)] {
            let elements = Elements::new(&scene, &mesh, size);
            let means: Vec<f32> =
                (0..elements.len() as u32).map(|e| elements.optics(&scene, &mesh, e).0[0] / 0.99).collect();
            let mean = means.iter().sum::<f32>() / means.len() as f32;
            let off = means.iter().fold(0f32, |most, m| most.max((m - 0.5).abs()));
            assert!((mean - 0.5).abs() < 0.01 && off < most_off, "{size}: {mean}, {off}");
        }
    }

    /// Both sides of a sheet are looked up at the same places: what it gives back and passes on together is no more than it got.
    #[test]
    fn sides_of_a_sheet_with_a_picture_are_alike() {
        let scene = tiled(16, 1.0, |picture| Material {
            base_color_texture: Some(picture),
            base_color: [0.05; 4],
            transmission: Some(crate::Transmission {
                transmittance: [0.9; 3],
                texture: Some(picture),
                ..crate::Transmission::default()
            }),
            ..Material::default()
        });
        let mesh = Mesh::new(&scene);
        let elements = Elements::new(&scene, &mesh, 0.2);
        for e in 0..elements.len() as u32 {
            let other = elements.opposite(e).unwrap();
            assert_ne!(e, other);
            assert_eq!(elements.optics(&scene, &mesh, e), elements.optics(&scene, &mesh, other));
            assert_eq!(elements.transmittance(&scene, &mesh, e), elements.transmittance(&scene, &mesh, other));
        }
    }
}
