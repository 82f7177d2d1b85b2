//! Pictures that go out: PNG for eyes, OpenEXR for numbers; whole or not at all.

use radiosity_scene::Bands;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// Why a file was not written.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// The system refused.
    #[error("{}: cannot be written: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        #[source]
        error: std::io::Error,
    },
    /// The picture could not be encoded.
    #[error("{}: cannot be encoded: {what}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
}

/// Writes bytes to a file through a temporary one beside it, so that no half-written file is ever seen.
///
/// # Errors
/// [`SaveError::Io`].
pub fn save(path: &Path, bytes: &[u8]) -> Result<(), SaveError> {
    let mut name = path.file_name().unwrap_or_default().to_os_string();
    name.push(format!(".{}.tmp", std::process::id()));
    let temporary = path.with_file_name(name);
    let written = std::fs::write(&temporary, bytes).and_then(|()| std::fs::rename(&temporary, path));
    written.map_err(|error| {
        // Nothing is left behind; that the removal may fail as well changes nothing for the caller.
        let _ = std::fs::remove_file(&temporary);
        SaveError::Io { path: path.to_owned(), error }
    })
}

/// 8-bit RGB pixels, row-major from the top left, as PNG.
///
/// # Errors
/// A description, if the size does not fit the pixels.
pub fn encode_png(width: u32, height: u32, pixels: &[[u8; 3]]) -> Result<Vec<u8>, String> {
    let buffer = image::RgbImage::from_raw(width, height, pixels.as_flattened().to_vec())
        .ok_or_else(|| format!("{} pixels for {width} x {height}", pixels.len()))?;
    let mut bytes = Cursor::new(Vec::new());
    buffer.write_to(&mut bytes, image::ImageFormat::Png).map_err(|e| e.to_string())?;
    Ok(bytes.into_inner())
}

/// Linear RGB values, row-major from the top left, as OpenEXR (32-bit float).
///
/// # Errors
/// A description, if the size does not fit the pixels.
pub fn encode_exr(width: u32, height: u32, pixels: &[Bands]) -> Result<Vec<u8>, String> {
    let buffer = image::Rgb32FImage::from_raw(width, height, pixels.as_flattened().to_vec())
        .ok_or_else(|| format!("{} pixels for {width} x {height}", pixels.len()))?;
    let mut bytes = Cursor::new(Vec::new());
    buffer.write_to(&mut bytes, image::ImageFormat::OpenExr).map_err(|e| e.to_string())?;
    Ok(bytes.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_come_back_as_they_went_out() {
        let linear: Vec<Bands> = (0..12).map(|i| [i as f32 * 1000.0, 0.5, 1e-4]).collect();
        let exr = image::load_from_memory(&encode_exr(4, 3, &linear).unwrap()).unwrap().to_rgb32f();
        assert_eq!(exr.as_raw(), linear.as_flattened());
        let bytes: Vec<[u8; 3]> = (0..12).map(|i| [i, 255 - i, 7]).collect();
        let png = image::load_from_memory(&encode_png(4, 3, &bytes).unwrap()).unwrap().to_rgb8();
        assert_eq!(png.as_raw(), bytes.as_flattened());
        assert!(encode_png(5, 3, &bytes).is_err());
    }
}
