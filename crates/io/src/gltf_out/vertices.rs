//! Vertices of a lit primitive: every attribute of the source, interpolated.

use super::glb::Builder;
use super::{Light, LitPrimitive, LitVertex, Style, WriteError, skin};
use crate::gltf::Document;
use crate::gltf::json::{list, whole};
use radiosity_scene::display::tone_map;
use serde_json::{Map, Value, json};

/// How an attribute behaves between vertices.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Plain,
    /// Unit vector, turned round on back sides; a fourth component is a sign.
    Direction,
    /// Displacement of a direction (morph targets).
    Turning,
}

fn kind(name: &str, morph: bool) -> Kind {
    match name {
        "NORMAL" | "TANGENT" if morph => Kind::Turning,
        "NORMAL" | "TANGENT" => Kind::Direction,
        _ => Kind::Plain,
    }
}

/// Values of the new vertices; `source` has `width` components per vertex.
fn interpolate(vertices: &[LitVertex], source: &[f32], width: usize, kind: Kind, flipped: bool) -> Vec<f32> {
    let at = |corner: u32, k: usize| source.get(corner as usize * width + k).copied().unwrap_or(0.0);
    let mut out = Vec::with_capacity(vertices.len() * width);
    for vertex in vertices {
        let near = nearest(vertex);
        let start = out.len();
        let exact = vertex.weights[1..].iter().all(|&w| w == 0.0) && vertex.weights[0] == 1.0;
        for k in 0..width {
            out.push(if exact || kind == Kind::Direction && k == 3 {
                at(near, k)
            } else {
                vertex.corners.iter().zip(vertex.weights).map(|(&c, w)| if w == 0.0 { 0.0 } else { w * at(c, k) }).sum()
            });
        }
        if kind == Kind::Direction && width >= 3 {
            let direction = glam::Vec3::from_slice(&out[start..]);
            let own = glam::Vec3::new(at(near, 0), at(near, 1), at(near, 2));
            // Opposite directions cancel: the nearest vertex then decides.
            let unit = direction.try_normalize().or(own.try_normalize()).unwrap_or(glam::Vec3::Z);
            if !exact || !direction.is_normalized() {
                out[start..start + 3].copy_from_slice(&unit.to_array());
            }
        }
        if flipped && matches!(kind, Kind::Direction | Kind::Turning) {
            for v in &mut out[start..] {
                *v = -*v;
            }
        }
    }
    out
}

/// The corner of the largest weight, the first of equal ones.
fn nearest(vertex: &LitVertex) -> u32 {
    let mut best = 0;
    for k in 1..3 {
        if vertex.weights[k] > vertex.weights[best] {
            best = k;
        }
    }
    vertex.corners[best]
}

/// Interpolates the attributes and morph targets of a source primitive into `primitive`, which is then complete but
/// for its material.
pub(super) fn from_source(
    builder: &mut Builder,
    document: &Document,
    source: &Value,
    primitive: &mut Map<String, Value>,
    lit: &LitPrimitive,
    mirrored: bool,
) -> Result<(), WriteError> {
    let mut attributes = Map::new();
    let empty = Map::new();
    let own = source.get("attributes").and_then(Value::as_object).unwrap_or(&empty);
    for (name, accessor) in own {
        let Some(index) = whole(accessor) else { continue };
        // Skins are interpolated as a whole, below; light of before is no more.
        if name.starts_with("JOINTS_") || name.starts_with("WEIGHTS_") || name == "_IRRADIANCE" {
            continue;
        }
        let written = attribute(builder, document, index, lit, name, false);
        match written {
            Ok(accessor) => {
                attributes.insert(name.clone(), accessor.into());
            }
            // Positions must be; anything else was reported when the file was read, and is left out as there.
            Err(error) if name == "POSITION" => return Err(error.into()),
            Err(_) => {}
        }
    }
    skin::interpolate(builder, document, own, &lit.vertices, &mut attributes);
    let mut targets = Vec::new();
    for target in list(source, "targets") {
        let mut own = Map::new();
        for (name, accessor) in target.as_object().unwrap_or(&empty) {
            if let Some(index) = whole(accessor) {
                own.insert(name.clone(), attribute(builder, document, index, lit, name, true)?.into());
            }
        }
        targets.push(Value::Object(own));
    }
    if !targets.is_empty() {
        primitive.insert("targets".into(), targets.into());
    }
    primitive.insert("attributes".into(), Value::Object(attributes));
    triangles(builder, primitive, lit, mirrored);
    Ok(())
}

fn attribute(
    builder: &mut Builder,
    document: &Document,
    index: usize,
    lit: &LitPrimitive,
    name: &str,
    morph: bool,
) -> Result<usize, crate::gltf::AccessorError> {
    let (values, width) = document.read_components(index, &[1, 2, 3, 4])?;
    let values = interpolate(&lit.vertices, &values, width, kind(name, morph), lit.flipped);
    Ok(builder.floats(&values, width, name == "POSITION"))
}

/// One attribute of a scene's own vertices.
pub(super) fn from_scene(builder: &mut Builder, lit: &LitPrimitive, name: &str, values: &[f32], width: usize) -> usize {
    let values = interpolate(&lit.vertices, values, width, kind(name, false), lit.flipped);
    builder.floats(&values, width, name == "POSITION")
}

/// Writes the indices; a mirrored node turns them once more.
pub(super) fn triangles(builder: &mut Builder, primitive: &mut Map<String, Value>, lit: &LitPrimitive, mirrored: bool) {
    let indices = match mirrored {
        true => builder.indices(&lit.triangles.iter().map(|&[a, b, c]| [a, c, b]).collect::<Vec<_>>()),
        false => builder.indices(&lit.triangles),
    };
    primitive.insert("indices".into(), indices.into());
    primitive.insert("mode".into(), 4.into());
}

/// How unlit vertices of a material make their colour: tint × reflected + emissive.
#[derive(Clone, Copy)]
pub(super) struct Glow {
    /// Factor on reflected light, where the material's own base colour does not multiply it.
    pub tint: [f32; 3],
    /// Emitted luminance, cd/m² per band.
    pub emissive: [f32; 3],
}

/// Adds the light to the attributes of a primitive; returns the texture coordinate set of its lightmap.
pub(super) fn add_light(
    builder: &mut Builder,
    primitive: &mut Map<String, Value>,
    lit: &LitPrimitive,
    style: &Style,
    colors: Option<&[[f32; 4]]>,
    glow: Glow,
) -> Option<usize> {
    let attributes = primitive.get_mut("attributes").and_then(Value::as_object_mut)?;
    match (&lit.light, style) {
        (Light::Lightmap { uv, .. }, _) => {
            let flat: Vec<f32> = uv.iter().flatten().copied().collect();
            let accessor = builder.floats(&flat, 2, false);
            // Sets must be numbered without gaps, and readers expect the lightmap in set 1: where the source has no
            // set 0, both are the same numbers.
            attributes.entry("TEXCOORD_0").or_insert_with(|| accessor.into());
            let set = (1..).find(|set| !attributes.contains_key(&format!("TEXCOORD_{set}"))).unwrap_or(1);
            attributes.insert(format!("TEXCOORD_{set}"), accessor.into());
            return Some(set);
        }
        (Light::Vertex { irradiance }, Style::Unlit { exposure }) => {
            let mut values = Vec::with_capacity(4 * irradiance.len());
            for (vertex, e) in lit.vertices.iter().zip(irradiance) {
                let own = colors.map(|colors| {
                    let flat: [f32; 4] = std::array::from_fn(|k| {
                        let at = |c: u32| colors.get(c as usize).map_or(1.0, |color| color[k]);
                        vertex.corners.iter().zip(vertex.weights).map(|(&c, w)| w * at(c)).sum()
                    });
                    flat
                });
                let own = own.unwrap_or([1.0; 4]);
                values.extend(tone_map(std::array::from_fn(|band| {
                    let reflected = glow.tint[band] * own[band] * e[band] / std::f32::consts::PI;
                    exposure * (reflected + glow.emissive[band])
                })));
                values.push(own[3].clamp(0.0, 1.0));
            }
            let accessor = builder.floats(&values, 4, false);
            attributes.insert("COLOR_0".into(), accessor.into());
        }
        (Light::Vertex { irradiance }, _) => {
            let flat: Vec<f32> = irradiance.iter().flatten().copied().collect();
            attributes.insert("_IRRADIANCE".into(), json!(builder.floats(&flat, 3, false)));
        }
        (Light::None, _) => {}
    }
    None
}
