//! What a point sees of polygons past other polygons, cut out exactly: the visible part of Nusselt's analog.
//!
//! The shadow of a convex blocker is the pyramid of the planes through the point and the blocker's edges, beyond the
//! blocker. A convex polygon is cut along each plane in turn; what lies outside one of them, or before the blocker, is
//! seen; what is left after all is hidden (Weiler and Atherton 1977, by way of planes in space).

use crate::polygon::{above, point_to_polygon, twice_area};
use glam::DVec3;

/// Distance from a plane below which a corner is in it, relative to the distance from the point: rounding.
const TOUCH: f64 = 1e-13;

/// Most blockers that a polygon is cut by; pieces cost evaluations each.
const CUTS: usize = 8;

/// The form factor from the differential area at a point with unit `normal` to what it sees of convex polygons past
/// convex blockers.
pub fn seen(point: DVec3, normal: DVec3, polygons: &[Vec<DVec3>], blockers: &[&[DVec3]]) -> f64 {
    polygons.iter().map(|polygon| seen_of(point, normal, polygon, blockers)).sum()
}

/// Convex polygons cut along the planes of blockers that stand on them or go through them: across such lines the view
/// jumps.
pub fn cut_where_standing(polygons: &[Vec<DVec3>], plane: (DVec3, DVec3), blockers: &[&[DVec3]]) -> Vec<Vec<DVec3>> {
    let (origin, normal) = plane;
    let stands = |blocker: &&&[DVec3]| {
        let size = blocker.iter().map(|c| c.distance(origin)).fold(0.0, f64::max);
        let heights = || blocker.iter().map(|c| (*c - origin).dot(normal));
        heights().any(|h| h > 1e-9 * size) && heights().any(|h| h < 1e-9 * size)
    };
    let mut parts = polygons.to_vec();
    for blocker in blockers.iter().filter(stands).take(CUTS) {
        let Some(across) = twice_area(blocker).try_normalize() else { continue };
        let halves = |part: &Vec<DVec3>| split(part, across, blocker[0].dot(across));
        parts = parts.iter().flat_map(halves).filter(|part| part.len() > 2).collect();
    }
    parts
}

fn seen_of(point: DVec3, normal: DVec3, polygon: &[DVec3], blockers: &[&[DVec3]]) -> f64 {
    let pieces = visible(point, polygon, blockers);
    pieces.iter().map(|piece| point_to_polygon(DVec3::ZERO, normal, piece)).sum()
}

/// The convex pieces, relative to the point, that the point sees of a convex polygon past convex blockers.
pub fn visible(point: DVec3, polygon: &[DVec3], blockers: &[&[DVec3]]) -> Vec<Vec<DVec3>> {
    let mut pieces = vec![polygon.iter().map(|c| *c - point).collect::<Vec<_>>()];
    for blocker in blockers {
        // Relative to the point, and turned so that its normal points away from it.
        let corners: Vec<DVec3> = blocker.iter().map(|c| *c - point).collect();
        let Some(normal) = twice_area(&corners).try_normalize() else { continue };
        let height = normal.dot(corners[0]);
        if height.abs() <= TOUCH * corners[0].length() {
            continue;
        }
        let side = height.signum();
        let n = corners.len();
        // Planes that the hidden part is on the positive side of, the blocker's own first.
        let own = (side * normal, side * height);
        let edges = (0..n).map(|i| (side * corners[i].cross(corners[(i + 1) % n]).normalize_or_zero(), 0.0));
        let planes: Vec<(DVec3, f64)> = std::iter::once(own).chain(edges).collect();
        let mut left = Vec::with_capacity(pieces.len());
        for piece in pieces {
            without(piece, &planes, &mut left);
        }
        pieces = left;
    }
    pieces
}

/// Adds what of a convex piece is outside the intersection of half spaces; whole where the intersection misses it.
fn without(piece: Vec<DVec3>, planes: &[(DVec3, f64)], left: &mut Vec<Vec<DVec3>>) {
    let before = left.len();
    let mut rest = piece.clone();
    for (normal, offset) in planes {
        let [inside, outside] = split(&rest, *normal, *offset);
        if inside.is_empty() {
            left.truncate(before);
            left.push(piece);
            return;
        }
        if !outside.is_empty() {
            left.push(outside);
        }
        rest = inside;
    }
}

/// The parts of a convex polygon where p · normal is above and below `offset`; empty where there is none.
fn split(polygon: &[DVec3], normal: DVec3, offset: f64) -> [Vec<DVec3>; 2] {
    let height = |p: DVec3| {
        let height = p.dot(normal) - offset;
        if height.abs() <= TOUCH * p.length() { 0.0 } else { height }
    };
    let heights: Vec<f64> = polygon.iter().map(|p| height(*p)).collect();
    if heights.iter().all(|h| *h <= 0.0) {
        return [Vec::new(), polygon.to_vec()];
    }
    if heights.iter().all(|h| *h >= 0.0) {
        return [polygon.to_vec(), Vec::new()];
    }
    let below: Vec<f64> = heights.iter().map(|h| -h).collect();
    [above(polygon, &heights), above(polygon, &below)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(low: f64, high: f64, z: f64) -> Vec<DVec3> {
        [[low, low], [low, high], [high, high], [high, low]].iter().map(|[x, y]| DVec3::new(*x, *y, z)).collect()
    }

    /// The shadow of a square halfway is twice as large; overlapping blockers count once.
    #[test]
    fn shadows_are_cut_exactly() {
        let target = [square(-1.0, 1.0, 2.0)];
        let see = |blockers: &[&[DVec3]]| seen(DVec3::ZERO, DVec3::Z, &target, blockers);
        let free = see(&[]);
        let hole = point_to_polygon(DVec3::ZERO, DVec3::Z, &square(-0.5, 0.5, 2.0));
        let small = square(-0.25, 0.25, 1.0);
        let back: Vec<DVec3> = small.iter().rev().copied().collect();
        assert!((see(&[&small]) - (free - hole)).abs() < 1e-15);
        assert!((see(&[&back, &small, &square(-0.1, 0.1, 0.8)]) - (free - hole)).abs() < 1e-15);
        assert_eq!(see(&[&square(-0.6, 0.6, 1.0)]), 0.0);
        assert_eq!(see(&[&square(-0.6, 0.6, 2.5), &square(-0.6, 0.6, -1.0), &square(0.7, 0.9, 1.0)]), free);
        // An upright blocker that pierces the target hides what is behind its nearer part only.
        let fin: Vec<DVec3> =
            [[1., 1.], [1., 3.], [-1., 3.], [-1., 1.]].iter().map(|[y, z]| DVec3::new(0.5, *y, *z)).collect();
        let beyond: Vec<DVec3> =
            [[0.5, -1.], [0.5, 1.], [1., 1.], [1., -1.]].iter().map(|[x, y]| DVec3::new(*x, *y, 2.0)).collect();
        let hidden = point_to_polygon(DVec3::ZERO, DVec3::Z, &beyond);
        assert!((see(&[&fin]) - (free - hidden)).abs() < 1e-15, "{} {free} {hidden}", see(&[&fin]));
    }
}
