//! Y = E + R (D + F Y) for several columns of light at once, sweep by sweep, so that it can be interrupted.
//!
//! Y is what surfaces give off but for what lamps carry directly, E the emission that goes through rows, D the direct
//! light. Chebyshev's semi-iteration (Golub and Varga 1961) of the gathering sweep G: Y' = ω (G(Y) − Y°) + Y°, with Y° the
//! iterate before, ω₁ = 1, ω₂ = 2/(2 − σ²), ω' = 1/(1 − σ² ω/4). With the spectrum of R F within ±σ a white room takes the
//! square root of the sweeps. What is beyond σ converges too, only slower. It multiplies by polynomials of R F, so light never
//! gets where no ray goes: a sealed dark room stays black to the last bit. The start and the rule for the end are
//! fixed, and so is every order of summation: the same rows give the same bits.

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
    /// Irradiance by id, at the last sweep.
    pub h: Vec<Lanes<W>>,
    /// ‖G(Y) − Y‖/‖Y‖ of the last sweep, weighted by area.
    pub residual: f64,
}

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
        Solve { e, d, y, before, gathered, omega: 0.0, sweeps: 0, h, residual: f64::INFINITY }
    }

    /// One sweep over the first `rays` rays of each row; answers whether the residual is at most `tolerance`.
    pub fn sweep(&mut self, live: &Live, answer: &Answer, rays: usize, tolerance: f64) -> bool {
        live.gather(&self.y, rays, &mut self.h);
        self.h.par_iter_mut().zip(&self.d).with_min_len(4096).for_each(|(h, d)| {
            for k in 0..W {
                h.0[k] += d.0[k];
            }
        });
        answer.respond(&self.e, &self.h, &mut self.gathered);
        let sums: Vec<[f64; 2]> = self
            .gathered
            .par_chunks(SUM)
            .zip(self.y.par_chunks(SUM))
            .zip(answer.area.par_chunks(SUM))
            .map(|((new, old), area)| {
                let mut sums = [0f64; 2];
                for ((new, old), area) in new.iter().zip(old).zip(area) {
                    let mut own = [0f32; 2];
                    for k in 0..W {
                        own[0] += (new.0[k] - old.0[k]).powi(2);
                        own[1] += old.0[k].powi(2);
                    }
                    sums[0] += f64::from(*area) * f64::from(own[0]);
                    sums[1] += f64::from(*area) * f64::from(own[1]);
                }
                sums
            })
            .collect();
        let [change, whole] = sums.iter().fold([0f64; 2], |sum, own| [sum[0] + own[0], sum[1] + own[1]]);
        self.residual = if change > 0.0 { (change / whole.max(f64::MIN_POSITIVE)).sqrt() } else { 0.0 };
        self.sweeps += 1;
        if self.residual <= tolerance || self.sweeps >= MOST_SWEEPS {
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

    /// The direct light that it is solved for.
    pub fn direct(&self) -> &[Lanes<W>] {
        &self.d
    }

    /// What surfaces give off at the last sweep.
    pub fn radiosity(&self) -> &[Lanes<W>] {
        &self.y
    }
}
