//! Iterates number by number: the textbook's tables, sweeps and spectra.

use super::systems::*;
use crate::*;

/// The iterates of a solver on the textbook's system, the start first.
fn iterates(solver: Solver, start: [f64; 2], count: usize) -> Vec<[f64; 2]> {
    let system = textbook();
    let (mut b, mut seen) = (start, Vec::new());
    let params = Params { tolerance: 0.0, ..Params::default() };
    let result = solve(solver, &system.transport, &system.response, &system.e, &mut b, &params, |b, _| {
        seen.push([b[0], b[1]]);
        if seen.len() == count { Go::Stop } else { Go::On }
    });
    assert!(matches!(result, Err(SolveError::Stopped)));
    seen
}

/// Compares with a table's rows, numbered from one, to the digits that are printed.
fn assert_rows(seen: &[[f64; 2]], table: &[(usize, [f64; 2])], digits: f64) {
    for (row, expected) in table {
        for k in 0..2 {
            let (is, should) = (seen[row - 1][k], expected[k]);
            assert!((is - should).abs() <= digits, "row {row}: {is} for {should}");
        }
    }
}

/// Catalogue 32: Jacobi's table. Dyadic fractions are exact; others are printed to nine decimals.
#[test]
fn catalogue_32_jacobi_table() {
    let seen = iterates(Solver::Jacobi, [0.0, 0.0], 20);
    let exact = [
        (1, [0.0, 0.0]),
        (2, [4.0, 5.0]),
        (3, [1.5, 3.0]),
        (4, [2.5, 4.25]),
        (5, [1.875, 3.75]),
        (6, [2.125, 4.0625]),
        (7, [1.96875, 3.9375]),
        (8, [2.03125, 4.015625]),
        (9, [1.9921875, 3.984375]),
        (10, [2.0078125, 4.00390625]),
        (11, [1.998046875, 3.99609375]),
    ];
    assert_rows(&seen, &exact, 0.0);
    let printed = [
        (12, [2.001953125, 4.000976563]),
        (13, [1.999511719, 3.999023438]),
        (16, [2.00012207, 4.000061035]),
        (20, [2.000007629, 4.000003815]),
    ];
    assert_rows(&seen, &printed, 5.1e-10);
    // Neumann's partial sums are the same iterates.
    assert_rows(&iterates(Solver::Neumann, [0.0, 0.0], 20), &exact, 0.0);
}

/// Catalogue 33: the table of Gauss–Seidel, printed to six decimals; its rate is the square of Jacobi's.
#[test]
fn catalogue_33_gauss_seidel_table() {
    let seen = iterates(Solver::GaussSeidel, [0.0, 0.0], 14);
    let exact = [(1, [0.0, 0.0]), (2, [4.0, 3.0]), (3, [2.5, 3.75]), (4, [2.125, 3.9375]), (5, [2.03125, 3.984375])];
    assert_rows(&seen, &exact, 0.0);
    let printed = [
        (6, [2.007813, 3.996094]),
        (7, [2.001953, 3.999023]),
        (8, [2.000488, 3.999756]),
        (9, [2.000122, 3.999939]),
        (10, [2.000031, 3.999985]),
        (11, [2.000008, 3.999996]),
        (12, [2.000002, 3.999999]),
        (13, [2.0, 4.0]),
        (14, [2.0, 4.0]),
    ];
    assert_rows(&seen, &printed, 5.1e-7);
    assert_eq!((seen[7][0] - 2.0) / (seen[6][0] - 2.0), 0.25);
}

/// Catalogue 34: the same from (2, 3); Gauss–Seidel is one sweep ahead of its cold self.
#[test]
fn catalogue_34_warm_start_tables() {
    let warm = iterates(Solver::Jacobi, [2.0, 3.0], 20);
    let exact = [
        (1, [2.0, 3.0]),
        (2, [2.5, 4.0]),
        (3, [2.0, 3.75]),
        (4, [2.125, 4.0]),
        (5, [2.0, 3.9375]),
        (8, [2.0078125, 4.0]),
    ];
    assert_rows(&warm, &exact, 0.0);
    assert_rows(&warm, &[(12, [2.000488281, 4.0]), (20, [2.000001907, 4.0])], 5.1e-10);

    let (cold, warm) = (iterates(Solver::GaussSeidel, [0.0; 2], 21), iterates(Solver::GaussSeidel, [2.0, 3.0], 20));
    assert_eq!(warm[1], [2.5, 3.75]);
    for row in 1..20 {
        assert_eq!(warm[row], cold[row + 1], "row {row}");
    }
}

/// Catalogue 34: after one of the faces was repainted, the old solution is a start that halves the sweeps at least.
#[test]
fn catalogue_34_warm_start_after_an_edit() {
    let before = room(4);
    let mut after = room(4);
    // One patch of the ceiling, a little darker.
    after.response.reflectance[20] = 0.69;
    let params = Params { tolerance: 1e-4, ..Params::default() };
    let exact = before.exact();
    for solver in [Solver::Jacobi, Solver::GaussSeidel, Solver::Sor, Solver::Progressive, Solver::Southwell] {
        let (_, cold) = after.solve(solver, &params).unwrap();
        let mut b = exact.clone();
        let warm = solve(solver, &after.transport, &after.response, &after.e, &mut b, &params, |_, _| Go::On).unwrap();
        assert!(warm.work <= 0.5 * cold.work, "{solver}: {} of {}", warm.work, cold.work);
        assert!(after.residual(&b) <= 1.01e-4);
    }
}

/// Catalogue 36: on the textbook's system ω = 1.0718 is best; no ω between 0 and 2 diverges; outside it is refused.
#[test]
fn catalogue_36_overrelaxation() {
    let system = textbook();
    let sweeps = |relaxation: f64| {
        let params = Params { tolerance: 1e-10, relaxation, max_steps: 5000, ..Params::default() };
        system.solve(Solver::Sor, &params).unwrap().1.steps
    };
    let (best, seidel) = (sweeps(1.0718), sweeps(1.0));
    assert!(best < seidel, "{best} of {seidel}");
    for relaxation in [0.05, 0.5, 0.9, 1.2, 1.5, 1.9, 1.98] {
        let own = sweeps(relaxation);
        assert!(own >= best, "{relaxation}: {own} of {best}");
    }
    let room = room(4);
    for relaxation in [0.1, 0.5, 1.0, 1.5, 1.9] {
        room.solve(Solver::Sor, &Params { relaxation, ..Params::default() }).unwrap();
    }
    for relaxation in [0.0, 2.0, f64::NAN] {
        let refused = system.solve(Solver::Sor, &Params { relaxation, ..Params::default() });
        assert!(matches!(refused, Err(SolveError::NotApplicable(_))));
    }
}

/// Catalogue R1: sweeps to an error of 0.1 %.
#[test]
fn catalogue_36_sweeps_of_r1() {
    let system = r1();
    let exact = system.exact();
    for (solver, expected) in [(Solver::Sor, 3), (Solver::GaussSeidel, 4), (Solver::Jacobi, 7)] {
        let mut b = system.e.clone();
        let mut reached = None;
        let mut sweep = 0;
        let params = Params { tolerance: 1e-8, ..Params::default() };
        let look = |b: &[f64], _: &Info| {
            if reached.is_none() && system.error(b, &exact) < 1e-3 {
                reached = Some(sweep);
            }
            sweep += 1;
            Go::On
        };
        solve(solver, &system.transport, &system.response, &system.e, &mut b, &params, look).unwrap();
        assert_eq!(reached, Some(expected), "{solver}");
    }
}

/// A closed cube of 600 patches, all of reflectance ρ, with an emission without pattern.
fn closed_cube(rho: f64) -> System {
    let pattern = |c: [f64; 3]| {
        let phase = c[0] * 12_989.8 + c[1] * 7_823.3 + c[2] * 3_771.9;
        (4375.5 * phase.sin()).rem_euclid(1.0)
    };
    box_of([1.0; 3], 10).closed().system(|_| rho, |_, c| pattern(c))
}

/// Iterations from B = E to a relative error of 1e-6 on a closed cube of 600 patches, all alike, emission without
/// pattern: Jacobi and Gauss–Seidel lose the constant at the rate of ρ; Krylov methods and deflation do not care.
#[test]
fn catalogue_8_iterations_on_a_closed_cube() {
    let solvers =
        [Solver::Jacobi, Solver::GaussSeidel, Solver::Cg, Solver::DeflatedJacobi, Solver::Gmres, Solver::Bicgstab];
    for (rho, expected) in [(0.5, [19, 11, 7]), (0.8, [61, 32, 9]), (0.95, [269, 136, 10]), (0.99, [1374, 688, 10])] {
        let system = closed_cube(rho);
        let exact = system.exact();
        let found = solvers.map(|solver| {
            let mut b = system.e.clone();
            let mut count = 0i32;
            let params = Params { tolerance: 0.0, max_steps: 3000, ..Params::default() };
            let look = |b: &[f64], _: &Info| {
                if system.error(b, &exact) < 1e-6 {
                    return Go::Stop;
                }
                count += 1;
                Go::On
            };
            let _ = solve(solver, &system.transport, &system.response, &system.e, &mut b, &params, look);
            count
        });
        let [jacobi, seidel, cg, deflated, gmres, bicgstab] = found;
        assert_eq!([jacobi, seidel], expected[..2], "{rho}");
        // Another emission may ask one step more of conjugate gradients, or one less.
        assert!((cg - expected[2]).abs() <= 1, "{rho}: {cg}");
        assert!(deflated <= 12 && gmres <= cg && bicgstab <= 8, "{rho}: {found:?}");
    }
}

/// Catalogue 39: what shooting costs to an error of 1 % on the same cube, in applications of F: 2.7, 9.7 and 44 were
/// measured with another emission, which is worth half a sweep either way. Overshooting takes a sweep or two.
#[test]
fn catalogue_39_shots_on_a_closed_cube() {
    for (rho, expected) in [(0.5, 2.7), (0.8, 9.7), (0.95, 44.0)] {
        let system = closed_cube(rho);
        let exact = system.exact();
        let [plain, over] = [Solver::Progressive, Solver::Overshooting].map(|solver| {
            let mut b = vec![0.0; 600];
            let mut work = 0.0;
            let mut last = 1;
            let look = |b: &[f64], info: &Info| {
                work = info.work;
                // A look at every tenth shot tells the work to 0.02.
                last = (last + 1) % 10;
                if last == 0 && system.error(b, &exact) < 0.01 { Go::Stop } else { Go::On }
            };
            let _ = solve(solver, &system.transport, &system.response, &system.e, &mut b, &Params::default(), look);
            work
        });
        assert!((plain - expected).abs() <= 0.5 + 0.01 * expected, "{rho}: {plain}");
        assert!(over < 2.5, "{rho}: {over}");
    }
}
