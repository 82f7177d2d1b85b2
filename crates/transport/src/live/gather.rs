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
                let (row, share) = chunk.row(e, rays);
                // Four sums side by side: each addition would wait for the one before it.
                let mut sums = [[0f32; W]; 4];
                for ids in row.into_iter().flat_map(|part| part.chunks_exact(4)) {
                    for (sum, id) in sums.iter_mut().zip(ids) {
                        let value = &values[*id as usize].0;
                        for k in 0..W {
                            sum[k] += value[k];
                        }
                    }
                }
                *mean = Lanes(std::array::from_fn(|k| ((sums[0][k] + sums[1][k]) + (sums[2][k] + sums[3][k])) * share));
            }
        });
    }

    /// Half the difference between the halves of each row.
    pub fn half_differences(&self, values: &[Lanes<4>], rays: usize, differences: &mut [Lanes<4>]) {
        self.each_chunk(differences, |chunk, differences| {
            for (e, difference) in differences.iter_mut().enumerate() {
                let (row, share) = chunk.row(e, rays);
                let rays = row[0].len() + row[1].len();
                let mut sums = [[0f32; 4]; 2];
                for (m, id) in row.into_iter().flatten().enumerate() {
                    let (sum, value) = (&mut sums[usize::from(2 * m >= rays)], &values[*id as usize].0);
                    for k in 0..4 {
                        sum[k] += value[k];
                    }
                }
                *difference = Lanes(std::array::from_fn(|k| (sums[0][k] - sums[1][k]) * share));
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
