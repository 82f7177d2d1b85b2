//! The page of a comparison: what to take away, then pictures of what each method got wrong, error against time, solvers,
//! growth, what it was all compared with, and how to do it again. Every sentence with a number is made from the numbers.

use super::compare_methods as methods;
use super::compare_plot::{Axes, Curve, plot, seconds};
use super::compare_solvers as solvers;
use super::markup::{cards, count, duration, escape, note, number, percent, plural, section, table, with_unit};
use super::{STYLE, quoted};
use crate::Failure;
use crate::compare::{Account, finest, misses_accuracy};
use radiosity::Audit;
use radiosity::compare::{Comparison, Contender, Kind, Trial};
use std::path::Path;

/// What this page has beyond the others.
const OWN_STYLE: &str = include_str!("compare.css");

/// A self-contained HTML page.
pub fn comparison(account: &Account) -> Result<String, Failure> {
    let name = Path::new(&account.scene).file_name().map(|n| n.to_string_lossy().into_owned());
    let name = escape(&name.unwrap_or_else(|| account.scene.clone()));
    let all = &account.comparison;
    let body = [
        take_away(all),
        methods::pictures(all)?,
        methods::errors(all),
        methods::causes(all),
        solvers::solvers(all),
        growth(all),
        ground(all),
        origin(account),
    ]
    .concat();
    let (program, version) = (account.program, account.version);
    Ok(format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <meta name=\"color-scheme\" content=\"light dark\">\
         <meta http-equiv=\"Content-Security-Policy\" \
         content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\">\
         <title>Methods compared on {name}</title>\n<style>\n{STYLE}{OWN_STYLE}</style></head>\n<body><main>\
         <header><p class=\"eyebrow\"><span>Methods side by side</span><span>{}</span></p><h1>{name}</h1>\
         <p class=\"quiet\">{} · {} · {}\u{a0}m² of surface</p></header>\n{body}\n\
         <footer>{program} {version}</footer></main></body></html>\n",
        escape(&account.written),
        plural(account.triangles, "triangle"),
        plural(all.elements, "element"),
        number(all.area),
    ))
}

/// Colour of a kind of method.
pub fn color(kind: Kind) -> &'static str {
    match kind {
        Kind::Projection => "k1",
        Kind::Sampling => "k2",
        Kind::Adaptive => "k3",
        Kind::Pair => "k5",
    }
}

/// The audit's error, by its bound where the estimate is lost in its noise.
fn audited(audit: &Audit) -> String {
    if audit.lower > 0.0 { percent(audit.error) } else { format!("less than {}", percent(audit.upper)) }
}

/// What a hurried reader needs.
fn take_away(all: &Comparison) -> String {
    let points = [solvers::take_away(all), corners(all), mesh(all), cost(all)];
    let list: String =
        points.into_iter().flatten().map(|[head, text]| format!("<li><b>{head}</b> {text}</li>")).collect();
    let share = shares(all).map_or("unknown".to_owned(), |[low, high]| range(low, high));
    let cards = cards(&[
        ("Elements", count(all.elements), &format!("each {} wide", with_unit(all.element_size, "m"))),
        ("Cost of the mesh", audited(&all.truth.constant), "error of the exact discrete light from the truth"),
        (
            "Engine",
            audited(&all.truth.engine),
            &format!("the same with its own {} elements", count(all.truth.engine_elements)),
        ),
        ("Share of form factors", share, "in the time of form factors and solver"),
        ("Time", duration(all.seconds), &format!("of {} allowed", duration(all.budget))),
    ]);
    section("What to take away", &format!("<ul class=\"take\">{list}</ul>{cards}<h3>In these words</h3>{}", terms(all)))
}

/// Least and largest share of form factors in time.
fn shares(all: &Comparison) -> Option<[f64; 2]> {
    let of = || finest(&all.trials).map(|t| t.factor_share);
    let (low, high) = (of().fold(f64::INFINITY, f64::min), of().fold(0.0, f64::max));
    (low <= high).then_some([low, high])
}

fn range(low: f64, high: f64) -> String {
    let [low, high] = [low, high].map(|x| format!("{:.0}", 100.0 * x));
    if low == high { format!("{low}\u{a0}%") } else { format!("{low}–{high}\u{a0}%") }
}

/// Why the hemicube fails in corners.
fn corners(all: &Comparison) -> Option<[String; 2]> {
    let trial = finest(&all.trials).find(|t| t.method == "hemicube")?;
    // The finest with one eye point tells about that point.
    let single = |t: &&Trial| t.method == "hemicube" && !t.label.contains("points");
    let trial = all.trials.iter().rfind(single).unwrap_or(trial);
    let first = all.trials.iter().find(single).unwrap_or(trial);
    let [near, pairs, of_factors] = trial.wrong.causes.near;
    let mut text =
        "It looks out from the centre of an element. A facet nearer than the element is wide looks different from \
                    there than from the element’s other places, and no number of cells mends that. "
            .to_owned();
    if first.label != trial.label {
        text += &format!(
            "From {} to {} the error of its factors only goes from {} to {}. ",
            escape(&first.label),
            escape(&trial.label),
            percent(first.factor_error),
            percent(trial.factor_error)
        );
    }
    text += &format!(
        "Seen with {}, such pairs, {} of all, make {} of the squared error of its factors and {} of that of its light.",
        escape(&trial.label),
        percent(pairs),
        percent(of_factors),
        percent(near)
    );
    if let Some(corner) = &trial.wrong.corner {
        let [found, exact] = corner.factors;
        let [looking, seen] = corner.objects.each_ref().map(|name| match name.as_str() {
            "" => "a surface".to_owned(),
            name => format!("“{}”", escape(name)),
        });
        let [x, y, z] = corner.centre.map(|c| format!("{c:.3}"));
        let side = if found > exact { "too much" } else { "too little" };
        text += &format!(
            " One such pair: an element of {looking} at {x}, {y}, {z}\u{a0}m and one of {seen} that meets it along an edge. From \
             its centre the other takes {} of what it sees, on the mean over all its places {}: the hemicube has {} {side}.",
            factor(found),
            factor(exact),
            percent((found / exact - 1.0).abs())
        );
    }
    let spread = all.trials.iter().find(|t| t.method == "hemicube" && t.label.contains("points"));
    if let Some(spread) = spread {
        text += &format!(
            " More places to look from do mend it: with {} its factors are {} off and its light {}, after {}.",
            escape(&spread.label),
            percent(spread.factor_error),
            percent(spread.light_error),
            duration(spread.seconds)
        );
    }
    Some(["The hemicube’s factors fail in corners, not for want of cells.".to_owned(), text])
}

/// A form factor to four decimals, as tables have them.
fn factor(f: f64) -> String {
    format!("{f:.4}")
}

/// Words that the page cannot do without.
fn terms(all: &Comparison) -> String {
    let shot = number(1.0 / all.elements.max(1) as f64);
    let terms = [
        ("Form factor F", "the share of the light leaving one element that arrives at another".to_owned()),
        (
            "Light off",
            "root mean square difference of illuminance from the exact one on the same elements, relative, by area"
                .to_owned(),
        ),
        ("Sweep", "one application of F to the light: every element collects from all others once".to_owned()),
        (
            "Work",
            format!("counted in sweeps; a shot, in which one element gives to all others, is one of {} parts of a sweep ({shot})", count(all.elements)),
        ),
        (
            "Of full white",
            "how far a picture is off as a display shows it, root mean square over its pixels; 100 % were white instead of \
             black everywhere"
                .to_owned(),
        ),
    ];
    let list: String =
        terms.iter().map(|(name, meaning)| format!("<div><dt>{name}</dt><dd>{meaning}</dd></div>")).collect();
    format!("<dl class=\"terms\">{list}</dl>")
}

/// What the mesh costs beside what methods cost.
fn mesh(all: &Comparison) -> Option<[String; 2]> {
    let below = finest(&all.trials).filter(|t| t.light_error < all.truth.constant.error).count();
    let total = finest(&all.trials).count();
    let head = match below * 2 >= total && total > 0 {
        true => "The mesh costs more than most methods.",
        false => "The mesh has its price, too.",
    };
    Some([
        head.to_owned(),
        format!(
            "One value for each of {} is {} from the truth even with exact form factors; interpolated, {}. The engine as it \
             runs by itself, with {} and light of lamps apart, is {} off after {}.",
            plural(all.elements, "element"),
            audited(&all.truth.constant),
            audited(&all.truth.interpolated),
            plural(all.truth.engine_elements, "element"),
            audited(&all.truth.engine),
            duration(all.truth.engine_seconds)
        ),
    ])
}

/// Who is fast.
fn cost(all: &Comparison) -> Option<[String; 2]> {
    let classic = all
        .trials
        .iter()
        .filter(|t| t.kind == Kind::Projection)
        .min_by(|a, b| a.light_error.total_cmp(&b.light_error))?;
    let cheaper = all.trials.iter().filter(|t| t.light_error <= classic.light_error && t.kind != Kind::Projection);
    let mut text = match cheaper.min_by(|a, b| a.seconds.total_cmp(&b.seconds)) {
        Some(best) if best.seconds < classic.seconds => format!(
            "{} ({}) is {} off after {}; the best projection, {} with {}, is {} off after {}.",
            best.method,
            escape(&best.label),
            percent(best.light_error),
            duration(best.seconds),
            classic.method,
            escape(&classic.label),
            percent(classic.light_error),
            duration(classic.seconds)
        ),
        _ => format!(
            "Nothing is as good as {} with {} in less time: {} off after {}.",
            classic.method,
            escape(&classic.label),
            percent(classic.light_error),
            duration(classic.seconds)
        ),
    };
    if let Some([low, high]) = shares(all) {
        text += &format!(
            " Form factors take {} of the time; the solver hardly matters to a still picture.",
            range(low, high)
        );
    }
    Some(["Form factors are the cost.".to_owned(), text])
}

/// Time and memory over meshes.
fn growth(all: &Comparison) -> String {
    let many: Vec<_> = all.growth.iter().filter(|g| g.sizes.len() > 1).collect();
    if many.is_empty() {
        return String::new();
    }
    let kind = |name: &str| name.parse::<Contender>().map_or(Kind::Pair, Contender::kind);
    let curves: Vec<Curve> = many
        .iter()
        .map(|g| Curve {
            name: format!("{} {}", g.method, g.label).trim_end().to_owned(),
            color: color(kind(g.method)),
            points: g.sizes.iter().map(|s| [s.elements as f64, s.seconds]).collect(),
            dotted: true,
        })
        .collect();
    let axes = Axes {
        title: "Seconds for all form factors against elements",
        x: "elements",
        write_x: number,
        write_y: seconds,
        floor: None,
        from: None,
    };
    let power = |p: Option<f64>| p.map_or("unknown".to_owned(), |p| format!("N<sup>{p:.2}</sup>"));
    let rows: Vec<Vec<String>> = many
        .iter()
        .map(|g| {
            let ends = [g.sizes.first(), g.sizes.last()].map(|s| s.map_or(String::new(), |s| count(s.elements)));
            vec![
                g.method.to_owned(),
                escape(&g.label),
                format!("{}–{}", ends[0], ends[1]),
                power(g.time_exponent),
                power(g.memory_exponent),
            ]
        })
        .collect();
    let words = note(
        "Each at one setting, on meshes of a quarter, a half and twice the elements where there was time; the exponents are \
         those of straight lines through the logarithms. Few meshes and short times leave ± 0.2 of an exponent open. A table of \
         rays grows with the elements; every matrix with their square.",
    );
    let head = ["Method", "Setting", "Elements", "Time", "Memory"];
    section("Growth with the mesh", &(plot(&curves, &[], &axes) + &table(&head, &rows) + &words))
}

/// What all was compared with.
fn ground(all: &Comparison) -> String {
    let r = &all.reference;
    let cards = cards(&[
        (
            "Accuracy",
            number(r.accuracy),
            "bound asked of each factor of a pair that is partly hidden; 10⁻⁴ of it for others",
        ),
        (
            "Largest stated error",
            number(r.largest_stated_error),
            if misses_accuracy(all) {
                "of a factor: the accuracy asked was NOT reached everywhere"
            } else {
                "of a factor: what was asked is reached"
            },
        ),
        ("Uncertainty", percent(r.uncertainty), "how much light changed from ten times looser factors; less is left"),
        ("Residual", number(r.residual), "of B by conjugate gradients, relative"),
        ("Reciprocity", number(r.reciprocity), "largest |A_i F_ij − A_j F_ji| over the smaller area"),
        ("Row sums", number(r.closure.rms), "root mean square difference from one; open scenes have it by right"),
        ("Time", duration(r.seconds), "for its factors"),
    ]);
    let direct = match all.has_direct_light {
        true => {
            " Light of lamps without area and of the sky arrives directly, found once and the same for all; it takes no part \
              in their errors."
        }
        false => "",
    };
    let audit = &all.truth.constant;
    let words = note(&format!(
        "The reference is the same equation on the same elements, with the factors of <code>adaptive</code>; errors of methods \
         and solvers are against it, so that the mesh is no part of them. What the mesh costs is told by a path tracer that \
         shares nothing with them but rays, at {} with two estimates of about {} each. Elements are whole, also where they reach \
         into solids; the engine by itself leaves these parts out. All factors are solved with by \
         <code>{}</code>.{direct}",
        plural(audit.points, "place"),
        plural(audit.paths as usize, "path"),
        all.trial_solver,
    ));
    section("What it is compared with", &(cards + &words))
}

fn origin(account: &Account) -> String {
    let row = |name: &str, value: String| format!("<div><dt>{name}</dt><dd>{value}</dd></div>");
    let command: Vec<String> = account.command.iter().map(|word| escape(&quoted(word))).collect();
    let rows = [
        row("Command line", format!("<code>{}</code>", command.join(" "))),
        row("Scene", format!("<code>{}</code>", escape(&account.scene))),
        row("Program", format!("{} {}", account.program, account.version)),
        row(
            "Threads",
            format!("{}; times are wall-clock and depend on the machine, numbers do not", count(account.threads)),
        ),
    ];
    section("How it was made", &format!("<dl class=\"origin\">{}</dl>", rows.concat()))
}
