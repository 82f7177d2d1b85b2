//! A CSV of points.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    for point in radiosity_io::parse_points_csv("fuzz.csv", data).unwrap_or_default().points {
        assert!(point.position.is_finite() && (point.normal.length() - 1.0).abs() < 1e-9, "{point:?}");
    }
});
