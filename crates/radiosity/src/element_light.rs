//! Light of elements that are finer than those that were solved for: means over their areas, by a final gather.

use crate::measure::ENOUGH;
use crate::monitor::Watch;
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

/// Shadow rays from each place of an element: the fewest with which what sees all of a light has no noise.
const FROM_EACH: usize = 4;

/// Elements that are not buried, on the elements that were asked for.
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

    fn direct(
        &self,
        solution: &Solution,
        own: &[usize],
        (rays, salt): (usize, u32),
        monitor: &dyn Monitor,
    ) -> Result<Vec<Bands>, Error> {
        let receivers = Part { open: self, own, salt };
        let shadowing = Shadowing { places: rays.div_ceil(FROM_EACH) as u32, rays: FROM_EACH as u32 };
        let columns = solution.stages.time(monitor, "direct light", || {
            solution.luminaires.columns(solution.tracer(), &receivers, &shadowing, &Watch(monitor))
        })?;
        Ok((0..own.len()).map(|i| columns.mean(i)).collect())
    }

    fn gathered(
        &self,
        solution: &Solution,
        own: &[usize],
        (rays, salt): (usize, u32),
        monitor: &dyn Monitor,
    ) -> Result<Vec<[Bands; 2]>, Error> {
        let receivers = Part { open: self, own, salt };
        let gather = || solution.gather().irradiance(&receivers, rays, &Watch(monitor));
        Ok(solution.stages.time(monitor, "gather", gather)?)
    }
}

impl Solution<'_> {
    /// Mean irradiance over what is exposed of each of `elements`, lux per band, with so much `noise` relative to the root mean square over
    /// all; nothing where an element is buried. They may be much finer than those that the solution was found on, which are only looked
    /// up ([`SolveOptions::looked_up`](crate::SolveOptions::looked_up)): light of elements is smooth, and neighbours share it. What the
    /// solution itself is off comes on top of the noise.
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
    /// assert_eq!(light.len(), elements.len());
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
    ) -> Result<Vec<Bands>, Error> {
        let own: Vec<ElementId> = (0..elements.len() as ElementId).filter(|e| !exposure.is_buried(*e)).collect();
        let all = ElementReceivers { mesh: self.tracer().mesh, elements, exposure };
        let mut light = Light::new(self, Open { all, own: own.clone() }, FIRST, monitor)?;
        let asked = noise * light.size();
        while light.noise() > ENOUGH * asked && light.grow(self, asked, None, monitor)? {}
        let mut irradiance = vec![[0.0; 3]; elements.len()];
        own.into_iter().zip(light.irradiance()).for_each(|(e, found)| irradiance[e as usize] = found);
        Ok(irradiance)
    }
}
