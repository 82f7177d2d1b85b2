//! What of a polygon is seen from a point past panels, exactly.
//!
//! Seen from x, a convex panel hides of a target what lies beyond its plane and within the planes through x and its
//! edges: a convex polygon again. With V(T, k) the form factor of what the first k panels leave of T, and T_k the part of T
//! that panel k hides, V(T, k) = Λ(T) − Σ_{m ≤ k} V(T_m, m − 1): each panel takes away what none before it has
//! taken. Λ is Lambert's contour integral (1760).

use super::panel::Panel;
pub(crate) use crate::polygon::point_to_polygon_above as lambert;
use glam::DVec3;
use smallvec::SmallVec;
use std::cmp::Ordering;

/// A convex polygon on its way through the cuts.
pub type Loop = SmallVec<[DVec3; 10]>;

/// Heights below this are taken for zero, relative to the largest of the polygon: cuts along an edge leave no slivers.
const ROUNDING: f64 = 1e-12;

/// Shadows up to which each takes away what none before it has taken; of more, any two that overlap would double the work,
/// and what they leave is cut into pieces.
const FEW: usize = 8;

/// What a panel hides from a point: all that has positive heights over these planes.
type Shadow = SmallVec<[(DVec3, f64); 6]>;

/// The shadows of panels as a point throws them.
#[derive(Default)]
pub struct Shadows {
    of: Vec<Shadow>,
    panels: Vec<u16>,
}

/// What a point sees of a polygon past panels.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sight {
    /// F to what is visible and to what is hidden.
    pub factors: [f64; 2],
    /// Bit k: panel k hides something.
    pub hiding: u64,
}

impl Shadows {
    /// F from the differential area at `x` with unit `normal` to what is visible of the convex polygon `target`, which lies
    /// above its horizon and faces it, and to what is hidden, past the `listed` ones of the panels. Panels within `touch`
    /// of x hide nothing.
    pub fn sight(
        &mut self,
        (x, normal): (DVec3, DVec3),
        target: &[DVec3],
        (panels, listed): (&[&Panel], &[u16]),
        touch: f64,
    ) -> Sight {
        self.of.clear();
        self.panels.clear();
        for &k in listed {
            if let Some(shadow) = shadow(x, panels[k as usize], touch) {
                self.of.push(shadow);
                self.panels.push(k);
            }
        }
        let whole = lambert(x, normal, target);
        let (mut hidden_all, mut hiding) = (0.0, 0);
        let are_many = self.of.len() > FEW;
        for (k, shadow) in self.of.iter().enumerate() {
            let bit = 1u64.checked_shl(u32::from(self.panels[k])).unwrap_or(0);
            match within(target, shadow) {
                Within::None => {}
                Within::All => return Sight { factors: [0.0, whole], hiding: u64::MAX },
                Within::Part(part) => {
                    if !are_many {
                        let own = lambert(x, normal, &part);
                        hidden_all += own - hidden(x, normal, &part, own, &self.of[..k]);
                    }
                    hiding |= bit;
                }
            }
        }
        if are_many {
            hidden_all = whole - left(target, &self.of).iter().map(|piece| lambert(x, normal, piece)).sum::<f64>();
        }
        Sight { factors: [(whole - hidden_all).max(0.0), hidden_all], hiding }
    }

    /// Puts panels in the order of what they hide from a place, most first: what one hides whole need not be looked at
    /// again.
    pub fn sort(x: DVec3, normal: DVec3, target: &[DVec3], panels: &mut [&Panel], touch: f64) {
        if panels.len() < 3 {
            return;
        }
        let hides = |panel: &&Panel| match shadow(x, panel, touch).map_or(Within::None, |s| within(target, &s)) {
            Within::None => 0.0,
            Within::Part(part) => lambert(x, normal, &part),
            Within::All => f64::INFINITY,
        };
        panels.sort_by_cached_key(|panel| std::cmp::Reverse(Total(hides(panel))));
    }
}

/// A number in its total order.
#[derive(PartialEq)]
struct Total(f64);

impl Eq for Total {}

impl PartialOrd for Total {
    fn partial_cmp(&self, other: &Total) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Total {
    fn cmp(&self, other: &Total) -> Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// The shadow that a panel throws as seen from x; none if x lies in its plane.
fn shadow(x: DVec3, panel: &Panel, touch: f64) -> Option<Shadow> {
    let height = panel.height(x);
    if height.abs() <= touch {
        return None;
    }
    let side = -height.signum();
    let mut planes = Shadow::new();
    planes.push((side * panel.normal, side * panel.offset));
    let corners = &panel.corners;
    let mut corner = corners[corners.len() - 1] - x;
    for next in corners {
        let next = *next - x;
        let normal = side * corner.cross(next);
        planes.push((normal, normal.dot(x)));
        corner = next;
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
                Within::Part(_) => {
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
            Within::Part(part) => {
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
    Part(Loop),
    All,
}

fn within(polygon: &[DVec3], shadow: &Shadow) -> Within {
    // The planes that cut, as bits.
    let mut cuts = 0u64;
    for (k, &(normal, offset)) in shadow.iter().enumerate() {
        let (mut low, mut high) = (0.0f64, 0.0f64);
        for p in polygon {
            let h = normal.dot(*p) - offset;
            (low, high) = (low.min(h), high.max(h));
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
    Within::Part(part)
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
