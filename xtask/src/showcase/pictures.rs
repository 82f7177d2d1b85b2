//! Pictures drawn by formula: the planks of the floor, the weave of the rug, and what hangs on the wall.

use crate::fault::Fault;
use crate::hash::{lattice, noise};

/// Planks along u: one picture covers 3 × 2.25 m and repeats without a seam.
pub fn planks() -> Result<Vec<u8>, Fault> {
    const ROWS: i64 = 15;
    let (width, height) = (1024, 768);
    picture(width, height, |u, v| {
        let row = (v * ROWS as f64) as i64;
        // Every row has two planks of 1.5 m, shifted by its own share of a plank.
        let along = u * 2.0 + lattice([row, 7, 0]);
        let plank = (along.floor() as i64).rem_euclid(2);
        let across = (v * ROWS as f64).fract();
        let tone = lattice([row, plank, 1]);
        // Grain: long streaks that differ from plank to plank, bent by a slow wave.
        let (x, y) = (along.fract() * 6.0, across * 9.0 + 40.0 * tone);
        let bend = 2.0 * noise(x * 0.4, y * 0.15, tone * 31.0);
        let grain = 0.6 * noise(x * 0.5, (y + bend) * 1.3, tone * 57.0) + 0.4 * noise(x * 2.0, (y + bend) * 4.0, 3.0);
        let gap = edge(across, 0.018).min(edge(along.fract(), 0.0015));
        let shade = (0.82 + 0.22 * (tone - 0.5) + 0.34 * (grain - 0.5)) * (0.45 + 0.55 * gap);
        [0.50 * shade, 0.345 * shade, 0.215 * shade]
    })
}

/// 1 inside 0..1, falling to 0 within `width` of either end.
fn edge(x: f64, width: f64) -> f64 {
    (x.min(1.0 - x) / width).clamp(0.0, 1.0)
}

/// A woven rug, wide along u: cream with a border and rows of lozenges.
pub fn rug() -> Result<Vec<u8>, Fault> {
    let (cream, ink, rust) = ([0.66, 0.60, 0.50], [0.10, 0.17, 0.22], [0.50, 0.17, 0.09]);
    picture(768, 512, |u, v| {
        let (x, y) = (u * 3.0, v * 2.0);
        let rim = x.min(3.0 - x).min(y).min(2.0 - y);
        let lozenge = ((x / 0.5 + 0.5).rem_euclid(1.0) - 0.5).abs() + ((y / 0.5 + 0.5).rem_euclid(1.0) - 0.5).abs();
        let color = match rim {
            r if r < 0.05 => cream,
            r if r < 0.10 => ink,
            r if r < 0.13 => cream,
            r if r < 0.15 => rust,
            r if r < 0.22 => cream,
            _ if lozenge < 0.10 => rust,
            _ if (0.36..0.42).contains(&lozenge) => ink,
            _ => cream,
        };
        let thread = 0.93 + 0.14 * (noise(u * 300.0, v * 60.0, 5.0) - 0.5);
        color.map(|c| c * thread)
    })
}

/// Hills under a low sun.
pub fn hills() -> Result<Vec<u8>, Fault> {
    picture(320, 256, |u, v| {
        let sun = (u - 0.66).hypot((v - 0.36) * 0.8) < 0.13;
        let ridge = |base: f64, height: f64, pitch: f64, seed: f64| v > base - height * noise(u * pitch, 0.0, seed);
        match () {
            () if ridge(0.95, 0.28, 2.2, 11.0) => [0.05, 0.13, 0.14],
            () if ridge(0.80, 0.26, 3.0, 23.5) => [0.10, 0.28, 0.28],
            () if ridge(0.66, 0.22, 3.6, 37.2) => [0.30, 0.47, 0.42],
            () if sun => [0.80, 0.33, 0.12],
            () => [0.78 - 0.1 * v, 0.66 - 0.25 * v, 0.50 - 0.3 * v],
        }
    })
}

/// Four discs and a bar.
pub fn discs() -> Result<Vec<u8>, Fault> {
    let discs = [
        (0.38, 0.34, 0.24, [0.62, 0.20, 0.10]),
        (0.66, 0.48, 0.19, [0.75, 0.50, 0.14]),
        (0.34, 0.72, 0.15, [0.07, 0.24, 0.30]),
        (0.70, 0.82, 0.08, [0.05, 0.06, 0.08]),
    ];
    picture(256, 320, |u, v| {
        let on = |&&(x, y, r, _): &&(f64, f64, f64, [f64; 3])| (u - x).hypot((v - y) * 1.25) < r;
        match discs.iter().rfind(on) {
            Some(disc) => disc.3,
            None if (v - 0.585).abs() < 0.006 && (0.12..0.9).contains(&u) => [0.05, 0.06, 0.08],
            None => [0.72, 0.68, 0.60],
        }
    })
}

/// An sRGB PNG of linear reflectances by (u, v), v downwards.
fn picture(width: u32, height: u32, color: impl Fn(f64, f64) -> [f64; 3]) -> Result<Vec<u8>, Fault> {
    let mut texels = Vec::with_capacity((3 * width * height) as usize);
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        // Two by two samples a texel soften the edges of the drawings.
        let mut sum = [0.0; 3];
        for (dx, dy) in [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)] {
            let c = color((f64::from(x) + dx) / f64::from(width), (f64::from(y) + dy) / f64::from(height));
            sum = std::array::from_fn(|i| sum[i] + c[i] / 4.0);
        }
        texels.extend(sum.map(srgb));
    }
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header()?.write_image_data(&texels)?;
    Ok(file)
}

/// The byte of a linear value (IEC 61966-2-1).
fn srgb(linear: f64) -> u8 {
    let x = linear.clamp(0.0, 1.0);
    let s = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (255.0 * s).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(file: &[u8]) -> (u32, u32, Vec<u8>) {
        let mut reader = png::Decoder::new(std::io::Cursor::new(file)).read_info().expect("a PNG");
        let mut texels = vec![0; reader.output_buffer_size().expect("a size")];
        let info = reader.next_frame(&mut texels).expect("its texels");
        (info.width, info.height, texels)
    }

    /// A living-room floor of oak reflects about a third (CIBSE LG11, table of reflectances: 0.25–0.4).
    #[test]
    fn planks_reflect_as_wood_does() {
        let (width, height, texels) = decoded(&planks().expect("drawn"));
        let linear = |s: u8| (f64::from(s) / 255.0).powf(2.2);
        let luminance: f64 =
            texels.chunks(3).map(|t| 0.2126 * linear(t[0]) + 0.7152 * linear(t[1]) + 0.0722 * linear(t[2])).sum();
        let mean = luminance / f64::from(width * height);
        assert!((0.25..0.4).contains(&mean), "{mean}");
    }

    #[test]
    fn bytes_are_those_of_srgb() {
        // 0.215861 is the linear value of the middle grey 128 / 255.
        assert_eq!([srgb(0.0), srgb(0.215_861), srgb(1.0), srgb(7.0)], [0, 128, 255, 255]);
    }
}
