//! A View3D file: what is read has areas, convex facets that face as their surfaces do, and indices that exist; what is cut
//! out of a surface and what is left of it are no more than the surface.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    if let Ok(vs3) = radiosity_io::parse_vs3("fuzz.vs3", data) {
        let enclosure = &vs3.enclosure;
        assert_eq!(enclosure.facets.len(), enclosure.surface_of.len());
        assert_eq!(enclosure.surfaces.len(), vs3.numbers.len());
        let areas = enclosure.surface_areas();
        assert!(areas.iter().all(|area| *area > 0.0), "{areas:?}");
        for facet in enclosure.facets.iter().chain(&enclosure.obstructions) {
            assert!(facet.area() > 0.0 && facet.corners().iter().all(|c| c.is_finite()), "{facet:?}");
        }
        if areas.len() < 100 && areas.iter().all(|area| area.is_finite()) {
            let masked = vs3.with_masks(&areas, &vec![0.0; areas.len() * areas.len()]);
            assert_eq!(masked.areas.len(), areas.len() + vs3.masks.len());
        }
    }
    let _ = radiosity_io::factors_out::parse_view3d_text("fuzz.txt", data);
});
