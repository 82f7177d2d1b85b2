//! Equirectangular sky pictures: Radiance .hdr and OpenEXR, told apart by their first bytes.
//!
//! Pixel values are luminances in cd/m² per band as they stand; of a Radiance picture the EXPOSURE its header
//! records is taken out again. Negative values, which filters leave behind, count as 0.

use crate::LoadError;
use crate::source::read_plain_file;
use image::codecs::hdr::HdrDecoder;
use image::{DynamicImage, ImageFormat, ImageReader, Limits};
use radiosity_scene::{Scene, Sky, counted};
use std::io::Cursor;
use std::path::Path;

/// Most pixels of a sky: 16,384 x 8,192, whose pixel is 1/24 of the sun's disc across; it takes 1.6 GB.
const MAX_PIXELS: u64 = 16_384 * 8_192;

/// Reads a sky from a file into a scene, whose zenith is known by then. Suns in it become directional lights of the scene,
/// as [`Scene::set_sky`] has it: what they light is exact, and their shadows have sharp edges.
pub fn load_sky_hdr(path: &Path, scene: &mut Scene) -> Result<(), LoadError> {
    let bytes = read_plain_file(path).map_err(|error| LoadError::Io { path: path.to_owned(), error })?;
    let file = path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned());
    scene.set_sky(parse_sky(&file, &bytes)?, &file);
    Ok(())
}

/// The sky in a file's bytes with its suns still in it; `file` is the name for messages.
pub fn parse_sky(file: &str, bytes: &[u8]) -> Result<Sky, LoadError> {
    // The EXR decoder (exr 1.74) asserts where it should report (damaged B44 data bring it down). It holds no
    // state and no unsafe code, so a caught panic leaves nothing behind.
    std::panic::catch_unwind(|| parse(file, bytes)).unwrap_or_else(|_| {
        Err(LoadError::one(file, "cannot be decoded: the decoder gave up", "the file is damaged; export it again"))
    })
}

fn parse(file: &str, bytes: &[u8]) -> Result<Sky, LoadError> {
    let wrong = |what: String, hint: &str| LoadError::one(file, what, hint);
    let format = image::guess_format(bytes).ok();
    let Some(format) = format.filter(|f| matches!(f, ImageFormat::Hdr | ImageFormat::OpenExr)) else {
        return Err(wrong("neither a Radiance nor an OpenEXR picture".to_owned(), "a sky is an .hdr or .exr file"));
    };
    let reader = || {
        let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
        let mut limits = Limits::default();
        // Four channels of 32 bits.
        limits.max_alloc = Some(16 * MAX_PIXELS);
        reader.limits(limits);
        reader
    };
    let damaged = |error: image::ImageError| wrong(format!("cannot be decoded: {error}"), "the file is damaged");
    let (width, height) = reader().into_dimensions().map_err(damaged)?;
    let count = u64::from(width) * u64::from(height);
    if count == 0 || count > MAX_PIXELS {
        let what = format!("{width} x {height} pixels; at most {MAX_PIXELS} in all can be used");
        return Err(wrong(what, "scale it down"));
    }
    // A picture of nothing may compress a thousandfold, not a millionfold.
    if count / 100_000 > bytes.len() as u64 {
        return Err(wrong(format!("{width} x {height} pixels in {} bytes", bytes.len()), "the file is damaged"));
    }
    let exposure = match format {
        ImageFormat::Hdr => HdrDecoder::new(Cursor::new(bytes)).map_err(damaged)?.metadata().exposure.unwrap_or(1.0),
        _ => 1.0,
    };
    if !(exposure.is_finite() && exposure > 0.0) {
        return Err(wrong(format!("its EXPOSURE is {exposure}"), "it must be above 0"));
    }
    let decoded: DynamicImage = reader().decode().map_err(damaged)?;
    let pixels: Vec<[f32; 3]> = decoded.into_rgb32f().pixels().map(|p| p.0.map(|v| v / exposure)).collect();
    let bad = pixels.iter().filter(|p| p.iter().any(|v| !v.is_finite())).count();
    if bad > 0 {
        return Err(wrong(
            format!("{} not finite", counted(bad, "pixel is", "pixels are")),
            "export it again, or clip its highlights",
        ));
    }
    let pixels = pixels.into_iter().map(|p| p.map(|v| v.max(0.0))).collect();
    Ok(Sky::Map { width: width as usize, height: height as usize, pixels })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn encoded(format: ImageFormat) -> Vec<u8> {
        let picture = image::Rgb32FImage::from_fn(8, 4, |x, y| image::Rgb([2.0 * x as f32, y as f32, 1000.0]));
        let mut bytes = Cursor::new(Vec::new());
        DynamicImage::ImageRgb32F(picture).write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn both_formats_give_luminances_by_direction() {
        for format in [ImageFormat::Hdr, ImageFormat::OpenExr] {
            let sky = parse_sky("s", &encoded(format)).unwrap();
            // The middle column looks along −Z, its right half towards +X; the top row is the zenith.
            let up = sky.luminance(DVec3::Y, DVec3::Y);
            let east_of_north = sky.luminance(DVec3::new(0.1, 0.1, -1.0).normalize(), DVec3::Y);
            // RGBE shares one exponent: 1000 leaves steps of 4.
            assert!((up[1] - 0.0).abs() < 4.0 && (up[2] - 1000.0).abs() < 4.0, "{up:?}");
            assert!((east_of_north[0] - 8.0).abs() < 4.0, "{east_of_north:?}");
        }
    }

    #[test]
    fn a_sun_in_the_file_becomes_a_light() {
        let (width, height) = (128, 64);
        let picture = image::Rgb32FImage::from_fn(width, height, |x, y| {
            image::Rgb(if (x, y) == (64, 20) { [3e7, 2e7, 1e7] } else { [1000.0; 3] })
        });
        let path = std::env::temp_dir().join(format!("radiosity-sun-{}.exr", std::process::id()));
        DynamicImage::ImageRgb32F(picture).save_with_format(&path, ImageFormat::OpenExr).unwrap();
        let mut scene = Scene::default();
        let result = load_sky_hdr(&path, &mut scene);
        std::fs::remove_file(&path).unwrap();
        result.unwrap();
        let [sun] = scene.lights.as_slice() else { panic!("{:?}", scene.lights) };
        assert!(sun.name.starts_with("sun of radiosity-sun-"), "{}", sun.name);
        // The pixel lies between elevations of 30.94° and 33.75°, just right of the middle, which looks along −Z.
        let solid_angle = (33.75f64.to_radians().sin() - 30.9375f64.to_radians().sin()) * std::f64::consts::TAU / 128.0;
        let towards = DVec3::new(0.0246, 0.6374, -1.0).normalize();
        assert!((-sun.direction).angle_between(towards) < 0.01, "{}", sun.direction);
        for (e, l) in sun.intensity.iter().zip([3e7, 2e7, 1e7]) {
            assert!((f64::from(*e) / ((l - 1000.0) * solid_angle) - 1.0).abs() < 1e-3, "{e}");
        }
        assert_eq!(scene.sky.luminance(towards, DVec3::Y), [1000.0; 3]);
    }

    #[test]
    fn the_recorded_exposure_is_taken_out() {
        let plain = encoded(ImageFormat::Hdr);
        let at = plain.windows(2).position(|pair| pair == b"\n\n").unwrap();
        let exposed = [&plain[..at], b"\nEXPOSURE=2.0".as_slice(), &plain[at..]].concat();
        let [a, b] = [&plain, &exposed].map(|bytes| parse_sky("s", bytes).unwrap().luminance(DVec3::Y, DVec3::Y)[2]);
        assert_eq!(a, 2.0 * b);
    }

    #[test]
    fn what_is_no_sky_is_refused() {
        for bytes in [&b""[..], b"#?RADIANCE\n", b"\x76\x2f\x31\x01", b"\x89PNG\r\n\x1a\n"] {
            assert!(parse_sky("s", bytes).is_err());
        }
        let bomb = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 60000 +X 60000\n";
        assert!(parse_sky("s", bomb).unwrap_err().to_string().contains("60000 x 60000"));
        let mut cut = encoded(ImageFormat::Hdr);
        cut.truncate(cut.len() / 2);
        assert!(parse_sky("s", &cut).is_err());
    }
}
