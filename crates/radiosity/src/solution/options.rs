//! How to solve: what is asked for, what it may take, and which methods go together.

use super::Solution;
use crate::displayed::Displayed;
use crate::equation::{RANDOM_TOLERANCE, TABLE_TOLERANCE};
use crate::{Error, Monitor};
use radiosity_scene::{CellWidth, Mesh, Scene};
use radiosity_solve::{Params, Solver};
use radiosity_trace::Tracer;
use radiosity_transport::exposure::Care;
use radiosity_transport::{FormFactorMethod, Shadowing};

/// How to solve.
#[derive(Clone, Copy, Debug)]
pub struct SolveOptions {
    /// Width of all cells, metres: of an element, where direct light is even. `None` chooses it by `cells`, and smaller where a surface is
    /// more important than its area tells ([`Tracer::seen_from`]).
    pub element_size: Option<f64>,
    /// Whether what comes of it is only looked up, by a gather: triangles much smaller than cells get their share of the
    /// rays then, as the noise of many averages out.
    pub looked_up: bool,
    /// Whether points of the elements are shown, as texels are. Then what lies inside of solids that touch each other is told from what is
    /// seen, which takes longer; who asks for points of their own does without.
    pub shown: bool,
    /// How many cells to aim for on top of one per triangle; two thousand at most where a matrix grows with their square and `variation` is finite. At ten thousand the walls of a room are cut into cells of
    /// some 15 cm, and their light varies by a few percent from cell to cell.
    pub cells: usize,
    /// How much direct light may vary within elements: the flux that leaves them by their standard deviation, relative
    /// to that of their direct light.
    pub variation: f64,
    /// M: rays per cell.
    pub rays: usize,
    /// Shadow rays per cell. Their noise averages out over the elements that a receiver sees.
    pub shadowing: Shadowing,
    /// How light between elements is found: by the table of hit ids where there is none, else by one of the methods for
    /// form factors, whose matrix grows with the square of the elements. Light of lamps and sky is found the same way in
    /// either case.
    pub form_factors: Option<FormFactorMethod>,
    /// The solver.
    pub solver: Solver,
    /// When it stops. Random solvers are better asked for [`RANDOM_TOLERANCE`](crate::RANDOM_TOLERANCE): see
    /// [`SolveOptions::of`].
    pub params: Params,
    /// Stops when what is displayed is near enough, whatever the residual.
    pub displayed: Option<Displayed>,
    /// Memory that the scene, its mesh and tree, the solution and what is written of it may take, bytes. Rays that it does not hold
    /// lie in a temporary file, in the system's folder for such, and are read from there at each sweep: that takes longer, and the
    /// numbers are the same.
    pub memory: usize,
}

impl Default for SolveOptions {
    fn default() -> Self {
        SolveOptions {
            element_size: None,
            looked_up: false,
            shown: true,
            cells: 10_000,
            variation: 0.05,
            rays: 64,
            shadowing: Shadowing { places: 8, rays: 2 },
            form_factors: None,
            solver: Solver::DeflatedJacobi,
            params: Params { tolerance: 1e-4, ..Params::default() },
            displayed: None,
            memory: 4 << 30,
        }
    }
}

/// Rays per cell below which what elements show is of no use; what looks them up can do with fewer.
const LEAST_RAYS: usize = 32;

/// Most bytes of a ray whose hit is an entry of a stored matrix: 16 among those of its row, up to as many that are spare there, and
/// 12 in the matrix.
const ENTRY: usize = 44;

/// Most cells where form factors or elimination fill a matrix, unless an element size is asked for: four million pairs.
const MATRIX_CELLS: usize = 2000;

impl SolveOptions {
    /// The default with a solver, and the residual that it is good for.
    pub fn of(solver: Solver) -> SolveOptions {
        let mut options = SolveOptions { solver, ..SolveOptions::default() };
        if solver.is_random() {
            options.params.tolerance = RANDOM_TOLERANCE;
        }
        options
    }

    /// How closely it is looked for what of the elements is buried.
    pub(super) fn care(&self) -> Care {
        match (self.looked_up, self.shown) {
            (false, _) => Care::Full,
            (true, true) => Care::Contacts,
            (true, false) => Care::Glance,
        }
    }

    /// Fewer cells, and none of them divided, where a matrix grows with the square of the elements; as many as asked where it is said
    /// already that none is to be divided.
    pub(crate) fn suit_method(&mut self) {
        let is_stored = self.form_factors.is_some() || self.solver.is_direct();
        if is_stored && self.variation.is_finite() {
            (self.cells, self.variation) = (self.cells.min(MATRIX_CELLS), f64::INFINITY);
        }
    }

    /// Refuses a solver that has no right to sheets, or to the factors of the method: only the adaptive one stores a pair
    /// once for both directions.
    pub(super) fn refuse_unfit_solver(&self, scene: &Scene) -> Result<(), Error> {
        if scene.transmits() && !self.solver.takes_sheets() {
            return Err(Error::Transmission { solver: self.solver });
        }
        if !self.solver.needs_reciprocity() || self.form_factors == Some(FormFactorMethod::Adaptive) {
            return Ok(());
        }
        let method = self.form_factors.map_or("rays", FormFactorMethod::name);
        Err(Error::Reciprocity { solver: self.solver, method })
    }

    /// Refuses a residual that single precision does not tell, before the work.
    pub(super) fn refuse_beyond_single_precision(&self) -> Result<(), Error> {
        let is_applied = self.form_factors.is_none() && self.solver.applies_only() && self.displayed.is_none();
        let (asked, least) = (self.params.tolerance, TABLE_TOLERANCE);
        if is_applied && asked < least { Err(Error::Tolerance { asked, least }) } else { Ok(()) }
    }

    /// Refuses elimination of so many elements that its matrices are beyond the memory.
    pub(super) fn refuse_large_matrices(&self, elements: usize) -> Result<(), Error> {
        let (solver, needed, allowed) = (self.solver, self.solver.matrix_bytes(elements), self.memory);
        if needed > allowed { Err(Error::Elimination { solver, elements, needed, allowed }) } else { Ok(()) }
    }

    /// Bytes of the matrix that the table of so many cells and elements is copied to, for solvers that need rows; none where it is only
    /// applied. Elements of a cell share its rays, and have two at least each.
    pub(super) fn stored(&self, cells: usize, elements: usize) -> usize {
        let is_stored = self.form_factors.is_none() && !self.solver.applies_only();
        let rays = cells.saturating_mul(self.rays).saturating_add(2 * elements.saturating_sub(cells));
        if is_stored { rays.saturating_mul(ENTRY) } else { 0 }
    }

    /// Fewer rays where they become a matrix that the memory does not hold, and larger elements where no size is asked for: an error that
    /// is missed tells more than none.
    pub(crate) fn fit(&mut self, tracer: &Tracer, monitor: &dyn Monitor) {
        let lacks_room = |options: &SolveOptions| Solution::memory(tracer, options) > options.memory;
        // Rays that may lie in a file take none of it.
        while self.rays > LEAST_RAYS && self.stored(1, 1) > 0 && lacks_room(self) {
            self.rays /= 2;
        }
        let usual = cell_width(tracer.mesh, tracer.scales(), self).size;
        while self.element_size.is_none() && self.cells > 1 && lacks_room(self) {
            self.cells = self.cells * 3 / 4;
        }
        let wider = cell_width(tracer.mesh, tracer.scales(), self).size / usual;
        if wider > 1.0 {
            monitor.note(&format!("elements are {wider:.1} times as wide as usual: memory holds no more"));
        }
    }
}

/// Width of cells: as asked, or such that the scene's area makes as many as asked, narrower in places of a smaller scale.
pub(crate) fn cell_width<'s>(mesh: &Mesh, scales: &'s [f32], options: &SolveOptions) -> CellWidth<'s> {
    options.element_size.map_or_else(
        || CellWidth { size: (2.0 * scaled_area(mesh, scales) / options.cells.max(1) as f64).sqrt(), scales },
        CellWidth::from,
    )
}

/// Area that each triangle would have were all places of one scale, m².
pub(crate) fn scaled_area(mesh: &Mesh, scales: &[f32]) -> f64 {
    let scale = |t: usize| scales.get(t).map_or(1.0, |scale| f64::from(*scale));
    (0..mesh.triangles.len()).map(|t| mesh.area(t) / scale(t).powi(2)).sum()
}
