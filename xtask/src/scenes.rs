//! `cargo xtask scenes`: scenes of any size by formula, to measure how time and memory grow.
//!
//! A scene is a visit: it hands its solids to a sink in a fixed order and can be visited again. The writer visits it
//! once to count and once for every material's points and indices, so memory stays constant up to GLB's 4 GiB.

mod building;
mod soup;

use crate::fault::{Fault, options};
use crate::glb::{self, Bounds};
use glam::Vec3;
use serde_json::{Value, json};
use std::io::{BufWriter, Write};
use std::path::Path;

/// Materials shared by the scenes, by index: name, linear reflectance, luminance in cd/m² (all bands).
const MATERIALS: [(&str, [f64; 3], f64); 7] = [
    ("plaster", [0.75, 0.75, 0.72], 0.0),
    ("floor", [0.35, 0.30, 0.25], 0.0),
    ("wood", [0.42, 0.28, 0.16], 0.0),
    ("red", [0.55, 0.12, 0.10], 0.0),
    ("green", [0.15, 0.45, 0.18], 0.0),
    ("blue", [0.12, 0.22, 0.50], 0.0),
    ("lamp", [0.8, 0.8, 0.8], 4000.0),
];
const PLASTER: usize = 0;
const FLOOR: usize = 1;
const WOOD: usize = 2;
const RED: usize = 3;
const BLUE: usize = 5;
const LAMP: usize = 6;

/// A closed solid on its way to the file: points and triangles, counter-clockwise from outside.
struct Part<'a> {
    material: usize,
    points: &'a [Vec3],
    triangles: &'a [[u32; 3]],
}

/// Something that can be walked through, again and again in the same order.
trait Visit {
    fn visit(&self, sink: &mut dyn FnMut(Part));
    /// Eye and target of the scene's camera.
    fn camera(&self) -> [Vec3; 2];
}

/// Corners of a box: bit k of the number is the side on axis k.
fn corners(lo: Vec3, hi: Vec3) -> [Vec3; 8] {
    std::array::from_fn(|i| {
        Vec3::from_array(std::array::from_fn(|axis| if i >> axis & 1 == 1 { hi[axis] } else { lo[axis] }))
    })
}

/// Triangles of a box seen from outside, for points in the order of [`corners`].
const BOX: [[u32; 3]; 12] = {
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let mut triangles = [[0; 3]; 12];
    let mut i = 0;
    while i < 6 {
        let [a, b, c, d] = quads[i];
        triangles[2 * i] = [a, b, c];
        triangles[2 * i + 1] = [a, c, d];
        i += 1;
    }
    triangles
};

/// What one material's primitive holds.
#[derive(Clone, Copy, Default)]
struct Count {
    points: u64,
    triangles: u64,
    bounds: Bounds,
}

/// Writes a scene as GLB; returns its number of triangles.
fn write(scene: &dyn Visit, name: &str, to: &mut dyn Write) -> Result<u64, glb::Head> {
    let mut counts = [Count::default(); MATERIALS.len()];
    scene.visit(&mut |part| {
        let count = &mut counts[part.material];
        count.points += part.points.len() as u64;
        count.triangles += part.triangles.len() as u64;
        part.points.iter().for_each(|p| count.bounds.add(p.to_array()));
    });
    let length: u64 = counts.iter().map(|c| 12 * (c.points + c.triangles)).sum();
    glb::write_head(to, &document(scene, name, &counts, length), length)?;

    // Points, then indices, of each material: the order of the buffer views.
    let mut failed = Ok(());
    for material in (0..MATERIALS.len()).filter(|&m| counts[m].points > 0) {
        let mut keep = |result: std::io::Result<()>| failed = std::mem::replace(&mut failed, Ok(())).and(result);
        scene.visit(&mut |part| {
            if part.material == material {
                part.points.iter().flat_map(|p| p.to_array()).for_each(|x| keep(to.write_all(&x.to_le_bytes())));
            }
        });
        let mut base = 0;
        scene.visit(&mut |part| {
            if part.material == material {
                for i in part.triangles.iter().flatten() {
                    keep(to.write_all(&(base + i).to_le_bytes()));
                }
                base += part.points.len() as u32;
            }
        });
    }
    failed?;
    Ok(counts.iter().map(|c| c.triangles).sum())
}

fn document(scene: &dyn Visit, name: &str, counts: &[Count], length: u64) -> Value {
    let (mut views, mut accessors, mut primitives) = (Vec::new(), Vec::new(), Vec::new());
    let mut offset = 0;
    for (material, count) in counts.iter().enumerate().filter(|(_, c)| c.points > 0) {
        let at = accessors.len();
        views.push(json!({
            "buffer": 0, "byteOffset": offset, "byteLength": 12 * count.points, "target": glb::ARRAY_BUFFER,
        }));
        offset += 12 * count.points;
        accessors.push(json!({
            "bufferView": at, "componentType": glb::FLOAT, "count": count.points, "type": "VEC3",
            "min": count.bounds.min, "max": count.bounds.max,
        }));
        views.push(json!({
            "buffer": 0, "byteOffset": offset, "byteLength": 12 * count.triangles, "target": glb::ELEMENT_ARRAY_BUFFER,
        }));
        offset += 12 * count.triangles;
        accessors.push(json!({
            "bufferView": at + 1, "componentType": glb::UNSIGNED_INT, "count": 3 * count.triangles, "type": "SCALAR",
        }));
        primitives.push(json!({"attributes": {"POSITION": at}, "indices": at + 1, "material": material}));
    }
    let materials: Vec<Value> = MATERIALS
        .iter()
        .map(|&(name, [r, g, b], luminance)| {
            let mut material = json!({
                "name": name,
                "pbrMetallicRoughness": {"baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0},
            });
            if luminance > 0.0 {
                material["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
                material["extensions"] = json!({"KHR_materials_emissive_strength": {"emissiveStrength": luminance}});
            }
            material
        })
        .collect();
    let [eye, target] = scene.camera().map(|p| p.as_dvec3());
    json!({
        "asset": {"version": "2.0", "generator": "radiosity xtask"},
        "extensionsUsed": ["KHR_materials_emissive_strength"],
        "scene": 0,
        "scenes": [{"name": name, "nodes": [0, 1]}],
        "nodes": [{"name": name, "mesh": 0}, glb::camera_node(name, 0, eye, target)],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.05, "zfar": 1000.0}}],
        "meshes": [{"name": name, "primitives": primitives}],
        "materials": materials,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": length}],
    })
}

fn write_file(scene: &dyn Visit, name: &str, path: &Path) -> Result<u64, Fault> {
    let mut file = BufWriter::with_capacity(1 << 20, std::fs::File::create(path).map_err(Fault::at(path))?);
    let triangles = write(scene, name, &mut file).map_err(glb::Head::at(path))?;
    file.flush().map_err(Fault::at(path))?;
    Ok(triangles)
}

/// `scenes building [--rooms N] -o FILE` and `scenes soup [--triangles N] -o FILE`.
pub fn command(arguments: &[&str]) -> Result<String, Fault> {
    let Some((&kind, rest)) = arguments.split_first() else {
        return Err(Fault::Usage("'scenes' needs a kind: building or soup".to_owned()));
    };
    let (size_option, default) = match kind {
        "building" => ("--rooms", 16),
        "soup" => ("--triangles", 10_000),
        _ => return Err(Fault::Usage(format!("there is no scene '{kind}'; there are building and soup"))),
    };
    let (mut size, mut path) = (default, None);
    for (option, value) in options(rest, &[size_option, "-o"])? {
        if option == "-o" {
            path = Some(Path::new(value));
        } else {
            // 10^8 keeps every index below 2^32; GLB itself ends sooner, at some 2 × 10^8 triangles.
            size = value.parse().ok().filter(|n| (1..=100_000_000).contains(n)).ok_or_else(|| {
                Fault::Usage(format!("'{size_option} {value}': give a whole number from 1 to 100000000"))
            })?;
        }
    }
    let path = path.ok_or_else(|| Fault::Usage(format!("'scenes {kind}' needs -o FILE")))?;
    let scene: Box<dyn Visit> = match kind {
        "building" => Box::new(building::Building::new(size)),
        _ => Box::new(soup::Soup::new(size)),
    };
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(Fault::at(folder))?;
    }
    // Written beside its place and renamed when whole, so that a failure leaves no half a file.
    let mut unfinished = path.as_os_str().to_owned();
    unfinished.push(".tmp");
    let unfinished = Path::new(&unfinished);
    let triangles = write_file(scene.as_ref(), kind, unfinished).inspect_err(|_| {
        // The first fault is the one to tell; a file that cannot be removed either adds nothing to it.
        std::fs::remove_file(unfinished).ok();
    })?;
    std::fs::rename(unfinished, path).map_err(Fault::at(path))?;
    Ok(format!("{}: {triangles} triangles", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    fn file_of(scene: &dyn Visit) -> (Vec<u8>, u64) {
        let mut file = Vec::new();
        let triangles = write(scene, "test", &mut file).expect("memory takes it");
        (file, triangles)
    }

    #[test]
    fn files_are_whole_and_the_same_each_time() {
        let scenes: [&dyn Visit; 3] =
            [&building::Building::new(1), &building::Building::new(7), &soup::Soup::new(5000)];
        for scene in scenes {
            let (file, triangles) = file_of(scene);
            assert!(file == file_of(scene).0, "two runs differ");
            let (json, binary) = glb::parts(&file);
            assert_eq!(json["buffers"][0]["byteLength"], binary.len());
            let mut seen = 0;
            for primitive in json["meshes"][0]["primitives"].as_array().expect("primitives") {
                let [points, indices] = [&primitive["attributes"]["POSITION"], &primitive["indices"]]
                    .map(|i| &json["accessors"][i.as_u64().expect("an index") as usize]);
                let view = &json["bufferViews"][indices["bufferView"].as_u64().expect("an index") as usize];
                let [at, length] = ["byteOffset", "byteLength"].map(|k| view[k].as_u64().expect("a number") as usize);
                let count = points["count"].as_u64().expect("a count") as u32;
                let words = binary[at..at + length].as_chunks::<4>().0;
                assert!(words.iter().all(|&w| u32::from_le_bytes(w) < count));
                seen += indices["count"].as_u64().expect("a count") / 3;
            }
            assert_eq!(seen, triangles);
        }
    }

    #[test]
    fn every_part_is_closed_and_right_side_out() {
        let scenes: [&dyn Visit; 2] = [&building::Building::new(5), &soup::Soup::new(2000)];
        for scene in scenes {
            let mut inside_out = 0;
            scene.visit(&mut |part| {
                let mut edges: HashMap<(u32, u32), i32> = HashMap::new();
                let mut volume = 0.0;
                for &[a, b, c] in part.triangles {
                    for (from, to) in [(a, b), (b, c), (c, a)] {
                        *edges.entry((from, to)).or_default() += 1;
                        *edges.entry((to, from)).or_default() -= 1;
                    }
                    let [a, b, c] = [a, b, c].map(|i| (part.points[i as usize] - part.points[0]).as_dvec3());
                    volume += a.dot(b.cross(c));
                }
                assert!(edges.values().all(|&balance| balance == 0), "a hole");
                inside_out += usize::from(volume <= 0.0);
            });
            assert_eq!(inside_out, 0);
        }
    }

    #[test]
    fn wrong_calls_are_told_what_is_right() {
        for call in [
            &["building"][..],
            &["tower", "-o", "x"],
            &["soup", "--triangles", "many", "-o", "x"],
            &[],
            &["soup", "-o"],
        ] {
            assert!(matches!(command(call), Err(Fault::Usage(_))), "{call:?}");
        }
    }
}
