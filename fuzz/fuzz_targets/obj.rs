//! An OBJ; what follows a byte 0xFF is its library and every picture.
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
    let (obj, rest) = match data.iter().position(|&byte| byte == 0xFF) {
        Some(at) => (&data[..at], &data[at + 1..]),
        None => (data, &[][..]),
    };
    if let Ok(loaded) = radiosity_io::obj::load("fuzz.obj", obj, &Everywhere(rest), &options) {
        let faults = loaded.scene.validate("fuzz");
        assert!(!faults.has_errors(), "{faults}");
    }
});
