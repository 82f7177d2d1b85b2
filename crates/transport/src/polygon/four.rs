//! Form factors of four triangles from a point at once: what the lights of a room give to a place, before anything is
//! said of shadows, is the sum of dozens of them.
//!
//! The operations are those of [`point_to_triangle`], lane by lane and in the same order, so the results are the same
//! bit for bit. Triangles that the receiver's horizon cuts are left to it.

use super::{ABOVE, BELOW, point_to_triangle};
use crate::lanes::{Lanes, Vectors, cross, dot, everywhere, minus};
use glam::DVec3;

/// Corners of up to four triangles, counter-clockwise seen from the side that emits.
#[derive(Clone, Debug)]
pub struct Four {
    corners: [Vectors; 3],
    /// (b − a) × (c − a).
    normal: Vectors,
}

impl Four {
    /// Up to four triangles; those that are missing are points, and give nothing.
    pub fn new(triangles: &[[DVec3; 3]]) -> Four {
        let mut corners = [everywhere(DVec3::ZERO); 3];
        for (lane, triangle) in triangles.iter().enumerate() {
            for (corner, p) in corners.iter_mut().zip(triangle) {
                (corner[0].0[lane], corner[1].0[lane], corner[2].0[lane]) = (p.x, p.y, p.z);
            }
        }
        let [a, b, c] = corners;
        Four { corners, normal: cross(minus(b, a), minus(c, a)) }
    }

    fn triangle(&self, lane: usize) -> [DVec3; 3] {
        self.corners.map(|[x, y, z]| DVec3::new(x.0[lane], y.0[lane], z.0[lane]))
    }

    /// [`point_to_triangle`] of each.
    #[inline]
    pub fn seen_from(&self, point: DVec3, normal: DVec3) -> [f64; 4] {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has it.
            return unsafe { avx2(self, point, normal) };
        }
        self.seen(point, normal)
    }

    /// Without closures, which would be compiled for the least of processors.
    #[inline(always)]
    fn seen(&self, point: DVec3, normal: DVec3) -> [f64; 4] {
        let (from, up) = (everywhere(point), everywhere(normal));
        let [a, b, c] = self.corners;
        let (a, b, c) = (minus(a, from), minus(b, from), minus(c, from));
        let (Lanes(behind), Lanes(x), Lanes(y), Lanes(z)) = (dot(self.normal, a), dot(a, up), dot(b, up), dot(c, up));
        let (mut cut, mut seen) = ([false; 4], [false; 4]);
        for i in 0..4 {
            let (all, any) = (x[i].min(y[i]).min(z[i]) >= 0.0, x[i].max(y[i]).max(z[i]) >= 0.0);
            seen[i] = behind[i] < 0.0 && all;
            cut[i] = behind[i] < 0.0 && any && !all;
        }
        let mut factors = [0.0; 4];
        if seen != [false; 4] {
            let (p, q, r) = (inverse_length(a), inverse_length(b), inverse_length(c));
            let sum = contour((c, r), (a, p), up) + contour((a, p), (b, q), up) + contour((b, q), (c, r), up);
            let Lanes(all) = sum / Lanes::of(std::f64::consts::TAU);
            for i in 0..4 {
                factors[i] = if seen[i] { all[i].max(0.0) } else { 0.0 };
            }
        }
        for i in 0..4 {
            if cut[i] {
                factors[i] = point_to_triangle(point, normal, self.triangle(i));
            }
        }
        factors
    }
}

/// [`super::point_to_polygon_above`] of four quadrilaterals, by their corners.
#[inline(always)]
pub(crate) fn quads_above(corners: &[Vectors; 4], point: DVec3, normal: DVec3) -> Lanes {
    let (from, up) = (everywhere(point), everywhere(normal));
    let [a, b, c, d] = corners;
    let (a, b, c, d) = (minus(*a, from), minus(*b, from), minus(*c, from), minus(*d, from));
    let (p, q, r, s) = (inverse_length(a), inverse_length(b), inverse_length(c), inverse_length(d));
    let sum = contour((d, s), (a, p), up) + contour((a, p), (b, q), up);
    let sum = sum + contour((b, q), (c, r), up) + contour((c, r), (d, s), up);
    (sum / Lanes::of(std::f64::consts::TAU)).max(Lanes::of(0.0))
}

/// One over the lengths; zero where they are.
#[inline(always)]
fn inverse_length(v: Vectors) -> Lanes {
    let length = dot(v, v).sqrt();
    Lanes::above_zero(length, Lanes::of(1.0) / length, Lanes::of(0.0))
}

/// Four lanes of a double are one register there.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn avx2(four: &Four, point: DVec3, normal: DVec3) -> [f64; 4] {
    four.seen(point, normal)
}

/// [`super::contour`] in every lane.
#[inline(always)]
fn contour((a, a_inverse): (Vectors, Lanes), (b, b_inverse): (Vectors, Lanes), normal: Vectors) -> Lanes {
    let cross = cross(b, a);
    let inverse = a_inverse * b_inverse;
    let cosine = dot(a, b) * inverse;
    let turned = dot(cross, normal);
    let acute = angle_over_sine(cosine.abs()) * inverse;
    // The root and the quotient are needed for obtuse angles only: those of lamps that are near.
    let Lanes([p, q, r, s]) = cosine;
    if !(p < 0.0 || q < 0.0 || r < 0.0 || s < 0.0) {
        return acute * turned;
    }
    let sine = dot(cross, cross).sqrt();
    let over = Lanes::of(std::f64::consts::PI) / sine - acute;
    let obtuse = Lanes::above_zero(sine, over * turned, Lanes::of(0.0));
    Lanes::above_zero(Lanes::of(0.0) - cosine, obtuse, acute * turned)
}

#[inline(always)]
fn angle_over_sine(cosine: Lanes) -> Lanes {
    let (mut above, mut below) = (Lanes::of(0.0), Lanes::of(0.0));
    for k in (0..7).rev() {
        above = above * cosine + Lanes::of(ABOVE[k]);
        below = below * cosine + Lanes::of(BELOW[k]);
    }
    above / below
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_trace::sampling::Random;

    /// Four at once are what each is alone, bit for bit, wherever the horizon lies, and with or without AVX2.
    #[test]
    fn four_are_as_one() {
        let mut random = Random::new(7);
        let mut some =
            |scale: f64| DVec3::from_array(std::array::from_fn(|_| scale * (2.0 * random.next_unit() - 1.0)));
        let (mut seen, mut cut) = (0, 0);
        for _ in 0..2000 {
            let triangles: Vec<[DVec3; 3]> = (0..4).map(|_| std::array::from_fn(|_| some(1.0))).collect();
            let (point, normal) = (some(0.5), some(1.0).normalize());
            let four = Four::new(&triangles);
            let found = four.seen_from(point, normal);
            assert_eq!(found.map(f64::to_bits), four.seen(point, normal).map(f64::to_bits));
            for (triangle, found) in triangles.iter().zip(found) {
                assert_eq!(found.to_bits(), point_to_triangle(point, normal, *triangle).to_bits());
                let below = triangle.iter().filter(|p| (**p - point).dot(normal) < 0.0).count();
                seen += usize::from(found > 0.0 && below == 0);
                cut += usize::from(found > 0.0 && below > 0);
            }
        }
        assert!(seen > 300 && cut > 300, "{seen} seen, {cut} cut");
    }

    /// Corners at the receiver, edges through it and what is missing: numbers, and nothing where nothing is.
    #[test]
    fn degenerate_triangles_give_numbers() {
        let p = |x: f64, z: f64| DVec3::new(x, 0.0, z);
        let four = Four::new(&[[p(0., 0.), p(1., 0.), p(0., 1.)], [p(-1., 0.), p(0., 1.), p(1., 0.)]]);
        for normal in [DVec3::Z, DVec3::Y, -DVec3::Y] {
            let found = four.seen_from(DVec3::ZERO, normal);
            assert!(found.iter().all(|f| f.is_finite()), "{found:?}");
            assert_eq!(found[2..], [0.0; 2]);
        }
    }
}
