//! Edges, and the triangles on their sides.

use super::Mesh;
use rayon::prelude::*;

/// A triangle's side of an edge of a [`Mesh`].
#[derive(Clone, Copy, Debug, Default)]
pub struct EdgeSide {
    /// The ends, the lower number first.
    pub edge: (u32, u32),
    /// Whether the triangle runs from the first to the second.
    pub forward: bool,
    corner: u8,
    triangle: u32,
}

impl EdgeSide {
    /// The triangle, and the corner where its side begins.
    pub fn place(&self) -> (usize, usize) {
        (self.triangle as usize, usize::from(self.corner))
    }
}

/// The ends of an edge, the lower number first.
pub(super) fn ordered(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

impl Mesh {
    /// The sides of all triangles, in the order of their edges and then of the triangles: those of one edge follow each other.
    pub fn sides_of_edges(&self) -> Vec<EdgeSide> {
        // Counted by the first end; what is left to sort is a handful for each.
        let mut next = vec![0usize; self.vertices.len() + 1];
        let ends = |t: &[u32; 3], i: usize| (t[i], t[(i + 1) % 3]);
        for t in &self.triangles {
            (0..3).for_each(|i| next[ordered(ends(t, i).0, ends(t, i).1).0 as usize + 1] += 1);
        }
        for v in 0..self.vertices.len() {
            next[v + 1] += next[v];
        }
        let mut sides = vec![EdgeSide::default(); 3 * self.triangles.len()];
        for (index, t) in self.triangles.iter().enumerate() {
            for i in 0..3 {
                let (a, b) = ends(t, i);
                let edge = ordered(a, b);
                let slot = &mut next[edge.0 as usize];
                sides[*slot] = EdgeSide { edge, forward: a < b, corner: i as u8, triangle: index as u32 };
                *slot += 1;
            }
        }
        sides
            .par_chunk_by_mut(|a, b| a.edge.0 == b.edge.0)
            .for_each(|own| own.sort_unstable_by_key(|side| (side.edge.1, side.triangle, side.corner)));
        sides
    }
}

/// Whether an edge is walked as often one way as the other, as within a surface. Else a surface ends there.
pub(super) fn is_balanced(sides: &[EdgeSide]) -> bool {
    2 * sides.iter().filter(|side| side.forward).count() == sides.len()
}
