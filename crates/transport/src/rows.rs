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

use crate::{Progress, Receivers, Stopped};
use radiosity_scene::{Elements, SkyPatches};
use radiosity_solve::{AreaSpace, Transport};
use radiosity_trace::sampling::{Sequence, cosine_direction, frame, hash, unit};
use radiosity_trace::{Found, Tracer};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

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
    pub fn id(&self, found: Found, direction: glam::DVec3) -> u32 {
        match found {
            Found::Surface { triangle, uv: [u, v], side, .. } => {
                self.elements.at(triangle, u, v, side).unwrap_or(self.nothing())
            }
            Found::Back => self.nothing(),
            Found::Escaped => (self.elements.len() + self.sky.at(direction)) as u32,
        }
    }
}

/// Places tried for a ray before its receiver counts as buried. Elements less than a tenth of which is exposed are
/// known to the exposure mask, so each attempt succeeds with probability 1/2 or more.
const ATTEMPTS: u32 = 8;

/// Rays `2 from..2 to` of a receiver's row, in two halves; `out` gets the ids of the first half, then of the second.
fn trace_row(
    tracer: &Tracer,
    ids: &IdSpace,
    receivers: &impl Receivers,
    i: usize,
    (from, to, stream): (u32, u32, u32),
    mut out: impl FnMut(usize, u32),
) {
    let seed = receivers.seed(i);
    let Some(site) = receivers.site(i) else {
        (from..to).for_each(|_| (0..2).for_each(|half| out(half, ids.nothing())));
        return;
    };
    let frame = frame(site.normal);
    let sequence = Sequence::new(seed, stream);
    for half in 0..2 {
        for index in (0..to - from).map(|k| 2 * from + half * (to - from) + k) {
            let [u, v, mut x, mut y] = sequence.point(index);
            let salt = hash(hash(seed) ^ index);
            let mut id = ids.nothing();
            for attempt in 0..ATTEMPTS {
                let place = site.place(x, y);
                let direction = cosine_direction(&frame, f64::from(u), f64::from(v));
                let found = tracer.first(&tracer.ray(&place, direction, f64::INFINITY), salt);
                id = ids.id(found, direction);
                if found != Found::Back || !receivers.buried(tracer, &place, salt) {
                    break;
                }
                // The place lies inside a solid: the same direction from another place of the receiver.
                let again = hash(salt ^ attempt);
                (x, y) = (unit(again), unit(hash(again)));
            }
            out(half as usize, id);
        }
    }
}

/// Rays of one block of columns. Row i is `ids[starts[i]..starts[i + 1]]`, the first half of it from the first half
/// of the points.
#[derive(Clone, Debug)]
struct Block {
    starts: Vec<usize>,
    ids: Vec<u32>,
}

impl Block {
    fn row(&self, i: usize) -> &[u32] {
        &self.ids[self.starts[i]..self.starts[i + 1]]
    }
}

/// Rays of a row where a whole cell gets `columns`: an element of a divided cell gets its share, and at least one ray
/// in each half.
fn width(columns: usize, pieces: usize) -> usize {
    2 * (columns / 2).div_ceil(pieces)
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
    /// Label of each element: elements that see each other, directly or through others, share one.
    parts: Vec<u32>,
}

/// The stream of sample points that rows use.
const ROWS: u32 = 0x0100;

impl HitTable {
    /// An empty table for elements of the given areas (m²).
    pub fn new(area: Vec<f64>, ids: &IdSpace) -> HitTable {
        let n = area.len();
        let parts = (0..n as u32).collect();
        let traced = vec![0; n];
        HitTable { space: AreaSpace { area }, blocks: Vec::new(), columns: 0, all_ids: ids.len(), traced, parts }
    }

    /// M: rays per cell so far.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Bytes of the table with `columns` rays for each of `cells`.
    pub fn bytes(cells: usize, columns: usize) -> usize {
        cells * columns * size_of::<u32>()
    }

    /// Appends columns up to `columns` rays per cell (an even number).
    ///
    /// # Errors
    /// [`Stopped`] if `progress` says so; the table is then as it was.
    pub fn extend(
        &mut self,
        tracer: &Tracer,
        ids: &IdSpace,
        receivers: &impl Receivers,
        columns: usize,
        progress: &impl Progress,
    ) -> Result<(), Stopped> {
        let n = receivers.len();
        assert_eq!(n, self.space.area.len());
        let columns = columns.next_multiple_of(2);
        let Some(more) = columns.checked_sub(self.columns).filter(|more| *more > 0) else { return Ok(()) };
        const CHUNK: usize = 256;
        let mut starts = Vec::with_capacity(n + 1);
        let mut end = 0;
        for i in 0..n {
            starts.push(end);
            end += width(more, ids.elements.pieces(i as u32) as usize);
        }
        starts.push(end);
        let mut block = Block { starts, ids: vec![0u32; end] };
        let done = AtomicUsize::new(0);
        split_rows(&mut block.ids, &block.starts, CHUNK).into_par_iter().try_for_each(|(rows, mut ids_left)| {
            for i in rows.clone() {
                let row;
                (row, ids_left) = ids_left.split_at_mut(block.starts[i + 1] - block.starts[i]);
                let half = row.len() / 2;
                let (from, mut next) = (self.traced[i] / 2, [0, half]);
                trace_row(tracer, ids, receivers, i, (from, from + half as u32, ROWS), |half, id| {
                    row[next[half]] = id;
                    next[half] += 1;
                });
                // Neighbouring ids lie in the same cache lines when the row is read back in order.
                row[..half].sort_unstable();
                row[half..].sort_unstable();
            }
            progress.step(done.fetch_add(rows.len(), Ordering::Relaxed) + rows.len(), n).then_some(()).ok_or(Stopped)
        })?;
        self.join_parts(&block);
        for (traced, starts) in self.traced.iter_mut().zip(block.starts.windows(2)) {
            *traced += (starts[1] - starts[0]) as u32;
        }
        self.blocks.push(block);
        self.columns = columns;
        Ok(())
    }

    /// Joins the labels of elements that rows connect, and numbers them anew from 0.
    fn join_parts(&mut self, block: &Block) {
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
        for i in 0..n {
            let mut own = root(&mut parent, i as u32);
            for &id in block.row(i).iter().filter(|id| (**id as usize) < n) {
                let other = root(&mut parent, id);
                let (low, high) = (own.min(other), own.max(other));
                parent[high as usize] = low;
                own = low;
            }
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
    }

    /// Mean of `values` (by id) over each row: h_i = (1/M_i) Σ_m values[id(i, m)].
    pub fn rows_mean(&self, values: &[[f32; 4]]) -> Vec<[f32; 4]> {
        self.halves(values).into_iter().map(|[a, b]| std::array::from_fn(|k| 0.5 * (a[k] + b[k]))).collect()
    }

    /// The same for the two halves of each row.
    pub fn halves(&self, values: &[[f32; 4]]) -> Vec<[[f32; 4]; 2]> {
        assert_eq!(values.len(), self.all_ids);
        let n = self.space.area.len();
        (0..n)
            .into_par_iter()
            .with_min_len(256)
            .map(|i| {
                let share = 2.0 / self.traced[i].max(1) as f32;
                self.row(i, values).map(|sum| sum.map(|x| x * share))
            })
            .collect()
    }

    #[inline]
    fn row(&self, i: usize, values: &[[f32; 4]]) -> [[f32; 4]; 2] {
        let mut sums = [[0f32; 4]; 2];
        for block in &self.blocks {
            let row = block.row(i);
            for (sum, ids) in sums.iter_mut().zip(row.chunks_exact(row.len() / 2)) {
                for &id in ids {
                    let value = values[id as usize];
                    for k in 0..4 {
                        sum[k] += value[k];
                    }
                }
            }
        }
        sums
    }

    /// The ids of a row, all of the same weight.
    pub fn row_ids(&self, i: usize) -> impl Iterator<Item = u32> + '_ {
        self.blocks.iter().flat_map(move |block| block.row(i).iter().copied())
    }
}

/// Cuts `ids` into chunks of `chunk` rows, each with the range of its rows.
fn split_rows<'a>(mut ids: &'a mut [u32], starts: &[usize], chunk: usize) -> Vec<(Range<usize>, &'a mut [u32])> {
    let n = starts.len() - 1;
    let mut chunks = Vec::with_capacity(n.div_ceil(chunk));
    for first in (0..n).step_by(chunk) {
        let end = (first + chunk).min(n);
        let (own, rest) = ids.split_at_mut(starts[end] - starts[first]);
        chunks.push((first..end, own));
        ids = rest;
    }
    chunks
}

impl Transport for HitTable {
    type Space = AreaSpace;

    fn space(&self) -> &AreaSpace {
        &self.space
    }

    fn parts(&self) -> Option<&[u32]> {
        Some(&self.parts)
    }

    /// F b among the elements; sky and nothing give zero here. Bands beyond four are taken four at a time.
    fn apply(&self, b: &[f64], h: &mut [f64], bands: usize) {
        let n = self.space.area.len();
        let mut values = vec![[0f32; 4]; self.all_ids];
        for first in (0..bands).step_by(4) {
            let count = (bands - first).min(4);
            for (value, b) in values.iter_mut().zip(b.chunks_exact(bands)) {
                for k in 0..count {
                    value[k] = b[first + k] as f32;
                }
            }
            h.par_chunks_exact_mut(bands).with_min_len(256).enumerate().take(n).for_each(|(i, h)| {
                let share = 1.0 / f64::from(self.traced[i].max(1));
                let [a, c] = self.row(i, &values);
                for k in 0..count {
                    h[first + k] = (f64::from(a[k]) + f64::from(c[k])) * share;
                }
            });
        }
    }
}
