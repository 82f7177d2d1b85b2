//! Convex polygons: heights over a plane, cuts by it, and patches of a given width.

use glam::DVec3;
use radiosity_scene::Facet;

/// The points x of n · x = d; its front is where n · x > d.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    pub normal: DVec3,
    pub offset: f64,
}

impl Plane {
    /// Height of a point above the plane, m.
    pub fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// Least and greatest height of some corners, m.
    pub fn heights(&self, corners: &[DVec3]) -> [f64; 2] {
        let range = |[low, high]: [f64; 2], h: f64| [low.min(h), high.max(h)];
        corners.iter().map(|c| self.height(*c)).fold([f64::INFINITY, f64::NEG_INFINITY], range)
    }

    /// Where corners lie that are no farther than `touch` beyond the plane.
    pub fn place(&self, corners: &[DVec3], touch: f64) -> Place {
        let [low, high] = self.heights(corners);
        match (low >= -touch, high <= touch) {
            (true, true) => Place::Within,
            (false, true) => Place::Behind,
            (true, false) => Place::Before,
            (false, false) => Place::Across,
        }
    }

    /// The parts of a convex polygon behind the plane and before it, fewer than three corners where there is none.
    /// Corners within `touch` of the plane belong to both.
    pub fn split(&self, corners: &[DVec3], touch: f64) -> [Vec<DVec3>; 2] {
        let mut parts = [Vec::with_capacity(corners.len() + 1), Vec::with_capacity(corners.len() + 1)];
        let n = corners.len();
        for (i, a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % n];
            let (at, next) = (self.height(*a), self.height(b));
            if at <= touch {
                parts[0].push(*a);
            }
            if at >= -touch {
                parts[1].push(*a);
            }
            if at.min(next) < -touch && at.max(next) > touch {
                let between = *a + (b - *a) * (at / (at - next));
                parts.iter_mut().for_each(|part| part.push(between));
            }
        }
        parts
    }
}

/// On which side of a plane a polygon is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// In the plane.
    Within,
    /// Where n · x < d.
    Behind,
    /// Where n · x > d.
    Before,
    /// On both sides.
    Across,
}

/// Area of a planar polygon, m².
pub fn area(corners: &[DVec3]) -> f64 {
    let Some((first, rest)) = corners.split_first() else { return 0.0 };
    0.5 * rest.windows(2).map(|pair| (pair[0] - first).cross(pair[1] - first)).sum::<DVec3>().length()
}

/// Centre of the triangle or polygon: the mean of its corners, which a convex one holds.
pub fn middle(corners: &[DVec3]) -> DVec3 {
    corners.iter().sum::<DVec3>() / corners.len().max(1) as f64
}

/// A grid along the longest edge of a polygon, of cells about `size` wide: for both directions the unit vector, where
/// it begins, the width of a cell, and their number.
fn grid(corners: &[DVec3], normal: DVec3, size: f64) -> [(DVec3, f64, f64, usize); 2] {
    let n = corners.len();
    let edge = |i: usize| corners[(i + 1) % n] - corners[i];
    let longest =
        (0..n).map(edge).fold(DVec3::ZERO, |a, b| if b.length_squared() > a.length_squared() { b } else { a });
    let u = longest.normalize_or_zero();
    [u, normal.cross(u)].map(|along| {
        let [low, high] = Plane { normal: along, offset: 0.0 }.heights(corners);
        // A cut finer than a thousand a side serves nobody and would fill the memory.
        let cells = ((high - low) / size).round().clamp(1.0, 1000.0);
        (along, low, (high - low) / cells, cells as usize)
    })
}

/// About how many patches [`patches`] makes; exactly so for rectangles.
pub fn count(corners: &[DVec3], normal: DVec3, size: f64) -> f64 {
    let [(_, _, width, columns), (_, _, height, rows)] = grid(corners, normal, size);
    let cells = (columns * rows) as f64;
    let filled = area(corners) / (width * height).max(f64::MIN_POSITIVE);
    filled.min(cells).round().max(1.0)
}

/// A convex polygon cut into patches about `size` wide, with its orientation.
pub fn patches(corners: &[DVec3], normal: DVec3, size: f64) -> Vec<Facet> {
    let grid = grid(corners, normal, size);
    let mut pieces = vec![corners.to_vec()];
    for (along, low, width, cells) in grid {
        let mut cut = Vec::new();
        for mut left in pieces {
            for k in 1..cells {
                let plane = Plane { normal: along, offset: low + width * k as f64 };
                let [behind, before] = plane.split(&left, 1e-9 * width);
                cut.push(behind);
                left = before;
            }
            cut.push(left);
        }
        pieces = cut;
    }
    pieces.into_iter().filter_map(|piece| Facet::new(piece).ok()).collect()
}
