//! How many texels each chart gets: many where light is rough, few where it is smooth.
//!
//! Where a texel differs from the mean of the two beside it by δ, linear interpolation from texels twice as far apart is
//! wrong by δ there. With f times as many texels per metre, n f² of them, the square of the error summed over a chart is
//! c/f^p: p is 1 across the edge of a shadow, 3 where a shadow has a soft edge, 4 where light is smooth. The least Σ n f² for
//! a given Σ c/f^p has f in proportion to (c/n)^(1/(2 + p)).

use super::{Atlas, Charts, Texel, UnwrapParams, look_up};
use glam::DVec2;
use radiosity_scene::{Bands, luminance};

/// The square of what is lost at a texel, over δ²: a step of height s has δ = s/2 on its two sides, and is wrong by s²/12 to
/// s²/6 of a texel, by its place between the centres.
pub const LOST: f64 = 0.25;

/// p: 1.8 in a furnished room under lamps, 1.4 in one with sun on leaves. Too little asks for more texels than are needed, too
/// much for one more round.
pub const GAIN: f64 = 1.5;

/// Up to how many times as many texels per metre a chart gets in all: what is still rough then is noise or a leak, which texels
/// do not cure.
const MOST_FINER: f64 = 16.0;

/// What the texels of a map show of what lies between them.
#[derive(Clone, Debug)]
pub struct Detail {
    /// By chart, squared error that is to be feared, (lx)² times texels.
    pub lost: Vec<f64>,
    /// By chart, share of the texels that are rough.
    share: Vec<f64>,
    /// By page, row-major: whether a look-up that reads this texel may miss something.
    rough: Vec<Vec<bool>>,
    /// Whether a texel lies inside a solid.
    hidden: Vec<Vec<bool>>,
}

/// What texels would be spent on.
#[derive(Clone, Debug)]
pub struct Allotment {
    /// By chart, how many times as many texels per metre it gets as were asked for.
    pub finer: Vec<f64>,
    /// Texels in all.
    pub texels: f64,
    /// Those of them that would have to be lit anew.
    pub rough: f64,
}

/// A texel that shows light, lies inside a solid, or is no texel of the chart.
#[derive(Clone, Copy)]
enum Slot {
    Lit(f64),
    Hidden,
    Empty,
}

impl Atlas {
    /// What `values` at `texels` (by page, one for each texel; not finite inside solids) say. A texel is rough if it
    /// differs from the mean of its neighbours by more than `tolerance`, lx, or lies beside a solid or the chart's border.
    pub fn detail(&self, texels: &[Vec<Texel>], values: &[Vec<Bands>], tolerance: f64) -> Detail {
        let area = |page: &[u32; 2]| page[0] as usize * page[1] as usize;
        let mut slots: Vec<Vec<Slot>> = self.pages.iter().map(|page| vec![Slot::Empty; area(page)]).collect();
        for (page, (texels, values)) in texels.iter().zip(values).enumerate() {
            for (texel, value) in texels.iter().zip(values) {
                let e = f64::from(luminance(*value));
                let at = usize::from(texel.y) * self.pages[page][0] as usize + usize::from(texel.x);
                slots[page][at] = if e.is_finite() { Slot::Lit(e) } else { Slot::Hidden };
            }
        }
        let mut rough: Vec<Vec<bool>> = self.pages.iter().map(|page| vec![false; area(page)]).collect();
        let (lost, share) = self
            .charts
            .iter()
            .map(|chart| {
                let page = chart.at.page as usize;
                let at = |x: u32, y: u32| chart.slot(x, y, self.pages[page][0]);
                let (slots, rough) = (&slots[page], &mut rough[page]);
                let [columns, rows] = chart.size;
                let mut lost = 0.0;
                let mut line = |count: u32, at: &dyn Fn(u32) -> usize| {
                    for i in 0..count {
                        let Slot::Lit(own) = slots[at(i)] else { continue };
                        let side = |i: Option<u32>| i.filter(|i| *i < count).map_or(Slot::Empty, |i| slots[at(i)]);
                        // Beside a solid, and where there are but two texels, there is no second difference.
                        let (delta, at_end) = match (side(i.checked_sub(1)), side(Some(i + 1))) {
                            (Slot::Lit(a), Slot::Lit(b)) => (own - 0.5 * (a + b), false),
                            (Slot::Lit(a), Slot::Hidden) | (Slot::Hidden, Slot::Lit(a)) => (own - a, true),
                            (Slot::Lit(a), Slot::Empty) | (Slot::Empty, Slot::Lit(a)) if count == 2 => (own - a, false),
                            // A texel on a ragged border stands for a point beside its centre.
                            _ => (0.0, true),
                        };
                        let is_rough = delta.abs() > tolerance;
                        if is_rough {
                            lost += LOST * delta * delta;
                        }
                        if is_rough || at_end {
                            (i.saturating_sub(1)..(i + 2).min(count)).for_each(|i| rough[at(i)] = true);
                        }
                    }
                };
                (0..rows).for_each(|y| line(columns, &|x| at(x, y)));
                (0..columns).for_each(|x| line(rows, &|y| at(x, y)));
                let own = (0..rows).flat_map(|y| (0..columns).map(move |x| at(x, y)));
                let (mut all, mut few) = (0.0, 0.0);
                for slot in own.filter(|slot| !matches!(slots[*slot], Slot::Empty)) {
                    all += 1.0;
                    few += f64::from(u8::from(rough[slot]));
                }
                (lost, few / f64::max(all, 1.0))
            })
            .unzip();
        let hidden = slots.iter().map(|page| page.iter().map(|slot| matches!(slot, Slot::Hidden)).collect()).collect();
        Detail { lost, share, rough, hidden }
    }

    /// What an `older` map of the same charts, its `pictures` by page, tells of a texel: the very same texel where the chart
    /// has as many as before, a look-up where the older map was smooth. Not a number inside solids.
    pub fn told(&self, texel: &Texel, older: &Atlas, pictures: &[Vec<Bands>], detail: &Detail) -> Option<Bands> {
        let chart = self.triangle_chart[texel.triangle as usize] as usize;
        let (own, old) = (&self.charts[chart], &older.charts[chart]);
        let page = old.at.page as usize;
        let size = older.pages[page];
        let value = |slot: usize| if detail.hidden[page][slot] { [f32::NAN; 3] } else { pictures[page][slot] };
        if own.size == old.size {
            let (x, y) = (u32::from(texel.x) - own.at.x, u32::from(texel.y) - own.at.y);
            let (x, y) = if own.at.rotated { (y, x) } else { (x, y) };
            return Some(value(old.slot(x, y, size[0])));
        }
        let [a, b, c] = older.uv[texel.triangle as usize];
        let uv = a + texel.uv.x * (b - a) + texel.uv.y * (c - a);
        let low = (uv.as_dvec2() * DVec2::new(size[0].into(), size[1].into()) - 0.5).max(DVec2::ZERO).as_uvec2();
        let across = [low.x, (low.x + 1).min(size[0] - 1)];
        let around = [low.y, (low.y + 1).min(size[1] - 1)].map(|y| across.map(|x| (y * size[0] + x) as usize));
        let mut around = around.into_iter().flatten();
        if around.clone().any(|slot| detail.rough[page][slot]) {
            return None;
        }
        let hidden = around.clone().filter(|slot| detail.hidden[page][*slot]).count();
        match hidden {
            0 => Some(look_up(size, &pictures[page], uv)),
            4 => around.next().map(value),
            _ => None,
        }
    }
}

impl Charts {
    /// Finer charts, so that a part `goal` is left of what they have lost; nothing where pages are too small.
    pub fn allot(&self, detail: &Detail, goal: f64, params: &UnwrapParams) -> Option<Allotment> {
        let all = 0..self.len();
        let density = |k: usize| self.finer[k] * params.texels_per_metre;
        let room = f64::from(params.max_page - 1);
        let most_finer: Vec<f64> = all
            .clone()
            .map(|k| {
                let wide = density(k) * self.narrow[k] * self.charts[k].extent.max_element();
                (room / wide).min(MOST_FINER / self.finer[k]).max(1.0)
            })
            .collect();
        // What is lost by area, for the texels of charts are not of one size; those of smaller places count by as much more.
        let lost: Vec<f64> = all.clone().map(|k| detail.lost[k] / density(k).powi(2)).collect();
        let count: Vec<f64> = all.clone().map(|k| self.count(k, params.texels_per_metre)).collect();
        let total: f64 = lost.iter().sum();
        let wanting = |k: usize| (lost[k] / count[k]).powf(1.0 / (2.0 + GAIN));
        let largest = all.clone().map(wanting).fold(0.0, f64::max);
        if largest <= 0.0 {
            return None;
        }
        let finer = |scale: f64, k: usize| (scale * wanting(k)).clamp(1.0, most_finer[k]);
        let left = |scale: f64| all.clone().map(|k| lost[k] / finer(scale, k).powf(GAIN)).sum::<f64>();
        // From where the most wanting chart begins to gain; 60 halvings of the six decades above.
        let (mut low, mut high) = (1.0 / largest, 1e6 / largest);
        for _ in 0..60 {
            let middle = f64::sqrt(low * high);
            if left(middle) > goal * total { low = middle } else { high = middle }
        }
        let (mut texels, mut rough) = (0.0, 0.0);
        for k in all.clone() {
            let f = finer(high, k);
            texels += count[k] * f * f;
            rough += if f > 1.0 { detail.share[k] * count[k] * f * f } else { 0.0 };
        }
        let reached = left(high) <= goal * total;
        reached.then(|| Allotment { finer: all.map(|k| self.finer[k] * finer(high, k)).collect(), texels, rough })
    }
}
