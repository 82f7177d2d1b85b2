//! The tree of boxes: who is met first along a ray, and is anyone in the way?
//!
//! Each node holds eight boxes, each leaf up to eight triangles in blocks of four. `build` makes a
//! binary tree by the surface-area heuristic, `spatial` cuts triangles in parts that go to different leaves, `collapse` chooses which
//! of its nodes remain, `walk` goes through it by the registers of `avx2` and `neon` and `portable` without, `intersect` says what a hit is. Which of two hits counts depends on them
//! alone and not on the walk: the nearer one, at the same distance the one with the lower index; a back is taken to lie
//! 2^-20 of the largest coordinate further away than it does. So answers are the same on every machine.

use crate::build::{Bounds, Item, build};
use crate::collapse::collapse;
use crate::intersect::{Prepared, tie_of};
use crate::{Hit, Ray, portable};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::ops::Range;

/// Boxes of a node.
pub(crate) const WIDTH: usize = 8;

/// Triangles of a block.
pub(crate) const LANES: usize = 4;

/// Blocks of a leaf, at most. With one, rays visit 2 % more nodes and 12 % fewer blocks, in 10 % more memory.
pub(crate) const MAX_BLOCKS: usize = 2;

/// What a slot of a node leads to: a node by its index, or a run of blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub(crate) struct Child(pub u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    const MORE: u32 = 1 << 30;

    /// Of an empty slot, whose box no ray meets.
    const NONE: Child = Child(u32::MAX);

    pub fn node(index: usize) -> Child {
        Child(index as u32)
    }

    pub fn leaf(first: usize, blocks: usize) -> Child {
        Child(Child::LEAF | if blocks > 1 { Child::MORE } else { 0 } | first as u32)
    }

    pub fn is_leaf(self) -> bool {
        self.0 & Child::LEAF != 0
    }

    /// The node's index.
    pub fn index(self) -> usize {
        self.0 as usize
    }

    /// The leaf's blocks.
    pub fn blocks(self) -> Range<usize> {
        let first = (self.0 & (Child::MORE - 1)) as usize;
        first..first + if self.0 & Child::MORE != 0 { 2 } else { 1 }
    }
}

/// Eight boxes: rows of lower x, y, z, then of upper x, y, z; and what they contain.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(crate) struct Node {
    pub bounds: [[f32; WIDTH]; 6],
    pub child: [Child; WIDTH],
}

impl Node {
    pub const EMPTY: Node = Node {
        bounds: [
            [f32::INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
        ],
        child: [Child::NONE; WIDTH],
    };
}

/// Four triangles, by corner, axis and lane. Empty lanes are NaN, which nothing hits.
#[derive(Clone, Debug)]
#[repr(C, align(32))]
pub(crate) struct Block {
    pub corner: [[[f32; LANES]; 3]; 3],
    pub triangle: [u32; LANES],
}

impl Block {
    pub const EMPTY: Block = Block { corner: [[[f32::NAN; LANES]; 3]; 3], triangle: [u32::MAX; LANES] };

    pub fn set(&mut self, lane: usize, triangle: u32, corners: &[Vec3; 3]) {
        for (rows, corner) in self.corner.iter_mut().zip(corners) {
            for axis in 0..3 {
                rows[axis][lane] = corner[axis];
            }
        }
        self.triangle[lane] = triangle;
    }

    pub fn corners(&self, lane: usize) -> [[f32; 3]; 3] {
        self.corner.map(|rows| rows.map(|row| row[lane]))
    }
}

/// A tree of boxes over triangles.
///
/// ```
/// use glam::Vec3;
/// use radiosity_trace::{Ray, Tree};
/// let tree = Tree::new(&[[Vec3::ZERO, Vec3::X, Vec3::Y]]);
/// let ray = Ray { origin: Vec3::new(0.25, 0.5, 2.0), direction: -Vec3::Z, t_max: f32::INFINITY, skip: u32::MAX };
/// let hit = tree.closest(&ray).unwrap();
/// assert_eq!((hit.triangle, hit.t, hit.u, hit.v, hit.back), (0, 2.0, 0.25, 0.5, false));
/// assert!(!tree.blocked(&Ray { t_max: 2.0, ..ray }));
/// ```
#[derive(Clone, Debug)]
pub struct Tree {
    pub(crate) nodes: Vec<Node>,
    pub(crate) blocks: Vec<Block>,
    pub(crate) bounds: Option<[Vec3; 2]>,
    /// What backs are set back by.
    tie: f32,
    len: usize,
    /// Whether the processor has what `avx2` or `neon` is compiled for. Set nowhere but in [`Tree::new`] and to false in tests.
    #[cfg_attr(not(any(target_arch = "x86_64", target_arch = "aarch64")), allow(dead_code))]
    pub(crate) simd: bool,
}

/// What can be wrong with a tree; see [`Tree::validate`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Flaw {
    /// A slot leads to a node that does not exist, or that another slot leads to as well.
    #[error("node {0} is out of range or has two parents")]
    Node(usize),
    /// A leaf refers to a block that does not exist, or that another leaf has as well.
    #[error("block {0} is out of range or in two leaves")]
    Block(usize),
    /// A triangle is in no leaf or twice in one, or its corners are not those given.
    #[error("triangle {0} is in no leaf, twice in one, or has other corners")]
    Triangle(usize),
    /// A box does not contain what is below it.
    #[error("a box of node {0} does not contain what is below it")]
    Box(usize),
}

impl Tree {
    /// Builds the tree over triangles given by their corners, counter-clockwise seen from the front. The triangles
    /// keep their indices; those with a corner that is not finite cannot be hit. Uses rayon's threads; the tree is the
    /// same for any number of them.
    pub fn new(triangles: &[[Vec3; 3]]) -> Tree {
        Tree::over(triangles.len(), |triangle| triangles[triangle])
    }

    /// The same over `len` triangles whose corners are worked out where they are asked for.
    pub fn over(len: usize, corners: impl Fn(usize) -> [Vec3; 3] + Sync) -> Tree {
        let item = |triangle: usize| {
            let corners = corners(triangle);
            corners.iter().all(|c| c.is_finite()).then(|| Item::new(&corners, triangle as u32))
        };
        let mut items: Vec<Item> = Vec::with_capacity(len);
        items.extend((0..len).filter_map(item));
        let Bounds { lo, hi } = Bounds::of(&items);
        let bounds = (!items.is_empty()).then(|| [lo.truncate(), hi.truncate()]);
        items.par_iter_mut().for_each(|item| *item = item.slackened());
        let binary = build(&mut items, &corners);
        let (nodes, blocks) = collapse(&binary, &items, &corners);
        let tie = bounds.map_or(0.0, tie_of);
        Tree { nodes, blocks, bounds, tie, len, simd: has_simd() }
    }

    /// The same tree for a part of a scene whose coordinates are at most `reach`: its hits compete with those of the tree of
    /// another part as if both were one ([`Tree::key`]).
    pub fn as_part(mut self, reach: f32) -> Tree {
        self.tie = tie_of([Vec3::splat(reach); 2]);
        self
    }

    /// Takes some triangles out, all of which lie in the box `around` from its lower to its upper corner: no ray meets them any more.
    /// Boxes stay as they are, so that rays look in vain where they were. They still count in [`Tree::len`], and are
    /// to [`Tree::validate`] as triangles that are not finite.
    pub fn take_out(&mut self, triangles: Range<u32>, around: [Vec3; 2]) {
        let mut open = Vec::from_iter((!self.nodes.is_empty()).then_some(0));
        while let Some(index) = open.pop() {
            let Node { bounds, child } = &self.nodes[index];
            let meets = |slot: usize| {
                (0..3).all(|axis| bounds[axis][slot] <= around[1][axis] && bounds[3 + axis][slot] >= around[0][axis])
            };
            for slot in (0..WIDTH).filter(|slot| child[*slot] != Child::NONE && meets(*slot)) {
                if !child[slot].is_leaf() {
                    open.push(child[slot].index());
                    continue;
                }
                for block in &mut self.blocks[child[slot].blocks()] {
                    for lane in 0..LANES {
                        if triangles.contains(&block.triangle[lane]) {
                            block.set(lane, u32::MAX, &[Vec3::NAN; 3]);
                        }
                    }
                }
            }
        }
    }

    /// The distance by which a hit competes with others: the smaller one counts, of equal ones that of the lower index.
    pub fn key(&self, hit: &Hit) -> f32 {
        hit.key(self.tie)
    }

    /// Number of triangles given.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether no triangle was given.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Memory the tree takes, bytes.
    pub fn memory(&self) -> usize {
        size_of::<Tree>() + size_of_val(&*self.nodes) + size_of_val(&*self.blocks)
    }

    /// Smallest box around the triangles; `None` without any.
    pub fn bounds(&self) -> Option<[Vec3; 2]> {
        self.bounds
    }

    /// The nearest hit.
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        self.closest_where(ray, |_, _, _, _| true)
    }

    /// The nearest hit that `accept` (triangle, weights of its corners 1 and 2, back) does not refuse; the ray passes
    /// through the others. `accept` may be asked about hits behind the nearest one, about one more than once, and in any order.
    #[inline]
    pub fn closest_where(&self, ray: &Ray, mut accept: impl FnMut(u32, f32, f32, bool) -> bool) -> Option<Hit> {
        #[cfg(target_arch = "x86_64")]
        if self.simd {
            // SAFETY: `simd` is set only where the processor has AVX2 and FMA.
            return unsafe { crate::avx2::closest(self, ray, &mut accept) };
        }
        #[cfg(target_arch = "aarch64")]
        if self.simd {
            // SAFETY: `simd` is set only where the processor has NEON.
            return unsafe { crate::neon::closest(self, ray, &mut accept) };
        }
        portable::closest(self, &self.prepared(ray)?, &mut accept)
    }

    /// Whether anything is hit.
    pub fn blocked(&self, ray: &Ray) -> bool {
        self.blocked_where(ray, |_, _, _, _| true)
    }

    /// Whether anything is hit that `accept` (triangle, weights of its corners 1 and 2, back) does not refuse. It may be asked about a hit more
    /// than once.
    #[inline]
    pub fn blocked_where(&self, ray: &Ray, mut accept: impl FnMut(u32, f32, f32, bool) -> bool) -> bool {
        #[cfg(target_arch = "x86_64")]
        if self.simd {
            // SAFETY: `simd` is set only where the processor has AVX2 and FMA.
            return unsafe { crate::avx2::blocked(self, ray, &mut accept) };
        }
        #[cfg(target_arch = "aarch64")]
        if self.simd {
            // SAFETY: `simd` is set only where the processor has NEON.
            return unsafe { crate::neon::blocked(self, ray, &mut accept) };
        }
        self.prepared(ray).is_some_and(|prepared| portable::blocked(self, &prepared, &mut accept))
    }

    /// `None` where a ray cannot hit anything. Inlined, so that `avx2` and `neon` have it in registers.
    #[inline(always)]
    pub(crate) fn prepared(&self, ray: &Ray) -> Option<Prepared> {
        Prepared::with_tie(ray, self.bounds?, self.tie)
    }

    /// The nearest hit of each ray, on the caller's thread. Stops at the end of the shorter slice.
    pub fn closest_batch(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = self.closest(ray);
        }
    }

    /// Whether each ray hits anything, on the caller's thread. Stops at the end of the shorter slice.
    pub fn blocked_batch(&self, rays: &[Ray], blocked: &mut [bool]) {
        for (ray, blocked) in rays.iter().zip(blocked) {
            *blocked = self.blocked(ray);
        }
    }

    /// Checks the structure against the triangles it was built from: each of them (with finite corners) in a leaf or, in parts, in several, whose
    /// boxes have all of it in them, every box around those below it, every node and block reached once.
    pub fn validate(&self, triangles: &[[Vec3; 3]]) -> Result<(), Flaw> {
        let mut seen =
            Seen { nodes: vec![false; self.nodes.len()], blocks: vec![false; self.blocks.len()], parts: Vec::new() };
        if !self.nodes.is_empty() {
            seen.nodes[0] = true;
            // (node, the box it stands in)
            let mut open = vec![(0, [Vec3::NEG_INFINITY, Vec3::INFINITY])];
            while let Some((index, around)) = open.pop() {
                for slot in 0..WIDTH {
                    let node = &self.nodes[index];
                    let child = node.child[slot];
                    if child == Child::NONE {
                        continue;
                    }
                    let [lo, hi] =
                        [0, 3].map(|row| Vec3::from_array(std::array::from_fn(|i| node.bounds[row + i][slot])));
                    if !(around[0].cmple(lo).all() && around[1].cmpge(hi).all()) {
                        return Err(Flaw::Box(index));
                    }
                    if child.is_leaf() {
                        let first = seen.parts.len();
                        for block in child.blocks() {
                            once(&mut seen.blocks, block).ok_or(Flaw::Block(block))?;
                            self.validate_block(block, triangles)?;
                            let block =
                                self.blocks[block].triangle.into_iter().filter(|triangle| *triangle != u32::MAX);
                            seen.parts.extend(block.map(|triangle| Part { triangle, node: index, lo, hi }));
                        }
                        let leaf = &mut seen.parts[first..];
                        leaf.sort_by_key(|part| part.triangle);
                        let twice = leaf.windows(2).find(|two| two[0].triangle == two[1].triangle);
                        twice.map_or(Ok(()), |two| Err(Flaw::Triangle(two[0].triangle as usize)))?;
                    } else {
                        once(&mut seen.nodes, child.index()).ok_or(Flaw::Node(child.index()))?;
                        open.push((child.index(), [lo, hi]));
                    }
                }
            }
        }
        let missing = |seen: &[bool]| seen.iter().position(|seen| !seen);
        missing(&seen.nodes).map_or(Ok(()), |i| Err(Flaw::Node(i)))?;
        missing(&seen.blocks).map_or(Ok(()), |i| Err(Flaw::Block(i)))?;
        seen.parts.sort_by_key(|part| part.triangle);
        let mut rest = &seen.parts[..];
        for (triangle, corners) in triangles.iter().enumerate() {
            let parts;
            (parts, rest) = rest.split_at(rest.iter().take_while(|part| part.triangle as usize == triangle).count());
            match parts {
                [] if corners.iter().all(|c| c.is_finite()) => return Err(Flaw::Triangle(triangle)),
                [] => {}
                [part, ..] => is_covered(corners, parts).then_some(()).ok_or(Flaw::Box(part.node))?,
            }
        }
        Ok(())
    }

    fn validate_block(&self, block: usize, triangles: &[[Vec3; 3]]) -> Result<(), Flaw> {
        let block = &self.blocks[block];
        for lane in (0..LANES).filter(|lane| block.triangle[*lane] != u32::MAX) {
            let triangle = block.triangle[lane] as usize;
            if triangles.get(triangle).map(|corners| corners.map(|c| c.to_array())) != Some(block.corners(lane)) {
                return Err(Flaw::Triangle(triangle));
            }
        }
        Ok(())
    }
}

struct Seen {
    nodes: Vec<bool>,
    blocks: Vec<bool>,
    parts: Vec<Part>,
}

/// A triangle in a leaf, whose box is in a node.
struct Part {
    triangle: u32,
    node: usize,
    lo: Vec3,
    hi: Vec3,
}

/// Whether a triangle's corners lie in the boxes of its parts and, where there are several, points all over it too.
fn is_covered(corners: &[Vec3; 3], parts: &[Part]) -> bool {
    /// Steps along an edge.
    const STEPS: usize = 16;
    let [a, b, c] = corners.map(|p| p.as_dvec3());
    // What the rounding of points on the triangle may be off by.
    let grace = 1e-15 * a.abs().max(b.abs()).max(c.abs()).max_element();
    let lies_in = |p: DVec3, grace: f64, part: &Part| {
        (p + grace).cmpge(part.lo.as_dvec3()).all() && (p - grace).cmple(part.hi.as_dvec3()).all()
    };
    let points = (0..=STEPS).flat_map(|i| (0..=STEPS - i).map(move |k| [i, k].map(|i| i as f64 / STEPS as f64)));
    let is_everywhere = || {
        let mut points = points.map(|[u, v]| a + (b - a) * u + (c - a) * v);
        points.all(|p| parts.iter().any(|part| lies_in(p, grace, part)))
    };
    [a, b, c].iter().all(|p| parts.iter().any(|part| lies_in(*p, 0.0, part))) && (parts.len() == 1 || is_everywhere())
}

/// Marks a place; `None` if it was marked before or does not exist.
fn once(seen: &mut [bool], at: usize) -> Option<()> {
    let place = seen.get_mut(at)?;
    (!std::mem::replace(place, true)).then_some(())
}

fn has_simd() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
    }
    #[cfg(target_arch = "aarch64")]
    {
        std::arch::is_aarch64_feature_detected!("neon")
    }
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    {
        false
    }
}

#[cfg(test)]
mod tests;
