//! Everything that comes in or goes out: glTF, OBJ, View3D, sky pictures, lists of points, form factors.
//!
//! Input is somebody else's data. Whatever the bytes, reading ends, takes no more memory than the bytes justify,
//! opens nothing outside the folder of the file, and answers with a scene of finite numbers or with every fault found.
//!
//! ```no_run
//! # fn main() -> Result<(), radiosity_io::LoadError> {
//! let loaded = radiosity_io::load("room.glb".as_ref(), &radiosity_io::LoadOptions::default())?;
//! for fault in &loaded.faults.0 {
//!     eprintln!("{fault}");
//! }
//! # Ok(()) }
//! ```

mod assemble;
mod bytes;
mod data_uri;
mod enclosure;
mod error;
pub mod factors_out;
pub mod gltf;
pub mod gltf_out;
pub mod image_out;
mod load;
pub mod obj;
mod options;
mod picture;
mod points;
mod sky;
pub mod source;
mod staged;
pub mod vs3;

pub use bytes::Bytes;
pub use enclosure::{Grouping, LoadedEnclosure, enclosure_of, load_enclosure};
pub use error::LoadError;
pub use factors_out::{FactorFormat, FactorRows, FactorTable, FactorsError, write_factors};
pub use gltf::{Document, EncodedImage};
pub use load::{Loaded, load};
pub use options::LoadOptions;
pub use points::{Point, Points, parse_points_csv, read_points, read_points_csv};
pub use sky::{load_sky_hdr, parse_sky};
pub use source::{Folder, Memory, Source, SourceError};
pub use staged::Staged;
pub use vs3::{Vs3, parse_vs3};
