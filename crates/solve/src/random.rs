//! What the random methods share: numbers, whither light goes, and the mean of independent runs.
//!
//! Power that leaves i arrives at j with probability F_ij (for A_j H_j = Σ_i F_ij A_i B_i by reciprocity), and
//! nowhere with 1 − Σ_j F_ij.

use crate::gauge::{Gauge, begin, is_done, remainder};
use crate::{Go, Info, Params, Response, Rows, Sheets, SolveError, Space};

/// SplitMix64 (Steele, Lea & Flood 2014): small, seeded, the same on every machine.
pub(crate) struct Random(u64);

impl Random {
    /// Streams of different numbers are independent.
    pub fn new(seed: u64, stream: u64) -> Random {
        let mut mix = Random(seed ^ stream.wrapping_mul(0xd1b5_4a32_d192_ed03));
        Random(mix.bits())
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// The cumulative rows of F.
pub(crate) struct Destinations {
    starts: Vec<usize>,
    columns: Vec<u32>,
    cumulative: Vec<f64>,
}

impl Destinations {
    fn new(transport: &impl Rows) -> Result<Destinations, SolveError> {
        let mut made = Destinations { starts: vec![0], columns: Vec::new(), cumulative: Vec::new() };
        let mut negative = false;
        for i in 0..transport.space().dim() {
            let mut sum = 0.0;
            transport.row(i, |j, factor| {
                negative |= factor < 0.0;
                if factor > 0.0 {
                    sum += factor;
                    made.columns.push(j as u32);
                    made.cumulative.push(sum);
                }
            });
            made.starts.push(made.columns.len());
        }
        if negative {
            return Err(SolveError::NotApplicable("random methods need form factors, which are not negative"));
        }
        Ok(made)
    }

    /// Where power from i arrives, if anywhere, and by how much it must be multiplied: by more than one only where a
    /// row sums to more than one.
    pub fn draw(&self, i: usize, random: &mut Random) -> Option<(usize, f64)> {
        let (first, end) = (self.starts[i], self.starts[i + 1]);
        let all = self.cumulative[first..end].last()?.max(1.0);
        let u = random.unit() * all;
        let place = self.cumulative[first..end].partition_point(|sum| *sum <= u);
        (first + place < end).then(|| (self.columns[first + place] as usize, all))
    }
}

/// What a run works on.
pub(crate) struct Walks<'a> {
    pub destinations: Destinations,
    /// Reflectances and transmittances.
    pub sheets: Sheets<'a>,
    pub bands: usize,
    /// Area of each unknown, or whatever weighs it in its space.
    pub area: Vec<f64>,
    /// Samples that leave all unknowns together.
    pub samples: f64,
}

impl Walks<'_> {
    /// Where light that lands on an unknown comes out on the other side, and τ by band there.
    pub fn through(&self, landed: usize) -> Option<(usize, &[f64])> {
        let (other, _) = self.sheets.passed(landed, self.bands)?;
        Some((other, self.sheets.passed(other, self.bands)?.1))
    }

    /// The power of each unknown: area times |unshot|, summed over the bands; and the sum of all.
    pub fn power(&self, unshot: &[f64]) -> (Vec<f64>, f64) {
        let of = |(area, x): (&f64, &[f64])| area * x.iter().map(|x| x.abs()).sum::<f64>();
        let power: Vec<f64> = self.area.iter().zip(unshot.chunks_exact(self.bands)).map(of).collect();
        let sum = power.iter().sum();
        (power, sum)
    }
}

/// Deals `samples` out in proportion to `power`: with one random offset for all, each gets its share rounded up or
/// down, and exactly its share in expectation (Bekaert 1999, §5.2: systematic sampling).
pub(crate) fn deal(power: &[f64], sum: f64, samples: f64, random: &mut Random, mut give: impl FnMut(usize, usize)) {
    let offset = random.unit();
    let (mut reached, mut dealt) = (0.0, 0usize);
    for (i, power) in power.iter().enumerate() {
        reached += power;
        let until = (reached / sum * samples + offset) as usize;
        if until > dealt {
            give(i, until - dealt);
            dealt = until;
        }
    }
}

/// Repeats independent runs and shows their mean after each. A run adds to a field an unbiased estimate of
/// Σ_k (R F)^k r for the residual r of the start, and returns how often it drew.
pub(crate) fn repeat<T: Rows>(
    transport: &T,
    response: &(impl Response + ?Sized),
    e: &[f64],
    b: &mut [f64],
    params: &Params,
    mut step: impl FnMut(&[f64], &Info) -> Go,
    run: impl Fn(&Walks, &[f64], &mut Random, &mut [f64]) -> u64,
) -> Result<Info, SolveError> {
    let (Some(sheets), true) = (response.sheets(), response.is_reciprocal()) else {
        return Err(SolveError::NotApplicable(
            "random methods need a reciprocal transport and a response of plain surfaces and sheets",
        ));
    };
    if response.largest().iter().any(|most| *most >= 1.0) {
        return Err(SolveError::NotApplicable("random walks never end where a reflectance is one or more"));
    }
    let (bands, unknowns) = (response.bands(), transport.space().dim());
    let mut area = vec![0.0; unknowns];
    transport.space().accumulate(&vec![1.0; unknowns], 1, |i, _, weight| area[i] = weight);
    let destinations = Destinations::new(transport)?;
    let samples = params.samples.max(1) as f64 * unknowns as f64;
    let walks = Walks { destinations, sheets, bands, area, samples };

    let gauge = Gauge::new(transport, response, e);
    let start = b.to_vec();
    let (mut h, mut r, mut left) = (vec![0.0; b.len()], vec![0.0; b.len()], vec![0.0; b.len()]);
    let begun = begin(transport, b, &mut h, bands)?;
    remainder(response, (e, b, &h), &mut r);
    let mut info = Info { work: begun as f64, ..Info::default() };
    gauge.enter(transport, &r, &mut info);
    if is_done(b, &info, params, &mut step)? {
        return Ok(info);
    }

    // Mean and squared deviations so far (Welford 1962).
    let (mut mean, mut squares) = (vec![0.0; b.len()], vec![0.0; b.len()]);
    loop {
        let mut one = vec![0.0; b.len()];
        let mut random = Random::new(params.seed, info.steps as u64);
        let draws = run(&walks, &r, &mut random, &mut one);
        info.steps += 1;
        let runs = info.steps as f64;
        for k in 0..b.len() {
            let off = one[k] - mean[k];
            mean[k] += off / runs;
            squares[k] += off * (one[k] - mean[k]);
            b[k] = start[k] + mean[k];
        }
        // One run alone does not tell its error.
        info.standard_error = squares.iter().map(|s| (s / (runs - 1.0) / runs).sqrt()).collect();
        if info.steps == 1 {
            info.standard_error.fill(f64::INFINITY);
        }

        // A draw reads one of the N² entries; the residual is worth an application.
        info.work += draws as f64 / (unknowns * unknowns) as f64 + 1.0;
        transport.apply(b, &mut h, bands)?;
        gauge.measure(transport, response, (e, b, &h), &mut left, &mut info);
        if is_done(b, &info, params, &mut step)? {
            return Ok(info);
        }
    }
}
