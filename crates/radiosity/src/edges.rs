//! Edges of shadows within pixels.
//!
//! A pixel has the direct light of one place of each surface that it shows (`pixels.rs`), so that hard shadows would have steps, and
//! those narrower than a pixel would be dashed. Where that light differs much from a neighbouring pixel's on the same surface,
//! it is found at all samples that the pixel has of the surface, and so it is around these, as far as samples differ: lines go on
//! (adaptive supersampling, Whitted 1980, "An improved illumination model for shaded display", of shadows alone).

use crate::Error;
use crate::allocation::Lit;
use crate::pixels::{DARK, around, lies_on, pixel, seen};
use radiosity_scene::{Bands, Camera, luminance};
use radiosity_trace::{Place, Tracer};
use radiosity_view::picture::{Seen, ViewRays};
use rayon::prelude::*;

/// By how much light differs at an edge, relative to all the light of a band there: with 0.05 penumbrae a dozen pixels wide would count as edges.
const CONTRAST: f32 = 0.1;

/// The same where shadow rays leave noise: with 0.3 lines break off where they cross a soft shadow.
const NOISY: f32 = 0.2;

/// Places whose samples are held at once.
const PORTION: usize = 1 << 15;

/// Direct light of places, beside which there is `indirect` light, with its edges within pixels.
pub(crate) struct Edges<'a> {
    view: &'a ViewRays,
    indirect: &'a [Bands],
    dark: f32,
    /// Number of the first place of each pixel, and of all.
    first: Vec<u32>,
    /// What places are given, and whether their samples were asked.
    light: Vec<Bands>,
    is_sampled: Vec<bool>,
    /// Whether it has no noise: where it has, what differs need be no edge.
    is_exact: Vec<bool>,
}

impl<'a> Edges<'a> {
    /// Edges in the direct `light` of single places.
    pub fn new(view: &'a ViewRays, indirect: &'a [Bands], Lit { light, is_exact }: Lit) -> Edges<'a> {
        let mut first = vec![0; view.sky.len() + 1];
        view.seen.iter().for_each(|seen| first[seen.pixel as usize + 1] += 1);
        (1..first.len()).for_each(|pixel| first[pixel] += first[pixel - 1]);
        let sum: f64 = light.iter().chain(indirect).map(|light| f64::from(luminance(*light))).sum();
        let dark = (DARK * sum / light.len().max(1) as f64) as f32;
        Edges { view, indirect, dark, first, is_sampled: vec![false; light.len()], is_exact, light }
    }

    /// Places whose light differs much from that of a neighbouring pixel.
    pub fn sharp(&self) -> Vec<u32> {
        let is_sharp = |place: &u32| self.beside(*place).any(|other| self.differs(*place, other));
        (0..self.light.len() as u32).into_par_iter().filter(is_sharp).collect()
    }

    /// Places that lie beside a place on the same surface.
    fn beside(&self, place: u32) -> impl Iterator<Item = u32> {
        let is_inside = move |[x, y]: &[u32; 2]| *x < self.view.width && *y < self.view.height;
        around(pixel(self.view, place))
            .filter(is_inside)
            .flat_map(move |[x, y]| {
                let pixel = (y * self.view.width + x) as usize;
                self.first[pixel]..self.first[pixel + 1]
            })
            .filter(move |other| lies_on(seen(self.view, place), seen(self.view, *other)))
    }

    /// Whether direct light of two places differs much, and not by its noise.
    fn differs(&self, place: u32, other: u32) -> bool {
        let of = |place: u32| (self.light[place as usize], self.is_exact[place as usize]);
        let ((own, is_exact), (other, is_exact_too)) = (of(place), of(other));
        self.departs(place, (own, other), if is_exact && is_exact_too { CONTRAST } else { NOISY })
    }

    /// Whether two values of direct light at a place differ by more than some contrast.
    fn departs(&self, place: u32, (one, other): (Bands, Bands), contrast: f32) -> bool {
        let indirect = self.indirect[place as usize];
        let all: Bands = std::array::from_fn(|band| indirect[band] + one[band].max(other[band]));
        let least = luminance(all).max(self.dark);
        (0..3).any(|band| (one[band] - other[band]).abs() > contrast * all[band].max(least))
    }

    /// Finds light at all samples of some places, given in order, by `light_of`; answers those beside them that are to be looked at next.
    ///
    /// # Errors
    /// Those of `light_of`.
    pub fn sample(
        &mut self,
        (tracer, camera): (&Tracer, &Camera),
        places: &[u32],
        light_of: impl Fn(&[Place]) -> Result<Lit, Error>,
    ) -> Result<Vec<u32>, Error> {
        places.iter().for_each(|place| self.is_sampled[*place as usize] = true);
        let mut crossed = Vec::new();
        for some in places.chunks(PORTION) {
            let (of, samples): (Vec<u32>, Vec<Seen>) = self.view.samples(tracer, camera, some).into_iter().unzip();
            let lit = light_of(&samples.iter().map(|seen| seen.place).collect::<Vec<_>>())?;
            let mut begin = 0;
            for of_place in of.chunk_by(|a, b| a == b) {
                let (place, own) = (of_place[0], begin..begin + of_place.len());
                begin = own.end;
                let is_exact = lit.is_exact[own.clone()].iter().all(|is_exact| *is_exact);
                let light = &lit.light[own.clone()];
                if is_exact && light.iter().any(|sample| self.departs(place, (light[0], *sample), CONTRAST)) {
                    crossed.push(place);
                }
                let mean = mean(&samples[own], light);
                let at = place as usize;
                // Few rays at each sample have more noise together than many at one place.
                if is_exact || self.departs(place, (self.light[at], mean), CONTRAST) {
                    (self.light[at], self.is_exact[at]) = (mean, is_exact);
                }
            }
        }
        // What crosses a pixel goes on, however little of the next one it fills.
        let is_left = |other: &u32| !self.is_sampled[*other as usize];
        let beside = |place: &u32| self.beside(*place).filter(is_left).collect::<Vec<u32>>();
        let sharp_beside = |place: &u32| {
            let is_next = |other: &u32| is_left(other) && self.differs(*place, *other);
            self.beside(*place).filter(is_next).collect::<Vec<u32>>()
        };
        let mut next: Vec<u32> = crossed.par_iter().flat_map_iter(beside).collect();
        next.par_extend(places.par_iter().flat_map_iter(sharp_beside));
        next.sort_unstable();
        next.dedup();
        Ok(next)
    }

    /// How many samples some places have at the most.
    pub fn most_samples(&self, places: &[u32]) -> f64 {
        places.len() as f64 * f64::from(self.view.grid.pow(2))
    }

    /// What places are given.
    pub fn light(self) -> Vec<Bands> {
        self.light
    }
}

/// The light that gives what samples give together.
fn mean(samples: &[Seen], light: &[Bands]) -> Bands {
    std::array::from_fn(|band| {
        let all: f32 = samples.iter().map(|seen| seen.response[band]).sum();
        let given: f32 = samples.iter().zip(light).map(|(seen, light)| seen.response[band] * light[band]).sum();
        if all > 0.0 { given / all } else { light.iter().map(|light| light[band]).sum::<f32>() / light.len() as f32 }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};
    use radiosity_scene::{Material, Mesh, Scene};

    const SIZE: u32 = 64;

    /// A picture of a floor from above, one pixel for each of so many units of length.
    fn seen_from_above(work: impl Fn(&Tracer, &Camera, &ViewRays)) {
        let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
        let side = f64::from(SIZE);
        let corners = [[0., 0., 0.], [side, 0., 0.], [side, side, 0.], [0., side, 0.]];
        scene.add_quad("floor", 0, corners.map(DVec3::from));
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let middle = DVec3::new(side / 2.0, side / 2.0, 0.0);
        // So far away that all that is seen of the floor is a unit in each pixel.
        let camera = Camera::look_at("eye", middle + DVec3::Z * side, middle, DVec3::Y, 2.0 * 0.5f64.atan());
        work(&tracer, &camera, &ViewRays::new(&tracer, &camera, SIZE, SIZE));
    }

    /// Softened light of a floor that has `light` at its places, with or without noise; and how many of them were sampled.
    fn softened(
        (tracer, camera, view): (&Tracer, &Camera, &ViewRays),
        is_exact: bool,
        light: impl Fn(DVec3) -> Bands + Sync,
    ) -> (Vec<Bands>, usize) {
        let of = |places: &[Place]| Lit {
            light: places.iter().map(|place| light(place.point)).collect(),
            is_exact: vec![is_exact; places.len()],
        };
        let single = of(&view.seen.iter().map(|seen| seen.place).collect::<Vec<_>>());
        let indirect = vec![[0.0; 3]; view.seen.len()];
        let mut edges = Edges::new(view, &indirect, single);
        let (mut sharp, mut count) = (edges.sharp(), 0);
        while !sharp.is_empty() {
            count += sharp.len();
            sharp = edges.sample((tracer, camera), &sharp, |places| Ok(of(places))).unwrap();
        }
        (edges.light(), count)
    }

    /// Pixels at the edge of a shadow have the mean of their samples, those off it their own light.
    #[test]
    fn edges_have_the_values_between() {
        let normal = DVec3::new(0.9, 0.3, 0.0).normalize();
        let from = |at: DVec3| normal.dot(at) - 31.3;
        seen_from_above(|tracer, camera, view| {
            assert_eq!(view.seen.len(), (SIZE * SIZE) as usize);
            let (lit, _) = softened((tracer, camera, view), true, |at| [if from(at) < 0.0 { 100.0 } else { 20.0 }; 3]);
            let mut between = 0;
            for (seen, [e, ..]) in view.seen.iter().zip(&lit) {
                // Its place is its first sample.
                let distance = from(seen.place.point + DVec3::new(0.09375, -0.09375, 0.0));
                let expected = if distance < 0.0 { 100.0 } else { 20.0 };
                assert!(distance.abs() < 0.8 || (e - expected).abs() < 1e-3, "{distance} {e}");
                // Of sixteen samples of a square of one unit, the part on the lit side, to within three of them.
                let part = (0.5 - distance / (normal.x + normal.y)).clamp(0.0, 1.0);
                assert!((f64::from(*e) - (20.0 + 80.0 * part)).abs() < 80.0 * 0.2, "{distance} {e}");
                between += usize::from((25.0..95.0).contains(e));
            }
            assert!(between > SIZE as usize / 2, "{between}");
        });
    }

    /// A line a third of a pixel wide, which single places meet here and there, goes from end to end, as dark as it is wide.
    #[test]
    fn lines_narrower_than_a_pixel_are_not_dashed() {
        let turn = DMat3::from_rotation_z(0.13);
        let is_dark = |at: DVec3| ((turn * at).x - 26.2).abs() < 0.17;
        seen_from_above(|tracer, camera, view| {
            let (lit, _) = softened((tracer, camera, view), true, |at| [if is_dark(at) { 0.0 } else { 100.0 }; 3]);
            let mut before = 0;
            for row in 0..SIZE as usize {
                let of_row = row * SIZE as usize..(row + 1) * SIZE as usize;
                let missing: f32 = lit[of_row.clone()].iter().map(|[e, ..]| 100.0 - e).sum();
                // Its width across a row, 0.34 / cos 0.13 or five to six of sixteen columns of samples, to within two of them.
                assert!((21.0..48.0).contains(&missing), "{row}: {missing}");
                before += usize::from(view.seen[of_row].iter().any(|seen| is_dark(seen.place.point)));
            }
            // So it would be otherwise.
            assert!(before < 40, "{before}");
        });
    }

    /// Light that changes by a few percent from pixel to pixel is no edge, in whichever colour; nor are twice as many where there is noise.
    #[test]
    fn smooth_light_stays_as_it_is() {
        let slope = |at: DVec3| 50.0 + 3.0 * at.x as f32 + 0.3 * at.y as f32;
        seen_from_above(|tracer, camera, view| {
            for color in [[1.0; 3], [0.0, 0.0, 1.0], [1.0, 0.3, 0.0]] {
                let light = |at: DVec3| color.map(|c| c * slope(at));
                let (lit, count) = softened((tracer, camera, view), true, light);
                assert!(view.seen.iter().zip(lit).all(|(seen, e)| e == light(seen.place.point)));
                assert_eq!(count, 0);
            }
            let grainy = |at: DVec3| [if (at.x as u32 + at.y as u32).is_multiple_of(2) { 100.0 } else { 85.0 }; 3];
            assert_eq!(softened((tracer, camera, view), false, grainy).1, 0);
            assert!(softened((tracer, camera, view), true, grainy).1 > 4000);
        });
    }

    /// Where there is noise, samples count only if they depart much from what was found with more rays.
    #[test]
    fn samples_with_noise_count_at_edges_alone() {
        seen_from_above(|tracer, camera, view| {
            let places = view.seen.len();
            let beside = |seen: &Seen| seen.place.point.x > 32.0;
            let light = view.seen.iter().map(|seen| [if beside(seen) { 20.0 } else { 100.0 }; 3]).collect();
            let indirect = vec![[0.0; 3]; places];
            for (found, expected) in [(95.0, 100.0), (60.0, 60.0)] {
                let mut edges =
                    Edges::new(view, &indirect, Lit { is_exact: vec![false; places], light: Vec::clone(&light) });
                let sharp: Vec<u32> =
                    edges.sharp().into_iter().filter(|&place| !beside(&view.seen[place as usize])).collect();
                assert_eq!(sharp.len(), SIZE as usize);
                let of = |places: &[Place]| {
                    Ok(Lit { light: vec![[found; 3]; places.len()], is_exact: vec![false; places.len()] })
                };
                edges.sample((tracer, camera), &sharp, of).unwrap();
                assert!(sharp.iter().all(|&place| (edges.light[place as usize][0] - expected).abs() < 1e-3));
            }
        });
    }
}
