use radiosity::session::SessionOptions;

/// As coarse as tests of all that happens can do with.
pub fn small() -> SessionOptions {
    SessionOptions { elements: 900, rays: 128, shadow_rays: Some(16), places: 4000, ..SessionOptions::default() }
}
