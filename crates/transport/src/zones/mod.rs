//! Participating media by the zonal method (Hottel and Sarofim 1967, "Radiative Transfer"; catalogue 14).
//!
//! Space is cut into zones of uniform, grey, isotropically scattering medium: absorption a and scattering s, together the
//! extinction κ = a + s, in 1/m. Between facets and zones there are *direct exchange areas*, in m²:
//!
//! ```text
//! s_i s_j = ∫∫ cos θ_i cos θ_j τ/(π r²) dA_j dA_i
//! s_i g_j = ∫∫ cos θ_i κ_j τ/(π r²) dV_j dA_i
//! g_i g_j = ∫∫ κ_i κ_j τ/(π r²) dV_j dV_i          with τ = V exp(−∫ κ dr) from one point to the other.
//! ```
//!
//! In a closed enclosure Σ_j s_i s_j + Σ_j s_i g_j = A_i and Σ_j g_i s_j + Σ_j g_i g_j = 4κ_i V_i.
//!
//! **Zones are further rows of B = E + R F B.** With J the source function of a zone, times π, and H what it receives,
//! Σ (x_ij J_j)/(4κV), it gives off J = (1 − ω) E_g + ω H with the albedo ω = s/κ. That is the equation of a facet of
//! area 4κV, reflectance ω and emission (1 − ω) E_g: every solver takes it as it is ([`ZoneExchange::transport`],
//! [`ZoneExchange::response`], [`ZoneExchange::emission`]), and [`radiosity_solve::script_f`] makes total exchange areas of it.
//!
//! **How they are found.** Along a line all three integrals are differences of e^-∫κ dr, so that no 1/r² is left, a
//! zone's own share is as harmless as its neighbours', and what a line carries adds up (`row`). Lines start from every facet
//! and zone; a pair is seen from both of its ends and stored once, so reciprocity is bitwise and what rows lack is an honest
//! measure of the error ([`ZoneExchange::closure`]). The factors without medium are those of [`crate::view_factors`],
//! and lines only say what the medium does to them: without it they are what they are, exactly.
//!
//! **It fails** where zones are too large for the field in them to be uniform: κ times their size should be well below one,
//! or the field smooth, as in any zonal method. Errors fall about as the number of lines to the power −0.75: four digits
//! are cheap, six are not. Lines know single precision where they meet facets, 1e-7 of the scene's extent.

mod cell;
mod check;
mod exchange;
mod medium;
mod row;
#[cfg(test)]
mod tests;

pub use cell::{Cell, CellError};
pub use check::ZoneFault;
pub use exchange::ZoneExchange;

use crate::view_factors::{Entry, Exchange, FactorError, ViewFactorOptions, ViewFactors, view_factors};
use crate::{Progress, Stopped};
use medium::Medium;
use radiosity_scene::Enclosure;
use rayon::prelude::*;
use row::{Aim, Row, both, facet_row, zone_row};
use std::sync::atomic::{AtomicUsize, Ordering};

/// A cell filled with a medium.
#[derive(Clone, Debug)]
pub struct Zone {
    /// The space.
    pub cell: Cell,
    /// Absorption coefficient a, 1/m.
    pub absorption: f64,
    /// Scattering coefficient s, 1/m; what is scattered goes everywhere alike.
    pub scattering: f64,
}

impl Zone {
    /// κ = a + s, 1/m.
    pub fn extinction(&self) -> f64 {
        self.absorption + self.scattering
    }

    /// ω = s/κ; zero without a medium.
    pub fn albedo(&self) -> f64 {
        let kappa = self.extinction();
        if kappa > 0.0 { self.scattering / kappa } else { 0.0 }
    }

    /// 4κV, m²: what the row of the zone sums to.
    pub fn exchange(&self) -> f64 {
        4.0 * self.extinction() * self.cell.volume()
    }
}

/// How exact exchange areas are to be, and what they may take.
#[derive(Clone, Copy, Debug)]
pub struct ZoneOptions {
    /// Largest error of each exchange area, as three standard errors, relative to the smaller of what the two rows sum
    /// to (A or 4κV). The default 1e-3 is below what zones of uniform temperature leave of a furnace; 1e-4 takes some
    /// thirty times as long.
    pub accuracy: f64,
    /// Most lines of a row. The default, four million, takes some ten seconds a row and gives errors of 1e-5 where
    /// little stands in the way; what is reached then is told ([`ZoneExchange::reached`]).
    pub lines: usize,
    /// Each seed has its own lines.
    pub seed: u32,
    /// Of the factors without medium.
    pub vacuum: ViewFactorOptions,
}

impl Default for ZoneOptions {
    fn default() -> Self {
        ZoneOptions { accuracy: 1e-3, lines: 1 << 22, seed: 0, vacuum: ViewFactorOptions::default() }
    }
}

/// Why there are no exchange areas.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ZoneError {
    /// Zones that cannot be: all that is wrong with them.
    #[error("{}", list(.0))]
    Zones(Vec<ZoneFault>),
    /// An accuracy that is not between 0 and 1.
    #[error("an accuracy of {0} for exchange areas is not between 0 and 1")]
    Accuracy(f64),
    /// Stopped, or too little memory.
    #[error(transparent)]
    Factors(#[from] FactorError),
}

impl From<Stopped> for ZoneError {
    fn from(stopped: Stopped) -> ZoneError {
        ZoneError::Factors(stopped.into())
    }
}

fn list(faults: &[ZoneFault]) -> String {
    faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}

/// The direct exchange areas between all facets of an enclosure and all zones. Facets are opaque from both sides; what
/// ends on their backs or on obstructions is lost, as what leaves an open enclosure. The same on any number of threads.
///
/// ```
/// use glam::DVec3;
/// use radiosity_scene::{Enclosure, Facet};
/// use radiosity_solve::{Go, Params, Solver, solve};
/// use radiosity_transport::zones::{Cell, Zone, ZoneOptions, zone_exchange};
///
/// // A black cube of one metre full of grey gas.
/// let gas = Zone { cell: Cell::cuboid(DVec3::ZERO, DVec3::ONE)?, absorption: 1.0, scattering: 0.0 };
/// let mut cube = Enclosure { is_closed: true, ..Enclosure::default() };
/// for face in gas.cell.faces() {
///     cube.add("wall", face.flipped());
/// }
/// let mut exchange = zone_exchange(&cube, &[gas], &ZoneOptions::default(), &())?;
/// exchange.repair();
///
/// // Gas that emits like a black body of 1 W/m², between cold walls: what they absorb comes from the gas.
/// let response = exchange.response(&[0.0; 6]);
/// let e = exchange.emission(&[0.0; 6], &[1.0]);
/// let mut b = vec![0.0; e.len()];
/// solve(Solver::Lu, &exchange.transport()?, &response, &e, &mut b, &Params::default(), |_, _| Go::On)?;
/// let (walls, gas) = exchange.net_loss(&b);
/// assert!((gas[0] + walls.iter().sum::<f64>()).abs() < 1e-9);
/// assert!((gas[0] / 6.0 - 0.446).abs() < 2e-3); // the emissivity of a cube of optical edge 1
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`ZoneError::Zones`] for coefficients that are negative or no numbers, zones that overlap and facets that cut through
/// them, all at once; [`ZoneError::Accuracy`]; [`ZoneError::Factors`] if `progress` says so.
pub fn zone_exchange(
    enclosure: &Enclosure,
    zones: &[Zone],
    options: &ZoneOptions,
    progress: &dyn Progress,
) -> Result<ZoneExchange, ZoneError> {
    if !(options.accuracy > 0.0 && options.accuracy < 1.0) {
        return Err(ZoneError::Accuracy(options.accuracy));
    }
    let faults = check::faults(enclosure, zones);
    if !faults.is_empty() {
        return Err(ZoneError::Zones(faults));
    }
    let vacuum = view_factors(enclosure, &options.vacuum, progress)?;
    let facets = enclosure.facets.len();
    // What each facet sees, with A_i F_ij.
    let mut faced: Vec<Vec<(u32, f64)>> = vec![Vec::new(); facets];
    for (i, j, exchange, _) in vacuum.entries().filter(|(_, _, exchange, _)| *exchange > 0.0) {
        faced[i].push((j as u32, exchange));
        faced[j].push((i as u32, exchange));
    }
    let dense: Vec<usize> = (0..zones.len()).filter(|z| zones[*z].extinction() > 0.0).collect();
    let medium = Medium::new(enclosure, zones, &dense);
    let sums: Vec<f64> = vacuum.areas().iter().copied().chain(dense.iter().map(|z| zones[*z].exchange())).collect();
    let aim = Aim { accuracy: options.accuracy, lines: options.lines, seed: options.seed };
    let done = AtomicUsize::new(0);
    let step = |row: Row| {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        progress.step(done, sums.len()).then_some(row).ok_or(Stopped)
    };
    let facet = |i: usize| step(facet_row(&medium, sums[i], i, &faced[i], aim));
    let mut rows: Vec<Row> = (0..facets).into_par_iter().with_max_len(1).map(facet).collect::<Result<_, _>>()?;
    // Zones need not find out what facets know well enough.
    let zone = |k: usize| {
        let known: Vec<_> = (0..facets).map(|i| (rows[i].error(facets + k, sums[i]), sums[i])).collect();
        step(zone_row(&medium, k, &known, aim))
    };
    let of_zones: Vec<Row> = (0..dense.len()).into_par_iter().with_max_len(1).map(zone).collect::<Result<_, _>>()?;
    rows.extend(of_zones);
    let lines = rows.iter().map(|row| row.lines).sum();
    Ok(ZoneExchange::new(pairs(sums, &rows, &vacuum), facets, zones, &dense, lines))
}

/// Each pair from both of its ends, weighted by the inverse squares of their errors.
fn pairs(sums: Vec<f64>, rows: &[Row], vacuum: &ViewFactors) -> ViewFactors {
    let facets = vacuum.len();
    let of_row = |i: usize| {
        let pair = |j: usize| {
            let (own, other) = (rows[i].values[j], rows[j].values[i]);
            if own == 0.0 && other == 0.0 {
                return Exchange::default();
            }
            let (own_error, other_error) = (rows[i].error(j, sums[i]), rows[j].error(i, sums[j]));
            let squares = own_error * own_error + other_error * other_error;
            let share = if squares > 0.0 { other_error * other_error / squares } else { 0.5 };
            let value = other + share * (own - other);
            let error = if i == j { own_error } else { both(own_error, other_error) };
            if j >= facets {
                return Exchange { value, error };
            }
            // The medium takes of the error without it what it takes of the factor.
            let free = vacuum.factor(i, j);
            let left = if free.value > 0.0 { (value / (free.value * sums[i])).min(1.0) } else { 1.0 };
            Exchange { value, error: error + left * free.error * sums[i] }
        };
        let entries = (i..rows.len()).map(|j| (j, pair(j)));
        let entries = entries.filter(|(_, exchange)| exchange.value > 0.0 || exchange.error > 0.0);
        entries.map(|(j, exchange)| Entry::new(i as u32, j as u32, exchange)).collect()
    };
    let entries: Vec<Vec<Entry>> = (0..rows.len()).map(of_row).collect();
    ViewFactors::new(sums, entries.into_iter(), vacuum.choices)
}
