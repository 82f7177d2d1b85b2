//! Files that go out: checked before the work, written whole after it.

use crate::Failure;
use radiosity::io::image_out::{encode_exr, encode_png, save};
use radiosity::{Camera, Picture, Scene, Tracer};
use std::path::Path;

/// Refuses, before hours of work, what could not be written after it.
pub fn check(path: &Path, extensions: &[&str]) -> Result<(), Failure> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    if !extensions.contains(&extension.as_str()) {
        let wanted = extensions.iter().map(|e| format!(".{e}")).collect::<Vec<_>>().join(" or ");
        return Err(Failure::input(format!("{}: the name must end in {wanted}", path.display())));
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if let Err(error) = std::fs::create_dir_all(folder) {
        return Err(Failure::input(format!("{}: the folder cannot be made: {error}", folder.display())));
    }
    if path.is_dir() {
        return Err(Failure::input(format!("{}: is a folder", path.display())));
    }
    Ok(())
}

/// Writes bytes whole or not at all.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    save(path, bytes).map_err(Failure::work)
}

/// Writes a picture as its name's ending says.
pub fn write_picture(path: &Path, picture: &Picture, exposure: Option<f64>) -> Result<(), Failure> {
    let exr = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
    let bytes = if exr {
        encode_exr(picture.width, picture.height, &picture.pixels).map_err(Failure::work)?
    } else {
        png(picture, exposure)?
    };
    write(path, &bytes)
}

/// A tone-mapped picture as PNG bytes; exposed by itself where no exposure is given.
pub fn png(picture: &Picture, exposure: Option<f64>) -> Result<Vec<u8>, Failure> {
    let pixels = picture.tone_mapped(exposure.unwrap_or_else(|| picture.exposure()));
    encode_png(picture.width, picture.height, &pixels).map_err(Failure::work)
}

/// The camera that was asked for by name or number, else the first, else one that is placed well.
pub fn camera(scene: &Scene, tracer: &Tracer, wanted: Option<&str>) -> Result<Camera, Failure> {
    let Some(wanted) = wanted else {
        return Ok(scene.cameras.first().cloned().unwrap_or_else(|| radiosity::place_camera(tracer)));
    };
    let by_name = scene.cameras.iter().find(|c| c.name == wanted);
    let by_number = wanted.parse::<usize>().ok().and_then(|n| scene.cameras.get(n));
    by_name.or(by_number).cloned().ok_or_else(|| {
        let names: Vec<String> = scene.cameras.iter().enumerate().map(|(i, c)| format!("{i} '{}'", c.name)).collect();
        let there = if names.is_empty() { "it has none".to_owned() } else { format!("it has {}", names.join(", ")) };
        Failure::input(format!("--camera {wanted}: the scene has no such camera; {there}"))
    })
}

/// Width and height for a camera: as asked, else of 1280 pixels' width or height by its aspect.
pub fn picture_size(camera: &Camera, asked: Option<(u32, u32)>) -> (u32, u32) {
    asked.unwrap_or_else(|| match camera.aspect {
        Some(aspect) if aspect.is_finite() && aspect > 0.0 => {
            let height = (1280.0 * 720.0 / aspect).sqrt().clamp(16.0, 4096.0);
            ((height * aspect).round().clamp(16.0, 8192.0) as u32, height.round() as u32)
        }
        _ => (1280, 720),
    })
}
