//! Spectra of N bands: one transport carries them all, and the eye sees three numbers in the end (catalogue 11).

use glam::DVec3;
use radiosity_scene::{Enclosure, Facet, Illuminant, SpectralBands};
use radiosity_solve::{AreaSpace, DiffuseResponse, Go, Params, SolveError, Solver, Transport, solve_operator};
use radiosity_transport::{FormFactorMethod, FormFactorOptions, FormFactors, Progress};
use std::sync::atomic::{AtomicUsize, Ordering};

/// A transport that counts how often it is applied.
struct Counted<T>(T, AtomicUsize);

impl<T: Transport<Space = AreaSpace>> Transport for Counted<T> {
    type Space = AreaSpace;

    fn space(&self) -> &AreaSpace {
        self.0.space()
    }

    fn apply(&self, b: &[f64], h: &mut [f64], bands: usize) -> Result<(), SolveError> {
        self.1.fetch_add(1, Ordering::Relaxed);
        self.0.apply(b, h, bands)
    }
}

/// Counts the rows that are made.
struct Rows(AtomicUsize);

impl Progress for Rows {
    fn step(&self, _: usize, _: usize) -> bool {
        self.0.fetch_add(1, Ordering::Relaxed);
        true
    }
}

/// The unit cube from inside.
fn cube() -> Enclosure {
    let mut cube = Enclosure { is_closed: true, ..Enclosure::default() };
    for k in 0..3 {
        let [u, v, w] = [0, 1, 2].map(|m| DVec3::AXES[(k + m) % 3]);
        cube.add("near", Facet::new(vec![DVec3::ZERO, u, u + v, v]).unwrap());
        cube.add("far", Facet::new(vec![w, w + v, w + u + v, w + u]).unwrap());
    }
    cube
}

/// Sixteen bands of tungsten light between coloured walls: F is found once, each step of the solver applies it once to all
/// bands, as often as the slowest band alone asks for; every band is what it is alone.
#[test]
fn catalogue_11_bands_cost_one_transport() {
    let n = 16;
    let lamp = |nm: f64| Illuminant::A.power(nm);
    let bands = SpectralBands::uniform(n, lamp).unwrap();
    let rows = Rows(AtomicUsize::new(0));
    let method: FormFactorMethod = "lambert".parse().unwrap();
    let factors = FormFactors::new(method, &cube(), &FormFactorOptions::default(), &rows).unwrap();
    let transport = Counted(factors.transport().unwrap(), AtomicUsize::new(0));

    // A red and a green wall, others white; the far face of the first axis is the lamp.
    let red = bands.means(|nm| 0.05 + 0.7 / (1.0 + ((600.0 - nm) / 15.0).exp()));
    let green = bands.means(|nm| 0.05 + 0.5 * (-((nm - 540.0) / 40.0).powi(2)).exp());
    let white = bands.means(|_| 0.8);
    let reflectance: Vec<f64> = [&white, &white, &red, &green, &white, &white].into_iter().flatten().copied().collect();
    let mut e = vec![0.0; 6 * n];
    e[n..2 * n].copy_from_slice(&bands.powers(lamp));

    let params = Params { tolerance: 1e-12, ..Params::default() };
    let run = |reflectance: Vec<f64>, e: &[f64], bands: usize| {
        let response = DiffuseResponse { reflectance, bands, reciprocal_area: None };
        let mut b = vec![0.0; e.len()];
        transport.1.store(0, Ordering::Relaxed);
        solve_operator(Solver::Jacobi, &transport, &response, e, &mut b, &params, |_, _| Go::On).unwrap();
        (b, transport.1.load(Ordering::Relaxed))
    };
    let (together, applied) = run(reflectance.clone(), &e, n);
    let one = |x: &[f64], band: usize| -> Vec<f64> { x.iter().skip(band).step_by(n).copied().collect() };
    let mut most = 0;
    for band in 0..n {
        let (alone, times) = run(one(&reflectance, band), &one(&e, band), 1);
        most = most.max(times);
        for (x, y) in one(&together, band).iter().zip(&alone) {
            assert!((x - y).abs() <= 1e-10 * y.abs(), "band {band}: {x} {y}");
        }
    }
    assert_eq!(applied, most, "applications of F for all bands, and for the slowest");
    // Six rows, however many bands.
    assert_eq!(rows.0.load(Ordering::Relaxed), 6);

    // The lamp itself has the colour of illuminant A but for what comes back; walls have their own.
    let colour = |facet: usize| SpectralBands::chromaticity(bands.xyz(&together[facet * n..(facet + 1) * n]));
    let [lamp, red, green] = [1, 2, 3].map(colour);
    assert!((SpectralBands::chromaticity(bands.xyz(&e[n..2 * n]))[0] - 0.447_58).abs() < 1e-5);
    assert!(lamp[0] > 0.44 && red[0] > lamp[0] + 0.05 && green[1] > lamp[1] + 0.03, "{lamp:?} {red:?} {green:?}");
}
