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
use super::visible::{Loop, Plane, cut_off};
use glam::DVec3;
use smallvec::SmallVec;

/// Sine of the angle below which edges are parallel.
const PARALLEL: f64 = 1e-6;

/// Pieces narrower than this, relative to the whole, are not cut off.
const NARROW: f64 = 1e-5;

/// Bodies in a list up to which their edges are held against each other's.
const FEW: usize = 6;

/// Faces that cross a polygon above which it is not cut by any: those of a mesh bend what is seen everywhere, and little each.
const MESH: usize = 16;

/// Pieces beyond which no more are cut.
const MANY: usize = 64;

/// Cuts pieces of a convex polygon by a plane.
fn cut(pieces: &mut Vec<Loop>, plane: Plane, size: f64) {
    let (normal, offset) = plane;
    let mut k = 0;
    let all = pieces.len();
    while k < all && pieces.len() < MANY {
        if is_crossed(&pieces[k], plane, size) {
            let below = cut_off(&mut pieces[k], normal, offset);
            pieces.extend(below);
        }
        k += 1;
    }
}

/// Whether a polygon of a size (m) lies on both sides of a plane, by more than nothing.
#[inline]
fn is_crossed(polygon: &[DVec3], (normal, offset): Plane, size: f64) -> bool {
    let heights = polygon.iter().map(|p| normal.dot(*p) - offset);
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| (low.min(h), high.max(h)));
    low < -NARROW * size && high > NARROW * size
}

/// An edge and a parallel one of the target, or of another body: seen from their common plane, the shadow of one falls along
/// the other all at once, and the visible factor has a kink.
struct Meeting {
    plane: Plane,
    along: DVec3,
    edge: [DVec3; 2],
    other: [DVec3; 2],
}

impl Meeting {
    fn new(edge: &Line, other: &Line) -> Option<Meeting> {
        let along = edge.along;
        if along.cross(other.along).length_squared() > PARALLEL * PARALLEL {
            return None;
        }
        let normal = along.cross(other.ends[0] - edge.ends[0]).try_normalize()?;
        Some(Meeting { plane: (normal, normal.dot(edge.ends[0])), along, edge: edge.ends, other: other.ends })
    }

    /// Whether the plane crosses `piece` where both edges take part.
    fn crosses(&self, piece: &[DVec3], size: f64) -> bool {
        let Meeting { plane: (normal, offset), along, edge, other } = *self;
        if !is_crossed(piece, self.plane, size) {
            return false;
        }
        // In the plane: along the edges, and across, from the other edge.
        let across = normal.cross(along);
        let base = across.dot(other[0]);
        let height = across.dot(edge[0]) - base;
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
        // The edge lies between, at `share` of the way from the other.
        if !(share.1 > 0.0 && share.0 < 1.0) {
            return false;
        }
        let span = |[p, q]: [DVec3; 2]| {
            let (a, b) = (along.dot(p), along.dot(q));
            (a.min(b), a.max(b))
        };
        let (e, t) = (span(edge), span(other));
        let (s0, s1) = (share.0.max(0.0), share.1.min(1.0));
        let least = [s0, s1].map(|s| t.0 + s * (reach.0 - t.0)).into_iter().fold(f64::INFINITY, f64::min);
        let most = [s0, s1].map(|s| t.1 + s * (reach.1 - t.1)).into_iter().fold(f64::NEG_INFINITY, f64::max);
        e.0 < most && e.1 > least
    }
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

/// On which side of the planes of faces a piece lies: 1 or −1, or 0 where one still crosses it.
type Signs = SmallVec<[i8; 8]>;

/// All that lies alike to the planes of faces.
struct Side {
    signs: Signs,
    /// The bodies as seen from there, in their order.
    seen: Vec<Seen>,
    /// Once they are asked for.
    meetings: Option<Vec<Meeting>>,
}

/// How polygons in a region of a plane are cut, and what throws shadows on the pieces.
pub struct Sides {
    /// A polygon that holds the region.
    region: Loop,
    /// The planes of faces that cross it, each with its body, but those of round solids.
    faces: SmallVec<[(u16, Plane); 8]>,
    /// The round solids with faces whose planes cross it, in order.
    round: Vec<u16>,
    /// The edges of the target.
    outline: SmallVec<[Line; 6]>,
    /// Those that were met.
    sides: Vec<Side>,
    /// Polygons on their way through the cuts; kept to be used again.
    scratch: [Vec<Loop>; 2],
}

impl Sides {
    pub fn new(region: &[DVec3], bodies: &[Body], setting: Setting) -> Sides {
        let faces = bodies
            .iter()
            .enumerate()
            .flat_map(|(k, body)| body.faces(setting).map(move |face| (k as u16, (face.normal, face.offset))));
        let crossing = faces.filter(|(_, plane)| is_crossed(region, *plane, 0.0));
        let is_round = |body: u16| bodies[body as usize].is_round(setting.obstacles);
        let (of_round, faces): (Vec<_>, Vec<_>) = crossing.partition(|(body, _)| is_round(*body));
        let mut round: Vec<u16> = of_round.into_iter().map(|(body, _)| body).collect();
        round.dedup();
        let target = setting.target;
        let outline = (0..target.len()).map(|i| Line::new([target[i], target[(i + 1) % target.len()]])).collect();
        Sides {
            region: region.into(),
            faces: faces.into(),
            round,
            outline,
            sides: Vec::new(),
            scratch: Default::default(),
        }
    }

    /// The bodies as seen from a side, in their order.
    pub fn seen(&self, side: u16) -> &[Seen] {
        &self.sides[side as usize].seen
    }

    /// A convex polygon of a size (m) in the region as it is, whatever planes of faces cross it.
    pub fn uncut(&mut self, (from, size): (&[DVec3], f64), bodies: &[Body], setting: Setting) -> SmallVec<[Piece; 4]> {
        let side = self.side(from, size, bodies, setting) as u16;
        Frame::of(from).into_iter().map(|frame| Piece { frame, side }).collect()
    }

    /// Cuts a convex polygon of a size (m) in the region by the planes of faces that cross it, if they are not those of a mesh, and
    /// then where edges of bodies meet parallel ones.
    pub fn cut(&mut self, (from, size): (&[DVec3], f64), bodies: &[Body], setting: Setting) -> SmallVec<[Piece; 4]> {
        let [mut pieces, mut parts] = std::mem::take(&mut self.scratch);
        pieces.push(from.into());
        let crossing = self.faces.iter().filter(|(_, face)| is_crossed(from, *face, size));
        if crossing.clone().count() <= MESH {
            crossing.for_each(|(_, face)| cut(&mut pieces, *face, size));
        }
        let mut found = SmallVec::new();
        for piece in pieces.drain(..) {
            let number = self.side(&piece, size, bodies, setting);
            let Side { seen, meetings: of_side, .. } = &mut self.sides[number];
            let of_side = of_side.get_or_insert_with(|| meetings(&self.region, seen, &self.outline));
            let crossing = of_side.iter().filter(|meeting| meeting.crosses(&piece, size));
            let planes: SmallVec<[Plane; 16]> = crossing.map(|meeting| meeting.plane).collect();
            parts.push(piece);
            for plane in planes {
                cut(&mut parts, plane, size);
            }
            let frames = parts.iter().flat_map(|part| Frame::of(part));
            found.extend(frames.map(|frame| Piece { frame, side: number as u16 }));
            parts.clear();
        }
        self.scratch = [pieces, parts];
        found
    }

    /// The side that a piece lies on.
    fn side(&mut self, piece: &[DVec3], size: f64, bodies: &[Body], setting: Setting) -> usize {
        let centre = piece.iter().sum::<DVec3>() / piece.len() as f64;
        let sign = |(_, plane): &(u16, Plane)| match is_crossed(piece, *plane, size) {
            true => 0,
            false if plane.0.dot(centre) > plane.1 => 1,
            false => -1,
        };
        let signs: Signs = self.faces.iter().map(sign).collect();
        if let Some(known) = self.sides.iter().position(|side| side.signs == signs) {
            return known;
        }
        let is_cut =
            |body: usize| self.faces.iter().zip(&signs).any(|(face, sign)| face.0 as usize == body && *sign == 0);
        let is_varying = |body: usize| self.round.binary_search(&(body as u16)).is_ok() || is_cut(body);
        let seen = |(k, body): (usize, &Body)| match Occluder::new(*body, setting, centre) {
            _ if is_varying(k) => Seen::Varying,
            Some(occluder) => occluder.before(&self.region, setting).map_or(Seen::Nothing, Seen::As),
            None => Seen::Nothing,
        };
        let seen: Vec<Seen> = bodies.iter().enumerate().map(seen).collect();
        self.sides.push(Side { signs, seen, meetings: None });
        self.sides.len() - 1
    }
}

/// Where edges of bodies meet the target's as seen from a region, and those of other bodies while they are few.
fn meetings(region: &[DVec3], seen: &[Seen], outline: &[Line]) -> Vec<Meeting> {
    let mut meetings = Vec::new();
    let mut add = |edge: &Line, other: &Line| {
        meetings.extend(Meeting::new(edge, other).filter(|meeting| is_crossed(region, meeting.plane, 0.0)));
    };
    for (k, occluder) in seen.iter().enumerate() {
        let before = if seen.len() <= FEW { &seen[..k] } else { &[] };
        for edge in occluder.edges() {
            outline.iter().for_each(|other| add(edge, other));
            for other in before.iter().flat_map(Seen::edges) {
                add(edge, other);
                add(other, edge);
            }
        }
    }
    meetings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view_factors::panel::Panel;
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
        let (region, bodies) = (square(0.0, -1.0, 2.0), [Body::Panel(0)]);
        let mut sides = Sides::new(&region, &bodies, setting);
        let pieces = sides.cut((&square(0.0, 0.0, 1.0), 1.0), &bodies, setting);
        // 2 · 0.4 − 0 = 0.8 and 2 · 0.7 − 1 = 0.4 lie on it; 2 · 0.4 − 1 and 2 · 0.7 do not.
        assert_eq!((pieces.len(), sides.sides.len()), (9, 1));
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
        let (from, bodies) = (square(2.0, 0.25, 1.75), [Body::Solid(0)]);
        let mut sides = Sides::new(&from, &bodies, setting);
        sides.cut((&from, 1.0), &bodies, setting);
        assert_eq!(sides.sides.len(), 4);
        // Half of it lies on the same sides.
        sides.cut((&square(2.0, 0.25, 1.25), 1.0), &bodies, setting);
        assert_eq!(sides.sides.len(), 4);
    }
}
