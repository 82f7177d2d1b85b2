//! What the user means: surfaces, materials, light sources, cameras, sky — and the elements that carry the unknowns.
//!
//! A [`Scene`] is plain data in metres and SI photometric units, flattened into world space and validated by the
//! reader that made it. [`Mesh`] welds it into surfaces that light can be continuous on; [`Elements`] cuts those
//! into the pieces whose radiosity is one number per band. Nothing in this crate traces a ray or stores a result.

pub mod camera;
mod curve;
pub mod display;
mod element_facets;
pub mod elements;
pub mod facet;
pub mod fault;
pub mod lab;
pub mod light;
pub mod material;
pub mod mesh;
pub mod scene;
pub mod sky;
pub mod spectrum;
pub mod texture;

pub use camera::{Camera, Projection};
pub use curve::Curve;
pub use element_facets::ElementError;
pub use elements::{CellWidth, ElementId, Elements};
pub use facet::{Enclosure, EnclosureSurface, Facet, FacetError};
pub use fault::{Fault, Faults, Severity, counted, listed, size};
pub use light::{PointLight, PointLightKind};
pub use material::{AlphaMode, Material, TextureRef, Transmission};
pub use mesh::{EdgeSide, Mesh, Side, Weld};
pub use scene::{Object, Scene, Source, Surface, Up};
pub use sky::{Sky, SkyPatches};
pub use spectrum::{Illuminant, SpectralBands, SpectrumError};
pub use texture::{Texture, Wrap};

/// One value per colour band (linear Rec.709 red, green, blue), the way every spectral quantity is carried.
pub type Bands = [f32; 3];

/// Luminance weights of linear Rec.709 primaries (ITU-R BT.709): the one number that stands for three bands.
pub const LUMINANCE: Bands = [0.2126, 0.7152, 0.0722];

/// The luminance-weighted mean of three bands; of an irradiance in lux per band it is the illuminance in lux.
#[inline]
pub fn luminance(bands: Bands) -> f32 {
    LUMINANCE[0] * bands[0] + LUMINANCE[1] * bands[1] + LUMINANCE[2] * bands[2]
}
