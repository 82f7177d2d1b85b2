//! Solids: panels that close around a body, normals outwards.
//!
//! Light that meets a body from outside meets a face that looks towards where it comes from. So of a body only the
//! faces before a place need be looked at from there, half of them, unless the place lies within. Of a convex one, all that they
//! hide is one convex shadow.

use super::body::Line;
use super::panel::Panel;
use crate::polygon::solid_angle;
use glam::DVec3;
use radiosity_scene::Weld;
use rustc_hash::FxHashMap;

/// A closed body.
#[derive(Clone, Debug, Default)]
pub struct Solid {
    /// Whether it is convex.
    pub is_convex: bool,
    /// Its least and greatest coordinates.
    bounds: [DVec3; 2],
    /// Its faces, by index of the panel.
    pub faces: Vec<u32>,
    /// The edges of each face, counter-clockwise about its normal: the face and the one beyond, by their places in `faces`, and both
    /// ends.
    pub edges: Vec<(u16, u16, Line)>,
}

/// Faces of a solid above which it is round: where outlines change, they hardly do.
const ROUND: usize = 32;

impl Solid {
    /// Whether what it hides is smooth in the place that it is looked from, though the faces and edges that hide change all the
    /// time.
    pub fn is_round(&self) -> bool {
        self.is_convex && self.faces.len() > ROUND
    }
}

/// The panels of a scene and its solids.
#[derive(Clone, Copy)]
pub struct Obstacles<'a> {
    /// All panels.
    pub panels: &'a [Panel],
    /// The bodies that some of them close around.
    pub solids: &'a [Solid],
}

/// Marks the panels that are faces of solids; answers with the faces of each.
pub fn find_solids(panels: &mut [Panel], touch: f64) -> Vec<Solid> {
    let outlines = outlines(panels, WELD * touch);
    let mut edges: FxHashMap<[u32; 2], Vec<u32>> = FxHashMap::default();
    for (k, outline) in outlines.iter().enumerate() {
        for [(a, _), (b, _)] in around(outline) {
            edges.entry([a, b]).or_default().push(k as u32);
        }
    }
    let mut seen = vec![false; panels.len()];
    let mut solids = Vec::new();
    for start in 0..panels.len() {
        if seen[start] {
            continue;
        }
        seen[start] = true;
        let (mut faces, mut of_edges, mut next, mut closed) = (vec![start as u32], Vec::new(), 0, true);
        while next < faces.len() {
            let face = faces[next];
            next += 1;
            for [(a, p), (b, q)] in around(&outlines[face as usize]) {
                // Across each edge lies one other face, which runs along it the other way.
                let own = edges.get(&[a, b]).map_or(0, Vec::len);
                match edges.get(&[b, a]).map(Vec::as_slice) {
                    Some([other]) if own == 1 => {
                        of_edges.push((face, *other, Line::new([p, q])));
                        if !std::mem::replace(&mut seen[*other as usize], true) {
                            faces.push(*other);
                        }
                    }
                    _ => closed = false,
                }
            }
        }
        if !closed || faces.len() < 4 || faces.len() > MOST_FACES {
            continue;
        }
        let corners = || faces.iter().flat_map(|face| &panels[*face as usize].corners);
        let is_convex = faces.iter().all(|face| corners().all(|c| panels[*face as usize].height(*c) <= touch));
        if is_convex || has_the_outside_before_it(panels, &faces, touch) {
            let low = corners().fold(DVec3::INFINITY, |low, c| low.min(*c));
            let high = corners().fold(DVec3::NEG_INFINITY, |high, c| high.max(*c));
            let number: FxHashMap<u32, u16> = faces.iter().zip(0..).map(|(face, number)| (*face, number)).collect();
            let edges =
                of_edges.into_iter().map(|(face, beyond, line)| (number[&face], number[&beyond], line)).collect();
            for face in &faces {
                panels[*face as usize].solid = Some(solids.len() as u32);
            }
            solids.push(Solid { is_convex, bounds: [low, high], faces, edges });
        }
    }
    solids
}

/// The corners of each panel with their numbers. Those nearer to each other than `reach` have one number, and follow each other
/// only once.
fn outlines(panels: &[Panel], reach: f64) -> Vec<Vec<(u32, DVec3)>> {
    let (mut weld, mut vertices) = (Weld::new(reach), Vec::new());
    let outline = |panel: &Panel| {
        let number = |p: &DVec3| (weld.vertex(&mut vertices, *p), *p);
        let mut outline: Vec<(u32, DVec3)> = panel.corners.iter().map(number).collect();
        outline.dedup_by_key(|(number, _)| *number);
        if outline.len() > 1 && outline.first().map(|p| p.0) == outline.last().map(|p| p.0) {
            outline.pop();
        }
        outline
    };
    panels.iter().map(outline).collect()
}

/// The edges of an outline.
fn around<T: Copy>(outline: &[T]) -> impl Iterator<Item = [T; 2]> {
    (0..outline.len()).map(|i| [outline[i], outline[(i + 1) % outline.len()]])
}

/// Whether each of some faces, which close around something, has the outside of it before it: from there all of them turn about the
/// place as often one way as the other.
fn has_the_outside_before_it(panels: &[Panel], faces: &[u32], touch: f64) -> bool {
    faces.iter().all(|face| {
        let Panel { corners, normal, .. } = &panels[*face as usize];
        let place = corners.iter().sum::<DVec3>() / corners.len() as f64 + BEFORE * touch * *normal;
        let turn = |face: &u32| {
            let corners = &panels[*face as usize].corners;
            let of = |k: usize| solid_angle([corners[0], corners[k], corners[k + 1]].map(|p| p - place));
            (1..corners.len() - 1).map(of).sum::<f64>()
        };
        faces.iter().map(turn).sum::<f64>().abs() < 0.5
    })
}

/// Distance before a face, over that below which points lie on its plane.
const BEFORE: f64 = 4.0;

/// Distance below which corners are one, over that from a plane.
const WELD: f64 = 8.0;

/// Faces of a solid at most: each is held against all.
const MOST_FACES: usize = 4096;

/// Places, and which solids they lie outside of.
pub struct Outside<'a> {
    obstacles: Obstacles<'a>,
    places: &'a [DVec3],
    /// Distance below which points lie on a plane, m.
    touch: f64,
    /// What was asked last: faces of a solid follow each other.
    last: Option<(u32, bool)>,
}

impl<'a> Outside<'a> {
    pub fn new(obstacles: Obstacles<'a>, places: &'a [DVec3], touch: f64) -> Outside<'a> {
        Outside { obstacles, places, touch, last: None }
    }

    /// Whether all places are known to lie outside of a solid: before one of its faces, or of a box around it.
    pub fn of(&mut self, solid: u32) -> bool {
        if let Some((_, is_outside)) = self.last.filter(|(last, _)| *last == solid) {
            return is_outside;
        }
        let Outside { obstacles: Obstacles { panels, solids }, places, touch, .. } = *self;
        let Solid { is_convex, bounds: [low, high], faces, .. } = &solids[solid as usize];
        let is_before = |face: &u32| places.iter().all(|x| panels[*face as usize].height(*x) >= -touch);
        let is_beyond = |axis: usize| {
            let (low, high) = (low[axis] + touch, high[axis] - touch);
            places.iter().all(|x| x[axis] <= low) || places.iter().all(|x| x[axis] >= high)
        };
        let is_outside = (0..3).any(is_beyond) || (*is_convex && faces.iter().any(is_before));
        self.last = Some((solid, is_outside));
        is_outside
    }

    /// Whether a solid's panel can be left out as seen from the places: it looks away from them, and they lie outside.
    pub fn looks_away(&mut self, panel: &Panel) -> bool {
        let Some(solid) = panel.solid else { return false };
        self.places.iter().all(|x| panel.height(*x) <= self.touch) && self.of(solid)
    }
}

#[cfg(test)]
mod tests {
    use super::super::panel::{Planes, panels};
    use super::*;
    use radiosity_scene::{Enclosure, Facet};

    fn cube(outwards: bool) -> Vec<Panel> {
        let corner = |k: usize| DVec3::from_array(std::array::from_fn(|axis| f64::from(u8::from(k >> axis & 1 == 1))));
        let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        faces
            .iter()
            .map(|face| {
                let mut corners: Vec<DVec3> = face.iter().map(|k| corner(*k)).collect();
                if !outwards {
                    corners.reverse();
                }
                let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
                Panel::new(corners, normal)
            })
            .collect()
    }

    #[test]
    fn a_cube_is_a_solid_a_room_and_an_open_box_are_not() {
        let mut panels = cube(true);
        let solids = find_solids(&mut panels, 1e-7);
        assert_eq!(solids.len(), 1);
        let obstacles = Obstacles { panels: &panels, solids: &solids };
        let away = |x: DVec3| panels.iter().filter(|p| Outside::new(obstacles, &[x], 1e-7).looks_away(p)).count();
        assert_eq!(away(DVec3::new(3.0, 4.0, 5.0)), 3);
        assert_eq!(away(DVec3::new(0.5, 0.5, 5.0)), 5);
        assert_eq!(away(DVec3::splat(0.5)), 0);
        assert!(find_solids(&mut cube(false), 1e-7).is_empty());
        assert!(find_solids(&mut cube(true)[1..], 1e-7).is_empty());
    }

    /// A mesh of rings of `ring` corners each, as a file with six digits has it, whose first and last rings are one or points.
    fn rings(count: usize, ring: usize, at: impl Fn(f64, f64) -> DVec3) -> Vec<Panel> {
        let rounded = |k: usize, i: usize| {
            let (u, v) = (k as f64 / count as f64, (i % ring) as f64 / ring as f64);
            (at(u, v) * 1e6).round() / 1e6
        };
        let mut enclosure = Enclosure::default();
        for (k, i) in (0..count).flat_map(|k| (0..ring).map(move |i| (k, i))) {
            let [a, b, c, d] = [[k, i], [k + 1, i], [k + 1, i + 1], [k, i + 1]].map(|[k, i]| rounded(k, i));
            for triangle in [[a, b, c], [a, c, d]] {
                Facet::new(triangle.to_vec()).into_iter().for_each(|facet| enclosure.add("", facet));
            }
        }
        panels(&enclosure, &mut Planes::new(7.0, 3.5e-6))
    }

    #[test]
    fn round_bodies_of_files_are_solids() {
        use std::f64::consts::{PI, TAU};
        let ball = |u: f64, v: f64| {
            let (height, radius) = (0.1 * (PI * u).cos(), 0.1 * (PI * u).sin());
            DVec3::new(2.5 + radius * (TAU * v).cos(), 1.9 + radius * (TAU * v).sin(), 2.2 + height)
        };
        let mut panels = rings(12, 24, ball);
        let solids = find_solids(&mut panels, 3.5e-6);
        assert!(solids.len() == 1 && solids[0].is_round());
        assert!(panels.iter().all(|panel| panel.solid == Some(0)));

        let ring = |u: f64, v: f64| {
            let radius = 0.3 + 0.1 * (TAU * v).cos();
            DVec3::new(2.5 + radius * (TAU * u).cos(), 1.9 + radius * (TAU * u).sin(), 2.2 + 0.1 * (TAU * v).sin())
        };
        let turned = |u: f64, v: f64| ring(1.0 - u, v);
        for (mut panels, closes) in [(rings(16, 8, ring), true), (rings(16, 8, turned), false)] {
            let solids = find_solids(&mut panels, 3.5e-6);
            assert_eq!(solids.len(), usize::from(closes));
            assert!(solids.iter().all(|solid| !solid.is_convex));
            let obstacles = Obstacles { panels: &panels, solids: &solids };
            // From beside it about half look away; in its hole it is not told from its inside.
            let away = |x: DVec3| panels.iter().filter(|p| Outside::new(obstacles, &[x], 1e-7).looks_away(p)).count();
            let beside = away(DVec3::new(4.0, 1.0, 1.0));
            assert_eq!(beside > panels.len() / 4 && beside < 3 * panels.len() / 4, closes, "{beside}");
            assert_eq!(away(DVec3::new(2.5, 1.9, 2.2)), 0);
        }
    }
}
