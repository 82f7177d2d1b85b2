//! Lamps whose light has been written shine no second time: KHR_lights_punctual leaves the nodes that were lit. The
//! light's definition stays there as `extras.KHR_lights_punctual`, for whoever wants the lamp back, and so do the node,
//! its name and what animates it. A scene that is written to be lit later has them where they were. Our own reader takes those that
//! were put aside, as it computes all light anew.

use super::glb::Builder;
use crate::gltf::Document;
use crate::gltf::json::{list, whole};
use crate::gltf::nodes::placed;
use glam::{DMat4, DQuat, DVec3};
use radiosity_scene::{Faults, PointLight, PointLightKind};
use serde_json::{Map, Value, json};

const NAME: &str = "KHR_lights_punctual";

/// Takes the lamps out of the nodes of the scene that was lit; lamps of other scenes stay.
pub(super) fn take_out(builder: &mut Builder, document: &Document) {
    let lights = document.json.pointer(&format!("/extensions/{NAME}")).map_or(&[][..], |own| list(own, "lights"));
    // What is wrong with the nodes was said when they were read.
    for at in placed(document, "", &mut Faults::default()) {
        let Some(node) = builder.list("nodes").get_mut(at.node).and_then(Value::as_object_mut) else { continue };
        let Some(lamp) = remove(node, NAME) else { continue };
        let definition = lamp.get("light").and_then(whole).and_then(|index| lights.get(index));
        let extras = node.entry("extras").or_insert_with(|| json!({}));
        if let (Some(definition), Some(extras)) = (definition, extras.as_object_mut()) {
            extras.insert(NAME.into(), definition.clone());
        }
    }

    let is_lamp = |node: &Value| node.pointer(&format!("/extensions/{NAME}")).is_some();
    if !builder.list("nodes").iter().any(is_lamp) {
        remove(&mut builder.json, NAME);
        for name in ["extensionsUsed", "extensionsRequired"] {
            builder.list(name).retain(|name| name != NAME);
        }
    }
}

/// Writes lamps into a file of a scene that is yet to be lit; their nodes come back.
pub(super) fn put_in(builder: &mut Builder, lamps: &[PointLight]) -> Vec<usize> {
    if lamps.is_empty() {
        return Vec::new();
    }
    builder.uses(NAME);
    let definitions: Vec<Value> = lamps.iter().map(definition).collect();
    let extensions = builder.json.entry("extensions").or_insert_with(|| json!({}));
    if let Some(extensions) = extensions.as_object_mut() {
        extensions.insert(NAME.into(), json!({ "lights": definitions }));
    }
    let light = |index| ("extensions", json!({ NAME: { "light": index } }));
    lamps.iter().enumerate().map(|(index, lamp)| node(builder, lamp, light(index))).collect()
}

/// Writes lamps whose light is in the surfaces of the file, for whoever wants them back; their nodes come back.
pub(super) fn put_aside(builder: &mut Builder, lamps: &[PointLight]) -> Vec<usize> {
    lamps.iter().map(|lamp| node(builder, lamp, ("extras", json!({ NAME: definition(lamp) })))).collect()
}

/// A lamp as the extension defines it.
fn definition(lamp: &PointLight) -> Value {
    // Colours end at 1; the intensity carries the rest.
    let intensity = lamp.intensity.iter().copied().fold(0.0, f32::max);
    let scale = if intensity > 0.0 { intensity } else { 1.0 };
    let kind = match lamp.kind {
        PointLightKind::Point => "point",
        PointLightKind::Spot { .. } => "spot",
        PointLightKind::Directional => "directional",
    };
    let mut definition = json!({
        "name": lamp.name, "type": kind, "intensity": intensity, "color": lamp.intensity.map(|i| i / scale),
    });
    if let PointLightKind::Spot { inner, outer } = lamp.kind {
        definition["spot"] = json!({ "innerConeAngle": inner, "outerConeAngle": outer });
    }
    if let Some(range) = lamp.range.filter(|_| lamp.kind != PointLightKind::Directional) {
        definition["range"] = json!(range);
    }
    definition
}

/// A node where a lamp stands, with what is said of it there.
fn node(builder: &mut Builder, lamp: &PointLight, (name, own): (&str, Value)) -> usize {
    // Lamps shine along −Z of their nodes; the place of parallel light means nothing.
    let turn = DQuat::from_rotation_arc(DVec3::NEG_Z, lamp.direction.try_normalize().unwrap_or(DVec3::NEG_Z));
    let place = if lamp.position.is_finite() { lamp.position } else { DVec3::ZERO };
    let matrix = DMat4::from_rotation_translation(turn, place).to_cols_array();
    builder.push("nodes", json!({ "name": lamp.name, "matrix": matrix, name: own }))
}

/// Removes an extension from an object, and `extensions` where it was the last.
pub(super) fn remove(json: &mut Map<String, Value>, name: &str) -> Option<Value> {
    let extensions = json.get_mut("extensions")?.as_object_mut()?;
    let own = extensions.remove(name);
    if extensions.is_empty() {
        json.remove("extensions");
    }
    own
}
