//! Pictures that go out: PNG for eyes, OpenEXR for numbers; whole or not at all.

use radiosity_scene::Bands;
use std::io::Cursor;

/// Why a picture could not be encoded.
#[derive(Debug, thiserror::Error)]
pub enum EncodeError {
    /// Width × height is not the number of pixels.
    #[error("{pixels} pixels for {width} x {height}")]
    Size {
        /// Pixels given.
        pixels: usize,
        /// Width.
        width: u32,
        /// Height.
        height: u32,
    },
    /// The encoder refuses.
    #[error(transparent)]
    Image(#[from] image::ImageError),
}

/// 8-bit RGB pixels, row-major from the top left, as PNG.
///
/// # Errors
/// [`EncodeError`].
pub fn encode_png(width: u32, height: u32, pixels: &[[u8; 3]]) -> Result<Vec<u8>, EncodeError> {
    let buffer = image::RgbImage::from_raw(width, height, pixels.as_flattened().to_vec()).ok_or(EncodeError::Size {
        pixels: pixels.len(),
        width,
        height,
    })?;
    let mut bytes = Cursor::new(Vec::new());
    buffer.write_to(&mut bytes, image::ImageFormat::Png)?;
    Ok(bytes.into_inner())
}

/// Linear RGB values, row-major from the top left, as OpenEXR (32-bit float).
///
/// # Errors
/// [`EncodeError`].
pub fn encode_exr(width: u32, height: u32, pixels: &[Bands]) -> Result<Vec<u8>, EncodeError> {
    let buffer = image::Rgb32FImage::from_raw(width, height, pixels.as_flattened().to_vec())
        .ok_or(EncodeError::Size { pixels: pixels.len(), width, height })?;
    let mut bytes = Cursor::new(Vec::new());
    buffer.write_to(&mut bytes, image::ImageFormat::OpenExr)?;
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
