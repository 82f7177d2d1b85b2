//! How far to trust it: convergence, energy balance, how well the equation is solved, what it cost.

use super::markup::{
    bars, cards, count, duration, escape, named, note, number, percent, section, share, table, with_unit,
};
use super::plot;
use crate::figures;
use crate::report::Report;
use radiosity::{Bands, luminance};

const BANDS: [&str; 3] = ["Red", "Green", "Blue"];

/// The rounds of refinement.
pub fn convergence(report: &Report) -> String {
    let rows: Vec<Vec<String>> = report
        .rounds
        .iter()
        .enumerate()
        .map(|(i, r)| {
            let found = [percent(r.error), percent(r.upper), duration(r.seconds)];
            let with = [count(r.elements), count(r.rays), count(r.shadow_rays as usize)];
            [&[count(i + 1)][..], &found, &with].concat()
        })
        .collect();
    let head = ["Round", "Estimated error", "Upper bound", "After", "Elements", "Rays per cell", "Shadow rays"];
    let body = match rows.len() {
        0 => "<p>No round was completed.</p>".to_owned(),
        _ => plot::convergence(&report.rounds, report.error.asked) + &table(&head, &rows),
    };
    let words = note(
        "Each round refines the solution and audits it again (the verdict above is about the light as it is written), until the upper bound (one-sided, 95 %) meets the asked \
         error, or rounds or memory end. Both scales are logarithmic. A bound far above its estimate means that the \
         audit, not the answer, is coarse; an estimate of zero, drawn hollow on the lower edge, is below what the \
         audit can resolve.",
    );
    section("Convergence", &(body + &words))
}

/// A term of the energy balance.
struct Term {
    name: &'static str,
    color: &'static str,
    flux: Bands,
    meaning: &'static str,
}

/// The first three come in, the others go out.
fn terms(report: &Report) -> [Term; 6] {
    let b = &report.balance;
    let term = |name, color, flux, meaning| Term { name, color, flux, meaning };
    [
        term("Emitted", "c1", b.emitted, figures::EMITTED),
        term("From point lights", "c2", b.from_point_lights, figures::FROM_POINT_LIGHTS),
        term("From the sky", "c3", b.from_sky, figures::FROM_SKY),
        term("Absorbed", "c4", b.absorbed, figures::ABSORBED),
        term("Escaped", "c5", b.escaped, figures::ESCAPED),
        term("Lost on backs", "c6", b.lost_on_backs, figures::LOST_ON_BACKS),
    ]
}

/// Where the light goes.
pub fn balance(report: &Report) -> String {
    let terms = terms(report);
    let flux = |name: String, v: Bands| {
        let cells = [luminance(v), v[0], v[1], v[2]].map(|x| number(f64::from(x)));
        [&[name][..], &cells].concat()
    };
    let sum = |terms: &[Term]| -> Bands { std::array::from_fn(|band| terms.iter().map(|t| t.flux[band]).sum()) };
    let sides = [("In", &terms[..3]), ("Out", &terms[3..])];
    let mut rows = Vec::new();
    for (name, side) in sides {
        let key = |t: &Term| named(&format!("<i class=\"{}\"></i>{}", t.color, t.name), t.meaning);
        rows.extend(side.iter().map(|t| flux(key(t), t.flux)));
        rows.push(flux(format!("<b>{name} together</b>"), sum(side)));
    }
    let [total_in, total_out] = sides.map(|(_, side)| f64::from(luminance(sum(side))));
    let defects = report.balance.defect.map(percent);
    let defect = percent((total_in - total_out) / total_in);
    rows.push([&[named("<b>Defect</b>", figures::DEFECT), defect][..], &defects].concat());
    let largest = if total_in > total_out { total_in } else { total_out };
    let bar = |(name, side): (&str, &[Term])| {
        let parts: Vec<(&str, f64)> = side.iter().map(|t| (t.color, f64::from(luminance(t.flux)) / largest)).collect();
        let total = f64::from(luminance(sum(side)));
        (name.to_owned(), plot::bar(&parts), vec![with_unit(total, "lm")])
    };
    let head = ["Flux, lm", "Luminous", BANDS[0], BANDS[1], BANDS[2]];
    let words = note(
        "Light that enters the scene must leave it. Luminous flux weights the colour bands as the eye does; each band is \
         in lumens for a flux of that band alone. A defect that does not shrink with more rays is a fault of the method.",
    );
    section("Energy balance", &format!("{}{}{words}", bars(sides.map(bar)), table(&head, &rows)))
}

/// How well the equation is solved.
pub fn solution(report: &Report) -> String {
    let s = &report.solution;
    let bands = |values: &[f64]| [0, 1, 2].map(|i| number(values.get(i).copied().unwrap_or(f64::NAN)));
    let row = |name: &str, meaning: &str, values: &[f64]| [&[named(name, meaning)][..], &bands(values)].concat();
    let partly = if s.partly_buried > 0 { format!("; {} more in part", count(s.partly_buried)) } else { String::new() };
    let buried = format!("{}{partly}", figures::BURIED);
    let elements = format!("{}, up to {} wide", figures::ELEMENTS, with_unit(s.element_size, "m"));
    let cards = cards(&[
        ("Raw closure", number(s.raw_closure), figures::CLOSURE),
        ("Elements", count(s.elements), &elements),
        ("Rays", count(s.rays_per_cell), figures::RAYS),
        ("Steps", count(s.steps), figures::STEPS),
        ("Buried", count(s.buried), &buried),
    ]);
    let rows = [
        row("Residual", figures::RESIDUAL, &s.relative_residual),
        row("Guaranteed bound", figures::BOUND, &s.guaranteed_bound),
    ];
    let words = note(
        "These say how well the equation over the elements is solved. What elements and rays themselves do to the answer \
         is the audit's to say. All of it follows from the scene and the settings, on any number of threads.",
    );
    section("Solution", &(cards + &table(&["", BANDS[0], BANDS[1], BANDS[2]], &rows) + &words))
}

/// What it cost.
pub fn work(report: &Report) -> String {
    let time = &report.time;
    let known = |s: f64| if s.is_finite() { s.max(0.0) } else { 0.0 };
    let sum: f64 = time.stages.iter().map(|s| known(s.seconds)).sum();
    let total = known(time.seconds).max(sum);
    let row = |stage: &crate::report::StageReport| {
        let part = stage.seconds / total;
        (escape(&stage.name), plot::bar(&[("c2", part)]), vec![duration(stage.seconds), share(part)])
    };
    let memory = report.peak_memory_mb.unwrap_or(f64::NAN);
    let cards = cards(&[
        ("Time", duration(time.seconds), figures::SECONDS),
        ("Threads", count(time.threads), figures::THREADS),
        ("Peak memory", with_unit(memory, "MB"), figures::MEMORY),
    ]);
    let words = note(
        "Time by stage, in the order of first use. “audit” is the time of the check, which is no part of the \
                      answer.",
    );
    section("Time and memory", &(cards + &bars(time.stages.iter().map(row)) + &words))
}
