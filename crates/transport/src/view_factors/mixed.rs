//! Pairs with something between them: the form factor of what is visible, exact from each point of one part, averaged
//! over its points.
//!
//! From a point, bodies are cut out of the other part exactly, so shadow edges on it cost nothing. Over the points the
//! visible factor is continuous with kinks: the part is cut along them (`sides`), and cells are divided where it still
//! bends (`cell`, `adaptive`). Parts of the leaf that lies farther from the panels, by their size, are divided: what stands
//! close to a part throws sharp shadows there, which only the exact side resolves.

use super::adaptive::{Goal, integrate};
use super::body::{Body, Occluder, Setting};
use super::cell::{List, Shaded, Sights, bit};
use super::clear::{Exchange, clear_frame, closed_form};
use super::frame::Frame;
use super::panel::Panel;
use super::part::Part;
use super::shaft::{Look, Shaft, Stands};
use super::sides::{Seen, Sides};
use super::visible::{Loop, Shadows, Sight, keep_above, lambert};
use crate::polygon::twice_area;
use glam::DVec3;
use radiosity_scene::Facet;
use smallvec::SmallVec;

/// Places are drawn this much towards the middle: on an edge that both parts share, a factor has no one value.
pub const INSIDE: f64 = 1e-7;

/// Least height of a corner above the other polygon's plane, by the greatest: below it, all that reaches the corner
/// changes too fast for places to tell.
pub const STEEP: f64 = 1e-3;

/// Error of visible and hidden together over all cells, relative to the tolerance.
const OF_WHOLE: f64 = 0.01;

/// Error of a facet that is not cut along kinks, relative to the tolerance. With 0 all are cut, and rows of a room of 3,200 patches,
/// asked for 1e-4, were off by 4.4e-5 (RMS) instead of 7.0e-5 when all parts came here, and with 1 by 9.7e-5.
const UNCUT: f64 = 0.6;

/// What all parts of a leaf share that look at one target past the same panels. They lie in one plane, and from there
/// bodies look alike, as do the lines where what is seen has kinks, and the corners where parts meet.
pub struct Stage<'a> {
    setting: Setting<'a>,
    bodies: Vec<Body>,
    /// The body that a panel belongs to.
    body_of: Vec<u16>,
    sides: Sides,
    /// Where from, and the normal there.
    middle: DVec3,
    normal: DVec3,
    /// Where to.
    to: Facet,
    /// The part that it is, if no corner of it was cut off.
    inner: Option<&'a Part>,
}

/// What of a polygon lies above a plane; none if nothing does.
pub fn above(polygon: &[DVec3], plane: Option<(DVec3, f64)>) -> Option<Loop> {
    let mut left: Loop = polygon.into();
    plane.is_none_or(|(normal, offset)| keep_above(&mut left, normal, offset)).then_some(left)
}

impl<'a> Stage<'a> {
    /// Before a target that is `inner` or what of it lies above the plane with `normal`, in which `region` holds all parts that
    /// look; none if the target is too thin a strip or too much stands between for a list.
    pub fn new(
        region: &[DVec3],
        normal: DVec3,
        inner: &'a Part,
        setting: Setting<'a>,
        sights: &mut Sights,
    ) -> Option<Stage<'a>> {
        u16::try_from(setting.panels.len()).ok()?;
        let to = Facet::new(setting.target.to_vec()).ok()?;
        let (bodies, body_of) = Body::of(setting, region);
        let sides = Sides::new(region, &bodies, setting);
        let middle = region.iter().sum::<DVec3>() / region.len() as f64;
        let inner = (inner.shape.corners() == setting.target).then_some(inner);
        sights.clear(region);
        Some(Stage { setting, bodies, body_of, sides, middle, normal, to, inner })
    }

    /// A_i F_ij of a part past the panels listed; `tolerance` and the answer in m², `whole` is the answer without panels.
    /// None if too thin a strip of it sees the target.
    pub fn mixed(
        &mut self,
        (shadows, sights): (&mut Shadows, &mut Sights),
        outer: &Part,
        list: &[u16],
        whole: Exchange,
        tolerance: f64,
    ) -> Option<Exchange> {
        let from =
            above(outer.shape.corners(), Some((self.to.normal(), self.to.normal().dot(self.setting.target[0]))))?;
        let area = 0.5 * twice_area(&from).length();
        if area <= 0.0 {
            return None;
        }
        let of_whole = OF_WHOLE * tolerance / area;
        // Most facets see smoothly enough as they are: places at corners, which neighbours share, and one in the middle tell.
        let pieces = self.sides.uncut((&from, outer.moments.radius), &self.bodies, self.setting);
        let mut view = View { shadows, stage: self, from: &from, of_whole };
        let goal = Goal { whole: whole.value, tolerance: UNCUT * tolerance, may_divide: false };
        if let Some(found) = integrate(&pieces, goal, (&mut view, sights), list) {
            return Some(found.within(whole));
        }
        let pieces = self.sides.cut((&from, outer.moments.radius), &self.bodies, self.setting);
        let mut view = View { shadows, stage: self, from: &from, of_whole };
        let goal = Goal { whole: whole.value, tolerance, may_divide: true };
        integrate(&pieces, goal, (&mut view, sights), list).map(|found| found.within(whole))
    }
}

/// How far the nearest panel stands from a place, m.
pub fn distance<'a>(place: DVec3, panels: impl Iterator<Item = &'a Panel>) -> f64 {
    panels.map(|panel| panel.distance(place)).fold(f64::INFINITY, f64::min)
}

/// The most that panels might hide from the centre of a cell with a normal, seen from any of its places: what of each lies in
/// the shaft.
pub fn possible<'a>(
    mut shaft: Shaft,
    (cell, normal): (&[DVec3], DVec3),
    panels: impl Iterator<Item = &'a Panel>,
) -> f64 {
    let centre = cell.iter().sum::<DVec3>() / cell.len() as f64;
    let mut sum = 0.0;
    for panel in panels {
        let mut part = shaft.part_of(panel);
        if panel.height(centre) < 0.0 {
            part.reverse();
        }
        if part.len() >= 3 {
            sum += lambert(centre, normal, &part);
        }
    }
    sum
}

/// What a part sees of another past panels.
struct View<'a, 'b> {
    shadows: &'a mut Shadows,
    stage: &'a Stage<'b>,
    /// Where from.
    from: &'a [DVec3],
    /// Error of visible and hidden together over a cell, by its area.
    of_whole: f64,
}

impl View<'_, '_> {
    fn shaft<'a>(&'a self, cell: &'a [DVec3]) -> Shaft<'a> {
        let Stage { setting, normal, to, .. } = self.stage;
        Shaft::new([cell, setting.target], [*normal, to.normal()], setting.touch)
    }

    fn inside(&self, place: DVec3) -> DVec3 {
        place + INSIDE * (self.stage.middle - place)
    }
}

impl Shaded for View<'_, '_> {
    fn sight(&mut self, side: u16, place: DVec3, list: &[u16]) -> Sight {
        let Stage { setting, body_of, sides, normal, .. } = self.stage;
        let mut bodies: SmallVec<[u16; 16]> = list.iter().map(|k| body_of[*k as usize]).collect();
        bodies.sort_unstable();
        bodies.dedup();
        let seen = sides.seen(side);
        let varying = bodies.iter().filter(|k| matches!(seen[**k as usize], Seen::Varying));
        let body = |k: &u16| {
            let occluder = Occluder::new(self.stage.bodies[*k as usize], *setting, place)?;
            occluder.is_before(place, setting.touch).then_some((*k, occluder))
        };
        let varying: Vec<(u16, Occluder)> = varying.filter_map(body).collect();
        let fixed = bodies.iter().filter_map(|k| match &seen[*k as usize] {
            Seen::As(occluder) => Some((*k, occluder)),
            _ => None,
        });
        let occluders = fixed.chain(varying.iter().map(|(k, occluder)| (*k, occluder)));
        self.shadows.sight((self.inside(place), *normal), setting.target, occluders, setting.touch)
    }

    fn all(&mut self, place: DVec3) -> f64 {
        lambert(self.inside(place), self.stage.normal, self.stage.setting.target)
    }

    fn before(&mut self, corners: &[DVec3], list: &[u16]) -> List {
        let mut shaft = self.shaft(corners);
        let stands = |k: &u16| shaft.stands(self.stage.setting.panels[*k as usize], Look::Rough) != Stands::Aside;
        list.iter().copied().filter(stands).collect()
    }

    fn is_clear(&mut self, corners: &[DVec3], list: &[u16]) -> bool {
        let mut shaft = self.shaft(corners);
        list.iter().all(|k| shaft.stands(self.stage.setting.panels[*k as usize], Look::Close) == Stands::Aside)
    }

    fn possible(&mut self, corners: &[DVec3], list: &[u16], without: u64) -> f64 {
        let Stage { setting, body_of, normal, .. } = self.stage;
        let others = list.iter().filter(|k| bit(body_of[**k as usize]) & without == 0);
        possible(self.shaft(corners), (corners, *normal), others.map(|k| setting.panels[*k as usize]))
    }

    fn whole(&mut self, cell: &Frame) -> Exchange {
        let tolerance = self.of_whole * cell.area();
        match self.stage.inner {
            Some(inner) => clear_frame(cell, self.stage.normal, inner, tolerance),
            None => Facet::new(cell.corners().to_vec())
                .map_or(Exchange::default(), |cell| closed_form(&cell, &self.stage.to, tolerance)),
        }
    }

    fn is_steep(&self) -> bool {
        let heights = self.from.iter().map(|x| self.stage.to.height(*x));
        let (low, high) = heights.fold((f64::INFINITY, 0.0f64), |(low, high), h| (low.min(h), high.max(h)));
        low < STEEP * high
    }
}
