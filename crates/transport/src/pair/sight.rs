//! Whether two facets see each other wholly, in part or not at all (catalogue 18), by segments between a few points of
//! each: the centroid and points near the corners. Segments that agree say "wholly" or "not at all" only as far as so
//! many segments can; a method that builds on them adds that doubt to its error.

use super::{Factor, Occlusion};
use glam::DVec3;
use radiosity_scene::Facet;

/// How far towards the corners the points lie: near enough to see shadows that come in over an edge, and inside.
const TOWARDS: f64 = 0.98;

/// Most corners probed of a facet.
const CORNERS: usize = 8;

/// Events that 95 % of trials would show once where none was seen, times the trials (the "rule of three").
const UNSEEN: f64 = 3.0;

/// The factor of a pair, from what it would be with nothing between and the visible share that the method saw.
pub fn obstructed(free: Factor, share: f64, from: &Facet, to: &Facet, occlusion: &dyn Occlusion) -> Factor {
    // Shares cut out of polygons are rounded.
    let share = if share > 1.0 - 1e-12 { 1.0 } else { share };
    let value = share * free.value;
    let (clear, count) = probe(from, to, occlusion);
    let most = free.value + free.error;
    let doubt = UNSEEN / count as f64;
    let error = if clear == count && share == 1.0 {
        free.error + doubt * value
    } else if clear == 0 && share == 0.0 {
        doubt * most
    } else {
        // In part: anything from nothing to the whole.
        value.max(most - value)
    };
    Factor { value, error }
}

/// How many segments are clear, of how many.
fn probe(from: &Facet, to: &Facet, occlusion: &dyn Occlusion) -> (usize, usize) {
    let points = |facet: &Facet| -> Vec<DVec3> {
        let step = facet.corners().len().div_ceil(CORNERS);
        let corners = facet.corners().iter().step_by(step).map(|c| facet.centroid().lerp(*c, TOWARDS));
        std::iter::once(facet.centroid()).chain(corners).collect()
    };
    let (of_from, of_to) = (points(from), points(to));
    let clear = of_from.iter().map(|p| of_to.iter().filter(|q| occlusion.is_clear(*p, **q)).count()).sum();
    (clear, of_from.len() * of_to.len())
}
