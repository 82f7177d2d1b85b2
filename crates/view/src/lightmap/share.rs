//! Texels of a chart share what they gathered ([`pooled`]).

use super::{Atlas, Placed, Texel};
use crate::pool::{Pooled, Sample, pooled};
use glam::DVec2;
use radiosity_scene::{Bands, luminance};
use rayon::prelude::*;

/// The number of a slot without a texel.
const NONE: u32 = u32::MAX;

impl Atlas {
    /// Pooled light of `texels` of a page: `values[i]`, lx per band, and its standard error `noise[i]` belong to `texels[i]`, each
    /// named once. What is not finite stays as it is. Noise of one texel must not be that of another: a part that they share is
    /// taken for light.
    pub fn pooled(&self, page: usize, texels: &[Texel], values: &[Bands], noise: &[Bands]) -> Vec<Pooled> {
        assert_eq!((texels.len(), texels.len()), (values.len(), noise.len()));
        let mut out: Vec<Pooled> = values.iter().map(|light| Pooled::alone(*light, 0.0)).collect();
        let Some(&[width, height]) = self.pages.get(page) else { return out };
        let mut index = vec![NONE; width as usize * height as usize];
        for (i, texel) in texels.iter().enumerate() {
            if values[i].iter().chain(&noise[i]).all(|e| e.is_finite()) {
                index[usize::from(texel.y) * width as usize + usize::from(texel.x)] = i as u32;
            }
        }
        let charts: Vec<&Placed> = self.charts.iter().filter(|chart| chart.at.page as usize == page).collect();
        let of_chart = |chart: &&Placed| -> Vec<(usize, Pooled)> {
            let [columns, rows] = chart.size;
            let slots = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
            let texel = |(column, row)| {
                let i = index[chart.slot(column, row, width)];
                (i != NONE).then(|| (i as usize, DVec2::new(f64::from(column), f64::from(row))))
            };
            let (own, samples): (Vec<usize>, Vec<Sample>) = slots
                .filter_map(texel)
                .map(|(i, at)| (i, Sample { at, light: values[i], noise: luminance(noise[i]), weight: 1.0 }))
                .unzip();
            own.into_iter().zip(pooled(&samples, &[])).collect()
        };
        let found: Vec<Vec<(usize, Pooled)>> = charts.par_iter().map(of_chart).collect();
        found.into_iter().flatten().for_each(|(i, value)| out[i] = value);
        out
    }
}
