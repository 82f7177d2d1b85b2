//! What the light is: the pictures, how bright the surfaces are, the lightmap.

use super::markup::{bars, cards, count, escape, note, number, section, share, table, with_unit};
use super::{Plate, plot};
use crate::figures;
use crate::illuminance::{Class, Illuminance};
use crate::numbers::fixed;
use crate::report::{LightmapReport, Report};
use base64::Engine;

/// The pictures.
pub fn gallery(plates: &[Plate], light: &Illuminance) -> String {
    if plates.is_empty() {
        return String::new();
    }
    let figure = |plate: &Plate| {
        let data = base64::engine::general_purpose::STANDARD.encode(&plate.png);
        let (title, remark) = (escape(&plate.title), escape(&plate.note));
        let scale = if plate.has_scale { scale(&light.classes) } else { String::new() };
        format!(
            "<figure><img alt=\"{title}\" src=\"data:image/png;base64,{data}\">{scale}\
             <figcaption><b>{title}.</b> {remark}</figcaption></figure>"
        )
    };
    format!("<section class=\"gallery\">{}</section>", plates.iter().map(figure).collect::<String>())
}

fn paint(class: &Class) -> String {
    let [r, g, b] = class.color;
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// The colours of the classes with the illuminances at which they meet.
fn scale(classes: &[Class]) -> String {
    let cell = |(i, class): (usize, &Class)| {
        let edge = if i == 0 { String::new() } else { format!("<b>{}</b>", number(class.from)) };
        format!("<span style=\"background:{}\">{edge}</span>", paint(class))
    };
    let cells: String = classes.iter().enumerate().map(cell).collect();
    format!("<div class=\"scale\" aria-hidden=\"true\">{cells}<em>lx</em></div>")
}

/// Extremes, distribution and single surfaces.
pub fn illuminance(report: &Report) -> String {
    let light = &report.illuminance;
    let lux = |x: f64| with_unit(x, "lx");
    let uniform = uniformity(light.low / light.mean);
    let mut body = cards(&[
        ("Low", lux(light.low), figures::LOW),
        ("Mean", lux(light.mean), figures::MEAN),
        ("Median", lux(light.median), figures::MEDIAN),
        ("Largest", lux(light.largest), figures::LARGEST),
        ("Uniformity", uniform, figures::UNIFORMITY),
    ]);
    if !light.classes.is_empty() {
        let top = light.classes.iter().map(|c| c.share).fold(f64::MIN_POSITIVE, f64::max);
        let last = light.classes.len() - 1;
        let row = |(i, class): (usize, &Class)| {
            let (from, to) = (number(class.from), number(class.to));
            let name = match i {
                0 => format!("below {to}\u{a0}lx"),
                i if i == last && light.largest > class.to => format!("above {from}\u{a0}lx"),
                _ => format!("{from}\u{a0}–\u{a0}{to}\u{a0}lx"),
            };
            (name, plot::bar(&[(&paint(class), class.share / top)]), vec![share(class.share)])
        };
        body += "<h3>Share of the lit area</h3>";
        body += &bars(light.classes.iter().enumerate().map(row));
    }
    if !light.surfaces.is_empty() {
        let row = |s: &crate::illuminance::SurfaceLight| {
            let [mean, low, largest, area] = [s.mean, s.low, s.largest, s.area].map(number);
            vec![escape(&s.name), mean, low, largest, uniformity(s.low / s.mean), area]
        };
        let rows: Vec<Vec<String>> = light.surfaces.iter().map(row).collect();
        body += "<h3>By surface</h3>";
        body += &table(&["Object", "Mean, lx", "Low, lx", "Largest, lx", "Uniformity", "Area, m²"], &rows);
        if light.further_surfaces > 0 {
            body += &note(&match light.further_surfaces {
                1 => "1 smaller object is not listed.".to_owned(),
                n => format!("{} smaller objects are not listed.", count(n)),
            });
        }
    }
    let referee = match report.error.points {
        0 => String::new(),
        _ => format!(
            " The audit's own mean at its points, dark ones included, is {}.",
            lux(report.error.mean_illuminance)
        ),
    };
    let dark = match light.dark {
        dark if dark < 0.0005 => String::new(),
        dark => {
            format!(" No light reaches {} of the area, such as insides of solids; it is left out above.", share(dark))
        }
    };
    body += &note(&format!(
        "Illuminance in lux is the light that arrives on a surface, on both sides of two-sided ones, by elements up to {} wide. \
         Extremes depend on their size, the mean hardly does.{dark}{referee}",
        with_unit(report.solution.element_size, "m"),
    ));
    section("Illuminance", &body)
}

/// As lighting designers write it.
fn uniformity(x: f64) -> String {
    match x {
        x if !x.is_finite() => number(x),
        x if x > 0.0 && x < 0.005 => "&lt;\u{202f}0.01".to_owned(),
        x => fixed(x, 2),
    }
}

/// The lightmap.
pub fn lightmap(map: &LightmapReport) -> String {
    let pages: Vec<String> = map.pages.iter().map(|[w, h]| format!("{w} × {h}")).collect();
    let seams = format!(
        "root mean square difference of illuminance where charts of one smooth surface meet; {} before \
                         fitting",
        with_unit(map.seams_before, "lx")
    );
    let finest = match map.finest > map.density {
        true => format!("texels along a metre of surface; up to {} where light is rough", with_unit(map.finest, "/m")),
        false => "texels along a metre of surface".to_owned(),
    };
    let cards = cards(&[
        ("Density", with_unit(map.density, "/m"), &finest),
        ("Texels", count(map.texels), "places on surfaces where light was computed"),
        ("Pages", count(map.pages.len()), &format!("{} texels", pages.join(", "))),
        ("Seams", with_unit(map.seams_after, "lx"), &seams),
    ]);
    section("Lightmap", &cards)
}
