//! The default view factors of whole enclosures: against closed forms and references with blockers, and by the laws.

use glam::{DMat3, DVec3};
use radiosity_scene::{Enclosure, Facet};
use radiosity_trace::sampling::Random;
use radiosity_transport::view_factors::{ViewFactorOptions, ViewFactors, view_factors};
use serde_json::Value;

fn solve(enclosure: &Enclosure, accuracy: f64) -> ViewFactors {
    view_factors(enclosure, &ViewFactorOptions { accuracy, ..ViewFactorOptions::default() }, &()).unwrap()
}

fn facet(corners: &[[f64; 3]]) -> Facet {
    Facet::new(corners.iter().map(|c| DVec3::from(*c)).collect()).unwrap()
}

/// The sides of a box in patches of n × n, active inwards or outwards.
fn add_box(enclosure: &mut Enclosure, low: [f64; 3], high: [f64; 3], n: usize, inwards: bool) {
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for (upper, at) in [(false, low[axis]), (true, high[axis])] {
            for k in 0..n * n {
                let point = |i: usize, j: usize| {
                    let mut p = [0.0; 3];
                    p[axis] = at;
                    p[u] = low[u] + (high[u] - low[u]) * i as f64 / n as f64;
                    p[v] = low[v] + (high[v] - low[v]) * j as f64 / n as f64;
                    p
                };
                let (i, j) = (k / n, k % n);
                let mut corners = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
                if upper == inwards {
                    corners.reverse();
                }
                enclosure.add(format!("{axis}{upper}{k}"), facet(&corners));
            }
        }
    }
}

/// The same of a box turned about the vertical through its middle, active outwards.
fn add_turned_box(enclosure: &mut Enclosure, low: [f64; 3], size: [f64; 3], turn: f64, n: usize) {
    let mut upright = Enclosure::default();
    add_box(&mut upright, low, std::array::from_fn(|k| low[k] + size[k]), n, false);
    let middle = DVec3::from(low) + 0.5 * DVec3::from(size);
    let turned = DMat3::from_rotation_z(turn);
    for facet in upright.facets {
        let corners = facet.corners().iter().map(|c| middle + turned * (*c - middle)).collect();
        enclosure.add("", Facet::new(corners).unwrap());
    }
}

fn obstructed_room(n: usize) -> Enclosure {
    let mut room = Enclosure::default();
    add_box(&mut room, [0.0; 3], [5.0, 4.0, 3.0], n, true);
    add_box(&mut room, [1.0, 1.0, 0.4], [2.2, 1.8, 1.4], 1, false);
    add_box(&mut room, [3.2, 2.2, 0.3], [3.9, 3.0, 2.1], 1, false);
    room
}

/// Catalogue 20: faces of the unit cube.
#[test]
fn catalogue_20_cube() {
    let mut cube = Enclosure::default();
    add_box(&mut cube, [0.0; 3], [1.0; 3], 1, true);
    let factors = solve(&cube, 1e-5);
    for i in 0..6 {
        for j in 0..6 {
            let exact = if i == j {
                0.0
            } else if i / 2 == j / 2 {
                0.199_824_895_698
            } else {
                0.200_043_776_075
            };
            assert!((factors.factor(i, j).value - exact).abs() < 1e-11, "{i} {j}: {:?}", factors.factor(i, j));
        }
    }
    assert!(factors.closure().largest < 1e-11);
}

/// Catalogue 0b: in a closed enclosure rows sum to one, whatever is clear to the accuracy of what is clear, with boxes
/// in the way to that of what is not; and closer as the accuracy asked is finer.
#[test]
fn catalogue_0b_rows_sum_to_one() {
    let mut empty = Enclosure::default();
    add_box(&mut empty, [0.0; 3], [5.0, 4.0, 3.0], 6, true);
    assert!(solve(&empty, 1e-5).closure().largest < 1e-7);

    let room = obstructed_room(6);
    let mut last = f64::INFINITY;
    for accuracy in [1e-4, 1e-5, 1e-6] {
        let closure = solve(&room, accuracy).closure();
        assert!(closure.rms < 10.0 * accuracy && closure.rms < last, "{accuracy:e}: {closure:?}");
        last = closure.rms;
    }
}

/// Catalogue 18: two unit squares 1 apart, a half-size square midway; never more than without it.
#[test]
fn catalogue_18_a_square_between_squares() {
    for (at, exact) in [(0.0, 0.149_868_671_8), (0.25, 0.099_506_294_6)] {
        let mut pair = Enclosure::default();
        pair.add("floor", facet(&[[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]));
        pair.add("ceiling", facet(&[[0., 0., 1.], [0., 1., 1.], [1., 1., 1.], [1., 0., 1.]]));
        let (a, b) = (at, at + 0.5);
        pair.obstructions.push(facet(&[[a, a, 0.5], [b, a, 0.5], [b, b, 0.5], [a, b, 0.5]]));
        for accuracy in [1e-3, 1e-4, 1e-5, 1e-6] {
            let factor = solve(&pair, accuracy).factor(0, 1);
            let off = (factor.value - exact).abs();
            assert!(off <= factor.error && factor.error <= 1.01 * accuracy, "{accuracy:e}: {factor:?}, off {off:e}");
            assert!(factor.value <= 0.199_824_895_7);
        }
    }
}

fn polygons(list: &Value) -> Option<Vec<Facet>> {
    let polygon = |p: &Value| {
        let corners: Vec<[f64; 3]> = serde_json::from_value(p["vertices"].clone()).ok()?;
        (p["type"] == "polygon").then(|| facet(&corners))
    };
    list.as_array()?.iter().map(polygon).collect()
}

/// Every planar reference with blockers, decade by decade: the stated error holds the true one and meets the asked one.
#[test]
fn catalogue_18_references_with_blockers() {
    let data: Value = serde_json::from_str(include_str!("../data/view_factors_occluded.json")).unwrap();
    let mut cases = 0;
    for case in data["cases"].as_array().unwrap() {
        let (Some(surfaces), Some(blockers)) = (polygons(&case["surfaces"]), polygons(&case["blockers"])) else {
            continue;
        };
        cases += 1;
        let mut enclosure = Enclosure { obstructions: blockers, ..Enclosure::default() };
        surfaces.into_iter().for_each(|s| enclosure.add("", s));
        let (id, truth) = (case["id"].as_str().unwrap(), case["value"].as_f64().unwrap());
        for accuracy in [1e-3, 1e-4, 1e-5, 1e-6] {
            let factor = solve(&enclosure, accuracy).factor(0, 1);
            let off = (factor.value - truth).abs();
            assert!(off <= factor.error + 1e-9, "{id} at {accuracy:e}: off by {off:e}, {factor:?}");
            assert!(factor.error <= 1.01 * accuracy, "{id} at {accuracy:e}: {factor:?}");
        }
    }
    assert_eq!(cases, 8);
}

/// Unoccluded references to 1e-8, by the default.
#[test]
fn catalogue_21_references_without_blockers() {
    let data: Value = serde_json::from_str(include_str!("../data/view_factors.json")).unwrap();
    let mut cases = 0;
    for case in data["cases"].as_array().unwrap() {
        let Some(surfaces) = polygons(&case["surfaces"]).filter(|s| s.len() == 2) else { continue };
        cases += 1;
        let mut enclosure = Enclosure::default();
        surfaces.into_iter().for_each(|s| enclosure.add("", s));
        let factor = solve(&enclosure, 1e-5).factor(0, 1);
        let off = (factor.value - case["value"].as_f64().unwrap()).abs();
        assert!(off < 1e-8, "{}: off by {off:e}", case["id"]);
    }
    assert!(cases >= 15, "{cases}");
}

/// Catalogue 8: A_i F_ij = A_j F_ji bit for bit in what is stored, and within rounding in what is handed out.
#[test]
fn catalogue_8_reciprocity_by_storage() {
    let factors = solve(&obstructed_room(3), 1e-4);
    let dense = factors.dense();
    let n = factors.len();
    for i in 0..n {
        for j in 0..n {
            let (a, b) = (factors.areas()[i] * dense[i * n + j], factors.areas()[j] * dense[j * n + i]);
            assert!((a - b).abs() <= 1e-15 * a.abs(), "{i} {j}: {a} {b}");
        }
    }
    let (starts, columns, values, _) = factors.csr();
    for i in 0..n {
        let row = starts[i]..starts[i + 1];
        assert!(columns[row.clone()].is_sorted());
        for k in row {
            assert_eq!(values[k], dense[i * n + columns[k] as usize]);
        }
    }
}

/// The repair closes rows by moving uncertain entries, and leaves the others as they are.
#[test]
fn the_repair_moves_what_is_uncertain() {
    let room = obstructed_room(4);
    let raw = solve(&room, 1e-4);
    let mut closed = raw.clone();
    let repair = closed.repair();
    assert!(repair.before.rms > 1e-6 && repair.after.largest < 1e-12, "{repair:?}");
    for i in 0..raw.len() {
        for j in 0..raw.len() {
            let (before, after) = (raw.factor(i, j), closed.factor(i, j));
            let moved = (after.value - before.value).abs();
            assert!(moved <= 2.0 * before.error + 1e-15, "{i} {j}: {before:?} {after:?}");
        }
    }
}

/// Floor under a turned block that stands on it, up to the corner of the block, sees nothing of what is outside: walls
/// of triangles, as a mesh has them, hide it together.
#[test]
fn floor_under_a_block_is_hidden() {
    let corners = [[0.265, 0.296], [0.423, 0.247], [0.472, 0.406], [0.314, 0.456]];
    let mut scene = Enclosure::default();
    scene.add("covered", facet(&[[0.27725, 0., 0.336], [0.31675, 0., 0.3235], [0.265, 0., 0.296]]));
    scene.add("outside", facet(&[[0.24, 0.04125, 0.272], [0.24, 0.0825, 0.272], [0.2005, 0.0825, 0.26025]]));
    let n = 8;
    for k in 0..4 {
        let ([ax, az], [bx, bz]) = (corners[k], corners[(k + 1) % 4]);
        for turned in [false, true] {
            let point = |i: i32, j: i32| {
                let (u, v) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                let (s, t) = if turned { (u + v, v) } else { (u, u + v) };
                [ax + s * (bx - ax), 0.33 * t, az + s * (bz - az)]
            };
            for i in 0..n {
                for j in 0..n - i {
                    scene.obstructions.push(facet(&[point(i, j), point(i + 1, j), point(i, j + 1)]));
                    if i + j + 1 < n {
                        let last = [point(i + 1, j + 1), point(i, j + 1), point(i + 1, j)];
                        scene.obstructions.push(facet(&last));
                    }
                }
            }
        }
    }
    let factor = solve(&scene, 1e-5).factor(0, 1);
    assert!(factor.value <= factor.error && factor.error <= 1e-5, "{factor:?}");
}

/// A screen whose shadow lies between the places that are looked at first: found, and stated as an error where it is
/// not.
#[test]
fn a_small_shadow_is_not_overlooked() {
    let mut scene = Enclosure::default();
    scene.add("wall", facet(&[[0.314, 0., 0.456], [0.265, 0.33, 0.296], [0.265, 0., 0.296]]));
    scene.add("floor", facet(&[[0.5528, 0., 0.], [0., 0., 0.], [0., 0., 0.5592]]));
    scene.obstructions.push(facet(&[[0.13, 0.165, 0.065], [0.24, 0.165, 0.272], [0.29, 0.165, 0.114]]));
    let best = solve(&scene, 1e-7).factor(0, 1);
    assert!((best.value - 0.115_762_4).abs() < 1e-6, "{best:?}");
    for accuracy in [1e-2, 1e-3, 1e-4, 1e-5] {
        let found = solve(&scene, accuracy).factor(0, 1);
        assert!((found.value - best.value).abs() <= found.error + 1e-7, "{accuracy:e}: {found:?}, {best:?}");
    }
}

/// Six sheets that stand at random and go through one another, active on both sides.
fn random_sheets(random: &mut Random) -> Enclosure {
    let mut scene = Enclosure::default();
    for k in 0..6 {
        let mut vector = |size: f64| DVec3::from_array(std::array::from_fn(|_| size * random.next_unit()));
        let centre = vector(1.0);
        let size = 0.1 + 0.7 * vector(1.0).x.powi(2);
        let [mut u, mut v] = [(); 2].map(|()| vector(2.0 * size) - DVec3::splat(size));
        if k % 2 == 0 {
            (u[k / 2], v[k / 2]) = (0.0, 0.0);
        }
        let sheet = Facet::new(vec![centre - u - v, centre + u - v, centre + u + v, centre - u + v]).unwrap();
        scene.add("front", sheet.clone());
        scene.add("back", sheet.flipped());
    }
    scene
}

/// How far partly hidden pairs are off, in their stated errors, ascending: by factors a fiftieth as far off.
fn off_by_stated(scene: &Enclosure, accuracy: f64) -> Vec<f64> {
    let [found, truth] = [accuracy, 0.02 * accuracy].map(|accuracy| solve(scene, accuracy));
    let partly = found.entries().filter(|(.., error)| *error > 1e-9);
    let off = |(i, j, value, error): (usize, usize, f64, f64)| {
        let truth = truth.factor(i, j);
        ((value - truth.value * found.areas()[i]).abs() - truth.error * found.areas()[i]).max(0.0) / error
    };
    partly.map(off).collect()
}

/// Sheets that stand at random and go through one another: what is stated as the error holds what is, but for one in
/// a hundred, and those are not far off.
#[test]
fn stated_errors_hold_among_random_sheets() {
    let mut random = Random::new(11);
    let mut off: Vec<f64> = (0..12).flat_map(|_| off_by_stated(&random_sheets(&mut random), 1e-3)).collect();
    off.sort_by(f64::total_cmp);
    let [at_99, most] = [off[off.len() * 99 / 100], off[off.len() - 1]];
    assert!(off.len() > 150 && at_99 <= 1.0 && most < 3.0, "{} pairs: {at_99}, {most}", off.len());
}

/// A sheet that reaches a little through a facet: places at its foot see from before it, not along it, and find that it hides
/// something.
#[test]
fn what_stands_on_a_facet_hides_from_its_foot() {
    let x = 0.832;
    let mut scene = Enclosure::default();
    scene.add("small", facet(&[[x, 0.128, 0.502], [x, 0.040, 0.523], [x, 0.260, 0.701], [x, 0.348, 0.680]]));
    scene.add(
        "large",
        facet(&[[-0.877, -0.672, 0.513], [0.136, 0.420, -0.289], [1.473, 0.909, 0.909], [0.460, -0.183, 1.711]]),
    );
    let z = 0.6755;
    scene.obstructions.push(facet(&[[0.688, 1.004, z], [0.843, 0.212, z], [1.282, -0.185, z], [1.127, 0.607, z]]));
    let best = solve(&scene, 1e-6).factor(0, 1);
    assert!(best.value > 0.1 && best.error <= 1e-5, "{best:?}");
    for accuracy in [1e-2, 1e-3, 1e-4, 1e-5] {
        let found = solve(&scene, accuracy).factor(0, 1);
        let off = (found.value - best.value).abs();
        assert!(off <= found.error + best.error, "{accuracy:e}: off by {off:e}, {found:?}, {best:?}");
    }
}

/// A room of 5 × 4 × 3 m with a table, two stools, a cupboard and a lamp, some of them turned.
fn furnished_room() -> Enclosure {
    let mut room = Enclosure { is_closed: true, ..Enclosure::default() };
    add_box(&mut room, [0.0; 3], [5.0, 4.0, 3.0], 6, true);
    add_turned_box(&mut room, [1.5, 1.2, 0.7], [1.6, 0.9, 0.05], 0.2, 2);
    for [x, y] in [[1.6, 1.2], [2.9, 1.45], [1.5, 1.85], [2.8, 2.1]] {
        add_turned_box(&mut room, [x, y, 0.001], [0.06, 0.06, 0.69], 0.2, 1);
    }
    add_turned_box(&mut room, [1.1, 2.5, 0.1], [0.4, 0.4, 0.35], 0.7, 2);
    add_turned_box(&mut room, [3.4, 0.8, 0.1], [0.4, 0.4, 0.35], -0.4, 2);
    add_turned_box(&mut room, [4.2, 1.0, 0.1], [0.6, 2.0, 1.8], 0.0, 3);
    add_turned_box(&mut room, [2.2, 1.5, 2.2], [0.3, 0.3, 0.3], 0.5, 1);
    room
}

/// The same of a hundred scenes of sheets, and of a furnished room; prints how many are off by more than stated.
#[test]
#[ignore = "minutes of processor time in a release build"]
#[expect(clippy::print_stdout, reason = "the counts are what one runs this for")]
fn stated_errors_hold_in_many_scenes() {
    let mut random = Random::new(11);
    let sheets: Vec<Enclosure> = (0..100).map(|_| random_sheets(&mut random)).collect();
    let room = [furnished_room()];
    for (name, scenes, accuracies, least) in
        [("random sheets", &sheets[..], [1e-2, 1e-3], 2000), ("a furnished room", &room[..], [1e-3, 1e-4], 13_000)]
    {
        for accuracy in accuracies {
            let off: Vec<f64> = scenes.iter().flat_map(|scene| off_by_stated(scene, accuracy)).collect();
            let missed = off.iter().filter(|off| **off > 1.0).count();
            let tenfold = off.iter().filter(|off| **off < 0.1).count();
            let most = off.iter().copied().fold(0.0, f64::max);
            println!(
                "{name}, {accuracy:e} asked: {missed} of {} off by more than stated, at most {most:.1} times; {tenfold} by \
                 less than a tenth",
                off.len()
            );
            assert!(off.len() > least && 100 * missed <= off.len() && most < 4.0);
        }
    }
}

/// What is asked of surfaces holds for them, though they have several facets that take part.
#[test]
fn surfaces_of_facets_are_as_exact_as_asked() {
    let mut scene = obstructed_room(2);
    scene.surfaces.clear();
    for surface in &mut scene.surface_of {
        *surface /= 4;
    }
    scene.surfaces.resize(9, radiosity_scene::EnclosureSurface::default());
    assert_eq!(scene.surface_of.len(), 24 + 12);
    for accuracy in [1e-3, 1e-4] {
        let factors = solve(&scene, accuracy).by_surface(&scene);
        let areas = scene.surface_areas();
        for i in 0..9 {
            for j in 0..9 {
                let error = factors.factor(i, j).error * areas[i] / areas[i].min(areas[j]);
                assert!(error <= accuracy, "{i} {j}: {error}");
            }
        }
    }
}

/// Errors of surfaces add up in squares for the most part: what is stated holds what is, for few facets a surface and for many.
#[test]
fn errors_of_surfaces_of_facets_hold() {
    for facets in [2, 4, 12, 36] {
        let mut scene = obstructed_room(4);
        scene.surface_of.iter_mut().for_each(|surface| *surface /= facets);
        scene.surfaces.truncate(scene.facets.len().div_ceil(facets as usize));
        for accuracy in [1e-2, 1e-3] {
            let [found, truth] = [accuracy, 0.02 * accuracy].map(|asked| solve(&scene, asked).by_surface(&scene));
            for (i, j, value, error) in found.entries() {
                let (truth, area) = (truth.factor(i, j), found.areas()[i]);
                let off = (value - truth.value * area).abs() - truth.error * area;
                assert!(off <= error + 1e-12, "{facets} a surface, {accuracy}: {i} {j} off by {off}, stated {error}");
            }
        }
    }
}

/// A wall between two rooms has a side in each: neither is hidden by the wall itself, and no light gets through.
#[test]
fn rooms_on_either_side_of_a_wall_are_closed() {
    for n in [1, 2, 3] {
        let mut rooms = Enclosure::default();
        add_box(&mut rooms, [0.0; 3], [1.0; 3], n, true);
        let of_first = rooms.facets.len();
        add_box(&mut rooms, [1.0, 0.0, 0.0], [2.0, 1.0, 1.0], n, true);
        rooms.obstructions.push(facet(&[[0.3, 0.4, 0.9], [0.3, 0.6, 0.9], [0.5, 0.6, 0.9], [0.5, 0.4, 0.9]]));
        let factors = solve(&rooms, 1e-5);
        let sums = factors.row_sums();
        let facing = |i: usize| rooms.facets[i].normal().x < -0.5;
        for (i, sum) in sums.into_iter().enumerate() {
            let least = if facing(i) && i < of_first { 0.9 } else { 0.5 };
            let holds = if i < of_first { sum > least && sum < 1.0 + 1e-4 } else { (sum - 1.0).abs() < 1e-6 };
            assert!(holds, "{n}: {i} {sum}");
            for j in 0..rooms.facets.len() {
                let across = factors.factor(i, j);
                assert!((i < of_first) == (j < of_first) || across.value <= 1e-9, "{n}: {i} {j} {across:?}");
            }
        }
    }
}

/// Many staggered plates between two squares: what they leave is found without going through all ways in which they
/// overlap.
#[test]
fn many_plates_that_overlap_are_one_shadow() {
    let plate = |x: f64, z: f64| facet(&[[x, -0.1, z], [x + 0.3, -0.1, z], [x + 0.3, 0.7, z], [x, 0.7, z]]);
    let squares = |plates: Vec<Facet>| {
        let mut scene = Enclosure::default();
        scene.add("floor", facet(&[[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]));
        scene.add("ceiling", facet(&[[0., 0., 1.], [0., 1., 1.], [1., 1., 1.], [1., 0., 1.]]));
        scene.obstructions = plates;
        solve(&scene, 1e-3).factor(0, 1)
    };
    // Thirty plates close to one height stand for the one that they make up, but for their thickness.
    let many = squares((0..30).map(|k| plate(-0.05 + 0.025 * f64::from(k), 0.5 + 1e-5 * f64::from(k))).collect());
    let one = squares(vec![facet(&[[-0.05, -0.1, 0.5], [0.975, -0.1, 0.5], [0.975, 0.7, 0.5], [-0.05, 0.7, 0.5]])]);
    assert!(one.value > 0.02 && (many.value - one.value).abs() <= many.error + one.error + 1e-4, "{many:?}, {one:?}");
}

/// A disc of a hundred corners hides what one of forty-eight does, but for its rim.
#[test]
fn round_tables_hide_as_what_they_are() {
    let hidden = |corners: usize| {
        let mut scene = Enclosure::default();
        scene.add("floor", facet(&[[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]));
        scene.add("ceiling", facet(&[[0., 0., 1.], [0., 1., 1.], [1., 1., 1.], [1., 0., 1.]]));
        let open = solve(&scene, 1e-6).factor(0, 1).value;
        let corner = |k: usize| {
            let angle = std::f64::consts::TAU * k as f64 / corners as f64;
            [0.5 + 0.3 * angle.cos(), 0.5 + 0.3 * angle.sin(), 0.5]
        };
        scene.obstructions.push(facet(&(0..corners).map(corner).collect::<Vec<_>>()));
        open - solve(&scene, 1e-5).factor(0, 1).value
    };
    let (fine, coarse) = (hidden(100), hidden(48));
    assert!(coarse > 0.05 && (fine / coarse - 1.0).abs() < 5e-3, "{fine}, {coarse}");
}

/// Slats whose planes cut a floor into more pieces than it is cut into: none loses its shadow.
#[test]
fn more_planes_than_pieces_lose_no_shadow() {
    let slat = |at: f64, axis: usize| {
        let point = |along: f64, z: f64| if axis == 0 { [at, along, z] } else { [along, at, z] };
        facet(&[point(0.1, 0.45), point(0.9, 0.45), point(0.9, 0.55), point(0.1, 0.55)])
    };
    let square = |z: f64, low: [f64; 2], size: f64| {
        let [x, y] = low;
        [[x, y, z], [x + size, y, z], [x + size, y + size, z], [x, y + size, z]]
    };
    let slats: Vec<Facet> = (0..20).map(|k| slat(0.07 + 0.09 * f64::from(k / 2), k as usize % 2)).collect();
    let factor = |n: usize| {
        let mut scene = Enclosure::default();
        let mut ceiling = square(1.0, [0.0; 2], 1.0);
        ceiling.reverse();
        scene.add("ceiling", facet(&ceiling));
        for k in 0..n * n {
            let low = [k % n, k / n].map(|i| i as f64 / n as f64);
            scene.add("floor", facet(&square(0.0, low, 1.0 / n as f64)));
        }
        scene.obstructions = slats.clone();
        let factors = solve(&scene, 2e-3);
        (1..scene.facets.len()).map(|i| factors.factor(0, i)).fold((0.0, 0.0), |(v, e), f| (v + f.value, e + f.error))
    };
    let (whole, parts) = (factor(1), factor(3));
    assert!((whole.0 - parts.0).abs() <= whole.1 + parts.1 && whole.1 < 4e-3, "{whole:?}, {parts:?}");
}

/// Where a wall is missing, what is known stays and the gap is told.
#[test]
fn the_repair_does_not_close_a_gap() {
    let mut open = obstructed_room(3);
    open.facets.truncate(9 * 5);
    open.surface_of.truncate(9 * 5);
    let raw = solve(&open, 1e-4);
    let mut repaired = raw.clone();
    let repair = repaired.repair();
    assert!(repair.after.largest > 0.1 && repair.largest_change < 1e-3, "{repair:?}");
}

/// The same bytes on any number of threads.
#[test]
fn threads_do_not_matter() {
    let room = obstructed_room(4);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| solve(&room, 1e-4).dense())
    };
    assert_eq!(on(1), on(3));
}

/// A room shaped like an L whose floor and ceiling are concave polygons.
#[test]
fn concave_facets_take_part() {
    let outline = [[0., 0.], [2., 0.], [2., 1.], [1., 1.], [1., 3.], [0., 3.]];
    let mut room = Enclosure::default();
    let at = |z: f64| outline.map(|[x, y]| [x, y, z]);
    let mut ceiling = at(1.0);
    ceiling.reverse();
    room.add("floor", facet(&at(0.0)));
    room.add("ceiling", facet(&ceiling));
    for i in 0..6 {
        let ([ax, ay], [bx, by]) = (outline[i], outline[(i + 1) % 6]);
        room.add("wall", facet(&[[bx, by, 0.], [ax, ay, 0.], [ax, ay, 1.], [bx, by, 1.]]));
    }
    let factors = solve(&room, 1e-6);
    assert!(factors.closure().largest < 1e-5, "{:?}", factors.closure());
}
