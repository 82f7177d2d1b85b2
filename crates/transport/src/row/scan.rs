//! A convex polygon made ready for the cells of a face, in homogeneous coordinates (Olano and Greer 1997, "Triangle scan
//! conversion using 2D homogeneous coordinates").
//!
//! An edge from a to b and the eye span a plane, and the direction p = (x, y, 1) lies on its inner side where
//! (a × b)·p ≥ 0. The directions that are inside of all edges are those that meet the convex polygon, wherever its
//! corners lie: nothing is divided by a depth, so nothing has to be clipped, be it beside, below or behind the eye.
//! Polygons that share an edge compute the same plane with the opposite sign, so no cell falls between them. On the plane
//! m·X = d the reciprocal depth is m·p/d, linear over the window.

use super::face::Face;
use glam::DVec3;
use std::ops::Range;

/// A back is taken to lie this much further away than it does, so that the front of a wall without thickness is seen
/// and not its back. Far above rounding (1e-15 times how obliquely the wall is seen), far below any thickness.
const BACK: f64 = 1.0 / (1u64 << 30) as f64;

/// A convex polygon as the eye sees it: corners, and the plane m·X = d, in the frame of the face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outline<'a> {
    pub corners: &'a [DVec3],
    pub normal: DVec3,
    pub offset: f64,
}

/// What is needed to know which cells of a face a polygon covers, and how near it is there. Its edges lie in a list that
/// many share.
#[derive(Clone, Debug)]
pub(super) struct Scan {
    pub item: u32,
    /// Inner normals of the planes of its edges, in the shared list.
    pub edges: Range<usize>,
    /// Nearness at p is `plane`·p.
    pub plane: DVec3,
    /// It is seen from behind, so its nearness is a little less than it is.
    #[cfg(feature = "gpu")]
    pub is_back: bool,
    /// Rows of the face that the image reaches.
    pub rows: Range<usize>,
}

impl Scan {
    /// Adds the edges of a polygon to `edges`.
    pub fn new(face: &Face, outline: &Outline, item: u32, edges: &mut Vec<DVec3>) -> Scan {
        let Outline { corners, normal, offset } = *outline;
        let (side, start) = (offset.signum(), edges.len());
        edges.extend((0..corners.len()).map(|i| side * corners[i].cross(corners[(i + 1) % corners.len()])));
        let scale = (if offset > 0.0 { 1.0 - BACK } else { 1.0 }) / offset;
        let ([_, height], low) = (face.pitch(), face.window[2]);

        // The rows that the image reaches; all of them where a part of it lies at infinity.
        let mut reach = [f64::INFINITY, f64::NEG_INFINITY];
        for c in corners {
            let row = (c.y / c.z - low) / height - 0.5;
            reach = if c.z > 0.0 { [reach[0].min(row), reach[1].max(row)] } else { [f64::NEG_INFINITY, f64::INFINITY] };
            if c.z <= 0.0 {
                break;
            }
        }
        // A row more at either end, as these are rounded; conversions of what is too large saturate.
        let rows = (reach[0].floor() as usize)..face.cells[1].min((reach[1].ceil() + 1.0) as usize);
        Scan {
            item,
            edges: start..edges.len(),
            plane: normal * scale,
            #[cfg(feature = "gpu")]
            is_back: offset > 0.0,
            rows,
        }
    }

    /// The first and the last cell of a row whose centres the polygon covers.
    #[inline]
    pub fn span(&self, edges: &[DVec3], face: &Face, row: usize) -> Option<[usize; 2]> {
        if !self.rows.contains(&row) {
            return None;
        }
        let ([width, height], [left, _, low, _]) = (face.pitch(), face.window);
        let y = low + (row as f64 + 0.5) * height;
        let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
        for e in &edges[self.edges.clone()] {
            let rest = e.y * y + e.z;
            if e.x > 0.0 {
                from = from.max(-rest / e.x);
            } else if e.x < 0.0 {
                to = to.min(-rest / e.x);
            } else if rest < 0.0 {
                to = f64::NEG_INFINITY;
            }
        }
        let first = ((from - left) / width - 0.5).ceil().max(0.0);
        let last = ((to - left) / width - 0.5).floor().min(face.cells[0] as f64 - 1.0);
        // Not a number where an edge degenerates: nothing is covered.
        (first <= last).then_some([first as usize, last as usize])
    }

    /// Reciprocal depth at the centre of the first cell of a row, and how much it grows from cell to cell.
    #[inline]
    pub fn nearness(&self, face: &Face, row: usize) -> [f64; 2] {
        let ([width, height], [left, _, low, _]) = (face.pitch(), face.window);
        let (x, y) = (left + 0.5 * width, low + (row as f64 + 0.5) * height);
        [self.plane.x * x + self.plane.y * y + self.plane.z, self.plane.x * width]
    }

    /// Number of cells that it covers.
    pub fn covered(&self, edges: &[DVec3], face: &Face) -> u32 {
        let spans = self.rows.clone().filter_map(|row| self.span(edges, face, row));
        spans.map(|[first, last]| (last - first + 1) as u32).sum()
    }
}

/// What stands for no polygon.
pub(super) const NONE: u32 = u32::MAX;

/// All polygons that a face may show, in the order in which they are drawn.
#[derive(Clone, Debug, Default)]
pub(super) struct Scans {
    pub list: Vec<Scan>,
    pub edges: Vec<DVec3>,
    /// The corner at which each edge starts.
    #[cfg(feature = "gpu")]
    pub corners: Vec<DVec3>,
}

impl Scans {
    pub fn clear(&mut self) {
        self.list.clear();
        self.edges.clear();
        #[cfg(feature = "gpu")]
        self.corners.clear();
    }

    /// Adds a polygon; answers how many cells it covers.
    pub fn push(&mut self, face: &Face, outline: &Outline, item: u32) -> u32 {
        let scan = Scan::new(face, outline, item, &mut self.edges);
        #[cfg(feature = "gpu")]
        self.corners.extend(outline.corners);
        let covered = scan.covered(&self.edges, face);
        self.list.push(scan);
        covered
    }

    /// The item of a polygon; `nothing` of none.
    pub fn item(&self, scan: u32, nothing: u32) -> u32 {
        self.list.get(scan as usize).map_or(nothing, |scan| scan.item)
    }

    /// Reciprocal depth of a polygon at a cell's centre; zero of none.
    pub fn depth(&self, scan: u32, face: &Face, cell: usize) -> f64 {
        let (column, row) = (cell % face.cells[0], cell / face.cells[0]);
        self.list.get(scan as usize).map_or(0.0, |scan| {
            let [start, step] = scan.nearness(face, row);
            start + step * column as f64
        })
    }
}
