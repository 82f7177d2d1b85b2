//! More points for texels that an edge of a shadow runs through.
//!
//! One point for each texel makes stairs of shadow edges and dashes of thin shadows. The best constant for a texel is
//! the mean over its square; where light is smooth its centre is as good, so only texels that differ from a neighbour
//! get more points: Hammersley's, so that an edge along an axis meets as many steps as points.

use super::texels::{drawn_in, nearest};
use super::{Atlas, Placed, Texel};
use glam::{DVec2, Vec2};
use radiosity_scene::{Bands, luminance};

/// Differences below this share of the page's mean are left alone: dark corners full of noise would cost the most.
const UNSEEN: f64 = 0.01;

/// What is known of a texel.
#[derive(Clone, Copy, Default)]
struct Light {
    sum: f64,
    finite: u32,
    points: u32,
    is_doubtful: bool,
}

impl Light {
    fn add(&mut self, e: f64) {
        self.points += 1;
        if e.is_finite() {
            self.sum += e;
            self.finite += 1;
        }
    }

    /// Not a number where all is buried.
    fn mean(&self) -> f64 {
        self.sum / f64::from(self.finite)
    }
}

impl Atlas {
    /// Points to evaluate besides `texels`, up to `points` (at most 64) in the square around the centre of each texel
    /// whose luminance differs from that of one of its eight neighbours on the chart by more than the share
    /// `contrast` of the brighter one, or is `doubtful`. `values[i]` and `doubtful[i]` belong to `texels[i]`; a buried place, whose
    /// value is not finite, differs from every other. [`super::fill`] takes the mean of all points of a texel.
    ///
    /// To be called again with all points so far, until nothing comes back: a thin shadow that one centre met is
    /// followed from texel to texel, where it ran between the centres. No texel gets points twice.
    pub fn finer(
        &self,
        page: usize,
        (texels, values, doubtful): (&[Texel], &[Bands], &[bool]),
        contrast: f64,
        points: u32,
    ) -> Vec<Texel> {
        let Some(&[width, height]) = self.pages.get(page) else { return Vec::new() };
        let (width, height) = (width as usize, height as usize);
        let mut light = vec![Light::default(); width * height];
        for ((texel, value), is_doubtful) in texels.iter().zip(values).zip(doubtful) {
            let (x, y) = (usize::from(texel.x), usize::from(texel.y));
            if x < width && y < height {
                light[y * width + x].add(f64::from(luminance(*value)));
                light[y * width + x].is_doubtful |= is_doubtful;
            }
        }
        let (sum, count) =
            light.iter().map(Light::mean).filter(|e| e.is_finite()).fold((0.0, 0), |(sum, n), e| (sum + e, n + 1));
        let least = UNSEEN * sum / f64::from(count.max(1));
        let differ = |a: f64, b: f64| match (a.is_finite(), b.is_finite()) {
            (true, true) => (a - b).abs() > (contrast * a.max(b)).max(least),
            (a, b) => a != b,
        };

        let mut out = Vec::new();
        for chart in self.charts.iter().filter(|chart| chart.at.page as usize == page) {
            let [columns, rows] = chart.size.map(|side| side as usize);
            let at = |x: usize, y: usize| {
                let (x, y) = if chart.at.rotated { (y, x) } else { (x, y) };
                light[(chart.at.y as usize + y) * width + chart.at.x as usize + x]
            };
            let mixed: Vec<bool> = (0..columns * rows)
                .map(|slot| {
                    let (x, y) = (slot % columns, slot / columns);
                    let own = at(x, y);
                    if own.points != 1 {
                        return false;
                    }
                    let around = (y.saturating_sub(1)..=(y + 1).min(rows - 1))
                        .flat_map(|y| (x.saturating_sub(1)..=(x + 1).min(columns - 1)).map(move |x| (x, y)));
                    let mut others = around.map(|(x, y)| at(x, y)).filter(|other| other.points > 0);
                    own.is_doubtful || others.any(|other| differ(own.mean(), other.mean()))
                })
                .collect();
            if mixed.contains(&true) {
                chart.finer(&mixed, points.clamp(1, 64), &mut out);
            }
        }
        out
    }
}

impl Placed {
    /// Appends the points of the `mixed` slots that lie on the chart.
    fn finer(&self, mixed: &[bool], points: u32, out: &mut Vec<Texel>) {
        let [width, height] = self.size.map(|side| side as usize);
        // Along a collapsed axis the only row stands for all of the width.
        let square = |axis: usize| self.collapsed[axis].unwrap_or(1.0);
        let low = |axis: usize, i: usize| if self.collapsed[axis].is_some() { 0.0 } else { i as f64 - 0.5 };
        // The inverses of 0..2ᵐ are the multiples of 2⁻ᵐ: half of that centres them.
        let half = 0.5 / f64::from(points.next_power_of_two());
        let mut taken = vec![0_u64; mixed.len()];
        for (triangle, corners) in self.local.iter().enumerate() {
            let (least, most) =
                (corners[0].min(corners[1]).min(corners[2]), corners[0].max(corners[1]).max(corners[2]));
            let range = |axis: usize, least: f64, most: f64, count: usize| match self.collapsed[axis] {
                Some(_) => 0..1,
                None => {
                    let clamp = |x: f64| x.clamp(0.0, count as f64) as usize;
                    clamp((least - 0.5).ceil())..clamp((most + 0.5).floor() + 1.0)
                }
            };
            for y in range(1, least.y, most.y, height) {
                for x in range(0, least.x, most.x, width) {
                    let slot = y * width + x;
                    if !mixed[slot] {
                        continue;
                    }
                    for k in (0..points).filter(|k| taken[slot] >> k & 1 == 0).collect::<Vec<_>>() {
                        let across = (f64::from(k) + 0.5) / f64::from(points);
                        let down = f64::from(k.reverse_bits()) / 2_f64.powi(32) + half;
                        let p = DVec2::new(low(0, x) + across * square(0), low(1, y) + down * square(1));
                        let (distance, weights) = nearest(corners, p);
                        if distance > 0.0 {
                            continue;
                        }
                        taken[slot] |= 1 << k;
                        let weights = drawn_in(corners, weights);
                        let (x, y) = (x as u32, y as u32);
                        let (x, y) = if self.at.rotated { (y, x) } else { (x, y) };
                        out.push(Texel {
                            x: (self.at.x + x) as u16,
                            y: (self.at.y + y) as u16,
                            triangle: self.triangles[triangle],
                            uv: Vec2::new(weights[1] as f32, weights[2] as f32),
                        });
                    }
                }
            }
        }
    }
}
