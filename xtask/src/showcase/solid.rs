//! Closed solids of triangles, counter-clockwise from outside, and the shapes that a room is made of.
//!
//! A solid is kept welded (one point per corner) so that it can be checked for holes; [`Solid::shaded`] splits the
//! points where an edge is sharper than a crease angle and gives each its normal.

use glam::{DAffine3, DVec2, DVec3};
use std::collections::{BTreeMap, HashMap};
use std::f64::consts::TAU;

/// Triangles over shared points.
#[derive(Clone, Debug, Default)]
pub struct Solid {
    pub points: Vec<DVec3>,
    pub triangles: Vec<[usize; 3]>,
}

/// Triangles with a normal and texture coordinates at each vertex, ready to be written.
#[derive(Clone, Debug, Default)]
pub struct Shaded {
    pub positions: Vec<[f32; 3]>,
    pub normals: Vec<[f32; 3]>,
    /// Empty where the material has no picture.
    pub uvs: Vec<[f32; 2]>,
    pub indices: Vec<u32>,
}

impl Solid {
    /// Adds a planar quadrilateral of existing points, counter-clockwise from the front.
    fn quad(&mut self, [a, b, c, d]: [usize; 4]) {
        self.triangles.extend([[a, b, c], [a, c, d]]);
    }

    /// The parts of both.
    pub fn and(mut self, other: Solid) -> Solid {
        let base = self.points.len();
        self.points.extend(other.points);
        self.triangles.extend(other.triangles.into_iter().map(|t| t.map(|i| i + base)));
        self
    }

    /// All of several solids.
    pub fn all(solids: impl IntoIterator<Item = Solid>) -> Solid {
        solids.into_iter().fold(Solid::default(), Solid::and)
    }

    /// The solid elsewhere; a mirroring transform keeps the outside outside.
    pub fn moved(mut self, to: DAffine3) -> Solid {
        for point in &mut self.points {
            *point = to.transform_point3(*point);
        }
        if to.matrix3.determinant() < 0.0 {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        self
    }

    /// The solid with every point displaced by `shift` of it.
    pub fn displaced(mut self, shift: impl Fn(DVec3) -> DVec3) -> Solid {
        for point in &mut self.points {
            *point += shift(*point);
        }
        self
    }

    /// Splits points at edges sharper than `crease` radians and gives each vertex the mean normal, weighted by
    /// angle, of the faces it stands for (Thürmer & Wüthrich 1998). `map` gives the texture coordinates of a point.
    pub fn shaded(&self, crease: f64, map: Option<&dyn Fn(DVec3) -> DVec2>) -> Shaded {
        let mut around = vec![Vec::new(); self.points.len()];
        for (face, triangle) in self.triangles.iter().enumerate() {
            let corners = triangle.map(|i| self.points[i]);
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
            for k in 0..3 {
                let (to_next, to_last) = (corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]);
                around[triangle[k]].push((face, normal, to_next.angle_between(to_last)));
            }
        }
        let mut shaded = Shaded::default();
        let mut known = HashMap::new();
        for (face, triangle) in self.triangles.iter().enumerate() {
            for &point in triangle {
                let own = around[point].iter().find(|f| f.0 == face).map_or(DVec3::Y, |f| f.1);
                let smooth = around[point].iter().filter(|f| f.1.dot(own) >= crease.cos() - 1e-9);
                let sum: DVec3 = smooth.map(|&(_, normal, angle)| normal * angle).sum();
                let normal = sum.try_normalize().unwrap_or(own).as_vec3().to_array();
                let index = *known.entry((point, normal.map(f32::to_bits))).or_insert_with(|| {
                    shaded.positions.push(self.points[point].as_vec3().to_array());
                    shaded.normals.push(normal);
                    shaded.uvs.extend(map.map(|map| map(self.points[point]).as_vec2().to_array()));
                    shaded.positions.len() as u32 - 1
                });
                shaded.indices.push(index);
            }
        }
        shaded
    }

    /// Edges that do not meet exactly one neighbour of the opposite sense; none in a closed solid.
    #[cfg(test)]
    pub fn open_edges(&self) -> usize {
        let mut places = HashMap::new();
        let mut weld = |p: DVec3| {
            let next = places.len();
            *places.entry(p.to_array().map(|x| (x * 1e7).round() as i64)).or_insert(next)
        };
        let mut edges: HashMap<(usize, usize), i32> = HashMap::new();
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|i| weld(self.points[i]));
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *edges.entry((from, to)).or_default() += 1;
                *edges.entry((to, from)).or_default() -= 1;
            }
        }
        edges.values().filter(|&&balance| balance != 0).count()
    }

    /// Enclosed volume: positive when the faces look outwards.
    #[cfg(test)]
    pub fn volume(&self) -> f64 {
        let corners = self.triangles.iter().map(|t| t.map(|i| self.points[i]));
        corners.map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
    }
}

/// A box with its faces parallel to the axes.
pub fn cuboid(lo: [f64; 3], hi: [f64; 3]) -> Solid {
    let corner =
        |i: usize| DVec3::from_array(std::array::from_fn(|axis| if i >> axis & 1 == 1 { hi[axis] } else { lo[axis] }));
    let mut solid = Solid { points: (0..8).map(corner).collect(), triangles: Vec::new() };
    for face in [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]] {
        solid.quad(face);
    }
    solid
}

/// A box whose faces are `cells` × `cells` lattices, to be displaced.
pub fn lattice_cuboid(lo: DVec3, hi: DVec3, cells: [usize; 3]) -> Solid {
    let mut solid = Solid::default();
    let mut known = BTreeMap::new();
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        for (end, i, j) in [0, cells[axis]]
            .into_iter()
            .flat_map(|end| (0..cells[u]).flat_map(move |i| (0..cells[v]).map(move |j| (end, i, j))))
        {
            let mut corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| {
                let mut at = [0; 3];
                (at[axis], at[u], at[v]) = (end, i, j);
                *known.entry(at).or_insert_with(|| {
                    let share = DVec3::from_array(std::array::from_fn(|k| at[k] as f64 / cells[k] as f64));
                    solid.points.push(lo + share * (hi - lo));
                    solid.points.len() - 1
                })
            });
            if end == 0 {
                corners.reverse();
            }
            solid.quad(corners);
        }
    }
    solid
}

/// A solid of revolution about +Y. `profile` lists (radius, height) upwards along the outside; it begins and ends on
/// the axis, or forms a closed loop, counter-clockwise in the (radius, height) plane, when no radius is 0.
pub fn lathe(profile: &[[f64; 2]], segments: usize) -> Solid {
    let mut solid = Solid::default();
    let rings: Vec<Vec<usize>> = profile
        .iter()
        .map(|&[radius, height]| {
            let count = if radius == 0.0 { 1 } else { segments };
            let base = solid.points.len();
            solid.points.extend((0..count).map(|i| {
                let angle = TAU * i as f64 / segments as f64;
                DVec3::new(radius * angle.cos(), height, -radius * angle.sin())
            }));
            (0..segments).map(|i| base + i % count).collect()
        })
        .collect();
    let closing = usize::from(profile.iter().all(|p| p[0] > 0.0));
    for k in 0..rings.len() - 1 + closing {
        let (below, above) = (&rings[k], &rings[(k + 1) % rings.len()]);
        for i in 0..segments {
            let j = (i + 1) % segments;
            let corners = [below[i], below[j], above[j], above[i]];
            for triangle in [[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]] {
                if triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0] {
                    solid.triangles.push(triangle);
                }
            }
        }
    }
    solid
}

/// A sphere about the origin, from a twenty-sided solid whose faces are halved `halvings` times.
pub fn sphere(radius: f64, halvings: usize) -> Solid {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut points: Vec<DVec3> = Vec::new();
    for [a, b] in [[-1.0, golden], [1.0, golden], [-1.0, -golden], [1.0, -golden]] {
        points.extend([DVec3::new(a, b, 0.0), DVec3::new(0.0, a, b), DVec3::new(b, 0.0, a)]);
    }
    // Every three corners at the shortest distance (2) from one another are a face of the icosahedron.
    let near = |a: DVec3, b: DVec3| (a.distance(b) - 2.0).abs() < 1e-9;
    let mut triangles = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let [a, b, c] = [i, j, k].map(|i| points[i]);
                if near(a, b) && near(b, c) && near(c, a) {
                    triangles.push(if (b - a).cross(c - a).dot(a) > 0.0 { [i, j, k] } else { [i, k, j] });
                }
            }
        }
    }
    for _ in 0..halvings {
        let mut middles = HashMap::new();
        triangles = triangles
            .into_iter()
            .flat_map(|[a, b, c]: [usize; 3]| {
                let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(i, j)| {
                    *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                        points.push(points[i].normalize() + points[j].normalize());
                        points.len() - 1
                    })
                });
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    points.iter_mut().for_each(|p| *p = p.normalize() * radius);
    Solid { points, triangles }
}

/// A tube through `stations`: (centre, half width, half thickness), where half width is the vector of one half axis
/// of the elliptic cross-section and half thickness that of the other; right-handed with the direction of travel.
pub fn sweep(stations: &[[DVec3; 3]], sides: usize) -> Solid {
    let mut solid = Solid::default();
    for [centre, width, thickness] in stations {
        solid.points.extend((0..sides).map(|i| {
            let angle = TAU * i as f64 / sides as f64;
            *centre + *width * angle.cos() + *thickness * angle.sin()
        }));
    }
    for k in 0..stations.len() - 1 {
        for i in 0..sides {
            let j = (i + 1) % sides;
            solid.quad([k * sides + i, k * sides + j, (k + 1) * sides + j, (k + 1) * sides + i]);
        }
    }
    for (station, first) in [(stations[0], true), (stations[stations.len() - 1], false)] {
        let hub = solid.points.len();
        solid.points.push(station[0]);
        let base = if first { 0 } else { (stations.len() - 1) * sides };
        for i in 0..sides {
            let (a, b) = (base + i, base + (i + 1) % sides);
            solid.triangles.push(if first { [hub, b, a] } else { [hub, a, b] });
        }
    }
    solid
}

/// A straight round rod.
pub fn rod(from: DVec3, to: DVec3, radius: f64, sides: usize) -> Solid {
    let (width, thickness) = (to - from).normalize().any_orthonormal_pair();
    // The pair is right-handed with the axis: axis × width = thickness.
    sweep(&[from, to].map(|centre| [centre, width * radius, thickness * radius]), sides)
}

/// A thick curved sheet: `front(i, j)` and `back(i, j)` are its two sides over a lattice of `nu` × `nv` cells, i to
/// the right and j upwards seen from the front.
pub fn sheet(
    nu: usize,
    nv: usize,
    front: impl Fn(usize, usize) -> DVec3,
    back: impl Fn(usize, usize) -> DVec3,
) -> Solid {
    let mut solid = Solid::default();
    let at = |i: usize, j: usize| j * (nu + 1) + i;
    let behind = (nu + 1) * (nv + 1);
    for side in [&front as &dyn Fn(usize, usize) -> DVec3, &back] {
        solid.points.extend((0..=nv).flat_map(|j| (0..=nu).map(move |i| (i, j))).map(|(i, j)| side(i, j)));
    }
    for (i, j) in (0..nv).flat_map(|j| (0..nu).map(move |i| (i, j))) {
        let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        solid.quad(corners);
        let [a, b, c, d] = corners.map(|k| k + behind);
        solid.triangles.extend([[a, c, b], [a, d, c]]);
    }
    let bottom = (0..nu).map(|i| (at(i, 0), at(i + 1, 0)));
    let right = (0..nv).map(|j| (at(nu, j), at(nu, j + 1)));
    let top = (0..nu).map(|i| (at(i + 1, nv), at(i, nv)));
    let left = (0..nv).map(|j| (at(0, j + 1), at(0, j)));
    for (a, b) in bottom.chain(right).chain(top).chain(left) {
        solid.quad([b, a, a + behind, b + behind]);
    }
    solid
}

/// A rectangular frame with mitred corners in the XY plane: the bar between two rectangles [x0, y0, x1, y1], from
/// z = `depth[0]` to `depth[1]`.
pub fn frame(outer: [f64; 4], inner: [f64; 4], depth: [f64; 2]) -> Solid {
    let mut solid = Solid::default();
    for z in depth {
        for [x0, y0, x1, y1] in [outer, inner] {
            solid.points.extend([[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(|[x, y]| DVec3::new(x, y, z)));
        }
    }
    // Points: 0..4 outer back, 4..8 inner back, 8..12 outer front, 12..16 inner front.
    for i in 0..4 {
        let j = (i + 1) % 4;
        solid.quad([8 + i, 8 + j, 12 + j, 12 + i]);
        solid.quad([i, 4 + i, 4 + j, j]);
        solid.quad([i, j, 8 + j, 8 + i]);
        solid.quad([4 + i, 12 + i, 12 + j, 4 + j]);
    }
    solid
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn every_shape_is_closed_and_encloses_its_volume() {
        let up = |t: f64| [DVec3::Y * t, DVec3::Z * 0.5, DVec3::X * 0.25];
        let sheet = sheet(3, 2, |i, j| DVec3::new(i as f64, j as f64, 1.0), |i, j| DVec3::new(i as f64, j as f64, 0.0));
        let many = 512;
        for (name, solid, volume) in [
            ("cuboid", cuboid([-1.0, 0.0, 2.0], [1.0, 3.0, 2.5]), 3.0),
            ("lattice", lattice_cuboid(DVec3::ZERO, DVec3::new(1.0, 2.0, 3.0), [2, 3, 4]), 6.0),
            ("frame", frame([0.0, 0.0, 3.0, 2.0], [0.5, 0.5, 2.5, 1.5], [0.0, 0.5]), 2.0),
            ("sheet", sheet, 6.0),
            ("rod", rod(DVec3::ZERO, DVec3::new(0.0, 0.0, 2.0), 0.5, many), PI / 2.0),
            ("sweep", sweep(&[up(0.0), up(1.0)], many), PI / 8.0),
            ("lathe", lathe(&[[0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.0, 2.0]], many), TAU),
            ("ring", lathe(&[[1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0]], many), 3.0 * PI),
            ("sphere", sphere(1.0, 5), 4.0 / 3.0 * PI),
        ] {
            assert_eq!(solid.open_edges(), 0, "{name}");
            // Round shapes are inscribed: 512 sides and five halvings lose less than 1e-3 of the volume.
            assert!((solid.volume() / volume - 1.0).abs() < 1e-3, "{name}: {} is not {volume}", solid.volume());
            let mirrored = solid.moved(DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)));
            assert!(mirrored.volume() > 0.0, "{name}, mirrored");
        }
    }

    #[test]
    fn sharp_edges_split_and_round_ones_do_not() {
        let cube = cuboid([0.0; 3], [1.0; 3]).shaded(0.5, None);
        assert_eq!(cube.positions.len(), 24);
        assert!(cube.normals.iter().all(|n| n.iter().filter(|x| x.abs() == 1.0).count() == 1));
        let ball = sphere(2.0, 3).shaded(0.5, None);
        assert_eq!(ball.positions.len(), 642);
        for (p, n) in ball.positions.iter().zip(&ball.normals) {
            let cosine: f32 = p.iter().zip(n).map(|(p, n)| p * n / 2.0).sum();
            assert!(cosine > 0.999, "{p:?} {n:?}");
        }
    }
}
