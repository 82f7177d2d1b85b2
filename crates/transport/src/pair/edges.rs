//! ∫∫ ln r² over two straight edges, the building block of the contour integral for form factors.
//!
//! Parallel edges have an elementary integral. Skew edges are described by their distances a and b from the feet of the
//! common perpendicular, of length d, and their angle θ: r² = a² + b² − 2ab cos θ + d². The divergence theorem, with
//! x·∇ ln r² = 2 − 2d²/r², leaves integrals over one edge each and d² ∫∫ 1/r², which is elementary for edges in one
//! plane (d = 0) and otherwise, with a sin θ = d sinh x and b sin θ = d sinh y, a sum of dilogarithms of e^{±x±y±iθ},
//! as Schröder and Hanrahan 1993 ("On the form factor between two polygons") found by other means. Edges apart are
//! integrated by Gauss, which is faster and loses fewer digits. Loses digits only for edges that are almost, not quite,
//! parallel and much nearer than they are long.

use super::gauss::gauss;
use glam::DVec3;

/// Sine below which edges count as parallel: coordinates in double precision say no more.
const PARALLEL: f64 = 1e-13;

/// Digits that Gauss rules are chosen for, as −ln ρ⁻²ⁿ: 1e-13, as the integrand's singularities are logarithms, whose
/// errors are smaller by 1/n².
const DIGITS: f64 = 30.0;

/// Sum of the distances of an edge's ends from the other edge, relative to its length, from which on Gauss is used:
/// for skew edges where some ten points suffice, which cost as much as eight dilogarithms; for parallel ones where the
/// second difference of the closed form begins to cancel.
const APART: f64 = 1.9;
const APART_PARALLEL: f64 = 6.0;

/// Most points of the rules over both edges: thirteen cost as much as the closed form.
const BOTH: usize = 12;

/// Ratio of lengths beyond which the longer edge is divided, so that no difference cancels, and how many lengths of the
/// shorter one are kept to either side: what is beyond them is apart.
const SLENDER: f64 = 10.0;
const KEPT: f64 = 4.0;

/// Ratio of lengths below which an edge is a point: what it adds is a rounding of the rest.
const POINT: f64 = 1e-14;

/// Reach of the feet of the common perpendicular, in lengths of the longer edge, up to which the closed form of skew
/// edges is taken: it loses as many digits as this has.
const REACH: f64 = 1e3;

/// Distance between the lines of almost parallel edges, in lengths of the longer one, from which on Gauss over pieces
/// comes to an end soon: it takes some hundred pieces. Edges nearer than this and as good as parallel lose digits, down
/// to nine.
const GAP: f64 = 0.01;

/// Deepest division of an edge: a piece of 2⁻³⁰ adds less than one rounding.
const DEEPEST: u32 = 30;

/// A straight edge.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    start: DVec3,
    end: DVec3,
    direction: DVec3,
    length: f64,
}

impl Edge {
    /// The edge between two points; `None` where they coincide.
    pub fn new(start: DVec3, end: DVec3) -> Option<Edge> {
        let length = start.distance(end);
        (length > 0.0).then(|| Edge { start, end, direction: (end - start) / length, length })
    }

    /// Its length.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Its unit direction.
    pub fn direction(&self) -> DVec3 {
        self.direction
    }

    /// The part from length `low` to length `high`.
    fn part(&self, low: f64, high: f64) -> Option<Edge> {
        let at = |x: f64| if x >= self.length { self.end } else { self.start + x * self.direction };
        Some(Edge { start: at(low), end: at(high), length: high - low, ..*self }).filter(|part| part.length > 0.0)
    }

    /// Distance of a point from the nearest point of the edge.
    pub fn distance(&self, p: DVec3) -> f64 {
        let along = (p - self.start).dot(self.direction).clamp(0.0, self.length);
        (self.start + along * self.direction).distance(p)
    }

    /// ∫ ln |p − q|² over the points q of the edge.
    pub fn log_from(&self, p: DVec3) -> f64 {
        let w = p - self.start;
        let along = w.dot(self.direction);
        let height = (w - along * self.direction).length();
        let (low, high) = (-along, self.length - along);
        let near = (low * low + height * height).max(f64::MIN_POSITIVE);
        let far = (high * high + height * height).max(f64::MIN_POSITIVE);
        // high·ln far − low·ln near, by sum and difference: far − near = length·(high + low) without cancellation, and
        // ln far − ln near = 2 artanh ((far − near)/(far + near)).
        let sum = high + low;
        let x = self.length * sum / (near + far);
        let (mean, difference) = if x.abs() < 0.125 {
            let square = x * x;
            let odd = |series: f64, k: i32| series * square + 1.0 / f64::from(k);
            (0.5 * (near * far).ln(), 2.0 * x * [15, 13, 11, 9, 7, 5, 3, 1].into_iter().fold(0.0, odd))
        } else {
            let logs = (near.ln(), far.ln());
            (0.5 * (logs.0 + logs.1), logs.1 - logs.0)
        };
        let angle = (height * self.length).atan2(height * height + low * high);
        self.length * (mean - 2.0) + 0.5 * sum * difference + 2.0 * height * angle
    }
}

/// ∫∫ ln |p − q|² over the points p of one edge and q of the other.
pub fn log_integral(e: &Edge, f: &Edge) -> f64 {
    // e is the shorter one.
    let (e, f) = if e.length > f.length { (f, e) } else { (e, f) };
    let normal = e.direction.cross(f.direction);
    let sine = normal.length();
    let is_parallel = sine <= PARALLEL;
    let apart = (f.distance(e.start) + f.distance(e.end)) / e.length;
    if apart >= if is_parallel { APART_PARALLEL } else { APART } {
        return by_gauss(e, f, apart);
    }
    if e.length < POINT * f.length {
        return e.length * f.log_from(0.5 * (e.start + e.end));
    }
    if f.length > SLENDER * e.length {
        let along = (0.5 * (e.start + e.end) - f.start).dot(f.direction);
        let [low, high] = [along - KEPT * e.length, along + KEPT * e.length].map(|x| x.clamp(0.0, f.length));
        let parts = [f.part(0.0, low), f.part(low, high), f.part(high, f.length)];
        return parts.iter().flatten().map(|part| log_integral(e, part)).sum();
    }
    if is_parallel {
        return parallel(e, f);
    }
    let feet = Feet::new(e, f, normal, sine);
    let reach = feet.a.abs().max(feet.b.abs()) / f.length;
    if reach <= REACH {
        return skew(e, f, &feet, sine);
    }
    // Almost parallel: by the way that loses least.
    if feet.gap > GAP * f.length {
        divided(e, f, 0)
    } else if reach * f64::EPSILON < sine {
        skew(e, f, &feet, sine)
    } else {
        parallel(e, f)
    }
}

/// Points that a rule needs where the distances of the edge's ends from the other edge are `apart` times its length. The
/// points at which ln r² is singular, continued to complex places along an edge, lie on the ellipses about it through
/// the points of the other.
fn points(apart: f64) -> usize {
    let rho = apart + (apart * apart - 1.0).max(0.0).sqrt();
    // Infinitely many where the edges meet.
    (DIGITS / (2.0 * rho.ln().max(0.0))).ceil().max(2.0) as usize
}

/// Gauss over `e` of the closed form over `f`, or over both where both are apart.
fn by_gauss(e: &Edge, f: &Edge, apart: f64) -> f64 {
    let n = points(apart);
    let from_f = (e.distance(f.start) + e.distance(f.end)) / f.length;
    let m = points(from_f);
    if n.max(m) <= BOTH {
        return by_gauss_over_both(e, f, n, m);
    }
    let sum: f64 = gauss(n).iter().map(|[x, w]| w * f.log_from(e.start + x * e.length * e.direction)).sum();
    e.length * sum
}

/// Gauss over both edges. Points that lie symmetric to the middles have the same weight and share a logarithm.
fn by_gauss_over_both(e: &Edge, f: &Edge, n: usize, m: usize) -> f64 {
    let (mut p, mut q) = ([DVec3::ZERO; BOTH], [DVec3::ZERO; BOTH]);
    for (edge, places, n) in [(e, &mut p, n), (f, &mut q, m)] {
        let along = edge.length * edge.direction;
        for (place, [x, _]) in places.iter_mut().zip(gauss(n)) {
            *place = edge.start + *x * along;
        }
    }
    let mut sum = 0.0;
    for (i, [_, weight_p]) in gauss(n)[..n.div_ceil(2)].iter().enumerate() {
        for (j, [_, weight_q]) in gauss(m)[..m.div_ceil(2)].iter().enumerate() {
            let (k, l) = (n - 1 - i, m - 1 - j);
            let mut product = p[i].distance_squared(q[j]);
            if l != j {
                product *= p[i].distance_squared(q[l]);
            }
            if k != i {
                product *= p[k].distance_squared(q[j]);
                if l != j {
                    product *= p[k].distance_squared(q[l]);
                }
            }
            sum += weight_p * weight_q * product.ln();
        }
    }
    e.length * f.length * sum
}

/// Gauss over pieces of `e`, halved until each is apart from `f`.
fn divided(e: &Edge, f: &Edge, depth: u32) -> f64 {
    let apart = (f.distance(e.start) + f.distance(e.end)) / e.length;
    if apart >= APART {
        return by_gauss(e, f, apart);
    }
    if depth == DEEPEST {
        return e.length * f.log_from(e.start + 0.5 * e.length * e.direction);
    }
    let half = 0.5 * e.length;
    [e.part(0.0, half), e.part(half, e.length)].iter().flatten().map(|part| divided(part, f, depth + 1)).sum()
}

/// Parallel edges: the second difference of K(u), K″ = ln (u² + d²).
fn parallel(e: &Edge, f: &Edge) -> f64 {
    // Distances across are taken from the middle of f, along e's direction from its start.
    let w = 0.5 * (f.start + f.end) - 0.5 * (e.start + e.end);
    let along = w.dot(e.direction);
    let d = (w - along * e.direction).length();
    let k = |u: f64| {
        let squared = (u * u + d * d).max(f64::MIN_POSITIVE);
        0.5 * (u * u - d * d) * squared.ln() + 2.0 * u * d * u.atan2(d) - 1.5 * u * u
    };
    let (sum, difference) = (0.5 * (e.length + f.length), 0.5 * (f.length - e.length));
    k(along + sum) + k(along - sum) - k(along + difference) - k(along - difference)
}

/// The common perpendicular of skew edges, as seen from the two ends that are nearest to each other, so that no digits
/// are lost where edges share a corner.
struct Feet {
    /// The nearest ends.
    ends: [DVec3; 2],
    /// Lengths along the edges from their nearest ends to the feet.
    a: f64,
    b: f64,
    /// The perpendicular's length.
    d: f64,
    /// Distance of one line from the other's nearest end.
    gap: f64,
}

impl Feet {
    fn new(e: &Edge, f: &Edge, normal: DVec3, sine: f64) -> Feet {
        let nearer = |s: [DVec3; 2], t: [DVec3; 2]| {
            if t[0].distance_squared(t[1]) < s[0].distance_squared(s[1]) { t } else { s }
        };
        let [p, q] = nearer(nearer([e.start, f.start], [e.start, f.end]), nearer([e.end, f.start], [e.end, f.end]));
        let w = q - p;
        let (across_f, across_e) = (w.cross(f.direction), w.cross(e.direction));
        let square = sine * sine;
        Feet {
            ends: [p, q],
            a: across_f.dot(normal) / square,
            b: across_e.dot(normal) / square,
            d: w.dot(normal).abs() / sine,
            gap: across_f.length(),
        }
    }
}

/// Skew edges, by their closed form.
fn skew(e: &Edge, f: &Edge, feet: &Feet, sine: f64) -> f64 {
    let d = feet.d;
    let span = |edge: &Edge, end: DVec3, foot: f64| {
        if end == edge.start { [-foot, edge.length - foot] } else { [-edge.length - foot, -foot] }
    };
    let (a, b) = (span(e, feet.ends[0], feet.a), span(f, feet.ends[1], feet.b));
    let boundary =
        a[1] * f.log_from(e.end) - a[0] * f.log_from(e.start) + b[1] * e.log_from(f.end) - b[0] * e.log_from(f.start);
    let mut sum = 0.5 * boundary - e.length * f.length;
    // d² ∫∫ 1/r² is below d²/sin θ times a logarithm.
    if d * d > 1e-18 * sine * e.length * f.length {
        let cosine = e.direction.dot(f.direction);
        let angles = Angles { theta: sine.atan2(cosine), sine, cosine };
        let [x, y] = [a, b].map(|ends| ends.map(|u| (u * sine / d).asinh()));
        let s = |i: usize, j: usize| angles.primitive(x[i], y[j]);
        sum -= d * d / sine * (s(1, 1) - s(0, 1) - s(1, 0) + s(0, 0));
    }
    sum
}

/// The angle θ between skew edges.
struct Angles {
    theta: f64,
    sine: f64,
    cosine: f64,
}

impl Angles {
    /// ∫∫ −d²/r² up to the factor d²/sin θ: A(x + y) − B(x − y), from the arguments of the factors of
    /// sinh y − sinh (x − iθ) = 2 cosh ((x + y − iθ)/2) sinh ((y − x + iθ)/2).
    fn primitive(&self, x: f64, y: f64) -> f64 {
        let (z, w) = ((x + y).abs(), (x - y).abs());
        let other = std::f64::consts::PI - self.theta;
        0.5 * (other * w - self.theta * z) + clausen((-w).exp(), self.sine, self.cosine)
            - clausen((-z).exp(), self.sine, -self.cosine)
    }
}

/// Im Li₂(ρ e^{iφ}) = Σ ρᵏ sin kφ/k² for 0 ≤ ρ ≤ 1, from the sine and cosine of 0 < φ < π.
fn clausen(rho: f64, sine: f64, cosine: f64) -> f64 {
    let (x, y) = (rho * cosine, rho * sine);
    // ln (1 − z), and by Euler's reflection Li₂(z) = π²/6 − ln z ln (1 − z) − Li₂(1 − z) where z is nearer to one.
    let log = |x: f64, y: f64| (0.5 * (x * x + y * y).ln(), y.atan2(x));
    if x <= 0.5 {
        let (re, im) = log(1.0 - x, -y);
        return debye(-re, -im);
    }
    let (re, im) = log(1.0 - x, -y);
    if re == f64::NEG_INFINITY {
        return 0.0;
    }
    let (re_z, im_z) = log(x, y);
    -(re_z * im + im_z * re) - debye(-re_z, -im_z)
}

/// Coefficients B₂ₖ/(2k + 1)! of the series of Li₂ in u = −ln (1 − z), which gains a factor (|u|/2π)² ≤ 0.03 a term.
const BERNOULLI: [f64; 10] = [
    1.0 / 36.0,
    -1.0 / 3600.0,
    1.0 / 211_680.0,
    -1.0 / 10_886_400.0,
    5.0 / 66.0 / 39_916_800.0,
    -691.0 / 2730.0 / 6_227_020_800.0,
    7.0 / 6.0 / 1_307_674_368_000.0,
    -3617.0 / 510.0 / 355_687_428_096_000.0,
    43867.0 / 798.0 / 121_645_100_408_832_000.0,
    -174_611.0 / 330.0 / 51_090_942_171_709_440_000.0,
];

/// Im Li₂(1 − e^{−u}) = Im [u − u²/4 + Σ B₂ₖ u²ᵏ⁺¹/(2k + 1)!].
fn debye(re: f64, im: f64) -> f64 {
    let (square_re, square_im) = (re * re - im * im, 2.0 * re * im);
    let (mut sum_re, mut sum_im) = (0.0, 0.0);
    for c in BERNOULLI.into_iter().rev() {
        let next = sum_re * square_re - sum_im * square_im + c;
        sum_im = sum_re * square_im + sum_im * square_re;
        sum_re = next;
    }
    // u + u³·sum − u²/4.
    let (re_3, im_3) = (re * square_re - im * square_im, re * square_im + im * square_re);
    im + re_3 * sum_im + im_3 * sum_re - 0.25 * square_im
}

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity_trace::sampling::Random;

    /// Closed forms against Gauss over divided edges, for edges near, touching, and crossing at small angles.
    #[test]
    fn closed_forms_agree_with_divided_gauss() {
        let mut random = Random::new(7);
        let mut next = || 2.0 * random.next_unit() - 1.0;
        for k in 0..1000 {
            let p = DVec3::new(next(), next(), next());
            let d = DVec3::new(next(), next(), next());
            let tilt = 10f64.powf(1.5 * (next() - 1.0));
            let gap = if k % 3 == 0 { 0.0 } else { 10f64.powf(1.5 * (next() - 1.0)) };
            let q = p + gap * DVec3::new(next(), next(), next());
            let along = (d + tilt * DVec3::new(next(), next(), next())) * if k % 2 == 0 { 1.0 } else { -1.0 };
            let (e, f) = (Edge::new(p, p + d).unwrap(), Edge::new(q, q + along).unwrap());
            let off = (log_integral(&e, &f) - divided(&e, &f, 0)).abs() / (e.length * f.length);
            // Division ends at pieces that together are off by less.
            assert!(off < 1e-12, "{off:e} at gap {gap} and tilt {tilt}");
        }
    }

    /// Almost parallel edges, from a gap as wide as they are long to none.
    #[test]
    fn almost_parallel_edges_keep_nine_digits() {
        for gap in [1.0, 0.1, 0.011, 0.009, 1e-3, 1e-6, 1e-9, 0.0] {
            let edge = |x: f64, y: f64, tilt: f64| {
                Edge::new(DVec3::new(x, y, gap), DVec3::new(x + 1.0, y, gap * (1.0 + tilt)) + tilt * DVec3::Y).unwrap()
            };
            let e = Edge::new(DVec3::ZERO, DVec3::X).unwrap();
            for x in [0.0, 0.3, 1.0] {
                let reference = parallel(&e, &edge(x, 0.0, 0.0));
                for tilt in [1e-14, 1e-12, 1e-10, 1e-9, 1e-8, 1e-7] {
                    let value = log_integral(&e, &edge(x, 0.0, tilt));
                    assert!((value - reference).abs() < 1e-9 + 7.0 * tilt, "{gap} {x} {tilt}: {value} {reference}");
                }
            }
        }
    }
}
