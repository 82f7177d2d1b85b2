//! Form factors of pairs: how much of what one facet gives off reaches another.
//!
//! F_ij = (1/A_i) ∫_{A_i} ∫_{A_j} cos θ_i cos θ_j V/(π r²) dA_j dA_i (catalogue 0a), the share of what leaves i that
//! arrives at j. Each method is a file and knows how far it is off.

mod area;
pub mod blockers;
pub mod contour;
pub mod cubature;
mod edges;
pub mod exact;
pub(crate) mod gauss;
pub mod lambert;
mod methods;
pub mod nusselt;
pub mod point;
#[cfg(test)]
mod polygons;
pub mod sampled;
mod segments;
pub(crate) mod shadow;
pub mod shapes;
mod sight;
mod smooth;

pub use methods::{PAIRS, PairMethod, UnknownMethod};

use glam::DVec3;
use radiosity_scene::Facet;

/// A form factor and how far it may be off.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Factor {
    /// F_ij.
    pub value: f64,
    /// Bound of |value − F_ij| as the method knows it: a proven one or an estimate on the safe side; three standard errors
    /// where points are drawn.
    pub error: f64,
}

/// What stands between two points.
pub trait Occlusion: Sync {
    /// Whether the open segment from `a` to `b` meets nothing. What touches its ends does not count.
    fn is_clear(&self, a: DVec3, b: DVec3) -> bool;

    /// Whether nothing ever stands in the way.
    fn is_empty(&self) -> bool {
        false
    }

    /// Whether anything may stand between the front sides of two facets; where not, methods trace no segments.
    fn may_block(&self, _from: &Facet, _to: &Facet) -> bool {
        !self.is_empty()
    }

    /// The convex polygons, of either orientation, that may stand between the front sides of two facets, where polygons
    /// are all there is and they are few; methods then cut shadows exactly. `None` where only segments can tell.
    fn polygons(&self, _from: &Facet, _to: &Facet) -> Option<Vec<&[DVec3]>> {
        None
    }
}

/// Nothing stands anywhere.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unoccluded;

impl Occlusion for Unoccluded {
    fn is_clear(&self, _a: DVec3, _b: DVec3) -> bool {
        true
    }

    fn is_empty(&self) -> bool {
        true
    }
}

/// A method for the form factor of one pair.
pub trait Pair: Sync {
    /// F from `from` to `to`, both emitting and receiving on their active sides only.
    fn factor(&self, from: &Facet, to: &Facet, occlusion: &dyn Occlusion) -> Factor;
}
