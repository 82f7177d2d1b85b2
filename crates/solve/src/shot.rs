//! One shot: what an unknown has not yet shot goes to all others (catalogue 38; Cohen, Chen, Wallace & Greenberg
//! 1988, §3).
//!
//! With ΔB the unshot radiosity, a shot of amount a from i is h_j = F_ji a, ΔB_i ← ΔB_i − a, ΔB ← ΔB + R h. It takes
//! one column of F and O(N) memory. The sum shot so far, B − ΔB, has ΔB as its exact residual at all times.

use crate::gauge::{Gauge, begin, energy, remainder};
use crate::{Info, Response, Shoot, SolveError, Space, Transport};

/// The unshot radiosity and what a shot needs.
pub(crate) struct Shots<'a, T, R: ?Sized> {
    transport: &'a T,
    response: &'a R,
    gauge: Gauge,
    unshot: Vec<f64>,
    h: Vec<f64>,
    /// What the last shot brought to each: R h.
    reflected: Vec<f64>,
    energy: Vec<f64>,
}

impl<'a, T: Shoot, R: Response + ?Sized> Shots<'a, T, R> {
    /// ΔB = E + R F B − B for the start; E for a start from zero, without an application of F.
    pub fn new(transport: &'a T, response: &'a R, e: &[f64], b: &[f64]) -> Result<(Shots<'a, T, R>, Info), SolveError> {
        let (mut h, mut unshot) = (vec![0.0; b.len()], vec![0.0; b.len()]);
        let begun = begin(transport, b, &mut h, response.bands())?;
        remainder(response, (e, b, &h), &mut unshot);
        let gauge = Gauge::new(transport, response, e);
        let energy = vec![0.0; transport.space().dim()];
        let shots = Shots { transport, response, gauge, unshot, h, reflected: vec![0.0; b.len()], energy };
        Ok((shots, Info { work: begun as f64, ..Info::default() }))
    }

    /// The unshot radiosity ΔB.
    pub fn unshot(&self) -> &[f64] {
        &self.unshot
    }

    /// What the last shot brought to each, ρ_j F_ji a.
    pub fn reflected(&self) -> &[f64] {
        &self.reflected
    }

    /// Enters ΔB in the account as the residual.
    pub fn account(&self, info: &mut Info) {
        self.gauge.enter(self.transport, &self.unshot, info);
    }

    /// The unknown with the most energy to shoot, A_i |ΔB_i + extra_i| summed over the bands; of equals the first.
    pub fn brightest(&mut self, extra: Option<&[f64]>) -> usize {
        let (energy, bands) = (&mut self.energy, self.response.bands());
        energy.fill(0.0);
        let mut add = |i: usize, _: usize, weighted: f64| energy[i] += weighted.abs();
        match extra {
            None => self.transport.space().accumulate(&self.unshot, bands, &mut add),
            Some(extra) => {
                let sum: Vec<f64> = self.unshot.iter().zip(extra).map(|(own, extra)| own + extra).collect();
                self.transport.space().accumulate(&sum, bands, &mut add);
            }
        }
        let mut best = 0;
        for (i, energy) in self.energy.iter().enumerate() {
            if *energy > self.energy[best] {
                best = i;
            }
        }
        best
    }

    /// Shoots `amount`, a radiosity by band, from `source`. A shot is the N-th part of an application of F.
    pub fn shoot(&mut self, source: usize, amount: &[f64], info: &mut Info) {
        self.transport.shoot(source, amount, &mut self.h);
        self.response.respond(&self.h, &mut self.reflected);
        for (unshot, amount) in self.unshot[source * amount.len()..].iter_mut().zip(amount) {
            *unshot -= amount;
        }
        for (unshot, reflected) in self.unshot.iter_mut().zip(&self.reflected) {
            *unshot += reflected;
        }
        info.steps += 1;
        info.work += 1.0 / self.energy.len() as f64;
    }

    /// Shoots all that `source` has, and says how much that was.
    pub fn shoot_all(&mut self, source: usize, info: &mut Info) -> Vec<f64> {
        let bands = self.response.bands();
        let amount = self.unshot[source * bands..(source + 1) * bands].to_vec();
        self.shoot(source, &amount, info);
        amount
    }
}

/// The ambient estimate of what is still to come (catalogue 41; Cohen et al. 1988, §4.3).
///
/// The mean unshot radiosity ΔB̄ = Σ A_j ΔB_j/Σ A_j, reflected again and again by walls of mean reflectance ρ̄, makes
/// the irradiance ΔB̄/(1 − ρ̄) everywhere. It tends to zero with ΔB.
pub(crate) struct Ambient {
    /// ρ, as R 1.
    reflectance: Vec<f64>,
    /// 1/((1 − ρ̄) ΣA) of each band; nothing where ρ̄ is not below one.
    factor: Vec<f64>,
}

impl Ambient {
    pub fn new<T: Transport>(transport: &T, response: &(impl Response + ?Sized), n: usize) -> Ambient {
        let bands = response.bands();
        let (ones, mut reflectance) = (vec![1.0; n], vec![0.0; n]);
        response.respond(&ones, &mut reflectance);
        let (area, reflected) = (energy(transport, &ones, bands), energy(transport, &reflectance, bands));
        let factor = area.iter().zip(reflected).map(|(a, r)| if r < *a { 1.0 / (a - r) } else { 0.0 }).collect();
        Ambient { reflectance, factor }
    }

    /// The ambient irradiance of each band.
    pub fn irradiance<T: Transport>(&self, transport: &T, unshot: &[f64]) -> Vec<f64> {
        let sums = energy(transport, unshot, self.factor.len());
        sums.iter().zip(&self.factor).map(|(sum, factor)| sum * factor).collect()
    }

    /// What all unknowns reflect of an ambient irradiance.
    pub fn reflected(&self, irradiance: &[f64], out: &mut [f64]) {
        let bands = irradiance.len();
        for (out, rho) in out.chunks_exact_mut(bands).zip(self.reflectance.chunks_exact(bands)) {
            for ((out, rho), irradiance) in out.iter_mut().zip(rho).zip(irradiance) {
                *out = rho * irradiance;
            }
        }
    }
}
