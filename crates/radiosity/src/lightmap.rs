//! A solution as a lightmap: every texel is lit like a point of the surface.

use crate::bake::Baked;
use crate::canvas::{Canvas, Drawn};
use crate::eight_bits::{Classes, code};
use crate::faces::lit_vertex;
use crate::judge::{Judge, STEP, Written, WrittenRound, is_stalled, root_mean_square};
use crate::monitor::is_over;
use crate::pace::EDGES;
use crate::{Error, Monitor};
use glam::DVec2;
use radiosity_io::gltf_out::{Encoding, Light, LitPrimitive, PageImage};
use radiosity_io::image_out::encode_png;
use radiosity_scene::{Bands, Mesh, Side};
use radiosity_view::Audit;
use radiosity_view::lightmap::{Allotment, Atlas, Detail, LightmapError, UnwrapParams};
use std::collections::HashMap;

/// A lightmap: pages of linear irradiance, and the primitives that refer to them.
pub struct Lightmap {
    /// Width and height of each page.
    pub pages: Vec<[u32; 2]>,
    /// Irradiance, lx per band, row-major from the top.
    pub irradiance: Vec<Vec<Bands>>,
    /// The primitives to write.
    pub primitives: Vec<LitPrimitive>,
    /// Texels per metre, at least.
    pub density: f64,
    /// Texels per metre where light is roughest.
    pub finest: f64,
    /// Charts that did not fit on a page and got fewer.
    pub reduced: usize,
    /// Texels that were computed.
    pub texels: usize,
    /// What the referee says of the texels as a viewer reads them, before they are stored in 8 bits.
    pub audit: Audit,
    /// The attempts, each with more texels than the one before. That which is read back best is the map.
    pub rounds: Vec<WrittenRound>,
    /// About how many texels the error asked would take, if it was missed and this is known.
    pub needed: Option<f64>,
    /// Root mean square difference across seams, before and after fitting them, lx.
    pub seams: [f64; 2],
    /// Whether a deadline left something undone.
    pub hurried: bool,
}

impl Lightmap {
    /// The pages as pictures of 8 bits, each scaled so that as little as possible is lost: light that is far above all other, on next to nothing of a page, is cut off there.
    ///
    /// # Errors
    /// [`Error::Picture`] if one cannot be encoded.
    pub fn images(&self, encoding: Encoding) -> Result<Vec<PageImage>, Error> {
        let image = |(size, lux): (&[u32; 2], &Vec<Bands>)| {
            let intensity = Classes::new(lux, encoding).brightest();
            let pixels: Vec<[u8; 3]> = lux.iter().map(|e| e.map(|e| code(e / intensity, encoding))).collect();
            Ok(PageImage { png: encode_png(size[0], size[1], &pixels)?, intensity })
        };
        self.pages.iter().zip(&self.irradiance).map(image).collect()
    }

    /// Which part of the light of all texels is off by more than a tenth of itself in such pictures.
    pub fn coarse(&self, encoding: Encoding) -> f64 {
        let of_page = |lux: &Vec<Bands>| {
            let classes = Classes::new(lux, encoding);
            classes.coarse(classes.brightest())
        };
        let add = |[coarse, all]: [f64; 2], own: [f64; 2]| [coarse + own[0], all + own[1]];
        let [coarse, all] = self.irradiance.iter().map(of_page).fold([0.0; 2], add);
        if all > 0.0 { coarse / all } else { 0.0 }
    }
}

/// Memory that a texel takes while it is worked out, about.
pub const TEXEL_BYTES: usize = 600;

/// Texels that the program spends where no density is asked for, and how many for each chart where that is more: the corners of
/// a rectangle.
const AUTOMATIC_TEXELS: f64 = 200_000.0;
const CHART_TEXELS: f64 = 4.0;

/// Part of these that there are however little time there is: texels twice as wide. Wider ones lose the shadows of furniture's legs.
const LEAST_TEXELS: f64 = 0.25;

/// How many times as many texels are spent for an error at most: more than a page of 2048 × 2048 is no lightmap for a room any
/// more.
const MOST_GROWTH: f64 = 20.0;

/// The same where even so many would not reach the error: a map that stayed as it was at first would be worse than that of who asks for more
/// error. A furnished office at 2 % comes from 7.3 to 3.8 % so, in three times the time.
const MOST_IN_VAIN: f64 = 4.0;

/// How many times as many texels as at first are lit in a round at most: it takes as many times as long then.
const MOST_LIT: f64 = 3.0;

/// Rounds after the first map: two or three of finer texels, one to mend what the estimate had wrong.
const ROUNDS: usize = 4;

/// Texels of so many charts where no density is asked for.
pub(crate) fn automatic_texels(charts: usize) -> f64 {
    AUTOMATIC_TEXELS.max(CHART_TEXELS * charts as f64)
}

/// About how many texels the light of a mesh is written in where no density is asked for; most often, a chart has two triangles or
/// more.
pub fn points_about(mesh: &Mesh) -> usize {
    automatic_texels(mesh.triangles.len() / 2) as usize
}

/// A vertex of a primitive: its slot, source corners, weights and texture coordinates, the floats by their bits.
type VertexKey = (usize, [u32; 3], [u32; 3], [u32; 2]);

/// A map and what the referee says of it.
struct Attempt {
    drawn: Drawn,
    audit: Audit,
    /// Texels per metre at most.
    finest: f64,
}

/// Bakes a solution into a lightmap. Where no density is given, texels are made finer where the light is rough until the
/// map as it is read back meets the error that the solution was asked for, or is near that of a solution that misses it.
///
/// # Errors
/// [`Error::Stopped`]; [`Error::Lightmap`] if the layout is impossible.
pub fn lightmap(
    baked: &Baked,
    texels_per_metre: Option<f64>,
    max_page: u32,
    monitor: &dyn Monitor,
) -> Result<Lightmap, Error> {
    let mut params = UnwrapParams { max_page, ..UnwrapParams::default() };
    monitor.stage("unwrap");
    let mut canvas = Canvas::new(&baked.solution, &params)?;
    if texels_per_metre.is_none() {
        let Canvas { faces, charts, .. } = &mut canvas;
        charts.narrow(|face| baked.solution.tracer().scale(faces[face].triangle));
    }
    let most = (baked.solution.memory_allowed() / TEXEL_BYTES) as f64;
    let budget = automatic_texels(canvas.charts.len()).min(most);
    let mut judge = Judge::new(baked, Written::Texels);
    // Where there is no time for that many with the fewest rays, there are fewer.
    let part = if texels_per_metre.is_none() { judge.pace(budget, EDGES, true, monitor)? } else { 1.0 };
    params.texels_per_metre = texels_per_metre
        .or_else(|| canvas.charts.density_for(budget * part.max(LEAST_TEXELS)))
        .unwrap_or(params.texels_per_metre);
    let texels = canvas.charts.texel_count(params.texels_per_metre);
    if texels > most {
        return Err(Error::Lightmap(LightmapError::Texels { texels, most }));
    }
    if texels_per_metre.is_some() {
        judge.pace(texels, EDGES, false, monitor)?;
    }
    let may_be_finer = texels_per_metre.is_none();
    if may_be_finer {
        judge.begin(monitor);
    }
    let mut last = attempt(&canvas, &params, &mut judge, None, monitor)?;
    let mut rounds = vec![last.drawn.round(&last.audit)];
    // Finer texels may be read back worse: where those lie that stand for small things is chance.
    let mut best: Option<Attempt> = None;

    // Finer texels while the map misses what the solution has and the texels that are needed can be had.
    let tolerance = judge.reachable() * root_mean_square(&baked.solution);
    let mut needed = None;
    while may_be_finer
        && rounds.len() <= ROUNDS
        && !is_stalled(&rounds)
        && !is_over(monitor)
        && (last.audit.upper <= judge.reachable() || judge.has_time(STEP * texels, EDGES, monitor))
    {
        let Some(goal) = judge.goal(&last.audit, monitor)? else { break };
        let detail = canvas.detail(&last.drawn, tolerance);
        let allot = |left: f64| canvas.charts.allot(&detail, left, &params);
        let whole = allot(goal.left);
        needed = whole.as_ref().filter(|_| goal.is_for_asked).map(|whole| whole.texels);
        let is_reached = whole.is_some_and(|whole| whole.texels <= most.min(MOST_GROWTH * budget));
        let lit = |step: &Allotment| if goal.relight { step.texels } else { step.rough };
        let is_near = |step: &Allotment| {
            let is_affordable = is_reached || step.texels <= most.min(MOST_IN_VAIN * budget);
            is_affordable && lit(step) <= MOST_LIT * budget && judge.has_time(lit(step), EDGES, monitor)
        };
        // As far as a round may go; if not all the way, it is not the last.
        let Some(step) = goal.steps().filter_map(allot).find(is_near) else { break };
        monitor.note(&rounds[rounds.len() - 1].to_string());
        canvas.charts.finer = step.finer;
        let known = (!goal.relight).then_some((&last.drawn, &detail));
        judge.begin(monitor);
        let next = attempt(&canvas, &params, &mut judge, known, monitor)?;
        rounds.push(next.drawn.round(&next.audit));
        let before = std::mem::replace(&mut last, next);
        let is_better = |than: &Attempt| before.audit.upper < than.audit.upper;
        if is_better(&last) && best.as_ref().is_none_or(is_better) {
            best = Some(Attempt { drawn: before.drawn.handed_out(), ..before });
        }
    }
    if let Some(mut best) = best.filter(|best| best.audit.upper < last.audit.upper) {
        // By all that the referee knows now.
        best.audit = judge.audit(monitor, |station| canvas.read(&best.drawn, station))?;
        if best.audit.upper < last.audit.upper {
            last = best;
        }
    }
    let Attempt { drawn, audit, finest } = last;

    Ok(Lightmap {
        primitives: primitives(&canvas, &drawn.atlas),
        density: params.texels_per_metre,
        reduced: drawn.atlas.reduced,
        finest,
        texels: drawn.texels(),
        needed: needed.filter(|_| audit.upper > baked.error),
        audit,
        seams: [drawn.seams.before, drawn.seams.after],
        rounds,
        hurried: judge.is_hurried(),
        pages: drawn.atlas.pages,
        irradiance: drawn.irradiance,
    })
}

/// Draws a map, as far as it is not known from one before, and judges it.
fn attempt(
    canvas: &Canvas,
    params: &UnwrapParams,
    judge: &mut Judge,
    known: Option<(&Drawn, &Detail)>,
    monitor: &dyn Monitor,
) -> Result<Attempt, Error> {
    let drawn = canvas.draw(params, judge, known, monitor)?;
    let audit = judge.audit(monitor, |station| canvas.read(&drawn, station))?;
    let finest = params.texels_per_metre * canvas.charts.finer.iter().fold(1.0, |most: f64, f| f.max(most));
    Ok(Attempt { drawn, audit, finest })
}

/// The faces as primitives that refer to the pages.
fn primitives(canvas: &Canvas, atlas: &Atlas) -> Vec<LitPrimitive> {
    let mut primitives: Vec<LitPrimitive> = Vec::new();
    let mut current: HashMap<(usize, Side, u32), usize> = HashMap::new();
    let mut known: HashMap<VertexKey, u32> = HashMap::new();
    for (index, face) in canvas.faces.iter().enumerate() {
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
            let vertex = lit_vertex(canvas.tracer(), face.triangle, at);
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
    primitives
}

impl From<LightmapError> for Error {
    fn from(error: LightmapError) -> Self {
        Error::Lightmap(error)
    }
}
