//! Texels of a chart share what they found ([`pooled`]), and what they know of its noise.

use super::{Atlas, Placed, Texel};
use crate::pool::{Pooled, Sample, pooled};
use glam::DVec2;
use radiosity_scene::Bands;
use rayon::prelude::*;
use smallvec::SmallVec;

/// The number of a slot without a texel.
const NONE: u32 = u32::MAX;

/// Texels around one, along each axis, that tell the noise of its rays: twenty-five know it to a seventh, the nine of a
/// corner to a quarter, and a shadow's edge is not wider.
const AROUND: u32 = 2;

/// Texels around one at most.
const MOST_AROUND: usize = ((2 * AROUND + 1) * (2 * AROUND + 1) - 1) as usize;

/// Numbers of those.
pub type Around = SmallVec<[u32; MOST_AROUND]>;

/// Charts of fewer texels than this ask those that come before and after them, up to so many texels away: most are parts of one thing.
const FEW: usize = 9;

/// The slots of a chart in the square around one, that among them.
fn square_around(slot: u32, [columns, rows]: [u32; 2]) -> impl Iterator<Item = u32> {
    let near = |x: u32, count: u32| x.saturating_sub(AROUND)..(x + AROUND + 1).min(count);
    let (across, down) = (near(slot % columns, columns), near(slot / columns, rows));
    down.flat_map(move |y| across.clone().map(move |x| y * columns + x))
}

impl Atlas {
    /// Pooled light of `texels` of a page: `values[i]`, lx per band, its standard error `noise[i]`, lx, and its number of rays belong to
    /// `texels[i]`, each named once. What is not finite stays as it is. Noise of one texel must not be that of another: a part that they
    /// share is taken for light.
    pub fn pooled(&self, page: usize, texels: &[Texel], values: &[Bands], noise: &[f32], rays: &[u32]) -> Vec<Pooled> {
        assert_eq!([texels.len(); 3], [values.len(), noise.len(), rays.len()]);
        let mut out: Vec<Pooled> = values.iter().zip(noise).map(|(light, s)| Pooled::alone(*light, *s)).collect();
        let is_known = |i: usize| values[i].iter().chain([&noise[i]]).all(|e| e.is_finite());
        let of_chart = |slots: &[Option<usize>], columns: u32| -> Vec<(usize, Pooled)> {
            let at = |slot: usize| DVec2::new((slot % columns as usize) as f64, (slot / columns as usize) as f64);
            let (own, samples): (Vec<usize>, Vec<Sample>) = slots
                .iter()
                .enumerate()
                .filter_map(|(slot, i)| i.map(|i| (slot, i)))
                .map(|(slot, i)| {
                    (i, Sample { at: at(slot), light: values[i], noise: noise[i], weight: rays[i] as f32 })
                })
                .unzip();
            own.into_iter().zip(pooled(&samples, &[])).collect()
        };
        for (i, value) in self.by_chart(page, texels, is_known, of_chart).into_iter().flatten() {
            out[i] = value;
        }
        out
    }

    /// The standard error of each of `texels`, lx, where two halves of its rays differ by `noise` from their mean: a root mean square over
    /// the texels around, as a difference says little by itself. What is not finite says nothing.
    pub fn evened(&self, page: usize, texels: &[Texel], noise: &[f32]) -> Vec<f32> {
        assert_eq!(texels.len(), noise.len());
        let square = |i: usize| f64::from(noise[i]).powi(2);
        let mean = |squares: &mut dyn Iterator<Item = f64>| {
            let (sum, count) = squares.fold((0.0, 0), |(sum, count), s| (sum + s, count + 1));
            (sum / f64::from(count.max(1))).sqrt() as f32
        };
        let of_chart = |slots: &[Option<usize>], columns: u32| -> Vec<(usize, Option<f32>)> {
            let own = slots.iter().flatten().count();
            let rows = slots.len() as u32 / columns;
            let around = |slot: u32| {
                let known = square_around(slot, [columns, rows]).filter_map(|slot| slots[slot as usize]);
                mean(&mut known.map(square))
            };
            let tell = |(slot, i): (usize, &Option<usize>)| i.map(|i| (i, (own >= FEW).then(|| around(slot as u32))));
            slots.iter().enumerate().filter_map(tell).collect()
        };
        let found = self.by_chart(page, texels, |i| noise[i].is_finite(), of_chart).concat();
        let mut out = vec![f32::NAN; texels.len()];
        for (k, (i, told)) in found.iter().enumerate() {
            let run = &found[k.saturating_sub(FEW)..(k + FEW + 1).min(found.len())];
            out[*i] = told.unwrap_or_else(|| mean(&mut run.iter().map(|(i, _)| square(*i))));
        }
        out
    }

    /// Of each of `texels`, each named once, those of its chart that lie around it. Charts of fewer than could lie there know too little of their noise: of theirs there are none.
    pub fn beside(&self, page: usize, texels: &[Texel]) -> Vec<Around> {
        let mut out = vec![Around::new(); texels.len()];
        let of_chart = |slots: &[Option<usize>], columns: u32| -> Vec<(usize, Around)> {
            if slots.iter().flatten().count() <= MOST_AROUND {
                return Vec::new();
            }
            let rows = slots.len() as u32 / columns;
            let around = |(slot, own): (u32, usize)| {
                let others = square_around(slot, [columns, rows]).filter(|other| *other != slot);
                let others = others.filter_map(|other| slots[other as usize]);
                (own, others.map(|other| other as u32).collect())
            };
            (0..).zip(slots).filter_map(|(slot, own)| own.map(|own| (slot, own))).map(around).collect()
        };
        for (own, beside) in self.by_chart(page, texels, |_| true, of_chart).into_iter().flatten() {
            out[own] = beside;
        }
        out
    }

    /// Surface that each of `texels` stands for, about, m²: those of one chart alike, up to its border.
    pub fn areas(&self, texels: &[Texel]) -> Vec<f64> {
        texels.iter().map(|t| self.charts[self.triangle_chart[t.triangle as usize] as usize].texel).collect()
    }

    /// What comes of the slots of each chart of a page, in the order of charts: by row, the number of the texel that is there, if it
    /// is known.
    fn by_chart<T: Send>(
        &self,
        page: usize,
        texels: &[Texel],
        is_known: impl Fn(usize) -> bool,
        of_chart: impl Fn(&[Option<usize>], u32) -> T + Sync,
    ) -> Vec<T> {
        let Some(&[width, height]) = self.pages.get(page) else { return Vec::new() };
        let mut index = vec![NONE; width as usize * height as usize];
        for (i, texel) in texels.iter().enumerate().filter(|(i, _)| is_known(*i)) {
            index[usize::from(texel.y) * width as usize + usize::from(texel.x)] = i as u32;
        }
        let charts: Vec<&Placed> = self.charts.iter().filter(|chart| chart.at.page as usize == page).collect();
        let slots = |chart: &&Placed| {
            let [columns, rows] = chart.size;
            let slots = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
            let texel = |(column, row)| index[chart.slot(column, row, width)];
            let slots: Vec<Option<usize>> = slots.map(texel).map(|i| (i != NONE).then_some(i as usize)).collect();
            of_chart(&slots, columns)
        };
        charts.par_iter().map(slots).collect()
    }
}
