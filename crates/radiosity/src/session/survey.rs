//! Light at places on surfaces, by rays of their own.
//!
//! What is shown is the light of elements, smoothed: where it has edges within an element, along shadows and beside what lies on a
//! surface, a point may have twice or half of it, however many rays there are. A survey measures at the places themselves
//! ([`Live::receive`](radiosity_transport::live::Live::receive)), with what surfaces give off as it is known, and tells how far the
//! picture is off there: for one's figures, and for what one sees.

use super::{ObjectId, Session};
use glam::{DMat4, DVec3};
use radiosity_scene::{Bands, luminance};
use radiosity_transport::live::Target;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Rays of a point: by default four times those of an element, as no neighbours average its noise out. In a room with daylight from
/// one window points are off by 1 % then, under lamps by a tenth of that (test `agrees_with_measure`); half as many make it 1.6
/// times as much.
const RAYS: u32 = 1024;

/// Shadow rays of a point, shared out among lights, and how many each has.
const SHADOWS: u32 = 1024;
const LEAST_SHADOWS: u32 = 16;
const MOST_SHADOWS: u32 = 256;

/// Places across and down a picture: their mean is known to a tenth of itself.
const SIGHT: [u32; 2] = [16, 10];

/// Light of a place over that of the brightest, up to which it is what rounding of single precision may have left; beside the sun's patch nobody
/// sees as little.
const ROUNDING: f32 = 1e-6;

/// A place on an object.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfacePlace {
    /// The object.
    pub object: ObjectId,
    /// Counts the object's [`ModelObject::indices`](super::ModelObject::indices) by threes.
    pub triangle: u32,
    /// Weights of its corners 1 and 2.
    pub uv: [f32; 2],
}

/// Light that was measured at a place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Reading {
    /// Where it is in the world.
    pub position: [f64; 3],
    /// Unit normal of the side.
    pub normal: [f64; 3],
    /// Irradiance, lux per band.
    pub irradiance: Bands,
    /// Illuminance, lx.
    pub lux: f32,
    /// One standard error of it by the rays of this place, lx.
    pub error: f32,
    /// Illuminance as it is shown there, lx.
    pub shown: f32,
}

/// What a survey found.
#[derive(Clone, Debug, PartialEq)]
pub struct Surveyed {
    /// In the order of the places; none where an object is gone.
    pub readings: Vec<Option<Reading>>,
    /// How far what is shown is off at these places, over the light there, in the root mean square; the noise of the readings
    /// themselves is not in it. No less than one standard error of it, as far as these places tell. None where there is no light.
    pub off: Option<f64>,
}

/// Places that are being measured. It belongs to the session that works on it.
#[derive(Clone, Debug)]
pub struct Survey {
    places: Vec<SurfacePlace>,
    /// Of which state of the light it is.
    revision: u64,
    halves: Vec<Option<[Bands; 2]>>,
}

impl Survey {
    /// Of some places.
    pub fn new(places: Vec<SurfacePlace>) -> Survey {
        Survey { places, revision: 0, halves: Vec::new() }
    }
}

/// What points are measured with.
pub(super) struct Meter {
    pub columns: Vec<(usize, Bands)>,
    pub target: Target,
}

impl Session {
    /// Whether points can be measured: not before there is light, nor while an edit is not seen.
    pub fn measures(&self) -> bool {
        self.meter().is_some()
    }

    /// What points are measured with; none while there is no light, or an edit is not seen.
    pub(super) fn meter(&self) -> Option<Meter> {
        let state = &self.state;
        if state.is_edited || state.solved_rays == 0 || state.given.len() != self.live.ids() {
            return None;
        }
        // What is off or gone takes no rays: readings are those of a scene that never had it.
        let shines = |(column, factor): &(usize, Bands)| *factor != [0.0; 3] && self.live.has_lamps(*column);
        let columns = self.strands.iter().filter_map(|strand| Some((strand.column?, self.factor(strand))));
        let columns: Vec<(usize, Bands)> = columns.filter(shines).collect();
        let shadows = (SHADOWS / columns.len().max(1) as u32).next_power_of_two().clamp(LEAST_SHADOWS, MOST_SHADOWS);
        Some(Meter { columns, target: Target { rays: RAYS, shadows } })
    }

    /// Irradiance at a point of the world, by the halves of its rays.
    pub(super) fn receive(&self, meter: &Meter, point: DVec3, normal: DVec3) -> [Bands; 2] {
        self.live.receive((point, normal), &self.state.given, &meter.columns, meter.target)
    }

    /// Where a place is in the world, and the unit normal of its side; none if there is no such place.
    pub(super) fn place_of(&self, place: &SurfacePlace) -> Option<(DVec3, DVec3)> {
        let world = self.live.world();
        let body = world.bodies.get(place.object.0 as usize)?;
        let is_one = body.is_present && place.triangle < body.elements() && place.uv.iter().all(|x| x.is_finite());
        is_one.then(|| {
            let (at, normal) = body.facing(place.triangle, place.uv);
            (at + world.middle, normal)
        })
    }

    /// Works on a survey for about `budget`, at least on a few places. Answers nothing yet until all of it is measured in the light
    /// that is shown now, nor while there is none or an edit is not seen; when light changes meanwhile it begins anew.
    pub fn survey(&self, survey: &mut Survey, budget: Duration) -> Option<Surveyed> {
        let deadline = Instant::now() + budget;
        let meter = self.meter()?;
        if survey.revision != self.state.revision {
            survey.revision = self.state.revision;
            survey.halves.clear();
        }
        let batch = 2 * rayon::current_num_threads();
        while survey.halves.len() < survey.places.len() {
            let from = survey.halves.len();
            let next = &survey.places[from..survey.places.len().min(from + batch)];
            let look = |place| self.place_of(place).map(|(point, normal)| self.receive(&meter, point, normal));
            let found: Vec<_> = next.par_iter().map(look).collect();
            survey.halves.extend(found);
            if Instant::now() >= deadline {
                break;
            }
        }
        (survey.halves.len() == survey.places.len()).then(|| self.compare(survey))
    }

    /// What was measured beside what is shown.
    fn compare(&self, survey: &Survey) -> Surveyed {
        let mut lights: BTreeMap<ObjectId, Vec<Bands>> = BTreeMap::new();
        let mut read = |(place, halves): (&SurfacePlace, &Option<[Bands; 2]>)| {
            let (halves, (position, normal)) = ((*halves)?, self.place_of(place)?);
            let light = lights.entry(place.object).or_insert_with(|| self.light(place.object, super::Layer::Total));
            let shown = luminance(self.shown_at(place.object.0 as usize, light, place.triangle, place.uv));
            let irradiance: Bands = std::array::from_fn(|band| 0.5 * (halves[0][band] + halves[1][band]));
            let [a, b] = halves.map(luminance);
            let (lux, error) = (luminance(irradiance), 0.5 * (a - b).abs());
            let reading =
                Reading { position: position.to_array(), normal: normal.to_array(), irradiance, lux, error, shown };
            Some((reading, [a, b]))
        };
        let found: Vec<Option<_>> = survey.places.iter().zip(&survey.halves).map(&mut read).collect();
        let brightest = found.iter().flatten().map(|(reading, _)| reading.shown.max(reading.lux)).fold(0.0, f32::max);
        let (mut sum, mut squares, mut count) = (0f64, 0f64, 0u32);
        for (Reading { shown, .. }, halves @ [a, b]) in found.iter().flatten() {
            let most = shown.max(0.5 * (a + b));
            if most > ROUNDING * brightest {
                // Each half is off by its own noise: in the mean their product has none.
                let [a, b] = halves.map(|half| f64::from((shown - half) / most).clamp(-1.0, 1.0));
                sum += a * b;
                squares += (a * b).powi(2);
                count += 1;
            }
        }
        // What few places cannot tell from nothing is told as what it may be.
        let n = f64::from(count.max(1));
        let (mean, spread) = (sum / n, (squares / n - (sum / n).powi(2)).max(0.0));
        let readings = found.into_iter().map(|found| found.map(|(reading, _)| reading)).collect();
        Surveyed { readings, off: (count > 0).then(|| mean.max((spread / n).sqrt()).sqrt()) }
    }

    /// Places on surfaces that are seen from somewhere, evenly over the picture. The matrix is the world from the camera, by columns,
    /// `fov` the vertical angle of view, radians, and `aspect` the width over the height. None for a camera that is none.
    pub fn places_in_sight(&self, matrix: &[f64; 16], fov: f64, aspect: f64) -> Vec<SurfacePlace> {
        let world = self.live.world();
        let camera = DMat4::from_cols_array(matrix);
        let eye = camera.transform_point3(DVec3::ZERO) - world.middle;
        let half = (0.5 * fov).tan();
        if !(camera.is_finite() && (0.0..1e6).contains(&half) && (1e-3..1e3).contains(&aspect)) {
            return Vec::new();
        }
        let seen = |pixel: u32| {
            let at = [pixel % SIGHT[0], pixel / SIGHT[0]];
            let [x, y] = [0, 1].map(|k| 2.0 * (f64::from(at[k]) + 0.5) / f64::from(SIGHT[k]) - 1.0);
            let direction = camera.transform_vector3(DVec3::new(x * half * aspect, y * half, -1.0)).normalize_or_zero();
            let id = world.seen(eye, direction)?;
            let object = world.body_of_id(id)?;
            let triangle = id - world.bodies[object].first;
            let uv = world.bodies[object].towards(triangle, eye, direction)?;
            Some(SurfacePlace { object: ObjectId(object as u32), triangle, uv })
        };
        (0..SIGHT[0] * SIGHT[1]).filter_map(seen).collect()
    }
}
