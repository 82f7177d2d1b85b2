//! What stands in the room besides the kit's furniture: rug, bookcase, pouf, plant, pictures, things on the table.

use super::paint::Paint;
use super::solid::{Solid, cuboid, frame, lathe, rod, sphere, sweep};
use super::{Piece, SUNK, sharp, smooth};
use crate::hash::Random;
use glam::{DAffine3, DVec2, DVec3, dvec3};
use std::f64::consts::{PI, TAU};

/// The rug on the floor: [x0, z0, x1, z1].
const RUG: [f64; 4] = [-1.85, -0.62, 1.25, 1.50];

/// Pictures on the accent wall, without their frames: [x0, y0, x1, y1].
pub const HILLS: [f64; 4] = [-1.20, 1.24, -0.20, 2.04];
pub const DISCS: [f64; 4] = [0.06, 1.34, 0.54, 1.94];

/// The accent wall's plane.
const WALL_Z: f64 = 2.25;

/// Top of the kit's table where it stands.
const TABLE: f64 = 0.41 - SUNK;

/// Where a point lies in the picture of the rug.
pub fn on_rug(p: DVec3) -> DVec2 {
    DVec2::new((p.x - RUG[0]) / (RUG[2] - RUG[0]), (p.z - RUG[1]) / (RUG[3] - RUG[1]))
}

/// Where a point lies in a picture on the accent wall; seen from the room, +X is to the left.
pub fn on_canvas([x0, y0, x1, y1]: [f64; 4], p: DVec3) -> DVec2 {
    DVec2::new((x1 - p.x) / (x1 - x0), (y1 - p.y) / (y1 - y0))
}

pub fn pieces() -> Vec<Piece> {
    let [x0, z0, x1, z1] = RUG;
    let mut pieces = vec![sharp("rug", Paint::Rug, cuboid([x0, -0.5 * SUNK, z0], [x1, 0.012, z1]))];
    pieces.extend(wall_pictures());
    pieces.extend(bookcase());
    pieces.extend(plant());
    pieces.extend(on_table());
    pieces.extend(sideboard());
    let pouf = [
        [0.0, -SUNK],
        [0.25, -SUNK],
        [0.28, 0.03],
        [0.30, 0.10],
        [0.305, 0.19],
        [0.30, 0.28],
        [0.28, 0.34],
        [0.24, 0.37],
        [0.16, 0.385],
        [0.0, 0.39],
    ];
    pieces.push(smooth("pouf", Paint::Rust, at(lathe(&pouf, 48), [-0.86, 0.0, -0.92])));
    pieces
}

fn at(solid: Solid, place: [f64; 3]) -> Solid {
    solid.moved(DAffine3::from_translation(DVec3::from_array(place)))
}

fn wall_pictures() -> Vec<Piece> {
    let mut pieces = Vec::new();
    for (name, paint, canvas, rail) in
        [("picture of hills", Paint::Hills, HILLS, Paint::Oak), ("picture of discs", Paint::Discs, DISCS, Paint::Black)]
    {
        let [x0, y0, x1, y1] = canvas;
        let bar = 0.03;
        let around = [x0 - bar, y0 - bar, x1 + bar, y1 + bar];
        let back = WALL_Z + SUNK;
        // The canvas reaches behind the rail, so that its edge is hidden.
        let canvas = cuboid([x0 - 0.01, y0 - 0.01, WALL_Z - 0.012], [x1 + 0.01, y1 + 0.01, back - 0.001]);
        pieces.push(sharp(name, paint, canvas));
        pieces.push(sharp("picture frame", rail, frame(around, [x0, y0, x1, y1], [WALL_Z - 0.028, back])));
    }
    pieces
}

/// A tall bookcase against the accent wall, with books and a vase.
fn bookcase() -> Vec<Piece> {
    let (x0, x1, z0, z1, top, board) = (1.32, 2.22, 1.95, WALL_Z + SUNK, 1.92, 0.025);
    let mut case = Solid::default();
    for x in [x0, x1 - board] {
        case = case.and(cuboid([x, -SUNK, z0], [x + board, top, z1]));
    }
    let back = cuboid([x0 + 0.01, 0.06, z1 - 0.02], [x1 - 0.01, top - 0.02, z1 - 0.001]);
    case = case.and(back);
    let shelves: Vec<f64> = (0..6).map(|i| 0.07 + 0.362 * f64::from(i)).collect();
    for &y in &shelves {
        case = case.and(cuboid([x0 + 0.008, y, z0 + 0.004], [x1 - 0.008, y + board, z1 - 0.012]));
    }
    let colors = [Paint::Rust, Paint::Navy, Paint::Ceramic, Paint::Mustard, Paint::Sage];
    let mut books: [Solid; 5] = Default::default();
    let mut random = Random::new(4);
    for (shelf, &y) in shelves[..5].iter().enumerate() {
        // Books from the left, with a gap wherever something else stands.
        let (mut x, end) = (x0 + board + 0.012, x1 - board - [0.30, 0.05, 0.36, 0.02, 0.26][shelf]);
        loop {
            let (thick, height, deep) =
                (random.range(0.018, 0.045), random.range(0.20, 0.30), random.range(0.15, 0.21));
            if x + thick > end {
                break;
            }
            let book = cuboid([x, y + board - 0.002, z0 + 0.03], [x + thick, y + board + height, z0 + 0.03 + deep]);
            let color = &mut books[(random.bits() % 5) as usize];
            *color = std::mem::take(color).and(book);
            x += thick + 0.0015;
        }
    }
    let vase = [
        [0.0, -0.002],
        [0.045, -0.002],
        [0.07, 0.04],
        [0.078, 0.09],
        [0.06, 0.15],
        [0.03, 0.19],
        [0.032, 0.215],
        [0.024, 0.215],
        [0.022, 0.19],
        [0.0, 0.17],
    ];
    let jar = [[0.0, -0.002], [0.07, -0.002], [0.085, 0.02], [0.085, 0.13], [0.07, 0.15], [0.0, 0.155]];
    let mut pieces = vec![sharp("bookcase", Paint::Oak, case)];
    pieces.extend(colors.into_iter().zip(books).map(|(paint, books)| sharp("books", paint, books)));
    let middle = (z0 + z1) / 2.0;
    let vases = at(lathe(&vase, 40), [2.03, shelves[2] + board, middle])
        .and(at(lathe(&vase, 40), [2.05, shelves[5] + board, middle]));
    pieces.push(smooth("vases", Paint::Ceramic, vases));
    let jars = at(lathe(&jar, 40), [2.06, shelves[4] + board, middle])
        .and(at(lathe(&jar, 40), [2.05, shelves[0] + board, middle]));
    pieces.push(smooth("jars", Paint::Mustard, jars));
    pieces
}

/// A low sideboard against the end wall at +X, with a vase and a few books.
fn sideboard() -> Vec<Piece> {
    let (front, back, z0, z1) = (2.58, 3.0 + SUNK, -0.55, 1.15);
    let body = cuboid([front, 0.18, z0], [back, 0.68, z1]);
    let third = (z1 - z0) / 3.0;
    let doors = Solid::all((0..3).map(|i| {
        let z = z0 + third * f64::from(i);
        cuboid([front - 0.018, 0.20, z + 0.012], [front + SUNK, 0.66, z + third - 0.012])
    }));
    let knobs = Solid::all((0..3).map(|i| {
        let z = z0 + third * (f64::from(i) + 0.88);
        rod(dvec3(front - 0.016, 0.46, z), dvec3(front - 0.040, 0.46, z), 0.012, 16)
    }));
    let legs = [[front + 0.05, z0 + 0.08], [front + 0.05, z1 - 0.08], [2.93, z0 + 0.08], [2.93, z1 - 0.08]]
        .map(|[x, z]| rod(dvec3(x, -SUNK, z), dvec3(x, 0.19, z), 0.018, 16));
    let vase = [
        [0.0, -0.002],
        [0.06, -0.002],
        [0.10, 0.06],
        [0.115, 0.13],
        [0.10, 0.21],
        [0.05, 0.29],
        [0.04, 0.34],
        [0.05, 0.37],
        [0.042, 0.37],
        [0.032, 0.34],
        [0.035, 0.29],
        [0.0, 0.27],
    ];
    let mut pieces = Vec::new();
    let mut y = 0.68;
    for (paint, turn, thick) in [(Paint::Rust, 0.10, 0.035), (Paint::Ceramic, -0.06, 0.025), (Paint::Navy, 0.22, 0.030)]
    {
        let lying = cuboid([-0.10, -0.001, -0.14], [0.10, thick, 0.14]).moved(DAffine3::from_rotation_y(turn));
        pieces.push(sharp("books", paint, at(lying, [2.80, y, -0.20])));
        y += thick;
    }
    pieces.extend([
        sharp("sideboard", Paint::Oak, body),
        sharp("sideboard doors", Paint::White, doors),
        smooth("sideboard knobs", Paint::Brass, knobs),
        smooth("sideboard legs", Paint::Black, Solid::all(legs)),
        smooth("vase", Paint::Sage, at(lathe(&vase, 48), [2.80, 0.68, 0.88])),
    ]);
    pieces
}

/// A pot plant whose leaves arch outwards.
fn plant() -> Vec<Piece> {
    let place = [-2.50, 0.0, -1.48];
    let pot = [
        [0.0, -SUNK],
        [0.13, -SUNK],
        [0.145, 0.01],
        [0.175, 0.28],
        [0.18, 0.32],
        [0.165, 0.325],
        [0.155, 0.29],
        [0.0, 0.285],
    ];
    let soil = [[0.0, 0.27], [0.1565, 0.27], [0.1565, 0.292], [0.08, 0.300], [0.0, 0.302]];
    let mut random = Random::new(11);
    let leaves = (0..17).map(|i| {
        // Golden angle: no two leaves above one another (Vogel 1979). Inner leaves stand, outer ones lean.
        let (turn, share) = (2.399_963 * f64::from(i), f64::from(i) / 16.0);
        let (reach, rise) = (0.14 + 0.28 * share, 1.02 - 0.50 * share + random.range(-0.06, 0.06));
        leaf(dvec3(turn.cos(), 0.0, turn.sin()), 0.272 + 0.0012 * f64::from(i), reach, rise, random.range(0.055, 0.075))
    });
    let leaves = Solid::all(leaves);
    vec![
        smooth("plant pot", Paint::Ceramic, at(lathe(&pot, 48), place)),
        smooth("plant soil", Paint::Soil, at(lathe(&soil, 32), place)),
        smooth("plant leaves", Paint::Leaf, at(leaves, place)),
    ]
}

/// A leaf on its stalk, from the height `root` in the soil outwards along `out`: thin where it is stalk, a lens where it is blade.
fn leaf(out: DVec3, root: f64, reach: f64, rise: f64, half_width: f64) -> Solid {
    let stations = 18;
    let curve = |t: f64| {
        // Up first, then over: the tip hangs by a third of what the leaf reaches.
        let droop = (t - 0.6).max(0.0) / 0.4;
        out * (0.02 + reach * t * t) + DVec3::Y * (root + rise * t - (0.33 * reach + 0.10) * droop * droop)
    };
    let side = DVec3::Y.cross(out);
    let tube: Vec<[DVec3; 3]> = (0..=stations)
        .map(|k| {
            let t = f64::from(k) / f64::from(stations);
            let along = (curve(t + 1e-4) - curve(t - 1e-4)).normalize();
            let blade = ((t - 0.35) / 0.65).clamp(0.0, 1.0);
            let wide = 0.005 * (1.0 - t) + 0.0015 + half_width * (PI * blade.powf(0.8)).sin().max(0.0);
            let thick = 0.0045 * (1.0 - t) + 0.0012;
            [curve(t), side * wide, along.cross(side) * thick]
        })
        .collect();
    sweep(&tube, 10)
}

/// Books, a bowl and a cup on the table.
fn on_table() -> Vec<Piece> {
    let book = |size: [f64; 3], turn: f64, place: [f64; 3]| {
        let [x, y, z] = size;
        let lying = cuboid([-x / 2.0, -0.001, -z / 2.0], [x / 2.0, y, z / 2.0]);
        at(lying.moved(DAffine3::from_rotation_y(turn)), place)
    };
    let bowl = [
        [0.0, -0.002],
        [0.05, -0.002],
        [0.055, 0.008],
        [0.10, 0.035],
        [0.135, 0.075],
        [0.14, 0.09],
        [0.132, 0.09],
        [0.125, 0.076],
        [0.095, 0.042],
        [0.05, 0.018],
        [0.0, 0.014],
    ];
    let cup =
        [[0.0, -0.002], [0.03, -0.002], [0.038, 0.02], [0.04, 0.085], [0.035, 0.085], [0.033, 0.02], [0.0, 0.012]];
    let fruit = (0..4).map(|i| {
        let turn = TAU * f64::from(i) / 3.0;
        let (r, y) = if i < 3 { (0.045, 0.052) } else { (0.0, 0.105) };
        let ball = sphere(0.036, 2);
        at(ball, [-0.62 + r * turn.cos(), TABLE + y, 0.36 + r * turn.sin()])
    });
    let handle: Vec<[DVec3; 3]> = (0..=10)
        .map(|k| {
            let turn = -1.9 + 3.8 * f64::from(k) / 10.0;
            let (out, up) = (turn.cos(), turn.sin());
            let along = dvec3(-up, out, 0.0);
            [dvec3(0.036 + 0.024 * out, 0.046 + 0.022 * up, 0.0), DVec3::Z * 0.004, along.cross(DVec3::Z) * 0.004]
        })
        .collect();
    let cup = lathe(&cup, 32).and(sweep(&handle, 8));
    vec![
        sharp("book", Paint::Navy, book([0.24, 0.028, 0.17], 0.18, [0.03, TABLE, 0.30])),
        sharp("book", Paint::Mustard, book([0.20, 0.022, 0.145], -0.12, [0.03, TABLE + 0.028, 0.30])),
        smooth("bowl", Paint::Ceramic, at(lathe(&bowl, 48), [-0.62, TABLE, 0.36])),
        smooth("fruit", Paint::Mustard, Solid::all(fruit)),
        smooth("cup", Paint::Rust, at(cup.moved(DAffine3::from_rotation_y(0.7)), [-0.16, TABLE, 0.16])),
    ]
}
