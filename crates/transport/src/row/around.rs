//! All that rays from facets may meet: a tree over the triangles of an enclosure, in single precision about its middle,
//! which moves edges by 1e-7 of its extent.

use super::points::is_coplanar;
use glam::DVec3;
use radiosity_scene::{Enclosure, Facet};
use radiosity_trace::{Hit, Ray, Tree};

/// Places are drawn this much towards the facet's centre, relative to the coordinates, so that rounding puts none behind a
/// wall that the facet touches: four units in the last place.
const INWARDS: f64 = 4.0 / (1u32 << 24) as f64;

/// All that rays may meet.
pub(crate) struct Around<'a> {
    pub enclosure: &'a Enclosure,
    tree: Tree,
    /// Facet of each triangle; the number of facets for obstructions.
    owner: Vec<u32>,
    /// The middle of everything, and how far the farthest coordinate lies from it.
    pub middle: DVec3,
    pub reach: f64,
}

impl<'a> Around<'a> {
    pub fn new(enclosure: &'a Enclosure) -> Around<'a> {
        let [low, high] = enclosure.bounds().unwrap_or_default();
        let middle = 0.5 * (low + high);
        let (mut triangles, mut owner) = (Vec::new(), Vec::new());
        let nothing = enclosure.facets.len();
        let owners = (0..nothing).chain(std::iter::repeat(nothing));
        for (facet, index) in enclosure.facets.iter().chain(&enclosure.obstructions).zip(owners) {
            for triangle in facet.triangles() {
                triangles.push(triangle.map(|c| (c - middle).as_vec3()));
                owner.push(index as u32);
            }
        }
        Around { enclosure, tree: Tree::new(&triangles), owner, middle, reach: (high - middle).max_element() }
    }

    /// Which facets lie in the plane of another: rays that start on it do not meet them.
    pub fn in_plane_of(&self, own: &Facet) -> Vec<bool> {
        self.enclosure.facets.iter().map(|facet| is_coplanar(own, facet.corners().iter().copied())).collect()
    }

    /// How much nearer to its centre a place on something of this radius is to be drawn.
    pub fn inwards(&self, radius: f64) -> f64 {
        1.0 - (INWARDS * self.reach / radius).min(0.01)
    }

    /// The ray from a place.
    pub fn ray(&self, place: DVec3, direction: DVec3, t_max: f64) -> Ray {
        let origin = (place - self.middle).as_vec3();
        Ray { origin, direction: direction.as_vec3(), t_max: t_max as f32, skip: u32::MAX }
    }

    /// The first hit of all that is not ignored (by facet), and the facet, or the number of facets for what only stands in the way.
    #[inline]
    pub fn first(&self, place: DVec3, direction: DVec3, is_ignored: impl Fn(usize) -> bool) -> Option<(usize, Hit)> {
        let is_met = |triangle: u32, _, _, _| {
            let owner = self.owner[triangle as usize] as usize;
            owner == self.enclosure.facets.len() || !is_ignored(owner)
        };
        let hit = self.tree.closest_where(&self.ray(place, direction, f64::INFINITY), is_met)?;
        Some((self.owner[hit.triangle as usize] as usize, hit))
    }

    /// What a ray meets first of all that is not ignored (by facet): the facet whose active side it is, or the number of
    /// facets where that is nothing, and how far away; infinitely far if the ray escapes.
    #[inline]
    pub fn meets(&self, place: DVec3, direction: DVec3, is_ignored: impl Fn(usize) -> bool) -> (usize, f64) {
        let nothing = self.enclosure.facets.len();
        match self.first(place, direction, is_ignored) {
            Some((_, hit)) if hit.back => (nothing, f64::from(hit.t)),
            Some((facet, hit)) => (facet, f64::from(hit.t)),
            None => (nothing, f64::INFINITY),
        }
    }
}
