//! Crossed strings (Hottel 1954): A₁F₁₂ is half of what the crossed strings about two convex profiles are longer than the
//! uncrossed ones. By Crofton that difference is the measure of the straight lines that meet both profiles, and this is
//! how it is computed: ∫₀^π of the overlap of their shadows, min(h₁, h₂)(θ) + min(h₁, h₂)(θ + π) where positive, with the
//! support functions h. Each is a sine plus a constant between the directions of common tangents: the strings.
//!
//! A strip sees and is seen on one side: each profile is first cut by the line of the other where that is a strip.

use std::f64::consts::{PI, TAU};

use glam::DVec2;

use super::flat::Profile;
use super::gauss::Integral;

/// Rounding of a dozen strings, relative to their length.
const ROUNDING: f64 = 1e-15;

/// A corner, or an arc that is the border between two normals.
#[derive(Clone, Copy, Debug)]
struct Part {
    center: DVec2,
    radius: f64,
    /// Middle and half of the range of normals; `None` for all of them.
    range: Option<[f64; 2]>,
}

impl Part {
    fn at(&self, angle: f64) -> f64 {
        self.center.dot(DVec2::from_angle(angle)) + self.radius
    }

    fn is_border(&self, angle: f64) -> bool {
        self.range.is_none_or(|[middle, half]| {
            let off = angle - middle;
            (off - TAU * (off / TAU).round()).abs() <= half
        })
    }
}

/// The part of a profile in front of another, about a common origin.
fn in_front(profile: &Profile, other: &Profile, origin: DVec2) -> Vec<Part> {
    let corner = |center: DVec2| Part { center: center - origin, radius: 0.0, range: None };
    let Profile::Strip { from, to } = other else {
        return match *profile {
            Profile::Strip { from, to } => vec![corner(from), corner(to)],
            Profile::Circle { center, radius, .. } => vec![Part { radius, ..corner(center) }],
        };
    };
    let normal = (*to - *from).perp().normalize();
    let height = |p: DVec2| (p - *from).dot(normal);
    match *profile {
        Profile::Strip { from: a, to: b } => {
            let (x, y) = (height(a), height(b));
            match (x > 0.0, y > 0.0) {
                (true, true) => vec![corner(a), corner(b)],
                (false, false) => Vec::new(),
                (up, _) => vec![corner(if up { a } else { b }), corner(a + x / (x - y) * (b - a))],
            }
        }
        Profile::Circle { center, radius, .. } => {
            let cos = -height(center) / radius;
            if cos >= 1.0 {
                return Vec::new();
            }
            let whole = Part { radius, ..corner(center) };
            if cos <= -1.0 {
                return vec![whole];
            }
            let (middle, half) = (normal.to_angle(), cos.acos());
            let end = |angle: f64| corner(center + radius * DVec2::from_angle(angle));
            vec![Part { range: Some([middle, half]), ..whole }, end(middle - half), end(middle + half)]
        }
    }
}

/// The part that bounds a profile in a direction.
fn support(parts: &[Part], angle: f64) -> Part {
    let border = parts.iter().filter(|part| part.is_border(angle));
    *border.max_by(|a, b| a.at(angle).total_cmp(&b.at(angle))).unwrap_or(&parts[0])
}

/// A₁F₁₂ of two convex profiles with nothing between them, per metre of length.
pub(super) fn crossed_strings(one: &Profile, two: &Profile) -> Integral {
    let origin = 0.5 * (one.place_of_middle() + two.place_of_middle());
    let (a, b) = (in_front(one, two, origin), in_front(two, one, origin));
    if a.is_empty() || b.is_empty() {
        return Integral::default();
    }
    // The directions of all lines that touch two parts on either side, and the ends of arcs.
    let parts: Vec<Part> = a.iter().chain(&b).copied().collect();
    let mut angles = vec![0.0, PI];
    for (i, x) in parts.iter().enumerate() {
        angles.extend(x.range.into_iter().flat_map(|[middle, half]| [middle - half, middle + half]));
        for y in &parts[i + 1..] {
            let across = x.center - y.center;
            for k in [y.radius - x.radius, y.radius + x.radius, -y.radius - x.radius] {
                let cos = k / across.length();
                if cos.abs() <= 1.0 {
                    angles.extend([across.to_angle() - cos.acos(), across.to_angle() + cos.acos()]);
                }
            }
        }
    }
    for angle in &mut angles[2..] {
        *angle = angle.rem_euclid(PI);
    }
    angles.sort_by(f64::total_cmp);

    let (mut sum, mut size) = (0.0, 0.0);
    for pair in angles.windows(2) {
        let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
        let nearer = |angle: f64| {
            let (x, y) = (support(&a, angle), support(&b, angle));
            if x.at(angle) < y.at(angle) { x } else { y }
        };
        let (high, low) = (nearer(middle), nearer(middle + PI));
        let (across, constant) = (high.center - low.center, high.radius + low.radius);
        let wave = across.dot(DVec2::from_angle(middle));
        if wave + constant > 0.0 {
            sum += 2.0 * (wave * half.sin() + constant * half);
            size += 2.0 * half * (across.length() + constant + origin.length());
        }
    }
    Integral { value: 0.5 * sum, error: ROUNDING * size }
}

impl Profile {
    fn place_of_middle(&self) -> DVec2 {
        match *self {
            Profile::Strip { from, to } => 0.5 * (from + to),
            Profile::Circle { center, .. } => center,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two strips that see one another wholly: the strings by name.
    #[test]
    fn strings_of_two_strips_are_four() {
        let (a, b, c, d) = (DVec2::ZERO, DVec2::new(2.0, 0.1), DVec2::new(1.7, 1.4), DVec2::new(-0.3, 0.9));
        let crossed = a.distance(c) + b.distance(d);
        let uncrossed = a.distance(d) + b.distance(c);
        let got = crossed_strings(&Profile::strip(a, b), &Profile::strip(c, d));
        assert!((got.value - 0.5 * (crossed - uncrossed)).abs() <= got.error, "{got:?}");
    }

    /// Two equal circles: Howell C-63.
    #[test]
    fn strings_of_two_circles_wrap() {
        for gap in [0.01, 1.0, 50.0] {
            let (one, two) = (Profile::circle(DVec2::ZERO, 1.0), Profile::circle(DVec2::new(2.0 + gap, 0.0), 1.0));
            let x: f64 = 1.0 + 0.5 * gap;
            let exact = ((x * x - 1.0).sqrt() + (1.0 / x).asin() - x) / PI;
            let got = crossed_strings(&one, &two);
            assert!((got.value / TAU - exact).abs() < 1e-14, "{gap}: {} {exact}", got.value / TAU);
        }
    }
}
