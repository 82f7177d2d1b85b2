//! Elimination, and the numbers of others that it must give.

use super::systems::*;
use crate::*;

/// Catalogue 31: the residual of elimination is at most 1e-13.
#[test]
fn catalogue_31_elimination_leaves_rounding() {
    for (name, system) in [("cube", cube(0.8)), ("textbook", textbook()), ("room", room(7))] {
        for solver in [Solver::Lu, Solver::Cholesky] {
            let (b, info) = system.solve(solver, &Params { tolerance: 1e-13, ..Params::default() }).unwrap();
            let residual = system.residual(&b);
            assert!(residual <= 1e-13 && info.residual[0] <= 1e-13, "{name}, {solver}: {residual:e}");
        }
    }
}

/// Catalogue 31 for N = 2,000: 18 × 18 patches a face make 1,944.
#[test]
fn catalogue_31_elimination_of_two_thousand_unknowns() {
    let system = room(18);
    for solver in [Solver::Lu, Solver::Cholesky] {
        let (b, info) = system.solve(solver, &Params { tolerance: 1e-13, ..Params::default() }).unwrap();
        assert!(system.residual(&b) <= 1e-13, "{solver}: {:?}", info.residual);
    }
}

/// Independent solutions of boxes with one constant patch per face, from closed forms of parallel and perpendicular
/// rectangles (rad-box-1 to 3): face values in the order z−, z+, y−, y+, x−, x+.
#[test]
fn catalogue_31_boxes_of_one_patch_a_face() {
    // Size, reflectance and exitance by face, radiosity by face.
    let cases = [
        (
            [1.0, 1.0, 1.0],
            [0.5; 6],
            [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [
                1.090909098107695,
                0.18174582610778853,
                0.18183626894612903,
                0.18183626894612906,
                0.18183626894612903,
                0.18183626894612903,
            ],
        ),
        (
            [1.0, 1.0, 1.0],
            [0.2, 0.0, 0.6, 0.6, 0.1, 0.8],
            [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
            [
                0.06519500446655477,
                1.0,
                0.18170787366378152,
                0.18170787366378152,
                0.033253244727637514,
                0.23394361239211922,
            ],
        ),
        (
            [4.0, 3.0, 2.5],
            [0.2, 0.7, 0.5, 0.5, 0.5, 0.5],
            [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
            [
                0.09325441631400264,
                1.1170696000380669,
                0.19832578126392644,
                0.1983257812639265,
                0.1970133441921433,
                0.19701334419214334,
            ],
        ),
    ];
    for (size, reflectance, exitance, expected) in cases {
        let [x, y, z] = size;
        // Parallel pairs first; what they leave goes to the four sides, fixed by reciprocity and closure.
        let area = [x * y, x * y, x * z, x * z, y * z, y * z];
        let parallel = [(x, y, z), (x, z, y), (y, z, x)].map(|(a, b, c)| parallel(a, b, c));
        let mut rows = vec![0.0; 36];
        // A_p F_pq of the three pairs of directions, from the three sums of a row: 2 Σ_q A_p F_pq = A_p (1 −
        // F_opposite).
        let free: Vec<f64> = (0..3).map(|p| area[2 * p] * (1.0 - parallel[p]) / 2.0).collect();
        let half = free.iter().sum::<f64>() / 2.0;
        for i in 0..6 {
            for j in 0..6 {
                rows[6 * i + j] = match (i / 2, j / 2) {
                    (p, q) if p == q => {
                        if i == j {
                            0.0
                        } else {
                            parallel[p]
                        }
                    }
                    // g_pq + g_pr = free_p for all three gives g_pq = half − free_r.
                    (p, q) => (half - free[3 - p - q]) / area[i],
                };
            }
        }
        let system = System::new(area.to_vec(), rows, reflectance.to_vec(), exitance.to_vec());
        for solver in Solver::ALL.iter().filter(|s| !s.is_random()) {
            let (b, _) = system.solve(*solver, &Params { tolerance: 1e-13, ..Params::default() }).unwrap();
            for (b, expected) in b.iter().zip(expected) {
                assert!((b - expected).abs() <= 1e-12, "{solver}: {b} for {expected}");
            }
        }
    }
}

/// Two parallel rectangles a × b at distance c (Hottel 1931).
fn parallel(a: f64, b: f64, c: f64) -> f64 {
    let (x, y) = (a / c, b / c);
    let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    2.0 / (std::f64::consts::PI * x * y)
        * ((p * p * q * q / (1.0 + x * x + y * y)).sqrt().ln() + x * q * (x / q).atan() + y * p * (y / p).atan()
            - x * x.atan()
            - y * y.atan())
}
