//! The report as a page: one file that needs nothing else. Styles are inline, pictures are data addresses, plots are
//! drawn here as SVG, and a content policy in its head forbids the browser to fetch anything.
//!
//! Figures that do not exist (an infinite bound, a time that is not a number) are called unknown and are left out of
//! the plots. All text from outside is escaped.

use crate::report::{LightmapReport, Report};
use base64::Engine;
use radiosity::measure::Round;
use radiosity::{Audit, Bands, Severity, luminance};

const BANDS: [&str; 3] = ["Red", "Green", "Blue"];
/// Two-sided 95 % quantile of the normal distribution, for the interval of the bias.
const TWO_SIDED_95: f64 = 1.96;

/// A self-contained HTML page; `pictures` are titles and PNG bytes.
pub fn page(report: &Report, pictures: &[(String, Vec<u8>)]) -> String {
    let scene = escape(&report.scene);
    let body = [
        verdict(report),
        gallery(pictures),
        illuminance(report),
        convergence(report),
        balance(report),
        solver(report),
        work(report),
        report.lightmap.as_ref().map(lightmap).unwrap_or_default(),
        faults(report),
        outputs(report),
    ]
    .concat();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <meta name=\"color-scheme\" content=\"light dark\">\
         <meta http-equiv=\"Content-Security-Policy\" \
         content=\"default-src 'none'; img-src data:; style-src 'unsafe-inline'\">\
         <title>Light in {scene}</title><style>{STYLE}</style></head>\n<body><main>\
         <header><p class=\"eyebrow\">Lighting report</p><h1>{scene}</h1><p class=\"quiet\">{}</p></header>\
         {body}<footer>{}</footer></main></body></html>\n",
        scene_facts(report),
        escape(&report.program),
    )
}

fn scene_facts(report: &Report) -> String {
    let lights = match report.lights.len() {
        0 => "no lights".to_owned(),
        n => format!("{}: {}", plural(n, "light"), escape(&report.lights.join(", "))),
    };
    format!(
        "{}, {} m² of surface, {}, {lights}",
        plural(report.triangles, "triangle"),
        number(report.area),
        plural(report.materials, "material")
    )
}

fn verdict(report: &Report) -> String {
    let (audit, asked) = (&report.audit, report.asked_error);
    // The flag and the figures must agree before the page says so.
    let achieved = report.achieved && audit.upper <= asked;
    let (class, title) = match achieved {
        true => ("good", "The asked error is achieved"),
        false => ("bad", "The asked error is NOT achieved"),
    };
    let reason = if audit.points == 0 || !audit.upper.is_finite() {
        "The audit could not bound the error, so this answer is not certified.".to_owned()
    } else if achieved {
        format!("With 95 % confidence the illuminance is wrong by no more than {}.", percent(audit.upper))
    } else if audit.error > asked {
        "The estimated error itself is larger than asked. Allow more rays, smaller elements or more rounds.".to_owned()
    } else {
        "The estimate meets the asked error, but the audit cannot exclude a larger one. Allow more rounds, or audit \
         more points."
            .to_owned()
    };
    let between = match audit.points {
        0 => "no point was audited".to_owned(),
        _ => format!("95 % limits: {} to {}", percent(audit.lower), percent(audit.upper)),
    };
    let estimate = if audit.points == 0 { f64::NAN } else { audit.error };
    let (bias, bias_note) = bias(audit);
    let cards = cards(&[
        ("Asked error", percent(asked), "relative, all surfaces together".to_owned()),
        ("Estimated error", percent(estimate), between),
        ("Bias", bias, bias_note),
        ("Time", duration(report.seconds), format!("on {}", plural(report.threads, "thread"))),
    ]);
    let troubles = report.faults.0.iter().filter(|f| f.severity != Severity::Note).count();
    let troubles = match troubles {
        0 => String::new(),
        n => format!(" <a href=\"#faults\">The input has {}.</a>", plural(n, "fault")),
    };
    format!(
        "<section class=\"verdict {class}\"><h2>{title}</h2><p class=\"lead\">{reason}{troubles}</p>{}{cards}{}</section>",
        gauge(audit, asked),
        explain(&format!(
            "<p>An independent referee traced paths through the original scene at {}, {} per estimate and two \
             estimates per point. It shares neither elements nor solver with the answer, so its error covers \
             everything: elements, rays, solver, interpolation and leaks of light. The error is the root mean square \
             difference of illuminance, divided by the root mean square illuminance.</p>\
             <p>Each limit holds by itself with 95 % confidence, both together with 90 %. The bias is the mean \
             difference over the mean illuminance; its interval holds with 95 %. <b>To repeat:</b> run again with \
             another seed; the new limits should nearly always overlap these.</p>",
            plural(audit.points, "point"),
            plural(audit.paths as usize, "path"),
        )),
    )
}

/// The bias with its interval, and what it means.
fn bias(audit: &Audit) -> (String, String) {
    let half = TWO_SIDED_95 * audit.bias_error;
    if audit.points == 0 || !audit.bias.is_finite() || !half.is_finite() {
        return ("unknown".to_owned(), String::new());
    }
    let sign = if audit.bias > 0.0 { "+" } else { "" };
    let meaning = match () {
        () if audit.bias.abs() <= half => "too small to tell from none",
        () if audit.bias > 0.0 => "on average too bright",
        () => "on average too dark",
    };
    (format!("{sign}{}", percent(audit.bias)), format!("± {}; {meaning}", percent(half)))
}

/// The audit's interval on a scale from zero, with the asked error as a mark.
fn gauge(audit: &Audit, asked: f64) -> String {
    let top = [audit.error, audit.upper, asked].into_iter().filter(|x| x.is_finite()).fold(0.0, f64::max) * 1.2;
    if audit.points == 0 || !(top > 0.0 && audit.error.is_finite()) {
        return String::new();
    }
    let x = |v: f64| if v.is_finite() { 10.0 + 700.0 * (v / top).clamp(0.0, 1.0) } else { 710.0 };
    let (lower, upper, error) = (x(audit.lower.max(0.0)), x(audit.upper), x(audit.error));
    let mark = if asked > 0.0 && asked.is_finite() {
        let x = x(asked);
        format!(
            "<path class=\"asked\" d=\"M{x:.1} 22V58\"/><text x=\"{x:.1}\" y=\"16\" text-anchor=\"middle\">asked {}</text>",
            percent(asked)
        )
    } else {
        String::new()
    };
    format!(
        "<svg viewBox=\"0 0 720 78\" role=\"img\" aria-label=\"Audit\"><path class=\"axis\" d=\"M10 58H710\"/>\
         <rect class=\"interval\" x=\"{lower:.1}\" y=\"30\" width=\"{:.1}\" height=\"20\" rx=\"4\"/>\
         <circle class=\"dot\" cx=\"{error:.1}\" cy=\"40\" r=\"6\"/>{mark}\
         <text x=\"10\" y=\"74\">0</text><text x=\"710\" y=\"74\" text-anchor=\"end\">error {}</text></svg>",
        (upper - lower).max(2.0),
        percent(top)
    )
}

fn gallery(pictures: &[(String, Vec<u8>)]) -> String {
    if pictures.is_empty() {
        return String::new();
    }
    let figure = |(title, png): &(String, Vec<u8>)| {
        let (title, data) = (escape(title), base64::engine::general_purpose::STANDARD.encode(png));
        format!(
            "<figure><img alt=\"{title}\" src=\"data:image/png;base64,{data}\"><figcaption>{title}</figcaption></figure>"
        )
    };
    format!("<section class=\"gallery\">{}</section>", pictures.iter().map(figure).collect::<String>())
}

fn illuminance(report: &Report) -> String {
    let [least, mean, most] = report.illuminance.map(f64::from);
    let lux = |x: f64| with_unit(x, "lx");
    let body = cards(&[
        ("Least", lux(least), "darkest element".to_owned()),
        ("Mean", lux(mean), "of all elements".to_owned()),
        ("Largest", lux(most), "brightest element".to_owned()),
        ("Least : mean", number(least / mean), "over all surfaces, not a task area".to_owned()),
    ]);
    let words = format!(
        "<p>Illuminance of the elements, all surfaces together. The referee's own mean at its points is {}. \
         <b>To repeat:</b> extremes depend on the size of the elements, {}; the mean hardly does.</p>",
        lux(if report.audit.points == 0 { f64::NAN } else { report.audit.mean_illuminance }),
        with_unit(report.element_size, "m"),
    );
    section("Illuminance", &(body + &explain(&words)))
}

fn convergence(report: &Report) -> String {
    let rows: Vec<Vec<String>> = report
        .rounds
        .iter()
        .enumerate()
        .map(|(i, r)| {
            let gather = if r.gather == 0 { "interpolated".to_owned() } else { count(r.gather) };
            let cells = [count(i + 1), count(r.elements), count(r.rays), gather, count(r.shadow_rays as usize)];
            [&cells[..], &[percent(r.error), percent(r.upper), duration(r.seconds)]].concat()
        })
        .collect();
    let head = ["Round", "Elements", "Rays", "Gather rays", "Shadow rays", "Error", "Upper bound", "Time"];
    let body = match rows.len() {
        0 => "<p>No round was completed.</p>".to_owned(),
        _ => plot(&report.rounds, report.asked_error) + &table(&head, &rows),
    };
    let words = "<p>Each round refines the answer and audits it again, until the upper bound (95 %) meets the asked \
        error or the rounds are used up. Both scales are logarithmic. A bound far above its estimate means that the \
        audit, not the answer, is coarse. An estimate of zero means: below what the audit can resolve; it is drawn \
        hollow on the lower edge, and bounds that are unknown are not drawn. <b>To repeat:</b> ask for half the error \
        and compare the times.</p>";
    section("Convergence", &(body + &explain(words)))
}

/// Error and upper bound against seconds, both logarithmic.
fn plot(rounds: &[Round], asked: f64) -> String {
    const LEFT: f64 = 70.0;
    const RIGHT: f64 = 700.0;
    const TOP: f64 = 34.0;
    const BOTTOM: f64 = 290.0;
    // A clock does not resolve less than a millisecond usefully; zero has no logarithm.
    let time = |r: &Round| if r.seconds.is_finite() { r.seconds.max(1e-3) } else { f64::NAN };
    let errors = rounds.iter().flat_map(|r| [r.error, r.upper]).chain([asked]);
    let (Some((x0, x1)), Some((y0, y1))) = (log_range(rounds.iter().map(time)), log_range(errors)) else {
        return String::new();
    };
    let x = |v: f64| LEFT + (RIGHT - LEFT) * (v.log10() - x0) / (x1 - x0);
    let y = |v: f64| BOTTOM - (BOTTOM - TOP) * (v.log10() - y0) / (y1 - y0);
    let mut out = String::new();
    for v in ticks(x0, x1) {
        let (x, label) = (x(v), number(v));
        out += &format!("<path class=\"grid\" d=\"M{x:.1} {TOP}V{BOTTOM}\"/>");
        out += &format!("<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{label}</text>", BOTTOM + 18.0);
    }
    for v in ticks(y0, y1) {
        let (y, label) = (y(v), percent(v));
        out += &format!("<path class=\"grid\" d=\"M{LEFT} {y:.1}H{RIGHT}\"/>");
        out += &format!("<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{label}</text>", LEFT - 8.0, y + 4.0);
    }
    out += &format!("<path class=\"axis\" d=\"M{LEFT} {TOP}V{BOTTOM}H{RIGHT}\"/>");
    if asked > 0.0 && asked.is_finite() {
        let y = y(asked);
        out += &format!("<path class=\"asked\" d=\"M{LEFT} {y:.1}H{RIGHT}\"/>");
    }
    let timed: Vec<&Round> = rounds.iter().filter(|r| time(r).is_finite()).collect();
    for (class, value) in [("upper", &(|r: &Round| r.upper) as &dyn Fn(&Round) -> f64), ("error", &|r| r.error)] {
        let drawn = |r: &&&Round| value(r) > 0.0 && value(r).is_finite();
        let points: Vec<[f64; 2]> = timed.iter().filter(drawn).map(|r| [x(time(r)), y(value(r))]).collect();
        let path: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
        if path.len() > 1 {
            out += &format!("<path class=\"line {class}\" d=\"M{}\"/>", path.join("L"));
        }
        for [x, y] in points {
            out += &format!("<circle class=\"dot {class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4.5\"/>");
        }
        for r in timed.iter().filter(|r| value(r) == 0.0) {
            out += &format!("<circle class=\"hollow {class}\" cx=\"{:.1}\" cy=\"{BOTTOM}\" r=\"4.5\"/>", x(time(r)));
        }
    }
    format!(
        "<svg viewBox=\"0 0 720 332\" role=\"img\" aria-label=\"Error against time\">{out}\
         <circle class=\"dot error\" cx=\"76\" cy=\"14\" r=\"4.5\"/><text x=\"86\" y=\"18\">estimated error</text>\
         <circle class=\"dot upper\" cx=\"206\" cy=\"14\" r=\"4.5\"/><text x=\"216\" y=\"18\">upper bound (95 %)</text>\
         <path class=\"asked\" d=\"M358 14H382\"/><text x=\"390\" y=\"18\">asked error</text>\
         <text x=\"385\" y=\"326\" text-anchor=\"middle\">seconds since the start</text>\
         <text transform=\"translate(14 162) rotate(-90)\" text-anchor=\"middle\">relative error</text></svg>"
    )
}

/// Decimal logarithms of a range that holds all positive finite values with a margin, and is at least a decade wide.
fn log_range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let logs = values.filter(|v| *v > 0.0 && v.is_finite()).map(f64::log10);
    let (low, high) = logs.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
    let margin = (0.5 * (1.0 - (high - low))).max(0.12);
    (low <= high).then_some((low - margin, high + margin))
}

/// Round values between two decimal logarithms: 1, 2, 5 in each decade, or whole decades where those would crowd.
fn ticks(low: f64, high: f64) -> Vec<f64> {
    let stride = ((high - low) / 6.0).ceil().max(1.0) as usize;
    let steps: &[f64] = if high - low <= 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let decades = (low.floor() as i32..=high.ceil() as i32).step_by(stride);
    let all = decades.flat_map(|d| steps.iter().map(move |s| s * 10f64.powi(d)));
    all.filter(|v| (low..=high).contains(&v.log10())).collect()
}

/// The terms of the energy balance: name, colour, values; the first three come in, the others go out.
fn balance_terms(report: &Report) -> [(&'static str, &'static str, Bands); 6] {
    let b = &report.balance;
    [
        ("Emitted by surfaces", "c1", b.emitted),
        ("From point lights", "c2", b.from_point_lights),
        ("From the sky", "c3", b.from_sky),
        ("Absorbed", "c4", b.absorbed),
        ("Escaped", "c5", b.escaped),
        ("Lost on backs", "c6", b.lost_on_backs),
    ]
}

fn balance(report: &Report) -> String {
    let terms = balance_terms(report);
    let flux = |name: &str, v: Bands| {
        let cells = v.map(|x| number(f64::from(x)));
        [&[name.to_owned()][..], &cells, &[number(f64::from(luminance(v)))]].concat()
    };
    let sum = |terms: &[(&str, &str, Bands)]| std::array::from_fn(|band| terms.iter().map(|t| t.2[band]).sum());
    let mut rows = Vec::new();
    for (name, side) in [("In", &terms[..3]), ("Out", &terms[3..])] {
        let named = |(name, colour, v): &(&str, &str, Bands)| flux(&format!("<i class=\"{colour}\"></i>{name}"), *v);
        rows.extend(side.iter().map(named));
        rows.push(flux(&format!("<b>{name} together</b>"), sum(side)));
    }
    let [total_in, total_out]: [Bands; 2] = [sum(&terms[..3]), sum(&terms[3..])];
    let total = f64::from(luminance(total_in));
    let defect = (total - f64::from(luminance(total_out))) / total;
    let defects = report.balance.defect.map(percent);
    rows.push([&["<b>Defect</b>".to_owned()][..], &defects, &[percent(defect)]].concat());
    let largest = total_in.iter().chain(&total_out).filter(|x| x.is_finite()).fold(0f32, |a, x| a.max(*x));
    let bars: String = (0..3)
        .flat_map(|band| [("in", &terms[..3]), ("out", &terms[3..])].map(|(side, terms)| (band, side, terms)))
        .map(|(band, side, terms)| {
            let parts: Vec<(&str, f64)> = terms.iter().map(|t| (t.1, f64::from(t.2[band] / largest))).collect();
            format!("<tr><th>{} {side}</th><td class=\"wide\">{}</td></tr>", BANDS[band], bar(&parts))
        })
        .collect();
    let words = "<p>Light that enters the scene must leave it: absorbed by surfaces, escaped to the outside, or lost \
        on the black backs of one-sided surfaces. The defect is what is missing of it, (in − out)/in, before any \
        repair; below zero, more leaves than enters. It is sampling noise and must shrink with the rays; a defect \
        that stays is a fault of the method. Values are lumens (watts if the scene is given in watts) for a flux of \
        that band alone; the last column weights the bands by their luminance. <b>To repeat:</b> run with four times \
        the rays.</p>";
    let head = ["Flux", BANDS[0], BANDS[1], BANDS[2], "Luminous"];
    section("Energy balance", &format!("<table class=\"bars\">{bars}</table>{}{}", table(&head, &rows), explain(words)))
}

fn solver(report: &Report) -> String {
    let band = |values: &[f64], i: usize| number(values.get(i).copied().unwrap_or(f64::NAN));
    let row =
        |name: &str, values: &[f64]| [name.to_owned(), band(values, 0), band(values, 1), band(values, 2)].to_vec();
    let rows =
        [row("Relative residual", &report.solver.residual), row("Guaranteed bound, lm/m²", &report.solver.bound)];
    let cards = cards(&[
        ("Raw closure", number(report.raw_closure), "largest row sum's distance from one".to_owned()),
        ("Steps", count(report.solver.steps), "applications of the transport".to_owned()),
        ("Elements", count(report.elements), format!("{} wide", with_unit(report.element_size, "m"))),
        ("Rays", count(report.rays_per_element), "per element".to_owned()),
        ("Buried", count(report.buried[0]), format!("inside solids; {} more in part", count(report.buried[1]))),
    ]);
    let words = "<p><b>Raw closure:</b> the form factors of an element, with sky and outside, sum to one; shown is \
        the worst row before any repair. <b>Residual:</b> what the solved equation still lacks, relative to its \
        right-hand side. <b>Guaranteed bound:</b> no element's radiosity differs by more from the exact solution of \
        the discrete equation; it says nothing of the elements or rays themselves, for which the audit answers. \
        <b>Buried</b> elements lie inside other solids and take no part in the light. <b>To repeat:</b> all of \
        these follow from the scene and the settings, on any number of threads.</p>";
    section("Solution", &(cards + &table(&["", BANDS[0], BANDS[1], BANDS[2]], &rows) + &explain(words)))
}

fn work(report: &Report) -> String {
    let known = |s: f64| if s.is_finite() { s.max(0.0) } else { 0.0 };
    let sum: f64 = report.stages.iter().map(|s| known(s.1)).sum();
    let total = known(report.seconds).max(sum);
    let rest = ("everything else".to_owned(), total - sum);
    let rest = (rest.1 > 0.005 * total).then_some(rest);
    let rows: String = report
        .stages
        .iter()
        .chain(rest.as_ref())
        .map(|(name, seconds)| {
            let share = seconds / total;
            format!(
                "<tr><th>{}</th><td class=\"wide\">{}</td><td>{}</td><td>{}</td></tr>",
                escape(name),
                bar(&[("c2", share)]),
                duration(*seconds),
                if share.is_finite() { format!("{:.1} %", 100.0 * share) } else { "unknown".to_owned() }
            )
        })
        .collect();
    let memory = if report.peak_memory_mb > 0.0 { report.peak_memory_mb } else { f64::NAN };
    let cards = cards(&[
        ("Time", duration(report.seconds), "in all".to_owned()),
        ("Threads", count(report.threads), String::new()),
        ("Memory", with_unit(memory, "MB"), "peak of the process".to_owned()),
    ]);
    let words = "<p>Wall-clock time by stage, in the order of first use, as shares of the whole. <b>To repeat:</b> \
        times vary with the machine and its other work; the answer does not depend on the number of threads.</p>";
    section("Time and memory", &format!("{cards}<table class=\"bars\">{rows}</table>{}", explain(words)))
}

fn lightmap(map: &LightmapReport) -> String {
    let pages: Vec<String> = map.pages.iter().map(|[w, h]| format!("{w} × {h}")).collect();
    let cards = cards(&[
        ("Density", with_unit(map.density, "/m"), "texels per metre".to_owned()),
        ("Texels", count(map.texels), "computed".to_owned()),
        ("Pages", count(map.pages.len()), pages.join(", ")),
        ("Seams", with_unit(map.seams_after, "lx"), format!("{} before fitting", with_unit(map.seams_before, "lx"))),
    ]);
    let words = "<p>A lightmap cuts the surfaces into charts. Seams: root mean square difference of illuminance \
        across the edges where charts meet on one smooth surface; fitting makes both sides agree there. \
        <b>To repeat:</b> twice the density should lessen the difference before fitting.</p>";
    section("Lightmap", &(cards + &explain(words)))
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

fn outputs(report: &Report) -> String {
    let items: String = report.outputs.iter().map(|o| format!("<li><code>{}</code></li>", escape(o))).collect();
    let body = if items.is_empty() { "<p>No file was written.</p>".to_owned() } else { format!("<ul>{items}</ul>") };
    section("Files written", &body)
}

fn section(title: &str, body: &str) -> String {
    format!("<section><h2>{title}</h2>{body}</section>")
}

fn explain(words: &str) -> String {
    format!("<div class=\"explain\">{words}</div>")
}

/// Figures in a row: name, value, note.
fn cards(cards: &[(&str, String, String)]) -> String {
    let card = |(name, value, note): &(&str, String, String)| {
        format!("<div><dt>{name}</dt><dd>{value}</dd><dd class=\"quiet\">{note}</dd></div>")
    };
    format!("<dl class=\"cards\">{}</dl>", cards.iter().map(card).collect::<String>())
}

/// A table of ready markup; the first column names the row.
fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let head: String = head.iter().map(|h| format!("<th scope=\"col\">{h}</th>")).collect();
    let row = |r: &Vec<String>| {
        let cells: String = r[1..].iter().map(|c| format!("<td>{c}</td>")).collect();
        format!("<tr><th scope=\"row\">{}</th>{cells}</tr>", r[0])
    };
    let rows: String = rows.iter().map(row).collect();
    format!("<div class=\"scroll\"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>")
}

/// A stacked bar of parts of one: class and share.
fn bar(parts: &[(&str, f64)]) -> String {
    let mut x = 0.0;
    let mut rects = String::new();
    for (class, share) in parts.iter().filter(|p| p.1 > 0.0 && p.1.is_finite()) {
        let width = (1000.0 * share).min(1000.0 - x);
        rects += &format!("<rect class=\"{class}\" x=\"{x:.1}\" width=\"{width:.1}\" height=\"10\"/>");
        x += width;
    }
    format!(
        "<svg class=\"bar\" viewBox=\"0 0 1000 10\" preserveAspectRatio=\"none\" aria-hidden=\"true\">{rects}</svg>"
    )
}

fn escape(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    text.replace('"', "&quot;").replace('\'', "&#39;")
}

/// A count with its noun.
fn plural(n: usize, noun: &str) -> String {
    format!("{} {noun}{}", count(n), if n == 1 { "" } else { "s" })
}

/// A whole number with narrow spaces between thousands.
fn count(n: usize) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(digit);
    }
    out
}

/// Three significant digits, as a power of ten where that reads better; unknown if not finite.
fn number(x: f64) -> String {
    if !x.is_finite() {
        return "unknown".to_owned();
    }
    let sign = if x < 0.0 { "−" } else { "" };
    let size = x.abs();
    let rounded: f64 = format!("{size:.2e}").parse().unwrap_or(size);
    match rounded {
        0.0 => "0".to_owned(),
        1e-3..1e3 => format!("{sign}{rounded}"),
        1e3..1e9 => format!("{sign}{}", count(size.round() as usize)),
        _ => {
            let rounded = if rounded.is_finite() { rounded } else { size };
            let text = format!("{rounded:e}");
            let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
            let raise = |c: char| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(c.to_digit(10).unwrap_or(0) as usize).unwrap_or('⁰');
            let power: String = power.chars().map(|c| if c == '-' { '⁻' } else { raise(c) }).collect();
            format!("{sign}{digits} × 10{power}")
        }
    }
}

fn with_unit(x: f64, unit: &str) -> String {
    if x.is_finite() { format!("{}\u{a0}{unit}", number(x)) } else { number(x) }
}

fn percent(x: f64) -> String {
    with_unit(100.0 * x, "%")
}

fn duration(seconds: f64) -> String {
    match seconds {
        s if (120.0..1e9).contains(&s) => format!("{} min {:02} s", count(s as usize / 60), s as usize % 60),
        s if s > 0.0 && s < 1.0 => with_unit(1e3 * s, "ms"),
        s => with_unit(s, "s"),
    }
}

/// Light and dark, screen and paper.
const STYLE: &str = "
:root{--page:#f6f5f2;--card:#fff;--text:#1d2126;--quiet:#626a73;--line:#dcd9d2;--good:#1c7c4a;--bad:#b3261e;--warn:#a86400;--error:#1f5fae;--upper:#c2571a;--c1:#e2a929;--c2:#3f7fc4;--c3:#6fc3d4;--c4:#8a8178;--c5:#9a78c2;--c6:#c8504b}
@media(prefers-color-scheme:dark){:root{--page:#14171a;--card:#1d2125;--text:#e8e6e1;--quiet:#9aa3ac;--line:#363c42;--good:#5cc98d;--bad:#ff8a80;--warn:#f2b552;--error:#7db4f5;--upper:#f0955a;--c1:#e2b34a;--c2:#5b97d8;--c3:#72bccb;--c4:#a39a90;--c5:#ab8dd1;--c6:#dd6b66}}
*{box-sizing:border-box;print-color-adjust:exact;-webkit-print-color-adjust:exact}
body{margin:0;background:var(--page);color:var(--text);font:16px/1.5 system-ui,'Segoe UI',Roboto,'Liberation Sans',sans-serif;overflow-wrap:anywhere}
main{max-width:66rem;margin:0 auto;padding:2rem 1.25rem}
header{margin-bottom:1.5rem}h1{font-size:2rem;line-height:1.2;margin:0 0 .4rem;font-weight:650}h2{font-size:1.2rem;margin:0 0 .8rem}
p{margin:.4rem 0}.eyebrow{text-transform:uppercase;letter-spacing:.1em;font-size:.75rem}.quiet,.eyebrow,footer{color:var(--quiet)}a{color:inherit}
section{background:var(--card);border:1px solid var(--line);border-radius:10px;padding:1.25rem 1.5rem;margin:0 0 1.25rem}
.verdict{border-left:8px solid var(--bad)}.verdict h2{font-size:1.6rem;margin:0;color:var(--bad)}.verdict.good{border-color:var(--good)}.verdict.good h2{color:var(--good)}.lead{font-size:1.05rem;margin-bottom:1rem}
.gallery{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,26rem),1fr));gap:1.25rem;background:none;border:0;padding:0}.gallery figure:first-child{grid-column:1/-1}
figure{margin:0;text-align:center}img{display:block;width:100%;height:auto;max-height:92vh;object-fit:contain;background:#000;border-radius:10px}figcaption{color:var(--quiet);font-size:.9rem;padding-top:.4rem}
.cards{display:grid;grid-template-columns:repeat(auto-fit,minmax(10.5rem,1fr));gap:1rem;margin:.5rem 0 1rem}.cards div{border-top:2px solid var(--line);padding-top:.4rem}
dt{color:var(--quiet);font-size:.85rem}dd{margin:0;font-size:1.45rem;font-weight:600;line-height:1.3}dd.quiet{font-size:.85rem;font-weight:400}
.scroll{overflow-x:auto}table{border-collapse:collapse;width:100%;margin:.75rem 0;font-size:.92rem;font-variant-numeric:tabular-nums}th{text-align:left;font-weight:500}thead th{color:var(--quiet);font-size:.85rem}th+th,td{text-align:right}td,th{padding:.3rem .5rem;border-bottom:1px solid var(--line);overflow-wrap:normal}
.bars td,.bars th{border:0;white-space:nowrap;padding:.2rem .5rem}.bars th{width:1%;padding-left:0}.bars td{width:1%}.bars td.wide{width:auto}
i{display:inline-block;width:.75em;height:.75em;border-radius:2px;margin-right:.5em}i.c1{background:var(--c1)}i.c2{background:var(--c2)}i.c3{background:var(--c3)}i.c4{background:var(--c4)}i.c5{background:var(--c5)}i.c6{background:var(--c6)}
svg{display:block;width:100%;height:auto}.bar{height:1rem;background:var(--page);border-radius:3px}rect.c1{fill:var(--c1)}rect.c2{fill:var(--c2)}rect.c3{fill:var(--c3)}rect.c4{fill:var(--c4)}rect.c5{fill:var(--c5)}rect.c6{fill:var(--c6)}
text{fill:var(--quiet);font-size:12.5px}path{fill:none}.grid{stroke:var(--line)}.axis{stroke:var(--quiet)}.asked{stroke:var(--good);stroke-width:2;stroke-dasharray:6 4}.interval{fill:var(--error);opacity:.3}.dot{fill:var(--error)}.dot.upper{fill:var(--upper)}.line,.hollow{stroke:var(--error);stroke-width:2}.line.upper,.hollow.upper{stroke:var(--upper)}.hollow{fill:var(--card)}
.explain{color:var(--quiet);font-size:.88rem;border-top:1px solid var(--line);margin-top:1rem;padding-top:.4rem}
.faults{list-style:none;padding:0;margin:0}.faults li{border-left:4px solid var(--quiet);padding:.3rem .8rem;margin:.6rem 0}.faults .error{border-color:var(--bad)}.faults .error b{color:var(--bad)}.faults .warning{border-color:var(--warn)}.faults .warning b{color:var(--warn)}.faults em{color:var(--quiet);font-style:normal}
code{font:.9em ui-monospace,'DejaVu Sans Mono',monospace}footer{text-align:center;font-size:.85rem}
@media print{:root{--page:#fff;--card:#fff;--text:#000;--quiet:#444;--line:#ccc;--good:#1c7c4a;--bad:#b3261e;--warn:#a86400;--error:#1f5fae;--upper:#c2571a}body{font-size:11pt}main{max-width:none;padding:0}section,figure,tr{break-inside:avoid}h2{break-after:avoid}img{max-height:20cm}.bar{background:none}}
";

#[cfg(test)]
mod tests {
    use super::*;
    use radiosity::{Balance, Faults};

    fn example(rounds: usize) -> Report {
        let round = |i: usize| {
            let seconds = 0.8 * 2.2f64.powi(i as i32);
            let (error, upper) = (0.05 / seconds.sqrt(), 0.06 / seconds.sqrt() + 0.002);
            Round { elements: 10_240, rays: 64 << i, gather: 256 << i, shadow_rays: 64, error, upper, seconds }
        };
        let rounds: Vec<Round> = (0..rounds).map(round).collect();
        let mut faults = Faults::default();
        faults.error("mesh 'A' <b>", "a triangle without area & \"more\"", "remove it");
        faults.warning("material 3", "reflectance 0.97 is high", "plaster reflects 0.8");
        faults.note("camera", "none given", "");
        let last = rounds.last();
        let (error, upper) = last.map_or((f64::NAN, f64::INFINITY), |r| (r.error, r.upper));
        let lower = 0.8 * error;
        let (bias, bias_error, points) = (-0.0021, 0.0006, last.map_or(0, |_| 1000));
        Report {
            program: "radiosity 0.1.0".to_owned(),
            scene: "office <script>.glb".to_owned(),
            triangles: 12_345,
            materials: 7,
            lights: vec!["ceiling & wall".to_owned(), "desk lamp".to_owned()],
            area: 164.2,
            asked_error: 0.01,
            achieved: upper <= 0.01,
            audit: Audit { points, paths: 256, error, upper, lower, bias, bias_error, mean_illuminance: 412.0 },
            rounds,
            elements: 10_240,
            element_size: 0.181,
            buried: [120, 34],
            rays_per_element: 2048,
            raw_closure: 2.2e-16,
            solver: radiosity::solve::Info { steps: 14, residual: vec![3.1e-6; 3], bound: vec![0.012, 0.011, 0.009] },
            balance: Balance {
                emitted: [5200.0, 5000.0, 4100.0],
                from_point_lights: [1200.0, 1300.0, 900.0],
                from_sky: [300.0, 400.0, 700.0],
                absorbed: [5900.0, 5800.0, 4900.0],
                escaped: [700.0, 800.0, 750.0],
                lost_on_backs: [60.0, 55.0, 40.0],
                defect: [0.006, 0.0067, 0.0018],
            },
            illuminance: [3.2, 412.0, 8210.0],
            stages: vec![("elements".to_owned(), 0.2), ("rays <&>".to_owned(), 14.0), ("audit".to_owned(), 20.0)],
            seconds: 41.5,
            threads: 16,
            peak_memory_mb: 812.0,
            outputs: vec!["out/<a>.png".to_owned()],
            lightmap: Some(LightmapReport {
                density: 16.0,
                texels: 42_000,
                pages: vec![[1024, 1024], [512, 256]],
                seams_before: 3.4,
                seams_after: 0.12,
            }),
            faults,
        }
    }

    fn sound(html: &str) {
        let words = |wrong: &str| html.split(|c: char| !c.is_alphanumeric()).any(|word| word == wrong);
        assert!(!words("NaN") && !words("inf") && !html.contains("url(") && !html.contains("@import"), "{html}");
        let addresses = html.split("src=\"").skip(1).chain(html.split("href=\"").skip(1));
        assert!(addresses.into_iter().all(|a| a.starts_with("data:image/png;base64,") || a.starts_with('#')));
        for tag in ["section", "table", "tr", "svg", "div", "ul", "li", "dl", "figure"] {
            let opened = html.matches(&format!("<{tag}>")).count() + html.matches(&format!("<{tag} ")).count();
            assert_eq!(opened, html.matches(&format!("</{tag}>")).count(), "{tag}");
        }
    }

    #[test]
    fn text_is_escaped_and_nothing_is_fetched() {
        let html = page(&example(6), &[("View <1> \"a\"".to_owned(), vec![1, 2, 3])]);
        sound(&html);
        assert!(!html.contains("<script") && !html.contains("<a>") && !html.contains("<1>") && !html.contains("<&>"));
        assert!(html.contains("src=\"data:image/png;base64,AQID\"") && html.contains("View &lt;1&gt; &quot;a&quot;"));
    }

    #[test]
    fn plots_hold_one_round_and_six() {
        for rounds in [1, 6] {
            let svg = plot(&example(rounds).rounds, 0.01);
            assert_eq!(svg.matches("<circle").count(), 2 * rounds + 2, "two of them in the legend");
            assert_eq!(svg.matches("<path class=\"line").count(), if rounds > 1 { 2 } else { 0 });
            sound(&page(&example(rounds), &[]));
        }
    }

    #[test]
    fn values_that_do_not_exist_are_unknown() {
        for value in [0.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN_POSITIVE] {
            let mut report = example(3);
            let few = value as f32;
            (report.area, report.asked_error, report.seconds, report.raw_closure) = (value, value, value, value);
            report.audit = Audit { error: value, upper: value, lower: value, bias: value, ..report.audit };
            report.balance = Balance { emitted: [few; 3], absorbed: [few; 3], defect: [value; 3], ..report.balance };
            (report.illuminance, report.stages[1].1, report.rounds[1].upper) = ([few; 3], value, value);
            (report.rounds[0].seconds, report.rounds[2].error, report.peak_memory_mb) = (value, value, value);
            sound(&page(&report, &[]));
        }
        let nothing = page(&example(0), &[]);
        sound(&nothing);
        assert!(nothing.contains("NOT achieved") && nothing.contains("unknown"));
    }

    #[test]
    fn verdict_follows_the_bound() {
        let mut report = example(6);
        assert!(page(&report, &[]).contains("NOT achieved"));
        (report.asked_error, report.achieved) = (0.05, true);
        assert!(!page(&report, &[]).contains("NOT achieved"));
        report.audit.upper = f64::INFINITY;
        assert!(page(&report, &[]).contains("NOT achieved"), "a flag without a bound convinces nobody");
    }

    #[test]
    fn numbers_read_well() {
        let expected = ["unknown", "0", "−0.00123", "12 346", "2.2 × 10⁻¹⁶", "1 000"];
        for (x, text) in [f64::INFINITY, -0.0, -0.001234, 12345.6, 2.2e-16, 999.9].into_iter().zip(expected) {
            assert_eq!(number(x).replace('\u{202f}', " "), text);
        }
        assert_eq!(duration(f64::NAN), "unknown");
        assert_eq!(duration(125.0), "2 min 05 s");
    }
}
