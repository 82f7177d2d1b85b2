//! Lightmaps: every surface of a scene laid out on a few pictures, at the same number of texels per metre everywhere or
//! finer where light is rough ([`Charts::allot`]).
//!
//! A *chart* is a connected part of one group of triangles that is laid flat in one piece. The ideal chart of
//! architecture is a maximal coplanar region: it keeps every length and angle, and where it is a rectangle its
//! border runs through texel centres, so that the two walls of a corner sample the very same points. Smooth curved
//! parts are joined while their normals stay in a narrow cone ([`UnwrapParams::cone_degrees`]) and projected along its axis:
//! nothing folds over, and a texel covers at most 1/cos of the cone more surface than elsewhere. Charts that overlap
//! themselves all the same (a winding ramp) are cut apart.
//!
//! The way: [`Charts::new`] lays flat (no density yet), [`Charts::texel_count`] says what a density would cost,
//! [`Charts::pack`] makes the [`Atlas`], [`Atlas::texels`] the points to evaluate, [`Atlas::pooled`] takes noise from what they
//! gather, [`Atlas::finer`] gives more of them where shadows end, [`fill`] the picture and [`fit_seams`] lets both sides of a seam agree. Coordinates: u to the right, v down, texel (x, y) centred at
//! ((x + ½)/width, (y + ½)/height) as in glTF.

mod allot;
mod charts;
mod edges;
mod fill;
mod finer;
mod flatten;
mod pack;
mod seams;
mod share;
mod texels;

pub use allot::{Allotment, Detail, GAIN, LOST};
pub use edges::{SharedEdge, shared_edges};
pub use fill::{fill, look_up};
pub use flatten::Charts;
pub use seams::{SeamInfo, SeamParams, fit_seams};
pub use share::Around;
pub use texels::Texel;

use glam::{DVec2, DVec3, Vec2};
use pack::{Placement, pack};

/// Triangles to lay out.
#[derive(Clone, Copy, Debug)]
pub struct UnwrapInput<'a> {
    /// Positions, metres; charts are connected only across edges whose vertex indices are shared (welded).
    pub positions: &'a [DVec3],
    /// Vertex indices, counter-clockwise from the front.
    pub triangles: &'a [[u32; 3]],
    /// A number for each triangle; charts never cross from one number to another.
    pub group: &'a [u32],
    /// The smooth vertex of each corner: where two triangles of a plane share none along an edge, a wall stands on it, and
    /// the chart ends. Empty where no wall does.
    pub smooth: &'a [[u32; 3]],
}

/// How to lay out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnwrapParams {
    /// Texels per metre of surface.
    pub texels_per_metre: f64,
    /// Largest width and height of a page, texels: at most 65535.
    pub max_page: u32,
    /// Unused texels between two charts. Bilinear look-ups stay inside a chart's own texels even with 0; the
    /// padding is for mip-maps and block compression, one level for each doubling.
    pub padding: u32,
    /// Half angle of the cone that holds the normals of one chart, degrees, at most 75. At 45 a texel covers at most 1.41
    /// times the surface along one direction; half of it doubles the seams on round things.
    pub cone_degrees: f64,
    /// Charts of curved surfaces do not cross edges sharper than this, degrees: 30 keeps the sides of a 12-sided
    /// column together and a chamfer of 45 apart.
    pub crease_degrees: f64,
}

impl Default for UnwrapParams {
    fn default() -> Self {
        UnwrapParams { texels_per_metre: 20.0, max_page: 4096, padding: 2, cone_degrees: 45.0, crease_degrees: 30.5 }
    }
}

/// Why no atlas could be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LightmapError {
    /// `group` has not one entry for each triangle.
    #[error("{groups} group numbers for {triangles} triangles")]
    Groups {
        /// Group numbers given.
        groups: usize,
        /// Triangles given.
        triangles: usize,
    },
    /// A triangle names a vertex that is not there.
    #[error("triangle {triangle} names vertex {vertex}, but there are only {vertices}")]
    Vertex {
        /// Index of the triangle.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A position is not finite or farther than 1e9 m from the origin.
    #[error("vertex {vertex} at {position} is out of range")]
    Position {
        /// Index of the vertex.
        vertex: usize,
        /// Its position.
        position: DVec3,
    },
    /// A parameter is outside its range.
    #[error("{name} is {value}, but must be {range}")]
    Parameter {
        /// Which.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        range: &'static str,
    },
    /// More texels than the memory that is allowed can hold.
    #[error("{texels:.0} texels are asked for and {most:.0} are allowed; ask for fewer per metre or allow more memory")]
    Texels {
        /// About how many are asked for.
        texels: f64,
        /// How many are allowed.
        most: f64,
    },
}

/// Where every triangle lies on the pages.
#[derive(Clone, Debug, PartialEq)]
pub struct Atlas {
    /// Width and height of each page, texels.
    pub pages: Vec<[u32; 2]>,
    /// Page of each triangle.
    pub triangle_page: Vec<u32>,
    /// Chart of each triangle.
    pub triangle_chart: Vec<u32>,
    /// Texture coordinates of each triangle's corners, 0..1 on its page.
    pub uv: Vec<[Vec2; 3]>,
    /// Charts that were too large for a page and got fewer texels per metre.
    pub reduced: usize,
    charts: Vec<Placed>,
}

/// A chart on its page.
#[derive(Clone, Debug, PartialEq)]
struct Placed {
    triangles: Vec<u32>,
    /// Corners in texels from the chart's first texel centre, not yet rotated; an axis thinner than half a texel is
    /// *collapsed*: all its points read one row of texels, but here it keeps its width.
    local: Vec<[DVec2; 3]>,
    /// Width in texels of the collapsed axes, `None` for the others.
    collapsed: [Option<f64>; 2],
    /// Texels along the axes, not yet rotated.
    size: [u32; 2],
    /// Surface that a texel stands for, about, m².
    texel: f64,
    at: Placement,
}

/// Axes thinner than this many texels read a single row: two rows would cost twice as much and show nothing more.
const COLLAPSE: f64 = 0.5;

impl UnwrapParams {
    fn check(&self) -> Result<(), LightmapError> {
        let density = self.texels_per_metre;
        let fault = |name, value, range| Err(LightmapError::Parameter { name, value, range });
        if !(density > 0.0 && density < 1e9) {
            return fault("texels_per_metre", density, "above 0 and below 1e9");
        }
        if !(2..=65535).contains(&self.max_page) {
            return fault("max_page", self.max_page.into(), "2 to 65535");
        }
        if self.padding > 1024 {
            return fault("padding", self.padding.into(), "at most 1024");
        }
        if !(0.0..=75.0).contains(&self.cone_degrees) {
            return fault("cone_degrees", self.cone_degrees, "0 to 75");
        }
        if !(0.0..=180.0).contains(&self.crease_degrees) {
            return fault("crease_degrees", self.crease_degrees, "0 to 180");
        }
        Ok(())
    }
}

impl Charts {
    /// Gives every chart its texels and its place. The same input gives the same atlas for any number of threads.
    pub fn pack(&self, params: &UnwrapParams) -> Result<Atlas, LightmapError> {
        params.check()?;
        let mut reduced = 0;
        let mut charts = Vec::with_capacity(self.charts.len());
        for (index, chart) in self.charts.iter().enumerate() {
            let (finer, narrow) = (self.finer[index], self.narrow[index]);
            // Scale to texels; too large a chart gets what a page can hold.
            let most = f64::from(params.max_page - 1) / chart.extent.max_element();
            reduced += usize::from(params.texels_per_metre * narrow > most);
            let scale = (params.texels_per_metre * narrow * finer).min(most);
            let axes =
                [chart.extent.x, chart.extent.y].map(|extent| axis(extent * scale, chart.rectangle, params.max_page));
            let stretch = DVec2::new(axes[0].stretch, axes[1].stretch) * scale;
            charts.push(Placed {
                triangles: chart.triangles.clone(),
                local: chart.local.iter().map(|corners| corners.map(|p| p * stretch)).collect(),
                collapsed: axes.map(|axis| axis.collapsed),
                size: axes.map(|axis| axis.count),
                texel: chart.area / self.count(index, scale / (narrow * finer)),
                at: Placement::default(),
            });
        }

        let sizes: Vec<[u32; 2]> = charts.iter().map(|chart| chart.size).collect();
        let (places, pages) = pack(&sizes, params.max_page, params.padding);
        let mut atlas = Atlas {
            pages,
            triangle_page: vec![0; self.triangles],
            triangle_chart: vec![0; self.triangles],
            uv: vec![[Vec2::ZERO; 3]; self.triangles],
            reduced,
            charts,
        };
        for (index, (chart, at)) in atlas.charts.iter_mut().zip(places).enumerate() {
            chart.at = at;
            let [width, height] = atlas.pages[at.page as usize].map(f64::from);
            for (&triangle, corners) in chart.triangles.iter().zip(&chart.local) {
                let triangle = triangle as usize;
                atlas.triangle_page[triangle] = at.page;
                atlas.triangle_chart[triangle] = index as u32;
                atlas.uv[triangle] = corners.map(|p| {
                    let p = chart.on_page(p) + 0.5;
                    Vec2::new((p.x / width) as f32, (p.y / height) as f32)
                });
            }
        }
        Ok(atlas)
    }

    /// About how many texels [`Atlas::texels`] will list in all, a little too many for ragged charts; costs neither
    /// the packing nor the memory.
    pub fn texel_count(&self, texels_per_metre: f64) -> f64 {
        (0..self.len()).map(|chart| self.count(chart, texels_per_metre)).sum()
    }

    /// The same for one chart.
    fn count(&self, chart: usize, texels_per_metre: f64) -> f64 {
        let density = texels_per_metre * self.narrow[chart] * self.finer[chart];
        let chart = &self.charts[chart];
        let [x, y] = [chart.extent.x, chart.extent.y].map(|extent| axis(extent * density, chart.rectangle, u32::MAX));
        let all = f64::from(x.count) * f64::from(y.count);
        // Area of the chart widened by a bilinear footprint (a square of two texels): Steiner's formula.
        let widened = (chart.area * density + chart.outline) * density + 4.0;
        all.min(widened)
    }

    /// The largest density, texels per metre, whose [`Charts::texel_count`] stays within `budget`; `None` where even
    /// one texel for each chart is too much.
    pub fn density_for(&self, budget: f64) -> Option<f64> {
        let (mut low, mut high) = (1e-6, 1e6);
        if budget.is_nan() || self.texel_count(low) > budget {
            return None;
        }
        // 60 halvings of 12 decades: to the last few bits.
        for _ in 0..60 {
            let middle: f64 = f64::sqrt(low * high);
            if self.texel_count(middle) <= budget { low = middle } else { high = middle }
        }
        Some(low)
    }
}

#[derive(Clone, Copy)]
struct Axis {
    count: u32,
    stretch: f64,
    collapsed: Option<f64>,
}

/// How many texels a length (in texels) takes when its start lies on a texel centre. Rectangles are stretched by at
/// most half a texel so that their end lies on a centre too.
fn axis(length: f64, rectangle: bool, most: u32) -> Axis {
    if length < COLLAPSE {
        return Axis { count: 1, stretch: 1.0, collapsed: Some(length) };
    }
    if rectangle {
        let steps = length.round().max(1.0).min(f64::from(most - 1));
        return Axis { count: steps as u32 + 1, stretch: steps / length, collapsed: None };
    }
    // A millionth of a texel beyond a centre is rounding, not surface.
    Axis { count: ((length - 1e-6).ceil() as u32).saturating_add(1).min(most), stretch: 1.0, collapsed: None }
}

impl Placed {
    /// Texel coordinates on the page (texel centres at whole numbers) of a local point.
    fn on_page(&self, p: DVec2) -> DVec2 {
        let p = DVec2::new(
            if self.collapsed[0].is_some() { 0.0 } else { p.x },
            if self.collapsed[1].is_some() { 0.0 } else { p.y },
        );
        let p = if self.at.rotated { DVec2::new(p.y, p.x) } else { p };
        p + DVec2::new(f64::from(self.at.x), f64::from(self.at.y))
    }

    /// Where texel (x, y), not yet rotated, stands on a page of a width.
    fn slot(&self, x: u32, y: u32, width: u32) -> usize {
        let (x, y) = if self.at.rotated { (y, x) } else { (x, y) };
        (self.at.y + y) as usize * width as usize + (self.at.x + x) as usize
    }
}

impl Atlas {
    /// Number of charts.
    pub fn chart_count(&self) -> usize {
        self.charts.len()
    }
}

#[cfg(test)]
mod tests;
