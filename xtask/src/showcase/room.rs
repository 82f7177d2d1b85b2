//! The room: a shell with thick walls and a hole for the window, and what is fixed to it.

use super::paint::Paint;
use super::solid::{Solid, cuboid, frame, lathe, rod, sheet, sphere};
use super::{Piece, SUNK, Shape, sharp, smooth};
use glam::{DAffine3, DVec2, DVec3, dvec3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Half the room's width and depth, its height, and the thickness of its walls.
const X: f64 = 3.0;
const Z: f64 = 2.25;
const HEIGHT: f64 = 2.8;
const WALL: f64 = 0.3;

/// The window's opening: [x0, y0, x1, y1].
const WINDOW: [f64; 4] = [-2.0, 0.5, 1.0, 2.35];

/// Where a point of the floor lies in the picture of planks, which covers 3 × 2.25 m.
pub fn planks(p: DVec3) -> DVec2 {
    DVec2::new((p.x + X) / 3.0, (p.z + Z) / 2.25)
}

/// Shell, window, curtains, skirting, door and pendant.
pub fn pieces() -> Vec<Piece> {
    let mut pieces = shell();
    pieces.extend(window());
    pieces.extend(door());
    pieces.extend(pendant());
    // Sunk deeper than what stands before it, so that their hidden backs do not coincide.
    let deep = 1.5 * SUNK;
    let (x, z, thick) = (X + deep, Z + deep, 0.015);
    let lying = DAffine3::from_rotation_x(-FRAC_PI_2);
    let skirting = frame([-x, -z, x, z], [thick - X, thick - Z, X - thick, Z - thick], [-deep, 0.09]);
    pieces.push(sharp("skirting", Paint::White, skirting.moved(lying)));
    pieces
}

/// A quadrilateral seen from the side of `towards`.
fn facing(towards: DVec3, mut corners: [DVec3; 4]) -> Solid {
    if (corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(towards) < 0.0 {
        corners.reverse();
    }
    Solid { points: corners.to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3]] }
}

/// Corners of a rectangle [x0, y0, x1, y1] at depth z.
fn rectangle([x0, y0, x1, y1]: [f64; 4], z: f64) -> [DVec3; 4] {
    [dvec3(x0, y0, z), dvec3(x1, y0, z), dvec3(x1, y1, z), dvec3(x0, y1, z)]
}

/// Four quadrilaterals between two rectangles, without a T-junction.
fn between(towards: impl Fn(usize) -> DVec3, outer: [DVec3; 4], inner: [DVec3; 4]) -> Solid {
    Solid::all((0..4).map(|i| {
        let j = (i + 1) % 4;
        facing(towards(i), [outer[i], outer[j], inner[j], inner[i]])
    }))
}

fn shell() -> Vec<Piece> {
    let sheet = |name, paint, solid| Piece { name, paint, shape: Shape::Sheet(solid) };
    let inside = |x: f64, y: f64, z: f64| dvec3(x * X, if y > 0.0 { HEIGHT } else { 0.0 }, z * Z);
    let outside =
        |x: f64, y: f64, z: f64| dvec3(x * (X + WALL), if y > 0.0 { HEIGHT + WALL } else { -WALL }, z * (Z + WALL));
    // The face of a box on the side of `axis`, with its front towards or away from the box's middle.
    let face = |corner: &dyn Fn(f64, f64, f64) -> DVec3, axis: DVec3, inwards: bool| {
        let (u, v) = axis.any_orthonormal_pair();
        let corners = [u + v, v - u, -u - v, u - v].map(|d| axis + d).map(|d| corner(d.x, d.y, d.z));
        facing(if inwards { -axis } else { axis }, corners)
    };
    let opening = |z| rectangle(WINDOW, z);
    let window_wall = between(|_| DVec3::Z, rectangle([-X, 0.0, X, HEIGHT], -Z), opening(-Z));
    let (x, low, high, z) = (X + WALL, -WALL, HEIGHT + WALL, -Z - WALL);
    let facade = between(|_| DVec3::NEG_Z, rectangle([-x, low, x, high], z), opening(z));
    let reveal = between(|i| [DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y, DVec3::X][i], opening(z), opening(-Z));
    let ends = face(&inside, DVec3::X, true).and(face(&inside, DVec3::NEG_X, true));
    let others = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z];
    let facade = facade.and(Solid::all(others.map(|axis| face(&outside, axis, false))));
    vec![
        sheet("floor", Paint::Floor, face(&inside, DVec3::NEG_Y, true)),
        sheet("ceiling", Paint::Ceiling, face(&inside, DVec3::Y, true)),
        sheet("walls", Paint::Wall, ends),
        sheet("window wall", Paint::Wall, window_wall),
        sheet("window reveal", Paint::White, reveal),
        sheet("accent wall", Paint::Accent, face(&inside, DVec3::Z, true)),
        sheet("facade", Paint::Facade, facade),
    ]
}

fn window() -> Vec<Piece> {
    let [x0, y0, x1, y1] = WINDOW;
    let (bar, z) = (0.055, [-2.46, -2.40]);
    let outer = [x0 - SUNK, y0 - SUNK, x1 + SUNK, y1 + SUNK];
    let mut frames = frame(outer, [x0 + bar, y0 + bar, x1 - bar, y1 - bar], z);
    // Bars are thinner than the frame, and the transom thinner than the mullions, so that no faces coincide.
    for share in [1.0 / 3.0, 2.0 / 3.0] {
        let x = x0 + share * (x1 - x0);
        let lo = [x - 0.025, y0 + bar - SUNK, z[0] + 0.006];
        frames = frames.and(cuboid(lo, [x + 0.025, y1 - bar + SUNK, z[1] - 0.006]));
    }
    let lo = [x0 + bar - SUNK, 1.80, z[0] + 0.012];
    frames = frames.and(cuboid(lo, [x1 - bar + SUNK, 1.84, z[1] - 0.012]));
    let sill = cuboid([x0 - 0.03, y0 - 0.02, -2.43], [x1 + 0.03, y0 + 0.018, -2.165]);
    let curtains = Solid::all([[-2.48, -2.04], [1.04, 1.48]].map(curtain));
    let (left, right, at) = (-2.62, 1.62, dvec3(0.0, 2.56, -2.10));
    let ends = [left, right].map(|x| dvec3(x, at.y, at.z));
    let mut rail = rod(ends[0], ends[1], 0.011, 16);
    for (end, inner) in ends.into_iter().zip([left + 0.06, right - 0.06]) {
        rail = rail.and(sphere(0.024, 2).moved(DAffine3::from_translation(end)));
        rail = rail.and(rod(dvec3(inner, at.y, -Z - SUNK), dvec3(inner, at.y, at.z), 0.008, 12));
    }
    vec![
        sharp("window frame", Paint::White, frames),
        sharp("window sill", Paint::White, sill),
        smooth("curtains", Paint::Linen, curtains),
        smooth("curtain rail", Paint::Black, rail),
    ]
}

/// A hanging cloth, drawn aside: folds that deepen downwards.
fn curtain([x0, x1]: [f64; 2]) -> Solid {
    let (folds, thick, nu, nv) = (5.0, 0.006, 70, 8);
    let side = |depth: f64| {
        move |i: usize, j: usize| {
            let (u, v) = (i as f64 / nu as f64, j as f64 / nv as f64);
            let fold = (TAU * folds * u).cos() + 0.25 * (TAU * 2.3 * u + 1.0).sin();
            dvec3(x0 + u * (x1 - x0), 0.02 + 2.53 * v, -2.10 + (0.038 - 0.016 * v) * fold + depth)
        }
    };
    sheet(nu, nv, side(thick), side(0.0))
}

/// A closed door in the end wall at +X.
fn door() -> Vec<Piece> {
    // The frame is made in the XY plane and turned so that its x runs along +Z and its z along −X.
    let on_wall = DAffine3::from_translation(dvec3(X + SUNK, 0.0, 0.0)) * DAffine3::from_rotation_y(-FRAC_PI_2);
    let casing = frame([-1.90, -0.10, -0.94, 2.11], [-1.82, -0.02, -1.02, 2.03], [0.0, 0.05]).moved(on_wall);
    let leaf = cuboid([X - 0.024, -0.5 * SUNK, -1.83], [X + 0.5 * SUNK, 2.04, -1.01]);
    let panels = [[0.20, 0.88], [1.02, 1.88]].map(|[low, high]| {
        frame([-1.72, low, -1.12, high], [-1.68, low + 0.04, -1.16, high - 0.04], [0.02, 0.038]).moved(on_wall)
    });
    let at = dvec3(X - 0.07, 1.0, -1.11);
    let handle = rod(dvec3(X - 0.02, 1.0, -1.11), at - DVec3::X * 0.01, 0.010, 16).and(rod(
        at + DVec3::Z * 0.012,
        at - DVec3::Z * 0.12,
        0.010,
        16,
    ));
    vec![
        sharp("door casing", Paint::White, casing),
        sharp("door", Paint::White, leaf.and(Solid::all(panels))),
        smooth("door handle", Paint::Brass, handle),
    ]
}

/// An opal globe over the table.
fn pendant() -> Vec<Piece> {
    let centre = dvec3(-0.3, 2.02, 0.30);
    let over = |solid: Solid, y: f64| solid.moved(DAffine3::from_translation(dvec3(centre.x, y, centre.z)));
    let canopy = lathe(&[[0.0, -0.03], [0.045, -0.028], [0.055, -0.02], [0.055, SUNK], [0.0, SUNK]], 32);
    let cap = lathe(&[[0.0, -0.02], [0.062, -0.02], [0.058, 0.012], [0.02, 0.035], [0.014, 0.08], [0.0, 0.08]], 32);
    let cord = rod(centre + DVec3::Y * 0.2, dvec3(centre.x, HEIGHT - 0.01, centre.z), 0.004, 8);
    vec![
        smooth("pendant globe", Paint::Globe, sphere(0.17, 3).moved(DAffine3::from_translation(centre))),
        smooth("pendant cap", Paint::Brass, over(canopy, HEIGHT).and(over(cap, centre.y + 0.17))),
        smooth("pendant cord", Paint::Black, cord),
    ]
}
