//! The hemicube against its published numbers, catalogue 23 and 24.

use super::*;
use crate::row::surface::Atlas;
use crate::row::tests::{ADJACENT, OPPOSITE, box_of, point_to_rectangle};
use crate::row::{Repair, Row, RowFactors};
use radiosity_scene::{Enclosure, Facet};

fn weights_sum(n: usize, weights: Weights) -> f64 {
    let hemicube = Hemicube { weights, ..Hemicube::default() };
    let faces = Projection::faces(&hemicube, n);
    faces.iter().flat_map(|face| face.weights(&face.vectors(weights), DVec3::Z)).sum()
}

#[test]
fn catalogue_23_midpoint_cells_miss_one_by_n_squared() {
    let table = [(16, 2.12e-3), (32, 5.30e-4), (50, 2.17e-4), (64, 1.32e-4), (100, 5.42e-5), (128, 3.31e-5)];
    for (n, defect) in table.into_iter().chain([(256, 8.27e-6), (512, 2.07e-6)]) {
        let off = (weights_sum(n, Weights::Midpoint) - 1.0).abs();
        assert!((off - defect).abs() < 0.006 * defect, "{n}: {off:e} for {defect:e}");
        assert!((weights_sum(n, Weights::Exact) - 1.0).abs() < 1e-12, "{n}");
    }
}

#[test]
fn catalogue_23_shares_of_top_and_sides() {
    let hemicube = Hemicube::default();
    let faces = Projection::faces(&hemicube, 50);
    let shares = faces.iter().map(|face| face.weights(&face.vectors(Weights::Exact), DVec3::Z).iter().sum::<f64>());
    for (share, exact) in shares.zip([0.554_126_424_0].into_iter().chain([0.111_468_394_0; 4])) {
        assert!((share - exact).abs() < 1e-10, "{share} {exact}");
    }
    // A row keeps its weights through whatever scales them.
    let atlas = Atlas::new(&hemicube);
    let raw = faces[0].weights(&faces[0].vectors(Weights::Exact), DVec3::Z);
    assert_eq!(atlas.level(1).faces[0].cells, [256, 256]);
    assert_eq!(raw.len(), 2500);
}

/// A square of side `side` at a place ahead and a little aside of a small facet, with its exact factor.
fn far_square(side: f64, place: f64) -> (Enclosure, f64) {
    let square = |half: f64, [x, y, z]: [f64; 3]| {
        let corner = |[u, v]: [f64; 2]| DVec3::new(x + half * u, y + half * v, z);
        Facet::new([[-1., -1.], [1., -1.], [1., 1.], [-1., 1.]].map(corner).to_vec()).unwrap()
    };
    let mut pair = Enclosure::default();
    pair.add("from", square(1e-4, [0.0; 3]));
    // Steps of the golden and the plastic ratio, so that no two places lie alike on a grid.
    let (x, y) = (0.2 + 0.3 * (0.618_034 * place).fract(), 0.3 * (0.754_878 * place).fract() - 0.4);
    pair.add("to", square(side / 2.0, [x, y, 1.0]).flipped());
    let [l, r, b, t] = [x - side / 2.0, x + side / 2.0, y - side / 2.0, y + side / 2.0];
    let corner = |x: f64, y: f64| point_to_rectangle(x, y, 1.0);
    (pair, corner(r, t) - corner(l, t) - corner(r, b) + corner(l, b))
}

/// Mean relative error of a small far square over 40 places, and how often the prediction covered it.
fn aliasing(side: f64, method: &dyn Row) -> (f64, usize) {
    let (mut sum, mut covered) = (0.0, 0);
    for place in 0..40 {
        let (pair, exact) = far_square(side, f64::from(place));
        let found = method.row(0, &pair).factors[1];
        sum += (found.value - exact).abs() / exact / 40.0;
        covered += usize::from((found.value - exact).abs() <= found.error);
    }
    (sum, covered)
}

/// A square some cells wide is off by about a cell's width over its own, so the error falls with n⁻¹.
#[test]
fn catalogue_23_small_far_facets_alias() {
    let look = |n: usize| Look { resolution: n, ..Look::default() };
    let errors = [32, 64, 128, 256].map(|n| aliasing(0.103, &Hemicube { look: look(n), ..Hemicube::default() }));
    for (error, covered) in errors {
        assert!(error > 0.0 && covered >= 38, "{errors:?}");
    }
    let slope = (errors[3].0 / errors[0].0).ln() / 8f64.ln();
    assert!((-1.2..-0.8).contains(&slope), "{slope} of {errors:?}");
    // Below one cell all may be lost, or several times as much be found; the prediction covers both.
    let hemicube = Hemicube { look: look(32), ..Hemicube::default() };
    let found = (0..40).map(|place| hemicube.row(0, &far_square(0.02, f64::from(place)).0).factors[1]);
    assert!(found.clone().any(|f| f.value == 0.0) && found.clone().any(|f| f.value > 0.0));
    assert!(aliasing(0.02, &hemicube).1 >= 38);
}

/// The same squares: turned surfaces at several eye points are several times better, exact outlines leave nothing, and a
/// tolerance is met.
#[test]
fn catalogue_23_aliasing_is_repaired() {
    let look = Look { resolution: 64, ..Look::default() };
    let with = |look: Look| Hemicube { look, ..Hemicube::default() };
    let plain = aliasing(0.103, &with(look)).0;
    let turned = aliasing(0.103, &with(Look { points: 4, spin: Some(1), ..look }));
    assert!(turned.0 < plain / 3.0 && turned.1 >= 38, "{turned:?} of {plain}");
    for side in [0.103, 0.02, 0.002] {
        let exact = aliasing(side, &with(Look { repair: Repair::Analytic, ..look }));
        assert!(exact.0 < 1e-3 && exact.1 >= 38, "{side}: {exact:?}");
        let (pair, factor) = far_square(side, 0.0);
        let until = with(Look { resolution: 16, repair: Repair::UntilError(0.01 * factor), ..look }).row(0, &pair);
        assert!((until.factors[1].value - factor).abs() <= until.factors[1].error);
        assert!(until.factors[1].error <= 0.01 * factor, "{until:?} of {factor}");
    }
}

/// Errors of one eye point, and of more, as an infinitely fine hemicube has them; and what is predicted for them.
#[test]
fn catalogue_24_a_point_does_not_stand_for_a_facet() {
    let cube = box_of(DVec3::ONE, 1);
    let row = |points: usize| -> RowFactors {
        let look = Look { resolution: 128, points, spin: Some(3), repair: Repair::Analytic };
        Hemicube { look, ..Hemicube::default() }.row(0, &cube)
    };
    let centre = row(1);
    assert!((centre.factors[1].value - 0.239456).abs() < 1e-6, "{centre:?}");
    assert!((centre.factors[2].value - 0.190136).abs() < 1e-6, "{centre:?}");
    for (points, off) in [(1, 0.198), (2, 0.0401), (4, 0.0096), (8, 0.00236)] {
        let row = row(points);
        let opposite = row.factors[1].value / OPPOSITE - 1.0;
        assert!((opposite - off).abs() < 0.006 * off, "{points}: {opposite}");
        for (j, factor) in row.factors.iter().enumerate().skip(1) {
            let error = (factor.value - if j == 1 { OPPOSITE } else { ADJACENT }).abs();
            assert!((error..8.0 * error).contains(&factor.error), "{points}, {j}: {error} {factor:?}");
        }
    }
}

/// The classic hemicube, cells and all, predicts its errors too, and repairs them to any tolerance.
#[test]
fn catalogue_24_errors_are_predicted_and_repaired() {
    let cube = box_of(DVec3::ONE, 1);
    let exact = |j: usize| [0.0, OPPOSITE, ADJACENT, ADJACENT, ADJACENT, ADJACENT][j];
    for weights in [Weights::Exact, Weights::Midpoint] {
        for points in [1, 2, 4] {
            let look = Look { resolution: 128, points, ..Look::default() };
            let row = Hemicube { look, weights }.row(0, &cube);
            for (j, factor) in row.factors.iter().enumerate() {
                let error = (factor.value - exact(j)).abs();
                assert!(error <= factor.error, "{points}, {j}: {error} {factor:?}");
                assert!(factor.error <= 8.0 * error + 0.01, "{points}, {j}: {error} {factor:?}");
            }
        }
    }
    for tolerance in [1e-2, 1e-3, 1e-4] {
        let look = Look { resolution: 32, repair: Repair::UntilError(tolerance), ..Look::default() };
        let row = Hemicube { look, ..Hemicube::default() }.row(0, &cube);
        for (j, factor) in row.factors.iter().enumerate() {
            assert!(factor.error <= tolerance && (factor.value - exact(j)).abs() <= tolerance, "{j}: {factor:?}");
        }
    }
}
