//! From a [`Document`] to the [`Scene`](radiosity_scene::Scene) it means.
//!
//! Every primitive of every node becomes one object, instances of EXT_mesh_gpu_instancing included. A mirrored node
//! (negative determinant) turns the corner order of its triangles, so that the front stays the front. A skinned mesh
//! stands as its joints stand in the file, and its own node's place is ignored (glTF 2.0, 3.7.3.3); morph targets
//! have their default weights; animations are not played.

use super::json::{list, shown, whole};
use super::nodes::{self, Placed};
use super::primitive::{self, Geometry};
use super::{Document, extensions, light, lit, material};
use crate::assemble::{Assembly, Part};
use crate::{LoadError, LoadOptions, Loaded, Source};
use glam::{DAffine3, DMat3, DMat4, DVec3, Vec3};
use radiosity_scene::{Faults, Material, Source as Origin, counted};
use serde_json::Value;
use std::collections::BTreeMap;

/// Reads a .gltf or .glb from memory; `file` is its name for messages, `source` gives what it refers to.
pub fn load(file: &str, bytes: &[u8], source: &dyn Source, options: &LoadOptions) -> Result<Loaded, LoadError> {
    let mut faults = Faults::default();
    let Some(document) = Document::read(file, bytes, source, &mut faults) else {
        return Err(LoadError::Faults(faults));
    };
    extensions::check(&document, file, &mut faults);

    let materials = material::read(&document, file, &mut faults);
    let placed = nodes::placed(&document, file, &mut faults);
    let mut assembly = Assembly::new(options);
    assembly.scene.materials = materials.materials;
    assembly.scene.textures = materials.textures;
    let (lights, put_aside) = light::lights(&document, &placed, file, &mut faults);
    assembly.scene.lights = lights;
    lit::warn(&document, put_aside, file, &mut faults);
    assembly.scene.cameras = light::cameras(&document, &placed, file, &mut faults);
    assembly.scene.up = options.up.unwrap_or_default();

    let mut meshes = Meshes {
        document: &document,
        file,
        world_of: placed.iter().map(|at| (at.node, at.world)).collect(),
        uses: uses(&document, &placed),
        known: BTreeMap::new(),
        without_material: 0,
    };
    for at in &placed {
        meshes.place(at, &mut assembly, &mut faults);
    }
    if meshes.without_material > 0 {
        let what = format!(
            "{} without a material: matte grey of reflectance {}",
            counted(meshes.without_material, "primitive is", "primitives are"),
            material::UNNAMED_REFLECTANCE
        );
        faults.note(file, what, "give them a material");
    }
    if meshes.without_material == 0 {
        assembly.scene.materials.pop();
    }
    note_metals(&assembly, file, &mut faults);
    if !list(&document.json, "animations").is_empty() {
        faults.note(file, "animations are not played; the scene is as it stands", "");
    }

    let scene = assembly.finish(file, &mut faults);
    Loaded::checked(file, scene, faults, Some(document))
}

fn note_metals(assembly: &Assembly<'_>, file: &str, faults: &mut Faults) {
    let metal = |material: &&Material| material.metallic > 0.5 && material.metallic_texture.is_none();
    let names: Vec<&str> = assembly.scene.materials.iter().filter(metal).map(|m| m.name.as_str()).take(5).collect();
    if !names.is_empty() {
        let what = format!("metals reflect little or nothing diffusely: {}", names.join(", "));
        faults.note(file, what, "metallicFactor is 1 where a file does not say");
    }
}

/// How many nodes use each mesh.
fn uses(document: &Document, placed: &[Placed]) -> BTreeMap<usize, usize> {
    let mut uses = BTreeMap::new();
    for at in placed {
        let mesh = list(&document.json, "nodes").get(at.node).and_then(|node| node.get("mesh")).and_then(whole);
        *uses.entry(mesh.unwrap_or(usize::MAX)).or_insert(0) += 1;
    }
    uses
}

struct Meshes<'a> {
    document: &'a Document,
    file: &'a str,
    world_of: BTreeMap<usize, DAffine3>,
    uses: BTreeMap<usize, usize>,
    /// Primitives of meshes that are placed more than once, by mesh and primitive.
    known: BTreeMap<(usize, usize), Option<Geometry>>,
    without_material: usize,
}

impl Meshes<'_> {
    fn place(&mut self, at: &Placed, assembly: &mut Assembly<'_>, faults: &mut Faults) {
        let document = self.document;
        let null = Value::Null;
        let node = list(&document.json, "nodes").get(at.node).unwrap_or(&null);
        let Some(mesh) = node.get("mesh") else { return };
        let place = format!("{}: nodes[{}]", self.file, at.node);
        let meshes = list(&document.json, "meshes");
        let Some((mesh_index, mesh)) = whole(mesh).and_then(|index| Some((index, meshes.get(index)?))) else {
            let what = format!("mesh {} of {}", shown(node.get("mesh")), meshes.len());
            faults.error(place, what, "export the model again");
            return;
        };
        let skin = node.get("skin").and_then(|skin| self.skin(skin, &place, faults));
        let worlds = match instances(document, node, &place, faults) {
            Some(instances) => instances.into_iter().map(|instance| at.world * instance).collect(),
            None => vec![at.world],
        };
        let weights = primitive::morph_weights(node, mesh);
        let name = nodes::name_of(document, at.node, Some(mesh_index));

        for (index, json) in list(mesh, "primitives").iter().enumerate() {
            let place = format!("{}: meshes[{mesh_index}].primitives[{index}]", self.file);
            // Ask before memory is taken: a small file can name one large accessor many times.
            let size = primitive::size(document, json).unwrap_or_default();
            if !assembly.has_room(&place, worlds.len(), size, faults) {
                return;
            }
            let material = self.material(json, assembly.scene.materials.len() - 1, &place, faults);
            let read = |faults: &mut Faults| primitive::read(document, json, &weights, skin.is_some(), &place, faults);
            let plain = skin.is_none() && weights.is_empty();
            let own;
            let geometry = if plain && self.uses.get(&mesh_index).copied().unwrap_or(0) > 1 {
                self.known.entry((mesh_index, index)).or_insert_with(|| read(faults)).as_ref()
            } else {
                own = read(faults);
                own.as_ref()
            };
            let Some(geometry) = geometry else { continue };
            for (instance, world) in worlds.iter().enumerate() {
                let mut part = match &skin {
                    Some(joints) => skinned(geometry, joints),
                    None => moved(geometry, world),
                };
                part.name.clone_from(&name);
                part.material = material;
                part.source = Origin { node: at.node, mesh: mesh_index, primitive: index, instance };
                assembly.add(&place, part, faults);
            }
        }
    }

    /// Index of the primitive's material; `unnamed` where it has none.
    fn material(&mut self, primitive: &Value, unnamed: usize, place: &str, faults: &mut Faults) -> usize {
        let Some(material) = primitive.get("material") else {
            self.without_material += 1;
            return unnamed;
        };
        whole(material).filter(|index| *index < unnamed).unwrap_or_else(|| {
            faults.error(place, format!("material {} of {unnamed}", shown(Some(material))), "export the model again");
            self.without_material += 1;
            unnamed
        })
    }

    /// World from mesh for each joint of a skin.
    fn skin(&self, skin: &Value, place: &str, faults: &mut Faults) -> Option<Vec<DAffine3>> {
        let skins = list(&self.document.json, "skins");
        let Some(json) = whole(skin).and_then(|index| skins.get(index)) else {
            let what = format!("skin {} of {}; its mesh is not bent", shown(Some(skin)), skins.len());
            faults.warning(place, what, "export the model again");
            return None;
        };
        let joints = list(json, "joints");
        let inverse = match json.get("inverseBindMatrices") {
            None => vec![DMat4::IDENTITY; joints.len()],
            Some(accessor) => match whole(accessor).map(|index| self.document.read_mat4(index)) {
                Some(Ok(matrices)) => matrices,
                Some(Err(error)) => {
                    faults.warning(
                        place,
                        format!("inverseBindMatrices: {error}; its mesh is not bent"),
                        "export again",
                    );
                    return None;
                }
                None => return None,
            },
        };
        let mut out = Vec::with_capacity(joints.len().min(inverse.len()));
        for (joint, inverse) in joints.iter().zip(inverse) {
            let Some(world) = whole(joint).and_then(|joint| self.world_of.get(&joint)) else {
                let what = format!("joint {} is not in the scene; its mesh is not bent", shown(Some(joint)));
                faults.warning(place, what, "export the model again");
                return None;
            };
            out.push(*world * DAffine3::from_mat4(inverse));
        }
        faults.note(place, "is skinned; it stands as its joints stand in the file", "");
        Some(out)
    }
}

/// Transforms of EXT_mesh_gpu_instancing; `None` where the node has none.
fn instances(document: &Document, node: &Value, place: &str, faults: &mut Faults) -> Option<Vec<DAffine3>> {
    let attributes = node.pointer("/extensions/EXT_mesh_gpu_instancing/attributes")?;
    let mut wrong = |what: String| {
        faults.error(place, format!("EXT_mesh_gpu_instancing: {what}"), "export the model again");
        Some(Vec::new())
    };
    let index = |name: &str| attributes.get(name).map(|value| whole(value).unwrap_or(usize::MAX));
    let translation = index("TRANSLATION").map(|i| document.read_vec3(i)).transpose();
    let rotation = index("ROTATION").map(|i| document.read_vec4(i)).transpose();
    let scale = index("SCALE").map(|i| document.read_vec3(i)).transpose();
    let (translation, rotation, scale) = match (translation, rotation, scale) {
        (Ok(t), Ok(r), Ok(s)) => (t, r, s),
        (Err(error), ..) | (_, Err(error), _) | (.., Err(error)) => return wrong(error.to_string()),
    };
    let counts = [translation.as_ref().map(Vec::len), rotation.as_ref().map(Vec::len), scale.as_ref().map(Vec::len)];
    let count = counts.iter().flatten().copied().min().unwrap_or(0);
    if counts.iter().flatten().any(|&c| c != count) {
        return wrong(format!("lists of different lengths {counts:?}"));
    }
    let at = |i: usize| {
        let t = translation.as_ref().and_then(|list| list.get(i)).map_or(DVec3::ZERO, |t| t.as_dvec3());
        let s = scale.as_ref().and_then(|list| list.get(i)).map_or(DVec3::ONE, |s| s.as_dvec3());
        let r = rotation.as_ref().and_then(|list| list.get(i)).map(|r| r.to_array().map(f64::from));
        let r = r.map_or(Some(glam::DQuat::IDENTITY), nodes::unit_quaternion).unwrap_or_default();
        DAffine3::from_scale_rotation_translation(s, r, t)
    };
    Some((0..count).map(at).collect())
}

/// A primitive placed by its node.
fn moved(geometry: &Geometry, world: &DAffine3) -> Part {
    let normal_matrix = world.matrix3.inverse().transpose();
    Part {
        positions: geometry.positions.iter().map(|&p| world.transform_point3(p)).collect(),
        normals: geometry.normals.iter().map(|&n| turned(&normal_matrix, n)).collect(),
        triangles: wound(&geometry.triangles, world.matrix3.determinant() < 0.0),
        ..common(geometry)
    }
}

/// A primitive bent by its joints.
fn skinned(geometry: &Geometry, joints: &[DAffine3]) -> Part {
    let blended = |vertex: usize| {
        let influences = geometry.influences.get(vertex).map_or(&[][..], Vec::as_slice);
        let known = influences.iter().filter_map(|&(joint, w)| Some((joints.get(joint as usize)?, f64::from(w))));
        let total: f64 = known.clone().map(|(_, weight)| weight).sum();
        if total <= 0.0 {
            return joints.first().copied().unwrap_or(DAffine3::IDENTITY);
        }
        let mut sum = DMat4::ZERO;
        for (joint, weight) in known {
            sum += DMat4::from(*joint) * (weight / total);
        }
        DAffine3::from_mat4(sum)
    };
    let frames: Vec<DAffine3> = (0..geometry.positions.len()).map(blended).collect();
    let mirrored = frames.first().is_some_and(|frame| frame.matrix3.determinant() < 0.0);
    let normal = |(frame, &n): (&DAffine3, &Vec3)| turned(&frame.matrix3.inverse().transpose(), n);
    Part {
        positions: frames.iter().zip(&geometry.positions).map(|(frame, &p)| frame.transform_point3(p)).collect(),
        normals: frames.iter().zip(&geometry.normals).map(normal).collect(),
        triangles: wound(&geometry.triangles, mirrored),
        ..common(geometry)
    }
}

fn common(geometry: &Geometry) -> Part {
    Part { uvs: geometry.uvs.clone(), colors: geometry.colors.clone(), ..Part::default() }
}

fn turned(normal_matrix: &DMat3, normal: Vec3) -> Vec3 {
    (*normal_matrix * normal.as_dvec3()).try_normalize().unwrap_or(DVec3::ZERO).as_vec3()
}

fn wound(triangles: &[[u32; 3]], mirrored: bool) -> Vec<[u32; 3]> {
    match mirrored {
        true => triangles.iter().map(|&[a, b, c]| [a, c, b]).collect(),
        false => triangles.to_vec(),
    }
}
