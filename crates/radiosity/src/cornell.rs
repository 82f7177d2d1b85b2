//! The built-in scene: the Cornell box as its makers measured it (Cornell University Program of Computer Graphics).

use glam::DVec3;
use radiosity_scene::{Camera, Material, Scene};

/// The Cornell box, in metres, +Y up, with an open front; reflectances at 620, 540 and 460 nm as red, green and blue.
/// The light has 10 000 cd/m² of a warm white.
pub fn cornell_box() -> Scene {
    let material = |name: &str, [r, g, b]: [f32; 3], emissive: [f32; 3]| Material {
        name: name.to_owned(),
        base_color: [r, g, b, 1.0],
        emissive,
        ..Material::default()
    };
    let mut scene = Scene { name: "cornell-box".to_owned(), ..Scene::default() };
    scene.materials = vec![
        material("white", [0.744, 0.743, 0.765], [0.0; 3]),
        material("red", [0.513, 0.059, 0.062], [0.0; 3]),
        material("green", [0.126, 0.441, 0.104], [0.0; 3]),
        material("light", [0.78; 3], [11_800.0, 9_800.0, 7_300.0]),
    ];
    const QUADS: &[(&str, usize, [[f64; 3]; 4])] = &[
        ("floor", 0, [[552.8, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 559.2], [549.6, 0.0, 559.2]]),
        ("light", 3, [[343.0, 548.8, 227.0], [343.0, 548.8, 332.0], [213.0, 548.8, 332.0], [213.0, 548.8, 227.0]]),
        ("ceiling", 0, [[213.0, 548.8, 0.0], [213.0, 548.8, 559.2], [0.0, 548.8, 559.2], [0.0, 548.8, 0.0]]),
        ("ceiling", 0, [[556.0, 548.8, 0.0], [556.0, 548.8, 559.2], [343.0, 548.8, 559.2], [343.0, 548.8, 0.0]]),
        ("ceiling", 0, [[343.0, 548.8, 0.0], [343.0, 548.8, 227.0], [213.0, 548.8, 227.0], [213.0, 548.8, 0.0]]),
        ("ceiling", 0, [[343.0, 548.8, 332.0], [343.0, 548.8, 559.2], [213.0, 548.8, 559.2], [213.0, 548.8, 332.0]]),
        ("back", 0, [[549.6, 0.0, 559.2], [0.0, 0.0, 559.2], [0.0, 548.8, 559.2], [556.0, 548.8, 559.2]]),
        ("right", 2, [[0.0, 0.0, 559.2], [0.0, 0.0, 0.0], [0.0, 548.8, 0.0], [0.0, 548.8, 559.2]]),
        ("left", 1, [[552.8, 0.0, 0.0], [549.6, 0.0, 559.2], [556.0, 548.8, 559.2], [556.0, 548.8, 0.0]]),
        ("short block", 0, [[130.0, 165.0, 65.0], [82.0, 165.0, 225.0], [240.0, 165.0, 272.0], [290.0, 165.0, 114.0]]),
        ("short block", 0, [[290.0, 0.0, 114.0], [290.0, 165.0, 114.0], [240.0, 165.0, 272.0], [240.0, 0.0, 272.0]]),
        ("short block", 0, [[130.0, 0.0, 65.0], [130.0, 165.0, 65.0], [290.0, 165.0, 114.0], [290.0, 0.0, 114.0]]),
        ("short block", 0, [[82.0, 0.0, 225.0], [82.0, 165.0, 225.0], [130.0, 165.0, 65.0], [130.0, 0.0, 65.0]]),
        ("short block", 0, [[240.0, 0.0, 272.0], [240.0, 165.0, 272.0], [82.0, 165.0, 225.0], [82.0, 0.0, 225.0]]),
        ("tall block", 0, [[423.0, 330.0, 247.0], [265.0, 330.0, 296.0], [314.0, 330.0, 456.0], [472.0, 330.0, 406.0]]),
        ("tall block", 0, [[423.0, 0.0, 247.0], [423.0, 330.0, 247.0], [472.0, 330.0, 406.0], [472.0, 0.0, 406.0]]),
        ("tall block", 0, [[472.0, 0.0, 406.0], [472.0, 330.0, 406.0], [314.0, 330.0, 456.0], [314.0, 0.0, 456.0]]),
        ("tall block", 0, [[314.0, 0.0, 456.0], [314.0, 330.0, 456.0], [265.0, 330.0, 296.0], [265.0, 0.0, 296.0]]),
        ("tall block", 0, [[265.0, 0.0, 296.0], [265.0, 330.0, 296.0], [423.0, 330.0, 247.0], [423.0, 0.0, 247.0]]),
    ];
    for (name, material, corners) in QUADS {
        let object = scene.add_quad(name, *material, corners.map(|p| DVec3::from(p) / 1000.0));
        // Sides of one block are one thing.
        let first = scene.objects.iter().position(|other| other.name == *name).unwrap_or(object);
        scene.objects[object].source.node = first;
    }
    // The published camera: a 35 mm lens before a 25 mm square film, 0.8 m in front of the opening.
    let mut camera = Camera::look_at(
        "front",
        DVec3::new(0.278, 0.273, -0.8),
        DVec3::new(0.278, 0.273, 0.0),
        DVec3::Y,
        2.0 * (0.0125f64 / 0.035).atan(),
    );
    camera.aspect = Some(1.0);
    scene.cameras.push(camera);
    scene
}
