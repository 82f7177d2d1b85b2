//! Clusters: a binary tree over the parts, so that many pairs are judged at once.
//!
//! Parts of one plane that face the same way stay together, for what holds of a wall and a wall holds of all that is on
//! them. A cluster keeps the corners of a hull: its rectangle if it lies in a plane, else its box.

use super::lattice::Lattice;
use super::panel::Planes;
use super::part::Part;
use glam::{DVec2, DVec3};
use std::ops::Range;

/// Parts of a leaf: those that share what they see of a target. With 4 a room of 800 patches takes 15 % more, with 8 or 32 some
/// 4 %: fewer neighbours to share with, or less that is proven for all of them.
pub const LEAF: usize = 16;

/// A node of the tree.
#[derive(Clone, Debug)]
pub struct Cluster {
    /// The parts below it, in the tree's order.
    pub parts: Range<usize>,
    /// Corners of a convex hull of all that is below.
    pub hull: Vec<DVec3>,
    /// Normal and offset of the plane, if all parts lie in one and face along it.
    pub plane: Option<(DVec3, f64)>,
    /// Its two halves; none for a leaf.
    pub halves: Option<[u32; 2]>,
    /// Largest distance between corners of the hull.
    pub extent: f64,
    /// Places of the parts of a leaf.
    pub lattice: Option<Lattice>,
}

/// The tree.
#[derive(Clone, Debug, Default)]
pub struct Clusters {
    /// All nodes, the root last.
    pub nodes: Vec<Cluster>,
    /// The parts in the tree's order.
    pub parts: Vec<Part>,
}

impl Clusters {
    /// Builds the tree; the parts are put in its order.
    pub fn new(parts: Vec<Part>, planes: &mut Planes) -> Clusters {
        let mut walls: Vec<((u32, bool), Vec<usize>)> = Vec::new();
        let mut keyed: Vec<((u32, bool), usize)> =
            parts.iter().enumerate().map(|(i, part)| (planes.find(&part.shape), i)).collect();
        keyed.sort_unstable();
        for (key, i) in keyed {
            match walls.last_mut() {
                Some((last, members)) if *last == key => members.push(i),
                _ => walls.push((key, vec![i])),
            }
        }
        let mut builder = Builder { from: parts, order: Vec::new(), nodes: Vec::new(), planes };
        if !walls.is_empty() {
            builder.over_walls(&mut walls);
        }
        let Builder { from, order, mut nodes, .. } = builder;
        let mut taken: Vec<Option<Part>> = from.into_iter().map(Some).collect();
        let parts: Vec<Part> = order.into_iter().filter_map(|i| taken[i].take()).collect();
        for leaf in nodes.iter_mut().filter(|node| node.halves.is_none()) {
            leaf.lattice = Some(Lattice::new(&parts[leaf.parts.clone()], leaf.extent));
        }
        Clusters { nodes, parts }
    }

    /// The root; `None` without parts.
    pub fn root(&self) -> Option<u32> {
        self.nodes.len().checked_sub(1).map(|root| root as u32)
    }

    /// Nodes with no more than `most` parts that together hold all, in order.
    pub fn blocks(&self, most: usize) -> Vec<u32> {
        let mut blocks = Vec::new();
        let mut open: Vec<u32> = self.root().into_iter().collect();
        while let Some(node) = open.pop() {
            let cluster = &self.nodes[node as usize];
            match cluster.halves {
                // In-plane blocks only: what is judged by planes is judged once for all of them.
                Some([a, b]) if cluster.parts.len() > most || cluster.plane.is_none() => open.extend([b, a]),
                _ => blocks.push(node),
            }
        }
        blocks
    }
}

struct Builder<'a> {
    from: Vec<Part>,
    order: Vec<usize>,
    nodes: Vec<Cluster>,
    planes: &'a Planes,
}

impl Builder<'_> {
    /// A tree over whole walls, halved at the median of their centres along the longest axis.
    fn over_walls(&mut self, walls: &mut [((u32, bool), Vec<usize>)]) -> u32 {
        if let [(key, members)] = walls {
            let (normal, offset) = self.planes.plane(key.0);
            let plane = if key.1 { (normal, offset) } else { (-normal, -offset) };
            let mut members = std::mem::take(members);
            return self.in_wall(plane, &mut members);
        }
        let centre = |builder: &Self, members: &[usize]| -> DVec3 {
            let [low, high] = bounds(members.iter().flat_map(|i| builder.from[*i].shape.corners().iter().copied()));
            0.5 * (low + high)
        };
        let centres: Vec<DVec3> = walls.iter().map(|(_, members)| centre(self, members)).collect();
        let [low, high] = bounds(centres.iter().copied());
        let axis = longest(high - low);
        let mut ranked: Vec<usize> = (0..walls.len()).collect();
        ranked.sort_by(|a, b| centres[*a][axis].total_cmp(&centres[*b][axis]).then(walls[*a].0.cmp(&walls[*b].0)));
        let mut sorted: Vec<_> = ranked.iter().map(|i| std::mem::take(&mut walls[*i])).collect();
        let middle = sorted.len() / 2;
        let (left, right) = sorted.split_at_mut(middle);
        let start = self.order.len();
        let halves = [self.over_walls(left), self.over_walls(right)];
        let corners = || self.order[start..].iter().flat_map(|i| self.from[*i].shape.corners().iter().copied());
        let [low, high] = bounds(corners());
        let hull: Vec<DVec3> = (0..8)
            .map(|k| {
                DVec3::from_array(std::array::from_fn(|axis| if k >> axis & 1 == 0 { low[axis] } else { high[axis] }))
            })
            .collect();
        self.push(start, hull, None, Some(halves))
    }

    /// A tree over the parts of one wall, halved in its plane.
    fn in_wall(&mut self, plane: (DVec3, f64), members: &mut [usize]) -> u32 {
        let start = self.order.len();
        let (x, y) = plane.0.any_orthonormal_pair();
        let flat = |p: DVec3| DVec2::new(x.dot(p), y.dot(p));
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for corner in members.iter().flat_map(|i| self.from[*i].shape.corners()) {
            (low, high) = (low.min(flat(*corner)), high.max(flat(*corner)));
        }
        let halves = if members.len() <= LEAF {
            members.sort_unstable();
            self.order.extend_from_slice(members);
            None
        } else {
            let along = if high.x - low.x >= high.y - low.y { x } else { y };
            let place = |i: usize| along.dot(self.from[i].shape.centroid());
            members.sort_by(|a, b| place(*a).total_cmp(&place(*b)).then(a.cmp(b)));
            let (left, right) = members.split_at_mut(members.len() / 2);
            Some([self.in_wall(plane, left), self.in_wall(plane, right)])
        };
        let foot = plane.1 * plane.0;
        let hull = [[low.x, low.y], [high.x, low.y], [high.x, high.y], [low.x, high.y]];
        let hull = match self.order[start..] {
            // One part is its own hull.
            [only] => self.from[only].shape.corners().to_vec(),
            _ => hull.into_iter().map(|[u, v]| foot + u * x + v * y).collect(),
        };
        self.push(start, hull, Some(plane), halves)
    }

    fn push(&mut self, start: usize, hull: Vec<DVec3>, plane: Option<(DVec3, f64)>, halves: Option<[u32; 2]>) -> u32 {
        let extent = hull.iter().map(|c| c.distance(hull[0])).fold(0.0, f64::max);
        self.nodes.push(Cluster { parts: start..self.order.len(), hull, plane, halves, extent, lattice: None });
        (self.nodes.len() - 1) as u32
    }
}

fn bounds(points: impl Iterator<Item = DVec3>) -> [DVec3; 2] {
    points.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| [low.min(p), high.max(p)])
}

fn longest(size: DVec3) -> usize {
    (0..3).fold(0, |best, axis| if size[axis] > size[best] { axis } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_scene::Facet;

    #[test]
    fn blocks_hold_every_part_once_and_lie_in_planes() {
        let mut parts = Vec::new();
        for i in 0..300u32 {
            let (x, y) = (f64::from(i % 10), f64::from(i / 10));
            let p =
                |a: f64, b: f64| if i % 3 == 0 { DVec3::new(x + a, y + b, 0.0) } else { DVec3::new(0.0, x + a, y + b) };
            let facet = Facet::new(vec![p(0., 0.), p(1., 0.), p(1., 1.), p(0., 1.)]).unwrap();
            parts.extend(Part::of(i, &if i % 2 == 0 { facet } else { facet.flipped() }));
        }
        let clusters = Clusters::new(parts, &mut Planes::new(40.0, 1e-6));
        assert_eq!(clusters.parts.len(), 300);
        let mut next = 0;
        for block in clusters.blocks(32) {
            let node = &clusters.nodes[block as usize];
            assert_eq!(node.parts.start, next);
            next = node.parts.end;
            let (normal, offset) = node.plane.unwrap();
            for part in &clusters.parts[node.parts.clone()] {
                assert!(part.shape.normal().dot(normal) > 0.999);
                assert!(part.shape.corners().iter().all(|c| (normal.dot(*c) - offset).abs() < 1e-9));
            }
        }
        assert_eq!(next, 300);
        let mut facets: Vec<u32> = clusters.parts.iter().map(|p| p.facet).collect();
        facets.sort_unstable();
        assert_eq!(facets, (0..300).collect::<Vec<_>>());
    }
}
