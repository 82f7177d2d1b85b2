//! Shooting: the identities of the literature and the numbers of reference run R1.

use super::systems::*;
use crate::*;

/// Catalogue 37: Southwell's residuals from zero are the unshot energies of progressive refinement, bit by bit.
#[test]
fn catalogue_37_southwell_is_progressive_refinement() {
    for system in [room(4), cube(0.8)] {
        let account = |solver| {
            let (mut told, mut last) = (Vec::new(), vec![0.0; system.e.len()]);
            let params = Params { tolerance: 1e-9, ..Params::default() };
            let look = |_: &[f64], info: &Info| {
                told.push((info.residual[0].to_bits(), info.unshot[0].to_bits(), info.work.to_bits()));
                Go::On
            };
            solve(solver, &system.transport, &system.response, &system.e, &mut last, &params, look).unwrap();
            told
        };
        let southwell = account(Solver::Southwell);
        assert!(southwell.len() > 20);
        assert_eq!(southwell, account(Solver::Progressive));
    }
}

/// Catalogue 38: the unshot energy falls at every shot; the residual told of Southwell is the true one; the limit is
/// that of elimination; a shot is the N-th part of a sweep.
#[test]
fn catalogue_38_progressive_refinement() {
    let system = room(4);
    let exact = system.exact();
    for solver in [Solver::Progressive, Solver::Southwell, Solver::ShootingCyclic, Solver::ShootingAmbient] {
        let mut b = vec![0.0; system.e.len()];
        let mut unshot = f64::INFINITY;
        let params = Params { tolerance: 1e-11, ..Params::default() };
        let look = |b: &[f64], info: &Info| {
            assert!(info.unshot[0] < unshot, "{solver}: {} after {unshot}", info.unshot[0]);
            unshot = info.unshot[0];
            let true_residual = system.residual(b);
            match solver {
                Solver::Southwell => assert!((true_residual - info.residual[0]).abs() < 1e-13),
                Solver::ShootingAmbient => {}
                _ => assert!(true_residual <= info.residual[0] + 1e-13),
            }
            Go::On
        };
        let info = solve(solver, &system.transport, &system.response, &system.e, &mut b, &params, look).unwrap();
        assert!(b.iter().zip(&exact).all(|(b, x)| (b - x).abs() <= 1e-10), "{solver}");
        assert!((info.work - info.steps as f64 / 96.0).abs() < 1e-9);
    }
}

/// The self-share of a facet that sees itself stays unshot and is shot again.
#[test]
fn catalogue_38_self_share() {
    let sphere = System::new(vec![1.0], vec![1.0], vec![0.5], vec![1.0]);
    for solver in [Solver::Progressive, Solver::Southwell, Solver::ShootingCyclic, Solver::Overshooting] {
        let (b, _) = sphere.solve(solver, &Params { tolerance: 1e-12, ..Params::default() }).unwrap();
        assert!((b[0] - 2.0).abs() < 1e-11, "{solver}: {}", b[0]);
    }
}

/// What a shooting method did on R1.
struct Run {
    /// Unshot over emitted energy after 4 and 864 shots.
    unshot: [f64; 2],
    /// Error of what is shown after 4 shots.
    after_four: f64,
    /// First shots at which what is shown is within 1 % and within 0.1 %.
    reached: [usize; 2],
    b: Vec<f64>,
}

fn shoot(system: &System, exact: &[f64], solver: Solver) -> Run {
    let mut run = Run { unshot: [0.0; 2], after_four: 0.0, reached: [0; 2], b: vec![0.0; exact.len()] };
    let mut b = vec![0.0; exact.len()];
    let params = Params { tolerance: 5e-4, ..Params::default() };
    let look = |b: &[f64], info: &Info| {
        // Until 0.1 % is reached; beyond that every shot alike.
        let error = if run.reached[1] == 0 { system.error(b, exact) } else { 0.0 };
        match info.steps {
            4 => (run.unshot[0], run.after_four) = (info.unshot[0], error),
            864 => run.unshot[1] = info.unshot[0],
            _ => {}
        }
        for (reached, goal) in run.reached.iter_mut().zip([0.01, 0.001]) {
            if *reached == 0 && error < goal {
                *reached = info.steps;
            }
        }
        Go::On
    };
    solve(solver, &system.transport, &system.response, &system.e, &mut b, &params, look).unwrap();
    run.b = b;
    run
}

/// Catalogue 39, 40, 41: reference run R1, shot by shot.
#[test]
fn catalogue_39_40_41_reference_run() {
    let system = r1();
    let exact = system.exact();
    let sorted = shoot(&system, &exact, Solver::Progressive);
    let cyclic = shoot(&system, &exact, Solver::ShootingCyclic);
    let ambient = shoot(&system, &exact, Solver::ShootingAmbient);
    let over = shoot(&system, &exact, Solver::Overshooting);
    let near = |is: f64, should: f64, digits: f64| assert!((is - should).abs() <= digits, "{is} for {should}");

    // The greatest first: 8 % fewer shots on a uniform mesh.
    near(sorted.unshot[0], 0.4531, 5e-5);
    near(cyclic.unshot[0], 0.4531, 5e-5);
    near(sorted.unshot[1], 0.1394, 5e-5);
    near(cyclic.unshot[1], 0.1536, 5e-5);
    assert_eq!((sorted.reached, cyclic.reached), ([901, 2542], [978, 2573]));
    // Shooting takes as long as gathering: Gauss–Seidel 4 sweeps, Jacobi 7.
    near(2542.0 / 864.0, 2.94, 5e-3);

    // The ambient term: ten times nearer from the first shots on, the same in the end.
    near(sorted.after_four, 0.0350, 5e-5);
    near(ambient.after_four, 0.0034, 5e-5);
    assert_eq!(ambient.reached[0], 3);
    assert_eq!(ambient.b, sorted.b);

    // Overshooting: 0.1 % after a third of the shots, 0.99 sweeps.
    assert_eq!(over.reached, [525, 857]);
}

/// Bands travel together: what shoots is decided by the energy of all, and each band ends where it would alone.
#[test]
fn catalogue_11_bands_shoot_together() {
    let system = room(3);
    let n = system.e.len();
    let (reds, blues) = ([0.2, 0.7, 0.0, 0.5, 0.9, 0.1], [0.6, 0.1, 0.3, 0.8, 0.0, 0.4]);
    let reflectance = (0..n).flat_map(|i| [reds[i / 9], blues[i / 9]]).collect();
    let area = system.transport.space().area.clone();
    let response = DiffuseResponse { reflectance, bands: 2, reciprocal_area: Some(area.clone()) };
    let e: Vec<f64> = system.e.iter().enumerate().flat_map(|(i, e)| [*e, if i % 7 == 0 { 2.0 } else { 0.0 }]).collect();
    let params = Params { tolerance: 1e-12, max_steps: 2000, ..Params::default() };
    for solver in Solver::ALL.iter().filter(|s| !s.is_random()) {
        let mut b = vec![0.0; 2 * n];
        solve(*solver, &system.transport, &response, &e, &mut b, &params, |_, _| Go::On).unwrap();
        for band in 0..2 {
            let one = |x: &[f64]| x.iter().skip(band).step_by(2).copied().collect::<Vec<_>>();
            let alone = DiffuseResponse {
                reflectance: one(&response.reflectance),
                bands: 1,
                reciprocal_area: Some(area.clone()),
            };
            let mut x = vec![0.0; n];
            lu(&system.transport, &alone, &one(&e), &mut x, &params, |_, _| Go::On).unwrap();
            assert!(one(&b).iter().zip(&x).all(|(b, x)| (b - x).abs() < 1e-10), "{solver}, band {band}");
        }
    }
}
