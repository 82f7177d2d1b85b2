//! What holds for every line of the table of solvers.

use super::systems::*;
use crate::*;

/// Solvers without chance.
fn certain() -> impl Iterator<Item = Solver> {
    Solver::ALL.iter().copied().filter(|solver| !solver.is_random())
}

fn tight() -> Params {
    Params { tolerance: 1e-13, max_steps: 5000, ..Params::default() }
}

/// Asks for a field: from those without chance within `digits`, from the others within 5 standard errors.
fn assert_solves(system: &System, expected: &[f64], digits: f64) {
    for solver in Solver::ALL {
        let (b, error) = if solver.is_random() {
            let params = Params { tolerance: 0.0, max_steps: usize::MAX, ..Params::default() };
            let mut b = vec![0.0; system.e.len()];
            let mut error = Vec::new();
            let stop = |_: &[f64], info: &Info| {
                error.clone_from(&info.standard_error);
                if info.steps == 100 { Go::Stop } else { Go::On }
            };
            let _ = solve(*solver, &system.transport, &system.response, &system.e, &mut b, &params, stop);
            (b, error)
        } else {
            let (b, info) = system.solve(*solver, &tight()).unwrap();
            assert!(info.residual[0] <= 1e-13 && info.work > 0.0 && info.steps > 0, "{solver}: {info:?}");
            (b, vec![0.0; system.e.len()])
        };
        for i in 0..b.len() {
            let allowed = digits + 5.0 * error[i];
            assert!((b[i] - expected[i]).abs() <= allowed, "{solver}, {i}: {} for {}", b[i], expected[i]);
        }
    }
}

/// Catalogue 0a: areas 1 and 100; a swapped index would be wrong by 10⁴.
#[test]
fn catalogue_0a_unequal_areas_in_every_solver() {
    let system = System::new(vec![1.0, 100.0], vec![0.0, 1.0, 0.01, 0.99], vec![0.5, 0.5], vec![1.0, 0.0]);
    // B1 = 1 + B2/2, B2 = (0.01 B1 + 0.99 B2)/2.
    let b2 = 0.005 / (1.0 - 0.495 - 0.0025);
    assert_solves(&system, &[1.0 + b2 / 2.0, b2], 1e-12);
}

/// Catalogue 1: face radiosities of the closed cube; what is emitted is absorbed.
#[test]
fn catalogue_1_cube_in_every_solver() {
    let expected = [
        (0.2, [1.009_615_385_4, 0.048_044_544_6, 0.048_085_017_4]),
        (0.5, [1.090_909_098_1, 0.181_745_826_1, 0.181_836_268_9]),
        (0.8, [1.551_724_153_6, 0.689_551_070_7, 0.689_681_193_9]),
    ];
    for (rho, [emitter, opposite, side]) in expected {
        let system = cube(rho);
        assert_solves(&system, &[emitter, opposite, side, side, side, side], 1e-9);
        for solver in certain() {
            let (b, _) = system.solve(solver, &tight()).unwrap();
            let absorbed: f64 = b.iter().zip(&system.e).map(|(b, e)| (b - e) / rho * (1.0 - rho)).sum();
            assert!((absorbed - 1.0).abs() < 1e-11, "{solver}: {absorbed}");
        }
    }
}

/// Catalogue 5: the furnace, B = E/(1 − ρ), with any areas.
#[test]
fn catalogue_5_furnace_in_every_solver() {
    for rho in [0.0, 0.5, 0.9] {
        let furnace = box_of([4.0, 3.0, 2.5], 3).closed().system(|_| rho, |_, _| 1.0 - rho);
        assert_solves(&furnace, &vec![1.0; 54], 1e-11);
    }
}

/// Catalogue 8: the symmetric form is symmetric and positive, and sampled rows that are not reciprocal are refused
/// where that is asked for.
#[test]
fn catalogue_8_symmetric_form() {
    let mut system = room(3);
    let (area, n) = (system.transport.space().area.clone(), system.e.len());
    let mut form = vec![0.0; n * n];
    for i in 0..n {
        system.transport.row(i, |j, factor| form[i * n + j] = area[i] * factor);
    }
    for i in 0..n {
        assert!((0..i).all(|j| (form[i * n + j] - form[j * n + i]).abs() <= 1e-12));
    }
    system.solve(Solver::Cholesky, &tight()).unwrap();
    system.response.reciprocal_area = None;
    for solver in Solver::ALL {
        let asks = matches!(solver, Solver::Cg | Solver::Cholesky) || solver.is_random();
        let result = system.solve(*solver, &Params::default());
        assert_eq!(matches!(result, Err(SolveError::NotApplicable(_))), asks, "{solver}");
    }
}

/// Catalogue 8: rows that are not reciprocal are solved as they stand, by gathering and by shooting.
#[test]
fn catalogue_8_rows_that_are_not_reciprocal() {
    // Point to polygon factors: closed, but F_ij A_i and F_ji A_j differ by percents.
    let open = |made: Box6| {
        let mut system = made.system(|face| [0.2, 0.7, 0.4, 0.5, 0.9, 0.0][face], |face, _| f64::from(face == 1));
        system.response.reciprocal_area = None;
        system
    };
    let system = open(box_of([4.0, 3.0, 2.5], 3));
    let exact = system.exact();
    let sparse = SparseTransport::from_rows(&system.transport).unwrap();
    let mut tried = 0;
    for solver in certain().filter(|s| !matches!(s, Solver::Cg | Solver::Cholesky)) {
        let (b, _) = system.solve(solver, &tight()).unwrap();
        assert!(b.iter().zip(&exact).all(|(b, x)| (b - x).abs() < 1e-11), "{solver}");
        let mut c = vec![0.0; b.len()];
        solve(solver, &sparse, &system.response, &system.e, &mut c, &tight(), |_, _| Go::On).unwrap();
        assert!(c.iter().zip(&exact).all(|(b, x)| (b - x).abs() < 1e-11), "{solver}, sparse");
        tried += 1;
    }
    assert!(tried > 10);
}

/// Catalogue 9: the furnace after k bounces, and how many it takes to 1 %.
#[test]
fn catalogue_9_bounces_of_a_furnace() {
    let furnace = |rho: f64| box_of([1.0; 3], 2).closed().system(|_| rho, |_, _| 1.0 - rho);
    let half = furnace(0.5);
    let layers = bounces(&half.transport, &half.response, &half.e, 4).unwrap();
    for (k, layer) in layers.iter().enumerate() {
        assert!(layer.iter().all(|x| (x - 0.5f64.powi(k as i32 + 1)).abs() < 1e-14), "bounce {k}");
    }
    for (count, share) in [(1, 0.75), (2, 0.875), (4, 0.968_75)] {
        let sum: f64 = layers[..=count].iter().map(|layer| layer[0]).sum();
        assert!((sum - share).abs() < 1e-14);
    }
    // The first bounce after which less than 1 % is missing, seen by the solver itself.
    for (rho, expected) in [(0.5, 6), (0.7, 12), (0.8, 20), (0.9, 43)] {
        let system = furnace(rho);
        for solver in [Solver::Jacobi, Solver::Neumann] {
            let mut b = system.e.clone();
            let mut count = 0;
            let result = solve(solver, &system.transport, &system.response, &system.e, &mut b, &tight(), |b, _| {
                if (1.0 - b[0]).abs() <= 0.01 {
                    return Go::Stop;
                }
                count += 1;
                Go::On
            });
            assert!(matches!(result, Err(SolveError::Stopped)) && count == expected, "{solver}, {rho}: {count}");
        }
    }
}

/// Catalogue 10: the layers sum to the solution.
#[test]
fn catalogue_10_layers_sum_to_the_solution() {
    let system = room(4);
    let (b, info) = system.solve(Solver::Neumann, &tight()).unwrap();
    // From zero the first application is that of E.
    let layers = bounces(&system.transport, &system.response, &system.e, info.steps - 1).unwrap();
    for i in 0..b.len() {
        let sum: f64 = layers.iter().map(|layer| layer[i]).sum();
        assert!((sum - b[i]).abs() < 1e-13);
    }
}

/// Catalogue 35, 42: at every step of every solver the bound holds, and in the end the tolerance is kept by the true
/// residual. The rows of R1's kind sum to up to 1.02, which the bound must know.
#[test]
fn catalogue_35_bound_holds_at_every_step_of_every_solver() {
    let bright =
        |made: Box6| made.system(|face| [0.2, 0.9, 0.0, 0.5, 0.95, 0.6][face], |face, c| f64::from(face == 1) * c[0]);
    let systems =
        [cube(0.8), room(3), bright(box_of([1.0; 3], 3).symmetrised()), bright(box_of([4.0, 3.0, 2.5], 3).closed())];
    for system in systems {
        let exact = system.exact();
        // From nothing, and from above in one half of the room and below in the other.
        let astray = exact.iter().enumerate().map(|(i, x)| x * if i % 2 == 0 { 1.3 } else { 0.6 }).collect();
        for start in [vec![0.0; exact.len()], astray] {
            for solver in Solver::ALL {
                let mut b: Vec<f64> = start.clone();
                let mut steps = 0;
                let check = |b: &[f64], info: &Info| {
                    let error = b.iter().zip(&exact).fold(0f64, |m, (b, x)| m.max((b - x).abs()));
                    assert!(error <= info.bound[0] * (1.0 + 1e-12) + 1e-13, "{solver}: {error} > {}", info.bound[0]);
                    steps += 1;
                    if solver.is_random() && steps > 20 { Go::Stop } else { Go::On }
                };
                let params = Params { tolerance: 1e-6, max_steps: 2000, ..Params::default() };
                let result = solve(*solver, &system.transport, &system.response, &system.e, &mut b, &params, check);
                if !solver.is_random() {
                    result.unwrap();
                    let residual = system.residual(&b);
                    assert!(residual <= 1e-6 * (1.0 + 1e-6), "{solver}: {residual:e}");
                    assert!(steps > 1 || matches!(solver, Solver::Lu | Solver::Cholesky));
                }
            }
        }
    }
}

/// Catalogue 42: what is asked for is kept, decade by decade, by every solver without chance on every system: the true
/// residual is at most the tolerance, and so ‖B − B*‖ at most tolerance ‖E‖/(1 − ρ_max) in the norm of areas, where F is
/// reciprocal and its rows sum to one; and the bound that is told is never below the largest error.
#[test]
fn catalogue_42_what_is_asked_for_is_kept() {
    let bright = box_of([1.0; 3], 3).closed().system(|face| [0.2, 0.9, 0.0, 0.5, 0.95, 0.6][face], |_, c| c[0]);
    for (system, largest) in [(cube(0.8), 0.8), (room(3), 0.9), (bright, 0.95)] {
        let exact = system.exact();
        let area = &system.transport.space().area;
        let norm = |x: &[f64]| x.iter().zip(area).map(|(x, a)| a * x * x).sum::<f64>().sqrt();
        for solver in certain() {
            for tolerance in (1..12).map(|k| 0.1f64.powi(k)) {
                let (b, info) = system.solve(solver, &Params { tolerance, ..tight() }).unwrap();
                let residual = system.residual(&b);
                assert!(residual <= tolerance * 1.001 + 1e-14, "{solver}, {tolerance:e}: {residual:e}");
                let off: Vec<f64> = b.iter().zip(&exact).map(|(b, x)| b - x).collect();
                let allowed = tolerance * norm(&system.e) / (1.0 - largest) + 1e-11;
                assert!(norm(&off) <= allowed, "{solver}, {tolerance:e}: {:e} of {allowed:e}", norm(&off));
                let worst = off.iter().fold(0.0f64, |m, x| m.max(x.abs()));
                assert!(worst <= info.bound[0] + 1e-11, "{solver}, {tolerance:e}: {worst:e} of {:e}", info.bound[0]);
            }
        }
    }
}

/// Catalogue 42: each criterion that a callback can have is kept by the answer: the share that is unshot, the guaranteed
/// bound, and the true error below it, decade by decade, by every solver that takes steps; the iterate that was found good
/// enough is the one that is handed out, and it took no more work than a residual of 1e-13.
#[test]
fn catalogue_42_a_callback_ends_a_solver_by_any_criterion() {
    type Left = fn(&Info) -> f64;
    let criteria: [(&str, Left); 2] = [("bound", |info| info.bound[0]), ("unshot", |info| info.unshot[0].abs())];
    for system in [cube(0.8), room(3)] {
        let exact = system.exact();
        for solver in certain().filter(|solver| !solver.is_direct()) {
            let (_, whole) = system.solve(solver, &tight()).unwrap();
            for (name, left) in criteria {
                for asked in (0..8).map(|k| 0.1f64.powi(k)) {
                    let mut b = vec![0.0; exact.len()];
                    let mut seen = Vec::new();
                    let step = |b: &[f64], info: &Info| {
                        seen = b.to_vec();
                        if left(info) <= asked { Go::Enough } else { Go::On }
                    };
                    let params = Params { tolerance: 0.0, ..tight() };
                    let info =
                        solve(solver, &system.transport, &system.response, &system.e, &mut b, &params, step).unwrap();
                    assert!(left(&info) <= asked && seen == b, "{solver}, {name} {asked:e}: {:e}", left(&info));
                    assert!(info.work <= whole.work, "{solver}, {name} {asked:e}: {} of {}", info.work, whole.work);
                    let error = b.iter().zip(&exact).fold(0f64, |worst, (b, x)| worst.max((b - x).abs()));
                    assert!(error <= info.bound[0] * (1.0 + 1e-12) + 1e-13, "{solver}, {name} {asked:e}: {error:e}");
                }
            }
        }
    }
}

/// Catalogue 35: what no surface reflects is refused, with its place.
#[test]
fn catalogue_35_reflectances_are_checked() {
    for value in [1.01, -0.1, f64::NAN] {
        let mut system = cube(0.5);
        system.response.reflectance[4] = value;
        let refused = system.solve(Solver::Jacobi, &Params::default());
        assert!(matches!(refused, Err(SolveError::Reflectance { unknown: 4, band: 0, .. })), "{value}");
    }
    // Surfaces that give back all they receive are legitimate; nothing is promised of them.
    let mut system = cube(0.5);
    system.response.reflectance[1] = 1.0;
    let (_, info) = system.solve(Solver::Jacobi, &Params::default()).unwrap();
    assert_eq!(info.bound, [f64::INFINITY]);
}

/// A solved field is a start from which nothing is left to do, for every solver that takes a start.
#[test]
fn catalogue_34_a_solution_is_a_start() {
    let system = room(3);
    let exact = system.exact();
    for solver in Solver::ALL {
        let mut b = exact.clone();
        let params = Params { tolerance: 1e-9, ..Params::default() };
        let info =
            solve(*solver, &system.transport, &system.response, &system.e, &mut b, &params, |_, _| Go::On).unwrap();
        let direct = matches!(solver, Solver::Lu | Solver::Cholesky);
        assert!(direct || info.work <= 2.0, "{solver}: {}", info.work);
    }
}

/// A sparse matrix gives what the full one does; in single precision nearly.
#[test]
fn sparse_rows_are_full_rows() {
    let system = room(3);
    let exact = system.exact();
    let sparse = SparseTransport::from_rows(&system.transport).unwrap();
    let single = sparse.to_single();
    assert_eq!(sparse.entries(), 54 * 45);
    for solver in certain() {
        let full = system.solve(solver, &tight()).unwrap();
        let (mut b, mut c) = (vec![0.0; 54], vec![0.0; 54]);
        let info = solve(solver, &sparse, &system.response, &system.e, &mut b, &tight(), |_, _| Go::On).unwrap();
        assert!(b.iter().zip(&full.0).all(|(b, x)| (b - x).abs() < 1e-13), "{solver}");
        assert_eq!(info.steps, full.1.steps, "{solver}");
        // Rounded to single precision F is reciprocal to 1e-7 only, and those that rely on it get no further.
        let loose = Params { tolerance: 1e-5, ..tight() };
        solve(solver, &single, &system.response, &system.e, &mut c, &loose, |_, _| Go::On).unwrap();
        assert!(c.iter().zip(&exact).all(|(b, x)| (b - x).abs() < 1e-4), "{solver}, single");
    }
    let new = |starts: Vec<usize>, columns: Vec<u32>| {
        let values = vec![0.5f32; columns.len()];
        SparseTransport::new(vec![1.0; 2], starts, columns, values).is_ok()
    };
    assert!(new(vec![0, 1, 2], vec![1, 0]));
    for (starts, columns) in [
        (vec![0, 2], vec![0, 1]),
        (vec![0, 1, 2], vec![1, 2]),
        (vec![0, 2, 2], vec![1, 0]),
        (vec![0, 3, 2], vec![0, 1]),
    ] {
        assert!(!new(starts, columns));
    }
}

/// A transport that can only be applied is taken by those solvers that the table says, and refused by name otherwise.
#[test]
fn operators_are_applied_only() {
    let system = room(3);
    let exact = system.exact();
    for solver in Solver::ALL {
        let mut b = vec![0.0; 54];
        let result =
            solve_operator(*solver, &system.transport, &system.response, &system.e, &mut b, &tight(), |_, _| Go::On);
        if solver.applies_only() {
            result.unwrap();
            assert!(b.iter().zip(&exact).all(|(b, x)| (b - x).abs() < 1e-11), "{solver}");
        } else {
            let text = result.unwrap_err().to_string();
            assert!(text.contains("jacobi") && text.contains("gmres"), "{text}");
        }
    }
}

/// A response that mixes bands and places is no obstacle to those that need no rows of it.
#[test]
fn responses_that_are_not_diagonal() {
    /// Each of two sides passes a quarter through to the other.
    struct Pane;
    impl Response for Pane {
        fn bands(&self) -> usize {
            1
        }
        fn respond(&self, h: &[f64], b: &mut [f64]) {
            for i in 0..h.len() {
                b[i] = 0.25 * h[i] + 0.25 * h[i ^ 1];
            }
        }
        fn largest(&self) -> Vec<f64> {
            vec![0.5]
        }
        fn self_adjoint_weight(&self) -> Option<Vec<f64>> {
            None
        }
    }
    let system = cube(0.5);
    let fields: Vec<(Solver, Vec<f64>)> = certain()
        .filter_map(|solver| {
            let mut b = vec![0.0; 6];
            let result = solve(solver, &system.transport, &Pane, &system.e, &mut b, &tight(), |_, _| Go::On);
            match result {
                Ok(_) => Some((solver, b)),
                Err(SolveError::NotApplicable(_)) => None,
                Err(other) => panic!("{solver}: {other}"),
            }
        })
        .collect();
    assert!(fields.len() == 10, "{fields:?}");
    for (solver, b) in &fields {
        assert!(b.iter().zip(&fields[0].1).all(|(b, x)| (b - x).abs() < 1e-12), "{solver}");
    }
}

/// Names are those of the table, each once, and go both ways.
#[test]
fn names_go_both_ways() {
    let names = [
        "jacobi",
        "deflated-jacobi",
        "gauss-seidel",
        "sor",
        "southwell",
        "progressive",
        "shooting-cyclic",
        "shooting-ambient",
        "overshooting",
        "neumann",
        "cg",
        "bicgstab",
        "gmres",
        "lu",
        "cholesky",
        "random-walk",
        "stochastic-jacobi",
    ];
    assert_eq!(Solver::ALL.len(), names.len());
    for name in names {
        assert_eq!(name.parse::<Solver>().unwrap().to_string(), name);
    }
    let unknown = "conjugate".parse::<Solver>().unwrap_err().to_string();
    assert!(names.iter().all(|name| unknown.contains(name)), "{unknown}");
}

/// What is no finite number would make every bound worthless: it is refused with its kind.
#[test]
fn numbers_that_are_none_are_refused() {
    let says = |result: Result<(), SolveError>, word: &str| {
        let error = result.unwrap_err().to_string();
        assert!(error.contains(word) && error.contains("finite"), "{error}");
    };
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        says(DenseTransport::new(vec![1.0, bad], vec![0.0; 4]).map(drop), "areas");
        says(DenseTransport::new(vec![1.0; 2], vec![0.0, bad, 0.0, 0.0]).map(drop), "factors");
        says(SparseTransport::new(vec![bad], vec![0, 0], vec![], Vec::<f64>::new()).map(drop), "areas");
        says(SparseTransport::new(vec![1.0], vec![0, 1], vec![0], vec![bad as f32]).map(drop), "factors");
        says(Substructure::new(vec![bad], vec![0], vec![0.5]).map(drop), "areas");
        says(Substructure::new(vec![1.0], vec![0], vec![bad]).map(drop), "factors");
        let system = room(1);
        for solver in Solver::ALL {
            let (mut e, mut b) = (system.e.clone(), vec![0.0; system.e.len()]);
            e[1] = bad;
            let refused = solve(*solver, &system.transport, &system.response, &e, &mut b, &tight(), |_, _| Go::On);
            says(refused.map(drop), "emission");
            b[1] = bad;
            let refused =
                solve(*solver, &system.transport, &system.response, &system.e, &mut b, &tight(), |_, _| Go::On);
            says(refused.map(drop), "start");
        }
    }
    says(DenseTransport::new(vec![-1.0], vec![0.0]).map(drop), "areas");
}

/// Wrong lengths are refused before they are read, and each solver can be stopped and run out of work.
#[test]
fn every_solver_stops_when_told() {
    let system = room(3);
    for solver in Solver::ALL {
        let short = solve(*solver, &system.transport, &system.response, &[1.0], &mut [0.0], &tight(), |_, _| Go::On);
        assert!(matches!(short, Err(SolveError::NotApplicable(_))), "{solver}");
        let mut b = vec![0.0; 54];
        let run = |b: &mut [f64], params: &Params, go: Go| {
            solve(*solver, &system.transport, &system.response, &system.e, b, params, |_, _| go)
        };
        assert!(matches!(run(&mut b, &tight(), Go::Stop), Err(SolveError::Stopped)), "{solver}");
        b.fill(0.0);
        let out = run(&mut b, &Params { tolerance: 0.0, max_steps: 2, ..Params::default() }, Go::On);
        assert!(matches!(&out, Err(SolveError::NotConverged { info, .. }) if info.residual[0] > 0.0), "{solver}");
    }
}
