//! How the surface of an object goes on around an element.

use super::display::Display;
use glam::{DVec3, Vec3};
use std::f32::consts::{PI, TAU};

/// Least cosine between the normals of a facet and of its corners, 3°: beyond, a body is rounded.
const FLAT: f32 = 0.9986;

/// Least cosine between the normals of elements in one plane, 0.26°: of a wall that is turned by rounding.
const IN_PLANE: f32 = 0.99999;

impl Display {
    /// Least and most around each element: of those that share a corner with it.
    pub fn ranges(&self, of: impl Fn(u32) -> f32, is_buried: impl Fn(u32) -> bool) -> Vec<[f32; 2]> {
        let spots = self.around_spots(|elements| {
            let there = elements.iter().filter(|(element, _)| !is_buried(*element)).map(|(element, _)| of(*element));
            there.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
        });
        let of = |corners: &[u32]| {
            let range = corners.iter().map(|corner| spots[self.spot_of(*corner)]);
            range.fold([f32::INFINITY, 0.0], |[low, high]: [f32; 2], [a, b]| [low.min(a), high.max(b)])
        };
        self.indices.chunks_exact(3).map(of).map(|[low, high]| [low.min(high), high]).collect()
    }

    /// Whether an element is flat to the eye, too, and no facet of a rounded body.
    pub fn is_flat(&self, element: u32) -> bool {
        let (corners, flat) = (&self.indices[3 * element as usize..][..3], self.flat(element));
        corners.iter().all(|corner| Vec3::from(self.normals[*corner as usize]).dot(flat) >= FLAT)
    }

    /// Whether an element has others in its plane on all sides.
    pub fn is_inside(&self, element: u32) -> bool {
        let normal = self.flat(element);
        self.spots(element).into_iter().all(|spot| {
            let angle = |(element, _): &(u32, f32)| {
                if self.flat(*element).dot(normal) < IN_PLANE { 0.0 } else { self.angle_at(*element, spot) }
            };
            self.around(spot).iter().map(angle).sum::<f32>() > 0.999 * TAU
        })
    }

    /// Unit normal of an element.
    fn flat(&self, element: u32) -> Vec3 {
        let [a, b, c] = self.places_of(element);
        (b - a).cross(c - a).normalize_or_zero()
    }

    fn places_of(&self, element: u32) -> [Vec3; 3] {
        [0, 1, 2].map(|k| Vec3::from(self.positions[self.indices[3 * element as usize + k] as usize]))
    }

    /// The angle of an element at one of its corners, or at a spot within an edge.
    fn angle_at(&self, element: u32, spot: usize) -> f32 {
        let places = self.places_of(element);
        self.spots(element)
            .iter()
            .position(|own| *own == spot)
            .map_or(PI, |k| (places[(k + 1) % 3] - places[k]).angle_between(places[(k + 2) % 3] - places[k]))
    }

    /// The normal at a place of an element, of any length.
    pub fn normal(&self, element: u32, [v, w]: [f32; 2]) -> DVec3 {
        let corners = &self.indices[3 * element as usize..][..3];
        let [a, b, c] = [0, 1, 2].map(|k| Vec3::from(self.normals[corners[k] as usize]));
        ((1.0 - v - w) * a + v * b + w * c).as_dvec3()
    }
}
