//! Which glTF extensions we know, so that a file that needs another one is refused by name.

use super::Document;
use super::json::list;
use radiosity_scene::Faults;
use serde_json::Value;

/// Read and honoured.
const READ: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_emissive_strength",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_transform",
];

/// Change nothing that diffuse light depends on, or only how an animation moves: passed over.
const HARMLESS: &[&str] = &[
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_dispersion",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_variants",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    "KHR_texture_basisu",
    "KHR_xmp_json_ld",
];

/// Change how light passes through a surface; the surface is taken as opaque, or as a sheet without thickness, and says so
/// in a note of its own.
const APPROXIMATED: &[&str] = &["KHR_materials_transmission", "KHR_materials_volume"];

/// Reports every required extension that is not known.
pub(crate) fn check(document: &Document, file: &str, faults: &mut Faults) {
    for name in list(&document.json, "extensionsRequired") {
        let name = name.as_str().unwrap_or_default();
        if ![READ, HARMLESS, APPROXIMATED].iter().any(|known| known.contains(&name)) {
            faults.error(
                format!("{file}: extensionsRequired"),
                format!("the extension '{name}' is not supported"),
                "export without it",
            );
        }
    }
    if list(&document.json, "extensionsUsed").iter().any(|name| name == &Value::from("EXT_lights_ies")) {
        faults.note(file, "EXT_lights_ies is not read; its lights are left out", "use KHR_lights_punctual");
    }
}
