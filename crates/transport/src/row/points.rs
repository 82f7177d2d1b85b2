//! Points that stand for a facet: eye points with their shares of its area, and what counts as lying in its plane.

use glam::DVec3;
use radiosity_scene::Facet;

/// How far corners may lie off a plane and still count as in it, relative to the extent of both facets: coordinates have
/// six digits or more. A facet of that height hides 1e-6 of the view.
const IN_PLANE: f64 = 1e-6;

/// Whether all `corners` lie in the plane of a facet.
pub(crate) fn is_coplanar(facet: &Facet, corners: impl Iterator<Item = DVec3> + Clone) -> bool {
    let Some(first) = corners.clone().next() else { return true };
    let extent = facet.radius() + corners.clone().map(|c| c.distance(first)).fold(0.0, f64::max);
    corners.into_iter().all(|c| facet.height(c).abs() <= IN_PLANE * extent)
}

/// Some k × k points on a facet, each with its share of the area: cell centres of a grid on a quadrilateral, centroids of
/// similar triangles elsewhere (then the facet's own shape says how many). One point is the centroid.
pub(super) fn eye_points(facet: &Facet, k: usize) -> Vec<(DVec3, f64)> {
    if k <= 1 {
        return vec![(middle(facet), 1.0)];
    }
    let weigh = |pieces: Vec<(DVec3, f64)>| {
        let whole: f64 = pieces.iter().map(|(_, area)| area).sum();
        pieces.into_iter().map(|(point, area)| (point, area / whole)).collect()
    };
    if let ([a, b, c, d], true) = (facet.corners(), facet.is_convex()) {
        let at = |i: usize, j: usize| {
            let (u, v) = (i as f64 / k as f64, j as f64 / k as f64);
            a.lerp(*b, u).lerp(d.lerp(*c, u), v)
        };
        let cell = |index: usize| {
            let (i, j) = (index % k, index / k);
            let (p, q, r, s) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            ((p + q + r + s) / 4.0, 0.5 * (r - p).cross(s - q).length())
        };
        return weigh((0..k * k).map(cell).collect());
    }
    let mut pieces = Vec::new();
    for [a, b, c] in facet.triangles() {
        let area = 0.5 * (b - a).cross(c - a).length();
        let n = (k as f64 * (area / facet.area()).sqrt()).ceil().max(1.0) as usize;
        let at = |i: f64, j: f64| (a + (b - a) * (i / n as f64)) + (c - a) * (j / n as f64);
        for j in 0..n {
            for i in 0..n - j {
                let (x, y) = (i as f64, j as f64);
                pieces.push((at(x + 1.0 / 3.0, y + 1.0 / 3.0), area));
                if i + j + 1 < n {
                    pieces.push((at(x + 2.0 / 3.0, y + 2.0 / 3.0), area));
                }
            }
        }
        let last = pieces.len() - n * n;
        pieces[last..].iter_mut().for_each(|piece| piece.1 /= (n * n) as f64);
    }
    weigh(pieces)
}

/// The centroid, or the centre of the largest triangle of a facet that does not contain its own.
fn middle(facet: &Facet) -> DVec3 {
    let centroid = facet.centroid();
    let triangles = facet.triangles();
    let twice = |[a, b, c]: &[DVec3; 3]| (*b - *a).cross(*c - *a).dot(facet.normal());
    let inside = |[a, b, c]: &[DVec3; 3]| {
        [[*a, *b, centroid], [*b, *c, centroid], [*c, *a, centroid]].iter().all(|t| twice(t) > 0.0)
    };
    if facet.is_convex() || triangles.iter().any(inside) {
        return centroid;
    }
    let largest = triangles.iter().max_by(|s, t| twice(s).total_cmp(&twice(t)));
    largest.map_or(centroid, |[a, b, c]| (*a + *b + *c) / 3.0)
}

/// Places on a facet, uniform by area, from points of the unit square.
#[derive(Clone, Debug)]
pub(crate) struct Places {
    /// Triangles, and the share of the area up to the end of each.
    triangles: Vec<([DVec3; 3], f64)>,
}

impl Places {
    pub fn new(facet: &Facet) -> Places {
        Places::of(facet.triangles())
    }

    /// On all of some triangles.
    pub fn of(triangles: Vec<[DVec3; 3]>) -> Places {
        let areas: Vec<f64> = triangles.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).length()).collect();
        let whole: f64 = areas.iter().sum();
        let mut end = 0.0;
        let ends = areas.iter().map(|area| {
            end += area / whole;
            end
        });
        let ends: Vec<f64> = ends.collect();
        Places { triangles: triangles.into_iter().zip(ends).collect() }
    }

    /// The place of (x, y), both in [0, 1).
    pub fn at(&self, x: f64, y: f64) -> DVec3 {
        self.find(x, y).1
    }

    /// The place of (x, y), both in [0, 1), and which triangle it lies on.
    pub fn find(&self, x: f64, y: f64) -> (usize, DVec3) {
        let k = self.triangles.partition_point(|(_, end)| *end <= x).min(self.triangles.len() - 1);
        let start = if k > 0 { self.triangles[k - 1].1 } else { 0.0 };
        let ([a, b, c], end) = self.triangles[k];
        let (u, root) = (((x - start) / (end - start)).clamp(0.0, 1.0), y.sqrt());
        (k, a + root * ((1.0 - u) * (b - a) + u * (c - a)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Means of x and x² over an L: by points and places as by hand.
    #[test]
    fn points_stand_for_any_facet() {
        let outline = [[0., 0.], [3., 0.], [3., 1.], [1., 1.], [1., 3.], [0., 3.]];
        let facet = Facet::new(outline.iter().map(|[x, y]| DVec3::new(*x, *y, 0.0)).collect()).unwrap();
        assert_eq!(eye_points(&facet, 1).len(), 1);
        let exact = (9.0 / 3.0 * 3.0 + 2.0 / 3.0) / 5.0;
        for k in [2, 4, 8, 16] {
            let points = eye_points(&facet, k);
            let shares: f64 = points.iter().map(|(_, share)| share).sum();
            let mean: f64 = points.iter().map(|(p, share)| p.x * share).sum();
            let square: f64 = points.iter().map(|(p, share)| p.x * p.x * share).sum();
            assert!((shares - 1.0).abs() < 1e-12 && (mean - 1.1).abs() < 1e-12, "{shares} {mean}");
            assert!((square - exact).abs() < 1.0 / (k * k) as f64, "{k}: {square} of {exact}");
        }
        let (places, n) = (Places::new(&facet), 200);
        let at = |i: usize| places.at(((i % n) as f64 + 0.5) / n as f64, ((i / n) as f64 + 0.5) / n as f64);
        let square = (0..n * n).map(|i| at(i).x.powi(2)).sum::<f64>() / (n * n) as f64;
        assert!((square - exact).abs() < 1e-3, "{square} of {exact}");
    }

    #[test]
    fn a_square_has_a_grid_of_points() {
        let square = [[0., 0.], [1., 0.], [1., 1.], [0., 1.]].map(|[x, y]| DVec3::new(x, y, 0.0));
        let points = eye_points(&Facet::new(square.to_vec()).unwrap(), 2);
        assert_eq!(points[0], (DVec3::new(0.25, 0.25, 0.0), 0.25));
        assert_eq!(points[3], (DVec3::new(0.75, 0.75, 0.0), 0.25));
    }
}
