//! Pairs with something between them: the form factor of what is visible, exact from each point of one part, averaged
//! over its points.
//!
//! From a point, panels are cut out of the other part exactly, so shadow edges on it cost nothing. Over the points the
//! visible factor is continuous with kinks, and cells are divided where it bends. The part that lies farther from the
//! panels, by its own size, is divided: what stands close to a part throws sharp shadows there, which only the exact
//! side resolves.

use super::adaptive::{Before, List, Shaded, integrate};
use super::clear::Exchange;
use super::panel::Panel;
use super::part::Part;
use super::shaft::{Look, Shaft, Stands};
use super::solid::{Obstacles, hides, looks_away};
use super::visible::{Loop, Shadows, Sight, keep_above, lambert};
use crate::pair::exact::exact;
use glam::DVec3;
use radiosity_scene::Facet;

/// Places are drawn this much towards the middle: on an edge that both parts share, a factor has no one value.
const INSIDE: f64 = 1e-7;

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
    let middle = from.centroid();
    Shadows::sort(middle, outer.shape.normal(), &target, panels, touch);
    let all: List = (0..count).collect();
    let mut view =
        View { shadows, panels, obstacles, middle, normal: outer.shape.normal(), target: &target, to: &to, touch };
    let found = integrate(&from, (whole.value, tolerance), &mut view, &all);
    // What is visible, or what all would be without what is hidden: whichever is known better.
    let [(visible, of_visible), (hidden, of_hidden)] = [0, 1].map(|k| (found.values[k], found.errors[k]));
    let (value, error) = if of_visible <= of_hidden + whole.error {
        (visible, of_visible)
    } else {
        (whole.value - hidden, of_hidden + whole.error)
    };
    Exchange { value: value.clamp(0.0, whole.value), error }
}

/// How far the nearest panel stands from a part, by the part's size.
fn distance(part: &Part, panels: &[&Panel]) -> f64 {
    let centre = part.shape.centroid();
    panels.iter().map(|panel| panel.distance(centre)).fold(f64::INFINITY, f64::min) / part.radius
}

/// What a part sees of another past panels.
struct View<'a> {
    shadows: &'a mut Shadows,
    panels: &'a [&'a Panel],
    obstacles: Obstacles<'a>,
    /// Where from.
    middle: DVec3,
    normal: DVec3,
    /// Where to.
    target: &'a [DVec3],
    to: &'a Facet,
    touch: f64,
}

impl View<'_> {
    fn shaft<'a>(&'a self, cell: &'a [DVec3]) -> Shaft<'a> {
        Shaft::new([cell, self.target], [self.normal, self.to.normal()], self.touch)
    }
}

impl Shaded for View<'_> {
    fn sight(&mut self, x: DVec3, list: &[u16]) -> Sight {
        let x = x + INSIDE * (self.middle - x);
        self.shadows.sight((x, self.normal), self.target, (self.panels, list), self.touch)
    }

    fn before(&mut self, cell: &[DVec3], list: &[u16]) -> Before {
        let mut left = List::new();
        let mut shaft = self.shaft(cell);
        for &k in list {
            match shaft.stands(self.panels[k as usize], Look::Rough) {
                Stands::Aside => {}
                Stands::Between => left.push(k),
                Stands::Across => return Before::All,
            }
        }
        if left.is_empty() { Before::Nothing } else { Before::Some(left) }
    }

    fn is_clear(&mut self, cell: &[DVec3], list: &[u16]) -> bool {
        let mut shaft = self.shaft(cell);
        list.iter().all(|k| shaft.stands(self.panels[*k as usize], Look::Close) == Stands::Aside)
    }

    fn is_hidden(&mut self, cell: &[DVec3], list: &[u16]) -> bool {
        let mut solids: Vec<u32> = list.iter().filter_map(|k| self.panels[*k as usize].solid).collect();
        solids.dedup();
        solids.into_iter().any(|solid| hides(self.obstacles, solid, [cell, self.target]))
    }

    fn possible(&mut self, cell: &[DVec3], list: &[u16]) -> f64 {
        let centre = cell.iter().sum::<DVec3>() / cell.len() as f64;
        let mut shaft = self.shaft(cell);
        let mut sum = 0.0;
        for &k in list {
            let panel = self.panels[k as usize];
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

    fn whole(&mut self, cell: &[DVec3]) -> f64 {
        Facet::new(cell.to_vec()).map_or(0.0, |cell| exact(&cell, self.to))
    }
}
