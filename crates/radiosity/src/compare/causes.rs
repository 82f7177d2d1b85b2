//! What a contender got wrong, from its numbers: between which facets its error lies, and the worst spot.
//!
//! The squared error of the light that i receives from j, A_i (ΔF_ij L_j)², is counted to the first that holds:
//! *rim*, what is so low above i that the method does not look there; *near*, j begins nearer to i's centre than i is
//! wide, so that the centre cannot stand for all of it (proximity); *hidden*, something stands between, in part or
//! wholly; *small*, j has fewer than 32 cells or rays (aliasing, noise); *rest*.

use super::difference::each_pair;
use super::problem::{Problem, bright};
use super::reference::Reference;
use glam::DVec3;
use radiosity_transport::FormFactors;
use rayon::prelude::*;
use serde::Serialize;

/// Cells or rays below which a facet's outline is coarse.
const FEW: f64 = 32.0;

/// Light against the mean that relative differences are relative to at least.
const DARK: f64 = 0.01;

/// Shares of the squared error of light, of the pairs, and of the squared error of factors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Causes {
    /// Below the rim of the projection surface.
    pub rim: [f64; 3],
    /// Nearer than the receiver is wide.
    pub near: [f64; 3],
    /// Something stands between.
    pub hidden: [f64; 3],
    /// Fewer than 32 cells or rays.
    pub small: [f64; 3],
    /// None of these.
    pub rest: [f64; 3],
}

impl Causes {
    /// Name and shares; the largest of the error of light first.
    pub fn ranked(&self) -> [(&'static str, [f64; 3]); 5] {
        let mut all = [
            ("rim", self.rim),
            ("near", self.near),
            ("hidden", self.hidden),
            ("small", self.small),
            ("rest", self.rest),
        ];
        all.sort_by(|a, b| b.1[0].total_cmp(&a.1[0]));
        all
    }
}

/// The worst element and the facet from which most of its error comes.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Wrong {
    /// Shares of the squared error of the light and of the pairs, by cause.
    pub causes: Causes,
    /// The element with the largest part of the squared error of illuminance by area.
    pub element: usize,
    /// The object it is a part of.
    pub object: String,
    /// Its centre, metres.
    pub centre: [f64; 3],
    /// (H − H*)/H* there.
    pub relative: f64,
    /// The object of the facet from which most of that comes.
    pub from_object: String,
    /// F to that facet, as found and exactly.
    pub factors: [f64; 2],
    /// From the element's centre to where that facet begins, in widths of the element.
    pub distance_in_widths: f64,
    /// Rays or cells that the facet should have had, where they are counted.
    pub samples: Option<f64>,
    /// The worst pair of facets that share an edge.
    pub corner: Option<Corner>,
}

/// A facet as another sees it with which it shares an edge.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Corner {
    /// The object of the facet that looks, and that of the one that it sees.
    pub objects: [String; 2],
    /// The middle of the one that looks, metres.
    pub centre: [f64; 3],
    /// F between them, as found and exactly.
    pub factors: [f64; 2],
}

/// The pair with a common edge that sees each other whole and whose factor is off by most; none where facets share no
/// edges.
fn worst_corner(factors: &FormFactors, problem: &Problem, reference: &Reference) -> Option<Corner> {
    let clear = clear_error(reference);
    let row = |i: usize| {
        let mut worst: Option<(f64, usize, usize, [f64; 2])> = None;
        each_pair(factors, &reference.factors, i, |j, [value, _], [truth, own]| {
            let off = (value - truth).abs();
            let is_clear = truth > 0.0 && own * problem.area[i] <= clear * problem.area[i].min(problem.area[j]);
            if is_clear && worst.is_none_or(|worst| off > worst.0) && share_edge(problem, i, j) {
                worst = Some((off, i, j, [value, truth]));
            }
        });
        worst
    };
    let rows: Vec<_> = (0..problem.len()).into_par_iter().filter_map(row).collect();
    let first_of_worst =
        |a: (f64, usize, usize, [f64; 2]), b: (f64, usize, usize, [f64; 2])| if b.0 > a.0 { b } else { a };
    let (_, i, j, factors) = rows.into_iter().reduce(first_of_worst)?;
    let centre = problem.enclosure.facets[i].centroid().to_array();
    Some(Corner { objects: [problem.object(i), problem.object(j)], centre, factors })
}

/// Distance, in widths of a facet, at which corners are one.
const SAME: f64 = 1e-5;

/// Whether two corners of a facet are corners of the other.
fn share_edge(problem: &Problem, i: usize, j: usize) -> bool {
    let (a, b) = (&problem.enclosure.facets[i], &problem.enclosure.facets[j]);
    let near = SAME * problem.area[i].sqrt();
    let is_shared = |corner: &&DVec3| b.corners().iter().any(|other| corner.distance(*other) <= near);
    a.corners().iter().filter(is_shared).count() >= 2
}

/// Compares rows and light with the exact ones.
pub(super) fn wrong(
    factors: &FormFactors,
    irradiance: &[[f64; 3]],
    samples: Option<usize>,
    problem: &Problem,
    reference: &Reference,
) -> Wrong {
    let exact = &reference.factors;
    let light: Vec<f64> = (0..problem.len()).map(|j| luminous(&reference.radiosity, j)).collect();
    let sums: Vec<[[f64; 3]; 5]> =
        (0..problem.len()).into_par_iter().map(|i| shares(i, factors, samples, (problem, reference), &light)).collect();
    let mut total = [[0.0; 3]; 5];
    for row in &sums {
        for (total, row) in total.iter_mut().zip(row) {
            (0..3).for_each(|k| total[k] += row[k]);
        }
    }
    let all = [0, 1, 2].map(|k| total.iter().map(|cause| cause[k]).sum::<f64>().max(f64::MIN_POSITIVE));
    let [rim, near, hidden, small, rest] = total.map(|cause| [0, 1, 2].map(|k| cause[k] / all[k]));

    // The worst element, and what it gets wrong most light from.
    let off = |i: usize| bright(irradiance[i]) - bright(reference.irradiance[i]);
    let part = |i: usize| problem.area[i] * off(i).powi(2);
    let worst = (0..problem.len()).fold(0, |worst, i| if part(i) > part(worst) { i } else { worst });
    let (mut most, mut from, mut pair) = (-1.0, worst, [0.0; 2]);
    each_pair(factors, exact, worst, |j, [value, _], [truth, _]| {
        let lost = ((value - truth) * light[j]).abs();
        if lost > most {
            (most, from, pair) = (lost, j, [value, truth]);
        }
    });
    let centre = problem.enclosure.facets[worst].centroid();
    Wrong {
        causes: Causes { rim, near, hidden, small, rest },
        element: worst,
        object: problem.object(worst),
        centre: centre.to_array(),
        relative: off(worst) / bright(reference.irradiance[worst]).max(DARK * reference.account.mean_illuminance),
        from_object: problem.object(from),
        factors: pair,
        distance_in_widths: gap(problem, worst, from),
        samples: samples.map(|m| pair[1] * m as f64),
        corner: worst_corner(factors, problem, reference),
    }
}

fn luminous(b: &[f64], i: usize) -> f64 {
    bright([b[3 * i], b[3 * i + 1], b[3 * i + 2]])
}

/// From the centre of i to where j begins, in widths of i.
fn gap(problem: &Problem, i: usize, j: usize) -> f64 {
    let facets = &problem.enclosure.facets;
    let centre = facets[i].centroid();
    let corners = facets[j].corners();
    let nearest = facets[j].edges().map(|[a, b]| to_segment(centre, a, b)).fold(f64::INFINITY, f64::min);
    let inside = facets[j].height(centre).abs();
    // Right above it, its plane is nearer than its edges.
    let foot = centre - facets[j].height(centre) * facets[j].normal();
    let is_above = corners
        .iter()
        .zip(corners.iter().cycle().skip(1))
        .all(|(a, b)| (*b - *a).cross(foot - *a).dot(facets[j].normal()) >= 0.0);
    (if is_above { inside } else { nearest }) / problem.area[i].sqrt()
}

fn to_segment(point: DVec3, a: DVec3, b: DVec3) -> f64 {
    let along = ((point - a).dot(b - a) / (b - a).length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    point.distance(a + along * (b - a))
}

/// Error of an exact factor, from the smaller facet, up to which nothing hides a part: ten times what is asked of such pairs.
fn clear_error(reference: &Reference) -> f64 {
    10.0 * 1e-4 * reference.account.accuracy
}

/// Squared error of light, number of pairs and squared error of factors of row i by cause.
fn shares(
    i: usize,
    factors: &FormFactors,
    samples: Option<usize>,
    (problem, reference): (&Problem, &Reference),
    light: &[f64],
) -> [[f64; 3]; 5] {
    let facets = &problem.enclosure.facets;
    let (normal, centre) = (facets[i].normal(), facets[i].centroid());
    // sin² of the height of a round rim that captures as much.
    let rim = 1.0 - factors.captured.get(i).copied().unwrap_or(1.0);
    let cut = clear_error(reference);
    let mut sums = [[0.0; 3]; 5];
    each_pair(factors, &reference.factors, i, |j, [value, _], [truth, own]| {
        let towards = (facets[j].centroid() - centre).normalize_or_zero();
        let is_low = rim > 1e-3 && towards.dot(normal).powi(2) < rim;
        let is_near = || gap(problem, i, j) < 1.0;
        // What nothing hides is known far better than what is cut out.
        let is_hidden = || truth == 0.0 || own * problem.area[i] > cut * problem.area[i].min(problem.area[j]);
        let is_small = || samples.is_some_and(|m| truth * (m as f64) < FEW);
        let cause = match () {
            () if is_low => 0,
            () if is_near() => 1,
            () if is_hidden() => 2,
            () if is_small() => 3,
            () => 4,
        };
        sums[cause][0] += problem.area[i] * ((value - truth) * light[j]).powi(2);
        sums[cause][1] += 1.0;
        sums[cause][2] += (value - truth).powi(2);
    });
    sums
}
