//! What may be wrong with zones.

use super::Zone;
use radiosity_scene::Enclosure;
use rayon::prelude::*;

/// One fault of the zones.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum ZoneFault {
    /// A coefficient below zero, infinite or no number.
    #[error("zone {zone}: the {coefficient} coefficient is {value}/m, not a finite number from zero")]
    Coefficient {
        /// The zone.
        zone: usize,
        /// Which.
        coefficient: &'static str,
        /// What was given.
        value: f64,
    },
    /// Two zones that share more than a surface.
    #[error("zones {first} and {second} overlap: cut one, or leave it out")]
    Overlap {
        /// The one.
        first: usize,
        /// The other.
        second: usize,
    },
    /// A facet inside a zone.
    #[error("facet {facet} passes through zone {zone}: cut the zone along it")]
    Cut {
        /// The zone.
        zone: usize,
        /// The facet.
        facet: usize,
    },
    /// An obstruction inside a zone.
    #[error("obstruction {obstruction} passes through zone {zone}: cut the zone along it")]
    Obstructed {
        /// The zone.
        zone: usize,
        /// The obstruction.
        obstruction: usize,
    },
}

/// All of them, zone by zone.
pub(super) fn faults(enclosure: &Enclosure, zones: &[Zone]) -> Vec<ZoneFault> {
    let of_zone = |zone: usize| {
        let Zone { cell, absorption, scattering } = &zones[zone];
        let mut found = Vec::new();
        for (coefficient, value) in [("absorption", *absorption), ("scattering", *scattering)] {
            if !(value.is_finite() && value >= 0.0) {
                found.push(ZoneFault::Coefficient { zone, coefficient, value });
            }
        }
        let later = (zone + 1..zones.len()).filter(|other| cell.overlaps(&zones[*other].cell));
        found.extend(later.map(|second| ZoneFault::Overlap { first: zone, second }));
        let cuts = |facets: &[radiosity_scene::Facet]| -> Vec<usize> {
            facets.iter().enumerate().filter(|(_, facet)| cell.is_cut_by(facet)).map(|(k, _)| k).collect()
        };
        found.extend(cuts(&enclosure.facets).into_iter().map(|facet| ZoneFault::Cut { zone, facet }));
        let obstructed = |obstruction| ZoneFault::Obstructed { zone, obstruction };
        found.extend(cuts(&enclosure.obstructions).into_iter().map(obstructed));
        found
    };
    (0..zones.len()).into_par_iter().flat_map_iter(of_zone).collect()
}
