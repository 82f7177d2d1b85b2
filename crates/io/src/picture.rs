//! PNG and JPEG to texels, with limits set before anything is decoded.

use image::{ImageFormat, ImageReader, Limits};
use radiosity_scene::Texture;
use std::io::Cursor;

/// Longest side of a picture. Twice the largest texture that graphics cards commonly take; at the full square of it
/// a picture takes 1 GiB.
const MAX_SIDE: u32 = 16_384;

/// Texels of all pictures of a scene together: 2 GiB. A 2 MB file of one colour can ask for 1 GiB, and a scene can
/// name many of them; the largest scenes in common use carry half of this.
pub(crate) const MAX_TEXELS: u64 = 1 << 29;

/// Decodes a picture. Takes its texels off `budget`, also where it turns out damaged: trying took the time and memory.
pub(crate) fn decode(name: &str, bytes: &[u8], budget: &mut u64) -> Result<Texture, String> {
    let format = image::guess_format(bytes).ok();
    let format = format.filter(|f| matches!(f, ImageFormat::Png | ImageFormat::Jpeg)).ok_or("neither PNG nor JPEG")?;
    let reader = |bytes| {
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        reader.limits(limits());
        reader
    };
    let (width, height) = reader(bytes).into_dimensions().map_err(|error| error.to_string())?;
    if width > MAX_SIDE || height > MAX_SIDE || width == 0 || height == 0 {
        return Err(format!("{width} x {height} texels; between 1 and {MAX_SIDE} a side can be used"));
    }
    let count = u64::from(width) * u64::from(height);
    if count > *budget {
        return Err(format!("{width} x {height} texels; all pictures together may have {MAX_TEXELS}"));
    }
    *budget -= count;
    let decoded = reader(bytes).decode().map_err(|error| error.to_string())?.into_rgba8();
    let texels = decoded.pixels().map(|pixel| pixel.0).collect();
    Ok(Texture { name: name.to_owned(), width, height, texels })
}

fn limits() -> Limits {
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    // 16 bits in four channels at the full size.
    limits.max_alloc = Some(8 * u64::from(MAX_SIDE) * u64::from(MAX_SIDE));
    limits
}

#[cfg(test)]
mod tests {
    use super::*;

    fn png(width: u32, height: u32) -> Vec<u8> {
        let picture = image::RgbaImage::from_fn(width, height, |x, y| image::Rgba([x as u8, y as u8, 7, 200]));
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, ImageFormat::Png).unwrap();
        bytes.into_inner()
    }

    /// A file may hold thousands of damaged pictures of a gigabyte each.
    #[test]
    fn damaged_pictures_count_as_well() {
        let bytes = png(30, 20);
        let mut budget = 1000;
        assert!(decode("t", &bytes[..bytes.len() / 2], &mut budget).is_err());
        assert_eq!(budget, 400);
        assert!(decode("t", &bytes, &mut budget).unwrap_err().contains("all pictures together"));
    }

    #[test]
    fn decodes_in_rows_from_the_top_and_counts_texels() {
        let mut budget = 10;
        let texture = decode("t", &png(3, 2), &mut budget).unwrap();
        assert_eq!((texture.width, texture.height, budget), (3, 2, 4));
        assert_eq!(texture.texels[5], [2, 1, 7, 200]);
        assert!(decode("t", &png(3, 2), &mut budget).unwrap_err().contains("all pictures together"));
    }

    #[test]
    fn a_header_that_promises_too_much_is_refused_unread() {
        let mut bytes = png(1, 1);
        bytes[16..24].copy_from_slice(&[0, 1, 0, 0, 0, 1, 0, 0]);
        assert!(decode("t", &bytes, &mut MAX_TEXELS.clone()).is_err());
        assert!(decode("t", b"GIF89a", &mut MAX_TEXELS.clone()).unwrap_err().contains("neither"));
    }
}
