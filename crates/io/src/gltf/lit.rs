//! A model that was lit before carries its light: in a lightmap, at its vertices, or, unlit, in their colours. Lightmaps and light
//! at vertices are not read, unlit colours are taken for paint: light is computed anew, and who opens such a model is told. Its lamps are where [`gltf_out`](crate::gltf_out) put them aside, in the
//! `extras` of their nodes, so that they shine again ([`super::light`]); a sky is nowhere in a glTF.

use super::Document;
use super::json::{list, text, whole};
use radiosity_scene::Faults;
use serde_json::Value;

/// Warns of light that is not read; `lamps` were found put aside.
pub(crate) fn warn(document: &Document, lamps: usize, file: &str, faults: &mut Faults) {
    let materials = list(&document.json, "materials");
    let primitives = || list(&document.json, "meshes").iter().flat_map(|mesh| list(mesh, "primitives"));
    let has = |primitive: &Value, name: &str| primitive.pointer(&format!("/attributes/{name}")).is_some();
    let is_unlit = |primitive: &Value| {
        let material = primitive.get("material").and_then(whole).and_then(|index| materials.get(index));
        material.is_some_and(|material| material.pointer("/extensions/KHR_materials_unlit").is_some())
    };
    let by_us = document.json.get("asset").is_some_and(|asset| text(asset, "generator").starts_with("radiosity "));
    let again = match lamps {
        0 => "light is computed anew".to_owned(),
        1 => "light is computed anew, and the lamp that was put aside in it shines again".to_owned(),
        _ => format!("light is computed anew, and {lamps} lamps that were put aside in it shine again"),
    };
    let sky = "a sky is in no glTF: where it was lit by one, give --sky again";
    let (what, hint) = if materials.iter().any(|m| m.pointer("/extensions/MOZ_lightmap").is_some()) {
        (format!("carries a lightmap (MOZ_lightmap), which is not used: {again}"), sky)
    } else if primitives().any(|primitive| has(primitive, "_IRRADIANCE")) {
        (format!("carries light at its vertices (_IRRADIANCE), which is not used: {again}"), sky)
    } else if by_us && primitives().any(|primitive| has(primitive, "COLOR_0") && is_unlit(primitive)) {
        let what =
            "carries light as the colours of its vertices (--unlit), which are taken for paint: it will be wrong";
        (what.to_owned(), "open the model that it was made from")
    } else {
        return;
    };
    faults.warning(file, what, hint);
}
