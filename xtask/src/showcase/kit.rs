//! Furniture from the kit in assets/kaykit (CC0, see the LICENSES.md there): one mesh with one picture per file.

use crate::fault::Fault;
use crate::glb::Bounds;
use crate::showcase::solid::Shaded;
use glam::{DAffine3, Vec2, Vec3};
use serde_json::Value;
use std::collections::HashMap;

macro_rules! model {
    ($name:literal) => {
        (
            $name,
            include_str!(concat!("../../../assets/kaykit/", $name, ".gltf")),
            include_bytes!(concat!("../../../assets/kaykit/", $name, ".bin")) as &[u8],
        )
    };
}

/// The kit's files: name, JSON, binary.
const MODELS: [(&str, &str, &[u8]); 5] = [
    model!("armchair"),
    model!("couch_pillows"),
    model!("lamp_standing"),
    model!("shelf_B_large_decorated"),
    model!("table_medium_long"),
];

/// The picture that all models share.
pub const PICTURE: &[u8] = include_bytes!("../../../assets/kaykit/furniturebits_texture.png");

/// Reads a model and places it in the room, as one shape per connected part, in the order of the file's vertices.
pub fn parts(name: &str, placed: DAffine3) -> Result<Vec<Shaded>, Fault> {
    let fault = |what: &str| Fault::Kit { model: format!("{name}.gltf"), what: what.to_owned() };
    let (_, json, binary) = MODELS.iter().find(|m| m.0 == name).ok_or_else(|| fault("is not in the kit"))?;
    let json: Value = serde_json::from_str(json).map_err(|e| fault(&e.to_string()))?;
    let primitive = &json["meshes"][0]["primitives"][0];
    let column = |accessor: &Value, width: usize| -> Option<&[u8]> {
        let accessor = &json["accessors"][usize::try_from(accessor.as_u64()?).ok()?];
        let view = &json["bufferViews"][usize::try_from(accessor["bufferView"].as_u64()?).ok()?];
        let offset = usize::try_from(view["byteOffset"].as_u64()?).ok()?;
        let length = usize::try_from(accessor["count"].as_u64()?).ok()?.checked_mul(width)?;
        binary.get(offset..offset.checked_add(length)?)
    };
    let floats = |attribute: &str, width: usize| -> Result<Vec<f32>, Fault> {
        let bytes = column(&primitive["attributes"][attribute], 4 * width).ok_or_else(|| fault(attribute))?;
        Ok(bytes.as_chunks().0.iter().map(|&b| f32::from_le_bytes(b)).collect())
    };
    let positions: Vec<Vec3> = floats("POSITION", 3)?.as_chunks().0.iter().map(|&p| Vec3::from_array(p)).collect();
    let normals: Vec<Vec3> = floats("NORMAL", 3)?.as_chunks().0.iter().map(|&n| Vec3::from_array(n)).collect();
    let uvs: Vec<Vec2> = floats("TEXCOORD_0", 2)?.as_chunks().0.iter().map(|&t| Vec2::from_array(t)).collect();
    let bytes = column(&primitive["indices"], 2).ok_or_else(|| fault("indices"))?;
    let indices: Vec<usize> = bytes.as_chunks().0.iter().map(|&b| usize::from(u16::from_le_bytes(b))).collect();
    let count = positions.len();
    if normals.len() != count || uvs.len() != count || indices.iter().any(|&i| i >= count) {
        return Err(fault("an index points nowhere"));
    }

    // Join vertices at one place and the corners of each triangle; what hangs together is one part.
    let mut part: Vec<usize> = (0..count).collect();
    let mut first_at = HashMap::new();
    for (i, p) in positions.iter().enumerate() {
        let first = *first_at.entry(p.to_array().map(|x| (x * 1e4).round() as i32)).or_insert(i);
        join(&mut part, i, first);
    }
    for triangle in indices.as_chunks::<3>().0 {
        join(&mut part, triangle[0], triangle[1]);
        join(&mut part, triangle[0], triangle[2]);
    }

    let normal_to_room = placed.matrix3.inverse().transpose();
    let mut order: Vec<usize> = Vec::new();
    let mut shapes: HashMap<usize, (Shaded, HashMap<usize, u32>)> = HashMap::new();
    for &i in &indices {
        let root = root(&part, i);
        let (shape, known) = shapes.entry(root).or_insert_with(|| {
            order.push(root);
            Default::default()
        });
        let index = *known.entry(i).or_insert_with(|| {
            shape.positions.push(placed.transform_point3(positions[i].as_dvec3()).as_vec3().to_array());
            shape
                .normals
                .push((normal_to_room * normals[i].as_dvec3()).normalize_or(glam::DVec3::Y).as_vec3().to_array());
            shape.uvs.push(uvs[i].to_array());
            shape.positions.len() as u32 - 1
        });
        shape.indices.push(index);
    }
    let mut parts: Vec<Shaded> = order.iter().filter_map(|root| shapes.remove(root)).map(|(shape, _)| shape).collect();
    parts.iter_mut().skip(1).for_each(grow);
    Ok(parts)
}

/// Makes a part larger by half a percent about its middle. In the kit, cushions and boards touch face to face; so
/// they reach into one another by a millimetre or two, and no two faces coincide.
fn grow(part: &mut Shaded) {
    let mut bounds = Bounds::default();
    part.positions.iter().for_each(|&p| bounds.add(p));
    for (axis, x) in part.positions.iter_mut().flat_map(|p| p.iter_mut().enumerate()) {
        let middle = 0.5 * (bounds.min[axis] + bounds.max[axis]);
        *x = middle + 1.005 * (*x - middle);
    }
}

fn root(part: &[usize], mut i: usize) -> usize {
    while part[i] != i {
        i = part[i];
    }
    i
}

/// The smaller root wins, so that parts come in the order of the file.
fn join(part: &mut [usize], a: usize, b: usize) {
    let (a, b) = (root(part, a), root(part, b));
    part[a.max(b)] = a.min(b);
}

/// Several parts as one shape.
pub fn together(parts: impl IntoIterator<Item = Shaded>) -> Shaded {
    parts.into_iter().fold(Shaded::default(), |mut all, part| {
        let base = all.positions.len() as u32;
        all.positions.extend(part.positions);
        all.normals.extend(part.normals);
        all.uvs.extend(part.uvs);
        all.indices.extend(part.indices.iter().map(|i| i + base));
        all
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_model_falls_into_its_known_parts() {
        for ((name, ..), (parts_known, triangles)) in
            MODELS.iter().zip([(3, 528), (5, 808), (3, 320), (4, 482), (5, 168)])
        {
            let parts = parts(name, DAffine3::IDENTITY).expect("the kit is in order");
            assert_eq!(parts.len(), parts_known, "{name}");
            assert_eq!(together(parts).indices.len(), 3 * triangles, "{name}");
        }
        assert!(matches!(parts("piano", DAffine3::IDENTITY), Err(Fault::Kit { .. })));
    }
}
