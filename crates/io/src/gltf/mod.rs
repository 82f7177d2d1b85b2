//! glTF 2.0 in: the [`Document`] as it stands, and the scene it means.

pub mod accessor;
mod decompress;
pub mod document;
mod extensions;
pub(crate) mod json;
mod light;
mod lit;
mod material;
mod meshopt;
pub(crate) mod nodes;
mod primitive;
mod scene;

pub use accessor::{Accessor, AccessorError, Component};
pub use document::{Document, EncodedImage};
pub use scene::load;
