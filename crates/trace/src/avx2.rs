//! A ray in the registers of AVX2, for the [`walk`] through the tree.

use crate::intersect::Prepared;
use crate::tree::{Block, LANES, Node, Tree, WIDTH};
use crate::walk::{self, Candidate, Candidates, Lanes};
use crate::{Hit, Ray};
use std::arch::x86_64::*;

/// The ray in every lane.
struct Avx2 {
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

impl Avx2 {
    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn new(ray: &Prepared) -> Avx2 {
        let three = |x: [f32; 3]| [_mm256_set1_ps(x[0]), _mm256_set1_ps(x[1]), _mm256_set1_ps(x[2])];
        let [kx, ky, kz] = ray.axes;
        Avx2 {
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
    fn met(&self, node: &Node, limit: __m256) -> (u32, __m256) {
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
    fn hit(&self, block: &Block, axes: [usize; 3], limit: f32, found: impl FnMut(Candidate) -> bool) -> bool {
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
        let mask = inside & _mm_movemask_ps(_mm_andnot_ps(skipped, within)) as u32;
        if mask == 0 {
            return false;
        }

        let mut hits = Candidates::default();
        // SAFETY: each array has room for its four numbers.
        unsafe {
            _mm_storeu_ps(hits.t.as_mut_ptr(), t);
            _mm_storeu_ps(hits.key.as_mut_ptr(), key);
            _mm256_storeu_pd(hits.v.as_mut_ptr(), v);
            _mm256_storeu_pd(hits.w.as_mut_ptr(), w);
            _mm256_storeu_pd(hits.det.as_mut_ptr(), det);
        }
        hits.show(block, mask, found)
    }
}

impl Lanes for Avx2 {
    type Eight = __m256;

    #[inline(always)]
    fn boxes(&self, node: &Node, limit: f32) -> (u32, __m256) {
        // SAFETY: there is an `Avx2` only where the processor has AVX2 and FMA.
        unsafe { self.met(node, _mm256_set1_ps(limit)) }
    }

    #[inline(always)]
    fn distances(&self, eight: __m256) -> [f32; WIDTH] {
        let mut distances = [0.0f32; WIDTH];
        // SAFETY: eight numbers fit, and there is an `Avx2` only where the processor has AVX2 and FMA.
        unsafe { _mm256_storeu_ps(distances.as_mut_ptr(), eight) };
        distances
    }

    #[inline(always)]
    fn triangles(&self, block: &Block, axes: [usize; 3], limit: f32, found: impl FnMut(Candidate) -> bool) -> bool {
        // SAFETY: there is an `Avx2` only where the processor has AVX2 and FMA.
        unsafe { self.hit(block, axes, limit, found) }
    }
}

#[target_feature(enable = "avx2,fma")]
pub(crate) fn closest(tree: &Tree, ray: &Ray, accept: &mut impl FnMut(u32, f32, f32, bool) -> bool) -> Option<Hit> {
    let ray = tree.prepared(ray)?;
    walk::closest(tree, &ray, &Avx2::new(&ray), accept)
}

#[target_feature(enable = "avx2,fma")]
pub(crate) fn blocked(tree: &Tree, ray: &Ray, accept: &mut impl FnMut(u32, f32, f32, bool) -> bool) -> bool {
    let Some(ray) = tree.prepared(ray) else { return false };
    walk::blocked(tree, &ray, &Avx2::new(&ray), accept)
}
