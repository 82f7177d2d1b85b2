//! Seams that cannot be seen: the texels along both sides of every continuous edge are moved, by as little as
//! possible, until bilinear look-ups from either side agree.
//!
//! With L the look-ups along the first sides, K along the second and D = L − K, the correction d minimises
//! ‖D (x + d)‖² + λ‖d‖²: (DᵀD + λ) d = −DᵀD x, solved by conjugate gradients for each band. After Iwanicki,
//! "Lighting technology of The Last of Us" (SIGGRAPH 2013). Only texels that a seam reads are unknowns.

use super::{Atlas, SharedEdge};
use glam::{DVec2, Vec2};
use radiosity_scene::Bands;

/// How firmly to fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamParams {
    /// λ: weight of staying with the computed values. A difference shrinks to about λ/(λ + 1) of itself; far smaller
    /// values only cost steps, at 1 seams are halved.
    pub stay: f64,
    /// Relative residual to reach, Euclidean norm.
    pub tolerance: f64,
    /// Most steps.
    pub steps: usize,
}

impl Default for SeamParams {
    fn default() -> Self {
        SeamParams { stay: 1e-3, tolerance: 1e-4, steps: 300 }
    }
}

/// What a fit did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SeamInfo {
    /// Places compared along the seams.
    pub samples: usize,
    /// Texels that could move.
    pub texels: usize,
    /// Conjugate gradient steps, the most of any band.
    pub steps: usize,
    /// Root mean square difference across the seams before, over all bands.
    pub before: f64,
    /// The same afterwards.
    pub after: f64,
}

/// Look-ups compared for each texel along a seam: two, so that no oscillation between texels goes unseen.
const SAMPLES_PER_TEXEL: f64 = 2.0;

/// Lets both sides of the `seams` agree on the pictures of all pages (row-major, as [`super::fill`] makes them).
///
/// The caller passes the edges on which light is continuous: smooth or coplanar ones. Edges inside one chart cost
/// nothing. Seams and pages that do not exist are skipped; values stay at least 0.
pub fn fit_seams(atlas: &Atlas, seams: &[SharedEdge], pictures: &mut [Vec<Bands>], params: &SeamParams) -> SeamInfo {
    // The first texel of each page in one row of all texels.
    let mut starts = vec![0_usize];
    for page in &atlas.pages {
        starts.push(starts[starts.len() - 1] + page[0] as usize * page[1] as usize);
    }
    let fits = pictures.len() == atlas.pages.len()
        && pictures.iter().enumerate().all(|(page, picture)| picture.len() == starts[page + 1] - starts[page]);
    if !fits {
        return SeamInfo::default();
    }

    // Rows of D: eight texels with their weights, the second side's negative.
    let mut rows: Vec<[(usize, f64); 8]> = Vec::new();
    for seam in seams {
        let Some([first, second]) = sides(atlas, seam) else { continue };
        if first == second {
            continue;
        }
        let length = first.length().max(second.length());
        let count = (SAMPLES_PER_TEXEL * length).ceil().clamp(1.0, 1e6) as usize;
        for i in 0..=count {
            let t = i as f64 / count as f64;
            let (a, b) = (first.look_up(t, &starts), second.look_up(t, &starts));
            rows.push(std::array::from_fn(|k| if k < 4 { a[k] } else { (b[k - 4].0, -b[k - 4].1) }));
        }
    }

    // Only what is read is unknown.
    let mut read: Vec<usize> = rows.iter().flatten().map(|&(texel, _)| texel).collect();
    read.sort_unstable();
    read.dedup();
    for (texel, _) in rows.iter_mut().flatten() {
        *texel = read.binary_search(texel).unwrap_or(0);
    }
    let mut info = SeamInfo { samples: rows.len(), texels: read.len(), ..SeamInfo::default() };
    if rows.is_empty() {
        return info;
    }
    let place = |texel: usize| {
        let page = starts.partition_point(|&start| start <= texel) - 1;
        (page, texel - starts[page])
    };
    let mut fit_band = |band: usize| {
        let value = |&texel: &usize| {
            let (page, at) = place(texel);
            f64::from(pictures[page][at][band])
        };
        let x: Vec<f64> = read.iter().map(value).collect();
        let (moved, steps) = fit(&rows, &x, params);
        info.steps = info.steps.max(steps);
        info.before += sum_of_squares(&rows, &x);
        let fitted: Vec<f64> = x.iter().zip(&moved).map(|(x, d)| (x + d).max(0.0)).collect();
        info.after += sum_of_squares(&rows, &fitted);
        for (&texel, value) in read.iter().zip(fitted) {
            let (page, at) = place(texel);
            pictures[page][at][band] = value as f32;
        }
    };
    (0..3).for_each(&mut fit_band);
    let mean = |sum: f64| (sum / (3 * rows.len()) as f64).sqrt();
    (info.before, info.after) = (mean(info.before), mean(info.after));
    info
}

/// One side of a seam in the texels of its page.
#[derive(Clone, Copy, PartialEq)]
struct Side {
    page: usize,
    size: [u32; 2],
    from: DVec2,
    to: DVec2,
}

impl Side {
    fn length(&self) -> f64 {
        self.from.distance(self.to)
    }

    /// The four texels of a bilinear look-up, clamped at the page's border, and their weights.
    fn look_up(&self, t: f64, starts: &[usize]) -> [(usize, f64); 4] {
        let most = DVec2::new(f64::from(self.size[0] - 1), f64::from(self.size[1] - 1));
        let p = self.from.lerp(self.to, t).clamp(DVec2::ZERO, most);
        let (low, share) = (p.floor(), p - p.floor());
        let high = (low + 1.0).min(most);
        let at = |x: f64, y: f64| starts[self.page] + y as usize * self.size[0] as usize + x as usize;
        [
            (at(low.x, low.y), (1.0 - share.x) * (1.0 - share.y)),
            (at(high.x, low.y), share.x * (1.0 - share.y)),
            (at(low.x, high.y), (1.0 - share.x) * share.y),
            (at(high.x, high.y), share.x * share.y),
        ]
    }
}

/// Both sides of a seam, running the same way.
fn sides(atlas: &Atlas, seam: &SharedEdge) -> Option<[Side; 2]> {
    let side = |which: usize| {
        let triangle = seam.triangles[which] as usize;
        let k = usize::from(seam.sides[which]);
        let corners = atlas.uv.get(triangle)?;
        let page = *atlas.triangle_page.get(triangle)? as usize;
        let size = *atlas.pages.get(page)?;
        let place = |uv: Vec2| uv.as_dvec2() * DVec2::new(f64::from(size[0]), f64::from(size[1])) - 0.5;
        let (from, to) = (place(*corners.get(k)?), place(corners[(k + 1) % 3]));
        let (from, to) = if which == 0 { (from, to) } else { (to, from) };
        Some(Side { page, size, from, to })
    };
    Some([side(0)?, side(1)?])
}

fn difference(row: &[(usize, f64); 8], x: &[f64]) -> f64 {
    row.iter().map(|&(texel, weight)| weight * x[texel]).sum()
}

fn sum_of_squares(rows: &[[(usize, f64); 8]], x: &[f64]) -> f64 {
    rows.iter().map(|row| difference(row, x).powi(2)).sum()
}

/// DᵀD x.
fn normal(rows: &[[(usize, f64); 8]], x: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; x.len()];
    for row in rows {
        let gap = difference(row, x);
        for &(texel, weight) in row {
            out[texel] += weight * gap;
        }
    }
    out
}

/// The correction d and the steps taken.
fn fit(rows: &[[(usize, f64); 8]], x: &[f64], params: &SeamParams) -> (Vec<f64>, usize) {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut d = vec![0.0; x.len()];
    let mut r: Vec<f64> = normal(rows, x).iter().map(|v| -v).collect();
    let mut p = r.clone();
    let mut rr = dot(&r, &r);
    // Differences of 1e-7 of the values are f32 rounding, which no step can cure.
    let goal = (params.tolerance.powi(2) * rr).max(1e-14 * dot(x, x));
    let mut steps = 0;
    while rr > goal && steps < params.steps {
        let mut ap = normal(rows, &p);
        for (a, p) in ap.iter_mut().zip(&p) {
            *a += params.stay * p;
        }
        let curvature = dot(&p, &ap);
        if curvature.is_nan() || curvature <= 0.0 {
            break;
        }
        let alpha = rr / curvature;
        for i in 0..d.len() {
            d[i] += alpha * p[i];
            r[i] -= alpha * ap[i];
        }
        let next = dot(&r, &r);
        for (p, r) in p.iter_mut().zip(&r) {
            *p = r + next / rr * *p;
        }
        rr = next;
        steps += 1;
    }
    (d, steps)
}
