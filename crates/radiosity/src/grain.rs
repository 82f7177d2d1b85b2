//! Grain: what chance leaves in the direct light of a picture where there is time for few shadow rays alone. Halves of these tell it from shadows, by scales ([`crate::believed`]); pixels that few others lie beside keep theirs.

use crate::allocation::Lit;
use crate::believed::SHADOWED;
use crate::blocks::{Blocks, Shape};
use radiosity_scene::Bands;
use radiosity_view::picture::ViewRays;

/// Bytes that a place takes.
const PLACE_BYTES: usize = 400;

/// Evens out the `direct` light of all places but those where it is exact, by how far its halves are `apart` from it; where that is no number it is not known. Of a picture of more places than the `memory` holds some keep their grain.
pub(crate) fn even_out(view: &ViewRays, direct: &mut Lit, apart: &[f32], memory: usize) {
    // Curved surfaces go on as flat ones do: as far as they turn by little.
    let shape = |(is_exact, apart): (&bool, &f32)| (!is_exact && apart.is_finite()).then_some(Shape::Flat);
    let shapes = direct.is_exact.iter().zip(apart).map(shape).collect();
    let pixels = Blocks::of(view, shapes, 1, memory / PLACE_BYTES);
    let chosen: Vec<usize> = pixels.blocks.iter().map(|block| block.chosen as usize).collect();
    let (light, apart): (Vec<Bands>, Vec<f32>) =
        chosen.iter().map(|place| (direct.light[*place], apart[*place])).unzip();
    let shown = pixels.beside.by_scales(&light, &apart, None, &SHADOWED);
    chosen.into_iter().zip(shown).for_each(|(place, shown)| direct.light[place] = shown);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::allocation::mean;
    use crate::believed::apart;
    use crate::pixels::pixel;
    use crate::pixels::tests::{SIZE, floors};
    use radiosity_trace::sampling::{hash, unit};

    /// Of what some of eight rays in each half find of a lamp: soft shadows lose most of their grain, harder ones some, none are farther off, and what is exact, or has noise that is not known, is left alone.
    #[test]
    fn grain_goes_and_shadows_stay() {
        let view = floors(SIZE);
        let places = || 0..view.seen.len();
        let column = |place: usize| pixel(&view, place as u32)[0];
        let is_exact: Vec<bool> = places().map(|place| column(place) < 8).collect();
        for (width, most) in [(80.0, 0.3), (20.0, 0.4), (8.0, 0.7), (3.0, 1.0)] {
            // Part of a lamp that is seen, beside other light.
            let seen = |place: usize| ((column(place) as f32 - 48.0) / width + 0.5).clamp(0.0, 1.0);
            let truth = |place: usize| 20.0 + 100.0 * seen(place);
            let half = |place: usize, k: u32| {
                let ray = |ray: u32| unit(hash(hash(place as u32) ^ (k + 2 * ray))) < seen(place);
                20.0 + 100.0 * (0..8).filter(|i| ray(*i)).count() as f32 / 8.0
            };
            let halves = |place: usize| -> [Bands; 2] { [0, 1].map(|k| [half(place, k); 3]) };
            let grainy: Vec<Bands> = places().map(|place| mean(halves(place))).collect();
            // Of the last columns nothing is known.
            let is_known = |place: usize| column(place) < SIZE - 8;
            let told = |place: usize| if is_known(place) { apart(halves(place)) } else { f32::NAN };
            let apart: Vec<f32> = places().map(told).collect();
            let mut direct = Lit { light: grainy.clone(), is_exact: is_exact.clone() };
            even_out(&view, &mut direct, &apart, usize::MAX);
            let off = |light: &[Bands]| {
                let of = |place: usize| (light[place][1] / truth(place) - 1.0).powi(2);
                places().filter(|place| !is_exact[*place] && is_known(*place)).map(of).sum::<f32>().sqrt()
            };
            let left = off(&direct.light) / off(&grainy);
            assert!(left < most, "{width}: {left}");
            assert!(places().all(|place| !is_exact[place] && is_known(place) || direct.light[place] == grainy[place]));
        }
    }
}
