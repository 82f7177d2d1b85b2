//! The solution: radiosity on elements, and all that is needed to read it, refine it, and re-light it.
//!
//! The unknown is X = B − P, the radiosity without the part P that [`Luminaires`] carry to every receiver directly:
//! X = (E − P) + R (D + S + F X), with D the direct irradiance and S the sky's, both known before the solve.

mod balance;
mod focus;
mod options;

pub use balance::Balance;
pub(crate) use focus::Looking;
pub use options::SolveOptions;
pub(crate) use options::{cell_width, scaled_area};

use crate::Error;
use crate::displayed::{Screen, Shown};
use crate::division::{Optics, Sheets, divided};
use crate::equation::{self, Matrix, Task, single};
use crate::footprint::{self, least_memory};
use crate::monitor::{Begin, Hurry, Monitor, Stages, Timed, Watch, is_over};
use crate::pace;
use radiosity_scene::{Bands, Elements, SkyPatches, size};
use radiosity_solve::{DiffuseResponse, Info};
use radiosity_trace::Tracer;
use radiosity_transport::{Columns, ElementReceivers, Exposure, ExtendError, Gather, HitTable, IdSpace, Luminaires};
use std::time::Duration;

/// Rays per cell that are traced whether or not there is time, where elements are [`FEW`]: a tenth of a second for a room.
const FIRST_RAYS: usize = 16;

/// Part of the time left for rays that is kept for solving with them, which takes an eighth to a fifth as long. Without it a sun-lit room
/// within a wide landscape still had most of the ambient term, which is the landscape's: half as much light again as there was.
const SOLVED: f64 = 0.2;

/// So many elements get their direct light and their first rays whether or not there is time: a few seconds. A building of a
/// million triangles took 102 s where 60 were allowed.
pub(crate) const FEW: usize = 100_000;

/// A solved scene.
pub struct Solution<'a> {
    tracer: &'a Tracer<'a>,
    /// The elements.
    pub elements: Elements,
    /// What of them is exposed.
    pub exposure: Exposure,
    /// The lights that are evaluated directly.
    pub luminaires: Luminaires,
    /// Direct irradiance by element and light, lux per band.
    pub columns: Columns,
    /// Area of each element, m².
    pub area: Vec<f64>,
    /// Reflectance of each element.
    pub reflectance: Vec<Bands>,
    /// What passes through sheets.
    sheets: Sheets,
    /// Emitted exitance of each element, lm/m² per band.
    pub exitance: Vec<Bands>,
    /// Residual, bound and steps of the last solve.
    pub info: Info,
    /// Time by stage.
    pub stages: Stages,
    /// Width of a cell, metres; of the widest where what is seen has smaller ones.
    pub element_size: f64,
    /// Width of the cells of each triangle relative to that; empty where all are as wide.
    pub(crate) scales: Vec<f32>,
    sky: SkyPatches,
    table: HitTable,
    /// Whether time left fewer rays than were asked for.
    pub(crate) is_cut: bool,
    /// What other methods than rays found of F between elements.
    matrix: Option<Matrix>,
    pub(crate) options: SolveOptions,
    /// X by id: reflected and not directly carried radiosity of elements, then the sky's, then nothing.
    values: Vec<[f32; 4]>,
    irradiance: Vec<Bands>,
    indirect: Vec<Bands>,
}

impl<'a> Solution<'a> {
    /// Cuts the scene into elements, traces their rays and solves: [`Solution::begin`] and one [`Solution::refine`].
    ///
    /// # Errors
    /// [`Error::Memory`] and [`Error::Elimination`] before anything large is allocated; [`Error::Reciprocity`];
    /// [`Error::Stopped`]; [`Error::Solve`]; [`Error::File`].
    pub fn new(tracer: &'a Tracer<'a>, options: &SolveOptions, monitor: &dyn Monitor) -> Result<Solution<'a>, Error> {
        Solution::scaled(tracer, tracer.scales().to_vec(), options, monitor)
    }

    /// A first answer, before any row is traced: elements, their direct light, and for the rest the ambient term
    /// (Cohen et al. 1988, sect. 4.2), the same indirect irradiance everywhere that keeps the energy. Sky light comes with
    /// the rows. Call [`Solution::refine`] with ever more rays for ever better answers; each is whole.
    ///
    /// # Errors
    /// [`Error::Memory`] and [`Error::Elimination`] before anything large is allocated; [`Error::Reciprocity`];
    /// [`Error::Transmission`]; [`Error::Tolerance`]; [`Error::Stopped`].
    pub fn begin(tracer: &'a Tracer<'a>, options: &SolveOptions, monitor: &dyn Monitor) -> Result<Solution<'a>, Error> {
        Solution::begin_scaled(tracer, tracer.scales().to_vec(), options, monitor)
    }

    /// [`Solution::new`] with cells of other widths relative to each other ([`Solution::focused`]).
    pub(crate) fn scaled(
        tracer: &'a Tracer<'a>,
        scales: Vec<f32>,
        options: &SolveOptions,
        monitor: &dyn Monitor,
    ) -> Result<Solution<'a>, Error> {
        let mut solution = Solution::begin_scaled(tracer, scales, options, monitor)?;
        solution.refine(options.rays, monitor)?;
        Ok(solution)
    }

    fn begin_scaled(
        tracer: &'a Tracer<'a>,
        scales: Vec<f32>,
        options: &SolveOptions,
        monitor: &dyn Monitor,
    ) -> Result<Solution<'a>, Error> {
        let (scene, mesh) = (tracer.scene, tracer.mesh);
        if mesh.triangles.is_empty() {
            return Err(Error::Empty("the scene has no surface"));
        }
        let mut options = *options;
        options.suit_method();
        let options = &options;
        options.refuse_unfit_solver(scene)?;
        options.refuse_beyond_single_precision()?;
        let stages = Stages::default();
        let width = cell_width(mesh, &scales, options);
        options.refuse_large_matrices(Elements::count(scene, mesh, width))?;
        let needed = Solution::memory_scaled(tracer, &scales, options);
        if needed > options.memory {
            return Err(memory_error(tracer, Elements::count(scene, mesh, width), needed, options));
        }
        let lights = Luminaires::most(scene);
        let needed = |elements: usize, cells: usize| {
            footprint::solution(tracer, elements, lights).saturating_add(options.stored(cells, elements))
        };
        let begin = |elements: usize| Begin { monitor, is_soon: elements <= FEW };
        stages.time(monitor, "beams", || tracer.beams());
        stages.time(monitor, "openings", || tracer.openings());
        let elements = stages.time(monitor, "elements", || {
            let cells = Elements::new(scene, mesh, width);
            let cells = if options.looked_up { cells.shared(&width) } else { cells };
            // Coarser light, where there is no room or time for finer.
            let (whole, of_piece) = (needed(cells.len(), cells.cells()), needed(1, 0) - needed(0, 0));
            let in_memory = cells.len() + options.memory.saturating_sub(whole) / of_piece;
            let in_time = if monitor.deadline().is_some() { FEW.max(cells.len()) } else { usize::MAX };
            match divided(tracer, &cells, options.variation, in_memory.min(in_time), &begin(cells.len())) {
                Err(_) if is_over(monitor) => Ok(cells),
                done => done,
            }
        })?;
        options.refuse_large_matrices(elements.len())?;
        let Optics { area, reflectance, sheets, exitance } = Optics::new(tracer, &elements);
        let begin = begin(elements.len());
        let exposure = stages.time(monitor, "exposure", || {
            match Exposure::with_care(options.care(), tracer, (mesh, &elements), &begin) {
                // Buried places are rejected one by one then.
                Err(_) if is_over(monitor) => Ok(Exposure::default()),
                done => done,
            }
        })?;
        let sheets = sheets.exposed(&exposure);
        let luminaires = Luminaires::new(tracer, &elements, &area, &exitance).with_beams(tracer, &elements);
        let needed = needed(elements.len(), elements.cells());
        if needed > options.memory {
            return Err(memory_error(tracer, elements.len(), needed, options));
        }
        let sky = SkyPatches::new(&scene.sky, scene.up.direction());

        let receivers = ElementReceivers { mesh, elements: &elements, exposure: &exposure };
        let columns = stages.time(monitor, "direct light", || {
            if monitor.deadline().is_some() {
                return Ok(luminaires.columns_in_time(tracer, &receivers, &options.shadowing, &area, &begin));
            }
            luminaires.columns(tracer, &receivers, &options.shadowing, &begin)
        })?;

        let id_space = IdSpace { elements: &elements, sky };
        let room = options.memory - needed;
        let table = HitTable::new(area.clone(), &id_space).within(room, std::env::temp_dir());
        let table = if options.looked_up { table.from_afar() } else { table };
        let mut values = vec![[0f32; 4]; id_space.len()];
        for (value, l) in values[elements.len()..].iter_mut().zip(sky.radiosity(&scene.sky)) {
            value[..3].copy_from_slice(&l);
        }
        let n = elements.len();
        let mut solution = Solution {
            tracer,
            elements,
            exposure,
            luminaires,
            columns,
            area,
            reflectance,
            sheets,
            exitance,
            info: Info::default(),
            stages,
            element_size: width.size,
            scales,
            sky,
            table,
            is_cut: false,
            matrix: None,
            options: *options,
            values,
            irradiance: vec![[0.0; 3]; n],
            indirect: vec![[0.0; 3]; n],
        };
        solution.spread_ambient();
        monitor.solved(&solution);
        Ok(solution)
    }

    /// H = Σ A B₀/Σ A (1 − ρ) on all elements, B₀ being what they give off without indirect light.
    fn spread_ambient(&mut self) {
        let (weight, direct) = (self.exposed_area(), self.direct());
        let own = |i: usize, band: usize| {
            let seen = f64::from(self.columns.seen(i)[band]);
            let own = f64::from(self.exitance[i][band] - self.luminaires.promoted[i][band])
                + f64::from(self.reflectance[i][band]) * seen;
            // What a sheet receives is spread over all that it gives; openness to one side says nothing of the other.
            match self.sheets.passed(i) {
                Some((other, tau)) => own + f64::from(tau[band]) * f64::from(direct[other][band]),
                None => own,
            }
        };
        let ambient: Bands = std::array::from_fn(|band| {
            let (mut given, mut kept) = (0.0, 0.0);
            for (i, w) in weight.iter().enumerate() {
                given += w * own(i, band);
                kept += w * (1.0 - f64::from(self.reflectance[i][band]));
                if let Some((_, tau)) = self.sheets.passed(i) {
                    kept -= w * f64::from(tau[band]);
                }
            }
            if kept > 0.0 { (given / kept) as f32 } else { 0.0 }
        });
        let own: Vec<[f64; 3]> = (0..weight.len()).map(|i| std::array::from_fn(|band| own(i, band))).collect();
        for i in 0..weight.len() {
            for band in 0..3 {
                self.values[i][band] = own[i][band] as f32 + self.reflectance[i][band] * ambient[band];
                if let Some((_, tau)) = self.sheets.passed(i) {
                    self.values[i][band] += tau[band] * ambient[band];
                }
                self.indirect[i][band] = ambient[band];
                self.irradiance[i][band] = direct[i][band] + ambient[band];
            }
        }
    }

    /// Bytes that may be taken beside the solution and what it is made of.
    pub fn memory_allowed(&self) -> usize {
        self.options.memory.saturating_sub(self.needed(self.rays())).saturating_sub(self.table.bytes_in_memory())
    }

    /// Bytes of the solution with so many rays, and of what it is made of, as far as they cannot lie in a file.
    fn needed(&self, rays: usize) -> usize {
        let solution = footprint::solution(self.tracer, self.elements.len(), Luminaires::most(self.tracer.scene));
        solution
            .saturating_add(SolveOptions { rays, ..self.options }.stored(self.elements.cells(), self.elements.len()))
    }

    /// Bytes that the scene, its mesh and tree and a solution with these options take, as far as that is known before the
    /// elements are made: none of them divided. Rays may lie in a file and do not count.
    pub fn memory(tracer: &Tracer, options: &SolveOptions) -> usize {
        Solution::memory_scaled(tracer, tracer.scales(), options)
    }

    fn memory_scaled(tracer: &Tracer, scales: &[f32], options: &SolveOptions) -> usize {
        let cells = Elements::count(tracer.scene, tracer.mesh, cell_width(tracer.mesh, scales, options));
        let solution = footprint::solution(tracer, cells, Luminaires::most(tracer.scene));
        solution.saturating_add(options.stored(cells, cells))
    }

    /// Whether the memory holds what these options ask for with cells of such widths as these, as far as that is known before the elements are made.
    pub(crate) fn has_room_for(&self, options: &SolveOptions) -> bool {
        let (tracer, scales) = (self.tracer, &self.scales);
        let elements = Elements::count(tracer.scene, tracer.mesh, cell_width(tracer.mesh, scales, options));
        Solution::memory_scaled(tracer, scales, options) <= options.memory
            && options.solver.matrix_bytes(elements) <= options.memory
    }

    /// Width of the narrowest cells, metres.
    pub fn narrowest(&self) -> f64 {
        let scales = if self.options.element_size.is_some() { &[][..] } else { &self.scales };
        self.element_size * f64::from(scales.iter().copied().fold(1.0, f32::min))
    }

    /// The tracer that the solution was made with.
    pub fn tracer(&self) -> &'a Tracer<'a> {
        self.tracer
    }

    /// M: rays per cell; the elements of a divided cell share them.
    pub fn rays(&self) -> usize {
        self.table.columns()
    }

    /// Rays of all elements together.
    pub(crate) fn rays_in_all(&self) -> f64 {
        let share = |element| self.elements.share(self.tracer.mesh, element);
        self.rays() as f64 * (0..self.elements.len() as u32).map(share).sum::<f64>()
    }

    /// Appends rays up to `rays` per cell and solves again from the solution so far. Of a monitor's time a fifth is kept for solving; when
    /// it is over, it ends with what it has: fewer rays, perhaps ([`Solution::rays`]), and the iterate by then ([`Solution::info`]).
    ///
    /// # Errors
    /// As [`Solution::new`]; [`Error::Displayed`], [`Error::Tolerance`], [`Error::Time`], [`Error::File`].
    pub fn refine(&mut self, rays: usize, monitor: &dyn Monitor) -> Result<(), Error> {
        let needed = self.needed(rays);
        if needed > self.options.memory {
            let options = SolveOptions { rays, ..self.options };
            return Err(memory_error(self.tracer, self.elements.len(), needed, &options));
        }
        self.trace(rays, monitor)?;
        if let (Some(method), None) = (self.options.form_factors, &self.matrix) {
            let (mesh, memory) = (self.tracer.mesh, self.options.memory);
            let found = self
                .stages
                .time(monitor, "form factors", || Matrix::new(method, mesh, &self.elements, memory, &Hurry(monitor)));
            self.matrix = Some(found.map_err(|error| match error {
                Error::Stopped if is_over(monitor) => Error::Time("the form factors"),
                other => other,
            })?);
        }
        if self.is_ambient() {
            return Ok(());
        }
        let started = std::time::Instant::now();
        monitor.stage("solve");
        self.solve(monitor)?;
        self.stages.add("solve", started.elapsed().as_secs_f64());
        monitor.solved(self);
        Ok(())
    }

    /// Whether indirect light is the ambient term still.
    fn is_ambient(&self) -> bool {
        self.table.columns() == 0 && self.matrix.is_none()
    }

    /// Appends rays up to `rays` per cell. Where there is a time limit they come in portions, each as many as there are, and
    /// those that it does not leave time for, nor for solving with them, are not there; where elements are few, sixteen always are.
    fn trace(&mut self, rays: usize, monitor: &dyn Monitor) -> Result<(), Error> {
        let ids = IdSpace { elements: &self.elements, sky: self.sky };
        let mesh = self.tracer.mesh;
        let receivers = ElementReceivers { mesh, elements: &self.elements, exposure: &self.exposure };
        let scene_sky = &self.tracer.scene.sky;
        let sky = if scene_sky.is_black() { Vec::new() } else { self.sky.radiosity(scene_sky) };
        let (tracer, table) = (self.tracer, &mut self.table);
        let in_files = table.bytes_in_files();
        self.stages.time(monitor, "rays", || -> Result<(), Error> {
            if monitor.deadline().is_none() {
                return Ok(table.extend(tracer, (&ids, &sky), &receivers, rays, &Watch(monitor))?);
            }
            if table.columns() == 0 {
                let begin = Begin { monitor, is_soon: receivers.elements.len() <= FEW };
                match table.extend(tracer, (&ids, &sky), &receivers, FIRST_RAYS.min(rays), &begin) {
                    Err(ExtendError::Stopped(_)) if is_over(monitor) => return Ok(()),
                    done => done?,
                }
            }
            let left = pace::left(monitor).unwrap_or(0.0);
            let monitor = &Timed::new(monitor, Duration::from_secs_f64((1.0 - SOLVED) * left));
            while table.columns() < rays && !is_over(monitor) {
                let next = (2 * table.columns()).min(rays);
                match table.extend(tracer, (&ids, &sky), &receivers, next, &Hurry(monitor)) {
                    Err(ExtendError::Stopped(_)) if is_over(monitor) => break,
                    done => done?,
                }
            }
            Ok(())
        })?;
        self.is_cut = self.table.columns() < rays;
        if self.table.bytes_in_files() > in_files {
            let (bytes, folder) = (size(self.table.bytes_in_files()), std::env::temp_dir());
            monitor.note(&format!(
                "{bytes} of rays, which memory does not hold, lie in a temporary file in {}",
                folder.display()
            ));
        }
        Ok(())
    }

    /// How far what is displayed may be from what the solution of the same rows would be displayed as (catalogue 42); at the
    /// exposure given, or that of a picture that shows all surfaces alike. Infinite before the first solve.
    pub fn displayed(&self, exposure: Option<f64>) -> Shown {
        let x: Vec<Bands> = self.values[..self.elements.len()].iter().map(|v| [v[0], v[1], v[2]]).collect();
        let bound = if self.info.bound.is_empty() { &[f64::INFINITY; 3] } else { self.info.bound.as_slice() };
        self.screen().shown(&x, bound, exposure)
    }

    /// B − X: what luminaires carry, E's part and ρ times what is read of their light beyond what the equation has.
    fn screen(&self) -> Screen {
        let apart = |i: usize| -> Bands {
            let (seen, read) = (self.columns.seen(i), self.columns.mean(i));
            std::array::from_fn(|k| self.luminaires.promoted[i][k] + self.reflectance[i][k] * (read[k] - seen[k]))
        };
        Screen { apart: (0..self.elements.len()).map(apart).collect(), weight: self.exposed_area() }
    }

    fn solve(&mut self, monitor: &dyn Monitor) -> Result<(), Error> {
        let n = self.elements.len();
        // The known part: direct light and what the sky gives.
        let daylight = self.daylight();
        let direct = self.direct();
        let mut e = vec![0.0; 3 * n];
        for i in 0..n {
            let seen = self.columns.seen(i);
            for band in 0..3 {
                let own = f64::from(self.exitance[i][band] - self.luminaires.promoted[i][band]);
                let arriving = f64::from(seen[band]) + f64::from(daylight[i][band]);
                e[3 * i + band] = own + f64::from(self.reflectance[i][band]) * arriving;
                if let Some((other, tau)) = self.sheets.passed(i) {
                    let behind = f64::from(direct[other][band]) + f64::from(daylight[other][band]);
                    e[3 * i + band] += f64::from(tau[band]) * behind;
                }
            }
        }
        let reflectance = self.reflectance.iter().flatten().map(|r| f64::from(*r)).collect();
        let reciprocal = self.matrix.as_ref().is_some_and(|matrix| matrix.is_reciprocal);
        let response = self.sheets.response(DiffuseResponse {
            reflectance,
            bands: 3,
            reciprocal_area: reciprocal.then(|| self.area.clone()),
        });
        // Where time may end the solver at once, the ambient term is a better start than none.
        let mut x: Vec<f64> = if self.info.steps > 0 || monitor.deadline().is_some() {
            self.values[..n].iter().flat_map(|v| v[..3].iter().map(|v| f64::from(*v))).collect()
        } else {
            e.clone()
        };
        let screen = self.options.displayed.map(|asked| (self.screen(), asked));
        let task = Task {
            solver: self.options.solver,
            params: &self.options.params,
            displayed: screen.as_ref().map(|(screen, asked)| (screen, *asked)),
        };
        let operator = (&self.table, self.matrix.as_ref());
        self.info = equation::solve(operator, &response, (&e, &mut x), &task, monitor)?;

        for (value, [r, g, b]) in self.values.iter_mut().zip(single(&x)) {
            *value = [r, g, b, 0.0];
        }
        let gathered = self.gathered_halves()?;
        let mean = |[a, b]: [[f32; 4]; 2], band: usize| 0.5 * (a[band] + b[band]);
        for i in 0..n {
            for band in 0..3 {
                // Within its tolerance the solver may end a little below nothing.
                self.indirect[i][band] = (daylight[i][band] + mean(gathered[i], band)).max(0.0);
                self.irradiance[i][band] = direct[i][band] + self.indirect[i][band];
            }
        }
        Ok(())
    }

    /// F X among the elements, as two halves whose difference tells the noise of rays; a matrix has none.
    fn gathered_halves(&self) -> Result<Vec<[[f32; 4]; 2]>, Error> {
        let values = self.of_elements();
        match &self.matrix {
            None => Ok(self.table.halves(&values)?),
            Some(matrix) => Ok(matrix.gather(&values[..self.elements.len()])?.into_iter().map(|h| [h, h]).collect()),
        }
    }

    /// X by id, the sky's set to nothing.
    fn of_elements(&self) -> Vec<[f32; 4]> {
        let mut values = self.values.clone();
        values[self.elements.len()..].fill([0.0; 4]);
        values
    }

    /// Irradiance of each element by the sky, unreflected.
    fn daylight(&self) -> Vec<Bands> {
        let mean = |[a, b]: &[Bands; 2]| std::array::from_fn(|band| 0.5 * (a[band] + b[band]));
        self.table.daylight().iter().map(mean).collect()
    }

    /// Direct irradiance of all lights together, by element.
    pub fn direct(&self) -> Vec<Bands> {
        (0..self.elements.len()).map(|i| self.columns.mean(i)).collect()
    }

    /// Irradiance of each element, lux per band.
    pub fn irradiance(&self) -> &[Bands] {
        &self.irradiance
    }

    /// The part of the irradiance that came through the rows: reflected light, sky, large faint emitters.
    pub fn indirect(&self) -> &[Bands] {
        &self.indirect
    }

    /// The same as the two halves of its rays tell it.
    pub(crate) fn indirect_halves(&self) -> Result<Vec<[Bands; 2]>, Error> {
        if self.is_ambient() {
            return Ok(self.indirect.iter().map(|h| [*h; 2]).collect());
        }
        let both = |(daylight, of_elements): (&[Bands; 2], [[f32; 4]; 2])| {
            std::array::from_fn(|k| std::array::from_fn(|band| (daylight[k][band] + of_elements[k][band]).max(0.0)))
        };
        Ok(self.table.daylight().iter().zip(self.gathered_halves()?).map(both).collect())
    }

    /// Transmittance of each element, nothing where no light passes: of what arrives on its other side, the share that
    /// leaves it.
    pub fn transmittance(&self, element: usize) -> Bands {
        self.sheets.passed(element).map_or([0.0; 3], |(_, tau)| tau)
    }

    /// Radiosity B = E + ρ H of each element, lm/m² per band, and + τ H of its other side on sheets.
    pub fn radiosity(&self) -> Vec<Bands> {
        (0..self.elements.len())
            .map(|i| {
                let passed = self.sheets.passed(i);
                std::array::from_fn(|band| {
                    let own = self.exitance[i][band] + self.reflectance[i][band] * self.irradiance[i][band];
                    passed.map_or(own, |(other, tau)| own + tau[band] * self.irradiance[other][band])
                })
            })
            .collect()
    }

    /// The solution as a final gather reads it.
    pub fn gather(&self) -> Gather<'_> {
        Gather {
            tracer: self.tracer,
            ids: IdSpace { elements: &self.elements, sky: self.sky },
            values: &self.values,
            luminaires: &self.luminaires,
            columns: &self.columns,
            area: &self.area,
        }
    }

    /// Exposed area of each element, m²; zero where it is buried.
    pub fn exposed_area(&self) -> Vec<f64> {
        self.area.iter().enumerate().map(|(e, area)| area * self.exposure.share(e as u32)).collect()
    }

    /// The same as it counts.
    pub(crate) fn counted_area(&self) -> Vec<f64> {
        let mut area = self.exposed_area();
        area.iter_mut().enumerate().for_each(|(e, area)| *area *= self.counts(self.elements.place(e as u32).0));
        area
    }

    /// How many times its area a triangle counts: places of a smaller scale as if they were as wide as the rest. A flat on a wide site is
    /// a thousandth of its area, and what matters to who is in it.
    pub(crate) fn counts(&self, triangle: usize) -> f64 {
        self.tracer.scale(triangle).powi(-2)
    }

    /// Raw closure: the largest difference of a row of F from the sum one, over all ids, as the table answers it; with a
    /// matrix, of its rows from what the table says that elements take up.
    ///
    /// # Errors
    /// [`Error::File`].
    pub fn raw_closure(&self) -> Result<f64, Error> {
        if let Some(matrix) = &self.matrix {
            let mut of_elements = vec![[1f32; 4]; self.values.len()];
            of_elements[self.elements.len()..].fill([0.0; 4]);
            let (found, seen) =
                (matrix.gather(&of_elements[..self.elements.len()])?, self.table.rows_mean(&of_elements)?);
            return Ok(found.iter().zip(&seen).fold(0f64, |worst, (a, b)| worst.max(f64::from((a[0] - b[0]).abs()))));
        }
        let ones = vec![[1f32; 4]; self.values.len()];
        let sums = self.table.rows_mean(&ones)?;
        Ok(sums.iter().fold(0f64, |worst, sum| worst.max((f64::from(sum[0]) - 1.0).abs())))
    }
}

/// What an answer would need that the options do not allow.
fn memory_error(tracer: &Tracer, elements: usize, needed: usize, options: &SolveOptions) -> Error {
    let least = least_memory(tracer.scene);
    let rays = (options.stored(elements, elements) > 0).then_some(options.rays);
    Error::Memory { elements, rays, needed, allowed: options.memory, least }
}
