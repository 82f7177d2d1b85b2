//! A GLB, or the JSON of a .gltf; what follows a byte 0xFF stands behind every address of it.
#![no_main]

use libfuzzer_sys::fuzz_target;
use radiosity_io::{LoadOptions, Source, SourceError};

struct Everywhere<'a>(&'a [u8]);

impl Source for Everywhere<'_> {
    fn read(&self, _: &str) -> Result<Vec<u8>, SourceError> {
        Ok(self.0.to_vec())
    }
}

fuzz_target!(|data: &[u8]| {
    let options = LoadOptions { max_triangles: 100_000, ..LoadOptions::default() };
    let (json, rest) = match data.iter().position(|&byte| byte == 0xFF) {
        Some(at) if !data.starts_with(b"glTF") => (&data[..at], &data[at + 1..]),
        _ => (data, &[][..]),
    };
    let mut bytes = json.to_vec();
    if bytes.starts_with(b"glTF") && bytes.len() >= 12 {
        // The header's length follows what the fuzzer makes of the file, so that chunks are reached.
        let length = (bytes.len() as u32).to_le_bytes();
        bytes[8..12].copy_from_slice(&length);
    }
    if let Ok(loaded) = radiosity_io::gltf::load("fuzz", &bytes, &Everywhere(rest), &options) {
        let faults = loaded.scene.validate("fuzz");
        assert!(!faults.has_errors(), "{faults}");
    }
});
