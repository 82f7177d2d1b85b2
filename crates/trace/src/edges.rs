//! The edges of a mesh.

use radiosity_scene::Mesh;
use rayon::prelude::*;

/// Nothing is looked for past the edges of more triangles than this: they would take hundreds of megabytes.
pub(crate) const MOST_TRIANGLES: usize = 1 << 22;

/// Offsets of ray origins by which rays pass an edge.
pub(crate) const PAST: f64 = 16.0;

/// Rays past one edge at most: an opening may be a small part of a long one.
const OF_EDGE: f64 = 64.0;

/// Places from which what was found past edges is grown, at most.
const SEEDS: usize = 1024;

/// The edges of a mesh, and the corners of its triangles that lie opposite each.
pub(crate) struct Edges<'a> {
    pub mesh: &'a Mesh,
    /// Ends of the edge, and the corner opposite it, of all triangles; those of one edge follow each other.
    sides: Vec<[u32; 3]>,
}

impl Edges<'_> {
    /// Those of some triangles of a mesh, by their numbers.
    pub fn of(mesh: &Mesh, is_part: impl Fn(usize) -> bool + Sync) -> Edges<'_> {
        let of_triangle =
            |&[a, b, c]: &[u32; 3]| [[a, b, c], [b, c, a], [c, a, b]].map(|[a, b, c]| [a.min(b), a.max(b), c]);
        let mut sides: Vec<[u32; 3]> = mesh
            .triangles
            .par_iter()
            .enumerate()
            .filter(|(t, _)| is_part(*t))
            .map(|(_, corners)| corners)
            .flat_map_iter(of_triangle)
            .collect();
        sides.par_sort_unstable();
        Edges { mesh, sides }
    }

    /// Each edge once, by its ends and the opposite corner of each triangle beside it.
    pub fn all(&self) -> impl ParallelIterator<Item = &[[u32; 3]]> {
        self.sides.par_chunk_by(|a, b| a[..2] == b[..2])
    }

    /// The same one after the other.
    pub fn each(&self) -> impl Iterator<Item = &[[u32; 3]]> {
        self.sides.chunk_by(|a, b| a[..2] == b[..2])
    }
}

/// How many of about so many rays go past each edge of such lengths: as its length and its being one tell, and where there are too many edges, one now and then.
pub(crate) fn spread(lengths: &[f32], probes: f64) -> Vec<u32> {
    let whole: f64 = lengths.iter().map(|length| f64::from(*length)).sum();
    let wanted = |length: f32| {
        let share = 0.5 * f64::from(length) / whole + 0.5 / lengths.len() as f64;
        (probes * share).min(OF_EDGE)
    };
    let mut reached = 0.5;
    let count = |length: &f32| {
        let before = f64::floor(reached);
        reached += wanted(*length);
        (reached.floor() - before) as u32
    };
    lengths.iter().map(count).collect()
}

/// Thins what was found evenly where it is too much.
pub(crate) fn thin<T>(found: &mut Vec<T>) {
    let many = found.len().max(SEEDS);
    let mut number = 0;
    found.retain(|_| {
        number += 1;
        number * SEEDS / many > (number - 1) * SEEDS / many
    });
}
