//! What holds for every method of form factors: sums of rows, unequal areas, grouping, and agreement past obstacles.

use crate::rooms::{box_of, rectangle, room_with_block};
use glam::DVec3;
use radiosity_scene::Enclosure;
use radiosity_transport::row::Look;
use radiosity_transport::view_factors::ViewFactorOptions;
use radiosity_transport::{FormFactorMethod, FormFactorOptions, FormFactors, PairMethod};

fn options(resolution: usize) -> FormFactorOptions {
    let look = Look { resolution, points: 2, ..Look::default() };
    FormFactorOptions { adaptive: ViewFactorOptions::default(), look }
}

fn found(method: FormFactorMethod, room: &Enclosure, resolution: usize) -> FormFactors {
    // The cells of the single plane are as wide at its rim as in the middle.
    let finer = if method.name().starts_with("single-plane") { 4 } else { 1 };
    FormFactors::new(method, room, &options(finer * resolution), &()).unwrap()
}

/// Whether the method draws points, so that its errors are three standard errors.
fn is_random(method: FormFactorMethod) -> bool {
    use PairMethod::{AreaSamples, GlobalLines, Malley};
    matches!(method, FormFactorMethod::Pair(Malley | AreaSamples | GlobalLines))
}

/// Catalogue 0a: areas 1 and 100, face to face. F_12 A_1 = F_21 A_2 for every method within its errors; swapped indices
/// would be off by 10⁴.
#[test]
fn catalogue_0a_unequal_areas_in_every_method() {
    let mut pair = Enclosure::default();
    pair.add("large", rectangle(DVec3::ZERO, DVec3::X * 10.0, DVec3::Y * 10.0));
    pair.add("small", rectangle(DVec3::new(4.5, 4.5, 5.0), DVec3::Y, DVec3::X));
    let exact = FormFactors::new(FormFactorMethod::Adaptive, &pair, &options(64), &()).unwrap();
    let (up, down) = (exact.value(0, 1), exact.value(1, 0));
    assert!((down / up - 100.0).abs() < 1e-11 && down > 0.5 && up < 0.01, "{up} {down}");
    for method in FormFactorMethod::all() {
        let factors = found(method, &pair, 64);
        for (i, j) in [(0, 1), (1, 0)] {
            let (_, value, error) = factors.row(i).find(|entry| entry.0 == j).unwrap();
            let scale = if is_random(method) { 1.5 } else { 1.0 };
            assert!((value - exact.value(i, j)).abs() <= scale * error + 1e-9, "{method} {i} {j}: {value} ± {error}");
        }
        // The disc is not reciprocal: it has 45 instead of 100.
        assert!(factors.value(1, 0) > 40.0 * factors.value(0, 1), "{method}");
    }
}

/// Catalogue 0b: how far the rows of a closed room are from one, as found: no farther than the errors stated of their entries,
/// 1e-6 for closed forms (1e-5 for cubature, which is asked for 1e-6 an entry), rounding for what shares out a hemisphere, and 1e-3 for what samples one.
#[test]
fn catalogue_0b_rows_of_every_method() {
    let room = box_of(DVec3::new(2.0, 1.5, 1.0), 1);
    for method in FormFactorMethod::all() {
        let factors = found(method, &room, 64);
        let scale = if is_random(method) { 1.5 } else { 1.0 };
        for (i, sum) in factors.row_sums().into_iter().enumerate() {
            let doubt: f64 = factors.row(i).map(|(_, _, error)| error).sum();
            assert!((sum - 1.0).abs() <= scale * doubt + 1e-9, "{method}, {i}: {sum} ± {doubt}");
        }
        let allowed = match method.name() {
            "adaptive" | "exact" => 1e-6,
            "cubature" => 1e-5,
            "hemicube" | "cubic-tetrahedron" | "hemisphere" | "lambert" | "nusselt" => 1e-12,
            "hemicube-midpoint" | "global-cube" => 1e-3,
            _ => continue,
        };
        let closure = factors.closure();
        assert!(closure.largest <= allowed, "{method}: {closure:?}");
    }
}

/// Catalogue 22: what is grouped adds up, F_I,(J∪K) = F_IJ + F_IK and A_(J∪K) F_(J∪K),I = A_J F_JI + A_K F_KI, past a
/// block as well; and a wall that was cut gives what the whole one gives.
#[test]
fn catalogue_22_surfaces_add_up() {
    let room = room_with_block(2);
    let parts = FormFactors::new(FormFactorMethod::Adaptive, &room, &options(64), &()).unwrap();
    // Four facets of each wall are one surface.
    let mut grouped = room.clone();
    grouped.surface_of = (0..room.facets.len() as u32).map(|i| if i < 24 { i / 4 } else { i - 18 }).collect();
    grouped.surfaces.truncate(12);
    let whole = parts.by_surface(&grouped);
    let members = |s: usize| grouped.surface_of.iter().enumerate().filter(move |m| *m.1 == s as u32).map(|m| m.0);
    let mut largest: f64 = 0.0;
    for i in 0..12 {
        assert!((whole.areas[i] - members(i).map(|m| parts.areas[m]).sum::<f64>()).abs() < 1e-12);
        for j in 0..12 {
            let there: f64 = members(i)
                .flat_map(|m| members(j).map(move |n| (m, n)))
                .map(|(m, n)| parts.areas[m] * parts.value(m, n))
                .sum();
            let back: f64 = members(j)
                .flat_map(|n| members(i).map(move |m| (n, m)))
                .map(|(n, m)| parts.areas[n] * parts.value(n, m))
                .sum();
            largest = largest.max((whole.areas[i] * whole.value(i, j) - there).abs());
            largest = largest.max((whole.areas[j] * whole.value(j, i) - back).abs());
            largest = largest.max((there - back).abs());
        }
    }
    assert!(largest < 1e-12, "{largest:e}");

    let uncut = FormFactors::new(FormFactorMethod::Adaptive, &room_with_block(1), &options(64), &()).unwrap();
    for i in 0..12 {
        for (j, value, error) in uncut.row(i) {
            let (_, other, doubt) = whole.row(i).find(|entry| entry.0 == j).unwrap();
            assert!((value - other).abs() <= error + doubt + 1e-12, "{i} {j}: {value} ± {error}, {other} ± {doubt}");
        }
    }
    // Nothing stands between the upper faces of the block and the walls beside: what is clear agrees to 1e-9 of the area.
    assert!(uncut.closure().largest < 1e-4 && whole.closure().largest < 1e-4);
}

/// Catalogue 91: around a block, every two methods that see occlusion agree within the sum of their stated errors, points drawn
/// at random within twice that, also in what is hidden from all points that rows look from.
#[test]
fn catalogue_91_every_method_that_sees_occlusion() {
    let room = room_with_block(1);
    let n = room.facets.len();
    let all = FormFactorMethod::all().filter(|m| m.sees_occlusion()).map(|method| {
        let factors = found(method, &room, 64);
        let mut entries = vec![(0.0, 0.0); n * n];
        for i in 0..n {
            factors.row(i).for_each(|(j, value, error)| entries[i * n + j] = (value, error));
        }
        (method, entries)
    });
    let all: Vec<(FormFactorMethod, Vec<(f64, f64)>)> = all.collect();
    assert!(all.len() >= 13);
    for (a, (method, one)) in all.iter().enumerate() {
        for (other, two) in &all[..a] {
            let drawn = is_random(*method)
                || is_random(*other)
                || method.name() == "hemisphere"
                || other.name() == "hemisphere";
            let scale = if drawn { 2.0 } else { 1.0 };
            for (k, (x, y)) in one.iter().zip(two).enumerate() {
                let off = (x.0 - y.0).abs();
                assert!(off <= scale * (x.1 + y.1) + 1e-12, "{}, {}: {method} {x:?}, {other} {y:?}", k / n, k % n);
            }
        }
    }
}
