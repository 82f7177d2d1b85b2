//! Pictures on surfaces: 8-bit texels as files carry them, decoded when looked up.

use crate::display::linear;
use glam::DVec2;
use std::sync::LazyLock;

/// What happens outside 0..1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The picture repeats (glTF's default).
    #[default]
    Repeat,
    /// The picture repeats, every other time mirrored.
    Mirror,
    /// The border texel goes on.
    Clamp,
}

impl Wrap {
    fn index(self, i: i64, size: i64) -> usize {
        let i = match self {
            Wrap::Repeat => i.rem_euclid(size),
            Wrap::Clamp => i.clamp(0, size - 1),
            Wrap::Mirror => {
                let j = i.rem_euclid(2 * size);
                if j < size { j } else { 2 * size - 1 - j }
            }
        };
        i as usize
    }
}

/// A picture of RGBA texels, 8 bits each, row-major from the top (glTF: v = 0 is the top row).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Texture {
    /// Name or address, for messages.
    pub name: String,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
    /// `width * height` texels.
    pub texels: Vec<[u8; 4]>,
}

/// Linear value of each sRGB byte (IEC 61966-2-1).
static LINEAR_FROM_SRGB: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| linear(i as f64 / 255.0) as f32));

impl Texture {
    /// Whether every texel is opaque.
    pub fn is_opaque(&self) -> bool {
        self.texels.iter().all(|t| t[3] == 255)
    }

    /// Look-up at `uv`, bilinear or of the `nearest` texel. Colour is decoded from sRGB when `srgb`; alpha never is. All in
    /// 0..1.
    pub fn sample(&self, uv: DVec2, wrap: [Wrap; 2], nearest: bool, srgb: bool) -> [f32; 4] {
        let (w, h) = (i64::from(self.width), i64::from(self.height));
        // After the product, which may overflow where `uv` does not.
        let finite = |x: f64| if x.is_finite() { x } else { 0.0 };
        let (x, y) = (finite(uv.x * w as f64), finite(uv.y * h as f64));
        let [x, y] = if nearest { [x.floor(), y.floor()] } else { [x - 0.5, y - 0.5] };
        let (x0, y0) = (x.floor(), y.floor());
        let (fx, fy) = ((x - x0) as f32, (y - y0) as f32);
        let mut sum = [0.0; 4];
        for (dx, dy, weight) in
            [(0, 0, (1.0 - fx) * (1.0 - fy)), (1, 0, fx * (1.0 - fy)), (0, 1, (1.0 - fx) * fy), (1, 1, fx * fy)]
        {
            let column = wrap[0].index((x0 as i64).saturating_add(dx), w);
            let row = wrap[1].index((y0 as i64).saturating_add(dy), h);
            let texel = self.texels[row * self.width as usize + column];
            for (channel, value) in sum.iter_mut().enumerate() {
                let decoded = if srgb && channel < 3 {
                    LINEAR_FROM_SRGB[usize::from(texel[channel])]
                } else {
                    f32::from(texel[channel]) / 255.0
                };
                *value += weight * decoded;
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chequer of two texels has two colours where texels are squares, and all between them where they are blended.
    #[test]
    fn nearest_texels_are_squares() {
        let texels = vec![[0; 4], [255; 4]];
        let texture = Texture { name: "t".to_owned(), width: 2, height: 1, texels };
        let at = |u: f64, nearest: bool| texture.sample(DVec2::new(u, 0.5), [Wrap::Repeat; 2], nearest, false)[0];
        assert_eq!([0.0, 0.49, 0.51, 0.99, 1.1, -0.1].map(|u| at(u, true)), [0.0, 0.0, 1.0, 1.0, 0.0, 1.0]);
        assert!((at(0.5, false) - 0.5).abs() < 1e-6);
    }

    /// KHR_texture_transform may move by 1e308: 64 times that is infinite, and its fraction was no number.
    #[test]
    fn coordinates_that_overflow_have_a_colour() {
        let texture = Texture { name: "t".to_owned(), width: 64, height: 64, texels: vec![[128; 4]; 64 * 64] };
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for u in [1e308, -1e308, 1e300, f64::MAX, f64::NAN, f64::INFINITY] {
                let [r, ..] = texture.sample(DVec2::new(u, 0.5), [wrap; 2], false, false);
                assert!((r - 128.0 / 255.0).abs() < 1e-6, "{r} at {u}, {wrap:?}");
            }
        }
    }
}
