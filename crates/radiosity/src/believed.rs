//! What of gathered light is believed over what is there without it: the field of elements, or what lies between wider blocks. Both are smooth, and noise is seen on smooth walls.

use crate::allocation::mean;
use crate::final_gather::Gathered;
use radiosity_scene::{Bands, luminance};
use rayon::prelude::*;
use smallvec::SmallVec;

/// How often the noise of blocks is evened out with that of those around.
const FARTHER: usize = 4;

/// How often what the field misses is evened out, so that it is told from noise where it is as wide as an element, as 25 blocks do not tell it. With once the
/// furnished room is 0.77 instead of 0.70 % off (with 4 for [`SURE`]).
const SCALES: u32 = 4;

/// Squared ratio of what the field misses to the noise of that from which on it is believed, and of what pixels differ by from what lies between blocks. With 4 the
/// furnished room is 0.71 % off, with 3 0.68, with 2 0.65, and with 2 there are more light dots on smooth walls, of up to 6 %.
const SURE: f32 = 3.0;

/// Mean square noise, so many times, is what of the mean square of a difference is not believed where blocks share with no others. With 1 and 4 pillars are up to a twentieth farther off.
const CLEAR: f32 = 2.0;

/// And halves that differ by more mean squares than this met a bright path that others around did not, and say nothing: within little time they are dots. With 6 and 16 all is as near.
const STRAY: f32 = 9.0;

/// Of blocks, those of the same surface around each.
pub(crate) struct Neighbours(pub Vec<SmallVec<[u32; 24]>>);

impl Neighbours {
    /// Means over each block and those beside it.
    fn around(&self, values: &[f32]) -> Vec<f32> {
        self.means(|own| [values[own]]).into_iter().map(|[mean]| mean).collect()
    }

    /// The same, of several values of each.
    fn means<const N: usize>(&self, of: impl Fn(usize) -> [f32; N] + Sync) -> Vec<[f32; N]> {
        let mean = |(own, beside): (usize, &SmallVec<[u32; 24]>)| -> [f32; N] {
            let mut sum = of(own);
            for other in beside {
                sum.iter_mut().zip(of(*other as usize)).for_each(|(sum, other)| *sum += other);
            }
            sum.map(|sum| sum / (beside.len() + 1) as f32)
        };
        self.0.par_iter().enumerate().map(mean).collect()
    }

    /// Leaves in its place what the `field` of elements has, as far as what is `gathered` does not tell more than its noise: what
    /// bright paths leave, if few rays meet them, is seen on walls, and the field is smooth. It may tell more by what a block shares with others, or by
    /// what it and those around found, up to [`SCALES`] times as far.
    pub fn unless_sure(&self, gathered: &mut Gathered, field: &[Bands]) {
        let beyond = |(light, field): (Bands, &Bands)| luminance(light) - luminance(*field);
        let shared = gathered.light.iter().copied().zip(field).map(beyond);
        let farther = self.farther(&gathered.noise);
        let noise = gathered.noise.iter().zip(farther).map(|(own, farther)| own.max(farther));
        let mut most_sure: Vec<f32> = shared.zip(noise).map(sure).collect();

        let halves = &gathered.halves;
        let mut off: Vec<f32> = halves.iter().map(|halves| mean(*halves)).zip(field).map(beyond).collect();
        // Half of what halves differ by has the noise of their mean, however many blocks it is evened out over. One that met a bright path tells of it alone.
        let mut apart: Vec<f32> = halves.iter().map(|[a, b]| 0.5 * (luminance(*a) - luminance(*b))).collect();
        let mut squares: Vec<f32> = apart.iter().map(|apart| apart * apart).collect();
        for scale in 1..=SCALES {
            (off, apart, squares) = (self.around(&off), self.around(&apart), self.around(&squares));
            let farther = self.farther(&apart);
            let noise = |own: usize| {
                let count = scale as f32 * (self.0[own].len() + 1) as f32;
                farther[own].max((squares[own] / count).sqrt())
            };
            most_sure.iter_mut().enumerate().for_each(|(own, most)| *most = most.max(sure((off[own], noise(own)))));
        }
        self.mix(&mut gathered.light, field, &most_sure);
    }

    /// What of `gathered` light stands out on curved surfaces, where few share, over the `field`: of what each is off from those around, and these are from those farther around, so
    /// much as stands out from noise there. All of it counts relative to the light around, as some that is dark is seen beside what is bright.
    pub fn by_scales(&self, gathered: &Gathered, field: &[Bands]) -> Vec<Bands> {
        let Gathered { light, apart, .. } = gathered;
        let level = self.means(|own| [luminance(light[own]).max(f32::MIN_POSITIVE)]);
        let off = |own: usize| {
            let [level] = level[own];
            let [red, green, blue]: Bands = std::array::from_fn(|k| (light[own][k] - field[own][k]) / level);
            [red, green, blue, apart[own] / level]
        };
        // Beyond the field, per band; and half of what halves differ by.
        let mut off: Vec<[f32; 4]> = (0..field.len()).map(off).collect();
        let mut beyond = vec![[0.0; 3]; field.len()];
        for scale in 0..=SCALES {
            let wide = if scale < SCALES { self.means(|own| off[own]) } else { vec![[0.0; 4]; off.len()] };
            let detail = |own: usize| -> [f32; 4] { std::array::from_fn(|k| off[own][k] - wide[own][k]) };
            let squares = self.means(|own| {
                let [red, green, blue, apart] = detail(own);
                [luminance([red, green, blue]).powi(2), apart.powi(2)]
            });
            let squares = (1..FARTHER).fold(squares, |squares, _| self.means(|own| squares[own]));
            beyond.par_iter_mut().enumerate().for_each(|(own, beyond): (usize, &mut Bands)| {
                let [all, noise] = squares[own];
                let has_strayed = detail(own)[3].powi(2) > STRAY * noise;
                let sure = if all > 0.0 && !has_strayed { (1.0 - CLEAR * noise / all).max(0.0) } else { 0.0 };
                *beyond = std::array::from_fn(|k| beyond[k] + sure * detail(own)[k]);
            });
            off = wide;
        }
        let believed = |own: usize| std::array::from_fn(|k| (field[own][k] + level[own][0] * beyond[own][k]).max(0.0));
        (0..field.len()).map(believed).collect()
    }

    /// Leaves in its place what lies `between` wider blocks, as far as what these `found` differs from it all around by no more than their `noise` might ([`SURE`]): they would
    /// stand out as dots from what is beside them. The noise of blocks is in both, as the pixels that were theirs send the same rays again.
    pub fn unless_clear(&self, found: &mut [Bands], between: &[Bands], noise: &[f32]) {
        let off = |(found, between): (&Bands, &Bands)| (luminance(*found) - luminance(*between)).powi(2);
        let off = self.around(&found.iter().zip(between).map(off).collect::<Vec<f32>>());
        let noise = self.farther(noise);
        let sure: Vec<f32> = off.into_iter().map(f32::sqrt).zip(noise).map(sure).collect();
        self.mix(found, between, &sure);
    }

    /// Leaves of what was `found` so much as is sure, and `others` for the rest.
    fn mix(&self, found: &mut [Bands], others: &[Bands], sure: &[f32]) {
        for ((found, other), sure) in found.iter_mut().zip(others).zip(self.around(sure)) {
            *found = std::array::from_fn(|k| other[k] + sure * (found[k] - other[k]));
        }
    }

    /// Root mean square noise farther around, as there need not be a bright path in a window where there might be.
    fn farther(&self, noise: &[f32]) -> Vec<f32> {
        let squares = noise.iter().map(|noise| noise * noise).collect();
        (0..FARTHER).fold(squares, |squares: Vec<f32>, _| self.around(&squares)).into_iter().map(f32::sqrt).collect()
    }
}

/// How much of a difference is believed, by its noise (a Wiener filter, as in `radiosity_view::pool`).
fn sure((off, noise): (f32, f32)) -> f32 {
    if off != 0.0 { (1.0 - SURE * (noise / off).powi(2)).max(0.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::allocation::halved;
    use radiosity_trace::sampling::{hash, unit};

    /// Places in rows of [`SIDE`], each beside those of the 24 around that there are.
    const SIDE: usize = 40;

    fn beside(own: usize) -> SmallVec<[u32; 24]> {
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
        let draw = |i: usize| 0.2 * (unit(hash(i as u32)) - 0.5);
        // Of this standard error.
        let noise = vec![0.2 / 12f32.sqrt(); SIDE * SIDE];
        let off = |detail: f32| {
            let truth = |i: usize| 1.0 + if i.is_multiple_of(2) { detail } else { -detail };
            let mut found: Vec<Bands> = (0..SIDE * SIDE).map(|i| [truth(i) + draw(i); 3]).collect();
            blocks.unless_clear(&mut found, &vec![[1.0; 3]; SIDE * SIDE], &noise);
            let squares = found.iter().enumerate().map(|(i, e)| (e[0] - truth(i)).powi(2));
            (squares.sum::<f32>() / found.len() as f32).sqrt() / noise[0]
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
        // And told by these alone.
        let told = |i: usize| {
            let own = blocks.0[i].iter().map(|other| halved(halves[*other as usize]).powi(2));
            own.sum::<f32>().sqrt() / blocks.0[i].len() as f32
        };
        let noise: Vec<f32> = (0..halves.len()).map(told).collect();
        let off =
            |light: &[Bands]| (light.iter().map(|e| (e[0] - 1.0).powi(2)).sum::<f32>() / light.len() as f32).sqrt();
        let gathered = || Gathered {
            light: light.clone(),
            halves: halves.clone(),
            noise: noise.clone(),
            apart: Vec::new(),
            is_whole: true,
        };
        let mut with_right = gathered();
        blocks.unless_sure(&mut with_right, &vec![[1.0; 3]; halves.len()]);
        assert!(off(&with_right.light) < 0.2 * off(&light), "{} of {}", off(&with_right.light), off(&light));
        let field = vec![[3.0; 3]; halves.len()];
        let mut with_wrong = gathered();
        blocks.unless_sure(&mut with_wrong, &field);
        assert!(off(&with_wrong.light) < 0.1 * off(&field), "{} of {}", off(&with_wrong.light), off(&field));
    }

    /// Where a field is wrong by less than 25 blocks tell, many more do if it is so on all of an element, and what each shares does at the end of a wall.
    #[test]
    fn the_field_gives_way_where_it_is_wrong_on_an_element_or_at_an_edge() {
        let blocks = Neighbours((0..SIDE * SIDE).map(beside).collect());
        let left = |noise: f32, wrong: &dyn Fn(usize) -> bool| {
            let mut gathered = Gathered {
                light: vec![[1.0; 3]; SIDE * SIDE],
                halves: (0..SIDE * SIDE).map(apart).collect(),
                noise: vec![noise; SIDE * SIDE],
                apart: Vec::new(),
                is_whole: true,
            };
            let field: Vec<Bands> = (0..SIDE * SIDE).map(|i| [if wrong(i) { 1.07 } else { 1.0 }; 3]).collect();
            blocks.unless_sure(&mut gathered, &field);
            let own: Vec<f32> = (0..SIDE * SIDE).filter(|i| wrong(*i)).map(|i| gathered.light[i][0] - 1.0).collect();
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
        let strip = |own: u32| -> SmallVec<[u32; 24]> {
            (own.saturating_sub(2)..=own + 2).filter(|i| *i != own && *i < (SIDE * SIDE) as u32).collect()
        };
        for (reach, most) in [(0, 0.78), (1, 0.28)] {
            let all = (0..(SIDE * SIDE) as u32).map(|i| if reach == 0 { SmallVec::new() } else { strip(i) });
            let blocks = Neighbours(all.collect());
            let halves: Vec<[Bands; 2]> = (0..SIDE * SIDE).map(apart).collect();
            let light: Vec<Bands> = halves.iter().map(|halves| mean(*halves)).collect();
            let noise = halves.iter().map(|halves| halved(*halves)).collect();
            let off = |light: &[Bands]| light.iter().map(|e| (e[0] - 1.0).powi(2)).sum::<f32>().sqrt();
            let before = off(&light);
            let mut gathered = Gathered { light, halves, noise, apart: Vec::new(), is_whole: true };
            blocks.unless_sure(&mut gathered, &vec![[1.0; 3]; SIDE * SIDE]);
            let left = off(&gathered.light) / before;
            assert!(left < most, "{reach}: {left}");
        }
    }

    /// Of what blocks found that share with none, noise is left out where the field is right and where it is wrong all over; what is finer than that, and more than noise, stays.
    #[test]
    fn by_scales_details_stay_and_noise_does_not() {
        let blocks = Neighbours((0..SIDE * SIDE).map(beside).collect());
        let left = |wrong: f32, detail: f32| {
            let truth = |i: usize| 1.0 + if i % 4 < 2 { detail } else { -detail };
            let all: Vec<[Bands; 2]> = (0..SIDE * SIDE).map(apart).collect();
            let light: Vec<Bands> = (0..all.len()).map(|i| [mean(all[i])[0] - 1.0 + truth(i); 3]).collect();
            let halves = all.iter().map(|[a, b]| 0.5 * (a[0] - b[0])).collect();
            let gathered = Gathered { light, halves: all, noise: Vec::new(), apart: halves, is_whole: true };
            let shown = blocks.by_scales(&gathered, &vec![[1.0 + wrong; 3]; SIDE * SIDE]);
            let off =
                |light: &[Bands]| light.iter().enumerate().map(|(i, e)| (e[0] - truth(i)).powi(2)).sum::<f32>().sqrt();
            off(&shown) / off(&gathered.light)
        };
        let [right, wrong, fine] = [left(0.0, 0.0), left(0.5, 0.0), left(0.0, 1.0)];
        assert!(right < 0.1 && wrong < 0.2 && fine < 1.05, "{right} {wrong} {fine}");

        // One that met a bright path by one half has no part in details that others show.
        let detail = |i: usize| [if i % 4 < 2 { 1.3 } else { 0.7 }; 3];
        let mut light: Vec<Bands> = (0..SIDE * SIDE).map(detail).collect();
        let mut apart = vec![1e-3; SIDE * SIDE];
        let own = SIDE * SIDE / 2 + SIDE / 2;
        (light[own], apart[own]) = ([3.0; 3], 1.5);
        let gathered = Gathered { light, halves: Vec::new(), noise: Vec::new(), apart, is_whole: true };
        let shown = blocks.by_scales(&gathered, &vec![[1.0; 3]; SIDE * SIDE]);
        let (lit, other) = (shown[own][0], shown[SIDE / 2][0]);
        assert!(lit < 1.5 && (other - 1.3).abs() < 0.05, "{lit}, {other} far away");
    }

    /// Two halves around 1.
    fn apart(i: usize) -> [Bands; 2] {
        [0, 1].map(|k| [0.5 + unit(hash(hash(i as u32) ^ k)); 3])
    }
}
