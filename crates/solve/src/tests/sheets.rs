//! Diffuse transmission: two rooms that share a pane (catalogue 12, 13).

use super::tight;
use crate::*;

/// Unknowns: the walls of the first room, the two sides of the pane, the walls of the second room. The pane is a sixth of
/// each room's surface, and sees the walls alone.
fn rooms() -> DenseTransport {
    let rows = vec![0.8, 0.2, 0., 0., 1., 0., 0., 0., 0., 0., 0., 1., 0., 0., 0.2, 0.8];
    DenseTransport::new(vec![5.0, 1.0, 1.0, 5.0], rows).unwrap()
}

/// Reflectances by unknown and τ, of two bands.
fn pane(bands: [([f64; 4], f64); 2]) -> SheetResponse {
    let reflectance = (0..4).flat_map(|i| bands.map(|(rho, _)| rho[i])).collect();
    let tau = |i: usize| bands.map(|(_, tau)| if i == 1 || i == 2 { tau } else { 0.0 });
    SheetResponse {
        diffuse: DiffuseResponse { reflectance, bands: 2, reciprocal_area: Some(vec![5.0, 1.0, 1.0, 5.0]) },
        opposite: vec![0, 2, 1, 3],
        transmittance: (0..4).flat_map(tau).collect(),
    }
}

/// The energy balance of two rooms, of which the walls of the first give off one: with p and q the sides of the pane,
/// B_1 (1 − 0.8 ρ_1 − 0.2 ρ_1 ρ_p) = 1 + 0.2 ρ_1 τ B_2 and B_2 (1 − 0.8 ρ_2 − 0.2 ρ_2 ρ_q) = 0.2 ρ_2 τ B_1.
fn balance([first, p, q, second]: [f64; 4], tau: f64) -> [f64; 4] {
    let own = |wall: f64, side: f64| 1.0 - 0.8 * wall - 0.2 * wall * side;
    let ratio = 0.2 * second * tau / own(second, q);
    let b1 = 1.0 / (own(first, p) - 0.2 * first * tau * ratio);
    let b2 = ratio * b1;
    [b1, p * b1 + tau * b2, q * b2 + tau * b1, b2]
}

/// A dull pane that is darker on one side, and an opal one that passes more than it reflects.
const OPTICS: [([f64; 4], f64); 2] = [([0.6, 0.3, 0.1, 0.8], 0.4), ([0.9, 0.05, 0.05, 0.9], 0.9)];

/// Light from one room to the other by all solvers that have a right to it, and none of the others.
#[test]
fn catalogue_12_two_rooms_and_a_pane_in_every_solver() {
    let (transport, response) = (rooms(), pane(OPTICS));
    let e = [1.0, 1.0, 0., 0., 0., 0., 0., 0.];
    let exact = OPTICS.map(|(rho, tau)| balance(rho, tau));
    for solver in Solver::ALL {
        let mut b = vec![0.0; 8];
        let mut error = vec![0.0; 8];
        if solver.is_random() {
            let params = Params { tolerance: 0.0, max_steps: usize::MAX, ..Params::default() };
            let step = |_: &[f64], info: &Info| {
                error.clone_from(&info.standard_error);
                if info.steps == 400 { Go::Stop } else { Go::On }
            };
            let _ = solve(*solver, &transport, &response, &e, &mut b, &params, step);
            assert!(error.iter().all(|error| *error < 0.05), "{solver}: {error:?}");
        } else {
            let params = Params { max_steps: 5000, ..tight() };
            match solve(*solver, &transport, &response, &e, &mut b, &params, |_, _| Go::On) {
                Ok(info) => assert!(info.bound.iter().all(|bound| *bound < 1e-10), "{solver}: {info:?}"),
                Err(SolveError::NotApplicable(why)) => {
                    assert!(!solver.takes_sheets() && why.contains("transmission"), "{solver}: {why}");
                    continue;
                }
                Err(other) => panic!("{solver}: {other}"),
            }
        }
        assert!(solver.takes_sheets(), "{solver}");
        for k in 0..8 {
            let expected = exact[k % 2][k / 2];
            assert!((b[k] - expected).abs() < 1e-11 + 5.0 * error[k], "{solver}, {k}: {} for {expected}", b[k]);
        }
    }
}

/// What is emitted is absorbed: α = 1 − ρ − τ of what arrives on each side.
#[test]
fn catalogue_12_shares_sum_to_one() {
    let (transport, response) = (rooms(), pane(OPTICS));
    let mut b = vec![0.0; 8];
    let e = [1.0, 1.0, 0., 0., 0., 0., 0., 0.];
    lu(&transport, &response, &e, &mut b, &tight(), |_, _| Go::On).unwrap();
    let mut h = vec![0.0; 8];
    transport.apply(&b, &mut h, 2).unwrap();
    for (band, (rho, tau)) in OPTICS.into_iter().enumerate() {
        let absorbed: f64 = (0..4)
            .map(|i| {
                let tau = if i == 1 || i == 2 { tau } else { 0.0 };
                transport.space().area[i] * (1.0 - rho[i] - tau) * h[2 * i + band]
            })
            .sum();
        assert!((absorbed - 5.0).abs() < 1e-12, "{absorbed}");
    }
    assert_eq!(response.largest(), [0.8, 0.9 + 0.05]);

    // More than arrives is refused, and so are sides that do not name each other.
    let mut bright = pane(OPTICS);
    bright.transmittance[3] = 0.96;
    let refused = |response: &SheetResponse| {
        solve(Solver::Jacobi, &transport, response, &e, &mut [0.0; 8], &tight(), |_, _| Go::On).unwrap_err()
    };
    let error = refused(&bright);
    assert!(matches!(error, SolveError::Transmittance { unknown: 1, band: 1, .. }), "{error}");
    let mut odd = pane(OPTICS);
    odd.opposite[1] = 3;
    assert!(matches!(refused(&odd), SolveError::NotApplicable(_)));
}

/// A pane without transmittance leaves every bit as it is without the pane.
#[test]
fn catalogue_13_nothing_passes_an_opaque_pane() {
    let (transport, pane) = (rooms(), pane(OPTICS.map(|(rho, _)| (rho, 0.0))));
    let e = [1.0, 1.0, 0., 0., 0., 0., 0., 0.];
    for solver in Solver::ALL.iter().filter(|s| s.takes_sheets() && !s.is_random()) {
        let run = |response: &dyn Response| {
            let mut b = vec![0.0; 8];
            solve(*solver, &transport, response, &e, &mut b, &tight(), |_, _| Go::On).unwrap();
            b
        };
        assert_eq!(run(&pane), run(&pane.diffuse), "{solver}");
    }
}

/// Rooms that F does not connect, as tables of hits tell them.
struct Parted(DenseTransport);

impl Transport for Parted {
    type Space = AreaSpace;

    fn space(&self) -> &AreaSpace {
        self.0.space()
    }

    fn apply(&self, b: &[f64], h: &mut [f64], bands: usize) -> Result<(), SolveError> {
        self.0.apply(b, h, bands)
    }

    fn parts(&self) -> Option<&[u32]> {
        Some(&[0, 0, 1, 1])
    }
}

/// Each room has its own coarse vector, and an opal pane joins them: taken one by one their corrections overshot, and the
/// iteration ran away.
#[test]
fn catalogue_13_deflation_of_rooms_that_a_pane_joins() {
    for (walls, tau) in [(0.98, 0.98), (0.98, 0.5), (0.5, 0.9), (0.9, 1e-6), (0.3, 0.0)] {
        let optics = ([walls, 0.01, 0.01, walls], tau);
        let mut b = vec![0.0; 8];
        let e = [1.0, 1.0, 0., 0., 0., 0., 0., 0.];
        let info = deflated_jacobi(&Parted(rooms()), &pane([optics; 2]), &e, &mut b, &tight(), |_, _| Go::On).unwrap();
        assert!(info.steps < 60, "{walls}, {tau}: {info:?}");
        for (b, exact) in b.chunks_exact(2).zip(balance(optics.0, tau)) {
            assert!((b[0] - exact).abs() <= 1e-10 * exact.max(1e-3), "{walls}, {tau}: {} for {exact}", b[0]);
        }
    }
}

/// A room that has a ten-thousandth of the light of the one beside it is solved by its own light: what balances the energy of both is added in proportion to what
/// each has, and the residual, of all, is not the last word.
#[test]
fn catalogue_13_a_dim_room_beside_a_bright_one() {
    for (walls, tau) in [(0.5, 1e-3), (0.8, 1e-4), (0.9, 1e-4)] {
        let optics = ([walls, 0.5, 0.5, walls], tau);
        let mut b = vec![0.0; 8];
        let e = [1.0, 1.0, 0., 0., 0., 0., 0., 0.];
        let params = Params { tolerance: 1e-4, ..Params::default() };
        deflated_jacobi(&rooms(), &pane([optics; 2]), &e, &mut b, &params, |_, _| Go::On).unwrap();
        for (b, exact) in b.chunks_exact(2).zip(balance(optics.0, tau)) {
            assert!((b[0] / exact - 1.0).abs() <= 0.01, "{walls}, {tau}: {} for {exact}", b[0]);
        }
    }
}
