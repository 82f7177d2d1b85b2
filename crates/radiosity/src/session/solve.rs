//! Y = E + R (D + F Y) for several columns of light at once, sweep by sweep, so that it can be interrupted.
//!
//! Y is what surfaces give off but for what lamps carry directly, E the emission that goes through rows, D the direct
//! light. Chebyshev's semi-iteration (Golub and Varga 1961) of the gathering sweep G: Y' = ω (G(Y) − Y°) + Y°, with Y° the
//! iterate before, ω₁ = 1, ω₂ = 2/(2 − σ²), ω' = 1/(1 − σ² ω/4). With the spectrum of R F within ±σ a white room takes the
//! square root of the sweeps. What is beyond σ converges too, only slower. It multiplies by polynomials of R F, so light never
//! gets where no ray goes: a sealed dark room stays black to the last bit. The start and the rule for the end are
//! fixed, and so is every order of summation: the same rows give the same bits. Each column ends by its own residual and by what
//! sweeps still change of its dim places, and stays as it was then, so that its bits do not depend on what is solved beside it.

use radiosity_transport::live::{Lanes, Live};
use rayon::prelude::*;

/// How surfaces answer light, by id.
#[derive(Clone, Debug, Default)]
pub struct Answer {
    /// Reflectance.
    pub rho: Vec<[f32; 3]>,
    /// Sides of sheets: id, id of the other side, transmittance.
    pub passed: Vec<(u32, u32, [f32; 3])>,
    /// Area, m².
    pub area: Vec<f32>,
    /// σ: about the largest eigenvalue of R F.
    pub radius: f64,
}

impl Answer {
    /// Finds σ: reflectance weighted by what is reflected, so that a dark floor does not hide a white ceiling.
    pub fn measure(&mut self) {
        self.radius = (0..3)
            .map(|band| {
                let (mut sum, mut squares) = (0f64, 0f64);
                for (rho, area) in self.rho.iter().zip(&self.area) {
                    let (rho, area) = (f64::from(rho[band]), f64::from(*area));
                    sum += area * rho;
                    squares += area * rho * rho;
                }
                if sum > 0.0 { squares / sum } else { 0.0 }
            })
            .fold(0.0, f64::max);
    }

    /// What comes through the sheet whose side has an id, given the irradiance of ids.
    pub fn through(&self, id: u32, h: impl Fn(u32) -> [f32; 3]) -> [f32; 3] {
        let Ok(place) = self.passed.binary_search_by_key(&id, |side| side.0) else { return [0.0; 3] };
        let (_, other, tau) = self.passed[place];
        let h = h(other);
        std::array::from_fn(|band| tau[band] * h[band])
    }

    /// What an id makes of light, R H, given the irradiance of ids.
    pub fn reflected(&self, id: u32, h: impl Fn(u32) -> [f32; 3]) -> [f32; 3] {
        let (own, through) = (h(id), self.through(id, &h));
        std::array::from_fn(|band| self.rho[id as usize][band] * own[band] + through[band])
    }

    /// Y = R H.
    pub fn reflect<const W: usize>(&self, h: &[Lanes<W>], y: &mut [Lanes<W>]) {
        let lanes = y.par_iter_mut().zip(h).zip(&self.rho).with_min_len(4096);
        lanes.for_each(|((y, h), rho)| {
            for k in 0..W / 3 * 3 {
                y.0[k] = rho[k % 3] * h.0[k];
            }
        });
        self.pass(h, y);
    }

    /// Y = E + R H.
    pub fn respond<const W: usize>(&self, e: &[Lanes<W>], h: &[Lanes<W>], y: &mut [Lanes<W>]) {
        let lanes = y.par_iter_mut().zip(e).zip(h).zip(&self.rho).with_min_len(4096);
        lanes.for_each(|(((y, e), h), rho)| {
            for k in 0..W / 3 * 3 {
                y.0[k] = e.0[k] + rho[k % 3] * h.0[k];
            }
        });
        self.pass(h, y);
    }

    /// Adds what passes through sheets.
    fn pass<const W: usize>(&self, h: &[Lanes<W>], y: &mut [Lanes<W>]) {
        for (id, other, tau) in &self.passed {
            let h = h[*other as usize].0;
            for k in 0..W / 3 * 3 {
                y[*id as usize].0[k] += tau[k % 3] * h[k];
            }
        }
    }
}

/// By what a last step of several is to be multiplied, band by band, so that all those that would follow are in it: steps
/// of a geometric series, whose quotient is ⟨s, s°⟩/⟨s°, s°⟩ with s° the step before (Lyusternik 1947). Weighted by area.
pub fn tail(answer: &Answer, before: &[Lanes<4>], step: &[Lanes<4>]) -> [f32; 3] {
    let sums: Vec<[[f64; 2]; 3]> = before
        .par_chunks(SUM)
        .zip(step.par_chunks(SUM))
        .zip(answer.area.par_chunks(SUM))
        .map(|((before, step), area)| {
            let mut sums = [[0f64; 2]; 3];
            for ((before, step), area) in before.iter().zip(step).zip(area) {
                for (band, sum) in sums.iter_mut().enumerate() {
                    sum[0] += f64::from(area * step.0[band] * before.0[band]);
                    sum[1] += f64::from(area * before.0[band] * before.0[band]);
                }
            }
            sums
        })
        .collect();
    std::array::from_fn(|band| {
        let [product, square] = sums.iter().fold([0.0; 2], |sum, own| [sum[0] + own[band][0], sum[1] + own[band][1]]);
        let quotient = if square > 0.0 { (product / square).clamp(0.0, MOST_QUOTIENT) } else { 0.0 };
        (1.0 / (1.0 - quotient)) as f32
    })
}

/// With more, the noise of the last step would be multiplied by more than five; rooms that give back more of their light are
/// rare, and miss some of it for a moment.
const MOST_QUOTIENT: f64 = 0.8;

/// Elements that are summed together; sums of them are added in their order.
const SUM: usize = 1024;

/// Sweeps after which a solve ends in any case.
const MOST_SWEEPS: u32 = 300;

/// What each element lacks at the end, relative to itself, over the tolerance: at most this in the mean of fourth powers, so that a room of a hundredth of all lacks three times as much at most. The
/// residual is that of the brightest: rooms of a thousandth of the light outside would end where what is outside does. The same as in batch work (`radiosity_solve::deflated_jacobi`), where a third of
/// it and three times as much were not tried.
const SETTLED: f64 = 30.0;

/// Sweeps after which the residual is enough: some places are so dark that they settle for ever.
const MOST_LOCAL: u32 = 64;

/// The largest part of its error that a mode is believed to keep from sweep to sweep of plain gathering.
const SLOWEST: f64 = 0.98;

/// Light beside the brightest below which nobody asks.
const DARK: f32 = 1e-6;

/// What is lacking after a sweep over what that changed, where residuals have fallen by a factor q. A mode of the eigenvalue λ of R F lacks λ/(1 − λ) times its residual; beyond σ the semi-iteration keeps
/// q = (λ + √(λ² − σ²))/(1 + √(1 − σ²)) of it, and within σ none is slower than σ (Golub and Varga 1961).
fn lacking(q: f64, radius: f64) -> f64 {
    let kept = q * (1.0 + (1.0 - radius * radius).sqrt());
    let lambda = if kept > radius { 0.5 * (kept + radius * radius / kept) } else { radius };
    let lambda = lambda.clamp(0.0, SLOWEST);
    lambda / (1.0 - lambda)
}

/// Columns on their way: up to `W`/3 of them, three bands each.
#[derive(Clone, Debug)]
pub struct Solve<const W: usize> {
    e: Vec<Lanes<W>>,
    d: Vec<Lanes<W>>,
    y: Vec<Lanes<W>>,
    before: Vec<Lanes<W>>,
    gathered: Vec<Lanes<W>>,
    omega: f64,
    sweeps: u32,
    /// Irradiance by id, of each column at its last sweep.
    pub h: Vec<Lanes<W>>,
    /// ‖G(Y) − Y‖/‖Y‖ of each column at its last sweep, weighted by area; beyond the last column nothing.
    residuals: [f64; MOST_TOGETHER],
    /// What the last sweep changed of each element of a column, relative to itself, in the mean of fourth powers.
    changes: [f64; MOST_TOGETHER],
    has_ended: [bool; MOST_TOGETHER],
}

/// What a sweep changed of a column: squares of the change and of all, weighted by area; fourth powers of what changed of each
/// element relative to itself.
#[derive(Clone, Copy, Default)]
struct Change {
    squares: f64,
    whole: f64,
    fourths: f64,
}

/// Columns that are solved together at most.
pub const MOST_TOGETHER: usize = 5;

impl<const W: usize> Solve<W> {
    /// Begins at `start`, or at E + R D.
    pub fn new(answer: &Answer, e: Vec<Lanes<W>>, d: Vec<Lanes<W>>, start: Option<Vec<Lanes<W>>>) -> Solve<W> {
        let n = d.len();
        let y = start.unwrap_or_else(|| {
            let mut y = vec![Lanes::default(); n];
            answer.respond(&e, &d, &mut y);
            y
        });
        let nothing = || vec![Lanes::default(); n];
        let (before, gathered, h) = (nothing(), nothing(), nothing());
        Solve {
            e,
            d,
            y,
            before,
            gathered,
            omega: 0.0,
            sweeps: 0,
            h,
            residuals: [f64::INFINITY; MOST_TOGETHER],
            changes: [f64::INFINITY; MOST_TOGETHER],
            has_ended: [false; MOST_TOGETHER],
        }
    }

    /// One sweep over the first `rays` rays of each row; answers whether all columns have ended: the residual of each was at most `tolerance`, and its dim places lacked no more than
    /// some times that of theirs, or there were sweeps enough.
    pub fn sweep(&mut self, live: &Live, answer: &Answer, rays: usize, tolerance: f64) -> bool {
        live.gather(&self.y, rays, &mut self.gathered);
        let columns = W / 3;
        let is_open: [bool; W] = std::array::from_fn(|k| k / 3 < columns && !self.has_ended[k / 3]);
        let lanes = self.h.par_iter_mut().zip(&self.gathered).zip(&self.d).with_min_len(4096);
        lanes.for_each(|((h, gathered), d)| {
            for (k, is_open) in is_open.iter().enumerate() {
                h.0[k] = if *is_open { gathered.0[k] + d.0[k] } else { h.0[k] };
            }
        });
        answer.respond(&self.e, &self.h, &mut self.gathered);
        let changes = self.change(answer);
        self.sweeps += 1;
        for column in (0..columns).filter(|column| is_open[3 * column]) {
            let Change { squares, whole, fourths } = changes[column];
            let residual = if squares > 0.0 { (squares / whole.max(f64::MIN_POSITIVE)).sqrt() } else { 0.0 };
            let now = (fourths / self.y.len().max(1) as f64).powf(0.25);
            let left = now * lacking(now / self.changes[column], answer.radius);
            (self.residuals[column], self.changes[column]) = (residual, now);
            let is_settled = left <= SETTLED * tolerance || self.sweeps >= MOST_LOCAL;
            self.has_ended[column] = (residual <= tolerance && is_settled) || self.sweeps >= MOST_SWEEPS;
        }
        if self.has_ended[..columns].iter().all(|has_ended| *has_ended) {
            return true;
        }
        let square = answer.radius * answer.radius;
        self.omega = match self.sweeps {
            1 => 1.0,
            2 => 2.0 / (2.0 - square),
            _ => 1.0 / (1.0 - 0.25 * square * self.omega),
        };
        let omega = self.omega as f32;
        let lanes = self.before.par_iter_mut().zip(&self.gathered).with_min_len(4096);
        lanes.for_each(|(before, new)| {
            for k in 0..W {
                // The first sweep has no iterate before it, and ω = 1 takes it out.
                before.0[k] = if omega == 1.0 { new.0[k] } else { omega * (new.0[k] - before.0[k]) + before.0[k] };
            }
        });
        std::mem::swap(&mut self.before, &mut self.y);
        false
    }

    /// What a sweep changed of each column, given what it made.
    fn change(&self, answer: &Answer) -> [Change; MOST_TOGETHER] {
        let columns = W / 3;
        let larger = |a: [f32; W], b: [f32; W]| std::array::from_fn(|k| a[k].max(b[k]));
        let brightest = self.gathered.par_chunks(SUM).map(|new| new.iter().fold([0.0; W], |most, y| larger(most, y.0)));
        let dark = brightest.reduce(|| [0.0; W], larger).map(|most| (DARK * most).max(f32::MIN_POSITIVE));
        let sums: Vec<[Change; MOST_TOGETHER]> = self
            .gathered
            .par_chunks(SUM)
            .zip(self.y.par_chunks(SUM))
            .zip(answer.area.par_chunks(SUM))
            .map(|((new, old), area)| {
                let mut sums = [Change::default(); MOST_TOGETHER];
                for ((new, old), area) in new.iter().zip(old).zip(area) {
                    for (column, sum) in sums.iter_mut().enumerate().take(columns) {
                        let (mut own, mut fourths) = ([0f32; 2], 0f32);
                        for (k, dark) in dark.iter().enumerate().skip(3 * column).take(3) {
                            let change = new.0[k] - old.0[k];
                            own[0] += change.powi(2);
                            own[1] += old.0[k].powi(2);
                            fourths += (change / new.0[k].abs().max(*dark)).powi(4);
                        }
                        sum.squares += f64::from(*area) * f64::from(own[0]);
                        sum.whole += f64::from(*area) * f64::from(own[1]);
                        sum.fourths += f64::from(fourths) / 3.0;
                    }
                }
                sums
            })
            .collect();
        sums.iter().fold([Change::default(); MOST_TOGETHER], |mut sums, own| {
            for (sum, own) in sums.iter_mut().zip(own) {
                sum.squares += own.squares;
                sum.whole += own.whole;
                sum.fourths += own.fourths;
            }
            sums
        })
    }

    /// The largest residual of a column.
    pub fn residual(&self) -> f64 {
        self.residuals[..W / 3].iter().copied().fold(0.0, f64::max)
    }

    /// The direct light that it is solved for.
    pub fn direct(&self) -> &[Lanes<W>] {
        &self.d
    }

    /// What surfaces give off at the last sweep.
    pub fn radiosity(&self) -> &[Lanes<W>] {
        &self.y
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::{Session, SessionOptions};
    use crate::{Material, Scene, Sky};
    use std::time::Duration;

    /// A column has the bits that it has alone, whatever is solved beside it and wherever it lies: dark, even, or so uneven
    /// that it takes other sweeps.
    #[test]
    fn a_column_does_not_depend_on_those_beside_it() {
        let options = SessionOptions { elements: 900, rays: 64, shadow_rays: Some(4), ..SessionOptions::default() };
        let mut session = Session::new(crate::cornell_box(), &options).unwrap();
        while !session.step(Duration::from_millis(3)).is_done {}
        let (live, answer) = (&session.live, &session.answer);
        let lit = |column: usize, id: usize| match column {
            0 => [1e3, 0.0, 2.0],
            1 => [0.0; 3],
            2 => [if id == 7 { 1e5 } else { 0.0 }; 3],
            3 => [id as f32, 0.0, 0.0],
            _ => [if id == 400 { 1e4 } else { 0.0 }; 3],
        };
        let solve = |columns: &[usize]| match columns.len() {
            1 => solved::<4>(live, answer, columns, lit),
            2 => solved::<8>(live, answer, columns, lit),
            _ => solved::<16>(live, answer, columns, lit),
        };
        let alone: Vec<(Vec<[u32; 3]>, u32)> = (0..5).map(|column| solve(&[column]).remove(0)).collect();
        let sweeps: std::collections::BTreeSet<u32> = alone.iter().map(|(_, sweeps)| *sweeps).collect();
        assert!(sweeps.len() > 2, "columns that all end together show nothing: {sweeps:?}");
        for columns in [&[0, 1][..], &[2, 0], &[3, 4], &[0, 1, 2, 3, 4], &[4, 2, 3, 0, 1], &[2, 1, 0], &[0, 3, 4, 2]] {
            for (column, (light, _)) in columns.iter().zip(solve(columns)) {
                assert!(light == alone[*column].0, "column {column} among {columns:?}");
            }
        }
    }

    /// A room behind a small window, with ground before it that has all of the sky: its light is carried on as far as it
    /// goes, though what that changes is next to nothing of the light on the ground.
    #[test]
    fn a_dim_room_is_solved_as_far_as_what_is_outside() {
        use glam::DVec3;
        let gray = |rho: f32| Material { base_color: [rho, rho, rho, 1.0], ..Material::default() };
        let room = |walls: f32| {
            let sky = Sky::Overcast { horizontal: [10_000.0; 3] };
            let mut scene = Scene { sky, materials: vec![gray(walls), gray(0.3)], ..Scene::default() };
            let mut quad = |object: &str, material, corners: [[f64; 3]; 4]| {
                scene.add_quad(object, material, corners.map(DVec3::from));
            };
            quad("room", 0, [[0., 0., 0.], [0., 0., 4.], [4., 0., 4.], [4., 0., 0.]]);
            quad("room", 0, [[0., 3., 0.], [4., 3., 0.], [4., 3., 4.], [0., 3., 4.]]);
            quad("room", 0, [[0., 0., 0.], [0., 3., 0.], [0., 3., 4.], [0., 0., 4.]]);
            quad("room", 0, [[4., 0., 0.], [4., 0., 4.], [4., 3., 4.], [4., 3., 0.]]);
            quad("room", 0, [[0., 0., 4.], [0., 3., 4.], [4., 3., 4.], [4., 0., 4.]]);
            let pieces =
                [([0., 1.9], [0., 3.]), ([2.1, 4.], [0., 3.]), ([1.9, 2.1], [0., 1.4]), ([1.9, 2.1], [1.6, 3.])];
            for ([x0, x1], [y0, y1]) in pieces {
                quad("inside", 0, [[x0, y0, 0.], [x1, y0, 0.], [x1, y1, 0.], [x0, y1, 0.]]);
                quad("outside", 0, [[x1, y0, -0.1], [x0, y0, -0.1], [x0, y1, -0.1], [x1, y1, -0.1]]);
            }
            quad("ground", 1, [[-6., -0.01, -12.], [-6., -0.01, -0.1], [10., -0.01, -0.1], [10., -0.01, -12.]]);
            scene
        };
        for walls in [0.5, 0.8, 0.9] {
            let options = SessionOptions { element_size: Some(0.4), rays: 1024, ..SessionOptions::default() };
            let mut session = Session::new(room(walls), &options).unwrap();
            while !session.step(Duration::from_millis(3)).is_done {}
            let solve = |tolerance: f64| {
                let mut solve = Solve::new(&session.answer, session.emission(), session.direct_light(), None);
                while !solve.sweep(&session.live, &session.answer, 1024, tolerance) {}
                (solve.h, solve.sweeps)
            };
            let exact = solve(0.0).0;
            let bodies = session.live.world().bodies.iter();
            let lit: Vec<usize> = bodies.flat_map(|body| body.first as usize..body.dark() as usize).collect();
            let lit: Vec<usize> = lit.into_iter().filter(|id| exact[*id].0[0] > 0.0).collect();
            let dim = lit.iter().filter(|id| exact[**id].0[0] < 100.0).count();
            assert!(dim > 500, "{dim} elements are no dim room");
            for tolerance in [1e-3, 1e-4, 1e-5] {
                let (found, sweeps) = solve(tolerance);
                let fourth = |id: &usize| f64::from(found[*id].0[0] / exact[*id].0[0] - 1.0).powi(4);
                let off = (lit.iter().map(fourth).sum::<f64>() / lit.len() as f64).powf(0.25);
                assert!(off <= SETTLED * tolerance, "{walls}, {tolerance}: {off} after {sweeps} sweeps");
            }
        }
    }

    /// Columns, and how many sweeps they took together.
    fn solved<const W: usize>(
        live: &Live,
        answer: &Answer,
        columns: &[usize],
        lit: impl Fn(usize, usize) -> [f32; 3],
    ) -> Vec<(Vec<[u32; 3]>, u32)> {
        let ids = live.ids();
        let (mut e, mut d) = (vec![Lanes::<W>::default(); ids], vec![Lanes::<W>::default(); ids]);
        for (k, column) in columns.iter().enumerate() {
            for id in 0..ids {
                // The third is found by rows, and all others by shadow rays.
                let to = if *column == 2 { &mut e } else { &mut d };
                to[id].0[3 * k..3 * k + 3].copy_from_slice(&lit(*column, id));
            }
        }
        let mut solve = Solve::new(answer, e, d, None);
        while !solve.sweep(live, answer, 64, 1e-4) {}
        assert!(solve.residual() <= 1e-4);
        let of = |k: usize| solve.h.iter().map(|h| [0, 1, 2].map(|band| h.0[3 * k + band].to_bits())).collect();
        (0..columns.len()).map(|k| (of(k), solve.sweeps)).collect()
    }
}
