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
}

impl Part {
    /// The convex parts of facet `index`.
    pub fn of(index: u32, facet: &Facet) -> Vec<Part> {
        let part = |shape: Facet| Part { facet: index, radius: shape.radius(), rules: rules(shape.corners()), shape };
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
}

fn rules(polygon: &[DVec3]) -> [Vec<Weighted>; ORDERS] {
    let frames = Frame::of(polygon);
    std::array::from_fn(|k| frames.iter().flat_map(|frame| frame.rule(k + 1)).collect())
}
