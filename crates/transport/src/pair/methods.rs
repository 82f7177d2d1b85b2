//! The methods for pairs by name.

use super::Pair;
use super::contour::Contour;
use super::cubature::Cubature;
use super::exact::Exact;
use super::lambert::Lambert;
use super::nusselt::Nusselt;
use super::point::Point;
use super::sampled::{AreaSamples, GlobalLines, Malley};
use std::fmt;
use std::str::FromStr;

/// A method for the form factor of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PairMethod {
    /// [`Point`], plain.
    Point,
    /// [`Point`] with a disc.
    Disc,
    /// [`Lambert`].
    Lambert,
    /// [`Nusselt`].
    Nusselt,
    /// [`Contour`].
    Contour,
    /// [`Exact`].
    Exact,
    /// [`Cubature`].
    Cubature,
    /// [`Malley`].
    Malley,
    /// [`AreaSamples`].
    AreaSamples,
    /// [`GlobalLines`].
    GlobalLines,
}

/// All methods, the coarsest first.
pub const PAIRS: [PairMethod; 10] = [
    PairMethod::Point,
    PairMethod::Disc,
    PairMethod::Lambert,
    PairMethod::Nusselt,
    PairMethod::Contour,
    PairMethod::Exact,
    PairMethod::Cubature,
    PairMethod::Malley,
    PairMethod::AreaSamples,
    PairMethod::GlobalLines,
];

impl PairMethod {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            PairMethod::Point => "point",
            PairMethod::Disc => "disc",
            PairMethod::Lambert => "lambert",
            PairMethod::Nusselt => "nusselt",
            PairMethod::Contour => "contour",
            PairMethod::Exact => "exact",
            PairMethod::Cubature => "cubature",
            PairMethod::Malley => "malley",
            PairMethod::AreaSamples => "area-samples",
            PairMethod::GlobalLines => "global-lines",
        }
    }

    /// What it does, in a line, and where it is from.
    pub fn description(self) -> &'static str {
        match self {
            PairMethod::Point => "the kernel between the centroids times the area (Goral et al. 1984)",
            PairMethod::Disc => "the same with the receiver as a disc, never above one (Wallace et al. 1989)",
            PairMethod::Lambert => "the contour formula from the centroid to the polygon (Lambert 1760)",
            PairMethod::Nusselt => "the area on the base of the hemisphere above the centroid (Nusselt 1928)",
            PairMethod::Contour => "the contour double line integral by Gauss (Sparrow 1963)",
            PairMethod::Exact => "the contour double line integral in closed form (Schröder and Hanrahan 1993)",
            PairMethod::Cubature => "the double-area integral by adaptive cubature (Genz and Malik 1980)",
            PairMethod::Malley => "cosine-distributed rays (Malley 1988)",
            PairMethod::AreaSamples => "pairs of points on both areas (Cohen and Wallace 1993)",
            PairMethod::GlobalLines => "uniform lines through the scene (Sbert 1993)",
        }
    }

    /// The method with its default settings.
    pub fn build(self) -> Box<dyn Pair> {
        match self {
            PairMethod::Point => Box::new(Point { is_disc: false }),
            PairMethod::Disc => Box::new(Point { is_disc: true }),
            PairMethod::Lambert => Box::new(Lambert),
            PairMethod::Nusselt => Box::new(Nusselt),
            PairMethod::Contour => Box::new(Contour::default()),
            PairMethod::Exact => Box::new(Exact),
            PairMethod::Cubature => Box::new(Cubature::default()),
            PairMethod::Malley => Box::new(Malley::default()),
            PairMethod::AreaSamples => Box::new(AreaSamples::default()),
            PairMethod::GlobalLines => Box::new(GlobalLines::default()),
        }
    }

    /// Whether the value takes account of what stands between; where not, only the error does.
    pub fn sees_occlusion(self) -> bool {
        !matches!(self, PairMethod::Contour | PairMethod::Exact)
    }
}

impl fmt::Display for PairMethod {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A name that no method for pairs has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no method for pairs is called \"{name}\"; there are {}", names())]
pub struct UnknownMethod {
    /// What was asked for.
    pub name: String,
}

fn names() -> String {
    PAIRS.map(PairMethod::name).join(", ")
}

impl FromStr for PairMethod {
    type Err = UnknownMethod;

    fn from_str(name: &str) -> Result<PairMethod, UnknownMethod> {
        PAIRS.into_iter().find(|method| method.name() == name).ok_or_else(|| UnknownMethod { name: name.into() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pair::blockers::Blockers;
    use crate::pair::polygons::parallelogram;
    use crate::pair::{Occlusion, Unoccluded};
    use glam::DVec3;
    use radiosity_scene::Facet;

    #[test]
    fn names_are_read_back() {
        for method in PAIRS {
            assert_eq!(method.to_string().parse(), Ok(method));
            assert!(method.description().ends_with(')'));
        }
        let error = "hemisphere".parse::<PairMethod>().unwrap_err();
        assert!(error.to_string().contains("hemisphere") && error.to_string().contains("global-lines"));
    }

    /// All methods agree within the sum of their errors on pairs apart, near, touching, of unequal size, with and without
    /// something between. Three of them draw points, with fixed seeds, and may be off by more in one of some hundred
    /// cases.
    #[test]
    fn catalogue_91_methods_agree_within_their_errors() {
        let floor = parallelogram([0., 0., 0.], [1., 0., 0.], [0., 1., 0.]);
        let l = [[0., 0.], [0., 2.], [1., 2.], [1., 1.], [2., 1.], [2., 0.]];
        let concave = Facet::new(l.iter().map(|[x, y]| DVec3::new(*x, *y, 1.2)).collect()).unwrap();
        let ceiling = parallelogram([0., 0., 1.], [0., 1., 0.], [1., 0., 0.]);
        let half = Blockers::new([&parallelogram([0.25, 0.25, 0.5], [0.5, 0., 0.], [0., 0.5, 0.])]);
        let fin = Blockers::new([&parallelogram([0.2, 0.2, 0.2], [0.4, 0., 0.], [0., 0.6, 0.])]);
        let lid = Blockers::new([&parallelogram([-1., -1., 0.5], [3., 0., 0.], [0., 3., 0.])]);
        let wall = parallelogram([0., 0., 0.], [0., 1., 0.], [0., 0., 1.]);
        let cases: [(&str, Facet, Facet, &dyn Occlusion); 9] = [
            ("opposite", floor.clone(), ceiling.clone(), &Unoccluded),
            ("far", floor.clone(), parallelogram([2., 3., 6.], [0., 1., 0.5], [1.5, 0., -1.]), &Unoccluded),
            ("tilted", floor.clone(), parallelogram([0.3, -2., 0.5], [0.5, 0.1, 0.2], [0.1, 0.8, 1.]), &Unoccluded),
            ("concave", floor.clone(), concave.clone(), &Unoccluded),
            ("from concave", concave, floor.clone(), &Unoccluded),
            ("half hidden", floor.clone(), ceiling.clone(), &half),
            ("fin", floor.clone(), ceiling.clone(), &fin),
            ("hidden", floor.clone(), ceiling, &lid),
            ("behind", floor.clone(), wall.flipped(), &Unoccluded),
        ];
        for (name, from, to, occlusion) in &cases {
            let factors = PAIRS.map(|method| (method, method.build().factor(from, to, *occlusion)));
            for (i, (method, a)) in factors.iter().enumerate() {
                assert!(a.value >= 0.0 && a.error.is_finite(), "{name} by {method}: {a:?}");
                for (other, b) in &factors[..i] {
                    let off = (a.value - b.value).abs();
                    assert!(off <= a.error + b.error + 1e-14, "{name}: {method} {a:?}, {other} {b:?}");
                }
            }
        }
        // Touching facets, for all that have a variance.
        let factors = PAIRS.map(|method| (method, method.build().factor(&floor, &wall, &Unoccluded)));
        for (method, factor) in factors.iter().filter(|(method, _)| *method != PairMethod::AreaSamples) {
            assert!((factor.value - 0.200_043_776_1).abs() <= factor.error + 1e-10, "{method} {factor:?}");
        }
    }

    /// What is obstructed never exceeds what is not by more than points drawn at random make it.
    #[test]
    fn catalogue_18_obstructed_is_never_more() {
        let floor = parallelogram([0., 0., 0.], [1., 0., 0.], [0., 1., 0.]);
        let ceiling = parallelogram([0., 0., 1.], [0., 1., 0.], [1., 0., 0.]);
        for x in [-0.4, 0.0, 0.3, 0.9, 1.2] {
            let blocker = Blockers::new([&parallelogram([x, 0.1, 0.5], [0.4, 0., 0.], [0., 0.5, 0.])]);
            for method in PAIRS {
                let method = method.build();
                let free = method.factor(&floor, &ceiling, &Unoccluded).value;
                assert!(method.factor(&floor, &ceiling, &blocker).value <= free);
            }
        }
    }
}
