//! Who casts the rays of rows: from places of a receiver everywhere, and to the sky.

use super::IdSpace;
use crate::Receivers;
use crate::gather::SKYWARD;
use crate::pilot::{AGAIN, Pilot};
use crate::receivers::Site;
use glam::DVec3;
use radiosity_scene::Bands;
use radiosity_trace::sampling::{Sequence, cosine_direction, frame, hash, unit};
use radiosity_trace::{Found, Openings, Place, Tracer};

/// The stream of sample points that rows use.
const ROWS: u32 = 0x0100;

/// The stream of those that look for the sky where rows have too few.
const LOOKS: u32 = 0x0190;

/// That of rays to it through small openings.
const OPENINGS: u32 = 0x01a0;

/// Places tried for a ray before its receiver counts as buried. Elements less than a tenth of which is exposed are
/// known to the exposure mask, so each attempt succeeds with probability 1/2 or more.
const ATTEMPTS: u32 = 8;

/// Where a ray goes.
#[derive(Clone, Copy)]
enum Way {
    /// Anywhere, by its cosine.
    Everywhere,
    /// Through a small opening to the sky.
    Out,
}

/// Who casts the rays of rows.
pub(super) struct Caster<'a, R> {
    pub tracer: &'a Tracer<'a>,
    pub ids: &'a IdSpace<'a>,
    /// Radiosity of the sky patches; none where the sky is black.
    pub sky: &'a [Bands],
    pub openings: &'a Openings,
    pub receivers: &'a R,
    /// Whether rays begin where receivers are seen from afar.
    pub from_afar: bool,
}

impl<R: Receivers> Caster<'_, R> {
    /// The id of what a ray meets that point (u, v, x, y) of a sequence sends from a receiver, and what counts of the sky's light there; where `near`
    /// is given, from a place that another ray leaves without meeting anything nearer.
    fn cast(
        &self,
        (site, near): (&Site, Option<f64>),
        (way, frame): (Way, &[DVec3; 3]),
        [u, v, mut x, mut y]: [f32; 4],
        salt: u32,
    ) -> (u32, [f64; 3]) {
        let drawn = [u, v].map(f64::from);
        let mut met = (self.ids.nothing(), [0.0; 3]);
        for attempt in 0..ATTEMPTS {
            let place = site.place(x, y);
            if attempt + 1 < ATTEMPTS && near.is_some_and(|near| self.is_covered(&place, frame, near, salt ^ attempt)) {
                let again = hash(salt ^ attempt);
                (x, y) = (unit(again), unit(hash(again)));
                continue;
            }
            let (direction, counts) = match way {
                Way::Everywhere => (cosine_direction(frame, drawn[0], drawn[1]), None),
                Way::Out => match self.openings.counted(&place, drawn, SKYWARD) {
                    Some((direction, counts)) => (direction, Some(counts)),
                    // No opening is before the plane of the receiver: other places have none, either.
                    None => break,
                },
            };
            let found = self.tracer.first(&self.tracer.ray(&place, direction, f64::INFINITY), salt);
            let id = self.ids.id(found, direction);
            let light = self.light(id).map_or([0.0; 3], |light| {
                let counts = counts.unwrap_or_else(|| self.openings.found(&place, direction, SKYWARD));
                light.map(|l| counts * l)
            });
            met = (id, light);
            if found != Found::Back || !self.receivers.buried(self.tracer, &place, salt) {
                break;
            }
            // The place lies inside a solid: the same direction from another place of the receiver.
            let again = hash(salt ^ attempt);
            (x, y) = (unit(again), unit(hash(again)));
        }
        met
    }

    /// Whether a ray from a place meets something near, in a direction by chance.
    fn is_covered(&self, place: &Place, frame: &[DVec3; 3], near: f64, seed: u32) -> bool {
        let [u, v] = [hash(seed ^ 0xc0), hash(seed ^ 0xc1)].map(|h| f64::from(unit(h)));
        self.tracer.blocked(&self.tracer.ray(place, cosine_direction(frame, u, v), near), seed)
    }

    /// Where receiver i lies, and the distance up to which its places are covered by others.
    fn site(&self, i: usize) -> Option<(Site, Option<f64>)> {
        Some((self.receivers.site(i)?, self.receivers.near(i).filter(|_| self.from_afar)))
    }

    /// Radiosity of the sky patch with an id; `None` for what is not sky.
    fn light(&self, id: u32) -> Option<[f64; 3]> {
        Some(self.sky.get((id as usize).checked_sub(self.ids.elements.len())?)?.map(f64::from))
    }

    /// Rays `2 from..2 to` of receiver i, in two halves, which are those of `row`; what pilot goes to receiver k there.
    pub fn trace(&self, (i, from): (usize, u32), row: &mut [u32], k: usize, pilot: &mut Pilot) {
        let Some((site, near)) = self.site(i) else { return row.fill(self.ids.nothing()) };
        let (seed, frame) = (self.receivers.seed(i), frame(site.normal));
        let sequence = Sequence::new(seed, ROWS);
        pilot.place(k, &site, row.len() as u32);
        self.seek((&site, near), &frame, (hash(seed ^ from), row.len() as u32), k, pilot);
        let half = row.len() / 2;
        for (m, id) in row.iter_mut().enumerate() {
            let index = 2 * from + m as u32;
            let point = sequence.point(index);
            let (met, light) = self.cast((&site, near), (Way::Everywhere, &frame), point, hash(hash(seed) ^ index));
            *id = met;
            pilot.add(k, m / half, [point[0], point[1]], light);
        }
    }

    /// So many rays of receiver i, k there, that no row keeps: what they have of the sky goes to `pilot`.
    pub fn look(&self, (i, from): (usize, u32), rays: u32, k: usize, pilot: &mut Pilot) {
        let Some((site, near)) = self.site(i) else { return };
        let (seed, frame) = (hash(self.receivers.seed(i) ^ from), frame(site.normal));
        let sequence = Sequence::new(seed, LOOKS);
        pilot.place(k, &site, rays);
        self.seek((&site, near), &frame, (hash(seed ^ LOOKS), rays), k, pilot);
        for index in 0..rays {
            let point = sequence.point(index);
            let (_, light) =
                self.cast((&site, near), (Way::Everywhere, &frame), point, hash(hash(seed ^ LOOKS) ^ index));
            pilot.add(k, usize::from(index >= rays / 2), [point[0], point[1]], light);
        }
    }

    /// Mean radiosity of the sky over the hemisphere of receiver i, k there, as two halves.
    pub fn daylight(&self, (i, from): (usize, u32), k: usize, pilot: &mut Pilot) -> [Bands; 2] {
        let Some((site, near)) = self.site(i) else { return Default::default() };
        let (seed, frame) = (hash(self.receivers.seed(i) ^ from), frame(site.normal));
        pilot.mean(k, &Sequence::new(seed, AGAIN), |index, point| {
            self.cast((&site, near), (Way::Everywhere, &frame), point, hash(hash(seed ^ AGAIN) ^ index)).1
        })
    }

    /// Has `pilot` know what receiver k there has of the sky through small openings, by some rays for each of its own.
    fn seek(
        &self,
        from: (&Site, Option<f64>),
        frame: &[DVec3; 3],
        (seed, rays): (u32, u32),
        k: usize,
        pilot: &mut Pilot,
    ) {
        if self.openings.is_empty() {
            return;
        }
        let half = (0.5 * SKYWARD * f64::from(rays)).ceil() as u32;
        let (sequence, salt) = (Sequence::new(seed, OPENINGS), hash(seed ^ OPENINGS));
        let of_half = |first: u32| {
            let mut sum = [0f64; 3];
            for index in first..first + half {
                let (_, light) = self.cast(from, (Way::Out, frame), sequence.point(index), hash(salt ^ index));
                (0..3).for_each(|band| sum[band] += light[band]);
            }
            sum.map(|sum| sum / f64::from(half))
        };
        pilot.know(k, [0, half].map(of_half));
    }
}
