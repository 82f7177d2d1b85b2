//! Cells: the convex spaces that zones of a medium fill.
//!
//! Every straight line crosses a convex cell once, from t₀ to t₁. Lines that enter it are uniform where their places are
//! uniform on the cell's surface and their directions have the density cos θ/π about the inward normal; the mean of
//! their chords is then 4V/A (Cauchy 1850), which ties what lines say of a cell to its volume.

use crate::row::points::Places;
use glam::DVec3;
use radiosity_scene::{Facet, FacetError};
use radiosity_trace::sampling::{cosine_direction, frame};
use rustc_hash::FxHashMap;
use std::f64::consts::{PI, TAU};

/// How far corners may stand out of a face's plane and the cell still be convex, and how deep cells may reach into each
/// other or facets into cells, relative to their extent: what coordinates of six digits leave of a plane. Half as much,
/// and files written with six digits are refused; much more, and chords are counted twice that a tolerance would notice.
const TOUCH: f64 = 2e-6;

/// Volume below which a cell is flat, relative to the cube of its extent.
const FLAT: f64 = 1e-12;

/// Why a cell cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CellError {
    /// A coordinate or a radius is NaN or infinite.
    #[error("a coordinate or radius of a cell is not a finite number")]
    NotFinite,
    /// A box or a ball without volume.
    #[error("a cell has no volume")]
    NoVolume,
    /// A face that is no polygon.
    #[error("face {face} of a cell: {error}")]
    Face {
        /// The face.
        face: usize,
        /// What is wrong with it.
        error: FacetError,
    },
    /// Edges that do not meet another face edge to edge, run the other way.
    #[error("the faces of a cell leave a gap: {0} edges have no partner")]
    Open(usize),
    /// A corner stands out of a face's plane: the cell is not convex, or its faces look inwards.
    #[error("a cell is not convex, or its faces do not look outwards: a corner is {0:e} m in front of a face")]
    NotConvex(f64),
}

/// A convex polyhedron or a ball.
#[derive(Clone, Debug)]
pub struct Cell {
    shape: Shape,
    volume: f64,
    area: f64,
    bounds: [DVec3; 2],
}

#[derive(Clone, Debug)]
enum Shape {
    /// Faces that look outwards.
    Polyhedron(Vec<Facet>),
    Ball {
        centre: DVec3,
        radius: f64,
    },
}

impl Cell {
    /// The box between two corners, its edges along the axes (metres).
    ///
    /// # Errors
    /// [`CellError`] if a coordinate is not finite, or `high` not above `low` in all three.
    pub fn cuboid(low: DVec3, high: DVec3) -> Result<Cell, CellError> {
        if !(low.is_finite() && high.is_finite()) {
            return Err(CellError::NotFinite);
        }
        if !high.cmpgt(low).all() {
            return Err(CellError::NoVolume);
        }
        let at = |x: bool, y: bool, z: bool| DVec3::select(glam::BVec3::new(x, y, z), high, low);
        let corners = |face: usize| {
            let (axis, is_high) = (face / 2, face % 2 == 1);
            let turn = if is_high {
                [(false, false), (true, false), (true, true), (false, true)]
            } else {
                [(false, false), (false, true), (true, true), (true, false)]
            };
            turn.map(|(u, v)| {
                let mut flags = [false; 3];
                (flags[axis], flags[(axis + 1) % 3], flags[(axis + 2) % 3]) = (is_high, u, v);
                at(flags[0], flags[1], flags[2])
            })
        };
        Cell::polyhedron((0..6).map(|face| corners(face).to_vec()).collect())
    }

    /// The ball about a centre (metres).
    ///
    /// # Errors
    /// [`CellError`] if a number is not finite or the radius not positive.
    pub fn ball(centre: DVec3, radius: f64) -> Result<Cell, CellError> {
        if !(centre.is_finite() && radius.is_finite()) {
            return Err(CellError::NotFinite);
        }
        if radius <= 0.0 {
            return Err(CellError::NoVolume);
        }
        Ok(Cell {
            shape: Shape::Ball { centre, radius },
            volume: 4.0 / 3.0 * PI * radius.powi(3),
            area: 4.0 * PI * radius * radius,
            bounds: [centre - radius, centre + radius],
        })
    }

    /// The convex polyhedron with these faces, each by its corners counter-clockwise from outside (metres). Faces meet
    /// edge to edge, in the very same corners.
    ///
    /// # Errors
    /// [`CellError`] for faces that are none, leave a gap, or do not bound a convex space.
    pub fn polyhedron(faces: Vec<Vec<DVec3>>) -> Result<Cell, CellError> {
        let face = |(face, corners)| Facet::new(corners).map_err(|error| CellError::Face { face, error });
        let faces: Vec<Facet> = faces.into_iter().enumerate().map(face).collect::<Result<_, _>>()?;
        let mut edges: FxHashMap<[[u64; 3]; 2], i32> = FxHashMap::default();
        // −0 and 0 are one place.
        let key = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
        for [a, b] in faces.iter().flat_map(Facet::edges).map(|edge| edge.map(key)) {
            *edges.entry(if a < b { [a, b] } else { [b, a] }).or_default() += if a < b { 1 } else { -1 };
        }
        let gaps: i32 = edges.values().map(|n| n.abs()).sum();
        if gaps > 0 || faces.is_empty() {
            return Err(CellError::Open(gaps as usize));
        }
        let corners = || faces.iter().flat_map(|f| f.corners().iter().copied());
        let bounds = [corners().fold(DVec3::INFINITY, DVec3::min), corners().fold(DVec3::NEG_INFINITY, DVec3::max)];
        let extent = bounds[0].distance(bounds[1]);
        let out = faces.iter().flat_map(|f| corners().map(|c| f.height(c))).fold(0.0, f64::max);
        if out > TOUCH * extent || !faces.iter().all(Facet::is_convex) {
            return Err(CellError::NotConvex(out));
        }
        let area = faces.iter().map(Facet::area).sum();
        // The divergence theorem, from a corner so that far cells lose no digits.
        let origin = faces[0].corners()[0];
        let volume = faces.iter().map(|f| f.area() * (f.centroid() - origin).dot(f.normal())).sum::<f64>() / 3.0;
        if volume <= FLAT * extent.powi(3) {
            return Err(CellError::NoVolume);
        }
        Ok(Cell { shape: Shape::Polyhedron(faces), volume, area, bounds })
    }

    /// Volume, m³.
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Area of its surface, m².
    pub fn surface_area(&self) -> f64 {
        self.area
    }

    /// The mean length of the lines through it, 4V/A, metres: the mean beam length of a thin medium.
    pub fn mean_chord(&self) -> f64 {
        4.0 * self.volume / self.area
    }

    /// The faces, looking outwards; a ball has none.
    pub fn faces(&self) -> &[Facet] {
        match &self.shape {
            Shape::Polyhedron(faces) => faces,
            Shape::Ball { .. } => &[],
        }
    }

    /// A point inside.
    pub(super) fn middle(&self) -> DVec3 {
        0.5 * (self.bounds[0] + self.bounds[1])
    }

    /// Where a line is inside, by distance from its place along a unit direction; either may be negative.
    pub(super) fn chord(&self, place: DVec3, direction: DVec3) -> Option<[f64; 2]> {
        let [near, far] = match &self.shape {
            Shape::Polyhedron(faces) => faces.iter().fold([f64::NEG_INFINITY, f64::INFINITY], |[near, far], face| {
                let (height, slope) = (face.height(place), direction.dot(face.normal()));
                if slope == 0.0 {
                    if height > 0.0 { [f64::INFINITY, f64::NEG_INFINITY] } else { [near, far] }
                } else if slope < 0.0 {
                    [near.max(-height / slope), far]
                } else {
                    [near, far.min(-height / slope)]
                }
            }),
            Shape::Ball { centre, radius } => {
                let from = place - *centre;
                let middle = -from.dot(direction);
                let squared = radius * radius - (from + middle * direction).length_squared();
                let half = if squared > 0.0 { squared.sqrt() } else { f64::NAN };
                [middle - half, middle + half]
            }
        };
        (near < far).then_some([near, far])
    }

    /// Triangles around the cell, at its faces or outside it, for trees of boxes.
    pub(super) fn hull(&self) -> Vec<[DVec3; 3]> {
        match &self.shape {
            Shape::Polyhedron(faces) => faces.iter().flat_map(Facet::triangles).collect(),
            Shape::Ball { .. } => {
                let around = Cell::cuboid(self.bounds[0], self.bounds[1]);
                around.map(|cell| cell.hull()).unwrap_or_default()
            }
        }
    }

    /// Whether two cells share more than their surfaces.
    pub(super) fn overlaps(&self, other: &Cell) -> bool {
        let touch = TOUCH * self.extent().min(other.extent());
        let [[low, high], [other_low, other_high]] = [self.bounds, other.bounds];
        if !(low + touch).cmplt(other_high).all() || !(other_low + touch).cmplt(high).all() {
            return false;
        }
        match (&self.shape, &other.shape) {
            (Shape::Ball { centre: a, radius: r }, Shape::Ball { centre: b, radius: s }) => {
                a.distance(*b) < r + s - touch
            }
            (Shape::Ball { centre, radius }, _) => other.distance(*centre) < radius - touch,
            (_, Shape::Ball { centre, radius }) => self.distance(*centre) < radius - touch,
            (Shape::Polyhedron(a), Shape::Polyhedron(b)) => !is_separated(a, b, touch),
        }
    }

    /// Whether a facet passes through the inside.
    pub(super) fn is_cut_by(&self, facet: &Facet) -> bool {
        let touch = TOUCH * self.extent();
        match &self.shape {
            Shape::Ball { centre, radius } => {
                facet.triangles().iter().any(|triangle| distance(*centre, triangle, facet.normal()) < radius - touch)
            }
            Shape::Polyhedron(faces) => facet.triangles().iter().any(|triangle| {
                let inside = faces.iter().fold(triangle.to_vec(), |polygon, face| below(&polygon, face, touch));
                inside.len() > 2
            }),
        }
    }

    fn extent(&self) -> f64 {
        self.bounds[0].distance(self.bounds[1])
    }

    /// Distance of a point; zero inside.
    fn distance(&self, point: DVec3) -> f64 {
        match &self.shape {
            Shape::Ball { centre, radius } => (point.distance(*centre) - radius).max(0.0),
            Shape::Polyhedron(faces) if faces.iter().all(|f| f.height(point) <= 0.0) => 0.0,
            Shape::Polyhedron(faces) => {
                faces.iter().map(|f| distance(point, f.corners(), f.normal())).fold(f64::INFINITY, f64::min)
            }
        }
    }
}

/// Lines into a cell.
pub(super) enum Entrances<'a> {
    /// Shares of the surface up to each face, places on it and the frame about its inward normal.
    Faces(&'a Cell, Vec<(f64, Places, [DVec3; 3])>),
    Ball(DVec3, f64),
}

impl<'a> Entrances<'a> {
    pub fn new(cell: &'a Cell) -> Entrances<'a> {
        match &cell.shape {
            Shape::Ball { centre, radius } => Entrances::Ball(*centre, *radius),
            Shape::Polyhedron(faces) => {
                let mut sum = 0.0;
                let entrance = |face: &Facet| {
                    sum += face.area() / cell.area;
                    (sum, Places::new(face), frame(-face.normal()))
                };
                Entrances::Faces(cell, faces.iter().map(entrance).collect())
            }
        }
    }

    /// The line of a point of the unit 4-cube: the face that it enters by, where, and which way.
    pub fn at(&self, [u, v, x, y]: [f64; 4]) -> (Option<usize>, DVec3, DVec3) {
        match self {
            Entrances::Faces(_, faces) => {
                let k = faces.iter().position(|(share, ..)| x < *share).unwrap_or(faces.len() - 1);
                let low = if k == 0 { 0.0 } else { faces[k - 1].0 };
                let (share, places, frame) = &faces[k];
                let x = ((x - low) / (share - low)).clamp(0.0, 1.0);
                (Some(k), places.at(x, y), cosine_direction(frame, u, v))
            }
            Entrances::Ball(centre, radius) => {
                let (z, angle) = (2.0 * x - 1.0, TAU * y);
                let level = (1.0 - z * z).max(0.0).sqrt();
                let outwards = DVec3::new(level * angle.cos(), level * angle.sin(), z);
                (None, *centre + *radius * outwards, cosine_direction(&frame(-outwards), u, v))
            }
        }
    }

    /// The face of a number.
    pub fn face(&self, k: usize) -> Option<&Facet> {
        match self {
            Entrances::Faces(cell, _) => cell.faces().get(k),
            Entrances::Ball(..) => None,
        }
    }
}

/// Whether a plane keeps two polyhedra apart but for `touch` (separating axes: normals, and edges across edges).
fn is_separated(a: &[Facet], b: &[Facet], touch: f64) -> bool {
    let range = |faces: &[Facet], axis: DVec3| {
        let along = faces.iter().flat_map(|f| f.corners()).map(|c| axis.dot(*c));
        along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), d| (low.min(d), high.max(d)))
    };
    let separates = |axis: DVec3| {
        let ((low, high), (other_low, other_high)) = (range(a, axis), range(b, axis));
        high <= other_low + touch || other_high <= low + touch
    };
    if a.iter().chain(b).any(|face| separates(face.normal())) {
        return true;
    }
    let directions = |faces: &[Facet]| -> Vec<DVec3> {
        faces.iter().flat_map(Facet::edges).map(|[p, q]| (q - p).normalize_or_zero()).collect()
    };
    let others = directions(b);
    // Parallel edges span no plane.
    let across = |u: DVec3| others.iter().filter_map(move |v| u.cross(*v).try_normalize());
    directions(a).into_iter().flat_map(across).any(separates)
}

/// What of a polygon lies deeper than `depth` below a face's plane.
fn below(polygon: &[DVec3], face: &Facet, depth: f64) -> Vec<DVec3> {
    let mut left = Vec::with_capacity(polygon.len() + 1);
    for (i, p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (h, k) = (face.height(*p) + depth, face.height(q) + depth);
        if h < 0.0 {
            left.push(*p);
        }
        if (h < 0.0) != (k < 0.0) {
            left.push(*p + h / (h - k) * (q - *p));
        }
    }
    left
}

/// Distance of a point from a convex polygon of either orientation.
fn distance(point: DVec3, corners: &[DVec3], normal: DVec3) -> f64 {
    let edges = || corners.iter().enumerate().map(|(i, a)| [*a, corners[(i + 1) % corners.len()]]);
    if edges().all(|[a, b]| (b - a).cross(point - a).dot(normal) >= 0.0) {
        return (point - corners[0]).dot(normal).abs();
    }
    let to_edge = |[a, b]: [DVec3; 2]| {
        let t = ((point - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        point.distance(a + t * (b - a))
    };
    edges().map(to_edge).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit() -> Cell {
        Cell::cuboid(DVec3::ZERO, DVec3::ONE).unwrap()
    }

    #[test]
    fn boxes_and_balls_have_their_volumes_and_chords() {
        let cell = Cell::cuboid(DVec3::new(1.0, 2.0, 3.0), DVec3::new(2.0, 4.0, 6.0)).unwrap();
        assert!((cell.volume() - 6.0).abs() < 1e-14 && (cell.surface_area() - 22.0).abs() < 1e-13);
        assert_eq!(cell.chord(DVec3::new(1.5, 0.0, 4.0), DVec3::Y), Some([2.0, 4.0]));
        assert_eq!(cell.chord(DVec3::new(0.5, 0.0, 4.0), DVec3::Y), None);
        let ball = Cell::ball(DVec3::ONE, 0.5).unwrap();
        assert!((ball.mean_chord() - 2.0 / 3.0).abs() < 1e-15);
        assert_eq!(ball.chord(DVec3::new(1.0, 1.0, 0.0), DVec3::Z), Some([0.5, 1.5]));
        assert_eq!(ball.chord(DVec3::new(1.6, 1.0, 0.0), DVec3::Z), None);
    }

    /// Cauchy: the mean chord is 4V/A.
    #[test]
    fn lines_that_enter_are_uniform() {
        let wedge = [[0., 0., 0.], [2., 0., 0.], [0., 1., 0.], [0., 0., 3.]].map(DVec3::from_array);
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let wedge = Cell::polyhedron(faces.iter().map(|f| f.map(|i| wedge[i]).to_vec()).collect()).unwrap();
        assert!((wedge.volume() - 1.0).abs() < 1e-14);
        for cell in [wedge, unit(), Cell::ball(DVec3::X, 2.0).unwrap()] {
            let (entrances, sequence) = (Entrances::new(&cell), radiosity_trace::sampling::Sequence::new(1, 2));
            let n = 1 << 15;
            let chord = |i| {
                let (_, place, direction) = entrances.at(sequence.point(i).map(f64::from));
                let [near, far] = cell.chord(place, direction).unwrap_or_default();
                assert!(near.abs() < 1e-6, "{near}");
                far - near
            };
            let mean = (0..n).map(chord).sum::<f64>() / f64::from(n);
            assert!((mean / cell.mean_chord() - 1.0).abs() < 1e-3, "{mean} for {}", cell.mean_chord());
        }
    }

    #[test]
    fn cells_that_cannot_be_are_refused() {
        let is = |cell: Result<Cell, CellError>| cell.unwrap_err();
        assert_eq!(is(Cell::cuboid(DVec3::ZERO, DVec3::new(1.0, f64::NAN, 1.0))), CellError::NotFinite);
        assert_eq!(is(Cell::cuboid(DVec3::ZERO, DVec3::new(1.0, 0.0, 1.0))), CellError::NoVolume);
        assert_eq!(is(Cell::ball(DVec3::ZERO, -1.0)), CellError::NoVolume);
        assert_eq!(is(Cell::ball(DVec3::ZERO, f64::INFINITY)), CellError::NotFinite);
        let faces: Vec<Vec<DVec3>> = unit().faces().iter().map(|f| f.corners().to_vec()).collect();
        assert_eq!(is(Cell::polyhedron(faces[1..].to_vec())), CellError::Open(4));
        let inwards = faces.iter().map(|f| f.iter().rev().copied().collect()).collect();
        assert!(matches!(is(Cell::polyhedron(inwards)), CellError::NotConvex(_)));
        assert!(matches!(is(Cell::polyhedron(vec![vec![DVec3::ZERO]])), CellError::Face { face: 0, .. }));
    }

    #[test]
    fn cells_overlap_where_they_share_more_than_a_surface() {
        let moved = |by: DVec3| Cell::cuboid(by, by + 1.0).unwrap();
        let ball = |x: f64| Cell::ball(DVec3::new(x, 0.5, 0.5), 0.5).unwrap();
        assert!(!unit().overlaps(&moved(DVec3::X)) && unit().overlaps(&moved(0.9 * DVec3::X)));
        assert!(unit().overlaps(&unit()) && !unit().overlaps(&moved(DVec3::ONE)));
        assert!(!unit().overlaps(&ball(1.5)) && ball(1.4).overlaps(&unit()) && unit().overlaps(&ball(0.5)));
        assert!(!ball(0.0).overlaps(&ball(1.0)) && ball(0.0).overlaps(&ball(0.9)));
        let corner = Cell::ball(DVec3::splat(1.3), 0.5).unwrap();
        assert!(!unit().overlaps(&corner));
        // The boxes around these overlap, they do not.
        let tip = |d: f64| {
            let p = [[d, d, d], [d - 1.5, d, d], [d, d - 1.5, d], [d, d, d - 1.5]].map(DVec3::from_array);
            let faces = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
            Cell::polyhedron(faces.iter().map(|f| f.map(|i| p[i]).to_vec()).collect()).unwrap()
        };
        assert!(tip(1.4).overlaps(&unit()) && !tip(1.51).overlaps(&unit()));
    }

    #[test]
    fn facets_cut_cells_that_they_pass_through() {
        let square = |x: f64| {
            let corners = [[x, 0., 0.], [x, 3., 0.], [x, 3., 3.], [x, 0., 3.]].map(DVec3::from_array);
            Facet::new(corners.to_vec()).unwrap()
        };
        let ball = Cell::ball(DVec3::splat(0.5), 0.5).unwrap();
        for cell in [unit(), ball] {
            assert!(cell.is_cut_by(&square(0.5)) && cell.is_cut_by(&square(0.01)));
            assert!(!cell.is_cut_by(&square(0.0)) && !cell.is_cut_by(&square(1.0)) && !cell.is_cut_by(&square(1.5)));
        }
    }
}
