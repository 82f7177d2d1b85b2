//! Small parts of surfaces that glow: sought by a gather, not only found.
//!
//! A strip under a ceiling, a lamp in a cove, the sun on a floor: a thousandth of the surfaces gives half of the light, and rays that go
//! everywhere meet it so rarely that ten thousand of them are off by a tenth. The solution tells where it is. So some rays of a gather go
//! to places on the elements that are much brighter than the mean, each picked after what it could give (`EmitterTree`); and
//! what is found either way is weighted by the balance heuristic (Veach 1997, §9.2), so that no light counts twice, whatever
//! the elements have wrong. Where nothing glows, nothing is done.

use crate::gather::Gather;
use crate::one_light::luminance_of;
use glam::DVec3;
use radiosity_trace::{Emitter, EmitterTree, Place};
use std::f64::consts::PI;

/// Radiosity of an element that glows, relative to the mean.
const BRIGHT: f64 = 8.0;

/// Share of all light that those must have to be worth a ray.
const WORTH: f64 = 0.02;

/// Rays that go there, for each that goes everywhere.
pub(crate) const SOUGHT: f64 = 0.25;

/// The elements that glow.
pub(crate) struct Glow {
    /// By number; their ids ascend.
    elements: Vec<Glowing>,
    tree: EmitterTree,
}

struct Glowing {
    id: u32,
    normal: DVec3,
    area: f64,
}

impl Glow {
    /// None where next to no light comes from bright elements.
    pub fn new(gather: &Gather) -> Option<Glow> {
        let (elements, mesh) = (gather.ids.elements, gather.tracer.mesh);
        let light = |id: usize| luminance_of(std::array::from_fn(|band| f64::from(gather.values[id][band])));
        let (mut all, mut area) = (0.0, 0.0);
        for id in 0..elements.len() {
            all += light(id) * gather.area[id];
            area += gather.area[id];
        }
        let bright: Vec<usize> = (0..elements.len()).filter(|&id| light(id) * area > BRIGHT * all).collect();
        if bright.iter().map(|&id| light(id) * gather.area[id]).sum::<f64>() <= WORTH * all {
            return None;
        }
        let (mut glowing, mut emitters) = (Vec::new(), Vec::new());
        for id in bright {
            let element = id as u32;
            let (triangle, _) = elements.place(element);
            let corners = elements.corners(element).map(|uv| mesh.point(triangle, uv));
            let (normal, area) = (elements.normal(mesh, element), elements.area(mesh, element));
            emitters.push(Emitter::triangle(corners, normal, light(id) * area));
            glowing.push(Glowing { id: element, normal, area });
        }
        Some(Glow { elements: glowing, tree: EmitterTree::new(&emitters, 1) })
    }

    /// What of the light counts that a ray has from an element so far away: the rest is sought.
    pub fn found(&self, id: u32, place: &Place, direction: DVec3, distance: f64) -> f64 {
        let Ok(number) = self.elements.binary_search_by_key(&id, |glowing| glowing.id) else { return 1.0 };
        let probability = self.tree.probability(number as u32, place.point, place.normal);
        1.0 / (1.0 + self.elements[number].likelier(probability, place, direction, distance))
    }

    /// An element to seek from a place by (u, v), the way to a place on it, and what counts of the light that a ray has from it.
    pub fn sought(&self, gather: &Gather, place: &Place, [mut u, v]: [f64; 2]) -> Option<(u32, DVec3, f64)> {
        let (leaf, probability) = self.tree.pick(0, place.point, place.normal, &mut u)?;
        let glowing = &self.elements[self.tree.order()[leaf] as usize];
        let (elements, mesh) = (gather.ids.elements, gather.tracer.mesh);
        let along = mesh.point(elements.place(glowing.id).0, elements.sample(glowing.id, u, v)) - place.point;
        let distance = along.length();
        let direction = along / distance;
        let likelier = glowing.likelier(probability, place, direction, distance);
        (likelier > 0.0 && direction.dot(place.normal) > 0.0)
            .then(|| (glowing.id, direction, SOUGHT / (1.0 + likelier)))
    }
}

impl Glowing {
    /// How many more rays are here in a direction because this was sought, with such a probability, than those that go everywhere.
    fn likelier(&self, probability: f64, place: &Place, direction: DVec3, distance: f64) -> f64 {
        let cosines = direction.dot(place.normal) * -direction.dot(self.normal);
        if cosines > 0.0 { SOUGHT * probability * PI * distance * distance / (self.area * cosines) } else { 0.0 }
    }
}
