//! Every file of `data/bad-inputs` does what its manifest says, within its limits of time.

use radiosity_io::{LoadError, LoadOptions, Loaded, load};
use radiosity_scene::Severity;
use serde_json::Value;
use std::path::Path;
use std::time::Instant;

fn folder() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bad-inputs"))
}

fn read(file: &str) -> Result<Loaded, LoadError> {
    load(&folder().join(file), &LoadOptions::default())
}

/// What the message of each refused file, or the warning of each file that loads, must tell the user.
const SAID: &[(&str, &str)] = &[
    ("glb-truncated-half.glb", "cut short"),
    ("glb-header-only.glb", "cut short"),
    ("glb-bad-magic.glb", "does not begin with 'glTF'"),
    ("glb-version-1.glb", "container version 1"),
    ("glb-length-too-long.glb", "cut short"),
    ("empty.gltf", "the file is empty"),
    ("not-json.gltf", "not JSON"),
    ("no-asset.gltf", "'asset' is missing"),
    ("version-3.gltf", "version '3.0'"),
    ("index-out-of-range.gltf", "1 of 1 triangle names vertices that do not exist"),
    ("accessor-out-of-range.gltf", "accessors[9]: there are only 2"),
    ("nan-position.gltf", "not finite"),
    ("inf-position.gltf", "not finite"),
    ("coords-1e30.gltf", "1.0000000150474662e30 m"),
    ("zero-area.gltf", "no area; dropped"),
    ("empty-scene.gltf", "no triangle with an area"),
    ("cyclic-nodes.gltf", "nodes[0]: is reached twice"),
    ("self-child.gltf", "nodes[0]: is reached twice"),
    ("missing-buffer-file.gltf", "'nowhere.bin' does not exist"),
    ("traversal-uri.gltf", "leads outside the folder"),
    ("absolute-uri.gltf", "leads outside the folder"),
    ("http-uri.gltf", "nothing is fetched from a network"),
    ("bad-base64.gltf", "not base64"),
    ("count-bomb.gltf", "4294967295 elements of 12 bytes do not fit"),
    ("count-bomb-no-view.gltf", "2000000000 elements without a bufferView"),
    ("negative-count.gltf", "count is -3"),
    ("required-extension.gltf", "'XX_unknown' is not supported"),
    ("albedo-above-1.gltf", "clamped to 0..1"),
    ("obj-index-range.obj", "with a corner that does not exist"),
    ("obj-index-zero.obj", "with a corner that does not exist"),
    ("obj-nan.obj", "something else than numbers"),
    ("obj-mtl-missing.obj", "'none.mtl' does not exist"),
    ("obj-mtl-traversal.obj", "leads outside the folder"),
    ("obj-duplicate-faces.obj", "1 of 3 triangles lies exactly on another"),
    ("obj-nonmanifold.obj", ""),
    ("obj-polygon.obj", ""),
];

/// Files that load; the rest of the manifest is refused.
const LOADS: &[&str] = &[
    "albedo-above-1.gltf",
    "obj-mtl-missing.obj",
    "obj-mtl-traversal.obj",
    "obj-duplicate-faces.obj",
    "obj-nonmanifold.obj",
    "obj-polygon.obj",
];

#[test]
fn every_bad_file_does_what_its_manifest_says() {
    let manifest: Value = serde_json::from_slice(&std::fs::read(folder().join("manifest.json")).unwrap()).unwrap();
    let files = manifest["files"].as_array().unwrap();
    assert_eq!(files.len(), SAID.len());
    for entry in files {
        let (file, must) = (entry["file"].as_str().unwrap(), entry["must"].as_str().unwrap());
        let expected = SAID.iter().find(|(name, _)| *name == file).map(|(_, said)| *said).unwrap();
        let start = Instant::now();
        let result = read(file);
        assert!(start.elapsed().as_secs() < 10, "{file}");
        match result {
            Err(error) => {
                assert!(!LOADS.contains(&file), "{file}: {error}");
                assert!(must.starts_with('E') || must.contains("a scene left without area is an error"), "{file}");
                let text = error.to_string();
                assert!(text.contains(expected) && text.contains(file), "{file}: {text}");
            }
            Ok(loaded) => {
                assert!(LOADS.contains(&file), "{file} loads");
                let text = loaded.faults.to_string();
                let warned = loaded.faults.0.iter().any(|fault| fault.severity == Severity::Warning);
                assert_eq!(warned, !must.starts_with('O'), "{file}: {text}");
                assert!(text.contains(expected), "{file}: {text}");
                let scene = &loaded.scene;
                assert!(!scene.validate(file).has_errors(), "{}", scene.validate(file));
                let colors = scene
                    .materials
                    .iter()
                    .flat_map(|m| m.base_color)
                    .chain(scene.materials.iter().flat_map(|m| m.emissive));
                assert!(colors.into_iter().all(|c| c.is_finite()), "{file}");
            }
        }
    }
}

#[test]
fn doubled_faces_answer_once_and_concave_polygons_keep_their_area() {
    let area = |loaded: &Loaded| (0..loaded.scene.triangles.len()).map(|t| loaded.scene.area(t)).sum::<f64>();
    let doubled = read("obj-duplicate-faces.obj").unwrap();
    assert_eq!(doubled.scene.triangle_source, [0, 2]);
    assert_eq!(area(&doubled), 1.0);
    assert!((area(&read("obj-polygon.obj").unwrap()) - 3.0).abs() < 1e-12);
    assert_eq!(read("obj-nonmanifold.obj").unwrap().scene.triangles.len(), 3);
}

#[test]
fn a_file_that_is_not_there_or_of_no_known_kind_is_named() {
    assert!(read("nothing.glb").unwrap_err().to_string().contains("nothing.glb: cannot be read"));
    assert!(read("manifest.json").unwrap_err().to_string().contains("'.json' is no known kind"));
    let folder = load(folder().parent().unwrap(), &LoadOptions::default());
    assert!(folder.unwrap_err().to_string().contains("is a folder"));
}
