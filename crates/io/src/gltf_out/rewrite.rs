//! A glTF source with its lit primitives put in place.

use super::glb::{Builder, Target};
use super::materials::Materials;
use super::{LitPrimitive, Style, WriteError, lamps, vertices};
use crate::gltf::Document;
use crate::gltf::json::{list, numbers, whole};
use glam::DMat4;
use radiosity_scene::Scene;
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// Extensions whose data is plain in a [`Document`].
const UNPACKED: &[&str] = &["EXT_meshopt_compression", "KHR_meshopt_compression", "KHR_draco_mesh_compression"];

/// Extensions that name no accessor; with any other one, no accessor is dropped, since it may be in use.
const WITHOUT_ACCESSORS: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_basisu",
    "KHR_texture_transform",
    "MOZ_lightmap",
];

/// Lit primitives by node, instance and primitive.
type Places = BTreeMap<usize, BTreeMap<usize, BTreeMap<usize, Vec<usize>>>>;

pub(super) fn rewrite(
    scene: &Scene,
    document: &Document,
    primitives: &[LitPrimitive],
    style: &Style,
) -> Result<Vec<u8>, WriteError> {
    let mut builder = Builder { json: document.json.as_object().cloned().unwrap_or_default(), binary: Vec::new() };
    unpack(&mut builder);
    forget_light(&mut builder);
    let old_views = list(&document.json, "bufferViews").len();
    let mut materials = Materials::new(scene, style, &mut builder);

    // Sort by place; sides of one object share the question whether it has a lit back.
    let mut places = Places::new();
    let mut layered = BTreeSet::new();
    for (index, lit) in primitives.iter().enumerate() {
        let Some(object) = scene.objects.get(lit.object) else { continue };
        let at = object.source;
        let by_node = places.entry(at.node).or_default().entry(at.instance).or_default();
        by_node.entry(at.primitive).or_default().push(index);
        if lit.flipped {
            layered.insert(lit.object);
        }
    }
    let mirrored = mirrored(document);

    // A mesh whose every user is lit gives its index to the first of them.
    let mut unlit_uses: BTreeMap<usize, usize> = BTreeMap::new();
    for (node, json) in list(&document.json, "nodes").iter().enumerate() {
        if let Some(mesh) = json.get("mesh").and_then(whole)
            && !places.contains_key(&node)
        {
            *unlit_uses.entry(mesh).or_default() += 1;
        }
    }
    let mut taken = BTreeSet::new();
    for (&node, by_instance) in &places {
        let json = list(&document.json, "nodes").get(node).unwrap_or(&Value::Null);
        let mesh_index = json.get("mesh").and_then(whole);
        let mesh = mesh_index.and_then(|mesh| Some((mesh, list(&document.json, "meshes").get(mesh)?)));
        let Some((mesh_index, mesh)) = mesh else {
            let primitive = by_instance.values().flat_map(|p| p.values()).flatten().next().copied().unwrap_or(0);
            return Err(WriteError::Primitive { primitive, what: format!("node {node} of the source has no mesh") });
        };
        let skinned = json.get("skin").is_some();
        // The place of a skinned mesh's own node is ignored (glTF 2.0, 3.7.3.3).
        let world = !skinned && mirrored.get(node).copied().unwrap_or(false);
        let instances = instances(document, json)?;
        let mut meshes = Vec::new();
        for instance in 0..instances.as_ref().map_or(1, Vec::len) {
            let turned = instances.as_ref().and_then(|all| all.get(instance)).is_some_and(|at| at.mirrored);
            let lit = by_instance.get(&instance);
            let mut parts = Vec::new();
            for (index, source) in list(mesh, "primitives").iter().enumerate() {
                let Some(own) = lit.and_then(|lit| lit.get(&index)) else {
                    parts.push(without_packing(source));
                    continue;
                };
                for &which in own {
                    let Some(lit) = primitives.get(which) else { continue };
                    let context = Context { document, style, single_sided: layered.contains(&lit.object) };
                    parts.push(part(&mut builder, &mut materials, &context, source, lit, world != turned)?);
                }
            }
            let mut copy = mesh.clone();
            copy["primitives"] = Value::Array(parts);
            let free = !unlit_uses.contains_key(&mesh_index) && taken.insert(mesh_index);
            let meshes_of_file = builder.list("meshes");
            meshes.push(match meshes_of_file.get_mut(mesh_index) {
                Some(slot) if free => {
                    *slot = copy;
                    mesh_index
                }
                _ => builder.push("meshes", copy),
            });
        }
        place(&mut builder, node, &meshes, instances.as_deref());
    }

    materials.settle(&mut builder, true);
    lamps::take_out(&mut builder, document);
    embed_pictures(&mut builder, document);
    compact(&mut builder, document, old_views)?;
    finish_names(&mut builder);
    builder.finish()
}

/// Whether each node stands mirrored in the world: an odd number of negative determinants on the way to its root.
fn mirrored(document: &Document) -> Vec<bool> {
    let nodes = list(&document.json, "nodes");
    let own =
        |node: &Value| match (node.get("matrix").and_then(numbers::<16>), node.get("scale").and_then(numbers::<3>)) {
            (Some(matrix), _) => DMat4::from_cols_array(&matrix).determinant() < 0.0,
            (None, Some(scale)) => scale.iter().product::<f64>() < 0.0,
            (None, None) => false,
        };
    let mut parent = vec![None; nodes.len()];
    for (index, node) in nodes.iter().enumerate() {
        for child in list(node, "children").iter().filter_map(whole) {
            if let Some(slot) = parent.get_mut(child) {
                *slot = Some(index);
            }
        }
    }
    let mut out: Vec<bool> = nodes.iter().map(own).collect();
    let mut stack: Vec<usize> = (0..nodes.len()).filter(|&node| parent.get(node) == Some(&None)).collect();
    // Parents before children; nodes in a loop, which the reader refuses, are never reached.
    while let Some(index) = stack.pop() {
        let above = out.get(index).copied().unwrap_or(false);
        for child in nodes.get(index).map(|node| list(node, "children")).unwrap_or_default().iter().filter_map(whole) {
            if parent.get(child) == Some(&Some(index)) {
                if let Some(slot) = out.get_mut(child) {
                    *slot ^= above;
                }
                stack.push(child);
            }
        }
    }
    out
}

struct Context<'a> {
    document: &'a Document,
    style: &'a Style,
    single_sided: bool,
}

/// A lit primitive in the place of its source.
fn part(
    builder: &mut Builder,
    materials: &mut Materials<'_>,
    context: &Context<'_>,
    source: &Value,
    lit: &LitPrimitive,
    mirrored: bool,
) -> Result<Value, WriteError> {
    let Value::Object(mut primitive) = without_packing(source) else { return Ok(source.clone()) };
    for name in ["attributes", "targets", "indices", "mode"] {
        primitive.remove(name);
    }
    vertices::from_source(builder, context.document, source, &mut primitive, lit, mirrored)?;
    let colors = source.pointer("/attributes/COLOR_0").and_then(whole);
    let colors = colors.and_then(|index| context.document.read_colors(index).ok());
    let material = source.get("material").and_then(whole);
    let glow = materials.glow_of(lit.object);
    let set = vertices::add_light(builder, &mut primitive, lit, context.style, colors.as_deref(), glow);
    let single_sided = context.single_sided;
    if let Some(material) = materials.lit(builder, material, lit, set, single_sided) {
        primitive.insert("material".into(), material.into());
    }
    Ok(Value::Object(primitive))
}

/// A primitive without the extension that held its compressed form.
fn without_packing(source: &Value) -> Value {
    let mut copy = source.clone();
    remove_extensions(&mut copy);
    copy
}

fn remove_extensions(json: &mut Value) {
    let Some(object) = json.as_object_mut() else { return };
    if let Some(extensions) = object.get_mut("extensions").and_then(Value::as_object_mut) {
        extensions.retain(|name, _| !UNPACKED.contains(&name.as_str()));
        if extensions.is_empty() {
            object.remove("extensions");
        }
    }
}

/// Forgets how the source was compressed.
fn unpack(builder: &mut Builder) {
    for name in ["extensionsUsed", "extensionsRequired"] {
        builder.list(name).retain(|name| name.as_str().is_none_or(|name| !UNPACKED.contains(&name)));
    }
    builder.list("bufferViews").iter_mut().for_each(remove_extensions);
    for mesh in builder.list("meshes") {
        if let Some(parts) = mesh.get_mut("primitives").and_then(Value::as_array_mut) {
            parts.iter_mut().for_each(remove_extensions);
        }
    }
}

/// Takes the lightmap out with which a model was lit before: beside other light it would be shown, too. Light at vertices is not copied
/// ([`vertices`]).
fn forget_light(builder: &mut Builder) {
    for material in builder.list("materials").iter_mut().filter_map(Value::as_object_mut) {
        lamps::remove(material, "MOZ_lightmap");
    }
    for name in ["extensionsUsed", "extensionsRequired"] {
        builder.list(name).retain(|name| name != "MOZ_lightmap");
    }
}

/// An instance of EXT_mesh_gpu_instancing.
struct Instance {
    /// `translation`, `rotation`, `scale` of its node.
    json: Map<String, Value>,
    mirrored: bool,
}

fn instances(document: &Document, node: &Value) -> Result<Option<Vec<Instance>>, WriteError> {
    let Some(attributes) = node.pointer("/extensions/EXT_mesh_gpu_instancing/attributes") else { return Ok(None) };
    let index = |name: &str| attributes.get(name).and_then(whole);
    let mut lists: Vec<(&str, Vec<Value>)> = Vec::new();
    let mut mirrored = Vec::new();
    if let Some(index) = index("TRANSLATION") {
        lists.push(("translation", document.read_vec3(index)?.iter().map(|t| json!(t.to_array())).collect()));
    }
    if let Some(index) = index("ROTATION") {
        let unit = |r: &glam::Vec4| json!(r.as_dvec4().normalize_or(glam::DVec4::W).to_array().map(|x| x as f32));
        lists.push(("rotation", document.read_vec4(index)?.iter().map(unit).collect()));
    }
    if let Some(index) = index("SCALE") {
        let scales = document.read_vec3(index)?;
        mirrored = scales.iter().map(|s| s.element_product() < 0.0).collect();
        lists.push(("scale", scales.iter().map(|s| json!(s.to_array())).collect()));
    }
    let count = lists.iter().map(|(_, list)| list.len()).min().unwrap_or(0);
    let instance = |i: usize| Instance {
        json: lists.iter().filter_map(|(name, list)| Some(((*name).to_owned(), list.get(i)?.clone()))).collect(),
        mirrored: mirrored.get(i).copied().unwrap_or(false),
    };
    Ok(Some((0..count).map(instance).collect()))
}

/// Hands the meshes to a node: its own, or one child for each instance.
fn place(builder: &mut Builder, node: usize, meshes: &[usize], instances: Option<&[Instance]>) {
    let Some(instances) = instances else {
        if let (Some(json), Some(&mesh)) = (builder.list("nodes").get_mut(node), meshes.first()) {
            json["mesh"] = mesh.into();
        }
        return;
    };
    let weights = builder.list("nodes").get(node).and_then(|json| json.get("weights").cloned());
    let mut children = Vec::new();
    for (index, (&mesh, instance)) in meshes.iter().zip(instances).enumerate() {
        let mut child = instance.json.clone();
        child.insert("name".into(), format!("instance {index}").into());
        child.insert("mesh".into(), mesh.into());
        if let Some(weights) = &weights {
            child.insert("weights".into(), weights.clone());
        }
        children.push(Value::from(builder.push("nodes", Value::Object(child))));
    }
    let Some(json) = builder.list("nodes").get_mut(node).and_then(Value::as_object_mut) else { return };
    json.remove("mesh");
    json.remove("weights");
    if let Some(extensions) = json.get_mut("extensions").and_then(Value::as_object_mut) {
        extensions.remove("EXT_mesh_gpu_instancing");
        if extensions.is_empty() {
            json.remove("extensions");
        }
    }
    let all = json.entry("children").or_insert_with(|| json!([]));
    if let Some(all) = all.as_array_mut() {
        all.extend(children);
    }
}

/// Pictures from other files move into this one; once, however many images name them.
fn embed_pictures(builder: &mut Builder, document: &Document) {
    let mut known = BTreeMap::new();
    for (index, picture) in document.images.iter().enumerate() {
        let outside = builder.list("images").get(index).is_some_and(|json| json.get("uri").is_some());
        let (true, Some(picture)) = (outside, picture) else { continue };
        let view = *known.entry(picture.bytes.place()).or_insert_with(|| builder.view(&picture.bytes, Target::None));
        if let Some(json) = builder.list("images").get_mut(index).and_then(Value::as_object_mut) {
            json.remove("uri");
            json.insert("bufferView".into(), view.into());
            json.insert("mimeType".into(), picture.mime.clone().into());
        }
    }
}

/// Drops accessors and buffer views that nothing uses any more and copies the bytes of the others, those of equal views
/// once.
fn compact(builder: &mut Builder, document: &Document, old_views: usize) -> Result<(), WriteError> {
    let count = builder.list("accessors").len();
    let known = |name: &Value| name.as_str().is_some_and(|name| WITHOUT_ACCESSORS.contains(&name));
    let mut used = vec![!builder.list("extensionsUsed").iter().all(known); count];
    accessors(&mut builder.json, &mut |index| {
        if let Some(used) = used.get_mut(*index) {
            *used = true;
        }
    });
    let new = renumber(&used);
    accessors(&mut builder.json, &mut |index| *index = new.get(*index).copied().unwrap_or(*index));
    keep(builder.list("accessors"), &used);

    let mut used = vec![false; builder.list("bufferViews").len()];
    for (_, value) in builder.json.iter_mut().filter(|(name, _)| *name != "extras") {
        indices(value, "bufferView", &mut |index| {
            if let Some(used) = used.get_mut(*index) {
                *used = true;
            }
        });
    }
    let mut known = BTreeMap::new();
    for (index, _) in used.iter().enumerate().take(old_views).filter(|(_, used)| **used) {
        let (bytes, _) = document.view(index)?;
        let length = bytes.len();
        let offset = *known.entry((bytes.as_ptr(), length)).or_insert_with(|| builder.append(bytes));
        if let Some(view) = builder.list("bufferViews").get_mut(index) {
            view["buffer"] = 0.into();
            view["byteOffset"] = offset.into();
            view["byteLength"] = length.into();
        }
    }
    let new = renumber(&used);
    for (_, value) in builder.json.iter_mut().filter(|(name, _)| *name != "extras") {
        indices(value, "bufferView", &mut |index| *index = new.get(*index).copied().unwrap_or(*index));
    }
    keep(builder.list("bufferViews"), &used);
    Ok(())
}

/// The index that each one kept will have.
pub(super) fn renumber(used: &[bool]) -> Vec<usize> {
    used.iter()
        .scan(0, |next, &used| {
            let index = *next;
            *next += usize::from(used);
            Some(index)
        })
        .collect()
}

pub(super) fn keep(list: &mut Vec<Value>, used: &[bool]) {
    let mut used = used.iter();
    list.retain(|_| used.next().copied().unwrap_or(true));
}

/// Visits every index of an accessor.
fn accessors(json: &mut Map<String, Value>, visit: &mut dyn FnMut(&mut usize)) {
    let mut one = |value: &mut Value| {
        if let Some(mut index) = whole(value) {
            visit(&mut index);
            *value = index.into();
        }
    };
    fn all<'a>(json: &'a mut Value, name: &str) -> impl Iterator<Item = &'a mut Value> {
        json.get_mut(name).and_then(Value::as_array_mut).into_iter().flatten()
    }
    fn fields(json: &mut Value, one: &mut dyn FnMut(&mut Value)) {
        json.as_object_mut().into_iter().flat_map(|map| map.values_mut()).for_each(one);
    }
    let lists = ["meshes", "skins", "animations", "nodes"];
    for (name, list) in json.iter_mut().filter(|(name, _)| lists.contains(&name.as_str())) {
        for item in list.as_array_mut().into_iter().flatten() {
            match name.as_str() {
                "meshes" => {
                    for primitive in all(item, "primitives") {
                        primitive.get_mut("attributes").into_iter().for_each(|a| fields(a, &mut one));
                        primitive.get_mut("indices").into_iter().for_each(&mut one);
                        all(primitive, "targets").for_each(|target| fields(target, &mut one));
                    }
                }
                "skins" => item.get_mut("inverseBindMatrices").into_iter().for_each(&mut one),
                "animations" => {
                    for sampler in all(item, "samplers") {
                        sampler.get_mut("input").into_iter().for_each(&mut one);
                        sampler.get_mut("output").into_iter().for_each(&mut one);
                    }
                }
                _ => {
                    let instancing = item.pointer_mut("/extensions/EXT_mesh_gpu_instancing/attributes");
                    instancing.into_iter().for_each(|a| fields(a, &mut one));
                }
            }
        }
    }
}

/// Visits every index of one name, such as `bufferView`, wherever it stands; extras are the author's.
pub(super) fn indices(json: &mut Value, name: &str, visit: &mut dyn FnMut(&mut usize)) {
    match json {
        Value::Array(list) => list.iter_mut().for_each(|item| indices(item, name, visit)),
        Value::Object(map) => {
            for (own, value) in map.iter_mut().filter(|(own, _)| *own != "extras") {
                match whole(value).filter(|_| own == name) {
                    Some(mut index) => {
                        visit(&mut index);
                        *value = index.into();
                    }
                    None => indices(value, name, visit),
                }
            }
        }
        _ => {}
    }
}

/// Says who wrote the file and which extensions are left.
fn finish_names(builder: &mut Builder) {
    let instancing = |node: &Value| node.pointer("/extensions/EXT_mesh_gpu_instancing").is_some();
    if !builder.list("nodes").iter().any(instancing) {
        for name in ["extensionsUsed", "extensionsRequired"] {
            builder.list(name).retain(|name| name != "EXT_mesh_gpu_instancing");
        }
    }
    let asset = builder.json.entry("asset").or_insert_with(|| json!({ "version": "2.0" }));
    if let Some(asset) = asset.as_object_mut() {
        asset.insert("generator".into(), super::plain::GENERATOR.into());
    }
}
