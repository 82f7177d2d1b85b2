//! Points of a facet, uniform by area.

use glam::DVec3;
use radiosity_scene::Facet;

/// The triangles of a facet and the shares of its area up to each.
pub struct Places {
    triangles: Vec<[DVec3; 3]>,
    shares: Vec<f64>,
}

impl Places {
    pub fn new(facet: &Facet) -> Places {
        let triangles = facet.triangles();
        let area = |[a, b, c]: &[DVec3; 3]| (*b - *a).cross(*c - *a).length();
        let total: f64 = triangles.iter().map(area).sum();
        let mut sum = 0.0;
        let up_to = |t| {
            sum += area(t) / total;
            sum
        };
        let shares = triangles.iter().map(up_to).collect();
        Places { triangles, shares }
    }

    /// The point that (x, y) in the unit square maps to, at the same rate of area everywhere.
    pub fn at(&self, x: f64, y: f64) -> DVec3 {
        let last = self.triangles.len() - 1;
        let k = self.shares.iter().position(|share| x < *share).unwrap_or(last);
        let low = if k == 0 { 0.0 } else { self.shares[k - 1] };
        let [a, b, c] = self.triangles[k];
        // The root makes rows of equal area (Turk 1990).
        let root = ((x - low) / (self.shares[k] - low)).clamp(0.0, 1.0).sqrt();
        a + root * ((b - a) + y * (c - b))
    }
}
