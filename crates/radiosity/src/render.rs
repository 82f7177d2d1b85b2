//! A picture of a solution: direct light found at places that pixels show (`pixels.rs`), indirect light gathered at some of them
//! (`final_gather.rs`). Where there is no time for all shadow rays, the grain of few is evened out (`grain.rs`).

use crate::allocation::Lit;
use crate::answer::Station;
use crate::believed::apart;
use crate::edges::Edges;
use crate::final_gather;
use crate::grain;
use crate::measure::{certify, most_paths};
use crate::monitor::{Monitor, Timed};
use crate::pace::{self, Cost};
use crate::pixels::Tiles;
use crate::{Baked, Error, Solution};
use radiosity_scene::{Bands, Camera, luminance};
use radiosity_trace::Place;
use radiosity_trace::sampling::{hash, unit};
use radiosity_transport::Shadowing;
use radiosity_view::{Audit, Auditor, Picture, ViewRays};
use std::time::Duration;

/// How to make a picture.
#[derive(Clone, Copy, Debug)]
pub struct RenderOptions {
    /// Width, pixels.
    pub width: u32,
    /// Height, pixels.
    pub height: u32,
    /// Shadow rays for each place at which direct light is found, over all lights; with 128 walls near a lamp are sandy.
    pub shadowing: Shadowing,
}

impl Default for RenderOptions {
    fn default() -> Self {
        RenderOptions { width: 1280, height: 720, shadowing: Shadowing { places: 1, rays: 256 } }
    }
}

/// Shadow rays of a pixel, however little time there is: with 8 penumbrae have steps that one sees from afar, and 16 take little more,
/// as much of what a pixel takes is taken by none.
const LEAST_SHADOW_RAYS: u32 = 16;

/// Part of the time left that the camera's rays may take; where it is more, each side of a pixel has so many samples instead of four:
/// edges are still softened.
const CAST: f64 = 0.15;
const FEWEST_SAMPLES: u32 = 2;

/// By how much smaller along each side a picture is that tells how long its rays take.
const SMALLER: u32 = 16;

/// Shadow rays that a part of the pixels is timed with: enough to tell what each takes.
const TIMED_SHADOW_RAYS: u32 = 64;

/// What edges of shadows take of what direct light of all places would: so it is in a furnished office. With less there would be no time left
/// for them, with more places would have fewer rays.
const SOFTENED: f64 = 0.06;

/// Part of the time that what is seen may gather in, where it does not do for all: shadows and what is reflected are seen alike.
const GATHERED: f64 = 0.5;

/// Audits of what is seen relative to those of surfaces, and what an audit and the file take of the time for each second that the
/// camera's rays take: 16 of them go to each pixel.
const SEEN: f64 = 1.5;
const ENCODED: f64 = 0.2;

/// The same of what it takes to even out the grain of few shadow rays.
const EVENED: f64 = 0.3;

/// Places of a picture that an audit looks at, over those of a solution, but under a deadline. Lines beside which light falls to a half within a pixel
/// fill a part in some thousands of an office: a thousand places met one or none, and said 3.1 or 0.6 % by their seed.
const MORE: usize = 4;

/// What a camera sees.
#[derive(Clone, Debug)]
pub struct View {
    /// Luminances.
    pub picture: Picture,
    /// Illuminance of the surface that fills most of each pixel, lx; not a number where there is none.
    pub illuminance: Vec<f32>,
    /// Places that are seen, spread over the pixels, and their irradiance there.
    pub watched: Vec<(Place, Bands)>,
    /// Whether a deadline left fewer gather rays than noise asks for, fewer shadow rays than were asked for, places without any, which
    /// lie between those around them, or edges of shadows that are as those of single places.
    pub is_hurried: bool,
}

impl View {
    /// What the referee says of the irradiance that is seen.
    ///
    /// # Errors
    /// [`Error::Stopped`].
    pub fn audit(&self, baked: &Baked, monitor: &dyn Monitor) -> Result<Audit, Error> {
        let (places, light): (Vec<Place>, Vec<Bands>) = self.watched.iter().copied().unzip();
        let mut auditor = Auditor::new(baked.solution.tracer(), places, &light, u64::from(baked.seed));
        let judge = |auditor: &Auditor| auditor.judge(&light);
        certify(&mut auditor, &judge, baked.error, most_paths(baked.error), &baked.stages, monitor)
    }
}

/// Looks at a solution. Places that are seen gather their indirect light, as do cells of surfaces that are not flat, until its noise is
/// well below the error that the solution was made for, as far as some hundreds or thousands of rays bring it. Within a deadline that
/// leaves too little for this, these gather and pixels are lit with fewer rays, for which a part of them is timed, and the grain of direct light is evened
/// out; time for the audit is left.
///
/// # Errors
/// [`Error::Stopped`].
pub fn render(baked: &Baked, camera: &Camera, options: &RenderOptions, monitor: &dyn Monitor) -> Result<View, Error> {
    monitor.stage("picture");
    let solution = &baked.solution;
    let (cast, view) = pace::timed(|| cast(solution, camera, options, monitor));
    let stations: Vec<Station> =
        view.seen.iter().map(|seen| Station { place: seen.place, uv: seen.uv, side: seen.side }).collect();
    let after = SEEN * baked.audit_seconds() + (EVENED + ENCODED) * cast;
    let left = || pace::left(monitor).map(|left| (left - after).max(0.0));
    let tiles = Tiles::new(&view);
    let (indirect, is_gathered) = match left() {
        None => final_gather::indirect(baked, &view, &stations, monitor)?,
        Some(seconds) => {
            let lit = cost(solution, &stations, &options.shadowing, monitor)?;
            let lit = (tiles.part() + SOFTENED) * lit.seconds(f64::from(options.shadowing.rays));
            // Timing took some of it.
            let seconds = left().unwrap_or(seconds);
            let gather = Duration::from_secs_f64((seconds - lit).max(GATHERED * seconds));
            final_gather::indirect(baked, &view, &stations, &Timed::new(monitor, gather))?
        }
    };
    // Timed once more: others may have come or gone since.
    let cost = left().map(|_| cost(solution, &stations, &options.shadowing, monitor)).transpose()?;
    let mut shadowing = options.shadowing;
    let (mut is_first, mut is_hurried) = (true, false);
    let mut halves_apart = vec![f32::NAN; stations.len()];
    let mut direct = tiles.direct(&indirect, |own| {
        if let (Some(cost), Some(seconds)) = (&cost, left()) {
            // All that follows is planned with the first ones.
            let part = if is_first { tiles.part() + SOFTENED } else { own.len() as f64 / stations.len() as f64 };
            let (cost, least) = (cost.of(part), LEAST_SHADOW_RAYS.min(shadowing.rays));
            if !is_first && !pace::suffices(seconds, cost.seconds(f64::from(least))) {
                is_hurried = true;
                return Ok(None);
            }
            shadowing.rays = cost.rays(seconds, [least, shadowing.rays].map(f64::from)) as u32;
        }
        is_first = false;
        let places: Vec<Place> = own.iter().map(|place| stations[*place as usize].place).collect();
        if shadowing.rays == options.shadowing.rays {
            return Ok(Some((solution.direct_by(&places, &shadowing, 0, monitor)?, shadowing.rays)));
        }
        let of_half = Shadowing { rays: shadowing.rays / 2, ..shadowing };
        let halves = solution.direct_halves_of(&solution.places(places, 0), &of_half, monitor)?;
        own.iter().zip(&halves).for_each(|(place, half)| halves_apart[*place as usize] = apart(half.light));
        Ok(Some((Lit::of_halves(&halves), 2 * of_half.rays)))
    })?;
    if shadowing.rays < options.shadowing.rays {
        grain::even_out(&view, &mut direct, &halves_apart, solution.memory_allowed());
    }
    let both = |(h, d): (&Bands, &Bands)| -> Bands { std::array::from_fn(|band| h[band] + d[band]) };
    // One in each of as many stretches of what is seen, by how much of the picture places fill: slivers are many and little is seen of them.
    let more = if pace::left(monitor).is_some() { 1 } else { MORE };
    let count = (more * baked.watched.len()).min(stations.len());
    let mut seen_so_far = 0.0;
    let sums = view.seen.iter().map(|seen| {
        seen_so_far += f64::from(seen.share);
        seen_so_far
    });
    let sums: Vec<f64> = sums.collect();
    let pick = |i: usize| {
        let jitter = f64::from(unit(hash(baked.seed ^ hash(i as u32))));
        let at = (i as f64 + jitter) / count as f64 * sums.last().copied().unwrap_or(0.0);
        sums.partition_point(|sum| *sum <= at).min(stations.len() - 1)
    };
    let watched = (0..count).map(pick).map(|i| (stations[i].place, both((&indirect[i], &direct.light[i])))).collect();
    let edges = Edges::new(&view, &indirect, direct);
    // Those of a place share its rays.
    let of_sample = Shadowing { rays: shadowing.rays.div_ceil(view.grid.pow(2)), ..shadowing };
    let has_time = |samples: f64| {
        let cost = cost.as_ref().map(|cost| cost.of(samples / stations.len() as f64));
        let suffices = |(cost, left): (Cost, f64)| pace::suffices(left, cost.seconds(f64::from(of_sample.rays)));
        cost.zip(left()).is_none_or(suffices)
    };
    let (softened, is_whole) = soften(edges, has_time, (solution, camera), &of_sample, monitor)?;
    let irradiance: Vec<Bands> = indirect.iter().zip(&softened).map(both).collect();
    let pixels = view.sky.len();
    let (mut illuminance, mut share) = (vec![f32::NAN; pixels], vec![-1f32; pixels]);
    for (seen, e) in view.seen.iter().zip(&irradiance) {
        let (pixel, response) = (seen.pixel as usize, luminance(seen.response));
        if response > share[pixel] && !seen.behind {
            (share[pixel], illuminance[pixel]) = (response, luminance(*e));
        }
    }
    is_hurried |= !is_gathered || !is_whole || shadowing.rays < options.shadowing.rays;
    Ok(View { picture: view.picture(&irradiance), illuminance, watched, is_hurried })
}

/// Direct light with its edges within pixels, round by round as far as there is time for so many samples; whether there was for all.
fn soften(
    mut edges: Edges,
    has_time: impl Fn(f64) -> bool,
    (solution, camera): (&Solution, &Camera),
    shadowing: &Shadowing,
    monitor: &dyn Monitor,
) -> Result<(Vec<Bands>, bool), Error> {
    let mut sharp = edges.sharp();
    while !sharp.is_empty() && has_time(edges.most_samples(&sharp)) {
        sharp = edges
            .sample((solution.tracer(), camera), &sharp, |places| solution.direct_by(places, shadowing, 0, monitor))?;
    }
    Ok((edges.light(), sharp.is_empty()))
}

/// Casts the camera's rays, fewer of them where a small picture tells that they would take too much of the time.
fn cast(solution: &Solution, camera: &Camera, options: &RenderOptions, monitor: &dyn Monitor) -> ViewRays {
    let (tracer, RenderOptions { width, height, .. }) = (solution.tracer(), *options);
    if let Some(left) = pace::left(monitor) {
        let small = [width, height].map(|side| side.div_ceil(SMALLER));
        let (seconds, _) = pace::timed(|| ViewRays::new(tracer, camera, small[0], small[1]));
        let larger = f64::from(width) * f64::from(height) / (f64::from(small[0]) * f64::from(small[1]));
        if seconds * larger > CAST * left {
            return ViewRays::sampled(tracer, camera, (width, height), FEWEST_SAMPLES);
        }
    }
    ViewRays::new(tracer, camera, width, height)
}

/// What direct light of all pixels takes by its shadow rays.
fn cost(
    solution: &Solution,
    stations: &[Station],
    shadowing: &Shadowing,
    monitor: &dyn Monitor,
) -> Result<Cost, Error> {
    let (some, parts) = pace::sample(stations);
    let places: Vec<Place> = some.iter().map(|station| station.place).collect();
    let time = |rays: u32| {
        let (seconds, lit) =
            pace::timed(|| solution.direct_at(&places, &Shadowing { rays, ..*shadowing }, monitor).map(drop));
        lit.map(|()| (f64::from(rays), seconds))
    };
    Ok(Cost::new([time(LEAST_SHADOW_RAYS)?, time(TIMED_SHADOW_RAYS)?], parts))
}
