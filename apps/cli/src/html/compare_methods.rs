//! Form-factor methods on the page: pictures of what they got wrong, error against time, and where their errors come from.

use super::compare::color;
use super::compare_plot::{Axes, Curve, Level, percent as power_percent, plot, seconds};
use super::markup::{bars, count, duration, escape, note, number, percent, section, share, table, with_unit};
use super::plot::bar;
use crate::Failure;
use crate::compare::finest;
use base64::Engine;
use radiosity::Picture;
use radiosity::compare::{Comparison, Kind, Trial};
use radiosity::io::image_out::encode_png;

/// Relative differences that the colours begin and end with; between them they go with the logarithm, so that errors of a
/// half and of a hundredth are both seen.
const LEAST: f64 = 0.003;
const MOST: f64 = 0.5;

/// Too dark, right, too bright.
const RAMP: [[f64; 3]; 5] =
    [[20.0, 48.0, 128.0], [116.0, 170.0, 222.0], [244.0, 242.0, 237.0], [240.0, 150.0, 106.0], [138.0, 18.0, 30.0]];

/// Where there is no surface.
const VOID: [u8; 3] = [118, 122, 128];

/// Place of a difference on the scale, from −1 to 1.
fn place(difference: f64) -> f64 {
    let size = (1.0 + difference.abs() / LEAST).ln() / (1.0 + MOST / LEAST).ln();
    difference.signum() * size.min(1.0)
}

/// Colour of a place on the scale.
fn paint(place: f64) -> [u8; 3] {
    let at = (place.clamp(-1.0, 1.0) + 1.0) * 2.0;
    let first = (at as usize).min(3);
    let t = at - first as f64;
    std::array::from_fn(|k| (RAMP[first][k] + t * (RAMP[first + 1][k] - RAMP[first][k])).round() as u8)
}

fn image(png: &[u8], name: &str, caption: &str) -> String {
    let data = base64::engine::general_purpose::STANDARD.encode(png);
    format!(
        "<figure><img alt=\"{name}\" loading=\"lazy\" src=\"data:image/png;base64,{data}\">\
         <figcaption><b>{name}</b>{caption}</figcaption></figure>"
    )
}

/// The exact light, and the difference of each from it.
pub fn pictures(all: &Comparison) -> Result<String, Failure> {
    let [width, height] = all.size;
    let mut figures = String::new();
    if let Some(picture) = &all.picture {
        let Picture { width, height, .. } = *picture;
        let png = encode_png(width, height, &picture.tone_mapped(all.exposure)).map_err(Failure::work)?;
        figures += &image(&png, "The light", "exact, one value for each element");
    }
    for view in &all.views {
        let Some(trial) = all.trials.get(view.trial) else { continue };
        let color = |d: &f32| if d.is_finite() { paint(place(f64::from(*d))) } else { VOID };
        let pixels: Vec<[u8; 3]> = view.pixels.iter().map(color).collect();
        let png = encode_png(width, height, &pixels).map_err(Failure::work)?;
        let name = escape(&format!("{} {}", trial.method, trial.label));
        let caption = format!("{} off · {}", percent(trial.light_error), duration(trial.seconds));
        figures += &image(&png, name.trim_end(), &caption);
    }
    let words = note(
        "Illuminance of each element against the exact one, by the same camera and the same colours. Patches of single \
         elements are noise or aliasing; seams along corners and contacts are proximity; whole surfaces are what a method \
         does not see.",
    );
    Ok(section("What each got wrong", &format!("{}<div class=\"shots\">{figures}</div>{words}", ramp())))
}

/// The colours and their differences.
fn ramp() -> String {
    let stops: Vec<String> = (0..=20)
        .map(|k| {
            let [r, g, b] = paint(f64::from(k) / 10.0 - 1.0);
            format!("#{r:02x}{g:02x}{b:02x} {}%", 5 * k)
        })
        .collect();
    let marks =
        [(-0.5, "−50\u{a0}%"), (-0.1, "−10"), (-0.01, "−1"), (0.0, "0"), (0.01, "1"), (0.1, "10"), (0.5, "50\u{a0}%")];
    let mark = |(d, text): (f64, &str)| format!("<span style=\"left:{:.1}%\">{text}</span>", 50.0 * (1.0 + place(d)));
    let marks: String = marks.into_iter().map(mark).collect();
    format!(
        "<p class=\"ends\"><span>too dark</span><span>too bright</span></p>\
         <div class=\"ramp\"><div style=\"background:linear-gradient(90deg,{})\"></div>{marks}</div>",
        stops.join(",")
    )
}

/// Error against time.
pub fn errors(all: &Comparison) -> String {
    if all.trials.is_empty() && all.skipped.is_empty() {
        return String::new();
    }
    let is_spread = |t: &Trial| t.label.contains("points");
    let groups = all.trials.chunk_by(|a, b| a.method == b.method && is_spread(a) == is_spread(b));
    let curves: Vec<Curve> = groups
        .map(|of| {
            let name = match is_spread(&of[0]) {
                true => format!("{} {}", of[0].method, of[0].label),
                false => of[0].method.to_owned(),
            };
            let points = of.iter().map(|t| [t.seconds, t.light_error]).collect();
            Curve { name, color: color(of[0].kind), points, dotted: true }
        })
        .collect();
    let mesh = Level { at: all.truth.constant.error, name: "what the mesh costs".to_owned() };
    let axes = Axes {
        title: "Error of light against seconds for the form factors",
        x: "seconds for all form factors, wall clock",
        write_x: seconds,
        write_y: power_percent,
        floor: None,
        from: None,
    };
    let legend = "<p class=\"legend\"><span><i class=\"k1\"></i>projections</span><span><i class=\"k2\"></i>rays</span>\
                  <span><i class=\"k3\"></i>adaptive</span><span><i class=\"k5\"></i>pair by pair</span></p>";
    let words = note(
        "Error of light: relative root mean square difference of illuminance from the exact discrete one, by area. F off: \
         ‖F − F*‖/‖F*‖ over all entries. Covered: pairs whose stated error holds the true one. Row sums: root mean square \
         difference from the exact ones. From the truth: everything, mesh included, by the referee. Short runs are the best \
         of three. <code>rays</code> carries bright sources apart, as the engine does; its rows need not find them. \
         <code>hemicube</code> and <code>hemicube-midpoint</code> see the same through the same cells and differ in what a cell \
         weighs: its exact factor, so that rows sum to one, or the factor at its centre times its area, as published in \
         1985, which is off by some 10⁻⁴ with 64 cells and falls with their square.",
    );
    section(
        "Form factors: error against time",
        &(legend.to_owned() + &plot(&curves, &[mesh], &axes) + &trials(all) + &words + &skipped(all)),
    )
}

fn trials(all: &Comparison) -> String {
    let row = |(k, t): (usize, &Trial)| {
        let megabytes = t.bytes as f64 / f64::from(1 << 20);
        let is_first = k == 0 || all.trials[k - 1].method != t.method;
        vec![
            if is_first { format!("<b>{}</b>", t.method) } else { String::new() },
            escape(&t.label),
            duration(t.seconds),
            percent(t.light_error),
            percent(t.factor_error),
            number(t.largest_factor_error),
            t.covered.map_or("–".to_owned(), share),
            with_unit(megabytes, "MB"),
            percent(t.bias),
            percent(t.error_from_truth),
            number(t.row_sum_error),
            t.samples.map_or("–".to_owned(), count),
            share(t.factor_share),
            t.processor_seconds.map_or("–".to_owned(), duration),
            number(t.reciprocity),
        ]
    };
    let head = [
        "Method",
        "Setting",
        "Time",
        "Light off",
        "F off",
        "Largest",
        "Covered",
        "Memory",
        "Bias",
        "From the truth",
        "Row sums off",
        "Rays, cells a row",
        "F’s share of time",
        "Processor",
        "Reciprocity off",
    ];
    let rows: Vec<Vec<String>> = all.trials.iter().enumerate().map(row).collect();
    format!(
        "<div class=\"trials\"><p class=\"sideways\">scroll sideways for all columns →</p>{}</div>",
        table(&head, &rows)
    )
}

fn skipped(all: &Comparison) -> String {
    if all.skipped.is_empty() {
        return String::new();
    }
    let item = |s: &radiosity::compare::Skipped| {
        format!("{} ({})", escape(format!("{} {}", s.method, s.label).trim_end()), duration(s.estimated_seconds))
    };
    let list: Vec<String> = all.skipped.iter().map(item).collect();
    note(&format!(
        "Left out, as one would have taken too much of the time that was left, with its time as estimated from its first \
         rows or some pairs: {}. A larger <code>--budget</code> or fewer <code>--elements</code> let them in.",
        list.join(", ")
    ))
}

/// Names, colours and meanings of causes.
const CAUSES: [(&str, &str, &str); 5] = [
    ("near", "k2", "facets nearer than the element is wide (proximity)"),
    ("hidden", "k5", "something stands between"),
    ("rim", "k3", "below the rim (truncation)"),
    ("small", "k1", "fewer than 32 cells or rays (aliasing, noise)"),
    ("rest", "k4", "none of these"),
];

/// Where errors come from.
pub fn causes(all: &Comparison) -> String {
    if all.trials.is_empty() {
        return String::new();
    }
    let rows = finest(&all.trials).map(|t| {
        let ranked = t.wrong.causes.ranked();
        let parts: Vec<(&str, f64)> = CAUSES
            .iter()
            .filter_map(|(name, color, _)| Some((*color, ranked.iter().find(|(n, _)| n == name)?.1[0])))
            .collect();
        (t.method.to_owned(), bar(&parts), vec![percent(t.light_error)])
    });
    let legend: String =
        CAUSES.iter().map(|(_, color, meaning)| format!("<span><i class=\"{color}\"></i>{meaning}</span>")).collect();
    let words: String = finest(&all.trials)
        .map(|t| format!("<dt>{} {}</dt><dd>{}</dd>", t.method, escape(&t.label), said(t)))
        .collect();
    let remark = note(
        "Shares of the squared error of the light that reaches elements from each other, each pair counted to the first \
         cause that holds, in the order of rim, near, hidden, small; and the error of light beside. The finest setting of each.",
    );
    section(
        "Where the errors come from",
        &format!("<p class=\"legend\">{legend}</p>{}{remark}<dl class=\"said-of\">{words}</dl>", bars(rows)),
    )
}

/// What is to be said of a method, from its numbers.
fn said(t: &Trial) -> String {
    let w = &t.wrong;
    let (cause, [part, pairs, _]) = w.causes.ranked()[0];
    let cells = if t.kind == Kind::Sampling { "rays" } else { "cells" };
    let what = match (cause, t.kind) {
        ("near", _) => {
            "comes from facets nearer than the element is wide, which its centre sees otherwise than its whole"
                .to_owned()
        }
        ("hidden", Kind::Pair) if t.covered.is_some_and(|c| c < 0.95) => {
            "comes from where something stands between, which it does not look for".to_owned()
        }
        ("hidden", Kind::Adaptive) => "comes from edges of shadows, cut as exactly as was asked".to_owned(),
        ("hidden", _) => {
            "comes from where something stands between: a place sees all of a facet or none of it".to_owned()
        }
        ("rim", _) => "comes from what lies below the rim, where it does not look".to_owned(),
        ("small", _) => format!("comes from facets that should have fewer than 32 {cells}"),
        _ => "comes from no one place: borders of facets that are drawn a little off".to_owned(),
    };
    let [x, y, z] = w.centre.map(|c| format!("{c:.2}"));
    let object = |name: &str| if name.is_empty() { "a surface".to_owned() } else { format!("“{}”", escape(name)) };
    let worst = if w.relative <= -0.999 {
        "no light at all, as if its centre were inside a solid".to_owned()
    } else {
        let side = if w.relative < 0.0 { "too dark" } else { "too bright" };
        format!("{} {side}", percent(w.relative.abs()))
    };
    let samples = match w.samples {
        Some(samples) if samples < 1e4 => format!(" and {} {cells} large", number(samples)),
        _ => String::new(),
    };
    let from = if w.from_object == w.object { "the same".to_owned() } else { object(&w.from_object) };
    format!(
        "{} of its squared error, in {} of the pairs, {what}. The element that adds most to it is one of {} at {x}, {y}, \
         {z}\u{a0}m: {worst}, most of it by a facet of {from}, {} of its widths away{samples}, to which its factor is {} \
         instead of {}.",
        share(part),
        share(pairs),
        object(&w.object),
        number(w.distance_in_widths),
        number(w.factors[0]),
        number(w.factors[1]),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_tell_the_sign_and_end_at_the_scale() {
        assert_eq!((place(0.0), place(MOST), place(-9.0)), (0.0, 1.0, -1.0));
        assert!(place(0.01) > 0.1 && place(0.01) < place(0.1));
        let ([dark, .., blue], [red, .., bright]) = (paint(-0.7), paint(0.7));
        assert!(blue > dark && red > bright);
        assert_eq!(paint(0.0), [244, 242, 237]);
    }
}
