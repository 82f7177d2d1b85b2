//! Light in 8 bits: what stands for the brightest code, so that as little as possible is lost.
//!
//! The inside of a lamp shade has hundreds of times the light of the room, and a room next door a hundredth of it: scaled by its brightest texel, a page in 8 bits
//! has seven steps for the one and none for the other. So what is bright on next to nothing of the page is cut off, as far as that costs less than
//! it gives the rest.

use radiosity_io::gltf_out::Encoding;
use radiosity_scene::Bands;
use radiosity_scene::display::{linear, srgb};

/// Classes of light to a factor of two, and how many there are.
const TO_AN_OCTAVE: f32 = 8.0;
const CLASSES: usize = 8 * 40;

/// Candidates to a factor of two.
const CANDIDATES: usize = 2;

/// Light below this part of the median counts as if it was as much: nobody sees it beside the rest.
const UNSEEN: f64 = 0.01;

/// What is cut off counts so many times as much as what is rounded by as much of itself: bright places are looked at first.
const CUT: f64 = 4.0;

/// Nothing is cut off unless it makes the loss so many times smaller: a page that holds all is worth half as fine steps.
const WORTH: f64 = 4.0;

/// Light is coarse from this part of itself on by which it is off.
const COARSE: f64 = 0.1;

/// The light of a page by classes, from the brightest down.
pub(crate) struct Classes {
    peak: f32,
    counts: Vec<f64>,
    encoding: Encoding,
}

/// The code of a part of the brightest light.
pub(crate) fn code(share: f32, encoding: Encoding) -> u8 {
    let share = share.clamp(0.0, 1.0);
    (255.0 * if encoding == Encoding::Srgb { srgb(share) } else { share }).round() as u8
}

/// What a code stands for, as a part of the brightest light.
fn decoded(code: f64, encoding: Encoding) -> f64 {
    let share = code / 255.0;
    if encoding == Encoding::Srgb { linear(share) } else { share }
}

impl Classes {
    /// Of the light of all texels that have some.
    pub(crate) fn new(lux: &[Bands], encoding: Encoding) -> Classes {
        let lit = || lux.iter().flatten().copied().filter(|e| *e > 0.0 && e.is_finite());
        let peak = lit().fold(0.0, f32::max);
        let mut counts = vec![0.0; CLASSES];
        for e in lit() {
            counts[((TO_AN_OCTAVE * (peak / e).log2()) as usize).min(CLASSES - 1)] += 1.0;
        }
        Classes { peak, counts, encoding }
    }

    /// The middle of a class, lx.
    fn light(&self, class: usize) -> f64 {
        f64::from(self.peak) * (-(class as f64 + 0.5) / f64::from(TO_AN_OCTAVE)).exp2()
    }

    /// By what part of itself light is off where `most` is the brightest that there is, in the root mean square of all that is rounded alike.
    fn off(&self, light: f64, most: f64) -> f64 {
        if light > most {
            return 1.0 - most / light;
        }
        let below = (f64::from(code((light / most) as f32, self.encoding)) - 0.5).max(0.0);
        let step = most * (decoded(below + 1.0, self.encoding) - decoded(below, self.encoding));
        (step / light / 12f64.sqrt()).min(1.0)
    }

    /// Light below which nobody asks, and the median; none where there is no light.
    fn least(&self) -> Option<[f64; 2]> {
        let total: f64 = self.counts.iter().sum();
        let mut sum = 0.0;
        let is_median = |count: &f64| {
            sum += count;
            2.0 * sum >= total
        };
        let median = self.counts.iter().position(is_median).filter(|_| total > 0.0)?;
        Some([UNSEEN * self.light(median), self.light(median)])
    }

    /// The light for which the brightest code is to stand, lx.
    pub(crate) fn brightest(&self) -> f32 {
        let Some([least, median]) = self.least() else { return 1.0 };
        let lost = |most: f64| -> f64 {
            let of_class = |(class, count): (usize, &f64)| {
                let light = self.light(class);
                let cut = if light > most { CUT } else { 1.0 };
                cut * count * (self.off(light, most) * (light / least).min(1.0)).powi(2)
            };
            self.counts.iter().enumerate().filter(|(_, count)| **count > 0.0).map(of_class).sum()
        };
        let peak = f64::from(self.peak);
        let candidates = (0..).map(|k| peak * (-f64::from(k) / CANDIDATES as f64).exp2());
        let candidates = candidates.take_while(|most| *most == peak || *most > median);
        let whole = lost(peak);
        let lower = |best: (f64, f64), next: (f64, f64)| if next.0 < best.0 { next } else { best };
        let best = candidates.map(|most| (lost(most), most)).reduce(lower);
        best.filter(|(lost, _)| WORTH * lost < whole).map_or(self.peak, |(_, most)| most as f32)
    }

    /// How many numbers that somebody sees are coarse where `most` is the brightest light, and how many there are in all.
    pub(crate) fn coarse(&self, most: f32) -> [f64; 2] {
        let least = self.least().map_or(0.0, |[least, _]| least);
        let is_coarse = |class: usize| {
            let light = self.light(class);
            light >= least && self.off(light, f64::from(most)) > COARSE
        };
        let coarse = self.counts.iter().enumerate().filter(|(class, _)| is_coarse(*class));
        [coarse.map(|(_, count)| count).sum(), self.counts.iter().sum()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By what part of themselves texels are off in 8 bits, in the root mean square, and the brightest light.
    fn off(lux: &[Bands], encoding: Encoding) -> (f64, f32) {
        let most = Classes::new(lux, encoding).brightest();
        let squares = lux.iter().map(|e| {
            let read = f64::from(most) * decoded(f64::from(code(e[0] / most, encoding)), encoding);
            (read / f64::from(e[0]) - 1.0).powi(2)
        });
        ((squares.sum::<f64>() / lux.len() as f64).sqrt(), most)
    }

    /// The inside of a shade does not take all steps from a room and from a dim one next to it; light that is alike all over keeps its brightest texel.
    #[test]
    fn what_is_bright_on_next_to_nothing_leaves_steps_to_the_rest() {
        let even: Vec<Bands> = (0..1000).map(|k| [100.0 + 0.3 * k as f32; 3]).collect();
        let night = (0..100_000).map(|k| match k {
            0..20 => [6000.0; 3],
            20..60_000 => [5.0 + 1e-4 * k as f32; 3],
            _ => [0.2 + 1e-6 * k as f32; 3],
        });
        let night: Vec<Bands> = night.collect();
        for encoding in [Encoding::Srgb, Encoding::Linear] {
            let (even_off, most) = off(&even, encoding);
            assert!(even_off < 0.005 && most == 399.7, "{even_off} {most}");
            let (night_off, most) = off(&night, encoding);
            let limit = if encoding == Encoding::Srgb { 0.03 } else { 0.12 };
            assert!(night_off < limit && most < 100.0, "{night_off} {most}");
        }
        let [coarse, all] = Classes::new(&night, Encoding::Srgb).coarse(6000.0);
        assert!(coarse >= 120_000.0 && all == 300_000.0, "{coarse} of {all}");
        assert!(Classes::new(&night, Encoding::Srgb).coarse(20.0)[0] < 100.0);
        assert_eq!(Classes::new(&[[0.0; 3]], Encoding::Srgb).brightest(), 1.0);
    }
}
