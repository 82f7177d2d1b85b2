//! The walk through the tree without SIMD intrinsics: for other processors, and as the reference for `avx2` and `neon`.

use crate::Hit;
use crate::intersect::Prepared;
use crate::tree::{Child, LANES, Tree, WIDTH};

pub(crate) fn closest(
    tree: &Tree,
    ray: &Prepared,
    accept: &mut impl FnMut(u32, f32, f32, bool) -> bool,
) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    let mut limit = ray.t_max;
    walk(tree, ray, &mut limit, |hit, limit| {
        let nearer = best.is_none_or(|b| hit.precedes(ray.tie, b.key(ray.tie), b.triangle));
        if nearer && accept(hit.triangle, hit.u, hit.v, hit.back) {
            best = Some(hit);
            *limit = limit.min(hit.key(ray.tie));
        }
        false
    });
    best
}

pub(crate) fn blocked(tree: &Tree, ray: &Prepared, accept: &mut impl FnMut(u32, f32, f32, bool) -> bool) -> bool {
    let mut found = false;
    walk(tree, ray, &mut { ray.t_max }, |hit, _| {
        found = accept(hit.triangle, hit.u, hit.v, hit.back);
        found
    });
    found
}

/// Shows `found` every hit in a box that begins no later than `limit`, as boxes are widened, which it may lower; it ends the walk by `true`.
fn walk(tree: &Tree, ray: &Prepared, limit: &mut f32, mut found: impl FnMut(Hit, &mut f32) -> bool) {
    // (distance at which the box is entered, what it contains), the nearest last
    let mut stack = vec![(0.0, Child::node(0))];
    while let Some((near, child)) = stack.pop() {
        if near > *limit + ray.add {
            continue;
        }
        if child.is_leaf() {
            for block in &tree.blocks[child.blocks()] {
                for lane in 0..LANES {
                    let hit = ray.hit(block.corners(lane), block.triangle[lane]);
                    if hit.is_some_and(|hit| found(hit, limit)) {
                        return;
                    }
                }
            }
        } else {
            let node = &tree.nodes[child.index()];
            let first = stack.len();
            for slot in 0..WIDTH {
                let (mut near, mut far) = (ray.least, *limit + ray.add);
                for axis in 0..3 {
                    let (enter, leave) = (ray.rows[axis], (ray.rows[axis] + 3) % 6);
                    let distance = |row: usize| (node.bounds[row][slot] - ray.origin[axis]) * ray.inverse[axis];
                    near = near.max(distance(enter));
                    far = far.min(distance(leave) + ray.add);
                }
                if near <= far {
                    stack.push((near, node.child[slot]));
                }
            }
            stack[first..].sort_by(|a, b| b.0.total_cmp(&a.0));
        }
    }
}
