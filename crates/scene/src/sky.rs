//! What a ray that escapes the scene sees: the luminance of the sky by direction.

use crate::{Bands, Texture};
use glam::DVec3;

/// The luminance of everything outside the scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Sky {
    /// Nothing: escaping light is lost.
    #[default]
    Black,
    /// The same luminance from every direction, the ground included: cd/m² per band.
    Uniform(Bands),
    /// CIE standard overcast sky (CIE S 011, type 16): L(γ) = L_z (1 + 2 sin γ)/3 above the horizon, nothing below;
    /// given by the horizontal illuminance E = 7π L_z/9 in lux per band.
    Overcast {
        /// Unobstructed horizontal illuminance, lux per band.
        horizontal: Bands,
    },
    /// An equirectangular picture, cd/m² per band: its middle row is the horizon, its middle column looks along −Z
    /// (for +Y up), its right half towards +X.
    Map {
        /// Width, pixels.
        width: usize,
        /// Height, pixels.
        height: usize,
        /// Row-major luminances from the top (zenith) down.
        pixels: Vec<Bands>,
    },
}

impl Sky {
    /// Whether the sky gives no light at all.
    pub fn is_black(&self) -> bool {
        match self {
            Sky::Black => true,
            Sky::Uniform(l) | Sky::Overcast { horizontal: l } => l.iter().all(|&x| x == 0.0),
            Sky::Map { pixels, .. } => pixels.iter().flatten().all(|&x| x == 0.0),
        }
    }

    /// Luminance (cd/m² per band) seen in the unit `direction`, where `up` is the unit zenith direction.
    pub fn luminance(&self, direction: DVec3, up: DVec3) -> Bands {
        match self {
            Sky::Black => [0.0; 3],
            Sky::Uniform(luminance) => *luminance,
            Sky::Overcast { horizontal } => {
                let sine = direction.dot(up);
                if sine <= 0.0 {
                    return [0.0; 3];
                }
                let per_illuminance = 9.0 / (7.0 * std::f64::consts::PI) * (1.0 + 2.0 * sine) / 3.0;
                horizontal.map(|e| e * per_illuminance as f32)
            }
            Sky::Map { width, height, pixels } => {
                // North is the direction of −Z when Y is up, and of +Y when Z is up.
                let north = if up.y.abs() > 0.5 { -DVec3::Z } else { DVec3::Y };
                let east = north.cross(up);
                let elevation = direction.dot(up).clamp(-1.0, 1.0).asin();
                let azimuth = direction.dot(east).atan2(direction.dot(north));
                let u = 0.5 + azimuth / std::f64::consts::TAU;
                let v = 0.5 - elevation / std::f64::consts::PI;
                let x = ((u * *width as f64) as usize).min(width - 1);
                let y = ((v * *height as f64) as usize).min(height - 1);
                pixels[y * width + x]
            }
        }
    }
}

impl Texture {
    /// Whether every texel is opaque.
    pub fn is_opaque(&self) -> bool {
        self.texels.iter().all(|t| t[3] == 255)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Catalogue 84: the overcast sky of horizontal illuminance E gives E on the ground and 0.396177 E on a wall.
    #[test]
    fn overcast_sky_gives_its_horizontal_illuminance() {
        let sky = Sky::Overcast { horizontal: [1.0; 3] };
        let (steps, mut ground, mut wall) = (400, 0.0, 0.0);
        for i in 0..steps {
            for j in 0..4 * steps {
                let gamma = (i as f64 + 0.5) / steps as f64 * std::f64::consts::FRAC_PI_2;
                let azimuth = (j as f64 + 0.5) / (4 * steps) as f64 * std::f64::consts::TAU;
                let direction = DVec3::new(gamma.cos() * azimuth.cos(), gamma.sin(), gamma.cos() * azimuth.sin());
                let solid_angle = gamma.cos()
                    * (std::f64::consts::FRAC_PI_2 / steps as f64)
                    * (std::f64::consts::TAU / (4 * steps) as f64);
                let luminance = f64::from(sky.luminance(direction, DVec3::Y)[1]);
                ground += luminance * direction.y * solid_angle;
                wall += luminance * direction.x.max(0.0) * solid_angle;
            }
        }
        assert!((ground - 1.0).abs() < 1e-4, "{ground}");
        assert!((wall - 0.396177).abs() < 1e-4, "{wall}");
    }
}
