//! From unknowns to what people ask for: continuous fields, pictures, lightmaps, and how far to trust them.
//!
//! Everything here works on plain arrays by element and band and on rays; nothing knows which transport or which
//! solver made the numbers.

pub mod audit;
pub mod lightmap;
pub mod picture;
pub mod pool;
pub mod reconstruct;
pub mod referee;

pub use audit::{Audit, Auditor, Dim};
pub use picture::{Picture, ViewRays};
pub use pool::Pooled;
pub use reconstruct::{FLAT, Field, Finding, Planes, Shared, shared_corner};
pub use referee::Referee;
