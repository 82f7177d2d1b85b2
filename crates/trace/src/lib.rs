//! Who sees whom: a tree of boxes over the scene's triangles; batches of rays in, hits out.
//!
//! [`Tree`] knows triangles only. [`Tracer`] adds what the scene says of them: which sides take part in the exchange
//! of light, what is cut out, what lets light pass. [`sampling`] holds the points that rays are made from, and
//! [`EmitterTree`] tells which of many emitters to send them to.

#[cfg(target_arch = "x86_64")]
mod avx2;
pub mod beams;
pub mod brute;
mod build;
mod collapse;
mod edges;
pub mod emitters;
mod grid;
mod importance;
mod intersect;
#[cfg(target_arch = "aarch64")]
mod neon;
mod openings;
mod portable;
pub mod ray;
mod shaft;
mod spatial;
pub mod tree;
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
mod walk;

pub use beams::{Beam, Beams};
pub use brute::{blocked_brute, closest_brute, closest_where_brute};
pub use emitters::{Emitter, EmitterTree};
pub use grid::{Cell, Grid, Rectangle};
pub use importance::narrowed;
pub use openings::Openings;
pub use ray::{Hit, Ray};
pub use tree::{Flaw, Tree};

pub mod sampling;
pub mod surface;

pub use surface::{Blocker, Fan, Found, Place, Tracer, quadrilateral};
