//! Rows of exchange areas: all that one facet or one zone exchanges with, by lines that start on it.
//!
//! **From a facet** lines have the density cos θ/π, and those that arrive at facet j stand for exactly F_ij: the mean
//! over them is weighted by the view factor, which is known far better than lines would tell. With nothing in the way
//! the row is the view factors, bit by bit. A facet that no line met is seen along the line between the middles.
//!
//! **From a zone** lines enter it everywhere (`cell`). On its chord, of optical depth τ, the zone emits τ, keeps
//! τ − (1 − e^-τ) and sends 1 − e^-τ on. The mean of τ is known, 4κV/A, and so is a part of the error: what is sent is
//! corrected by β = e^(−4κV/A) times what the mean of τ is off (a control variate; the slope of 1 − e^-τ), and what is
//! not sent is kept. Rows sum to 4κV exactly, less what leaves the enclosure.
//!
//! Lines are Sobol' points with Owen scrambling in independent replicates, whose spread is the error. They are made
//! more until the errors of the row are what was asked.

use super::cell::Entrances;
use super::medium::{Line, Medium};
use crate::row::points::Places;

use radiosity_trace::sampling::{Sequence, cosine_direction, frame, hash};

/// The stream of sample points of the first replicate.
const STREAM: u32 = 0x0e00;

/// Independent replicates: enough for a standard error to be known to 18 %; more would shorten the sequences, which gain by
/// length. A power of two, so that the mean of equal numbers is their value.
const REPLICATES: usize = 16;

/// Standard errors that the error covers: beyond it lies one in a hundred where sixteen replicates tell the spread.
const DEVIATIONS: f64 = 3.0;

/// What happens to three lines in all on average may be seen by none, with a chance of 5 % (rule of three): so many are the
/// fewest for an accuracy.
const UNSEEN: f64 = 3.0;

/// Fewest and, in a first attempt, most lines of a replicate.
const FIRST: [usize; 2] = [16, 1 << 12];

/// The rate at which errors fall with the number of lines, by which the next number is chosen.
const RATE: f64 = 0.75;

/// Lines of a replicate that a facet must be met by to be weighed for itself: it is met by none with a chance of 2 %.
const FEW: f64 = 4.0;

/// Most times that lines are multiplied by at once: the rate is only about right.
const TIMES: f64 = 16.0;

/// One row: x_ij by unknown and three standard errors, m².
pub(super) struct Row {
    pub values: Vec<f64>,
    pub errors: Vec<f64>,
    /// Lines that the values come from, and all that were followed for them.
    used: usize,
    pub lines: usize,
}

impl Row {
    /// The error of an entry as others should see it: what no line met may still be there, by the rule of three. `sum` is
    /// the row's.
    pub fn error(&self, j: usize, sum: f64) -> f64 {
        if self.values[j] == 0.0 { sum * (UNSEEN / (self.used as f64).max(UNSEEN)) } else { self.errors[j] }
    }
}

/// When a row is good.
#[derive(Clone, Copy)]
pub(super) struct Aim {
    /// Largest error, relative to the smaller sum of the two rows.
    pub accuracy: f64,
    /// Most lines.
    pub lines: usize,
    pub seed: u32,
}

/// The row of facet `i` of so much area; `faced` are the facets that it sees with A_i F_ij, m².
pub(super) fn facet_row(medium: &Medium, area: f64, i: usize, faced: &[(u32, f64)], aim: Aim) -> Row {
    let facets = &medium.around.enclosure.facets;
    let (own, nothing) = (&facets[i], facets.len());
    let unknowns = nothing + medium.dense.len();
    let mut exchange = vec![0.0; nothing + 1];
    faced.iter().for_each(|(j, value)| exchange[*j as usize] = *value);
    if medium.dense.is_empty() {
        exchange.resize(unknowns, 0.0);
        return Row { values: exchange, errors: vec![0.0; unknowns], used: usize::MAX, lines: 0 };
    }
    exchange[nothing] = (area - faced.iter().map(|(_, value)| value).sum::<f64>()).max(0.0);
    let (places, frame, ignored) = (Places::new(own), frame(own.normal()), medium.around.in_plane_of(own));
    let inwards = medium.around.inwards(own.radius());
    let mut line = Line::default();

    // Of each line where it ended, what was left of it, and up to where zones took of it.
    let mut ends: Vec<(u32, f64, usize)> = Vec::new();
    let mut taken: Vec<(u32, f64)> = Vec::new();
    let replicate = |sequence: &Sequence, lines: usize| {
        ends.clear();
        taken.clear();
        for index in 0..lines {
            let [u, v, x, y] = sequence.point(index as u32).map(f64::from);
            let place = own.centroid() + inwards * (places.at(x, y) - own.centroid());
            let direction = cosine_direction(&frame, u, v);
            let (item, end) = medium.around.meets(place, direction, |facet| ignored[facet]);
            let left = medium.follow(&mut line, (place, direction), [0.0, end], None, 1.0);
            taken.extend_from_slice(&line.taken);
            ends.push((item as u32, left, taken.len()));
        }
        let (mut met, mut left) = (vec![0.0; nothing + 1], vec![0.0; nothing]);
        for (item, rest, _) in &ends {
            met[*item as usize] += 1.0;
            if let Some(left) = left.get_mut(*item as usize) {
                *left += rest;
            }
        }
        // What a line stands for. Facets that few lines meet share what they meet.
        let few = |j: usize| met[j] == 0.0 || exchange[j] * (lines as f64) < FEW * area;
        let (rest, lines_of_rest) =
            (0..=nothing).filter(|j| few(*j)).fold((0.0, 0.0), |(sum, lines), j| (sum + exchange[j], lines + met[j]));
        // What no line at all stands for goes to the others.
        let times = if lines_of_rest == 0.0 && rest < area { area / (area - rest) } else { 1.0 };
        let stands_for: Vec<f64> = (0..=nothing)
            .map(|j| if few(j) { rest / f64::max(lines_of_rest, 1.0) } else { times * exchange[j] / met[j] })
            .collect();
        let mut values = vec![0.0; unknowns];
        let mut from = 0;
        for (item, _, to) in &ends {
            for (k, taken) in &taken[from..*to] {
                values[nothing + *k as usize] += stands_for[*item as usize] * taken;
            }
            from = *to;
        }
        // Facets are weighed at the end, by the lines of all replicates.
        values[..nothing].copy_from_slice(&left);
        met.truncate(nothing);
        (values, met)
    };
    let straight = |j: usize, line: &mut Line| {
        let along = facets[j].centroid() - own.centroid();
        let ray = (own.centroid(), along.normalize_or_zero());
        medium.follow(line, ray, [0.0, along.length()], None, 1.0)
    };
    let thickest = medium.most_taken();
    let judge = |replicates: &[(Vec<f64>, Vec<f64>)]| {
        let (mut values, mut errors) = spread(replicates.iter().map(|(values, _)| &values[..]));
        let n = replicates.len() as f64;
        for j in 0..nothing {
            let met: f64 = replicates.iter().map(|(_, met)| met[j]).sum();
            let mut line = Line::default();
            let through = match exchange[j] {
                0.0 => 0.0,
                _ if met == 0.0 => straight(j, &mut line),
                _ => n * values[j] / met,
            };
            // The spread of a ratio, from its residuals; few lines do not tell it.
            let off = |(left, met): &(Vec<f64>, Vec<f64>)| (left[j] - through * met[j]).powi(2);
            let squares: f64 = replicates.iter().map(off).sum();
            let error = DEVIATIONS * (n / (n - 1.0) * squares).sqrt() / f64::max(met, 1.0);
            values[j] = exchange[j] * through;
            errors[j] = exchange[j] * (error + thickest * UNSEEN / (met + UNSEEN)).min(1.0);
        }
        (values, errors)
    };
    let worst = |errors: &[f64]| errors.iter().fold(0.0, |worst: f64, e| worst.max(*e)) / area;
    refine(i, aim, replicate, judge, worst)
}

/// The row of the zone of unknown `k`, counted from the facets'. `known` has the error by which facets know what they
/// exchange with it, and their areas.
pub(super) fn zone_row(medium: &Medium, k: usize, known: &[(f64, f64)], aim: Aim) -> Row {
    let nothing = medium.around.enclosure.facets.len();
    let unknowns = nothing + medium.dense.len();
    let zone = medium.zone(k);
    let (kappa, whole, area) = (zone.extinction(), zone.exchange(), zone.cell.surface_area());
    let mean_depth = kappa * zone.cell.mean_chord();
    let beta = (-mean_depth).exp();
    let entrances = Entrances::new(&zone.cell);
    // Facets on the zone's own faces are not in the way of lines that enter there.
    let ignored: Vec<Vec<bool>> = zone.cell.faces().iter().map(|face| medium.around.in_plane_of(face)).collect();
    let middle = |face: Option<usize>| {
        let face = face.and_then(|f| entrances.face(f));
        face.map_or((zone.cell.middle(), 0.5 * zone.cell.mean_chord()), |f| (f.centroid(), f.radius()))
    };
    let mut line = Line::default();
    let replicate = |sequence: &Sequence, lines: usize| {
        let mut row = vec![0.0; unknowns];
        let (mut emitted, mut stays) = (0.0, 0.0);
        for index in 0..lines {
            let (face, place, direction) = entrances.at(sequence.point(index as u32).map(f64::from));
            let (centre, radius) = middle(face);
            let place = centre + medium.around.inwards(radius) * (place - centre);
            let Some([_, end]) = zone.cell.chord(place, direction) else { continue };
            let depth = kappa * end.max(0.0);
            emitted += depth;
            stays += kept(depth);
            let is_ignored = |facet: usize| face.is_some_and(|f| ignored[f][facet]);
            let (item, far) = medium.around.meets(place, direction, is_ignored);
            let left = medium.follow(&mut line, (place, direction), [end, far.max(end)], Some(k), -(-depth).exp_m1());
            line.taken.iter().for_each(|(k, taken)| row[nothing + *k as usize] += taken);
            if item < nothing {
                row[item] += left;
            }
        }
        // Means over lines, whose mean depth is known to be 4κV/A: where it is off, what lines send is, β times as much.
        let (of_line, sends) = (area / lines as f64, emitted - stays);
        let off = emitted - lines as f64 * mean_depth;
        let scale = if sends > 0.0 { of_line * (1.0 - beta * off / sends).max(0.0) } else { 0.0 };
        row.iter_mut().for_each(|x| *x *= scale);
        row[nothing + k] = (of_line * (stays - (1.0 - beta) * off)).clamp(0.0, whole);
        row
    };
    let judge = |rows: &[Vec<f64>]| spread(rows.iter().map(Vec::as_slice));
    let worst = |errors: &[f64]| {
        let with_facets = known.iter().zip(errors).map(|((error, area), own)| both(*error, *own) / whole.min(*area));
        let with_zones = errors[nothing..].iter().map(|error| error / whole);
        with_facets.chain(with_zones).fold(0.0, f64::max)
    };
    refine(nothing + k, aim, replicate, judge, worst)
}

/// The error of the mean of two estimates, each weighted by the inverse square of its error.
pub(super) fn both(a: f64, b: f64) -> f64 {
    if a > 0.0 && b > 0.0 { a * b / a.hypot(b) } else { 0.0 }
}

/// τ − (1 − e^-τ), what a chord keeps of what it emits; by its series where the difference would lose digits.
fn kept(depth: f64) -> f64 {
    if depth < 1e-2 {
        // The next term is below 1e-13 of it.
        0.5 * depth
            * depth
            * (1.0
                - depth / 3.0 * (1.0 - depth / 4.0 * (1.0 - depth / 5.0 * (1.0 - depth / 6.0 * (1.0 - depth / 7.0)))))
    } else {
        depth + (-depth).exp_m1()
    }
}

/// Mean and three standard errors over replicates.
fn spread<'a>(replicates: impl Iterator<Item = &'a [f64]>) -> (Vec<f64>, Vec<f64>) {
    let (mut mean, mut squares) = (Vec::new(), Vec::new());
    let mut n = 0.0;
    for values in replicates {
        n += 1.0;
        mean.resize(values.len(), 0.0);
        squares.resize(values.len(), 0.0);
        // Welford: sums of squares would lose the digits of small spreads.
        for ((value, mean), square) in values.iter().zip(&mut mean).zip(&mut squares) {
            let off = value - *mean;
            *mean += off / n;
            *square += off * (value - *mean);
        }
    }
    let errors = squares.iter().map(|s: &f64| DEVIATIONS * (s / (n * (n - 1.0))).sqrt()).collect();
    (mean, errors)
}

/// Replicates of ever more lines until what `judge` makes of them is good by its `worst` error.
fn refine<R>(
    row: usize,
    aim: Aim,
    mut replicate: impl FnMut(&Sequence, usize) -> R,
    judge: impl Fn(&[R]) -> (Vec<f64>, Vec<f64>),
    worst: impl Fn(&[f64]) -> f64,
) -> Row {
    let each =
        |lines: f64| ((lines / REPLICATES as f64).clamp(1.0, f64::from(1u32 << 31)) as usize).next_power_of_two();
    // Not more than allowed, rounded down to a power of two.
    let most = each(aim.lines as f64 / 2.0 + 1.0);
    let mut lines = each(UNSEEN / aim.accuracy).clamp(FIRST[0], FIRST[1]).min(most);
    let mut traced = 0;
    loop {
        let sequence = |r| Sequence::new(hash(hash(aim.seed) ^ row as u32), STREAM + r as u32);
        let replicates: Vec<R> = (0..REPLICATES).map(|r| replicate(&sequence(r), lines)).collect();
        traced += REPLICATES * lines;
        let (values, errors) = judge(&replicates);
        let worst = worst(&errors);
        if worst <= aim.accuracy || lines >= most {
            return Row { values, errors, used: REPLICATES * lines, lines: traced };
        }
        let times = (worst / aim.accuracy).powf(1.0 / RATE).clamp(2.0, TIMES);
        lines = ((lines as f64 * times) as usize).next_power_of_two().min(most);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The series and the difference agree where they meet, and small depths keep τ²/2.
    #[test]
    fn what_a_chord_keeps_has_its_digits() {
        for depth in [9.999e-3, 1e-3, 1e-6] {
            let (a, b) = (kept(depth), depth + (-depth).exp_m1());
            assert!((a - b).abs() < 1e-17 + 1e-12 * a, "{a} {b}");
        }
        assert!((kept(1e-9) / 5e-19 - 1.0).abs() < 1e-9);
        assert_eq!(kept(0.0), 0.0);
    }
}
