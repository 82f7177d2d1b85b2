//! Reflectance and transmittance of an object's elements, as the file has them and as they are painted.

use radiosity_scene::display::{linear, srgb};
use radiosity_scene::elements::places_over;
use radiosity_scene::material::MAX_REFLECTANCE;
use radiosity_scene::{Bands, Scene, Surface, Texture};
use radiosity_transport::live::Shape;

/// What a shape is like in the file.
#[derive(Clone, Debug, Default)]
pub struct Paint {
    /// By element of the front; backs are like fronts. One for all where nothing varies.
    rho: Vec<Bands>,
    tau: Vec<Bands>,
    /// Mean reflectance over the area.
    pub mean: Bands,
    /// Whether a picture or vertex colours vary it.
    pub is_varied: bool,
    /// Whether light passes through.
    pub transmits: bool,
}

impl Paint {
    /// The paint of an object.
    pub fn new(scene: &Scene, object: usize, shape: &Shape) -> Paint {
        let material = &scene.materials[scene.objects[object].material];
        let is_varied = scene.varies_reflectance(material);
        let transmits = material.transmits();
        let (mut rho, mut tau) = (Vec::new(), Vec::new());
        let (mut sum, mut whole) = ([0f64; 3], 0f64);
        for element in 0..shape.fronts {
            let (t, _, _) = shape.place(element);
            let triangle = shape.triangles.start + t;
            if is_varied || element == 0 {
                let (r, t) = mean_optics(scene, shape, element);
                rho.push(r);
                tau.push(t);
            }
            let area = scene.area(triangle) / f64::from(shape.division[t].pow(2));
            let own = rho[rho.len() - 1];
            whole += area;
            (0..3).for_each(|band| sum[band] += area * f64::from(own[band]));
        }
        let mean = match rho.as_slice() {
            [only] => *only,
            _ => sum.map(|s| (s / whole.max(f64::MIN_POSITIVE)) as f32),
        };
        Paint { rho, tau, mean, is_varied, transmits }
    }

    fn own(of: &[Bands], element: u32, fronts: u32) -> Bands {
        let front = if element < fronts { element } else { element - fronts };
        of[if of.len() == 1 { 0 } else { front as usize }]
    }

    /// ρ and τ of an element under a new coat of a mean reflectance, if there is one. A picture keeps its pattern. Together
    /// they stay within what a surface may give back; what would be too much of ρ is left out.
    pub fn of(&self, element: u32, fronts: u32, coat: Option<Bands>) -> (Bands, Bands) {
        let (rho, tau) = (Paint::own(&self.rho, element, fronts), Paint::own(&self.tau, element, fronts));
        let Some(coat) = coat else { return (rho, tau) };
        let rho = std::array::from_fn(|band| {
            let painted = match self.mean[band] {
                mean if self.is_varied && mean > 0.0 => rho[band] * (coat[band] / mean),
                _ => coat[band],
            };
            painted.min(MAX_REFLECTANCE - tau[band])
        });
        (rho, tau)
    }
}

/// A picture whose linear colours are multiplied, as far as a picture goes.
pub fn brighter(texture: &Texture, factor: Bands) -> Texture {
    let tables = factor.map(|factor| -> [u8; 256] {
        let scaled = |byte: usize| (linear(byte as f64 / 255.0) as f32 * factor).min(1.0);
        std::array::from_fn(|byte| (255.0 * srgb(scaled(byte))).round() as u8)
    });
    let texel = |[r, g, b, a]: &[u8; 4]| {
        let [r, g, b] = [(0, r), (1, g), (2, b)].map(|(band, byte)| tables[band][usize::from(*byte)]);
        [r, g, b, *a]
    };
    Texture { texels: texture.texels.iter().map(texel).collect(), ..texture.clone() }
}

fn mean_optics(scene: &Scene, shape: &Shape, element: u32) -> (Bands, Bands) {
    let (t, _, piece) = shape.place(element);
    let triangle = shape.triangles.start + t;
    let (mut rho, mut tau, mut opaque) = ([0f32; 3], [0f32; 3], 0f32);
    let count = scene.places_for_mean(piece.map(|uv| Surface { triangle, uv }));
    for uv in places_over(piece, count, element) {
        let at = Surface { triangle, uv };
        let weight = scene.opacity(at);
        if weight > 0.0 {
            let (r, t) = (scene.reflectance(at), scene.transmittance(at));
            opaque += weight;
            for band in 0..3 {
                rho[band] += weight * r[band];
                tau[band] += weight * t[band];
            }
        }
    }
    if opaque > 0.0 { (rho.map(|r| r / opaque), tau.map(|t| t / opaque)) } else { (rho, tau) }
}
