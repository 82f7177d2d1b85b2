//! What of a polygon is seen from a point past panels, exactly.
//!
//! Seen from x, a convex panel hides of a target what lies beyond its plane and within the planes through x and its
//! edges: a convex polygon again. With V(T, k) the form factor of what the first k panels leave of T, and T_k the part
//! of T that panel k hides, V(T, k) = Λ(T) − Σ_{m ≤ k} V(T_m, m − 1): each panel takes away what none before it has
//! taken. Λ is Lambert's contour integral (1760).

use super::body::{Line, Occluder};
use super::cell::bit;
pub(crate) use crate::polygon::point_to_polygon_above as lambert;
use crate::polygon::twice_area;
use glam::DVec3;
use smallvec::SmallVec;
use std::ops::Range;

/// A convex polygon on its way through the cuts.
pub type Loop = SmallVec<[DVec3; 10]>;

/// Heights below this are taken for zero, relative to the largest of the polygon: cuts along an edge leave no slivers.
pub const ROUNDING: f64 = 1e-12;

/// Shadows up to which each takes away what none before it has taken; of more, any two that overlap would double the
/// work, and what they leave is cut into pieces.
pub const FEW: usize = 8;

/// A plane: a normal n, and n · x of its points.
pub type Plane = (DVec3, f64);

/// An odd number whose multiples mix bits.
pub const MIX: u64 = 0x9e37_79b9_7f4a_7c15;

/// The shadows of bodies as a point throws them: each is all that has positive heights over some planes.
pub struct Shadows {
    /// The planes of all, one shadow after another.
    planes: Vec<Plane>,
    /// The body of each, and its planes.
    of: Vec<(u16, Range<usize>)>,
    /// Whether each is of a round solid.
    round: Vec<bool>,
    /// What is cut, for shadows of shadows of shadows.
    clips: [Clip; FEW + 1],
}

impl Default for Shadows {
    fn default() -> Self {
        Shadows {
            planes: Vec::new(),
            of: Vec::new(),
            round: Vec::new(),
            clips: std::array::from_fn(|_| Clip::default()),
        }
    }
}

/// A polygon on its way through cuts; kept to be used again.
#[derive(Default)]
struct Clip {
    part: Vec<DVec3>,
    next: Vec<DVec3>,
    /// Heights of the corners over one plane after another.
    heights: Vec<f64>,
}

/// What a point sees of a polygon past bodies.
#[derive(Clone, Copy, Debug)]
pub enum Sight {
    /// All of it.
    Whole,
    /// Nothing: this body hides all.
    Nothing(u16),
    /// A part.
    Partly {
        /// F to what is visible and to what is hidden.
        factors: [f64; 2],
        /// The bodies that hide something, as bits.
        bodies: u64,
        /// What of which bodies hides which corners, as a hash: where places differ, the factors bend between them.
        how: u64,
    },
}

impl Shadows {
    /// F from the differential area at `x` with unit `normal` to what is visible of the convex polygon `target`, which
    /// lies above its horizon and faces it, and to what is hidden, past occluders, each with its number. Where x lies in the
    /// plane of a face, it is seen as from just before it: from within the face, all beyond is hidden. Edges nearer than
    /// `touch` cut nothing.
    pub fn sight<'a>(
        &mut self,
        (x, normal): (DVec3, DVec3),
        target: &[DVec3],
        occluders: impl Iterator<Item = (u16, &'a Occluder)>,
        touch: f64,
    ) -> Sight {
        self.of.clear();
        self.round.clear();
        self.planes.clear();
        for (body, occluder) in occluders {
            let start = self.planes.len();
            if throw(x, occluder, touch, &mut self.planes) {
                self.of.push((body, start..self.planes.len()));
                self.round.push(occluder.is_round);
            }
        }
        let Shadows { planes, of, round, clips: [clip, clips @ ..] } = self;
        let (mut hidden_all, mut bodies, mut hash) = (0.0, 0u64, 0u64);
        let are_many = of.len() > FEW;
        let mut many = Many::new();
        for (k, (body, range)) in of.iter().enumerate() {
            let shadow = &planes[range.clone()];
            match if are_many { falls(target, shadow) } else { within(target, shadow, clip) } {
                Within::None => {}
                Within::All => return Sight::Nothing(*body),
                Within::Part { cuts, outside } => {
                    bodies |= bit(*body);
                    if are_many {
                        many.push(k);
                    } else {
                        let own = lambert(x, normal, &clip.part);
                        hidden_all += own - hidden((x, normal), &clip.part, own, (&of[..k], planes), clips);
                    }
                    // Nothing bends where other edges of a round outline cut.
                    let how = if round[k] { outside << 32 } else { cuts ^ outside << 32 };
                    hash = (hash ^ how ^ u64::from(*body) << 48).wrapping_mul(MIX).rotate_left(29);
                }
            }
        }
        if bodies == 0 {
            return Sight::Whole;
        }
        let whole = lambert(x, normal, target);
        if are_many {
            hidden_all = hidden_by_many((x, normal), target, &many, (of, planes), &mut self.clips);
        }
        Sight::Partly { factors: [(whole - hidden_all).max(0.0), hidden_all], bodies, how: hash }
    }
}

impl Shadows {
    /// F to what the last of some shadows hides of a polygon and none before it does, where only some of its planes cut: those
    /// for which `cuts` holds; and the corners that lie outside, as bits. None if it hides nothing.
    pub fn hidden_by_last(
        &mut self,
        (x, normal): (DVec3, DVec3),
        target: &[DVec3],
        (shadows, planes): (&[(u16, Range<usize>)], &[Plane]),
        cuts: impl Fn(usize) -> bool,
    ) -> Option<(f64, u64)> {
        let [clip, clips @ ..] = &mut self.clips;
        let ((_, last), before) = shadows.split_last()?;
        let mut outside = 0;
        clip.part.clear();
        clip.part.extend_from_slice(target);
        for &(normal, offset) in last.clone().filter(|k| cuts(*k)).map(|k| &planes[k]) {
            if !clip.keep_above(normal, offset) {
                return None;
            }
            for (i, p) in target.iter().enumerate() {
                outside |= u64::from(normal.dot(*p) < offset) << i;
            }
        }
        let own = lambert(x, normal, &clip.part);
        Some((own - hidden((x, normal), &clip.part, own, (before, planes), clips), outside))
    }
}

/// Adds the planes of the shadow that an occluder throws as seen from x; whether there is one.
fn throw(x: DVec3, occluder: &Occluder, touch: f64, planes: &mut Vec<Plane>) -> bool {
    if occluder.faces.is_empty() {
        return false;
    }
    planes.extend_from_slice(&occluder.cuts);
    planes.extend(occluder.edges.iter().filter_map(|Line { ends: [p, q], .. }| {
        let normal = (*q - x).cross(*p - x);
        // Seen end-on, an edge is a point, and those beside it make the outline.
        let is_seen = normal.length_squared() > touch * touch * p.distance_squared(*q);
        is_seen.then(|| (normal, normal.dot(x)))
    }));
    true
}

/// Many shadows, by index.
type Many = SmallVec<[usize; 32]>;

/// Shadows in both halves of a polygon, by those in the whole, above which it is not halved.
const HALVED: f64 = 1.6;

/// F to what many shadows hide of a convex polygon, each of which cuts it. It is halved until few do: of a mesh, whose shadows lie
/// side by side, that takes n log n.
fn hidden_by_many(
    (x, normal): (DVec3, DVec3),
    target: &[DVec3],
    many: &[usize],
    (shadows, planes): (&[(u16, Range<usize>)], &[Plane]),
    clips: &mut [Clip; FEW + 1],
) -> f64 {
    let planes_of = |k: &usize| &planes[shadows[*k].1.clone()];
    if many.len() <= FEW {
        let few: SmallVec<[(u16, Range<usize>); FEW]> = many.iter().map(|k| shadows[*k].clone()).collect();
        return hidden((x, normal), target, lambert(x, normal, target), (&few, planes), clips);
    }
    let in_half = |half: &Loop| {
        let mut left = Many::new();
        for k in many {
            match falls(half, planes_of(k)) {
                Within::None => {}
                Within::Part { .. } => left.push(*k),
                Within::All => return None,
            }
        }
        Some(left)
    };
    let found = halves(target).find_map(|halves| {
        let lists = halves.each_ref().map(in_half);
        let both: usize = lists.iter().flatten().map(SmallVec::len).sum();
        (both as f64 <= HALVED * many.len() as f64).then_some((halves, lists))
    });
    match found {
        Some((halves, lists)) => {
            let of_half = |(half, list): (&Loop, &Option<Many>)| match list {
                Some(list) => hidden_by_many((x, normal), half, list, (shadows, planes), clips),
                None => lambert(x, normal, half),
            };
            halves.iter().zip(&lists).map(of_half).sum()
        }
        None => {
            let left = left(target, many.iter().map(planes_of), &mut clips[0]);
            lambert(x, normal, target) - left.iter().map(|piece| lambert(x, normal, piece)).sum::<f64>()
        }
    }
}

/// A convex polygon halved across its length, and along it.
fn halves(polygon: &[DVec3]) -> impl Iterator<Item = [Loop; 2]> {
    let middle = polygon.iter().sum::<DVec3>() / polygon.len() as f64;
    let farthest = polygon.iter().map(|p| *p - middle).max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    let length = farthest.unwrap_or_default();
    let width = twice_area(polygon).cross(length);
    [length, width].into_iter().filter_map(move |normal| {
        let mut half: Loop = polygon.into();
        let other = cut_off(&mut half, normal, normal.dot(middle))?;
        Some([half, other])
    })
}

/// What shadows leave of a polygon, as convex pieces.
fn left<'a>(target: &[DVec3], shadows: impl Iterator<Item = &'a [Plane]>, clip: &mut Clip) -> Vec<Loop> {
    let mut pieces: Vec<Loop> = vec![target.into()];
    let mut next = Vec::new();
    for shadow in shadows {
        for mut piece in pieces.drain(..) {
            match within(&piece, shadow, clip) {
                Within::None => next.push(piece),
                Within::All => {}
                // Plane by plane: what lies below one is left, what lies above all is hidden.
                Within::Part { .. } => {
                    for &(normal, offset) in shadow {
                        let mut below = piece.clone();
                        if keep_above(&mut below, -normal, -offset) {
                            next.push(below);
                        }
                        if !keep_above(&mut piece, normal, offset) {
                            break;
                        }
                    }
                }
            }
        }
        std::mem::swap(&mut pieces, &mut next);
    }
    pieces
}

/// The form factor of what shadows hide of a polygon whose own is `whole`.
fn hidden(
    (x, normal): (DVec3, DVec3),
    target: &[DVec3],
    whole: f64,
    (shadows, planes): (&[(u16, Range<usize>)], &[Plane]),
    clips: &mut [Clip],
) -> f64 {
    let [clip, clips @ ..] = clips else { unreachable!("there is a clip for each shadow of a few") };
    let mut sum = 0.0;
    for (k, (_, range)) in shadows.iter().enumerate() {
        match within(target, &planes[range.clone()], clip) {
            Within::None => {}
            Within::All => return whole,
            Within::Part { .. } => {
                let own = lambert(x, normal, &clip.part);
                sum += own - hidden((x, normal), &clip.part, own, (&shadows[..k], planes), clips);
            }
        }
    }
    sum
}

/// How much of a polygon lies within a shadow.
enum Within {
    None,
    /// A part, and how it comes about: which planes cut, and which corners lie outside, as bits.
    Part {
        cuts: u64,
        outside: u64,
    },
    All,
}

/// How much of a polygon lies within a shadow; a part is left in `clip`.
fn within(polygon: &[DVec3], shadow: &[Plane], clip: &mut Clip) -> Within {
    held(polygon, shadow, Some(clip))
}

/// The same without the part: what no plane has outside counts as one, though all of them together may leave nothing.
fn falls(polygon: &[DVec3], shadow: &[Plane]) -> Within {
    held(polygon, shadow, None)
}

/// Nearly all have four corners, and loops whose length is known take half the time.
#[inline(always)]
fn held(polygon: &[DVec3], shadow: &[Plane], clip: Option<&mut Clip>) -> Within {
    match <&[DVec3; 4]>::try_from(polygon) {
        Ok(four) => within_shadow(four, shadow, clip, &mut [0.0; 4]),
        Err(_) if polygon.len() <= 8 => within_shadow(polygon, shadow, clip, &mut [0.0; 8]),
        Err(_) => within_shadow(polygon, shadow, clip, &mut vec![0.0; polygon.len()]),
    }
}

#[inline(always)]
fn within_shadow(polygon: &[DVec3], shadow: &[Plane], mut clip: Option<&mut Clip>, heights: &mut [f64]) -> Within {
    let (mut cuts, mut outside, mut first) = (0u64, 0u64, None);
    for (k, &(normal, offset)) in shadow.iter().enumerate() {
        let (mut low, mut high) = (0.0f64, 0.0f64);
        for (height, p) in heights.iter_mut().zip(polygon) {
            let h = normal.dot(*p) - offset;
            low = if h < low { h } else { low };
            high = if h > high { h } else { high };
            *height = h;
        }
        let reach = ROUNDING * high.max(-low);
        if high <= reach {
            return Within::None;
        }
        if low < -reach {
            if let (None, Some(clip)) = (first, &mut clip) {
                clip.part.clear();
                keep(polygon, heights[..polygon.len()].iter().copied(), reach, |p| clip.part.push(p));
            }
            first = first.or(Some(k));
            cuts |= 1 << k.min(63);
            for (i, h) in heights.iter().enumerate().take(polygon.len()) {
                outside |= u64::from(*h < -reach) << (i % 32);
            }
        }
    }
    let Some(first) = first else { return Within::All };
    if let Some(clip) = clip {
        for (k, &(normal, offset)) in shadow.iter().enumerate().skip(first + 1) {
            if cuts >> k.min(63) & 1 == 1 && !clip.keep_above(normal, offset) {
                return Within::None;
            }
        }
    }
    Within::Part { cuts, outside }
}

impl Clip {
    /// Cuts off what lies below a plane; whether anything is left.
    fn keep_above(&mut self, normal: DVec3, offset: f64) -> bool {
        self.heights.clear();
        self.heights.extend(self.part.iter().map(|p| normal.dot(*p) - offset));
        let Some(reach) = reach(self.heights.iter().copied()) else { return false };
        if self.heights.iter().all(|h| *h >= -reach) {
            return true;
        }
        self.next.clear();
        keep(&self.part, self.heights.iter().copied(), reach, |p| self.next.push(p));
        std::mem::swap(&mut self.part, &mut self.next);
        self.part.len() >= 3
    }
}

/// Heights that count as none; `None` if none is above it.
#[inline]
fn reach(heights: impl Iterator<Item = f64>) -> Option<f64> {
    let (low, high) = heights.fold((0.0f64, 0.0f64), |(low, high), h| (low.min(h), high.max(h)));
    let reach = ROUNDING * high.max(-low);
    (high > reach).then_some(reach)
}

/// What of a polygon is not below a plane, by the heights of its corners; `reach` counts as none.
#[inline]
fn keep(
    polygon: &[DVec3],
    heights: impl DoubleEndedIterator<Item = f64> + Clone,
    reach: f64,
    mut kept: impl FnMut(DVec3),
) {
    let (Some(&last), Some(height)) = (polygon.last(), heights.clone().next_back()) else { return };
    let (mut p, mut h) = (last, height);
    for (&next, height) in polygon.iter().zip(heights) {
        if (h > reach && height < -reach) || (h < -reach && height > reach) {
            kept(p + h / (h - height) * (next - p));
        }
        if height >= -reach {
            kept(next);
        }
        (p, h) = (next, height);
    }
}

/// Cuts off what lies below a plane; whether anything is left.
pub fn keep_above(polygon: &mut Loop, normal: DVec3, offset: f64) -> bool {
    let mut kept = Loop::new();
    {
        let heights = polygon.iter().map(|p| normal.dot(*p) - offset);
        let Some(reach) = reach(heights.clone()) else { return false };
        if heights.clone().all(|h| h >= -reach) {
            return true;
        }
        keep(polygon, heights, reach, |p| kept.push(p));
    }
    *polygon = kept;
    polygon.len() >= 3
}

/// Cuts off what lies below a plane and answers with it, if there is something on both sides.
pub fn cut_off(polygon: &mut Loop, normal: DVec3, offset: f64) -> Option<Loop> {
    let (mut above, mut below) = (Loop::new(), Loop::new());
    let heights = polygon.iter().map(|p| normal.dot(*p) - offset);
    let depths = heights.clone().map(|h| -h);
    keep(polygon, heights.clone(), reach(heights)?, |p| above.push(p));
    keep(polygon, depths.clone(), reach(depths)?, |p| below.push(p));
    if above.len() < 3 || below.len() < 3 {
        return None;
    }
    *polygon = above;
    Some(below)
}

#[cfg(test)]
mod tests {
    use super::super::body::{Body, Setting};
    use super::super::panel::Panel;
    use super::super::solid::Obstacles;
    use super::*;
    use radiosity_trace::sampling::Random;

    /// A sheet of squares side by side before a target, and others strewn before and behind it: what they hide together is what is
    /// missing of the pieces that they leave.
    #[test]
    fn many_shadows_hide_what_they_leave_not() {
        let mut random = Random::new(3);
        let square = |[x, y, z]: [f64; 3], size: f64| {
            let corners =
                [[0., 0.], [1., 0.], [1., 1.], [0., 1.]].map(|[u, v]| DVec3::new(x + size * u, y + size * v, z));
            Panel::new(corners.into(), DVec3::Z)
        };
        let mut panels: Vec<Panel> = (0..144)
            .map(|k| square([0.05 * f64::from(k % 12) - 0.2, 0.05 * f64::from(k / 12) - 0.35, 1.0], 0.05))
            .collect();
        panels.extend((0..60).map(|_| {
            let [x, y, z, size] = std::array::from_fn(|_| random.next_unit());
            square([1.6 * x - 0.9, 1.6 * y - 0.9, 0.5 + z], 0.3 * size)
        }));
        let target = [[-1., -1.], [-0.9, 1.1], [1., 1.], [1.2, -1.]].map(|[x, y]| DVec3::new(x, y, 2.0));
        let panels: Vec<&Panel> = panels.iter().collect();
        let obstacles = Obstacles { panels: &[], solids: &[] };
        let setting = Setting { panels: &panels, obstacles, target: &target, touch: 1e-7 };
        let mut shadows = Shadows::default();
        for _ in 0..20 {
            let x = DVec3::new(random.next_unit() - 0.5, random.next_unit() - 0.5, 0.0);
            let occluders: Vec<(u16, Occluder)> = (0..panels.len() as u16)
                .filter_map(|k| Some((k, Occluder::new(Body::Panel(k), setting, x)?)))
                .collect();
            let of = || occluders.iter().map(|(k, occluder)| (*k, occluder));
            let Sight::Partly { factors: [visible, hidden], .. } = shadows.sight((x, DVec3::Z), &target, of(), 1e-7)
            else {
                panic!("some of it is hidden")
            };
            let Shadows { planes, of, clips: [clip, ..], .. } = &mut shadows;
            let left = left(&target, of.iter().map(|(_, range)| &planes[range.clone()]), clip);
            let by_pieces: f64 = left.iter().map(|piece| lambert(x, DVec3::Z, piece)).sum();
            assert!((visible - by_pieces).abs() < 1e-12, "{visible} {by_pieces}");
            assert!(hidden > 0.01 && visible > 0.01, "{hidden} {visible}");
        }
    }
}
