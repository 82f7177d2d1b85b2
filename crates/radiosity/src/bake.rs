//! From a scene to its lit model: refine until the audit is content, then write the light where viewers find it.

use crate::answer::Station;
use crate::measure::{Round, certify, rays_for};
use crate::monitor::{Monitor, Stages};
use crate::{Error, Indirect, Solution, SolveOptions, stations};
use glam::{DVec2, DVec3};
use radiosity_io::gltf_out::{Light, LitPrimitive, LitVertex};
use radiosity_scene::{Bands, Side, luminance};
use radiosity_trace::Tracer;
use radiosity_transport::Shadowing;
use radiosity_view::lightmap::{
    Charts, LightmapError, SeamParams, Texel, UnwrapInput, UnwrapParams, fill, fit_seams, shared_edges,
};
use radiosity_view::{Audit, Auditor, Field};
use std::collections::HashMap;

/// A side of a double-sided object that gets less than this share of the other side's light is not written as a layer
/// of its own: it is the inside of a solid.
const FORGOTTEN_SIDE: f64 = 1e-3;

/// By how much the continuous field lessens the noise of cells: a corner is the mean of some six of them.
const SMOOTHING: f64 = 2.4;

/// How to bake.
#[derive(Clone, Copy, Debug)]
pub struct BakeOptions {
    /// Relative L2 error of irradiance to reach, e.g. 0.01.
    pub error: f64,
    /// How to solve; its rays are the least that is used.
    pub solve: SolveOptions,
    /// Points of the audit.
    pub audit_points: usize,
    /// Rounds of refinement.
    pub rounds: usize,
    /// Seed of the audit.
    pub seed: u64,
}

impl Default for BakeOptions {
    fn default() -> Self {
        BakeOptions { error: 0.01, solve: SolveOptions::default(), audit_points: 1000, rounds: 5, seed: 1 }
    }
}

/// A solution that the audit has seen.
pub struct Baked<'a> {
    /// The solution.
    pub solution: Solution<'a>,
    /// Its continuous indirect field.
    pub field: Field,
    /// Rays that gather the indirect light at each point; 0 where the field is good enough.
    pub gather: usize,
    /// Shadow rays that points are lit with.
    pub shadowing: Shadowing,
    /// What the referee says.
    pub audit: Audit,
    /// Whether the audit's upper bound meets the asked error.
    pub achieved: bool,
    /// The rounds.
    pub rounds: Vec<Round>,
    /// Time by stage, over all rounds.
    pub stages: Stages,
}

/// Solves a scene to an asked error of the irradiance on its surfaces.
///
/// # Errors
/// As [`Solution::new`]. Not reaching the error asked is not an error: see [`Baked::achieved`].
pub fn bake<'a>(tracer: &'a Tracer<'a>, options: &BakeOptions, monitor: &dyn Monitor) -> Result<Baked<'a>, Error> {
    let start = std::time::Instant::now();
    let stages = Stages::default();
    let mut solve = options.solve;
    solve.rays = solve.rays.max(rays_for(options.error, 512.0, 32, 2048));
    let mut shadowing = Shadowing { places: 1, rays: rays_for(options.error, 128.0, 32, 4096) as u32 };
    let mut solution = Solution::new(tracer, &solve, monitor)?;
    let most_paths = rays_for(options.error, 4096.0, 64, 1 << 16) as u32;
    let watched: Vec<Station> = stations::spread(&solution, options.audit_points, options.seed as u32);
    let mut auditor = Auditor::new(tracer, watched.iter().map(|s| s.place).collect(), options.seed);
    let mut rounds = Vec::new();
    loop {
        let field = solution.indirect_field();
        let answer = solution.at(&watched, Indirect::Field(&field), &shadowing, monitor)?;
        let mut audit = certify(&mut auditor, &answer.irradiance, options.error, most_paths, &stages, monitor)?;
        let mut gather = 0;
        if audit.upper > options.error {
            // The field knows neither contacts below the size of its elements nor normals that are not the faces':
            // gathering at each point does, and costs less than elements that small.
            let rays = rays_for(options.error, 256.0, 32, 2048);
            let answer = solution.at(&watched, Indirect::Gather { rays }, &shadowing, monitor)?;
            let better = certify(&mut auditor, &answer.irradiance, options.error, most_paths, &stages, monitor)?;
            if better.upper < audit.upper {
                (audit, gather) = (better, rays);
            }
        }
        rounds.push(Round {
            elements: solution.elements.len(),
            rays: solution.rays(),
            gather,
            shadow_rays: shadowing.rays,
            error: audit.error,
            upper: audit.upper,
            seconds: start.elapsed().as_secs_f64(),
        });
        monitor.note(&format!("error {:.2} %, at most {:.2} %", 100.0 * audit.error, 100.0 * audit.upper));
        let achieved = audit.upper <= options.error;
        // More rounds only while there is something to gain and memory to gain it with.
        let smaller = solution.element_size / std::f64::consts::SQRT_2;
        let noisy = solution.row_noise() / SMOOTHING > 0.5 * options.error;
        let next = SolveOptions {
            rays: if noisy { 2 * solution.rays() } else { solution.rays() },
            element_size: Some(if noisy { solution.element_size } else { smaller }),
            ..solve
        };
        let fits = Solution::memory(tracer, &next) <= next.memory;
        if achieved || rounds.len() > options.rounds || !fits {
            stages.absorb(&solution.stages);
            return Ok(Baked { solution, field, gather, shadowing, audit, achieved, rounds, stages });
        }
        shadowing.rays *= 2;
        if noisy {
            solution.refine(next.rays, monitor)?;
        } else {
            stages.absorb(&solution.stages);
            drop(solution);
            solution = Solution::new(tracer, &next, monitor)?;
        }
    }
}

impl Baked<'_> {
    /// How points get their indirect light; a point that is one of `of` whose mean counts does with as many rays less.
    fn indirect(&self, of: usize) -> Indirect<'_> {
        match self.gather {
            0 => Indirect::Field(&self.field),
            rays => Indirect::Gather { rays: (rays / of).max(8) },
        }
    }
}

/// One side of a mesh triangle that gets light written on it.
#[derive(Clone, Copy, Debug)]
struct Face {
    triangle: usize,
    side: Side,
    object: usize,
}

impl Face {
    /// Corners in the order in which they run counter-clockwise seen from the face's side.
    fn order(self) -> [usize; 3] {
        if self.side == Side::Front { [0, 1, 2] } else { [0, 2, 1] }
    }

    /// Mesh barycentric coordinates of the face's own.
    fn mesh_uv(self, uv: DVec2) -> DVec2 {
        if self.side == Side::Front { uv } else { DVec2::new(uv.y, uv.x) }
    }
}

/// The faces that carry light: every front, and backs of double-sided objects that are not the inside of a solid.
fn faces(solution: &Solution) -> Vec<Face> {
    let (scene, mesh) = (solution.tracer().scene, solution.tracer().mesh);
    let mut flux = vec![[0f64; 2]; scene.objects.len()];
    let exposed = solution.exposed_area();
    for (e, h) in solution.irradiance().iter().enumerate() {
        let (triangle, side) = solution.elements.place(e as u32);
        let object = scene.triangle_object[mesh.source[triangle] as usize] as usize;
        flux[object][side as usize] += exposed[e] * f64::from(luminance(*h));
    }
    let mut faces = Vec::new();
    for triangle in 0..mesh.triangles.len() {
        let object = scene.triangle_object[mesh.source[triangle] as usize] as usize;
        let [front, back] = flux[object];
        if !solution.elements.has(triangle, Side::Back) || front >= FORGOTTEN_SIDE * back {
            faces.push(Face { triangle, side: Side::Front, object });
        }
        if solution.elements.has(triangle, Side::Back) && back > FORGOTTEN_SIDE * front {
            faces.push(Face { triangle, side: Side::Back, object });
        }
    }
    faces.sort_by_key(|f| (f.object, f.side));
    faces
}

/// The source vertices and weights of a corner of a mesh triangle.
fn lit_vertex(tracer: &Tracer, triangle: usize, uv: DVec2) -> LitVertex {
    let at = tracer.mesh.surface(triangle, uv);
    let object = tracer.scene.triangle_object[at.triangle] as usize;
    let first = tracer.scene.objects[object].vertices.start as u32;
    let corners = tracer.scene.triangles[at.triangle].map(|v| v - first);
    let weights = [1.0 - at.uv.x - at.uv.y, at.uv.x, at.uv.y];
    // A corner of the source is copied, not interpolated.
    match weights.iter().position(|w| *w > 1.0 - 1e-9) {
        Some(k) => LitVertex { corners: [corners[k]; 3], weights: [1.0, 0.0, 0.0] },
        None => LitVertex { corners, weights: weights.map(|w| w as f32) },
    }
}

/// Whether a station lies inside a solid, so that nobody ever sees its light.
fn is_hidden(solution: &Solution, station: &Station) -> bool {
    let (u, v) = (station.uv.x as f32, station.uv.y as f32);
    let Some(element) = solution.elements.at(station.place.triangle, u, v, station.side) else { return true };
    solution.exposure.is_buried(element)
        || (solution.exposure.is_partial(element)
            && radiosity_transport::exposure::is_buried(solution.tracer(), &station.place, element))
}

/// A lightmap: pages of linear irradiance, and the primitives that refer to them.
pub struct Lightmap {
    /// Width and height of each page.
    pub pages: Vec<[u32; 2]>,
    /// Irradiance, lx per band, row-major from the top.
    pub irradiance: Vec<Vec<Bands>>,
    /// The primitives to write.
    pub primitives: Vec<LitPrimitive>,
    /// Texels per metre.
    pub density: f64,
    /// Texels that were computed.
    pub texels: usize,
    /// Largest difference across seams, root mean square, before and after fitting them, lx.
    pub seams: [f64; 2],
}

/// Texels that differ from a neighbour by more than this share get more points, as an edge may run through them.
const EDGE_CONTRAST: f64 = 0.1;

/// How many points: stairs of 1/16 are below what a display shows.
const EDGE_POINTS: u32 = 16;

/// How often an edge is followed on to further texels.
const EDGE_ROUNDS: usize = 4;

/// Fewest shadow rays at each of these points.
const LEAST_RAYS: u32 = 8;

/// Texels that the program spends where no density is asked for.
const AUTOMATIC_TEXELS: f64 = 200_000.0;

/// A vertex of a primitive: its slot, source corners, weights and texture coordinates, the floats by their bits.
type VertexKey = (usize, [u32; 3], [u32; 3], [u32; 2]);

/// A place and a normal, both on a grid.
type PlaceKey = ([i64; 3], [i32; 3]);

/// Bakes a solution into a lightmap.
///
/// # Errors
/// [`Error::Stopped`]; [`Error::Lightmap`] if the layout is impossible.
pub fn lightmap(
    baked: &Baked,
    texels_per_metre: Option<f64>,
    max_page: u32,
    monitor: &dyn Monitor,
) -> Result<Lightmap, Error> {
    let solution = &baked.solution;
    let (tracer, mesh) = (solution.tracer(), solution.tracer().mesh);
    let faces = faces(solution);
    let triangles: Vec<[u32; 3]> =
        faces.iter().map(|f| f.order().map(|corner| mesh.triangles[f.triangle][corner])).collect();
    let group: Vec<u32> = faces.iter().map(|f| 2 * f.object as u32 + f.side as u32).collect();
    let input = UnwrapInput { positions: &mesh.vertices, triangles: &triangles, group: &group };
    let mut params = UnwrapParams { max_page, ..UnwrapParams::default() };
    monitor.stage("unwrap");
    let charts = Charts::new(&input, &params)?;
    params.texels_per_metre =
        texels_per_metre.or_else(|| charts.density_for(AUTOMATIC_TEXELS)).unwrap_or(params.texels_per_metre);
    let atlas = charts.pack(&params)?;

    // Every texel is lit like a point of the surface; those inside solids are left to their neighbours.
    let light = |texels: &[Texel], shadowing: &Shadowing, of: usize| -> Result<Vec<Bands>, Error> {
        let at: Vec<Station> = texels
            .iter()
            .map(|texel| {
                let face = faces[texel.triangle as usize];
                stations::station(tracer, face.triangle, face.mesh_uv(texel.uv.as_dvec2()), face.side)
            })
            .collect();
        let mut values = solution.at(&at, baked.indirect(of), shadowing, monitor)?.irradiance;
        for (value, station) in values.iter_mut().zip(&at) {
            if is_hidden(solution, station) {
                *value = [f32::NAN; 3];
            }
        }
        Ok(values)
    };
    // The points of a texel that an edge runs through share its shadow rays.
    let shared = Shadowing { rays: (baked.shadowing.rays / EDGE_POINTS).max(LEAST_RAYS), ..baked.shadowing };
    let mut irradiance = Vec::new();
    let mut count = 0;
    for (page, size) in atlas.pages.iter().enumerate() {
        let mut texels = atlas.texels(page);
        count += texels.len();
        let mut values = light(&texels, &baked.shadowing, 1)?;
        for _ in 0..EDGE_ROUNDS {
            let more = atlas.finer(page, &texels, &values, EDGE_CONTRAST, EDGE_POINTS);
            if more.is_empty() {
                break;
            }
            values.extend(light(&more, &shared, EDGE_POINTS as usize)?);
            texels.extend(more);
        }
        irradiance.push(fill(*size, &texels, &values));
    }

    // Light is continuous across an edge where the two faces share both its smooth vertices.
    let smooth: Vec<[u32; 3]> = faces.iter().map(|f| f.order().map(|corner| mesh.smooth[f.triangle][corner])).collect();
    let side: Vec<u32> = faces.iter().map(|f| f.side as u32).collect();
    let seams = shared_edges(&smooth, Some(&side));
    monitor.stage("seams");
    let fitted = fit_seams(&atlas, &seams, &mut irradiance, &SeamParams::default());

    let mut primitives: Vec<LitPrimitive> = Vec::new();
    let mut current: HashMap<(usize, Side, u32), usize> = HashMap::new();
    let mut known: HashMap<VertexKey, u32> = HashMap::new();
    for (index, face) in faces.iter().enumerate() {
        let page = atlas.triangle_page[index];
        let slot = *current.entry((face.object, face.side, page)).or_insert_with(|| {
            primitives.push(LitPrimitive {
                object: face.object,
                vertices: Vec::new(),
                triangles: Vec::new(),
                flipped: face.side == Side::Back,
                light: Light::Lightmap { page: page as usize, uv: Vec::new() },
            });
            primitives.len() - 1
        });
        let corners = [0, 1, 2].map(|k| {
            let at = [DVec2::ZERO, DVec2::X, DVec2::Y][face.order()[k]];
            let vertex = lit_vertex(tracer, face.triangle, at);
            let uv = atlas.uv[index][k].to_array();
            let key = (slot, vertex.corners, vertex.weights.map(f32::to_bits), uv.map(f32::to_bits));
            let primitive = &mut primitives[slot];
            *known.entry(key).or_insert_with(|| {
                primitive.vertices.push(vertex);
                if let Light::Lightmap { uv: list, .. } = &mut primitive.light {
                    list.push(uv);
                }
                (primitive.vertices.len() - 1) as u32
            })
        });
        primitives[slot].triangles.push(corners);
    }
    Ok(Lightmap {
        pages: atlas.pages.clone(),
        irradiance,
        primitives,
        density: params.texels_per_metre,
        texels: count,
        seams: [fitted.before, fitted.after],
    })
}

/// Bakes a solution into the vertices of a refined mesh: the lattice of the elements, stitched along edges where the
/// divisions of two triangles differ, so that there are no T-vertices.
///
/// # Errors
/// [`Error::Stopped`].
pub fn vertex_light(baked: &Baked, monitor: &dyn Monitor) -> Result<Vec<LitPrimitive>, Error> {
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

    let mut primitives: Vec<LitPrimitive> = Vec::new();
    let mut at: Vec<Vec<Station>> = Vec::new();
    for layer in faces(solution).chunk_by(|a, b| (a.object, a.side) == (b.object, b.side)) {
        let mut primitive = LitPrimitive {
            object: layer[0].object,
            vertices: Vec::new(),
            triangles: Vec::new(),
            flipped: layer[0].side == Side::Back,
            light: Light::None,
        };
        let mut places = Vec::new();
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
                *known.entry((lit.corners, lit.weights.map(f32::to_bits), crease)).or_insert_with(|| {
                    primitive.vertices.push(lit);
                    // A little towards the middle: the light of this triangle, not of what touches its border.
                    let inside = uv + 1e-3 * (DVec2::splat(1.0 / 3.0) - uv);
                    places.push(stations::station(tracer, face.triangle, inside, face.side));
                    (primitive.vertices.len() - 1) as u32
                })
            };
            let order = face.order();
            let mut add = |corners: [u32; 3]| {
                let [a, b, c] = order.map(|k| corners[k]);
                if a != b && b != c && c != a {
                    primitive.triangles.push([a, b, c]);
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
        at.push(places);
    }

    let all: Vec<Station> = at.concat();
    let light = solution.at(&all, baked.indirect(1), &baked.shadowing, monitor)?.irradiance;
    // Vertices at one place of one smooth surface share their mean, so that no seam shows; hidden ones do not count.
    let mut shared: HashMap<PlaceKey, ([f64; 3], f64)> = HashMap::new();
    let grid = 4.0 * mesh.tolerance.max(1e-9) + 4e-3 * solution.element_size;
    let key = |s: &Station| {
        let cell = ((s.place.point + DVec3::splat(0.37 * grid)) / grid).floor().as_i64vec3().to_array();
        (cell, (s.place.normal * 24.0).round().as_ivec3().to_array())
    };
    for (station, e) in all.iter().zip(&light) {
        if !is_hidden(solution, station) {
            let entry = shared.entry(key(station)).or_default();
            (0..3).for_each(|band| entry.0[band] += f64::from(e[band]));
            entry.1 += 1.0;
        }
    }
    let mut values = all.iter().zip(&light).map(|(station, e)| match shared.get(&key(station)) {
        Some((sum, n)) => sum.map(|s| (s / n) as f32),
        None => *e,
    });
    for primitive in &mut primitives {
        let irradiance = values.by_ref().take(primitive.vertices.len()).collect();
        primitive.light = Light::Vertex { irradiance };
    }
    Ok(primitives)
}

impl From<LightmapError> for Error {
    fn from(error: LightmapError) -> Self {
        Error::Lightmap(error)
    }
}
