//! The walk through the tree with AVX2: eight boxes at once, four triangles at once.
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
//! one array made 3 to 5 % more there and no more elsewhere. Eight rays in turn, a step each, what they need next fetched meanwhile: single rays 1.3
//! to 1.9 times as fast there, but 64 from each point, which are what there is to trace, 0.8 times.

use crate::build::MAX_DEPTH;
use crate::intersect::Prepared;
use crate::tree::{Block, Child, LANES, Node, Tree, WIDTH};
use crate::{Hit, Ray};
use std::arch::x86_64::*;
use std::mem::MaybeUninit;

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

/// The ray in every lane.
struct Lanes {
    origin: [__m256; 3],
    inverse: [__m256; 3],
    least: __m256,
    add: __m256,
    /// Offsets of the rows of bounds through which the ray enters and leaves, in numbers.
    enter: [usize; 3],
    leave: [usize; 3],
    shear: [__m128; 2],
    corner: [__m128; 3],
    scale: __m256d,
    tie: __m256d,
    t_max: __m128,
    skip: __m128i,
}

impl Lanes {
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn new(ray: &Prepared) -> Lanes {
        let three = |x: [f32; 3]| [_mm256_set1_ps(x[0]), _mm256_set1_ps(x[1]), _mm256_set1_ps(x[2])];
        let [kx, ky, kz] = ray.axes;
        Lanes {
            origin: three(ray.origin),
            inverse: three(ray.inverse),
            least: _mm256_set1_ps(ray.least),
            add: _mm256_set1_ps(ray.add),
            enter: ray.rows.map(|row| row * WIDTH),
            leave: ray.rows.map(|row| (if row < 3 { row + 3 } else { row - 3 }) * WIDTH),
            shear: [_mm_set1_ps(ray.shear[0]), _mm_set1_ps(ray.shear[1])],
            corner: [_mm_set1_ps(ray.origin[kx]), _mm_set1_ps(ray.origin[ky]), _mm_set1_ps(ray.origin[kz])],
            scale: _mm256_set1_pd(f64::from(ray.scale)),
            tie: _mm256_set1_pd(f64::from(ray.tie)),
            t_max: _mm_set1_ps(ray.t_max),
            skip: _mm_set1_epi32(ray.skip as i32),
        }
    }

    /// Bits of the boxes met no later than `limit`, which has been widened, and the distances of all.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn boxes(&self, node: &Node, limit: __m256) -> (u32, __m256) {
        let rows: *const f32 = node.bounds.as_ptr().cast();
        let (mut near, mut far) = (self.least, limit);
        for axis in 0..3 {
            // SAFETY: both offsets are row × 8 with row < 6, so eight numbers lie there.
            let (enter, leave) =
                unsafe { (_mm256_loadu_ps(rows.add(self.enter[axis])), _mm256_loadu_ps(rows.add(self.leave[axis]))) };
            let enter = _mm256_sub_ps(enter, self.origin[axis]);
            let leave = _mm256_sub_ps(leave, self.origin[axis]);
            near = _mm256_max_ps(_mm256_mul_ps(enter, self.inverse[axis]), near);
            far = _mm256_min_ps(_mm256_fmadd_ps(leave, self.inverse[axis], self.add), far);
        }
        (_mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(near, far)) as u32, near)
    }

    /// Shows `found` the triangles that are hit with a key of at most `limit`; it ends the search by `true`.
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn triangles(&self, block: &Block, axes: [usize; 3], limit: f32, mut found: impl FnMut(Candidate) -> bool) -> bool {
        let [kx, ky, kz] = axes;
        let rows: *const f32 = block.corner.as_ptr().cast();
        // SAFETY: the axes are a permutation of 0, 1, 2, so the rows lie within the nine of four numbers.
        let row = |corner: usize, axis: usize| unsafe { _mm_loadu_ps(rows.add((corner * 3 + axis) * LANES)) };
        let sheared = |corner: usize| {
            let z = _mm_sub_ps(row(corner, kz), self.corner[2]);
            let x = _mm_sub_ps(_mm_sub_ps(row(corner, kx), self.corner[0]), _mm_mul_ps(self.shear[0], z));
            let y = _mm_sub_ps(_mm_sub_ps(row(corner, ky), self.corner[1]), _mm_mul_ps(self.shear[1], z));
            [_mm256_cvtps_pd(x), _mm256_cvtps_pd(y), _mm256_cvtps_pd(z)]
        };
        let ([ax, ay, az], [bx, by, bz], [cx, cy, cz]) = (sheared(0), sheared(1), sheared(2));
        let u = _mm256_sub_pd(_mm256_mul_pd(cx, by), _mm256_mul_pd(cy, bx));
        let v = _mm256_sub_pd(_mm256_mul_pd(ax, cy), _mm256_mul_pd(ay, cx));
        let w = _mm256_sub_pd(_mm256_mul_pd(bx, ay), _mm256_mul_pd(by, ax));
        let zero = _mm256_setzero_pd();
        let least = _mm256_min_pd(_mm256_min_pd(u, v), w);
        let most = _mm256_max_pd(_mm256_max_pd(u, v), w);
        let one_side = _mm256_or_pd(_mm256_cmp_pd::<_CMP_GE_OQ>(least, zero), _mm256_cmp_pd::<_CMP_LE_OQ>(most, zero));
        let inside = _mm256_movemask_pd(one_side) as u32;
        if inside == 0 {
            return false;
        }

        let det = _mm256_add_pd(_mm256_add_pd(u, v), w);
        let sum = _mm256_add_pd(_mm256_add_pd(_mm256_mul_pd(u, az), _mm256_mul_pd(v, bz)), _mm256_mul_pd(w, cz));
        let t = _mm256_cvtpd_ps(_mm256_mul_pd(_mm256_div_pd(sum, det), self.scale));
        // The tie for lanes with a negative determinant, 0 for others.
        let set_back = _mm256_cvtpd_ps(_mm256_and_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(det, zero), self.tie));
        let key = _mm_add_ps(t, set_back);
        let within = _mm_and_ps(
            _mm_and_ps(_mm_cmp_ps::<_CMP_GT_OQ>(t, _mm_setzero_ps()), _mm_cmp_ps::<_CMP_LT_OQ>(t, self.t_max)),
            _mm_cmp_ps::<_CMP_LE_OQ>(key, _mm_set1_ps(limit)),
        );
        // SAFETY: four indices lie there.
        let triangle = unsafe { _mm_loadu_si128(block.triangle.as_ptr().cast()) };
        let skipped = _mm_castsi128_ps(_mm_cmpeq_epi32(triangle, self.skip));
        let mut mask = inside & _mm_movemask_ps(_mm_andnot_ps(skipped, within)) as u32;
        if mask == 0 {
            return false;
        }

        let (mut ts, mut keys) = ([0.0f32; LANES], [0.0f32; LANES]);
        let (mut vs, mut ws, mut dets) = ([0.0f64; LANES], [0.0f64; LANES], [0.0f64; LANES]);
        // SAFETY: each array has room for its four numbers.
        unsafe {
            _mm_storeu_ps(ts.as_mut_ptr(), t);
            _mm_storeu_ps(keys.as_mut_ptr(), key);
            _mm256_storeu_pd(vs.as_mut_ptr(), v);
            _mm256_storeu_pd(ws.as_mut_ptr(), w);
            _mm256_storeu_pd(dets.as_mut_ptr(), det);
        }
        while mask != 0 {
            let i = mask.trailing_zeros() as usize % LANES;
            mask &= mask - 1;
            let (key, t, triangle) = (keys[i], ts[i], block.triangle[i]);
            if found(Candidate { key, t, triangle, v: vs[i], w: ws[i], det: dets[i] }) {
                return true;
            }
        }
        false
    }
}

/// A hit, before the divisions.
#[derive(Clone, Copy)]
struct Candidate {
    key: f32,
    t: f32,
    triangle: u32,
    v: f64,
    w: f64,
    det: f64,
}

impl Candidate {
    #[inline(always)]
    fn hit(&self) -> Hit {
        let Candidate { t, triangle, v, w, det, .. } = *self;
        Hit { t, triangle, u: (v / det) as f32, v: (w / det) as f32, back: det < 0.0 }
    }
}

#[target_feature(enable = "avx2,fma")]
pub(crate) fn closest(tree: &Tree, ray: &Ray, accept: &mut impl FnMut(u32, f32, f32, bool) -> bool) -> Option<Hit> {
    let ray = tree.prepared(ray)?;
    let lanes = Lanes::new(&ray);
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
            let (mut mask, near) = lanes.boxes(node, _mm256_set1_ps(limit));
            if mask != 0 {
                let mut distance = [0.0f32; WIDTH];
                // SAFETY: eight numbers fit.
                unsafe { _mm256_storeu_ps(distance.as_mut_ptr(), near) };
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

#[target_feature(enable = "avx2,fma")]
pub(crate) fn blocked(tree: &Tree, ray: &Ray, accept: &mut impl FnMut(u32, f32, f32, bool) -> bool) -> bool {
    let Some(ray) = tree.prepared(ray) else { return false };
    let lanes = Lanes::new(&ray);
    let limit = _mm256_set1_ps(ray.t_max + ray.add);
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
