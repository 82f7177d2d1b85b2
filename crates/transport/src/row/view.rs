//! An enclosure made ready for looking at it from many points: welded corners and convex polygons.

use super::points::is_coplanar;
use crate::polygon::point_to_triangle;
use glam::DVec3;
use radiosity_scene::{Enclosure, Facet};
use rustc_hash::FxHashMap;

/// A convex polygon to draw.
#[derive(Clone, Copy, Debug)]
pub(super) struct Polygon {
    /// Its corners, in [`View::indices`].
    pub corners: [u32; 2],
    /// Its facet; the number of facets where it is an obstruction.
    pub owner: u32,
    pub normal: DVec3,
}

/// Everything that can be seen.
#[derive(Clone, Debug)]
pub(super) struct View<'a> {
    pub enclosure: &'a Enclosure,
    pub vertices: Vec<DVec3>,
    pub indices: Vec<u32>,
    pub polygons: Vec<Polygon>,
    radius: Vec<f64>,
}

impl<'a> View<'a> {
    pub fn new(enclosure: &'a Enclosure) -> View<'a> {
        let mut view = View {
            enclosure,
            vertices: Vec::new(),
            indices: Vec::new(),
            polygons: Vec::new(),
            radius: enclosure.facets.iter().map(Facet::radius).collect(),
        };
        let mut known = FxHashMap::default();
        let nothing = enclosure.facets.len();
        let owners = (0..nothing).chain(std::iter::repeat(nothing));
        for (facet, owner) in enclosure.facets.iter().chain(&enclosure.obstructions).zip(owners) {
            let mut add = |corners: &[DVec3]| {
                let start = view.indices.len() as u32;
                for corner in corners {
                    // −0 and 0 are one place.
                    let key = (*corner + DVec3::ZERO).to_array().map(f64::to_bits);
                    let index = *known.entry(key).or_insert_with(|| {
                        view.vertices.push(*corner);
                        view.vertices.len() as u32 - 1
                    });
                    view.indices.push(index);
                }
                let corners = [start, view.indices.len() as u32];
                view.polygons.push(Polygon { corners, owner: owner as u32, normal: facet.normal() });
            };
            if facet.is_convex() {
                add(facet.corners());
            } else {
                facet.triangles().iter().for_each(|triangle| add(triangle));
            }
        }
        view
    }

    /// The item of what is no facet's active side; also the number of facets.
    pub fn nothing(&self) -> u32 {
        self.enclosure.facets.len() as u32
    }

    pub fn corners(&self, polygon: &Polygon) -> &[u32] {
        &self.indices[polygon.corners[0] as usize..polygon.corners[1] as usize]
    }

    /// The polygons that facet `from` may see: those that rise above its plane. What lies in that plane covers nothing.
    pub fn ahead_of(&self, from: usize) -> Vec<u32> {
        let facets = &self.enclosure.facets;
        let own = &facets[from];
        let heights: Vec<f64> = self.vertices.iter().map(|v| own.height(*v)).collect();
        let is_ahead = |polygon: &&u32| {
            let polygon = &self.polygons[**polygon as usize];
            let height = |i: &u32| heights[*i as usize];
            let corners = self.corners(polygon);
            polygon.owner as usize != from
                && corners.iter().any(|i| height(i) > 0.0)
                && !is_coplanar(own, corners.iter().map(|i| self.vertices[*i as usize]))
        };
        let all: Vec<u32> = (0..self.polygons.len() as u32).collect();
        all.iter().filter(is_ahead).copied().collect()
    }

    /// What a facet would take of the view from `eye` if nothing stood in the way. Where its radius is less than `small`
    /// times as large as it is far, its centre stands for it, which is off by some `small`² of it.
    pub fn potential(&self, eye: DVec3, normal: DVec3, to: usize, small: f64) -> f64 {
        let facet = &self.enclosure.facets[to];
        let ray = facet.centroid() - eye;
        let distance = ray.length();
        if self.radius[to] < small * distance {
            let (cosine, other) = (ray.dot(normal) / distance, -ray.dot(facet.normal()) / distance);
            if cosine.abs() > small {
                return cosine.max(0.0) * other.max(0.0) * facet.area() / (std::f64::consts::PI * distance * distance);
            }
        }
        let lambert = |corners: [DVec3; 3]| point_to_triangle(eye, normal, corners);
        if !facet.is_convex() {
            return facet.triangles().into_iter().map(lambert).sum();
        }
        let corners = facet.corners();
        corners[1..].windows(2).map(|pair| lambert([corners[0], pair[0], pair[1]])).sum()
    }
}
