//! The triangles of one primitive in the frame of its mesh.

use super::json::{list, number, shown, whole};
use super::{AccessorError, Document};
use glam::{DVec3, Vec2, Vec3};
use radiosity_scene::Faults;
use serde_json::Value;

/// What a primitive draws: glTF modes that make triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Triangles,
    Strip,
    Fan,
}

/// A primitive as its accessors say, morph targets applied.
#[derive(Clone, Debug, Default)]
pub(crate) struct Geometry {
    pub positions: Vec<DVec3>,
    /// Empty or one per position; not yet unit.
    pub normals: Vec<Vec3>,
    pub uvs: [Vec<Vec2>; 2],
    pub colors: Vec<[f32; 4]>,
    pub triangles: Vec<[u32; 3]>,
    /// Joints and weights by vertex; empty where it has no skin.
    pub influences: Vec<Vec<(u32, f32)>>,
}

/// Numbers of vertices and triangles that reading would give, from the headers alone; `None` where the primitive
/// draws no triangles.
pub(crate) fn size(document: &Document, primitive: &Value) -> Option<[usize; 2]> {
    let mode = mode(primitive).ok().flatten()?;
    let count = |accessor: Option<&Value>| document.accessor(whole(accessor?)?).ok().map(|a| a.count);
    let vertices = count(primitive.pointer("/attributes/POSITION"))?;
    let corners = primitive.get("indices").map_or(Some(vertices), |i| count(Some(i)))?;
    Some([vertices, if mode == Mode::Triangles { corners / 3 } else { corners }])
}

/// `Ok(None)`: points or lines, which have no area.
fn mode(primitive: &Value) -> Result<Option<Mode>, String> {
    Ok(match primitive.get("mode").map_or(Some(4), whole) {
        Some(4) => Some(Mode::Triangles),
        Some(5) => Some(Mode::Strip),
        Some(6) => Some(Mode::Fan),
        Some(0..=3) => None,
        _ => return Err(format!("mode {}", shown(primitive.get("mode")))),
    })
}

/// Reads a primitive; `None` where it draws nothing or cannot be read, which is reported.
/// `weights` are those of its morph targets.
pub(crate) fn read(
    document: &Document,
    primitive: &Value,
    weights: &[f32],
    skinned: bool,
    place: &str,
    faults: &mut Faults,
) -> Option<Geometry> {
    let mode = match mode(primitive) {
        Ok(Some(mode)) => mode,
        Ok(None) => {
            faults.note(place, "points or lines have no area; left out", "");
            return None;
        }
        Err(what) => {
            faults.error(place, what, "modes are 0 to 6");
            return None;
        }
    };
    let null = Value::Null;
    let attributes = primitive.get("attributes").unwrap_or(&null);
    let Some(position) = attributes.get("POSITION") else {
        faults.warning(place, "has no POSITION; left out", "export the model again");
        return None;
    };
    let positions = required(position, |index| document.read_vec3(index), place, "POSITION", faults);
    let indices = match primitive.get("indices") {
        Some(indices) => required(indices, |index| document.read_indices(index), place, "indices", faults).map(Some),
        None => Some(None),
    };
    let (positions, indices) = (positions?, indices?);
    let count = positions.len();

    let mut normals =
        optional(attributes, "NORMAL", count, |i| document.read_vec3(i), place, faults).unwrap_or_default();
    let mut geometry = Geometry {
        uvs: ["TEXCOORD_0", "TEXCOORD_1"].map(|name| {
            optional(attributes, name, count, |i| document.read_vec2(i), place, faults).unwrap_or_default()
        }),
        colors: optional(attributes, "COLOR_0", count, |i| document.read_colors(i), place, faults).unwrap_or_default(),
        triangles: match indices {
            Some(indices) => triangles(mode, indices.len(), |i| indices.get(i).copied()),
            None => triangles(mode, count, |i| u32::try_from(i).ok()),
        },
        positions: positions.iter().map(|p| p.as_dvec3()).collect(),
        ..Geometry::default()
    };
    let corners = primitive.get("indices").and_then(|_| indices_left_over(document, primitive, mode));
    if let Some(left) =
        corners.or_else(|| (mode == Mode::Triangles && primitive.get("indices").is_none()).then_some(count % 3))
        && left > 0
    {
        faults.warning(place, format!("its last {left} corners make no triangle; ignored"), "export the model again");
    }

    // Morph targets move positions and normals by weighted displacements.
    for (target, &weight) in list(primitive, "targets").iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
        let moved = optional(target, "POSITION", count, |i| document.read_vec3(i), place, faults).unwrap_or_default();
        for (position, by) in geometry.positions.iter_mut().zip(moved) {
            *position += f64::from(weight) * by.as_dvec3();
        }
        let turned = optional(target, "NORMAL", count, |i| document.read_vec3(i), place, faults).unwrap_or_default();
        for (normal, by) in normals.iter_mut().zip(turned) {
            *normal += weight * by;
        }
    }
    geometry.normals = normals;
    if skinned {
        geometry.influences = influences(document, attributes, count, place, faults);
    }
    Some(geometry)
}

fn indices_left_over(document: &Document, primitive: &Value, mode: Mode) -> Option<usize> {
    let count = document.accessor(whole(primitive.get("indices")?)?).ok()?.count;
    (mode == Mode::Triangles).then_some(count % 3)
}

/// Triangles of `count` corners in the order of glTF 2.0, 3.7.2.1.
fn triangles(mode: Mode, count: usize, corner: impl Fn(usize) -> Option<u32>) -> Vec<[u32; 3]> {
    let number = if mode == Mode::Triangles { count / 3 } else { count.saturating_sub(2) };
    let all = (0..number).filter_map(|i| {
        let at = match mode {
            Mode::Triangles => [3 * i, 3 * i + 1, 3 * i + 2],
            Mode::Strip => [i, i + 1 + i % 2, i + 2 - i % 2],
            Mode::Fan => [i + 1, i + 2, 0],
        };
        Some([corner(at[0])?, corner(at[1])?, corner(at[2])?])
    });
    all.collect()
}

fn required<T>(
    accessor: &Value,
    read: impl Fn(usize) -> Result<T, AccessorError>,
    place: &str,
    name: &str,
    faults: &mut Faults,
) -> Option<T> {
    let Some(index) = whole(accessor) else {
        faults.error(place, format!("{name} is {}", shown(Some(accessor))), "export the model again");
        return None;
    };
    match read(index) {
        Ok(list) => Some(list),
        // A buffer that is not there was reported once; every accessor in it would only repeat that.
        Err(AccessorError::BufferNotLoaded(_)) => None,
        Err(error) => {
            faults.error(place, format!("{name}: {error}"), "the file is damaged; export it again");
            None
        }
    }
}

/// An attribute that may be absent; what is wrong with it costs only itself, with a warning.
fn optional<T>(
    attributes: &Value,
    name: &str,
    count: usize,
    read: impl Fn(usize) -> Result<Vec<T>, AccessorError>,
    place: &str,
    faults: &mut Faults,
) -> Option<Vec<T>> {
    let what = match whole(attributes.get(name)?).map(read) {
        Some(Ok(list)) if list.len() == count => return Some(list),
        Some(Ok(list)) => format!("{} for {count} vertices", list.len()),
        Some(Err(AccessorError::BufferNotLoaded(_))) => return None,
        Some(Err(error)) => error.to_string(),
        None => shown(attributes.get(name)),
    };
    faults.warning(place, format!("{name}: {what}; ignored"), "export the model again");
    None
}

fn influences(
    document: &Document,
    attributes: &Value,
    count: usize,
    place: &str,
    faults: &mut Faults,
) -> Vec<Vec<(u32, f32)>> {
    let mut out = vec![Vec::new(); count];
    for set in 0..2 {
        let joints = optional(attributes, &format!("JOINTS_{set}"), count, |i| document.read_joints(i), place, faults);
        let weights = optional(attributes, &format!("WEIGHTS_{set}"), count, |i| document.read_vec4(i), place, faults);
        let (Some(joints), Some(weights)) = (joints, weights) else { break };
        for (own, (joints, weights)) in out.iter_mut().zip(joints.into_iter().zip(weights)) {
            own.extend(joints.into_iter().zip(weights.to_array()).filter(|(_, w)| *w > 0.0 && w.is_finite()));
        }
    }
    out
}

/// Weights of morph targets: the node's, else the mesh's, else zero.
pub(crate) fn morph_weights(node: &Value, mesh: &Value) -> Vec<f32> {
    let own = [node, mesh].into_iter().map(|json| list(json, "weights")).find(|weights| !weights.is_empty());
    own.unwrap_or_default().iter().map(|w| number(w).unwrap_or(0.0) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans_keep_their_front() {
        let same = |i| Some(i as u32);
        assert_eq!(triangles(Mode::Triangles, 7, same), [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(triangles(Mode::Strip, 5, same), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
        assert_eq!(triangles(Mode::Fan, 5, same), [[1, 2, 0], [2, 3, 0], [3, 4, 0]]);
        assert!(triangles(Mode::Strip, 1, same).is_empty());
    }
}
