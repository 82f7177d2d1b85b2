//! Reading a solution at points: direct light there and then, indirect light gathered or interpolated.

use crate::allocation::Lit;
use crate::monitor::{Monitor, Watch};
use crate::{Error, Solution};
use glam::DVec2;
use radiosity_scene::elements::ElementId;
use radiosity_scene::{Bands, Side};
use radiosity_trace::Place;
use radiosity_transport::{HalvedLight, PointReceivers, Receivers, Shadowing, Site};
use radiosity_view::Field;
use rayon::prelude::*;

/// A place on the surface, as pictures and lightmaps ask for it.
#[derive(Clone, Copy, Debug)]
pub struct Station {
    /// The point and the normal it receives with.
    pub place: Place,
    /// Barycentric coordinates on the place's triangle.
    pub uv: DVec2,
    /// Side of the triangle.
    pub side: Side,
}

/// Where the indirect light at a point comes from.
#[derive(Clone, Copy, Debug)]
pub enum Indirect<'f> {
    /// Cosine rays from the point itself, looking up what they meet: exact in contacts and corners.
    Gather {
        /// Number of rays.
        rays: usize,
    },
    /// The continuous field over the elements: smooth, and free.
    Field(&'f Field),
}

/// Irradiance at points.
#[derive(Clone, Debug, Default)]
pub struct Answer {
    /// Total irradiance, lux per band.
    pub irradiance: Vec<Bands>,
    /// Its direct part.
    pub direct: Vec<Bands>,
    /// Standard error of the gathered part, lux per band; zero for fields.
    pub standard_error: Vec<Bands>,
}

/// Places that receive light; each salt has rays of its own.
pub(crate) struct Places {
    at: Vec<Place>,
    /// Whether any light may be hidden from each: whether any shadow ray of its cell was stopped. Of places in the open nothing is known.
    shaded: Vec<bool>,
    salt: u32,
}

impl Places {
    fn points(&self) -> PointReceivers<'_> {
        PointReceivers { places: &self.at, shaded: &self.shaded, salt: self.salt }
    }
}

impl Receivers for Places {
    fn len(&self) -> usize {
        self.at.len()
    }

    fn site(&self, i: usize) -> Option<Site> {
        self.points().site(i)
    }

    fn places(&self, i: usize, wanted: u32) -> u32 {
        self.points().places(i, wanted)
    }

    fn rays(&self, i: usize, wanted: u32) -> u32 {
        self.points().rays(i, wanted)
    }

    fn near(&self, i: usize) -> Option<f64> {
        self.points().near(i)
    }

    fn seed(&self, i: usize) -> u32 {
        self.points().seed(i)
    }
}

/// Irradiance at stations whose direct light is known, by the field of indirect light.
fn read(stations: &[Station], direct: Vec<Bands>, field: &Field) -> Answer {
    let irradiance = stations
        .par_iter()
        .zip(&direct)
        .map(|(s, d)| {
            let h = field.at(s.place.triangle as usize, s.uv, s.side);
            std::array::from_fn(|band| d[band] + h[band])
        })
        .collect();
    Answer { irradiance, direct, standard_error: vec![[0.0; 3]; stations.len()] }
}

impl Solution<'_> {
    /// Irradiance at stations, direct light with the given shadow rays.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub fn at(
        &self,
        stations: &[Station],
        indirect: Indirect,
        shadowing: &Shadowing,
        monitor: &dyn Monitor,
    ) -> Result<Answer, Error> {
        let places: Vec<Place> = stations.iter().map(|s| s.place).collect();
        match indirect {
            Indirect::Gather { rays } => self.gathered(&places, rays, shadowing, monitor),
            Indirect::Field(field) => Ok(read(stations, self.direct_at(&places, shadowing, monitor)?, field)),
        }
    }

    /// Irradiance at places by a final gather of `rays` rays.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub fn gathered(
        &self,
        places: &[Place],
        rays: usize,
        shadowing: &Shadowing,
        monitor: &dyn Monitor,
    ) -> Result<Answer, Error> {
        let direct = self.direct_at(places, shadowing, monitor)?;
        let halves = self.halves_at(places, rays, 0, monitor)?;
        let mut answer = Answer { direct, ..Answer::default() };
        for (HalvedLight { light: [a, b], .. }, d) in halves.iter().zip(&answer.direct) {
            answer.irradiance.push(std::array::from_fn(|k| d[k] + 0.5 * (a[k] + b[k])));
            answer.standard_error.push(std::array::from_fn(|k| 0.5 * (a[k] - b[k]).abs()));
        }
        Ok(answer)
    }

    /// The indirect part of it, by halves of the rays; each `salt` has rays of its own.
    pub(crate) fn halves_at(
        &self,
        places: &[Place],
        rays: usize,
        salt: u32,
        monitor: &dyn Monitor,
    ) -> Result<Vec<HalvedLight>, Error> {
        self.halves_of(&PointReceivers { places, shaded: &[], salt }, rays, monitor)
    }

    /// What receivers gather, as two halves of their rays tell it.
    pub(crate) fn halves_of(
        &self,
        receivers: &impl Receivers,
        rays: usize,
        monitor: &dyn Monitor,
    ) -> Result<Vec<HalvedLight>, Error> {
        let gather = || self.gather().irradiance(receivers, rays, &Watch(monitor));
        let halves = self.stages.time(monitor, "gather", gather)?;
        Ok(halves.into_iter().map(HalvedLight::sampled).collect())
    }

    /// Direct irradiance of all lights at places.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub fn direct_at(
        &self,
        places: &[Place],
        shadowing: &Shadowing,
        monitor: &dyn Monitor,
    ) -> Result<Vec<Bands>, Error> {
        Ok(self.direct_by(places, shadowing, 0, monitor)?.light)
    }

    /// The same; each `salt` has shadow rays of its own.
    pub(crate) fn direct_by(
        &self,
        places: &[Place],
        shadowing: &Shadowing,
        salt: u32,
        monitor: &dyn Monitor,
    ) -> Result<Lit, Error> {
        self.direct_of(&self.places(places.to_vec(), salt), shadowing, monitor)
    }

    /// Direct irradiance of receivers by two halves, of so many shadow rays each.
    pub(crate) fn direct_halves_of(
        &self,
        receivers: &impl Receivers,
        shadowing: &Shadowing,
        monitor: &dyn Monitor,
    ) -> Result<Vec<HalvedLight>, Error> {
        let halves = || self.luminaires.halves(self.tracer(), receivers, shadowing, &Watch(monitor));
        Ok(self.stages.time(monitor, "direct light", halves)?)
    }

    /// Direct irradiance of receivers.
    pub(crate) fn direct_of(
        &self,
        receivers: &impl Receivers,
        shadowing: &Shadowing,
        monitor: &dyn Monitor,
    ) -> Result<Lit, Error> {
        let columns = self.stages.time(monitor, "direct light", || {
            self.luminaires.columns(self.tracer(), receivers, shadowing, &Watch(monitor))
        })?;
        let (light, is_exact) = (0..receivers.len()).map(|i| (columns.mean(i), columns.is_exact(i))).unzip();
        Ok(Lit { light, is_exact })
    }

    /// Places as receivers.
    pub(crate) fn places(&self, at: Vec<Place>, salt: u32) -> Places {
        let may_be_shaded = |place: &Place| {
            self.element_at(place).is_none_or(|element| {
                let mut cell = self.elements.of_cell(self.elements.cell(element));
                cell.any(|e| self.columns.is_shaded(e as usize))
            })
        };
        let shaded = at.par_iter().map(may_be_shaded).collect();
        Places { at, shaded, salt }
    }

    /// Irradiance of the elements that places lie on, lux per band; 0 in the open.
    pub(crate) fn irradiance_at(&self, places: &[Place]) -> Vec<Bands> {
        let at = |place| self.element_at(place).map_or([0.0; 3], |e| self.irradiance()[e as usize]);
        places.iter().map(at).collect()
    }

    /// The element that a place lies on; none in the open.
    pub(crate) fn element_at(&self, place: &Place) -> Option<ElementId> {
        let mesh = self.tracer().mesh;
        let triangle = place.triangle as usize;
        if triangle >= mesh.triangles.len() {
            return None;
        }
        let side = if mesh.normal(triangle).dot(place.normal) >= 0.0 { Side::Front } else { Side::Back };
        let uv = mesh.barycentric(triangle, place.point).as_vec2();
        self.elements.at(place.triangle, uv.x, uv.y, side)
    }
}
