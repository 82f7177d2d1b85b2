//! View factors of an enclosure: the default way, chosen pair by pair.
//!
//! Pairs are judged in clusters first (`walk`, `cluster`, `shaft`): facing away, proven blocked, proven clear, or mixed. Clear
//! ones take cubature or the closed form (`clear`); mixed ones the exact visible factor from points of one part, which two
//! leaves share (`gallery`, `lattice`), and where those do not suffice from points that are chosen for the pair (`mixed`,
//! `visible`). The exchange area A_i F_ij is stored once per pair, so
//! reciprocity holds by storage; what the rows lack of one is therefore an honest measure of the error, and is reported before
//! any repair (`closure`). Surfaces of very many facets send rays instead (`surfaces`).

mod adaptive;
mod body;
mod cell;
mod clear;
mod closure;
mod cluster;
mod contact;
mod frame;
mod gallery;
mod lattice;
mod mixed;
mod moments;
mod panel;
mod part;
mod shaft;
mod sides;
mod solid;
mod store;
mod surfaces;
mod visible;
mod walk;

pub(crate) use clear::Exchange;
pub use closure::{Closure, Repair};
pub(crate) use store::Entry;
pub use store::ViewFactors;
pub use surfaces::surface_factors;

use crate::row::GpuError;
use crate::{Progress, Stopped};
use cell::Sights;
use cluster::{Clusters, LEAF};
use contact::exposed;
use gallery::Kept;
pub(crate) use panel::{Planes, convex_pieces, panels, united};
use part::Part;
use radiosity_scene::{Enclosure, Facet};
use rayon::prelude::*;
use serde::Serialize;
use solid::find_solids;
use std::sync::atomic::{AtomicUsize, Ordering};
use visible::Shadows;
use walk::Walk;

/// How exact the factors are to be, and what they may take.
#[derive(Clone, Copy, Debug)]
pub struct ViewFactorOptions {
    /// Bound asked for the error of F_ij between surfaces that see each other partly. Pairs of facets of such surfaces share it
    /// in squares, as their errors hardly add up. Where many take all of their share it may be missed, which the stated errors tell.
    pub accuracy: f64,
    /// The same for those that see each other whole.
    pub clear_accuracy: f64,
    /// Most bytes that may be taken.
    pub memory: usize,
}

/// Why there are no factors.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FactorError {
    /// The run was stopped.
    #[error("stopped on request")]
    Stopped,
    /// The memory allowed does not suffice.
    #[error(
        "the form factors of {facets} facets take more than the {} allowed (allow more, or use fewer facets)",
        radiosity_scene::size(*allowed)
    )]
    Memory {
        /// Facets.
        facets: usize,
        /// Bytes allowed.
        allowed: usize,
    },
    /// Graphics hardware draws nothing.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

impl From<Stopped> for FactorError {
    fn from(_: Stopped) -> FactorError {
        FactorError::Stopped
    }
}

impl Default for ViewFactorOptions {
    /// Errors of single factors are independent, so a row of some hundred partly blocked ones sums to one within a few
    /// times 10⁻⁵.
    fn default() -> Self {
        ViewFactorOptions { accuracy: 1e-5, clear_accuracy: 1e-9, memory: 4 << 30 }
    }
}

/// How many pairs of facet parts went which way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Choices {
    /// Neither faces the other.
    pub facing_away: usize,
    /// Proven blocked.
    pub blocked: usize,
    /// Proven clear, by moments, and by cubature of two to four points along an edge.
    pub clear_cubature: [usize; 4],
    /// Proven clear, closed form.
    pub clear_closed_form: usize,
    /// Mixed, found by cutting panels out.
    pub clipped: usize,
    /// Rays, where there were no pairs of facets but rays from all over surfaces.
    pub rays: usize,
}

impl Choices {
    fn add(&mut self, other: &Choices) {
        self.facing_away += other.facing_away;
        self.blocked += other.blocked;
        for (own, other) in self.clear_cubature.iter_mut().zip(other.clear_cubature) {
            *own += other;
        }
        self.clear_closed_form += other.clear_closed_form;
        self.clipped += other.clipped;
        self.rays += other.rays;
    }

    /// All pairs.
    pub fn total(&self) -> usize {
        let cubature: usize = self.clear_cubature.iter().sum();
        self.facing_away + self.blocked + cubature + self.clear_closed_form + self.clipped
    }
}

/// Distance below which points lie on a plane, relative to the diagonal of the scene: what single precision leaves of
/// coordinates. Sheets closer than this block each other no more.
pub(crate) const TOUCH: f64 = 5e-7;

/// Bytes that a pair takes at most: stored once, and beside it once in each direction ([`ViewFactors::csr`]).
const BYTES: usize = 3 * size_of::<(u32, f32, f64)>();

/// Parts of a block at most: one task, and the pairs that share the first look at the panels.
const BLOCK: usize = 32;

/// Blocks of few parts, at least: what is asked of some takes far longer than what is of others.
const BLOCKS: usize = 24;

/// The view factors between all facets of an enclosure.
///
/// # Errors
/// [`FactorError::Stopped`] if `progress` says so; [`FactorError::Memory`] as soon as the pairs found so far take too much.
pub fn view_factors(
    enclosure: &Enclosure,
    options: &ViewFactorOptions,
    progress: &dyn Progress,
) -> Result<ViewFactors, FactorError> {
    let areas: Vec<f64> = enclosure.facets.iter().map(Facet::area).collect();
    let Some([low, high]) = enclosure.bounds() else { return Ok(ViewFactors::default()) };
    let extent = high.distance(low);
    let touch = TOUCH * extent;
    let mut planes = Planes::new(extent, touch);
    let mut panels = panels(enclosure, &mut planes);
    let solids = find_solids(&mut panels, touch);
    let exposed = exposed(enclosure, &mut planes, touch);
    let parts_of = |(i, facet): (usize, &Facet)| match &exposed[i] {
        None => Part::of(i as u32, facet),
        Some(pieces) => pieces.iter().flat_map(|piece| Part::of(i as u32, piece)).collect(),
    };
    let parts = enclosure.facets.iter().enumerate().flat_map(parts_of).collect();
    let clusters = Clusters::new(parts, &mut planes);
    let blocks = clusters.blocks(BLOCK.min(clusters.parts.len() / BLOCKS).max(LEAF));
    let (done, found) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let of_surfaces = enclosure.surface_areas();
    let too_much = FactorError::Memory { facets: enclosure.facets.len(), allowed: options.memory };
    let work = |block: &u32| {
        let mut walk = Walk {
            enclosure,
            areas: &of_surfaces,
            clusters: &clusters,
            panels: &panels,
            solids: &solids,
            options,
            touch,
            shadows: Shadows::default(),
            sights: Sights::default(),
            kept: Kept::default(),
            choices: Choices::default(),
            entries: Vec::new(),
        };
        if let Some(root) = clusters.root() {
            let all: Vec<u32> = (0..panels.len() as u32).collect();
            walk.visit(*block, root, &all);
        }
        let so_far = found.fetch_add(walk.entries.len(), Ordering::Relaxed) + walk.entries.len();
        if so_far.saturating_mul(BYTES) > options.memory {
            return Err(too_much.clone());
        }
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        progress.step(done, blocks.len()).then_some((walk.entries, walk.choices)).ok_or(FactorError::Stopped)
    };
    let found: Vec<(Vec<Entry>, Choices)> = blocks.par_iter().map(work).collect::<Result<_, _>>()?;
    let mut choices = Choices::default();
    found.iter().for_each(|(_, c)| choices.add(c));
    Ok(ViewFactors::new(areas, found.into_iter().map(|(entries, _)| entries), choices))
}
