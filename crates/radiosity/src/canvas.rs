//! What a lightmap is drawn on: the faces that carry light, laid flat, and how texels are lit. Drawn again with more texels,
//! it keeps what it knows: only where the map before was rough are texels lit anew.

use crate::answer::Station;
use crate::faces::{Face, faces, is_hidden, is_shown_in_part};
use crate::judge::{Judge, WrittenRound};
use crate::texels::{self, Sheet};
use crate::{Error, Monitor, Solution, stations};
use radiosity_scene::{Bands, Side};
use radiosity_trace::Tracer;
use radiosity_view::Audit;
use radiosity_view::lightmap::{
    Atlas, Charts, Detail, SeamInfo, SeamParams, SharedEdge, Texel, UnwrapInput, UnwrapParams, fill, fit_seams,
    look_up, shared_edges,
};
use rayon::prelude::*;
use std::collections::HashMap;

/// Texels that differ from a neighbour by more than this share get more points, as an edge may run through them.
const EDGE_CONTRAST: f64 = 0.1;

/// How many points: stairs of 1/16 are below what a display shows.
const EDGE_POINTS: u32 = 16;

/// A texel that keeps less of its own light than this when it is pooled has the same indirect light at all its points. At 0 all
/// points of edges would gather, which takes most of the time; at 1 gaps narrower than a texel would be lit by its middle.
const SMOOTH: f32 = 0.5;

/// Points that are lit at a time.
const PORTION: usize = 1 << 18;

/// How often an edge is followed on to further texels.
const EDGE_ROUNDS: usize = 4;

/// The faces of a solution, laid flat.
pub(crate) struct Canvas<'b, 'a> {
    solution: &'b Solution<'a>,
    pub faces: Vec<Face>,
    pub charts: Charts,
    /// Edges across which light is continuous: the two faces share both smooth vertices.
    seams: Vec<SharedEdge>,
    index: HashMap<(usize, Side), usize>,
}

/// Light of texels, not a number inside solids, and what was gathered of it where that is smooth; lx per band. And whether something of what a
/// texel stands for may be seen though its middle is not.
struct Lit {
    light: Vec<Bands>,
    smooth: Vec<Option<Bands>>,
    doubtful: Vec<bool>,
}

/// A canvas with its light.
pub(crate) struct Drawn {
    pub atlas: Atlas,
    /// By page, row-major.
    pub irradiance: Vec<Vec<Bands>>,
    /// By page, the texels and the light of each; not a number inside solids.
    texels: Vec<Vec<Texel>>,
    values: Vec<Vec<Bands>>,
    /// The pages before seams were fitted.
    plain: Vec<Vec<Bands>>,
    /// Texels that were lit, not read from a map before.
    pub lit: usize,
    pub seams: SeamInfo,
}

impl Drawn {
    /// Texels in all.
    pub fn texels(&self) -> usize {
        self.texels.iter().map(Vec::len).sum()
    }

    /// Without what another map would be drawn by.
    pub fn handed_out(self) -> Drawn {
        Drawn { values: Vec::new(), plain: Vec::new(), ..self }
    }

    /// What came of it.
    pub fn round(&self, audit: &Audit) -> WrittenRound {
        WrittenRound { points: self.texels(), lit: self.lit, error: audit.error, upper: audit.upper }
    }
}

impl<'b, 'a> Canvas<'b, 'a> {
    pub fn new(solution: &'b Solution<'a>, params: &UnwrapParams) -> Result<Canvas<'b, 'a>, Error> {
        let mesh = solution.tracer().mesh;
        let faces = faces(solution);
        let corners = |of: &[[u32; 3]]| -> Vec<[u32; 3]> {
            faces.iter().map(|f| f.order().map(|corner| of[f.triangle][corner])).collect()
        };
        let (triangles, smooth) = (corners(&mesh.triangles), corners(&mesh.smooth));
        let group: Vec<u32> = faces.iter().map(|f| 2 * f.object as u32 + f.side as u32).collect();
        let input = UnwrapInput { positions: &mesh.vertices, triangles: &triangles, group: &group, smooth: &smooth };
        let charts = Charts::new(&input, params)?;
        let side: Vec<u32> = faces.iter().map(|f| f.side as u32).collect();
        let seams = shared_edges(&smooth, Some(&side));
        let index = faces.iter().enumerate().map(|(index, f)| ((f.triangle, f.side), index)).collect();
        Ok(Canvas { solution, faces, charts, seams, index })
    }

    /// Lights all texels; those that a map drawn `before` tells well enough are read from it.
    pub fn draw(
        &self,
        params: &UnwrapParams,
        judge: &Judge,
        before: Option<(&Drawn, &Detail)>,
        monitor: &dyn Monitor,
    ) -> Result<Drawn, Error> {
        let atlas = self.charts.pack(params)?;
        let (mut all, mut lights, mut plain, mut lit) = (Vec::new(), Vec::new(), Vec::new(), 0);
        let later = |page: usize| atlas.pages[page + 1..].iter().map(|[width, height]| (width * height) as usize).sum();
        for (page, size) in atlas.pages.iter().enumerate() {
            let texels = atlas.texels(page);
            let known: Vec<Option<Bands>> = match before {
                Some((older, detail)) => {
                    texels.par_iter().map(|t| atlas.told(t, &older.atlas, &older.plain, detail)).collect()
                }
                None => vec![None; texels.len()],
            };
            let fresh: Vec<Texel> = texels.iter().zip(&known).filter(|(_, e)| e.is_none()).map(|(t, _)| *t).collect();
            lit += fresh.len();
            let at = |t: &Texel| usize::from(t.y) * size[0] as usize + usize::from(t.x);
            let Lit { light, smooth, doubtful } = self.light(&atlas, page, &fresh, judge, monitor)?;
            let smooth: HashMap<usize, Bands> =
                fresh.iter().zip(smooth).filter_map(|(texel, light)| Some((at(texel), light?))).collect();
            let mut fresh = light.into_iter();
            let mut values: Vec<Bands> = known.iter().filter_map(|e| e.or_else(|| fresh.next())).collect();
            let mut points = texels.clone();
            let mut of_fresh = doubtful.into_iter();
            let mut doubtful: Vec<bool> = known.iter().map(|e| e.is_none() && of_fresh.next() == Some(true)).collect();
            // What is known gets no more points: it counts twice.
            for (texel, value) in texels.iter().zip(&known) {
                if let Some(value) = value {
                    points.push(*texel);
                    values.push(*value);
                }
            }
            for _ in 0..EDGE_ROUNDS {
                doubtful.resize(points.len(), false);
                let more = atlas.finer(page, (&points, &values, &doubtful), EDGE_CONTRAST, EDGE_POINTS);
                if more.is_empty() || !judge.has_time_for_edges(more.len(), EDGE_POINTS, later(page), monitor) {
                    break;
                }
                // In portions, as they may be many times as many as the texels.
                for some in more.chunks(PORTION) {
                    let indirect: Vec<_> = some.iter().map(|texel| smooth.get(&at(texel)).copied()).collect();
                    values.extend(self.light_edges(some, &indirect, judge, monitor)?);
                }
                points.extend(more);
            }
            let picture = fill(*size, &points, &values);
            let mut shows = vec![false; picture.len()];
            for (point, _) in points.iter().zip(&values).filter(|(_, e)| e[0].is_finite()) {
                shows[at(point)] = true;
            }
            let value = |t: &Texel| if shows[at(t)] { picture[at(t)] } else { [f32::NAN; 3] };
            lights.push(texels.iter().map(value).collect());
            all.push(texels);
            plain.push(picture);
        }
        monitor.stage("seams");
        let mut irradiance = plain.clone();
        let seams = fit_seams(&atlas, &self.seams, &mut irradiance, &SeamParams::default());
        Ok(Drawn { atlas, irradiance, texels: all, values: lights, plain, lit, seams })
    }

    pub fn tracer(&self) -> &'a Tracer<'a> {
        self.solution.tracer()
    }

    /// What is rough on a map.
    pub fn detail(&self, drawn: &Drawn, tolerance: f64) -> Detail {
        drawn.atlas.detail(&drawn.texels, &drawn.values, tolerance)
    }

    /// What a viewer reads from a map at a place; nothing where it has no light.
    pub fn read(&self, drawn: &Drawn, station: &Station) -> Bands {
        let Some(&index) = self.index.get(&(station.place.triangle as usize, station.side)) else { return [0.0; 3] };
        let ([a, b, c], at) = (drawn.atlas.uv[index], self.faces[index].mesh_uv(station.uv).as_vec2());
        let page = drawn.atlas.triangle_page[index] as usize;
        look_up(drawn.atlas.pages[page], &drawn.irradiance[page], a + at.x * (b - a) + at.y * (c - a))
    }

    /// Every texel is lit like a point of the surface; those inside solids are left to their neighbours. What is gathered is pooled, and
    /// direct light: where that is smooth, points of a texel differ by the edges of shadows alone.
    fn light(
        &self,
        atlas: &Atlas,
        page: usize,
        texels: &[Texel],
        judge: &Judge,
        monitor: &dyn Monitor,
    ) -> Result<Lit, Error> {
        let all = self.stations(texels);
        let hidden: Vec<bool> = all.par_iter().map(|station| is_hidden(self.solution, station)).collect();
        let shown: Vec<usize> = (0..texels.len()).filter(|&i| !hidden[i]).collect();
        let (own, at): (Vec<Texel>, Vec<Station>) = shown.iter().map(|&i| (texels[i], all[i])).unzip();
        let sheet = Sheet { atlas, page, texels: &own };
        let found = texels::light(judge.baked(), sheet, &at, (judge.gathers(), judge.thinned()), monitor)?;
        let (mut light, mut smooth) = (vec![[f32::NAN; 3]; texels.len()], vec![None; texels.len()]);
        for (&i, (d, p)) in shown.iter().zip(found.direct.iter().zip(&found.indirect)) {
            light[i] = std::array::from_fn(|k| d[k] + p.light[k]);
            smooth[i] = (p.own < SMOOTH).then_some(p.light);
        }
        let is_doubtful =
            |(is_hidden, station): (&bool, &Station)| *is_hidden && is_shown_in_part(self.solution, station);
        let doubtful = hidden.iter().zip(&all).map(is_doubtful).collect();
        Ok(Lit { light, smooth, doubtful })
    }

    /// Further points of texels, whose indirect light may be known.
    fn light_edges(
        &self,
        points: &[Texel],
        indirect: &[Option<Bands>],
        judge: &Judge,
        monitor: &dyn Monitor,
    ) -> Result<Vec<Bands>, Error> {
        let at = self.stations(points);
        let mut values = vec![[f32::NAN; 3]; points.len()];
        let shown: Vec<usize> =
            (0..points.len()).into_par_iter().filter(|&i| !is_hidden(self.solution, &at[i])).collect();
        let (smooth, rest): (Vec<usize>, Vec<usize>) = shown.into_iter().partition(|i| indirect[*i].is_some());
        let of = |chosen: &[usize]| -> Vec<Station> { chosen.iter().map(|i| at[*i]).collect() };
        for (i, direct) in smooth.iter().zip(judge.direct(&of(&smooth), EDGE_POINTS, monitor)?) {
            values[*i] = std::array::from_fn(|k| direct[k] + indirect[*i].map_or(0.0, |light| light[k]));
        }
        for (i, light) in rest.iter().zip(judge.light(&of(&rest), EDGE_POINTS, monitor)?.irradiance) {
            values[*i] = light;
        }
        Ok(values)
    }

    pub fn stations(&self, texels: &[Texel]) -> Vec<Station> {
        let station = |texel: &Texel| {
            let face = self.faces[texel.triangle as usize];
            stations::station(self.solution.tracer(), face.triangle, face.mesh_uv(texel.uv.as_dvec2()), face.side)
        };
        texels.iter().map(station).collect()
    }
}
