//! The row methods by name.

use super::{CubicTetrahedron, GlobalCube, Hemicube, Hemisphere, Look, Row, SinglePlane, Weights};
use std::fmt;
use std::str::FromStr;

/// A row method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum RowMethod {
    /// [`Hemicube`] with cells integrated exactly.
    #[default]
    Hemicube,
    /// [`Hemicube`] with cells weighed at their centres.
    HemicubeMidpoint,
    /// [`SinglePlane`].
    SinglePlane,
    /// [`SinglePlane`] with cells that adapt.
    SinglePlaneAdaptive,
    /// [`CubicTetrahedron`].
    CubicTetrahedron,
    /// [`GlobalCube`].
    GlobalCube,
    /// [`Hemisphere`] of rays.
    Hemisphere,
}

/// Names and descriptions of all methods.
const TABLE: [(RowMethod, &str, &str); 7] = [
    (RowMethod::Hemicube, "hemicube", "half a cube of cells, integrated exactly (Cohen and Greenberg 1985)"),
    (RowMethod::HemicubeMidpoint, "hemicube-midpoint", "half a cube of cells, as published (Cohen and Greenberg 1985)"),
    (RowMethod::SinglePlane, "single-plane", "one plane above the facet; misses what is low (Sillion and Puech 1989)"),
    (
        RowMethod::SinglePlaneAdaptive,
        "single-plane-adaptive",
        "the same, its cells divided where facets differ (Warnock 1969; Sillion and Puech 1989)",
    ),
    (RowMethod::CubicTetrahedron, "cubic-tetrahedron", "the corner of a cube of cells (Beran-Koehn and Pavicic 1991)"),
    (RowMethod::GlobalCube, "global-cube", "one cube of directions for all facets (Immel et al. 1986; Xu 1990)"),
    (RowMethod::Hemisphere, "hemisphere", "rays from all over the facet, cosine-distributed (Malley 1988)"),
];

impl RowMethod {
    /// All of them.
    pub fn all() -> impl Iterator<Item = RowMethod> {
        TABLE.into_iter().map(|(method, _, _)| method)
    }

    fn entry(self) -> (RowMethod, &'static str, &'static str) {
        TABLE.into_iter().find(|(method, _, _)| *method == self).expect("every method has a line in the table")
    }

    /// As users write it.
    pub fn name(self) -> &'static str {
        self.entry().1
    }

    /// One line on what it does, with its source.
    pub fn description(self) -> &'static str {
        self.entry().2
    }

    /// The method, looking as `look` says. Rays are as many as a hemicube would have cells on its top, for each of the
    /// points along a side.
    pub fn with(self, look: Look) -> Box<dyn Row> {
        match self {
            RowMethod::Hemicube => Box::new(Hemicube { look, weights: Weights::Exact }),
            RowMethod::HemicubeMidpoint => Box::new(Hemicube { look, weights: Weights::Midpoint }),
            RowMethod::SinglePlane => Box::new(SinglePlane::new(look)),
            RowMethod::SinglePlaneAdaptive => Box::new(SinglePlane::new(look).adapting()),
            RowMethod::CubicTetrahedron => Box::new(CubicTetrahedron { look }),
            RowMethod::GlobalCube => Box::new(GlobalCube { look, weights: Weights::Exact }),
            RowMethod::Hemisphere => Box::new(Hemisphere::like(&look)),
        }
    }
}

impl fmt::Display for RowMethod {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.pad(self.name())
    }
}

/// No row method has this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no row method is called \"{0}\"; there are {known}", known = names())]
pub struct UnknownRowMethod(pub String);

fn names() -> String {
    TABLE.map(|(_, name, _)| name).join(", ")
}

impl FromStr for RowMethod {
    type Err = UnknownRowMethod;

    fn from_str(name: &str) -> Result<RowMethod, UnknownRowMethod> {
        let entry = TABLE.into_iter().find(|(_, known, _)| *known == name);
        entry.map(|(method, _, _)| method).ok_or_else(|| UnknownRowMethod(name.into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_are_found_by_their_names() {
        for method in RowMethod::all() {
            assert_eq!(method.to_string().parse(), Ok(method));
            assert!(method.description().ends_with(')'), "{method} names its source");
            assert!(UnknownRowMethod(String::new()).to_string().contains(method.name()));
        }
        assert_eq!("Hemicube".parse::<RowMethod>(), Err(UnknownRowMethod("Hemicube".into())));
    }
}
