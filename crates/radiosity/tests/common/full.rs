use radiosity::{PointLight, PointLightKind, Scene, cornell_box};

/// The Cornell box with so many lamps that the last of them share a column.
pub fn full() -> Scene {
    let mut scene = cornell_box();
    for k in 0..33 {
        let position = glam::DVec3::new(0.1 + 0.01 * f64::from(k), 0.4, 0.3);
        scene.lights.push(PointLight {
            name: format!("lamp {k}"),
            kind: PointLightKind::Point,
            position,
            direction: glam::DVec3::NEG_Y,
            intensity: [1.0 + k as f32, 2.0, 1.0],
            range: None,
        });
    }
    scene
}
