//! Each scene of `data/scenes` has the triangles, area and bounds that two other readers found
//! (`expected.json`; materials and lights too), and what else its author says about it.

use glam::DVec3;
use radiosity_io::{LoadOptions, Loaded, Memory, gltf, load};
use radiosity_scene::{PointLightKind, Surface};
use serde_json::Value;
use std::path::Path;

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/scenes"))
}

fn read(file: &str) -> Loaded {
    load(&folder().join(file), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn area(loaded: &Loaded) -> f64 {
    (0..loaded.scene.triangles.len()).map(|t| loaded.scene.area(t)).sum()
}

/// Triangles that the warnings say were dropped for want of area ("5 of 190 triangles have no area; dropped").
fn dropped(loaded: &Loaded) -> u64 {
    let flat = loaded.faults.0.iter().filter(|fault| fault.what.ends_with(" no area; dropped"));
    flat.map(|fault| fault.what.split(' ').next().unwrap().parse::<u64>().unwrap()).sum()
}

#[test]
fn every_scene_has_its_triangles_area_and_bounds() {
    let expected: Value = serde_json::from_slice(&std::fs::read(folder().join("expected.json")).unwrap()).unwrap();
    let mut compared = 0;
    for (file, expected) in expected["files"].as_object().unwrap() {
        if !folder().join(file).exists() {
            continue;
        }
        let loaded = read(file);
        let scene = &loaded.scene;
        if let Some(triangles) = expected["triangles"].as_u64() {
            compared += 1;
            assert_eq!(scene.triangles.len() as u64 + dropped(&loaded), triangles, "{file}: {}", loaded.faults);
            let (ours, theirs) = (area(&loaded), expected["area"].as_f64().unwrap());
            assert!((ours / theirs - 1.0).abs() < 1e-5, "{file}: area {ours} for {theirs}");
            let bounds = scene.bounding_box().unwrap();
            for (ours, theirs) in bounds.iter().zip(expected["bbox"].as_array().unwrap()) {
                let theirs = DVec3::from_array(std::array::from_fn(|i| theirs[i].as_f64().unwrap()));
                assert!((*ours - theirs).length() <= 1e-6 * (1.0 + theirs.length()), "{file}: {ours} for {theirs}");
            }
        }
        if let Some(materials) = expected["materials"].as_u64() {
            // One more stands for primitives without material, where there are any.
            let unnamed = loaded.faults.to_string().contains("without a material");
            assert_eq!(scene.materials.len() as u64, materials + u64::from(unnamed), "{file}");
            assert_eq!(scene.lights.len() as u64, expected["lights"].as_u64().unwrap(), "{file}");
        }
        assert!(!scene.validate(file).has_errors(), "{}", scene.validate(file));
    }
    assert!(compared >= 15, "{compared}");
}

/// The uncompressed fallback of a meshopt file is left aside where decoding works, and counts where it does not.
#[test]
fn the_fallback_counts_where_decoding_fails() {
    let data = |file: &str| {
        std::fs::read(folder().join("compressed/EXT_meshopt_compression/meshopt-fallback").join(file)).unwrap()
    };
    let files = ["meshopt-fallback.bin", "meshopt-fallback.fallback.bin"];
    let mut memory = Memory(files.map(|file| (file.to_owned(), data(file))).into());
    let read = |memory: &Memory| {
        gltf::load("t.gltf", &data("meshopt-fallback.gltf"), memory, &LoadOptions::default()).unwrap()
    };
    let whole = read(&memory);
    memory.0.insert(files[0].to_owned(), vec![0; 468]);
    let damaged = read(&memory);
    assert_eq!(damaged.scene.positions, whole.scene.positions);
    assert!(damaged.faults.to_string().contains("the uncompressed fallback is used"), "{}", damaged.faults);
    assert!(!whole.faults.to_string().contains("fallback"), "{}", whole.faults);
}

/// Compressed files give what their uncompressed siblings give.
#[test]
fn compressed_files_are_decoded() {
    let fallback = read("compressed/EXT_meshopt_compression/meshopt-fallback/meshopt-fallback.gltf");
    let decoded = read("compressed/EXT_meshopt_compression/meshopt-no-fallback/meshopt-no-fallback.gltf");
    assert_eq!(decoded.scene.positions, fallback.scene.positions);
    assert_eq!(decoded.scene.triangles, fallback.scene.triangles);
    assert_eq!(decoded.scene.normals, fallback.scene.normals);
    // The normals passed a filter; on the cube, whose objects come first, they are those of the faces.
    for triangle in decoded.scene.objects[0].triangles.clone() {
        let [a, b, c] = decoded.scene.corners(triangle);
        let shaded = decoded.scene.normals[decoded.scene.triangles[triangle][0] as usize].as_dvec3();
        assert!((b - a).cross(c - a).normalize().dot(shaded) > 0.999, "{triangle}");
    }
    let document = decoded.document.unwrap();
    assert!(!document.json.to_string().contains("meshopt_compression"), "the document is plain after reading");

    let draco = read("compressed/Box_Draco.glb");
    assert_eq!(draco.scene.triangles.len(), 12);
    assert!((area(&draco) - 6.0).abs() < 1e-4, "{}", area(&draco));
    assert!(!draco.document.unwrap().json.to_string().contains("draco_mesh"));
}

#[test]
fn lights_have_their_units_and_places() {
    let loaded = read("made/room-lights.gltf");
    let kinds: Vec<_> = loaded.scene.lights.iter().map(|light| (light.kind, light.intensity)).collect();
    assert!(kinds.iter().any(|(kind, _)| *kind == PointLightKind::Point), "{kinds:?}");
    assert!(kinds.iter().all(|(_, intensity)| intensity.iter().all(|i| *i > 0.0)), "{kinds:?}");
}

/// The glTF and the OBJ of the Cornell box are the same box in other units.
#[test]
fn both_formats_of_the_cornell_box_agree() {
    let options = LoadOptions { metres_per_unit: 0.001, ..LoadOptions::default() };
    let obj = load(&folder().join("cornell/cornell-box.obj"), &options).unwrap();
    let gltf = read("cornell/cornell-box.glb");
    assert!((area(&obj) / area(&gltf) - 1.0).abs() < 1e-5);
    let emitted = |loaded: &Loaded| {
        let scene = &loaded.scene;
        let power = |t| {
            f64::from(scene.emitted_luminance(Surface { triangle: t, uv: glam::DVec2::splat(0.3) })[1]) * scene.area(t)
        };
        (0..scene.triangles.len()).map(power).sum::<f64>()
    };
    assert!((emitted(&obj) / emitted(&gltf) - 1.0).abs() < 1e-5, "{} {}", emitted(&obj), emitted(&gltf));
    // Every face of the closed room looks inwards: seen from its middle, all walls turn their front.
    for loaded in [&obj, &gltf] {
        let scene = &loaded.scene;
        let middle = DVec3::new(0.278, 0.45, 0.05);
        for object in
            scene.objects.iter().filter(|object| !object.name.contains("block") && !object.name.contains("box"))
        {
            for triangle in object.triangles.clone() {
                let [a, b, c] = scene.corners(triangle);
                assert!((b - a).cross(c - a).dot(middle - a) > 0.0, "{} {triangle}", object.name);
            }
        }
    }
}

/// The arrow of the Khronos texture transform test points to its marker for the right answer (uv 67.5° below the
/// corner it starts from), not to the one for no rotation (45°) or for the opposite one (22.5°).
#[test]
fn textures_turn_the_right_way() {
    let loaded = read("khronos/TextureTransformTest/TextureTransformTest.gltf");
    let material = loaded.scene.materials.iter().find(|material| material.name == "Rotation").unwrap();
    let picture = material.base_color_texture.unwrap();
    let red_towards = |degrees: f64| {
        let uv = 0.6 * glam::DVec2::from_angle(degrees.to_radians());
        loaded.scene.textures[picture.texture].sample(picture.coordinates(uv), picture.wrap, false, true)[0]
    };
    assert!(red_towards(67.5) < 0.1 && red_towards(45.0) > 0.3 && red_towards(22.5) > 0.3);
}
