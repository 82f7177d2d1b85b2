//! Rows of form factors: all that one facet sees, at once.
//!
//! A row method looks out from a facet and says what share of its view each facet takes up. Each knows where it
//! fails (proximity, aliasing, truncation) and predicts by how much.

use crate::pair::Factor;
use radiosity_scene::Enclosure;

/// A row of form factors.
#[derive(Clone, Debug, Default)]
pub struct RowFactors {
    /// F from the facet to every facet of the enclosure, in their order.
    pub factors: Vec<Factor>,
    /// To nothing: what escapes from an open enclosure, and what ends on obstructions or on inactive sides.
    pub lost: f64,
    /// Share of the hemisphere that the method looks at, exactly: below one where it looks past the rim.
    pub captured: f64,
}

/// A method for rows of form factors.
pub trait Row: Sync {
    /// The row of facet `from`.
    fn row(&self, from: usize, enclosure: &Enclosure) -> RowFactors;
}
