//! Rows of form factors: all that one facet sees, at once.
//!
//! A row method looks out from a facet and says what share of its view each facet takes up. Each knows where it
//! fails (proximity, aliasing, truncation) and predicts by how much. [`RowMethod`] has them by name; those that project
//! on faces share the item buffer (`buffer`), the weights of cells (`face`) and the bookkeeping of errors (`look`).

pub(crate) mod around;
mod buffer;
mod cubic_tetrahedron;
mod face;
mod glance;
mod global_cube;
mod gpu;
mod hemicube;
pub(crate) mod hemisphere;
mod look;
mod matrix;
mod method;
pub(crate) mod points;
mod scan;
mod single_plane;
mod surface;
mod view;
mod warnock;

pub use cubic_tetrahedron::CubicTetrahedron;
pub use face::Weights;
pub use global_cube::{DirectionalRow, GlobalCube};
pub use gpu::GpuError;
#[cfg(feature = "gpu")]
pub use gpu::HemicubeGpu;
pub use hemicube::Hemicube;
pub use hemisphere::Hemisphere;
pub use look::{Look, Repair};
pub use matrix::RowMatrix;
pub use method::{RowMethod, UnknownRowMethod};
pub use single_plane::{HalfWidthError, SinglePlane};
pub use surface::MOST_CELLS;
pub use warnock::LookUps;

use crate::pair::Factor;
use crate::{Progress, Stopped};
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

    /// All rows, on rayon's threads; the same for any number of them. What rows have in common is made once.
    ///
    /// # Errors
    /// [`Stopped`] if `progress` says so, which is told of every row.
    fn rows(&self, enclosure: &Enclosure, progress: &dyn Progress) -> Result<RowMatrix, Stopped> {
        RowMatrix::collect(enclosure, progress, || (), |(), from| self.row(from, enclosure))
    }
}

#[cfg(test)]
pub(crate) mod tests;
