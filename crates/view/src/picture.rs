//! Pictures: which surfaces the pixels of a camera see, exposure, tone mapping.
//!
//! A pixel has 16 samples. Samples that see the same smooth surface share one evaluation of irradiance,
//! because light changes slowly within a pixel where edges do not; reflectance is looked up at each. Edges come out
//! smooth at the price of little more than one evaluation per pixel; where light does change, each sample can be had
//! by itself. Of a sheet that transmits light the other side is evaluated too.

use glam::{DVec2, DVec3};
use radiosity_scene::display::{srgb, tone_map};
use radiosity_scene::{Bands, Camera, Side, luminance};
use radiosity_trace::{Found, Place, Tracer};
use rayon::prelude::*;

/// Part of a pixel below which nothing is left of it.
const LEAST_REST: f32 = 1e-5;

/// Samples along each side of a pixel.
const GRID: u32 = 4;

/// Samples of one pixel share an irradiance when their normals differ by less than this (cosine of 15°).
const SAME_SURFACE: f64 = 0.966;

/// A point that a picture needs the irradiance of, and what it adds to which pixel.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Pixel, row-major from the top left.
    pub pixel: u32,
    /// The point, with the shading normal on the side that is seen.
    pub place: Place,
    /// Barycentric coordinates on its mesh triangle.
    pub uv: DVec2,
    /// Side that is seen.
    pub side: Side,
    /// Luminance that the pixel gains per unit of irradiance: Σ ρ/π over the samples, per band; Σ τ/π behind a sheet.
    pub response: Bands,
    /// Whether it lies behind a sheet that is seen: on its other side, whose light comes through.
    pub behind: bool,
    /// Part of the pixel's samples that it stands for.
    pub share: f32,
    /// Luminance that the pixel gains by what the surface emits, cd/m² per band.
    pub emitted: Bands,
}

/// All that a camera sees.
#[derive(Clone, Debug)]
pub struct ViewRays {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Samples along each side of a pixel.
    pub grid: u32,
    /// Points to evaluate, by pixel.
    pub seen: Vec<Seen>,
    /// Luminance that pixels have from where no surface is seen, cd/m² per band.
    pub sky: Vec<Bands>,
}

/// What is known of a pixel's samples beforehand.
#[derive(Clone, Copy)]
struct Frame {
    width: u32,
    height: u32,
    grid: u32,
}

impl ViewRays {
    /// Casts the camera's rays.
    pub fn new(tracer: &Tracer, camera: &Camera, width: u32, height: u32) -> ViewRays {
        ViewRays::sampled(tracer, camera, (width, height), GRID)
    }

    /// The same with so many samples along each side of a pixel.
    pub fn sampled(tracer: &Tracer, camera: &Camera, (width, height): (u32, u32), grid: u32) -> ViewRays {
        let frame = Frame { width, height, grid };
        let nothing = || ViewRays { width, height, grid, seen: Vec::new(), sky: Vec::new() };
        let rows: Vec<ViewRays> = (0..height)
            .into_par_iter()
            .map(|row| {
                let mut of_row = nothing();
                for pixel in row * width..(row + 1) * width {
                    let first = of_row.seen.len();
                    let seen = &mut of_row.seen;
                    of_row.sky.push(frame.cast(tracer, camera, pixel, |sample| add(tracer, seen, first, sample)));
                }
                of_row
            })
            .collect();
        let mut view = nothing();
        for row in rows {
            view.seen.extend(row.seen);
            view.sky.extend(row.sky);
        }
        view
    }

    /// The samples that share what is evaluated at some `places` of [`ViewRays::seen`], given by number and in order: where light changes
    /// within a pixel. With each comes which of the places it is of, and those of a place follow each other. Tracer and camera are those
    /// that the rays were cast with.
    pub fn samples(&self, tracer: &Tracer, camera: &Camera, places: &[u32]) -> Vec<(u32, Seen)> {
        let frame = Frame { width: self.width, height: self.height, grid: self.grid };
        let of = |place: &u32| {
            let place = *place as usize;
            let pixel = self.seen[place].pixel;
            let first = self.seen[..place].iter().rposition(|seen| seen.pixel != pixel).map_or(0, |before| before + 1);
            // What a sample shares is the first that it can: nothing after the place need be looked at.
            let own = &self.seen[first..=place];
            let mut samples = Vec::new();
            frame.cast(tracer, camera, pixel, |sample| {
                if own.iter().position(|seen| is_shared(tracer, seen, &sample)) == Some(place - first) {
                    samples.push((place as u32, sample));
                }
            });
            samples
        };
        places.par_iter().flat_map_iter(of).collect()
    }

    /// The picture for irradiances (lux per band) of `seen`, in order.
    pub fn picture(&self, irradiance: &[Bands]) -> Picture {
        assert_eq!(irradiance.len(), self.seen.len());
        let (mut pixels, mut surfaces) = (self.sky.clone(), vec![false; self.sky.len()]);
        let mut parts: Vec<Part> = Vec::new();
        let mut begin = 0;
        for of_pixel in self.seen.chunk_by(|a, b| a.pixel == b.pixel) {
            let (pixel, first) = (of_pixel[0].pixel, parts.len());
            surfaces[pixel as usize] = true;
            let mut rest = 1.0;
            for (seen, e) in of_pixel.iter().zip(&irradiance[begin..]) {
                let given = seen.gives(*e);
                let add = |sum: &mut Bands| (0..3).for_each(|band| sum[band] += given[band]);
                add(&mut pixels[pixel as usize]);
                match parts[first..].last_mut() {
                    // It lies behind the sheet that was seen before it.
                    Some(part) if seen.behind => add(&mut part.luminance),
                    _ => parts.push(Part { pixel, share: seen.share, luminance: given }),
                }
                rest -= if seen.behind { 0.0 } else { seen.share };
            }
            begin += of_pixel.len();
            // Less is rounding: a part of a sample fills more.
            if rest > LEAST_REST {
                parts.push(Part { pixel, share: rest, luminance: self.sky[pixel as usize] });
            }
            if parts.len() == first + 1 {
                parts.truncate(first);
            }
        }
        Picture { width: self.width, height: self.height, pixels, surfaces, parts }
    }
}

impl Frame {
    /// Casts the samples of a pixel. Answers the luminance of the sky in it, cd/m².
    fn cast(&self, tracer: &Tracer, camera: &Camera, pixel: u32, mut surface: impl FnMut(Seen)) -> Bands {
        let Frame { width, height, grid } = *self;
        let (column, row) = (pixel % width, pixel / width);
        let aspect = f64::from(width) / f64::from(height);
        let share = 1.0 / (grid * grid) as f32;
        let mut sky = [0f32; 3];
        for sample in 0..grid * grid {
            let [x, y] = self.within(sample);
            let (x, y) = ((f64::from(column) + x) / f64::from(width), (f64::from(row) + y) / f64::from(height));
            let (origin, direction) = camera.ray(2.0 * x - 1.0, 1.0 - 2.0 * y, aspect);
            let scene = tracer.scene;
            tracer.seen(&tracer.free_ray(origin, direction), |found, part| match found {
                Found::Back => {}
                Found::Escaped => {
                    let luminance = scene.sky.luminance(direction, scene.up.direction());
                    (0..3).for_each(|band| sky[band] += part * share * luminance[band]);
                }
                Found::Surface { triangle, uv, side, .. } => {
                    let share = part * share;
                    let uv = DVec2::new(f64::from(uv[0]), f64::from(uv[1]));
                    let at = tracer.mesh.surface(triangle as usize, uv);
                    let emitted = scene.emitted_luminance(at).map(|luminance| share * luminance);
                    let point = tracer.mesh.point(triangle as usize, uv);
                    let sample = |side: Side, given_back: Bands, behind: bool, emitted: Bands| {
                        let normal = shading_normal(tracer, triangle as usize, uv, side);
                        let response = given_back.map(|given| given * share / std::f32::consts::PI);
                        let place = Place { point, normal, triangle };
                        Seen { pixel, place, uv, side, response, behind, share, emitted }
                    };
                    surface(sample(side, scene.reflectance(at), false, emitted));
                    let transmittance = scene.transmittance(at);
                    if transmittance.iter().any(|t| *t > 0.0) {
                        surface(sample(side.other(), transmittance, true, [0.0; 3]));
                    }
                }
            });
        }
        sky
    }

    /// Where in a pixel a sample lies: on a net of which each column and row has one (Hammersley 1960, "Monte Carlo methods for solving
    /// multivariable problems"), so that edges that are nearly upright or level have as many steps as there are samples. The first
    /// lies near the middle.
    fn within(&self, sample: u32) -> [f64; 2] {
        let count = self.grid * self.grid;
        let k = (sample + 3 * count / 8) % count;
        let half = 0.5 / f64::from(count);
        [f64::from(k) / f64::from(count) + half, f64::from(k.reverse_bits()) / 2f64.powi(32) + half]
    }
}

impl Seen {
    /// Luminance that the pixel gains, with an irradiance in lux per band.
    fn gives(&self, irradiance: Bands) -> Bands {
        std::array::from_fn(|band| self.emitted[band] + self.response[band] * irradiance[band])
    }

    fn glows(&self) -> bool {
        self.emitted.iter().any(|l| *l > 0.0)
    }
}

/// Adds a sample to what the pixel, from `first` on, has seen: to one of the same surface and side, if there is one.
fn add(tracer: &Tracer, seen: &mut Vec<Seen>, first: usize, sample: Seen) {
    match seen[first..].iter_mut().find(|seen| is_shared(tracer, seen, &sample)) {
        Some(seen) => {
            seen.share += sample.share;
            (0..3).for_each(|band| {
                seen.response[band] += sample.response[band];
                seen.emitted[band] += sample.emitted[band];
            });
        }
        None => seen.push(sample),
    }
}

/// Whether a sample of the same pixel shares what is evaluated for an earlier one.
fn is_shared(tracer: &Tracer, seen: &Seen, sample: &Seen) -> bool {
    seen.side == sample.side
        && seen.behind == sample.behind
        && seen.glows() == sample.glows()
        && seen.place.normal.dot(sample.place.normal) > SAME_SURFACE
        && continues(tracer, seen, sample.place.triangle)
}

/// Whether a triangle belongs to the smooth surface that an earlier sample of the pixel lies on.
fn continues(tracer: &Tracer, seen: &Seen, triangle: u32) -> bool {
    let (a, b) = (seen.place.triangle as usize, triangle as usize);
    a == b || tracer.mesh.smooth[a].iter().any(|corner| tracer.mesh.smooth[b].contains(corner))
}

/// The normal that light is received with: the author's smooth one where there is one, else the triangle's; on the
/// given side, and never turned away from it.
pub fn shading_normal(tracer: &Tracer, triangle: usize, uv: DVec2, side: Side) -> DVec3 {
    let sign = if side == Side::Front { 1.0 } else { -1.0 };
    let flat = tracer.mesh.normal(triangle);
    let smooth = tracer.scene.shading_normal(tracer.mesh.surface(triangle, uv)).unwrap_or(flat);
    // An author's normal that points to the other side is a mistake of the file, not a curved surface.
    sign * if smooth.dot(flat) > 0.1 { smooth } else { flat }
}

/// Luminances of a picture, cd/m² per band, row-major from the top left.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Luminances.
    pub pixels: Vec<Bands>,
    /// Whether a pixel shows a surface; sky and void are not metered.
    pub surfaces: Vec<bool>,
    /// Parts of pixels that show several surfaces, or one and the sky, by pixel: edges of what is brighter than white, as lamps are, are
    /// smooth only if each part is tone-mapped by itself.
    pub parts: Vec<Part>,
}

/// What a pixel shows of one surface, or of the sky.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Pixel, row-major from the top left.
    pub pixel: u32,
    /// Part of its samples.
    pub share: f32,
    /// What it adds to the pixel's luminance, cd/m² per band.
    pub luminance: Bands,
}

impl Picture {
    /// The exposure (log2 of the factor) that puts the picture's median surface luminance at 18 % grey, but keeps
    /// nine tenths of the picture below 80 % so that bright rooms are not washed out.
    pub fn exposure(&self) -> f64 {
        let metered = self.pixels.iter().zip(&self.surfaces).filter(|(_, surface)| **surface);
        let mut lit: Vec<f32> = metered.map(|(p, _)| luminance(*p)).filter(|l| *l > 0.0).collect();
        if lit.is_empty() {
            return 0.0;
        }
        lit.sort_unstable_by(f32::total_cmp);
        let at = |share: f64| f64::from(lit[((lit.len() - 1) as f64 * share) as usize]).max(1e-30);
        (0.24 / at(0.5)).min(0.8 / at(0.9)).log2()
    }

    /// 8-bit sRGB pixels, exposed by 2^`exposure` and tone-mapped: linear up to about one half, then a smooth shoulder
    /// that reaches white at 8 times that and keeps hues.
    pub fn tone_mapped(&self, exposure: f64) -> Vec<[u8; 3]> {
        let factor = exposure.exp2() as f32;
        let width = self.width.max(1) as usize;
        let map = |luminance: Bands| tone_map(luminance.map(|l| l * factor));
        let mapped = |i: usize| {
            let first = self.parts.partition_point(|part| (part.pixel as usize) < i);
            let parts = || self.parts[first..].iter().take_while(|part| part.pixel as usize == i);
            if parts().next().is_none() {
                return map(self.pixels[i]);
            }
            parts().fold([0.0; 3], |sum: Bands, part| {
                let own = map(part.luminance.map(|l| l / part.share));
                std::array::from_fn(|band| sum[band] + part.share * own[band])
            })
        };
        (0..self.pixels.len())
            .into_par_iter()
            .map(|i| {
                // A quarter of a step of ordered dither hides the banding of 8 bits on smooth walls.
                let dither = (BAYER[i / width % 4][i % width % 4] as f32 + 0.5) / 16.0 - 0.5;
                mapped(i).map(|c| (srgb(c) * 255.0 + 0.5 + dither * 0.9).clamp(0.0, 255.0) as u8)
            })
            .collect()
    }
}

const BAYER: [[u8; 4]; 4] = [[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]];

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_scene::{AlphaMode, Material, Mesh, Scene, Sky, Up};

    /// A square of the given material under an eye at the given angle from its normal, half a metre away.
    fn square_seen(material: Material, angle: f64, irradiance: f32) -> Vec<Bands> {
        let mut scene = Scene { materials: vec![material], ..Scene::default() };
        scene.add_quad("square", 0, [[-9., 0., 9.], [9., 0., 9.], [9., 0., -9.], [-9., 0., -9.]].map(DVec3::from));
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let eye = 0.5 * DVec3::new(angle.sin(), angle.cos(), 0.0);
        let view = ViewRays::new(&tracer, &Camera::look_at("eye", eye, DVec3::ZERO, DVec3::Z, 0.1), 4, 4);
        view.picture(&vec![[irradiance; 3]; view.seen.len()]).pixels
    }

    /// Catalogue 0c: B = π lm/m² shows as exactly 1 cd/m² where it is emitted, and within rounding where 16
    /// samples of reflected light are summed.
    #[test]
    fn catalogue_0c_radiosity_of_pi_is_luminance_of_one() {
        let glowing = Material { base_color: [0.0, 0.0, 0.0, 1.0], emissive: [1.0; 3], ..Material::default() };
        assert!(square_seen(glowing, 0.3, 0.0).iter().all(|pixel| *pixel == [1.0; 3]));
        // ρ = ½ under 2π lx.
        let grey = Material { base_color: [0.5, 0.5, 0.5, 1.0], ..Material::default() };
        let grey = square_seen(grey, 0.3, std::f32::consts::TAU);
        assert!(grey.iter().flatten().all(|l| (l - 1.0).abs() <= 2.0 * f32::EPSILON), "{grey:?}");
    }

    /// Catalogue 2: a diffuse surface shows the same luminance from any angle, to one unit in the last place.
    #[test]
    fn catalogue_2_luminance_does_not_depend_on_the_angle() {
        let material =
            Material { base_color: [0.7, 0.31, 0.05, 1.0], emissive: [0.1, 0.0, 3.0], ..Material::default() };
        let first = square_seen(material.clone(), 0.0, 123.4)[0];
        for angle in [0.0, 0.2, 0.7, 1.1, 1.4, 1.5, -1.3] {
            for pixel in square_seen(material.clone(), angle, 123.4) {
                for band in 0..3 {
                    let apart = pixel[band].to_bits().abs_diff(first[band].to_bits());
                    assert!(apart <= 1, "{angle}: {} and {}", pixel[band], first[band]);
                }
            }
        }
    }

    #[test]
    fn a_grey_picture_is_exposed_to_middle_grey() {
        // The upper half shows a bright sky, which must not count.
        let pixels = (0..16).map(|i| if i < 8 { [1e5; 3] } else { [300.0; 3] }).collect();
        let surfaces = (0..16).map(|i| i >= 8).collect();
        let picture = Picture { width: 4, height: 4, pixels, surfaces, parts: Vec::new() };
        let factor = picture.exposure().exp2() * 300.0;
        assert!((factor - 0.24).abs() < 1e-3, "{factor}");
        let mapped = picture.tone_mapped(picture.exposure());
        assert!(mapped[8..].iter().all(|p| (120..=140).contains(&p[0])), "{:?}", mapped[8]);
    }

    /// Edges of a lamp that is much brighter than white have values between it and what is around it, though its light alone in a part
    /// of a pixel would make that white; the luminances are the means that they are.
    #[test]
    fn edges_of_lamps_are_smooth() {
        let glowing = Material { base_color: [0.5, 0.5, 0.5, 1.0], emissive: [1e4; 3], ..Material::default() };
        let grey = Material { base_color: [0.5, 0.5, 0.5, 1.0], ..Material::default() };
        let mut scene = Scene { materials: vec![glowing, grey], ..Scene::default() };
        let quad = |x: [f64; 2]| [[x[0], 0., 9.], [x[1], 0., 9.], [x[1], 0., -9.], [x[0], 0., -9.]].map(DVec3::from);
        // Its edge is neither upright in the picture nor at a border of pixels.
        scene.add_quad("lamp", 0, quad([-9.0, 0.0]));
        scene.add_quad("floor", 1, quad([0.0, 9.0]));
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let up = DVec3::new(0.3, 0.0, -1.0);
        let camera = Camera::look_at("eye", DVec3::new(0.01, 2.0, 0.0), DVec3::new(0.01, 0.0, 0.0), up, 0.6);
        let view = ViewRays::new(&tracer, &camera, 24, 24);
        // Of the light that the lamp reflects nothing is taken for the floor's.
        let picture = view.picture(&vec![[100.0 * std::f32::consts::TAU; 3]; view.seen.len()]);
        assert!((16..72).contains(&(picture.parts.len() / 2)), "{}", picture.parts.len());
        let mapped = picture.tone_mapped((0.24f64 / 100.0).log2());
        let [floor, lamp] = [mapped[23][0], mapped[23 * 24][0]].map(f64::from);
        assert!(lamp > floor + 90.0, "{lamp} {floor}");
        let linear = |c: f64| (c / 255.0).powf(2.2);
        for [one, other] in picture.parts.as_chunks().0 {
            let at = one.pixel as usize;
            assert!(other.pixel == one.pixel && (one.share + other.share - 1.0).abs() < 1e-6);
            let glow = if one.luminance[0] > other.luminance[0] { one } else { other };
            let all = 1e4 * glow.share + 100.0;
            assert!((picture.pixels[at][0] / all - 1.0).abs() < 1e-4, "{} {all}", picture.pixels[at][0]);
            let share = (linear(f64::from(mapped[at][0])) - linear(floor)) / (linear(lamp) - linear(floor));
            assert!((share - f64::from(glow.share)).abs() < 0.04, "{share} {}", glow.share);
        }
    }

    /// Each of sixteen columns and rows of a pixel has a sample, the first near its middle; so have fewer.
    #[test]
    fn samples_lie_in_columns_and_rows_of_their_own() {
        for grid in [1, 2, 4] {
            let frame = Frame { width: 1, height: 1, grid };
            let count = grid * grid;
            for axis in 0..2 {
                let mut lines: Vec<u32> =
                    (0..count).map(|k| (frame.within(k)[axis] * f64::from(count)) as u32).collect();
                lines.sort_unstable();
                assert!(lines.into_iter().eq(0..count));
            }
            assert!(frame.within(0).iter().all(|x| (x - 0.5).abs() < 0.13));
        }
    }

    /// The samples of a place give together what the place does.
    #[test]
    fn samples_of_a_place_are_those_that_share_it() {
        let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
        scene.add_quad("floor", 0, [[-9., 0., 9.], [9., 0., 9.], [9., 0., -9.], [-9., 0., -9.]].map(DVec3::from));
        scene.add_quad("wall", 0, [[-9., 0., -1.], [9., 0., -1.], [9., 3., -2.], [-9., 3., -2.]].map(DVec3::from));
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let camera = Camera::look_at("eye", DVec3::new(0.3, 1.0, 2.0), DVec3::new(0.0, 0.2, -1.0), DVec3::Y, 1.0);
        let view = ViewRays::new(&tracer, &camera, 16, 16);
        let places: Vec<u32> = (0..view.seen.len() as u32).step_by(3).collect();
        let samples = view.samples(&tracer, &camera, &places);
        let mut rest = samples.as_slice();
        for place in places {
            let of = rest.partition_point(|(of, _)| *of <= place);
            let (own, others) = rest.split_at(of);
            let seen = &view.seen[place as usize];
            let response: f32 = own.iter().map(|(_, sample)| sample.response[0]).sum();
            assert!((response / seen.response[0] - 1.0).abs() < 1e-5, "{response} {}", seen.response[0]);
            assert!(own.iter().all(|(of, sample)| *of == place && sample.pixel == seen.pixel));
            assert_eq!(own[0].1.place.point, seen.place.point);
            rest = others;
        }
        assert!(rest.is_empty());
    }

    /// A pane over a floor is as much of every pixel as it is opaque, without any chance, and the sky above it as much as it lets through.
    #[test]
    fn panes_fill_their_part_of_every_pixel() {
        let of = |alpha: f32, emissive: f32| Material {
            base_color: [0.0, 0.0, 0.0, alpha],
            emissive: [emissive; 3],
            alpha_mode: if alpha < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque },
            double_sided: true,
            ..Material::default()
        };
        let square = |half: f64, z: f64| {
            [[-half, -half], [half, -half], [half, half], [-half, half]].map(|[x, y]| DVec3::new(x, y, z))
        };
        let mut scene = Scene { materials: vec![of(1.0, 10.0), of(0.3, 100.0)], up: Up::Z, ..Scene::default() };
        scene.sky = Sky::Uniform([1000.0; 3]);
        scene.add_quad(
            "floor",
            0,
            [[-5.0, -5.0], [0.0, -5.0], [0.0, 5.0], [-5.0, 5.0]].map(|[x, y]| DVec3::new(x, y, 0.0)),
        );
        scene.add_quad("pane", 1, square(5.0, 1.0));
        scene.add_quad("pane", 1, square(5.0, 1.5));
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let camera = Camera::look_at("eye", DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, DVec3::Y, 0.6);
        let view = ViewRays::new(&tracer, &camera, 24, 24);
        let picture = view.picture(&vec![[0.0; 3]; view.seen.len()]);
        // Two panes, each 0.3 of what is seen there.
        let over = |behind: f32| 30.0 + 0.7 * (30.0 + 0.7 * behind);
        let is = |pixel: &Bands, behind: f32| (pixel[1] - over(behind)).abs() < 1e-3 * over(behind);
        let (floor, sky) = (
            picture.pixels.iter().filter(|p| is(p, 10.0)).count(),
            picture.pixels.iter().filter(|p| is(p, 1000.0)).count(),
        );
        assert_eq!((floor + sky, floor.min(sky) > 200), (24 * 24, true), "{floor} {sky}");
        for part in picture.parts.chunk_by(|a, b| a.pixel == b.pixel) {
            assert!((part.iter().map(|p| p.share).sum::<f32>() - 1.0).abs() < 1e-4);
        }
    }
}
