//! What of a polygon is seen from a point past panels, exactly.
//!
//! Seen from x, a convex panel hides of a target what lies beyond its plane and within the planes through x and its
//! edges: a convex polygon again. With V(T, k) the form factor of what the first k panels leave of T, and T_k the part
//! of T that panel k hides, V(T, k) = Λ(T) − Σ_{m ≤ k} V(T_m, m − 1): each panel takes away what none before it has
//! taken. Λ is Lambert's contour integral (1760).

use super::body::{Line, Occluder};
pub(crate) use crate::polygon::point_to_polygon_above as lambert;
use glam::DVec3;
use smallvec::SmallVec;

/// A convex polygon on its way through the cuts.
pub type Loop = SmallVec<[DVec3; 10]>;

/// Heights below this are taken for zero, relative to the largest of the polygon: cuts along an edge leave no slivers.
const ROUNDING: f64 = 1e-12;

/// Shadows up to which each takes away what none before it has taken; of more, any two that overlap would double the
/// work, and what they leave is cut into pieces.
const FEW: usize = 8;

/// What a panel hides from a point: all that has positive heights over these planes.
type Shadow = SmallVec<[(DVec3, f64); 8]>;

/// An odd number whose multiples mix bits.
const MIX: u64 = 0x9e37_79b9_7f4a_7c15;

/// The shadows of panels as a point throws them.
#[derive(Default)]
pub struct Shadows {
    of: Vec<Shadow>,
    bodies: Vec<u16>,
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
        /// What of which bodies hides which corners, as a hash: where places differ, the factors bend between them.
        hiding: u64,
    },
}

impl Shadows {
    /// F from the differential area at `x` with unit `normal` to what is visible of the convex polygon `target`, which
    /// lies above its horizon and faces it, and to what is hidden, past occluders, each with its number. Those within
    /// `touch` of x hide nothing.
    pub fn sight<'a>(
        &mut self,
        (x, normal): (DVec3, DVec3),
        target: &[DVec3],
        occluders: impl Iterator<Item = (u16, &'a Occluder)>,
        touch: f64,
    ) -> Sight {
        self.of.clear();
        self.bodies.clear();
        for (k, occluder) in occluders {
            if let Some(shadow) = shadow(x, occluder, touch) {
                self.of.push(shadow);
                self.bodies.push(k);
            }
        }
        let (mut is_whole, mut hidden_all, mut hiding) = (true, 0.0, 0u64);
        let are_many = self.of.len() > FEW;
        for (k, shadow) in self.of.iter().enumerate() {
            match within(target, shadow) {
                Within::None => {}
                Within::All => return Sight::Nothing(self.bodies[k]),
                Within::Part(part, how) => {
                    is_whole = false;
                    if !are_many {
                        let own = lambert(x, normal, &part);
                        hidden_all += own - hidden(x, normal, &part, own, &self.of[..k]);
                    }
                    hiding = (hiding ^ how ^ u64::from(self.bodies[k]) << 48).wrapping_mul(MIX).rotate_left(29);
                }
            }
        }
        if is_whole {
            return Sight::Whole;
        }
        let whole = lambert(x, normal, target);
        if are_many {
            hidden_all = whole - left(target, &self.of).iter().map(|piece| lambert(x, normal, piece)).sum::<f64>();
        }
        Sight::Partly { factors: [(whole - hidden_all).max(0.0), hidden_all], hiding }
    }
}

/// The shadow that an occluder throws as seen from x; none if x does not lie before it.
fn shadow(x: DVec3, occluder: &Occluder, touch: f64) -> Option<Shadow> {
    if !occluder.faces.iter().any(|(beyond, offset)| beyond.dot(x) < offset - touch) {
        return None;
    }
    let mut planes: Shadow = occluder.cuts.iter().copied().collect();
    for Line { ends: [p, q], .. } in &occluder.edges {
        let normal = (*q - x).cross(*p - x);
        planes.push((normal, normal.dot(x)));
    }
    Some(planes)
}

/// What shadows leave of a polygon, as convex pieces.
fn left(target: &[DVec3], shadows: &[Shadow]) -> Vec<Loop> {
    let mut pieces: Vec<Loop> = vec![target.into()];
    let mut next = Vec::new();
    for shadow in shadows {
        for mut piece in pieces.drain(..) {
            match within(&piece, shadow) {
                Within::None => next.push(piece),
                Within::All => {}
                // Plane by plane: what lies below one is left, what lies above all is hidden.
                Within::Part(..) => {
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
fn hidden(x: DVec3, normal: DVec3, target: &[DVec3], whole: f64, shadows: &[Shadow]) -> f64 {
    let mut sum = 0.0;
    for (k, shadow) in shadows.iter().enumerate() {
        match within(target, shadow) {
            Within::None => {}
            Within::All => return whole,
            Within::Part(part, _) => {
                let own = lambert(x, normal, &part);
                sum += own - hidden(x, normal, &part, own, &shadows[..k]);
            }
        }
    }
    sum
}

/// How much of a polygon lies within a shadow.
#[expect(clippy::large_enum_variant, reason = "it lives for a few lines, and a box would cost as much as the cuts")]
enum Within {
    None,
    /// A part, and how it comes about: which planes cut, and which corners lie within.
    Part(Loop, u64),
    All,
}

fn within(polygon: &[DVec3], shadow: &Shadow) -> Within {
    // Planes that cut and corners that lie outside, as bits.
    let (mut cuts, mut outside) = (0u64, 0u64);
    for (k, &(normal, offset)) in shadow.iter().enumerate() {
        let (mut low, mut high) = (0.0f64, 0.0f64);
        for (i, p) in polygon.iter().enumerate() {
            let h = normal.dot(*p) - offset;
            (low, high) = (low.min(h), high.max(h));
            outside |= u64::from(h < 0.0) << (i % 32);
        }
        let reach = ROUNDING * high.max(-low);
        if high <= reach {
            return Within::None;
        }
        if low < -reach {
            cuts |= 1 << k.min(63);
        }
    }
    if cuts == 0 {
        return Within::All;
    }
    let mut part: Loop = polygon.into();
    for (k, &(normal, offset)) in shadow.iter().enumerate() {
        if cuts >> k.min(63) & 1 == 1 && !keep_above(&mut part, normal, offset) {
            return Within::None;
        }
    }
    Within::Part(part, cuts ^ outside << 32)
}

/// Cuts off what lies below a plane; whether anything is left.
pub fn keep_above(polygon: &mut Loop, normal: DVec3, offset: f64) -> bool {
    let n = polygon.len();
    let mut heights: SmallVec<[f64; 16]> = SmallVec::from_elem(0.0, n);
    let (mut low, mut high) = (0.0f64, 0.0f64);
    for (height, p) in heights.iter_mut().zip(&*polygon) {
        let h = normal.dot(*p) - offset;
        (low, high) = (low.min(h), high.max(h));
        *height = h;
    }
    let reach = ROUNDING * high.max(-low);
    if high <= reach {
        return false;
    }
    if low >= -reach {
        return true;
    }
    let mut kept = Loop::new();
    let (mut p, mut h) = (polygon[n - 1], heights[n - 1]);
    for (&next, &height) in polygon.iter().zip(&heights) {
        if (h > reach && height < -reach) || (h < -reach && height > reach) {
            kept.push(p + h / (h - height) * (next - p));
        }
        if height >= -reach {
            kept.push(next);
        }
        (p, h) = (next, height);
    }
    *polygon = kept;
    polygon.len() >= 3
}
