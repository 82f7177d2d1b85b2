//! Lamps whose light has been written shine no second time: KHR_lights_punctual leaves the nodes that were lit. The
//! light's definition stays there as `extras.KHR_lights_punctual`, for whoever wants the lamp back, and so do the node,
//! its name and what animates it.

use super::glb::Builder;
use crate::gltf::Document;
use crate::gltf::json::{list, whole};
use crate::gltf::nodes::placed;

use radiosity_scene::Faults;
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

/// Removes an extension from an object, and `extensions` where it was the last.
fn remove(json: &mut Map<String, Value>, name: &str) -> Option<Value> {
    let extensions = json.get_mut("extensions")?.as_object_mut()?;
    let own = extensions.remove(name);
    if extensions.is_empty() {
        json.remove("extensions");
    }
    own
}
