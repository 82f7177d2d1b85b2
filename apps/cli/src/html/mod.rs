//! The report as a page: one file that needs nothing else. Styles are inline, pictures are data addresses, plots are
//! drawn here as SVG, and a content policy in its head forbids the browser to fetch anything.
//!
//! What a reader needs first comes first: is the asked error reached, what does it look like, how bright is it; then
//! how far to trust it and what it cost; last, how to do it again. All text from outside is escaped.

mod compare;
mod compare_methods;
mod compare_plot;
mod compare_solvers;
mod light;
mod markup;
mod plot;
#[cfg(test)]
mod tests;
mod trust;

pub use compare::comparison;

use crate::figures;
use crate::report::{ErrorReport, Report};
use markup::{cards, count, escape, note, number, percent, plural, section};
use radiosity::Severity;
use std::path::Path;

/// Two-sided 95 % quantile of the normal distribution, for the interval of the bias.
const TWO_SIDED_95: f64 = 1.96;

/// Light and dark, screen, telephone and paper.
const STYLE: &str = include_str!("style.css");

/// A picture on the page.
pub struct Plate {
    /// What it shows.
    pub title: String,
    /// How to read it.
    pub note: String,
    /// PNG bytes.
    pub png: Vec<u8>,
    /// Its colours are those of the classes of illuminance.
    pub has_scale: bool,
}

/// A self-contained HTML page.
pub fn page(report: &Report, plates: &[Plate]) -> String {
    // The folder of a scene is nobody's title.
    let name = Path::new(&report.scene.name).file_name().map(|n| n.to_string_lossy().into_owned());
    let name = escape(&name.unwrap_or_else(|| report.scene.name.clone()));
    let body = [
        verdict(report),
        light::gallery(plates, &report.illuminance),
        light::illuminance(report),
        trust::convergence(report),
        trust::balance(report),
        trust::solution(report),
        trust::work(report),
        report.lightmap.as_ref().map(light::lightmap).unwrap_or_default(),
        faults(report),
        origin(report),
    ]
    .concat();
    let (program, version) = (escape(&report.program), escape(&report.version));
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <meta name=\"color-scheme\" content=\"light dark\">\
         <meta http-equiv=\"Content-Security-Policy\" \
         content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\">\
         <title>Light in {name}</title>\n<style>\n{STYLE}</style></head>\n<body><main>\
         <header><p class=\"eyebrow\"><span>Lighting report</span><span>{}</span></p><h1>{name}</h1>\
         <p class=\"quiet\">{}</p></header>\n{body}\n<footer>{program} {version}</footer></main></body></html>\n",
        escape(&report.written),
        scene_facts(report),
    )
}

fn scene_facts(report: &Report) -> String {
    let scene = &report.scene;
    let lights = match scene.lights.as_slice() {
        [] if scene.other_light.is_empty() => "no light".to_owned(),
        [] => format!("lit by {}", scene.other_light.join(" and ")),
        few @ ([_] | [_, _] | [_, _, _] | [_, _, _, _]) => {
            format!("{}: {}", plural(few.len(), "light"), escape(&few.join(", ")))
        }
        many => plural(many.len(), "light"),
    };
    let lights = match scene.lights.is_empty() || scene.other_light.is_empty() {
        true => lights,
        false => format!("{lights}, and {}", scene.other_light.join(" and ")),
    };
    format!(
        "{} · {}\u{a0}m² of surface · {} · {lights}",
        plural(scene.triangles, "triangle"),
        number(scene.area),
        plural(scene.materials, "material")
    )
}

fn verdict(report: &Report) -> String {
    let error = &report.error;
    let (asked, upper) = (error.asked, error.upper_95_one_sided);
    // The flag and the figures must agree before the page says so.
    let achieved = error.achieved && upper <= asked;
    let (class, title) = match achieved {
        true => ("good", "The asked error is reached"),
        false => ("bad", "The asked error is NOT reached"),
    };
    let bounded = error.points > 0 && upper.is_finite();
    let reached = match bounded {
        true => format!("With 95 % confidence the illuminance is wrong by no more than {}", percent(upper)),
        false => "The audit could not bound the error, so this answer is not certified".to_owned(),
    };
    let advice = if achieved {
        format!("; {} was asked.", percent(asked))
    } else if error.is_told_beside_the_solution() {
        let within = percent(error.solution_upper_95_one_sided);
        format!("; {} was asked. The solution itself is within {within}: {}.", percent(asked), error.finer)
    } else if error.out_of_time {
        format!("; {} was asked. Allow more time.", percent(asked))
    } else if error.left_open {
        format!(
            "; {} was asked. Light comes by few bright paths, and those of the audit leave open whether it is reached.",
            percent(asked)
        )
    } else if error.stalled {
        format!("; {} was asked. The last rounds came no nearer: more would hardly help.", percent(asked))
    } else if bounded && error.estimated <= asked {
        format!(
            "; {} was asked. The estimate meets it, but a larger error cannot be excluded: allow more rounds.",
            percent(asked)
        )
    } else {
        format!("; {} was asked. Allow more rounds, more memory or smaller elements.", percent(asked))
    };
    let estimated = if error.points == 0 { f64::NAN } else { error.estimated };
    let lower = if error.lower_95_one_sided == 0.0 { figures::LOWER_IS_ZERO } else { figures::LOWER };
    let (bias, bias_meaning) = bias(error);
    let cards = cards(&[
        ("Asked error", percent(asked), figures::ASKED),
        ("Estimated error", percent(estimated), figures::ESTIMATED),
        ("Upper bound", percent(upper), figures::UPPER),
        ("Lower bound", percent(error.lower_95_one_sided), lower),
        ("Bias", bias, &bias_meaning),
    ]);
    let troubles = report.faults.0.iter().filter(|f| f.severity != Severity::Note).count();
    let troubles = match troubles {
        0 => String::new(),
        n => format!(" <a href=\"#faults\">The input has {}.</a>", plural(n, "fault")),
    };
    let words = note(&format!(
        "The error is the root mean square difference of illuminance from the truth, over the root mean square \
         illuminance, by area; what eyes in the scene see much more of than its area tells, as a room on a wide site, counts for more. \
         An independent audit traced paths through the original scene at {}, two estimates of about {} \
         each, more where light is bright. It shares neither elements nor solver with the answer, so its error covers everything: elements, rays, \
         solver, interpolation, leaks of light. The band above spans the two bounds; each holds by itself with 95 % \
         confidence, both together with 90 %. Another seed audits other points.",
        plural(error.points, "point"),
        plural(error.paths_per_estimate as usize, "path"),
    ));
    let dimly = error.dimly().map_or(String::new(), |dimly| format!("<p class=\"lead\">But {dimly}.</p>"));
    format!(
        "<section class=\"verdict {class}\"><h2>{title}</h2><p class=\"lead\">{reached}{advice}{troubles}</p>\
         {dimly}{}{cards}{words}</section>",
        plot::gauge(error),
    )
}

/// The bias with its interval, and what it means.
fn bias(error: &ErrorReport) -> (String, String) {
    let half = TWO_SIDED_95 * error.bias_standard_error;
    if error.points == 0 || !error.bias.is_finite() || !half.is_finite() {
        return ("unknown".to_owned(), figures::BIAS.to_owned());
    }
    let sign = if error.bias > 0.0 { "+" } else { "" };
    let verdict = match () {
        () if error.bias.abs() <= half => "too small to tell from none",
        () if error.bias > 0.0 => "on average too bright",
        () => "on average too dark",
    };
    let meaning = format!("{}; ±\u{a0}{} with 95 % confidence: {verdict}", figures::BIAS, percent(half));
    (format!("{sign}{}", percent(error.bias)), meaning)
}

fn faults(report: &Report) -> String {
    let item = |f: &radiosity::Fault| {
        let (class, name) = match f.severity {
            Severity::Error => ("error", "Error"),
            Severity::Warning => ("warning", "Warning"),
            Severity::Note => ("note", "Note"),
        };
        let hint = if f.hint.is_empty() { String::new() } else { format!("<br><em>{}</em>", escape(&f.hint)) };
        let (place, what) = (escape(&f.place), escape(&f.what));
        format!("<li class=\"{class}\"><b>{name}</b> <code>{place}</code><br>{what}{hint}</li>")
    };
    let body = match report.faults.0.as_slice() {
        [] => "<p>None were found.</p>".to_owned(),
        all => format!("<ul class=\"faults\">{}</ul>", all.iter().map(item).collect::<String>()),
    };
    format!("<section id=\"faults\"><h2>Faults of the input</h2>{body}</section>")
}

/// How to do it again.
fn origin(report: &Report) -> String {
    let command: Vec<String> = report.command.iter().map(|word| escape(&quoted(word))).collect();
    let row = |name: &str, value: String| format!("<div><dt>{name}</dt><dd>{value}</dd></div>");
    let files: String = report.outputs.iter().map(|o| format!("<li><code>{}</code></li>", escape(o))).collect();
    let files = if files.is_empty() { "none".to_owned() } else { format!("<ul>{files}</ul>") };
    let rows = [
        row("Command line", format!("<code>{}</code>", command.join(" "))),
        row("Scene", format!("<code>{}</code>", escape(&report.scene.name))),
        row("Program", format!("{} {}", escape(&report.program), escape(&report.version))),
        row("Seed of the audit", report.error.seed.to_string()),
        row("Threads", format!("{}; {}", count(report.time.threads), figures::THREADS)),
        row("Files written", files),
    ];
    section("How it was made", &format!("<dl class=\"origin\">{}</dl>", rows.concat()))
}

/// A word as a shell would want it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=:,%+@".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}
