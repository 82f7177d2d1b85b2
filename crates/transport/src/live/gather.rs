//! H = F B over rows that are being changed: each row adds up what its entries see.

use super::{Live, chunk::Chunk};
use radiosity_scene::Bands;
use rayon::prelude::*;

/// Numbers that go through F together: values of an id lie side by side, so that a look-up is one cache line.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(16))]
pub struct Lanes<const W: usize>(pub [f32; W]);

impl<const W: usize> Default for Lanes<W> {
    fn default() -> Self {
        Lanes([0.0; W])
    }
}

impl Live {
    /// The mean of `values` over the first `rays` entries of each row; nothing for objects that are not there, for the sky
    /// and for black backs. Values and means are by id.
    pub fn gather<const W: usize>(&self, values: &[Lanes<W>], rays: usize, means: &mut [Lanes<W>]) {
        assert!(rays.is_multiple_of(4), "{rays}");
        assert_eq!((values.len(), means.len()), (self.ids(), self.ids()));
        self.each_chunk(means, |chunk, means| {
            for (e, mean) in means.iter_mut().enumerate() {
                let row = chunk.row(e, rays);
                // Four sums side by side: each addition would wait for the one before it.
                let mut sums = [[0f32; W]; 4];
                let mut add = |sum: usize, id: u32| {
                    let value = &values[id as usize].0;
                    (0..W).for_each(|k| sums[sum][k] += value[k]);
                };
                if row.is_whole() {
                    for ids in row.ids.into_iter().flat_map(|part| part.chunks_exact(4)) {
                        (0..4).for_each(|sum| add(sum, ids[sum]));
                    }
                } else {
                    row.counting().for_each(|(m, id)| add(m as usize % 4, id));
                }
                let sum = |k: usize| (sums[0][k] + sums[1][k]) + (sums[2][k] + sums[3][k]);
                *mean = Lanes(std::array::from_fn(|k| sum(k) * row.share));
            }
        });
    }

    /// Half the difference between the means over the halves of each row.
    pub fn half_differences(&self, values: &[Lanes<4>], rays: usize, differences: &mut [Lanes<4>]) {
        self.each_chunk(differences, |chunk, differences| {
            for (e, difference) in differences.iter_mut().enumerate() {
                let row = chunk.row(e, rays);
                let (mut sums, mut counts) = ([[0f32; 4]; 2], [0u32; 2]);
                for (m, id) in row.counting() {
                    let (half, value) = (usize::from(2 * m as usize >= row.len()), &values[id as usize].0);
                    counts[half] += 1;
                    (0..4).for_each(|k| sums[half][k] += value[k]);
                }
                // Halves of which one has nothing tell nothing.
                if row.share > 0.0 && !counts.contains(&0) {
                    let [a, b] = counts.map(|count| 0.5 / count as f32);
                    *difference = Lanes(std::array::from_fn(|k| sums[0][k] * a - sums[1][k] * b));
                } else {
                    *difference = Lanes::default();
                }
            }
        });
    }

    /// The direct light of columns: of each, times its own factor and added up, in the order given.
    pub fn add_direct(&self, columns: &[(usize, Bands)], light: &mut [Lanes<4>]) {
        self.each_chunk(light, |chunk, light| {
            for (column, factor) in columns {
                for (e, light) in light.iter_mut().enumerate() {
                    let own = chunk.light(*column, e);
                    (0..3).for_each(|band| light.0[band] += own[band] * factor[band]);
                }
            }
        });
    }

    /// Calls back with each chunk of objects that are there and its part of what is given by id; sets all else to nothing.
    pub fn each_chunk<T: Send + Copy + Default>(&self, by_id: &mut [T], visit: impl Fn(&Chunk, &mut [T]) + Sync) {
        let mut left = by_id;
        let mut at = 0;
        let mut parts = Vec::with_capacity(self.chunks.len());
        for chunk in &self.chunks {
            let (between, rest) = left.split_at_mut(chunk.id - at);
            between.fill(T::default());
            let (own, rest) = rest.split_at_mut(chunk.len);
            (left, at) = (rest, chunk.id + chunk.len);
            parts.push((chunk, own));
        }
        left.fill(T::default());
        parts.into_par_iter().with_min_len(4).for_each(|(chunk, own)| {
            if self.world.bodies[chunk.body].is_present {
                visit(chunk, own);
            } else {
                own.fill(T::default());
            }
        });
    }
}
