//! A solution as a lightmap: every texel is lit like a point of the surface.

use crate::answer::Station;
use crate::bake::Baked;
use crate::faces::{faces, is_hidden, lit_vertex};
use crate::{Error, Monitor, stations};
use glam::DVec2;
use radiosity_io::gltf_out::{Encoding, Light, LitPrimitive, PageImage};
use radiosity_io::image_out::encode_png;
use radiosity_scene::display::srgb;
use radiosity_scene::{Bands, Side};
use radiosity_transport::Shadowing;
use radiosity_view::Audit;
use radiosity_view::lightmap::{
    Charts, LightmapError, SeamParams, Texel, UnwrapInput, UnwrapParams, fill, fit_seams, look_up, shared_edges,
};
use std::collections::HashMap;

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
    /// Charts that did not fit on a page and got fewer.
    pub reduced: usize,
    /// Texels that were computed.
    pub texels: usize,
    /// What the referee says of the texels as a viewer reads them, before they are stored in 8 bits.
    pub audit: Audit,
    /// Root mean square difference across seams, before and after fitting them, lx.
    pub seams: [f64; 2],
}

impl Lightmap {
    /// The pages as pictures of 8 bits, each scaled by its brightest texel.
    ///
    /// # Errors
    /// [`Error::Picture`] if one cannot be encoded.
    pub fn images(&self, encoding: Encoding) -> Result<Vec<PageImage>, Error> {
        let image = |(size, lux): (&[u32; 2], &Vec<Bands>)| {
            let peak = lux.iter().flatten().fold(0f32, |most, e| most.max(*e));
            let intensity = if peak > 0.0 { peak } else { 1.0 };
            let encode = |e: f32| {
                let share = (e / intensity).clamp(0.0, 1.0);
                (255.0 * if encoding == Encoding::Srgb { srgb(share) } else { share }).round() as u8
            };
            let pixels: Vec<[u8; 3]> = lux.iter().map(|e| e.map(encode)).collect();
            Ok(PageImage { png: encode_png(size[0], size[1], &pixels)?, intensity })
        };
        self.pages.iter().zip(&self.irradiance).map(image).collect()
    }
}

/// Texels that differ from a neighbour by more than this share get more points, as an edge may run through them.
const EDGE_CONTRAST: f64 = 0.1;

/// How many points: stairs of 1/16 are below what a display shows.
const EDGE_POINTS: u32 = 16;

/// How often an edge is followed on to further texels.
const EDGE_ROUNDS: usize = 4;

/// Fewest shadow rays at each of these points.
const LEAST_RAYS: u32 = 8;

/// Memory that a texel takes while it is worked out, about.
const TEXEL_BYTES: usize = 400;

/// Texels that the program spends where no density is asked for.
const AUTOMATIC_TEXELS: f64 = 200_000.0;

/// A vertex of a primitive: its slot, source corners, weights and texture coordinates, the floats by their bits.
type VertexKey = (usize, [u32; 3], [u32; 3], [u32; 2]);

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
    let smooth: Vec<[u32; 3]> = faces.iter().map(|f| f.order().map(|corner| mesh.smooth[f.triangle][corner])).collect();
    let input = UnwrapInput { positions: &mesh.vertices, triangles: &triangles, group: &group, smooth: &smooth };
    let mut params = UnwrapParams { max_page, ..UnwrapParams::default() };
    monitor.stage("unwrap");
    let charts = Charts::new(&input, &params)?;
    params.texels_per_metre =
        texels_per_metre.or_else(|| charts.density_for(AUTOMATIC_TEXELS)).unwrap_or(params.texels_per_metre);
    let texels = charts.texel_count(params.texels_per_metre);
    let most = (solution.memory_allowed() / TEXEL_BYTES) as f64;
    if texels > most {
        return Err(Error::Lightmap(LightmapError::Texels { texels, most }));
    }
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

    let index: HashMap<(usize, Side), usize> =
        faces.iter().enumerate().map(|(index, f)| ((f.triangle, f.side), index)).collect();
    let audit = baked.judge(monitor, |station| {
        let Some(&index) = index.get(&(station.place.triangle as usize, station.side)) else { return [0.0; 3] };
        let ([a, b, c], at) = (atlas.uv[index], faces[index].mesh_uv(station.uv).as_vec2());
        let page = atlas.triangle_page[index] as usize;
        look_up(atlas.pages[page], &irradiance[page], a + at.x * (b - a) + at.y * (c - a))
    })?;
    Ok(Lightmap {
        pages: atlas.pages.clone(),
        irradiance,
        primitives,
        density: params.texels_per_metre,
        reduced: atlas.reduced,
        texels: count,
        audit,
        seams: [fitted.before, fitted.after],
    })
}

impl From<LightmapError> for Error {
    fn from(error: LightmapError) -> Self {
        Error::Lightmap(error)
    }
}
