//! Seams: lines along which elements of different sizes meet, so that each side has corners where the other has none.
//!
//! The light of a corner that lies within an edge of another element is that of the edge there, as it is drawn between the edge's
//! ends: light would jump along the line else, and be a seam to the eye (hanging nodes, as in finite elements on graded meshes). Where
//! the edges of both sides lie across each other, those of the larger elements lead.

use glam::{DVec3, Vec3};
use rustc_hash::FxHashMap;

/// Lines are held against each other if their directions, and where they pass the origin, are the same in steps of this size: the second
/// by half the scene's extent.
const ALIKE: f64 = 1.0 / 64.0;
const NEAR: f64 = 1e-3;

/// By how much of a step they are shifted before they are rounded: what lies in one line is hardly ever rounded to two sides. Where it is,
/// the seam is seen.
const OFF: f64 = 0.1371;

/// By how much longer an edge leads, relative to the other.
const LONGER: f64 = 1.0 + 1e-6;

/// A spot as seams see it: where it is, and its normal.
pub type Spot = (DVec3, Vec3);

/// A spot within an edge of an element that has no corner there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hanging {
    pub spot: u32,
    /// The element beyond the line.
    pub element: u32,
    /// The ends of its edge, and how much the second counts; none where the spot has light of its own.
    pub between: Option<([u32; 2], f32)>,
}

/// An edge that one element has for itself.
struct Edge {
    ends: [u32; 2],
    element: u32,
    /// Along the line.
    span: [f64; 2],
}

/// The spots that lie within edges, those that follow others after these. `corners` are the spots of the corners of each element, three by three.
/// What is nearer than `grain` is at one place; normals are of one surface from the cosine `smooth` on.
pub fn hanging(spots: &[Spot], corners: &[u32], half: f64, grain: f64, smooth: f32) -> Vec<Hanging> {
    let mut edges: Vec<([u32; 2], u32)> = Vec::with_capacity(corners.len());
    for (element, own) in corners.chunks_exact(3).enumerate() {
        for [a, b] in [[own[0], own[1]], [own[1], own[2]], [own[2], own[0]]] {
            edges.push(([a.min(b), a.max(b)], element as u32));
        }
    }
    edges.sort_unstable();
    let open = edges.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1).map(|same| same[0]);

    let mut lines: FxHashMap<[i32; 6], Vec<Edge>> = FxHashMap::default();
    for (ends, element) in open {
        let [a, b] = ends.map(|spot| spots[spot as usize].0);
        let Some(along) = (b - a).try_normalize() else { continue };
        let lead = along.to_array().into_iter().find(|x| x.abs() > 0.1).unwrap_or(1.0);
        let along = along * lead.signum();
        let foot = a - a.dot(along) * along;
        let [d, f] = [along / ALIKE, foot / (NEAR * half)].map(|v| (v + OFF).round().to_array().map(|x| x as i32));
        let mut span = [a, b].map(|p| p.dot(along));
        let mut ends = ends;
        if span[0] > span[1] {
            span.reverse();
            ends.reverse();
        }
        lines.entry([d[0], d[1], d[2], f[0], f[1], f[2]]).or_default().push(Edge { ends, element, span });
    }
    let mut longest: FxHashMap<u32, Found> = FxHashMap::default();
    for edges in lines.values_mut().filter(|edges| edges.len() > 1) {
        edges.sort_unstable_by(|a, b| a.span[0].total_cmp(&b.span[0]).then(a.ends.cmp(&b.ends)));
        for (k, edge) in edges.iter().enumerate() {
            let beside = edges[k + 1..].iter().take_while(|other| other.span[0] < edge.span[1]);
            for other in beside {
                for [leader, own] in [[edge, other], [other, edge]] {
                    for spot in own.ends {
                        look(spots, leader, own, spot, (grain, smooth), &mut longest);
                    }
                }
            }
        }
    }
    ordered(longest)
}

/// The longest edge that a spot lies within.
struct Found {
    length: f64,
    /// Of the spot's own edge along it.
    own: f64,
    hanging: Hanging,
}

/// Notes a spot, an end of `own`, if it lies within `edge`.
fn look(
    spots: &[Spot],
    edge: &Edge,
    own: &Edge,
    spot: u32,
    (grain, smooth): (f64, f32),
    longest: &mut FxHashMap<u32, Found>,
) {
    let [(a, normal), (b, other)] = edge.ends.map(|end| spots[end as usize]);
    let (place, facing) = spots[spot as usize];
    let length = a.distance(b);
    let share = (place - a).dot(b - a) / (length * length);
    let is_within = share * length > 2.0 * grain && (1.0 - share) * length > 2.0 * grain;
    let is_on = place.distance(a + share * (b - a)) <= grain;
    if !is_within || !is_on || facing.dot(normal).min(facing.dot(other)) < smooth {
        return;
    }
    let of_own = own.span[1] - own.span[0];
    let leads = length > LONGER * of_own;
    let hanging = Hanging { spot, element: edge.element, between: leads.then_some((edge.ends, share as f32)) };
    let found = Found { length, own: of_own, hanging };
    let better = |old: &Found| {
        let key = |found: &Found| (found.length, -found.own);
        key(&found) > key(old) || (key(&found) == key(old) && found.hanging.element < old.hanging.element)
    };
    if longest.get(&spot).is_none_or(better) {
        longest.insert(spot, found);
    }
}

/// In the order of spots, but what follows others after these; what would follow itself follows nothing.
fn ordered(mut longest: FxHashMap<u32, Found>) -> Vec<Hanging> {
    let mut spots: Vec<u32> = longest.keys().copied().collect();
    spots.sort_unstable();
    let mut order = Vec::with_capacity(spots.len());
    for first in spots {
        // The way from a spot over those that it follows.
        let mut way = vec![first];
        while let Some(&spot) = way.last() {
            let Some(Found { hanging, .. }) = longest.get(&spot) else {
                way.pop();
                continue;
            };
            let ends = hanging.between.map_or(Vec::new(), |(ends, _)| ends.to_vec());
            match ends.into_iter().find(|end| longest.contains_key(end)) {
                Some(end) if way.contains(&end) => {
                    longest.entry(spot).and_modify(|found| found.hanging.between = None);
                }
                Some(end) => way.push(end),
                None => {
                    order.extend(longest.remove(&spot).map(|found| found.hanging));
                    way.pop();
                }
            }
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two rows of triangles on both sides of y = 0: with corners at thirds of the line above, at halves below.
    #[test]
    fn corners_within_edges_follow_the_longer_ones() {
        let at = |x: f64, y: f64| (DVec3::new(x, y, 0.0), Vec3::Z);
        let spots: Vec<Spot> = vec![
            at(0.0, 0.0),
            at(1.0, 0.0),
            at(1.0 / 3.0, 0.0),
            at(2.0 / 3.0, 0.0),
            at(0.5, 0.0),
            at(0.5, 1.0),
            at(0.5, -1.0),
        ];
        let corners = [[0, 2, 5], [2, 3, 5], [3, 1, 5], [4, 0, 6], [1, 4, 6]].concat();
        let found = hanging(&spots, &corners, 1.0, 1e-6, 0.8);
        let of = |spot: u32| *found.iter().find(|hanging| hanging.spot == spot).unwrap();
        assert_eq!(found.len(), 3);
        let follows = |spot, ends: [u32; 2], share: f32| {
            let Some((own, part)) = of(spot).between else { return false };
            let part = if own == ends { part } else { 1.0 - part };
            own.contains(&ends[0]) && own.contains(&ends[1]) && (part - share).abs() < 1e-6
        };
        assert!(follows(2, [0, 4], 2.0 / 3.0) && follows(3, [4, 1], 1.0 / 3.0), "{found:?}");
        // The middle lies within an edge of the smaller elements: it has light of its own, of both sides.
        assert_eq!((of(4).between, of(4).element), (None, 1));
        // On a surface that turns away there is a corner of its own.
        let mut bent = spots;
        bent[2].1 = Vec3::X;
        bent[3].1 = Vec3::X;
        assert_eq!(hanging(&bent, &corners, 1.0, 1e-6, 0.8), []);
    }
}
