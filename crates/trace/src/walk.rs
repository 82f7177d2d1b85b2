//! The walk through the tree by a processor's registers: eight boxes at once, four triangles at once.
//!
//! Hits are those of `portable`, bit for bit: the triangle test repeats [`Prepared::hit`] operation by operation in four
//! lanes, and boxes only decide what is looked at.
//!
//! Tried and left, in a furnished room: nearest box first where any hit will do (14 % slower than in the order they
//! come), fetching the boxes met ahead of their turn (3 % slower, and no faster in a building of a million triangles), boxes
//! put on the stack by a permutation without branches and in the order of the ray's octant (30 % slower: the processor guesses well),
//! eight triangles at once in single precision with the exact test for those that pass (no faster), coordinates over directions worked out
//! once per ray (no faster), boxes widened by other inverses of the direction on the sides where rays enter and leave (5 % slower in a Cornell box).
//! Pages of 2 MiB made 4 % more rays a second in that building, and its tree took half as long again to build. Nodes and the blocks below them side by side in
//! one array made 3 to 5 % more there and no more elsewhere. Nodes of 128 bytes, with bounds as bytes, made a sixth to a quarter fewer in an office
//! (docs/performance.md): rays wait for arithmetic and for guesses, not for nodes. Eight rays in turn, a step each, what they need next fetched
//! meanwhile: single rays 1.3 to 1.9 times as fast there, but 64 from each point, which are what there is to trace, 0.8 times.

use crate::Hit;
use crate::build::MAX_DEPTH;
use crate::intersect::Prepared;
use crate::tree::{Block, Child, LANES, Node, Tree, WIDTH};
use std::mem::MaybeUninit;

/// A ray in every lane of a processor's registers.
pub(crate) trait Lanes {
    /// Eight numbers.
    type Eight: Copy;

    /// Bits of the boxes met no later than `limit`, which has been widened, and the distances of all.
    fn boxes(&self, node: &Node, limit: f32) -> (u32, Self::Eight);

    fn distances(&self, eight: Self::Eight) -> [f32; WIDTH];

    /// Shows `found` the triangles that are hit with a key of at most `limit`; it ends the search by `true`.
    fn triangles(&self, block: &Block, axes: [usize; 3], limit: f32, found: impl FnMut(Candidate) -> bool) -> bool;
}

/// Each level leaves at most seven boxes behind, and the wide tree is no deeper than the binary one.
const STACK: usize = (WIDTH - 1) * MAX_DEPTH + WIDTH;

/// Boxes still to be opened: the distance's bits above the child's. Distances are not negative, so the integers are in
/// the distances' order. The places are the caller's and apart from their number, or the compiler fills both with zeros
/// for every ray, which took a fifth of the time in the Cornell box.
struct Stack<'a> {
    place: &'a mut [MaybeUninit<u64>; STACK],
    len: usize,
}

impl Stack<'_> {
    #[inline(always)]
    fn push(&mut self, entry: u64) {
        self.place[self.len].write(entry);
        self.len += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<u64> {
        self.len = self.len.checked_sub(1)?;
        // SAFETY: places below the old length were written by `push` or moved there by `sort_from`.
        Some(unsafe { self.place[self.len].assume_init() })
    }

    /// Sorts what was pushed since the length was `first`, the nearest last. Mostly two or three entries.
    #[inline(always)]
    fn sort_from(&mut self, first: usize) {
        let new = &mut self.place[first..self.len];
        for i in 1..new.len() {
            // SAFETY: all of `new` lies below the length and was written.
            let entry = unsafe { new[i].assume_init() };
            let mut j = i;
            // SAFETY: as above.
            while j > 0 && unsafe { new[j - 1].assume_init() } < entry {
                new[j] = new[j - 1];
                j -= 1;
            }
            new[j].write(entry);
        }
    }
}

/// A hit, before the divisions.
#[derive(Clone, Copy)]
pub(crate) struct Candidate {
    pub key: f32,
    pub t: f32,
    pub triangle: u32,
    pub v: f64,
    pub w: f64,
    pub det: f64,
}

impl Candidate {
    #[inline(always)]
    fn hit(&self) -> Hit {
        let Candidate { t, triangle, v, w, det, .. } = *self;
        Hit { t, triangle, u: (v / det) as f32, v: (w / det) as f32, back: det < 0.0 }
    }
}

/// What a ray found of the triangles of a block, lane by lane.
#[derive(Default)]
pub(crate) struct Candidates {
    pub key: [f32; LANES],
    pub t: [f32; LANES],
    pub v: [f64; LANES],
    pub w: [f64; LANES],
    pub det: [f64; LANES],
}

impl Candidates {
    /// Shows `found` those that are hits, as bits of a mask; it ends the search by `true`.
    #[inline(always)]
    pub fn show(&self, block: &Block, mut mask: u32, mut found: impl FnMut(Candidate) -> bool) -> bool {
        let Candidates { key, t, v, w, det } = self;
        while mask != 0 {
            let i = mask.trailing_zeros() as usize % LANES;
            mask &= mask - 1;
            let triangle = block.triangle[i];
            if found(Candidate { key: key[i], t: t[i], triangle, v: v[i], w: w[i], det: det[i] }) {
                return true;
            }
        }
        false
    }
}

#[inline(always)]
pub(crate) fn closest<L: Lanes>(
    tree: &Tree,
    ray: &Prepared,
    lanes: &L,
    accept: &mut impl FnMut(u32, f32, f32, bool) -> bool,
) -> Option<Hit> {
    let mut best = Candidate { key: f32::INFINITY, t: 0.0, triangle: u32::MAX, v: 0.0, w: 0.0, det: 0.0 };
    // The least key so far, or the ray's end, widened: boxes behind it are not opened.
    let mut limit = ray.t_max + ray.add;
    let mut place = [const { MaybeUninit::uninit() }; STACK];
    let mut stack = Stack { place: &mut place, len: 0 };
    let mut child = Child::node(0);
    loop {
        if child.is_leaf() {
            for block in &tree.blocks[child.blocks()] {
                lanes.triangles(block, ray.axes, best.key, |found| {
                    let nearer = found.key < best.key || (found.key == best.key && found.triangle < best.triangle);
                    let Hit { triangle, u, v, back, .. } = found.hit();
                    if nearer && accept(triangle, u, v, back) {
                        best = found;
                        limit = limit.min(found.key + ray.add);
                    }
                    false
                });
            }
        } else {
            let node = &tree.nodes[child.index()];
            let (mut mask, near) = lanes.boxes(node, limit);
            if mask != 0 {
                let distance = lanes.distances(near);
                let entry = |slot: usize| u64::from(distance[slot].to_bits()) << 32 | u64::from(node.child[slot].0);
                let slot = mask.trailing_zeros() as usize % WIDTH;
                mask &= mask - 1;
                if mask == 0 {
                    child = node.child[slot];
                    continue;
                }
                let (a, b) = (entry(slot), entry(mask.trailing_zeros() as usize % WIDTH));
                mask &= mask - 1;
                if mask == 0 {
                    // Two are the most common number after one: straight into the nearer.
                    stack.push(a.max(b));
                    child = Child(a.min(b) as u32);
                    continue;
                }
                let first = stack.len;
                stack.push(a);
                stack.push(b);
                while mask != 0 {
                    stack.push(entry(mask.trailing_zeros() as usize % WIDTH));
                    mask &= mask - 1;
                }
                stack.sort_from(first);
            }
        }
        // The next box that is not behind the nearest hit.
        child = loop {
            let Some(entry) = stack.pop() else {
                return (best.triangle != u32::MAX).then(|| best.hit());
            };
            if f32::from_bits((entry >> 32) as u32) <= limit {
                break Child(entry as u32);
            }
        };
    }
}

#[inline(always)]
pub(crate) fn blocked<L: Lanes>(
    tree: &Tree,
    ray: &Prepared,
    lanes: &L,
    accept: &mut impl FnMut(u32, f32, f32, bool) -> bool,
) -> bool {
    let limit = ray.t_max + ray.add;
    let mut place = [const { MaybeUninit::uninit() }; STACK];
    let mut stack = Stack { place: &mut place, len: 0 };
    let mut child = Child::node(0);
    loop {
        if child.is_leaf() {
            for block in &tree.blocks[child.blocks()] {
                let found = |found: Candidate| {
                    let Hit { triangle, u, v, back, .. } = found.hit();
                    accept(triangle, u, v, back)
                };
                if lanes.triangles(block, ray.axes, f32::INFINITY, found) {
                    return true;
                }
            }
        } else {
            let node = &tree.nodes[child.index()];
            let (mut mask, _) = lanes.boxes(node, limit);
            while mask != 0 {
                stack.push(u64::from(node.child[mask.trailing_zeros() as usize % WIDTH].0));
                mask &= mask - 1;
            }
        }
        let Some(entry) = stack.pop() else { return false };
        child = Child(entry as u32);
    }
}
