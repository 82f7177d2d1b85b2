//! What a ray that escapes the scene sees: the luminance of the sky by direction.

use crate::{Bands, PointLight, PointLightKind, luminance};
use glam::DVec3;
use std::f64::consts::PI;

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

    /// Illuminance of open level ground, lux per band; exact for maps as well, whose pixels are L ∫ sin γ dω bright.
    pub fn horizontal(&self) -> Bands {
        match self {
            Sky::Black => [0.0; 3],
            Sky::Uniform(luminance) => luminance.map(|l| (PI * f64::from(l)) as f32),
            Sky::Overcast { horizontal } => *horizontal,
            Sky::Map { width, height, pixels } => {
                let square = |row: usize| (0.5 * PI - PI * row as f64 / *height as f64).max(0.0).sin().powi(2);
                let mut sum = [0f64; 3];
                for (row, pixels) in pixels.chunks_exact(*width).enumerate() {
                    let weight = PI / *width as f64 * (square(row) - square(row + 1));
                    for pixel in pixels {
                        (0..3).for_each(|band| sum[band] += weight * f64::from(pixel[band]));
                    }
                }
                sum.map(|sum| sum as f32)
            }
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

/// A spot of a map is looked at if it is brighter than this many times the map's mean, or than that doubled once or
/// more. A spot of [`SUN_RADIUS`] that is fainter has less than 4 % of the light, and rays that meet it now and then make
/// no more noise than a window.
const BRIGHT: f64 = 50.0;

/// Half angle of what is small enough to be a sun, radians: 0.01 sr. Real suns are 0.0047; pictures smear them out.
const SUN_RADIUS: f64 = 0.0565;

/// Least share of a map's light that makes a spot a sun. Rays find 0.01 sr once in 300 times: a spot with 1 % of the
/// light then adds 20 % to the noise of a single ray, and more the smaller it is.
const SUN_SHARE: f64 = 0.01;

impl Sky {
    /// Takes the suns out of a map: spots of at most 0.01 sr, far brighter than the rest, that carry more than 1 % of
    /// its light become directional lights, called `name`, and their pixels continue the surroundings.
    ///
    /// Rays from surfaces would meet a sun once in fifty thousand times, and neither their mean nor that of a referee
    /// would be worth anything. Every surface that sees the whole of a spot keeps its irradiance. What is lost is the
    /// spot's extent: shadows have sharp edges, where the real sun's penumbra is 0.5° wide (9 mm for each metre from the
    /// edge), and a sun on the horizon counts in full or not at all.
    pub fn take_suns(&mut self, name: &str, up: DVec3) -> Vec<PointLight> {
        let Sky::Map { width, height, pixels } = self else { return Vec::new() };
        let grid = Grid { width: *width, height: *height, up };
        let flux: f64 = (0..grid.height)
            .map(|y| {
                let row = &pixels[y * grid.width..][..grid.width];
                grid.solid_angle(y) * row.iter().map(|l| f64::from(luminance(*l))).sum::<f64>()
            })
            .sum();
        let mut threshold = BRIGHT * flux / (4.0 * PI);
        let mut bright: Vec<usize> =
            (0..pixels.len()).filter(|&i| f64::from(luminance(pixels[i])) > threshold).collect();
        let mut state = vec![Mark::Dark; pixels.len()];
        let mut suns = Vec::new();
        loop {
            // Spots that are too large may have a small core, so the threshold rises until nothing is above.
            bright.retain(|&i| {
                let above = f64::from(luminance(pixels[i])) > threshold;
                state[i] = if above { Mark::Bright } else { Mark::Dark };
                above
            });
            if bright.is_empty() {
                return suns;
            }
            for &seed in &bright {
                if state[seed] == Mark::Bright {
                    let (spot, rim) = grid.spot(seed, &mut state);
                    suns.extend(grid.sun(&spot, &rim, pixels, SUN_SHARE * flux, name));
                }
            }
            threshold *= 2.0;
        }
    }
}

/// What is known of a pixel while spots are looked for.
#[derive(Clone, Copy, PartialEq)]
enum Mark {
    Dark,
    Bright,
    /// Bright, and part of a spot already.
    Taken,
}

/// The pixels of a map as pieces of the sphere.
struct Grid {
    width: usize,
    height: usize,
    up: DVec3,
}

impl Grid {
    /// Elevation of the upper edge of a row.
    fn elevation(&self, y: usize) -> f64 {
        PI * (0.5 - y as f64 / self.height as f64)
    }

    /// Solid angle of a pixel of a row, sr.
    fn solid_angle(&self, y: usize) -> f64 {
        (self.elevation(y).sin() - self.elevation(y + 1).sin()) * 2.0 * PI / self.width as f64
    }

    /// ∫ω dω over a pixel: what it gives to a surface with normal n is its luminance times n · this.
    fn vector(&self, pixel: usize) -> DVec3 {
        let (x, y) = (pixel % self.width, pixel / self.width);
        let azimuth = |x: usize| 2.0 * PI * (x as f64 / self.width as f64 - 0.5);
        let (left, right) = (azimuth(x), azimuth(x + 1));
        let (top, bottom) = (self.elevation(y), self.elevation(y + 1));
        let level = 0.5 * (top - bottom) + 0.25 * ((2.0 * top).sin() - (2.0 * bottom).sin());
        let upright = 0.5 * (top.sin().powi(2) - bottom.sin().powi(2));
        let [north, east] = horizon(self.up);
        level * ((right.sin() - left.sin()) * north + (left.cos() - right.cos()) * east)
            + upright * (right - left) * self.up
    }

    /// The pixels around one. The map closes at ±180°, and the pixels of its first and last row meet at the poles.
    fn neighbours(&self, pixel: usize) -> impl Iterator<Item = usize> {
        let (w, h) = (self.width, self.height);
        let (x, y) = (pixel % w, pixel / w);
        (0..9).filter(|k| *k != 4).map(move |k| {
            let (x, y) = (x + w + k % 3 - 1, (y + k / 3).checked_sub(1).filter(|y| *y < h));
            y.map_or(pixel / w * w + (x + w / 2) % w, |y| y * w + x % w)
        })
    }

    /// The connected bright pixels about one, which are marked as taken, and the pixels that surround them.
    fn spot(&self, seed: usize, state: &mut [Mark]) -> (Vec<usize>, Vec<usize>) {
        let (mut spot, mut rim) = (vec![seed], Vec::new());
        state[seed] = Mark::Taken;
        let mut next = 0;
        while next < spot.len() {
            for i in self.neighbours(spot[next]) {
                match state[i] {
                    Mark::Bright => {
                        state[i] = Mark::Taken;
                        spot.push(i);
                    }
                    Mark::Dark => rim.push(i),
                    Mark::Taken => {}
                }
            }
            next += 1;
        }
        rim.sort_unstable();
        rim.dedup();
        (spot, rim)
    }

    /// Turns a spot into a light if it is small and gives more than `least` (cd/m² sr) beyond its surroundings.
    fn sun(&self, spot: &[usize], rim: &[usize], pixels: &mut [Bands], least: f64, name: &str) -> Option<PointLight> {
        let mut mean = [0f64; 3];
        let whole: f64 = rim.iter().map(|&i| self.solid_angle(i / self.width)).sum();
        for &i in rim {
            let share = self.solid_angle(i / self.width) / whole;
            (0..3).for_each(|band| mean[band] += share * f64::from(pixels[i][band]));
        }
        // What is left of a pixel is never more than it was, so that no band of the light is below zero.
        let left = |l: Bands| -> Bands { std::array::from_fn(|band| l[band].min(mean[band] as f32)) };

        let mut sum = [DVec3::ZERO; 3];
        for &i in spot {
            let (vector, left) = (self.vector(i), left(pixels[i]));
            (0..3).for_each(|band| sum[band] += f64::from(pixels[i][band] - left[band]) * vector);
        }
        // The direction by luminance, and the irradiance of a surface that faces it.
        let weights: Bands = std::array::from_fn(|k| luminance(std::array::from_fn(|band| f32::from(band == k))));
        let towards = (0..3).map(|band| f64::from(weights[band]) * sum[band]).sum::<DVec3>();
        let direction = towards.try_normalize()?;
        let solid_angle: f64 = spot.iter().map(|&i| self.solid_angle(i / self.width)).sum();
        let small = solid_angle < PI * SUN_RADIUS * SUN_RADIUS
            && spot.iter().all(|&i| self.vector(i).angle_between(direction) < SUN_RADIUS);
        if towards.length() <= least || !small {
            return None;
        }
        for &i in spot {
            pixels[i] = left(pixels[i]);
        }
        Some(PointLight {
            name: name.to_owned(),
            kind: PointLightKind::Directional,
            position: DVec3::ZERO,
            direction: -direction,
            intensity: sum.map(|sum| sum.dot(direction).max(0.0) as f32),
            range: None,
        })
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

    /// Mean radiosity π L of each patch (lm/m² per band). Pixels of a map are shared out to the patches that they overlap
    /// by solid angle, so the sum over the sphere is the map's own.
    pub fn radiosity(&self, sky: &Sky) -> Vec<Bands> {
        let mut sum = vec![[0f64; 3]; self.len()];
        if let Sky::Map { width, height, pixels } = sky {
            // Both grids are products of cuts in the azimuth and in h = (1 − sine of the elevation)/2, whose product is
            // the solid angle over 4π.
            let columns = overlaps(*width, |x| x as f64 / *width as f64, self.columns);
            let rows = overlaps(*height, |y| 0.5 * (1.0 - (PI * y as f64 / *height as f64).cos()), self.rows);
            for (y, row, share) in rows {
                let share = share * self.len() as f64;
                for &(x, column, part) in &columns {
                    let sum = &mut sum[row * self.columns + column];
                    for (sum, l) in sum.iter_mut().zip(pixels[y * width + x]) {
                        *sum += share * part * f64::from(l);
                    }
                }
            }
        } else {
            // What depends on the elevation alone is linear in its sine, and the middle of a ring has the ring's mean.
            for (patch, sum) in sum.iter_mut().enumerate() {
                let sine = 1.0 - (2 * (patch / self.columns) + 1) as f64 / self.rows as f64;
                let [north, _] = horizon(self.up);
                let direction = (1.0 - sine * sine).sqrt() * north + sine * self.up;
                *sum = sky.luminance(direction, self.up).map(f64::from);
            }
        }
        sum.into_iter().map(|l| l.map(|l| (PI * l) as f32)).collect()
    }
}

/// How `n` intervals with the given ends, from 0 to 1, overlap `m` equal ones: (one, other, length) in ascending order.
fn overlaps(n: usize, end: impl Fn(usize) -> f64, m: usize) -> Vec<(usize, usize, f64)> {
    let mut list = Vec::with_capacity(n + m);
    let (mut i, mut j, mut from) = (0, 0, 0.0);
    while i < n && j < m {
        let (own, other) = (end(i + 1), (j + 1) as f64 / m as f64);
        let to = own.min(other);
        if to > from {
            list.push((i, j, to - from));
        }
        from = to;
        // Ends that should be the same and differ by rounding leave a sliver, which harms nothing.
        i += usize::from(own <= other);
        j += usize::from(other <= own);
    }
    list
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

    /// A map of a blue sky over brown ground with discs of a luminance and half angle about some directions.
    fn map_with_suns(width: usize, up: DVec3, suns: &[(DVec3, f64, f32)]) -> Sky {
        let height = width / 2;
        let mut pixels = vec![[0.0; 3]; width * height];
        let [north, east] = horizon(up);
        for (i, pixel) in pixels.iter_mut().enumerate() {
            // 4 × 4 places in each, as a camera would smear the edge.
            for k in 0..16 {
                let (x, y) = ((i % width) as f64 + (k % 4) as f64 / 4.0, (i / width) as f64 + (k / 4) as f64 / 4.0);
                let azimuth = 2.0 * PI * ((x + 0.125) / width as f64 - 0.5);
                let elevation = PI * (0.5 - (y + 0.125) / height as f64);
                let direction = elevation.cos() * (azimuth.cos() * north + azimuth.sin() * east) + elevation.sin() * up;
                let sky = if elevation > 0.0 { [3000.0, 4000.0, 6000.0] } else { [900.0, 700.0, 500.0] };
                let sun: f32 = suns.iter().filter(|s| s.0.angle_between(direction) < s.1).map(|s| s.2).sum();
                (0..3).for_each(|band| pixel[band] += (sky[band] + sun * [1.0, 0.9, 0.8][band]) / 16.0);
            }
        }
        Sky::Map { width, height, pixels }
    }

    /// ∫ L cos⁺ by what the sky answers in 2 × 2 directions to a pixel.
    fn irradiance(sky: &Sky, normal: DVec3, up: DVec3) -> [f64; 3] {
        let Sky::Map { width, height, .. } = sky else { panic!() };
        let [north, east] = horizon(up);
        let (w, h) = (2 * width, 2 * height);
        let mut sum = [0.0; 3];
        for y in 0..h {
            let elevation = PI * (0.5 - (y as f64 + 0.5) / h as f64);
            for x in 0..w {
                let azimuth = 2.0 * PI * ((x as f64 + 0.5) / w as f64 - 0.5);
                let direction = elevation.cos() * (azimuth.cos() * north + azimuth.sin() * east) + elevation.sin() * up;
                let part = direction.dot(normal).max(0.0) * elevation.cos() * PI / h as f64 * 2.0 * PI / w as f64;
                let l = sky.luminance(direction, up);
                (0..3).for_each(|band| sum[band] += part * f64::from(l[band]));
            }
        }
        sum
    }

    fn lights(suns: &[PointLight], normal: DVec3) -> [f64; 3] {
        let given =
            |sun: &PointLight, band: usize| f64::from(sun.intensity[band]) * normal.dot(-sun.direction).max(0.0);
        std::array::from_fn(|band| suns.iter().map(|sun| given(sun, band)).sum())
    }

    /// Suns at the zenith, near it, across the seam at ±180°, low, and below the horizon: what is cut out comes back as light.
    #[test]
    fn suns_are_cut_out_and_nothing_is_lost() {
        for (up, width) in [(DVec3::Y, 256), (DVec3::Z, 512)] {
            let [north, east] = horizon(up);
            let places = [up, (up + 0.01 * east), (up - north), (0.2 * up - north + 0.003 * east), (east - 0.3 * up)];
            for towards in places.map(DVec3::normalize) {
                let mut sky = map_with_suns(width, up, &[(towards, 0.00465, 1.6e9)]);
                let normals = [up, towards, (up + east).normalize()];
                let before = normals.map(|n| irradiance(&sky, n, up));
                let suns = sky.take_suns("sun", up);
                assert_eq!(suns.len(), 1, "{towards}");
                // To a pixel.
                assert!((-suns[0].direction).angle_between(towards) < 2.0 * PI / width as f64, "{towards}");
                for (normal, before) in normals.into_iter().zip(before) {
                    let (rest, sun) = (irradiance(&sky, normal, up), lights(&suns, normal));
                    for band in 0..3 {
                        let after = rest[band] + sun[band];
                        assert!(
                            (after - before[band]).abs() < 1e-3 * before[band],
                            "{after} for {before:?} at {towards}"
                        );
                    }
                }
                let Sky::Map { pixels, .. } = &sky else { panic!() };
                assert!(pixels.iter().all(|p| luminance(*p) < 1e6));
            }
        }
    }

    /// Two suns are two lights, the core of a glare is one, and neither a large lamp nor the moon is any.
    #[test]
    fn suns_are_small_and_matter() {
        let (a, b) = (DVec3::new(0.3, 0.8, 0.2).normalize(), DVec3::new(-0.5, 0.4, 0.1).normalize());
        let count = |suns: &[(DVec3, f64, f32)]| map_with_suns(512, DVec3::Y, suns).take_suns("", DVec3::Y).len();
        assert_eq!(count(&[]), 0);
        assert_eq!(count(&[(a, 0.005, 1e9), (b, 0.01, 1e8)]), 2);
        assert_eq!(count(&[(a, 0.1, 1e6), (a, 0.005, 1e9)]), 1);
        assert_eq!(count(&[(a, 0.15, 1e7)]), 0);
        assert_eq!(count(&[(a, 0.005, 1e6)]), 0);
    }

    /// A map of a sky is as bright on the ground as the sky is, however coarse, and what is below the horizon does not count.
    #[test]
    fn maps_of_skies_give_their_illuminance() {
        let uniform = Sky::Uniform([1.0, 10.0, 1000.0]);
        for (width, height) in [(1, 2), (7, 5), (64, 33)] {
            let pixels = vec![[1.0, 10.0, 1000.0]; width * height];
            let given = Sky::Map { width, height, pixels }.horizontal();
            for (given, exact) in given.iter().zip(uniform.horizontal()) {
                assert!((given / exact - 1.0).abs() < 1e-6, "{width} × {height}: {given}, {exact}");
            }
        }
        let overcast = Sky::Overcast { horizontal: [3.0, 4.0, 5.0] };
        let (width, height) = (4, 400);
        let elevation = |row: usize| 0.5 * PI - PI * (row as f64 + 0.5) / height as f64;
        let seen = |i: usize| match elevation(i / width) {
            above if above > 0.0 => overcast.luminance(DVec3::new(above.cos(), above.sin(), 0.0), DVec3::Y),
            _ => [1e9; 3],
        };
        let given = Sky::Map { width, height, pixels: (0..width * height).map(seen).collect() }.horizontal();
        for (given, exact) in given.iter().zip(overcast.horizontal()) {
            assert!((given / exact - 1.0).abs() < 1e-4, "{given}, {exact}");
        }
        assert_eq!(Sky::Black.horizontal(), [0.0; 3]);
    }

    /// 64 samples to a patch found a sun of 0.53° sometimes and made it up to 17 % too bright.
    #[test]
    fn patches_have_the_flux_of_the_map_however_small_its_sun() {
        for (width, height) in [(7, 5), (100, 50), (1000, 501), (2048, 1024)] {
            // One pixel in a thousand is very bright.
            let bright = |i: usize| if (i * 7919) % 1000 == 17 { 1e7 } else { 1e3 + i as f32 % 97.0 };
            let pixels: Vec<Bands> = (0..width * height).map(|i| [bright(i), 2.0, (i / width) as f32]).collect();
            let grid = Grid { width, height, up: DVec3::Y };
            let mut flux = [0.0; 3];
            for (i, l) in pixels.iter().enumerate() {
                (0..3).for_each(|band| flux[band] += grid.solid_angle(i / width) * f64::from(l[band]));
            }
            let sky = Sky::Map { width, height, pixels };
            let patches = SkyPatches::new(&sky, DVec3::Y);
            let radiosity = patches.radiosity(&sky);
            for band in 0..3 {
                let sum: f64 = radiosity.iter().map(|b| 4.0 * f64::from(b[band]) / patches.len() as f64).sum();
                assert!((sum / flux[band] - 1.0).abs() < 1e-6, "{width} × {height}: {sum} for {flux:?}");
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
