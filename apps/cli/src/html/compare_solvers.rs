//! Solvers on the page: residual and picture by work and by time, and who is ahead when.

use super::compare_plot::{Axes, Curve, Level, percent as power_percent, plot, power, seconds};
use super::markup::{count, duration, escape, named, note, number, percent, section, table};
use radiosity::compare::{Comparison, Crossing, Family, Lead, March, Mark};

/// Least error and residual shown: below, nobody sees or needs anything.
const LEAST_DISPLAYED: f64 = 1e-5;
const LEAST_RESIDUAL: f64 = 1e-8;

/// One step of 8 bits.
const STEP: f64 = 1.0 / 255.0;

/// Colour of a family.
fn color(family: Family) -> &'static str {
    match family {
        Family::Gathering => "k1",
        Family::Shooting => "k2",
        Family::Krylov => "k3",
        Family::Direct => "k4",
        Family::Random => "k5",
    }
}

/// The curves of all solvers that ran.
fn curves(all: &Comparison, point: impl Fn(&Mark) -> [f64; 2]) -> Vec<Curve> {
    let curve = |march: &March| Curve {
        name: march.solver.to_owned(),
        color: color(march.family),
        points: march.marks.iter().map(&point).collect(),
        dotted: march.marks.len() == 1,
    };
    all.marches.iter().map(curve).collect()
}

/// When shooting beats gathering, in two or three sentences.
pub fn take_away(all: &Comparison) -> Option<[String; 2]> {
    let early = all.leads.first().filter(|lead| of(lead, Family::Shooting).is_some())?;
    let shooting = of(early, Family::Shooting)?;
    let gathering = of(early, Family::Gathering);
    let mut text = format!(
        "After {} of a sweep <code>{}</code> shows a picture that is {} off, of full white",
        number(early.work),
        shooting.0,
        percent(shooting.1)
    );
    if let Some((solver, error)) = gathering {
        text +=
            &format!("; gathering (<code>{solver}</code>) has nothing but the lamps by then, {} off", percent(error));
    }
    text += ". ";
    text += &all.leads.iter().skip(1).map(lead).collect::<Vec<_>>().join(" ");
    let rivals = all.crossings.iter().find(|c| c.late == "gauss-seidel");
    let loses_by_time = rivals.is_some_and(|c| c.seconds.is_some() && c.work.is_none_or(|work| work > 1.0));
    if let Some(c) = rivals {
        text += &format!(" {}", crossing(c));
        if loses_by_time {
            text += " So shooting beats gathering by work and not by time: on stored factors a sweep runs through memory in \
                     order and a shot does not. Where factors are made as they are needed, work is time.";
        }
    }
    let last = all.leads.last().and_then(|lead| lead.ranks.first()).map(|best| best.0);
    let head = match last {
        None | Some(Family::Shooting) => "Shooting has the picture first, and keeps ahead.".to_owned(),
        Some(family) if loses_by_time => {
            format!("Shooting has the picture first by work, not by time; {} has the last digits.", family.name())
        }
        Some(family) => format!("Shooting has the picture first, {} the last digits.", family.name()),
    };
    Some([head, text])
}

fn of(lead: &Lead, family: Family) -> Option<(&'static str, f64)> {
    lead.ranks.iter().find(|rank| rank.0 == family).map(|rank| (rank.1, rank.2))
}

/// Who is ahead after some work.
fn lead(lead: &Lead) -> String {
    let sweeps = if lead.work == 1.0 { "1 sweep".to_owned() } else { format!("{} sweeps", number(lead.work)) };
    let Some((family, solver, error)) = lead.ranks.first() else { return String::new() };
    let second = match lead.ranks.get(1) {
        Some((other, by, theirs)) => {
            format!("; {} follows with <code>{by}</code> and {}", other.name(), percent(*theirs))
        }
        None => String::new(),
    };
    format!("After {sweeps} {} leads with <code>{solver}</code> and {}{second}.", family.name(), percent(*error))
}

/// Where rivals cross.
fn crossing(c: &Crossing) -> String {
    let by_work = match c.work {
        Some(work) => format!("<code>{}</code> passes <code>{}</code> after {} sweeps", c.late, c.early, number(work)),
        None => format!("By work <code>{}</code> never passes <code>{}</code> before both look exact", c.late, c.early),
    };
    let by_time = match c.seconds {
        Some(s) => format!("by time, on stored factors, after {}", duration(s)),
        None => "nor by time".to_owned(),
    };
    format!("{by_work}; {by_time}.")
}

/// All of it.
pub fn solvers(all: &Comparison) -> String {
    if all.marches.is_empty() {
        return String::new();
    }
    // A shot is the least that is done.
    let shot = 1.0 / all.elements.max(1) as f64;
    let step = || Level { at: STEP, name: "one step of 8 bits".to_owned() };
    let axes =
        |title, x, write_x, floor, from| Axes { title, x, write_x, write_y: power_percent, floor: Some(floor), from };
    let work = "work, applications of F (sweeps)";
    // Elimination has no way to draw.
    let legend = [Family::Gathering, Family::Shooting, Family::Krylov, Family::Random]
        .map(|family| format!("<span><i class=\"{}\"></i>{}</span>", color(family), family.name()))
        .concat();
    let displayed = plot(
        &curves(all, |m| [m.work, m.displayed]),
        &[step()],
        &axes("Displayed error against work", work, number, LEAST_DISPLAYED, Some(0.99 * shot)),
    );
    let residual = plot(
        &curves(all, |m| [m.work, m.residual]),
        &[],
        &Axes { write_y: power, ..axes("Residual against work", work, number, LEAST_RESIDUAL, Some(0.99 * shot)) },
    );
    let timed = plot(
        &curves(all, |m| [m.seconds, m.displayed]),
        &[step()],
        &axes("Displayed error against time", "seconds on stored factors", seconds, LEAST_DISPLAYED, Some(1e-5)),
    );
    let leads: String = all.leads.iter().map(|l| format!("<li>{}</li>", lead(l))).collect();
    let crossings: String = all.crossings.iter().map(|c| format!("<li>{}</li>", crossing(c))).collect();
    let words = note(
        "Displayed error: what a display shows of each element, exposed for the exact picture, tone-mapped and encoded as sRGB; \
         root mean square difference over the pixels, 100 % being white for black. Shooting is shown with its ambient term \
         where it has one. A sweep is one application of F to all three bands; a shot is an N-th of it. Residuals are relative, \
         the worst band. Sweeps of gathering run through memory in order and shots do not, so that a unit of work takes \
         shooting longer where factors are stored; where they are made as they are needed, a shot needs one column and a sweep all of \
         them, and work is time. Elimination has nothing on the way and is in the table only.",
    );
    section(
        "Solvers: when shooting beats gathering",
        &format!(
            "<p class=\"legend\">{legend}</p><h3>Displayed error by work</h3>{displayed}<ul>{leads}</ul>\
             <h3>Displayed error by time</h3>{timed}<ul>{crossings}</ul><h3>Residual by work</h3>{residual}{}{words}",
            solver_table(all)
        ),
    )
}

fn solver_table(all: &Comparison) -> String {
    let row = |m: &March| {
        let shown = |work: f64| m.at(work).map_or("–".to_owned(), |mark| percent(mark.displayed));
        let last = m.marks.last();
        let end = |of: fn(&Mark) -> String| last.map_or("–".to_owned(), of);
        let remark = if m.remark.is_empty() { String::new() } else { format!(" — {}", escape(&m.remark)) };
        vec![
            named(m.solver, &format!("{}{remark}", escape(m.description))),
            m.family.name().to_owned(),
            shown(0.1),
            shown(1.0),
            shown(10.0),
            count(m.steps),
            end(|mark| number(mark.work)),
            end(|mark| duration(mark.seconds)),
            end(|mark| number(mark.residual)),
            end(|mark| percent(mark.error)),
        ]
    };
    let head = [
        "Solver",
        "Family",
        "Shown after 0.1",
        "after 1",
        "after 10",
        "Steps",
        "Work",
        "Time",
        "Residual",
        "Error of B",
    ];
    format!(
        "<div class=\"solvers\"><p class=\"sideways\">scroll sideways for all columns →</p>{}</div>",
        table(&head, &all.marches.iter().map(row).collect::<Vec<_>>())
    )
}
