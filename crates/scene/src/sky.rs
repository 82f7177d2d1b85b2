//! What a ray that escapes the scene sees: the luminance of the sky by direction.

use crate::Bands;
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
                let [north, east] = horizon(up);
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

/// The sky cut into patches of equal solid angle: rows of equal height in the sine of the elevation, each cut into
/// equal azimuths. A ray that escapes carries the number of the patch it ran into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyPatches {
    rows: usize,
    columns: usize,
    up: DVec3,
}

impl SkyPatches {
    /// As many patches as a sky needs: one where it is uniform, rings where it depends on elevation alone.
    pub fn new(sky: &Sky, up: DVec3) -> SkyPatches {
        let (rows, columns) = match sky {
            Sky::Black | Sky::Uniform(_) => (1, 1),
            // Rings below the horizon stay dark; 128 keep the step between neighbours below 2 % of the zenith.
            Sky::Overcast { .. } => (128, 1),
            Sky::Map { .. } => (64, 128),
        };
        SkyPatches { rows, columns, up }
    }

    /// Number of patches.
    pub fn len(&self) -> usize {
        self.rows * self.columns
    }

    /// Never: there is at least one.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The patch that a unit direction runs into.
    #[inline]
    pub fn at(&self, direction: DVec3) -> usize {
        if self.rows == 1 {
            return 0;
        }
        let row = (0.5 * (1.0 - direction.dot(self.up)) * self.rows as f64) as usize;
        let row = row.min(self.rows - 1);
        if self.columns == 1 {
            return row;
        }
        let [north, east] = horizon(self.up);
        let turn = direction.dot(east).atan2(direction.dot(north)) / std::f64::consts::TAU + 0.5;
        row * self.columns + ((turn * self.columns as f64) as usize).min(self.columns - 1)
    }

    /// Mean radiosity π L of each patch (lm/m² per band), from 8 × 8 directions each.
    pub fn radiosity(&self, sky: &Sky) -> Vec<Bands> {
        const N: usize = 8;
        let [north, east] = horizon(self.up);
        (0..self.len())
            .map(|patch| {
                let (row, column) = (patch / self.columns, patch % self.columns);
                let mut sum = [0.0f64; 3];
                for k in 0..N * N {
                    let (i, j) = ((k % N) as f64 + 0.5, (k / N) as f64 + 0.5);
                    let sine = 1.0 - 2.0 * (row as f64 + j / N as f64) / self.rows as f64;
                    let azimuth = ((column as f64 + i / N as f64) / self.columns as f64 - 0.5) * std::f64::consts::TAU;
                    let cosine = (1.0 - sine * sine).max(0.0).sqrt();
                    let direction = cosine * (azimuth.cos() * north + azimuth.sin() * east) + sine * self.up;
                    for (sum, l) in sum.iter_mut().zip(sky.luminance(direction, self.up)) {
                        *sum += f64::from(l);
                    }
                }
                sum.map(|s| (s / (N * N) as f64 * std::f64::consts::PI) as f32)
            })
            .collect()
    }
}

/// North and east on the horizon: −Z and +X when Y is up, +Y and +X when Z is up.
fn horizon(up: DVec3) -> [DVec3; 2] {
    let north = if up.y.abs() > 0.5 { -DVec3::Z } else { DVec3::Y };
    [north, north.cross(up)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_tell_directions_apart_and_keep_the_mean() {
        let (width, height) = (256, 128);
        let pixels = (0..width * height).map(|i| [(i % width) as f32, (i / width) as f32, 1.0]).collect();
        let sky = Sky::Map { width, height, pixels };
        for up in [DVec3::Y, DVec3::Z] {
            let patches = SkyPatches::new(&sky, up);
            let radiosity = patches.radiosity(&sky);
            for direction in [DVec3::new(0.3, 0.5, -0.7), DVec3::new(-0.9, -0.2, 0.1), DVec3::new(0.1, -0.1, 0.9)] {
                let direction = direction.normalize();
                let (own, exact) = (radiosity[patches.at(direction)], sky.luminance(direction, up));
                for band in 0..3 {
                    let difference = (own[band] / std::f32::consts::PI - exact[band]).abs();
                    assert!(difference < 4.0, "{up} {direction}: {own:?} for {exact:?}");
                }
            }
        }
    }

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
