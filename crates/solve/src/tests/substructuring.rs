//! Patches shoot, elements receive.

use super::systems::*;
use crate::*;

/// The oblong room of `n × n` patches a face, each cut into 2 × 2 elements.
fn substructure(n: usize) -> (Substructure, DiffuseResponse, Vec<f64>) {
    let fine = box_of([4.0, 3.0, 2.5], 2 * n).closed();
    let elements = fine.area.len();
    let patch: Vec<u32> = (0..elements)
        .map(|k| {
            let (face, i, j) = (k / (4 * n * n), k / (2 * n) % (2 * n), k % (2 * n));
            (face * n * n + i / 2 * n + j / 2) as u32
        })
        .collect();
    let patches = elements / 4;
    let mut factors = vec![0.0; elements * patches];
    for i in 0..elements {
        for j in 0..elements {
            factors[i * patches + patch[j] as usize] += fine.rows[i * elements + j];
        }
    }
    let reflectance = fine.face.iter().map(|f| [0.2, 0.7, 0.4, 0.5, 0.9, 0.0][*f]).collect();
    let e = fine.face.iter().map(|f| if *f == 1 { 1.0 } else { 0.0 }).collect();
    let response = DiffuseResponse { reflectance, bands: 1, reciprocal_area: None };
    (Substructure::new(fine.area, patch, factors).unwrap(), response, e)
}

/// Catalogue 47: the flux on a patch is the sum of that on its elements; patches solved by themselves and gathered
/// once are what the elements' own equation gives.
#[test]
fn catalogue_47_patches_and_elements() {
    let (scene, response, e) = substructure(3);
    let (elements, patches) = (e.len(), scene.patches());
    assert_eq!((elements, patches), (216, 54));
    let tight = Params { tolerance: 1e-14, ..Params::default() };

    // By the elements' equation, with all solvers that apply F and no more.
    let mut whole = vec![0.0; elements];
    bicgstab(&scene, &response, &e, &mut whole, &tight, |_, _| Go::On).unwrap();
    for solver in Solver::ALL.iter().filter(|s| s.applies_only() && **s != Solver::Cg) {
        let mut b = vec![0.0; elements];
        solve_operator(*solver, &scene, &response, &e, &mut b, &tight, |_, _| Go::On).unwrap();
        assert!(b.iter().zip(&whole).all(|(b, x)| (b - x).abs() < 1e-12), "{solver}");
    }

    // By the patches' equation and one gather.
    let between = scene.between_patches();
    let area = between.space().area.clone();
    let reflectance = scene.mean(&response.reflectance, 1);
    let of_patches = DiffuseResponse { reflectance, bands: 1, reciprocal_area: Some(area.clone()) };
    let mut b = vec![0.0; patches];
    solve(Solver::Southwell, &between, &of_patches, &scene.mean(&e, 1), &mut b, &tight, |_, _| Go::On).unwrap();
    let mut h = vec![0.0; elements];
    scene.gather(&b, &mut h, 1);
    let gathered: Vec<f64> = (0..elements).map(|i| e[i] + response.reflectance[i] * h[i]).collect();
    let worst = gathered.iter().zip(&whole).fold(0f64, |m, (b, x)| m.max((b - x).abs()));
    assert!(worst < 1e-12, "{worst:e}");

    // Flux through each patch, by its own equation and as the sum of its elements.
    let by_elements = scene.mean(&gathered, 1);
    for p in 0..patches {
        assert!((area[p] * (b[p] - by_elements[p])).abs() <= 1e-12, "patch {p}");
    }
    let (mut mean_h, own_h) = (vec![0.0; patches], scene.mean(&h, 1));
    between.apply(&b, &mut mean_h, 1).unwrap();
    for p in 0..patches {
        assert!((area[p] * (mean_h[p] - own_h[p])).abs() <= 1e-12);
    }
    // Within a patch the elements differ: that is what they are for.
    assert!((gathered[0] - gathered[1]).abs() > 1e-4);
}

#[test]
fn substructures_are_checked() {
    let made = |area: &[f64], patch: &[u32], factors: usize| {
        Substructure::new(area.to_vec(), patch.to_vec(), vec![0.0; factors]).is_ok()
    };
    assert!(made(&[1.0, 1.0], &[0, 1], 4));
    assert!(!made(&[1.0, 1.0], &[0, 1], 3));
    assert!(!made(&[1.0], &[0, 1], 2));
    assert!(!made(&[1.0, 1.0], &[0, 2], 6));
}
