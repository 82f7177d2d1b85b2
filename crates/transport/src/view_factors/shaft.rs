//! Shafts: does a panel stand between two convex sets, wholly, partly or not at all?
//!
//! What lies between two sets is the convex hull of both (Haines and Wallace 1991, "Shaft culling"). It meets the plane
//! of a panel in the hull of the points where segments between corners cross it. If that misses the panel, nothing is
//! blocked; if it lies within the panel and the sets lie on either side, everything is. Both are proofs, to within `touch`:
//! the distance below which points count as lying on a plane.

use super::panel::Panel;
use super::part::CORNERS;
use super::visible::{Loop, Plane, keep_above};
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

/// Corners whose heights above a plane are asked for. Nearly all ends have four or three, and loops whose length is known take a
/// third of the time.
trait Corners: AsRef<[DVec3]> {
    type Heights: AsRef<[f64]>;

    fn over(&self, plane: Plane) -> Self::Heights;

    /// 1/|h| of heights; of none a number.
    fn inverse(heights: &[f64]) -> Self::Heights;
}

impl<const N: usize> Corners for [DVec3; N] {
    type Heights = [f64; N];

    #[inline(always)]
    fn over(&self, (normal, offset): Plane) -> [f64; N] {
        self.map(|corner| normal.dot(corner) - offset)
    }

    #[inline(always)]
    fn inverse(heights: &[f64]) -> [f64; N] {
        std::array::from_fn(|k| inverse(heights[k]))
    }
}

impl Corners for [DVec3] {
    type Heights = SmallVec<[f64; MOST]>;

    fn over(&self, (normal, offset): Plane) -> SmallVec<[f64; MOST]> {
        self.iter().map(|corner| normal.dot(*corner) - offset).collect()
    }

    fn inverse(heights: &[f64]) -> SmallVec<[f64; MOST]> {
        heights.iter().map(|h| inverse(*h)).collect()
    }
}

/// Corners of known number.
#[inline(always)]
fn sized<const N: usize>(corners: &[DVec3]) -> &[DVec3; N] {
    corners.try_into().expect("as many as they were matched for")
}

#[inline(always)]
fn inverse(height: f64) -> f64 {
    1.0 / height.abs().max(f64::MIN_POSITIVE)
}

#[inline(always)]
fn least(heights: &[f64]) -> f64 {
    heights.iter().fold(f64::INFINITY, |least, h| if *h < least { *h } else { least })
}

#[inline(always)]
fn most(heights: &[f64]) -> f64 {
    heights.iter().fold(f64::NEG_INFINITY, |most, h| if *h > most { *h } else { most })
}

/// A side of a hull: its normal n outwards, n · x of its points, and n · x by which points count as lying on it.
type Side = (DVec3, f64, f64);

/// What lies between two convex sets.
#[derive(Clone, Debug)]
pub struct Shaft<'a> {
    /// Corners of either.
    ends: [&'a [DVec3]; 2],
    /// Normals, if they are polygons: their corners run counter-clockwise about them. Zero for boxes.
    normals: [DVec3; 2],
    /// Distance below which points count as lying on a plane.
    touch: f64,
    /// Sides of the hull that join both, and those ends that are sides: those that were asked for so far.
    sides: SmallVec<[Side; 12]>,
    /// Of how many ends.
    ends_done: usize,
}

impl<'a> Shaft<'a> {
    /// The shaft between two sets; the normals of boxes are zero.
    pub fn new(ends: [&'a [DVec3]; 2], normals: [DVec3; 2], touch: f64) -> Shaft<'a> {
        debug_assert!(ends.iter().all(|end| end.len() <= MOST));
        Shaft { ends, normals, touch, sides: SmallVec::new(), ends_done: 0 }
    }

    /// What `panel` does to the segments from one end to the other.
    pub fn stands(&mut self, panel: &Panel, look: Look) -> Stands {
        let [a, b] = self.ends;
        let found = match (a, b) {
            ([_, _, _, _], [_, _, _, _]) => self.by_edges(panel, sized::<4>(a), sized::<4>(b)),
            ([_, _, _, _], [_, _, _]) => self.by_edges(panel, sized::<4>(a), sized::<3>(b)),
            ([_, _, _], [_, _, _, _]) => self.by_edges(panel, sized::<3>(a), sized::<4>(b)),
            ([_, _, _], [_, _, _]) => self.by_edges(panel, sized::<3>(a), sized::<3>(b)),
            _ => self.by_edges(panel, a, b),
        };
        let is_open = found == Stands::Between && look == Look::Close && !self.is_hit(panel);
        if is_open && self.is_beside(panel) { Stands::Aside } else { found }
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

    /// Whether some side of the hull has the panel outside.
    fn is_beside(&mut self, panel: &Panel) -> bool {
        let mut asked = 0;
        loop {
            let is_outside = |(outwards, offset, reach): &Side| {
                let least = offset - reach;
                panel.corners.iter().all(|c| outwards.dot(*c) >= least)
            };
            if self.sides[asked..].iter().any(is_outside) {
                return true;
            }
            asked = self.sides.len();
            if !self.find_sides() {
                return false;
            }
        }
    }

    /// What `panel` does, by its edges.
    #[inline(always)]
    fn by_edges<A: Corners + ?Sized, B: Corners + ?Sized>(&self, panel: &Panel, a_end: &A, b_end: &B) -> Stands {
        let touch = self.touch;
        let plane = (panel.normal, panel.offset);
        let (a, b) = (a_end.over(plane), b_end.over(plane));
        let (a, b) = (a.as_ref(), b.as_ref());
        let (a_side, b_side) = ([least(a), most(a)], [least(b), most(b)]);
        let is_above = |[least, _]: [f64; 2]| least >= -touch;
        let is_below = |[_, most]: [f64; 2]| most <= touch;
        if (is_above(a_side) && is_above(b_side)) || (is_below(a_side) && is_below(b_side)) {
            return Stands::Aside;
        }
        let is_parted = (is_above(a_side) && is_below(b_side)) || (is_below(a_side) && is_above(b_side));
        let is_off = |[least, most]: [f64; 2]| least > touch || most < -touch;
        let are_off = is_parted && is_off(a_side) && is_off(b_side);
        let (by_a, by_b) = (A::inverse(a), B::inverse(b));
        let (by_a, by_b) = (by_a.as_ref(), by_b.as_ref());
        let mut all_within = true;
        for &rim in &panel.rims {
            let (e, f) = (a_end.over(rim), b_end.over(rim));
            let (e, f) = (e.as_ref(), f.as_ref());
            // What is joined lies between its ends: where those lie on one side of the edge, segments need not be looked at.
            if most(e) <= touch && most(f) <= touch {
                return Stands::Aside;
            }
            let is_within = least(e) >= -touch && least(f) >= -touch;
            let mut crossings = Crossings { touch, outside: true, within: true };
            if are_off {
                crossings.between(slopes(e, by_a, touch), slopes(f, by_b, touch));
            } else {
                let (of_a, of_b) = (slopes_by_side(a, e, by_a, touch), slopes_by_side(b, f, by_b, touch));
                crossings.between(of_a[0], of_b[1]);
                crossings.between(of_a[1], of_b[0]);
                if !is_parted {
                    crossings.between(of_a[0], of_a[1]);
                    crossings.between(of_b[0], of_b[1]);
                }
                crossings.in_plane(a, e);
                crossings.in_plane(b, f);
            }
            if crossings.outside {
                return Stands::Aside;
            }
            all_within &= is_within || crossings.within;
        }
        // What lies in the panel itself looks away from it: a polygon only touches it there, a box may hold whole
        // parts.
        let only_touches =
            |end: usize, h: &[f64]| self.normals[end] != DVec3::ZERO || h.iter().all(|h| h.abs() > touch);
        if all_within && is_parted && only_touches(0, a) && only_touches(1, b) {
            return Stands::Across;
        }
        Stands::Between
    }

    /// What of a panel lies in the shaft between two polygons; empty if nothing.
    pub fn part_of(&mut self, panel: &Panel) -> Loop {
        let mut part: Loop = panel.corners.iter().copied().collect();
        while self.find_sides() {}
        for (outwards, offset, _) in &self.sides {
            if !keep_above(&mut part, -*outwards, -offset) {
                return Loop::new();
            }
        }
        part
    }

    /// Finds more sides of the hull of two polygons, first those at edges of one and then of the other; whether there were
    /// more to find.
    fn find_sides(&mut self) -> bool {
        let [a, b] = self.ends;
        let (own, other, normal) = match self.ends_done {
            0 => (a, b, self.normals[0]),
            1 => (b, a, self.normals[1]),
            _ => return false,
        };
        self.ends_done += 1;
        match (own, other) {
            (_, [_, _, _, _]) => self.add_sides(own, sized::<4>(other), normal),
            (_, [_, _, _]) => self.add_sides(own, sized::<3>(other), normal),
            _ => self.add_sides(own, other, normal),
        }
        true
    }

    #[inline(always)]
    fn add_sides<C: Corners + ?Sized>(&mut self, own: &[DVec3], other: &C, normal: DVec3) {
        let touch = self.touch;
        let offset = normal.dot(own[0]);
        let heights = other.over((normal, offset));
        let heights = heights.as_ref();
        let other = other.as_ref();
        let (low, high) = (least(heights), most(heights));
        if low >= -touch {
            self.sides.push((-normal, -offset, touch));
        }
        if high <= touch {
            self.sides.push((normal, offset, touch));
        }
        // Seen along an edge, the polygon and what lies above it span a wedge; so do the polygon and what lies below.
        for (turn, is_there) in [(1.0, high > touch), (-1.0, low < -touch)] {
            if !is_there {
                continue;
            }
            for (i, &p) in own.iter().enumerate() {
                let along = turn * (own[(i + 1) % own.len()] - p);
                let (mut side, mut of) = (DVec3::ZERO, 0.0);
                for (&q, height) in other.iter().zip(heights) {
                    if side == DVec3::ZERO || side.dot(q - p) > 0.0 {
                        (side, of) = (along.cross(q - p), turn * height);
                    }
                }
                // What lies on the polygon's own side of the edge stays behind a plane that rises from it.
                let reach = touch * side.length();
                if of >= 0.0 && reach > 0.0 && other.iter().all(|x| side.dot(*x - p) <= reach) {
                    self.sides.push((side, side.dot(p), reach));
                }
            }
        }
    }
}

/// Of corners on one side of a panel's plane, at heights h and distances e within an edge: the most of (e − touch)/|h| and
/// the least of (e + touch)/|h|. The segment from (h, e) to (−k, f) on the other side crosses the plane at
/// (e k + f h)/(h + k) = (e/h + f/k) h k/(h + k) within the edge. So all segments between two sets cross outside if the most
/// of one and of the other sum to less than zero, and within if the least to more: corners suffice, not pairs of them.
type Slopes = [f64; 2];

/// Of corners that all lie on one side; `by` is 1/|h|.
#[inline(always)]
fn slopes(inside: &[f64], by: &[f64], touch: f64) -> Slopes {
    inside.iter().zip(by).fold([f64::NEG_INFINITY, f64::INFINITY], |[high, low], (e, by)| {
        let (outer, inner) = ((e - touch) * by, (e + touch) * by);
        [if outer > high { outer } else { high }, if inner < low { inner } else { low }]
    })
}

/// Of those that lie above, and of the others.
#[inline(always)]
fn slopes_by_side(heights: &[f64], inside: &[f64], by: &[f64], touch: f64) -> [Slopes; 2] {
    let mut found = [slopes(&[], &[], touch); 2];
    for ((h, e), by) in heights.iter().zip(inside).zip(by) {
        let (outer, inner) = ((e - touch) * by, (e + touch) * by);
        let [high, low] = &mut found[usize::from(*h <= 0.0)];
        (*high, *low) = (if outer > *high { outer } else { *high }, if inner < *low { inner } else { *low });
    }
    found
}

/// Where the segments between corners cross the plane of a panel: all outside of an edge, or all within it.
struct Crossings {
    touch: f64,
    outside: bool,
    within: bool,
}

impl Crossings {
    /// Segments between corners on either side.
    #[inline(always)]
    fn between(&mut self, [high, low]: Slopes, [other_high, other_low]: Slopes) {
        // None on a side is infinite, and nothing crosses. Of a corner in the plane it may be, too, and −∞ + ∞ is no number: there
        // neither holds, as `in_plane` finds.
        self.outside &= high + other_high <= 0.0;
        self.within &= low + other_low >= 0.0;
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

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_trace::sampling::Random;

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

    /// Corners tell of crossings what all pairs of them do.
    #[test]
    fn slopes_are_as_good_as_pairs() {
        let mut random = Random::new(3);
        let touch = 1e-3;
        let mut found = [0; 3];
        for _ in 0..4000 {
            let shift = 3.0 * random.next_unit() - 1.5;
            let mut of = |low: f64| -> [f64; 4] { std::array::from_fn(|_| low + 2.0 * random.next_unit()) };
            let (heights, inside) = (of(-1.0), of(shift - 1.0));
            let mut plain = Crossings { touch, outside: true, within: true };
            for (a, e) in heights.iter().zip(inside).filter(|(a, _)| **a > 0.0) {
                for (b, f) in heights.iter().zip(inside).filter(|(b, _)| **b <= 0.0) {
                    let at = (a * f - b * e) / (a - b);
                    plain.outside &= at <= touch;
                    plain.within &= at >= -touch;
                }
            }
            let mut fast = Crossings { touch, outside: true, within: true };
            let by = <[DVec3; 4]>::inverse(&heights);
            let [above, below] = slopes_by_side(&heights, &inside, &by, touch);
            fast.between(above, below);
            assert_eq!((plain.outside, plain.within), (fast.outside, fast.within), "{heights:?} {inside:?}");
            found[usize::from(plain.outside) + 2 * usize::from(plain.within && !plain.outside)] += 1;
        }
        assert!(found.iter().all(|n| *n > 400), "{found:?}");
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
