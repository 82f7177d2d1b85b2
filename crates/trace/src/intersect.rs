//! A ray against a triangle and against a box, so that nothing slips through an edge or a vertex.
//!
//! Woop, Benthin & Wald 2013, "Watertight Ray/Triangle Intersection" (JCGT 2(1)): move the ray's origin to zero, shear
//! its direction onto the axis of its largest component, and ask on which side of the three projected edges the
//! origin lies. Every vertex is moved alike whichever triangle it belongs to, so two triangles that share an edge agree
//! about the side. The paper evaluates the edge functions U, V, W in f32 and again in f64 where one is zero; here they
//! are f64 at once. Products of two f32 are exact there, so signs are exact, and the distance stays good to a few units
//! of the largest coordinate (in f32 it loses all digits on slivers: 0.5 mm on one of 3 m by 1 mm).
//!
//! The tree finds what trying every triangle finds, bit for bit, because a box is never entered later than the distance
//! computed for a point inside it of a triangle. What that may be off by grows with the distance ([`CONE`]) and with the triangle ([`SLACK`], [`MARGIN`]). It does not grow
//! with the scene: where boxes are widened by what is enough at its far end, rays meet everything that lies in the plane they start from, and
//! find a tenth fewer nearest hits a second in a Cornell box and a sixth fewer in an office and a large building. Multiplication and addition of the triangle
//! test are never fused, or processors would disagree.

use crate::{Hit, Ray};
use glam::Vec3;

/// Boxes are entered earlier and left later by this part of the way along the axis on which the ray is steepest.
///
/// With u = 2^-24, z that axis, t the way along it, s the shear of a sideways axis a and D[a] the extent of a triangle along it: where the ray meets what is between
/// the corners these are, weighted as the hit is, s t + D[a] away along a and t + D[z] along z, and no further sideways than D[a] + s D[z] once sheared. A sheared
/// coordinate is off by up to u (s t + D[a]) for the corner, u s (t + D[z]) for the product and u (D[a] + s D[z]) for the difference; a depth by u (t + D[z]), which
/// counts along z alone, as it moves the hit along the ray. The rounded shear turns the ray by 2 u s, its distance is rounded by 2 u, that of a box by 4 u. Together, over
/// what the ray moves along a, that is 10 u t along z on any axis, of which this is 1.6 times; 2 u D[a], of which [`SLACK`] is twice; and 2 u D[z] along z,
/// of which [`MARGIN`] is one and a half times. Tests fail without any of the three.
const CONE: f32 = 1.0 / (1 << 20) as f32;

/// Boxes are larger than what they hold by this part of its extent, along each axis.
pub(crate) const SLACK: f32 = 1.0 / (1 << 22) as f32;

/// Boxes are entered earlier and left later by this part of the scene's largest extent, along the same axis: 3 u, less
/// than the 4 u that the [`Tracer`](crate::Tracer) moves origins off their surfaces, so that rays do not look whether they meet a wall they start from.
const MARGIN: f32 = 3.0 / (1 << 24) as f32;

/// Hits on backs compete as if they lay further by this part of the largest coordinate of the scene, so that the front
/// of a wall without thickness is met and not its back. Sixteen units in the last place: more than the distances of two
/// faces in one plane can differ, less than any wall that was modelled with a thickness.
const TIE: f32 = 1.0 / (1 << 20) as f32;

/// Rays are at least so long along the axis on which they are steepest.
const SMALLEST: f32 = 1.0 / (1u64 << 60) as f32;

/// Rays and scenes reach no further than this, so that no product overflows.
const LARGEST: f32 = (1u64 << 60) as f32;

/// The axes across each, as seen along it and against it.
const ACROSS: [[[usize; 2]; 2]; 3] = [[[1, 2], [2, 1]], [[2, 0], [0, 2]], [[0, 1], [1, 0]]];

/// Smallest box around all triangles that have finite corners; `None` without one.
pub(crate) fn bounds_of(triangles: &[[Vec3; 3]]) -> Option<[Vec3; 2]> {
    triangles
        .iter()
        .filter(|corners| corners.iter().all(|c| c.is_finite()))
        .flatten()
        .fold(None, |bounds, &p| Some(bounds.map_or([p, p], |[lo, hi]: [Vec3; 2]| [lo.min(p), hi.max(p)])))
}

/// By how much backs are set back in a scene with these bounds.
pub(crate) fn tie_of([lo, hi]: [Vec3; 2]) -> f32 {
    TIE * lo.abs().max(hi.abs()).max_element()
}

/// A ray made ready for triangles and boxes.
pub(crate) struct Prepared {
    pub origin: [f32; 3],
    pub t_max: f32,
    pub skip: u32,
    /// The axes that become x, y and z of the sheared frame; z is that of the largest component.
    pub axes: [usize; 3],
    /// Shear of x and y along z.
    pub shear: [f32; 2],
    /// Distance along the ray per distance along z.
    pub scale: f32,
    /// What backs are set back by.
    pub tie: f32,
    /// One over the direction, signs kept, magnitudes at most 2^126.
    pub inverse: [f32; 3],
    /// A box that is entered at e and left at l, the largest and the least of three distances, is met where max(e, `least`) is at most min(l, end of the
    /// ray) + `add`. `least` is a little less than `add`: by what may lie behind the origin.
    pub least: f32,
    pub add: f32,
    /// Per axis, the row of a node's bounds that the ray enters through; it leaves through the row 3 further, modulo 6.
    pub rows: [usize; 3],
}

impl Prepared {
    /// `None` where the ray cannot hit anything inside `bounds`.
    #[inline]
    pub fn new(ray: &Ray, bounds: [Vec3; 2]) -> Option<Prepared> {
        Prepared::with_tie(ray, bounds, tie_of(bounds))
    }

    /// The same where backs are set back by `tie`.
    #[inline(always)]
    pub fn with_tie(ray: &Ray, bounds: [Vec3; 2], tie: f32) -> Option<Prepared> {
        let [lo, hi] = bounds;
        let reach = (ray.origin - lo).abs().max((ray.origin - hi).abs()).max_element();
        let d = ray.direction.to_array();
        let steep = d.map(f32::abs);
        if !(ray.origin.is_finite() && ray.direction.is_finite() && reach <= LARGEST && ray.t_max > 0.0) {
            return None;
        }

        // The largest component becomes z; x and y change places where z looks backwards, which keeps the winding. All
        // without branches: where a ray goes nobody guesses.
        let first = usize::from(steep[0] <= steep[1]);
        let z = if steep[0].max(steep[1]) > steep[2] { first } else { 2 };
        let steepest = steep[0].max(steep[1]).max(steep[2]);
        if steepest < SMALLEST {
            return None;
        }
        let [x, y] = ACROSS[z][usize::from(d[z] < 0.0)];

        // Infinities are kept out, which would be no number where a box begins at the origin.
        let inverse = d.map(|d| 1.0 / d.abs().max(f32::MIN_POSITIVE).copysign(d));
        // Not by their numbers from arrays, for which a processor waits until these are in memory.
        let (scale, over) = (1.0 / d[z], 1.0 / steepest);
        let margin = MARGIN * (hi - lo).max_element() * over;
        let add = 2.0 * (CONE * reach.min(ray.t_max * steepest) * over + margin);
        Some(Prepared {
            origin: ray.origin.to_array(),
            t_max: ray.t_max,
            skip: ray.skip,
            axes: [x, y, z],
            shear: [d[x] * scale, d[y] * scale],
            scale,
            tie,
            inverse,
            least: add - margin,
            add,
            rows: std::array::from_fn(|axis| axis + 3 * usize::from(d[axis].is_sign_negative())),
        })
    }

    /// The hit on one triangle, if there is one within the ray's reach. The SIMD code repeats this line by line.
    pub fn hit(&self, corners: [[f32; 3]; 3], triangle: u32) -> Option<Hit> {
        let [kx, ky, kz] = self.axes;
        let sheared = |corner: [f32; 3]| {
            let z = corner[kz] - self.origin[kz];
            let x = (corner[kx] - self.origin[kx]) - self.shear[0] * z;
            let y = (corner[ky] - self.origin[ky]) - self.shear[1] * z;
            [f64::from(x), f64::from(y), f64::from(z)]
        };
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = corners.map(sheared);
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        let one_side = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
        let det = (u + v) + w;
        let t = (((((u * az) + (v * bz)) + (w * cz)) / det) * f64::from(self.scale)) as f32;
        // A triangle seen edge on has det = 0 and t = 0/0, which no comparison accepts.
        if !(one_side && t > 0.0 && t < self.t_max) || triangle == self.skip {
            return None;
        }
        Some(Hit { t, triangle, u: (v / det) as f32, v: (w / det) as f32, back: det < 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hit(triangle: [Vec3; 3], origin: Vec3, direction: Vec3) -> Option<Hit> {
        let ray = Ray { origin, direction: direction.normalize(), t_max: f32::INFINITY, skip: u32::MAX };
        Prepared::new(&ray, bounds_of(&[triangle])?)?.hit(triangle.map(|c| c.to_array()), 7)
    }

    #[test]
    fn weights_distance_and_side_of_a_known_hit() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let front = hit(corners, Vec3::new(0.25, 0.5, 2.0), -Vec3::Z);
        assert_eq!(front, Some(Hit { t: 2.0, triangle: 7, u: 0.25, v: 0.5, back: false }));
        let back = hit(corners, Vec3::new(0.25, 0.5, -2.0), Vec3::Z);
        assert_eq!(back, Some(Hit { t: 2.0, triangle: 7, u: 0.25, v: 0.5, back: true }));
        assert_eq!(hit(corners, Vec3::new(0.75, 0.5, 2.0), -Vec3::Z), None);
        assert_eq!(hit(corners, Vec3::new(0.25, 0.5, 2.0), Vec3::Z), None);
    }

    #[test]
    fn the_side_agrees_with_the_normal_for_every_main_axis() {
        let corners = [Vec3::new(0.1, 0.2, -0.3), Vec3::new(0.9, -0.4, 0.2), Vec3::new(-0.3, 0.8, 0.7)];
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        for d in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [axis, -axis]) {
            let d = (d + Vec3::new(0.2, -0.1, 0.15)).normalize();
            let found = hit(corners, middle - 2.0 * d, d).expect("aimed at the middle");
            assert_eq!(found.back, normal.dot(d) > 0.0, "{d}");
            assert!((found.t - 2.0).abs() < 1e-5 && (found.u - 1.0 / 3.0).abs() < 1e-5, "{found:?}");
        }
    }

    #[test]
    fn a_tilted_sliver_keeps_its_distance() {
        // 3 m long, 1 mm wide, at 45 degrees to the ray: f32 edge functions were off by up to 0.5 mm.
        let corners = [Vec3::new(0.0, 0.0, 0.0), Vec3::new(2.0, 1.0, 3.0), Vec3::new(2.0005, 0.9991, 3.0)];
        let normal = (corners[1] - corners[0]).as_dvec3().cross((corners[2] - corners[0]).as_dvec3());
        for i in 1..1000 {
            let s = i as f32 / 1000.0;
            let point = corners[0] * (1.0 - s) + (corners[1] + corners[2]) * (0.5 * s);
            let origin = point + Vec3::new(0.3, 0.4, 5.0);
            let direction = (point - origin).normalize();
            let Some(found) = hit(corners, origin, direction) else { continue };
            let exact = -origin.as_dvec3().dot(normal) / direction.as_dvec3().dot(normal);
            assert!((f64::from(found.t) - exact).abs() < 2e-5, "{s}: {} against {exact}", found.t);
        }
    }

    #[test]
    fn wild_numbers_hit_nothing_and_do_not_panic() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let bounds = bounds_of(&[corners]).expect("finite");
        for x in [f32::NAN, f32::INFINITY, f32::MAX, -f32::MAX] {
            for ray in [
                Ray { origin: Vec3::new(0.2, x, 1.0), direction: -Vec3::Z, t_max: 9.0, skip: 0 },
                Ray { origin: Vec3::new(0.2, x, 1.0), direction: Vec3::ZERO, t_max: 9.0, skip: 0 },
            ] {
                assert!(Prepared::new(&ray, bounds).is_none(), "{ray:?}");
            }
        }
        let nan = Ray { origin: Vec3::ONE, direction: Vec3::new(0.0, f32::NAN, 1.0), t_max: f32::NAN, skip: 0 };
        assert!(Prepared::new(&nan, bounds).is_none());
        assert!(bounds_of(&[[Vec3::ZERO, Vec3::X, Vec3::splat(f32::NAN)]]).is_none());
    }
}
