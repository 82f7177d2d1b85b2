//! The hemicube: half of a cube of side 2 around the eye point, its top parallel to the facet (Cohen and Greenberg 1985,
//! "The hemi-cube: a radiosity solution for complex environments", SIGGRAPH; catalogue 23, 24).
//!
//! Cells of the top at (x, y): ΔF = ΔA/(π(x² + y² + 1)²); of a side at height z: ΔF = z ΔA/(π(y² + z² + 1)²). With one eye
//! point it is a point-to-area factor: on the unit cube 20 % too large for the opposite face. A small far facet of few
//! cells is off by as much as it has cells at its boundary, and lost below one cell. Both are predicted; see
//! [`Look`] for what can be done about them.

use super::face::{Face, Weights};
use super::look::Look;
use super::surface::Projection;
use glam::DVec3;

/// The hemicube.
///
/// ```
/// use radiosity_transport::row::{Hemicube, Row};
/// # use glam::DVec3;
/// # use radiosity_scene::{Enclosure, Facet};
/// let square = |z: f64| [[0., 0.], [1., 0.], [1., 1.], [0., 1.]].map(|[x, y]| DVec3::new(x, y, z)).to_vec();
/// let mut plates = Enclosure::default();
/// plates.add("floor", Facet::new(square(0.0)).unwrap());
/// plates.add("ceiling", Facet::new(square(1.0)).unwrap().flipped());
/// let row = Hemicube::default().row(0, &plates);
/// let off = (row.factors[1].value - 0.1998248957).abs();
/// assert!(off > 0.03 && off < row.factors[1].error);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hemicube {
    /// How it is looked at; `resolution` is that of the top, sides have half as many rows.
    pub look: Look,
    /// What cells weigh.
    pub weights: Weights,
}

/// A face that looks along `forward`, parallel to the facet, with the facet's normal up.
pub(super) fn side(forward: DVec3) -> [DVec3; 3] {
    [DVec3::Z.cross(forward), DVec3::Z, forward]
}

impl Projection for Hemicube {
    fn look(&self) -> Look {
        self.look
    }

    fn weights(&self) -> Weights {
        self.weights
    }

    fn faces(&self, n: usize) -> Vec<Face> {
        let top = Face { frame: [DVec3::X, DVec3::Y, DVec3::Z], window: [-1.0, 1.0, -1.0, 1.0], cells: [n, n] };
        let sides = [DVec3::X, DVec3::Y, -DVec3::X, -DVec3::Y].map(|forward| Face {
            frame: side(forward),
            window: [-1.0, 1.0, 0.0, 1.0],
            cells: [n, n / 2],
        });
        std::iter::once(top).chain(sides).collect()
    }
}

#[cfg(test)]
mod tests;
