//! What of a polygon is seen from a point past panels, exactly.
//!
//! Seen from x, a convex panel hides of a target what lies beyond its plane and within the planes through x and its
//! edges. Cutting a convex polygon along these planes leaves convex pieces; those outside of any of them are visible.
//! The form factor of what remains after all panels is a sum of Lambert's contour integrals (1760).

use super::panel::Panel;
use glam::DVec3;
use smallvec::SmallVec;

/// A convex polygon on its way through the cuts.
pub type Loop = SmallVec<[DVec3; 10]>;

/// Heights below this are taken for zero, relative to the largest of the polygon: cuts along an edge leave no slivers.
const ROUNDING: f64 = 1e-12;

/// Pieces of polygons, kept from call to call.
#[derive(Default)]
pub struct Pieces {
    visible: Vec<Loop>,
    next: Vec<Loop>,
}

impl Pieces {
    /// F from the differential area at `x` with unit `normal` to what is visible of the convex polygon `target`, which lies
    /// above its horizon and faces it; and whether any panel hid anything. Panels within `touch` of x hide nothing.
    pub fn factor(&mut self, x: DVec3, normal: DVec3, target: &[DVec3], panels: &[&Panel], touch: f64) -> (f64, bool) {
        self.visible.clear();
        self.visible.push(target.iter().copied().collect());
        let mut hidden = false;
        for panel in panels {
            hidden |= self.hide(x, panel, touch);
            if self.visible.is_empty() {
                return (0.0, true);
            }
        }
        (self.visible.iter().map(|piece| lambert(x, normal, piece)).sum(), hidden)
    }

    /// Takes away what a panel hides; whether it hid anything.
    fn hide(&mut self, x: DVec3, panel: &Panel, touch: f64) -> bool {
        let height = panel.height(x);
        if height.abs() <= touch {
            return false;
        }
        let side = -height.signum();
        // Planes that bound what is hidden: positive heights within.
        let mut planes: SmallVec<[(DVec3, f64); 9]> = SmallVec::new();
        planes.push((side * panel.normal, side * panel.offset));
        let corners = &panel.corners;
        for (i, corner) in corners.iter().enumerate() {
            let next = corners[(i + 1) % corners.len()];
            let normal = side * (*corner - x).cross(next - x);
            planes.push((normal, normal.dot(x)));
        }
        let mut hidden = false;
        self.next.clear();
        for piece in self.visible.drain(..) {
            let outside = |(normal, offset): &(DVec3, f64)| {
                let heights = || piece.iter().map(|p| normal.dot(*p) - offset);
                let reach = ROUNDING * heights().fold(0.0, |m: f64, h| m.max(h.abs()));
                heights().all(|h| h <= reach)
            };
            if planes.iter().any(outside) {
                self.next.push(piece);
                continue;
            }
            let mut left = piece;
            for &(normal, offset) in &planes {
                let (within, without) = cut(&left, normal, offset);
                if without.len() >= 3 {
                    self.next.push(without);
                }
                left = within;
                if left.len() < 3 {
                    break;
                }
            }
            hidden |= left.len() >= 3;
        }
        std::mem::swap(&mut self.visible, &mut self.next);
        hidden
    }
}

/// The parts of a convex polygon above and below a plane.
pub fn cut(polygon: &[DVec3], normal: DVec3, offset: f64) -> (Loop, Loop) {
    let (mut above, mut below) = (Loop::new(), Loop::new());
    let heights: SmallVec<[f64; 10]> = polygon.iter().map(|p| normal.dot(*p) - offset).collect();
    let reach = ROUNDING * heights.iter().fold(0.0, |m: f64, h| m.max(h.abs()));
    let (mut has_above, mut has_below) = (false, false);
    for (i, (&p, &h)) in polygon.iter().zip(&heights).enumerate() {
        let k = (i + 1) % polygon.len();
        if h >= -reach {
            above.push(p);
            has_above |= h > reach;
        }
        if h <= reach {
            below.push(p);
            has_below |= h < -reach;
        }
        if (h > reach && heights[k] < -reach) || (h < -reach && heights[k] > reach) {
            let crossing = p + h / (h - heights[k]) * (polygon[k] - p);
            above.push(crossing);
            below.push(crossing);
        }
    }
    if !has_above {
        above.clear();
    }
    if !has_below {
        below.clear();
    }
    (above, below)
}

/// Lambert's contour integral of a polygon above the horizon whose corners run counter-clockwise about its own normal,
/// which faces x.
fn lambert(x: DVec3, normal: DVec3, polygon: &[DVec3]) -> f64 {
    let mut sum = 0.0;
    let mut a = polygon[polygon.len() - 1] - x;
    for corner in polygon {
        let b = *corner - x;
        let cross = b.cross(a);
        let sine = cross.length();
        if sine > 0.0 {
            sum += sine.atan2(a.dot(b)) / sine * cross.dot(normal);
        }
        a = b;
    }
    (sum / std::f64::consts::TAU).max(0.0)
}
