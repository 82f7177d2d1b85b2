//! View factors of an enclosure: the default way, chosen pair by pair.
//!
//! Pairs are judged in clusters first (`cluster`, `shaft`): facing away, proven blocked, proven clear, or mixed. Clear
//! ones take cubature or the closed form (`clear`); mixed ones the exact visible factor from points of one part (`mixed`,
//! `visible`). The exchange area A_i F_ij is stored once per pair, so reciprocity holds by storage; what the rows lack
//! of one is therefore an honest measure of the error, and is reported before any repair (`closure`).

mod adaptive;
mod body;
mod cell;
mod clear;
mod closure;
mod cluster;
mod frame;
mod mixed;
mod panel;
mod part;
mod shaft;
mod sides;
mod solid;
mod store;
mod visible;

pub(crate) use clear::Exchange;
pub use closure::{Closure, Repair};
pub(crate) use store::Entry;
pub use store::ViewFactors;

use crate::row::GpuError;
use crate::{Progress, Stopped};
use clear::clear;
use cluster::Clusters;
use mixed::mixed;
use panel::Panel;
pub(crate) use panel::{Planes, convex_pieces, panels, united};
use part::Part;
use radiosity_scene::{Enclosure, Facet};
use rayon::prelude::*;
use serde::Serialize;
use shaft::{Look, Shaft, Stands};
use solid::{Obstacles, Solid, find_solids};
use std::sync::atomic::{AtomicUsize, Ordering};
use visible::Shadows;

/// How exact the factors are to be, and what they may take.
#[derive(Clone, Copy, Debug)]
pub struct ViewFactorOptions {
    /// Bound asked for the error of F_ij between surfaces that see each other partly. A surface of many facets may miss it
    /// by a little, as no pair of facets is asked for less than a tenth of it.
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
    /// Proven clear, cubature of one to four points along an edge.
    pub clear_cubature: [usize; 4],
    /// Proven clear, closed form.
    pub clear_closed_form: usize,
    /// Mixed, found by cutting panels out.
    pub clipped: usize,
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

/// Error of the unoccluded factor relative to that of the visible one, where it only serves to find that.
const WHOLE: f64 = 0.05;

/// Least share of the accuracy that a pair of facets is asked for, where surfaces have many: their errors hardly add
/// up.
const LEAST: f64 = 0.1;

/// Bytes that a pair takes at most, while it is found and put in order.
const BYTES: usize = 2 * size_of::<Entry>();

/// Parts of a block: one task, and the pairs that share the first look at the panels.
const BLOCK: usize = 32;

/// The view factors between all facets of an enclosure.
///
/// # Errors
/// [`FactorError::Stopped`] if `progress` says so; [`FactorError::Memory`] as soon as the pairs found so far take too much.
pub fn view_factors(
    enclosure: &Enclosure,
    options: &ViewFactorOptions,
    progress: &impl Progress,
) -> Result<ViewFactors, FactorError> {
    let areas: Vec<f64> = enclosure.facets.iter().map(radiosity_scene::Facet::area).collect();
    let Some([low, high]) = enclosure.bounds() else { return Ok(ViewFactors::default()) };
    let extent = high.distance(low);
    let touch = TOUCH * extent;
    let mut planes = Planes::new(extent, touch);
    let mut panels = panels(enclosure, &mut planes);
    let solids = find_solids(&mut panels, touch);
    let parts = enclosure.facets.iter().enumerate().flat_map(|(i, facet)| Part::of(i as u32, facet)).collect();
    let clusters = Clusters::new(parts, &mut planes);
    let blocks = clusters.blocks(BLOCK);
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

/// One block of parts on its way through the tree.
struct Walk<'a> {
    enclosure: &'a Enclosure,
    /// Areas of the surfaces, m².
    areas: &'a [f64],
    clusters: &'a Clusters,
    panels: &'a [Panel],
    solids: &'a [Solid],
    options: &'a ViewFactorOptions,
    touch: f64,
    shadows: Shadows,
    choices: Choices,
    entries: Vec<Entry>,
}

impl Walk<'_> {
    /// All pairs of parts of `a` with later ones of `b`, past the panels `between`.
    fn visit(&mut self, a: u32, b: u32, between: &[u32]) {
        let (from, to) = (&self.clusters.nodes[a as usize], &self.clusters.nodes[b as usize]);
        // Every pair once: the second part comes after the first.
        if to.parts.end <= from.parts.start + 1 {
            return;
        }
        let pairs = || pairs(from.parts.clone(), to.parts.clone());
        let behind = |plane: &Option<(glam::DVec3, f64)>, hull: &[glam::DVec3]| {
            plane.is_some_and(|(normal, offset)| hull.iter().all(|c| normal.dot(*c) - offset <= self.touch))
        };
        if behind(&from.plane, &to.hull) || behind(&to.plane, &from.hull) {
            self.choices.facing_away += pairs();
            return;
        }
        let mut left: Vec<u32> = Vec::with_capacity(between.len());
        let normals = [from, to].map(|cluster| cluster.plane.map_or(glam::DVec3::ZERO, |(normal, _)| normal));
        let mut shaft = Shaft::new([&from.hull, &to.hull], normals, self.touch);
        for &panel in between {
            let corners = &self.panels[panel as usize];
            if behind(&from.plane, &corners.corners) || behind(&to.plane, &corners.corners) {
                continue;
            }
            match shaft.stands(corners, Look::Rough) {
                Stands::Aside => {}
                Stands::Between => left.push(panel),
                Stands::Across => {
                    self.choices.blocked += pairs();
                    return;
                }
            }
        }
        match (from.halves, to.halves) {
            (None, None) => self.parts(from.parts.clone(), to.parts.clone(), &left),
            (Some(halves), other) if other.is_none() || from.extent > to.extent => {
                halves.into_iter().for_each(|half| self.visit(half, b, &left));
            }
            (_, Some(halves)) => halves.into_iter().for_each(|half| self.visit(a, half, &left)),
            (Some(_), None) => {}
        }
    }

    fn parts(&mut self, from: std::ops::Range<usize>, to: std::ops::Range<usize>, between: &[u32]) {
        for i in from {
            for j in to.clone().filter(|j| *j > i) {
                self.pair(i, j, between);
            }
        }
    }

    /// Error of A_i F_ij that two parts may have: their share of what their surfaces may, m².
    fn tolerance(&self, a: &Part, b: &Part) -> f64 {
        let (area, other) = (a.shape.area(), b.shape.area());
        let [i, j] = [a, b].map(|part| self.enclosure.surface_of[part.facet as usize]);
        let of_surface = self.areas[i as usize].max(self.areas[j as usize]);
        let times = if i == j { 2.0 } else { 1.0 };
        self.options.accuracy * (area * other / (times * of_surface)).max(LEAST * area.min(other))
    }

    fn pair(&mut self, i: usize, j: usize, between: &[u32]) {
        let (a, b) = (&self.clusters.parts[i], &self.clusters.parts[j]);
        let reach = |part: &Part, other: &Part| {
            let heights = other.shape.corners().iter().map(|c| part.shape.height(*c));
            heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| (low.min(h), high.max(h)))
        };
        let ((low_b, high_b), (low_a, high_a)) = (reach(a, b), reach(b, a));
        if high_a <= self.touch || high_b <= self.touch {
            self.choices.facing_away += 1;
            return;
        }
        let cut = low_a < -self.touch || low_b < -self.touch;
        let mut panels: Vec<&Panel> = Vec::new();
        let ends = [&a.shape, &b.shape];
        let mut shaft = Shaft::new(ends.map(Facet::corners), ends.map(Facet::normal), self.touch);
        for &panel in between {
            let panel = &self.panels[panel as usize];
            let behind = |part: &Part| panel.corners.iter().all(|c| part.shape.height(*c) <= self.touch);
            if behind(a) || behind(b) {
                continue;
            }
            match shaft.stands(panel, Look::Close) {
                Stands::Aside => {}
                Stands::Between => panels.push(panel),
                Stands::Across => {
                    self.choices.blocked += 1;
                    return;
                }
            }
        }
        let least = a.shape.area().min(b.shape.area());
        let tolerance = self.tolerance(a, b);
        // Past panels the whole is asked for little more exactly than what is left of it.
        let of_whole = if panels.is_empty() { self.options.clear_accuracy * least } else { WHOLE * tolerance };
        let (whole, order) = clear(a, b, of_whole, cut);
        let exchange = if panels.is_empty() {
            match order {
                0 => self.choices.clear_closed_form += 1,
                order => self.choices.clear_cubature[order - 1] += 1,
            }
            whole
        } else {
            self.choices.clipped += 1;
            let obstacles = Obstacles { panels: self.panels, solids: self.solids };
            let tolerance = (tolerance - whole.error).max(0.5 * tolerance);
            mixed(&mut self.shadows, [a, b], (&mut panels, obstacles), whole, tolerance, self.touch)
        };
        if exchange.value > 0.0 || exchange.error > 0.0 {
            self.entries.push(Entry::new(a.facet, b.facet, exchange));
        }
    }
}

/// Pairs (i, j) with i < j from two ranges, of which the first is not after the second.
fn pairs(from: std::ops::Range<usize>, to: std::ops::Range<usize>) -> usize {
    from.map(|i| to.end.saturating_sub(to.start.max(i + 1))).sum()
}
