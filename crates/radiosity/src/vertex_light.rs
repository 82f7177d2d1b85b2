//! A solution as light at the vertices of a refined mesh.
//!
//! The mesh is the lattice of the elements, stitched along edges where the divisions of two triangles differ, so that there
//! are no T-vertices. Where light is rough the lattice is doubled, until what is interpolated meets the error asked: a vertex
//! that differs from the mean of the two beside it by δ tells what interpolation loses there, as texels do.

use crate::answer::Station;
use crate::bake::Baked;
use crate::faces::{Face, faces, is_hidden, lit_vertex};
use crate::judge::{Judge, STEP, Written, WrittenRound, is_stalled, root_mean_square};
use crate::monitor::is_over;
use crate::{Error, Monitor, Solution, stations};
use glam::DVec2;
use radiosity_io::gltf_out::{Light, LitPrimitive};
use radiosity_scene::{Bands, Side, luminance};
use radiosity_view::lightmap::{GAIN, LOST};
use radiosity_view::{Audit, Shared, shared_corner};
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

/// Light at vertices.
pub struct VertexLight {
    /// The primitives to write.
    pub primitives: Vec<LitPrimitive>,
    /// What the referee says of the light as a viewer interpolates it.
    pub audit: Audit,
    /// The attempts, each with more vertices or rays than the one before.
    pub rounds: Vec<WrittenRound>,
    /// Whether a deadline left something undone.
    pub hurried: bool,
}

/// Most vertices that are spent for an error: some 50 MB of model.
const MOST_VERTICES: f64 = 1_000_000.0;

/// Memory that a vertex takes while it is worked out, about.
const VERTEX_BYTES: usize = 1000;

/// Rounds after the first, each of a lattice doubled where light is rough.
const ROUNDS: usize = 4;

/// Bakes a solution into the vertices of a refined mesh.
///
/// # Errors
/// [`Error::Stopped`].
pub fn vertex_light(baked: &Baked, monitor: &dyn Monitor) -> Result<VertexLight, Error> {
    let solution = &baked.solution;
    let faces = faces(solution);
    let mut judge = Judge::new(baked, Written::Vertices);
    let mut division: Vec<u32> =
        (0..solution.tracer().mesh.triangles.len()).map(|t| solution.elements.division(t)).collect();
    let mut known = HashMap::new();
    let mut lattice = Lattice::new(solution, &faces, &division, &judge);
    judge.pace(lattice.at.len() as f64, 0.0, true, monitor)?;
    let mut lit = lattice.light(solution, &judge, &mut known, monitor)?;
    let mut audit = judge.audit(monitor, |station| lattice.read(station))?;
    let mut rounds = vec![lattice.round(lit, &audit)];

    let tolerance = judge.reachable() * root_mean_square(solution);
    let most = MOST_VERTICES.min((solution.memory_allowed() / VERTEX_BYTES) as f64);
    while rounds.len() <= ROUNDS
        && !is_stalled(&rounds)
        && !is_over(monitor)
        && (audit.upper <= judge.reachable() || judge.has_time(lattice.at.len() as f64, 0.0, monitor))
    {
        let Some(goal) = judge.goal(&audit, monitor)? else { break };
        let lost = lattice.lost(solution, &faces, tolerance);
        let finer = |left: f64| finer(&faces, &lost, &division, left, most);
        // For what is asked all the way has to go; else as far as it does.
        let next = match goal.is_for_asked {
            true => finer(goal.left).and_then(|_| finer(goal.left.max(STEP))),
            false => goal.steps().find_map(finer),
        };
        let Some(next) = next else { break };
        monitor.note(&rounds[rounds.len() - 1].to_string());
        if goal.relight {
            known.clear();
        }
        division = next;
        lattice = Lattice::new(solution, &faces, &division, &judge);
        lit = lattice.light(solution, &judge, &mut known, monitor)?;
        audit = judge.audit(monitor, |station| lattice.read(station))?;
        rounds.push(lattice.round(lit, &audit));
    }
    Ok(VertexLight { primitives: lattice.primitives, audit, rounds, hurried: judge.is_hurried() })
}

/// Divisions with which a part `goal` is left of what is `lost` by face; nothing where that takes more than `most` vertices,
/// or where nothing is known to be lost. Always the triangle is doubled that gains most for its vertices, on all sides lit.
fn finer(faces: &[Face], lost: &[f64], division: &[u32], goal: f64, most: f64) -> Option<Vec<u32>> {
    let mut division = division.to_vec();
    let total: f64 = lost.iter().sum();
    let vertices = |k: u32| 0.5 * f64::from(k) * f64::from(k);
    let (mut own, mut sides) = (vec![0.0; division.len()], vec![0.0; division.len()]);
    for (face, lost) in faces.iter().zip(lost) {
        own[face.triangle] += lost;
        sides[face.triangle] += 1.0;
    }
    let mut count: f64 = division.iter().zip(&sides).map(|(k, sides)| sides * vertices(*k)).sum();
    let mut left = total;
    // Non-negative floats are ordered as their bits are.
    let merit = |lost: f64, k: u32| (lost / vertices(k)).to_bits();
    let rough = (0..division.len()).filter(|t| own[*t] > 0.0);
    let mut heap: BinaryHeap<(u64, Reverse<usize>)> =
        rough.map(|t| (merit(own[t] / sides[t], division[t]), Reverse(t))).collect();
    if total <= 0.0 {
        return None;
    }
    while left > goal * total {
        let (_, Reverse(triangle)) = heap.pop()?;
        let k = &mut division[triangle];
        let gain = own[triangle] * (1.0 - 2f64.powf(-GAIN));
        count += 3.0 * sides[triangle] * vertices(*k);
        if count > most || *k >= FINEST {
            return None;
        }
        *k *= 2;
        own[triangle] -= gain;
        left -= gain;
        heap.push((merit(own[triangle] / sides[triangle], *k), Reverse(triangle)));
    }
    Some(division)
}

/// Most cells along an edge of a triangle.
const FINEST: u32 = 1 << 12;

/// A place of a lattice, the same for every division: triangle, side, and steps of [`FINEST`].
type Spot = (u32, Side, u32, u32);

/// A triangle of the refined mesh: its vertices, and their places on the mesh triangle that it is a part of.
type Part = ([u32; 3], [DVec2; 3]);

/// The parts of a face where light will be read back, by squares of its plane that they reach into.
struct Parts {
    primitive: usize,
    squares: u32,
    by_square: Vec<Vec<Part>>,
}

impl Parts {
    fn squares(&self, low: DVec2, high: DVec2) -> impl Iterator<Item = usize> + use<> {
        let n = self.squares;
        let at = move |x: f64| ((x * f64::from(n)) as u32).min(n - 1);
        (at(low.y)..=at(high.y)).flat_map(move |y| (at(low.x)..=at(high.x)).map(move |x| (y * n + x) as usize))
    }
}

/// The refined mesh and its light.
struct Lattice {
    primitives: Vec<LitPrimitive>,
    at: Vec<Station>,
    names: Vec<Option<Shared>>,
    spots: Vec<Spot>,
    /// By face, its primitive and the vertices of its lattice's corners, row by row.
    corners: Vec<(usize, Vec<u32>)>,
    division: Vec<u32>,
    parts: HashMap<(usize, Side), Parts>,
}

impl Lattice {
    fn new(solution: &Solution, faces: &[Face], division: &[u32], judge: &Judge) -> Lattice {
        let (tracer, mesh) = (solution.tracer(), solution.tracer().mesh);
        let mut coarsest: HashMap<(u32, u32), u32> = HashMap::new();
        let edge = |t: usize, e: usize| {
            let (a, b) = (mesh.triangles[t][e], mesh.triangles[t][(e + 1) % 3]);
            (a.min(b), a.max(b))
        };
        for (t, &k) in division.iter().enumerate() {
            for e in 0..3 {
                let entry = coarsest.entry(edge(t, e)).or_insert(k);
                *entry = (*entry).min(k);
            }
        }
        let mut parts: HashMap<(usize, Side), Parts> = HashMap::new();
        for station in judge.places() {
            let triangle = station.place.triangle as usize;
            let squares = division[triangle].min(64);
            parts.entry((triangle, station.side)).or_insert_with(|| Parts {
                primitive: 0,
                squares,
                by_square: vec![Vec::new(); (squares * squares) as usize],
            });
        }

        let mut lattice = Lattice {
            primitives: Vec::new(),
            at: Vec::new(),
            names: Vec::new(),
            spots: Vec::new(),
            corners: Vec::new(),
            division: division.to_vec(),
            parts: HashMap::new(),
        };
        for layer in faces.chunk_by(|a, b| (a.object, a.side) == (b.object, b.side)) {
            let mut primitive = LitPrimitive {
                object: layer[0].object,
                vertices: Vec::new(),
                triangles: Vec::new(),
                flipped: layer[0].side == Side::Back,
                light: Light::None,
            };
            let mut known: HashMap<([u32; 3], [u32; 3], u32), u32> = HashMap::new();
            for face in layer {
                let k = division[face.triangle];
                let steps = [0, 1, 2].map(|e| k / coarsest[&edge(face.triangle, e)]);
                // The vertex of lattice corner (i, j), moved along a stitched edge to the coarser side's vertex.
                let mut vertex = |i: u32, j: u32| {
                    let (mut i, mut j) = (i, j);
                    if j == 0 {
                        i -= i % steps[0];
                    } else if i + j == k {
                        j -= j % steps[1];
                        i = k - j;
                    } else if i == 0 {
                        let from_end = (k - j) - (k - j) % steps[2];
                        j = k - from_end;
                    }
                    let uv = DVec2::new(f64::from(i), f64::from(j)) / f64::from(k);
                    let lit = lit_vertex(tracer, face.triangle, uv);
                    // Corners on which light breaks keep a vertex on either side of the crease.
                    let corner = [(0, 0), (k, 0), (0, k)].iter().position(|c| *c == (i, j));
                    let crease = corner.map_or(face.triangle as u32 | 1 << 31, |c| mesh.smooth[face.triangle][c]);
                    let index =
                        *known.entry((lit.corners, lit.weights.map(f32::to_bits), crease)).or_insert_with(|| {
                            primitive.vertices.push(lit);
                            // A little towards the middle: the light of this triangle, not of what touches its border.
                            let inside = uv + 1e-3 * (DVec2::splat(1.0 / 3.0) - uv);
                            lattice.at.push(stations::station(tracer, face.triangle, inside, face.side));
                            lattice.names.push(shared_corner(mesh, face.triangle, face.side, (i, j), k));
                            lattice.spots.push((face.triangle as u32, face.side, i * (FINEST / k), j * (FINEST / k)));
                            (primitive.vertices.len() - 1) as u32
                        });
                    (index, uv)
                };
                let corners: Vec<(u32, DVec2)> =
                    (0..=k).flat_map(|j| (0..=k - j).map(move |i| (i, j))).map(|(i, j)| vertex(i, j)).collect();
                let at = |i: u32, j: u32| corners[corner(i, j, k)];
                let order = face.order();
                let mut parts = parts.get_mut(&(face.triangle, face.side));
                if let Some(parts) = &mut parts {
                    parts.primitive = lattice.primitives.len();
                }
                let mut add = |corners: [(u32, DVec2); 3]| {
                    let [a, b, c] = order.map(|k| corners[k].0);
                    if a != b && b != c && c != a {
                        primitive.triangles.push([a, b, c]);
                        if let Some(parts) = &mut parts {
                            let [a, b, c] = corners.map(|c| c.1);
                            for square in parts.squares(a.min(b).min(c), a.max(b).max(c)) {
                                parts.by_square[square].push((corners.map(|c| c.0), [a, b, c]));
                            }
                        }
                    }
                };
                for j in 0..k {
                    for i in 0..k - j {
                        add([at(i, j), at(i + 1, j), at(i, j + 1)]);
                        if i + j + 2 <= k {
                            add([at(i + 1, j + 1), at(i, j + 1), at(i + 1, j)]);
                        }
                    }
                }
                lattice.corners.push((lattice.primitives.len(), corners.into_iter().map(|c| c.0).collect()));
            }
            lattice.primitives.push(primitive);
        }
        lattice.parts = parts;
        lattice
    }

    /// Lights the vertices that are not `known`, and makes them so. Answers how many these were.
    fn light(
        &mut self,
        solution: &Solution,
        judge: &Judge,
        known: &mut HashMap<Spot, Option<Bands>>,
        monitor: &dyn Monitor,
    ) -> Result<usize, Error> {
        let new: Vec<usize> = (0..self.at.len()).filter(|i| !known.contains_key(&self.spots[*i])).collect();
        let stations: Vec<Station> = new.iter().map(|i| self.at[*i]).collect();
        let light = judge.light(&stations, 1, monitor)?.irradiance;
        let hidden: Vec<bool> = stations.par_iter().map(|station| is_hidden(solution, station)).collect();
        known.extend(new.iter().zip(light.iter().zip(&hidden)).map(|(i, (e, h))| (self.spots[*i], (!h).then_some(*e))));
        let light: Vec<Option<Bands>> = self.spots.iter().map(|spot| known[spot]).collect();
        // Vertices at one place of one smooth surface share their mean, so that no seam shows; hidden ones do not count.
        let mut shared: HashMap<Shared, ([f64; 3], f64)> = HashMap::new();
        for (name, e) in self.names.iter().zip(&light) {
            if let (Some(name), Some(e)) = (name, e) {
                let (sum, count) = shared.entry(*name).or_default();
                (0..3).for_each(|band| sum[band] += f64::from(e[band]));
                *count += 1.0;
            }
        }
        let own = |(i, e): (usize, &Option<Bands>)| match self.names[i].and_then(|name| shared.get(&name)) {
            Some((sum, n)) => Some(sum.map(|s| (s / n) as f32)),
            None => *e,
        };
        let mut values = light.iter().enumerate().map(own);
        for primitive in &mut self.primitives {
            let irradiance = values.by_ref().take(primitive.vertices.len()).collect();
            primitive.light = Light::Vertex { irradiance: continued(irradiance, &primitive.triangles) };
        }
        Ok(new.len())
    }

    /// What a viewer sees at a place.
    fn read(&self, station: &Station) -> Bands {
        let Some(parts) = self.parts.get(&(station.place.triangle as usize, station.side)) else { return [0.0; 3] };
        let Light::Vertex { irradiance } = &self.primitives[parts.primitive].light else { return [0.0; 3] };
        let near = parts.squares(station.uv, station.uv).flat_map(|square| &parts.by_square[square]);
        let inside = near.map(|part| (part, weights(part.1, station.uv)));
        let least = |w: &[f64; 3]| w[0].min(w[1]).min(w[2]);
        let Some((part, weights)) = inside.max_by(|a, b| least(&a.1).total_cmp(&least(&b.1))) else { return [0.0; 3] };
        let corner = |k: usize, band: usize| weights[k] as f32 * irradiance[part.0[k] as usize][band];
        std::array::from_fn(|band| (0..3).map(|k| corner(k, band)).sum())
    }

    /// By face, the squared error, lx² m², that is to be feared where vertices differ from the mean of those beside them by
    /// more than `tolerance`, lx.
    fn lost(&self, solution: &Solution, faces: &[Face], tolerance: f64) -> Vec<f64> {
        let of = |(face, (primitive, vertices)): (&Face, &(usize, Vec<u32>))| {
            let k = self.division[face.triangle];
            let Light::Vertex { irradiance } = &self.primitives[*primitive].light else { return 0.0 };
            let value = |(i, j): (u32, u32)| {
                let vertex = vertices[corner(i, j, k)];
                (vertex, f64::from(luminance(irradiance[vertex as usize])))
            };
            let mut sum = 0.0;
            let mut add = |delta: f64| sum += if delta.abs() > tolerance { LOST * delta * delta } else { 0.0 };
            if k == 1 {
                // There is no second difference: the first counts.
                let corners = [(0, 0), (1, 0), (0, 1)].map(|c| value(c).1);
                (0..3).for_each(|e| add(0.5 * (corners[e] - corners[(e + 1) % 3])));
            }
            // The two beside (i, j) along each of the three directions of the lattice, where it has both.
            for (i, j) in (1..k).flat_map(|j| (0..=k - j).map(move |i| (i, j))).chain((1..k).map(|i| (i, 0))) {
                let (w, own) = value((i, j));
                let along = (i > 0 && i + j < k).then(|| [(i - 1, j), (i + 1, j)]);
                let up = (j > 0 && i + j < k).then(|| [(i, j - 1), (i, j + 1)]);
                let across = (i > 0 && j > 0).then(|| [(i - 1, j + 1), (i + 1, j - 1)]);
                for [(u, from), (v, to)] in [along, up, across].into_iter().flatten().map(|ends| ends.map(&value)) {
                    // A stitched edge names the same vertex twice.
                    if u != v && v != w && w != u {
                        add(own - 0.5 * (from + to));
                    }
                }
            }
            let area = solution.tracer().mesh.area(face.triangle) * solution.counts(face.triangle);
            sum * area / (f64::from(k) * f64::from(k))
        };
        faces.par_iter().zip(&self.corners).map(of).collect()
    }

    /// What came of it.
    fn round(&self, lit: usize, audit: &Audit) -> WrittenRound {
        WrittenRound { points: self.at.len(), lit, error: audit.error, upper: audit.upper }
    }
}

/// Index of the lattice corner in column `i` of row `j` of a triangle with k cells along its edges.
fn corner(i: u32, j: u32, k: u32) -> usize {
    (j * (2 * k + 3 - j) / 2 + i) as usize
}

/// Values for vertices that have none: the mean of their neighbours', from the nearest on. A vertex inside a solid must
/// not darken what shows beside it.
fn continued(mut values: Vec<Option<Bands>>, triangles: &[[u32; 3]]) -> Vec<Bands> {
    while values.iter().any(Option::is_none) {
        let mut sums: HashMap<u32, ([f32; 3], f32)> = HashMap::new();
        for corners in triangles {
            for &v in corners.iter().filter(|v| values[**v as usize].is_none()) {
                for e in corners.iter().filter_map(|w| values[*w as usize]) {
                    let (sum, count) = sums.entry(v).or_default();
                    (0..3).for_each(|band| sum[band] += e[band]);
                    *count += 1.0;
                }
            }
        }
        if sums.is_empty() {
            break;
        }
        for (v, (sum, count)) in sums {
            values[v as usize] = Some(sum.map(|s| s / count));
        }
    }
    // What paths find beyond what they look up may be less than nothing.
    values.into_iter().map(|value| value.unwrap_or_default().map(|e| if e < 0.0 { 0.0 } else { e })).collect()
}

/// Weights of the corners of a triangle at a point; all are positive inside.
fn weights([a, b, c]: [DVec2; 3], point: DVec2) -> [f64; 3] {
    let area = (b - a).perp_dot(c - a);
    let [v, w] = [(point - a).perp_dot(c - a) / area, (b - a).perp_dot(point - a) / area];
    [1.0 - v - w, v, w]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Vertices that are hidden take the mean of those around, and none has less than nothing.
    #[test]
    fn vertices_are_never_below_nothing_and_hidden_ones_are_told_by_those_around() {
        let values = vec![Some([-2.0; 3]), Some([4.0; 3]), None, None];
        let all = continued(values, &[[0, 1, 2], [1, 2, 3]]);
        assert_eq!(all, [[0.0; 3], [4.0; 3], [2.0; 3], [4.0; 3]]);
    }
}
