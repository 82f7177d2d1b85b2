//! The item buffer: which polygon is seen through each cell of a window, by scan conversion in homogeneous coordinates
//! (Olano and Greer 1997) and the depth test of Catmull (1974, "A subdivision algorithm for computer display of curved
//! surfaces").
//!
//! Each polygon is a [`Scan`]: where it covers a cell's centre, and with which reciprocal depth. The larger one is seen, of
//! equal ones the one drawn first. It fails like any sampling: what is smaller than a cell is seen whole or not at all.

use super::face::Face;
use super::scan::{Outline, Scan};
use glam::DVec3;

/// Items and reciprocal depths of the cells of a face.
#[derive(Clone, Debug, Default)]
pub(super) struct ItemBuffer {
    /// What is seen through each cell.
    pub items: Vec<u32>,
    /// One over its depth; zero where nothing is seen.
    pub depths: Vec<f64>,
    edges: Vec<DVec3>,
}

impl ItemBuffer {
    /// Empties the buffer for a face: `nothing` is seen anywhere.
    pub fn clear(&mut self, face: &Face, nothing: u32) {
        let len = face.cells[0] * face.cells[1];
        self.items.clear();
        self.items.resize(len, nothing);
        self.depths.clear();
        self.depths.resize(len, 0.0);
    }

    /// Draws a polygon; answers how many cells it covers, seen or not.
    pub fn draw(&mut self, face: &Face, outline: &Outline, item: u32) -> u32 {
        self.edges.clear();
        let scan = Scan::new(face, outline, item, &mut self.edges);
        let mut covered = 0;
        for row in scan.rows.clone() {
            let Some([first, last]) = scan.span(&self.edges, face, row) else { continue };
            covered += (last - first + 1) as u32;
            let [start, step] = scan.nearness(face, row);
            let cells = row * face.cells[0] + first..=row * face.cells[0] + last;
            let cells = self.depths[cells.clone()].iter_mut().zip(&mut self.items[cells]);
            for (column, (depth, seen)) in (first..).zip(cells) {
                let nearness = start + step * column as f64;
                if nearness > *depth {
                    (*depth, *seen) = (nearness, item);
                }
            }
        }
        covered
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn face(n: usize) -> Face {
        Face { frame: [DVec3::X, DVec3::Y, DVec3::Z], window: [-1.0, 1.0, -1.0, 1.0], cells: [n, n] }
    }

    fn draw(buffer: &mut ItemBuffer, face: &Face, corners: &[[f64; 3]], item: u32) -> u32 {
        let corners: Vec<DVec3> = corners.iter().map(|c| DVec3::from_array(*c)).collect();
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        let outline = Outline { corners: &corners, normal, offset: normal.dot(corners[0]) };
        buffer.draw(face, &outline, item)
    }

    #[test]
    fn the_nearer_is_seen_and_of_equals_the_first() {
        let (face, mut buffer) = (face(8), ItemBuffer::default());
        buffer.clear(&face, 9);
        let square = |half: f64, z: f64| [[-half, -half, z], [-half, half, z], [half, half, z], [half, -half, z]];
        assert_eq!(draw(&mut buffer, &face, &square(4.0, 2.0), 0), 64);
        assert_eq!(draw(&mut buffer, &face, &square(4.0, 2.0), 1), 64);
        assert_eq!(draw(&mut buffer, &face, &square(8.0, 3.0), 2), 64);
        assert_eq!(draw(&mut buffer, &face, &square(0.5, 1.0), 3), 16);
        assert_eq!([0, 1, 2, 3].map(|i| buffer.items.iter().filter(|item| **item == i).count()), [48, 0, 0, 16]);
    }

    #[test]
    fn of_a_wall_without_thickness_the_front_is_seen() {
        let (face, mut buffer) = (face(8), ItemBuffer::default());
        buffer.clear(&face, 9);
        let front = [[-3.0, -3.0, 1.1], [-3.0, 3.0, 1.3], [3.0, 3.0, 1.9], [3.0, -3.0, 1.7]];
        let back: Vec<_> = front.iter().rev().copied().collect();
        draw(&mut buffer, &face, &back, 0);
        draw(&mut buffer, &face, &front, 1);
        assert_eq!(buffer.items, vec![1; 64]);
    }

    /// A floor that runs from behind the eye to far ahead, one unit below it, covers the lower half and nothing else; its
    /// reciprocal depth is −y.
    #[test]
    fn what_passes_the_eye_plane_needs_no_clipping() {
        let (face, mut buffer) = (face(16), ItemBuffer::default());
        buffer.clear(&face, 9);
        let floor = [[-1e6, -1.0, -1e6], [-1e6, -1.0, 1e6], [1e6, -1.0, 1e6], [1e6, -1.0, -1e6]];
        assert_eq!(draw(&mut buffer, &face, &floor, 0), 128);
        assert!(buffer.items[..128].iter().all(|i| *i == 0) && buffer.items[128..].iter().all(|i| *i == 9));
        assert!((buffer.depths[0] - 0.9375).abs() < 1e-9);
        // One that touches the eye plane.
        let wall = [[0.5, -1.0, 0.0], [0.5, 1.0, 0.0], [0.5, 1.0, 1.0], [0.5, -1.0, 1.0]];
        assert!(draw(&mut buffer, &face, &wall, 1) > 0);
        // One behind the eye.
        assert_eq!(draw(&mut buffer, &face, &[[-1., -1., -1.], [1., -1., -1.], [0., 1., -1.]], 2), 0);
    }

    /// A fan of slivers about a point covers each cell at least once, and at most twice where a centre lies on an edge.
    #[test]
    fn no_cell_falls_between_polygons_that_share_an_edge() {
        let (face, mut buffer) = (face(64), ItemBuffer::default());
        buffer.clear(&face, u32::MAX);
        let hub = [0.0123, -0.2, 1.7];
        let rim = |k: u32| {
            let angle = f64::from(k % 97) / 97.0 * std::f64::consts::TAU;
            [20.0 * angle.cos(), 20.0 * angle.sin(), if k.is_multiple_of(3) { -2.0 } else { 3.0 }]
        };
        let covered: u32 = (0..97).map(|k| draw(&mut buffer, &face, &[hub, rim(k), rim(k + 1)], k)).sum();
        assert!(buffer.items.iter().all(|i| *i != u32::MAX));
        assert!((64 * 64..64 * 64 + 2 * 64).contains(&covered), "{covered}");
    }
}
