//! The edges of a mesh.

use radiosity_scene::Mesh;
use rayon::prelude::*;

/// The edges of a mesh, and the corners of its triangles that lie opposite each.
pub(crate) struct Edges<'a> {
    pub mesh: &'a Mesh,
    /// Ends of the edge, and the corner opposite it, of all triangles; those of one edge follow each other.
    sides: Vec<[u32; 3]>,
}

impl Edges<'_> {
    /// Those of a mesh.
    pub fn of(mesh: &Mesh) -> Edges<'_> {
        let of_triangle =
            |&[a, b, c]: &[u32; 3]| [[a, b, c], [b, c, a], [c, a, b]].map(|[a, b, c]| [a.min(b), a.max(b), c]);
        let mut sides: Vec<[u32; 3]> = mesh.triangles.par_iter().flat_map_iter(of_triangle).collect();
        sides.par_sort_unstable();
        Edges { mesh, sides }
    }

    /// Each edge once, by its ends and the opposite corner of each triangle beside it.
    pub fn all(&self) -> impl ParallelIterator<Item = &[[u32; 3]]> {
        self.sides.par_chunk_by(|a, b| a[..2] == b[..2])
    }
}
