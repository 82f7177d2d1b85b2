//! Galleries: what the parts of one leaf see of those of another past bodies, from places that they share.
//!
//! The shadow that a convex body throws from a place on the plane of a leaf falls on all of its parts at once. So places,
//! where several parts meet, are looked from once: four targets at a time are held against the planes of each shadow, and
//! only those that it cuts are cut. The same signs are proofs. Of four points x, p, q, y the volume is linear in each, so
//! where an edge p q of a body's outline has a target y outside from all corners x of a part, it has from all between: the
//! body hides nothing. And where one body hides all from each corner, it does so from everywhere.
//!
//! What is left takes the mean of its places (`cell`), first of corners and centre and then of a lattice. Where that is not
//! enough there is no answer, and the part is cut along kinks (`mixed`).

use super::body::{Body, Line, Setting};
use super::cell::{ALL, Place, Places, bit};
use super::clear::Exchange;
use super::cluster::LEAF;
use super::lattice::{Lattice, Of};
use super::mixed::{INSIDE, STEEP, possible};
use super::panel::Panel;
use super::part::Part;
use super::shaft::{Look, Shaft, Stands};
use super::visible::{FEW, MIX, Plane, ROUNDING, Shadows};
use crate::lanes::{Lanes, Vectors, dot, everywhere};
use crate::polygon::quads_above;
use glam::DVec3;
use smallvec::SmallVec;
use std::ops::Range;

/// Planes of a body at most: faces and edges are bits of a number that a double holds exactly.
const PLANES: usize = 52;

/// Not a plane: no shadow at all.
const NONE: u64 = 1 << 63;

/// Targets that are looked at together.
const FOUR: usize = 4;

/// Targets, and fours of them, are bits of small numbers.
const _: () = assert!(LEAF <= 16 && LEAF.is_multiple_of(FOUR));

/// Error by fewer places, relative to the tolerance, up to which a lattice is asked.
const HOPE: f64 = 3.0;

/// Error by corners and centre alone, by what cells state: nothing tells how these places mislead.
const ALONE: f64 = 2.5;

/// Error by the finer lattice, by what it tells: it is asked where the other could not tell, and the two may agree by chance.
const FINER: f64 = 2.0;

/// Error by corners and centre alone, relative to the tolerance, above which a lattice is asked. With 1.6 times as much a room
/// of 800 patches, asked for 1e-4, took a twentieth less work, and its rows were off by 9e-5 (RMS) instead of 6e-5.
const COARSE: f64 = 0.6;

/// A body: its planes are numbered, faces first.
struct Caster {
    /// Normals outwards, and offsets.
    faces: SmallVec<[Plane; 6]>,
    /// Of each face: planes through its edges, inwards.
    rims: SmallVec<[SmallVec<[Plane; 4]>; 6]>,
    /// The face of an edge, the one beyond, and both ends, counter-clockwise about the first.
    edges: Vec<(u8, u8, Line)>,
    /// The panels of it that may stand in the way, by index.
    panels: SmallVec<[u16; 4]>,
    /// Of each target: the faces that hide nothing of it, and those whose planes cut it.
    aside: [u64; LEAF],
    cuts: [u64; LEAF],
}

/// How the shadow of a body falls on a target.
#[derive(Clone, Copy, Default)]
struct Mark {
    /// Planes that have all of it outside; if there is one, nothing is hidden.
    aside: u64,
    /// Planes that cut it.
    cuts: u64,
}

impl Mark {
    fn hides_all(&self) -> bool {
        self.aside == 0 && self.cuts == 0
    }
}

/// Four convex quadrilaterals.
type Quads = [Vectors; 4];

/// A place that was looked from.
struct Spot {
    /// Drawn a little inwards.
    at: DVec3,
    /// Those that bodies throw.
    shadows: Range<usize>,
    /// Fours of targets, as bits, of which it is known how shadows fall on them, and all that reaches it from them.
    marked: u8,
    lit: u8,
    /// Targets, as bits, of which is known what is seen.
    known: u16,
}

/// What else is known of the shadow of a body from a place.
struct Shadow {
    /// Faces that look towards it, as bits.
    front: u64,
    /// Planes of edges, behind those of faces.
    edges: Range<usize>,
}

/// What was seen so far; memory that is used again.
#[derive(Default)]
pub struct Kept {
    /// Number of the spot of each place.
    numbers: Vec<Option<u16>>,
    spots: Vec<Spot>,
    /// Bodies that throw shadows, with all their planes.
    shadows: Vec<(u16, Range<usize>)>,
    of_shadows: Vec<Shadow>,
    planes: Vec<Plane>,
    /// The bit of each plane.
    bits: Vec<u64>,
    /// By spot, body and target.
    marks: Vec<[Mark; LEAF]>,
    /// By spot and target: all that reaches it, and what it sees.
    wholes: Vec<[f64; LEAF]>,
    seen: Vec<[Place; LEAF]>,
    /// For what is cut.
    shapes: Shadows,
}

impl Kept {
    fn clear(&mut self) {
        self.numbers.clear();
        self.spots.clear();
        self.shadows.clear();
        self.of_shadows.clear();
        self.planes.clear();
        self.bits.clear();
        self.marks.clear();
        self.wholes.clear();
        self.seen.clear();
    }
}

/// What stands between a part and a target.
pub enum Between {
    Nothing,
    /// All is hidden.
    All,
    /// These bodies may hide a part, as bits.
    Some(u64),
}

/// One leaf before another.
pub struct Gallery<'a, 'b> {
    lattice: &'b Lattice,
    parts: &'b [Part],
    /// Whether a part is a parallelogram that no body meets, and whether the plane of a face crosses it.
    are_fit: SmallVec<[bool; LEAF]>,
    are_crossed: SmallVec<[bool; LEAF]>,
    targets: &'b [Part],
    quads: SmallVec<[Quads; LEAF / FOUR]>,
    setting: Setting<'a>,
    casters: Vec<Caster>,
    normal: DVec3,
    middle: DVec3,
    kept: &'b mut Kept,
}

impl<'a, 'b> Gallery<'a, 'b> {
    /// Parts with these places, in a region of a plane with `normal`, before targets; none if too much stands between.
    pub fn new(
        (lattice, parts): (&'b Lattice, &'b [Part]),
        (region, normal): (&[DVec3], DVec3),
        targets: &'b [Part],
        setting: Setting<'a>,
        kept: &'b mut Kept,
    ) -> Option<Gallery<'a, 'b>> {
        let (bodies, body_of) = Body::of(setting, region);
        if bodies.len() > FEW || bodies.iter().any(|body| body.planes(setting) > PLANES) {
            return None;
        }
        let mut casters: Vec<Caster> = bodies.iter().map(|body| Caster::new(*body, setting, targets)).collect();
        for (k, body) in body_of.iter().enumerate() {
            casters[*body as usize].panels.push(k as u16);
        }
        kept.clear();
        let faces = || casters.iter().flat_map(|caster| caster.faces.iter().zip(&caster.rims));
        let is_met =
            |part: &Part| faces().any(|(face, rims)| meets(part.shape.corners(), (*face, rims), setting.touch));
        let are_fit = parts.iter().zip(&lattice.of).map(|(part, of)| of.is_some() && !is_met(part)).collect();
        let is_crossed = |part: &Part| faces().any(|(face, _)| reaches(part.shape.corners(), *face, -setting.touch));
        let are_crossed = parts.iter().map(is_crossed).collect();
        kept.numbers.resize(lattice.places.len(), None);
        let quads = targets.chunks(FOUR).map(quads).collect();
        let middle = region.iter().sum::<DVec3>() / region.len() as f64;
        Some(Gallery { lattice, parts, are_fit, are_crossed, targets, quads, setting, casters, normal, middle, kept })
    }

    /// What stands between a part and a target that face each other whole; none where places cannot tell.
    pub fn between(&mut self, part: usize, target: usize) -> Option<Between> {
        let corners = self.lattice.of[part].filter(|_| self.are_fit[part])?.corners;
        if self.targets[target].shape.corners().len() != 4 {
            return None;
        }
        let bodies = self.casters.len();
        let marks = corners.map(|place| bodies * self.marked(place, target));
        let (mut some, mut is_whole) = (0, true);
        for k in 0..bodies {
            let of = marks.map(|first| &self.kept.marks[first + k][target]);
            if of.iter().all(|mark| mark.hides_all()) {
                return Some(Between::All);
            }
            if of.iter().fold(!NONE, |all, mark| all & mark.aside) == 0 {
                some |= 1 << k;
                is_whole &= of.iter().all(|mark| mark.aside != 0);
            }
        }
        let is_clear = some == 0 || (is_whole && self.is_clear(part, target, some));
        Some(if is_clear { Between::Nothing } else { Between::Some(some) })
    }

    /// A_i F_ij of a part past bodies, as bits; `tolerance` and the answer in m², `whole` is the answer without bodies. None if
    /// places do not tell it so exactly.
    pub fn mixed(
        &mut self,
        (part, target): (usize, usize),
        past: u64,
        whole: Exchange,
        tolerance: f64,
    ) -> Option<Exchange> {
        let Of { corners, centre, five, thirteen } = self.lattice.of[part]?;
        let (from, to) = (&self.parts[part].shape, &self.targets[target].shape);
        let heights = from.corners().iter().map(|x| to.height(*x));
        let (low, high) = heights.fold((f64::INFINITY, 0.0f64), |(low, high), h| (low.min(h), high.max(h)));
        let area = from.area();
        let corners = SmallVec::from(corners.map(|place| self.see(place, target)));
        let places = Places { corners, centre: self.see(centre, target) };
        let mut most = None;
        // What is known does not change from call to call.
        let mut doubt = |gallery: &Self, values, level| {
            let possible = |known: u64| *most.get_or_insert_with(|| gallery.possible(part, target, past & !known));
            places.doubt(values, area, level, possible)
        };
        // On either side of the plane of a face outlines are others.
        if low >= STEEP * high && !self.are_crossed[part] {
            let told = places.tell(area, None, true);
            let mut error = whole.error + ALONE * told.error + (told.values[0] + told.values[1] - whole.value).abs();
            if error <= COARSE * tolerance {
                error += doubt(self, told.values, 1.0);
                if error <= COARSE * tolerance {
                    return Some(Exchange { value: told.values[0], error }.within(whole));
                }
            }
        }
        let (mut share, mut before) = (places.share(), places.least_error() * whole.value);
        for (others, times, level) in [(&five[..], 1.0, 0.5), (&thirteen[..], FINER, 0.25)] {
            // Where shadows are too sharp for a lattice it need not be asked.
            if before > HOPE * tolerance {
                return None;
            }
            let others: SmallVec<[Place; 12]> = others.iter().map(|place| self.see(*place, target)).collect();
            let (found, error) = places.share_by(&others, share);
            share = found;
            let all = others.iter().chain([&places.centre]).map(Place::all).sum::<f64>() / (1.0 + others.len() as f64);
            let missed = (whole.value - area * all).abs();
            before = error * whole.value;
            let mut error = whole.error + times * before + Places::unknown(missed, share);
            if error <= tolerance {
                error += doubt(self, [share * whole.value, (1.0 - share) * whole.value], level);
                if error <= tolerance {
                    return Some(Exchange { value: share * whole.value, error });
                }
            }
        }
        None
    }

    fn shaft(&self, part: usize, target: usize) -> Shaft<'b> {
        let (from, to) = (&self.parts[part].shape, &self.targets[target].shape);
        Shaft::new([from.corners(), to.corners()], [self.normal, to.normal()], self.setting.touch)
    }

    /// The panels of some bodies.
    fn panels(&self, of: u64) -> impl Iterator<Item = &'a Panel> {
        let casters = self.casters.iter().enumerate().filter(move |(k, _)| of >> k & 1 == 1);
        casters.flat_map(|(_, caster)| &caster.panels).map(|k| self.setting.panels[*k as usize])
    }

    /// Whether some bodies are proven to hide nothing of a target from a part.
    fn is_clear(&self, part: usize, target: usize, of: u64) -> bool {
        let mut shaft = self.shaft(part, target);
        self.panels(of).all(|panel| shaft.stands(panel, Look::Close) == Stands::Aside)
    }

    /// The most that some bodies might hide.
    fn possible(&self, part: usize, target: usize, of: u64) -> f64 {
        let from = (self.parts[part].shape.corners(), self.normal);
        if of == 0 { 0.0 } else { possible(self.shaft(part, target), from, self.panels(of)) }
    }

    /// What is seen of a target from a place.
    fn see(&mut self, place: u16, target: usize) -> Place {
        let number = self.marked(place, target);
        let Kept { spots, shadows, planes, bits, marks, wholes, seen, shapes, .. } = &mut *self.kept;
        let spot = &mut spots[number];
        if spot.known >> target & 1 == 1 {
            return seen[number][target];
        }
        let (at, normal, four) = (spot.at, self.normal, target / FOUR);
        if spot.lit >> four & 1 == 0 {
            spot.lit |= 1 << four;
            wholes[number].as_chunks_mut::<FOUR>().0[four] = lambert(&self.quads[four], at, normal);
        }
        let whole = wholes[number][target];
        let mut place = Place { factors: [whole, 0.0], bodies: 0, how: 0 };
        let all = &shadows[spot.shadows.clone()];
        for (k, (body, _)) in all.iter().enumerate() {
            let mark = marks[number * self.casters.len() + *body as usize][target];
            if mark.hides_all() {
                place = Place { factors: [0.0, whole], bodies: bit(*body), how: ALL };
                break;
            }
            if mark.aside != 0 {
                continue;
            }
            let corners = self.targets[target].shape.corners();
            let cuts = |plane: usize| mark.cuts & bits[plane] != 0;
            if let Some((by, outside)) = shapes.hidden_by_last((at, normal), corners, (&all[..=k], planes), cuts) {
                place.factors[1] += by;
                place.bodies |= bit(*body);
                let how = mark.cuts.wrapping_mul(MIX) ^ outside;
                place.how = (place.how ^ how ^ u64::from(*body) << 48).wrapping_mul(MIX).rotate_left(29);
            }
        }
        place.factors[0] = (whole - place.factors[1]).max(0.0);
        spot.known |= 1 << target;
        seen[number][target] = place;
        place
    }

    /// The number of the spot of a place, after it was found how shadows fall from there on a target.
    #[inline]
    fn marked(&mut self, place: u16, target: usize) -> usize {
        let number = match self.kept.numbers[place as usize] {
            Some(number) => number as usize,
            None => self.look(place),
        };
        if self.kept.spots[number].marked >> (target / FOUR) & 1 == 0 {
            self.mark(number, target / FOUR);
        }
        number
    }

    /// Finds how shadows fall on four targets.
    fn mark(&mut self, number: usize, four: usize) {
        let Kept { spots, shadows, of_shadows, planes, bits, marks, .. } = &mut *self.kept;
        let spot = &mut spots[number];
        spot.marked |= 1 << four;
        for k in spot.shadows.clone() {
            let (body, Shadow { front, edges }) = (shadows[k].0 as usize, &of_shadows[k]);
            let caster = &self.casters[body];
            let found = hold(&self.quads[four], &planes[edges.clone()], &bits[edges.clone()]);
            let targets = FOUR * four..FOUR * (four + 1);
            let of = &mut marks[number * self.casters.len() + body][targets.clone()];
            let by_faces = caster.aside[targets.clone()].iter().zip(&caster.cuts[targets]);
            for ((mark, found), (aside, cuts)) in of.iter_mut().zip(found).zip(by_faces) {
                *mark = Mark { aside: found.aside | aside & front, cuts: found.cuts | cuts & front };
            }
        }
    }

    /// Throws the shadows of all bodies from a place; the number of its spot.
    fn look(&mut self, number: u16) -> usize {
        let touch = self.setting.touch;
        let kept = &mut *self.kept;
        let place = self.lattice.places[number as usize];
        let at = place + INSIDE * (self.middle - place);
        let first = kept.shadows.len();
        for (k, caster) in self.casters.iter().enumerate() {
            let (mut front, mut is_before) = (0u64, false);
            for (i, (normal, offset)) in caster.faces.iter().enumerate() {
                let height = normal.dot(place) - offset;
                front |= u64::from(height > 0.0) << i;
                is_before |= height > touch;
            }
            // What throws no shadow has its marks so for good.
            kept.marks.push([Mark { aside: NONE, cuts: 0 }; LEAF]);
            if !is_before {
                continue;
            }
            let start = kept.planes.len();
            for (i, (normal, offset)) in caster.faces.iter().enumerate().filter(|(i, _)| front >> i & 1 == 1) {
                kept.planes.push((-*normal, -*offset));
                kept.bits.push(1 << i);
            }
            let edges = kept.planes.len();
            for (i, (face, beyond, Line { ends: [p, q], .. })) in caster.edges.iter().enumerate() {
                if front >> face & 1 == 0 || front >> beyond & 1 == 1 {
                    continue;
                }
                let normal = (*q - at).cross(*p - at);
                // Seen end-on, an edge is a point, and those beside it make the outline.
                if normal.length_squared() > touch * touch * p.distance_squared(*q) {
                    kept.planes.push((normal, normal.dot(at)));
                    kept.bits.push(1 << (caster.faces.len() + i));
                }
            }
            let end = kept.planes.len();
            kept.shadows.push((k as u16, start..end));
            kept.of_shadows.push(Shadow { front, edges: edges..end });
        }
        kept.wholes.push([0.0; LEAF]);
        kept.seen.push([Place::default(); LEAF]);
        kept.spots.push(Spot { at, shadows: first..kept.shadows.len(), marked: 0, lit: 0, known: 0 });
        kept.numbers[number as usize] = Some((kept.spots.len() - 1) as u16);
        kept.spots.len() - 1
    }
}

impl Caster {
    fn new(body: Body, setting: Setting, targets: &[Part]) -> Caster {
        let (mut faces, mut rims, mut edges) = (SmallVec::<[Plane; 6]>::new(), SmallVec::new(), Vec::new());
        let mut face = |panel: &Panel, turn: f64| {
            faces.push((turn * panel.normal, turn * panel.offset));
            rims.push(panel.rims[..].into());
        };
        match body {
            // A panel is a solid with two faces.
            Body::Panel(k) => {
                let panel = setting.panels[k as usize];
                face(panel, 1.0);
                face(panel, -1.0);
                let n = panel.corners.len();
                for i in 0..n {
                    let (p, q) = (panel.corners[i], panel.corners[(i + 1) % n]);
                    edges.extend([(0, 1, Line::new([p, q])), (1, 0, Line::new([q, p]))]);
                }
            }
            Body::Solid(solid) => {
                body.faces(setting).for_each(|panel| face(panel, 1.0));
                let solid = &setting.obstacles.solids[solid as usize];
                edges.extend(solid.edges.iter().map(|(face, beyond, line)| (*face as u8, *beyond as u8, *line)));
            }
        }
        let (mut aside, mut cuts) = ([0; LEAF], [0; LEAF]);
        for (t, target) in targets.iter().enumerate() {
            for (i, (normal, offset)) in faces.iter().enumerate() {
                let heights = || target.shape.corners().iter().map(|q| normal.dot(*q) - offset);
                aside[t] |= u64::from(heights().all(|h| h >= -setting.touch)) << i;
                cuts[t] |= u64::from(heights().any(|h| h > 0.0)) << i;
            }
        }
        Caster { faces, rims, edges, panels: SmallVec::new(), aside, cuts }
    }
}

/// Whether a polygon reaches a plane to within `touch`; if that is negative, whether it is crossed.
fn reaches(polygon: &[DVec3], (normal, offset): Plane, touch: f64) -> bool {
    let heights = polygon.iter().map(|p| normal.dot(*p) - offset);
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), h| (low.min(h), high.max(h)));
    low <= touch && high >= -touch
}

/// Whether a face, by its plane and those through its edges, meets a polygon or touches it: what either side of it sees is
/// another thing.
fn meets(polygon: &[DVec3], (face, rims): (Plane, &[Plane]), touch: f64) -> bool {
    if !reaches(polygon, face, touch) {
        return false;
    }
    // Where the outline of the polygon crosses the plane of the face or touches it.
    let mut met: SmallVec<[DVec3; 8]> = SmallVec::new();
    let height = |p: DVec3| face.0.dot(p) - face.1;
    for (i, p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (h, k) = (height(*p), height(q));
        if h.abs() <= touch {
            met.push(*p);
        } else if h * k < 0.0 {
            met.push(*p + h / (h - k) * (q - *p));
        }
    }
    !rims.iter().any(|(inwards, offset)| met.iter().all(|p| inwards.dot(*p) < offset - touch))
}

/// Up to four targets; the last one stands for those that are missing, and what has not four corners for nothing.
fn quads(targets: &[Part]) -> Quads {
    let mut quads = [everywhere(DVec3::ZERO); 4];
    for lane in 0..FOUR {
        let corners = targets[lane.min(targets.len() - 1)].shape.corners();
        for (k, quad) in quads.iter_mut().enumerate() {
            let p = corners[k.min(corners.len() - 1)];
            (quad[0].0[lane], quad[1].0[lane], quad[2].0[lane]) = (p.x, p.y, p.z);
        }
    }
    quads
}

/// Holds four targets against planes through a place and the edges of a body, each with its bit.
fn hold(quads: &Quads, planes: &[Plane], bits: &[u64]) -> [Mark; FOUR] {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has it.
        return unsafe { hold_avx2(quads, planes, bits) };
    }
    held(quads, planes, bits)
}

/// Four lanes of a double are one register there.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn hold_avx2(quads: &Quads, planes: &[Plane], bits: &[u64]) -> [Mark; FOUR] {
    held(quads, planes, bits)
}

/// Bits are added up to a number as lanes have them: above 2^[`PLANES`] those are whole.
#[inline(always)]
fn held(quads: &Quads, planes: &[Plane], bits: &[u64]) -> [Mark; FOUR] {
    const WHOLE: f64 = (1u64 << PLANES) as f64;
    let zero = Lanes::of(0.0);
    let (mut aside, mut cuts) = (Lanes::of(WHOLE), Lanes::of(WHOLE));
    for (&(normal, offset), bit) in planes.iter().zip(bits) {
        let (normal, offset) = (everywhere(normal), Lanes::of(offset));
        let bit = Lanes::of(f64::from_bits(WHOLE.to_bits() | bit) - WHOLE);
        let [a, b, c, d] = quads;
        let (a, b, c, d) = (dot(normal, *a), dot(normal, *b), dot(normal, *c), dot(normal, *d));
        let high = a.max(b).max(c.max(d)) - offset;
        let low = a.min(b).min(c.min(d)) - offset;
        let reach = Lanes::of(ROUNDING) * high.max(zero - low);
        aside = aside + Lanes::above_zero(high - reach, zero, bit);
        cuts = cuts + Lanes::above_zero(low + reach, zero, bit);
    }
    let bits = |Lanes(of): Lanes| of.map(|sum| sum.to_bits() & ((1 << PLANES) - 1));
    let (aside, cuts) = (bits(aside), bits(cuts));
    std::array::from_fn(|k| Mark { aside: aside[k], cuts: cuts[k] })
}

/// What reaches a place from each of four targets.
fn lambert(quads: &Quads, place: DVec3, normal: DVec3) -> [f64; FOUR] {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: the processor has it.
        return unsafe { lambert_avx2(quads, place, normal) };
    }
    quads_above(quads, place, normal).0
}

/// As [`hold_avx2`].
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn lambert_avx2(quads: &Quads, place: DVec3, normal: DVec3) -> [f64; FOUR] {
    quads_above(quads, place, normal).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::polygon::point_to_polygon_above;
    use radiosity_scene::Facet;
    use radiosity_trace::sampling::Random;

    /// Four targets at once, in wide registers and in others, are what each is alone: signs, and what reaches a place.
    #[test]
    fn four_targets_are_as_one() {
        let mut random = Random::new(3);
        let mut unit = || 2.0 * random.next_unit() - 1.0;
        let mut marked = [0, 0];
        for _ in 0..500 {
            let mut vector = || DVec3::new(unit(), unit(), unit());
            let targets: Vec<Part> = (0..4)
                .flat_map(|_| {
                    let (centre, u) = (vector() + 3.0 * DVec3::Z, vector());
                    let v = vector().cross(u);
                    let facet = Facet::new(vec![centre - u - v, centre + u - v, centre + u + v, centre - u + v]);
                    Part::of(0, &facet.unwrap())
                })
                .collect();
            let four = quads(&targets);
            let planes: Vec<Plane> = (0..5).map(|_| (vector(), vector().x + 1.0)).collect();
            let bits = [1, 1 << 5, 1 << 20, 1 << 50, 1 << 51];
            let place = DVec3::new(0.1, 0.2, -1.0);
            let found = (hold(&four, &planes, &bits), lambert(&four, place, DVec3::Z));
            let plain = (held(&four, &planes, &bits), quads_above(&four, place, DVec3::Z).0);
            assert_eq!(found.1.map(f64::to_bits), plain.1.map(f64::to_bits));
            for (k, target) in targets.iter().enumerate() {
                assert_eq!((found.0[k].aside, found.0[k].cuts), (plain.0[k].aside, plain.0[k].cuts));
                let corners = target.shape.corners();
                assert_eq!(found.1[k].to_bits(), point_to_polygon_above(place, DVec3::Z, corners).to_bits());
                let bits_where = |holds: fn(f64) -> bool, all: bool| {
                    let of = |((normal, offset), bit): (&Plane, &u64)| {
                        let mut heights = corners.iter().map(|p| normal.dot(*p) - offset);
                        if if all { heights.all(holds) } else { heights.any(holds) } { *bit } else { 0 }
                    };
                    planes.iter().zip(&bits).map(of).sum::<u64>()
                };
                assert_eq!(found.0[k].aside, bits_where(|h| h <= 0.0, true));
                assert_eq!(found.0[k].cuts, bits_where(|h| h < 0.0, false));
                marked[0] += usize::from(found.0[k].aside != 0);
                marked[1] += usize::from(found.0[k].aside == 0 && found.0[k].cuts != 0);
            }
        }
        assert!(marked.iter().all(|n| *n > 40), "{marked:?}");
    }

    /// A face that a polygon goes through or stands on is met; one whose plane alone it crosses is not.
    #[test]
    fn what_meets_a_face_is_told_from_what_crosses_its_plane() {
        let p = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let panel = Panel::new(vec![p(0., 0., 0.), p(0., 1., 0.), p(0., 1., 1.), p(0., 0., 1.)], DVec3::X);
        let met = |x: f64, y: f64, z: f64| {
            let square = [p(x, y, z), p(x + 1.0, y, z), p(x + 1.0, y + 1.0, z), p(x, y + 1.0, z)];
            meets(&square, ((panel.normal, panel.offset), &panel.rims), 1e-7)
        };
        assert!(met(-0.5, 0.0, 0.5) && met(-0.5, 0.9, 0.0) && met(0.0, 0.5, 0.5));
        assert!(!met(-0.5, 1.1, 0.5) && !met(-0.5, 0.0, -0.1) && !met(0.1, 0.0, 0.5));
    }
}
