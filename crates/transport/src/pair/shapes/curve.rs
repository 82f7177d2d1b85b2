//! Outlines as seen from a point: r(t) = c + a cos t + b sin t relative to the eye, t in [0, span].
//!
//! Circles and ellipses have c ≠ 0; straight edges, silhouettes and horizons are arcs of great circles, c = 0. With them
//! Lambert's contour integral (1/2π) ∫ (r × r′)·n / r² dt is a ratio of trigonometric polynomials: closed for great
//! circles and circles, 15-point Gauss sums to rounding for ellipses and for circles whose axis passes the eye closely.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DMat3, DVec3};

use super::gauss::{Adaptive, fifteen};

/// Distance of the eye from the axis of a circle, relative to the mean distance of the rim, below which the closed form
/// cancels (its error is rounding over this) and the integrand is so smooth that 15 points per quarter are exact.
const NEAR_AXIS: f64 = 0.04;

/// Error left in the integral over an arc of an ellipse.
const ELLIPSE_TOLERANCE: f64 = 1e-14;

/// Intervals in which the crossings of two cones are sought first; halved or doubled, the same are found.
const INTERVALS: usize = 8;

/// Where the first of them starts: nowhere near the angles of symmetry, at which roots would lie on borders.
const START: f64 = 0.123_456_7;

/// Variation of f over an interval, relative to the terms of which it is the difference, that is rounding.
const FLAT: f64 = 1e-15;

/// A point counts as lying on a curve within this angle.
pub(super) const ON: f64 = 1e-7;

/// What a curve looks like from the eye.
#[derive(Clone, Copy, Debug)]
enum Form {
    /// In the plane through the eye with this unit normal a × b.
    Great(DVec3),
    /// A cone about a circle; the inverse of (a b c).
    Circle(DMat3),
    /// A cone about an ellipse.
    Ellipse(DMat3),
}

/// An outline.
#[derive(Clone, Copy, Debug)]
pub(super) struct Curve {
    c: DVec3,
    a: DVec3,
    b: DVec3,
    /// The parameter at its end; 2π for what is closed.
    pub(super) span: f64,
    form: Form,
}

impl Curve {
    /// The great circle counter-clockwise about a unit normal.
    pub(super) fn horizon(normal: DVec3) -> Curve {
        let (a, b) = normal.any_orthonormal_pair();
        // Whatever the hand of the pair, a × b must be the normal.
        let b = if a.cross(b).dot(normal) > 0.0 { b } else { -b };
        Curve { c: DVec3::ZERO, a, b, span: TAU, form: Form::Great(normal) }
    }

    /// The straight edge between two points relative to the eye; `None` where it is seen as a point.
    pub(super) fn edge(from: DVec3, to: DVec3) -> Option<Curve> {
        let (p, q) = (from.try_normalize()?, to.try_normalize()?);
        // From the difference of the points, which is exact for short edges far away.
        let m = from.cross(to - from);
        if m.length() <= 1e-14 * from.length() * (to - from).length().max(1e-300) {
            return None;
        }
        let m = m.normalize();
        let b = m.cross(p);
        let span = q.dot(b).atan2(q.dot(p));
        (span > 0.0).then_some(Curve { c: DVec3::ZERO, a: p, b, span, form: Form::Great(m) })
    }

    /// The ellipse of centre c and semi-axes a ⟂ b; `None` where it is seen from within its plane.
    pub(super) fn ellipse(c: DVec3, a: DVec3, b: DVec3) -> Option<Curve> {
        let matrix = DMat3::from_cols(a, b, c);
        let (x, y) = (a.length(), b.length());
        if matrix.determinant().abs() <= 1e-12 * x * y * (c.length() + x.max(y)) {
            return None;
        }
        let inverse = matrix.inverse();
        let round = (x - y).abs() <= 1e-15 * x;
        let form = if round { Form::Circle(inverse) } else { Form::Ellipse(inverse) };
        Some(Curve { c, a, b, span: TAU, form })
    }

    /// Whether it returns to its start.
    pub(super) fn is_closed(&self) -> bool {
        self.span >= TAU
    }

    /// The point at t relative to the eye.
    pub(super) fn at(&self, t: f64) -> DVec3 {
        let (sin, cos) = t.sin_cos();
        self.c + cos * self.a + sin * self.b
    }

    /// Unit directions at t: of the point, and at right angles to the curve, to its left seen from outside the sphere.
    pub(super) fn frame(&self, t: f64) -> [DVec3; 2] {
        let (sin, cos) = t.sin_cos();
        let r = self.c + cos * self.a + sin * self.b;
        let along = cos * self.b - sin * self.a;
        [r.normalize_or_zero(), r.cross(along).normalize_or_zero()]
    }

    /// The ends, where there are two.
    pub(super) fn ends(&self) -> Option<[DVec3; 2]> {
        (!self.is_closed()).then(|| [self.a, self.at(self.span)])
    }

    /// Whether nothing of it rises above the plane through the eye with this normal.
    pub(super) fn is_below(&self, n: DVec3) -> bool {
        match self.ends() {
            Some(ends) => ends.iter().all(|e| e.dot(n) <= 0.0),
            None => self.c.dot(n) + self.a.dot(n).hypot(self.b.dot(n)) <= 0.0,
        }
    }

    /// The angle between a unit direction and the curve, exact in the limit of small ones; infinite beyond its ends.
    pub(super) fn off(&self, d: DVec3) -> f64 {
        match &self.form {
            Form::Great(m) => {
                let beyond = !self.is_closed() && self.on_great(d).is_none();
                if beyond { f64::INFINITY } else { d.dot(*m).abs() }
            }
            Form::Circle(inverse) | Form::Ellipse(inverse) => {
                let y = *inverse * d;
                if y.z <= 0.0 { f64::INFINITY } else { d.distance(self.at(y.y.atan2(y.x)).normalize_or_zero()) }
            }
        }
    }

    /// The parameter of a direction near the plane of an arc of a great circle.
    fn on_great(&self, d: DVec3) -> Option<f64> {
        let t = d.dot(self.b).atan2(d.dot(self.a));
        if self.is_closed() {
            return Some(t.rem_euclid(TAU));
        }
        (t > -ON && t < self.span + ON).then_some(t)
    }

    /// The parameter of a direction where it lies on the curve.
    pub(super) fn parameter(&self, d: DVec3) -> Option<f64> {
        if self.off(d) > ON {
            return None;
        }
        match &self.form {
            Form::Great(_) => self.on_great(d),
            Form::Circle(inverse) | Form::Ellipse(inverse) => {
                let y = *inverse * d;
                Some(y.y.atan2(y.x).rem_euclid(TAU))
            }
        }
    }

    /// Appends the parameters at which this curve crosses the other, or the other continued.
    pub(super) fn crossings(&self, other: &Curve, found: &mut Vec<f64>) {
        let start = found.len();
        match (&self.form, &other.form) {
            (_, Form::Great(m)) => self.in_plane(*m, found),
            // By the parameters of the cone, which are the sharper ones; then by the directions there.
            (Form::Great(m), _) => {
                other.in_plane(*m, found);
                for t in &mut found[start..] {
                    let d = other.at(*t);
                    *t = d.dot(self.b).atan2(d.dot(self.a));
                }
            }
            (_, Form::Circle(inverse) | Form::Ellipse(inverse)) => {
                let [c, x, y] = [self.c, self.a, self.b].map(|p| *inverse * p);
                let q = |p: DVec3, s: DVec3| p.x * s.x + p.y * s.y - p.z * s.z;
                // The cone of the other at r(t), by harmonics.
                let constant = q(c, c) + 0.5 * (q(x, x) + q(y, y));
                let harmonics = [2.0 * q(c, x), 2.0 * q(c, y), 0.5 * (q(x, x) - q(y, y)), q(x, y)];
                let scale = c.length_squared() + x.length_squared() + y.length_squared();
                harmonic_roots(constant, harmonics, scale, found);
            }
        }
        let mut keep = start;
        for i in start..found.len() {
            let t = found[i].rem_euclid(TAU);
            if t < self.span {
                found[keep] = t;
                keep += 1;
            }
        }
        found.truncate(keep);
    }

    /// Appends the parameters at which the curve crosses the plane through the eye with this normal. A plane that it comes
    /// as close to as rounding allows is touched, not crossed: horizons touch the rims of what they are tangent to.
    fn in_plane(&self, m: DVec3, found: &mut Vec<f64>) {
        let [c, x, y] = [self.c, self.a, self.b].map(|p| p.dot(m));
        let size = x.hypot(y);
        let rounding = 8.0 * f64::EPSILON * (self.c.length() + self.a.length() + self.b.length());
        if c.abs() < size - rounding {
            let (middle, half) = (y.atan2(x), (-c / size).acos());
            found.extend([middle - half, middle + half]);
        }
    }

    /// (1/2π) ∫ (r × dr)·n / r² from t0 to t1.
    pub(super) fn contour(&self, n: DVec3, t0: f64, t1: f64) -> f64 {
        let integral = match &self.form {
            Form::Great(m) => (t1 - t0) * m.dot(n),
            Form::Circle(_) => self.circle(n, t0, t1),
            Form::Ellipse(_) => {
                let breaks: Vec<f64> = (0..=4).map(|i| t0 + (t1 - t0) * f64::from(i) / 4.0).collect();
                Adaptive::line(|_, [t]| self.integrand(n, t), &breaks).refine(ELLIPSE_TOLERANCE, 1 << 16).value
            }
        };
        integral / TAU
    }

    fn integrand(&self, n: DVec3, t: f64) -> f64 {
        let (sin, cos) = t.sin_cos();
        let r = self.c + cos * self.a + sin * self.b;
        r.cross(cos * self.b - sin * self.a).dot(n) / r.length_squared()
    }

    /// The integral over an arc of a circle of radius ρ at height h of its plane, the eye s off its axis: with τ counted
    /// from the direction eye-to-centre e₁, r² = α + δ cos τ and the numerator is A + P cos τ + Q sin τ.
    fn circle(&self, n: DVec3, t0: f64, t1: f64) -> f64 {
        let rho = self.a.length();
        let w = self.a.cross(self.b) / (rho * rho);
        let h = self.c.dot(w);
        let [ca, cb] = [self.c.dot(self.a) / rho, self.c.dot(self.b) / rho];
        let s = ca.hypot(cb);
        let alpha = s * s + h * h + rho * rho;
        if s * rho <= NEAR_AXIS * alpha {
            let quarters = ((t1 - t0) / FRAC_PI_2).ceil().max(1.0);
            let step = (t1 - t0) / quarters;
            let quarter =
                |i: i32| fifteen(t0 + f64::from(i) * step, t0 + f64::from(i + 1) * step, |t| self.integrand(n, t));
            return (0..quarters as i32).map(quarter).sum();
        }
        let e1 = (ca * self.a + cb * self.b) / (rho * s);
        let e2 = w.cross(e1);
        let (n1, n2, nw) = (n.dot(e1), n.dot(e2), n.dot(w));
        // Least and greatest squared distance from the rim, without cancellation.
        let (least, most) = (h * h + (s - rho) * (s - rho), h * h + (s + rho) * (s + rho));
        let turn = cb.atan2(ca);
        let (x, y) = (t0 - turn, t1 - turn);
        let p_over = (s * nw - h * n1) / (2.0 * s);
        let rest = 0.5 * nw * (rho * rho - s * s - h * h) + h * n1 * alpha / (2.0 * s);
        let log = |t: f64| (least + 4.0 * rho * s * (0.5 * t).cos().powi(2)).ln();
        // ∫ dτ/(α + δ cos τ), continued over half turns.
        let angle = |t: f64| {
            let turns = (t / TAU).round();
            let (sin, cos) = (0.5 * (t - TAU * turns)).sin_cos();
            (least.sqrt() * sin).atan2(most.sqrt() * cos) + PI * turns
        };
        let scale = (least * most).sqrt();
        let inner = if scale > 0.0 { 2.0 / scale * (angle(y) - angle(x)) } else { 0.0 };
        p_over * (y - x) + rest * inner + h * n2 / (2.0 * s) * (log(y) - log(x))
    }
}

/// Roots of constant + h₀ cos t + h₁ sin t + h₂ cos 2t + h₃ sin 2t: intervals are halved until the bound of the second
/// derivative shows that there is no root or that f is monotone. What only touches zero is no root, nor are those of two
/// curves that are one; `scale` is that of the terms of which f is the difference.
fn harmonic_roots(constant: f64, h: [f64; 4], scale: f64, found: &mut Vec<f64>) {
    let both = |t: f64| {
        let (sin, cos) = t.sin_cos();
        let (sin2, cos2) = (2.0 * sin * cos, cos * cos - sin * sin);
        let value = constant + h[0] * cos + h[1] * sin + h[2] * cos2 + h[3] * sin2;
        (value, h[1] * cos - h[0] * sin + 2.0 * (h[3] * cos2 - h[2] * sin2))
    };
    let (first, second) = (h[0].hypot(h[1]), h[2].hypot(h[3]));
    if constant.abs() > first + second {
        return;
    }
    let bend = first + 4.0 * second;
    let value = |t: f64| both(t).0;
    let half = PI / INTERVALS as f64;
    let mut open: Vec<(f64, f64)> = (0..INTERVALS).map(|i| (START + half * (2 * i + 1) as f64, half)).collect();
    while let Some((middle, half)) = open.pop() {
        let (f, slope) = both(middle);
        if f.abs() > slope.abs() * half + 0.5 * bend * half * half {
            continue;
        }
        if slope.abs() > bend * half {
            let (x, y) = (middle - half, middle + half);
            if (value(x) > 0.0) != (value(y) > 0.0) {
                found.push(bracketed(value, x, y));
            }
        } else if bend * half * half > FLAT * scale {
            open.extend([-0.5, 0.5].map(|side| (middle + side * half, 0.5 * half)));
        }
    }
}

/// The root between x and y, where f has opposite signs, by the method of Illinois.
fn bracketed(f: impl Fn(f64) -> f64, mut x: f64, mut y: f64) -> f64 {
    let (mut fx, mut fy) = (f(x), f(y));
    for _ in 0..100 {
        if fx == fy || (y - x).abs() <= 1e-15 * (1.0 + x.abs()) {
            break;
        }
        let z = y - fy * (y - x) / (fy - fx);
        let fz = f(z);
        if fz == 0.0 {
            return z;
        }
        if (fz > 0.0) != (fy > 0.0) {
            (x, fx) = (y, fy);
        } else {
            fx *= 0.5;
        }
        (y, fy) = (z, fz);
    }
    y
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The closed form of a circle against its integrand, near the rim, near the axis and over any arc.
    #[test]
    fn arcs_of_circles_are_exact() {
        let n = DVec3::new(0.3, -0.5, 0.8).normalize();
        for (c, from, to) in [
            (DVec3::new(0.4, 0.3, 1.0), 0.0, TAU),
            (DVec3::new(1.5, -0.3, 0.4), 1.0, 6.0),
            (DVec3::new(0.99, 0.0, 0.05), 2.0, 4.2),
            (DVec3::new(0.0, 0.02, 1.0), -1.0, 3.0),
            (DVec3::new(0.0, 0.0, 1.0), 0.0, TAU),
            (DVec3::new(0.06, 0.02, 1.0), -1.0, 3.0),
        ] {
            let circle = Curve::ellipse(c, 1.2 * DVec3::X, 1.2 * DVec3::Y).unwrap();
            assert!(matches!(circle.form, Form::Circle(_)));
            let got = circle.contour(n, from, to);
            let steps: Vec<f64> = (0..=8).map(|i| from + (to - from) * f64::from(i) / 8.0).collect();
            let sum = Adaptive::line(|_, [t]| circle.integrand(n, t), &steps).refine(1e-14, 1 << 20).value / TAU;
            assert!((got - sum).abs() < 1e-13, "{c}: {got} {sum}");
        }
    }

    /// The whole horizon is the whole hemisphere.
    #[test]
    fn the_horizon_encloses_everything() {
        let n = DVec3::new(1.0, 2.0, -3.0).normalize();
        let horizon = Curve::horizon(n);
        assert!((horizon.contour(n, 0.0, TAU) - 1.0).abs() < 1e-15);
        let [_, left] = horizon.frame(1.0);
        assert!((left - n).length() < 1e-15);
    }

    #[test]
    fn crossings_lie_on_both_curves() {
        let circle = Curve::ellipse(DVec3::new(0.2, 0.1, 1.0), DVec3::X, DVec3::Y).unwrap();
        let ellipse = Curve::ellipse(DVec3::new(0.0, 0.3, 1.5), DVec3::X * 2.5, DVec3::new(0.0, 0.9, 0.3)).unwrap();
        let edge = Curve::edge(DVec3::new(-2.0, 0.1, 0.9), DVec3::new(2.0, 0.2, 1.1)).unwrap();
        for (one, two, count) in
            [(circle, ellipse, 4), (ellipse, circle, 4), (edge, circle, 2), (circle, edge, 2), (ellipse, edge, 2)]
        {
            let mut found = Vec::new();
            one.crossings(&two, &mut found);
            found.retain(|t| two.off(one.frame(*t)[0]) < 1e-12);
            assert_eq!(found.len(), count, "{one:?} {two:?}");
        }
    }
}
