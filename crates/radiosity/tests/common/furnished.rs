use crate::room::{Furnishing, room};
use radiosity::Scene;

/// A room with a table, two lamps and books into which the sky looks.
pub fn furnished() -> Scene {
    let mut scene = room(&Furnishing { tables: 1, lamps: 2, books: 6 });
    scene.sky = radiosity::Sky::Uniform([300.0, 400.0, 500.0]);
    // Without this wall the sky looks in.
    scene.objects[3].name = "window".to_owned();
    let window = scene.objects[3].triangles.clone();
    for triangle in window {
        let corners = scene.triangles[triangle];
        for v in corners {
            let p = &mut scene.positions[v as usize];
            p.y = p.y.min(1.5);
        }
    }
    scene
}
