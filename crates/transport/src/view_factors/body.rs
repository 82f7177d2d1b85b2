//! Bodies: what throws one convex shadow, a panel or a convex solid.
//!
//! From a place outside, a solid hides what lies beyond the faces that look towards the place and within the planes
//! through the place and the edges where those faces meet the others: its outline. Over a piece of a polygon that no
//! plane of a face crosses, these faces and edges are the same.

use super::panel::Panel;
use super::solid::{Obstacles, Outside, Solid};
use glam::DVec3;
use smallvec::SmallVec;

/// What stands before a convex polygon.
#[derive(Clone, Copy)]
pub struct Setting<'a> {
    /// Panels that may hide a part.
    pub panels: &'a [&'a Panel],
    /// All panels, and the solids that they close around.
    pub obstacles: Obstacles<'a>,
    /// Corners of the polygon.
    pub target: &'a [DVec3],
    /// Distance below which points lie on a plane.
    pub touch: f64,
}

/// Panels that throw one shadow, by their place in a list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Body {
    /// A panel.
    Panel(u16),
    /// A solid.
    Solid(u32),
}

impl Body {
    /// The bodies that the panels belong to, and which each does. A solid is taken as one where all of `from` is
    /// outside.
    pub fn of(Setting { panels, obstacles, touch, .. }: Setting, from: &[DVec3]) -> (Vec<Body>, Vec<u16>) {
        let mut outside = Outside::new(obstacles, from, touch);
        let mut bodies: Vec<Body> = Vec::new();
        let mut body_of = Vec::with_capacity(panels.len());
        for (k, panel) in panels.iter().enumerate() {
            let body = match panel.solid {
                Some(solid) if obstacles.solids[solid as usize].is_convex && outside.of(solid) => Body::Solid(solid),
                _ => Body::Panel(k as u16),
            };
            let known = bodies.iter().position(|b| *b == body).unwrap_or(bodies.len());
            if known == bodies.len() {
                bodies.push(body);
            }
            body_of.push(known as u16);
        }
        (bodies, body_of)
    }

    /// Whether it is a round solid.
    pub fn is_round(self, obstacles: Obstacles) -> bool {
        matches!(self, Body::Solid(solid) if obstacles.solids[solid as usize].is_round())
    }

    /// Planes of its faces and edges, those of a panel from both sides.
    pub fn planes(self, Setting { panels, obstacles, .. }: Setting) -> usize {
        match self {
            Body::Panel(k) => 2 + 2 * panels[k as usize].corners.len(),
            Body::Solid(solid) => {
                let Solid { faces, edges, .. } = &obstacles.solids[solid as usize];
                faces.len() + edges.len()
            }
        }
    }

    /// Its faces.
    pub fn faces<'a>(self, setting: Setting<'a>) -> impl Iterator<Item = &'a Panel> {
        let Setting { panels, obstacles, .. } = setting;
        let (panel, solid) = match self {
            Body::Panel(k) => (Some(panels[k as usize]), None),
            Body::Solid(solid) => (None, Some(&obstacles.solids[solid as usize].faces)),
        };
        panel.into_iter().chain(solid.into_iter().flatten().map(move |face| &obstacles.panels[*face as usize]))
    }
}

/// A body as seen from anywhere in a piece of a polygon.
#[derive(Clone, Debug, Default)]
pub struct Occluder {
    /// The planes of its faces that look towards the piece, normals away from it.
    pub faces: SmallVec<[(DVec3, f64); 3]>,
    /// Those of them that the target crosses.
    pub cuts: SmallVec<[(DVec3, f64); 3]>,
    /// Its outline, counter-clockwise as seen from the piece.
    pub edges: SmallVec<[Line; 6]>,
    /// Whether it is a round solid.
    pub is_round: bool,
}

impl Occluder {
    /// A body as seen from `place`; none if it hides nothing of the target from there.
    pub fn new(body: Body, setting: Setting, place: DVec3) -> Option<Occluder> {
        let mut occluder = match body {
            Body::Panel(k) => Occluder::panel(setting.panels[k as usize], place),
            Body::Solid(solid) => Occluder::solid(solid, setting.obstacles, place),
        };
        for &(beyond, offset) in &occluder.faces {
            let heights = || setting.target.iter().map(|q| beyond.dot(*q) - offset);
            if heights().all(|h| h <= setting.touch) {
                return None;
            }
            if heights().any(|h| h < 0.0) {
                occluder.cuts.push((beyond, offset));
            }
        }
        Some(occluder)
    }

    /// Whether a place lies before one of its faces, by more than `touch`.
    pub fn is_before(&self, place: DVec3, touch: f64) -> bool {
        self.faces.iter().any(|(beyond, offset)| beyond.dot(place) < offset - touch)
    }

    /// The same without the edges that cut nothing off, whatever place of `region` is looked from; none if it hides nothing
    /// from any. Four points x, p, q, y span a volume that is linear in each, so corners tell of all that is between them.
    pub fn before(mut self, region: &[DVec3], setting: Setting) -> Option<Occluder> {
        let mut hides = true;
        self.edges.retain(|Line { ends: [p, q], .. }| {
            let margin = setting.touch * p.distance_squared(*q);
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            for y in setting.target {
                let normal = (*p - *y).cross(*q - *y);
                for x in region {
                    let volume = normal.dot(*x - *y);
                    (low, high) = (low.min(volume), high.max(volume));
                }
            }
            hides &= high >= 0.0;
            low < margin
        });
        hides.then_some(self)
    }

    /// A panel: its side that looks towards the place.
    fn panel(panel: &Panel, place: DVec3) -> Occluder {
        let is_above = panel.height(place) > 0.0;
        let side = if is_above { -1.0 } else { 1.0 };
        let n = panel.corners.len();
        let edge = |i: usize| {
            let (p, q) = (panel.corners[i], panel.corners[(i + 1) % n]);
            Line::new(if is_above { [p, q] } else { [q, p] })
        };
        let faces = SmallVec::from_iter([(side * panel.normal, side * panel.offset)]);
        Occluder { faces, edges: (0..n).map(edge).collect(), ..Occluder::default() }
    }

    /// A solid: its faces that look towards the place, and the edges where they meet the others.
    fn solid(solid: u32, obstacles: Obstacles, place: DVec3) -> Occluder {
        let solid = &obstacles.solids[solid as usize];
        let panels = || solid.faces.iter().map(|face| &obstacles.panels[*face as usize]);
        let front: SmallVec<[bool; 64]> = panels().map(|panel| panel.height(place) > 0.0).collect();
        let faces = panels().zip(&front).filter(|(_, is_front)| **is_front);
        let edges = solid.edges.iter().filter(|(face, beyond, _)| front[*face as usize] && !front[*beyond as usize]);
        Occluder {
            faces: faces.map(|(panel, _)| (-panel.normal, -panel.offset)).collect(),
            edges: edges.map(|(_, _, edge)| *edge).collect(),
            is_round: solid.is_round(),
            ..Occluder::default()
        }
    }
}

/// An edge.
#[derive(Clone, Copy, Debug, Default)]
pub struct Line {
    /// Its ends.
    pub ends: [DVec3; 2],
    /// The unit vector along it.
    pub along: DVec3,
}

impl Line {
    /// The edge between two ends.
    pub fn new(ends: [DVec3; 2]) -> Line {
        Line { ends, along: (ends[1] - ends[0]).normalize_or_zero() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::view_factors::visible::{Shadows, Sight};
    use radiosity_trace::sampling::Random;

    /// Panels at random places between two squares: what is seen of one from the other is the same without the edges that are
    /// left out, of which there are some, and panels that are left out hide nothing.
    #[test]
    fn edges_that_cut_nothing_are_left_out() {
        let mut random = Random::new(5);
        let mut unit = || 2.0 * random.next_unit() - 1.0;
        let p = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let region = [p(-0.5, -0.5, 0.), p(0.5, -0.5, 0.), p(0.5, 0.5, 0.), p(-0.5, 0.5, 0.)];
        let target = [p(-0.2, 0.5, 3.), p(0.5, 0.5, 3.), p(0.5, -0.2, 3.), p(-0.2, -0.2, 3.)];
        let (mut left_out, mut partly) = ([0, 0], 0);
        for _ in 0..400 {
            let (low, width) = ([unit(), unit()], [1.0 + unit(), 1.0 + unit()]);
            let (tilt, z) = (0.5 * unit(), 1.5 + unit());
            let corner = |u: f64, v: f64| p(low[0] + u * width[0], low[1] + v * width[1], z + tilt * (u - 0.5));
            let corners = vec![corner(0., 0.), corner(1., 0.), corner(1., 1.), corner(0., 1.)];
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
            let panel = Panel::new(corners, normal);
            let obstacles = Obstacles { panels: &[], solids: &[] };
            let setting = Setting { panels: &[&panel], obstacles, target: &target, touch: 1e-7 };
            let Some(plain) = Occluder::new(Body::Panel(0), setting, DVec3::ZERO) else { continue };
            let fewer = plain.clone().before(&region, setting);
            left_out[0] += usize::from(fewer.is_none());
            left_out[1] += fewer.as_ref().map_or(0, |fewer| plain.edges.len() - fewer.edges.len());
            for _ in 0..20 {
                let place = (p(0.5 * unit(), 0.5 * unit(), 0.0), DVec3::Z);
                let visible = |occluder: Option<&Occluder>| match Shadows::default().sight(
                    place,
                    &target,
                    occluder.map(|o| (0, o)).into_iter(),
                    1e-7,
                ) {
                    Sight::Whole => f64::INFINITY,
                    Sight::Nothing(_) => 0.0,
                    Sight::Partly { factors: [visible, _], .. } => visible,
                };
                let (all, found) = (visible(Some(&plain)), visible(fewer.as_ref()));
                assert!(all == found || (all - found).abs() < 1e-14, "{all} {found}");
                partly += usize::from(all > 0.0 && all.is_finite());
            }
        }
        assert!(left_out[0] > 40 && left_out[1] > 300 && partly > 1000, "{left_out:?} {partly}");
    }
}
