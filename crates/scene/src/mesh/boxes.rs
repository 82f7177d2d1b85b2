//! Which triangles come near a line: boxes around eight triangles, around eight such boxes, and so on, over the triangles
//! in the order of a space-filling curve, those of similar size together (Morton 1966; Lauterbach et al. 2009, "Fast BVH
//! construction on GPUs", §3). Made in the time that sorting takes; a box of much larger triangles would surround all others.

use super::Mesh;
use glam::DVec3;

/// Triangles in a box, and boxes in the next larger one: fewer make more boxes, more make each look longer.
const WIDTH: usize = 8;

/// Bits of the curve along each axis: with those of the size they fit into 64.
const BITS: u32 = 16;

/// A tree of boxes over the triangles of a mesh.
pub(super) struct Boxes {
    order: Vec<u32>,
    /// Low and high corners, from the smallest boxes to a single one.
    levels: Vec<Vec<[DVec3; 2]>>,
}

impl Boxes {
    pub(super) fn new(mesh: &Mesh) -> Boxes {
        let bounds = |t: u32| {
            let [a, b, c] = mesh.corners(t as usize);
            [a.min(b).min(c), a.max(b).max(c)]
        };
        let nothing = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        let union = |[low, high]: [DVec3; 2], [l, h]: [DVec3; 2]| [low.min(l), high.max(h)];
        let all = (0..mesh.triangles.len() as u32).map(bounds).fold(nothing, union);
        let extent = (all[1] - all[0]).max_element().max(f64::MIN_POSITIVE);

        let mut keys: Vec<(u64, u32)> = (0..mesh.triangles.len() as u32)
            .map(|t| {
                let [low, high] = bounds(t);
                let size = ((high - low).max_element() / extent).max(1e-9).log2().floor() as i64 + 64;
                let place = ((0.5 * (low + high) - all[0]) / extent * f64::from((1 << BITS) - 1)).as_u64vec3();
                let mut key = size as u64;
                for bit in (0..BITS).rev() {
                    for axis in place.to_array() {
                        key = key << 1 | axis >> bit & 1;
                    }
                }
                (key, t)
            })
            .collect();
        keys.sort_unstable();
        let order: Vec<u32> = keys.into_iter().map(|(_, t)| t).collect();
        let mut levels: Vec<Vec<[DVec3; 2]>> =
            vec![order.chunks(WIDTH).map(|list| list.iter().map(|&t| bounds(t)).fold(nothing, union)).collect()];
        while let Some(last) = levels.last().filter(|last| last.len() > 1) {
            let next = last.chunks(WIDTH).map(|list| list.iter().copied().fold(nothing, union)).collect();
            levels.push(next);
        }
        Boxes { order, levels }
    }

    /// Calls `visit` with every triangle that may lie within `margin` of the line from a to b, and others near it, and
    /// returns the number of boxes looked at.
    pub(super) fn near(&self, [a, b]: [DVec3; 2], margin: f64, mut visit: impl FnMut(u32)) -> u64 {
        let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
        let reach = half.abs() + DVec3::splat(margin);
        let meets = |[low, high]: &[DVec3; 2]| {
            let (size, from) = (0.5 * (*high - *low), middle - 0.5 * (*high + *low));
            if from.abs().cmpgt(size + reach).any() {
                return false;
            }
            // The axes across the line and one of the box's: Gottschalk, Lin and Manocha 1996.
            let size = size + DVec3::splat(margin);
            let (cross, h) = (half.cross(from).abs(), half.abs());
            let radius =
                DVec3::new(size.y * h.z + size.z * h.y, size.x * h.z + size.z * h.x, size.x * h.y + size.y * h.x);
            cross.cmple(radius).all()
        };
        let mut looked = 0;
        let mut stack: Vec<(usize, usize)> = self.levels.len().checked_sub(1).map(|top| (top, 0)).into_iter().collect();
        while let Some((level, index)) = stack.pop() {
            looked += 1;
            if !self.levels[level].get(index).is_some_and(meets) {
                continue;
            }
            let children = index * WIDTH..(index + 1) * WIDTH;
            if level > 0 {
                stack.extend(children.map(|child| (level - 1, child)));
            } else {
                self.order[children.start..children.end.min(self.order.len())].iter().for_each(|&t| visit(t));
            }
        }
        looked
    }
}
