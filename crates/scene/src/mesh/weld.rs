//! Vertices by their place: those within a distance of each other are one.

use glam::{DVec3, I64Vec3};

/// Width of the grid's cells in welding distances. At two, a place looks into eight cells; at eight into two on average, and a
/// surface that is all vertices has 64 of them in a cell.
const CELL: f64 = 8.0;

/// No vertex.
const NONE: u32 = u32::MAX;

/// Finds vertices by their place, metres. The first of a cluster represents it.
///
/// ```
/// use glam::DVec3;
/// let (mut weld, mut vertices) = (radiosity_scene::Weld::new(1e-6), Vec::new());
/// let places = [DVec3::ZERO, DVec3::X, DVec3::splat(5e-7)];
/// assert_eq!(places.map(|place| weld.vertex(&mut vertices, place)), [0, 1, 0]);
/// ```
///
/// The grid is a table of vertices by the hash of their cell, with linear probing (Knuth 1998, vol. 3, sect. 6.4): eight to
/// sixteen bytes a vertex.
#[derive(Clone, Debug)]
pub struct Weld {
    pub(super) tolerance: f64,
    /// Vertices and [`NONE`], as many as a power of two, at most half of them vertices.
    table: Vec<u32>,
    count: usize,
}

impl Weld {
    /// No vertices yet; those within `tolerance`, m, of each other are one.
    pub fn new(tolerance: f64) -> Weld {
        Weld { tolerance, table: vec![NONE; 16], count: 0 }
    }

    /// The vertex at a place, added where there is none. All calls are given the same `vertices`, empty at first.
    pub fn vertex(&mut self, vertices: &mut Vec<DVec3>, p: DVec3) -> u32 {
        // The cells within the tolerance of p: two at most along each axis.
        let (low, high) = (self.cell(p - self.tolerance), self.cell(p + self.tolerance));
        let mut found = NONE;
        for x in low.x..=high.x {
            for y in low.y..=high.y {
                for z in low.z..=high.z {
                    let is_near =
                        |v: &u32| vertices[*v as usize].distance_squared(p) <= self.tolerance * self.tolerance;
                    found = found.min(self.run(I64Vec3 { x, y, z }).filter(is_near).min().unwrap_or(NONE));
                }
            }
        }
        if found == NONE {
            found = vertices.len() as u32;
            vertices.push(p);
            self.add(vertices, found);
        }
        found
    }

    fn add(&mut self, vertices: &[DVec3], vertex: u32) {
        self.count += 1;
        if 2 * self.count > self.table.len() {
            let wider = vec![NONE; 2 * self.table.len()];
            for v in std::mem::replace(&mut self.table, wider).into_iter().filter(|v| *v != NONE) {
                self.put(vertices, v);
            }
        }
        self.put(vertices, vertex);
    }

    fn put(&mut self, vertices: &[DVec3], vertex: u32) {
        let mut slot = self.slot(self.cell(vertices[vertex as usize]));
        while self.table[slot] != NONE {
            slot = (slot + 1) & (self.table.len() - 1);
        }
        self.table[slot] = vertex;
    }

    /// The vertices of a cell, and others that came to stand between them.
    fn run(&self, cell: I64Vec3) -> impl Iterator<Item = u32> + '_ {
        let slot = self.slot(cell);
        self.table[slot..].iter().chain(&self.table[..slot]).copied().take_while(|v| *v != NONE)
    }

    fn cell(&self, p: DVec3) -> I64Vec3 {
        (p / (CELL * self.tolerance)).floor().as_i64vec3()
    }

    fn slot(&self, cell: I64Vec3) -> usize {
        // Cells in use lie in rows and planes, so that every bit of their numbers has to count: the finalizer of SplitMix64
        // (Steele et al. 2014, "Fast splittable pseudorandom number generators").
        let mut hash = 0;
        for x in cell.to_array() {
            hash = (hash ^ x as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29);
        }
        hash = (hash ^ hash >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        hash = (hash ^ hash >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        (hash ^ hash >> 31) as usize & (self.table.len() - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places on a lattice, again a little aside, in an order that is none: as many vertices as places, whatever cells they
    /// are in, and the table has grown many times.
    #[test]
    fn places_within_the_distance_are_one_vertex() {
        let (tolerance, n) = (1e-3, 27u32);
        let place = |k: u32| DVec3::new(f64::from(k % n), f64::from(k / n % n), f64::from(k / n / n)) * 2.5e-3;
        let (mut weld, mut vertices) = (Weld::new(tolerance), Vec::new());
        let order = (0..n * n * n).map(|k| k.wrapping_mul(7919) % (n * n * n));
        let names: Vec<u32> =
            order.clone().map(|k| weld.vertex(&mut vertices, place(k) - DVec3::splat(0.01))).collect();
        assert_eq!(vertices.len(), (n * n * n) as usize);
        for (k, name) in order.zip(names) {
            let aside = [DVec3::X, -DVec3::Y, DVec3::Z][k as usize % 3] * 0.99 * tolerance;
            assert_eq!(weld.vertex(&mut vertices, place(k) - DVec3::splat(0.01) + aside), name);
        }
        assert_eq!(vertices.len(), (n * n * n) as usize);
    }

    /// Where two are near enough, the first is taken, in whichever cells they are.
    #[test]
    fn the_first_represents_a_cluster() {
        for side in [1.0, -1.0] {
            let (mut weld, mut vertices) = (Weld::new(1.0), Vec::new());
            let at = |x: f64| DVec3::new(side * x, 0.0, 0.0);
            assert_eq!([-0.75, 0.75].map(|x| weld.vertex(&mut vertices, at(x))), [0, 1]);
            assert_eq!(weld.vertex(&mut vertices, at(0.0)), 0);
        }
    }
}
