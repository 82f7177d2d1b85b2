//! Facets: planar polygons between which form factors are asked, and the enclosure that they make.
//!
//! Where light wants welded triangles cut into elements, radiative exchange wants what the user drew: few polygons,
//! exactly placed. Everything here is in double precision.

use glam::DVec3;

/// Farthest that a corner may lie from a facet's plane, relative to the facet's extent: what coordinates of six digits
/// leave of a plane. Formulas for polygons are off by about as much.
const PLANAR: f64 = 1e-5;

/// Area below which a polygon is a line, relative to the square of its extent.
const LINE: f64 = 1e-12;

/// Largest coordinate, metres. Areas and their powers stay numbers in double precision, and errors in single; with 1e80 all
/// form factors were zero, and said to be exact.
const FARTHEST: f64 = 1e15;

/// Least extent, metres, for the same reason.
const LEAST: f64 = 1e-15;

/// Why corners make no facet.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FacetError {
    /// Fewer than three corners.
    #[error("a facet has at least three corners, this one has {0}")]
    Corners(usize),
    /// A coordinate is NaN or infinite.
    #[error("a coordinate is not a finite number")]
    NotFinite,
    /// A coordinate is beyond all lengths.
    #[error("a coordinate is {0:e} m, and none may be beyond 1e15 m")]
    TooFar(f64),
    /// The corners lie on a line or in a point.
    #[error("the area is zero: the corners lie on a line")]
    NoArea,
    /// The corners do not lie in a plane.
    #[error("the corners do not lie in a plane: one is {0:e} m off it")]
    NotPlanar(f64),
}

/// A planar polygon without holes, active on the side from which its corners run counter-clockwise.
#[derive(Clone, Debug, PartialEq)]
pub struct Facet {
    corners: Vec<DVec3>,
    normal: DVec3,
    area: f64,
    centroid: DVec3,
    convex: bool,
}

impl Facet {
    /// The facet with these corners (metres).
    ///
    /// # Errors
    /// [`FacetError`] where they are too few, not finite, beyond 1e15 m, on a line or in a point (within 1e-15 m), or not in
    /// a plane.
    pub fn new(corners: Vec<DVec3>) -> Result<Facet, FacetError> {
        if corners.len() < 3 {
            return Err(FacetError::Corners(corners.len()));
        }
        if corners.iter().any(|c| !c.is_finite()) {
            return Err(FacetError::NotFinite);
        }
        let farthest = corners.iter().map(|c| c.abs().max_element()).fold(0.0, f64::max);
        if farthest > FARTHEST {
            return Err(FacetError::TooFar(farthest));
        }
        let origin = corners[0];
        let extent = corners.iter().map(|c| c.distance(origin)).fold(0.0, f64::max);
        // Newell's normal, from the fan about the first corner.
        let fan = || corners[1..].windows(2).map(|pair| [pair[0] - origin, pair[1] - origin]);
        let twice: DVec3 = fan().map(|[a, b]| a.cross(b)).sum();
        let area = 0.5 * twice.length();
        if extent < LEAST || area <= LINE * extent * extent {
            return Err(FacetError::NoArea);
        }
        let normal = twice / (2.0 * area);
        let off = corners.iter().map(|c| (*c - origin).dot(normal).abs()).fold(0.0, f64::max);
        if off > PLANAR * extent {
            return Err(FacetError::NotPlanar(off));
        }
        let moment: DVec3 = fan().map(|[a, b]| a.cross(b).dot(normal) * (a + b)).sum();
        let centroid = origin + moment / (6.0 * area);
        let n = corners.len();
        let turn = |i: usize| {
            let [a, b, c] = [corners[i], corners[(i + 1) % n], corners[(i + 2) % n]];
            (b - a).cross(c - b).dot(normal)
        };
        let convex = (0..n).all(|i| turn(i) >= -LINE * extent * extent);
        Ok(Facet { corners, normal, area, centroid, convex })
    }

    /// The corners, counter-clockwise from the active side.
    pub fn corners(&self) -> &[DVec3] {
        &self.corners
    }

    /// Unit normal of the active side.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// Area, m².
    pub fn area(&self) -> f64 {
        self.area
    }

    /// Centre of area.
    pub fn centroid(&self) -> DVec3 {
        self.centroid
    }

    /// Whether no corner turns inwards.
    pub fn is_convex(&self) -> bool {
        self.convex
    }

    /// Height of a point above the facet's plane, metres; positive on the active side.
    pub fn height(&self, point: DVec3) -> f64 {
        (point - self.corners[0]).dot(self.normal)
    }

    /// Whether each has a corner before the other's plane: where not, no light goes from one front to the other.
    pub fn faces(&self, other: &Facet) -> bool {
        let is_before = |a: &Facet, b: &Facet| b.corners.iter().any(|c| a.height(*c) > 0.0);
        is_before(self, other) && is_before(other, self)
    }

    /// Radius of the smallest ball about the centroid that holds the facet.
    pub fn radius(&self) -> f64 {
        self.corners.iter().map(|c| c.distance(self.centroid)).fold(0.0, f64::max)
    }

    /// The edges, each from a corner to the next.
    pub fn edges(&self) -> impl Iterator<Item = [DVec3; 2]> + '_ {
        let n = self.corners.len();
        (0..n).map(move |i| [self.corners[i], self.corners[(i + 1) % n]])
    }

    /// The same polygon, active on its other side.
    pub fn flipped(&self) -> Facet {
        let mut corners = self.corners.clone();
        corners.reverse();
        Facet { corners, normal: -self.normal, ..self.clone() }
    }

    /// Triangles that cover the facet, of its orientation, one at least: a fan where it is convex, else ears cut off one by
    /// one.
    pub fn triangles(&self) -> Vec<[DVec3; 3]> {
        let mut left = self.corners.clone();
        if self.convex {
            return left[1..].windows(2).map(|pair| [left[0], pair[0], pair[1]]).collect();
        }
        let mut triangles = Vec::with_capacity(left.len() - 2);
        while left.len() > 3 {
            let n = left.len();
            let corners = |i: usize| [left[(i + n - 1) % n], left[i], left[(i + 1) % n]];
            let twice = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).dot(self.normal);
            let is_ear = |i: usize| {
                let ear @ [a, b, c] = corners(i);
                let inside = |p: DVec3| [[a, b, p], [b, c, p], [c, a, p]].into_iter().all(|t| twice(t) >= 0.0);
                let others = (0..n).filter(|j| ![(i + n - 1) % n, i, (i + 1) % n].contains(j));
                twice(ear) > 0.0 && !others.map(|j| left[j]).any(|p| p != a && p != b && p != c && inside(p))
            };
            // A simple polygon has an ear; rounding may hide it, and then the corner that turns most is as good.
            let widest = |i: &usize, j: &usize| twice(corners(*i)).total_cmp(&twice(corners(*j)));
            let ear = (0..n).find(|i| is_ear(*i)).or_else(|| (0..n).max_by(widest)).unwrap_or(0);
            triangles.push(corners(ear));
            left.remove(ear);
        }
        triangles.push([left[0], left[1], left[2]]);
        triangles.retain(|[a, b, c]| (*b - *a).cross(*c - *a).dot(self.normal) > 0.0);
        if triangles.is_empty() {
            // Rounding has left none: the area is next to nothing, and any three corners do.
            triangles.push([self.corners[0], self.corners[1], self.corners[2]]);
        }
        triangles
    }
}

/// A surface as the user named it: the facets that answer together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EnclosureSurface {
    /// Its name.
    pub name: String,
    /// Hemispherical emittance ε, where the file gives one.
    pub emittance: Option<f64>,
}

/// Facets that exchange radiation, and what stands in their way. Facets and obstructions are opaque from both sides.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Enclosure {
    /// What the file calls it.
    pub title: String,
    /// The facets that take part.
    pub facets: Vec<Facet>,
    /// The surface of each facet.
    pub surface_of: Vec<u32>,
    /// The surfaces.
    pub surfaces: Vec<EnclosureSurface>,
    /// Facets that only stand in the way.
    pub obstructions: Vec<Facet>,
    /// Whether the facets are meant to leave no gap, so that every row must sum to one.
    pub is_closed: bool,
}

impl Enclosure {
    /// Area of each surface, m².
    pub fn surface_areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.surfaces.len()];
        for (facet, surface) in self.facets.iter().zip(&self.surface_of) {
            areas[*surface as usize] += facet.area();
        }
        areas
    }

    /// Adds a surface of one facet.
    pub fn add(&mut self, name: impl Into<String>, facet: Facet) {
        self.surface_of.push(self.surfaces.len() as u32);
        self.surfaces.push(EnclosureSurface { name: name.into(), emittance: None });
        self.facets.push(facet);
    }

    /// Lower and upper corner of the box around everything; `None` without facets.
    pub fn bounds(&self) -> Option<[DVec3; 2]> {
        let corners = self.facets.iter().chain(&self.obstructions).flat_map(|f| f.corners().iter().copied());
        corners.fold(None, |bounds, c| match bounds {
            None => Some([c, c]),
            Some([low, high]) => Some([low.min(c), high.max(c)]),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(points: &[[f64; 2]]) -> Vec<DVec3> {
        points.iter().map(|[x, y]| DVec3::new(*x, *y, 3.0)).collect()
    }

    #[test]
    fn a_square_has_its_plane_area_and_centre() {
        let square = Facet::new(at(&[[1., 1.], [3., 1.], [3., 3.], [1., 3.]])).unwrap();
        assert_eq!((square.normal(), square.area()), (DVec3::Z, 4.0));
        assert_eq!(square.centroid(), DVec3::new(2.0, 2.0, 3.0));
        assert!(square.is_convex());
        assert_eq!(square.flipped().height(DVec3::ZERO), 3.0);
        assert_eq!(square.flipped(), Facet::new(square.flipped().corners().to_vec()).unwrap());
    }

    #[test]
    fn triangles_cover_a_concave_polygon_once() {
        let outline =
            [[0., 0.], [4., 0.], [4., 1.], [1., 1.], [1., 3.], [3., 3.], [3., 2.], [4., 2.], [4., 4.], [0., 4.]];
        let snake = Facet::new(at(&outline)).unwrap();
        assert!(!snake.is_convex());
        let triangles = snake.triangles();
        assert_eq!(triangles.len(), outline.len() - 2);
        let area: f64 = triangles.iter().map(|t| Facet::new(t.to_vec()).unwrap().area()).sum();
        assert!((area - snake.area()).abs() < 1e-12, "{area} of {}", snake.area());
    }

    #[test]
    fn what_is_no_polygon_is_refused_by_name() {
        let is = |corners: Vec<DVec3>| Facet::new(corners).unwrap_err();
        assert_eq!(is(at(&[[0., 0.], [1., 0.]])), FacetError::Corners(2));
        assert_eq!(is(at(&[[0., 0.], [1., 0.], [2., 0.]])), FacetError::NoArea);
        assert_eq!(is(at(&[[0., 0.], [f64::NAN, 0.], [2., 0.]])), FacetError::NotFinite);
        let square = |size: f64| at(&[[0., 0.], [size, 0.], [size, size], [0., size]]);
        assert_eq!(is(square(1e80)), FacetError::TooFar(1e80));
        assert_eq!(is(square(1e-80)), FacetError::NoArea);
        let bent = vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.1), DVec3::Y];
        assert!(matches!(is(bent), FacetError::NotPlanar(_)));
    }
}
