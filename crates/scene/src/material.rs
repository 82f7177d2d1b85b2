//! How a surface answers light, as its author wrote it down.

use crate::{Bands, Faults, Wrap};
use glam::{DAffine2, DVec2};

/// Largest reflectance the solver accepts. At 1 a closed scene has no bounded solution; 0.99 keeps the guaranteed
/// bound ‖r‖/(1−ρ) below 100 residuals while no real paint (0.95) or snow (0.98) is darkened.
pub const MAX_REFLECTANCE: f32 = 0.99;

/// A texture as a material uses it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into [`crate::Scene::textures`].
    pub texture: usize,
    /// Which set of texture coordinates: 0 or 1.
    pub uv_set: usize,
    /// Texture coordinates from mesh coordinates (KHR_texture_transform).
    pub transform: DAffine2,
    /// Behaviour outside 0..1 along u and v.
    pub wrap: [Wrap; 2],
    /// Whether texels are squares of one colour (magnification by NEAREST), not blended into each other.
    pub nearest: bool,
}

impl TextureRef {
    /// Texture coordinates for mesh coordinates `uv`.
    pub fn coordinates(&self, uv: DVec2) -> DVec2 {
        self.transform.transform_point2(uv)
    }
}

/// What alpha means (glTF `alphaMode`).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Alpha is ignored.
    #[default]
    Opaque,
    /// The surface is absent where alpha is below the cutoff.
    Mask {
        /// Alpha below which the surface is cut out.
        cutoff: f32,
    },
    /// The surface covers the share `alpha` of the light and lets the rest pass unchanged.
    Blend,
}

/// By how much ρ + τ may be above one: the rounding of three numbers that are one together.
const ROUNDING: f32 = 4.0 * f32::EPSILON;

/// What a thin sheet passes on: light that falls on one side leaves the other, diffusely.
///
/// With s = 1 where there is no picture of the share, else its alpha, the sheet has at each point
/// ρ = (1 − `replaced` s) base colour and τ = s `transmittance` × its picture, both times 1 − metallic. Both sides are
/// alike: a diffuse sheet passes the same share in either direction (Helmholtz reciprocity).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Transmission {
    /// Transmittance τ per band.
    pub transmittance: Bands,
    /// Picture (sRGB) that multiplies it.
    pub texture: Option<TextureRef>,
    /// Share of the base colour that transmission takes the place of, 0..1: glTF's `diffuseTransmissionFactor`. At 0
    /// the base colour is the reflectance itself.
    pub replaced: f32,
    /// Picture whose alpha says how much of the sheet transmits.
    pub share_texture: Option<TextureRef>,
}

/// A diffuse material: reflectance, transmittance and emission per band.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name given by the author; may be empty.
    pub name: String,
    /// Linear base colour and alpha.
    pub base_color: [f32; 4],
    /// Base colour picture (sRGB, alpha linear), multiplies `base_color`.
    pub base_color_texture: Option<TextureRef>,
    /// Metallic share 0..1: that part of the base colour reflects like a mirror and is taken out of the diffuse.
    pub metallic: f32,
    /// Picture whose blue channel multiplies `metallic`.
    pub metallic_texture: Option<TextureRef>,
    /// Emitted luminance, cd/m² per band (emissive factor × strength).
    pub emissive: Bands,
    /// Picture (sRGB) that multiplies `emissive`.
    pub emissive_texture: Option<TextureRef>,
    /// Meaning of alpha.
    pub alpha_mode: AlphaMode,
    /// Whether the back of the surface reflects and emits as the front does. That of a sheet that transmits light does
    /// in any case: ask [`Material::has_two_sides`].
    pub double_sided: bool,
    /// Diffuse transmission; `None` for what lets no light through.
    pub transmission: Option<Transmission>,
}

impl Default for Material {
    fn default() -> Self {
        Material {
            name: String::new(),
            base_color: [1.0; 4],
            base_color_texture: None,
            metallic: 0.0,
            metallic_texture: None,
            emissive: [0.0; 3],
            emissive_texture: None,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
            transmission: None,
        }
    }
}

impl Material {
    /// Whether the surface gives light anywhere.
    pub fn emits(&self) -> bool {
        self.emissive.iter().any(|&e| e > 0.0)
    }

    /// Pictures that vary what the surface gives back or lets through.
    pub fn reflectance_pictures(&self) -> impl Iterator<Item = &TextureRef> {
        let sheet = self.transmission.iter().flat_map(|t| t.texture.iter().chain(&t.share_texture));
        self.base_color_texture.iter().chain(&self.metallic_texture).chain(sheet)
    }

    /// Pictures that vary what the surface is like, its emission too.
    pub fn pictures(&self) -> impl Iterator<Item = &TextureRef> {
        self.reflectance_pictures().chain(&self.emissive_texture)
    }

    /// Whether light passes through the surface anywhere.
    pub fn transmits(&self) -> bool {
        self.transmission.as_ref().is_some_and(|t| t.transmittance.iter().any(|&tau| tau > 0.0))
    }

    /// Whether the back takes part in the exchange of light as the front does. Light that leaves a sheet on its other
    /// side needs that side.
    pub fn has_two_sides(&self) -> bool {
        self.double_sided || self.transmission.is_some()
    }

    /// Adds what is wrong with the transmission: values that are no shares, and bands in which ρ + τ is above one. The
    /// rest, α = 1 − ρ − τ, is absorbed.
    pub fn check_transmission(&self, place: &str, faults: &mut Faults) {
        let Some(transmission) = &self.transmission else { return };
        let (tau, replaced) = (transmission.transmittance, transmission.replaced);
        if tau.iter().chain([&replaced]).any(|share| !(0.0..=1.0).contains(share)) {
            let what = format!("transmittance {tau:?}, which takes the place of {replaced} of the reflectance");
            faults.error(place, what, "use values in 0..1");
            return;
        }
        let returned = self.most_returned(transmission);
        if returned.iter().any(|sum| *sum > 1.0 + ROUNDING) {
            let what = format!("reflectance and transmittance sum to {returned:?}, above 1");
            faults.error(place, what, "no surface gives back more light than it gets: make one of them smaller");
        }
    }

    /// The largest ρ + τ of each band. Pictures, and vertex colours in 0..1, only take away; the sum is linear in the
    /// share that transmits, so it is largest where that is nothing or all.
    fn most_returned(&self, transmission: &Transmission) -> Bands {
        let diffuse = if self.metallic_texture.is_some() { 1.0 } else { 1.0 - self.metallic };
        std::array::from_fn(|band| {
            let (base, tau) = (self.base_color[band], transmission.transmittance[band]);
            let all = base * (1.0 - transmission.replaced) + tau;
            diffuse * if transmission.share_texture.is_some() { base.max(all) } else { all }
        })
    }
}
