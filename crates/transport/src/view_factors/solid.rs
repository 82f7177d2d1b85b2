//! Solids: panels that close around a convex body, normals outwards.
//!
//! Light that meets a body from outside meets a face that looks towards where it comes from. So of a body only the
//! faces before a place need be looked at from there, half of them, unless the place lies within.

use super::body::Line;
use super::panel::Panel;
use glam::DVec3;
use rustc_hash::FxHashMap;

/// A convex body.
#[derive(Clone, Debug, Default)]
pub struct Solid {
    /// Its faces, by index of the panel.
    pub faces: Vec<u32>,
    /// The edges of each face, counter-clockwise about its normal: the face, the one beyond, both ends.
    pub edges: Vec<(u32, u32, Line)>,
}

/// The panels of a scene and its solids.
#[derive(Clone, Copy)]
pub struct Obstacles<'a> {
    /// All panels.
    pub panels: &'a [Panel],
    /// The convex bodies that some of them close around.
    pub solids: &'a [Solid],
}

/// Marks the panels that are faces of convex solids; answers with the faces of each.
pub fn find_solids(panels: &mut [Panel], touch: f64) -> Vec<Solid> {
    // Corners within some roundings of each other are one; where a border of the grid parts them, a solid is
    // overlooked.
    let cell = 16.0 * touch;
    let key = |p: &DVec3| p.to_array().map(|x| (x / cell).round() as i64);
    let mut edges: FxHashMap<[[i64; 3]; 2], Vec<u32>> = FxHashMap::default();
    for (k, panel) in panels.iter().enumerate() {
        for (i, a) in panel.corners.iter().enumerate() {
            let b = &panel.corners[(i + 1) % panel.corners.len()];
            edges.entry([key(a), key(b)]).or_default().push(k as u32);
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
            let panel = &panels[face as usize];
            next += 1;
            for (i, a) in panel.corners.iter().enumerate() {
                let b = &panel.corners[(i + 1) % panel.corners.len()];
                // Across each edge lies one other face, which runs along it the other way.
                let own = edges.get(&[key(a), key(b)]).map_or(0, Vec::len);
                match edges.get(&[key(b), key(a)]).map(Vec::as_slice) {
                    Some([other]) if own == 1 => {
                        of_edges.push((face, *other, Line::new([*a, *b])));
                        if !std::mem::replace(&mut seen[*other as usize], true) {
                            faces.push(*other);
                        }
                    }
                    _ => closed = false,
                }
            }
        }
        let is_convex = || {
            let corners = || faces.iter().flat_map(|f| &panels[*f as usize].corners);
            faces.iter().all(|f| corners().all(|c| panels[*f as usize].height(*c) <= touch))
        };
        if closed && faces.len() >= 4 && faces.len() <= MOST_FACES && is_convex() {
            for face in &faces {
                panels[*face as usize].solid = Some(solids.len() as u32);
            }
            solids.push(Solid { faces, edges: of_edges });
        }
    }
    solids
}

/// Faces of a solid at most: finding out which are before a place must stay cheap.
const MOST_FACES: usize = 32;

/// Whether a solid's panel can be left out as seen from the places `from`: it looks away from them, and they lie
/// outside.
pub fn looks_away(panel: &Panel, obstacles: Obstacles, from: &[DVec3], touch: f64) -> bool {
    let Some(solid) = panel.solid else { return false };
    from.iter().all(|x| panel.height(*x) <= touch) && is_outside(solid, obstacles, from, touch)
}

/// Whether places lie outside of a solid, all before one of its faces.
pub fn is_outside(solid: u32, obstacles: Obstacles, places: &[DVec3], touch: f64) -> bool {
    let is_before = |face: &u32| places.iter().all(|x| obstacles.panels[*face as usize].height(*x) >= -touch);
    obstacles.solids[solid as usize].faces.iter().any(is_before)
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let away = |x: DVec3| panels.iter().filter(|p| looks_away(p, obstacles, &[x], 1e-7)).count();
        assert_eq!(away(DVec3::new(3.0, 4.0, 5.0)), 3);
        assert_eq!(away(DVec3::new(0.5, 0.5, 5.0)), 5);
        assert_eq!(away(DVec3::splat(0.5)), 0);
        assert!(find_solids(&mut cube(false), 1e-7).is_empty());
        assert!(find_solids(&mut cube(true)[1..], 1e-7).is_empty());
    }
}
