//! Diffuse global illumination by the radiosity method: a scene goes in, light on its surfaces comes out, with an
//! error that can be signed.
//!
//! ```
//! use radiosity::{Mesh, Solution, SolveOptions, Tracer, cornell_box};
//!
//! let scene = cornell_box();
//! let mesh = Mesh::new(&scene);
//! let tracer = Tracer::new(&scene, &mesh);
//! let options = SolveOptions { element_size: Some(0.1), rays: 32, ..SolveOptions::default() };
//! let solution = Solution::new(&tracer, &options, &()).unwrap();
//! let brightest = solution.irradiance().iter().map(|e| e[1]).fold(0.0, f32::max);
//! assert!(brightest > 0.0);
//! ```

mod allocation;
pub mod answer;
pub mod bake;
mod believed;
mod blocks;
mod canvas;
pub mod compare;
mod cornell;
mod displayed;
mod division;
mod edges;
mod eight_bits;
mod element_light;
mod equation;
mod error;
mod faces;
pub mod factors;
mod field;
mod final_gather;
mod footprint;
mod grain;
mod judge;
mod levels;
mod lightmap;
mod mean_path;
pub mod measure;
mod monitor;
mod pace;
mod pixels;
mod points;
mod preview;
pub mod render;
pub mod session;
mod solution;
pub mod stations;
mod texels;
mod vertex_light;
mod viewpoint;

pub use answer::{Answer, Indirect};
pub use bake::{BakeOptions, Baked, bake};
pub use compare::{CompareOptions, Comparison, compare};
pub use cornell::cornell_box;
pub use displayed::{Displayed, Shown};
pub use element_light::ElementLight;
pub use equation::{RANDOM_TOLERANCE, TABLE_TOLERANCE};
pub use error::Error;
pub use factors::{Doubt, Excess, Factors, FactorsOptions, Missed, factors};
pub use footprint::{ELEMENT_BYTES, least_memory};
pub use judge::WrittenRound;
pub use levels::Levels;
pub use lightmap::{Lightmap, TEXEL_BYTES, lightmap, points_about};
pub use measure::{MeasureOptions, Measurement, measure};
pub use monitor::{Monitor, Stages, Timed};
pub use pace::After;
pub use preview::{Glimpse, preview};
pub use render::{RenderOptions, View, render};
pub use solution::{Balance, Solution, SolveOptions};
pub use vertex_light::{VertexLight, vertex_light};
pub use viewpoint::place_camera;

pub use radiosity_io as io;
/// What a display makes of light, and how far apart two of its colours are.
pub mod display {
    pub use radiosity_scene::display::{srgb, tone_map};
    pub use radiosity_scene::lab::{delta_e, lab};
}
pub use radiosity_scene::{
    AlphaMode, Bands, Camera, EdgeSide, Elements, Enclosure, EnclosureSurface, Facet, Fault, Faults, Material, Mesh,
    Object, PointLight, PointLightKind, Projection, Scene, Severity, Side, Sky, SkyPatches, Surface, Texture,
    TextureRef, Transmission, Up, Wrap, counted, listed, luminance, size,
};
pub use radiosity_solve as solve;
pub use radiosity_trace::{Found, Place, Tracer};
pub use radiosity_transport as transport;
pub use radiosity_view as view;
pub use radiosity_view::{Audit, Auditor, Dim, Field, Picture, Referee};
