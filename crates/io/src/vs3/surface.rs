//! Surfaces as the lines of a View3D file give them, one by one, in both of its forms.
//!
//! `F 3`: `V n x y z`, then `S n v1 v2 v3 v4 base cmb emit name` (v4 = 0: a triangle); M and N alike, O without what
//! follows v4. `F 3a`: `S n shape base cmb emit name` (O: `O n shape`), and in the next lines the origin of a plane, its
//! azimuth and tilt in degrees, and in the plane a rectangle (R: width, height), triangle (T) or quadrilateral (Q: x y …).

use super::records::Record;
use super::report::Report;
use glam::DVec3;
use radiosity_scene::{Facet, FacetError};
use rustc_hash::FxHashMap;

/// What a surface is, by its letter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// S: takes part in the exchange.
    Radiating,
    /// M: lies upon its base and faces it; what it covers sees it and nothing else.
    Mask,
    /// N: as a mask, but what it covers is no part of the base and the mask is no surface.
    Null,
    /// O: stands in the way.
    Obstruction,
}

impl Kind {
    /// In messages.
    pub fn word(self) -> &'static str {
        match self {
            Kind::Radiating => "surface",
            Kind::Mask => "mask",
            Kind::Null => "null surface",
            Kind::Obstruction => "obstruction",
        }
    }
}

/// One surface.
#[derive(Debug)]
pub(super) struct Surface {
    pub line: usize,
    pub kind: Kind,
    pub number: u32,
    pub facet: Facet,
    /// Number of the surface that it lies upon; 0 for none.
    pub base: u32,
    /// Number of the surface that it is a part of; 0 for none.
    pub combine: u32,
    /// 0 where the file gives none.
    pub emittance: f64,
    pub name: String,
}

/// Vertices by their numbers.
#[derive(Debug, Default)]
pub(super) struct Vertices {
    /// The first line of each number, and the position where it can be read.
    by_number: FxHashMap<u32, (usize, Option<DVec3>)>,
    last: u32,
    out_of_order: Option<usize>,
}

impl Vertices {
    pub fn read(&mut self, record: &Record<'_>, scale: f64, report: &mut Report) {
        let Some(mut fields) = Fields::new(record, 4, "n x y z", report) else { return };
        let number = fields.number("the vertex number", report);
        let position = fields.point("x y z", report).map(|position| position * scale);
        let Some(number) = number else { return };
        if let Some((line, _)) = self.by_number.get(&number) {
            let what = format!("vertex {number} is there already, in line {line}");
            report.error(record.line, what, "give each vertex a number of its own");
            return;
        }
        if self.last.checked_add(1) != Some(number) {
            self.out_of_order.get_or_insert(record.line);
        }
        self.last = number;
        self.by_number.insert(number, (record.line, position));
    }

    /// Warns where numbers are not 1, 2, 3 …
    pub fn warn(&self, report: &mut Report) {
        if let Some(line) = self.out_of_order {
            report.warning(line, "vertices are not numbered 1, 2, 3 …", "View3D itself refuses that");
        }
    }
}

/// Reads one surface: in the form `F 3` with its vertices, in the form `F 3a` without. Where that fails, its number.
pub(super) fn read_surface(
    record: &Record<'_>,
    vertices: Option<&Vertices>,
    scale: f64,
    report: &mut Report,
) -> Result<Surface, Option<u32>> {
    let kind = match record.code {
        'S' => Kind::Radiating,
        'M' => Kind::Mask,
        'N' => Kind::Null,
        _ => Kind::Obstruction,
    };
    let radiates = kind != Kind::Obstruction;
    let (least, form) = match (vertices.is_some(), radiates) {
        (true, true) => (8, "n v1 v2 v3 v4 base cmb emit name"),
        (true, false) => (5, "n v1 v2 v3 v4"),
        (false, true) => (5, "n shape base cmb emit name"),
        (false, false) => (2, "n shape"),
    };
    let fields = match vertices {
        Some(_) => Fields::new(record, least, form, report),
        None => Fields::first_line(record, least, form, report),
    };
    let mut fields = fields.ok_or(None)?;
    let number = fields.number("the surface number", report);
    let corners = match vertices {
        Some(vertices) => vertex_corners(&mut fields, vertices, report),
        None => plane_corners(fields.word(), record, scale, report),
    };
    let (mut base, mut combine, mut emittance, mut name) = (Some(0), Some(0), Some(1.0), "");
    if radiates {
        base = fields.index("base", report);
        combine = fields.index("cmb", report);
        emittance = fields.emittance(report);
        name = fields.word();
    }
    let facet = corners.and_then(|corners| facet(corners, number, record.line, report));
    let (Some(number), Some(facet), Some(base), Some(combine), Some(emittance)) =
        (number, facet, base, combine, emittance)
    else {
        return Err(number);
    };
    let name = if name.is_empty() { format!("surface {number}") } else { name.to_owned() };
    Ok(Surface { line: record.line, kind, number, facet, base, combine, emittance, name })
}

/// The corners of `v1 v2 v3 v4`.
fn vertex_corners(fields: &mut Fields<'_>, vertices: &Vertices, report: &mut Report) -> Option<Vec<DVec3>> {
    let given: [Option<u32>; 4] = std::array::from_fn(|_| fields.index("a vertex", report));
    let mut numbers = Vec::with_capacity(4);
    let mut all = true;
    for (i, number) in given.into_iter().enumerate() {
        match number {
            Some(0) if i == 3 => {}
            Some(number) => numbers.push(number),
            None => all = false,
        }
    }
    let mut corners = Vec::with_capacity(4);
    for (i, number) in numbers.iter().enumerate() {
        if numbers[..i].contains(number) {
            let hint = "four different vertices, or three and 0 for a triangle";
            report.error(fields.line, format!("vertex {number} stands there twice"), hint);
            all = false;
        }
        match vertices.by_number.get(number) {
            Some((_, Some(position))) => corners.push(*position),
            Some((_, None)) => all = false,
            None => {
                report.error(
                    fields.line,
                    format!("there is no vertex {number}"),
                    "add its V line, or correct the number",
                );
                all = false;
            }
        }
    }
    all.then_some(corners)
}

/// The corners in a plane given by origin, azimuth (clockwise from +Y) and tilt (0 faces up, 90 is a wall, 180 faces down).
fn plane_corners(shape: &str, record: &Record<'_>, scale: f64, report: &mut Report) -> Option<Vec<DVec3>> {
    let shape = shape.to_ascii_uppercase();
    let (count, form) = match shape.as_str() {
        "R" => (7, "x y z azimuth tilt width height"),
        "T" => (11, "x y z azimuth tilt x1 y1 x2 y2 x3 y3"),
        "Q" => (13, "x y z azimuth tilt x1 y1 x2 y2 x3 y3 x4 y4"),
        _ => {
            report.error(record.line, format!("'{shape}' is no shape"), "shapes are R, T and Q");
            return None;
        }
    };
    let (line, words) = &record.more;
    if words.len() < count {
        let what = format!("{} of {count} numbers in the lines after it", words.len());
        report.error(record.line, what, form);
        return None;
    }
    let mut fields = Fields { line: *line, words: words.clone(), at: 0 };
    let values: Option<Vec<f64>> = (0..count).map(|_| fields.value("a number of the shape", report)).collect();
    let values = values?;
    let origin = DVec3::new(values[0], values[1], values[2]);
    let ((sin_azimuth, cos_azimuth), (sin_tilt, cos_tilt)) = (sin_cos(values[3]), sin_cos(values[4]));
    // Seen from the front: x runs to the right, y up the slope.
    let right = DVec3::new(-cos_azimuth, sin_azimuth, 0.0);
    let up = DVec3::new(-cos_tilt * sin_azimuth, -cos_tilt * cos_azimuth, sin_tilt);
    let at = |x: f64, y: f64| (origin + x * right + y * up) * scale;
    Some(match values[5..] {
        [width, height] => vec![at(0.0, height), at(0.0, 0.0), at(width, 0.0), at(width, height)],
        ref pairs => pairs.chunks_exact(2).map(|p| at(p[0], p[1])).collect(),
    })
}

/// Sine and cosine of an angle in degrees, exact at right angles, so that walls meet.
fn sin_cos(degrees: f64) -> (f64, f64) {
    match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        other => other.to_radians().sin_cos(),
    }
}

fn facet(corners: Vec<DVec3>, number: Option<u32>, line: usize, report: &mut Report) -> Option<Facet> {
    let number = number.map_or_else(|| "?".to_owned(), |number| number.to_string());
    match Facet::new(corners) {
        Ok(facet) if facet.is_convex() => Some(facet),
        Ok(_) => {
            let hint = "split it into triangles or convex quadrilaterals and combine them by cmb; \
                        a crossed outline has two vertices in the wrong order";
            report.error(line, format!("surface {number} is not convex"), hint);
            None
        }
        Err(error) => {
            let hint = match error {
                FacetError::NotPlanar(_) => "split it into two triangles and combine them by cmb",
                _ => "correct its vertices",
            };
            report.error(line, format!("surface {number}: {error}"), hint);
            None
        }
    }
}

/// The words of a record, taken one by one.
struct Fields<'a> {
    line: usize,
    words: Vec<&'a str>,
    at: usize,
}

impl<'a> Fields<'a> {
    /// Those of the first line, and of the next where it has fewer than `least`.
    fn new(record: &Record<'a>, least: usize, form: &str, report: &mut Report) -> Option<Fields<'a>> {
        let mut words = record.words.clone();
        let (line, more) = &record.more;
        if words.len() < least {
            words.extend(more);
        } else if !more.is_empty() {
            let what = format!("a line that begins with the number {}", more[0]);
            report.error(*line, what, "a line begins with its letter, a comment with '!'");
        }
        Fields::of(record, words, least, form, report)
    }

    /// Those of the first line alone.
    fn first_line(record: &Record<'a>, least: usize, form: &str, report: &mut Report) -> Option<Fields<'a>> {
        Fields::of(record, record.words.clone(), least, form, report)
    }

    fn of(
        record: &Record<'a>,
        words: Vec<&'a str>,
        least: usize,
        form: &str,
        report: &mut Report,
    ) -> Option<Fields<'a>> {
        if words.len() < least {
            let what = format!("{} of at least {least} values", words.len());
            report.error(record.line, what, format!("{} {form}", record.code));
            return None;
        }
        Some(Fields { line: record.line, words, at: 0 })
    }

    /// The next word, or nothing.
    fn word(&mut self) -> &'a str {
        self.at += 1;
        self.words.get(self.at - 1).copied().unwrap_or_default()
    }

    fn value(&mut self, what: &str, report: &mut Report) -> Option<f64> {
        let word = self.word();
        let value = word.parse().ok().filter(|value: &f64| value.is_finite());
        if value.is_none() {
            report.error(self.line, format!("{what} is '{word}'"), "it must be a finite number");
        }
        value
    }

    fn point(&mut self, what: &str, report: &mut Report) -> Option<DVec3> {
        let [x, y, z] = std::array::from_fn(|_| self.value(what, report));
        Some(DVec3::new(x?, y?, z?))
    }

    /// A number from 0.
    fn index(&mut self, what: &str, report: &mut Report) -> Option<u32> {
        let word = self.word();
        let index = word.parse().ok();
        if index.is_none() {
            report.error(self.line, format!("{what} is '{word}'"), "it must be a whole number, 0 for none");
        }
        index
    }

    /// A number from 1.
    fn number(&mut self, what: &str, report: &mut Report) -> Option<u32> {
        let word = self.word();
        let number = word.parse().ok().filter(|number| *number > 0);
        if number.is_none() {
            report.error(self.line, format!("{what} is '{word}'"), "it must be a whole number from 1");
        }
        number
    }

    fn emittance(&mut self, report: &mut Report) -> Option<f64> {
        let line = self.line;
        let emittance = self.value("the emittance", report)?;
        if !(0.0..=1.0).contains(&emittance) {
            report.error(line, format!("the emittance is {emittance}"), "it must lie between 0 and 1");
            return None;
        }
        Some(emittance)
    }
}

#[cfg(test)]
mod tests {
    use super::super::records::records;
    use super::*;

    fn plane(text: &str) -> Facet {
        let mut report = Report::new("p");
        let record = records(text).next().unwrap();
        let surface = read_surface(&record, None, 1.0, &mut report);
        surface.unwrap_or_else(|_| panic!("{}", report.finish())).facet
    }

    #[test]
    fn azimuth_and_tilt_are_where_the_manual_puts_them() {
        // The walls, ceiling and floor of a room of 2 × 3 × 4 m, seen from inside.
        for (text, normal, corner) in [
            ("S 1 R 0 0 .9 south\n 2 0 0 0 90 2 4", DVec3::Y, DVec3::new(0., 0., 4.)),
            ("S 1 R 0 0 .9 west\n 0 0 0 90 90 3 4", DVec3::X, DVec3::new(0., 3., 4.)),
            ("S 1 R 0 0 .9 north\n 0 3 0 180 90 2 4", DVec3::NEG_Y, DVec3::new(2., 3., 4.)),
            ("S 1 R 0 0 .9 east\n 2 3 0 270 90 3 4", DVec3::NEG_X, DVec3::new(2., 0., 4.)),
            ("S 1 R 0 0 .9 floor\n 0 0 0 180 0 2 3", DVec3::Z, DVec3::new(2., 3., 0.)),
            ("S 1 R 0 0 .9 ceiling\n 2 0 4 0 180 2 3", DVec3::NEG_Z, DVec3::new(0., 3., 4.)),
        ] {
            let facet = plane(text);
            assert_eq!(facet.normal(), normal, "{text}");
            assert_eq!(facet.corners()[3], corner, "{text}");
        }
        let roof = plane("O 1 q\n 1 2 3 30 40\n 0 0 1 0\n 1 1 0 1");
        let (azimuth, tilt) = (30_f64.to_radians(), 40_f64.to_radians());
        let expected = DVec3::new(azimuth.sin() * tilt.sin(), azimuth.cos() * tilt.sin(), tilt.cos());
        assert!(roof.normal().distance(expected) < 1e-15, "{}", roof.normal());
        assert!((roof.area() - 1.0).abs() < 1e-15);
    }
}
