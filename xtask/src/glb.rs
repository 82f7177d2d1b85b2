//! GLB, the binary container of glTF 2.0 (Khronos specification, section 4): a JSON chunk and one binary chunk.

use crate::fault::Fault;
use crate::showcase::solid::Shaded;
use glam::{DMat3, DQuat, DVec3};
use serde_json::{Value, json};
use std::io::Write;

pub const FLOAT: u32 = 5126;
pub const UNSIGNED_INT: u32 = 5125;
pub const ARRAY_BUFFER: u32 = 34962;
pub const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Writes the headers and the JSON chunk; the caller then writes exactly `binary_length` bytes (a multiple of 4).
pub fn write_head(to: &mut dyn Write, json: &Value, binary_length: u64) -> Result<(), Head> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + text.len() as u64 + 8 + binary_length;
    let total = u32::try_from(total).map_err(|_| Head::TooLarge(total))?;
    for word in [0x4654_6c67, 2, total, text.len() as u32, 0x4e4f_534a] {
        to.write_all(&u32::to_le_bytes(word))?;
    }
    to.write_all(&text)?;
    for word in [binary_length as u32, 0x004e_4942] {
        to.write_all(&u32::to_le_bytes(word))?;
    }
    Ok(())
}

/// Why a head could not be written.
#[derive(Debug, thiserror::Error)]
pub enum Head {
    #[error("{0}")]
    Write(#[from] std::io::Error),
    #[error("{0} bytes")]
    TooLarge(u64),
}

impl Head {
    /// The task's fault, for the file at `path`.
    pub fn at(path: &std::path::Path) -> impl FnOnce(Head) -> Fault + '_ {
        move |head| match head {
            Head::Write(source) => Fault::at(path)(source),
            Head::TooLarge(bytes) => Fault::TooLarge(bytes),
        }
    }
}

/// Smallest and largest coordinates of a set of points, as `POSITION` accessors must tell.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    pub min: [f32; 3],
    pub max: [f32; 3],
}

impl Default for Bounds {
    fn default() -> Self {
        Bounds { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] }
    }
}

impl Bounds {
    /// Grows to hold `point`.
    pub fn add(&mut self, point: [f32; 3]) {
        for (axis, x) in point.into_iter().enumerate() {
            self.min[axis] = self.min[axis].min(x);
            self.max[axis] = self.max[axis].max(x);
        }
    }
}

/// The node of a camera at `eye` that looks at `target`, upright.
pub fn camera_node(name: &str, camera: usize, eye: DVec3, target: DVec3) -> Value {
    let back = (eye - target).normalize();
    let right = DVec3::Y.cross(back).normalize();
    let turn = DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back));
    json!({"name": name, "camera": camera, "translation": eye.to_array(), "rotation": turn.to_array()})
}

/// A glTF document being put together in memory.
#[derive(Default)]
pub struct Glb {
    binary: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    images: Vec<Value>,
    materials: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    cameras: Vec<Value>,
    lights: Vec<Value>,
    /// Triangles so far.
    pub triangles: usize,
}

impl Glb {
    fn view(&mut self, bytes: impl IntoIterator<Item = u8>, target: Option<u32>) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let offset = self.binary.len();
        self.binary.extend(bytes);
        let mut view = json!({"buffer": 0, "byteOffset": offset, "byteLength": self.binary.len() - offset});
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.views.push(view);
        self.views.len() - 1
    }

    fn accessor<const N: usize>(&mut self, rows: &[[f32; N]], kind: &str) -> usize {
        let view = self.view(rows.iter().flatten().flat_map(|x| x.to_le_bytes()), Some(ARRAY_BUFFER));
        self.accessors.push(json!({"bufferView": view, "componentType": FLOAT, "count": rows.len(), "type": kind}));
        self.accessors.len() - 1
    }

    /// Embeds a PNG as picture and texture; returns the texture's index.
    pub fn texture(&mut self, name: &str, png: &[u8]) -> usize {
        let view = self.view(png.iter().copied(), None);
        self.images.push(json!({"name": name, "bufferView": view, "mimeType": "image/png"}));
        self.images.len() - 1
    }

    /// A diffuse material of linear reflectance `color`, times a texture if given, that emits `luminance` (linear
    /// red, green, blue in cd/m²; written as a factor of at most 1 times a strength).
    pub fn material(&mut self, name: &str, color: [f64; 3], texture: Option<usize>, luminance: [f64; 3]) -> usize {
        let [r, g, b] = color;
        let mut material = json!({
            "name": name,
            "pbrMetallicRoughness": {"baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0},
        });
        if let Some(texture) = texture {
            material["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": texture});
        }
        let strength = luminance.into_iter().fold(0.0, f64::max);
        if strength > 0.0 {
            material["emissiveFactor"] = json!(luminance.map(|l| l / strength));
            material["extensions"] = json!({"KHR_materials_emissive_strength": {"emissiveStrength": strength}});
        }
        self.materials.push(material);
        self.materials.len() - 1
    }

    /// Places a mesh of its own. Texture coordinates are written only where there are some.
    pub fn object(&mut self, name: &str, material: usize, shape: &Shaded) {
        let mut bounds = Bounds::default();
        shape.positions.iter().for_each(|&p| bounds.add(p));
        let position = self.accessor(&shape.positions, "VEC3");
        self.accessors[position]["min"] = json!(bounds.min);
        self.accessors[position]["max"] = json!(bounds.max);
        let mut attributes = json!({"POSITION": position, "NORMAL": self.accessor(&shape.normals, "VEC3")});
        if !shape.uvs.is_empty() {
            attributes["TEXCOORD_0"] = json!(self.accessor(&shape.uvs, "VEC2"));
        }
        let view = self.view(shape.indices.iter().flat_map(|i| i.to_le_bytes()), Some(ELEMENT_ARRAY_BUFFER));
        self.accessors.push(json!({
            "bufferView": view, "componentType": UNSIGNED_INT, "count": shape.indices.len(), "type": "SCALAR",
        }));
        let indices = self.accessors.len() - 1;
        self.meshes.push(json!({
            "name": name,
            "primitives": [{"attributes": attributes, "indices": indices, "material": material}],
        }));
        self.nodes.push(json!({"name": name, "mesh": self.meshes.len() - 1}));
        self.triangles += shape.indices.len() / 3;
    }

    /// A directional light shining along `direction`, in lux on a surface that faces it, per linear colour band.
    pub fn sun(&mut self, name: &str, direction: DVec3, lux: [f64; 3]) {
        let strength = lux.into_iter().fold(0.0, f64::max);
        let color = lux.map(|x| x / strength);
        self.lights.push(json!({"name": name, "type": "directional", "color": color, "intensity": strength}));
        let turn = DQuat::from_rotation_arc(DVec3::NEG_Z, direction.normalize());
        let light = self.lights.len() - 1;
        self.nodes.push(json!({
            "name": name,
            "rotation": turn.to_array(),
            "extensions": {"KHR_lights_punctual": {"light": light}},
        }));
    }

    /// A perspective camera at `eye`, looking at `target`, upright; `vertical_fov` in radians.
    pub fn camera(&mut self, name: &str, eye: DVec3, target: DVec3, vertical_fov: f64) {
        self.cameras.push(json!({
            "name": name,
            "type": "perspective",
            "perspective": {"yfov": vertical_fov, "znear": 0.05, "zfar": 100.0},
        }));
        self.nodes.push(camera_node(name, self.cameras.len() - 1, eye, target));
    }

    /// The whole file.
    pub fn finish(mut self, scene: &str) -> Result<Vec<u8>, Head> {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let textures: Vec<Value> = (0..self.images.len()).map(|i| json!({"sampler": 0, "source": i})).collect();
        let json = json!({
            "asset": {"version": "2.0", "generator": "radiosity xtask"},
            "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_emissive_strength"],
            "extensions": {"KHR_lights_punctual": {"lights": self.lights}},
            "scene": 0,
            "scenes": [{"name": scene, "nodes": (0..self.nodes.len()).collect::<Vec<_>>()}],
            "nodes": self.nodes,
            "meshes": self.meshes,
            "materials": self.materials,
            "cameras": self.cameras,
            "samplers": [{"magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497}],
            "textures": textures,
            "images": self.images,
            "accessors": self.accessors,
            "bufferViews": self.views,
            "buffers": [{"byteLength": self.binary.len()}],
        });
        let mut file = Vec::new();
        write_head(&mut file, &json, self.binary.len() as u64)?;
        file.extend(self.binary);
        Ok(file)
    }
}

/// Splits a GLB into its JSON and its binary chunk, holding it to the container's rules.
#[cfg(test)]
pub fn parts(file: &[u8]) -> (Value, &[u8]) {
    let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().expect("four bytes")) as usize;
    assert_eq!((&file[..4], word(4), word(8)), (&b"glTF"[..], 2, file.len()));
    let json_length = word(12);
    assert_eq!((&file[16..20], json_length % 4), (&b"JSON"[..], 0));
    let at = 20 + json_length;
    assert_eq!((&file[at + 4..at + 8], word(at) % 4, at + 8 + word(at)), (&b"BIN\0"[..], 0, file.len()));
    (serde_json::from_slice(&file[20..at]).expect("the chunk is JSON"), &file[at + 8..])
}
