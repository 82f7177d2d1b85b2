//! Edges, and the triangles on their sides.

/// A triangle's side of an edge.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct EdgeSide {
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

/// The sides of all triangles, in the order of their edges and then of the triangles.
pub(super) fn sides_of_edges(triangles: &[[u32; 3]], vertices: usize) -> Vec<EdgeSide> {
    // Counted by the first end; what is left to sort is a handful for each.
    let mut next = vec![0usize; vertices + 1];
    let corners = |t: &[u32; 3], i: usize| (t[i], t[(i + 1) % 3]);
    for t in triangles {
        (0..3).for_each(|i| next[ordered(corners(t, i).0, corners(t, i).1).0 as usize + 1] += 1);
    }
    for v in 0..vertices {
        next[v + 1] += next[v];
    }
    let mut sides = vec![EdgeSide::default(); 3 * triangles.len()];
    for (index, t) in triangles.iter().enumerate() {
        for i in 0..3 {
            let (a, b) = corners(t, i);
            let edge = ordered(a, b);
            let slot = &mut next[edge.0 as usize];
            sides[*slot] = EdgeSide { edge, forward: a < b, corner: i as u8, triangle: index as u32 };
            *slot += 1;
        }
    }
    // Each place has moved on to where the next vertex begins.
    let mut start = 0;
    for &end in &next[..vertices] {
        sides[start..end].sort_unstable_by_key(|side| (side.edge.1, side.triangle, side.corner));
        start = end;
    }
    sides
}

/// Whether an edge is walked as often one way as the other, as within a surface. Else a surface ends there.
pub(super) fn is_balanced(sides: &[EdgeSide]) -> bool {
    2 * sides.iter().filter(|side| side.forward).count() == sides.len()
}
