//! Integrals by the Gauss-Kronrod pair of 7 and 15 points (Kronrod 1965; nodes as in QUADPACK, Piessens et al. 1983),
//! on intervals and on squares, each halved where the pair disagrees most until the sum of disagreements is small.
//!
//! The disagreement is the error of the 7-point rule, far above that of the 15-point value that is kept: an estimate on
//! the safe side wherever the nodes see every feature of the integrand. What lies wholly between nodes is not seen.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Nodes on [−1, 1], by magnitude, and their weights in the rule of 15 and of 7 points.
const NODES: [[f64; 3]; 8] = [
    [0.991_455_371_120_812_6, 0.022_935_322_010_529_22, 0.0],
    [0.949_107_912_342_758_5, 0.063_092_092_629_978_55, 0.129_484_966_168_869_7],
    [0.864_864_423_359_769_1, 0.104_790_010_322_250_2, 0.0],
    [0.741_531_185_599_394_4, 0.140_653_259_715_525_9, 0.279_705_391_489_276_7],
    [0.586_087_235_467_691_1, 0.169_004_726_639_267_9, 0.0],
    [0.405_845_151_377_397_2, 0.190_350_578_064_785_4, 0.381_830_050_505_118_9],
    [0.207_784_955_007_898_5, 0.204_432_940_075_298_9, 0.0],
    [0.0, 0.209_482_141_084_727_8, 0.417_959_183_673_469_4],
];

/// Share of a value that rounding takes: smaller disagreements are noise and are not chased.
const ROUNDING: f64 = 4e-16;

/// All 15 nodes on [0, 1] with their two weights there.
fn nodes() -> [[f64; 3]; 15] {
    std::array::from_fn(|i| {
        let [x, k, g] = NODES[i.min(14 - i)];
        [0.5 + 0.5 * x.copysign(i as f64 - 7.0), 0.5 * k, 0.5 * g]
    })
}

/// An integral and how far it may be off.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Integral {
    pub(super) value: f64,
    pub(super) error: f64,
}

/// The 15-point value of an integral from `a` to `b`.
pub(super) fn fifteen(a: f64, b: f64, f: impl Fn(f64) -> f64) -> f64 {
    (b - a) * nodes().iter().map(|[x, k, _]| k * f(a + x * (b - a))).sum::<f64>()
}

/// A piece of the domain: lower and upper corner, its integral, and the direction in which to halve it.
struct Cell<const N: usize> {
    chart: usize,
    low: [f64; N],
    high: [f64; N],
    integral: Integral,
    /// Below this an error is rounding.
    noise: f64,
    worst: usize,
}

impl<const N: usize> PartialEq for Cell<N> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl<const N: usize> Eq for Cell<N> {}
impl<const N: usize> PartialOrd for Cell<N> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl<const N: usize> Ord for Cell<N> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.integral.error.total_cmp(&other.integral.error)
    }
}

/// An integral being refined.
pub(super) struct Adaptive<const N: usize, F: Fn(usize, [f64; N]) -> f64> {
    f: F,
    cells: BinaryHeap<Cell<N>>,
    /// What is finer than rounding allows.
    settled: Integral,
    /// Values of the integrand asked for so far.
    pub(super) evaluations: usize,
}

impl<F: Fn(usize, [f64; 1]) -> f64> Adaptive<1, F> {
    /// The integral over the intervals between successive `breaks`.
    pub(super) fn line(f: F, breaks: &[f64]) -> Self {
        let mut this = Adaptive { f, cells: BinaryHeap::new(), settled: Integral::default(), evaluations: 0 };
        for pair in breaks.windows(2).filter(|pair| pair[1] > pair[0]) {
            this.push(0, [pair[0]], [pair[1]]);
        }
        this
    }
}

impl<F: Fn(usize, [f64; 2]) -> f64> Adaptive<2, F> {
    /// The integral over the unit squares of several charts, each cut in `turns` along its second coordinate.
    pub(super) fn charts(f: F, charts: usize, turns: usize) -> Self {
        let mut this = Adaptive { f, cells: BinaryHeap::new(), settled: Integral::default(), evaluations: 0 };
        for (chart, i) in (0..charts).flat_map(|c| (0..turns).map(move |i| (c, i))) {
            let at = |i: usize| i as f64 / turns as f64;
            this.push(chart, [0.0, at(i)], [1.0, at(i + 1)]);
        }
        this
    }
}

impl<const N: usize, F: Fn(usize, [f64; N]) -> f64> Adaptive<N, F> {
    /// The integral as far as it is known.
    pub(super) fn integral(&self) -> Integral {
        // In order of place, so that the sum does not depend on the heap.
        let mut cells: Vec<&Cell<N>> = self.cells.iter().collect();
        cells.sort_by(|a, b| (a.chart, a.low).partial_cmp(&(b.chart, b.low)).unwrap_or(Ordering::Equal));
        cells.iter().fold(self.settled, |sum, cell| Integral {
            value: sum.value + cell.integral.value,
            error: sum.error + cell.integral.error,
        })
    }

    /// Halves cells until the error is at most `tolerance` or the budget is spent.
    pub(super) fn refine(&mut self, tolerance: f64, evaluations: usize) -> Integral {
        let mut error = self.integral().error;
        while error > tolerance && self.evaluations < evaluations {
            let Some(cell) = self.cells.pop() else { break };
            if cell.integral.error <= cell.noise {
                // The largest error left is rounding: nothing better can be had.
                self.cells.push(cell);
                break;
            }
            error -= cell.integral.error;
            let axis = cell.worst;
            let middle = 0.5 * (cell.low[axis] + cell.high[axis]);
            if middle <= cell.low[axis] || middle >= cell.high[axis] {
                self.settled.value += cell.integral.value;
                self.settled.error += cell.integral.error;
                error += cell.integral.error;
                continue;
            }
            let (mut high, mut low) = (cell.high, cell.low);
            high[axis] = middle;
            low[axis] = middle;
            error += self.push(cell.chart, cell.low, high);
            error += self.push(cell.chart, low, cell.high);
        }
        self.integral()
    }

    /// Integrates over a cell and returns its error.
    fn push(&mut self, chart: usize, low: [f64; N], high: [f64; N]) -> f64 {
        let nodes = nodes();
        let volume: f64 = (0..N).map(|i| high[i] - low[i]).product();
        // Sums of the rule of 15 points in every direction, and with that of 7 in one of them.
        let (mut fine, mut coarse, mut size) = (0.0, [0.0; N], 0.0);
        for index in 0..15_usize.pow(N as u32) {
            let (mut at, mut rest, mut weight) = (low, index, 1.0);
            let mut ratio = [0.0; N];
            for i in 0..N {
                let [x, k, g] = nodes[rest % 15];
                rest /= 15;
                at[i] += x * (high[i] - low[i]);
                weight *= k;
                ratio[i] = g / k;
            }
            let value = weight * (self.f)(chart, at);
            fine += value;
            size += value.abs();
            for i in 0..N {
                coarse[i] += ratio[i] * value;
            }
        }
        self.evaluations += 15_usize.pow(N as u32);
        let errors = coarse.map(|c| volume * (c - fine).abs());
        let worst = (0..N).max_by(|i, j| errors[*i].total_cmp(&errors[*j])).unwrap_or(0);
        let error = errors.iter().sum::<f64>();
        let integral = Integral { value: volume * fine, error };
        self.cells.push(Cell { chart, low, high, integral, noise: ROUNDING * volume * size, worst });
        error
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nodes_integrate_what_they_promise() {
        for degree in 0..22 {
            let exact = 1.0 / f64::from(degree + 1);
            assert!((fifteen(0.0, 1.0, |x| x.powi(degree)) - exact).abs() < 1e-15, "{degree}");
        }
        let seven: f64 = nodes().iter().map(|[x, _, g]| g * x.powi(13)).sum();
        assert!((seven - 1.0 / 14.0).abs() < 1e-15);
    }

    #[test]
    fn kinks_and_roots_are_found_within_the_stated_error() {
        for k in 1..12 {
            let tolerance = 0.1_f64.powi(k);
            let got = Adaptive::line(|_, [x]| (x - 0.3_f64).abs().sqrt(), &[0.0, 1.0]).refine(tolerance, 1 << 20);
            let exact = 2.0 / 3.0 * (0.3_f64.powf(1.5) + 0.7_f64.powf(1.5));
            assert!(got.error <= tolerance && (got.value - exact).abs() <= got.error + 1e-15, "{got:?} {exact}");
        }
        let disc = |_: usize, [x, y]: [f64; 2]| (1.0 - x * x - y * y).max(0.0).sqrt();
        let got = Adaptive::charts(disc, 1, 1).refine(1e-6, 1 << 22);
        assert!((got.value - std::f64::consts::PI / 6.0).abs() <= got.error.min(1e-6), "{got:?}");
    }
}
