//! Projection surfaces: faces around an eye point, at some resolutions, and what their cells weigh.

use super::face::{Face, Weights};
use super::look::Look;
use super::scan::Scans;
use glam::DVec3;
use std::sync::OnceLock;

/// Cells along a side beyond which refinement stops: a row then takes some seconds.
const REFINED: usize = 1024;

/// Most cells along a side of a projection surface: four million on a face, which are 100 MB.
pub const MOST_CELLS: u16 = 2048;

/// How cells come to show what they show.
#[derive(Clone, Copy, Default)]
pub(super) enum Fill<'a> {
    /// Polygon by polygon, into all cells that it covers.
    #[default]
    Cells,
    /// Window by window, divided where polygons differ. For surfaces whose faces lie above the horizon whole.
    Windows,
    /// All polygons at once, by somebody else.
    #[cfg_attr(not(feature = "gpu"), expect(dead_code, reason = "only graphics hardware does"))]
    By(&'a dyn Raster),
}

/// Finds what cells show.
pub(super) trait Raster: Sync {
    /// Writes down which of the polygons each cell of the face shows; [`super::scan::NONE`] if none.
    fn fill(&self, face: &Face, scans: &Scans, shown: &mut Vec<u32>);
}

/// A method that projects what is around on faces.
pub(super) trait Projection: Sync {
    fn look(&self) -> Look;
    /// Faces of the surface; forward along z is the facet's normal.
    fn faces(&self, resolution: usize) -> Vec<Face>;
    fn weights(&self) -> Weights {
        Weights::Exact
    }
    fn fill(&self) -> Fill<'_> {
        Fill::Cells
    }
    /// Faces keep to the world's axes, whatever the facet's normal.
    fn is_world_aligned(&self) -> bool {
        false
    }
    /// Share of the hemisphere that the faces take in.
    fn captured(&self) -> f64 {
        1.0
    }
    fn renormalises(&self) -> bool {
        false
    }
}

/// The faces of a surface at one resolution.
pub(super) struct Level {
    pub faces: Vec<Face>,
    vectors: Vec<Vec<DVec3>>,
    /// What cells weigh, where that is the same for all facets.
    pub fixed: Option<Vec<Vec<f64>>>,
}

/// The faces of a surface at half its resolution, the whole, twice, ….
pub(super) struct Atlas<'a> {
    pub projection: &'a dyn Projection,
    levels: Vec<OnceLock<Level>>,
}

impl Atlas<'_> {
    pub fn new(projection: &dyn Projection) -> Atlas<'_> {
        let resolution = resolution_of(projection);
        let finer = (1..).take_while(|level| resolution << level <= REFINED).count();
        Atlas { projection, levels: (0..2 + finer).map(|_| OnceLock::new()).collect() }
    }

    /// Number of levels.
    pub fn len(&self) -> usize {
        self.levels.len()
    }

    pub fn level(&self, level: usize) -> &Level {
        self.levels[level].get_or_init(|| {
            let resolution = (resolution_of(self.projection) << level) / 2;
            let faces = self.projection.faces(resolution.next_multiple_of(2));
            let vectors: Vec<_> = faces.iter().map(|face| face.vectors(self.projection.weights())).collect();
            let level = Level { faces, vectors, fixed: None };
            if self.projection.is_world_aligned() {
                return level;
            }
            let fixed = Some(level.weights(self.projection, DVec3::Z));
            Level { vectors: Vec::new(), fixed, ..level }
        })
    }
}

/// An even number of cells from 4 to [`MOST_CELLS`].
fn resolution_of(projection: &dyn Projection) -> usize {
    projection.look().resolution.clamp(4, usize::from(MOST_CELLS)).next_multiple_of(2)
}

impl Level {
    /// What each cell weighs for a facet of normal `normal`. Exact weights of a surface that takes in the whole
    /// hemisphere sum to one: where the horizon cuts through cells, that takes n⁻² of correction.
    pub fn weights(&self, projection: &dyn Projection, normal: DVec3) -> Vec<Vec<f64>> {
        let faces = self.faces.iter().zip(&self.vectors);
        let mut weights: Vec<_> = faces.map(|(face, vectors)| face.weights(vectors, normal)).collect();
        if projection.weights() == Weights::Exact && projection.captured() >= 1.0 {
            let sum: f64 = weights.iter().flatten().sum();
            weights.iter_mut().flatten().for_each(|weight| *weight /= sum);
        }
        weights
    }
}
