//! Gauss–Legendre rules on [0, 1]: n points integrate polynomials of degree 2n − 1 exactly, and an analytic function
//! with an error that falls like ρ⁻²ⁿ, where ρ is the sum of the half axes of the largest ellipse about the interval
//! (foci at its ends, half length 1) in which the function stays analytic (Trefethen 2008, "Is Gauss quadrature better
//! than Clenshaw–Curtis?", SIAM Review 50).

use std::sync::OnceLock;

/// Most points of a rule: what the slowest user, the plain contour integral, may ask for.
pub const MOST: usize = 64;

/// Those that were asked for.
static RULES: [OnceLock<Vec<[f64; 2]>>; MOST + 1] = [const { OnceLock::new() }; MOST + 1];

/// The rule of `n` points, pairs of abscissa and weight; `n` is held to 1..=[`MOST`].
pub fn gauss(n: usize) -> &'static [[f64; 2]] {
    let n = n.clamp(1, MOST);
    RULES[n].get_or_init(|| rule(n))
}

/// The rule by Newton's method on the Legendre polynomial, from the asymptotic roots.
fn rule(n: usize) -> Vec<[f64; 2]> {
    let degree = n as f64;
    let point = |i: usize| {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (degree + 0.5)).cos();
        let mut slope = 1.0;
        // Newton doubles the digits; from the asymptotic roots three steps suffice and ten cost nothing.
        for _ in 0..10 {
            let (mut p, mut before) = (1.0, 0.0);
            for k in 1..=n {
                let k = k as f64;
                (p, before) = (((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k, p);
            }
            slope = degree * (x * p - before) / (x * x - 1.0);
            x -= p / slope;
        }
        [0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope)]
    };
    (0..n).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rule_integrates_its_powers() {
        for n in 1..=MOST {
            assert_eq!(gauss(n).len(), n);
            for power in [0, 1, n, 2 * n - 1] {
                let sum: f64 = gauss(n).iter().map(|[x, w]| w * x.powi(power as i32)).sum();
                assert!((sum * (power as f64 + 1.0) - 1.0).abs() < 1e-12, "{n} points, power {power}: {sum}");
            }
        }
    }
}
