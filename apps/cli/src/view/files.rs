//! What pages can take with them: the scene as edited, and the model with its light.

use super::solver::Export;
use glam::{DMat4, DVec3, Vec2};
use radiosity::io::gltf_out::{Light, LitPrimitive, LitVertex, Style, WriteError, lit_glb, scene_glb};
use radiosity::{Material, Object, Scene};

/// The scene as it was edited, to be opened again: with its lamps, and with the cameras that were kept.
pub fn edited(export: Export) -> Result<Vec<u8>, WriteError> {
    scene_glb(&export.scene)
}

/// The elements of the scene with the light at their vertices (attribute `_IRRADIANCE`, lx); lamps are put aside.
pub fn lit(export: Export) -> Result<Vec<u8>, WriteError> {
    let Export { scene: edited, model, light } = export;
    let mut scene = Scene {
        name: edited.name,
        up: edited.up,
        materials: edited.materials.into_iter().map(plain_texture).collect(),
        textures: edited.textures,
        cameras: edited.cameras,
        lights: edited.lights,
        ..Scene::default()
    };
    let there = model.objects.iter().zip(light).filter(|(object, _)| !object.deleted && !object.indices.is_empty());
    let mut primitives = Vec::new();
    for ((object, irradiance), placed) in there.zip(&edited.objects) {
        let (first, first_triangle) = (scene.positions.len() as u32, scene.triangles.len());
        let place = DMat4::from_cols_array(&object.matrix);
        let normals = place.inverse().transpose();
        scene.positions.extend(object.positions.iter().map(|p| place.transform_point3(DVec3::from(p.map(f64::from)))));
        let turn =
            |n: &[f32; 3]| normals.transform_vector3(DVec3::from(n.map(f64::from))).normalize_or_zero().as_vec3();
        scene.normals.extend(object.normals.iter().map(turn));
        let triangles: Vec<[u32; 3]> = object.indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
        let index = scene.objects.len();
        scene.triangles.extend(triangles.iter().map(|t| t.map(|v| first + v)));
        scene.triangle_object.resize(scene.triangles.len(), index as u32);
        scene.triangle_source.extend(0..triangles.len() as u32);
        scene.uvs[0].resize(first as usize, Vec2::ZERO);
        scene.uvs[0].extend(object.uvs.iter().copied().map(Vec2::from));
        scene.uvs[0].resize(scene.positions.len(), Vec2::ZERO);
        scene.objects.push(Object {
            name: object.name.clone(),
            material: placed.material,
            triangles: first_triangle..scene.triangles.len(),
            vertices: first as usize..scene.positions.len(),
            source: placed.source,
        });
        let vertex = |i: u32| LitVertex { corners: [i; 3], weights: [1.0, 0.0, 0.0] };
        primitives.push(LitPrimitive {
            object: index,
            vertices: (0..object.positions.len() as u32).map(vertex).collect(),
            triangles,
            flipped: false,
            light: Light::Vertex { irradiance },
        });
    }
    lit_glb(&scene, None, &primitives, &Style::Vertices)
}

/// What is drawn has the texture coordinates of the base colour alone, as its picture takes them. Others that do not
/// share them are left out.
fn plain_texture(mut material: Material) -> Material {
    let Some(base) = &mut material.base_color_texture else {
        return Material { metallic_texture: None, emissive_texture: None, ..material };
    };
    let own = (base.uv_set, base.transform);
    (base.uv_set, base.transform) = (0, glam::DAffine2::IDENTITY);
    for other in [&mut material.metallic_texture, &mut material.emissive_texture] {
        *other = other.filter(|other| (other.uv_set, other.transform) == own);
        if let Some(other) = other {
            (other.uv_set, other.transform) = (0, glam::DAffine2::IDENTITY);
        }
    }
    material
}
