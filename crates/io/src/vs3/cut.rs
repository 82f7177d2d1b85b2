//! A convex polygon without the convex polygons that lie in it, as convex pieces.
//!
//! Each hole is taken out of every piece that it touches, edge by edge: what lies outside the edge's line is a piece, what
//! lies inside goes on to the next edge, and what is left after the last edge is hole. Pieces touch and do not overlap.

use glam::DVec3;
use radiosity_scene::Facet;

/// Distance within which points and lines are one, relative to the radius of the polygon. Thousands of roundings of
/// double precision are smaller, and pieces this thin have no part in any form factor.
const SAME: f64 = 1e-9;

/// Most pieces for each hole. A window takes 4, touching ones fewer; rows of tall and wide holes could ask for the square of
/// their number.
const MAX_PIECES: usize = 16;

/// What is left of a polygon.
#[derive(Debug)]
pub(super) struct Cut {
    /// Convex pieces of the polygon's orientation.
    pub pieces: Vec<Facet>,
    /// The area of each hole that was not there to take away: outside the polygon or in another hole, m². Within
    /// `rim` of its outline that is no matter; with more, the hole is not cut.
    pub missing: Vec<f64>,
}

/// Cuts holes that lie in the plane of a convex polygon out of it, facing either way. `None` where that takes more pieces
/// than [`MAX_PIECES`] allows.
pub(super) fn cut(facet: &Facet, holes: &[&Facet], rim: f64) -> Option<Cut> {
    if holes.is_empty() {
        return Some(Cut { pieces: vec![facet.clone()], missing: Vec::new() });
    }
    let (normal, same) = (facet.normal(), SAME * facet.radius());
    // Corners that are off the plane by more than rounding are moved into it, so that small pieces are planar as well.
    let flat = |corner: &DVec3| {
        let height = facet.height(*corner);
        if height.abs() > same { *corner - height * normal } else { *corner }
    };
    let whole = Piece::new(facet.corners().iter().map(flat).collect());
    let mut known = whole.corners.clone();
    let mut pieces = vec![whole];
    let mut missing = Vec::with_capacity(holes.len());
    for hole in holes {
        let mut corners: Vec<DVec3> = hole.corners().iter().map(flat).collect();
        if hole.normal().dot(normal) < 0.0 {
            corners.reverse();
        }
        let (area, around) = (hole.area(), hole.edges().map(|[a, b]| a.distance(b)).sum::<f64>());
        let hole = Piece::new(corners);
        let parts: Vec<_> = pieces.iter().map(|piece| piece.without(&hole, normal, same)).collect();
        let removed: f64 = parts.iter().flatten().map(|(_, inside)| inside.area(normal)).sum();
        if area - removed > rim * around {
            missing.push(area - removed);
            continue;
        }
        missing.push(0.0);
        let mut left = Vec::with_capacity(pieces.len() + 4);
        for (piece, parts) in pieces.into_iter().zip(parts) {
            match parts {
                Some((outside, _)) => left.extend(outside),
                None => left.push(piece),
            }
        }
        pieces = left;
        if pieces.len() > MAX_PIECES * (holes.len() + 4) {
            return None;
        }
        known.extend(hole.corners);
    }

    // A corner where two cuts meet is the hole's own corner up to rounding, and shall be that corner.
    known.sort_by(|a, b| a.x.total_cmp(&b.x));
    let snap = |corner: DVec3| {
        let from = known.partition_point(|k| k.x < corner.x - same);
        let near = known[from..].iter().take_while(|k| k.x <= corner.x + same);
        near.copied().find(|k| k.distance(corner) <= same).unwrap_or(corner)
    };
    let facet = |piece: Piece| {
        let mut corners: Vec<DVec3> = piece.corners.into_iter().map(snap).collect();
        corners.dedup();
        Facet::new(corners).ok()
    };
    Some(Cut { pieces: pieces.into_iter().filter_map(facet).collect(), missing })
}

/// A convex polygon on its way, with the box around it.
struct Piece {
    corners: Vec<DVec3>,
    low: DVec3,
    high: DVec3,
}

impl Piece {
    fn new(corners: Vec<DVec3>) -> Piece {
        let low = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        Piece { corners, low, high }
    }

    fn area(&self, normal: DVec3) -> f64 {
        let origin = self.corners[0];
        let fan = self.corners[1..].windows(2);
        0.5 * fan.map(|pair| (pair[0] - origin).cross(pair[1] - origin).dot(normal)).sum::<f64>()
    }

    /// What of this lies outside a hole, in pieces, and what inside; `None` where they have no area in common.
    fn without(&self, hole: &Piece, normal: DVec3, same: f64) -> Option<(Vec<Piece>, Piece)> {
        if self.low.cmpgt(hole.high + same).any() || self.high.cmplt(hole.low - same).any() {
            return None;
        }
        let mut outside = Vec::new();
        let mut inside = self.corners.clone();
        for i in 0..hole.corners.len() {
            let (a, b) = (hole.corners[i], hole.corners[(i + 1) % hole.corners.len()]);
            let (within, beyond) = split(&inside, a, normal.cross(b - a).normalize_or_zero(), same);
            outside.extend(beyond.map(Piece::new));
            inside = within?;
        }
        Some((outside, Piece::new(inside)))
    }
}

/// The parts of a convex polygon on the side of a line to which `inwards` points, and on the other.
fn split(corners: &[DVec3], origin: DVec3, inwards: DVec3, same: f64) -> (Option<Vec<DVec3>>, Option<Vec<DVec3>>) {
    let side = |corner: &DVec3| {
        let distance = (*corner - origin).dot(inwards);
        if distance.abs() <= same { 0.0 } else { distance }
    };
    let sides: Vec<f64> = corners.iter().map(side).collect();
    let some_inside = sides.iter().any(|s| *s > 0.0);
    let some_outside = sides.iter().any(|s| *s < 0.0);
    if !(some_inside && some_outside) {
        return (some_inside.then(|| corners.to_vec()), some_outside.then(|| corners.to_vec()));
    }
    let (mut inside, mut outside) = (Vec::new(), Vec::new());
    for i in 0..corners.len() {
        let next = (i + 1) % corners.len();
        let (s, t) = (sides[i], sides[next]);
        if s >= 0.0 {
            inside.push(corners[i]);
        }
        if s <= 0.0 {
            outside.push(corners[i]);
        }
        if s * t < 0.0 {
            let crossing = corners[i].lerp(corners[next], s / (s - t));
            inside.push(crossing);
            outside.push(crossing);
        }
    }
    (Some(inside), Some(outside))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facet(points: &[[f64; 2]]) -> Facet {
        // In a slanted plane, far from the origin.
        let (x, y) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(-0.64, 0.6, 0.48));
        Facet::new(points.iter().map(|p| DVec3::new(20.0, -30.0, 7.0) + p[0] * x + p[1] * y).collect()).unwrap()
    }

    fn rectangle(x: [f64; 2], y: [f64; 2]) -> Facet {
        facet(&[[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]])
    }

    fn area(facets: &[Facet]) -> f64 {
        facets.iter().map(Facet::area).sum()
    }

    /// Whether the pieces cover the polygon outside its holes once: right area, right places, right side.
    fn check(wall: &Facet, holes: &[&Facet]) -> Vec<Facet> {
        let Cut { pieces, missing } = cut(wall, holes, 1e-12).unwrap();
        let expected = wall.area() - holes.iter().map(|h| h.area()).sum::<f64>();
        assert!((area(&pieces) - expected).abs() < 1e-12 * wall.area(), "{} of {expected}", area(&pieces));
        assert_eq!(missing, vec![0.0; holes.len()]);
        // A hole that is nowhere in the pieces is missing whole, a piece of the wall nowhere.
        for hole in holes {
            let missed = pieces.iter().map(|p| cut(p, &[hole], 0.0).unwrap().missing[0]);
            assert!(missed.into_iter().all(|missed| (missed - hole.area()).abs() < 1e-12 * wall.area()));
        }
        for piece in &pieces {
            assert!(piece.is_convex() && piece.normal().distance(wall.normal()) < 1e-12);
            assert_eq!(cut(wall, &[piece], 1e-12).unwrap().missing, [0.0]);
        }
        pieces
    }

    #[test]
    fn a_window_leaves_four_pieces_with_its_own_corners() {
        let (wall, window) = (rectangle([0., 6.], [0., 3.]), rectangle([1., 2.], [1., 2.]));
        let pieces = check(&wall, &[&window]);
        assert_eq!(pieces.len(), 4);
        for corner in window.corners() {
            assert!(pieces.iter().any(|p| p.corners().contains(corner)), "{corner}");
        }
        assert_eq!(check(&wall, &[&window.flipped()]).len(), 4);
    }

    #[test]
    fn holes_may_touch_edges_corners_and_each_other() {
        let wall = rectangle([0., 6.], [0., 3.]);
        assert_eq!(check(&wall, &[&rectangle([1., 2.], [0., 2.])]).len(), 3);
        assert_eq!(check(&wall, &[&rectangle([0., 2.], [0., 2.])]).len(), 2);
        check(&wall, &[&rectangle([1., 2.], [1., 2.]), &rectangle([2., 3.], [1., 2.]), &rectangle([3., 4.], [2., 3.])]);
        assert!(check(&wall, &[&rectangle([0., 6.], [0., 1.]), &rectangle([0., 6.], [1., 3.])]).is_empty());
        let triangle = facet(&[[3., 0.5], [5., 1.], [3.5, 2.9]]);
        check(&wall, &[&triangle, &rectangle([0.1, 0.9], [0.3, 2.9])]);
        check(&facet(&[[0., 0.], [7., 0.], [3., 5.]]), &[&rectangle([2., 3.], [0., 2.])]);
    }

    #[test]
    fn a_facade_of_windows_is_covered() {
        let wall = rectangle([0., 1.], [0., 1.]);
        let at = |i: usize| (i as f64 * 10.0 + 1.0) / 101.0;
        let window = |i: usize| rectangle([at(i % 10), at(i % 10) + 0.05], [at(i / 10), at(i / 10) + 0.07]);
        let windows: Vec<Facet> = (0..100).map(window).collect();
        let pieces = check(&wall, &windows.iter().collect::<Vec<_>>());
        assert!(pieces.len() < 500, "{}", pieces.len());
    }

    #[test]
    fn holes_that_overlap_or_reach_out_are_not_cut() {
        let wall = rectangle([0., 6.], [0., 3.]);
        let holes = [rectangle([1., 3.], [1., 2.]), rectangle([2., 7.], [1., 2.]), rectangle([5., 6.], [0., 1.])];
        let Cut { pieces, missing } = cut(&wall, &holes.each_ref(), 1e-12).unwrap();
        assert!((missing[1] - 2.0).abs() < 1e-12 && missing[0] + missing[2] == 0.0, "{missing:?}");
        assert!((area(&pieces) - 15.0).abs() < 1e-12);
        assert_eq!(cut(&wall, &holes.each_ref(), 1.0).unwrap().missing, [0.0; 3]);
    }

    #[test]
    fn pieces_do_not_grow_with_the_square_of_the_holes() {
        let wall = rectangle([0., 1.], [0., 1.]);
        let at = |i: usize| (i as f64 + 0.3) / 100.0;
        let dots = (0..100).rev().map(|i| rectangle([0.1, 0.101], [at(i), at(i) + 0.004]));
        let strips = (30..100).map(|i| rectangle([at(i), at(i) + 0.004], [0., 1.]));
        let holes: Vec<Facet> = dots.chain(strips).collect();
        assert!(cut(&wall, &holes.iter().collect::<Vec<_>>(), 1e-12).is_none());
    }
}
