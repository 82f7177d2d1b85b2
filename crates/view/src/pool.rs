//! Pooling: places of a plane share the light that rays found at them with those around, as far as light is smooth. Texels of a
//! chart do, and cells of a wall.
//!
//! Each place is estimated by a plane through the light of those within a radius. How far to go is found by leaving places
//! out: the plane through the others predicts one to (its noise)² + (what the plane has wrong)², and the radius where this is
//! least, on average over the places around, is taken (cross-validation; Stone 1974). Where no radius predicts places as well as
//! their own noise would have it, something is smaller than they are far apart, a contact or a shadow's edge: there a place keeps
//! its own light in the part by which the prediction is worse (a Wiener filter; Lee 1980).
//!
//! Quadrics beside planes, of radii 4 to 16, predict better where light is bent, and points are no nearer to the truth for it: 2,000 in the
//! Cornell box at 4, 2 and 1 % are 1.04, 0.77 and 0.53 % off instead of 1.10, 0.79 and 0.54, a hundred thousand 0.72, 0.68 and 0.41 instead of 0.69, 0.66 and
//! 0.42, and 1.73 % either way in a furnished office. What is left lies at edges and contacts, where none of them reaches far. Left out.

use glam::DVec2;
use radiosity_scene::{Bands, luminance};

/// Radii that are tried, in slots. Beyond the last there is nothing to gain: of a thousand places the noise is a thirtieth.
const RADII: [usize; 5] = [1, 2, 4, 8, 16];

/// Radius over which predictions of a place are compared: 81 places tell which of two planes a fifth of the noise apart is better.
const COMPARED: usize = 4;

/// Radius over which chosen radii are evened out: at 0 neighbours differ by the choice alone, and much more carries the radius of
/// smooth light into contacts.
const EVENED: usize = 2;

/// Fewest places that a plane is laid through.
const FEWEST: f64 = 4.0;

/// A place that has more of a plane to itself than this, at the end of a row, is not predicted by the others: what it is off is
/// divided by what is left.
const ALONE: f64 = 0.9;

/// Variance of coordinates, slots², that is added along each axis: places in a row say nothing of the slope across.
const RIDGE: f64 = 1e-3;

/// Slots for each place at most, so that a few far apart take no memory; and as many as are always there.
const MOST_SLOTS: usize = 8;
const FEW_SLOTS: usize = 4096;

/// What rays found at a place of a plane.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Where it is, such that about one place lies in each square of side 1, its slot.
    pub at: DVec2,
    /// Light, lx per band.
    pub light: Bands,
    /// Standard error of its luminance, lx; negative where it is told by two halves of the rays and the second found more.
    pub noise: f32,
    /// In proportion to its rays.
    pub weight: f32,
}

/// What came of a place.
#[derive(Clone, Copy, Debug)]
pub struct Pooled {
    /// Light, lx per band.
    pub light: Bands,
    /// How much of it is the place's own beyond its share in the pool: 0 where light is smooth, 1 where the others know nothing of
    /// it.
    pub own: f32,
    /// What is left of the noise, lx, where those that were given have signs: it is shared as light is.
    pub noise: f32,
    /// How large that is to be expected by the noise of the places around, whatever its signs: its standard error, lx.
    pub spread: f32,
}

impl Pooled {
    /// A place that shares with no other.
    pub fn alone(light: Bands, noise: f32) -> Pooled {
        Pooled { light, own: 1.0, noise, spread: noise.abs() }
    }
}

/// Pooled light of all samples of a plane, in their order. Noise of one must not be that of another: a part that they
/// share is taken for light. `walls` stand on the plane, from one point to another: no square of places that share goes over one.
pub fn pooled(samples: &[Sample], walls: &[[DVec2; 2]]) -> Vec<Pooled> {
    let alone = |sample: &Sample| Pooled::alone(sample.light, sample.noise);
    if (samples.len() as f64) < FEWEST {
        return samples.iter().map(alone).collect();
    }
    let grid = Grid::new(samples, walls);
    grid.pooled().into_iter().zip(samples).map(|(pooled, sample)| pooled.unwrap_or(alone(sample))).collect()
}

/// Samples in the slots of a rectangle.
struct Grid<'s> {
    samples: &'s [Sample],
    columns: usize,
    rows: usize,
    /// Where each sample is, from the middle.
    at: Vec<DVec2>,
    /// Column and row of its slot.
    slot: Vec<[usize; 2]>,
    /// Those of slots that walls go through, some more than once.
    walls: Vec<[usize; 2]>,
}

/// Light of three bands, and its noise.
type Values = [f64; 4];

/// A plane through light, at the place that it was laid around.
#[derive(Clone, Copy)]
struct Fit {
    values: Values,
    /// How much of it is the place's own.
    share: f64,
}

impl Grid<'_> {
    fn new<'s>(samples: &'s [Sample], walls: &[[DVec2; 2]]) -> Grid<'s> {
        let bounds = |(low, high): (DVec2, DVec2), sample: &Sample| (low.min(sample.at), high.max(sample.at));
        let (low, high) = samples.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), bounds);
        let mut scale = 1.0;
        let size = |scale: f64| ((high - low) * scale).to_array().map(|x| (x.round() as usize).saturating_add(1));
        let most = FEW_SLOTS.max(MOST_SLOTS * samples.len());
        while size(scale).into_iter().fold(1usize, usize::saturating_mul) > most {
            scale *= 0.5;
        }
        let [columns, rows] = size(scale);
        let middle = 0.5 * (low + high);
        // Twice in each slot on their way, and those beside the grid not at all.
        let slots_of = |[from, to]: &[DVec2; 2]| {
            let [from, to] = [from, to].map(|p| (*p - low) * scale);
            let steps = (2.0 * from.distance(to)).ceil().clamp(1.0, 2.0 * (columns + rows) as f64) as usize;
            (0..=steps).map(move |k| (from + k as f64 / steps as f64 * (to - from)).round())
        };
        let is_inside = |p: &DVec2| p.x >= 0.0 && p.y >= 0.0 && (p.x as usize) < columns && (p.y as usize) < rows;
        let walls = walls.iter().flat_map(slots_of).filter(is_inside).map(|p| p.to_array().map(|x| x as usize));
        Grid {
            samples,
            columns,
            rows,
            at: samples.iter().map(|sample| (sample.at - middle) * scale).collect(),
            slot: samples.iter().map(|s| ((s.at - low) * scale).to_array().map(|x| x.round() as usize)).collect(),
            walls: walls.collect(),
        }
    }

    /// Those that have others to share with, and their light.
    fn pooled(&self) -> Vec<Option<Pooled>> {
        let moments = Sums::new(self, |i| {
            let (DVec2 { x, y }, w) = (self.at[i], self.weight(i));
            let [r, g, b, n] = self.values(i).map(|z| w * z);
            let place = [w, w * x, w * y, w * x * x, w * x * y, w * y * y];
            let values = [r, r * x, r * y, g, g * x, g * y, b, b * x, b * y, n, n * x, n * y];
            std::array::from_fn(|k| if k < 6 { place[k] } else { values[k - 6] })
        });
        let count = Sums::new(self, |_| [1.0]);
        let walls = Sums::of(self, self.walls.iter().map(|slot| (*slot, [1.0])));
        let plane = |i: usize, radius: usize| {
            let ([count], [walls]) = (count.within(self, i, radius), walls.within(self, i, radius));
            (count >= FEWEST && walls == 0.0)
                .then(|| plane(&moments.within(self, i, radius), self.at[i], self.weight(i)))
                .flatten()
        };

        // The radius that predicts best, by its number, and how far its planes are off.
        let reach = self.columns.max(self.rows) - 1;
        let mut best = vec![(NOWHERE, f64::INFINITY); self.samples.len()];
        for (k, radius) in RADII.into_iter().enumerate() {
            let planes: Vec<Option<Fit>> = (0..best.len()).map(|i| plane(i, radius)).collect();
            let off = Sums::new(self, |i| planes[i].map_or([0.0; 2], |fit| self.off(i, fit)));
            for (i, best) in best.iter_mut().enumerate() {
                let [weight, sum] = off.within(self, i, COMPARED);
                if planes[i].is_some() && weight > 0.0 && sum / weight < best.1 {
                    *best = (k, sum / weight);
                }
            }
            if radius >= reach {
                break;
            }
        }

        // What has no noise says nothing of that of the others.
        let variance = Sums::new(self, |i| {
            let (w, variance) = (self.weight(i), f64::from(self.samples[i].noise).powi(2));
            if variance > 0.0 { [1.0, w, w * variance] } else { [0.0; 3] }
        });
        // Places without a plane have no say in it.
        let evened = Sums::new(self, |i| if best[i].0 == NOWHERE { [0.0; 2] } else { [1.0, best[i].0 as f64] });
        let light = |i: usize| {
            let (chosen, missed) = best[i];
            if chosen == NOWHERE {
                return None;
            }
            let [count, sum] = evened.within(self, i, EVENED);
            let at = sum / count;
            let near = |k: f64| plane(i, RADII[k as usize]).or_else(|| plane(i, RADII[chosen]));
            let (low, high, share) = (near(at.floor())?, near(at.ceil())?, at.fract());
            let [count, weight, sum] = variance.within(self, i, COMPARED);
            // Of so many places a variance is known to √(2/n) of itself: less than twice that beyond the noise is chance.
            let noise = if count > 0.5 { sum / weight * (1.0 + (8.0 / count).sqrt()) } else { 0.0 };
            let kept = if missed > 0.0 { (1.0 - noise / missed).clamp(0.0, 1.0) } else { 0.0 };
            let between = |low: f64, high: f64| low + share * (high - low);
            let own = self.values(i);
            let [r, g, b, noise]: Values = std::array::from_fn(|k| {
                let shared = between(low.values[k], high.values[k]);
                shared + kept * (own[k] - shared)
            });
            let light = [r, g, b].map(|e| e.max(0.0) as f32);
            // The variance of a plane at one of its places is the share h that this has of it, times that of the place alone (the
            // leverage of least squares); beside it the place keeps a part of its own, which h counts already.
            let h = between(low.share, high.share);
            let part = kept * kept + (1.0 - kept * kept) * h;
            let spread = (sum.max(0.0) / count.max(1.0) / self.weight(i) * part).sqrt();
            Some(Pooled { light, own: kept as f32, noise: noise as f32, spread: spread as f32 })
        };
        (0..self.samples.len()).map(light).collect()
    }

    /// The weight of a sample, and with it the squared distance from a plane around it that is laid without it.
    fn off(&self, i: usize, fit: Fit) -> [f64; 2] {
        let (own, w) = (f64::from(luminance(self.samples[i].light)), self.weight(i));
        let [r, g, b, _] = fit.values.map(|e| e as f32);
        let off = own - f64::from(luminance([r, g, b]));
        [w, w * (off / (1.0 - fit.share)).powi(2)]
    }

    fn values(&self, i: usize) -> Values {
        let Sample { light: [r, g, b], noise, .. } = self.samples[i];
        [r, g, b, noise].map(f64::from)
    }

    fn weight(&self, i: usize) -> f64 {
        f64::from(self.samples[i].weight)
    }
}

/// The number of a radius where none knows anything.
const NOWHERE: usize = RADII.len();

/// The plane by least squares through places with these sums, at one of them that weighs `own`.
fn plane(sums: &[f64; 18], at: DVec2, own: f64) -> Option<Fit> {
    let [n, x, y, xx, xy, yy, of_values @ ..] = *sums;
    let middle = DVec2::new(x, y) / n;
    let (xx, xy, yy) =
        (xx / n - middle.x * middle.x + RIDGE, xy / n - middle.x * middle.y, yy / n - middle.y * middle.y + RIDGE);
    let away = at - middle;
    let way = DVec2::new(yy * away.x - xy * away.y, xx * away.y - xy * away.x) / (xx * yy - xy * xy);
    let share = own * (1.0 + way.dot(away)) / n;
    let values = std::array::from_fn(|k| {
        let [z, zx, zy] = [0, 1, 2].map(|m| of_values[3 * k + m] / n);
        z + way.dot(DVec2::new(zx, zy) - z * middle)
    });
    (share < ALONE).then_some(Fit { values, share })
}

/// Sums over rectangles of a grid (summed-area table; Crow 1984).
struct Sums<const N: usize> {
    /// Of all above and left of a corner, `columns + 1` to a row.
    table: Vec<[f64; N]>,
}

impl<const N: usize> Sums<N> {
    /// Of what each sample has.
    fn new(grid: &Grid, of: impl Fn(usize) -> [f64; N]) -> Sums<N> {
        Sums::of(grid, grid.slot.iter().enumerate().map(|(i, slot)| (*slot, of(i))))
    }

    /// Of what is in slots.
    fn of(grid: &Grid, items: impl Iterator<Item = ([usize; 2], [f64; N])>) -> Sums<N> {
        let stride = grid.columns + 1;
        let mut table = vec![[0.0; N]; stride * (grid.rows + 1)];
        for ([x, y], own) in items {
            let sum = &mut table[(y + 1) * stride + x + 1];
            *sum = std::array::from_fn(|k| sum[k] + own[k]);
        }
        for y in 0..grid.rows {
            let mut row = [0.0; N];
            for x in 0..grid.columns {
                let own = table[(y + 1) * stride + x + 1];
                row = std::array::from_fn(|k| row[k] + own[k]);
                table[(y + 1) * stride + x + 1] = std::array::from_fn(|k| table[y * stride + x + 1][k] + row[k]);
            }
        }
        Sums { table }
    }

    /// Over the square of a radius around a sample's slot.
    fn within(&self, grid: &Grid, i: usize, radius: usize) -> [f64; N] {
        let ([x, y], stride) = (grid.slot[i], grid.columns + 1);
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

    /// One at each slot.
    fn samples(values: &[Bands], noise: f32) -> Vec<Sample> {
        let at = |slot: usize| DVec2::new((slot % SIDE) as f64, (slot / SIDE) as f64);
        values.iter().enumerate().map(|(i, v)| Sample { at: at(i), light: *v, noise, weight: 1.0 }).collect()
    }

    fn pooled(values: &[Bands], noise: f32) -> Vec<Pooled> {
        super::pooled(&samples(values, noise), &[])
    }

    /// Root mean square distance from the truth over places that count, and the mean one.
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

    /// What is told to be left of the noise is what is left: where light is smooth, and where each keeps its own.
    #[test]
    fn the_noise_that_is_left_is_as_told() {
        let smooth = |x: f64, y: f64| 40.0 + 0.3 * x - 0.2 * y;
        let rough = |x: f64, y: f64| 40.0 + 30.0 * unit(hash(x as u32 ^ hash(y as u32))) as f64;
        let told = |pooled: &[Pooled]| {
            let square = |p: &Pooled| f64::from(p.spread).powi(2);
            (pooled.iter().map(square).sum::<f64>() / pooled.len() as f64).sqrt()
        };
        for seed in 1..4 {
            let of = pooled(&noisy(smooth, seed), 1.0);
            let ([off, _], told) = (off(&of, smooth, |_, _| true), told(&of));
            assert!(told > 0.7 * off && told < 1.6 * off, "{told} {off}");
        }
        let of = pooled(&noisy(rough, 1), 1.0);
        let ([off, _], told) = (off(&of, rough, |_, _| true), told(&of));
        assert!((told / off - 1.0).abs() < 0.1, "{told} {off}");
    }

    #[test]
    fn places_far_between_share_as_well() {
        let truth = |at: DVec2| 40.0 + 0.3 * at.x - 0.2 * at.y;
        let values = noisy(|x, y| truth(DVec2::new(x, y)), 4);
        let all = samples(&values, 1.0);
        let some: Vec<Sample> = (0..all.len()).filter(|i| i % 5 == i / SIDE % 5).map(|i| all[i]).collect();
        assert!(some.len() > SIDE * SIDE / 6);
        let off = |(p, s): (Pooled, &Sample)| (f64::from(p.light[1]) - truth(s.at)).powi(2);
        let all = (super::pooled(&some, &[]).into_iter().zip(&some).map(off).sum::<f64>() / some.len() as f64).sqrt();
        assert!(all < 0.35, "{all}");
    }

    /// Places off any grid, of which every other has four times the rays: each counts by these.
    #[test]
    fn places_anywhere_count_by_their_rays() {
        let truth = |at: DVec2| 40.0 + 0.3 * at.x - 0.2 * at.y;
        let noise = noisy(|_, _| 0.0, 5);
        let draw = |i: usize, k: u32| SIDE as f64 * f64::from(unit(hash(hash(i as u32) ^ k)));
        let off = |weigh: bool| {
            let sample = |i: usize| {
                let (at, rays) = (DVec2::new(draw(i, 1), draw(i, 2)), if i.is_multiple_of(2) { 4.0 } else { 1.0f32 });
                let light = [truth(at) as f32 + noise[i][0] / rays.sqrt(); 3];
                Sample { at, light, noise: 1.0 / rays.sqrt(), weight: if weigh { rays } else { 1.0 } }
            };
            let samples: Vec<Sample> = (0..SIDE * SIDE).map(sample).collect();
            let off = |(p, s): (Pooled, &Sample)| (f64::from(p.light[1]) - truth(s.at)).powi(2);
            (super::pooled(&samples, &[]).into_iter().zip(&samples).map(off).sum::<f64>() / samples.len() as f64).sqrt()
        };
        let [weighed, alike] = [true, false].map(off);
        assert!(weighed < 0.1 && weighed < 0.9 * alike, "{weighed} {alike}");
    }

    /// A wall without thickness between a bright room and a dark one, with a door: what is behind it has nothing of the bright
    /// noise or light, and only what is beside it or opposite to the door stays as it is.
    #[test]
    fn nothing_is_shared_through_walls() {
        let middle = SIDE as f64 / 2.0 - 0.5;
        let is_bright = |x: f64| x < middle;
        let noise = noisy(|_, _| 0.0, 7);
        let mut samples = samples(&noise, 0.0);
        for sample in &mut samples {
            let (light, noise) = if is_bright(sample.at.x) { (1000.0, 100.0) } else { (1.0, 0.1) };
            *sample = Sample { light: sample.light.map(|e| light + noise * e), noise, ..*sample };
        }
        let wall = [DVec2::new(middle, 12.0), DVec2::new(middle, SIDE as f64)];
        let (mut square, mut count) = (0.0, 0.0);
        for (p, s) in super::pooled(&samples, &[wall]).iter().zip(&samples) {
            if !is_bright(s.at.x) && s.at.y > 13.0 {
                assert!((p.light[0] - 1.0).abs() < 1.0, "{} at {}", p.light[0], s.at);
                (square, count) = (square + f64::from(p.light[0] - 1.0).powi(2), count + 1.0);
            }
        }
        let off: f64 = (square / count).sqrt();
        assert!(off < 0.08, "{off}");
    }

    /// Two clusters a million slots apart take as little memory as beside each other.
    #[test]
    fn far_apart_is_not_large() {
        let mut samples = samples(&noisy(|_, _| 40.0, 6), 1.0);
        samples.iter_mut().skip(SIDE * SIDE / 2).for_each(|sample| sample.at += DVec2::splat(1e6));
        let grid = Grid::new(&samples, &[]);
        assert!(grid.columns * grid.rows <= MOST_SLOTS * samples.len());
        assert!(super::pooled(&samples, &[]).iter().all(|p| p.light[0].is_finite()));
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
        let few = super::pooled(&samples(&values[..3], 1.0), &[]);
        assert!(few.iter().zip(&values).all(|(p, v)| p.light == *v && p.own == 1.0));
    }
}
