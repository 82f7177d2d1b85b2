//! Small systems with known answers.

use crate::*;

mod direct;
mod every_solver;
mod iterations;
mod random;
mod sheets;
mod shooting;
mod substructuring;
mod systems;

fn cube() -> DenseTransport {
    systems::cube(0.5).transport
}

fn response(rho: f64, n: usize) -> DiffuseResponse {
    DiffuseResponse { reflectance: vec![rho; n], bands: 1, reciprocal_area: Some(vec![1.0; n]) }
}

fn tight() -> Params {
    Params { tolerance: 1e-13, ..Params::default() }
}

/// Catalogue 1: face radiosities of the closed cube with one emitting face; absorbed = emitted.
#[test]
fn catalogue_1_cube_with_one_emitting_face() {
    let expected = [
        (0.2, [1.009_615_385_4, 0.048_044_544_6, 0.048_085_017_4]),
        (0.5, [1.090_909_098_1, 0.181_745_826_1, 0.181_836_268_9]),
        (0.8, [1.551_724_153_6, 0.689_551_070_7, 0.689_681_193_9]),
    ];
    for (rho, [emitter, opposite, side]) in expected {
        for method in 0..2 {
            let (transport, response) = (cube(), response(rho, 6));
            let e = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
            let mut b = vec![0.0; 6];
            let solve = |b: &mut [f64]| match method {
                0 => deflated_jacobi(&transport, &response, &e, b, &tight(), |_, _| Go::On),
                _ => conjugate_gradient(&transport, &response, &e, b, &tight(), |_, _| Go::On),
            };
            let info = solve(&mut b).unwrap();
            for (i, exact) in [emitter, opposite, side, side, side, side].into_iter().enumerate() {
                assert!((b[i] - exact).abs() < 1e-9, "rho {rho}, method {method}: {} for {exact}", b[i]);
            }
            let absorbed: f64 = b.iter().zip(e).map(|(b, e)| (b - e) / rho * (1.0 - rho)).sum();
            assert!((absorbed - 1.0).abs() < 1e-10, "{absorbed}");
            assert!(info.bound[0] < 1e-11);
        }
    }
}

/// Catalogue 5: the furnace has B = E/(1 − ρ), at any reflectance, in few steps.
#[test]
fn catalogue_5_furnace() {
    for rho in [0.0, 0.5, 0.9, 0.99] {
        let transport = cube();
        let mut b = vec![0.0; 6];
        let info = deflated_jacobi(&transport, &response(rho, 6), &[1.0; 6], &mut b, &tight(), |_, _| Go::On).unwrap();
        for x in &b {
            assert!((x - 1.0 / (1.0 - rho)).abs() < 1e-10 / (1.0 - rho), "rho {rho}: {x}");
        }
        assert!(info.steps <= 5, "rho {rho}: {} steps", info.steps);
    }
}

/// Catalogue 9: k Jacobi sweeps without deflation would reach 1 − ρ^(k+1); the deflated ones are past that.
#[test]
fn catalogue_9_neumann_terms_bound_the_iterates() {
    let transport = cube();
    let (e, rho) = ([1.0; 6], 0.5f64);
    let mut b = e.to_vec();
    let mut h = vec![0.0; 6];
    for bounces in 1..=4 {
        transport.apply(&b, &mut h, 1).unwrap();
        for i in 0..6 {
            b[i] = e[i] + rho * h[i];
        }
        assert!((b[0] / 2.0 - (1.0 - rho.powi(bounces + 1))).abs() < 1e-9);
    }
}

/// Catalogue 35: the printed bound is never below the true error, at every step.
#[test]
fn catalogue_35_bound_holds_at_every_step() {
    let transport = cube();
    let e = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let exact = {
        let mut b = vec![0.0; 6];
        deflated_jacobi(&transport, &response(0.8, 6), &e, &mut b, &tight(), |_, _| Go::On).unwrap();
        b
    };
    let mut b = vec![0.0; 6];
    let check = |b: &[f64], info: &Info| {
        let error = b.iter().zip(&exact).fold(0f64, |m, (b, x)| m.max((b - x).abs()));
        assert!(error <= info.bound[0] + 1e-12, "{error} > {}", info.bound[0]);
        Go::On
    };
    deflated_jacobi(
        &transport,
        &response(0.8, 6),
        &e,
        &mut b,
        &Params { tolerance: 1e-9, max_steps: 100, ..Params::default() },
        check,
    )
    .unwrap();
}

/// Catalogue 0a: areas 1 and 100; a swapped index would be wrong by 10⁴. F_12 = 1 and F_21 = 0.01: the small patch
/// sees only the large one, the large one sees the small one and, for the rest, itself.
#[test]
fn catalogue_0a_unequal_areas() {
    let transport = DenseTransport::new(vec![1.0, 100.0], vec![0.0, 1.0, 0.01, 0.99]).unwrap();
    let response = DiffuseResponse { reflectance: vec![0.5, 0.5], bands: 1, reciprocal_area: Some(vec![1.0, 100.0]) };
    // B1 = 1 + B2/2, B2 = (0.01 B1 + 0.99 B2)/2.
    let b2 = 0.005 / (1.0 - 0.495 - 0.0025);
    for method in 0..2 {
        let mut b = vec![0.0; 2];
        let e = [1.0, 0.0];
        if method == 0 {
            deflated_jacobi(&transport, &response, &e, &mut b, &tight(), |_, _| Go::On).unwrap();
        } else {
            conjugate_gradient(&transport, &response, &e, &mut b, &tight(), |_, _| Go::On).unwrap();
        }
        assert!((b[1] - b2).abs() < 1e-12 && (b[0] - 1.0 - b2 / 2.0).abs() < 1e-12, "{b:?}");
    }
}

/// Bands travel together and do not mix; black entries stay at their emission.
#[test]
fn bands_are_independent() {
    let transport = cube();
    let mut reflectance = vec![0.5; 18];
    reflectance[0] = 0.0;
    let response = DiffuseResponse { reflectance, bands: 3, reciprocal_area: Some(vec![1.0; 6]) };
    let mut e = vec![0.0; 18];
    (e[0], e[4], e[8]) = (1.0, 1.0, 0.0);
    let (mut b, mut c) = (vec![0.0; 18], vec![0.0; 18]);
    deflated_jacobi(&transport, &response, &e, &mut b, &tight(), |_, _| Go::On).unwrap();
    conjugate_gradient(&transport, &response, &e, &mut c, &tight(), |_, _| Go::On).unwrap();
    for i in 0..18 {
        assert!((b[i] - c[i]).abs() < 1e-11);
    }
    assert_eq!(b[0], 1.0);
    assert!((8..18).step_by(3).all(|i| b[i] == 0.0));
    assert!((b[4] - 1.090_909_098_1).abs() < 1e-9);
}

#[test]
fn running_out_of_steps_is_an_error_with_the_residual() {
    let mut b = vec![0.0; 6];
    let params = Params { tolerance: 1e-12, max_steps: 4, ..Params::default() };
    let e = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let error = deflated_jacobi(&cube(), &response(0.9, 6), &e, &mut b, &params, |_, _| Go::On).unwrap_err();
    assert!(matches!(&error, SolveError::NotConverged { info, .. } if info.residual[0] > 1e-12), "{error}");
    let open = DiffuseResponse { reciprocal_area: None, ..response(0.5, 6) };
    let refused = conjugate_gradient(&cube(), &open, &e, &mut b, &params, |_, _| Go::On).unwrap_err();
    assert!(matches!(refused, SolveError::NotApplicable(_)));
    let stop = deflated_jacobi(&cube(), &response(0.9, 6), &e, &mut b, &params, |_, _| Go::Stop).unwrap_err();
    assert!(matches!(stop, SolveError::Stopped));
}
