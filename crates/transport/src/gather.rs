//! The final gather: rows that start at a point, are used once and not kept (Reichert 1992; Smits 1994).
//!
//! A ray that meets a far element looks up its radiosity; errors of single elements average out over the rays. Where
//! the element that is met is nearer than a few times its own width, its mean is a poor stand-in for the spot that is
//! seen: there the ray goes on as a path — one light sample, one more ray — and so contacts, shelves and corners are
//! resolved below the size of the elements.

use crate::glance::Glance;
use crate::glow::{Glow, SOUGHT};
use crate::parts::Parts;
use crate::pilot::{AGAIN, Facing, Pilot, facing};
use crate::rows::IdSpace;
use crate::{Columns, Luminaires, Progress, Receivers, Site, Stopped};
use glam::{DVec2, DVec3, Vec3};
use radiosity_scene::{Bands, Curve, Side, Surface, luminance};
use radiosity_trace::sampling::{EIGHT, Sequence, cosine_directions, frame, hash, unit};
use radiosity_trace::{Fan, Found, Openings, Place, Ray, Tracer};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Elements nearer than this many of their own widths are resolved, not looked up. In a furnished office points are 1.12 %
/// off with 1 and 0.98 % with 2, where rays are so many that little of it is noise; with 256 rays and 1, 2 or 3 they are 2.37, 2.42 and
/// 2.53 % off, as fewer paths are less noise.
const NEAR: f64 = 2.0;

/// The distance below which an element of an area (m²) is resolved, metres.
pub(crate) fn near(area: f64) -> f64 {
    NEAR * (2.0 * area).sqrt()
}

/// Bounces after which even near elements are looked up. Two millimetres beneath a rug a sixtieth of the light around is found where there is none, and with 4
/// a fortieth, which takes as long; with 8 no less.
const DEEPEST: u32 = 6;

/// Share of near hits that go on as a path. What those find beyond what is looked up counts for all, so nothing is lost but
/// a little quiet.
const FOLLOWED: f64 = 0.5;

/// Share of light samples that ignore what the element itself received, so that no light is ever missed.
const UNGUIDED: f64 = 0.2;

/// The stream of sample points that gathers use.
const GATHER: u32 = 0x0200;

/// Those of paths from near hits, for either half of the rays.
const PATHS: u32 = 0x0210;

/// That of rays to what glows.
const GLOW: u32 = 0x0220;

/// Rays through small openings to the sky for each that goes everywhere. Twice as many take a tenth longer in rooms behind a window, for as much noise.
pub(crate) const SKYWARD: f64 = 0.125;

/// The same from each place of a path.
const FOR_ONE: f64 = 1.0;

/// That of rays through small openings.
const OPENINGS: u32 = 0x0230;

/// A solution, as a gather reads it.
pub struct Gather<'a> {
    /// Who sees whom.
    pub tracer: &'a Tracer<'a>,
    /// The ids.
    pub ids: IdSpace<'a>,
    /// X by id: radiosity that is not carried by luminaires.
    pub values: &'a [[f32; 4]],
    /// The luminaires.
    pub luminaires: &'a Luminaires,
    /// Direct irradiance by element and light.
    pub columns: &'a Columns,
    /// Area by element, m².
    pub area: &'a [f64],
}

impl<'a> Gather<'a> {
    /// Mean incoming radiosity at each receiver over `rays` rays, as two halves: its indirect irradiance.
    ///
    /// # Errors
    /// [`Stopped`] if `progress` says so.
    pub fn irradiance(
        &self,
        receivers: &impl Receivers,
        rays: usize,
        progress: &dyn Progress,
    ) -> Result<Vec<[Bands; 2]>, Stopped> {
        let n = receivers.len();
        let half_rays = rays.div_ceil(2).max(1) as u32;
        let peak = self.values.iter().map(|[r, g, b, _]| luminance([*r, *g, *b])).fold(0.0, f32::max).into();
        let caster = Caster {
            gather: self,
            looked_up: self.looked_up(),
            glance: Glance::new(self.luminaires),
            glow: Glow::new(self),
            openings: self.tracer.openings(),
        };
        let done = AtomicUsize::new(0);
        let order = in_groups(receivers);
        let size = (GROUP / rays.max(1)).clamp(FEWEST, MOST);
        let of_group = |group: &[u32]| -> Result<Vec<[Bands; 2]>, Stopped> {
            let mut pilot = Pilot::default();
            pilot.begin(group.len(), 2 * half_rays, peak);
            let own = |i: u32| receivers.site(i as usize).map(|site| (receivers.seed(i as usize), site));
            let (mut parts, mut volley) = (Parts::default(), Volley::default());
            for (k, i) in group.iter().enumerate() {
                let Some((seed, site)) = own(*i) else { continue };
                let (sequence, salt) = (Sequence::new(seed, GATHER), hash(seed));
                let only = site.point().map(|place| Hemisphere::new(self.tracer, &place));
                volley.aim(&sequence, 2 * half_rays);
                let Volley { points, directions, order, light, share, near } = &mut volley;
                for &index in &*order {
                    let above = only.unwrap_or_else(|| {
                        let [_, _, x, y] = sequence.point(index);
                        Hemisphere::new(self.tracer, &site.place(x, y))
                    });
                    let ray = above.ray(directions[index as usize]);
                    let end = caster.end(&ray, hash(salt ^ index));
                    light[index as usize] = end.light.map(f64::from);
                    share[index as usize] = caster.share(&above, &ray, &end);
                    near[usize::from(index >= half_rays)].extend(end.spot.map(|spot| (index, spot)));
                }
                for (half, near) in (0..).zip(near) {
                    caster.follow(near, light, (seed, half, salt), &mut parts);
                }
                pilot.place(k, &site, 2 * half_rays);
                for (index, ((point, light), share)) in points.iter().zip(light).zip(share).enumerate() {
                    pilot.add(k, usize::from(index >= half_rays as usize), *point, light.map(|l| *share * l));
                }
            }
            let mut means = vec![[[0f32; 3]; 2]; group.len()];
            for (k, (i, mean)) in group.iter().zip(&mut means).enumerate() {
                let Some((seed, site)) = own(*i) else { continue };
                let (sequence, salt) = (Sequence::new(seed, AGAIN), hash(seed ^ AGAIN));
                let only = site.point().map(|place| Hemisphere::new(self.tracer, &place));
                *mean = pilot.mean(k, &sequence, |index, [u, v, x, y]| {
                    let above = only.unwrap_or_else(|| Hemisphere::new(self.tracer, &site.place(x, y)));
                    caster.arriving(&above, &above.towards([u, v]), hash(salt ^ index), &mut parts)
                });
                let sought = caster.sought((&site, seed), half_rays, &mut parts);
                (0..2).for_each(|half| (0..3).for_each(|band| mean[half][band] += sought[half][band]));
            }
            let so_far = done.fetch_add(group.len(), Ordering::Relaxed) + group.len();
            progress.step(so_far, n).then_some(means).ok_or(Stopped)
        };
        let found = order.par_chunks(size).map(of_group).collect::<Result<Vec<_>, Stopped>>()?;
        let mut means = vec![Default::default(); n];
        order.iter().zip(found.into_iter().flatten()).for_each(|(i, mean)| means[*i as usize] = mean);
        Ok(means)
    }

    /// By id, radiosity and the distance below which it is not looked up, metres.
    fn looked_up(&self) -> Vec<[f32; 4]> {
        let near = self.area.iter().map(|area| near(*area) as f32).chain(std::iter::repeat(0.0));
        self.values.iter().zip(near).map(|([r, g, b, _], near)| [*r, *g, *b, near]).collect()
    }
}

/// First rays that a group of receivers sends, about, which share what these found: with four times as many there is about as much noise.
const GROUP: usize = 1 << 13;

/// How few and how many receivers that are: a few on either side are looked at where rays are many, and where they are few a group is not to reach far.
const FEWEST: usize = 8;
const MOST: usize = 256;

/// Receivers in groups that lie side by side: by where they face, then along a curve.
fn in_groups(receivers: &impl Receivers) -> Vec<u32> {
    let site = |i: usize| receivers.site(i).map(|site| (facing(site.normal), site.middle()));
    let sites: Vec<Option<(Facing, DVec3)>> = (0..receivers.len()).into_par_iter().map(site).collect();
    let nothing = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let bounds = sites.iter().flatten().fold(nothing, |[low, high], (_, at)| [low.min(*at), high.max(*at)]);
    let curve = Curve::new(bounds);
    let mut order: Vec<u32> = (0..receivers.len() as u32).collect();
    // Those of which nothing is exposed come first, and face nowhere.
    order.par_sort_by_cached_key(|i| sites[*i as usize].map(|(facing, at)| (facing, curve.number(at))));
    order
}

/// Cells along a side of the square whose rays are traced one after another.
const CELLS: usize = 16;

/// The first rays of a receiver, by their number, and the order in which they are traced: rays that go about the same way
/// one after another find the same boxes in the caches, and the processor guesses their branches. The points of a
/// sequence jump from one end of the hemisphere to the other.
#[derive(Default)]
struct Volley {
    points: Vec<[f32; 2]>,
    directions: Vec<[f32; 3]>,
    order: Vec<u32>,
    light: Vec<[f64; 3]>,
    /// What of it counts.
    share: Vec<f64>,
    /// By halves, those that met what is near.
    near: [Vec<(u32, Spot)>; 2],
}

impl Volley {
    /// Those of a sequence.
    fn aim(&mut self, sequence: &Sequence, rays: u32) {
        self.points.clear();
        self.directions.clear();
        for first in (0..rays).step_by(EIGHT) {
            let ([u, v], [x, y, z]) = sequence.eight_directions(first);
            self.points.extend((0..EIGHT).map(|lane| [u[lane], v[lane]]));
            self.directions.extend((0..EIGHT).map(|lane| [x[lane], y[lane], z[lane]]));
        }
        self.points.truncate(rays as usize);
        // Sort by cells: where each begins, then each ray to the next place of its cell.
        let mut next = [0; CELLS * CELLS];
        self.points.iter().for_each(|point| next[cell(*point)] += 1);
        let mut begin = 0;
        for next in &mut next {
            (begin, *next) = (begin + *next, begin);
        }
        self.order.resize(rays as usize, 0);
        for (index, point) in (0..rays).zip(&self.points) {
            let next = &mut next[cell(*point)];
            self.order[*next as usize] = index;
            *next += 1;
        }
        self.light.resize(rays as usize, [0.0; 3]);
        self.share.resize(rays as usize, 1.0);
        self.near.iter_mut().for_each(Vec::clear);
    }
}

/// The number of a point's cell along a curve that keeps cells together (Morton 1966).
fn cell(point: [f32; 2]) -> usize {
    let [i, j] = point.map(|x| {
        let i = (x * CELLS as f32) as usize;
        let i = (i | i << 2) & 0x33;
        (i | i << 1) & 0x55
    });
    i | j << 1
}

/// Directions over the surface at a place, and the rays that go there.
#[derive(Clone, Copy)]
struct Hemisphere {
    place: Place,
    fan: Fan,
    frame: [Vec3; 3],
}

impl Hemisphere {
    fn new(tracer: &Tracer, place: &Place) -> Hemisphere {
        Hemisphere { place: *place, fan: tracer.fan(place), frame: frame(place.normal).map(|axis| axis.as_vec3()) }
    }

    /// The ray in a direction of the frame about the normal.
    fn ray(&self, [x, y, z]: [f32; 3]) -> Ray {
        self.fan.ray(x * self.frame[0] + y * self.frame[1] + z * self.frame[2], f32::INFINITY)
    }

    /// The ray that a point of the unit square stands for.
    fn towards(&self, point: [f32; 2]) -> Ray {
        self.ray(cosine_directions(point.map(|x| [x])).map(|[x]| x))
    }
}

/// Where on a surface a ray ended.
#[derive(Clone, Copy)]
struct Spot {
    triangle: usize,
    uv: [f32; 2],
    side: Side,
    id: u32,
}

/// What a ray met.
#[derive(Clone, Copy)]
struct End {
    /// Its radiosity.
    light: Bands,
    /// The spot if that is near.
    spot: Option<Spot>,
    id: u32,
    distance: f32,
    is_sky: bool,
}

/// Whether a path goes on from what is near.
fn is_followed(seed: u32) -> bool {
    f64::from(unit(hash(seed ^ 0x6))) < FOLLOWED
}

/// Where it goes, and which light is looked at.
fn draw(seed: u32) -> [f32; 3] {
    [0x1, 0x2, 0x3].map(|k| unit(hash(seed ^ k)))
}

/// What a ray is sent to, if not to the sky, its direction, and what counts of the light from there.
type Aim = (Option<u32>, DVec3, f64);

/// A gather under way.
struct Caster<'g, 'a> {
    gather: &'g Gather<'a>,
    /// [`Gather::looked_up`]: all that most rays ask for lies in one place.
    looked_up: Vec<[f32; 4]>,
    /// What picks one of all lamps, where they are few.
    glance: Option<Glance<'a>>,
    /// What is sought, if anything is worth it.
    glow: Option<Glow>,
    /// Where the sky is sought.
    openings: &'g Openings,
}

impl<'a> Caster<'_, 'a> {
    /// Radiosity that arrives along a ray from a place, without that of the luminaires and what is sought.
    #[inline]
    fn arriving(&self, above: &Hemisphere, ray: &Ray, seed: u32, parts: &mut Parts<'a>) -> [f64; 3] {
        let end = self.end(ray, seed);
        let share = self.share(above, ray, &end);
        self.seen(&end, seed, parts).map(|light| share * light)
    }

    /// What counts of the light that a ray has from its end.
    #[inline]
    fn share(&self, above: &Hemisphere, ray: &Ray, end: &End) -> f64 {
        let direction = ray.direction.as_dvec3();
        if end.is_sky {
            return self.openings.found(&above.place, direction, SKYWARD);
        }
        let found = |glow: &Glow| glow.found(end.id, &above.place, direction, end.distance.into());
        self.glow.as_ref().map_or(1.0, found)
    }

    /// The mean over the hemisphere of a site of what is sought, by either half of its rays.
    fn sought(&self, (site, seed): (&Site, u32), half_rays: u32, parts: &mut Parts<'a>) -> [Bands; 2] {
        let mut mean = |stream: u32, more: f64, seek: &dyn Fn(&Place, [f64; 2]) -> Option<Aim>| {
            let rays = (more * f64::from(half_rays)).ceil() as u32;
            let (sequence, salt) = (Sequence::new(seed, stream), hash(seed ^ stream));
            [0, rays].map(|first| {
                let mut sum = [0.0; 3];
                for index in first..first + rays {
                    let [u, v, x, y] = sequence.point(index);
                    let above = Hemisphere::new(self.gather.tracer, &site.place(x, y));
                    let Some((id, direction, counts)) = seek(&above.place, [u, v].map(f64::from)) else { continue };
                    let seed = hash(salt ^ index);
                    let end = self.end(&above.fan.ray(direction.as_vec3(), f32::INFINITY), seed);
                    if id.map_or(end.is_sky, |id| end.id == id) {
                        let light = self.seen(&end, seed, parts);
                        (0..3).for_each(|band| sum[band] += counts * light[band]);
                    }
                }
                sum.map(|light: f64| light / f64::from(rays))
            })
        };
        let mut sought = [[0.0; 3]; 2];
        let mut add = |more: [[f64; 3]; 2]| {
            (0..2).for_each(|half| (0..3).for_each(|band| sought[half][band] += more[half][band]));
        };
        if let Some(glow) = &self.glow {
            add(mean(GLOW, SOUGHT, &|place, drawn| {
                let (id, direction, counts) = glow.sought(self.gather, place, drawn)?;
                Some((Some(id), direction, counts))
            }));
        }
        if !self.openings.is_empty() {
            add(mean(OPENINGS, SKYWARD, &|place, drawn| {
                let (direction, counts) = self.openings.counted(place, drawn, SKYWARD)?;
                Some((None, direction, counts))
            }));
        }
        sought.map(|half| half.map(|light| light as f32))
    }

    /// The light of what a ray met, and of what that sees where it is near.
    fn seen(&self, end: &End, seed: u32, parts: &mut Parts<'a>) -> [f64; 3] {
        match end.spot {
            Some(spot) if is_followed(seed) => self.followed(end.light, spot, (draw(seed), seed), parts),
            _ => end.light.map(f64::from),
        }
    }

    /// Has some of the rays of a half of a receiver go on that met what is near: every other one, by elements, as paths whose
    /// directions and lights are points of a sequence in that order. So those from one element go all over its hemisphere (array-RQMC;
    /// L'Ecuyer, Lécot and Tuffin 2008). Of 512 rays the noise is 0.59 instead of 0.64 % in the Cornell box, and 1.00 instead of 1.11 % in a
    /// furnished office.
    fn follow(
        &self,
        near: &mut [(u32, Spot)],
        light: &mut [[f64; 3]],
        (seed, half, salt): (u32, u32, u32),
        parts: &mut Parts<'a>,
    ) {
        near.sort_unstable_by_key(|(index, spot)| (spot.id, *index));
        let sequence = Sequence::new(seed, PATHS + half);
        let offset = f64::from(sequence.point(0)[3]);
        let before = |k: usize| (FOLLOWED * k as f64 + offset) as u32;
        let followed = near.iter().enumerate().filter(|(k, _)| before(*k) < before(k + 1));
        for (number, (_, (index, spot))) in (0..).zip(followed) {
            let [u, v, pick, _] = sequence.point(number);
            let light = &mut light[*index as usize];
            *light = self.followed(light.map(|l| l as f32), *spot, ([u, v, pick], hash(salt ^ index)), parts);
        }
    }

    /// What a ray meets.
    #[inline]
    fn end(&self, ray: &Ray, seed: u32) -> End {
        let Gather { tracer, ids, .. } = self.gather;
        let found = tracer.first(ray, seed);
        let id = ids.id(found, ray.direction.as_dvec3());
        let [r, g, b, near] = self.looked_up[id as usize];
        let is_sky = found == Found::Escaped;
        let (mut spot, mut distance) = (None, f32::INFINITY);
        if let Found::Surface { triangle, uv, side, distance: t } = found {
            distance = t;
            spot = (t < near).then_some(Spot { triangle: triangle as usize, uv, side, id });
        }
        End { light: [r, g, b], spot, id, distance, is_sky }
    }

    /// The same along a ray that met `light` and goes on as a path from the very spot, first to a direction and by a light that are `drawn`.
    fn followed(
        &self,
        light: Bands,
        spot: Spot,
        (mut drawn, mut seed): ([f32; 3], u32),
        parts: &mut Parts<'a>,
    ) -> [f64; 3] {
        let gather = self.gather;
        let (scene, mesh) = (gather.tracer.scene, gather.tracer.mesh);
        let (mut sum, mut throughput) = ([0f64; 3], [1f64; 3]);
        let mut end = (light, Some(spot));
        for bounce in 0.. {
            let (value, spot) = end;
            let spot = spot.filter(|_| bounce < DEEPEST);
            let known = if spot.is_some() { 1.0 - 1.0 / FOLLOWED } else { 1.0 };
            (0..3).for_each(|band| sum[band] += known * throughput[band] * f64::from(value[band]));
            let Some(Spot { triangle, uv, side, id }) = spot else { return sum };
            throughput.iter_mut().for_each(|t| *t /= FOLLOWED);
            let uv = DVec2::new(f64::from(uv[0]), f64::from(uv[1]));
            let at = mesh.surface(triangle, uv);
            let sign = if side == Side::Front { 1.0 } else { -1.0 };
            let mut place = Place {
                point: mesh.point(triangle, uv),
                normal: sign * mesh.normal(triangle),
                triangle: triangle as u32,
            };
            if !gather.luminaires.carries(triangle, side) {
                let luminance = scene.emitted_luminance(at);
                for band in 0..3 {
                    sum[band] += throughput[band] * std::f64::consts::PI * f64::from(luminance[band]);
                }
            }
            let element = gather.returned(at, id, &mut throughput, &mut place, seed);
            // What comes through a sheet no other light carries on.
            let is_whole = element != id;
            if throughput.iter().all(|t| *t <= 0.0) {
                return sum;
            }
            seed = hash(seed.wrapping_add(0x9e37_79b9));
            let [u, v, pick] = drawn;
            let direct = match &self.glance {
                Some(glance) => glance.irradiance(gather.tracer, (&place, is_whole), (pick, seed)),
                None => gather.one_light((&place, is_whole), element as usize, (pick, seed), parts),
            };
            (0..3).for_each(|band| sum[band] += throughput[band] * direct[band]);
            let above = Hemisphere::new(gather.tracer, &place);
            let ray = above.towards([u, v]);
            let End { light, spot, is_sky, .. } = self.end(&ray, seed);
            drawn = draw(seed);
            let mut share = 1.0;
            if !self.openings.is_empty() {
                let [u, v, _] = draw(hash(seed ^ OPENINGS)).map(f64::from);
                if is_sky {
                    share = self.openings.found(&place, ray.direction.as_dvec3(), FOR_ONE);
                }
                if let Some((direction, counts)) = self.openings.counted(&place, [u, v], FOR_ONE) {
                    let out = self.end(&above.fan.ray(direction.as_vec3(), f32::INFINITY), seed);
                    if out.is_sky {
                        (0..3).for_each(|band| sum[band] += throughput[band] * counts * f64::from(out.light[band]));
                    }
                }
            }
            end = (light.map(|l| share as f32 * l), spot.filter(|_| is_followed(seed)));
        }
        sum
    }
}

impl<'a> Gather<'a> {
    /// Weighs a path by what an element gives back at a spot. What a sheet sends came from this side, or through it from
    /// the other: one of them is followed. The element whose light goes on, and the spot turned to its side.
    fn returned(&self, at: Surface, id: u32, throughput: &mut [f64; 3], spot: &mut Place, seed: u32) -> u32 {
        let scene = self.tracer.scene;
        let (reflectance, transmittance) = (scene.reflectance(at), scene.transmittance(at));
        let Some(opposite) = self.ids.elements.opposite(id).filter(|_| luminance(transmittance) > 0.0) else {
            (0..3).for_each(|band| throughput[band] *= f64::from(reflectance[band]));
            return id;
        };
        let (rho, tau) = (luminance(reflectance), luminance(transmittance));
        let passing = f64::from(tau / (rho + tau));
        let passes = f64::from(unit(hash(seed ^ 0x5))) < passing;
        let (kept, share) = if passes { (transmittance, passing) } else { (reflectance, 1.0 - passing) };
        (0..3).for_each(|band| throughput[band] *= f64::from(kept[band]) / share);
        if !passes {
            return id;
        }
        spot.normal = -spot.normal;
        opposite
    }

    /// Direct irradiance at a spot of an element, less what other lights carry on unless the whole is asked for: what the element received, and by how much
    /// one light differs from that at the spot, picked after what it gave the element. Where light is even, that is next to nothing.
    fn one_light(
        &self,
        (spot, is_whole): (&Place, bool),
        element: usize,
        (u, seed): (f32, u32),
        parts: &mut Parts<'a>,
    ) -> [f64; 3] {
        let received = self.columns.seen_by_light(element);
        let (pick, probability) = pick_light(received, f64::from(u));
        let here = match !is_whole && self.luminaires.carries_on(self.tracer, pick, spot) {
            true => [0.0; 3],
            false => self.luminaires.sample(pick, self.tracer, spot, hash(seed ^ 0x4), parts),
        };
        let mut direct = [0f64; 3];
        received.iter().for_each(|e| (0..3).for_each(|band| direct[band] += f64::from(e[band])));
        std::array::from_fn(|band| direct[band] + (here[band] - f64::from(received[pick][band])) / probability)
    }
}

/// One of some lights with u in [0, 1), by what an element received of each, and how probable that was.
fn pick_light(received: &[Bands], u: f64) -> (usize, f64) {
    let of = |light: usize| f64::from(luminance(received[light]));
    let lights = received.len();
    let total: f64 = (0..lights).map(of).sum();
    let unguided = if total > 0.0 { UNGUIDED } else { 1.0 };
    let even = unguided / lights as f64;
    let pick = if u < unguided {
        ((u / even) as usize).min(lights - 1)
    } else {
        let mut rest = (u - unguided) / (1.0 - unguided) * total;
        let reached = |light: &usize| {
            rest -= of(*light);
            rest < 0.0
        };
        (0..lights).find(reached).unwrap_or(lights - 1)
    };
    let share = if total > 0.0 { of(pick) / total } else { 0.0 };
    (pick, even + (1.0 - unguided) * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PointReceivers;

    /// Places of two walls that were given in turn come wall by wall, those of a corner before those of the next, whatever their order was.
    #[test]
    fn groups_face_one_way_and_lie_side_by_side() {
        let place = |k: usize| {
            let (normal, corner) = if k.is_multiple_of(2) { (DVec3::X, 0.0) } else { (DVec3::Y, 8.0) };
            let far = if (k / 2).is_multiple_of(2) { 0.0 } else { 4.0 };
            let point = DVec3::new(corner, far + 0.01 * (k / 4) as f64, far);
            Place { point, normal, triangle: 0 }
        };
        let given: Vec<Place> = (0..64).map(place).collect();
        let backwards: Vec<Place> = given.iter().rev().copied().collect();
        let ordered = |places: &[Place]| -> Vec<DVec3> {
            let order = in_groups(&PointReceivers { places, shaded: &[], salt: 0 });
            order.into_iter().map(|i| places[i as usize].point).collect()
        };
        let found = ordered(&given);
        assert!(found == ordered(&backwards));
        let changes =
            |of: &dyn Fn(&DVec3) -> bool| found.windows(2).filter(|pair| of(&pair[0]) != of(&pair[1])).count();
        assert_eq!((changes(&|p| p.x > 4.0), changes(&|p| p.z > 2.0)), (1, 3));
    }
}
