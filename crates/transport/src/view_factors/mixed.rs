//! Pairs with something between them: the form factor of what is visible, exact from each point of one part, averaged
//! over its points.
//!
//! From a point, bodies are cut out of the other part exactly, so shadow edges on it cost nothing. Over the points the
//! visible factor is continuous with kinks: the part is cut along them (`sides`), and cells are divided where it still
//! bends (`cell`, `adaptive`). The part that lies farther from the panels, by its own size, is divided: what stands
//! close to a part throws sharp shadows there, which only the exact side resolves.

use super::adaptive::integrate;
use super::body::{Body, Occluder, Setting};
use super::cell::{List, Shaded, bit};
use super::clear::{Exchange, clear_frame, closed_form};
use super::frame::Frame;
use super::panel::Panel;
use super::part::Part;
use super::shaft::{Look, Shaft, Stands};
use super::sides::{Seen, Sides, sides};
use super::solid::{Obstacles, looks_away};
use super::visible::{Loop, Shadows, Sight, keep_above, lambert};
use glam::DVec3;
use radiosity_scene::Facet;
use smallvec::SmallVec;

/// Places are drawn this much towards the middle: on an edge that both parts share, a factor has no one value.
const INSIDE: f64 = 1e-7;

/// Least height of a corner above the other polygon's plane, by the greatest: below it, all that reaches the corner
/// changes too fast for places to tell.
const STEEP: f64 = 1e-3;

/// Error of visible and hidden together over all cells, relative to the tolerance.
const OF_WHOLE: f64 = 0.01;

/// A_i F_ij of two parts past panels; `tolerance` and the answer in m², `whole` is the answer without panels.
pub fn mixed(
    shadows: &mut Shadows,
    [a, b]: [&Part; 2],
    (panels, obstacles): (&mut Vec<&Panel>, Obstacles),
    whole: Exchange,
    tolerance: f64,
    touch: f64,
) -> Exchange {
    let (outer, inner) = if distance(a, panels) >= distance(b, panels) { (a, b) } else { (b, a) };
    let above = |part: &Part, other: &Part| {
        let mut left: Loop = part.shape.corners().iter().copied().collect();
        let normal = other.shape.normal();
        keep_above(&mut left, normal, normal.dot(other.shape.corners()[0])).then_some(left)
    };
    // Too thin a strip sees the other, or too much stands between for a list.
    let unknown = Exchange { value: 0.5 * whole.value, error: 0.5 * whole.value + whole.error };
    let (Some(from), Some(target)) = (above(outer, inner), above(inner, outer)) else { return unknown };
    let (Ok(from), Ok(to)) = (Facet::new(from.to_vec()), Facet::new(target.to_vec())) else { return unknown };
    panels.retain(|panel| !looks_away(panel, obstacles, from.corners(), touch));
    let Ok(count) = u16::try_from(panels.len()) else { return unknown };
    let setting = Setting { panels, obstacles, target: &target, touch };
    let (bodies, body_of) = Body::of(setting, from.corners());
    let Sides { pieces, sides } = sides(from.corners(), outer.radius, &bodies, setting);
    let all: List = (0..count).collect();
    let is_whole = inner.shape.corners() == &target[..];
    let mut view = View {
        shadows,
        setting,
        bodies: &bodies,
        body_of: &body_of,
        sides: &sides,
        from: from.corners(),
        middle: from.centroid(),
        normal: outer.shape.normal(),
        target: &target,
        to: &to,
        inner: is_whole.then_some(inner),
        of_whole: OF_WHOLE * tolerance / from.area(),
        touch,
    };
    let found = integrate(&pieces, (whole.value, tolerance), &mut view, &all);
    Exchange { value: found.value.clamp(0.0, whole.value), ..found }
}

/// How far the nearest panel stands from a part, by the part's size.
fn distance(part: &Part, panels: &[&Panel]) -> f64 {
    let centre = part.shape.centroid();
    panels.iter().map(|panel| panel.distance(centre)).fold(f64::INFINITY, f64::min) / part.radius
}

/// What a part sees of another past panels.
struct View<'a> {
    shadows: &'a mut Shadows,
    setting: Setting<'a>,
    bodies: &'a [Body],
    /// The body that a panel belongs to.
    body_of: &'a [u16],
    /// Bodies as seen from each side.
    sides: &'a [Vec<Seen>],
    /// Where from.
    from: &'a [DVec3],
    middle: DVec3,
    normal: DVec3,
    /// Where to.
    target: &'a [DVec3],
    to: &'a Facet,
    /// The part that it is, if no corner of it was cut off.
    inner: Option<&'a Part>,
    /// Error of visible and hidden together over a cell, by its area.
    of_whole: f64,
    touch: f64,
}

impl View<'_> {
    fn shaft<'a>(&'a self, cell: &'a [DVec3]) -> Shaft<'a> {
        Shaft::new([cell, self.target], [self.normal, self.to.normal()], self.touch)
    }

    fn inside(&self, place: DVec3) -> DVec3 {
        place + INSIDE * (self.middle - place)
    }
}

impl Shaded for View<'_> {
    fn sight(&mut self, side: u16, place: DVec3, list: &[u16]) -> Sight {
        let mut bodies: SmallVec<[u16; 16]> = list.iter().map(|k| self.body_of[*k as usize]).collect();
        bodies.sort_unstable();
        bodies.dedup();
        let side = &self.sides[side as usize];
        let varying = bodies.iter().filter(|k| matches!(side[**k as usize], Seen::Varying));
        let varying: SmallVec<[(u16, Occluder); 1]> =
            varying.filter_map(|k| Some((*k, Occluder::new(self.bodies[*k as usize], self.setting, place)?))).collect();
        let fixed = bodies.iter().filter_map(|k| match &side[*k as usize] {
            Seen::As(occluder) => Some((*k, occluder)),
            _ => None,
        });
        let occluders = fixed.chain(varying.iter().map(|(k, occluder)| (*k, occluder)));
        self.shadows.sight((self.inside(place), self.normal), self.target, occluders, self.touch)
    }

    fn all(&mut self, place: DVec3) -> f64 {
        lambert(self.inside(place), self.normal, self.target)
    }

    fn before(&mut self, corners: &[DVec3], list: &[u16]) -> List {
        let mut shaft = self.shaft(corners);
        let stands = |k: &u16| shaft.stands(self.setting.panels[*k as usize], Look::Rough) != Stands::Aside;
        list.iter().copied().filter(stands).collect()
    }

    fn is_clear(&mut self, corners: &[DVec3], list: &[u16]) -> bool {
        let mut shaft = self.shaft(corners);
        list.iter().all(|k| shaft.stands(self.setting.panels[*k as usize], Look::Close) == Stands::Aside)
    }

    fn possible(&mut self, corners: &[DVec3], list: &[u16], without: u64) -> f64 {
        let centre = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let mut shaft = self.shaft(corners);
        let mut sum = 0.0;
        for &k in list.iter().filter(|k| bit(self.body_of[**k as usize]) & without == 0) {
            let panel = self.setting.panels[k as usize];
            let mut part = shaft.part_of(panel);
            if panel.height(centre) < 0.0 {
                part.reverse();
            }
            if part.len() >= 3 {
                sum += lambert(centre, self.normal, &part);
            }
        }
        sum
    }

    fn whole(&mut self, cell: &Frame) -> Exchange {
        match self.inner {
            Some(inner) => clear_frame(cell, self.normal, inner, self.of_whole * cell.area()),
            None => Facet::new(cell.corners().to_vec()).map_or(Exchange::default(), |cell| closed_form(&cell, self.to)),
        }
    }

    fn is_steep(&self) -> bool {
        let heights = self.from.iter().map(|x| self.to.height(*x));
        let (low, high) = heights.fold((f64::INFINITY, 0.0f64), |(low, high), h| (low.min(h), high.max(h)));
        low < STEEP * high
    }
}
