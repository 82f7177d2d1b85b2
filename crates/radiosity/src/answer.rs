//! Reading a solution at points: direct light there and then, indirect light gathered or interpolated.

use crate::monitor::{Monitor, Watch};
use crate::{Error, Solution};
use glam::{DVec2, DVec3};
use radiosity_scene::{Bands, Side, luminance};
use radiosity_trace::Place;
use radiosity_transport::{CurvedReceivers, ElementReceivers, PointReceivers, Shadowing};
use radiosity_view::Field;
use radiosity_view::picture::shading_normal;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Elements are flat where normals differ from theirs by less than this cosine, that of half a degree: light that comes from
/// one side changes by less than one percent.
const FLAT: f64 = 0.99996;

/// Fewest rays that gather for an element.
const LEAST_RAYS: usize = 8;

/// Most rays that gather for a cell that is looked at.
const MOST_RAYS: usize = 4096;

/// By how much the continuous field lessens the noise of cells: a corner is the mean of some six of them.
pub(crate) const SMOOTHING: f64 = 2.4;

/// An element, and the unit normals at its corners that it receives with.
type Curved = (u32, [DVec3; 3]);

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

impl Solution<'_> {
    /// The continuous field of the indirect irradiance, as points of the surfaces receive it.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub fn indirect_field(&self, monitor: &dyn Monitor) -> Result<Field, Error> {
        Ok(self.field_of(&self.received(monitor)?))
    }

    /// The same where cells are looked at, each as often as `looks` says: its noise, relative to the light of each cell, is at
    /// most `error` in the root mean square over all looks. Where the rows leave more, the cells gather it anew.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub fn indirect_field_on(&self, looks: &[u32], error: f64, monitor: &dyn Monitor) -> Result<Field, Error> {
        let mut light = self.received(monitor)?;
        let around = Field::around(self.tracer().mesh, &self.elements, looks);
        let elements = (0..around.len()).filter(|cell| around[*cell]).flat_map(|cell| self.elements.of_cell(cell));
        let seen: Vec<Curved> = elements.map(|element| (element, self.shading_normals(element))).collect();
        let mut rays = self.rays();
        while self.noise(looks, &light) / SMOOTHING > error && rays < MOST_RAYS {
            rays *= 2;
            self.gather_on(&seen, rays, &mut light, monitor)?;
        }
        Ok(self.field_of(&light))
    }

    /// Indirect irradiance of each element, by two halves of its rays. Elements that stand for a curved surface gather it anew
    /// with its normals: by those of its facets it would show bands.
    fn received(&self, monitor: &dyn Monitor) -> Result<Vec<[Bands; 2]>, Error> {
        let curved: Vec<Curved> = (0..self.elements.len() as u32)
            .into_par_iter()
            .map(|element| (element, self.shading_normals(element)))
            .filter(|(element, normals)| {
                let own = self.elements.normal(self.tracer().mesh, *element);
                normals.iter().any(|normal| normal.dot(own) < FLAT)
            })
            .collect();
        let mut light = self.indirect_halves();
        self.gather_on(&curved, self.rays(), &mut light, monitor)?;
        Ok(light)
    }

    /// Relative standard error of the irradiance of cells, in the root mean square over all looks at them.
    fn noise(&self, looks: &[u32], light: &[[Bands; 2]]) -> f64 {
        let (mut noise, mut count) = (0.0, 0.0);
        for (element, halves) in light.iter().enumerate() {
            let looks = f64::from(looks[self.elements.cell(element as u32)]);
            let [a, b] = halves.map(|half| f64::from(luminance(half)));
            let both = a + b + 2.0 * f64::from(luminance(self.columns.mean(element)));
            if both > 0.0 {
                noise += looks * ((a - b) / both).powi(2);
                count += looks;
            }
        }
        (noise / f64::max(count, 1.0)).sqrt()
    }

    fn field_of(&self, light: &[[Bands; 2]]) -> Field {
        let mean = |[a, b]: &[Bands; 2]| std::array::from_fn(|band| 0.5 * (a[band] + b[band]));
        let indirect: Vec<Bands> = light.iter().map(mean).collect();
        Field::new(self.tracer().mesh, &self.elements, &indirect, &self.exposed_area())
    }

    /// Puts what elements gather with `rays` rays per cell into `light`.
    fn gather_on(
        &self,
        elements: &[Curved],
        rays: usize,
        light: &mut [[Bands; 2]],
        monitor: &dyn Monitor,
    ) -> Result<(), Error> {
        let all = ElementReceivers { mesh: self.tracer().mesh, elements: &self.elements, exposure: &self.exposure };
        // Elements of a divided cell share its rays.
        let mut by_pieces: BTreeMap<u32, Vec<Curved>> = BTreeMap::new();
        for element in elements {
            by_pieces.entry(self.elements.pieces(element.0)).or_default().push(*element);
        }
        for (pieces, curved) in &by_pieces {
            let receivers = CurvedReceivers { all: &all, curved };
            let rays = (rays / *pieces as usize).max(LEAST_RAYS);
            let gather = || self.gather().irradiance(&receivers, rays, &Watch(monitor));
            for ((element, _), halves) in curved.iter().zip(self.stages.time(monitor, "gather on surfaces", gather)?) {
                light[*element as usize] = halves;
            }
        }
        Ok(())
    }

    /// The normals that light is received with at an element's corners.
    fn shading_normals(&self, element: u32) -> [DVec3; 3] {
        let (triangle, side) = self.elements.place(element);
        self.elements.corners(element).map(|uv| shading_normal(self.tracer(), triangle, uv, side))
    }

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
            Indirect::Field(field) => {
                let direct = self.direct_at(&places, shadowing, monitor)?;
                let irradiance = stations
                    .par_iter()
                    .zip(&direct)
                    .map(|(s, d)| {
                        let h = field.at(s.place.triangle as usize, s.uv, s.side);
                        std::array::from_fn(|band| d[band] + h[band])
                    })
                    .collect();
                Ok(Answer { irradiance, direct, standard_error: vec![[0.0; 3]; stations.len()] })
            }
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
        let halves = self.stages.time(monitor, "gather", || {
            self.gather().irradiance(&PointReceivers { places, shaded: &[] }, rays, &Watch(monitor))
        })?;
        let mut answer = Answer { direct, ..Answer::default() };
        for ([a, b], d) in halves.iter().zip(&answer.direct) {
            answer.irradiance.push(std::array::from_fn(|k| d[k] + 0.5 * (a[k] + b[k])));
            answer.standard_error.push(std::array::from_fn(|k| 0.5 * (a[k] - b[k]).abs()));
        }
        Ok(answer)
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
        let shaded: Vec<bool> = places.par_iter().map(|place| self.may_be_shaded(place)).collect();
        let receivers = PointReceivers { places, shaded: &shaded };
        let columns = self.stages.time(monitor, "direct light", || {
            self.luminaires.columns(self.tracer(), &receivers, shadowing, &Watch(monitor))
        })?;
        Ok((0..places.len()).map(|i| columns.mean(i)).collect())
    }

    /// Whether any light may be hidden from a place: whether any shadow ray of its cell was stopped. Of places in the open
    /// nothing is known.
    fn may_be_shaded(&self, place: &Place) -> bool {
        let mesh = self.tracer().mesh;
        let triangle = place.triangle as usize;
        if triangle >= mesh.triangles.len() {
            return true;
        }
        let side = if mesh.normal(triangle).dot(place.normal) >= 0.0 { Side::Front } else { Side::Back };
        let uv = mesh.barycentric(triangle, place.point).as_vec2();
        self.elements.at(place.triangle, uv.x, uv.y, side).is_none_or(|element| {
            let mut cell = self.elements.of_cell(self.elements.cell(element));
            cell.any(|e| self.columns.is_shaded(e as usize))
        })
    }
}
