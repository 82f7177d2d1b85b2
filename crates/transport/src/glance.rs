//! One of all lamps for a single look, picked by about what it would give.
//!
//! A path looks at one lamp from each spot that it comes to. To know what every lamp gives there, by the factors of their triangles
//! (Lambert 1760), takes longer than the path's rays: in a furnished office of twelve lamps gathers took 1.4 times as long, for as much noise. Only what is
//! picked needs to be known exactly, and no look has a bias, whatever it was picked by: here A M h s/(π (d² + r²)²), where the middle of a triangle is d away
//! and h and s above the planes of the triangle and the spot, and r is the distance from the middle to the farthest corner.
//!
//! That is far too little near a large triangle, which is seen all around although its middle is hardly above either plane (noise was 1.36
//! instead of 1.01 % in that office): both heights grow by up to r r²/(d² + r²).

use crate::Luminaires;
use crate::luminaires::{Light, Piece};
use crate::one_light::{from_point, sample_piece, tint};
use glam::DVec3;
use radiosity_scene::{PointLight, luminance};
use radiosity_trace::sampling::{hash, unit};
use radiosity_trace::{Place, Tracer};
use std::f64::consts::PI;

/// Triangles that are weighed at once.
const LANES: usize = 8;

/// Most of them, and of lights without area: to weigh them takes about as long as a ray.
const MOST: usize = 64;

/// Parts of r, and of how far both are from the middle of all, by which a triangle and the spot are higher than they are: none that gives light may be
/// left out by rounding.
const THICK: f32 = 0.01;
const ROUNDING: f32 = 1e-6;

/// Heights grow near a triangle by so many times themselves at most: in its own plane it gives nothing, however near. With less, what is seen from a
/// centimetre before a window is noisier; with more, looks from beside it are lost.
const GROWTH: f32 = 10.0;

/// Triangles with r² less than this part of d² are sampled by area, as directions take longer to sample, and others by direction. Half as much takes the
/// longer way up to 4.5 r; with twice as much, (d ± r)², by which samples by area differ, spans seven instead of four times.
const FAR: f64 = 0.1;

/// Share of looks that go to all lamps alike: whatever is wrong with what is told of one, beside a strip of light for example, no look counts more
/// than five times as much as by picks at random.
const UNGUIDED: f64 = 0.2;

/// Triangles side by side, from the middle of all of them.
#[derive(Clone, Copy, Default)]
struct Lanes {
    middle: [[f32; LANES]; 3],
    normal: [[f32; LANES]; 3],
    radius: [f32; LANES],
    /// A M/π; zero where there is none.
    power: [f32; LANES],
}

/// All lamps, where they are few.
pub(crate) struct Glance<'l> {
    origin: DVec3,
    lanes: Vec<Lanes>,
    pieces: Vec<&'l Piece>,
    points: Vec<&'l PointLight>,
    luminaires: &'l Luminaires,
}

impl<'l> Glance<'l> {
    /// None where there are too many to look at all of them.
    pub fn new(luminaires: &'l Luminaires) -> Option<Glance<'l>> {
        let lights = &luminaires.lights;
        let points: Vec<&PointLight> =
            lights.iter().filter_map(|l| if let Light::Point(point) = l { Some(point) } else { None }).collect();
        let pieces: Vec<&Piece> = lights.iter().flat_map(Light::few).collect();
        let has_tree = lights.iter().any(|light| matches!(light, Light::Area { tree: Some(_), .. }));
        if has_tree || pieces.len() + points.len() > MOST {
            return None;
        }
        let middles: Vec<DVec3> = pieces.iter().map(|piece| piece.corners.iter().sum::<DVec3>() / 3.0).collect();
        let origin = middles.iter().sum::<DVec3>() / middles.len().max(1) as f64;
        let mut lanes = vec![Lanes::default(); pieces.len().div_ceil(LANES)];
        for (k, (piece, middle)) in pieces.iter().zip(&middles).enumerate() {
            let (lanes, lane) = (&mut lanes[k / LANES], k % LANES);
            for axis in 0..3 {
                lanes.middle[axis][lane] = (*middle - origin)[axis] as f32;
                lanes.normal[axis][lane] = piece.normal[axis] as f32;
            }
            lanes.radius[lane] = piece.corners.iter().map(|c| c.distance(*middle)).fold(0.0, f64::max) as f32;
            lanes.power[lane] = (piece.area * f64::from(luminance(piece.exitance)) / PI) as f32;
        }
        Some(Glance { origin, lanes, pieces, points, luminaires })
    }

    /// Irradiance of a spot, lux per band, by one look at a lamp that u in [0, 1) picks, less what other lights carry on unless the whole is asked for.
    pub fn irradiance(&self, tracer: &Tracer, (spot, is_whole): (&Place, bool), (u, seed): (f32, u32)) -> [f64; 3] {
        let mut weights = [0f32; MOST];
        for (lanes, weights) in self.lanes.iter().zip(weights.chunks_exact_mut(LANES)) {
            weights.copy_from_slice(
                &lanes.weights((spot.point - self.origin).as_vec3().into(), spot.normal.as_vec3().into()),
            );
        }
        let all = self.pieces.len() + self.points.len();
        for (weight, light) in weights[self.pieces.len()..].iter_mut().zip(&self.points) {
            let (direction, _, arriving) = light.arrival(spot.point);
            *weight = direction.dot(spot.normal).max(0.0) as f32 * luminance(arriving);
        }
        let weights = &weights[..all];
        let lit = || weights.iter().enumerate().filter(|(_, weight)| **weight > 0.0);
        let total: f64 = lit().map(|(_, weight)| f64::from(*weight)).sum();
        if total <= 0.0 {
            return [0.0; 3];
        }
        let even = UNGUIDED / lit().count() as f64;
        let mut rest = f64::from(u);
        let mut picked = None;
        for (k, weight) in lit() {
            let probability = even + (1.0 - UNGUIDED) * f64::from(*weight) / total;
            picked = Some((k, probability));
            if rest < probability {
                break;
            }
            rest -= probability;
        }
        let Some((k, probability)) = picked else { return [0.0; 3] };
        let Some(piece) = self.pieces.get(k) else {
            let number = k - self.pieces.len();
            if !is_whole && self.luminaires.is_end(tracer, number, spot) {
                return [0.0; 3];
            }
            let (e, _) = from_point(self.points[number], tracer, spot, 1, seed);
            return e.map(|e| e / probability);
        };
        let uv = [0x7, 0x8].map(|k| f64::from(unit(hash(seed ^ k))));
        let radius = f64::from(self.lanes[k / LANES].radius[k % LANES]);
        let (target, weight) = sample_piece(piece, spot, radius * radius / FAR, uv);
        if weight <= 0.0 || piece.triangle == spot.triangle || !tracer.mutually_visible(spot, &target, seed) {
            return [0.0; 3];
        }
        tint(tracer, piece, target.point).map(|m| weight / probability * f64::from(m))
    }
}

impl Lanes {
    /// About what each would give to a place with a unit normal.
    #[inline]
    fn weights(&self, place: [f32; 3], normal: [f32; 3]) -> [f32; LANES] {
        std::array::from_fn(|lane| {
            let along = [0, 1, 2].map(|axis| self.middle[axis][lane] - place[axis]);
            let own = [0, 1, 2].map(|axis| self.normal[axis][lane]);
            let dot = |n: [f32; 3]| along[0] * n[0] + along[1] * n[1] + along[2] * n[2];
            let size: f32 = [0, 1, 2].map(|axis| self.middle[axis][lane].abs() + place[axis].abs()).iter().sum();
            let slack = THICK * self.radius[lane] + ROUNDING * size;
            let radius = self.radius[lane] + slack;
            let square = dot(along) + radius * radius;
            let height = (slack - dot(own)).max(0.0);
            // What is above the spot's plane in part rises from nothing to r, as a square does.
            let rise = dot(normal);
            let part = (rise + radius).max(0.0);
            let rise = if rise > radius { rise } else { part * part / (4.0 * radius) };
            let near = radius * radius / square;
            let grown = |x: f32| x + near * radius.min(GROWTH * x);
            self.power[lane] * (grown(height) / square) * (grown(rise) / square)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::direct::tests::prepared;
    use crate::polygon::point_to_triangle;
    use radiosity_scene::{Material, PointLightKind, Scene};

    /// A window of 2 m, a panel of 0.6 m that faces down, a small lamp, a strip of 3 m by 1 cm and a lamp without area, a floor far below.
    fn lamps() -> Scene {
        let lamp = |l: f32| Material { emissive: [l; 3], base_color: [0.0, 0.0, 0.0, 1.0], ..Material::default() };
        let mut scene =
            Scene { materials: vec![Material::default(), lamp(1e2), lamp(1e3), lamp(1e5)], ..Scene::default() };
        let square = |low: DVec3, x: DVec3, y: DVec3| [low, low + x, low + x + y, low + y];
        scene.add_quad("floor", 0, square(DVec3::new(-50.0, -50.0, -50.0), DVec3::X * 100.0, DVec3::Y * 100.0));
        scene.add_quad("window", 1, square(DVec3::new(0.0, -1.0, 0.0), DVec3::Y * 2.0, DVec3::Z * 2.0));
        scene.add_quad("panel", 2, square(DVec3::new(1.0, 0.0, 3.0), DVec3::Y * 0.6, DVec3::X * 0.6));
        scene.add_quad("small", 3, square(DVec3::new(1.0, 4.0, 2.0), DVec3::Y * 0.05, DVec3::X * 0.05));
        scene.add_quad("strip", 2, square(DVec3::new(3.0, 4.0, 2.5), DVec3::Y * 3.0, DVec3::X * 0.01));
        scene.lights.push(PointLight {
            name: String::new(),
            kind: PointLightKind::Point,
            position: DVec3::new(2.0, -3.0, 1.0),
            direction: DVec3::NEG_Z,
            intensity: [200.0; 3],
            range: None,
        });
        scene
    }

    /// Far from lamps of all sizes, beside and a centimetre before them, the mean of looks is what all of them give by the factors of
    /// their triangles, and their noise is at most twice as much: 1.5 times at the foot of the window, 9 times without growth.
    #[test]
    fn looks_have_no_bias_and_little_noise() {
        const LOOKS: u32 = 1 << 14;
        let scene = lamps();
        let (mesh, _, _, luminaires) = prepared(&scene, 10.0);
        let tracer = Tracer::new(&scene, &mesh);
        let glance = Glance::new(&luminaires).unwrap();
        assert_eq!((glance.pieces.len(), glance.points.len()), (8, 1));
        for (point, normal) in [
            ([1.5, 0.3, 0.0], DVec3::Z),
            ([0.01, 0.2, 1.2], DVec3::NEG_X),
            ([0.01, 0.2, 1.2], DVec3::Z),
            ([0.0001, 1.1, 1.0], DVec3::NEG_Y),
            ([1.3, 0.3, 2.99], DVec3::Z),
            ([1.3, 0.3, 2.9], DVec3::NEG_X),
            ([3.0, 0.0, 3.0], DVec3::NEG_Z),
            ([1.0, 4.0, 1.9], DVec3::new(0.6, 0.0, 0.8)),
            ([3.0, 6.0, 2.0], DVec3::Z),
        ] {
            let spot = Place { point: DVec3::from(point), normal, triangle: u32::MAX };
            let factor = |piece: &&Piece| {
                let seen = (spot.point - piece.corners[0]).dot(piece.normal) > 0.0;
                let factor = if seen { point_to_triangle(spot.point, normal, piece.corners) } else { 0.0 };
                factor * f64::from(piece.exitance[1])
            };
            let (direction, _, arriving) = scene.lights[0].arrival(spot.point);
            let of_point = direction.dot(normal).max(0.0) * f64::from(arriving[1]);
            let exact = glance.pieces.iter().map(factor).sum::<f64>() + of_point;
            let look =
                |i: u32| glance.irradiance(&tracer, (&spot, false), ((i as f32 + 0.5) / LOOKS as f32, hash(i)))[1];
            let looks: Vec<f64> = (0..LOOKS).map(look).collect();
            let n = f64::from(LOOKS);
            let mean = looks.iter().sum::<f64>() / n;
            let noise = (looks.iter().map(|e| (e - exact).powi(2)).sum::<f64>() / n).sqrt();
            assert!((mean - exact).abs() < 5.0 * noise / n.sqrt(), "{point:?}, {normal}: {mean} for {exact}, {noise}");
            assert!(noise < 2.0 * exact, "{point:?}, {normal}: noise of {noise} in {exact}");
        }
    }
}
