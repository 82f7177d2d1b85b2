//! A glTF built from a scene that was no glTF: nodes, materials, pictures and cameras.

use super::glb::{Builder, Target};
use super::materials::{Materials, unit};
use super::mixture::{Mixture, mixture};
use super::{Light, LitPrimitive, LitVertex, Style, WriteError, lamps, vertices};
use glam::{DVec2, DVec3, Vec3};
use radiosity_scene::{
    AlphaMode, Camera, Material, Object, PointLight, Projection, Scene, Texture, TextureRef, Up, Wrap,
};
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Cursor;

/// What `asset.generator` says.
pub(super) const GENERATOR: &str = concat!("radiosity ", env!("CARGO_PKG_VERSION"));

/// The scene with light on its surfaces, and its lamps put aside: they would light it a second time.
pub(super) fn lit(scene: &Scene, primitives: &[LitPrimitive], style: &Style) -> Result<Vec<u8>, WriteError> {
    build(scene, primitives, style, lamps::put_aside)
}

/// The scene to be lit, with its lamps.
pub(super) fn dark(scene: &Scene) -> Result<Vec<u8>, WriteError> {
    build(scene, &[], &Style::Vertices, lamps::put_in)
}

fn build(
    scene: &Scene,
    primitives: &[LitPrimitive],
    style: &Style,
    put: fn(&mut Builder, &[PointLight]) -> Vec<usize>,
) -> Result<Vec<u8>, WriteError> {
    let mut builder = Builder::default();
    builder.json.insert("asset".into(), json!({ "version": "2.0", "generator": GENERATOR }));
    let mut pictures =
        Pictures { scene, samplers: BTreeMap::new(), images: BTreeMap::new(), textures: BTreeMap::new() };
    for material in &scene.materials {
        let json = pictures.material(&mut builder, material)?;
        builder.push("materials", json);
    }
    let mut materials = Materials::new(scene, style, &mut builder);
    let layered: BTreeSet<usize> = primitives.iter().filter(|lit| lit.flipped).map(|lit| lit.object).collect();

    let origin = origin(scene);
    // A root turns the scene so that its zenith is glTF's +Y.
    let mut children = Vec::new();
    let root = builder.push("nodes", json!({ "name": if scene.name.is_empty() { "scene" } else { &scene.name } }));
    let mut of_object: BTreeMap<usize, Vec<&LitPrimitive>> = BTreeMap::new();
    for lit in primitives {
        of_object.entry(lit.object).or_default().push(lit);
    }
    for (index, object) in scene.objects.iter().enumerate() {
        let mut lit = of_object.remove(&index).unwrap_or_default();
        let own;
        if lit.is_empty() {
            own = unlit(scene, index, object);
            lit.push(&own);
        }
        let mut parts = Vec::new();
        for lit in lit.into_iter().filter(|lit| !lit.triangles.is_empty()) {
            parts.push(part(
                &mut builder,
                &mut materials,
                scene,
                style,
                (object, origin),
                lit,
                layered.contains(&index),
            ));
        }
        if parts.is_empty() {
            continue;
        }
        let mesh = builder.push("meshes", json!({ "name": object.name, "primitives": parts }));
        let mut node = json!({ "name": object.name, "mesh": mesh });
        if origin != DVec3::ZERO {
            node["translation"] = json!(origin.to_array());
        }
        children.push(builder.push("nodes", node));
    }
    materials.settle(&mut builder, false);
    for camera in &scene.cameras {
        let json = self::camera(camera);
        let index = builder.push("cameras", json);
        let matrix = camera.world_from_camera.to_cols_array();
        children.push(builder.push("nodes", json!({ "name": camera.name, "camera": index, "matrix": matrix })));
    }
    children.extend(put(&mut builder, &scene.lights));
    if let Some(root) = builder.list("nodes").get_mut(root) {
        if !children.is_empty() {
            root["children"] = json!(children);
        }
        if scene.up == Up::Z {
            let half = std::f64::consts::FRAC_1_SQRT_2;
            root["rotation"] = json!([-half, 0.0, 0.0, half]);
        }
    }
    builder.json.insert("scene".into(), 0.into());
    builder.push("scenes", json!({ "nodes": [root] }));
    builder.finish()
}

/// From here on single precision does not do for places, metres: its numbers lie 0.06 mm apart.
const FAR: f64 = 1000.0;

/// Where positions are written from: the scene's own origin, or where that lies farther away than the scene is wide, as of models in national coordinates, whole
/// metres in their middle.
pub(super) fn origin(scene: &Scene) -> DVec3 {
    let bounds = |(low, high): (DVec3, DVec3), p: &DVec3| (low.min(*p), high.max(*p));
    let (low, high) = scene.positions.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), bounds);
    let middle = (0.5 * (low + high)).round();
    let far = (high - low).max_element().max(FAR);
    if middle.is_finite() && middle.abs().max_element() > far { middle } else { DVec3::ZERO }
}

/// An object that got no light: all its triangles as they are.
fn unlit(scene: &Scene, index: usize, object: &Object) -> LitPrimitive {
    let first = object.vertices.start as u32;
    let vertex = |i: usize| LitVertex { corners: [i as u32; 3], weights: [1.0, 0.0, 0.0] };
    LitPrimitive {
        object: index,
        vertices: (0..object.vertices.len()).map(vertex).collect(),
        triangles: scene.triangles[object.triangles.clone()].iter().map(|t| t.map(|v| v - first)).collect(),
        flipped: false,
        light: Light::None,
    }
}

fn part(
    builder: &mut Builder,
    materials: &mut Materials<'_>,
    scene: &Scene,
    style: &Style,
    (object, origin): (&Object, DVec3),
    lit: &LitPrimitive,
    single_sided: bool,
) -> Value {
    let own = object.vertices.clone();
    let mut attributes = Map::new();
    let mut add = |name: &str, values: Vec<f32>, width: usize| {
        attributes.insert(name.to_owned(), vertices::from_scene(builder, lit, name, &values, width).into());
    };
    let positions = &scene.positions[own.clone()];
    add("POSITION", positions.iter().flat_map(|p| (*p - origin).as_vec3().to_array()).collect(), 3);
    let normals = &scene.normals[own.clone()];
    // Where one is missing none are written: viewers then shade flat.
    if normals.iter().all(|n| *n != Vec3::ZERO) {
        add("NORMAL", normals.iter().flat_map(|n| n.to_array()).collect(), 3);
    }
    for (set, uvs) in scene.uvs.iter().enumerate().filter(|(set, _)| *set == 0 || !scene.uvs[0].is_empty()) {
        if let Some(uvs) = uvs.get(own.clone()).filter(|uvs| !uvs.is_empty()) {
            add(&format!("TEXCOORD_{set}"), uvs.iter().flat_map(|uv| uv.to_array()).collect(), 2);
        }
    }
    let colors = scene.colors.get(own).filter(|colors| !colors.is_empty());
    if let Some(colors) = colors {
        add("COLOR_0", colors.iter().flatten().copied().collect(), 4);
    }
    let mut primitive = Map::from_iter([("attributes".to_owned(), Value::Object(attributes))]);
    vertices::triangles(builder, &mut primitive, lit, false);
    let glow = materials.glow(object.material);
    let set = vertices::add_light(builder, &mut primitive, lit, style, colors, glow);
    if let Some(material) = materials.lit(builder, Some(object.material), lit, set, single_sided) {
        primitive.insert("material".into(), material.into());
    }
    Value::Object(primitive)
}

fn camera(camera: &Camera) -> Value {
    match camera.projection {
        Projection::Perspective { vertical_fov } => {
            let mut perspective = json!({ "yfov": vertical_fov, "znear": 0.01 });
            if let Some(aspect) = camera.aspect {
                perspective["aspectRatio"] = aspect.into();
            }
            json!({ "name": camera.name, "type": "perspective", "perspective": perspective })
        }
        Projection::Orthographic { half_height } => {
            let half_width = half_height * camera.aspect.unwrap_or(1.0);
            let orthographic = json!({ "xmag": half_width, "ymag": half_height, "znear": 0.01, "zfar": 10_000.0 });
            json!({ "name": camera.name, "type": "orthographic", "orthographic": orthographic })
        }
    }
}

/// Pictures written so far.
struct Pictures<'a> {
    scene: &'a Scene,
    samplers: BTreeMap<[u32; 2], usize>,
    images: BTreeMap<usize, usize>,
    textures: BTreeMap<(usize, usize), usize>,
}

impl Pictures<'_> {
    fn material(&mut self, builder: &mut Builder, material: &Material) -> Result<Value, WriteError> {
        let (base, through) =
            match mixture(material).map_err(|what| WriteError::Material { name: material.name.clone(), what })? {
                None => (material.base_color, None),
                Some(mixture) => (mixture.base, Some(self.transmission(builder, material, &mixture)?)),
            };
        let mut pbr = json!({
            "baseColorFactor": base.map(unit), "metallicFactor": unit(material.metallic),
        });
        if let Some(texture) = &material.base_color_texture {
            pbr["baseColorTexture"] = self.reference(builder, texture)?;
        }
        if let Some(texture) = &material.metallic_texture {
            pbr["metallicRoughnessTexture"] = self.reference(builder, texture)?;
        }
        let mut json = json!({ "name": material.name, "pbrMetallicRoughness": pbr });
        if let Some(through) = through {
            json["extensions"]["KHR_materials_diffuse_transmission"] = through;
        }
        if material.emits() {
            // Factors end at 1; the strength carries the rest.
            let strength = material.emissive.iter().copied().fold(1.0, f32::max);
            json["emissiveFactor"] = json!(material.emissive.map(|e| unit(e / strength)));
            if strength > 1.0 && strength.is_finite() {
                json["extensions"]["KHR_materials_emissive_strength"] = json!({ "emissiveStrength": strength });
                builder.uses("KHR_materials_emissive_strength");
            }
            if let Some(texture) = &material.emissive_texture {
                json["emissiveTexture"] = self.reference(builder, texture)?;
            }
        }
        match material.alpha_mode {
            AlphaMode::Opaque => {}
            AlphaMode::Mask { cutoff } => {
                json["alphaMode"] = "MASK".into();
                json["alphaCutoff"] = json!(cutoff);
            }
            AlphaMode::Blend => json["alphaMode"] = "BLEND".into(),
        }
        if material.has_two_sides() {
            json["doubleSided"] = true.into();
        }
        Ok(json)
    }

    /// KHR_materials_diffuse_transmission.
    fn transmission(
        &mut self,
        builder: &mut Builder,
        material: &Material,
        mixture: &Mixture,
    ) -> Result<Value, WriteError> {
        let mut json = json!({
            "diffuseTransmissionFactor": mixture.share, "diffuseTransmissionColorFactor": mixture.color,
        });
        if let Some(transmission) = &material.transmission {
            if let Some(texture) = &transmission.texture {
                json["diffuseTransmissionColorTexture"] = self.reference(builder, texture)?;
            }
            if let Some(texture) = &transmission.share_texture {
                json["diffuseTransmissionTexture"] = self.reference(builder, texture)?;
            }
        }
        builder.uses("KHR_materials_diffuse_transmission");
        Ok(json)
    }

    fn reference(&mut self, builder: &mut Builder, at: &TextureRef) -> Result<Value, WriteError> {
        let code = |wrap: Wrap| match wrap {
            Wrap::Repeat => 10497,
            Wrap::Mirror => 33648,
            Wrap::Clamp => 33071,
        };
        let wraps = at.wrap.map(code);
        let sampler = *self
            .samplers
            .entry(wraps)
            .or_insert_with(|| builder.push("samplers", json!({ "wrapS": wraps[0], "wrapT": wraps[1] })));
        let image = match self.images.get(&at.texture) {
            Some(&image) => image,
            None => {
                let texture = self.scene.textures.get(at.texture);
                let bytes = texture.map_or_else(|| Ok(Vec::new()), png)?;
                let name = texture.map_or("", |texture| texture.name.as_str());
                let view = builder.view(&bytes, Target::None);
                let image = json!({ "bufferView": view, "mimeType": "image/png", "name": name });
                *self.images.entry(at.texture).or_insert(builder.push("images", image))
            }
        };
        let texture = *self
            .textures
            .entry((image, sampler))
            .or_insert_with(|| builder.push("textures", json!({ "source": image, "sampler": sampler })));
        let mut json = json!({ "index": texture, "texCoord": at.uv_set });

        // KHR_texture_transform scales, then turns (counter-clockwise as seen, v down), then moves.
        let matrix = at.transform.matrix2;
        let scale = DVec2::new(matrix.x_axis.length(), matrix.y_axis.length());
        let scale = if matrix.determinant() < 0.0 { DVec2::new(scale.x, -scale.y) } else { scale };
        let rotation = (-matrix.x_axis.y).atan2(matrix.x_axis.x);
        let offset = at.transform.translation;
        if (scale, rotation, offset) != (DVec2::ONE, 0.0, DVec2::ZERO) {
            let transform = json!({ "offset": offset.to_array(), "rotation": rotation, "scale": scale.to_array() });
            json["extensions"] = json!({ "KHR_texture_transform": transform });
            builder.uses("KHR_texture_transform");
        }
        Ok(json)
    }
}

fn png(texture: &Texture) -> Result<Vec<u8>, WriteError> {
    let flat: Vec<u8> = texture.texels.iter().flatten().copied().collect();
    let fault = |what: String| WriteError::Picture { name: texture.name.clone(), what };
    let picture = image::RgbaImage::from_raw(texture.width, texture.height, flat)
        .ok_or_else(|| fault(format!("{} texels for {} x {}", texture.texels.len(), texture.width, texture.height)))?;
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).map_err(|error| fault(error.to_string()))?;
    Ok(bytes.into_inner())
}
