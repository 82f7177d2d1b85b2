//! The tree of nodes: where each stands in the world.

use super::Document;
use super::json::{list, numbers, shown, text, whole};
use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3};
use radiosity_scene::Faults;
use serde_json::Value;

/// A node of the chosen scene.
pub(crate) struct Placed {
    pub node: usize,
    pub world: DAffine3,
}

/// The nodes of the default scene, else of scene 0, else all of them, parents before children, in the order of the file.
/// A node that is met twice is an error: glTF nodes form trees, and a loop would have no end.
pub(crate) fn placed(document: &Document, file: &str, faults: &mut Faults) -> Vec<Placed> {
    let nodes = list(&document.json, "nodes");
    let mut seen = vec![false; nodes.len()];
    let mut out = Vec::new();

    // A stack of nodes to visit, so that no depth of nesting can exhaust the thread's own stack.
    let mut stack: Vec<(usize, DAffine3)> =
        roots(document, file, faults).into_iter().rev().map(|root| (root, DAffine3::IDENTITY)).collect();
    while let Some((index, parent)) = stack.pop() {
        let (Some(json), Some(seen)) = (nodes.get(index), seen.get_mut(index)) else {
            faults.error(file, format!("node {index} is named, but there are only {}", nodes.len()), "export again");
            continue;
        };
        let place = format!("{file}: nodes[{index}]");
        if std::mem::replace(seen, true) {
            faults.error(
                place,
                "is reached twice: it has two parents or is its own ancestor",
                "nodes must form a tree",
            );
            continue;
        }
        let hidden = json
            .pointer("/extensions/KHR_node_visibility/visible")
            .is_some_and(|visible| visible.as_bool() == Some(false));
        if hidden {
            faults.note(place, "is hidden; it and its children are left out", "");
            continue;
        }
        let world = parent * local(json, &place, faults);
        if !world.is_finite() {
            faults.error(&place, "its place in the world is not finite", "check its scale and translation");
            continue;
        }
        out.push(Placed { node: index, world });
        for child in list(json, "children").iter().rev() {
            match whole(child) {
                Some(child) => stack.push((child, world)),
                None => faults.error(&place, format!("child {}", shown(Some(child))), "export the model again"),
            }
        }
    }
    out
}

fn roots(document: &Document, file: &str, faults: &mut Faults) -> Vec<usize> {
    let scenes = list(&document.json, "scenes");
    let chosen = document.json.get("scene").map(whole);
    let scene = match chosen {
        Some(index) => {
            let scene = index.and_then(|index| scenes.get(index));
            if scene.is_none() {
                let what = format!("scene {} of {}", shown(document.json.get("scene")), scenes.len());
                faults.error(file, what, "export the model again");
                return Vec::new();
            }
            scene
        }
        None => scenes.first(),
    };
    let nodes = list(&document.json, "nodes");
    match scene {
        Some(scene) => list(scene, "nodes").iter().filter_map(whole).collect(),
        None => {
            let mut is_child = vec![false; nodes.len()];
            for child in nodes.iter().flat_map(|node| list(node, "children")).filter_map(whole) {
                if let Some(slot) = is_child.get_mut(child) {
                    *slot = true;
                }
            }
            (0..nodes.len()).filter(|&node| !is_child.get(node).copied().unwrap_or(false)).collect()
        }
    }
}

/// Parent from node: a matrix, or translation × rotation × scale.
fn local(json: &Value, place: &str, faults: &mut Faults) -> DAffine3 {
    let mut read = |name: &str, good: bool| {
        if !good {
            faults.error(place, format!("{name} is {}", shown(json.get(name))), "export the model again");
        }
    };
    if let Some(matrix) = json.get("matrix") {
        let matrix = numbers::<16>(matrix);
        read("matrix", matrix.is_some());
        // The bottom row of an affine matrix carries nothing.
        return DAffine3::from_mat4(matrix.map_or(DMat4::IDENTITY, |m| DMat4::from_cols_array(&m)));
    }
    let vector =
        |name: &str, default: DVec3| json.get(name).map_or(Some(default), |v| numbers::<3>(v).map(DVec3::from));
    let translation = vector("translation", DVec3::ZERO);
    let scale = vector("scale", DVec3::ONE);
    let rotation = json.get("rotation").map_or(Some(DQuat::IDENTITY), |v| unit_quaternion(numbers::<4>(v)?));
    read("translation", translation.is_some());
    read("rotation", rotation.is_some());
    read("scale", scale.is_some());
    DAffine3::from_scale_rotation_translation(
        scale.unwrap_or(DVec3::ONE),
        rotation.unwrap_or(DQuat::IDENTITY),
        translation.unwrap_or(DVec3::ZERO),
    )
}

/// A quaternion of length 1; `None` where it has no direction.
pub(crate) fn unit_quaternion(xyzw: [f64; 4]) -> Option<DQuat> {
    let length = xyzw.iter().map(|x| x * x).sum::<f64>().sqrt();
    (length.is_normal()).then(|| DQuat::from_array(xyzw.map(|x| x / length)))
}

/// Rotation and place without scale or shear, as cameras and lights take them.
pub(crate) fn rigid(world: &DAffine3) -> Option<DMat4> {
    let [x, y, z] = [world.matrix3.x_axis, world.matrix3.y_axis, world.matrix3.z_axis];
    let z = z.try_normalize()?;
    let x = (x - z * x.dot(z)).try_normalize()?;
    // A mirrored node must not mirror the picture; y is kept on its own side as far as a rotation can.
    let cross = z.cross(x);
    let (x, y) = if cross.dot(y) >= 0.0 { (x, cross) } else { (-x, -cross) };
    Some(DMat4::from_mat3_translation(DMat3::from_cols(x, y, z), world.translation))
}

/// What people call a node: its name, its mesh's name, or its number.
pub(crate) fn name_of(document: &Document, node: usize, mesh: Option<usize>) -> String {
    let named = |kind: &str, index: usize| {
        list(&document.json, kind).get(index).map(|json| text(json, "name")).filter(|name| !name.is_empty())
    };
    named("nodes", node).or_else(|| named("meshes", mesh?)).map_or_else(|| format!("node {node}"), str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn walk(json: Value) -> (Vec<Placed>, Faults) {
        let mut faults = Faults::default();
        let document = Document { json, ..Document::default() };
        (placed(&document, "t", &mut faults), faults)
    }

    #[test]
    fn transforms_multiply_down_the_tree() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let (placed, faults) = walk(json!({"nodes": [
            {"children": [1], "translation": [1, 2, 3], "scale": [2, 2, 2]},
            {"rotation": [0, 0, half, half], "children": [2]},
            {"matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, 5,0,0,1]}]}));
        assert!(faults.0.is_empty(), "{faults}");
        assert_eq!(placed.iter().map(|p| p.node).collect::<Vec<_>>(), [0, 1, 2]);
        let point = placed[2].world.transform_point3(DVec3::ZERO);
        assert!((point - DVec3::new(1.0, 12.0, 3.0)).length() < 1e-12, "{point}");
    }

    #[test]
    fn the_default_scene_is_taken_else_the_first_else_all_roots() {
        let nodes = json!([{}, {"children": [2]}, {}]);
        let seen = |extra: Value| {
            let mut json = json!({ "nodes": nodes });
            json.as_object_mut().unwrap().extend(extra.as_object().unwrap().clone());
            walk(json).0.iter().map(|p| p.node).collect::<Vec<_>>()
        };
        assert_eq!(seen(json!({"scene": 1, "scenes": [{"nodes": [0]}, {"nodes": [1]}]})), [1, 2]);
        assert_eq!(seen(json!({"scenes": [{"nodes": [0]}, {"nodes": [1]}]})), [0]);
        assert_eq!(seen(json!({})), [0, 1, 2]);
    }

    #[test]
    fn loops_and_depth_end() {
        assert!(
            walk(json!({"scenes": [{"nodes": [0]}], "nodes": [{"children": [1]}, {"children": [0]}]})).1.has_errors()
        );
        assert!(walk(json!({"scenes": [{"nodes": [0]}], "nodes": [{"children": [7]}]})).1.has_errors());
        let deep: Vec<Value> =
            (0..200_000).map(|i| json!({"children": if i < 199_999 { vec![i + 1] } else { vec![] }})).collect();
        let (placed, faults) = walk(json!({"scenes": [{"nodes": [0]}], "nodes": deep}));
        assert!(placed.len() == 200_000 && faults.0.is_empty());
    }

    #[test]
    fn a_rigid_frame_is_a_rotation_whatever_the_scale() {
        for scale in [DVec3::new(2.0, 0.5, 3.0), DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, 1.0, -4.0)] {
            let world = DAffine3::from_scale_rotation_translation(scale, DQuat::from_rotation_y(0.7), DVec3::ONE);
            let frame = DMat3::from_mat4(rigid(&world).unwrap());
            assert!((frame.determinant() - 1.0).abs() < 1e-12);
            assert!((frame * frame.transpose() - DMat3::IDENTITY).to_cols_array().iter().all(|x| x.abs() < 1e-12));
        }
        assert!(rigid(&DAffine3::from_scale(DVec3::ZERO)).is_none());
    }
}
