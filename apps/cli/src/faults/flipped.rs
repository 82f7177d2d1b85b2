//! Faces that look the other way than their neighbours do.
//!
//! Two faces that continue each other walk their common edge in opposite directions. Where both walk it the same way,
//! one of them shows its black back where its neighbour shows its front. Only edges of exactly two faces are judged so:
//! where more meet, as at a wall that stands on a floor, no pair belongs together, and that is told where it is within an object.

use glam::DVec3;
use radiosity::{EdgeSide, Mesh, Scene};
use std::collections::BTreeMap;

/// Faces whose normals differ by less than this do not turn from each other at their edge but lie on one another
/// (cosine of 0.8°).
const FOLDED: f64 = 0.9999;

/// Edges of an object that are doubtful.
#[derive(Clone, Copy, Debug, Default)]
pub struct Edges {
    /// How many.
    pub count: usize,
    /// The middle of the first, metres.
    pub first: DVec3,
}

impl Edges {
    fn add(&mut self, mesh: &Mesh, side: &EdgeSide) {
        if self.count == 0 {
            let (triangle, corner) = side.place();
            let corners = mesh.corners(triangle);
            self.first = 0.5 * (corners[corner] + corners[(corner + 1) % 3]);
        }
        self.count += 1;
    }
}

/// Edges of each object at which three one-sided faces of it or more meet, from the sides of all edges.
pub fn branches(scene: &Scene, mesh: &Mesh, sides: &[EdgeSide]) -> BTreeMap<usize, Edges> {
    let mut found: BTreeMap<usize, Edges> = BTreeMap::new();
    for faces in sides.chunk_by(|a, b| a.edge == b.edge).filter(|faces| faces.len() > 2) {
        let mut of_objects: BTreeMap<usize, (usize, &EdgeSide)> = BTreeMap::new();
        let one_sided = |side: &&EdgeSide| !scene.material(mesh.source[side.place().0] as usize).has_two_sides();
        for side in faces.iter().filter(one_sided) {
            let object = scene.triangle_object[mesh.source[side.place().0] as usize] as usize;
            of_objects.entry(object).or_insert((0, side)).0 += 1;
        }
        for (object, (_, side)) in of_objects.into_iter().filter(|(_, (count, _))| *count > 2) {
            found.entry(object).or_default().add(mesh, side);
        }
    }
    found
}

/// Edges of each object between two faces of it that look opposite ways, from the sides of all edges.
///
/// Faces of different objects are not compared: what touches need not belong together. Two-sided faces have no wrong
/// way.
pub fn edges(scene: &Scene, mesh: &Mesh, sides: &[EdgeSide]) -> BTreeMap<usize, Edges> {
    let mut found: BTreeMap<usize, Edges> = BTreeMap::new();
    for faces in sides.chunk_by(|a, b| a.edge == b.edge) {
        let [one, other] = faces else { continue };
        let [s, t] = [one, other].map(|side| side.place().0);
        let object = |t: usize| scene.triangle_object[mesh.source[t] as usize] as usize;
        let alike = one.forward == other.forward && object(s) == object(t);
        let judged = alike && mesh.normal(s).dot(mesh.normal(t)) < FOLDED;
        if judged && !scene.material(mesh.source[t] as usize).has_two_sides() {
            found.entry(object(t)).or_default().add(mesh, one);
        }
    }
    found
}
