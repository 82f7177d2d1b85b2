//! Curves on logarithmic axes as SVG. Lines are drawn in a box of their own that is stretched to any width, letters are
//! placed in percent and keep their size. A curve is known by the badge at one of its points; the legend has the names.
//!
//! Values that are not above zero and finite have no place and are left out; what lies below the lowest value shown is cut off.

use super::markup::{escape, number};
use super::plot::{log_range, ticks};

/// One curve.
pub struct Curve {
    /// What it is called.
    pub name: String,
    /// Class of its colour: `k1` to `k5`.
    pub color: &'static str,
    /// x and y, by x.
    pub points: Vec<[f64; 2]>,
    /// Whether each point is an answer of its own, and drawn as a dot.
    pub dotted: bool,
}

/// A horizontal mark.
pub struct Level {
    /// Where.
    pub at: f64,
    /// What it says.
    pub name: String,
}

/// The axes.
pub struct Axes<'a> {
    /// What the plot shows, for those who hear it.
    pub title: &'a str,
    /// What x is.
    pub x: &'a str,
    /// How values of x are written.
    pub write_x: fn(f64) -> String,
    /// How values of y are written.
    pub write_y: fn(f64) -> String,
    /// Lowest y shown; none for the least there is.
    pub floor: Option<f64>,
    /// Lowest x shown.
    pub from: Option<f64>,
}

/// Badges in the order of the curves.
const BADGES: &str = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";

/// Width and height that badges are kept apart by, as if the plot had this many units each way: about its pixels.
const PLOT: [f64; 2] = [820.0, 380.0];

/// Distance of badges that do not touch.
const APART: f64 = 19.0;

/// The badge of curve `k`.
fn badge(k: usize) -> char {
    BADGES.chars().nth(k % BADGES.len()).unwrap_or('?')
}

/// The plot with its legend; nothing where there is nothing to draw.
pub fn plot(curves: &[Curve], levels: &[Level], axes: &Axes) -> String {
    let seen = |[x, y]: [f64; 2]| {
        x > 0.0 && y > 0.0 && x.is_finite() && y.is_finite() && axes.from.is_none_or(|from| x >= from)
    };
    let points = || curves.iter().flat_map(|c| c.points.iter().copied()).filter(|p| seen(*p));
    let shown = |y: f64| axes.floor.map_or(y, |floor| y.max(floor));
    let levels_shown = levels.iter().filter(|level| level.at > 0.0 && level.at.is_finite());
    let heights = points().map(|p| shown(p[1])).chain(levels_shown.clone().map(|level| shown(level.at)));
    let (Some((x0, x1)), Some((y0, y1))) = (log_range(points().map(|p| p[0])), log_range(heights)) else {
        return String::new();
    };
    let place = |[x, y]: [f64; 2]| [(x.log10() - x0) / (x1 - x0), (y1 - y.log10()) / (y1 - y0)];
    let mut out = String::new();
    for v in ticks(x0, x1) {
        let x = 100.0 * place([v, 1.0])[0];
        out += &format!("<line class=\"grid\" x1=\"{x:.2}%\" x2=\"{x:.2}%\" y1=\"0\" y2=\"100%\"/>");
        out += &format!("<text x=\"{x:.2}%\" y=\"100%\" dy=\"18\" text-anchor=\"middle\">{}</text>", (axes.write_x)(v));
    }
    for v in ticks(y0, y1) {
        let y = 100.0 * place([1.0, v])[1];
        out += &format!("<line class=\"grid\" x1=\"0\" x2=\"100%\" y1=\"{y:.2}%\" y2=\"{y:.2}%\"/>");
        out +=
            &format!("<text x=\"0\" dx=\"-8\" y=\"{y:.2}%\" dy=\"4\" text-anchor=\"end\">{}</text>", (axes.write_y)(v));
    }
    out += "<line class=\"axis\" x1=\"0\" x2=\"0\" y1=\"0\" y2=\"100%\"/>\
            <line class=\"axis\" x1=\"0\" x2=\"100%\" y1=\"100%\" y2=\"100%\"/>";
    for level in levels_shown.clone() {
        let y = 100.0 * place([1.0, shown(level.at)])[1];
        out += &format!("<line class=\"level\" x1=\"0\" x2=\"100%\" y1=\"{y:.2}%\" y2=\"{y:.2}%\"/>");
    }

    // Lines, cut off where the box ends.
    let mut lines = String::new();
    let mut dots = String::new();
    let mut placed: Vec<[f64; 2]> = Vec::new();
    let mut badges = String::new();
    for (k, curve) in curves.iter().enumerate() {
        let path: Vec<[f64; 2]> = curve.points.iter().copied().filter(|p| seen(*p)).map(place).collect();
        let inside: Vec<[f64; 2]> = path.iter().copied().filter(|p| p[1] <= 1.0).collect();
        let (Some(_), color) = (inside.last(), curve.color) else { continue };
        let text: String = path.iter().map(|[x, y]| format!("{:.1},{:.1} ", 1000.0 * x, 1000.0 * y.min(3.0))).collect();
        let name = escape(&curve.name);
        lines += &format!(
            "<polyline class=\"{color} d{}\" points=\"{}\"><title>{name}</title></polyline>",
            k % 3,
            text.trim_end()
        );
        if curve.dotted {
            for [x, y] in &inside {
                dots +=
                    &format!("<circle class=\"{color}\" cx=\"{:.2}%\" cy=\"{:.2}%\" r=\"3.5\"/>", 100.0 * x, 100.0 * y);
            }
        }
        // The last point where a badge is not over another; else the one farthest from all.
        let clear = |p: &[f64; 2]| {
            let gap = |q: &[f64; 2]| ((p[0] - q[0]) * PLOT[0]).hypot((p[1] - q[1]) * PLOT[1]);
            placed.iter().map(gap).fold(f64::INFINITY, f64::min)
        };
        let free = inside.iter().rev().find(|p| clear(p) > APART);
        let farthest = || inside.iter().max_by(|a, b| clear(a).total_cmp(&clear(b)));
        if let Some(&[x, y]) = free.or_else(farthest) {
            placed.push([x, y]);
            let (x, y) = (100.0 * x, 100.0 * y);
            badges += &format!(
                "<circle class=\"badge {color}\" cx=\"{x:.2}%\" cy=\"{y:.2}%\" r=\"8.5\"><title>{name}</title></circle>\
                 <text class=\"badge\" x=\"{x:.2}%\" y=\"{y:.2}%\" dy=\"4\" text-anchor=\"middle\">{}</text>",
                badge(k)
            );
        }
    }
    // What a level says stands at the side where fewer curves are.
    for level in levels_shown {
        let y = place([1.0, shown(level.at)])[1];
        let near = |from: f64, to: f64| {
            let is_near = |p: &[f64; 2]| (from..to).contains(&p[0]) && (y - p[1]).abs() < 0.07;
            points().map(place).filter(is_near).count()
        };
        let (x, dx, anchor) = if near(0.0, 0.25) <= near(0.75, 1.01) { (0, 8, "start") } else { (100, -4, "end") };
        badges += &format!(
            "<text class=\"said\" x=\"{x}%\" dx=\"{dx}\" y=\"{:.2}%\" dy=\"-6\" text-anchor=\"{anchor}\">{}</text>",
            100.0 * y,
            level.name
        );
    }
    let legend: String = curves
        .iter()
        .enumerate()
        .filter(|(_, c)| c.points.iter().any(|p| seen(*p) && place(*p)[1] <= 1.0))
        .map(|(k, c)| format!("<span><b class=\"{}\">{}</b>{}</span>", c.color, badge(k), escape(&c.name)))
        .collect();
    format!(
        "<p class=\"badges\">{legend}</p>\
         <svg class=\"plot tall\" role=\"img\" aria-label=\"{}\">{out}\
         <svg x=\"0\" y=\"0\" width=\"100%\" height=\"100%\" viewBox=\"0 0 1000 1000\" preserveAspectRatio=\"none\">{lines}</svg>\
         {dots}{badges}\
         <text x=\"50%\" y=\"100%\" dy=\"38\" text-anchor=\"middle\">{}</text></svg>",
        escape(axes.title),
        escape(axes.x)
    )
}

/// Seconds as an axis has them.
pub fn seconds(s: f64) -> String {
    match s {
        s if s < 0.9995e-3 => format!("{}\u{a0}µs", number(1e6 * s)),
        s if s < 0.9995 => format!("{}\u{a0}ms", number(1e3 * s)),
        s => format!("{}\u{a0}s", number(s)),
    }
}

/// A power of ten, or a small number.
pub fn power(x: f64) -> String {
    number(x).replace("1\u{a0}×\u{a0}", "")
}

/// Percent, as powers of ten where they are small.
pub fn percent(x: f64) -> String {
    format!("{}\u{a0}%", power(100.0 * x))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plot_leaves_out_what_has_no_place() {
        let curve = |points| Curve { name: "<a>".to_owned(), color: "k1", points, dotted: true };
        let axes = Axes { title: "t", x: "x", write_x: number, write_y: percent, floor: Some(1e-3), from: None };
        assert_eq!(plot(&[curve(vec![[0.0, 1.0], [1.0, f64::NAN]])], &[], &axes), "");
        let level = Level { at: 1e-2, name: "here".to_owned() };
        let drawn = plot(&[curve(vec![[1.0, 1.0], [2.0, 1e-9], [0.0, 1.0]]), curve(vec![[1.0, 0.5]])], &[level], &axes);
        assert!(drawn.contains("&lt;a&gt;") && !drawn.contains("<a>") && drawn.contains(">here<"), "{drawn}");
        assert_eq!(drawn.matches("r=\"3.5\"").count(), 2, "one of each is inside: {drawn}");
        assert!(!drawn.contains("NaN") && !drawn.contains("inf"), "{drawn}");
    }
}
