//! Parts: the facets of an enclosure as convex polygons, with the points that cubature over them needs.

use super::frame::{Frame, ORDERS, Weighted};
use glam::DVec3;
use radiosity_scene::Facet;

/// Corners of a part at most, so that shafts need no memory of their own; what has more is taken as triangles.
pub const CORNERS: usize = 12;

/// A convex polygon of a facet.
#[derive(Clone, Debug)]
pub struct Part {
    /// The facet that it belongs to.
    pub facet: u32,
    /// The polygon.
    pub shape: Facet,
    /// Radius about the centroid.
    pub radius: f64,
    /// Points of each order.
    rules: [Vec<Weighted>; ORDERS],
    /// The same in fours.
    fours: [Vec<Four>; ORDERS],
}

/// Four points of a rule: their coordinates, and their shares of the area, m². What is missing weighs nothing.
#[derive(Clone, Copy, Debug)]
pub struct Four {
    pub at: [[f64; 4]; 3],
    pub weights: [f64; 4],
}

impl Four {
    fn of(points: &[Weighted]) -> Four {
        let point = |k: usize| points[k.min(points.len() - 1)];
        Four {
            at: std::array::from_fn(|axis| std::array::from_fn(|k| point(k)[axis])),
            weights: std::array::from_fn(|k| if k < points.len() { points[k][3] } else { 0.0 }),
        }
    }
}

impl Part {
    /// The convex parts of facet `index`.
    pub fn of(index: u32, facet: &Facet) -> Vec<Part> {
        let part = |shape: Facet| {
            let rules = rules(shape.corners());
            let fours = std::array::from_fn(|k| rules[k].chunks(4).map(Four::of).collect());
            Part { facet: index, radius: shape.radius(), rules, fours, shape }
        };
        if facet.is_convex() && facet.corners().len() <= CORNERS {
            return vec![part(facet.clone())];
        }
        facet.triangles().into_iter().filter_map(|t| Facet::new(t.to_vec()).ok()).map(part).collect()
    }

    /// Points of the rule of an order (1 to [`ORDERS`]).
    #[inline]
    pub fn rule(&self, order: usize) -> &[Weighted] {
        &self.rules[order - 1]
    }

    /// The same points in fours.
    #[inline]
    pub fn fours(&self, order: usize) -> &[Four] {
        &self.fours[order - 1]
    }
}

fn rules(polygon: &[DVec3]) -> [Vec<Weighted>; ORDERS] {
    let frames = Frame::of(polygon);
    std::array::from_fn(|k| frames.iter().flat_map(|frame| frame.rule(k + 1)).collect())
}
