//! A solution as light at the vertices of a refined mesh.

use crate::answer::Station;
use crate::bake::Baked;
use crate::faces::{faces, is_hidden, lit_vertex};
use crate::{Error, Monitor, stations};
use glam::DVec2;
use radiosity_io::gltf_out::{Light, LitPrimitive};
use radiosity_scene::{Bands, Side};
use radiosity_view::{Audit, Shared, shared_corner};
use rayon::prelude::*;
use std::collections::HashMap;

/// Light at vertices.
pub struct VertexLight {
    /// The primitives to write.
    pub primitives: Vec<LitPrimitive>,
    /// What the referee says of the light as a viewer interpolates it.
    pub audit: Audit,
}

/// A triangle of the refined mesh: its primitive, its vertices there, and their places on the mesh triangle that it
/// is a part of.
type Part = (usize, [u32; 3], [DVec2; 3]);

/// Bakes a solution into the vertices of a refined mesh: the lattice of the elements, stitched along edges where the
/// divisions of two triangles differ, so that there are no T-vertices.
///
/// # Errors
/// [`Error::Stopped`].
pub fn vertex_light(baked: &Baked, monitor: &dyn Monitor) -> Result<VertexLight, Error> {
    let solution = &baked.solution;
    let (tracer, mesh) = (solution.tracer(), solution.tracer().mesh);
    let mut coarsest: HashMap<(u32, u32), u32> = HashMap::new();
    let edge = |t: usize, e: usize| {
        let (a, b) = (mesh.triangles[t][e], mesh.triangles[t][(e + 1) % 3]);
        (a.min(b), a.max(b))
    };
    for t in 0..mesh.triangles.len() {
        let k = solution.elements.division(t);
        for e in 0..3 {
            let entry = coarsest.entry(edge(t, e)).or_insert(k);
            *entry = (*entry).min(k);
        }
    }

    let mut watched: HashMap<(usize, Side), Vec<Part>> =
        baked.watched().iter().map(|s| ((s.place.triangle as usize, s.side), Vec::new())).collect();

    let mut primitives: Vec<LitPrimitive> = Vec::new();
    let mut at: Vec<Station> = Vec::new();
    let mut names: Vec<Option<Shared>> = Vec::new();
    for layer in faces(solution).chunk_by(|a, b| (a.object, a.side) == (b.object, b.side)) {
        let mut primitive = LitPrimitive {
            object: layer[0].object,
            vertices: Vec::new(),
            triangles: Vec::new(),
            flipped: layer[0].side == Side::Back,
            light: Light::None,
        };
        let mut known: HashMap<([u32; 3], [u32; 3], u32), u32> = HashMap::new();
        for face in layer {
            let k = solution.elements.division(face.triangle);
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
                let index = *known.entry((lit.corners, lit.weights.map(f32::to_bits), crease)).or_insert_with(|| {
                    primitive.vertices.push(lit);
                    // A little towards the middle: the light of this triangle, not of what touches its border.
                    let inside = uv + 1e-3 * (DVec2::splat(1.0 / 3.0) - uv);
                    at.push(stations::station(tracer, face.triangle, inside, face.side));
                    names.push(shared_corner(mesh, face.triangle, face.side, (i, j), k));
                    (primitive.vertices.len() - 1) as u32
                });
                (index, uv)
            };
            let order = face.order();
            let mut watched = watched.get_mut(&(face.triangle, face.side));
            let mut add = |corners: [(u32, DVec2); 3]| {
                let [a, b, c] = order.map(|k| corners[k].0);
                if a != b && b != c && c != a {
                    primitive.triangles.push([a, b, c]);
                    if let Some(watched) = &mut watched {
                        watched.push((primitives.len(), corners.map(|c| c.0), corners.map(|c| c.1)));
                    }
                }
            };
            for j in 0..k {
                for i in 0..k - j {
                    add([vertex(i, j), vertex(i + 1, j), vertex(i, j + 1)]);
                    if i + j + 2 <= k {
                        add([vertex(i + 1, j + 1), vertex(i, j + 1), vertex(i + 1, j)]);
                    }
                }
            }
        }
        primitives.push(primitive);
    }

    let light = solution.at(&at, baked.indirect(1), &baked.shadowing, monitor)?.irradiance;
    // Vertices at one place of one smooth surface share their mean, so that no seam shows; hidden ones do not count.
    let mut shared: HashMap<Shared, ([f64; 3], f64)> = HashMap::new();
    let hidden: Vec<bool> = at.par_iter().map(|station| is_hidden(solution, station)).collect();
    for ((name, hidden), e) in names.iter().zip(&hidden).zip(&light) {
        if let Some(name) = name.filter(|_| !hidden) {
            let (sum, count) = shared.entry(name).or_default();
            (0..3).for_each(|band| sum[band] += f64::from(e[band]));
            *count += 1.0;
        }
    }
    let own = |(i, e): (usize, &Bands)| match names[i].and_then(|name| shared.get(&name)) {
        Some((sum, n)) => Some(sum.map(|s| (s / n) as f32)),
        None => (!hidden[i]).then_some(*e),
    };
    let mut values = light.iter().enumerate().map(own);
    for primitive in &mut primitives {
        let irradiance = values.by_ref().take(primitive.vertices.len()).collect();
        primitive.light = Light::Vertex { irradiance: continued(irradiance, &primitive.triangles) };
    }

    let audit = baked.judge(monitor, |station| {
        let parts = watched.get(&(station.place.triangle as usize, station.side)).into_iter().flatten();
        let inside = parts.map(|part| (part, weights(part.2, station.uv)));
        let least = |w: &[f64; 3]| w[0].min(w[1]).min(w[2]);
        let Some((part, weights)) = inside.max_by(|a, b| least(&a.1).total_cmp(&least(&b.1))) else { return [0.0; 3] };
        let Light::Vertex { irradiance } = &primitives[part.0].light else { return [0.0; 3] };
        let corner = |k: usize, band: usize| weights[k] as f32 * irradiance[part.1[k] as usize][band];
        std::array::from_fn(|band| (0..3).map(|k| corner(k, band)).sum())
    })?;
    Ok(VertexLight { primitives, audit })
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
    values.into_iter().map(Option::unwrap_or_default).collect()
}

/// Weights of the corners of a triangle at a point; all are positive inside.
fn weights([a, b, c]: [DVec2; 3], point: DVec2) -> [f64; 3] {
    let area = (b - a).perp_dot(c - a);
    let [v, w] = [(point - a).perp_dot(c - a) / area, (b - a).perp_dot(point - a) / area];
    [1.0 - v - w, v, w]
}
