//! Joints and weights between vertices. Linear blend skinning is linear in the weights, so a vertex with the weighted
//! joints of its corners moves exactly as the surface between them does, as long as no influence has to be dropped.

use super::LitVertex;
use super::glb::Builder;
use crate::gltf::Document;
use crate::gltf::json::whole;
use serde_json::{Map, Value};

/// Influences in one set of attributes.
const PER_SET: usize = 4;

/// Writes as many sets of joints and weights as the source has; the strongest influences stay and add up to 1.
/// Nothing is written where a set cannot be read, which was reported when the file was read.
pub(super) fn interpolate(
    builder: &mut Builder,
    document: &Document,
    source: &Map<String, Value>,
    vertices: &[LitVertex],
    attributes: &mut Map<String, Value>,
) {
    let mut sets = Vec::new();
    while let (Some(joints), Some(weights)) =
        (source.get(&format!("JOINTS_{}", sets.len())), source.get(&format!("WEIGHTS_{}", sets.len())))
    {
        let joints = whole(joints).and_then(|index| document.read_joints(index).ok());
        let weights = whole(weights).and_then(|index| document.read_vec4(index).ok());
        let (Some(joints), Some(weights)) = (joints, weights) else { break };
        sets.push((joints, weights));
    }

    let mut out = vec![Vec::with_capacity(vertices.len()); sets.len()];
    for vertex in vertices {
        // Joints in ascending order, each once.
        let mut all: Vec<(u32, f32)> = Vec::new();
        for (&corner, share) in vertex.corners.iter().zip(vertex.weights).filter(|(_, share)| *share != 0.0) {
            for (joints, weights) in &sets {
                let (Some(joints), Some(weights)) = (joints.get(corner as usize), weights.get(corner as usize)) else {
                    continue;
                };
                for (&joint, weight) in joints.iter().zip(weights.to_array()).filter(|(_, w)| *w > 0.0 && w.is_finite())
                {
                    match all.iter_mut().find(|known| known.0 == joint) {
                        Some(known) => known.1 += share * weight,
                        None => all.push((joint, share * weight)),
                    }
                }
            }
        }
        all.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        all.truncate(PER_SET * sets.len());
        let total: f32 = all.iter().map(|(_, weight)| weight).sum();
        let unit = if total > 0.0 { 1.0 / total } else { 0.0 };
        for (set, out) in out.iter_mut().enumerate() {
            let at = |k: usize| all.get(PER_SET * set + k).map_or((0, 0.0), |&(joint, weight)| (joint, weight * unit));
            out.push(std::array::from_fn::<(u32, f32), PER_SET, _>(at));
        }
    }
    for (set, values) in out.iter().enumerate() {
        let joints: Vec<[u32; 4]> = values.iter().map(|four| four.map(|(joint, _)| joint)).collect();
        let weights: Vec<f32> = values.iter().flatten().map(|(_, weight)| *weight).collect();
        attributes.insert(format!("JOINTS_{set}"), builder.joints(&joints).into());
        attributes.insert(format!("WEIGHTS_{set}"), builder.floats(&weights, PER_SET, false).into());
    }
}
