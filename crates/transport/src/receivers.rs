//! Where light is asked for: elements while the equation is solved, points when an answer is read.

use crate::Exposure;
use crate::exposure::is_buried;
use glam::DVec3;
use radiosity_scene::{Elements, Mesh};
use radiosity_trace::{Place, Tracer};

/// Places keep off the border of their element by about this many welding tolerances (millionths of the scene).
const BORDER: f64 = 4.0;

/// A list of places that receive light.
pub trait Receivers: Sync {
    /// How many.
    fn len(&self) -> usize;
    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// The place that (x, y) in the unit square maps to, on receiver `i`; `None` if nothing of it is exposed.
    fn place(&self, i: usize, x: f32, y: f32) -> Option<Place>;
    /// Whether a place of the receiver lies inside a solid and must not be counted. Asked only where a ray from the
    /// place ended at once.
    fn buried(&self, _tracer: &Tracer, _place: &Place, _seed: u32) -> bool {
        false
    }
    /// Whether the receiver is larger than a point.
    fn has_area(&self) -> bool;
    /// A number that fixes the receiver's random choices: the same for the same place whatever else is asked.
    fn seed(&self, i: usize) -> u32;
}

/// Elements, sampled over the part of them that is not buried in other solids.
pub struct ElementReceivers<'a> {
    /// Their mesh.
    pub mesh: &'a Mesh,
    /// The elements.
    pub elements: &'a Elements,
    /// What of them is exposed.
    pub exposure: &'a Exposure,
}

impl Receivers for ElementReceivers<'_> {
    fn len(&self) -> usize {
        self.elements.len()
    }

    fn place(&self, i: usize, x: f32, y: f32) -> Option<Place> {
        let (x, y) = self.exposure.place(i as u32, x, y)?;
        let element = i as u32;
        let (triangle, _) = self.elements.place(element);
        let uv = self.elements.sample(element, x, y);
        let point = self.mesh.point(triangle, uv);
        // Away from the border by more than rounding moves a ray's origin: a place within a billionth of a wall's foot
        // would let rays start inside the wall.
        let inset = (BORDER * self.mesh.tolerance / self.elements.area(self.mesh, element).sqrt()).min(0.25);
        Some(Place {
            point: point + inset * (self.elements.centre(self.mesh, element) - point),
            normal: self.elements.normal(self.mesh, element),
            triangle: triangle as u32,
        })
    }

    fn buried(&self, tracer: &Tracer, place: &Place, seed: u32) -> bool {
        is_buried(tracer, place, seed)
    }

    fn has_area(&self) -> bool {
        true
    }

    fn seed(&self, i: usize) -> u32 {
        i as u32
    }
}

/// Points with normals.
pub struct PointReceivers<'a> {
    /// The places.
    pub places: &'a [Place],
}

impl Receivers for PointReceivers<'_> {
    fn len(&self) -> usize {
        self.places.len()
    }

    fn place(&self, i: usize, _x: f32, _y: f32) -> Option<Place> {
        let place = self.places[i];
        (place.normal != DVec3::ZERO).then_some(place)
    }

    fn has_area(&self) -> bool {
        false
    }

    fn seed(&self, i: usize) -> u32 {
        // From the position, so that a point's answer does not depend on its number in the list.
        let p = self.places[i].point;
        [p.x, p.y, p.z].iter().fold(0x51ed_270b, |seed, x| {
            let bits = x.to_bits();
            radiosity_trace::sampling::hash(seed ^ bits as u32 ^ (bits >> 32) as u32)
        })
    }
}
