//! Paint on objects that have pictures, as the edited scene keeps it.

use radiosity::session::{Edit, ObjectId, Session, SessionOptions};
use radiosity::{Material, Surface, Texture, TextureRef, cornell_box};

fn small() -> SessionOptions {
    SessionOptions { elements: 900, rays: 128, shadow_rays: Some(16), ..SessionOptions::default() }
}

/// An object with a dark picture, painted brighter than the picture's colour can be: the edited scene has a brighter picture.
#[test]
fn bright_paint_on_a_dark_picture_is_kept() {
    let mut scene = cornell_box();
    let texels = vec![[60, 60, 60, 255], [100, 100, 100, 255], [60, 60, 60, 255], [100, 100, 100, 255]];
    scene.textures.push(Texture { name: "dark".to_owned(), width: 2, height: 2, texels });
    let transform = glam::DAffine2::IDENTITY;
    let wrap = [radiosity::Wrap::Repeat; 2];
    let base_color_texture = Some(TextureRef { texture: 0, uv_set: 0, transform, wrap, nearest: false });
    scene.materials.push(Material { base_color_texture, ..Material::default() });
    scene.objects[0].material = scene.materials.len() - 1;
    scene.uvs[0] = scene.positions.iter().map(|p| glam::DVec2::new(3.0 * p.x, 3.0 * p.z).as_vec2()).collect();
    let mut session = Session::new(scene, &small()).unwrap();
    let mean = session.model().objects[0].reflectance;
    assert!(mean.iter().all(|rho| *rho < 0.2), "{mean:?}");
    let wanted = [0.3, 0.5, 0.4];
    session.apply(&Edit::Reflectance { object: ObjectId(0), reflectance: wanted }).unwrap();
    let edited = session.edited_scene();
    let (n, mut sum) = (40, [0f32; 3]);
    let triangles = edited.objects[0].triangles.clone();
    for triangle in triangles.clone() {
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let [x, y] = [i, j].map(|k| (f64::from(k) + 0.5) / f64::from(n));
            let uv = if x + y > 1.0 { [1.0 - x, 1.0 - y] } else { [x, y] };
            let own = edited.reflectance(Surface { triangle, uv: uv.into() });
            (0..3).for_each(|band| sum[band] += own[band] / (n * n) as f32 / triangles.len() as f32);
        }
    }
    for band in 0..3 {
        assert!((sum[band] - wanted[band]).abs() < 0.02 * wanted[band], "{sum:?}");
    }
}

/// A lamp of metal whose emission alone has a picture: the picture is no pattern of what it reflects, and paint on it is kept. It was
/// lost where it was brighter than the metal's base colour allows.
#[test]
fn paint_on_metal_with_a_glowing_picture_is_kept() {
    let mut scene = cornell_box();
    scene.textures.push(Texture { name: "glow".to_owned(), width: 1, height: 1, texels: vec![[255; 4]] });
    let picture = TextureRef {
        texture: 0,
        uv_set: 0,
        transform: glam::DAffine2::IDENTITY,
        wrap: [radiosity::Wrap::Repeat; 2],
        nearest: false,
    };
    let base_color = [0.6, 0.6, 0.6, 1.0];
    scene.materials.push(Material {
        emissive_texture: Some(picture),
        metallic: 0.9,
        base_color,
        ..Material::default()
    });
    scene.objects[0].material = scene.materials.len() - 1;
    scene.uvs[0] = vec![glam::Vec2::ZERO; scene.positions.len()];
    let mut session = Session::new(scene, &small()).unwrap();
    let wanted = [0.3, 0.5, 0.4];
    session.apply(&Edit::Reflectance { object: ObjectId(0), reflectance: wanted }).unwrap();
    let edited = session.edited_scene();
    let triangle = edited.objects[0].triangles.start;
    assert_eq!(edited.reflectance(Surface { triangle, uv: glam::DVec2::splat(0.3) }), wanted);
}
