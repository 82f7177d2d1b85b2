//! Random methods: right in the mean, right about their error, and the same for the same seed.

use super::systems::*;
use crate::*;

const RANDOM: [Solver; 2] = [Solver::RandomWalk, Solver::StochasticJacobi];

/// Runs a random method for a number of steps; none reaches a residual of nothing.
fn steps(system: &System, solver: Solver, start: &[f64], params: Params, count: usize) -> (Vec<f64>, Info) {
    let mut b = start.to_vec();
    let mut last = Info::default();
    let result = solve(
        solver,
        &system.transport,
        &system.response,
        &system.e,
        &mut b,
        &Params { tolerance: 0.0, max_steps: usize::MAX, ..params },
        |_, info| {
            last = info.clone();
            if info.steps == count { Go::Stop } else { Go::On }
        },
    );
    assert!(matches!(result, Err(SolveError::Stopped)));
    (b, last)
}

/// Catalogue 94: unbiased, from zero and from a warm start, with an error bar that tells the truth. Each of the
/// numbers lies within 4.5 standard errors (a false alarm once in ten thousand sets of seeds), and the mean of their
/// squared z is near one.
#[test]
fn catalogue_94_unbiased_with_standard_errors() {
    let system = room(3);
    let exact = system.exact();
    let warm: Vec<f64> = exact.iter().enumerate().map(|(i, x)| x * (0.5 + (i % 3) as f64 * 0.4)).collect();
    for solver in RANDOM {
        for start in [vec![0.0; exact.len()], warm.clone()] {
            let (b, info) = steps(&system, solver, &start, Params::default(), 200);
            let mut squares = 0.0;
            let mut count = 0.0;
            for i in 0..b.len() {
                let error = info.standard_error[i];
                if error > 0.0 {
                    let z = (b[i] - exact[i]) / error;
                    assert!(z.abs() < 4.5, "{solver}, {i}: {} for {} ± {error}", b[i], exact[i]);
                    squares += z * z;
                    count += 1.0;
                } else {
                    assert!((b[i] - exact[i]).abs() < 1e-12, "{solver}, {i}");
                }
            }
            // Neighbours are a little dependent; 36 numbers scatter by 0.24.
            assert!((0.4..1.8).contains(&(squares / count)), "{solver}: {}", squares / count);
            assert!(system.error(&b, &exact) < 0.02);
        }
    }
}

/// Catalogue 94: four times the samples, a quarter of the variance; measured over 400 runs, which know it to some 10 %.
#[test]
fn catalogue_94_variance_falls_as_one_over_samples() {
    let system = room(2);
    for solver in RANDOM {
        let variance = |samples: usize| {
            let (_, info) = steps(&system, solver, &[0.0; 24], Params { samples, ..Params::default() }, 400);
            info.standard_error.iter().map(|s| s * s).sum::<f64>()
        };
        let (few, some, many) = (variance(16), variance(64), variance(256));
        for ratio in [few / some, some / many] {
            assert!((3.2..5.0).contains(&ratio), "{solver}: {ratio}");
        }
    }
}

/// The same seed gives the same numbers, another seed others.
#[test]
fn seeds_decide() {
    let system = cube(0.5);
    for solver in RANDOM {
        let run = |seed| steps(&system, solver, &[0.0; 6], Params { seed, ..Params::default() }, 3).0;
        assert_eq!(run(7), run(7));
        assert_ne!(run(7), run(8));
    }
}

/// A tolerance is kept by random methods too: it is the residual that they are asked for.
#[test]
fn catalogue_42_a_tolerance_is_reached() {
    let system = cube(0.5);
    for solver in RANDOM {
        let params = Params { tolerance: 1e-3, max_steps: 1_000_000, samples: 10_000, ..Params::default() };
        let (b, info) = system.solve(solver, &params).unwrap();
        assert!(info.residual[0] <= 1e-3 && (system.residual(&b) - info.residual[0]).abs() < 1e-13);
    }
}

#[test]
fn random_methods_refuse_what_has_no_walks() {
    for solver in RANDOM {
        let refused = textbook().solve(solver, &Params::default());
        assert!(matches!(refused, Err(SolveError::NotApplicable(text)) if text.contains("negative")));
        let refused = cube(1.0).solve(solver, &Params::default());
        assert!(matches!(refused, Err(SolveError::NotApplicable(text)) if text.contains("end")));
    }
}
