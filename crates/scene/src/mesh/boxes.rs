//! Which triangles come near each other: boxes around eight triangles, around eight such boxes, and so on, over the triangles
//! in the order of a space-filling curve, those of similar size together (Morton 1966; Lauterbach et al. 2009, "Fast BVH
//! construction on GPUs", §3). Made in the time that sorting takes; a box of much larger triangles would surround all others.

use super::Mesh;
use crate::Curve;
use glam::DVec3;
use rayon::prelude::*;

/// Triangles in a box, and boxes in the next larger one: fewer make more boxes, more make each look longer.
const WIDTH: usize = 8;

/// A tree of boxes over the triangles of a mesh.
pub(super) struct Boxes {
    order: Vec<u32>,
    /// Low and high corners of the triangles, in this order.
    bounds: Vec<[DVec3; 2]>,
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
        let triangles = (0..mesh.triangles.len() as u32).into_par_iter();
        let all = triangles.clone().map(bounds).reduce(|| nothing, union);
        let extent = (all[1] - all[0]).max_element().max(f64::MIN_POSITIVE);
        let curve = Curve::new(all);

        let mut keys: Vec<(u64, u32)> = triangles
            .map(|t| {
                let [low, high] = bounds(t);
                let size = ((high - low).max_element() / extent).max(1e-9).log2().floor() as i64 + 64;
                ((size as u64) << Curve::BITS | curve.number(0.5 * (low + high)), t)
            })
            .collect();
        keys.par_sort_unstable();
        let order: Vec<u32> = keys.into_iter().map(|(_, t)| t).collect();
        let bounds: Vec<[DVec3; 2]> = order.par_iter().map(|&t| bounds(t)).collect();
        let mut levels: Vec<Vec<[DVec3; 2]>> =
            vec![bounds.chunks(WIDTH).map(|list| list.iter().copied().fold(nothing, union)).collect()];
        while let Some(last) = levels.last().filter(|last| last.len() > 1) {
            let next = last.chunks(WIDTH).map(|list| list.iter().copied().fold(nothing, union)).collect();
            levels.push(next);
        }
        Boxes { order, bounds, levels }
    }

    /// How many of the smallest boxes there are; the last have the largest triangles.
    pub(super) fn leaves(&self) -> usize {
        self.levels[0].len()
    }

    /// Calls `visit` with every two triangles whose boxes come within `margin` of each other, one of them in the box `home` and
    /// the other in it or in one before, until that says no or nothing is `left` of the comparisons. Whether it came to its end.
    pub(super) fn pairs(
        &self,
        home: usize,
        margin: f64,
        left: &mut u64,
        mut visit: impl FnMut(u32, u32) -> bool,
    ) -> bool {
        let margin = DVec3::splat(margin);
        let meet = |a: &[DVec3; 2], b: &[DVec3; 2]| a[0].cmple(b[1] + margin).all() && b[0].cmple(a[1] + margin).all();
        let leaf = |index: usize| index * WIDTH..((index + 1) * WIDTH).min(self.order.len());
        let mut stack = vec![(self.levels.len() - 1, 0)];
        while let Some((level, index)) = stack.pop() {
            let Some(rest) = left.checked_sub(1) else { return false };
            *left = rest;
            // Each two boxes meet once, from the last of them.
            let start = index << (WIDTH.trailing_zeros() as usize * level);
            let here = self.levels[level].get(index);
            if start > home || !here.is_some_and(|there| meet(&self.levels[0][home], there)) {
                continue;
            }
            if level > 0 {
                stack.extend((index * WIDTH..(index + 1) * WIDTH).map(|child| (level - 1, child)));
                continue;
            }
            for i in leaf(home).filter(|i| meet(&self.bounds[*i], &self.levels[0][index])) {
                for j in leaf(index).filter(|j| index < home || *j > i) {
                    *left = left.saturating_sub(1);
                    if meet(&self.bounds[i], &self.bounds[j]) && !visit(self.order[i], self.order[j]) {
                        return false;
                    }
                }
            }
        }
        true
    }
}
