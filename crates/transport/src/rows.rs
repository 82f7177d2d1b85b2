//! The table of hit ids: F as it was found by rays.
//!
//! Receiver i sends M cosine-distributed rays (Malley 1988) from stratified points on itself; entry (i, m) is the id of
//! what ray m met: an element, a sky patch, or nothing. Each entry weighs 1/M, so a row sums to exactly one and energy
//! cannot appear. The rays of a row are the two halves of one scrambled sequence. Half their difference is the standard
//! error of the row, live and for any right-hand side, and on the safe side: 1.15 to 1.4 times the true one in the
//! Cornell box, as the halves complement each other (independent ones would leave 15 % more noise). Doubling M appends
//! columns to the table; nothing is traced twice. The elements of a divided cell share its M rays: a receiver sees many
//! of them and averages their noise out.
//! It fails, like all sampling, on small bright sources; those go through [`crate::Luminaires`].
//!
//! What memory does not hold of the table lies in files ([`HitTable::within`]). Rows are summed from either in the same order, so
//! that the numbers are the same to the bit.

use crate::block::{Block, Buffer, FileError, Lent, portion};
use crate::pilot::Pilot;
use crate::{Progress, Receivers, Stopped};
use caster::Caster;
use glam::DVec3;
use radiosity_scene::{Bands, Elements, SkyPatches, luminance};
use radiosity_solve::{AreaSpace, SolveError, SparseTransport, Transport};
use radiosity_trace::{Found, Openings, Tracer};
use rayon::prelude::*;
use smallvec::SmallVec;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

mod caster;

/// The one space of ids: surface elements, then sky patches, then nothing.
#[derive(Clone, Copy, Debug)]
pub struct IdSpace<'a> {
    /// The surface elements.
    pub elements: &'a Elements,
    /// The sky patches.
    pub sky: SkyPatches,
}

impl IdSpace<'_> {
    /// Number of ids.
    pub fn len(&self) -> usize {
        self.elements.len() + self.sky.len() + 1
    }

    /// Never: there is always "nothing".
    pub fn is_empty(&self) -> bool {
        false
    }

    /// The id of nothing: the back of a one-sided surface.
    pub fn nothing(&self) -> u32 {
        (self.len() - 1) as u32
    }

    /// The id of what a ray found.
    #[inline]
    pub fn id(&self, found: Found, direction: DVec3) -> u32 {
        match found {
            Found::Surface { triangle, uv: [u, v], side, .. } => {
                self.elements.at(triangle, u, v, side).unwrap_or(self.nothing())
            }
            Found::Back => self.nothing(),
            Found::Escaped => (self.elements.len() + self.sky.at(direction)) as u32,
        }
    }
}

/// Why a table has no more columns.
#[derive(Debug, thiserror::Error)]
pub enum ExtendError {
    /// [`Progress`] said so.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// They fit into no memory, and could not be kept in a file.
    #[error(transparent)]
    File(#[from] FileError),
}

/// Rays of a row where a whole cell gets `columns`: an element gets its share, and at least one ray in each half.
fn width(columns: usize, share: f64) -> usize {
    2 * (((columns / 2) as f64 * share).ceil() as usize).max(1)
}

/// The table of hit ids of all elements.
#[derive(Clone, Debug)]
pub struct HitTable {
    space: AreaSpace,
    blocks: Vec<Block>,
    columns: usize,
    all_ids: usize,
    /// Rays of each element so far.
    traced: Vec<u32>,
    /// Mean radiosity of the sky over each element's hemisphere, as two halves: what it gives unreflected, lux per band.
    daylight: Vec<[Bands; 2]>,
    /// Rays of each element that told it.
    looked: Vec<u32>,
    /// Label of each element: elements that see each other, directly or through others, share one.
    parts: Vec<u32>,
    from_afar: bool,
    /// Bytes of ids that are kept in memory at most, and where the others are.
    room: usize,
    folder: PathBuf,
}

/// Rays to the sky over all elements where rows have fewer and it is not seen from everywhere, and the most of each, as many as the longest rows have: a narrow window
/// lights all of a room. Light on a table behind one a hand wide has a standard deviation of a tenth between solutions of rows of eight rays with half as many, of a
/// twentieth with twice as many.
const LOOKS_IN_ALL: usize = 800_000;
const MOST_LOOKS: usize = 1024;

/// Rows that are traced, and summed, by one thread at a time.
const CHUNK: usize = 256;

impl HitTable {
    /// An empty table for elements of the given areas (m²).
    pub fn new(area: Vec<f64>, ids: &IdSpace) -> HitTable {
        let n = area.len();
        let parts = (0..n as u32).collect();
        let traced = vec![0; n];
        HitTable {
            space: AreaSpace { area },
            blocks: Vec::new(),
            columns: 0,
            all_ids: ids.len(),
            traced,
            daylight: vec![Default::default(); n],
            looked: vec![0; n],
            parts,
            from_afar: false,
            room: usize::MAX,
            folder: PathBuf::new(),
        }
    }

    /// The same that keeps no more than `room` bytes of ids in memory, and others in temporary files without a name, in `folder`.
    pub fn within(self, room: usize, folder: PathBuf) -> HitTable {
        HitTable { room, folder, ..self }
    }

    /// The same whose rows are what elements receive where they are seen from afar: places count by the share of their hemisphere
    /// in which nothing is near, as they do for [`Columns`](crate::Columns). Who only looks elements up needs these: by the mean over
    /// their areas desks beneath things and shelves behind books are 5 to 20 % too dark.
    pub fn from_afar(self) -> HitTable {
        HitTable { from_afar: true, ..self }
    }

    /// M: rays per cell so far.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Irradiance of each element by the sky, unreflected, as two halves: lux per band.
    pub fn daylight(&self) -> &[[Bands; 2]] {
        &self.daylight
    }

    /// Bytes of ids that are in memory.
    pub fn bytes_in_memory(&self) -> usize {
        self.blocks.iter().filter(|block| !block.is_in_file()).map(Block::bytes).sum()
    }

    /// Bytes of ids that are in files.
    pub fn bytes_in_files(&self) -> usize {
        self.blocks.iter().filter(|block| block.is_in_file()).map(Block::bytes).sum()
    }

    /// Bytes of the table with `columns` rays for each of `cells`.
    pub fn bytes(cells: usize, columns: usize) -> usize {
        cells * columns * size_of::<u32>()
    }

    /// Appends columns up to `columns` rays per cell (an even number). `sky` has the radiosity π L of the sky patches;
    /// nothing where the sky is black.
    ///
    /// # Errors
    /// [`ExtendError::Stopped`] if `progress` says so, [`ExtendError::File`] if the file of rows that memory does not hold fails; the
    /// table is then as it was.
    pub fn extend(
        &mut self,
        tracer: &Tracer,
        (ids, sky): (&IdSpace, &[Bands]),
        receivers: &impl Receivers,
        columns: usize,
        progress: &dyn Progress,
    ) -> Result<(), ExtendError> {
        let n = receivers.len();
        assert_eq!(n, self.space.area.len());
        let columns = columns.next_multiple_of(2);
        let Some(more) = columns.checked_sub(self.columns).filter(|more| *more > 0) else { return Ok(()) };
        let mut starts = Vec::with_capacity(n + 1);
        let mut end = 0;
        for i in 0..n {
            starts.push(end);
            end += width(more, ids.elements.share(tracer.mesh, i as u32));
        }
        starts.push(end);
        let room = self.room.saturating_sub(self.bytes_in_memory());
        let mut block = Block::new(starts, room, &self.folder)?;
        let done = AtomicUsize::new(0);
        let (mut daylight, mut looked) = (vec![[[0f32; 3]; 2]; n], vec![0; n]);
        let brightest = sky.iter().map(|l| luminance(*l)).fold(0.0, f32::max).into();
        let none = Openings::default();
        let openings = if sky.is_empty() { &none } else { tracer.openings() };
        let caster = Caster { tracer, ids, sky, openings, receivers, from_afar: self.from_afar };
        let looks = (LOOKS_IN_ALL / n.max(1)).min(MOST_LOOKS).next_multiple_of(2) as u32;
        let chunks =
            block.writers(CHUNK).into_par_iter().zip(daylight.par_chunks_mut(CHUNK)).zip(looked.par_chunks_mut(CHUNK));
        chunks.try_for_each(|((mut writer, daylight), looked)| -> Result<(), ExtendError> {
            let rows = writer.rows.clone();
            let mut pilot = Pilot::default();
            pilot.begin(rows.len(), if sky.is_empty() { 0 } else { more as u32 }, brightest);
            for (k, i) in rows.clone().enumerate() {
                writer.write(i, |row| {
                    caster.trace((i, self.traced[i] / 2), row, k, &mut pilot);
                    // Neighbouring ids lie in the same cache lines when the row is read back in order.
                    let half = row.len() / 2;
                    row[..half].sort_unstable();
                    row[half..].sort_unstable();
                })?;
            }
            writer.flush()?;
            if !sky.is_empty() {
                let had = rows.clone().map(|i| self.looked[i]).min().unwrap_or(0);
                let lacks = looks.saturating_sub(had);
                if (more as u32) < lacks && !pilot.is_clear() {
                    pilot.begin(rows.len(), lacks, brightest);
                    for (k, i) in rows.clone().enumerate() {
                        caster.look((i, self.traced[i] / 2), lacks, k, &mut pilot);
                    }
                }
                for (k, looked) in looked.iter_mut().enumerate() {
                    *looked = pilot.rays(k);
                }
                for (k, (i, daylight)) in rows.clone().zip(daylight).enumerate() {
                    *daylight = caster.daylight((i, self.traced[i] / 2), k, &mut pilot);
                }
            }
            let done = done.fetch_add(rows.len(), Ordering::Relaxed) + rows.len();
            if progress.step(done, n) { Ok(()) } else { Err(Stopped.into()) }
        })?;
        self.join_parts(&block)?;
        for (i, found) in daylight.iter().enumerate() {
            let more = block.width(i) as u32;
            self.traced[i] += more;
            self.looked[i] += looked[i];
            let share = looked[i] as f32 / self.looked[i].max(1) as f32;
            for (mean, new) in self.daylight[i].iter_mut().flatten().zip(found.as_flattened()) {
                *mean += share * (new - *mean);
            }
        }
        self.blocks.push(block);
        self.columns = columns;
        Ok(())
    }

    /// Joins the labels of elements that rows connect, and numbers them anew from 0.
    fn join_parts(&mut self, block: &Block) -> Result<(), FileError> {
        let n = self.parts.len();
        // Labels as a forest: each points to an element of its set with a number no larger than its own.
        let mut first = vec![u32::MAX; n];
        let mut parent: Vec<u32> = (0..n as u32).collect();
        for (i, label) in self.parts.iter().enumerate() {
            let first = &mut first[*label as usize];
            *first = (*first).min(i as u32);
            parent[i] = *first;
        }
        fn root(parent: &mut [u32], mut i: u32) -> u32 {
            while parent[i as usize] != i {
                parent[i as usize] = parent[parent[i as usize] as usize];
                i = parent[i as usize];
            }
            i
        }
        let (mut buffer, mut rest) = (Buffer::default(), 0..n);
        while !rest.is_empty() {
            let rows = portion(std::slice::from_ref(block), &rest);
            let lent = block.lend(&rows, &mut buffer)?;
            for i in rows.clone() {
                let mut own = root(&mut parent, i as u32);
                for &id in lent.row(i).iter().filter(|id| (**id as usize) < n) {
                    let other = root(&mut parent, id);
                    let (low, high) = (own.min(other), own.max(other));
                    parent[high as usize] = low;
                    own = low;
                }
            }
            rest.start = rows.end;
        }
        let mut next = 0;
        let mut number = vec![u32::MAX; n];
        for i in 0..n {
            let root = root(&mut parent, i as u32) as usize;
            if number[root] == u32::MAX {
                number[root] = next;
                next += 1;
            }
            self.parts[i] = number[root];
        }
        Ok(())
    }

    /// Fills `out`, `width` numbers a row, by what `fill` makes of the ids of each row.
    fn each_row<T: Send>(
        &self,
        out: &mut [T],
        width: usize,
        fill: impl Fn(RowIds, &mut [T]) + Sync,
    ) -> Result<(), FileError> {
        let chunks = out.par_chunks_mut(CHUNK * width).enumerate();
        chunks.try_for_each_init(Vec::new, |buffers: &mut Vec<Buffer>, (chunk, mut out)| {
            buffers.resize_with(self.blocks.len(), Buffer::default);
            let first = chunk * CHUNK;
            let mut rest = first..first + out.len() / width;
            while !rest.is_empty() {
                let rows = portion(&self.blocks, &rest);
                let lent = self.blocks.iter().zip(&mut *buffers).map(|(block, buffer)| block.lend(&rows, buffer));
                let lent = lent.collect::<Result<SmallVec<[Lent; 8]>, FileError>>()?;
                for i in rows.clone() {
                    let own;
                    (own, out) = out.split_at_mut(width);
                    fill(RowIds { i, lent: &lent }, own);
                }
                rest.start = rows.end;
            }
            Ok(())
        })
    }

    /// What `of` makes of each row.
    ///
    /// # Errors
    /// [`FileError`] where rows are in a file that cannot be read.
    pub fn map_rows<T: Clone + Default + Send>(&self, of: impl Fn(RowIds) -> T + Sync) -> Result<Vec<T>, FileError> {
        let mut all = vec![T::default(); self.space.area.len()];
        self.each_row(&mut all, 1, |row, own| own[0] = of(row))?;
        Ok(all)
    }

    /// Mean of `values` (by id) over each row: h_i = (1/M_i) Σ_m values[id(i, m)].
    ///
    /// # Errors
    /// As [`HitTable::map_rows`].
    pub fn rows_mean(&self, values: &[[f32; 4]]) -> Result<Vec<[f32; 4]>, FileError> {
        let halves = self.halves(values)?;
        Ok(halves.into_iter().map(|[a, b]| std::array::from_fn(|k| 0.5 * (a[k] + b[k]))).collect())
    }

    /// The same for the two halves of each row.
    ///
    /// # Errors
    /// As [`HitTable::map_rows`].
    pub fn halves(&self, values: &[[f32; 4]]) -> Result<Vec<[[f32; 4]; 2]>, FileError> {
        assert_eq!(values.len(), self.all_ids);
        self.map_rows(|row| {
            let share = 2.0 / self.traced[row.i].max(1) as f32;
            row.sums(values).map(|sum| sum.map(|x| x * share))
        })
    }

    /// F b among the elements for up to W bands from `first` on; returns how many.
    fn sweep<const W: usize>(&self, b: &[f64], h: &mut [f64], bands: usize, first: usize) -> Result<usize, FileError> {
        let n = self.space.area.len();
        let count = (bands - first).min(W);
        let mut values = vec![[0f32; W]; self.all_ids];
        values.par_iter_mut().zip(b.par_chunks_exact(bands)).with_min_len(4096).for_each(|(value, b)| {
            for (value, b) in value.iter_mut().zip(&b[first..first + count]) {
                *value = *b as f32;
            }
        });
        self.each_row(&mut h[..n * bands], bands, |row, h| {
            let share = 1.0 / f64::from(self.traced[row.i].max(1));
            let [a, c] = row.sums(&values);
            for (k, h) in h[first..first + count].iter_mut().enumerate() {
                *h = (f64::from(a[k]) + f64::from(c[k])) * share;
            }
        })?;
        Ok(count)
    }

    /// The rows among elements as a stored matrix, for solvers that need more than to apply it.
    ///
    /// # Errors
    /// [`SolveError::Transport`] as [`HitTable::map_rows`]; another [`SolveError`] if an area is no finite number.
    pub fn matrix(&self) -> Result<SparseTransport<f64>, SolveError> {
        let n = self.space.area.len();
        let rows = self.map_rows(|row| {
            let mut ids: Vec<u32> = row.ids().filter(|id| (*id as usize) < n).collect();
            ids.sort_unstable();
            let share = 1.0 / f64::from(self.traced[row.i].max(1));
            let entries = ids.chunk_by(|a, b| a == b).map(|same| (same[0], share * same.len() as f64));
            entries.collect::<Vec<_>>()
        });
        let rows = rows.map_err(|error| SolveError::Transport(error.into()))?;
        let mut starts = vec![0];
        let (mut columns, mut values) = (Vec::new(), Vec::new());
        for row in rows {
            for (column, value) in row {
                columns.push(column);
                values.push(value);
            }
            starts.push(columns.len());
        }
        SparseTransport::new(self.space.area.clone(), starts, columns, values)
    }
}

/// The ids of a row of the table, all of the same weight.
#[derive(Clone, Copy)]
pub struct RowIds<'a> {
    i: usize,
    lent: &'a [Lent<'a>],
}

impl<'a> RowIds<'a> {
    /// The number of the row.
    pub fn row(&self) -> usize {
        self.i
    }

    /// The ids.
    pub fn ids(&self) -> impl Iterator<Item = u32> + use<'a> {
        self.blocks().flatten().copied()
    }

    /// Up to so many of them from all over the row, as halves of it are sorted.
    pub fn some(&self, most: usize) -> impl Iterator<Item = u32> + use<'a> {
        let all = self.blocks().map(<[u32]>::len).sum::<usize>();
        let step = all.div_ceil(most).max(1);
        self.ids().skip(step / 2).step_by(step)
    }

    /// The same block by block.
    #[inline]
    fn blocks(&self) -> impl Iterator<Item = &'a [u32]> + use<'a> {
        let RowIds { i, lent } = *self;
        lent.iter().map(move |lent| lent.row(i))
    }

    /// Sums of `values` over the two halves.
    #[inline]
    fn sums<const W: usize>(&self, values: &[[f32; W]]) -> [[f32; W]; 2] {
        let mut sums = [[0f32; W]; 2];
        let add = |sum: &mut [f32; W], id: u32| {
            for (sum, value) in sum.iter_mut().zip(&values[id as usize]) {
                *sum += value;
            }
        };
        for row in self.blocks() {
            let (first, second) = row.split_at(row.len() / 2);
            let [a, c] = &mut sums;
            if W <= 16 {
                // Both halves in turn, so that neither addition waits for the one before.
                for (&id, &other) in first.iter().zip(second) {
                    add(a, id);
                    add(c, other);
                }
            } else {
                // There are registers for one half.
                first.iter().for_each(|&id| add(a, id));
                second.iter().for_each(|&id| add(c, id));
            }
        }
        sums
    }
}

impl Transport for HitTable {
    type Space = AreaSpace;

    fn space(&self) -> &AreaSpace {
        &self.space
    }

    fn parts(&self) -> Option<&[u32]> {
        Some(&self.parts)
    }

    /// F b among the elements; sky and nothing give zero here. An entry of the table is read once for up to 32 bands: many right-hand
    /// sides at once, such as columns of lights, are bands of one field.
    fn apply(&self, b: &[f64], h: &mut [f64], bands: usize) -> Result<(), SolveError> {
        let mut first = 0;
        while first < bands {
            let swept = match bands - first {
                ..=4 => self.sweep::<4>(b, h, bands, first),
                5..=8 => self.sweep::<8>(b, h, bands, first),
                9..=16 => self.sweep::<16>(b, h, bands, first),
                _ => self.sweep::<32>(b, h, bands, first),
            };
            first += swept.map_err(|error| SolveError::Transport(error.into()))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ElementReceivers, Exposure};
    use radiosity_scene::{AlphaMode, Material, Mesh, Scene, Sky};

    /// Hands out the tracer and the elements of a floor, half of it 1 cm beneath a board, under an even sky.
    fn on_a_floor<T>(size: f64, of: impl FnOnce(&Tracer, &IdSpace, &ElementReceivers, &[f64]) -> T) -> T {
        let mut scene = Scene { sky: Sky::Uniform([1.0; 3]), ..Scene::default() };
        scene.materials = vec![Material::default(), Material { double_sided: true, ..Material::default() }];
        let quad = |low: DVec3, x: f64| [low, low + DVec3::X * x, low + DVec3::new(x, 1.0, 0.0), low + DVec3::Y];
        scene.add_quad("floor", 0, quad(DVec3::ZERO, 1.0));
        scene.add_quad("board", 1, quad(DVec3::new(-1.0, 0.0, 0.01), 1.5));
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let elements = Elements::new(&scene, &mesh, size);
        let sky = SkyPatches::new(&scene.sky, scene.up.direction());
        let ids = IdSpace { elements: &elements, sky };
        let exposure = Exposure::default();
        let receivers = ElementReceivers { mesh: &mesh, elements: &elements, exposure: &exposure };
        let area: Vec<f64> = (0..elements.len() as u32).map(|e| elements.area(&mesh, e)).collect();
        of(&tracer, &ids, &receivers, &area)
    }

    /// Of all that comes into a closed room through a slit of a centimetre, π L times its area, the part that rows of eight rays find, at some sizes of elements; and what
    /// is checked of each table. The slit is open, or cut out by opacity.
    fn through_a_slit(is_cut: bool, check: impl Fn(&mut HitTable, &dyn Fn(&mut HitTable, usize))) -> Vec<f64> {
        let mut scene = Scene { sky: Sky::Uniform([1.0; 3]), ..Scene::default() };
        let cut = Material { base_color: [0.0; 4], alpha_mode: AlphaMode::Mask { cutoff: 0.5 }, ..Material::default() };
        scene.materials = vec![Material::default(), cut];
        let [x, y, z] = [DVec3::X * 4.0, DVec3::Y * 4.0, DVec3::Z * 3.0];
        let slit = 0.01;
        let mut quad = |name: &str, at: DVec3, along: DVec3, across: DVec3| {
            let material = usize::from(name == "cut");
            scene.add_quad(name, material, [at, at + along, at + along + across, at + across]);
        };
        quad("floor", DVec3::ZERO, x, y);
        quad("ceiling", z, y, x * 0.5);
        quad("ceiling", z + x * 0.5 + DVec3::X * slit, y, x * 0.5 - DVec3::X * slit);
        if is_cut {
            quad("cut", z + x * 0.5, y, DVec3::X * slit);
        }
        for (at, along, across) in [(DVec3::ZERO, z, x), (y, x, z), (DVec3::ZERO, y, z), (x, z, y)] {
            quad("wall", at, along, across);
        }
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let exact = std::f64::consts::PI * slit * 4.0;
        let sizes: Vec<f64> = (0..8).map(|k| 0.22 + 0.04 * f64::from(k)).collect();
        let of_size = |size: &f64| {
            let elements = Elements::new(&scene, &mesh, *size);
            let ids = IdSpace { elements: &elements, sky: SkyPatches::new(&scene.sky, scene.up.direction()) };
            let exposure = Exposure::default();
            let receivers = ElementReceivers { mesh: &mesh, elements: &elements, exposure: &exposure };
            let area: Vec<f64> = (0..elements.len() as u32).map(|e| elements.area(&mesh, e)).collect();
            let mut table = HitTable::new(area.clone(), &ids);
            let more = |table: &mut HitTable, columns: usize| {
                table.extend(&tracer, (&ids, &ids.sky.radiosity(&scene.sky)), &receivers, columns, &()).unwrap();
            };
            more(&mut table, 8);
            let of = |(area, [a, b]): (&f64, &[Bands; 2])| area * f64::from(0.5 * (a[1] + b[1]));
            let found = area.iter().zip(table.daylight()).map(of).sum::<f64>() / exact;
            check(&mut table, &more);
            found
        };
        sizes.iter().map(of_size).collect()
    }

    /// Few rays meet a slit that is cut out by opacity. What comes through it is known to a seventh all the same, and as much at all sizes of elements in the mean.
    #[test]
    fn few_rays_tell_what_a_slit_lets_in() {
        let found = through_a_slit(true, |table, more| {
            // Once is enough: further columns look with their own rays.
            let looked = table.looked.clone();
            assert!(looked.iter().all(|rays| *rays >= 50));
            more(table, 16);
            assert!(table.looked.iter().zip(&looked).all(|(now, before)| (2..=8).contains(&(now - before))));
        });
        let mean = found.iter().sum::<f64>() / found.len() as f64;
        let off = (found.iter().map(|x| (x - 1.0).powi(2)).sum::<f64>() / found.len() as f64).sqrt();
        assert!(off < 0.15 && (mean - 1.0).abs() < 0.06, "{off} {mean} {found:?}");
    }

    /// Where rays are sent through it, what a slit lets in is known to some percent at all sizes of elements.
    #[test]
    fn what_comes_through_an_opening_is_sought() {
        let found = through_a_slit(false, |_, _| ());
        let mean = found.iter().sum::<f64>() / found.len() as f64;
        assert!((mean - 1.0).abs() < 0.02 && found.iter().all(|found| (found - 1.0).abs() < 0.05), "{found:?}");
    }

    /// Over its area the floor sees half of the sky, and its open half all of it.
    #[test]
    fn from_afar_the_open_half_is_seen() {
        let [whole, open] = on_a_floor(10.0, |tracer, ids, receivers, area| {
            let table = || HitTable::new(area.to_vec(), ids);
            [table(), table().from_afar()].map(|mut table| {
                table.extend(tracer, (ids, &[]), receivers, 1024, &()).unwrap();
                let mut sky = vec![[0f32; 4]; ids.len()];
                sky[ids.elements.len()..ids.len() - 1].fill([1.0; 4]);
                // The floor is two triangles.
                let of = |i: usize| area[i] * f64::from(table.rows_mean(&sky).unwrap()[i][0]);
                of(0) + of(1)
            })
        });
        assert!((whole - 0.5).abs() < 0.02, "{whole}");
        // Few tries leave some rays beneath the board of a triangle that has three quarters there.
        assert!(open > 0.9, "{open}");
    }

    /// A table in memory, one whose second columns are in a file and one whose columns all are give the same bits, with one thread
    /// and with two. Of 1,024 rays a row, as many rows are read at a time as make no whole number of times those of a thread.
    #[test]
    fn rows_in_files_give_the_same_bits() {
        let run = |threads: usize, room: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let found = || {
                on_a_floor(0.11, |tracer, ids, receivers, area| {
                    let n = area.len();
                    assert!(n > 2 * CHUNK && !n.is_multiple_of(CHUNK), "{n}");
                    let mut table = HitTable::new(area.to_vec(), ids).within(room, std::env::temp_dir());
                    let sky = ids.sky.radiosity(&Sky::Uniform([1.0; 3]));
                    for columns in [16, 1024] {
                        table.extend(tracer, (ids, &sky), receivers, columns, &()).unwrap();
                    }
                    let light = |i: usize| ((7 * i) % 97) as f64 / 31.0;
                    let b: Vec<f64> = (0..37 * n).map(light).collect();
                    let (mut h, mut by_matrix) = (vec![0.0; 37 * n], vec![0.0; n]);
                    table.apply(&b, &mut h, 37).unwrap();
                    table.matrix().unwrap().apply(&b[..n], &mut by_matrix, 1).unwrap();
                    let values: Vec<[f32; 4]> = (0..ids.len()).map(|i| [light(i) as f32; 4]).collect();
                    let halves = table.halves(&values).unwrap();
                    let single = halves.as_flattened().as_flattened().iter();
                    let single = single.chain(table.daylight().as_flattened().as_flattened()).map(|x| f64::from(*x));
                    let numbers: Vec<u64> = h.into_iter().chain(by_matrix).chain(single).map(f64::to_bits).collect();
                    let ids = table.map_rows(|row| row.ids().collect::<Vec<u32>>()).unwrap();
                    assert_eq!(table.bytes_in_memory() + table.bytes_in_files(), HitTable::bytes(n, 1024));
                    (table.bytes_in_memory(), (numbers, ids, table.parts().unwrap().to_vec()))
                })
            };
            pool.install(found)
        };
        let (whole, memory) = run(1, usize::MAX);
        for (threads, room, held) in
            [(2, usize::MAX, whole), (1, 0, 0), (2, 0, 0), (1, whole / 2, whole / 64), (2, whole / 2, whole / 64)]
        {
            let (in_memory, found) = run(threads, room);
            assert_eq!(in_memory, held, "{threads} threads, {room} bytes");
            assert!(found == memory, "{threads} threads, {room} bytes");
        }
    }

    /// Where there is no place for a file the table says so, and is as it was.
    #[test]
    fn a_file_that_cannot_be_is_an_error() {
        on_a_floor(0.1, |tracer, ids, receivers, area| {
            let nowhere = std::env::temp_dir().join("there is no such folder");
            let mut table = HitTable::new(area.to_vec(), ids).within(area.len() * 100, nowhere.clone());
            table.extend(tracer, (ids, &[]), receivers, 16, &()).unwrap();
            let Err(ExtendError::File(error)) = table.extend(tracer, (ids, &[]), receivers, 64, &()) else {
                panic!("written")
            };
            assert_eq!((&error.folder, error.bytes), (&nowhere, HitTable::bytes(area.len(), 48)));
            assert!(error.to_string().contains("no such folder"), "{error}");
            assert_eq!((table.columns(), table.bytes_in_files()), (16, 0));
            assert!(table.rows_mean(&vec![[1.0; 4]; ids.len()]).unwrap().iter().all(|sum| sum[0] == 1.0));
        });
    }
}
