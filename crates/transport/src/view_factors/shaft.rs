//! Shafts: does a panel stand between two convex sets, wholly, partly or not at all?
//!
//! What lies between two sets is the convex hull of both (Haines and Wallace 1991, "Shaft culling"). It meets the plane
//! of a panel in the hull of the points where segments between corners cross it. If that misses the panel, nothing is
//! blocked; if it lies within the panel and the sets lie on either side, everything is. Both are proofs.

use super::panel::Panel;
use glam::{DVec2, DVec3};
use smallvec::SmallVec;

/// What a panel does to the light between two sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stands {
    /// It is proven to block nothing.
    Aside,
    /// It may block a part.
    Between,
    /// It is proven to block all.
    Across,
}

/// How closely to look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// By the edges of the panel: some panels aside count as between.
    Rough,
    /// By the edges of the hull, too.
    Close,
}

/// What `panel` does to segments from the hull of `from` to that of `to`. `touch` is the distance below which points
/// count as lying on a plane.
pub fn stands(panel: &Panel, from: &[DVec3], to: &[DVec3], touch: f64, look: Look) -> Stands {
    let heights = |points: &[DVec3]| -> SmallVec<[f64; 8]> { points.iter().map(|p| panel.height(*p)).collect() };
    let (a, b) = (heights(from), heights(to));
    let side = |h: &[f64]| (h.iter().all(|h| *h >= -touch), h.iter().all(|h| *h <= touch));
    let ((a_above, a_below), (b_above, b_below)) = (side(&a), side(&b));
    if (a_above && b_above) || (a_below && b_below) {
        return Stands::Aside;
    }

    // Where segments cross the plane, in its own coordinates.
    let flat = |points: &[DVec3]| -> SmallVec<[DVec2; 8]> { points.iter().map(|p| panel.flat(*p)).collect() };
    let (from, to) = (flat(from), flat(to));
    let mut crossings: SmallVec<[DVec2; 64]> = SmallVec::new();
    // Corners in the plane are met there, and a crossing next to one may get lost in rounding.
    for (points, heights) in [(&from, &a), (&to, &b)] {
        crossings.extend(points.iter().zip(heights).filter(|(_, h)| h.abs() <= touch).map(|(p, _)| *p));
    }
    let mut cross = |p: DVec2, hp: f64, q: DVec2, hq: f64| {
        if (hp > 0.0) != (hq > 0.0) {
            crossings.push(p + hp / (hp - hq) * (q - p));
        }
    };
    for (p, hp) in from.iter().zip(&a) {
        for (q, hq) in to.iter().zip(&b) {
            cross(*p, *hp, *q, *hq);
        }
    }
    let parted = (a_above && b_below) || (a_below && b_above);
    if !parted {
        for (points, heights) in [(&from, &a), (&to, &b)] {
            for i in 0..points.len() {
                for k in 0..i {
                    cross(points[i], heights[i], points[k], heights[k]);
                }
            }
        }
    }
    if crossings.is_empty() {
        return Stands::Aside;
    }

    let corners = panel.outline();
    let mut all_within = true;
    for (i, &c) in corners.iter().enumerate() {
        let edge = corners[(i + 1) % corners.len()] - c;
        let length = edge.length();
        let (mut nearest, mut farthest) = (f64::INFINITY, f64::NEG_INFINITY);
        for p in &crossings {
            let inside = edge.perp_dot(*p - c);
            (nearest, farthest) = (nearest.min(inside), farthest.max(inside));
        }
        if farthest <= touch * length {
            return Stands::Aside;
        }
        all_within &= nearest >= 0.0;
    }
    if all_within && parted {
        return Stands::Across;
    }
    let is_aside = look == Look::Close && is_parted_by_hull(&mut crossings, corners, touch);
    if is_aside { Stands::Aside } else { Stands::Between }
}

/// Whether an edge of the hull of `points` parts it from the polygon `corners`.
fn is_parted_by_hull(points: &mut SmallVec<[DVec2; 64]>, corners: &[DVec2], touch: f64) -> bool {
    // The hull, counter-clockwise (Andrew 1979).
    points.sort_unstable_by(|p, q| p.x.total_cmp(&q.x).then(p.y.total_cmp(&q.y)));
    let mut hull: SmallVec<[DVec2; 32]> = SmallVec::new();
    for pass in 0..2 {
        let start = hull.len();
        for k in 0..points.len() {
            let p = points[if pass == 0 { k } else { points.len() - 1 - k }];
            while hull.len() >= start + 2 {
                let [a, b] = [hull[hull.len() - 2], hull[hull.len() - 1]];
                if (b - a).perp_dot(p - a) > 0.0 {
                    break;
                }
                hull.pop();
            }
            hull.push(p);
        }
        hull.pop();
    }
    (0..hull.len()).any(|i| {
        let (a, edge) = (hull[i], hull[(i + 1) % hull.len()] - hull[i]);
        let reach = touch * edge.length();
        edge != DVec2::ZERO && corners.iter().all(|c| edge.perp_dot(*c - a) <= reach)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(z: f64, low: [f64; 2], high: [f64; 2]) -> Vec<DVec3> {
        let p = |x: f64, y: f64| DVec3::new(x, y, z);
        vec![p(low[0], low[1]), p(high[0], low[1]), p(high[0], high[1]), p(low[0], high[1])]
    }

    fn panel(corners: Vec<DVec3>) -> Panel {
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
        Panel::new(corners, normal)
    }

    #[test]
    fn a_panel_is_aside_between_or_across() {
        let (a, b) = (square(0., [0., 0.], [1., 1.]), square(2., [0., 0.], [1., 1.]));
        let is =
            |low: [f64; 2], high: [f64; 2], z: f64| stands(&panel(square(z, low, high)), &a, &b, 1e-7, Look::Close);
        assert_eq!(is([-0.1, -0.1], [1.1, 1.1], 1.0), Stands::Across);
        assert_eq!(is([0.0, 0.0], [1.0, 1.0], 1.0), Stands::Across);
        assert_eq!(is([0.1, 0.0], [1.0, 1.0], 1.0), Stands::Between);
        assert_eq!(is([1.0, 0.0], [2.0, 1.0], 1.0), Stands::Aside);
        assert_eq!(is([0.2, 0.2], [0.8, 0.8], 3.0), Stands::Aside);
        assert_eq!(is([0.2, 0.2], [0.8, 0.8], 2.0), Stands::Aside);
    }

    /// A panel near the slanting rim of the hull: its own edges do not part it from the hull, the hull's do.
    #[test]
    fn the_hull_parts_what_the_panel_does_not() {
        let (a, b) = (square(0., [0., 0.], [1., 1.]), square(2., [0., 0.], [1., 1.]));
        let p = |x: f64, y: f64| DVec3::new(x, y, 1.0);
        let aside = panel(vec![p(0.5, -0.1), p(1.1, 0.5), p(1.5, -0.5)]);
        assert_eq!(stands(&aside, &a, &b, 1e-7, Look::Close), Stands::Between);
        let aside = panel(vec![p(0.95, -0.2), p(1.2, 0.05), p(1.5, -0.5)]);
        assert_eq!(stands(&aside, &a, &b, 1e-7, Look::Close), Stands::Aside);
    }

    /// Where a panel cuts a set itself, nothing is proven but that it may matter.
    #[test]
    fn a_panel_through_a_set_is_between() {
        let (a, b) = (square(0., [0., 0.], [1., 1.]), square(2., [0., 0.], [1., 1.]));
        let through = panel(vec![
            DVec3::new(0.5, 0., -1.),
            DVec3::new(0.5, 1., -1.),
            DVec3::new(0.5, 1., 1.),
            DVec3::new(0.5, 0., 1.),
        ]);
        assert_eq!(stands(&through, &a, &b, 1e-7, Look::Close), Stands::Between);
    }
}
