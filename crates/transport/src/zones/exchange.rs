//! The exchange areas of an enclosure with a medium, each stored once, and the equation that they make.

use super::Zone;
use crate::FormFactors;
use crate::pair::Factor;
use crate::view_factors::{Closure, Repair, ViewFactors};
use radiosity_solve::{DiffuseResponse, SolveError, SparseTransport};

/// Direct exchange areas between N facets and M zones. Transparent zones exchange nothing and are no unknowns: those are
/// the facets and then the other zones, in their order.
#[derive(Clone, Debug)]
pub struct ZoneExchange {
    /// With 4κV for the areas of zones.
    factors: ViewFactors,
    facets: usize,
    /// The unknown of each zone.
    unknown: Vec<Option<usize>>,
    /// ω by unknown zone.
    albedo: Vec<f64>,
    /// Lines that were followed.
    pub lines: usize,
}

impl ZoneExchange {
    pub(super) fn new(
        factors: ViewFactors,
        facets: usize,
        zones: &[Zone],
        dense: &[usize],
        lines: usize,
    ) -> ZoneExchange {
        let mut unknown = vec![None; zones.len()];
        dense.iter().enumerate().for_each(|(k, zone)| unknown[*zone] = Some(facets + k));
        let albedo = dense.iter().map(|zone| zones[*zone].albedo()).collect();
        ZoneExchange { factors, facets, unknown, albedo, lines }
    }

    /// Number of facets and of zones.
    pub fn len(&self) -> [usize; 2] {
        [self.facets, self.unknown.len()]
    }

    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.len() == [0, 0]
    }

    /// s_i s_j between two facets, m².
    pub fn surface_surface(&self, i: usize, j: usize) -> Factor {
        assert!(i < self.facets && j < self.facets, "facets {i} and {j} of {}", self.facets);
        self.area(Some(i), Some(j))
    }

    /// s_i g_j between a facet and a zone, m².
    pub fn surface_gas(&self, facet: usize, zone: usize) -> Factor {
        assert!(facet < self.facets, "facet {facet} of {}", self.facets);
        self.area(Some(facet), self.unknown[zone])
    }

    /// g_i g_j between two zones, or a zone and itself, m².
    pub fn gas_gas(&self, i: usize, j: usize) -> Factor {
        self.area(self.unknown[i], self.unknown[j])
    }

    fn area(&self, i: Option<usize>, j: Option<usize>) -> Factor {
        let (Some(i), Some(j)) = (i, j) else { return Factor::default() };
        let Factor { value, error } = self.factors.factor(i, j);
        let area = self.factors.areas()[i];
        Factor { value: area * value, error: area * error }
    }

    /// By unknowns: x_ij/A_i or x_ij/(4κV), with A or 4κV for areas.
    pub fn factors(&self) -> &ViewFactors {
        &self.factors
    }

    /// Largest stated error of an exchange area relative to the smaller sum of its two rows: what has become of
    /// [`super::ZoneOptions::accuracy`].
    pub fn reached(&self) -> f64 {
        let sums = self.factors.areas();
        let relative = |(i, j, _, error): (usize, usize, f64, f64)| error / sums[i].min(sums[j]);
        self.factors.entries().map(relative).fold(0.0, f64::max)
    }

    /// How far rows are from summing to A or 4κV, relative to that.
    pub fn closure(&self) -> Closure {
        self.factors.closure()
    }

    /// Makes the rows of a closed enclosure sum to A and 4κV by moving what is uncertain (the least change in terms of
    /// the errors); then no energy is lost.
    pub fn repair(&mut self) -> Repair {
        self.factors.repair()
    }

    /// F between unknowns, for any solver; reciprocal to rounding.
    ///
    /// # Errors
    /// [`SolveError`] if an area is no finite number.
    pub fn transport(&self) -> Result<SparseTransport, SolveError> {
        FormFactors::from(self.factors.clone()).transport()
    }

    /// R: reflectances of facets (in bands, interleaved, as many as there are numbers for each facet), albedos of zones.
    pub fn response(&self, reflectances: &[f64]) -> DiffuseResponse {
        let bands = self.bands(reflectances);
        let albedos = self.albedo.iter().flat_map(|albedo| std::iter::repeat_n(*albedo, bands));
        DiffuseResponse {
            reflectance: reflectances.iter().copied().chain(albedos).collect(),
            bands,
            reciprocal_area: Some(self.factors.areas().to_vec()),
        }
    }

    /// E of the unknowns: what facets emit (ε σT⁴, W/m²), and what a black body of the temperature of each zone would (σT⁴),
    /// times 1 − ω; bands interleaved.
    pub fn emission(&self, facets: &[f64], zones: &[f64]) -> Vec<f64> {
        let bands = self.bands(facets);
        assert_eq!(zones.len(), bands * self.unknown.len(), "one number for each zone and band");
        let mut e = facets.to_vec();
        for (zone, _) in self.unknown.iter().enumerate().filter(|(_, unknown)| unknown.is_some()) {
            let absorbs = 1.0 - self.albedo[e.len() / bands - self.facets];
            e.extend(zones[zone * bands..(zone + 1) * bands].iter().map(|black| absorbs * black));
        }
        e
    }

    /// What each facet and each zone loses, W, by the solution of one band: all that it gives off, A_i b_i or 4κV b_i, less
    /// Σ_j x_ij b_j that it receives. In a closed enclosure the sum over all is zero up to the closure's defect, and to
    /// rounding after [`ZoneExchange::repair`].
    pub fn net_loss(&self, b: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let sums = self.factors.areas();
        assert_eq!(b.len(), sums.len(), "one number for each unknown");
        let mut loss: Vec<f64> = sums.iter().zip(b).map(|(sum, b)| sum * b).collect();
        for (i, j, exchange, _) in self.factors.entries() {
            loss[i] -= exchange * b[j];
            if i != j {
                loss[j] -= exchange * b[i];
            }
        }
        let zones = self.unknown.iter().map(|unknown| unknown.map_or(0.0, |k| loss[k])).collect();
        loss.truncate(self.facets);
        (loss, zones)
    }

    fn bands(&self, of_facets: &[f64]) -> usize {
        let bands = of_facets.len() / self.facets.max(1);
        assert_eq!(bands * self.facets, of_facets.len(), "one number for each facet and band");
        bands.max(1)
    }
}
