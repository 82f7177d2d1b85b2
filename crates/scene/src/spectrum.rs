//! Spectra in N bands, and what the eye makes of them (catalogue 11).
//!
//! A quantity of light is carried as its power in each of N bands of wavelengths, a reflectance as its mean over each. All
//! bands go through one transport together, as three do; only at the end they become the three numbers
//! X = K_m ∫ S(λ) x̄(λ) dλ, Y and Z, with the observer of 1931 for 2° and K_m = 683 lm/W.
//!
//! **A band stands for a spectrum within it.** Its weight is ∫ S x̄ dλ/∫ S dλ over the band with a reference spectrum S, as
//! in the weights of ASTM E308: then S itself has its exact X, Y and Z in any number of bands, one included, and what is
//! spectrally flat within each band beside S has, too. Powers of bands add up to the whole, so no energy is lost. With E for
//! the reference, bands are flat; with the lamp's own spectrum few bands do: eight give a saturated red under A within
//! 0.015 of its x and y.
//!
//! Integrals are the CIE's sums over its tables, each entry standing for 5 nm about it: 377.5 to 782.5 nm. What lies beyond is
//! not seen, 1e-6 of Y.

mod cie;

use cie::{D65, ENTRIES, FIRST, OBSERVER, STEP};

/// Lumens of a watt at 555 nm, by which X, Y and Z are in lumens where powers are in watts (SI, 2019: 683 at 540 THz).
pub const LUMENS_PER_WATT: f64 = 683.0;

/// The second radiation constant of the definition of illuminant A, in nm K, and its temperature on that scale (CIE S 014-2).
const A_CONSTANT: f64 = 1.435e7;
const A_KELVIN: f64 = 2848.0;

/// Linear Rec. 709 from X, Y, Z with white at D65 (IEC 61966-2-1:1999 in the digits of its primaries, x and y to 1e-4).
const RGB_FROM_XYZ: [[f64; 3]; 3] = [
    [3.240_969_941_904_521, -1.537_383_177_570_093, -0.498_610_760_293],
    [-0.969_243_636_280_87, 1.875_967_501_507_72, 0.041_555_057_407_175],
    [0.055_630_079_696_993, -0.203_976_958_888_976, 1.056_971_514_242_878],
];

/// A standard illuminant of the CIE: its relative power by wavelength, 100 at 560 nm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Illuminant {
    /// Tungsten light, a Planckian radiator of 2856 K.
    A,
    /// Daylight of 6504 K.
    D65,
    /// The same at all wavelengths.
    E,
}

impl Illuminant {
    /// All of them.
    pub const ALL: [Illuminant; 3] = [Illuminant::A, Illuminant::D65, Illuminant::E];

    /// Relative power per nm at a wavelength from 380 to 780 nm; what the table has no entry for lies on a line between
    /// two, and beyond it is the last.
    ///
    /// ```
    /// use radiosity_scene::Illuminant;
    /// assert_eq!(Illuminant::D65.power(560.0), 100.0);
    /// assert!((Illuminant::A.power(700.0) - 198.261).abs() < 1e-3);
    /// ```
    pub fn power(self, wavelength_nm: f64) -> f64 {
        match self {
            Illuminant::A => {
                let planck = |nm: f64| nm.powi(-5) / (A_CONSTANT / (A_KELVIN * nm)).exp_m1();
                100.0 * planck(wavelength_nm) / planck(560.0)
            }
            Illuminant::D65 => {
                let at = ((wavelength_nm - FIRST) / STEP).clamp(0.0, (ENTRIES - 1) as f64);
                let k = (at as usize).min(ENTRIES - 2);
                D65[k] + (at - k as f64) * (D65[k + 1] - D65[k])
            }
            Illuminant::E => 100.0,
        }
    }
}

/// Why wavelengths make no bands.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SpectrumError {
    /// Fewer than two edges.
    #[error("bands need at least two edges, there are {0}")]
    Edges(usize),
    /// An edge that is no number, or not above the one before.
    #[error("edge {index} of the bands, {value} nm, is not a finite wavelength above the one before")]
    Order {
        /// Which.
        index: usize,
        /// What was given.
        value: f64,
    },
    /// A band in which there is no light to see.
    #[error("band {0} lies outside 377.5 to 782.5 nm or has no power of the reference spectrum")]
    Unseen(usize),
    /// A reference spectrum that is negative or no number.
    #[error("the reference spectrum is {value} at {wavelength_nm} nm, not a finite power from zero")]
    Power {
        /// Where.
        wavelength_nm: f64,
        /// What it gave.
        value: f64,
    },
}

/// N adjacent bands of wavelengths, and what a unit of power in each is to the eye.
///
/// ```
/// use radiosity_scene::{Illuminant, SpectralBands};
///
/// // Tungsten light in eight bands: its colour is exact, and its powers are an emission of eight bands.
/// let bands = SpectralBands::uniform(8, |nm| Illuminant::A.power(nm))?;
/// let powers = bands.powers(|nm| Illuminant::A.power(nm));
/// let [x, y] = SpectralBands::chromaticity(bands.xyz(&powers));
/// assert!((x - 0.44758).abs() < 1e-5 && (y - 0.40745).abs() < 1e-5);
/// # Ok::<(), radiosity_scene::SpectrumError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct SpectralBands {
    edges_nm: Vec<f64>,
    /// X, Y and Z of a watt in each band.
    weights: Vec<[f64; 3]>,
    /// Power of the reference in the part of each entry of the tables that lies in each band, of all of it in that band.
    shares: Vec<Vec<(usize, f64)>>,
}

impl SpectralBands {
    /// Bands between rising edges, nm; `reference` is the relative power per nm of the spectrum that bands are weighted by.
    ///
    /// # Errors
    /// [`SpectrumError`] for edges that do not rise, bands outside 377.5 to 782.5 nm, and a reference that is no spectrum.
    pub fn new(edges_nm: Vec<f64>, reference: impl Fn(f64) -> f64) -> Result<SpectralBands, SpectrumError> {
        if edges_nm.len() < 2 {
            return Err(SpectrumError::Edges(edges_nm.len()));
        }
        let is_rising = |k: usize| edges_nm[k].is_finite() && (k == 0 || edges_nm[k] > edges_nm[k - 1]);
        if let Some(index) = (0..edges_nm.len()).find(|k| !is_rising(*k)) {
            return Err(SpectrumError::Order { index, value: edges_nm[index] });
        }
        let mut power = Vec::with_capacity(ENTRIES);
        for wavelength_nm in (0..ENTRIES).map(wavelength) {
            let value = reference(wavelength_nm);
            if !(value.is_finite() && value >= 0.0) {
                return Err(SpectrumError::Power { wavelength_nm, value });
            }
            power.push(value);
        }
        let (mut weights, mut shares) = (Vec::new(), Vec::new());
        for (band, edges) in edges_nm.windows(2).enumerate() {
            let within: Vec<(usize, f64)> = parts(edges).map(|(k, width)| (k, width * power[k])).collect();
            let whole: f64 = within.iter().map(|(_, power)| power).sum();
            if whole <= 0.0 {
                return Err(SpectrumError::Unseen(band));
            }
            let share: Vec<(usize, f64)> = within.into_iter().map(|(k, power)| (k, power / whole)).collect();
            weights.push(std::array::from_fn(|c| {
                LUMENS_PER_WATT * share.iter().map(|(k, share)| share * OBSERVER[*k][c]).sum::<f64>()
            }));
            shares.push(share);
        }
        Ok(SpectralBands { edges_nm, weights, shares })
    }

    /// `n` bands of the same width over all that the eye sees, 377.5 to 782.5 nm.
    ///
    /// # Errors
    /// As [`SpectralBands::new`].
    pub fn uniform(n: usize, reference: impl Fn(f64) -> f64) -> Result<SpectralBands, SpectrumError> {
        let (low, width) = (FIRST - 0.5 * STEP, STEP * ENTRIES as f64);
        SpectralBands::new((0..=n).map(|k| low + width * k as f64 / n.max(1) as f64).collect(), reference)
    }

    /// Number of bands.
    pub fn len(&self) -> usize {
        self.weights.len()
    }

    /// Never: there is a band at least.
    pub fn is_empty(&self) -> bool {
        self.weights.is_empty()
    }

    /// The edges, nm: one more than bands.
    pub fn edges_nm(&self) -> &[f64] {
        &self.edges_nm
    }

    /// Power of a spectrum (per nm) in each band: an emission of N bands.
    pub fn powers(&self, spectrum: impl Fn(f64) -> f64) -> Vec<f64> {
        let band = |edges: &[f64]| parts(edges).map(|(k, width)| width * spectrum(wavelength(k))).sum();
        self.edges_nm.windows(2).map(band).collect()
    }

    /// Mean of a reflectance, transmittance or the like over each band, by the power of the reference in it: of what that
    /// brings, so much is given back.
    pub fn means(&self, spectrum: impl Fn(f64) -> f64) -> Vec<f64> {
        let band = |share: &Vec<(usize, f64)>| share.iter().map(|(k, share)| share * spectrum(wavelength(*k))).sum();
        self.shares.iter().map(band).collect()
    }

    /// X, Y and Z of powers by band, W to lm (or W/m² to lm/m²).
    ///
    /// # Panics
    /// If there is not one power for each band.
    pub fn xyz(&self, powers: &[f64]) -> [f64; 3] {
        assert_eq!(powers.len(), self.len(), "one power for each band");
        std::array::from_fn(|c| powers.iter().zip(&self.weights).map(|(power, weight)| power * weight[c]).sum())
    }

    /// Linear Rec. 709 of powers by band, as scenes have it in three; of a colour outside its triangle one is negative.
    ///
    /// # Panics
    /// As [`SpectralBands::xyz`].
    pub fn linear_rgb(&self, powers: &[f64]) -> [f64; 3] {
        linear_rgb(self.xyz(powers))
    }

    /// x and y of X, Y and Z; those of black are 0.
    pub fn chromaticity(xyz: [f64; 3]) -> [f64; 2] {
        let sum: f64 = xyz.iter().sum();
        if sum == 0.0 { [0.0; 2] } else { [xyz[0] / sum, xyz[1] / sum] }
    }
}

/// Linear Rec. 709 from X, Y and Z, white D65: its Y is that of [`crate::luminance`] to the digits of either.
pub fn linear_rgb(xyz: [f64; 3]) -> [f64; 3] {
    RGB_FROM_XYZ.map(|row| row.iter().zip(xyz).map(|(m, x)| m * x).sum())
}

/// Wavelength of an entry, nm.
fn wavelength(k: usize) -> f64 {
    FIRST + STEP * k as f64
}

/// The entries of the tables that reach into a band, with how far they do, nm.
fn parts(edges: &[f64]) -> impl Iterator<Item = (usize, f64)> + '_ {
    let part = |k: usize| {
        let (low, high) = (wavelength(k) - 0.5 * STEP, wavelength(k) + 0.5 * STEP);
        (k, high.min(edges[1]) - low.max(edges[0]))
    };
    (0..ENTRIES).map(part).filter(|(_, width)| *width > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x and y in CIE 15:2004, tables T.3.
    const WHITES: [(Illuminant, [f64; 2]); 3] = [
        (Illuminant::A, [0.447_58, 0.407_45]),
        (Illuminant::D65, [0.312_72, 0.329_03]),
        (Illuminant::E, [1.0 / 3.0, 1.0 / 3.0]),
    ];

    #[test]
    fn the_table_has_the_sums_of_the_cie() {
        let sums: [f64; 3] = std::array::from_fn(|c| OBSERVER.iter().map(|entry| entry[c]).sum());
        for (sum, published) in sums.into_iter().zip([21.371_524, 21.371_327, 21.371_540]) {
            assert!((sum - published).abs() < 1e-9, "{sum}");
        }
    }

    /// An illuminant in any number of bands, each weighted by itself, has its own x and y; flat bands need some hundred.
    #[test]
    fn catalogue_11_illuminants_have_their_chromaticity() {
        for (illuminant, published) in WHITES {
            let of = |bands: &SpectralBands| {
                SpectralBands::chromaticity(bands.xyz(&bands.powers(|nm| illuminant.power(nm))))
            };
            for n in [1, 2, 3, 7, 8, 16, 31, 81, 200] {
                let bands = SpectralBands::uniform(n, |nm| illuminant.power(nm)).unwrap();
                for (found, published) in of(&bands).into_iter().zip(published) {
                    assert!((found - published).abs() < 1e-5, "{illuminant:?} in {n} bands: {found} for {published}");
                }
            }
            let flat = SpectralBands::uniform(81, |_| 1.0).unwrap();
            assert!(of(&flat).into_iter().zip(published).all(|(x, y)| (x - y).abs() < 1e-5), "{:?}", of(&flat));
            let few = SpectralBands::uniform(16, |_| 1.0).unwrap();
            assert!(of(&few).into_iter().zip(published).all(|(x, y)| (x - y).abs() < 1e-2), "{:?}", of(&few));
        }
    }

    /// Powers of bands add up, however they are cut; their luminous flux, too.
    #[test]
    fn catalogue_11_bands_lose_no_energy() {
        let spectrum = |nm: f64| Illuminant::D65.power(nm);
        let whole = SpectralBands::uniform(1, spectrum).unwrap();
        let (power, flux) = (whole.powers(spectrum)[0], whole.xyz(&whole.powers(spectrum))[1]);
        for n in [3, 10, 77] {
            let bands = SpectralBands::uniform(n, spectrum).unwrap();
            let powers = bands.powers(spectrum);
            assert!((powers.iter().sum::<f64>() / power - 1.0).abs() < 1e-13);
            assert!((bands.xyz(&powers)[1] / flux - 1.0).abs() < 1e-13);
        }
        // One watt at 555 nm, as narrow as the tables: 683 lm.
        let green = SpectralBands::new(vec![552.5, 557.5], |_| 1.0).unwrap();
        assert!((green.xyz(&[1.0])[1] - 683.0).abs() < 1e-10);
    }

    /// White is white: D65 has equal parts of red, green and blue, and their luminance is Y.
    #[test]
    fn daylight_is_white() {
        let spectrum = |nm: f64| Illuminant::D65.power(nm);
        let bands = SpectralBands::uniform(9, spectrum).unwrap();
        let powers = bands.powers(spectrum);
        let (rgb, y) = (bands.linear_rgb(&powers), bands.xyz(&powers)[1]);
        assert!(rgb.iter().all(|c| (c / y - 1.0).abs() < 1e-3), "{rgb:?} of {y}");
        let luminance: f64 = rgb.iter().zip(crate::LUMINANCE).map(|(c, w)| c * f64::from(w)).sum();
        assert!((luminance / y - 1.0).abs() < 1e-4);
    }

    /// A surface of smooth colour: eight bands by the lamp's own spectrum against all that the tables have.
    #[test]
    fn few_bands_by_the_lamp_do_for_smooth_colours() {
        let lamp = |nm: f64| Illuminant::A.power(nm);
        let red = |nm: f64| 0.05 + 0.8 / (1.0 + ((600.0 - nm) / 12.0).exp());
        let colour = |n: usize| {
            let bands = SpectralBands::uniform(n, lamp).unwrap();
            let lit: Vec<f64> = bands.powers(lamp).iter().zip(bands.means(red)).map(|(p, rho)| p * rho).collect();
            SpectralBands::chromaticity(bands.xyz(&lit))
        };
        let (few, all) = (colour(8), colour(81));
        assert!(few.into_iter().zip(all).all(|(x, y)| (x - y).abs() < 1.5e-2), "{few:?} for {all:?}");
    }

    #[test]
    fn what_makes_no_bands_is_refused() {
        let is = |edges: &[f64]| SpectralBands::new(edges.to_vec(), |_| 1.0).unwrap_err();
        assert_eq!(is(&[500.0]), SpectrumError::Edges(1));
        assert_eq!(is(&[500.0, 500.0]), SpectrumError::Order { index: 1, value: 500.0 });
        assert!(matches!(is(&[f64::NAN, 500.0]), SpectrumError::Order { index: 0, .. }));
        assert_eq!(is(&[500.0, 600.0, 790.0, 800.0]), SpectrumError::Unseen(2));
        let negative = SpectralBands::uniform(3, |nm| 500.0 - nm).unwrap_err();
        assert_eq!(negative, SpectrumError::Power { wavelength_nm: 505.0, value: -5.0 });
        assert!(SpectralBands::uniform(0, |_| 1.0).is_err());
    }
}
