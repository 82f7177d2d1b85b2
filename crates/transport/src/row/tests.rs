//! All row methods on the same rooms: against closed forms, against each other, and their laws.

use super::*;
use glam::DVec3;
use radiosity_scene::Facet;
use std::f64::consts::PI;

#[path = "../../tests/rooms/mod.rs"]
mod rooms;
use rooms::{add_cut, rectangle};
pub(crate) use rooms::{box_of, room_with_block};

/// Faces of a unit cube (catalogue 20).
pub(super) const OPPOSITE: f64 = 0.199_824_895_7;
pub(super) const ADJACENT: f64 = 0.200_043_776_1;

/// F from a point to a parallel rectangle whose corner is above it, a × b at height c (Lambert; Howell C-11). Signs of a
/// and b carry over.
pub(super) fn point_to_rectangle(a: f64, b: f64, c: f64) -> f64 {
    let (p, q) = (a.hypot(c), b.hypot(c));
    (a / p * (b / p).atan() + b / q * (a / q).atan()) / (2.0 * PI)
}

/// F between equal rectangles a × b face to face at distance c (Howell C-11).
fn face_to_face(a: f64, b: f64, c: f64) -> f64 {
    let (x, y) = (a / c, b / c);
    let (p, q) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
    let logarithm = (p * p * q * q / (1.0 + x * x + y * y)).sqrt().ln();
    2.0 / (PI * x * y) * (logarithm + x * q * (x / q).atan() + y * p * (y / p).atan() - x * x.atan() - y * y.atan())
}

/// An L of two rooms, floor and ceiling concave.
pub(super) fn l_shaped_room() -> Enclosure {
    let outline = [[0., 0.], [3., 0.], [3., 1.], [1., 1.], [1., 2.], [0., 2.]].map(|[x, y]| DVec3::new(x, y, 0.0));
    let mut room = Enclosure { is_closed: true, ..Enclosure::default() };
    let floor = Facet::new(outline.to_vec()).unwrap();
    let ceiling = Facet::new(outline.map(|c| c + DVec3::Z).to_vec()).unwrap();
    room.add("floor", floor.clone());
    room.add("ceiling", ceiling.flipped());
    for [a, b] in floor.edges() {
        add_cut(&mut room, 2, [a, DVec3::Z, b - a]);
    }
    room
}

/// Share of pairs of entries that agree within the sum of their stated errors, times `scale`.
fn agreement(a: &RowMatrix, b: &RowMatrix, scale: f64) -> f64 {
    let entries = || a.factors.iter().zip(&b.factors).zip(a.errors.iter().zip(&b.errors));
    let agree = entries().filter(|((x, y), (e, f))| (*x - *y).abs() <= scale * (*e + *f) + 1e-12).count();
    agree as f64 / a.factors.len() as f64
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn is_plane(method: RowMethod) -> bool {
    matches!(method, RowMethod::SinglePlane | RowMethod::SinglePlaneAdaptive)
}

/// Cells of the single plane are as wide at its rim as in the middle: it gets four times as many each way.
fn made(method: RowMethod, look: Look) -> Box<dyn Row> {
    let finer = if is_plane(method) { 4 } else { 1 };
    method.with(Look { resolution: finer * look.resolution, ..look })
}

fn all_methods(room: &Enclosure, look: Look) -> Vec<(RowMethod, RowMatrix)> {
    RowMethod::all().map(|method| (method, made(method, look).rows(room, &()).unwrap())).collect()
}

/// Each pair of methods, on a room: nearly all entries within the errors, all within twice those, and errors that say
/// something.
fn all_agree(room: &Enclosure, look: Look) {
    let found = all_methods(room, look);
    for (i, (a, rows)) in found.iter().enumerate() {
        for (b, others) in &found[..i] {
            let [close, near] = [1.0, 2.0].map(|scale| agreement(rows, others, scale));
            assert!(close >= 0.99 && near >= 0.998, "{a} and {b}: {close} {near}");
        }
        let typical = mean(&rows.errors) / mean(&rows.factors);
        assert!(typical < 0.6, "{a}: errors of {typical} of a factor");
    }
}

#[test]
fn catalogue_91_all_surfaces_agree_in_a_cube() {
    all_agree(&box_of(DVec3::ONE, 4), Look { resolution: 64, ..Look::default() });
}

#[test]
fn catalogue_91_all_surfaces_agree_around_a_block() {
    all_agree(&room_with_block(2), Look { resolution: 64, points: 2, ..Look::default() });
}

#[test]
fn catalogue_91_all_surfaces_agree_around_a_corner() {
    all_agree(&l_shaped_room(), Look { resolution: 64, points: 2, ..Look::default() });
}

/// Predictions against the truth: a fine reference by rays, with obstacles in between, for all methods and numbers of
/// eye points.
#[test]
fn predicted_errors_cover_the_true_ones() {
    let room = room_with_block(2);
    let reference = Hemisphere { rays: 1 << 16, seed: 7, ..Hemisphere::default() }.rows(&room, &()).unwrap();
    for points in [1, 2, 4] {
        for method in RowMethod::all() {
            let found =
                made(method, Look { resolution: 48, points, spin: (points > 1).then_some(1), ..Look::default() })
                    .rows(&room, &())
                    .unwrap();
            let off: Vec<f64> = found.factors.iter().zip(&reference.factors).map(|(a, b)| (a - b).abs()).collect();
            let doubt = found.errors.iter().zip(&reference.errors);
            let covered =
                off.iter().zip(doubt).filter(|(off, (e, r))| **off <= *e + *r).count() as f64 / off.len() as f64;
            let ratio = mean(&found.errors) / mean(&off);
            assert!(covered >= 0.95, "{method}, {points}: {covered}");
            assert!(ratio < 12.0, "{method}, {points}: predicted {ratio} times what it is");
        }
    }
}

/// Parallel and close: large; perpendicular: small; and from a large to a small facet by the ratio of areas less than
/// back.
#[test]
fn catalogue_20_intuition_holds() {
    let close = |c: f64| {
        let mut pair = Enclosure::default();
        pair.add("below", rectangle(DVec3::ZERO, DVec3::X, DVec3::Y));
        pair.add("above", rectangle(DVec3::Z * c, DVec3::Y, DVec3::X));
        pair
    };
    let until = |tolerance: f64| Look { resolution: 64, repair: Repair::UntilError(tolerance), ..Look::default() };
    for method in RowMethod::all().filter(|m| !is_plane(*m)) {
        let row = method.with(until(4e-3)).row(0, &box_of(DVec3::ONE, 1));
        assert!((row.factors[1].value - OPPOSITE).abs() < 4e-3, "{method}: {row:?}");
        assert!((row.factors[4].value - ADJACENT).abs() < 4e-3, "{method}: {row:?}");
        let sum: f64 = row.factors.iter().map(|f| f.value).sum();
        assert!((sum - 1.0).abs() < 1e-2, "{method}: {sum}");
        for c in [0.5, 2.0] {
            let row = method.with(until(4e-3)).row(0, &close(c));
            assert!((row.factors[1].value - face_to_face(1.0, 1.0, c)).abs() < 4e-3, "{method}, {c}: {row:?}");
        }
        let mut unequal = Enclosure::default();
        unequal.add("large", rectangle(DVec3::ZERO, 10.0 * DVec3::X, 10.0 * DVec3::Y));
        unequal.add("small", rectangle(DVec3::new(4.5, 4.5, 5.0), DVec3::Y, DVec3::X));
        let rows = method.with(until(4e-3)).rows(&unequal, &()).unwrap();
        assert!((rows.row(0)[1] - rows.row(1)[0] / 100.0).abs() < 4e-3 + 4e-5, "{method}: {rows:?}");
        assert!(rows.row(1)[0] > 0.3 && rows.row(0)[1] < 0.01, "{method}: {rows:?}");
    }
}

/// Obstructed factors never exceed unobstructed ones, and a facet's own back and plane hide nothing.
#[test]
fn catalogue_18_what_stands_between_only_takes_away() {
    let mut pair = Enclosure::default();
    pair.add("below", rectangle(DVec3::ZERO, DVec3::X, DVec3::Y));
    pair.add("above", rectangle(DVec3::Z, DVec3::Y, DVec3::X));
    // In the plane of the first, on both of its sides: a sill that touches, and a copy.
    pair.obstructions.push(rectangle(DVec3::X, DVec3::X, DVec3::Y));
    pair.obstructions.push(rectangle(DVec3::ZERO, DVec3::Y, DVec3::X));
    let mut blocked = pair.clone();
    blocked.obstructions.push(rectangle(DVec3::new(0.25, 0.25, 0.5), DVec3::X * 0.5, DVec3::Y * 0.5));
    for method in RowMethod::all() {
        let look = Look { resolution: 128, points: 8, ..Look::default() };
        let [free, less] = [&pair, &blocked].map(|e| made(method, look).row(0, e));
        assert!((free.factors[1].value - OPPOSITE).abs() <= free.factors[1].error, "{method}: {free:?}");
        assert!((less.factors[1].value - 0.099_506_294_5).abs() <= less.factors[1].error, "{method}: {less:?}");
        assert!(less.factors[1].error < 0.02, "{method}: {less:?}");
        assert!((less.lost + less.factors[1].value - less.captured).abs() < 1e-4, "{method}: {less:?}");
    }
}

/// Rows are the same one by one and all at once, and with any number of threads; a stop is heard.
#[test]
fn rows_do_not_depend_on_threads() {
    struct AtMost(usize);
    impl Progress for AtMost {
        fn step(&self, done: usize, _total: usize) -> bool {
            done < self.0
        }
    }
    let room = room_with_block(2);
    let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
    for method in RowMethod::all() {
        let row = method.with(Look { resolution: 16, spin: Some(5), ..Look::default() });
        let [one, four] = [1, 4].map(|n| pool(n).install(|| row.rows(&room, &()).unwrap()));
        assert_eq!(one, four, "{method}");
        let single: Vec<f64> = row.row(7, &room).factors.iter().map(|f| f.value).collect();
        assert_eq!(single, four.row(7), "{method}");
        assert_eq!(row.rows(&room, &AtMost(3)), Err(Stopped), "{method}");
        assert!(row.rows(&Enclosure::default(), &()).unwrap().is_empty());
    }
}
