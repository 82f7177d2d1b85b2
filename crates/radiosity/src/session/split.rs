//! Parts of a cut element that are split along the edge of a shadow.
//!
//! Between places that see a lamp and places that do not lies the edge. It is found along each line from one to the other by halving, and parts
//! are split from one crossing to the next, with light of its own on either side: straight edges are straight. Light that ran evenly from place to place
//! had teeth as wide as a part. (Discontinuity meshing, by what places see and not by geometry: Heckbert 1992, "Discontinuity
//! meshing for radiosity"; Lischinski, Tampieri and Greenberg 1992.)

use super::lattice::{between, place, places, places_of};
use radiosity_scene::Bands;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Halvings of a line between two places.
const HALVINGS: u32 = 7;

/// How far from a crossing it is certain on which side one is, in lengths of the line.
const NEAR: f32 = 0.01;

/// Ways from a place to those after it.
const WAYS: [[i32; 2]; 3] = [[1, 0], [0, 1], [-1, 1]];

/// An element that is cut for display.
#[derive(Clone, Debug, PartialEq)]
pub struct CutElement {
    /// The element of its object.
    pub element: u32,
    /// Parts along each of its sides, before they are split.
    pub parts: u32,
    /// Where the edge of a shadow goes, if it is a sharp one.
    pub edge: Option<Arc<Edge>>,
}

/// The edge of a shadow among the places of an element.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Whether each place sees the lamp.
    pub is_lit: Vec<bool>,
    /// Where the edge crosses the lines on which it does, from 0 at the first of their places to 1: for each place in turn those to
    /// (i + 1, j), (i, j + 1) and (i − 1, j + 1).
    pub shares: Vec<f32>,
}

impl Edge {
    /// What the places of an element have, each by itself: what some see around themselves is beyond the edge.
    pub(super) fn values(&self, parts: u32, at: impl Fn([f32; 2]) -> Bands) -> Vec<Bands> {
        let all: Vec<[f32; 2]> = places(parts).collect();
        let beside = crossings(parts, Some(self)).flat_map(|([a, b], share)| {
            // As near to the edge as it was looked for, and safely on one side of it.
            let sides = [share - NEAR, share + NEAR].map(|share| share.clamp(0.0, 1.0));
            sides.map(|share| [0, 1].map(|k| all[a][k] + share * (all[b][k] - all[a][k])))
        });
        all.iter().copied().chain(beside).map(at).collect()
    }
}

impl CutElement {
    /// Weights of the corners 1 and 2 at all places: with n parts i/n and j/n, j from 0 to n and for each i from 0 to n − j; and after these two for each
    /// crossing of an edge, on the side of the line's first place and on the other.
    pub fn places(&self) -> Vec<[f32; 2]> {
        let mut all: Vec<[f32; 2]> = places(self.parts).collect();
        for ([a, b], share) in crossings(self.parts, self.edge.as_deref()) {
            let at = [0, 1].map(|k| all[a][k] + share * (all[b][k] - all[a][k]));
            all.extend([at; 2]);
        }
        all
    }

    /// The parts, as triples of places.
    pub fn triangles(&self) -> Vec<[usize; 3]> {
        let whole = triangles(self.parts);
        let Some(edge) = &self.edge else { return whole.collect() };
        let first = places_of(self.parts);
        let crossings = crossings(self.parts, Some(edge));
        let known: BTreeMap<[usize; 2], usize> =
            crossings.enumerate().map(|(m, (ends, _))| (ends, first + 2 * m)).collect();
        // The place on a line to another place where it meets the edge, on its own side.
        let near = |from: usize, to: usize| known[&[from.min(to), from.max(to)]] + usize::from(from > to);
        let split = |[a, b, c]: [usize; 3]| {
            let [p, q, r] = [a, b, c].map(|place| edge.is_lit[place]);
            // Of three places one is unlike the others.
            let (a, b, c) = match (p == q, q == r) {
                (true, true) => return vec![[a, b, c]],
                (false, true) => (a, b, c),
                (true, false) => (c, a, b),
                (false, false) => (b, c, a),
            };
            vec![[a, near(a, b), near(a, c)], [near(b, a), b, c], [near(b, a), c, near(c, a)]]
        };
        whole.flat_map(split).collect()
    }

    /// What is at a place between its own.
    pub(super) fn between(&self, known: &[Bands], uv: [f32; 2]) -> Bands {
        if self.edge.is_none() {
            return between(self.parts, known, uv);
        }
        let all = self.places();
        let across = |[a, b, c]: [[f32; 2]; 3]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let within = |corners: [usize; 3]| {
            let [a, b, c] = corners.map(|place| all[place]);
            let area = across([a, b, c]);
            let weights = [across([uv, b, c]), across([a, uv, c]), across([a, b, uv])].map(|weight| weight / area);
            let least = weights[0].min(weights[1]).min(weights[2]);
            (area > 0.0).then_some((least, corners, weights.map(|weight| weight.max(0.0))))
        };
        // The part that has it most within.
        let found = self.triangles().into_iter().filter_map(within).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, corners, weights)) = found else { return [0.0; 3] };
        let whole: f32 = weights.iter().sum();
        std::array::from_fn(|band| (0..3).map(|k| weights[k] / whole * known[corners[k]][band]).sum())
    }
}

/// Lines between places next to each other, as their first and last place.
fn lines(parts: u32) -> impl Iterator<Item = [usize; 2]> {
    let n = parts as i32;
    let all = (0..=n).flat_map(move |j| (0..=n - j).map(move |i| [i, j]));
    all.flat_map(move |[i, j]| {
        let ends = WAYS.map(|[x, y]| [i + x, j + y]).into_iter().filter(move |[i, j]| *i >= 0 && i + j <= n);
        ends.map(move |to| [[i, j], to].map(|[i, j]| place(parts, i as usize, j as usize)))
    })
}

/// The lines that an edge crosses, and where.
fn crossings(parts: u32, edge: Option<&Edge>) -> impl Iterator<Item = ([usize; 2], f32)> {
    edge.into_iter().flat_map(move |edge| {
        let crossed = lines(parts).filter(|[a, b]| edge.is_lit[*a] != edge.is_lit[*b]);
        crossed.zip(edge.shares.iter().copied())
    })
}

/// The parts as they are before they are split, as triples of places.
fn triangles(parts: u32) -> impl Iterator<Item = [usize; 3]> {
    let n = parts as usize;
    let of = move |i: usize, j: usize| {
        let [here, right, above] = [(i, j), (i + 1, j), (i, j + 1)].map(|(i, j)| place(parts, i, j));
        let upper = (i + j + 2 <= n).then(|| [right, place(parts, i + 1, j + 1), above]);
        [Some([here, right, above]), upper].into_iter().flatten()
    };
    (0..n).flat_map(move |j| (0..n - j).flat_map(move |i| of(i, j)))
}

/// Where the edge of a shadow goes: `sees` tells it of places. None where all places see the same.
pub fn find_edge(parts: u32, sees: impl Fn([f32; 2]) -> bool) -> Option<Edge> {
    let all: Vec<[f32; 2]> = places(parts).collect();
    let is_lit: Vec<bool> = all.iter().map(|uv| sees(*uv)).collect();
    let cross = |[a, b]: [usize; 2]| {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            let there = [0, 1].map(|k| all[a][k] + middle * (all[b][k] - all[a][k]));
            if sees(there) == is_lit[a] { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    };
    let shares: Vec<f32> = lines(parts).filter(|[a, b]| is_lit[*a] != is_lit[*b]).map(cross).collect();
    (!shares.is_empty()).then_some(Edge { is_lit, shares })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area([a, b, c]: [[f32; 2]; 3]) -> f32 {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    /// The edge of a half plane is where it is, whatever its direction: all but next to nothing of the element is in the light or in the shadow
    /// as it should be, and no part is turned over.
    #[test]
    fn a_straight_edge_is_straight() {
        for k in 0..30 {
            let angle = 0.21 * k as f32;
            let height = |[v, w]: [f32; 2]| (v - 0.31) * angle.cos() + (w - 0.27) * angle.sin();
            let edge = find_edge(16, |uv| height(uv) > 0.0);
            let cut = CutElement { element: 0, parts: 16, edge: edge.map(Arc::new) };
            let edge = cut.edge.as_deref().unwrap();
            let (places, triangles) = (cut.places(), cut.triangles());
            let whole: f32 = triangles.iter().map(|corners| area(corners.map(|place| places[place]))).sum();
            assert!((whole - 1.0).abs() < 1e-4, "{whole}");
            assert!(triangles.iter().all(|corners| area(corners.map(|place| places[place])) >= -1e-6));
            // Light by place: that of a crossing is that of its side.
            let mut light: Vec<Bands> = edge.is_lit.iter().map(|is_lit| [f32::from(*is_lit); 3]).collect();
            for ([a, b], _) in crossings(16, Some(edge)) {
                light.extend([light[a], light[b]]);
            }
            assert_eq!(light.len(), places.len());
            for i in 0..50 {
                for j in 0..50 - i {
                    let uv = [(i as f32 + 0.3) / 50.0, (j as f32 + 0.3) / 50.0];
                    let wanted = f32::from(height(uv) > 0.0);
                    let off = (cut.between(&light, uv)[0] - wanted).abs();
                    assert!(off < 1e-4 || height(uv).abs() < 1e-3, "{angle} {uv:?}: {off}");
                }
            }
        }
    }

    #[test]
    fn what_sees_the_same_has_no_edge() {
        assert_eq!(find_edge(8, |_| true), None);
        let cut = CutElement { element: 0, parts: 5, edge: None };
        assert_eq!((cut.places().len(), cut.triangles().len(), lines(5).count()), (21, 25, 45));
    }
}
