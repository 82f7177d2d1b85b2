//! Damaged files: every one is refused or loads into a scene that keeps its promises; none brings the reader down.

use radiosity_io::factors_out::parse_view3d_text;
use radiosity_io::{LoadOptions, Source, SourceError, gltf, obj, parse_points_csv, parse_sky, parse_vs3};
use radiosity_scene::Scene;
use std::path::Path;

/// The same bytes behind every address.
struct Everywhere(Vec<u8>);

impl Source for Everywhere {
    fn read(&self, _: &str) -> Result<Vec<u8>, SourceError> {
        Ok(self.0.clone())
    }
}

fn data(file: &str) -> Vec<u8> {
    std::fs::read(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data")).join(file)).unwrap()
}

/// A small generator with a fixed start (Steele, Lea & Flood 2014, SplitMix64).
struct Random(u64);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % limit.max(1) as u64) as usize
    }
}

/// `bytes` with up to four changes: a byte, a cut, a doubled stretch, an extreme word.
fn damaged(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for _ in 0..=random.below(4) {
        let at = random.below(out.len());
        match random.below(5) {
            0 | 1 if !out.is_empty() => out[at] = random.below(256) as u8,
            2 => out.truncate(at),
            3 => {
                let end = (at + random.below(40)).min(out.len());
                let stretch = out[at..end].to_vec();
                out.splice(at..at, stretch);
            }
            _ => {
                let words: [&[u8]; 6] = [&[0xFF; 4], &[0; 4], b"-1", b"1e39", b"4294967296", &[0, 0, 0xC0, 0x7F]];
                let word = words[random.below(words.len())];
                let end = (at + word.len()).min(out.len());
                out.splice(at..end, word.iter().copied());
            }
        }
    }
    out
}

fn each_damaged(files: &[&str], rounds: usize, read: impl Fn(&[u8])) {
    let mut random = Random(1);
    for file in files {
        let bytes = data(file);
        for cut in (0..bytes.len()).step_by(bytes.len().div_ceil(200)) {
            read(&bytes[..cut]);
        }
        for _ in 0..rounds {
            read(&damaged(&bytes, &mut random));
        }
    }
}

#[test]
fn damaged_gltf() {
    let options = LoadOptions { max_triangles: 100_000, ..LoadOptions::default() };
    let fallback = data("scenes/compressed/EXT_meshopt_compression/meshopt-no-fallback/meshopt-no-fallback.bin");
    let files = [
        "scenes/khronos/Box/Box.glb",
        "scenes/compressed/Box_Draco.glb",
        "scenes/compressed/EXT_meshopt_compression/meshopt-no-fallback/meshopt-no-fallback.gltf",
        "scenes/cesium-boxes/triangle-without-indices/triangle-without-indices.gltf",
        "bad-inputs/zero-area.gltf",
    ];
    let read = |bytes: &[u8], rest: &[u8]| {
        let mut bytes = bytes.to_vec();
        if bytes.starts_with(b"glTF") && bytes.len() >= 12 {
            let length = (bytes.len() as u32).to_le_bytes();
            bytes[8..12].copy_from_slice(&length);
        }
        if let Ok(loaded) = gltf::load("t", &bytes, &Everywhere(rest.to_vec()), &options) {
            assert!(!loaded.scene.validate("t").has_errors());
        }
    };
    each_damaged(&files, 600, |bytes| read(bytes, &fallback));

    // Damage to the compressed data themselves.
    let json = data(files[2]);
    let mut random = Random(2);
    for _ in 0..2000 {
        read(&json, &damaged(&fallback, &mut random));
    }
}

#[test]
fn damaged_obj() {
    let options = LoadOptions { max_triangles: 100_000, ..LoadOptions::default() };
    let mtl = data("scenes/cornell/cornell-box.mtl");
    each_damaged(&["scenes/cornell/cornell-box.obj", "bad-inputs/obj-polygon.obj"], 2000, |bytes| {
        if let Ok(loaded) = obj::load("t.obj", bytes, &Everywhere(mtl.clone()), &options) {
            assert!(!loaded.scene.validate("t").has_errors());
        }
    });
    let box_file = data("scenes/cornell/cornell-box.obj");
    each_damaged(&["scenes/cornell/cornell-box.mtl"], 2000, |bytes| {
        let _ = obj::load("t.obj", &box_file, &Everywhere(bytes.to_vec()), &options);
    });
}

#[test]
fn damaged_points_and_skies() {
    let csv = b"x,y,z,nx,ny,nz\n1,2,3,0,0,1\n-1e3,2.5,0,0.6,0,0.8\n".to_vec();
    let hdr = b"#?RADIANCE\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 2\n0123456789abcdef".to_vec();
    assert!(parse_points_csv("t", &csv).is_ok() && parse_sky("t", &hdr).is_ok());
    let mut random = Random(3);
    for _ in 0..20_000 {
        for point in parse_points_csv("t", &damaged(&csv, &mut random)).unwrap_or_default().points {
            assert!(point.position.is_finite() && (point.normal.length() - 1.0).abs() < 1e-9, "{point:?}");
        }
        if let Ok(sky) = parse_sky("t", &damaged(&hdr, &mut random)) {
            let mut scene = Scene::default();
            scene.set_sky(sky, "t");
            assert!(scene.lights.iter().flat_map(|l| l.intensity).all(|e| e.is_finite()));
        }
    }
}

#[test]
fn damaged_view3d_files() {
    let files = ["vs3/wall.vs3", "vs3/l-room.vs3", "vs3/l-room-3a.vs3", "vs3/latin-1.vs3", "vs3/broken.vs3"];
    each_damaged(&files, 4000, |bytes| {
        let Ok(vs3) = parse_vs3("t.vs3", bytes) else { return };
        let areas = vs3.enclosure.surface_areas();
        assert!(areas.iter().all(|area| *area > 0.0), "{areas:?}");
        for facet in vs3.enclosure.facets.iter().chain(&vs3.enclosure.obstructions) {
            assert!(facet.area() > 0.0 && facet.corners().iter().all(|c| c.is_finite()), "{facet:?}");
        }
        let masked = vs3.with_masks(&areas, &vec![0.0; areas.len().pow(2)], &vec![0.0; areas.len().pow(2)]);
        assert_eq!(masked.areas.len(), areas.len() + vs3.masks.len());
    });
    let output = b"View3D 3.3.1 0 1 0 2          \n1 1\n0.000000 1.000000\n1.000000 0.000000\n0.900 0.900\n";
    let mut random = Random(4);
    for _ in 0..20_000 {
        if let Ok(output) = parse_view3d_text("t.txt", &damaged(output, &mut random)) {
            assert_eq!(output.factors.len(), output.areas.len().pow(2));
        }
    }
}

/// The decoder asserted on its compressed blocks instead of reporting them. Where it is built without overflow checks it
/// decodes them to infinities, which are refused as well.
#[test]
fn a_sky_with_damaged_blocks_is_refused() {
    let text = parse_sky("sky.exr", &data("sky-damaged-b44.exr")).unwrap_err().to_string();
    let what = if cfg!(debug_assertions) { "sky.exr: cannot be decoded" } else { "sky.exr: 16 pixels are not finite" };
    assert!(text.contains(what), "{text}");
}
