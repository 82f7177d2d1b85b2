//! From cells to arrays: numbers of regions, pieces of facets, patches of openings.

use super::partition::{Leaf, Partition, Portal};
use super::polygon::{area, patches};
use super::{RegionSize, Regions};
use crate::view_factors::united;
use glam::DVec3;
use radiosity_scene::{Enclosure, Facet};
use std::collections::BTreeMap;

/// The regions that cells make. `group` tells by cell which belong together.
pub fn finish(enclosure: &Enclosure, partition: Partition, group: &[u32], size: f64, touch: f64) -> Regions {
    let Partition { leaves, portals, .. } = partition;
    let mut found = Regions::default();
    let mut number: BTreeMap<u32, u32> = BTreeMap::new();
    for (i, fragments) in fragments(enclosure.facets.len(), &leaves, group).into_iter().enumerate() {
        for (of, piece) in pieces(&enclosure.facets[i], fragments, touch) {
            let next = number.len() as u32;
            let region = *number.entry(of).or_insert(next);
            found.pieces.push(piece);
            found.facet_of.push(i as u32);
            found.region_of.push(region);
        }
    }
    found.sizes = vec![RegionSize::default(); number.len()];
    for region in &found.region_of {
        found.sizes[*region as usize].elements += 1;
    }
    let number_of = |cell: u32| number.get(&group[cell as usize]).copied();
    add_patches(&mut found, portals, number_of, size, touch);
    let mut blockers: Vec<(u32, Facet)> = Vec::new();
    for leaf in leaves {
        let Some(region) = number_of(leaf.id) else { continue };
        blockers.extend(leaf.panels.into_iter().filter_map(|panel| Some((region, Facet::new(panel).ok()?))));
    }
    blockers.sort_by_key(|(region, _)| *region);
    (found.blocker_of, found.blockers) = blockers.into_iter().unzip();
    found
}

/// By facet the parts of it, each with its group.
fn fragments<'a>(facets: usize, leaves: &'a [Leaf], group: &[u32]) -> Vec<Vec<(u32, &'a [DVec3])>> {
    let mut fragments = vec![Vec::new(); facets];
    for leaf in leaves {
        for piece in &leaf.pieces {
            fragments[piece.facet as usize].push((group[leaf.id as usize], &*piece.corners));
        }
    }
    fragments
}

/// The pieces of a facet by group; the facet itself where it is in one.
fn pieces(facet: &Facet, mut fragments: Vec<(u32, &[DVec3])>, touch: f64) -> Vec<(u32, Facet)> {
    fragments.sort_by_key(|(group, _)| *group);
    let mut pieces = Vec::new();
    let is_cut = fragments.windows(2).any(|pair| pair[0].0 != pair[1].0);
    for of_group in fragments.chunk_by(|a, b| a.0 == b.0).filter(|_| is_cut) {
        let parts: Vec<Facet> = of_group.iter().filter_map(|(_, part)| Facet::new(part.to_vec()).ok()).collect();
        let refs: Vec<&Facet> = parts.iter().collect();
        let polygons = if refs.len() > 1 { united(&refs, facet.normal(), 0.01 * touch) } else { Vec::new() };
        let joined: Vec<Facet> = polygons.into_iter().filter_map(|polygon| Facet::new(polygon).ok()).collect();
        let parts = if joined.is_empty() { parts } else { joined };
        pieces.extend(parts.into_iter().map(|part| (of_group[0].0, part)));
    }
    if pieces.is_empty() {
        // Whole, or cut into parts without area: it goes where most of it is.
        let most = fragments.iter().max_by(|a, b| area(a.1).total_cmp(&area(b.1)));
        pieces.extend(most.map(|(group, _)| (*group, facet.clone())));
    }
    pieces
}

/// What the parts of an opening have in common: the regions, the cut, and whether its plane looks from the first to the
/// second.
type Key = ([u32; 2], u32, bool);

/// Meshes the openings between regions; parts of an opening are put together first.
fn add_patches(
    found: &mut Regions,
    portals: Vec<Portal>,
    number_of: impl Fn(u32) -> Option<u32>,
    size: f64,
    touch: f64,
) {
    let mut openings: BTreeMap<Key, (DVec3, Vec<Facet>)> = BTreeMap::new();
    for portal in portals {
        let [Some(a), Some(b)] = portal.cells.map(&number_of) else { continue };
        let Ok(facet) = Facet::new(portal.corners) else { continue };
        if a != b {
            let along = a < b;
            let key = ([a.min(b), a.max(b)], portal.cut, along);
            let normal = if along { portal.normal } else { -portal.normal };
            openings.entry(key).or_insert((normal, Vec::new())).1.push(facet);
        }
    }
    for ((sides, ..), (normal, parts)) in openings {
        let refs: Vec<&Facet> = parts.iter().collect();
        for polygon in united(&refs, normal, 0.01 * touch) {
            let meshed = patches(&polygon, normal, size);
            for side in sides {
                found.sizes[side as usize].patches += meshed.len();
            }
            found.sides.extend(std::iter::repeat_n(sides, meshed.len()));
            found.patches.extend(meshed);
        }
    }
}
