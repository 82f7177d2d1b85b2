//! Parts: the facets of an enclosure as convex polygons, with the points that cubature over them needs.

use super::frame::{Frame, LEAST, ORDERS, Weighted};
use super::moments::Moments;
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
    /// Centre, area, radius and second moments.
    pub moments: Moments,
    /// Points of each order.
    rules: [Vec<Four>; ORDERS],
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

    /// The points, without what is missing.
    #[inline]
    pub fn points(&self) -> impl Iterator<Item = Weighted> + '_ {
        let Four { at: [x, y, z], weights } = self;
        (0..4).map(|k| [x[k], y[k], z[k], weights[k]]).filter(|point| point[3] > 0.0)
    }
}

impl Part {
    /// The convex parts of facet `index`.
    pub fn of(index: u32, facet: &Facet) -> Vec<Part> {
        if facet.is_convex() && facet.corners().len() <= CORNERS {
            return vec![Part::new(index, facet.clone())];
        }
        let triangles = facet.triangles().into_iter().filter_map(|t| Facet::new(t.to_vec()).ok());
        triangles.map(|triangle| Part::new(index, triangle)).collect()
    }

    fn new(facet: u32, shape: Facet) -> Part {
        let frames = Frame::of(shape.corners());
        let points = |order: usize| frames.iter().flat_map(|frame| frame.rule(order)).collect::<Vec<_>>();
        let (centre, normal) = (shape.centroid(), shape.normal());
        let moments = Moments {
            axes: Moments::axes(&points(LEAST), centre, normal),
            is_symmetric: matches!(frames[..], [Frame { is_square: true, .. }]),
            area: shape.area(),
            radius: shape.radius(),
            centre,
            normal,
        };
        let rules = std::array::from_fn(|k| points(LEAST + k).chunks(4).map(Four::of).collect());
        Part { facet, shape, moments, rules }
    }

    /// The points of the rule of an order, in fours.
    #[inline]
    pub fn rule(&self, order: usize) -> &[Four] {
        &self.rules[order - LEAST]
    }
}
