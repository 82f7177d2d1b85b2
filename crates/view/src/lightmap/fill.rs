//! A page's picture from its texels; the rest continues its surroundings (push–pull: averages of the known texels are
//! pushed up a pyramid and pulled back down where nothing is known), so that mip-maps and wide filters stay clean.

use super::Texel;
use glam::Vec2;
use radiosity_scene::Bands;

/// A row-major picture of `page` = width and height with `values[i]` at `texels[i]`, the mean where a texel is named
/// more than once, and nothing where it is less: light never is.
///
/// Texels outside the page and texels without a finite value are skipped; a page without any value is black.
pub fn fill(page: [u32; 2], texels: &[Texel], values: &[Bands]) -> Vec<Bands> {
    let [width, height] = page.map(|side| side as usize);
    let mut sums = vec![([0_f64; 3], 0_u32); width * height];
    for (texel, value) in texels.iter().zip(values) {
        let (x, y) = (usize::from(texel.x), usize::from(texel.y));
        if x < width && y < height && value.iter().all(|v| v.is_finite()) {
            let (sum, count) = &mut sums[y * width + x];
            *sum = std::array::from_fn(|band| sum[band] + f64::from(value[band]));
            *count += 1;
        }
    }
    let mean = |(sum, count): ([f64; 3], u32)| (count > 0).then(|| sum.map(|s| (s / f64::from(count)).max(0.0) as f32));

    // A chart continues into the texels around it: rounded texture coordinates give those a weight of a millionth or so,
    // and the mean of their surroundings may be a bright room's.
    let known: Vec<_> = sums.into_iter().map(mean).collect();
    let known = (0..known.len()).map(|i| known[i].or_else(|| beside(&known, width, i))).collect();
    let mut pyramid = vec![Level { width, height, known }];
    while let Some(last) = pyramid.last().filter(|level| level.width > 1 || level.height > 1) {
        let coarser = last.halved();
        pyramid.push(coarser);
    }
    while let Some(coarse) = pyramid.pop() {
        let Some(fine) = pyramid.last_mut() else {
            return coarse.known.into_iter().map(Option::unwrap_or_default).collect();
        };
        let width = fine.width;
        for (index, slot) in fine.known.iter_mut().enumerate() {
            if slot.is_none() {
                *slot = coarse.known[index / width / 2 * coarse.width + index % width / 2];
            }
        }
    }
    Vec::new()
}

/// The mean of the known ones among the eight around one.
fn beside(known: &[Option<Bands>], width: usize, index: usize) -> Option<Bands> {
    let (x, y, height) = (index % width, index / width, known.len() / width);
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for y in y.saturating_sub(1)..(y + 2).min(height) {
        for value in known[y * width..][x.saturating_sub(1)..(x + 2).min(width)].iter().flatten() {
            sum = std::array::from_fn(|band| sum[band] + value[band]);
            count += 1.0;
        }
    }
    (count > 0.0).then(|| sum.map(|s: f32| s / count))
}

struct Level {
    width: usize,
    height: usize,
    known: Vec<Option<Bands>>,
}

impl Level {
    /// The mean of the known ones among each 2 × 2.
    fn halved(&self) -> Level {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut known = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let (mut sum, mut count) = ([0.0; 3], 0.0);
                for (x, y) in [(2 * x, 2 * y), (2 * x + 1, 2 * y), (2 * x, 2 * y + 1), (2 * x + 1, 2 * y + 1)] {
                    if x < self.width
                        && y < self.height
                        && let Some(value) = self.known[y * self.width + x]
                    {
                        sum = std::array::from_fn(|band| sum[band] + value[band]);
                        count += 1.0;
                    }
                }
                known.push((count > 0.0).then(|| sum.map(|s: f32| s / count)));
            }
        }
        Level { width, height, known }
    }
}

/// What a viewer reads from a page at texture coordinates: the bilinear mean of four texels.
pub fn look_up(size: [u32; 2], page: &[Bands], uv: Vec2) -> Bands {
    let [width, height] = size.map(|side| side as usize);
    let split = |x: f32, side: usize| {
        let x = (x * side as f32 - 0.5).clamp(0.0, (side - 1) as f32);
        let low = x as usize;
        (low, (low + 1).min(side - 1), x - low as f32)
    };
    let ((left, right, across), (top, bottom, down)) = (split(uv.x, width), split(uv.y, height));
    let mix = |a: Bands, b: Bands, share: f32| std::array::from_fn(|k| a[k] + share * (b[k] - a[k]));
    let row = |y: usize| mix(page[y * width + left], page[y * width + right], across);
    mix(row(top), row(bottom), down)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec2;

    #[test]
    fn empty_texels_continue_their_neighbours() {
        let at = |x, y| Texel { x, y, triangle: 0, uv: Vec2::ZERO };
        let texels = [at(0, 0), at(6, 4), at(1, 3), at(6, 4)];
        let picture = fill([7, 5], &texels, &[[1.0; 3], [2.0; 3], [f32::NAN; 3], [4.0; 3]]);
        assert_eq!(picture.len(), 35);
        assert_eq!((picture[0], picture[1], picture[34]), ([1.0; 3], [1.0; 3], [3.0; 3]));
        assert!(picture.iter().flatten().all(|v| (1.0..=3.0).contains(v)));
        assert_eq!(fill([2, 1], &[], &[]), [[0.0; 3]; 2]);
        assert!(fill([0, 0], &[], &[]).is_empty());
    }
}
