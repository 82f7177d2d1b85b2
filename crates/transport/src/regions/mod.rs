//! Regions: an enclosure cut into rooms, and the boundary patches through which they see each other.
//!
//! Localization (Xu 1990) computes form factors room by room. A *region* with p elements and q *boundary patches*,
//! transparent polygons that part it from its neighbours, takes (p + q)² of them, so n rooms cost Σ(p + q)² where the
//! whole costs (Σp)². Here regions and patches are found without help: space is cut by planes of walls (`partition`, as
//! Airey 1990 and Teller 1992 cut it), a plane's openings are what its walls leave free (`section`), and cells are
//! joined where their union costs less or where a plane only went through a room (`merge`).
//!
//! **What holds.** Each point of a facet is in exactly one region: facets that lie in a wall belong where their fronts
//! look, and those that a boundary goes through are cut by it. Whatever two points of different regions see of each
//! other, they see through boundary patches, which lead from region to region. Patches are planar, do not overlap, and
//! lie where no facet does.
//!
//! **Where it fails.** Only planes of facets cut: a room behind a curved wall stays one with its neighbour, and a hall
//! without walls is one region. Planes are known within 5e-7 of the scene's diagonal, and openings narrower than that
//! are none. What is seen of nobody's space (from which no front of a facet is seen in 64 directions) crosses no patch:
//! a long black pipe between two rooms, active on the outside only, would be overlooked.
//!
//! Of an enclosure that is not said to be closed the outside counts as open space, so planes part it less. Thousands of
//! large polygons that go through one another take time by the square.

mod finish;
mod merge;
mod partition;
mod polygon;
mod section;

use crate::view_factors::TOUCH;
use finish::finish;
use merge::{Content, merge};
use partition::partition;
use radiosity_scene::{Enclosure, Facet};
use section::Space;

/// How regions are found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionOptions {
    /// Width of boundary patches, m; `None`: the root of the mean area of the facets. Finer patches tell more of where
    /// light goes through, and cost more.
    pub patch: Option<f64>,
    /// Largest share of a plane, within the space that somebody sees, that may be open for it to be a wall. At ½ doors,
    /// windows and arches part rooms; with more, tables and low shelves would, with less, wide arches would not.
    pub most_open: f64,
}

impl Default for RegionOptions {
    fn default() -> Self {
        RegionOptions { patch: None, most_open: 0.5 }
    }
}

/// What a region holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RegionSize {
    /// p: elements.
    pub elements: usize,
    /// q: boundary patches.
    pub patches: usize,
}

/// Regions of an enclosure, in arrays. The same on any number of threads.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Regions {
    /// Elements: the facets, those cut that a boundary goes through.
    pub pieces: Vec<Facet>,
    /// The facet of each piece; ascending.
    pub facet_of: Vec<u32>,
    /// The region of each piece. Regions are numbered by their first pieces.
    pub region_of: Vec<u32>,
    /// Boundary patches; their normals look from the first of their regions to the second.
    pub patches: Vec<Facet>,
    /// The two regions that each patch parts, the lower first.
    pub sides: Vec<[u32; 2]>,
    /// What stands in the way: all opaque polygons in or on the border of a region, its own pieces united among them.
    pub blockers: Vec<Facet>,
    /// The region of each blocker; ascending.
    pub blocker_of: Vec<u32>,
    /// p and q of each region.
    pub sizes: Vec<RegionSize>,
}

impl Regions {
    /// Number of regions.
    pub fn len(&self) -> usize {
        self.sizes.len()
    }

    /// Whether there are none: the enclosure had no facets.
    pub fn is_empty(&self) -> bool {
        self.sizes.is_empty()
    }

    /// Σ(p + q)²: form factors to be found.
    pub fn cost(&self) -> f64 {
        self.sizes.iter().map(|size| ((size.elements + size.patches) as f64).powi(2)).sum()
    }

    /// The boundary patches of a region.
    pub fn patches_of(&self, region: u32) -> impl Iterator<Item = u32> + '_ {
        (0..self.sides.len() as u32).filter(move |k| self.sides[*k as usize].contains(&region))
    }

    /// A region alone: its pieces, then its boundary patches in the order of [`Self::patches_of`], active towards the
    /// inside, with all that stands in the way. Closed where `whole` is; surfaces keep their names, patches have one
    /// each.
    pub fn local(&self, whole: &Enclosure, region: u32) -> Enclosure {
        let mut local = Enclosure { title: whole.title.clone(), is_closed: whole.is_closed, ..Enclosure::default() };
        local.surfaces.clone_from(&whole.surfaces);
        for (i, piece) in self.pieces.iter().enumerate().filter(|(i, _)| self.region_of[*i] == region) {
            local.facets.push(piece.clone());
            local.surface_of.push(whole.surface_of[self.facet_of[i] as usize]);
        }
        for k in self.patches_of(region) {
            let patch = &self.patches[k as usize];
            let is_first = self.sides[k as usize][0] == region;
            local.add(format!("boundary {k}"), if is_first { patch.flipped() } else { patch.clone() });
        }
        let own = self.blockers.iter().zip(&self.blocker_of).filter(|(_, of)| **of == region);
        local.obstructions = own.map(|(blocker, _)| blocker.clone()).collect();
        local
    }
}

/// Finds the regions of an enclosure. Takes some n log n for n facets in rooms of a size.
pub fn regions(enclosure: &Enclosure, options: &RegionOptions) -> Regions {
    let Some(bounds) = enclosure.bounds() else { return Regions::default() };
    if enclosure.facets.is_empty() {
        return Regions::default();
    }
    let areas: f64 = enclosure.facets.iter().map(Facet::area).sum();
    let mean = (areas / enclosure.facets.len() as f64).sqrt();
    let size = options.patch.filter(|size| *size > 0.0).unwrap_or(mean);
    let space = Space::new(enclosure, bounds, TOUCH * bounds[0].distance(bounds[1]));
    let partition = partition(enclosure, &space, size, options.most_open);
    let mut cells = vec![Content::default(); partition.ids as usize];
    for leaf in &partition.leaves {
        let cell = &mut cells[leaf.id as usize];
        for piece in &leaf.pieces {
            // By area, so that the parts of a facet count as one when they come together.
            let area = polygon::area(&piece.corners);
            cell.elements += area / enclosure.facets[piece.facet as usize].area();
            cell.area += area;
        }
    }
    let region_of_cell = merge(cells, &partition.borders(size));
    finish(enclosure, partition, &region_of_cell, size, space.touch)
}
