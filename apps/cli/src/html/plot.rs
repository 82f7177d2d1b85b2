//! Plots as SVG. Without a view box and with places in percent they take any width, while their letters and strokes
//! keep their size: a telephone shows the same plot as a sheet of paper. Colours are the style sheet's, by class.
//!
//! Values that are not finite are left out.

use super::markup::{number, percent};
use crate::report::ErrorReport;
use radiosity::measure::Round;

/// A stacked bar of parts of one: class and share, or with a colour of its own.
pub fn bar(parts: &[(&str, f64)]) -> String {
    let mut x = 0.0;
    let mut rects = String::new();
    for (paint, share) in parts.iter().filter(|p| p.1 > 0.0 && p.1.is_finite()) {
        let width = (100.0 * share).min(100.0 - x);
        let paint = match paint.strip_prefix('#') {
            Some(_) => format!("fill=\"{paint}\""),
            None => format!("class=\"{paint}\""),
        };
        rects += &format!("<rect {paint} x=\"{x:.2}%\" width=\"{width:.2}%\" height=\"100%\"/>");
        x += width;
    }
    format!("<svg class=\"bar\" aria-hidden=\"true\">{rects}</svg>")
}

/// The audit's interval on a scale from zero, with the asked error as a mark.
pub fn gauge(error: &ErrorReport) -> String {
    let (estimated, asked) = (error.estimated, error.asked);
    let (lower, upper) = (error.lower_95_one_sided, error.upper_95_one_sided);
    let top = [estimated, upper, asked].into_iter().filter(|x| x.is_finite()).fold(0.0, f64::max) * 1.2;
    if error.points == 0 || !(top > 0.0 && estimated.is_finite()) {
        return String::new();
    }
    let x = |v: f64| if v.is_finite() { 100.0 * (v / top).clamp(0.0, 1.0) } else { 100.0 };
    let (from, to) = (x(lower.max(0.0)), x(upper));
    let mut out = format!(
        "<line class=\"axis\" x1=\"0\" x2=\"100%\" y1=\"50\" y2=\"50\"/>\
         <rect class=\"interval\" x=\"{from:.2}%\" width=\"{:.2}%\" y=\"24\" height=\"18\" rx=\"4\"/>\
         <circle class=\"dot error\" cx=\"{:.2}%\" cy=\"33\" r=\"6\"/>",
        (to - from).max(0.3),
        x(estimated),
    );
    if asked > 0.0 && asked.is_finite() {
        let x = x(asked);
        let anchor = if x < 15.0 { "start" } else { "middle" };
        out += &format!(
            "<line class=\"asked\" x1=\"{x:.2}%\" x2=\"{x:.2}%\" y1=\"18\" y2=\"50\"/>\
             <text x=\"{x:.2}%\" y=\"12\" text-anchor=\"{anchor}\">asked {}</text>",
            percent(asked)
        );
    }
    format!(
        "<svg class=\"gauge\" role=\"img\" aria-label=\"Estimated error {}, asked {}\">{out}\
         <text x=\"0\" y=\"66\">0</text><text x=\"100%\" y=\"66\" text-anchor=\"end\">error {}</text></svg>",
        percent(estimated),
        percent(asked),
        percent(top)
    )
}

/// Error and upper bound against seconds, both logarithmic.
pub fn convergence(rounds: &[Round], asked: f64) -> String {
    // A clock does not resolve less than a millisecond usefully; zero has no logarithm.
    let time = |r: &Round| if r.seconds.is_finite() { r.seconds.max(1e-3) } else { f64::NAN };
    let errors = rounds.iter().flat_map(|r| [r.error, r.upper]).chain([asked]);
    let (Some((x0, x1)), Some((y0, y1))) = (log_range(rounds.iter().map(time)), log_range(errors)) else {
        return String::new();
    };
    let x = |v: f64| 100.0 * (v.log10() - x0) / (x1 - x0);
    let y = |v: f64| 100.0 * (y1 - v.log10()) / (y1 - y0);
    let mut out = String::new();
    // What was asked is the ground to land on.
    if asked > 0.0 && asked.is_finite() {
        let y = y(asked);
        out += &format!("<rect class=\"met\" y=\"{y:.2}%\" width=\"100%\" height=\"{:.2}%\"/>", 100.0 - y);
        out += &format!("<line class=\"asked\" x1=\"0\" x2=\"100%\" y1=\"{y:.2}%\" y2=\"{y:.2}%\"/>");
    }
    for v in ticks(x0, x1) {
        let (x, label) = (x(v), number(v));
        out += &format!("<line class=\"grid\" x1=\"{x:.2}%\" x2=\"{x:.2}%\" y1=\"0\" y2=\"100%\"/>");
        out += &format!("<text x=\"{x:.2}%\" y=\"100%\" dy=\"18\" text-anchor=\"middle\">{label}</text>");
    }
    for v in ticks(y0, y1) {
        let (y, label) = (y(v), percent(v));
        out += &format!("<line class=\"grid\" x1=\"0\" x2=\"100%\" y1=\"{y:.2}%\" y2=\"{y:.2}%\"/>");
        out += &format!("<text x=\"0\" dx=\"-8\" y=\"{y:.2}%\" dy=\"4\" text-anchor=\"end\">{label}</text>");
    }
    out += "<line class=\"axis\" x1=\"0\" x2=\"0\" y1=\"0\" y2=\"100%\"/>\
            <line class=\"axis\" x1=\"0\" x2=\"100%\" y1=\"100%\" y2=\"100%\"/>";
    let timed: Vec<&Round> = rounds.iter().filter(|r| time(r).is_finite()).collect();
    for (class, value) in [("upper", &(|r: &Round| r.upper) as &dyn Fn(&Round) -> f64), ("error", &|r| r.error)] {
        let drawn = |r: &&&Round| value(r) > 0.0 && value(r).is_finite();
        let points: Vec<[f64; 2]> = timed.iter().filter(drawn).map(|r| [x(time(r)), y(value(r))]).collect();
        for pair in points.windows(2) {
            let ([ax, ay], [bx, by]) = (pair[0], pair[1]);
            out += &format!(
                "<line class=\"line {class}\" x1=\"{ax:.2}%\" y1=\"{ay:.2}%\" x2=\"{bx:.2}%\" y2=\"{by:.2}%\"/>"
            );
        }
        for [x, y] in points {
            out += &format!("<circle class=\"dot {class}\" cx=\"{x:.2}%\" cy=\"{y:.2}%\" r=\"5\"/>");
        }
        for r in timed.iter().filter(|r| value(r) == 0.0) {
            out += &format!("<circle class=\"hollow {class}\" cx=\"{:.2}%\" cy=\"100%\" r=\"5\"/>", x(time(r)));
        }
    }
    format!(
        "<p class=\"legend\"><span><i class=\"error\"></i>estimated error</span>\
         <span><i class=\"upper\"></i>upper bound, one-sided 95 %</span>\
         <span><i class=\"asked\"></i>asked error</span></p>\
         <svg class=\"plot\" role=\"img\" aria-label=\"Relative error against seconds\">{out}\
         <text x=\"50%\" y=\"100%\" dy=\"38\" text-anchor=\"middle\">seconds since the solve began</text></svg>"
    )
}

/// Decimal logarithms of a range that holds all positive finite values with a margin, and is at least a decade wide.
pub fn log_range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let logs = values.filter(|v| *v > 0.0 && v.is_finite()).map(f64::log10);
    let (low, high) = logs.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
    let margin = (0.5 * (1.0 - (high - low))).max(0.12);
    (low <= high).then_some((low - margin, high + margin))
}

/// Round values between two decimal logarithms: 1, 2, 5 in each decade, or whole decades where those would crowd.
pub fn ticks(low: f64, high: f64) -> Vec<f64> {
    let stride = ((high - low) / 6.0).ceil().max(1.0) as usize;
    let steps: &[f64] = if high - low <= 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let decades = (low.floor() as i32..=high.ceil() as i32).step_by(stride);
    let all = decades.flat_map(|d| steps.iter().map(move |s| s * 10f64.powi(d)));
    all.filter(|v| (low..=high).contains(&v.log10())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_never_leaves_its_box() {
        let bar = bar(&[("c1", 0.7), ("#123456", 0.7), ("c3", f64::NAN), ("c4", -1.0)]);
        assert!(bar.contains("width=\"70.00%\"") && bar.contains("x=\"70.00%\" width=\"30.00%\""), "{bar}");
        assert_eq!(bar.matches("<rect").count(), 2);
    }

    #[test]
    fn ticks_are_round_and_not_many() {
        for (low, high) in [(-1.0, 0.0), (-3.1, -0.9), (-8.0, 9.0), (0.4, 1.4)] {
            let ticks = ticks(low, high);
            assert!((2..=9).contains(&ticks.len()), "{ticks:?}");
        }
        let decade: Vec<String> = ticks(-0.5, 0.5).into_iter().map(number).collect();
        assert_eq!(decade, ["0.5", "1", "2"]);
    }
}
