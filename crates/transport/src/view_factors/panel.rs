//! Panels: what stands in the way, as few convex polygons as possible.
//!
//! A wall that is meshed into hundreds of facets blocks light as one polygon. Facets that lie in one plane are united
//! (active side or not, they are opaque from both) and the union is cut into convex pieces, so that the question
//! whether anything stands between two facets is asked a few times and not a few hundred.

use crate::flat::Flat;
use glam::{DVec2, DVec3};
use i_triangle::float::triangulatable::Triangulatable;
use i_triangle::i_overlay::core::fill_rule::FillRule;
use i_triangle::i_overlay::float::simplify::SimplifyShape;
use radiosity_scene::{Enclosure, Facet};
use rustc_hash::FxHashMap;

/// A convex opaque polygon.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Its corners, counter-clockwise about the normal.
    pub corners: Vec<DVec3>,
    /// Unit normal; either side is opaque.
    pub normal: DVec3,
    /// n · x of the points x of its plane.
    pub offset: f64,
    /// Planes through its edges, upright on its own: unit normals inwards, and offsets.
    pub rims: Vec<(DVec3, f64)>,
    /// The convex solid that it is a face of, normals outwards.
    pub solid: Option<u32>,
}

impl Panel {
    /// The panel with these corners, counter-clockwise about `normal`.
    pub fn new(corners: Vec<DVec3>, normal: DVec3) -> Panel {
        let rim = |(i, a): (usize, &DVec3)| {
            let inwards = normal.cross(corners[(i + 1) % corners.len()] - *a).normalize_or_zero();
            (inwards, inwards.dot(*a))
        };
        let rims = corners.iter().enumerate().map(rim).collect();
        Panel { offset: normal.dot(corners[0]), normal, rims, corners, solid: None }
    }

    /// Distance of a point from the panel, m.
    pub fn distance(&self, point: DVec3) -> f64 {
        if self.rims.iter().all(|(inwards, offset)| inwards.dot(point) >= *offset) {
            return self.height(point).abs();
        }
        let n = self.corners.len();
        let beside = |i: usize| {
            let (a, edge) = (self.corners[i], self.corners[(i + 1) % n] - self.corners[i]);
            let along = ((point - a).dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
            point.distance(a + along * edge)
        };
        (0..n).map(beside).fold(f64::INFINITY, f64::min)
    }

    /// Height of a point above the plane.
    #[inline]
    pub fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }
}

/// Planes within `touch` of each other, found by hashing their rounded coefficients.
pub struct Planes {
    planes: Vec<(DVec3, f64)>,
    cells: FxHashMap<[i64; 4], Vec<u32>>,
    touch: f64,
    extent: f64,
}

/// Distance from a line below which corners lie on it, relative to that from a plane.
const STRAIGHT: f64 = 0.01;

/// Width of a cell of rounded coefficients, relative. Far above the tolerance, so that hardly a plane lies near a
/// border; far below the differences between planes of a scene.
const CELL: f64 = 1e-3;

impl Planes {
    /// No planes yet; `extent` is the scene's, `touch` the distance below which points lie on a plane.
    pub fn new(extent: f64, touch: f64) -> Planes {
        Planes { planes: Vec::new(), cells: FxHashMap::default(), touch, extent }
    }

    /// The plane of a facet: its index, and whether the facet faces along the plane's normal.
    pub fn find(&mut self, facet: &Facet) -> (u32, bool) {
        // One sign for both orientations: the first coefficient that is not small is positive.
        let n = facet.normal();
        let lead = n.to_array().into_iter().find(|c| c.abs() > 0.1).unwrap_or(n.z);
        let along = lead > 0.0;
        let n = if along { n } else { -n };
        let d = n.dot(facet.centroid());
        let scaled = [n.x, n.y, n.z, d / self.extent].map(|c| c / CELL);
        let slack = (10.0 * self.touch / self.extent / CELL).min(0.4);
        for cell in near(scaled, slack) {
            for &plane in self.cells.get(&cell).into_iter().flatten() {
                let (normal, offset) = self.planes[plane as usize];
                let holds = facet.corners().iter().all(|c| (normal.dot(*c) - offset).abs() <= self.touch);
                if holds && normal.dot(n) > 0.9 {
                    return (plane, along);
                }
            }
        }
        let plane = self.planes.len() as u32;
        self.planes.push((n, d));
        self.cells.entry(scaled.map(|c| c.floor() as i64)).or_default().push(plane);
        (plane, along)
    }

    /// Normal and offset of a plane.
    pub fn plane(&self, index: u32) -> (DVec3, f64) {
        self.planes[index as usize]
    }

    /// Number of planes.
    pub fn len(&self) -> usize {
        self.planes.len()
    }
}

/// The cell of rounded coefficients, and those beside it that lie within `slack` of a cell's width.
fn near(scaled: [f64; 4], slack: f64) -> Vec<[i64; 4]> {
    let mut cells = vec![[0i64; 4]];
    for (axis, c) in scaled.into_iter().enumerate() {
        let floor = c.floor();
        let mut own = vec![floor as i64];
        if c - floor < slack {
            own.push(floor as i64 - 1);
        }
        if floor + 1.0 - c < slack {
            own.push(floor as i64 + 1);
        }
        cells = cells
            .into_iter()
            .flat_map(|cell| {
                own.iter().map(move |&o| {
                    let mut cell = cell;
                    cell[axis] = o;
                    cell
                })
            })
            .collect();
    }
    cells
}

/// The panels of an enclosure: facets and obstructions, united plane by plane.
pub fn panels(enclosure: &Enclosure, planes: &mut Planes) -> Vec<Panel> {
    let mut of_plane: Vec<(Vec<&Facet>, [bool; 2])> = Vec::new();
    for facet in enclosure.facets.iter().chain(&enclosure.obstructions) {
        let (plane, along) = planes.find(facet);
        of_plane.resize_with(planes.len(), Default::default);
        let (facets, faces) = &mut of_plane[plane as usize];
        facets.push(facet);
        faces[usize::from(along)] = true;
    }
    let mut panels = Vec::new();
    for (plane, (facets, faces)) in of_plane.iter().enumerate() {
        if let [facet] = facets[..]
            && facet.is_convex()
        {
            panels.push(Panel::new(facet.corners().to_vec(), facet.normal()));
            continue;
        }
        // The side that all facets face, if there is one.
        let (normal, _) = planes.plane(plane as u32);
        let normal = if *faces == [true, false] { -normal } else { normal };
        let pieces = united(facets, normal, STRAIGHT * planes.touch);
        panels.extend(pieces.into_iter().map(|corners| Panel::new(corners, normal)));
    }
    panels
}

/// Drops corners that lie on the line between their neighbours, where facets met along a straight edge: rounding would
/// make them corners of ever more pieces.
fn straighten(contour: &mut Vec<[f64; 2]>, touch: f64) {
    let mut k = 0;
    while contour.len() > 3 && k < contour.len() {
        let n = contour.len();
        let [a, b, c] = [contour[(k + n - 1) % n], contour[k], contour[(k + 1) % n]].map(DVec2::from);
        let off = (c - a).perp_dot(b - a).abs();
        if off <= touch * (c - a).length() && (b - a).dot(c - b) > 0.0 {
            contour.remove(k);
        } else {
            k += 1;
        }
    }
}

/// Convex polygons that cover what the facets of one plane cover, counter-clockwise about `normal`.
pub fn united(facets: &[&Facet], normal: DVec3, touch: f64) -> Vec<Vec<DVec3>> {
    let flat = Flat::new(normal, facets[0].corners()[0]);
    let contours: Vec<Vec<[f64; 2]>> = facets
        .iter()
        .map(|facet| {
            let mut contour: Vec<_> = facet.corners().iter().map(|c| flat.flat(*c)).collect();
            if facet.normal().dot(normal) < 0.0 {
                contour.reverse();
            }
            contour
        })
        .collect();
    let union = contours.simplify_shape_as::<i64>(FillRule::NonZero);
    convex_pieces(union, touch).into_iter().map(|piece| piece.into_iter().map(|p| flat.back(p)).collect()).collect()
}

/// Shapes, outlines and holes, cut into convex polygons, counter-clockwise. Corners within `touch` of the line between their
/// neighbours are dropped.
pub fn convex_pieces(mut shapes: Vec<Vec<Vec<[f64; 2]>>>, touch: f64) -> Vec<Vec<[f64; 2]>> {
    for contour in shapes.iter_mut().flatten() {
        straighten(contour, touch);
    }
    let pieces = shapes.triangulate_as::<i64>().into_delaunay().to_convex_polygons();
    pieces
        .into_iter()
        .filter_map(|mut piece| {
            let at = |i: usize| DVec2::from(piece[i % piece.len()]);
            let twice: f64 = (0..piece.len()).map(|i| at(i).perp_dot(at(i + 1))).sum();
            if twice < 0.0 {
                piece.reverse();
            }
            (piece.len() >= 3 && twice != 0.0).then_some(piece)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quad(x: f64, y: f64, w: f64, h: f64, z: f64) -> Facet {
        let p = |x: f64, y: f64| DVec3::new(x, y, z);
        Facet::new(vec![p(x, y), p(x + w, y), p(x + w, y + h), p(x, y + h)]).unwrap()
    }

    fn of(facets: Vec<Facet>) -> Vec<Panel> {
        let mut enclosure = Enclosure::default();
        for facet in facets {
            enclosure.add("", facet);
        }
        panels(&enclosure, &mut Planes::new(10.0, 1e-6))
    }

    #[test]
    fn a_meshed_wall_is_one_panel_and_holes_stay_open() {
        let grid = |hole: bool| {
            let cells = (0..100).map(|k| (k % 10, k / 10));
            let kept = cells.filter(|(i, j)| !(hole && (3..5).contains(i) && (4..7).contains(j)));
            let facet = |(i, j)| {
                let q = quad(0.37 * f64::from(i), 0.21 * f64::from(j), 0.37, 0.21, 1.0);
                if (i + j) % 2 == 0 { q } else { q.flipped() }
            };
            kept.map(facet).collect::<Vec<_>>()
        };
        let area = |panels: &[Panel]| -> f64 {
            panels
                .iter()
                .map(|p| Facet::new(p.corners.clone()).unwrap())
                .inspect(|f| assert!(f.is_convex()))
                .map(|f| f.area())
                .sum()
        };
        let whole = of(grid(false));
        assert_eq!(whole.len(), 1);
        assert_eq!(whole[0].corners.len(), 4);
        assert!((area(&whole) - 3.7 * 2.1).abs() < 1e-9);
        let holed = of(grid(true));
        assert!(holed.len() <= 4, "{}", holed.len());
        assert!((area(&holed) - 94.0 * 0.37 * 0.21).abs() < 1e-9);
    }

    /// Triangles whose edges meet along slanting lines: rounding adds no pieces.
    #[test]
    fn a_wall_of_triangles_is_one_panel() {
        let at = |s: f64, t: f64| DVec3::new(0.265 + s * 0.158, 0.33 * t, 0.296 - 0.049 * s);
        let mut facets = Vec::new();
        for (a, b, c) in [([0., 0.], [0., 1.], [1., 1.]), ([0., 0.], [1., 1.], [1., 0.])] {
            let point = |i: i32, j: i32| {
                let (u, v) = (f64::from(i) / 8.0, f64::from(j) / 8.0);
                let mix = |k: usize| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]);
                at(mix(0), mix(1))
            };
            for i in 0..8 {
                for j in 0..8 - i {
                    facets.push(Facet::new(vec![point(i, j), point(i + 1, j), point(i, j + 1)]).unwrap());
                    if i + j < 7 {
                        facets.push(Facet::new(vec![point(i + 1, j + 1), point(i, j + 1), point(i + 1, j)]).unwrap());
                    }
                }
            }
        }
        let panels = of(facets);
        assert_eq!((panels.len(), panels[0].corners.len()), (1, 4), "{panels:?}");
    }

    #[test]
    fn parallel_planes_stay_apart() {
        assert_eq!(of(vec![quad(0., 0., 1., 1., 0.), quad(1., 0., 1., 1., 1e-3)]).len(), 2);
        assert_eq!(of(vec![quad(0., 0., 1., 1., 0.), quad(1., 0., 1., 1., 1e-8)]).len(), 1);
    }
}
