//! Sides: a polygon cut into pieces over which what it sees of another past bodies has hardly a kink.
//!
//! Seen from a place that moves, the shadow of an edge sweeps over the target. What is visible bends where the shadow
//! reaches a corner of it, and has a kink where it reaches a parallel edge, all at once: along a line, the
//! discontinuities of first order of discontinuity meshing (Heckbert 1992; Lischinski, Tampieri and Greenberg 1992).
//! Rooms and furniture are full of parallel edges, so polygons are cut along these lines, and along those where they
//! cross the planes of faces: what is left is smooth enough for few places.

use super::body::{Body, Line, Occluder, Setting};
use super::cell::Piece;
use super::frame::Frame;
use super::panel::Panel;
use super::visible::{Loop, keep_above};
use glam::DVec3;
use smallvec::SmallVec;

/// Sine of the angle below which edges are parallel.
const PARALLEL: f64 = 1e-6;

/// Pieces narrower than this, relative to the whole, are not cut off.
const NARROW: f64 = 1e-5;

/// Bodies in a list up to which their edges are held against each other's.
const FEW: usize = 6;

/// Pieces beyond which no more are cut.
const MANY: usize = 64;

/// A plane: a normal n, and n · x of its points.
type Plane = (DVec3, f64);

/// Cuts pieces of a convex polygon by a plane.
fn cut(pieces: &mut Vec<Loop>, (normal, offset): Plane, size: f64) {
    let mut k = 0;
    let all = pieces.len();
    while k < all && pieces.len() < MANY {
        let (low, high) = range(&pieces[k], normal, offset);
        if low < -NARROW * size && high > NARROW * size {
            let mut below = pieces[k].clone();
            if keep_above(&mut below, -normal, -offset) && keep_above(&mut pieces[k], normal, offset) {
                pieces.push(below);
            }
        }
        k += 1;
    }
}

fn range(polygon: &[DVec3], normal: DVec3, offset: f64) -> (f64, f64) {
    let heights = polygon.iter().map(|p| normal.dot(*p) - offset);
    heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| (low.min(h), high.max(h)))
}

/// The plane in which the shadow of an edge falls along a parallel one all at once, if it crosses `piece` where both
/// take part: seen from there, the visible factor has a kink.
fn meeting(piece: &[DVec3], edge: &Line, of_target: &Line, size: f64) -> Option<Plane> {
    let along = edge.along;
    if along.cross(of_target.along).length_squared() > PARALLEL * PARALLEL {
        return None;
    }
    let normal = along.cross(of_target.ends[0] - edge.ends[0]).try_normalize()?;
    let offset = normal.dot(edge.ends[0]);
    let (low, high) = range(piece, normal, offset);
    if !(low < -NARROW * size && high > NARROW * size) {
        return None;
    }
    // In the plane: along the edges, and across, from the edge of the target.
    let across = normal.cross(along);
    let base = across.dot(of_target.ends[0]);
    let height = across.dot(edge.ends[0]) - base;
    let (mut reach, mut share) = ((f64::INFINITY, f64::NEG_INFINITY), (f64::INFINITY, f64::NEG_INFINITY));
    let n = piece.len();
    for i in 0..n {
        let (p, q) = (piece[i], piece[(i + 1) % n]);
        let (h, k) = (normal.dot(p) - offset, normal.dot(q) - offset);
        if (h > 0.0) != (k > 0.0) {
            let x = p + h / (h - k) * (q - p);
            let s = along.dot(x);
            reach = (reach.0.min(s), reach.1.max(s));
            let of_edge = height / (across.dot(x) - base);
            share = (share.0.min(of_edge), share.1.max(of_edge));
        }
    }
    // The edge lies between, at `share` of the way from the target.
    if !(share.1 > 0.0 && share.0 < 1.0) {
        return None;
    }
    let span = |[p, q]: [DVec3; 2]| {
        let (a, b) = (along.dot(p), along.dot(q));
        (a.min(b), a.max(b))
    };
    let (e, t) = (span(edge.ends), span(of_target.ends));
    let (s0, s1) = (share.0.max(0.0), share.1.min(1.0));
    let least = [s0, s1].map(|s| t.0 + s * (reach.0 - t.0)).into_iter().fold(f64::INFINITY, f64::min);
    let most = [s0, s1].map(|s| t.1 + s * (reach.1 - t.1)).into_iter().fold(f64::NEG_INFINITY, f64::max);
    (e.0 < most && e.1 > least).then_some((normal, offset))
}

/// A polygon cut where what it sees has kinks, and what throws shadows on its pieces.
pub struct Sides {
    /// The pieces.
    pub pieces: Vec<Piece>,
    /// The bodies as seen from each side, in their order.
    pub sides: Vec<Vec<Seen>>,
}

/// A body as seen from a side.
#[expect(clippy::large_enum_variant, reason = "nearly all are of the large kind")]
pub enum Seen {
    /// It hides nothing of the target.
    Nothing,
    /// The same from all places.
    As(Occluder),
    /// The side is still crossed by the plane of a face, as there were too many to cut by.
    Varying,
}

impl Seen {
    fn edges(&self) -> &[Line] {
        if let Seen::As(occluder) = self { &occluder.edges } else { &[] }
    }
}

/// Cuts a convex polygon of a size (m) by the planes of faces that cross it, and then where edges of bodies meet
/// parallel ones.
pub fn sides(from: &[DVec3], size: f64, bodies: &[Body], setting: Setting) -> Sides {
    let mut pieces: Vec<Loop> = vec![from.into()];
    for face in bodies.iter().flat_map(|body| body.faces(setting)) {
        cut(&mut pieces, (face.normal, face.offset), size);
    }
    let target = setting.target;
    let outline: SmallVec<[Line; 6]> =
        (0..target.len()).map(|i| Line::new([target[i], target[(i + 1) % target.len()]])).collect();
    let mut found = Sides { pieces: Vec::new(), sides: Vec::new() };
    for piece in pieces {
        let centre = piece.iter().sum::<DVec3>() / piece.len() as f64;
        let crosses = |face: &Panel| {
            let (low, high) = range(&piece, face.normal, face.offset);
            low < -NARROW * size && high > NARROW * size
        };
        let seen = |body: &Body| match Occluder::new(*body, setting, centre) {
            _ if body.faces(setting).any(crosses) => Seen::Varying,
            Some(occluder) => Seen::As(occluder),
            None => Seen::Nothing,
        };
        let side: Vec<Seen> = bodies.iter().map(seen).collect();
        let mut parts = vec![piece.clone()];
        for plane in meetings(&piece, size, &side, &outline) {
            cut(&mut parts, plane, size);
        }
        let number = found.sides.len() as u16;
        let frames = parts.iter().flat_map(|part| Frame::of(part));
        found.pieces.extend(frames.map(|frame| Piece { frame, side: number }));
        found.sides.push(side);
    }
    found
}

/// The planes in which edges of bodies meet the target's, and those of other bodies while they are few.
fn meetings(piece: &[DVec3], size: f64, side: &[Seen], outline: &[Line]) -> SmallVec<[Plane; 16]> {
    let mut planes = SmallVec::new();
    for (k, occluder) in side.iter().enumerate() {
        let before = if side.len() <= FEW { &side[..k] } else { &[] };
        let others = || before.iter().flat_map(Seen::edges);
        for edge in occluder.edges() {
            planes.extend(outline.iter().filter_map(|other| meeting(piece, edge, other, size)));
            planes.extend(
                others().filter_map(|other| {
                    meeting(piece, edge, other, size).or_else(|| meeting(piece, other, edge, size))
                }),
            );
        }
    }
    planes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view_factors::solid::{Obstacles, find_solids};

    fn square(z: f64, low: f64, high: f64) -> Vec<DVec3> {
        [[low, low], [high, low], [high, high], [low, high]].map(|[x, y]| DVec3::new(x, y, z)).into()
    }

    /// A square plate halfway between two squares: each of its edges meets both edges of the target that are parallel
    /// to it, seen from two lines, of which those on the polygon cut it.
    #[test]
    fn a_plate_cuts_where_its_edges_meet_the_targets() {
        let plate = Panel::new(square(0.5, 0.4, 0.7), DVec3::Z);
        let target = square(1.0, 0.0, 1.0);
        let obstacles = Obstacles { panels: &[], solids: &[] };
        let setting = Setting { panels: &[&plate], obstacles, target: &target, touch: 1e-9 };
        let Sides { pieces, sides } = sides(&square(0.0, 0.0, 1.0), 1.0, &[Body::Panel(0)], setting);
        // 2 · 0.4 − 0 = 0.8 and 2 · 0.7 − 1 = 0.4 lie on it; 2 · 0.4 − 1 and 2 · 0.7 do not.
        assert_eq!((pieces.len(), sides.len()), (9, 1));
        let area: f64 = pieces.iter().map(|piece| piece.frame.area()).sum();
        assert!((area - 1.0).abs() < 1e-12);
        let corners = pieces.iter().flat_map(|piece| piece.frame.corners());
        assert!(corners.flat_map(|c| [c.x, c.y]).all(|x| [0.0, 0.4, 0.8, 1.0].iter().any(|y| (x - y).abs() < 1e-12)));
    }

    /// The outline of a cube has six edges from before a corner and four from before a face; a polygon that crosses the
    /// plane of a face is cut there.
    #[test]
    fn a_cube_has_an_outline() {
        let corner = |k: usize| DVec3::from_array(std::array::from_fn(|axis| f64::from(u8::from(k >> axis & 1 == 1))));
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let mut panels: Vec<Panel> = faces
            .iter()
            .map(|face| {
                let corners: Vec<DVec3> = face.iter().map(|k| corner(*k)).collect();
                let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
                Panel::new(corners, normal)
            })
            .collect();
        let solids = find_solids(&mut panels, 1e-7);
        let obstacles = Obstacles { panels: &panels, solids: &solids };
        let target = square(-3.0, -1.0, 0.5);
        let setting = Setting { panels: &[], obstacles, target: &target, touch: 1e-9 };
        let seen = |place: [f64; 3]| Occluder::new(Body::Solid(0), setting, DVec3::from_array(place)).unwrap();
        assert_eq!((seen([2.0, 2.0, 2.0]).edges.len(), seen([2.0, 2.0, 2.0]).faces.len()), (6, 3));
        assert_eq!((seen([0.5, 0.5, 2.0]).edges.len(), seen([0.5, 0.5, 2.0]).faces.len()), (4, 1));
        let found = sides(&square(2.0, 0.25, 1.75), 1.0, &[Body::Solid(0)], setting);
        assert_eq!(found.sides.len(), 4);
    }
}
