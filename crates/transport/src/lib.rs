//! F in its forms: who gives how much light to whom.
//!
//! The default form is a table of hit ids ([`HitTable`]): receiver i sends M cosine-distributed rays and keeps the id
//! of what each one met; every entry weighs 1/M, so a row sums to exactly one. Small and bright sources do not go
//! through rows: [`Luminaires`] gives their light as a direct column each. Receivers are elements while the equation
//! is solved and points when an answer is read; both go through the same code ([`Receivers`]).

mod block;
pub mod direct;
mod eclipse;
pub mod exposure;
mod flat;
pub mod form_factors;
pub mod gather;
mod glance;
mod glow;
pub(crate) mod lanes;
pub mod live;
pub mod luminaires;
pub mod nodes;
mod one_light;
pub mod pair;
mod parts;
mod pilot;
pub mod polygon;
pub mod receivers;
pub mod regions;
pub mod row;
pub mod rows;
pub mod view_factors;
pub mod zones;

pub use block::FileError;
pub use direct::{Columns, HalvedLight, Shadowing, Variation};
pub use exposure::Exposure;
pub use form_factors::{FormFactorMethod, FormFactorOptions, FormFactors, UnknownFormFactorMethod};
pub use gather::Gather;
pub use luminaires::{Light, Luminaires};
pub use nodes::{NodeMesh, NodeOptions, node_transport};
pub use pair::{Factor, Occlusion, PAIRS, Pair, PairMethod, Unoccluded};
pub use receivers::{ElementReceivers, PointReceivers, Receivers, ShadedReceivers, Site};
pub use regions::{RegionOptions, RegionSize, Regions, regions};
pub use row::{Row, RowFactors};
pub use rows::{ExtendError, HitTable, IdSpace, RowIds};
pub use view_factors::FactorError;
pub use zones::{Zone, ZoneExchange, ZoneOptions, zone_exchange};

/// Tells a long computation's progress and may end it.
pub trait Progress: Sync {
    /// `done` of `total` units of the current stage are finished; answers whether to go on.
    fn step(&self, done: usize, total: usize) -> bool;
}

/// No report, no interruption.
impl Progress for () {
    fn step(&self, _done: usize, _total: usize) -> bool {
        true
    }
}

/// A computation was stopped by its [`Progress`].
#[derive(Clone, Copy, Debug, thiserror::Error, PartialEq, Eq)]
#[error("stopped on request")]
pub struct Stopped;
