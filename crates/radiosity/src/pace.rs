//! Keeping a time that is given: how much of it is kept for what is made of a solution, and with how many rays that is made.
//!
//! Nothing is known of a machine before the run. So a small part of the work, evenly spread, is done twice, with few rays and with
//! more, and thrown away; seconds are taken to be a + b·rays, and all the rest is done with as many rays as the time leaves.
//! Of work that is done once there is nothing to be mended later, so it aims at [`SURE`] of the time. Where a machine gets busy after
//! it was timed, the time is missed by as much.
//!
//! What is here are functions of seconds that were measured and seconds that are left: without a deadline none of them is asked.

use crate::monitor::{Monitor, Timed};
use std::time::{Duration, Instant};

/// Part of the time left that the work is planned to fill: small parts are timed to some ten percent.
const SURE: f64 = 0.85;

/// Part of the time that is kept at most for what is made of a solution, and all that is kept before that is known: light that is
/// written or seen takes several times as long as the solution that it is read from.
const KEPT: f64 = 0.6;

/// Items that stand for all where a part is timed, about: a hundredth of a picture. Of few items one in so many does. As many
/// follow one another as threads take at a time, since those share what is in the caches.
const SAMPLE: usize = 1 << 13;
const ONE_IN: usize = 16;
const RUN: usize = 64;

/// Seconds that work takes by its rays: some whatever they are, and some for each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cost {
    fixed: f64,
    each: f64,
}

impl Cost {
    /// By a part of the work, one in `parts`, that was done with few rays and with more: rays and seconds of either. At least half of
    /// the latter goes with the rays, whatever the clock says of two short times.
    pub fn new([(few, short), (many, long)]: [(f64, f64); 2], parts: f64) -> Cost {
        let each = ((long - short) / (many - few)).max(0.5 * long / many);
        Cost { fixed: parts * (long - each * many).max(0.0), each: parts * each }
    }

    /// Seconds with so many rays.
    pub fn seconds(&self, rays: f64) -> f64 {
        self.fixed + self.each * rays
    }

    /// Rays that so many seconds suffice for, with some left over; within limits, of which the lower one is kept to.
    pub fn rays(&self, seconds: f64, [least, most]: [f64; 2]) -> f64 {
        let affordable = (SURE * seconds - self.fixed) / self.each.max(f64::MIN_POSITIVE);
        // In this order, as there may be nothing left to choose.
        affordable.min(most).max(least)
    }

    /// What a part of the work takes.
    pub fn of(&self, part: f64) -> Cost {
        Cost { fixed: part * self.fixed, each: part * self.each }
    }

    /// The part of the work with so many rays that seconds suffice for, with some left over.
    pub fn part(&self, seconds: f64, rays: f64) -> f64 {
        (SURE * seconds / self.seconds(rays).max(f64::MIN_POSITIVE)).min(1.0)
    }
}

/// Whether so many seconds are sure to do for what is expected to take `needed`.
pub(crate) fn suffices(seconds: f64, needed: f64) -> bool {
    needed <= SURE * seconds
}

/// Rays that seconds suffice for with `each` for a ray, with some left over.
pub(crate) fn affordable(seconds: f64, each: f64) -> usize {
    (SURE * seconds / each.max(f64::MIN_POSITIVE)) as usize
}

/// Seconds of a `total` that are kept for what is to come, which takes as many as `full` if nothing is spared.
pub(crate) fn kept(total: f64, full: f64) -> f64 {
    (full / SURE).min(KEPT * total)
}

/// Seconds that are left; none without a deadline.
pub(crate) fn left(monitor: &dyn Monitor) -> Option<f64> {
    monitor.deadline().map(|deadline| deadline.saturating_duration_since(Instant::now()).as_secs_f64())
}

/// Runs that are spread evenly over all items, and how many times as many items there are.
pub(crate) fn sample<T: Copy>(items: &[T]) -> (Vec<T>, f64) {
    let stride = (items.len() / SAMPLE).max(ONE_IN);
    // Where there are few runs, the middle one.
    let first = (stride / 2).min(items.len() / RUN / 2);
    let some: Vec<T> = items.chunks(RUN).skip(first).step_by(stride).flatten().copied().collect();
    let parts = items.len() as f64 / some.len().max(1) as f64;
    (some, parts)
}

/// The seconds that work takes, and what comes of it.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = Instant::now();
    let result = work();
    (start.elapsed().as_secs_f64(), result)
}

/// What is going to be made of a solution. Where there is a deadline, time is kept for it.
#[derive(Clone, Copy, Debug, Default)]
pub struct After {
    /// Pixels of pictures.
    pub pixels: usize,
    /// Texels or vertices that light is written in.
    pub points: usize,
}

/// Seconds that reading a solution at one place took for each shadow ray and for each gather ray, and an audit of it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Reading {
    pub shadow_ray: f64,
    pub gather_ray: f64,
    pub audit: f64,
}

/// Shadow rays of a pixel in the mean, as light is found at about half of them, and what is gathered beside them
/// takes, relative to them, about.
const PIXEL: (f64, f64) = (128.0, 2.0);

/// What edges take beside all texels, about.
pub(crate) const EDGES: f64 = 0.5;

impl After {
    /// Seconds that this is going to take if nothing is spared, with so many shadow and gather rays for each point.
    pub(crate) fn full(&self, reading: &Reading, shadow_rays: f64, gather_rays: f64) -> f64 {
        let (rays, gathered) = PIXEL;
        let pixel = rays * reading.shadow_ray * (1.0 + gathered);
        let point = (1.0 + EDGES) * (shadow_rays * reading.shadow_ray + gather_rays * reading.gather_ray);
        let audits = f64::from(u8::from(self.pixels > 0)) + f64::from(u8::from(self.points > 0));
        self.pixels as f64 * pixel + self.points as f64 * point + audits * reading.audit
    }

    fn is_nothing(&self) -> bool {
        self.pixels + self.points == 0
    }
}

/// A time that ends earlier than the whole, so that what is to come has its own.
pub(crate) struct Paced<'a> {
    /// Watches what comes before that.
    pub monitor: Timed<'a>,
    total: f64,
    deadline: Option<Instant>,
}

impl<'a> Paced<'a> {
    pub fn new(monitor: &'a dyn Monitor, after: &After) -> Paced<'a> {
        let (total, deadline) = (left(monitor).unwrap_or(f64::INFINITY), monitor.deadline());
        let paced = Paced { monitor: Timed::unlimited(monitor), total, deadline };
        paced.keep(if after.is_nothing() { 0.0 } else { f64::INFINITY });
        paced
    }

    /// Keeps time for what takes so many seconds if nothing is spared.
    pub fn keep(&self, full: f64) {
        let Some(deadline) = self.deadline else { return };
        let kept = Duration::from_secs_f64(kept(self.total, full));
        self.monitor.set_end(deadline.checked_sub(kept).unwrap_or(deadline));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A machine whose clock is known: seconds of work on so many items.
    struct Machine {
        fixed: f64,
        each: f64,
        items: f64,
    }

    impl Machine {
        fn seconds(&self, items: f64, rays: f64) -> f64 {
            items * (self.fixed + self.each * rays)
        }

        /// As a hundredth of the items tells it.
        fn timed(&self) -> Cost {
            let time = |rays: f64| (rays, self.seconds(self.items / 100.0, rays));
            Cost::new([time(16.0), time(64.0)], 100.0)
        }
    }

    /// On machines a thousand times as fast as each other, whatever the time: work ends within it, or is done with the fewest
    /// rays; more time never gives fewer, and all that is wanted is done where there is time for it.
    #[test]
    fn work_keeps_within_the_time_by_its_own_estimate() {
        for speed in [1e-8, 1e-7, 1e-6, 1e-5] {
            for fixed in [0.0, 8.0, 30.0] {
                let machine = Machine { fixed: fixed * speed, each: speed, items: 1e6 };
                let mut before = 0.0;
                for k in -10..20 {
                    let seconds = 2f64.powi(k);
                    let rays = machine.timed().rays(seconds, [16.0, 256.0]);
                    assert!((16.0..=256.0).contains(&rays) && rays >= before, "{rays} after {before}");
                    let takes = machine.seconds(machine.items, rays);
                    assert!(takes <= seconds || rays == 16.0, "{takes} s of {seconds} with {rays} rays");
                    let part = machine.timed().part(seconds, rays);
                    assert!(part <= 1.0 && part * takes <= seconds, "{part} of {takes} s in {seconds}");
                    assert!(rays == 16.0 || part > 1.0 - 1e-9, "{part} with {rays} rays");
                    let all = machine.seconds(machine.items, 256.0);
                    assert!(rays == 256.0 || 0.8 * seconds < all, "{rays} rays in {seconds} s");
                    before = rays;
                }
            }
        }
    }

    /// Two short times of which the longer work took less say nothing of the rays: they are not taken to be free.
    #[test]
    fn rays_are_never_free() {
        let cost = Cost::new([(16.0, 0.03), (64.0, 0.02)], 100.0);
        assert!(cost.rays(10.0, [16.0, 1e6]) < 1000.0, "{cost:?}");
        assert!((cost.seconds(64.0) - 2.0).abs() < 1e-9, "{cost:?}");
    }

    /// Refinement leaves time for what follows, as much as it takes or more than half; without a deadline there is none to leave.
    #[test]
    fn time_is_kept_for_what_follows_and_none_without_a_deadline() {
        assert_eq!((kept(10.0, 0.0), kept(10.0, f64::INFINITY)), (0.0, 6.0));
        assert!(kept(10.0, 2.0) > 2.0 && kept(10.0, 2.0) < 2.5);
        let after = After { pixels: 1000, points: 1000 };
        let free = Paced::new(&(), &after);
        free.keep(1.0);
        assert!(free.monitor.deadline().is_none() && left(&free.monitor).is_none());
        let timed = Timed::new(&(), Duration::from_secs(1000));
        let paced = Paced::new(&timed, &after);
        let before =
            |paced: &Paced| timed.deadline().zip(paced.monitor.deadline()).map(|(end, own)| (end - own).as_secs_f64());
        assert!(before(&paced).is_some_and(|kept| kept > 590.0 && kept <= 600.0));
        paced.keep(85.0);
        assert!(before(&paced).is_some_and(|kept| (kept - 100.0).abs() < 0.1));
        assert_eq!(Paced::new(&timed, &After::default()).monitor.deadline(), timed.deadline());
    }

    /// Parts that are timed are spread over all items, and few beside them.
    #[test]
    fn samples_are_small_and_even() {
        for n in [1, 10, 100, 3000, 100_000, 1_000_000] {
            let items: Vec<usize> = (0..n).collect();
            let (some, parts) = sample(&items);
            assert!(!some.is_empty() && (parts * some.len() as f64 - n as f64).abs() < 1e-6 * n as f64);
            assert!(some.len() <= RUN + n / 8 && some.len() <= 2 * SAMPLE, "{} of {n}", some.len());
            let mean = some.iter().sum::<usize>() as f64 / some.len() as f64;
            assert!(n < 100_000 || (mean / n as f64 - 0.5).abs() < 0.05, "{mean} of {n}");
        }
        assert!(sample::<u32>(&[]).0.is_empty());
    }
}
