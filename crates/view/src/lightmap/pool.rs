//! Pooling: texels share what they gathered with those around them on their chart, as far as light is smooth.
//!
//! Each texel is estimated by a plane through the light of its chart within a radius. How far to go is found by leaving texels
//! out: the plane through the others predicts a texel to (its noise)² + (what the plane has wrong)², and the radius where this is
//! least, on average over the texels around, is taken (cross-validation; Stone 1974). Where no radius predicts texels as well as
//! their own noise would have it, something is smaller than they are, a contact or a shadow's edge: there a texel keeps its own
//! light in the part by which the prediction is worse (a Wiener filter; Lee 1980).

use super::{Atlas, Placed, Texel};
use glam::DVec2;
use radiosity_scene::{Bands, luminance};
use rayon::prelude::*;

/// Radii that are tried, texels. Beyond the last there is nothing to gain: of a thousand texels the noise is a thirtieth.
const RADII: [usize; 5] = [1, 2, 4, 8, 16];

/// Radius over which predictions of a texel are compared: 81 texels tell which of two planes a fifth of the noise apart is better.
const COMPARED: usize = 4;

/// Radius over which chosen radii are evened out: at 0 neighbours differ by the choice alone, and much more carries the radius of
/// smooth light into contacts.
const EVENED: usize = 2;

/// Fewest texels that a plane is laid through.
const FEWEST: f64 = 4.0;

/// A texel that has more of a plane to itself than this, at the end of a row, is not predicted by the others: what it is off is
/// divided by what is left.
const ALONE: f64 = 0.9;

/// Variance of coordinates, texels², that is added along each axis: texels in a row say nothing of the slope across.
const RIDGE: f64 = 1e-3;

impl Atlas {
    /// Pooled light of `texels` of a page: `values[i]`, lx per band, and its standard error `noise[i]` belong to `texels[i]`, each
    /// named once. What is not finite stays as it is. Noise of one texel must not be that of another: a part that they share is
    /// taken for light.
    pub fn pooled(&self, page: usize, texels: &[Texel], values: &[Bands], noise: &[Bands]) -> Vec<Pooled> {
        assert_eq!((texels.len(), texels.len()), (values.len(), noise.len()));
        let mut out: Vec<Pooled> = values.iter().map(|light| Pooled { light: *light, own: 1.0 }).collect();
        let Some(&[width, height]) = self.pages.get(page) else { return out };
        let mut index = vec![NONE; width as usize * height as usize];
        for (i, texel) in texels.iter().enumerate() {
            if values[i].iter().chain(&noise[i]).all(|e| e.is_finite()) {
                index[usize::from(texel.y) * width as usize + usize::from(texel.x)] = i as u32;
            }
        }
        let charts: Vec<&Placed> = self.charts.iter().filter(|chart| chart.at.page as usize == page).collect();
        let pooled: Vec<Vec<(usize, Pooled)>> = charts
            .par_iter()
            .map(|chart| {
                let [columns, rows] = chart.size;
                let own = (0..columns * rows).map(|i| index[chart.slot(i % columns, i / columns, width)]).collect();
                Grid { columns: columns as usize, rows: rows as usize, own }.pooled(values, noise)
            })
            .collect();
        pooled.into_iter().flatten().for_each(|(i, value)| out[i] = value);
        out
    }
}

/// What came of a texel.
#[derive(Clone, Copy, Debug)]
pub struct Pooled {
    /// Light, lx per band.
    pub light: Bands,
    /// How much of it is the texel's own beyond its share in the pool: 0 where light is smooth, 1 where the others know nothing of
    /// it.
    pub own: f32,
}

/// The number of a slot without a texel.
const NONE: u32 = u32::MAX;

/// The texels of a chart, row-major, by their number.
struct Grid {
    columns: usize,
    rows: usize,
    own: Vec<u32>,
}

/// A plane through light, at the texel that it was laid around.
#[derive(Clone, Copy)]
struct Fit {
    light: [f64; 3],
    /// How much of it is the texel's own.
    share: f64,
}

impl Grid {
    /// The texels that have others to share with, and their light.
    fn pooled(&self, values: &[Bands], noise: &[Bands]) -> Vec<(usize, Pooled)> {
        if ((0..self.own.len()).filter_map(|slot| self.texel(slot)).count() as f64) < FEWEST {
            return Vec::new();
        }
        let moments = Sums::new(self, |slot| {
            let Some(own) = self.texel(slot) else { return [0.0; 15] };
            let ([r, g, b], DVec2 { x, y }) = (values[own].map(f64::from), self.at(slot));
            [1.0, x, y, x * x, x * y, y * y, r, r * x, r * y, g, g * x, g * y, b, b * x, b * y]
        });
        let plane = |slot: usize, radius: usize| plane(&moments.within(self, slot, radius), self.at(slot));

        // The radius that predicts best, by its number, and how far its planes are off.
        let reach = self.columns.max(self.rows) - 1;
        let mut best = vec![(NOWHERE, f64::INFINITY); self.own.len()];
        for (k, radius) in RADII.into_iter().enumerate() {
            let off = Sums::new(self, |slot| self.off(slot, plane(slot, radius), values));
            for (slot, best) in best.iter_mut().enumerate() {
                let [count, sum] = off.within(self, slot, COMPARED);
                let knows = self.texel(slot).and_then(|_| plane(slot, radius)).is_some();
                if knows && count > 0.0 && sum / count < best.1 {
                    *best = (k, sum / count);
                }
            }
            if radius >= reach {
                break;
            }
        }

        let variance = Sums::new(self, |slot| match self.texel(slot) {
            Some(own) => [1.0, f64::from(luminance(noise[own])).powi(2)],
            None => [0.0; 2],
        });
        // Texels without a plane have no say in it.
        let evened =
            Sums::new(self, |slot| if best[slot].0 == NOWHERE { [0.0; 2] } else { [1.0, best[slot].0 as f64] });
        let light = |slot: usize| {
            let (own, (chosen, missed)) = (self.texel(slot)?, best[slot]);
            if chosen == NOWHERE {
                return None;
            }
            let [count, sum] = evened.within(self, slot, EVENED);
            let at = sum / count;
            let near = |k: f64| Some(plane(slot, RADII[k as usize]).or_else(|| plane(slot, RADII[chosen]))?.light);
            let (low, high, share) = (near(at.floor())?, near(at.ceil())?, at.fract());
            let [count, sum] = variance.within(self, slot, COMPARED);
            // Of so many texels a variance is known to √(2/n) of itself: less than twice that beyond the noise is chance.
            let noise = sum / count * (1.0 + (8.0 / count).sqrt());
            let kept = if missed > 0.0 { (1.0 - noise / missed).clamp(0.0, 1.0) } else { 0.0 };
            let light = std::array::from_fn(|k| {
                let shared = low[k] + share * (high[k] - low[k]);
                (shared + kept * (f64::from(values[own][k]) - shared)).max(0.0) as f32
            });
            Some((own, Pooled { light, own: kept as f32 }))
        };
        (0..self.own.len()).filter_map(light).collect()
    }

    /// One, and the squared distance of a texel from a plane around it that is laid without it.
    fn off(&self, slot: usize, plane: Option<Fit>, values: &[Bands]) -> [f64; 2] {
        let (Some(own), Some(fit)) = (self.texel(slot), plane) else { return [0.0; 2] };
        let off = f64::from(luminance(values[own])) - f64::from(luminance(fit.light.map(|e| e as f32)));
        [1.0, (off / (1.0 - fit.share)).powi(2)]
    }

    /// The number of the texel at a slot.
    fn texel(&self, slot: usize) -> Option<usize> {
        Some(self.own[slot] as usize).filter(|_| self.own[slot] != NONE)
    }

    /// Where a texel lies, from the middle of the chart.
    fn at(&self, slot: usize) -> DVec2 {
        let middle = DVec2::new(self.columns as f64, self.rows as f64) / 2.0;
        DVec2::new((slot % self.columns) as f64, (slot / self.columns) as f64) - middle
    }
}

/// The number of a radius where none knows anything.
const NOWHERE: usize = RADII.len();

/// The plane by least squares through texels with these sums, at a place.
fn plane(sums: &[f64; 15], at: DVec2) -> Option<Fit> {
    let [n, x, y, xx, xy, yy, of_bands @ ..] = *sums;
    if n < FEWEST {
        return None;
    }
    let middle = DVec2::new(x, y) / n;
    let (xx, xy, yy) =
        (xx / n - middle.x * middle.x + RIDGE, xy / n - middle.x * middle.y, yy / n - middle.y * middle.y + RIDGE);
    let away = at - middle;
    let way = DVec2::new(yy * away.x - xy * away.y, xx * away.y - xy * away.x) / (xx * yy - xy * xy);
    let share = (1.0 + way.dot(away)) / n;
    let light = std::array::from_fn(|k| {
        let [z, zx, zy] = [0, 1, 2].map(|m| of_bands[3 * k + m] / n);
        z + way.dot(DVec2::new(zx, zy) - z * middle)
    });
    (share < ALONE).then_some(Fit { light, share })
}

/// Sums over rectangles of a grid (summed-area table; Crow 1984).
struct Sums<const N: usize> {
    /// Of all above and left of a corner, `columns + 1` to a row.
    table: Vec<[f64; N]>,
}

impl<const N: usize> Sums<N> {
    /// Of what each slot has.
    fn new(grid: &Grid, of: impl Fn(usize) -> [f64; N]) -> Sums<N> {
        let stride = grid.columns + 1;
        let mut table = vec![[0.0; N]; stride * (grid.rows + 1)];
        for y in 0..grid.rows {
            let mut row = [0.0; N];
            for x in 0..grid.columns {
                let own = of(y * grid.columns + x);
                row = std::array::from_fn(|k| row[k] + own[k]);
                table[(y + 1) * stride + x + 1] = std::array::from_fn(|k| table[y * stride + x + 1][k] + row[k]);
            }
        }
        Sums { table }
    }

    /// Over the square of a radius around a texel.
    fn within(&self, grid: &Grid, slot: usize, radius: usize) -> [f64; N] {
        let (x, y, stride) = (slot % grid.columns, slot / grid.columns, grid.columns + 1);
        let (left, right) = (x.saturating_sub(radius), (x + radius + 1).min(grid.columns));
        let (top, bottom) = (y.saturating_sub(radius), (y + radius + 1).min(grid.rows));
        let at = |x: usize, y: usize| &self.table[y * stride + x];
        let (a, b, c, d) = (at(left, top), at(right, top), at(left, bottom), at(right, bottom));
        std::array::from_fn(|k| d[k] - b[k] - c[k] + a[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_trace::sampling::{hash, unit};

    const SIDE: usize = 48;

    /// Noise of standard error 1, as sums of twelve even numbers have.
    fn noisy(of: impl Fn(f64, f64) -> f64, seed: u32) -> Vec<Bands> {
        let value = |slot: usize| {
            let draw = |k: u32| f64::from(unit(hash(hash(seed ^ slot as u32) ^ k)));
            let noise = (0..12).map(draw).sum::<f64>() - 6.0;
            [(of((slot % SIDE) as f64, (slot / SIDE) as f64) + noise) as f32; 3]
        };
        (0..SIDE * SIDE).map(value).collect()
    }

    fn pooled(values: &[Bands], noise: f32) -> Vec<Pooled> {
        let grid = Grid { columns: SIDE, rows: SIDE, own: (0..(SIDE * SIDE) as u32).collect() };
        let pooled = grid.pooled(values, &vec![[noise; 3]; values.len()]);
        assert!(pooled.iter().enumerate().all(|(i, (number, _))| i == *number));
        pooled.into_iter().map(|(_, p)| p).collect()
    }

    /// Root mean square distance from the truth over texels that count, and the mean one.
    fn off(pooled: &[Pooled], truth: impl Fn(f64, f64) -> f64, counts: impl Fn(f64, f64) -> bool) -> [f64; 2] {
        let (mut n, mut sum, mut square) = (0.0, 0.0, 0.0);
        for (slot, p) in pooled.iter().enumerate() {
            let (x, y) = ((slot % SIDE) as f64, (slot / SIDE) as f64);
            if counts(x, y) {
                let off = f64::from(p.light[1]) - truth(x, y);
                (n, sum, square) = (n + 1.0, sum + off, square + off * off);
            }
        }
        [(square / n).sqrt(), sum / n]
    }

    #[test]
    fn smooth_light_loses_nearly_all_noise_up_to_the_border() {
        let truth = |x: f64, y: f64| 40.0 + 0.3 * x - 0.2 * y + 0.004 * (x - 20.0) * (y - 30.0);
        let pooled = pooled(&noisy(truth, 1), 1.0);
        let [all, bias] = off(&pooled, truth, |_, _| true);
        let [border, _] = off(&pooled, truth, |x, y| x.min(y) < 1.0 || x.max(y) > SIDE as f64 - 2.0);
        assert!(all < 0.14 && border < 0.3 && bias.abs() < 0.05, "{all} {border} {bias}");
    }

    #[test]
    fn texels_far_between_share_as_well() {
        let truth = |x: f64, y: f64| 40.0 + 0.3 * x - 0.2 * y;
        let values = noisy(truth, 4);
        let own = (0..(SIDE * SIDE) as u32).map(|i| if i % 5 == i / SIDE as u32 % 5 { i } else { NONE }).collect();
        let pooled = Grid { columns: SIDE, rows: SIDE, own }.pooled(&values, &vec![[1.0; 3]; values.len()]);
        assert!(pooled.len() > SIDE * SIDE / 6);
        let off =
            |(i, p): &(usize, Pooled)| (f64::from(p.light[1]) - truth((i % SIDE) as f64, (i / SIDE) as f64)).powi(2);
        let all = (pooled.iter().map(off).sum::<f64>() / pooled.len() as f64).sqrt();
        assert!(all < 0.35, "{all}");
    }

    #[test]
    fn a_contact_and_an_edge_stay_sharp() {
        // Twenty times as deep as the noise, a texel and a half wide; an edge of forty times the noise.
        let contact = |x: f64, _: f64| 50.0 - 20.0 * (-x / 1.5).exp();
        let edge = |x: f64, y: f64| if x + 0.3 * y < 30.0 { 60.0 } else { 20.0 };
        let [near, _] = off(&pooled(&noisy(contact, 2), 1.0), contact, |x, _| x < 4.0);
        let [far, _] = off(&pooled(&noisy(contact, 2), 1.0), contact, |x, _| x > 12.0);
        assert!(near < 1.1 && far < 0.14, "{near} {far}");
        let [beside, _] = off(&pooled(&noisy(edge, 3), 1.0), edge, |x, y| (x + 0.3 * y - 30.0).abs() < 2.0);
        let [away, _] = off(&pooled(&noisy(edge, 3), 1.0), edge, |x, y| (x + 0.3 * y - 30.0).abs() > 12.0);
        assert!(beside < 1.1 && away < 0.2, "{beside} {away}");
    }

    #[test]
    fn light_without_noise_is_kept_and_too_few_are_left_alone() {
        let values: Vec<Bands> = (0..SIDE * SIDE).map(|i| [unit(hash(i as u32)); 3]).collect();
        let kept = pooled(&values, 0.0);
        assert!(kept.iter().zip(&values).all(|(p, v)| p.light == *v && p.own == 1.0));
        let few = Grid { columns: 3, rows: 1, own: (0..3).collect() };
        assert!(few.pooled(&values[..3], &values[..3]).is_empty());
    }
}
