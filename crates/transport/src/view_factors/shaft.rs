//! Shafts: does a panel stand between two convex sets, wholly, partly or not at all?
//!
//! What lies between two sets is the convex hull of both (Haines and Wallace 1991, "Shaft culling"). It meets the plane
//! of a panel in the hull of the points where segments between corners cross it. If that misses the panel, nothing is
//! blocked; if it lies within the panel and the sets lie on either side, everything is. Both are proofs, to within `touch`:
//! the distance below which points count as lying on a plane.

use super::panel::Panel;
use super::part::CORNERS;
use super::visible::{Loop, keep_above};
use glam::DVec3;
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
    /// By the sides of the hull, too. The two sets must be polygons.
    Close,
}

/// Corners of an end at most: those of a box, or of a part with a corner cut off.
const MOST: usize = if CORNERS + 1 > 8 { CORNERS + 1 } else { 8 };

/// Corners whose heights above a plane are asked for. Nearly all ends have four, and loops whose length is known take a third
/// of the time.
trait Corners {
    type Heights: AsRef<[f64]>;

    fn over(&self, plane: (DVec3, f64)) -> Self::Heights;
}

impl Corners for [DVec3; 4] {
    type Heights = [f64; 4];

    #[inline(always)]
    fn over(&self, (normal, offset): (DVec3, f64)) -> [f64; 4] {
        let [a, b, c, d] = self;
        [normal.dot(*a) - offset, normal.dot(*b) - offset, normal.dot(*c) - offset, normal.dot(*d) - offset]
    }
}

impl Corners for [DVec3] {
    type Heights = SmallVec<[f64; MOST]>;

    fn over(&self, (normal, offset): (DVec3, f64)) -> SmallVec<[f64; MOST]> {
        self.iter().map(|corner| normal.dot(*corner) - offset).collect()
    }
}

#[inline(always)]
fn least(heights: &[f64]) -> f64 {
    heights.iter().fold(f64::INFINITY, |least, h| if *h < least { *h } else { least })
}

#[inline(always)]
fn most(heights: &[f64]) -> f64 {
    heights.iter().fold(f64::NEG_INFINITY, |most, h| if *h > most { *h } else { most })
}

/// A plane: a normal n, n · x of its points, and n · x by which points count as lying on it.
type Plane = (DVec3, f64, f64);

/// What lies between two convex sets.
#[derive(Clone, Debug)]
pub struct Shaft<'a> {
    /// Corners of either.
    ends: [&'a [DVec3]; 2],
    /// Normals, if they are polygons: their corners run counter-clockwise about them. Zero for boxes.
    normals: [DVec3; 2],
    /// Distance below which points count as lying on a plane.
    touch: f64,
    /// Sides of the hull that join both, and those ends that are sides; normals outwards. Found when first asked for.
    sides: Option<SmallVec<[Plane; 12]>>,
}

impl<'a> Shaft<'a> {
    /// The shaft between two sets; the normals of boxes are zero.
    pub fn new(ends: [&'a [DVec3]; 2], normals: [DVec3; 2], touch: f64) -> Shaft<'a> {
        debug_assert!(ends.iter().all(|end| end.len() <= MOST));
        Shaft { ends, normals, touch, sides: None }
    }

    /// What `panel` does to the segments from one end to the other.
    pub fn stands(&mut self, panel: &Panel, look: Look) -> Stands {
        let [a, b] = self.ends;
        let found = match (a.try_into(), b.try_into()) {
            (Ok(a), Ok(b)) => self.by_edges::<[DVec3; 4]>(panel, a, b),
            _ => self.by_edges(panel, a, b),
        };
        let is_beside = |(outwards, offset, reach): &Plane| {
            let least = offset - reach;
            panel.corners.iter().all(|c| outwards.dot(*c) >= least)
        };
        let is_open = found == Stands::Between && look == Look::Close && !self.is_hit(panel);
        let is_aside = is_open && self.sides().iter().any(is_beside);
        if is_aside { Stands::Aside } else { found }
    }

    /// Whether a panel stands between the middles of both ends.
    fn is_hit(&self, panel: &Panel) -> bool {
        let [a, b] = self.ends.map(|end| end.iter().sum::<DVec3>() / end.len() as f64);
        let (h, k) = (panel.height(a), panel.height(b));
        let share = h / (h - k);
        let place = a + share * (b - a);
        share > 0.0
            && share < 1.0
            && panel.rims.iter().all(|(inwards, offset)| inwards.dot(place) > offset + self.touch)
    }

    /// What `panel` does, by its edges.
    #[inline(always)]
    fn by_edges<C: Corners + ?Sized>(&self, panel: &Panel, a_end: &C, b_end: &C) -> Stands {
        let touch = self.touch;
        let plane = (panel.normal, panel.offset);
        let (a, b) = (a_end.over(plane), b_end.over(plane));
        let (a, b) = (a.as_ref(), b.as_ref());
        let side = |h: &[f64]| (least(h) >= -touch, most(h) <= touch);
        let ((a_above, a_below), (b_above, b_below)) = (side(a), side(b));
        if (a_above && b_above) || (a_below && b_below) {
            return Stands::Aside;
        }
        let is_parted = (a_above && b_below) || (a_below && b_above);
        let mut all_within = true;
        for &rim in &panel.rims {
            let (e, f) = (a_end.over(rim), b_end.over(rim));
            let (e, f) = (e.as_ref(), f.as_ref());
            // What is joined lies between its ends: where those lie on one side of the edge, segments need not be looked at.
            if most(e) <= touch && most(f) <= touch {
                return Stands::Aside;
            }
            let is_within = least(e) >= -touch && least(f) >= -touch;
            let mut crossings = Crossings { touch, outside: true, within: true, is_within };
            crossings.between([a, b], [e, f]);
            if !is_parted {
                crossings.between([a, a], [e, e]);
                crossings.between([b, b], [f, f]);
            }
            crossings.in_plane(a, e);
            crossings.in_plane(b, f);
            if crossings.outside {
                return Stands::Aside;
            }
            all_within &= crossings.within;
        }
        // What lies in the panel itself looks away from it: a polygon only touches it there, a box may hold whole
        // parts.
        let is_off = |end: usize, h: &[f64]| self.normals[end] != DVec3::ZERO || h.iter().all(|h| h.abs() > touch);
        if all_within && is_parted && is_off(0, a) && is_off(1, b) {
            return Stands::Across;
        }
        Stands::Between
    }

    /// What of a panel lies in the shaft between two polygons; empty if nothing.
    pub fn part_of(&mut self, panel: &Panel) -> Loop {
        let mut part: Loop = panel.corners.iter().copied().collect();
        for (outwards, offset, _) in self.sides() {
            if !keep_above(&mut part, -*outwards, -offset) {
                return Loop::new();
            }
        }
        part
    }

    fn sides(&mut self) -> &[Plane] {
        let Shaft { ends, normals, touch, .. } = *self;
        self.sides.get_or_insert_with(|| sides(ends, normals, touch))
    }
}

/// Where the segments between corners cross the plane of a panel: all outside of an edge, or all within it.
struct Crossings {
    touch: f64,
    outside: bool,
    within: bool,
    /// Whether they are known to be within.
    is_within: bool,
}

impl Crossings {
    /// Segments between two sets of corners, by their heights above the plane and their distances within the edge.
    #[inline(always)]
    fn between(&mut self, heights: [&[f64]; 2], inside: [&[f64]; 2]) {
        for (a, e) in heights[0].iter().zip(inside[0]) {
            for (b, f) in heights[1].iter().zip(inside[1]) {
                if (*a > 0.0) != (*b > 0.0) {
                    let (length, within) = if *a > 0.0 { (a - b, a * f - b * e) } else { (b - a, b * e - a * f) };
                    self.outside &= within <= self.touch * length;
                    self.within &= within >= -self.touch * length;
                }
            }
            if !self.outside && (self.is_within || !self.within) {
                self.within |= self.is_within;
                return;
            }
        }
    }

    /// Corners in the plane are met there, and a crossing next to one may get lost in rounding.
    #[inline(always)]
    fn in_plane(&mut self, heights: &[f64], inside: &[f64]) {
        for (_, e) in heights.iter().zip(inside).filter(|(h, _)| h.abs() <= self.touch) {
            self.outside &= *e <= self.touch;
            self.within &= *e >= -self.touch;
        }
    }
}

/// The sides of the hull of two polygons that join both, and those of the polygons that are sides of it.
fn sides(ends: [&[DVec3]; 2], normals: [DVec3; 2], touch: f64) -> SmallVec<[Plane; 12]> {
    let mut sides = SmallVec::new();
    for (own, other, normal) in [(ends[0], ends[1], normals[0]), (ends[1], ends[0], normals[1])] {
        let heights: SmallVec<[f64; MOST]> = other.iter().map(|q| normal.dot(*q - own[0])).collect();
        let (low, high) = heights.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
        if low >= -touch {
            sides.push((-normal, -normal.dot(own[0]), touch));
        }
        if high <= touch {
            sides.push((normal, normal.dot(own[0]), touch));
        }
        // Seen along an edge, the polygon and what lies above it span a wedge; so do the polygon and what lies below.
        for (turn, is_there) in [(1.0, high > touch), (-1.0, low < -touch)] {
            if !is_there {
                continue;
            }
            for (i, &p) in own.iter().enumerate() {
                let along = turn * (own[(i + 1) % own.len()] - p);
                let (mut side, mut of) = (DVec3::ZERO, 0.0);
                for (&q, height) in other.iter().zip(&heights) {
                    if side == DVec3::ZERO || side.dot(q - p) > 0.0 {
                        (side, of) = (along.cross(q - p), turn * height);
                    }
                }
                // What lies on the polygon's own side of the edge stays behind a plane that rises from it.
                let reach = touch * side.length();
                if of >= 0.0 && reach > 0.0 && other.iter().all(|x| side.dot(*x - p) <= reach) {
                    sides.push((side, side.dot(p), reach));
                }
            }
        }
    }
    sides
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

    fn stands(panel: &Panel, a: &[DVec3], b: &[DVec3], look: Look) -> Stands {
        Shaft::new([a, b], [DVec3::Z, DVec3::Z], 1e-7).stands(panel, look)
    }

    #[test]
    fn a_panel_is_aside_between_or_across() {
        let (a, b) = (square(0., [0., 0.], [1., 1.]), square(2., [0., 0.], [1., 1.]));
        let is = |low: [f64; 2], high: [f64; 2], z: f64| stands(&panel(square(z, low, high)), &a, &b, Look::Close);
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
        assert_eq!(stands(&aside, &a, &b, Look::Close), Stands::Between);
        let aside = panel(vec![p(0.95, -0.2), p(1.2, 0.05), p(1.5, -0.5)]);
        assert_eq!(stands(&aside, &a, &b, Look::Close), Stands::Aside);
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
        assert_eq!(stands(&through, &a, &b, Look::Close), Stands::Between);
    }
}
