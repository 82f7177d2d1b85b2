//! Edges that exactly two triangles share, one on each side.

use rayon::prelude::*;

/// An edge between two triangles that lie on its two sides and face the same way.
///
/// Side k of a triangle joins its corners k and k + 1 (mod 3); the second triangle runs along the edge backwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SharedEdge {
    /// The two triangles, the smaller index first.
    pub triangles: [u32; 2],
    /// Which side of each.
    pub sides: [u8; 2],
}

/// All edges that exactly two triangles (of the same group, where groups are given) share in opposite directions,
/// in the order of their vertex indices. Edges of three or more triangles and of flipped neighbours are left out.
pub fn shared_edges(triangles: &[[u32; 3]], group: Option<&[u32]>) -> Vec<SharedEdge> {
    let mut sides: Vec<(u32, u32, u32, u32, u8)> = Vec::with_capacity(3 * triangles.len());
    for (index, corners) in triangles.iter().enumerate() {
        let group = group.and_then(|group| group.get(index)).copied().unwrap_or(0);
        for side in 0..3 {
            let (from, to) = (corners[side], corners[(side + 1) % 3]);
            if from != to {
                sides.push((group, from.min(to), from.max(to), index as u32, side as u8));
            }
        }
    }
    sides.par_sort_unstable();
    let same = |a: &(u32, u32, u32, u32, u8), b: &(u32, u32, u32, u32, u8)| (a.0, a.1, a.2) == (b.0, b.1, b.2);
    sides
        .chunk_by(same)
        .filter_map(|run| {
            let [a, b] = run else { return None };
            let start = |side: &(u32, u32, u32, u32, u8)| triangles[side.3 as usize][usize::from(side.4)];
            let apart = a.3 != b.3 && start(a) != start(b);
            apart.then_some(SharedEdge { triangles: [a.3, b.3], sides: [a.4, b.4] })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_two_sided_manifold_edges_are_shared() {
        let quad = [[0, 1, 2], [0, 2, 3]];
        assert_eq!(shared_edges(&quad, None), [SharedEdge { triangles: [0, 1], sides: [2, 0] }]);
        assert_eq!(shared_edges(&quad, Some(&[0, 1])), []);
        // Three leaves of a book, a flipped neighbour, and a triangle twice.
        assert_eq!(shared_edges(&[[0, 1, 2], [1, 0, 3], [0, 1, 4]], None), []);
        assert_eq!(shared_edges(&[[0, 1, 2], [0, 1, 3]], None), []);
        assert_eq!(shared_edges(&[[0, 1, 2], [0, 1, 2]], None), []);
    }
}
