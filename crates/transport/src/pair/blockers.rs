//! Facets that stand in the way, opaque from both sides, in double precision.
//!
//! A segment is blocked where it passes through a facet between its ends. Touching a facet with an end does not count,
//! nor does running within its plane: the facets that exchange radiation may be blockers too, and so may walls that
//! stand on them. Few facets are tried one by one, many through a tree of boxes (median split along the widest axis).

use super::Occlusion;
use glam::DVec3;
use radiosity_scene::Facet;
use std::cmp::Ordering;

/// Height above a facet's plane, relative to the segment's length, below which an end touches it: a thousand times what
/// rounding leaves of a hit point, a thousandth of what six-digit coordinates would notice.
const TOUCH: f64 = 1e-9;

/// Facets in a leaf of the tree: trying one costs about as much as a box.
const LEAF: usize = 4;

/// Most polygons that shadows are cut by: a point's view then costs some hundred microseconds, as much as the segments
/// for two digits.
const FEW: usize = 512;

/// Opaque facets.
#[derive(Clone, Debug, Default)]
pub struct Blockers {
    /// In the order of the tree's leaves.
    facets: Vec<Blocker>,
    /// Boxes in depth-first order; the first child follows its parent.
    nodes: Vec<Node>,
}

#[derive(Clone, Debug)]
struct Blocker {
    normal: DVec3,
    /// A point of the plane.
    origin: DVec3,
    corners: Vec<DVec3>,
    /// How far corners are off the plane.
    off: f64,
    /// Convex polygons that cover the facet.
    parts: Vec<Vec<DVec3>>,
    /// Axes of the plane that the facet is projected along its widest side on.
    axes: [usize; 2],
    low: DVec3,
    high: DVec3,
}

#[derive(Clone, Debug)]
struct Node {
    low: DVec3,
    high: DVec3,
    /// Facets of the node.
    first: usize,
    count: usize,
    /// Index of the second child; none for a leaf.
    second: Option<usize>,
}

impl Blockers {
    /// Blockers made of these facets.
    pub fn new<'a>(facets: impl IntoIterator<Item = &'a Facet>) -> Blockers {
        let mut blockers = Blockers { facets: facets.into_iter().map(Blocker::new).collect(), nodes: Vec::new() };
        if !blockers.facets.is_empty() {
            let count = blockers.facets.len();
            blockers.build(0, count);
        }
        blockers
    }

    fn build(&mut self, first: usize, count: usize) {
        let facets = &mut self.facets[first..first + count];
        let low = facets.iter().fold(DVec3::INFINITY, |low, f| low.min(f.low));
        let high = facets.iter().fold(DVec3::NEG_INFINITY, |high, f| high.max(f.high));
        let node = self.nodes.len();
        self.nodes.push(Node { low, high, first, count, second: None });
        if count <= LEAF {
            return;
        }
        let axis = widest(high - low);
        facets.sort_by(|a, b| (a.low + a.high)[axis].total_cmp(&(b.low + b.high)[axis]));
        let half = count / 2;
        self.build(first, half);
        self.nodes[node].second = Some(self.nodes.len());
        self.build(first + half, count - half);
    }

    /// Whether any facet in a box that `enters` passes the `test`, which sees each at most once.
    fn any<'a>(&'a self, enters: impl Fn(DVec3, DVec3) -> bool, mut test: impl FnMut(&'a Blocker) -> bool) -> bool {
        let mut next = (!self.nodes.is_empty()).then_some(0);
        // Second children yet to visit: one for each level, and the halves halve.
        let (mut stack, mut depth) = ([0usize; 64], 0);
        while let Some(index) = next {
            let node = &self.nodes[index];
            next = None;
            if enters(node.low, node.high) {
                match node.second {
                    Some(second) => {
                        stack[depth] = second;
                        depth += 1;
                        next = Some(index + 1);
                    }
                    None if self.facets[node.first..node.first + node.count].iter().any(&mut test) => return true,
                    None => {}
                }
            }
            if next.is_none() && depth > 0 {
                depth -= 1;
                next = Some(stack[depth]);
            }
        }
        false
    }

    /// Whether any facet that may stand between two others passes the `test`.
    fn any_between<'a>(&'a self, from: &Facet, to: &Facet, mut test: impl FnMut(&'a Blocker) -> bool) -> bool {
        let corners = || from.corners().iter().chain(to.corners());
        let low = corners().fold(DVec3::INFINITY, |low, c| low.min(*c));
        let high = corners().fold(DVec3::NEG_INFINITY, |high, c| high.max(*c));
        let touch = (TOUCH * low.distance(high)).max(off_plane(from)).max(off_plane(to));
        let meets = |l: DVec3, h: DVec3| l.cmple(high + touch).all() && h.cmpge(low - touch).all();
        self.any(meets, |blocker| {
            // Not where the blocker lies behind either facet, or both facets on one side of it.
            let is_behind = |f: &Facet| blocker.corners.iter().all(|c| f.height(*c) <= touch);
            let heights = || corners().map(|c| (*c - blocker.origin).dot(blocker.normal));
            meets(blocker.low, blocker.high)
                && !is_behind(from)
                && !is_behind(to)
                && heights().any(|h| h > touch)
                && heights().any(|h| h < -touch)
                && test(blocker)
        })
    }
}

impl Occlusion for Blockers {
    fn is_clear(&self, a: DVec3, b: DVec3) -> bool {
        let along = b - a;
        let touch = TOUCH * along.length();
        let inverse = along.recip();
        let enters = |low: DVec3, high: DVec3| {
            // Slabs, widened so that flat boxes are entered; 0 · ∞, which compares with nothing, is within.
            let (s, t) = ((low - touch - a) * inverse, (high + touch - a) * inverse);
            let (near, far) = (s.min(t).max_element(), s.max(t).min_element());
            near.max(0.0).partial_cmp(&far.min(1.0)) != Some(Ordering::Greater)
        };
        !self.any(enters, |blocker| blocker.blocks(a, along, touch))
    }

    fn is_empty(&self) -> bool {
        self.facets.is_empty()
    }

    fn may_block(&self, from: &Facet, to: &Facet) -> bool {
        self.any_between(from, to, |_| true)
    }

    fn polygons(&self, from: &Facet, to: &Facet) -> Option<Vec<&[DVec3]>> {
        let mut polygons = Vec::new();
        let too_many = self.any_between(from, to, |blocker| {
            polygons.extend(blocker.parts.iter().map(Vec::as_slice));
            polygons.len() > FEW
        });
        (!too_many).then_some(polygons)
    }
}

impl Blocker {
    fn new(facet: &Facet) -> Blocker {
        let corners = facet.corners().to_vec();
        let axis = widest(facet.normal().abs());
        let low = corners.iter().fold(DVec3::INFINITY, |low, c| low.min(*c));
        let high = corners.iter().fold(DVec3::NEG_INFINITY, |high, c| high.max(*c));
        let axes = [(axis + 1) % 3, (axis + 2) % 3];
        let parts = if facet.is_convex() {
            vec![corners.clone()]
        } else {
            facet.triangles().into_iter().map(Vec::from).collect()
        };
        let off = off_plane(facet);
        Blocker { normal: facet.normal(), origin: corners[0], corners, off, parts, axes, low, high }
    }

    /// Whether the segment from `a` along `along` passes through, its ends not counted.
    fn blocks(&self, a: DVec3, along: DVec3, touch: f64) -> bool {
        let height = (a - self.origin).dot(self.normal);
        let end = height + along.dot(self.normal);
        let touch = touch.max(2.0 * self.off);
        if height.abs() <= touch || end.abs() <= touch || (height > 0.0) == (end > 0.0) {
            return false;
        }
        self.contains(a + height / (height - end) * along)
    }

    /// Whether a point of the plane is inside, by the crossings of a half line (even and odd).
    fn contains(&self, p: DVec3) -> bool {
        contains(&self.corners, p, self.axes)
    }
}

/// How far a facet's corners are off its plane: coordinates of few digits leave some.
fn off_plane(facet: &Facet) -> f64 {
    facet.corners().iter().map(|c| facet.height(*c).abs()).fold(0.0, f64::max)
}

/// Whether a point of a polygon's plane is inside it, as projected on two coordinate axes.
fn contains(corners: &[DVec3], p: DVec3, [x, y]: [usize; 2]) -> bool {
    let (px, py) = (p[x], p[y]);
    let mut inside = false;
    let mut from = corners[corners.len() - 1];
    for to in corners {
        if (from[y] > py) != (to[y] > py) {
            // Taken from the lower end, so that neighbours agree on their common edge.
            let (low, high) = if from[y] < to[y] { (from, *to) } else { (*to, from) };
            inside ^= px < low[x] + (py - low[y]) / (high[y] - low[y]) * (high[x] - low[x]);
        }
        from = *to;
    }
    inside
}

/// Whether the facet contains a point of its plane.
pub(crate) fn is_inside(facet: &Facet, point: DVec3) -> bool {
    let axis = widest(facet.normal().abs());
    contains(facet.corners(), point, [(axis + 1) % 3, (axis + 2) % 3])
}

fn widest(v: DVec3) -> usize {
    if v.x >= v.y && v.x >= v.z {
        0
    } else if v.y >= v.z {
        1
    } else {
        2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pair::polygons::facet;
    use radiosity_trace::sampling::Random;

    fn wall() -> Facet {
        facet(&[[1., 0., 0.], [1., 1., 0.], [1., 1., 1.], [1., 0., 1.]])
    }

    #[test]
    fn ends_that_touch_and_segments_within_the_plane_are_clear() {
        let blockers = Blockers::new([&wall()]);
        let clear = |a: [f64; 3], b: [f64; 3]| {
            let (a, b) = (DVec3::from_array(a), DVec3::from_array(b));
            assert_eq!(blockers.is_clear(a, b), blockers.is_clear(b, a));
            blockers.is_clear(a, b)
        };
        assert!(!clear([0., 0.5, 0.5], [2., 0.5, 0.5]));
        assert!(!clear([0., 0.5, 0.5], [1.001, 0.5, 0.5]));
        assert!(clear([0., 0.5, 0.5], [1., 0.5, 0.5]));
        assert!(clear([1., 0.5, 0.5], [2., 0.5, 0.5]));
        assert!(clear([1., -1., 0.5], [1., 2., 0.5]));
        assert!(clear([0., 0.5, 1.1], [2., 0.5, 1.1]));
        // From one side of its foot to the other, over the floor: through the wall or beside it.
        assert!(!clear([0.9, 0.5, 0.], [1.1, 0.5, 1e-3]));
        assert!(clear([0.9, 1.5, 0.], [1.1, 1.5, 0.]));
        assert!(Blockers::default().is_clear(DVec3::ZERO, DVec3::X) && Blockers::default().is_empty());
    }

    #[test]
    fn a_concave_blocker_lets_through_its_notch() {
        let l = facet(&[[0., 0., 0.], [2., 0., 0.], [2., 1., 0.], [1., 1., 0.], [1., 2., 0.], [0., 2., 0.]]);
        let blockers = Blockers::new([&l]);
        let clear = |x: f64, y: f64| blockers.is_clear(DVec3::new(x, y, 1.0), DVec3::new(x, y, -1.0));
        assert!(!clear(0.5, 1.5) && !clear(1.5, 0.5) && clear(1.5, 1.5));
    }

    #[test]
    fn the_tree_answers_like_one_by_one() {
        let mut random = Random::new(11);
        let mut point = || DVec3::new(random.next_unit(), random.next_unit(), random.next_unit());
        let triangles: Vec<Facet> = (0..300)
            .filter_map(|_| {
                let p = point();
                Facet::new(vec![p, p + 0.1 * point(), p + 0.1 * point()]).ok()
            })
            .collect();
        let tree = Blockers::new(&triangles);
        let single: Vec<Blockers> = triangles.iter().map(|t| Blockers::new([t])).collect();
        let mut blocked = 0;
        for _ in 0..2000 {
            let (a, b) = (point(), point());
            let clear = tree.is_clear(a, b);
            assert_eq!(clear, single.iter().all(|s| s.is_clear(a, b)));
            blocked += usize::from(!clear);
        }
        assert!((200..1800).contains(&blocked), "{blocked}");
    }

    /// Coordinates of few digits leave corners off the plane; a facet still does not hide what starts on it.
    #[test]
    fn facets_that_are_not_quite_flat_do_not_block_themselves() {
        let bent = facet(&[[0., 0., 0.], [1., 0., 4e-6], [1., 1., 0.], [0., 1., 4e-6]]);
        let ceiling = facet(&[[0., 0., 1.], [0., 1., 1.], [1., 1., 1.], [1., 0., 1.]]);
        let blockers = Blockers::new([&bent, &ceiling]);
        assert!(!blockers.may_block(&bent, &ceiling));
        for [a, b, c] in bent.triangles() {
            assert!(blockers.is_clear((a + b + c) / 3.0, DVec3::new(0.4, 0.6, 1.0)));
        }
    }

    #[test]
    fn what_cannot_stand_between_is_known() {
        let floor = facet(&[[0., 0., 0.], [2., 0., 0.], [2., 1., 0.], [0., 1., 0.]]);
        let side = facet(&[[0., 0., 0.], [0., 1., 0.], [0., 1., 1.], [0., 0., 1.]]);
        let far = facet(&[[2., 0., 0.], [2., 0., 1.], [2., 1., 1.], [2., 1., 0.]]);
        let room = Blockers::new([&floor, &side, &far]);
        assert!(!room.may_block(&side, &far) && !room.may_block(&floor, &far));
        let with_wall = Blockers::new([&floor, &side, &far, &wall()]);
        assert!(with_wall.may_block(&side, &far) && with_wall.may_block(&floor, &far));
    }
}
