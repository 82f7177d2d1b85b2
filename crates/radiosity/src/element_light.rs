//! Light of elements that are finer than those that were solved for: means over their areas, by a final gather.

use crate::measure::ENOUGH;
use crate::points::{Asked, Light, Rays};
use crate::{Error, Monitor, Solution};
use glam::DVec3;
use radiosity_scene::{Bands, ElementId, Elements, Side};
use radiosity_trace::sampling::hash;
use radiosity_trace::{Place, Tracer};
use radiosity_transport::{ElementReceivers, Exposure, Receivers, Shadowing, Site};
use radiosity_view::Planes;

/// Gather rays and shadow rays of an element to begin with, those of both halves. Neighbours share them.
const FIRST: Rays = [16, 32];

/// Shadow rays from each place of an element: the fewest with which what sees all of a single light has no noise.
const FROM_EACH: usize = 4;

/// Of elements that were asked for those that are not buried.
struct Open<'a> {
    all: ElementReceivers<'a>,
    own: Vec<ElementId>,
}

/// Some of them; each `salt` has rays of its own.
struct Part<'a> {
    open: &'a Open<'a>,
    own: &'a [usize],
    salt: u32,
}

impl Receivers for Part<'_> {
    fn len(&self) -> usize {
        self.own.len()
    }

    fn site(&self, i: usize) -> Option<Site> {
        self.open.all.site(self.open.own[self.own[i]] as usize)
    }

    fn buried(&self, tracer: &Tracer, place: &Place, seed: u32) -> bool {
        self.open.all.buried(tracer, place, seed)
    }

    fn places(&self, _i: usize, wanted: u32) -> u32 {
        wanted
    }

    /// Nobody looks them up.
    fn near(&self, _i: usize) -> Option<f64> {
        None
    }

    fn seed(&self, i: usize) -> u32 {
        hash(hash(self.open.own[self.own[i]]) ^ self.salt)
    }
}

impl Asked for Open<'_> {
    const SHARES_DIRECT: bool = true;
    const MOST_NOISE: f64 = f64::INFINITY;

    fn len(&self) -> usize {
        self.own.len()
    }

    fn weight(&self, i: usize) -> f64 {
        let ElementReceivers { mesh, elements, exposure } = self.all;
        elements.area(mesh, self.own[i]) * exposure.share(self.own[i])
    }

    fn on(&self, _: &Solution, i: usize) -> Option<(DVec3, usize, Side)> {
        let (triangle, side) = self.all.elements.place(self.own[i]);
        Some((self.all.elements.centre(self.all.mesh, self.own[i]), triangle, side))
    }

    fn planes(&self, _: &Solution) -> Planes {
        Planes::new(self.all.mesh, self.all.elements)
    }

    type Some<'s>
        = Part<'s>
    where
        Self: 's;
    fn some<'s>(&'s self, _: &Solution, own: &'s [usize], salt: u32) -> Part<'s> {
        Part { open: self, own, salt }
    }

    fn shadowing(rays: usize) -> Shadowing {
        Shadowing { places: rays.div_ceil(FROM_EACH) as u32, rays: FROM_EACH as u32 }
    }
}

/// Light of elements ([`Solution::light_of`]).
#[derive(Clone, Debug)]
pub struct ElementLight {
    /// Mean irradiance over what is exposed of each, lux per band; nothing where all of it is buried.
    pub irradiance: Vec<Bands>,
    /// What rays leave of noise: root mean square over the exposed area, relative to that of the light. What the solution is off comes
    /// on top of it.
    pub noise: f64,
}

impl Solution<'_> {
    /// Mean irradiance of each of `elements`, with so much `noise` relative to the root mean square over all, or about a tenth more; with
    /// more than that, which is told, where further rays bring nothing. Elements may be much finer than those that the solution was found on,
    /// which are only looked up ([`SolveOptions::looked_up`](crate::SolveOptions::looked_up)): light of elements is smooth, and neighbours share
    /// it. Strips that are buried and narrower than an eighth of an element are black for what is gathered.
    ///
    /// ```
    /// use radiosity::transport::Exposure;
    /// use radiosity::{Elements, Mesh, Solution, SolveOptions, Tracer, cornell_box};
    ///
    /// let scene = cornell_box();
    /// let mesh = Mesh::new(&scene);
    /// let tracer = Tracer::new(&scene, &mesh);
    /// let options = SolveOptions { looked_up: true, cells: 1000, rays: 16, ..SolveOptions::default() };
    /// let solution = Solution::new(&tracer, &options, &()).unwrap();
    /// let elements = Elements::new(&scene, &mesh, 0.2);
    /// let exposure = Exposure::new(&tracer, &mesh, &elements, &()).unwrap();
    /// let light = solution.light_of(&elements, &exposure, 0.02, &()).unwrap();
    /// assert_eq!(light.irradiance.len(), elements.len());
    /// assert!(light.noise < 0.025);
    /// ```
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub fn light_of(
        &self,
        elements: &Elements,
        exposure: &Exposure,
        noise: f64,
        monitor: &dyn Monitor,
    ) -> Result<ElementLight, Error> {
        let own: Vec<ElementId> = (0..elements.len() as ElementId).filter(|e| !exposure.is_buried(*e)).collect();
        let all = ElementReceivers { mesh: self.tracer().mesh, elements, exposure };
        let mut light = Light::new(self, Open { all, own }, FIRST, monitor)?;
        let mut size = light.size();
        while light.noise() > ENOUGH * noise * size && light.grow(self, noise * size, None, monitor)? {
            size = light.size();
        }
        let mut irradiance = vec![[0.0; 3]; elements.len()];
        let found = light.asked().own.iter().zip(light.irradiance());
        found.for_each(|(e, found)| irradiance[*e as usize] = found);
        Ok(ElementLight { irradiance, noise: if size > 0.0 { light.noise() / size } else { 0.0 } })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Material, Mesh, SolveOptions, cornell_box};
    use radiosity_scene::luminance;
    use radiosity_transport::exposure::is_buried;
    use radiosity_view::Referee;

    /// In the Cornell box, with a rug 2 mm above its floor: means are those of the path tracer within the noise that is asked and what the
    /// solution is off, and beneath the rug it is dark to a twentieth of the light around.
    #[test]
    fn means_are_those_of_the_path_tracer_even_beneath_a_rug() {
        let mut scene = cornell_box();
        scene.materials.push(Material { double_sided: true, ..Material::default() });
        let rug = [[0.32, 0.002, 0.03], [0.32, 0.002, 0.21], [0.51, 0.002, 0.21], [0.51, 0.002, 0.03]];
        scene.add_quad("rug", scene.materials.len() - 1, rug.map(DVec3::from));
        let mesh = Mesh::new(&scene);
        let tracer = Tracer::new(&scene, &mesh);
        let options = SolveOptions { looked_up: true, cells: 4000, rays: 16, ..SolveOptions::default() };
        let solution = Solution::new(&tracer, &options, &()).unwrap();
        let elements = Elements::new(&scene, &mesh, 0.05);
        let exposure = Exposure::new(&tracer, &mesh, &elements, &()).unwrap();
        let light = solution.light_of(&elements, &exposure, 0.01, &()).unwrap();
        assert!(light.noise < 0.013, "{}", light.noise);

        let receivers = ElementReceivers { mesh: &mesh, elements: &elements, exposure: &exposure };
        let referee = Referee::new(&tracer);
        let (mut off, mut size, mut all, mut dark) = (0.0, 0.0, 0.0, Vec::new());
        for (e, light) in light.irradiance.iter().enumerate() {
            let Some(site) = receivers.site(e) else {
                assert_eq!(*light, [0.0; 3]);
                continue;
            };
            let counts = |place: &Place| !is_buried(&tracer, place, e as u32);
            let mean = |half: u64| {
                let found = referee.mean_irradiance(|[x, y]| site.place(x, y), counts, 256, half << 32 | e as u64);
                f64::from(luminance(found))
            };
            let (h, a, b) = (f64::from(luminance(*light)), mean(1), mean(2));
            let area = elements.area(&mesh, e as u32) * exposure.share(e as u32);
            off += area * (h - a) * (h - b);
            size += area * a * b;
            all += area;
            let centre = elements.centre(&mesh, e as u32);
            let is_beneath = site.normal.y < -0.9 && centre.y < 0.01;
            if is_beneath && (0.36..0.47).contains(&centre.x) && (0.07..0.17).contains(&centre.z) {
                dark.push((h, 0.5 * (a + b)));
            }
        }
        let error = (off / size).sqrt();
        assert!(error < 0.02, "{error}");
        let around = (size / all).sqrt();
        assert!(!dark.is_empty());
        for (h, truth) in dark {
            assert!((h - truth).abs() < 0.05 * around, "{h} instead of {truth}, {around} around");
        }
    }
}
