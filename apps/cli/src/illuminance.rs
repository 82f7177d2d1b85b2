//! How bright the surfaces are: extremes, classes of illuminance with their shares of the area, single surfaces.
//!
//! The classes are bounded by round preferred numbers, 3, 6 or 10 to a decade, as fine as their number allows. They are
//! the scale of a false-colour picture and span what all but the darkest and the brightest fiftieth of it get, so that a
//! room keeps its gradients before a sunny garden; without a picture the same of the area.

use radiosity::{Solution, luminance};
use serde::Serialize;
use std::collections::BTreeMap;

/// Round numbers of a decade, coarsest first.
const STEPS: [&[f64]; 3] =
    [&[1.0, 2.0, 5.0], &[1.0, 1.5, 2.0, 3.0, 5.0, 7.0], &[1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0]];

/// More classes cannot be told apart in a picture.
const MOST_CLASSES: usize = 14;

/// From the brightest class to the darkest: the coarsest steps fit, and an eye that is used to the one sees nothing in
/// the other.
const RANGE: f64 = 3000.0;

/// Share that the scale leaves out at either end. Less, and a lamp's rim or a crack sets the scale.
const TAIL: f64 = 0.02;

/// Share of the lit area that may get less than the low illuminance, as EN 17037 asks for daylight on 95 % of a plane. The
/// darkest element of all lies in a crack or behind furniture, and no place that people use is as dark.
const DARKEST: f64 = 0.05;

/// Surfaces that are named, the largest first; a page has to end.
const MOST_SURFACES: usize = 24;

/// The map "inferno" of matplotlib (CC0) at equal steps: lightness rises evenly, so that more light looks like more
/// light, also to the colour-blind and on paper.
const INFERNO: [[u8; 3]; 10] = [
    [0, 0, 4],
    [27, 12, 65],
    [74, 12, 107],
    [120, 28, 109],
    [165, 44, 96],
    [207, 68, 70],
    [237, 105, 37],
    [251, 155, 6],
    [247, 209, 61],
    [252, 255, 164],
];

/// Illuminance of all exposed surfaces that any light reaches, by elements. Insides of closed solids whose faces are two-sided
/// are black and no part of the room.
#[derive(Clone, Debug, Serialize)]
pub struct Illuminance {
    /// 95 % of the lit area gets more, lx.
    pub low: f64,
    /// Mean over the lit area, lx.
    pub mean: f64,
    /// Half of the lit area gets more, lx.
    pub median: f64,
    /// Share of the exposed area that no light reaches.
    pub dark: f64,
    /// The brightest element, lx.
    pub largest: f64,
    /// Classes, upwards; none if everything is dark. The first holds all below it as well, the last all above.
    pub classes: Vec<Class>,
    /// The largest surfaces by name.
    pub surfaces: Vec<SurfaceLight>,
    /// Surfaces that are not listed.
    pub further_surfaces: usize,
}

/// A class of illuminance.
#[derive(Clone, Debug, Serialize)]
pub struct Class {
    /// Lower edge, lx.
    pub from: f64,
    /// Upper edge, lx.
    pub to: f64,
    /// Share of the lit area.
    pub share: f64,
    /// Its colour, sRGB.
    pub color: [u8; 3],
}

/// Illuminance of the objects of one name.
#[derive(Clone, Debug, Serialize)]
pub struct SurfaceLight {
    /// Name of the objects.
    pub name: String,
    /// Exposed area, m².
    pub area: f64,
    /// 95 % of its lit area gets more, lx.
    pub low: f64,
    /// Mean over its lit area, lx.
    pub mean: f64,
    /// The brightest element, lx.
    pub largest: f64,
}

/// Illuminance and area of the elements that any light reaches, in ascending order.
struct Sorted(Vec<(f64, f64)>);

impl Sorted {
    fn new(mut elements: Vec<(f64, f64)>) -> Sorted {
        elements.retain(|(lux, _)| *lux > 0.0);
        elements.sort_by(|a, b| a.0.total_cmp(&b.0));
        Sorted(elements)
    }

    fn mean(&self) -> f64 {
        // From 0, as the sum of nothing is −0.
        self.0.iter().fold(0.0, |sum, (lux, area)| sum + lux * area) / total_area(&self.0).max(f64::MIN_POSITIVE)
    }

    fn low(&self) -> f64 {
        quantile(&self.0, DARKEST)
    }

    fn largest(&self) -> f64 {
        self.0.last().map_or(0.0, |(lux, _)| *lux)
    }

    /// The elements that get more.
    fn above(&self, lux: f64) -> &[(f64, f64)] {
        &self.0[self.0.partition_point(|(own, _)| *own <= lux)..]
    }
}

impl Illuminance {
    /// Of a solution; the classes suit what a picture shows of it, lux by pixel, if there is one.
    pub fn new(solution: &Solution, shown: Option<&[f32]>) -> Illuminance {
        let (scene, mesh) = (solution.tracer().scene, solution.tracer().mesh);
        let exposed = solution.exposed_area();
        let mut surfaces: BTreeMap<&str, Vec<(f64, f64)>> = BTreeMap::new();
        let mut elements = Vec::new();
        for (element, (h, area)) in solution.irradiance().iter().zip(&exposed).enumerate() {
            if *area > 0.0 {
                let lux = f64::from(luminance(*h));
                let (triangle, _) = solution.elements.place(element as u32);
                let object = scene.triangle_object[mesh.source[triangle] as usize] as usize;
                let name = Some(scene.objects[object].name.as_str()).filter(|n| !n.is_empty()).unwrap_or("unnamed");
                surfaces.entry(name).or_default().push((lux, *area));
                elements.push((lux, *area));
            }
        }
        let mut surfaces: Vec<SurfaceLight> = surfaces
            .into_iter()
            .map(|(name, elements)| {
                let area = total_area(&elements);
                let lit = Sorted::new(elements);
                let (low, mean, largest) = (lit.low(), lit.mean(), lit.largest());
                SurfaceLight { name: name.to_owned(), area, low, mean, largest }
            })
            .collect();
        surfaces.sort_by(|a, b| b.area.total_cmp(&a.area));
        let further_surfaces = surfaces.len().saturating_sub(MOST_SURFACES);
        surfaces.truncate(MOST_SURFACES);
        let lit = shown.into_iter().flatten().filter(|lux| **lux > 0.0 && lux.is_finite());
        let shown: Vec<(f64, f64)> = lit.map(|lux| (f64::from(*lux), 1.0)).collect();
        Illuminance { surfaces, further_surfaces, ..Illuminance::of(elements, shown) }
    }

    /// Of elements and of what is shown of them: illuminance and area.
    fn of(elements: Vec<(f64, f64)>, shown: Vec<(f64, f64)>) -> Illuminance {
        let exposed = total_area(&elements);
        let (all, shown) = (Sorted::new(elements), Sorted::new(shown));
        let lit = total_area(&all.0);
        let scaled = if shown.0.is_empty() { &all } else { &shown };
        let high = quantile(&scaled.0, 1.0 - TAIL);
        let low = quantile(scaled.above(high / RANGE), TAIL);
        let mut light = Illuminance {
            low: all.low(),
            mean: all.mean(),
            median: quantile(&all.0, 0.5),
            dark: if exposed > 0.0 { 1.0 - lit / exposed } else { 0.0 },
            largest: all.largest(),
            classes: classes(low, high),
            surfaces: Vec::new(),
            further_surfaces: 0,
        };
        for (lux, part) in all.0 {
            if let Some(class) = light.class(lux) {
                light.classes[class].share += part / lit;
            }
        }
        light
    }

    /// The class of an illuminance; none for what is no number.
    pub fn class(&self, lux: f64) -> Option<usize> {
        let last = self.classes.len().checked_sub(1)?;
        (!lux.is_nan()).then(|| self.classes.partition_point(|class| class.to <= lux).min(last))
    }
}

fn total_area(elements: &[(f64, f64)]) -> f64 {
    elements.iter().map(|(_, area)| area).sum()
}

/// The value that a share of the area stays below, of elements in ascending order; zero of none.
fn quantile(sorted: &[(f64, f64)], share: f64) -> f64 {
    let total: f64 = sorted.iter().map(|(_, area)| area).sum();
    let mut below = 0.0;
    let at = sorted.iter().find(|(_, area)| {
        below += area;
        below >= share * total
    });
    at.or(sorted.last()).map_or(0.0, |(lux, _)| *lux)
}

/// Classes from `low` to `high`, which are no more than [`RANGE`] apart; none if there is no light.
fn classes(low: f64, high: f64) -> Vec<Class> {
    if !(low > 0.0 && high >= low && high.is_finite()) {
        return Vec::new();
    }
    let all = STEPS.map(|steps| round_numbers(steps, low, high));
    let fine = all.iter().rfind(|edges| edges.len() <= MOST_CLASSES + 1);
    let edges = fine.unwrap_or(&all[0]);
    let count = edges.len() - 1;
    let class = |(i, edge): (usize, &[f64])| Class {
        from: edge[0],
        to: edge[1],
        share: 0.0,
        color: color((i as f64 + 0.5) / count as f64),
    };
    edges.windows(2).enumerate().map(class).collect()
}

/// Round numbers that enclose a range; at least two.
fn round_numbers(steps: &[f64], low: f64, high: f64) -> Vec<f64> {
    let decades = (low.log10().floor() as i32 - 1)..=(high.log10().floor() as i32 + 1);
    // Written out and read again: 3 × 10⁻¹ is 0.3 and not 0.30000000000000004.
    let number = |step: &f64, decade: i32| format!("{step}e{decade}").parse().unwrap_or(0.0);
    let all: Vec<f64> = decades.flat_map(|d| steps.iter().map(move |s| number(s, d))).collect();
    let first = all.partition_point(|edge| *edge <= low).saturating_sub(1);
    let last = all.partition_point(|edge| *edge < high).max(first + 1).min(all.len() - 1);
    all[first..=last].to_vec()
}

/// The scale's colour at 0..1. Its blackest end is left out: it would pass for no light at all.
fn color(t: f64) -> [u8; 3] {
    let at = (0.06 + 0.94 * t) * (INFERNO.len() - 1) as f64;
    let i = (at as usize).min(INFERNO.len() - 2);
    let mix = at - i as f64;
    std::array::from_fn(|k| (f64::from(INFERNO[i][k]) * (1.0 - mix) + f64::from(INFERNO[i + 1][k]) * mix).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_are_round_and_few() {
        for (low, ratio) in (0..2000).map(|i| (1e-9 * 1.0173f64.powi(i), RANGE.powf(f64::from(i % 41) / 40.0))) {
            let (high, classes) = (low * ratio, classes(low, low * ratio));
            let (first, last) = (&classes[0], classes.last().unwrap());
            assert!((1..=MOST_CLASSES).contains(&classes.len()), "{low} {high}: {}", classes.len());
            assert!(first.from <= low && low <= first.to, "{low} {first:?}");
            assert!(last.from <= high && high <= last.to, "{high} {last:?}");
            assert!(classes.windows(2).all(|c| c[0].to == c[1].from && c[0].color != c[1].color));
        }
        let edges = |low, high| classes(low, high).iter().map(|c| c.from).collect::<Vec<_>>();
        assert_eq!(edges(7.0, 2700.0)[..4], [5.0, 10.0, 20.0, 50.0]);
        assert_eq!(edges(290.0, 520.0), [250.0, 300.0, 400.0, 500.0]);
        assert!(classes(0.0, 0.0).is_empty());
    }

    #[test]
    fn shares_of_the_area_sum_to_one() {
        let elements: Vec<(f64, f64)> = (0..1000).map(|i| (f64::from(i), 1.0 + f64::from(i % 3))).collect();
        let light = Illuminance::of(elements.clone(), Vec::new());
        assert!((light.classes.iter().map(|c| c.share).sum::<f64>() - 1.0).abs() < 1e-12);
        assert_eq!((light.largest, light.median), (999.0, 500.0));
        assert_eq!(light.class(f64::NAN), None);
        assert_eq!((light.class(0.0), light.class(1e9)), (Some(0), Some(light.classes.len() - 1)));
        let part = Illuminance::of(elements, vec![(300.0, 1.0), (400.0, 1.0)]);
        assert_eq!((part.classes[0].from, part.classes.last().map(|c| c.to)), (300.0, Some(400.0)));
        assert!((part.classes.iter().map(|c| c.share).sum::<f64>() - 1.0).abs() < 1e-12);
        // Half of the area in the dark does not take the scale from the other.
        let half = (0..100).map(|i| (if i < 50 { 1e-6 } else { 300.0 + f64::from(i) }, 1.0)).collect();
        let half = Illuminance::of(half, Vec::new());
        assert!(half.classes[0].from > 100.0 && half.class(1e-6) == Some(0) && half.classes[0].share > 0.5);
        let dark = Illuminance::of(vec![(0.0, 1.0)], Vec::new());
        assert!(dark.classes.is_empty() && dark.class(0.0).is_none() && dark.mean == 0.0 && dark.low == 0.0);
    }

    /// The least illuminance of furnished rooms was that of a crack, 0.0000 lx, and so was their uniformity.
    #[test]
    fn the_low_illuminance_is_not_that_of_cracks_and_of_what_no_light_reaches() {
        let even = |i: u32| (f64::from(i), 1.0);
        let lit: Vec<(f64, f64)> = (1..=1000).map(even).collect();
        let low = |elements: Vec<(f64, f64)>| Illuminance::of(elements, Vec::new()).low;
        assert_eq!(low(lit.clone()), 50.0);
        // As much again in the dark changes nothing, a crack hardly anything.
        assert_eq!(low((0..1000).map(|_| (0.0, 1.0)).chain(lit.clone()).collect()), 50.0);
        assert_eq!(low([(1e-9, 20.0)].into_iter().chain(lit).collect()), 31.0);
    }
}
