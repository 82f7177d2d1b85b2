//! The hemisphere of rays: cosine-distributed directions from points all over the facet (Malley 1988, "A shading method for
//! computer generated images", MSc thesis, University of Utah; catalogue 28).
//!
//! Points of the disc below a hemisphere, lifted onto it, have the density cos θ/π (Nusselt's analog backwards), so F_ij
//! is the share of M rays that meet facet j: unbiased, with no proximity or truncation, and each row sums to one with
//! what is lost. Places and directions are one Sobol' sequence with Owen scrambling in four dimensions. Independent rays
//! would have a variance of F(1 − F)/M; how far below that these are, q, is read from the two halves of the sequence and
//! pooled over the row, as two halves say little about one entry; the halves of an entry count where they differ by more.
//! What no ray met may have 3/M with a chance of 5 % (rule of three). Rays are single precision about the middle of the
//! enclosure, which moves edges by 1e-7 of its extent. It fails on small factors: off by √(F/M); errors fall with
//! M^-¾ from small facets, with M^-⅝ from large ones, where edges run through all four dimensions of the points.

use super::around::Around;
use super::points::Places;
use super::{Look, Repair, Row, RowFactors, RowMatrix};
use crate::pair::Factor;
use crate::{Progress, Stopped};
use radiosity_scene::Enclosure;
use radiosity_trace::sampling::{Sequence, cosine_direction, frame, hash};

/// The stream of sample points.
const STREAM: u32 = 0x0201;

/// Rays beyond which [`Repair::UntilError`] gives up: a row then takes some ten seconds.
const MOST_RAYS: usize = 1 << 24;

/// Standard errors that the error of a factor covers.
const DEVIATIONS: f64 = 3.0;

/// The hemisphere of rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hemisphere {
    /// M: rays of a row; a power of two, as others leave the sequence unbalanced.
    pub rays: usize,
    /// Each seed has its own rays.
    pub seed: u32,
    /// [`Repair::UntilError`] doubles the rays until the predicted errors are met.
    pub repair: Repair,
}

/// 65,536 rays leave 1e-3 of a factor of 0.1, like the cells of other methods by default.
impl Default for Hemisphere {
    fn default() -> Hemisphere {
        Hemisphere { rays: 1 << 16, seed: 0, repair: Repair::None }
    }
}

/// What the rays of a row have met: by facet (or surface) and by one of N sets as large as each other, and last what shows nothing.
pub(crate) struct Counts<const N: usize> {
    hits: Vec<[u32; N]>,
}

impl Hemisphere {
    /// With as many rays as a projection that looks like this has cells, on one square face per point along a side.
    pub fn like(look: &Look) -> Hemisphere {
        let rays = look.resolution.saturating_mul(look.resolution).saturating_mul(look.points);
        Hemisphere { rays, seed: look.spin.unwrap_or(0), repair: look.repair }
    }

    fn trace(&self, around: &Around, from: usize) -> RowFactors {
        let own = &around.enclosure.facets[from];
        let own_plane = around.in_plane_of(own);
        let frame = frame(own.normal());
        let places = Places::new(own);
        let sequence = Sequence::new(hash(hash(self.seed) ^ from as u32), STREAM);
        let inwards = around.inwards(own.radius());
        let mut counts = Counts::<2>::new(around.enclosure.facets.len());
        let mut rays = self.rays.clamp(2, MOST_RAYS).next_power_of_two();
        let mut traced = 0;
        loop {
            for index in traced..rays {
                let [u, v, x, y] = sequence.point(index as u32).map(f64::from);
                let place = own.centroid() + inwards * (places.at(x, y) - own.centroid());
                let direction = cosine_direction(&frame, u, v);
                let (item, _) = around.meets(place, direction, |facet| own_plane[facet]);
                counts.add(item, index * 2 / rays, 1);
            }
            traced = rays;
            let row = counts.row(rays);
            let is_met = match self.repair {
                Repair::UntilError(tolerance) => !row.factors.iter().any(|f| f.error > tolerance),
                _ => true,
            };
            if is_met || rays >= MOST_RAYS {
                return row;
            }
            rays *= 2;
            counts.fold();
        }
    }
}

impl Counts<2> {
    /// What was counted becomes the first half of twice as many.
    fn fold(&mut self) {
        self.hits.iter_mut().for_each(|[a, b]| (*a, *b) = (*a + *b, 0));
    }
}

impl<const N: usize> Counts<N> {
    /// Of a row of `n` facets (or surfaces).
    pub fn new(n: usize) -> Counts<N> {
        Counts { hits: vec![[0; N]; n + 1] }
    }

    pub fn add(&mut self, item: usize, set: usize, times: u32) {
        self.hits[item][set] += times;
    }

    /// Of so many rays in all.
    pub fn row(&self, rays: usize) -> RowFactors {
        let (m, n) = (rays as f64, N as f64);
        let all = |hits: &[u32; N]| hits.iter().map(|h| f64::from(*h)).sum::<f64>();
        let share = |hits: &[u32; N]| all(hits) / m;
        // Of two halves: the square of half their difference. Smoothed by one hit, so that none means little.
        let between = |hits: &[u32; N]| {
            let mean = all(hits) / n;
            hits.iter().map(|h| (f64::from(*h) - mean).powi(2)).sum::<f64>() * n / (n - 1.0) / (m * m)
        };
        let binomial = |hits: &[u32; N]| {
            let smooth = (share(hits) * m + 1.0) / (m + 2.0);
            smooth * (1.0 - smooth) / m
        };
        let met = || self.hits.iter().filter(|hits| all(hits) > 0.0);
        let q = (met().map(between).sum::<f64>() / met().map(binomial).sum::<f64>()).clamp(1.0 / m.sqrt(), 1.0);
        let factor = |hits: &[u32; N]| {
            let few = if all(hits) == 0.0 { 1.0 } else { q };
            let error = DEVIATIONS * (few * binomial(hits)).max(between(hits)).sqrt();
            Factor { value: share(hits), error }
        };
        let (lost, facets) = self.hits.split_last().expect("there is always nothing");
        RowFactors { factors: facets.iter().map(factor).collect(), lost: share(lost), captured: 1.0 }
    }
}

impl Row for Hemisphere {
    fn row(&self, from: usize, enclosure: &Enclosure) -> RowFactors {
        self.trace(&Around::new(enclosure), from)
    }

    fn rows(&self, enclosure: &Enclosure, progress: &dyn Progress) -> Result<RowMatrix, Stopped> {
        let around = Around::new(enclosure);
        RowMatrix::collect(enclosure, progress, || (), |(), from| self.trace(&around, from))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::tests::{ADJACENT, OPPOSITE, box_of, room_with_block};
    use crate::row::view::View;
    use glam::DVec3;
    use radiosity_scene::Facet;

    /// Mean and spread over seeds against the exact factors of a cube: no bias (five standard errors, one false alarm in
    /// a million), never worse than independent rays, and better the more there are.
    #[test]
    fn catalogue_28_rays_are_unbiased_and_better_than_random() {
        let cube = box_of(DVec3::ONE, 1);
        let seeds = 64;
        let mut roots = Vec::new();
        for log in [6, 8, 10, 12] {
            let rays = 1 << log;
            let errors: Vec<f64> = (0..seeds)
                .flat_map(|seed| {
                    let row = Hemisphere { rays, seed, ..Hemisphere::default() }.row(0, &cube);
                    assert_eq!(row.factors.iter().map(|f| f.value).sum::<f64>(), 1.0);
                    [row.factors[1].value - OPPOSITE, row.factors[2].value - ADJACENT]
                })
                .collect();
            for k in 0..2 {
                let of = || errors.iter().skip(k).step_by(2);
                let mean = of().sum::<f64>() / f64::from(seeds);
                let root = (of().map(|e| e * e).sum::<f64>() / f64::from(seeds)).sqrt();
                assert!(mean.abs() < 5.0 * root / f64::from(seeds).sqrt(), "{rays}: {mean} ± {root}");
                assert!(root < (0.16 / rays as f64).sqrt(), "{rays}: {root}");
            }
            roots.push((errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt());
        }
        let slope = (roots[3] / roots[0]).ln() / 64f64.ln();
        assert!(slope < -0.6, "{slope} of {roots:?}");
    }

    /// Errors of all entries of a row fall with M^(-1/2 - 1/(2d)) where what is met has edges in d dimensions of the points:
    /// two from a small facet (the criterion of the catalogue), four from a large one (-5/8), where places matter as well.
    #[test]
    fn catalogue_28_errors_fall_faster_than_of_random_rays() {
        let mut cube = box_of(DVec3::ONE, 4);
        let corners =
            [[0., 0.], [1., 0.], [1., 1.], [0., 1.]].map(|[x, y]| DVec3::new(0.44 + 1e-3 * x, 0.4 + 1e-3 * y, 0.1));
        let small = Facet::new(corners.to_vec()).unwrap();
        let to = |j: usize| View::new(&cube).potential(small.centroid(), small.normal(), j, 0.0);
        let exact: Vec<f64> = (0..cube.facets.len()).map(to).collect();
        cube.add("small", small);
        let root = |rays: usize| {
            let rows = (0..32).map(|seed| Hemisphere { rays, seed, ..Hemisphere::default() }.row(96, &cube));
            let square =
                |row: RowFactors| row.factors.iter().zip(&exact).map(|(f, e)| (f.value - e).powi(2)).sum::<f64>();
            (rows.map(square).sum::<f64>() / 32.0).sqrt()
        };
        let slope = (root(1 << 13) / root(1 << 5)).ln() / 256f64.ln();
        assert!(slope < -0.75, "{slope}");
    }

    /// Closed rooms lose nothing, and the errors stated are met.
    #[test]
    fn catalogue_28_rows_of_closed_rooms_sum_to_one() {
        let room = room_with_block(2);
        let rays = Hemisphere { rays: 4096, ..Hemisphere::default() };
        let matrix = rays.rows(&room, &()).unwrap();
        for i in 0..matrix.len() {
            assert_eq!((matrix.row(i).iter().sum::<f64>(), matrix.lost[i]), (1.0, 0.0), "row {i}");
        }
        let reference = Hemisphere { rays: 1 << 16, seed: 1, ..rays }.rows(&room, &()).unwrap();
        let pairs = matrix.factors.iter().zip(&reference.factors).zip(&matrix.errors);
        let covered = pairs.filter(|((a, b), error)| (*a - *b).abs() <= **error).count();
        assert!(covered as f64 >= 0.97 * matrix.factors.len() as f64, "{covered} of {}", matrix.factors.len());
    }

    #[test]
    fn rays_are_doubled_until_the_error_is_met() {
        let cube = box_of(DVec3::ONE, 1);
        for tolerance in [1e-2, 1e-3] {
            let repair = Repair::UntilError(tolerance);
            let row = Hemisphere { rays: 16, repair, ..Hemisphere::default() }.row(2, &cube);
            assert!(row.factors.iter().all(|f| f.error <= tolerance));
            assert!((row.factors[3].value - OPPOSITE).abs() <= tolerance);
        }
    }
}
