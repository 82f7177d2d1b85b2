//! What stands between two convex polygons: the triangles that reach into their convex hull.
//!
//! Haines and Wallace 1991, "Shaft culling for efficient ray-traced radiosity", with the planes of the hull itself instead of
//! those of two boxes: planes through an edge of one polygon and a corner of the other that leave all corners on one
//! side, and those of the polygons.

use crate::tree::{Block, Child, LANES, Node, Tree, WIDTH};
use glam::{DVec3, Vec3};
use std::ops::ControlFlow;

/// Planes of a hull at most: those of a triangle and a quadrilateral are nine. Of more, these will do.
const MOST_PLANES: usize = 12;

/// By how much corners may lie beyond a plane that leaves all on one side, relative to the hull's size: it is moved there.
const ROUNDING: f64 = 1e-9;

/// By how much planes and boxes are moved outwards against rounding, relative to the scene's largest extent: heights over planes were off by up to nine tenths of it in
/// single precision, so that nothing that reaches in is missed. It is half of what places are moved off their surfaces: what lies in these is not found.
const MARGIN: f32 = 2.0 / (1 << 24) as f32;

/// The convex hull of two convex polygons that face each other.
#[derive(Clone, Debug)]
pub(crate) struct Shaft {
    /// Planes as n and d: inside is where n · x ≥ d.
    planes: [[f32; 4]; MOST_PLANES],
    len: usize,
    low: Vec3,
    high: Vec3,
}

impl Shaft {
    /// Between polygons by their corners in the coordinates of a tree; one may be a single point.
    pub fn new(from: &[DVec3], to: &[DVec3]) -> Shaft {
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for p in from.iter().chain(to) {
            (low, high) = (low.min(*p), high.max(*p));
        }
        let grace = ROUNDING * (high - low).max_element();
        let mut shaft = Shaft { planes: [[0.0; 4]; MOST_PLANES], len: 0, low: low.as_vec3(), high: high.as_vec3() };
        for polygon in [from, to] {
            if let [a, b, c, ..] = polygon {
                shaft.add(((*b - *a).cross(*c - *a), *a), (from, to), grace);
            }
        }
        for (edges, corners) in [(to, from), (from, to)] {
            let count = if edges.len() > 1 { edges.len() } else { 0 };
            for (i, p) in edges.iter().enumerate().take(count) {
                let along = edges[(i + 1) % count] - *p;
                corners.iter().for_each(|corner| shaft.add((along.cross(*corner - *p), *p), (from, to), grace));
            }
        }
        shaft
    }

    /// Adds the plane with this normal or against it through a point, if all corners lie on one side of it.
    fn add(&mut self, (normal, through): (DVec3, DVec3), (from, to): (&[DVec3], &[DVec3]), grace: f64) {
        // Most are no such planes, and need no root.
        let grace = grace * normal.abs().element_sum();
        let (mut low, mut high) = (0.0f64, 0.0f64);
        for p in from.iter().chain(to) {
            let height = normal.dot(*p - through);
            (low, high) = (low.min(height), high.max(height));
            if low < -grace && high > grace {
                return;
            }
        }
        let length = normal.length();
        if self.len == MOST_PLANES || high.max(-low) <= grace || length == 0.0 {
            return;
        }
        let (inwards, least) = if low >= -grace { (normal, low) } else { (-normal, -high) };
        let n = (inwards / length).as_vec3();
        self.planes[self.len] = [n.x, n.y, n.z, ((inwards.dot(through) + least) / length) as f32];
        self.len += 1;
    }

    /// Which boxes of a node may have something inside, as bits.
    #[inline(always)]
    fn boxes(&self, node: &Node, margin: f32) -> u32 {
        let mut outside = [false; WIDTH];
        for axis in 0..3 {
            let (low, high) = (self.low[axis] - margin, self.high[axis] + margin);
            for (slot, outside) in outside.iter_mut().enumerate() {
                *outside |= node.bounds[axis][slot] > high || node.bounds[3 + axis][slot] < low;
            }
        }
        for &[x, y, z, d] in &self.planes[..self.len] {
            // The corner of each box that is furthest inside.
            let row = |axis: usize, n: f32| &node.bounds[axis + if n > 0.0 { 3 } else { 0 }];
            let (xs, ys, zs) = (row(0, x), row(1, y), row(2, z));
            let least = d - margin;
            for (slot, outside) in outside.iter_mut().enumerate() {
                *outside |= x * xs[slot] + y * ys[slot] + z * zs[slot] < least;
            }
        }
        (0..WIDTH).map(|slot| u32::from(!outside[slot]) << slot).sum()
    }

    /// Which triangles of a block may reach inside, as bits.
    #[inline(always)]
    fn triangles(&self, block: &Block, margin: f32) -> u32 {
        let mut outside = [false; LANES];
        let [a, b, c] = &block.corner;
        for axis in 0..3 {
            let (low, high) = (self.low[axis] - margin, self.high[axis] + margin);
            for (lane, outside) in outside.iter_mut().enumerate() {
                let (p, q, r) = (a[axis][lane], b[axis][lane], c[axis][lane]);
                *outside |= p.min(q).min(r) > high || p.max(q).max(r) < low;
            }
        }
        for &[x, y, z, d] in &self.planes[..self.len] {
            let least = d - margin;
            for (lane, outside) in outside.iter_mut().enumerate() {
                let height = |p: &[[f32; LANES]; 3]| x * p[0][lane] + y * p[1][lane] + z * p[2][lane];
                *outside |= height(a).max(height(b)).max(height(c)) < least;
            }
        }
        (0..LANES).map(|lane| u32::from(!outside[lane] && block.triangle[lane] != u32::MAX) << lane).sum()
    }
}

impl Tree {
    /// Shows `visit` triangles until it breaks off: all that reach into a shaft, perhaps some that lie just outside, and now and then one twice.
    pub(crate) fn in_shaft(&self, shaft: &Shaft, visit: &mut impl FnMut(u32) -> ControlFlow<()>) -> ControlFlow<()> {
        let Some([low, high]) = self.bounds else { return ControlFlow::Continue(()) };
        let margin = MARGIN * (high - low).max_element();
        #[cfg(target_arch = "x86_64")]
        if self.simd {
            // SAFETY: `simd` is set only where the processor has AVX2 and FMA.
            return unsafe { walk_avx2(self, shaft, margin, visit) };
        }
        walk(self, shaft, margin, visit)
    }
}

/// Eight boxes are a register there.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn walk_avx2(
    tree: &Tree,
    shaft: &Shaft,
    margin: f32,
    visit: &mut impl FnMut(u32) -> ControlFlow<()>,
) -> ControlFlow<()> {
    walk(tree, shaft, margin, visit)
}

#[inline(always)]
fn walk(tree: &Tree, shaft: &Shaft, margin: f32, visit: &mut impl FnMut(u32) -> ControlFlow<()>) -> ControlFlow<()> {
    let mut open: smallvec::SmallVec<[Child; 64]> = smallvec::SmallVec::new();
    open.push(Child::node(0));
    while let Some(child) = open.pop() {
        if !child.is_leaf() {
            let node = &tree.nodes[child.index()];
            let mut met = shaft.boxes(node, margin);
            while met != 0 {
                open.push(node.child[met.trailing_zeros() as usize]);
                met &= met - 1;
            }
            continue;
        }
        for block in &tree.blocks[child.blocks()] {
            let mut met = shaft.triangles(block, margin);
            while met != 0 {
                let lane = met.trailing_zeros() as usize;
                visit(block.triangle[lane])?;
                met &= met - 1;
            }
        }
    }
    ControlFlow::Continue(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Ray;
    use crate::sampling::Random;

    /// Triangles of all directions, strewn over a cube of ten metres.
    fn strewn(random: &mut Random, count: usize) -> Vec<[Vec3; 3]> {
        let mut vector =
            |scale: f64| Vec3::from_array(std::array::from_fn(|_| (scale * (random.next_unit() - 0.5)) as f32));
        let triangle = |_| {
            let at = vector(10.0);
            [at, at + vector(2.0), at + vector(2.0)]
        };
        (0..count).map(triangle).collect()
    }

    fn found(tree: &Tree, shaft: &Shaft) -> Vec<u32> {
        let mut found = Vec::new();
        let all = tree.in_shaft(shaft, &mut |triangle| {
            found.push(triangle);
            ControlFlow::Continue(())
        });
        assert!(all.is_continue());
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Whatever a segment between the two polygons meets is found, by wide registers and without, and not much more: triangles that pass beside an edge
    /// of the hull count, too.
    #[test]
    fn what_stops_a_segment_is_found() {
        let mut random = Random::new(4);
        let triangles = strewn(&mut random, 600);
        let mut tree = Tree::new(&triangles);
        let (mut met, mut told) = (0, 0);
        for trial in 0..120 {
            let mut vector = || DVec3::from_array(std::array::from_fn(|_| random.next_unit() - 0.5));
            let (a, b) = (8.0 * vector(), 8.0 * vector());
            let (u, v, w) = (vector(), vector(), vector());
            let mut unit = || random.next_unit();
            let from = if trial % 2 == 0 { vec![a] } else { vec![a, a + u, a + v] };
            let to = [b, b + w, b + w + u, b + u];
            let shaft = Shaft::new(&from, &to);
            let found = found(&tree, &shaft);
            tree.simd = !tree.simd;
            assert_eq!(found, self::found(&tree, &shaft));
            let mut seen = Vec::new();
            for _ in 0..2000 {
                let [x, y] = [unit(), unit()];
                let [p, q] = if x + y > 1.0 { [1.0 - x, 1.0 - y] } else { [x, y] };
                let start = from.get(1..).map_or(a, |rest| match rest {
                    [b, c] => a + p * (*b - a) + q * (*c - a),
                    _ => a,
                });
                let along = b + unit() * w + unit() * u - start;
                let (direction, length) = (along.normalize(), along.length());
                let ray = Ray {
                    origin: start.as_vec3(),
                    direction: direction.as_vec3(),
                    t_max: length as f32 * 0.9999,
                    skip: u32::MAX,
                };
                tree.closest_where(&ray, |triangle, _, _, _| {
                    seen.push(triangle);
                    false
                });
            }
            seen.sort_unstable();
            seen.dedup();
            assert!(
                seen.iter().all(|triangle| found.binary_search(triangle).is_ok()),
                "{trial}: {seen:?} of {found:?}"
            );
            (met, told) = (met + seen.len(), told + found.len());
        }
        assert!(met > 200 && told < 3 * met, "{met} met, {told} told");
    }

    /// What lies in the plane that a place is moved off, or in that of the lamp, does not stand between them.
    #[test]
    fn what_touches_from_outside_is_not_found() {
        let mut triangles = Vec::new();
        for (z, up) in [(0.0, true), (3.0, false)] {
            for (i, k) in (0..10).flat_map(|i| (0..10).map(move |k| (i, k))) {
                let at = |x: i32, y: i32| Vec3::new(0.61 * (i + x) as f32, 0.61 * (k + y) as f32, z);
                let [a, b, c, d] = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
                triangles.extend(if up { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
            }
        }
        let tree = Tree::new(&triangles);
        let offset = 3.05 * 2f64.powi(-21);
        let mut random = Random::new(8);
        for _ in 0..200 {
            let mut unit = || random.next_unit();
            let at = DVec3::new(5.0 * unit(), 5.0 * unit(), offset);
            let lamp = DVec3::new(5.0 * unit(), 5.0 * unit(), 3.0 - offset);
            let to = [lamp, lamp + DVec3::Y, lamp + DVec3::X + DVec3::Y, lamp + DVec3::X];
            for from in [vec![at], vec![at, at + 0.3 * DVec3::X, at + 0.2 * DVec3::Y]] {
                assert_eq!(found(&tree, &Shaft::new(&from, &to)), [0u32; 0]);
            }
        }
    }
}
