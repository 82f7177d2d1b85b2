//! Smaller elements where direct light varies: the edges of shadows, shelves, the feet of furniture.
//!
//! A receiver far away sees the lit part of an element and not the part that reaches under a desk; a constant gives it
//! the mean of both. Cells whose direct light varies most, by the flux A ρ σ that may go astray, are divided until
//! the rest is small. Pilot samples only choose the cells; their light is worked out anew with other samples, as
//! keeping the pilot where it looked even would keep its errors too.
//!
//! Next to lamps, where nothing hides any of them and each is made of few panels, more is known than that: how much goes astray
//! within parts of each size. There cells are divided as often as that takes, those first of which the most is mended for each new element.

use radiosity_scene::{Bands, Elements, luminance};
use radiosity_solve::{DiffuseResponse, SheetResponse};
use radiosity_trace::{Place, Tracer};
use radiosity_transport::{
    ElementReceivers, Exposure, Light, Luminaires, Progress, Receivers, Shadowing, Site, Stopped, Variation,
};
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Elements along an edge of a divided cell of which only a few places are known. In a furnished office points are −1.27 % off with 1, −0.72 % with 2,
/// −0.52 % with 4, −0.42 % with 8, which takes half as long again.
const PIECES: u32 = 4;

/// How often such a cell is quartered.
const QUARTERINGS: usize = PIECES.ilog2() as usize;

/// Places in a cell that look how direct light varies, and shadow rays at each: one for each light up to this many.
/// With one ray at each place and twelve lights, points in a furnished office are −0.30 % off instead of −0.22 %.
const PLACES: u32 = 4;
const RAYS: usize = 4;

/// Share of a cell's rays below which a triangle is not looked at.
const LEAST_SHARE: f64 = 0.0625;

/// Optical properties by element.
pub(crate) struct Optics {
    /// m².
    pub area: Vec<f64>,
    pub reflectance: Vec<Bands>,
    /// What passes through, where anything does.
    pub sheets: Sheets,
    /// Emitted exitance, lm/m² per band.
    pub exitance: Vec<Bands>,
}

impl Optics {
    pub fn new(tracer: &Tracer, elements: &Elements) -> Optics {
        let ids = 0..elements.len() as u32;
        let area = ids.clone().into_par_iter().map(|e| elements.area(tracer.mesh, e)).collect();
        let (reflectance, exitance) =
            ids.into_par_iter().map(|e| elements.optics(tracer.scene, tracer.mesh, e)).unzip();
        Optics { area, reflectance, sheets: Sheets::new(tracer, elements), exitance }
    }
}

/// Diffuse transmission between the two sides of elements. Empty where no surface transmits light.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sheets {
    /// The other side of each element, itself where nothing passes.
    pub opposite: Vec<u32>,
    /// τ of each element: of what arrives on its other side, the share that leaves it.
    pub transmittance: Vec<Bands>,
}

impl Sheets {
    /// Of elements that are divided alike on the two sides of a sheet, as [`divided`] makes them.
    fn new(tracer: &Tracer, elements: &Elements) -> Sheets {
        let (scene, mesh) = (tracer.scene, tracer.mesh);
        if !scene.transmits() {
            return Sheets::default();
        }
        let (opposite, transmittance) = (0..elements.len() as u32)
            .into_par_iter()
            .map(|e| {
                let tau = elements.transmittance(scene, mesh, e);
                match elements.opposite(e).filter(|_| tau.iter().any(|t| *t > 0.0)) {
                    Some(opposite) => (opposite, tau),
                    None => (e, [0.0; 3]),
                }
            })
            .unzip();
        Sheets { opposite, transmittance }
    }

    /// The same where elements are partly buried: what leaves an exposed place arrived at the same place of the other
    /// side, if that is exposed too. Radiosity is the mean over the exposed places.
    pub fn exposed(mut self, exposure: &Exposure) -> Sheets {
        for (e, tau) in self.transmittance.iter_mut().enumerate() {
            let (own, other) = (exposure.mask(e as u32), exposure.mask(self.opposite[e]));
            if other != u64::MAX || own != u64::MAX {
                let share = (own & other).count_ones() as f32 / own.count_ones().max(1) as f32;
                *tau = tau.map(|t| t * share);
            }
        }
        self
    }

    /// The element whose light comes through an element, and the share that does.
    #[inline]
    pub fn passed(&self, element: usize) -> Option<(usize, Bands)> {
        let other = *self.opposite.get(element)? as usize;
        (other != element).then(|| (other, self.transmittance[element]))
    }

    /// R with this transmission.
    pub fn response(&self, diffuse: DiffuseResponse) -> SheetResponse {
        let transmittance = self.transmittance.iter().flatten().map(|t| f64::from(*t)).collect();
        SheetResponse { diffuse, opposite: self.opposite.clone(), transmittance }
    }

    /// Whether nothing passes anywhere.
    pub fn is_empty(&self) -> bool {
        self.opposite.is_empty()
    }
}

/// What light goes astray in a cell.
struct Astray<'a> {
    /// Area by what of the light goes on, m².
    weight: f64,
    light: &'a Variation,
}

impl Astray<'_> {
    /// That within its elements after so many quarterings, lm. Of cells with few places no more is known than that pieces are better.
    fn left(&self, quarterings: usize) -> f64 {
        let deviation = match (quarterings, &self.light.within) {
            (0, _) => self.light.deviation,
            (quarterings, Some(within)) => within[quarterings - 1],
            (_, None) => 0.0,
        };
        self.weight * f64::from(deviation)
    }

    /// How often it is quartered next.
    fn next(&self, quarterings: usize) -> Option<usize> {
        let next = if self.light.within.is_some() { quarterings + 1 } else { QUARTERINGS };
        (quarterings < next && next <= self.most()).then_some(next)
    }

    fn most(&self) -> usize {
        self.light.within.as_ref().map_or(QUARTERINGS, |within| within.len())
    }

    /// What no pieces mend.
    fn least(&self) -> f64 {
        self.left(self.most())
    }
}

/// Cells large enough to be divided.
struct Cells<'a>(ElementReceivers<'a>);

impl Receivers for Cells<'_> {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn site(&self, i: usize) -> Option<Site> {
        let is_large = self.0.elements.share(self.0.mesh, i as u32) >= LEAST_SHARE;
        is_large.then(|| self.0.site(i)).flatten()
    }

    fn buried(&self, tracer: &Tracer, place: &Place, seed: u32) -> bool {
        self.0.buried(tracer, place, seed)
    }

    fn places(&self, _i: usize, wanted: u32) -> u32 {
        wanted
    }

    fn near(&self, i: usize) -> Option<f64> {
        self.0.near(i)
    }

    fn seed(&self, i: usize) -> u32 {
        self.0.seed(i)
    }
}

/// Divides cells of one element each, those first of which the most is mended for each new element, until what can be mended of Σ A ρ σ is
/// at most `variation` times Σ A ρ D. Where that would be more than `most` elements, half of what these leave is taken.
///
/// # Errors
/// [`Stopped`] if `progress` says so.
pub(crate) fn divided(
    tracer: &Tracer,
    cells: &Elements,
    variation: f64,
    most: usize,
    progress: &dyn Progress,
) -> Result<Elements, Stopped> {
    // Nothing is asked of light that may vary as it likes, and looking takes seconds in a furnished room.
    if variation == f64::INFINITY {
        return Ok(cells.clone());
    }
    let Optics { area, reflectance, sheets, exitance } = Optics::new(tracer, cells);
    let luminaires = Luminaires::new(tracer, cells, &area, &exitance).with_beams(tracer, cells);
    // Nothing is known yet of what is buried; such places drop out one by one.
    let exposure = Exposure::default();
    let receivers = Cells(ElementReceivers { mesh: tracer.mesh, elements: cells, exposure: &exposure });
    // A light of many parts is as many lights.
    let parts = |light: &Light| if matches!(light, Light::Area { tree: Some(_), .. }) { RAYS } else { 1 };
    let parts: usize = luminaires.lights.iter().map(parts).sum();
    let looking = Shadowing { places: PLACES, rays: parts.min(RAYS) as u32 };
    let direct = luminaires.variation(tracer, &receivers, &looking, progress)?;

    // Light that goes astray on a sheet does so on both sides.
    let passing = |i: usize| sheets.passed(i).map_or(0.0, |(other, _)| luminance(sheets.transmittance[other]));
    let weight = |i: usize| area[i] * f64::from(luminance(reflectance[i]) + passing(i));
    let flux: f64 = (0..cells.len()).map(|i| weight(i) * f64::from(direct[i].mean)).sum();
    let of = |i: usize| Astray { weight: weight(i), light: &direct[i] };
    // What no pieces mend does not count: for its sake all would be divided as often as may be.
    let all: f64 = (0..cells.len()).map(|i| of(i).left(0) - of(i).least()).sum();
    let worst = |i: usize, level: usize| {
        let finer = of(i).next(level)?;
        let mended = of(i).left(level) - of(i).left(finer);
        let elements = (1u32 << (2 * finer)) - (1 << (2 * level));
        // The bits of what is not negative sort as that does.
        (mended > 0.0).then(|| ((mended / f64::from(elements)).to_bits(), Reverse(i), level))
    };
    // The pieces of cells, and whether they are all that is wanted.
    let cut = |most: usize| {
        let mut waiting: BinaryHeap<_> = (0..cells.len()).filter_map(|i| worst(i, 0)).collect();
        let (mut left, mut pieces, mut elements) = (all, vec![1u32; cells.cells()], cells.len());
        while left > variation * flux
            && let Some((_, Reverse(i), level)) = waiting.pop()
            && let Some(finer) = of(i).next(level)
        {
            let (cell, along) = (cells.cell(i as u32), 1u32 << finer);
            let opposite = sheets.passed(i).and_then(|_| cells.opposite_cell(cell));
            let sides = [Some(cell), opposite].into_iter().flatten();
            let more = |side: usize| (pieces[side].max(along).pow(2) - pieces[side].pow(2)) as usize;
            elements += sides.clone().map(more).sum::<usize>();
            if elements > most {
                return (pieces, false);
            }
            sides.for_each(|side| pieces[side] = pieces[side].max(along));
            left -= of(i).left(level) - of(i).left(finer);
            waiting.extend(worst(i, finer));
        }
        (pieces, true)
    };
    let (mut pieces, is_all) = cut(most);
    if !is_all {
        // Something is left for what light is read at, and for further rays.
        (pieces, _) = cut(cells.len() + most.saturating_sub(cells.len()) / 2);
    }
    Ok(cells.refined(&pieces))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use radiosity_scene::{Material, Mesh, Scene};

    /// A strip below a ceiling: what lies next to it is cut into smaller pieces than the edges of shadows are, the worst first, and no more
    /// than there may be.
    #[test]
    fn cells_beside_a_lamp_are_cut_as_small_as_their_light() {
        let lamp = Material { emissive: [1000.0; 3], base_color: [0.0, 0.0, 0.0, 1.0], ..Material::default() };
        let mut scene = Scene { materials: vec![Material::default(), lamp], ..Scene::default() };
        let ceiling = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
        scene.add_quad("ceiling", 0, ceiling);
        let strip = [[0.5, 1.0], [0.5, 1.002], [1.5, 1.002], [1.5, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.01));
        scene.add_quad("strip", 1, strip);
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let cells = Elements::new(&scene, &mesh, 0.2);
        let divided = |variation: f64, most: usize| divided(&tracer, &cells, variation, most, &()).unwrap();

        let smallest = |elements: &Elements| {
            let areas = (0..elements.len() as u32).map(|e| elements.area(&mesh, e));
            areas.fold(f64::INFINITY, f64::min).sqrt()
        };
        let [rough, fine] = [0.2, 0.02].map(|variation| divided(variation, usize::MAX));
        assert!(rough.len() > cells.len() && fine.len() > 2 * rough.len(), "{} {}", rough.len(), fine.len());
        assert!(smallest(&fine) < 0.01, "{}", smallest(&fine));
        // A cell far from the strip stays whole.
        let is_whole = |cell: &usize| fine.of_cell(*cell).len() == 1;
        assert!((0..fine.cells()).filter(is_whole).count() > fine.cells() / 2);

        // Where not all of them may be, something is left for others.
        let most = fine.len() - 1;
        let fewer = divided(0.02, most);
        assert!(fewer.len() > cells.len() && fewer.len() <= (cells.len() + most) / 2, "{} of {most}", fewer.len());
        assert_eq!(divided(0.02, fine.len()).len(), fine.len());
        assert_eq!(divided(0.02, cells.len()).len(), cells.len());
    }
}
