//! Every triangle, one after the other: what the tree of boxes must agree with, bit for bit.

use crate::intersect::{Prepared, bounds_of};
use crate::{Hit, Ray};
use glam::Vec3;

/// As [`Tree::closest`](crate::Tree::closest), by trying every triangle.
pub fn closest_brute(triangles: &[[Vec3; 3]], ray: &Ray) -> Option<Hit> {
    closest_where_brute(triangles, ray, |_, _, _, _| true)
}

/// As [`Tree::closest_where`](crate::Tree::closest_where), by trying every triangle.
pub fn closest_where_brute(
    triangles: &[[Vec3; 3]],
    ray: &Ray,
    mut accept: impl FnMut(u32, f32, f32, bool) -> bool,
) -> Option<Hit> {
    let prepared = Prepared::new(ray, bounds_of(triangles)?)?;
    let mut best: Option<Hit> = None;
    for hit in hits(&prepared, triangles) {
        let nearer = best.is_none_or(|b| hit.precedes(prepared.tie, b.key(prepared.tie), b.triangle));
        if nearer && accept(hit.triangle, hit.u, hit.v, hit.back) {
            best = Some(hit);
        }
    }
    best
}

/// As [`Tree::blocked`](crate::Tree::blocked), by trying every triangle.
pub fn blocked_brute(triangles: &[[Vec3; 3]], ray: &Ray) -> bool {
    let Some(prepared) = bounds_of(triangles).and_then(|bounds| Prepared::new(ray, bounds)) else { return false };
    hits(&prepared, triangles).next().is_some()
}

fn hits<'a>(prepared: &'a Prepared, triangles: &'a [[Vec3; 3]]) -> impl Iterator<Item = Hit> + 'a {
    triangles
        .iter()
        .enumerate()
        .filter(|(_, corners)| corners.iter().all(|c| c.is_finite()))
        .filter_map(|(i, corners)| prepared.hit(corners.map(|c| c.to_array()), i as u32))
}
