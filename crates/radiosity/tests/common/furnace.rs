use crate::room::{Furnishing, room};
use radiosity::Scene;

/// A closed room of reflectance ρ = 0.5 in every band whose walls and tables all shine alike, E = 100 lm/m²: H = E/(1 − ρ) = 200 lx everywhere.
pub fn furnace(tables: usize) -> Scene {
    let mut scene = room(&Furnishing { tables, lamps: 0, books: 0 });
    scene.lights.clear();
    for material in &mut scene.materials {
        material.base_color = [0.5, 0.5, 0.5, 1.0];
        material.emissive = [100.0 / std::f32::consts::PI; 3];
    }
    scene
}
