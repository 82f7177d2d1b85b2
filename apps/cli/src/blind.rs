//! Surfaces that see nothing: rows of a matrix of factors that are all zero, and why they are.

use radiosity::transport::FormFactors;
use radiosity::{Enclosure, Facet};

/// Height above a plane that counts as none, relative to the extent of the scene: below what single precision leaves of
/// coordinates.
const FLAT: f64 = 1e-6;

/// Why a surface sees nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// There is no other surface before it that faces it.
    Alone,
    /// There is, but all of it is hidden: the surface is covered or walled in.
    Hidden,
    /// There is, but the method met none of it: it may be hidden, or too small for where the method looked.
    Unmet,
}

impl Why {
    /// Why surface `blind` sees nothing by these factors: facets before each other that it yet sees nothing of are hidden, where
    /// pairs were proven to be. Other methods look at samples.
    pub fn of(enclosure: &Enclosure, factors: &FormFactors, blind: usize) -> Why {
        let is_proven = factors.choices.is_some_and(|choices| choices.rays == 0);
        let facets = || enclosure.facets.iter().zip(&enclosure.surface_of);
        let size = enclosure.bounds().map_or(0.0, |[low, high]| low.distance(high));
        let faces = |from: &Facet, to: &Facet| to.corners().iter().any(|corner| from.height(*corner) > FLAT * size);
        let own = facets().filter(|(_, surface)| **surface as usize == blind);
        for (facet, _) in own {
            if facets().any(|(other, _)| faces(facet, other) && faces(other, facet)) {
                return if is_proven { Why::Hidden } else { Why::Unmet };
            }
        }
        Why::Alone
    }

    /// In words, after a name.
    pub fn told(self) -> &'static str {
        match self {
            Why::Alone => "none faces it",
            Why::Hidden => "covered or walled in",
            Why::Unmet => "nothing was met",
        }
    }
}

/// The rows that are all zero.
pub fn blind(factors: &FormFactors) -> Vec<usize> {
    (0..factors.len()).filter(|row| factors.row(*row).all(|(_, value, _)| value == 0.0)).collect()
}
