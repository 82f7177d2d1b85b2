//! What of light with noise is believed over what lies below it: the field of elements, or what lies between wider blocks, or nothing. That is smooth, and noise is seen on smooth walls.
//!
//! Of each detail d of the light a part max(0, 1 − t n² / d²) is kept, where n is its noise and both squares are means over what is around ([`Doubt`]). Noise that both halves of the rays share is taken for light, and
//! edges of a few pixels are blurred where their noise is as large as they are.

use radiosity_scene::{Bands, luminance};
use radiosity_view::lightmap::Around;
use rayon::prelude::*;

/// How often the light around is evened out with that of those around: once, all blocks beside one that met a bright path are brighter, in a square; with 4 more noise is left in the dark beside light.
const LEVEL: usize = 3;

/// How many widths of detail there are below what is as wide as an element.
const SCALES: u32 = 4;

/// How much details are doubted.
pub(crate) struct Doubt {
    /// How often their size, and that of their noise, is evened out with those around.
    farther: usize,
    /// What is left of them: all but this many times the mean square noise, over their mean square.
    times: f32,
}

/// Of gathered light, which is smooth but for contacts. Pillars are up to a twentieth farther off once and four times, a furnished room is 0.68 and 0.69 instead of 0.67 % 1.3 and 3 times.
pub(crate) const GATHERED: Doubt = Doubt { farther: 4, times: 2.0 };

/// Of direct light, which has edges: with the doubt of what is gathered shadows of three pixels would be half as far off again as with all their grain, and those of eighty keep 0.15 of theirs instead of 0.24.
pub(crate) const SHADOWED: Doubt = Doubt { farther: 2, times: 1.0 };

/// Where halves differ by more than this many times the mean square noise around, a block met a bright path that others did not, and says nothing of that detail: within little time such are dots. With 6 and 16 balls and
/// vases are as near.
const STRAY: f32 = 9.0;

/// Of blocks, those of the same surface around each.
pub(crate) struct Neighbours(pub Vec<Around>);

impl Neighbours {
    /// Means over each block and those beside it, of values which are asked for by each of those around.
    fn means<const N: usize>(&self, of: impl Fn(usize) -> [f32; N] + Sync) -> Vec<[f32; N]> {
        let mean = |(own, beside): (usize, &Around)| -> [f32; N] {
            let mut sum = of(own);
            for other in beside {
                sum.iter_mut().zip(of(*other as usize)).for_each(|(sum, other)| *sum += other);
            }
            sum.map(|sum| sum / (beside.len() + 1) as f32)
        };
        self.0.par_iter().enumerate().map(mean).collect()
    }

    /// Values evened out so many `times`.
    fn evened<const N: usize>(&self, times: usize, values: Vec<[f32; N]>) -> Vec<[f32; N]> {
        (0..times).fold(values, |values, _| self.means(|own| values[own]))
    }

    /// What of `light` stands out over what lies `below` it, if there is anything: what they differ by, relative to the light around, is split into details of
    /// [`SCALES`] + 1 widths (à trous; Starck and Murtagh 1994), and each is kept as far as in a wide surrounding it is larger than its noise (a Wiener filter), which the halves of the rays, so far `apart` from the light, tell.
    pub fn by_scales(&self, light: &[Bands], apart: &[f32], below: Option<&[Bands]>, doubt: &Doubt) -> Vec<Bands> {
        let is_alone = below.is_none();
        let below = |own: usize| below.map_or([0.0; 3], |below| below[own]);
        let level = |own: usize| luminance(light[own]).max(luminance(below(own)));
        let level = (0..light.len()).map(|own| [if level(own).is_finite() { level(own) } else { 0.0 }]).collect();
        let level = self.evened(LEVEL, level);
        let level = |own: usize| level[own][0].max(f32::MIN_POSITIVE);
        let beyond = |own: usize| {
            let [red, green, blue]: Bands = std::array::from_fn(|k| (light[own][k] - below(own)[k]) / level(own));
            let all = [red, green, blue, apart[own] / level(own)];
            if all.iter().all(|k| k.is_finite()) { all } else { [0.0; 4] }
        };
        let mut left: Vec<[f32; 4]> = (0..light.len()).into_par_iter().map(beyond).collect();
        let mut kept = vec![[0.0; 3]; light.len()];
        for scale in 0..=SCALES {
            let is_last = scale == SCALES;
            let wide = if is_last { vec![[0.0; 4]; left.len()] } else { self.means(|own| left[own]) };
            let detail = |(left, wide): (&[f32; 4], &[f32; 4])| std::array::from_fn(|k| left[k] - wide[k]);
            let details: Vec<[f32; 4]> = left.par_iter().zip(&wide).map(detail).collect();
            let square = |own: usize| {
                let [red, green, blue, apart] = details[own];
                [luminance([red, green, blue]).powi(2), apart.powi(2)]
            };
            let squares = self.evened(doubt.farther, (0..light.len()).into_par_iter().map(square).collect());
            for ((kept, squares), detail) in kept.iter_mut().zip(squares).zip(details) {
                let [all, noise] = squares;
                let [.., apart] = detail;
                let is_stray = apart * apart > STRAY * noise;
                let part = if is_last && is_alone {
                    // Below what is widest there is nothing else, whatever was met.
                    1.0
                } else if all > 0.0 && !is_stray {
                    (1.0 - doubt.times * noise / all).max(0.0)
                } else {
                    0.0
                };
                *kept = std::array::from_fn(|k| kept[k] + part * detail[k]);
            }
            left = wide;
        }
        let shown = |own: usize| std::array::from_fn(|k| (below(own)[k] + level(own) * kept[own][k]).max(0.0));
        (0..light.len()).into_par_iter().map(shown).collect()
    }
}

/// How far the first half is from the mean of both, in luminance: its size is the noise of that, and its sign is evened out as noise is.
pub(crate) fn apart([a, b]: [Bands; 2]) -> f32 {
    0.5 * (luminance(a) - luminance(b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::allocation::mean;
    use radiosity_trace::sampling::{hash, unit};

    /// Places in rows of [`SIDE`], each beside those of the 24 around that there are.
    const SIDE: usize = 40;

    fn beside(own: usize) -> Around {
        let near = |other: &usize| {
            let apart = |a: usize, b: usize| a.abs_diff(b) <= 2;
            *other != own && apart(own % SIDE, other % SIDE) && apart(own / SIDE, other / SIDE)
        };
        (0..SIDE * SIDE).filter(near).map(|other| other as u32).collect()
    }

    /// Where pixels find but noise around what lies between blocks, that stays; what is finer than that, and more than noise, is theirs.
    #[test]
    fn pixels_show_what_is_clearly_theirs() {
        let blocks = Neighbours((0..SIDE * SIDE).map(beside).collect());
        let halves = |i: usize| two(i).map(|half| half.map(|e| 1.0 + 0.2 * (e - 1.0)));
        let noise: Vec<f32> = (0..SIDE * SIDE).map(|i| apart(halves(i))).collect();
        let size = (noise.iter().map(|noise| noise * noise).sum::<f32>() / noise.len() as f32).sqrt();
        let off = |detail: f32| {
            let truth = |i: usize| 1.0 + if i.is_multiple_of(2) { detail } else { -detail };
            let found: Vec<Bands> = (0..SIDE * SIDE).map(|i| mean(halves(i)).map(|e| truth(i) + e - 1.0)).collect();
            let shown = blocks.by_scales(&found, &noise, Some(&vec![[1.0; 3]; SIDE * SIDE]), &GATHERED);
            let squares = shown.iter().enumerate().map(|(i, e)| (e[0] - truth(i)).powi(2));
            (squares.sum::<f32>() / shown.len() as f32).sqrt() / size
        };
        assert!(off(0.0) < 0.1 && off(0.5) < 1.2, "{} {}", off(0.0), off(0.5));
    }

    /// Bright paths that one half in two hundred meets do not show where the field is right; where it is wrong what was gathered stays.
    #[test]
    fn the_field_gives_way_to_what_is_sure() {
        let blocks = Neighbours((0..SIDE * SIDE).map(beside).collect());
        let draw = |i: usize, k: u32| unit(hash(hash(i as u32) ^ k));
        let half = |i: usize, k: u32| {
            let bright = if draw(i, k + 2) < 0.005 { 8.0 } else { 0.0 };
            [1.0 + 0.2 * (draw(i, k) - 0.5) + bright; 3]
        };
        let halves: Vec<[Bands; 2]> = (0..SIDE * SIDE).map(|i| [half(i, 0), half(i, 1)]).collect();
        // As if all shared with those beside them.
        let shared = |i: usize| -> Bands {
            let own = blocks.0[i].iter().map(|other| mean(halves[*other as usize])[0]);
            [own.sum::<f32>() / blocks.0[i].len() as f32; 3]
        };
        let light: Vec<Bands> = (0..halves.len()).map(shared).collect();
        // And told apart by these alone.
        let told = |i: usize| {
            let own = blocks.0[i].iter().map(|other| apart(halves[*other as usize]));
            own.sum::<f32>() / blocks.0[i].len() as f32
        };
        let noise: Vec<f32> = (0..halves.len()).map(told).collect();
        let truth = 1.0 + 0.005 * 8.0;
        let off =
            |light: &[Bands]| (light.iter().map(|e| (e[0] - truth).powi(2)).sum::<f32>() / light.len() as f32).sqrt();
        let with_right = blocks.by_scales(&light, &noise, Some(&vec![[truth; 3]; halves.len()]), &GATHERED);
        assert!(off(&with_right) < 0.2 * off(&light), "{} of {}", off(&with_right), off(&light));
        // Sixteen bright paths in all tell little of a field that lacks them: it is mended in part.
        let with_lacking = blocks.by_scales(&light, &noise, Some(&vec![[1.0; 3]; halves.len()]), &GATHERED);
        assert!(off(&with_lacking) < truth - 1.0, "{} of {}", off(&with_lacking), truth - 1.0);
        let field = vec![[3.0; 3]; halves.len()];
        let with_wrong = blocks.by_scales(&light, &noise, Some(&field), &GATHERED);
        assert!(off(&with_wrong) < 0.1 * off(&field), "{} of {}", off(&with_wrong), off(&field));
    }

    /// Where a field is wrong by less than 25 blocks tell, many more do if it is so on all of an element, and what each shares does at the end of a wall.
    #[test]
    fn the_field_gives_way_where_it_is_wrong_on_an_element_or_at_an_edge() {
        let blocks = Neighbours((0..SIDE * SIDE).map(beside).collect());
        let left = |noise: f32, wrong: &dyn Fn(usize) -> bool| {
            let light = vec![[1.0; 3]; SIDE * SIDE];
            let apart: Vec<f32> =
                (0..SIDE * SIDE).map(|i| noise * (unit(hash(i as u32)) - 0.5) * 12f32.sqrt()).collect();
            let field: Vec<Bands> = (0..SIDE * SIDE).map(|i| [if wrong(i) { 1.07 } else { 1.0 }; 3]).collect();
            let shown = blocks.by_scales(&light, &apart, Some(&field), &GATHERED);
            let own: Vec<f32> = (0..SIDE * SIDE).filter(|i| wrong(*i)).map(|i| shown[i][0] - 1.0).collect();
            own.iter().sum::<f32>() / own.len() as f32
        };
        let is_edge = |i: usize| i % SIDE < 3;
        let [element, edge] = [left(0.1, &|_| true), left(0.01, &is_edge)];
        assert!(element < 0.04 && edge < 0.02, "{element} {edge}");
        assert!(left(0.1, &is_edge) > edge + 0.02);
    }

    /// Blocks that have nobody beside them, and those of a strip, know no better of their noise than they do; where the field is right it takes most of it.
    #[test]
    fn blocks_alone_and_in_a_strip_are_as_noisy_as_they_are() {
        let strip = |own: u32| -> Around {
            (own.saturating_sub(2)..=own + 2).filter(|i| *i != own && *i < (SIDE * SIDE) as u32).collect()
        };
        for (reach, most) in [(0, 0.78), (1, 0.28)] {
            let all = (0..(SIDE * SIDE) as u32).map(|i| if reach == 0 { Around::new() } else { strip(i) });
            let blocks = Neighbours(all.collect());
            let halves: Vec<[Bands; 2]> = (0..SIDE * SIDE).map(two).collect();
            let light: Vec<Bands> = halves.iter().map(|halves| mean(*halves)).collect();
            let noise: Vec<f32> = halves.iter().map(|halves| apart(*halves)).collect();
            let off = |light: &[Bands]| light.iter().map(|e| (e[0] - 1.0).powi(2)).sum::<f32>().sqrt();
            let shown = blocks.by_scales(&light, &noise, Some(&vec![[1.0; 3]; SIDE * SIDE]), &GATHERED);
            let left = off(&shown) / off(&light);
            assert!(left < most, "{reach}: {left}");
        }
    }

    /// Of what blocks found that share with none, noise is left out where the field is right and where it is wrong all over, in light and in the dark; what is finer than that, and more than noise, stays.
    #[test]
    fn by_scales_details_stay_and_noise_does_not() {
        let blocks = Neighbours((0..SIDE * SIDE).map(beside).collect());
        let left = |wrong: f32, detail: f32, dark: f32| {
            let level = |i: usize| if i % SIDE < SIDE / 2 { dark } else { 1.0 };
            let truth = |i: usize| level(i) * (1.0 + if i % 4 < 2 { detail } else { -detail });
            let halves = |i: usize| two(i).map(|half| half.map(|e| truth(i) + level(i) * (e - 1.0)));
            let light: Vec<Bands> = (0..SIDE * SIDE).map(|i| mean(halves(i))).collect();
            let noise: Vec<f32> = (0..SIDE * SIDE).map(|i| apart(halves(i))).collect();
            let field: Vec<Bands> = (0..SIDE * SIDE).map(|i| [(1.0 + wrong) * level(i); 3]).collect();
            let shown = blocks.by_scales(&light, &noise, Some(&field), &GATHERED);
            let off = |light: &[Bands]| {
                light.iter().enumerate().map(|(i, e)| (e[0] / truth(i) - 1.0).powi(2)).sum::<f32>().sqrt()
            };
            off(&shown) / off(&light)
        };
        let [right, wrong, fine] = [left(0.0, 0.0, 1.0), left(0.5, 0.0, 1.0), left(0.0, 0.5, 1.0)];
        assert!(right < 0.1 && wrong < 0.2 && fine < 1.05, "{right} {wrong} {fine}");
        // Beside light, noise of the dark is told by that of the dark.
        let dark = left(0.0, 0.0, 0.03);
        assert!(dark < 0.09, "{dark}");
    }

    /// A block that met a bright path by one half has no part in details that others show.
    #[test]
    fn by_scales_bright_paths_of_one_half_do_not_show() {
        let blocks = Neighbours((0..SIDE * SIDE).map(beside).collect());
        let detail = |i: usize| [if i % 4 < 2 { 1.3 } else { 0.7 }; 3];
        let mut light: Vec<Bands> = (0..SIDE * SIDE).map(detail).collect();
        let mut apart = vec![1e-3; SIDE * SIDE];
        let own = SIDE * SIDE / 2 + SIDE / 2;
        (light[own], apart[own]) = ([3.0; 3], 1.5);
        let shown = blocks.by_scales(&light, &apart, Some(&vec![[1.0; 3]; SIDE * SIDE]), &GATHERED);
        let (lit, other) = (shown[own][0], shown[SIDE / 2][0]);
        assert!(lit < 1.5 && (other - 1.3).abs() < 0.05, "{lit}, {other} far away");
    }

    /// Without a field no light is lost, however noisy; and what is lit stays so beside what found nothing where the field has some, or more than there are numbers for.
    #[test]
    fn by_scales_light_stays() {
        let alone = Neighbours(vec![Around::new(); SIDE * SIDE]);
        let light: Vec<Bands> = (0..SIDE * SIDE).map(|i| mean(two(i))).collect();
        let noise: Vec<f32> = (0..SIDE * SIDE).map(|i| apart(two(i))).collect();
        for (shown, found) in alone.by_scales(&light, &noise, None, &GATHERED).iter().zip(&light) {
            assert!((shown[0] - found[0]).abs() < 1e-6, "{} of {}", shown[0], found[0]);
        }

        let blocks = Neighbours((0..SIDE * SIDE).map(beside).collect());
        for dark in [0.0, f32::INFINITY] {
            let half = |i: usize, left: f32, right: f32| [if i % SIDE < SIDE / 2 { left } else { right }; 3];
            let light: Vec<Bands> = (0..SIDE * SIDE).map(|i| half(i, dark, 1.0)).collect();
            let field: Vec<Bands> = (0..SIDE * SIDE).map(|i| half(i, 0.5, 1.0)).collect();
            let shown = blocks.by_scales(&light, &vec![0.0; SIDE * SIDE], Some(&field), &GATHERED);
            let lit = (0..SIDE * SIDE).filter(|i| i % SIDE >= SIDE / 2).map(|i| shown[i][0]);
            let least = lit.fold(f32::INFINITY, f32::min);
            assert!(least > 0.9, "{least} beside {dark}");
        }
    }

    /// Two halves around 1.
    fn two(i: usize) -> [Bands; 2] {
        [0, 1].map(|k| [0.5 + unit(hash(hash(i as u32) ^ k)); 3])
    }
}
