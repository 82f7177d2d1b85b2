//! Faces that look the other way than their neighbours do.
//!
//! Two faces that continue each other walk their common edge in opposite directions. Where both walk it the same way,
//! one of them shows its black back where its neighbour shows its front. Only edges of exactly two faces are judged:
//! where more meet, as at a wall that stands on a floor, no pair belongs together.

use radiosity::{Mesh, Scene};
use std::collections::{BTreeMap, HashMap};

/// Faces whose normals differ by less than this do not turn from each other at their edge but lie on one another
/// (cosine of 0.8°).
const FOLDED: f64 = 0.9999;

/// Two faces of an edge, and whether each walks it from its lower to its higher vertex.
type Faces = [(u32, bool); 2];

/// How many edges of each object lie between two faces of it that look opposite ways.
///
/// Faces of different objects are not compared: what touches need not belong together. Two-sided faces have no wrong
/// way.
pub fn edges(scene: &Scene, mesh: &Mesh) -> BTreeMap<usize, usize> {
    // The first two faces of each edge, by the direction in which they walk it, and how many there are.
    let mut walked: HashMap<(u32, u32), (Faces, u32)> = HashMap::new();
    for (t, corners) in mesh.triangles.iter().enumerate() {
        for i in 0..3 {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            let (faces, count) = walked.entry((a.min(b), a.max(b))).or_default();
            if let Some(face) = faces.get_mut(*count as usize) {
                *face = (t as u32, a < b);
            }
            *count += 1;
        }
    }

    let mut found = BTreeMap::new();
    for ([(s, forward), (t, also)], _) in walked.values().filter(|(_, count)| *count == 2) {
        let [s, t] = [*s as usize, *t as usize];
        let object = |t: usize| scene.triangle_object[mesh.source[t] as usize] as usize;
        let judged = forward == also && object(s) == object(t) && mesh.normal(s).dot(mesh.normal(t)) < FOLDED;
        if judged && !scene.material(mesh.source[t] as usize).has_two_sides() {
            *found.entry(object(t)).or_default() += 1;
        }
    }
    found
}
