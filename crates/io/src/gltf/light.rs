//! Lights without area (KHR_lights_punctual) and cameras, where their nodes stand.

use super::Document;
use super::json::{list, number, numbers, shown, text, whole};
use super::nodes::{Placed, name_of, rigid};
use glam::DVec3;
use radiosity_scene::{Camera, Faults, PointLight, PointLightKind, Projection};
use serde_json::Value;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Lights of the placed nodes, in their order, and how many of them were put aside when the model was lit: they shine again, as all
/// light is computed anew. They shine along −Z of their node, whose scale is ignored.
pub(crate) fn lights(
    document: &Document,
    placed: &[Placed],
    file: &str,
    faults: &mut Faults,
) -> (Vec<PointLight>, usize) {
    let all = document.json.pointer("/extensions/KHR_lights_punctual").map_or(&[][..], |e| list(e, "lights"));
    let mut out = Vec::new();
    let mut put_aside = 0;
    for at in placed {
        let Some(node) = list(&document.json, "nodes").get(at.node) else { continue };
        // Extras are anybody's: what looks otherwise is no lamp of ours, and no fault.
        let is_lamp = |own: &&Value| ["point", "spot", "directional"].contains(&text(own, "type"));
        let aside = node.pointer("/extras/KHR_lights_punctual").filter(is_lamp);
        let (json, place) = match (node.pointer("/extensions/KHR_lights_punctual/light"), aside) {
            (Some(index), _) => {
                let Some(json) = whole(index).and_then(|index| all.get(index)) else {
                    let what = format!("light {} of {}", shown(Some(index)), all.len());
                    faults.error(format!("{file}: nodes[{}]", at.node), what, "export the model again");
                    continue;
                };
                (json, format!("{file}: extensions.KHR_lights_punctual.lights[{}]", shown(Some(index))))
            }
            (None, Some(json)) => {
                put_aside += 1;
                (json, format!("{file}: nodes[{}].extras.KHR_lights_punctual", at.node))
            }
            (None, None) => continue,
        };
        if let Some(mut light) = light(json, at, &place, faults) {
            light.name = match text(json, "name") {
                "" => name_of(document, at.node, None),
                name => name.to_owned(),
            };
            out.push(light);
        }
    }
    (out, put_aside)
}

fn light(json: &Value, at: &Placed, place: &str, faults: &mut Faults) -> Option<PointLight> {
    let given = |name: &str, default: f64| json.get(name).map_or(Some(default), number);
    let color = json.get("color").map_or(Some([1.0; 3]), numbers::<3>);
    let intensity = given("intensity", 1.0);
    // The same ceiling as for surfaces keeps sums within single precision.
    let strength = color.zip(intensity).map(|(color, intensity)| color.map(|c| c * intensity));
    let Some(strength) = strength.filter(|s| s.iter().all(|x| (0.0..=1e12).contains(x))) else {
        let what = format!("color {}, intensity {}", shown(json.get("color")), shown(json.get("intensity")));
        faults.error(place, what, "both must be numbers of at least 0, their product at most 1e12");
        return None;
    };
    let kind = match text(json, "type") {
        "point" => PointLightKind::Point,
        "directional" => PointLightKind::Directional,
        "spot" => {
            let inner = json.pointer("/spot/innerConeAngle").map_or(Some(0.0), number);
            let outer = json.pointer("/spot/outerConeAngle").map_or(Some(FRAC_PI_4), number);
            match inner.zip(outer) {
                Some((inner, outer)) if 0.0 <= inner && inner <= outer && outer <= FRAC_PI_2 + 1e-9 => {
                    PointLightKind::Spot { inner, outer }
                }
                _ => {
                    faults.error(place, "its cone angles are not 0 <= inner <= outer <= pi/2", "correct them");
                    return None;
                }
            }
        }
        other => {
            faults.error(place, format!("type '{other}'"), "use point, spot or directional");
            return None;
        }
    };
    let direction = at.world.transform_vector3(-DVec3::Z).try_normalize();
    if direction.is_none() && kind != PointLightKind::Point {
        faults.error(place, "its node has no direction", "its scale must not be 0");
        return None;
    }
    Some(PointLight {
        name: String::new(),
        kind,
        position: at.world.translation,
        direction: direction.unwrap_or(-DVec3::Z),
        intensity: strength.map(|s| s as f32),
        range: json.get("range").and_then(number).filter(|range| *range > 0.0),
    })
}

/// Cameras of the placed nodes, in their order.
pub(crate) fn cameras(document: &Document, placed: &[Placed], file: &str, faults: &mut Faults) -> Vec<Camera> {
    let all = list(&document.json, "cameras");
    let mut out = Vec::new();
    for at in placed {
        let Some(index) = list(&document.json, "nodes").get(at.node).and_then(|node| node.get("camera")) else {
            continue;
        };
        let json = whole(index).and_then(|index| all.get(index));
        let projection = json.and_then(projection);
        let (Some(json), Some((projection, aspect)), Some(frame)) = (json, projection, rigid(&at.world)) else {
            let what = format!("camera {} cannot be used; left out", shown(Some(index)));
            faults.warning(format!("{file}: nodes[{}]", at.node), what, "correct its angles, or its node's scale");
            continue;
        };
        let name = match text(json, "name") {
            "" => name_of(document, at.node, None),
            name => name.to_owned(),
        };
        out.push(Camera { name, world_from_camera: frame, projection, aspect });
    }
    out
}

fn projection(json: &Value) -> Option<(Projection, Option<f64>)> {
    let positive = |path: &str| json.pointer(path).and_then(number).filter(|x| *x > 0.0);
    match text(json, "type") {
        "perspective" => {
            let vertical_fov = positive("/perspective/yfov").filter(|angle| *angle < PI)?;
            Some((Projection::Perspective { vertical_fov }, positive("/perspective/aspectRatio")))
        }
        "orthographic" => {
            let (x, y) = (positive("/orthographic/xmag")?, positive("/orthographic/ymag")?);
            Some((Projection::Orthographic { half_height: y }, Some(x / y)))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gltf::nodes;
    use serde_json::json;

    #[test]
    fn lights_and_cameras_stand_where_their_nodes_do() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let light = |index: u32| json!({"KHR_lights_punctual": {"light": index}});
        let json = json!({
            "extensions": {"KHR_lights_punctual": {"lights": [
                {"type": "spot", "intensity": 10, "color": [1, 0.5, 0], "range": 4, "spot": {"innerConeAngle": 0.1}},
                {"type": "directional", "name": "sun"}, {"type": "laser"}]}},
            "cameras": [{"type": "perspective", "perspective": {"yfov": 0.5, "aspectRatio": 2}},
                {"type": "orthographic", "orthographic": {"xmag": 3, "ymag": 2}}],
            "nodes": [
                {"extensions": light(0), "translation": [1, 2, 3], "scale": [9, 9, 9], "name": "spot"},
                {"extensions": light(1), "rotation": [-half, 0, 0, half]},
                {"extensions": light(2)}, {"extensions": light(7)},
                {"extras": {"KHR_lights_punctual": {"type": "point", "intensity": 3}}, "translation": [0, 1, 0], "name": "aside"},
                {"extras": {"KHR_lights_punctual": "a remark"}}, {"extras": {"KHR_lights_punctual": {"type": "maser"}}},
                {"camera": 0, "translation": [0, 0, 5], "scale": [2, 2, 2], "name": "eye"}, {"camera": 1}]});
        let document = Document { json, ..Document::default() };
        let mut faults = Faults::default();
        let placed = nodes::placed(&document, "t", &mut faults);
        let (lights, put_aside) = lights(&document, &placed, "t", &mut faults);
        assert_eq!((lights.len(), put_aside), (3, 1));
        assert_eq!((lights[2].name.as_str(), lights[2].position, lights[2].intensity), ("aside", DVec3::Y, [3.0; 3]));
        assert_eq!((lights[0].name.as_str(), lights[0].range), ("spot", Some(4.0)));
        assert_eq!(lights[0].kind, PointLightKind::Spot { inner: 0.1, outer: FRAC_PI_4 });
        assert_eq!((lights[0].position, lights[0].intensity), (DVec3::new(1.0, 2.0, 3.0), [10.0, 5.0, 0.0]));
        assert!((lights[1].direction + DVec3::Y).length() < 1e-12, "{}", lights[1].direction);
        let text = faults.to_string();
        assert!(text.contains("type 'laser'") && text.contains("light 7 of 3") && !text.contains("maser"), "{text}");

        let cameras = cameras(&document, &placed, "t", &mut faults);
        assert_eq!((cameras[0].name.as_str(), cameras[0].aspect), ("eye", Some(2.0)));
        assert_eq!(cameras[0].world_from_camera.determinant(), 1.0);
        assert_eq!(cameras[1].projection, Projection::Orthographic { half_height: 2.0 });
        assert_eq!(cameras[1].aspect, Some(1.5));
    }
}
