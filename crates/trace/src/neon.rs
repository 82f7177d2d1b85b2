//! A ray in the registers of NEON, for the [`walk`] through the tree: two of them hold eight boxes, or four triangles in double precision.

use crate::intersect::Prepared;
use crate::tree::{Block, LANES, Node, Tree, WIDTH};
use crate::walk::{self, Candidate, Candidates, Lanes};
use crate::{Hit, Ray};
use std::arch::aarch64::*;

/// What the first and the second four boxes of eight count as bits.
const BITS: [[u32; 4]; 2] = [[1, 2, 4, 8], [16, 32, 64, 128]];

/// The ray in every lane.
struct Neon {
    origin: [float32x4_t; 3],
    inverse: [float32x4_t; 3],
    least: float32x4_t,
    add: float32x4_t,
    /// Offsets of the rows of bounds through which the ray enters and leaves, in numbers.
    enter: [usize; 3],
    leave: [usize; 3],
    shear: [float32x4_t; 2],
    corner: [float32x4_t; 3],
    scale: float64x2_t,
    tie: float32x2_t,
    t_max: float32x4_t,
    skip: uint32x4_t,
    bits: [uint32x4_t; 2],
}

impl Neon {
    #[inline]
    #[target_feature(enable = "neon")]
    fn new(ray: &Prepared) -> Neon {
        let three = |x: [f32; 3]| [vdupq_n_f32(x[0]), vdupq_n_f32(x[1]), vdupq_n_f32(x[2])];
        let [kx, ky, kz] = ray.axes;
        Neon {
            origin: three(ray.origin),
            inverse: three(ray.inverse),
            least: vdupq_n_f32(ray.least),
            add: vdupq_n_f32(ray.add),
            enter: ray.rows.map(|row| row * WIDTH),
            leave: ray.rows.map(|row| (if row < 3 { row + 3 } else { row - 3 }) * WIDTH),
            shear: [vdupq_n_f32(ray.shear[0]), vdupq_n_f32(ray.shear[1])],
            corner: [vdupq_n_f32(ray.origin[kx]), vdupq_n_f32(ray.origin[ky]), vdupq_n_f32(ray.origin[kz])],
            scale: vdupq_n_f64(f64::from(ray.scale)),
            tie: vdup_n_f32(ray.tie),
            t_max: vdupq_n_f32(ray.t_max),
            skip: vdupq_n_u32(ray.skip),
            // SAFETY: four numbers lie in each.
            bits: unsafe { [vld1q_u32(BITS[0].as_ptr()), vld1q_u32(BITS[1].as_ptr())] },
        }
    }

    /// Bits of the boxes met no later than `limit`, which has been widened, and the distances of all.
    #[inline]
    #[target_feature(enable = "neon")]
    fn met(&self, node: &Node, limit: float32x4_t) -> (u32, [float32x4_t; 2]) {
        let rows: *const f32 = node.bounds.as_ptr().cast();
        let (mut near, mut far) = ([self.least; 2], [limit; 2]);
        for axis in 0..3 {
            for half in 0..2 {
                // SAFETY: both offsets are row × 8 with row < 6, so twice four numbers lie there.
                let (enter, leave) = unsafe {
                    let at = |row: usize| vld1q_f32(rows.add(row + 4 * half));
                    (at(self.enter[axis]), at(self.leave[axis]))
                };
                let enter = vsubq_f32(enter, self.origin[axis]);
                let leave = vsubq_f32(leave, self.origin[axis]);
                near[half] = vmaxq_f32(vmulq_f32(enter, self.inverse[axis]), near[half]);
                far[half] = vminq_f32(vfmaq_f32(self.add, leave, self.inverse[axis]), far[half]);
            }
        }
        let bits = [0, 1].map(|half| vandq_u32(vcleq_f32(near[half], far[half]), self.bits[half]));
        (vaddvq_u32(vorrq_u32(bits[0], bits[1])), near)
    }

    /// Shows `found` the triangles that are hit with a key of at most `limit`; it ends the search by `true`.
    #[inline]
    #[target_feature(enable = "neon")]
    fn hit(&self, block: &Block, axes: [usize; 3], limit: f32, found: impl FnMut(Candidate) -> bool) -> bool {
        let [kx, ky, kz] = axes;
        let rows: *const f32 = block.corner.as_ptr().cast();
        // SAFETY: the axes are a permutation of 0, 1, 2, so the rows lie within the nine of four numbers.
        let row = |corner: usize, axis: usize| unsafe { vld1q_f32(rows.add((corner * 3 + axis) * LANES)) };
        let sheared = |corner: usize| {
            let z = vsubq_f32(row(corner, kz), self.corner[2]);
            let x = vsubq_f32(vsubq_f32(row(corner, kx), self.corner[0]), vmulq_f32(self.shear[0], z));
            let y = vsubq_f32(vsubq_f32(row(corner, ky), self.corner[1]), vmulq_f32(self.shear[1], z));
            [x, y, z]
        };
        let corners = [sheared(0), sheared(1), sheared(2)];
        let first = Edges::new(corners.map(|corner| corner.map(|x| vcvt_f64_f32(vget_low_f32(x)))));
        let second = Edges::new(corners.map(|corner| corner.map(|x| vcvt_high_f64_f32(x))));
        let inside = vcombine_u32(vmovn_u64(first.inside), vmovn_u64(second.inside));
        if vmaxvq_u32(inside) == 0 {
            return false;
        }

        let ([t, key], [t_high, key_high]) = (first.distances(self), second.distances(self));
        let (t, key) = (vcombine_f32(t, t_high), vcombine_f32(key, key_high));
        let within = vandq_u32(
            vandq_u32(vcgtzq_f32(t), vcltq_f32(t, self.t_max)),
            vandq_u32(vcleq_f32(key, vdupq_n_f32(limit)), inside),
        );
        // SAFETY: four indices lie there.
        let triangle = unsafe { vld1q_u32(block.triangle.as_ptr()) };
        let mask = vaddvq_u32(vandq_u32(vbicq_u32(within, vceqq_u32(triangle, self.skip)), self.bits[0]));
        if mask == 0 {
            return false;
        }

        let mut hits = Candidates::default();
        // SAFETY: each array has room for its four numbers.
        unsafe {
            vst1q_f32(hits.t.as_mut_ptr(), t);
            vst1q_f32(hits.key.as_mut_ptr(), key);
            for (edges, at) in [(&first, 0), (&second, 2)] {
                vst1q_f64(hits.v.as_mut_ptr().add(at), edges.v);
                vst1q_f64(hits.w.as_mut_ptr().add(at), edges.w);
                vst1q_f64(hits.det.as_mut_ptr().add(at), edges.det);
            }
        }
        hits.show(block, mask, found)
    }
}

/// Two triangles seen from the ray: on which side of their edges it passes.
struct Edges {
    u: float64x2_t,
    v: float64x2_t,
    w: float64x2_t,
    det: float64x2_t,
    /// Sheared depths of the corners.
    depths: [float64x2_t; 3],
    inside: uint64x2_t,
}

impl Edges {
    #[inline]
    #[target_feature(enable = "neon")]
    fn new([[ax, ay, az], [bx, by, bz], [cx, cy, cz]]: [[float64x2_t; 3]; 3]) -> Edges {
        let u = vsubq_f64(vmulq_f64(cx, by), vmulq_f64(cy, bx));
        let v = vsubq_f64(vmulq_f64(ax, cy), vmulq_f64(ay, cx));
        let w = vsubq_f64(vmulq_f64(bx, ay), vmulq_f64(by, ax));
        let least = vminq_f64(vminq_f64(u, v), w);
        let most = vmaxq_f64(vmaxq_f64(u, v), w);
        let inside = vorrq_u64(vcgezq_f64(least), vclezq_f64(most));
        Edges { u, v, w, det: vaddq_f64(vaddq_f64(u, v), w), depths: [az, bz, cz], inside }
    }

    /// Those along the ray, and the keys by which they compete.
    #[inline]
    #[target_feature(enable = "neon")]
    fn distances(&self, ray: &Neon) -> [float32x2_t; 2] {
        let [az, bz, cz] = self.depths;
        let sum = vaddq_f64(vaddq_f64(vmulq_f64(self.u, az), vmulq_f64(self.v, bz)), vmulq_f64(self.w, cz));
        let t = vcvt_f32_f64(vmulq_f64(vdivq_f64(sum, self.det), ray.scale));
        // The tie for lanes with a negative determinant, 0 for others.
        let is_back = vmovn_u64(vcltzq_f64(self.det));
        let set_back = vreinterpret_f32_u32(vand_u32(is_back, vreinterpret_u32_f32(ray.tie)));
        [t, vadd_f32(t, set_back)]
    }
}

impl Lanes for Neon {
    type Eight = [float32x4_t; 2];

    #[inline(always)]
    fn boxes(&self, node: &Node, limit: f32) -> (u32, Self::Eight) {
        // SAFETY: there is a `Neon` only where the processor has it.
        unsafe { self.met(node, vdupq_n_f32(limit)) }
    }

    #[inline(always)]
    fn distances(&self, [low, high]: Self::Eight) -> [f32; WIDTH] {
        let mut distances = [0.0f32; WIDTH];
        // SAFETY: twice four numbers fit, and there is a `Neon` only where the processor has it.
        unsafe {
            vst1q_f32(distances.as_mut_ptr(), low);
            vst1q_f32(distances.as_mut_ptr().add(4), high);
        }
        distances
    }

    #[inline(always)]
    fn triangles(&self, block: &Block, axes: [usize; 3], limit: f32, found: impl FnMut(Candidate) -> bool) -> bool {
        // SAFETY: there is a `Neon` only where the processor has it.
        unsafe { self.hit(block, axes, limit, found) }
    }
}

#[target_feature(enable = "neon")]
pub(crate) fn closest(tree: &Tree, ray: &Ray, accept: &mut impl FnMut(u32, f32, f32, bool) -> bool) -> Option<Hit> {
    let ray = tree.prepared(ray)?;
    walk::closest(tree, &ray, &Neon::new(&ray), accept)
}

#[target_feature(enable = "neon")]
pub(crate) fn blocked(tree: &Tree, ray: &Ray, accept: &mut impl FnMut(u32, f32, f32, bool) -> bool) -> bool {
    let Some(ray) = tree.prepared(ray) else { return false };
    walk::blocked(tree, &ray, &Neon::new(&ray), accept)
}
