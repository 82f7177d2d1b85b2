//! The same in two dimensions: strips and circular cylinders, infinitely long, by their profiles in the plane.
//!
//! F₁₂ = (1/A₁) ∫ ½ ∫ cos θ V dθ dx₁ with the angle θ in the plane and A the length of the profile. With nothing in the way
//! convex profiles exchange by crossed strings; otherwise the inner integral is a sum of sines between the
//! directions of ends and tangents, and the outer one is cut where a line touches two of them, so that each piece is
//! smooth. Rows of tubes and triangular ducts are Hottel's (1954; McAdams, "Heat transmission", 3rd ed.).

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec2;

use super::finite::{ELEMENT_ERROR, reached};
use super::gauss::Adaptive;
use super::shape::{Facing, ShapeError};
use super::strings::crossed_strings;
use crate::pair::Factor;

/// Places looked from before the tolerance is given up.
const MOST_PLACES: usize = 2_000_000;

/// What an infinitely long surface looks like from its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// A flat strip, active on the left of the way from one end to the other.
    Strip {
        /// Its start.
        from: DVec2,
        /// Its end.
        to: DVec2,
    },
    /// A circular cylinder.
    Circle {
        /// Its axis.
        center: DVec2,
        /// Its radius.
        radius: f64,
        /// Its active side.
        facing: Facing,
    },
}

impl Profile {
    /// The strip between two points.
    pub fn strip(from: DVec2, to: DVec2) -> Profile {
        Profile::Strip { from, to }
    }

    /// The outside of a circle.
    pub fn circle(center: DVec2, radius: f64) -> Profile {
        Profile::Circle { center, radius, facing: Facing::Outside }
    }

    /// Length of the profile: area per metre.
    pub fn length(&self) -> f64 {
        match self {
            Profile::Strip { from, to } => from.distance(*to),
            Profile::Circle { radius, .. } => TAU * radius,
        }
    }

    fn check(&self) -> Result<(), ShapeError> {
        let (is_finite, what) = match self {
            Profile::Strip { from, to } => (from.is_finite() && to.is_finite(), "length of a strip"),
            Profile::Circle { center, radius, .. } => (center.is_finite() && radius.is_finite(), "radius"),
        };
        if !is_finite {
            return Err(ShapeError::NotFinite("profile"));
        }
        if self.length() > 0.0 { Ok(()) } else { Err(ShapeError::NotPositive { what, value: self.length() }) }
    }

    /// Whether all of it that a straight line meets is its border.
    fn is_convex(&self) -> bool {
        !matches!(self, Profile::Circle { facing: Facing::Inside, .. })
    }

    /// Points and circles that straight lines may touch: centres and radii.
    fn touched(&self) -> Vec<(DVec2, f64)> {
        match *self {
            Profile::Strip { from, to } => vec![(from, 0.0), (to, 0.0)],
            Profile::Circle { center, radius, .. } => vec![(center, radius)],
        }
    }

    /// The place at s in [0, 1], and the normal of the active side there.
    fn place(&self, s: f64) -> (DVec2, DVec2) {
        match *self {
            Profile::Strip { from, to } => (from + s * (to - from), (to - from).perp().normalize()),
            Profile::Circle { center, radius, facing } => {
                let n = DVec2::from_angle(TAU * s);
                (center + radius * n, if facing == Facing::Outside { n } else { -n })
            }
        }
    }

    /// The places s at which a line m·x = d meets the profile.
    fn met(&self, m: DVec2, d: f64, found: &mut Vec<f64>) {
        match *self {
            Profile::Strip { from, to } => found.push((d - m.dot(from)) / m.dot(to - from)),
            Profile::Circle { center, radius, .. } => {
                let cos = (d - m.dot(center)) / radius;
                // A tangent of its own touches where rounding may have moved it off.
                if cos.abs() < 1.0 + 1e-9 {
                    let (middle, half) = (m.to_angle(), cos.clamp(-1.0, 1.0).acos());
                    found.extend([middle - half, middle + half].map(|t| t.rem_euclid(TAU) / TAU));
                }
            }
        }
    }

    /// Distance to where a ray meets the profile first, and whether on its active side.
    fn hit(&self, p: DVec2, d: DVec2, starts_on: bool) -> Option<(f64, bool)> {
        match *self {
            Profile::Strip { from, to } => {
                let along = to - from;
                let across = d.perp_dot(along);
                let (t, s) = ((from - p).perp_dot(along) / across, (from - p).perp_dot(d) / across);
                (t > 0.0 && t.is_finite() && (0.0..=1.0).contains(&s)).then(|| (t, d.dot(along.perp()) < 0.0))
            }
            Profile::Circle { center, radius, facing } => {
                let q = p - center;
                let b = q.dot(d);
                let c = if starts_on { 0.0 } else { (q.length() - radius) * (q.length() + radius) };
                let root = b * b - c;
                if root < 0.0 {
                    return None;
                }
                let far = -(b + root.sqrt().copysign(b));
                let near = if far == 0.0 { 0.0 } else { c / far };
                let t = [near.min(far), near.max(far)].into_iter().find(|t| *t > 0.0)?;
                Some((t, ((q + t * d).dot(d) < 0.0) == (facing == Facing::Outside)))
            }
        }
    }
}

/// F from one profile to another past `blockers`, within `tolerance` of the true value; `from` and `to` may be the same.
///
/// # Errors
/// [`ShapeError`] where a profile is none, or the tolerance is not reached.
pub fn factor(from: &Profile, to: &Profile, blockers: &[Profile], tolerance: f64) -> Result<Factor, ShapeError> {
    check(from, to, blockers, tolerance)?;
    if blockers.is_empty() && from != to && from.is_convex() && to.is_convex() {
        let exchange = crossed_strings(from, to);
        let value = (exchange.value / from.length()).clamp(0.0, 1.0);
        return reached(Factor { value, error: exchange.error / from.length() }, tolerance);
    }
    integrated(from, to, blockers, tolerance)
}

/// The same as [`factor`] by integration, even where crossed strings apply: their independent check.
///
/// # Errors
/// [`ShapeError`] as for [`factor`].
pub fn integrated(from: &Profile, to: &Profile, blockers: &[Profile], tolerance: f64) -> Result<Factor, ShapeError> {
    check(from, to, blockers, tolerance)?;
    let seen: Vec<&Profile> = [to].into_iter().chain(blockers).collect();
    let breaks = breaks(from, &seen);
    let at = |_: usize, [s]: [f64; 1]| {
        let (p, n) = from.place(s);
        from_point(p, n, from, to, blockers)
    };
    let integral = Adaptive::line(at, &breaks).refine(tolerance, MOST_PLACES);
    let value = integral.value.clamp(0.0, 1.0);
    reached(Factor { value, error: integral.error + ELEMENT_ERROR }, tolerance)
}

fn check(from: &Profile, to: &Profile, blockers: &[Profile], tolerance: f64) -> Result<(), ShapeError> {
    if tolerance.is_nan() || tolerance <= 0.0 {
        return Err(ShapeError::Tolerance(tolerance));
    }
    [from, to].into_iter().chain(blockers).try_for_each(Profile::check)
}

/// ½ ∫ cos θ dθ over what is seen of `to` from a point of `from`.
fn from_point(p: DVec2, n: DVec2, from: &Profile, to: &Profile, blockers: &[Profile]) -> f64 {
    let itself = [from];
    let is_hollow = !from.is_convex() && from != to;
    let blocking = || blockers.iter().chain(itself.into_iter().filter(|_| is_hollow));
    // Directions of all ends and tangents, by their angle from the normal.
    let mut angles = vec![-FRAC_PI_2, FRAC_PI_2];
    for (center, radius) in [to].into_iter().chain(blocking()).filter(|s| *s != from).flat_map(Profile::touched) {
        let d = center - p;
        let middle = n.perp_dot(d).atan2(n.dot(d));
        let half = (radius / d.length()).min(1.0).asin();
        let turns = [middle - half, middle + half].map(|t| t - TAU * (t / TAU).round());
        angles.extend(turns.into_iter().filter(|t| t.abs() < FRAC_PI_2));
    }
    angles.sort_by(f64::total_cmp);
    let is_seen = |angle: f64| {
        let d = n.rotate(DVec2::from_angle(angle));
        let Some((t, true)) = to.hit(p, d, to == from) else { return false };
        !blocking().any(|b| b.hit(p, d, b == from).is_some_and(|(near, _)| near < t))
    };
    let pairs = angles.windows(2).filter(|pair| pair[1] > pair[0] && is_seen(0.5 * (pair[0] + pair[1])));
    // sin b − sin a without the cancellation of narrow angles.
    pairs.map(|pair| (0.5 * (pair[0] + pair[1])).cos() * (0.5 * (pair[1] - pair[0])).sin()).sum()
}

/// The places of `from` at which what is seen changes its order: those on lines that touch two things.
fn breaks(from: &Profile, seen: &[&Profile]) -> Vec<f64> {
    let mut touched: Vec<(DVec2, f64)> = seen.iter().flat_map(|s| s.touched()).collect();
    // On a circle the horizon turns with the place, and sweeps over everything.
    if let Profile::Circle { .. } = from {
        touched.extend(from.touched());
    }
    let mut found = vec![0.0, 1.0];
    for (i, (c, r)) in touched.iter().enumerate() {
        for (other, s) in &touched[i + 1..] {
            let across = *c - *other;
            // m·c − d = ±r on both: outer and inner tangents.
            for k in [r - s, r + s] {
                let cos = k / across.length();
                if cos.abs() <= 1.0 {
                    for angle in [-cos.acos(), cos.acos()] {
                        let m = DVec2::from_angle(across.to_angle() + angle);
                        from.met(m, m.dot(*c) - r, &mut found);
                    }
                }
            }
        }
    }
    found.retain(|s| (0.0..=1.0).contains(s));
    found.sort_by(f64::total_cmp);
    found.dedup_by(|a, b| (*a - *b).abs() < 1e-14);
    found
}

/// F from a plane to a row of tubes before it, of this diameter and distance between axes:
/// 1 − √(1 − (D/s)²) + (D/s) atan √((s² − D²)/D²).
///
/// # Errors
/// [`ShapeError`] where the tubes overlap or a length is none.
pub fn tube_row(diameter: f64, pitch: f64) -> Result<f64, ShapeError> {
    for (what, value) in [("diameter", diameter), ("pitch", pitch)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(ShapeError::NotPositive { what, value });
        }
    }
    if diameter > pitch {
        return Err(ShapeError::Lengths("the tubes of a row overlap"));
    }
    let ratio = diameter / pitch;
    let rest = ((1.0 - ratio) * (1.0 + ratio)).sqrt();
    Ok(1.0 - rest + ratio * rest.atan2(ratio))
}

/// F between the sides of an infinitely long triangular duct: F_ij = (wᵢ + wⱼ − w_k)/(2 wᵢ).
///
/// # Errors
/// [`ShapeError`] where the sides close no triangle.
pub fn triangular_duct(sides: [f64; 3]) -> Result<[[f64; 3]; 3], ShapeError> {
    if let Some(value) = sides.into_iter().find(|w| !(*w > 0.0 && w.is_finite())) {
        return Err(ShapeError::NotPositive { what: "side", value });
    }
    if (0..3).any(|i| sides[i] > sides[(i + 1) % 3] + sides[(i + 2) % 3]) {
        return Err(ShapeError::Lengths("one side of a triangle is longer than the two others"));
    }
    let f = |i: usize, j: usize| (sides[i] + sides[j] - sides[3 - i - j]) / (2.0 * sides[i]);
    Ok(std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 0.0 } else { f(i, j) })))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Crossed strings and integration agree for strips and circles anywhere, cut by one another's planes or not.
    #[test]
    fn catalogue_21_strings_agree_with_integration() {
        let mut state = 7_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut met = 0;
        for _ in 0..300 {
            let mut profile = |x: f64| {
                let mut point = || DVec2::new(x + random(), 2.0 * random() - 1.0);
                let (a, b) = (point(), point());
                if random() < 0.4 { Profile::circle(a, 0.05 + 0.4 * random()) } else { Profile::strip(a, b) }
            };
            let (one, two) = (profile(0.0), profile(1.9));
            let strings = factor(&one, &two, &[], 1e-11).unwrap();
            let sum = integrated(&one, &two, &[], 1e-11).unwrap();
            let back = integrated(&two, &one, &[], 1e-11).unwrap();
            assert!((strings.value - sum.value).abs() < 1e-11, "{one:?} {two:?} {strings:?} {sum:?}");
            assert!((sum.value * one.length() - back.value * two.length()).abs() < 4e-11, "{one:?} {two:?}");
            met += usize::from(strings.value > 0.0);
        }
        assert!(met > 80, "{met}");
    }

    /// A duct of any shape closes, and so does a circle around others.
    #[test]
    fn enclosures_in_the_plane_close() {
        let sides = [3.0, 4.0, 5.0];
        let corners = [DVec2::ZERO, DVec2::new(3.0, 0.0), DVec2::new(3.0, 4.0)];
        let duct = triangular_duct(sides).unwrap();
        let strips: Vec<Profile> = (0..3).map(|i| Profile::strip(corners[i], corners[(i + 1) % 3])).collect();
        for (i, j) in (0..9).map(|k| (k / 3, k % 3)).filter(|(i, j)| i != j) {
            let f = factor(&strips[i], &strips[j], &[], 1e-12).unwrap();
            assert!((f.value - duct[i][j]).abs() < 1e-13, "{i} {j} {f:?}");
        }
        let around = Profile::Circle { center: DVec2::ZERO, radius: 2.0, facing: Facing::Inside };
        let tubes = [Profile::circle(DVec2::new(0.9, 0.1), 0.4), Profile::circle(DVec2::new(-0.7, 0.3), 0.6)];
        let strip = Profile::strip(DVec2::new(-0.5, -1.0), DVec2::new(0.8, -0.7));
        let all = [around, tubes[0], tubes[1], strip];
        for (i, from) in all.iter().enumerate() {
            let row = all.iter().enumerate().map(|(j, to)| {
                let blockers: Vec<Profile> = (0..4).filter(|k| *k != i && *k != j).map(|k| all[k]).collect();
                factor(from, to, &blockers, 1e-11).unwrap().value
            });
            let sum = row.sum::<f64>();
            // Only the upper side of the strip takes part: what meets its lower side is missing.
            let lower = Profile::strip(DVec2::new(0.8, -0.7), DVec2::new(-0.5, -1.0));
            let blockers: Vec<Profile> = (0..3).filter(|k| *k != i).map(|k| all[k]).collect();
            let missing = if i < 3 { factor(from, &lower, &blockers, 1e-11).unwrap().value } else { 0.0 };
            assert!((sum + missing - 1.0).abs() < 4e-11, "{i}: {sum} {missing}");
        }
    }

    /// A plane sees of many tubes what the formula for infinitely many says.
    #[test]
    fn a_row_of_tubes_is_one_tube_many_times() {
        let (diameter, pitch) = (0.7, 1.9);
        let tube = |i: i32| Profile::circle(DVec2::new(pitch * f64::from(i), 1.3), 0.5 * diameter);
        let plane = Profile::strip(DVec2::ZERO, DVec2::new(pitch, 0.0));
        let gap: f64 = {
            let blockers: Vec<Profile> = (-40..=41).map(tube).collect();
            // What passes meets a wide strip far above; beyond it every direction is closed by some tube.
            let sky = Profile::strip(DVec2::new(60.0, 3.0), DVec2::new(-60.0, 3.0));
            factor(&plane, &sky, &blockers, 1e-9).unwrap().value
        };
        let row = tube_row(diameter, pitch).unwrap();
        assert!((1.0 - gap - row).abs() < 2e-9, "{gap} {row}");
    }

    #[test]
    fn what_is_no_profile_is_refused() {
        let strip = Profile::strip(DVec2::ZERO, DVec2::X);
        let point = Profile::strip(DVec2::X, DVec2::X);
        assert!(matches!(factor(&strip, &point, &[], 1e-6), Err(ShapeError::NotPositive { .. })));
        assert!(matches!(factor(&strip, &strip, &[], 0.0), Err(ShapeError::Tolerance(_))));
        assert!(tube_row(2.0, 1.0).is_err() && triangular_duct([1.0, 1.0, 3.0]).is_err());
        assert!((tube_row(1.0, 1.0).unwrap() - 1.0).abs() < 1e-15);
    }
}
