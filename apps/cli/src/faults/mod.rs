//! What is wrong with a scene beyond what its reader says, told by every verb in the same words.

mod flipped;
mod overlap;
pub mod sheets;

use crate::numbers;
use glam::DVec3;
use radiosity::{EdgeSide, Faults, Mesh, PointLight, Scene, counted};

/// Adds the faults of a scene that can be read; `title` is what the scene is called.
pub fn find(scene: &Scene, mesh: &Mesh, title: &str, faults: &mut Faults) {
    if is_dark(scene) {
        let hint =
            "give it a sky, --sky overcast:10000, faces an emissive material, or lamps, KHR_lights_punctual in glTF";
        faults.warning(title, "there is no light, and all will be black", hint);
    }
    let sides = mesh.sides_of_edges();
    let open = open_edges(&sides);
    if open > 0 {
        faults.note(
            title,
            format!("{} to one face only: surfaces are open there", counted(open, "edge belongs", "edges belong")),
            "harmless for rooms with openings; in a solid it lets light in",
        );
    }
    let place = |object: usize| format!("{title}: object '{}'", scene.objects[object].name);
    let first_at = |p: DVec3| format!("the first at {} m", numbers::place(p.to_array()));
    for (object, edges) in flipped::branches(scene, mesh, &sides) {
        let (edges, at) = (counted(edges.count, "edge joins", "edges join"), first_at(edges.first));
        faults.note(
            place(object),
            format!(
                "{edges} three faces or more, {at}: surfaces branch there, and it is unclear which continue each other"
            ),
            "harmless where each face looks the way that is meant",
        );
    }
    for (object, edges) in flipped::edges(scene, mesh, &sides) {
        let (edges, at) = (counted(edges.count, "edge lies", "edges lie"), first_at(edges.first));
        faults.warning(
            place(object),
            format!(
                "{edges} between faces that look opposite ways, {at}: one shows its black back beside the other's front"
            ),
            "turn the faces that look the wrong way ('recalculate normals'), or make the material two-sided",
        );
    }
    drop(sides);
    if mesh.uncut {
        faults.warning(
            title,
            "too many surfaces go through each other for all to be cut there; light may pass below walls",
            "join what belongs together, or remove what is inside of other things",
        );
    }
    let overlaps = overlap::search(scene, mesh);
    for (&object, &(count, on)) in &overlaps.objects {
        let triangles = counted(count, "triangle lies", "triangles lie");
        let (on, verbs) =
            (&scene.objects[on].name, if count == 1 { ["overlaps", "faces"] } else { ["overlap", "face"] });
        faults.warning(
            place(object),
            format!("{triangles} in one plane with object '{on}', {} it and {} the same way", verbs[0], verbs[1]),
            "which of the two is seen is chance: move one of them by a millimetre, or remove what is covered",
        );
    }
    if overlaps.more {
        faults.note(title, "too many triangles lie in one place; overlapping surfaces were not all searched for", "");
    }
}

/// Whether nothing gives light: materials count where a face has them.
pub fn is_dark(scene: &Scene) -> bool {
    let is_lamp = |light: &PointLight| light.intensity.iter().any(|&i| i > 0.0);
    let shines = |triangle| scene.material(triangle).emits();
    scene.sky.is_black() && !scene.lights.iter().any(is_lamp) && !(0..scene.triangles.len()).any(shines)
}

/// Edges of the welded mesh that only one face has, from the sides of all.
pub fn open_edges(sides: &[EdgeSide]) -> usize {
    sides.chunk_by(|a, b| a.edge == b.edge).filter(|faces| faces.len() == 1).count()
}
