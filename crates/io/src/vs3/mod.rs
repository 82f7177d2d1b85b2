//! View3D's input (`.vs3`): planar convex surfaces between which view factors are wanted.
//!
//! The format is that of View3D 3.2 to 3.5 (Walton, NISTIR 6925, 2002, and the program's manual), in both its forms, `F 3`
//! (vertices and surfaces) and `F 3a` (surfaces in planes given by azimuth and tilt). View3D computes the factors of whole
//! surfaces and mends them afterwards; here the geometry says the same:
//! - a subsurface (`base`) is cut out of its base, which becomes convex pieces with one surface index;
//! - combined surfaces (`cmb`) are facets of one surface, with the name and the emittance of the one combined with;
//! - a null surface is cut out of its base and is none itself; a mask likewise, and [`Vs3::with_masks`] gives its row back,
//!   which needs no computing: it sees its base and nothing else. Both let nothing through;
//! - an obstruction is cut under the surfaces that lie upon it.
//!
//! Gentler than View3D: numbers may have gaps, which is a warning; emittances above 0.999 stay. Stricter: a line with an
//! unknown letter, surfaces that overlap upon their base, and masks without one are errors. Numbers are decimal (View3D
//! reads those with a leading 0 as octal).

mod cut;
mod enclosure;
mod records;
mod report;
mod settings;
mod surface;

pub use enclosure::{Mask, NoRow, Rowless};
pub use settings::Settings;

use crate::LoadError;
use enclosure::{Built, build};
use radiosity_scene::{Enclosure, EnclosureSurface, Faults, counted};
use records::records;
use report::Report;
use rustc_hash::FxHashSet;
use std::borrow::Cow;
use surface::{Surface, Vertices, read_surface};

/// Emittance in the place of 0, which script-F cannot have. Programs that need no emittance write 0.
const LEAST_EMITTANCE: f64 = 0.001;

/// A View3D file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Vs3 {
    /// Its surfaces, closed where `encl` says so.
    pub enclosure: Enclosure,
    /// The number in the file of each surface of the enclosure.
    pub numbers: Vec<u32>,
    /// Masking surfaces, in the order of the file; no part of the enclosure.
    pub masks: Vec<Mask>,
    /// The surfaces of the file that have no row, in its order.
    pub rowless: Vec<Rowless>,
    /// What the file asks of View3D.
    pub settings: Settings,
    /// What is doubtful.
    pub warnings: Faults,
}

/// A matrix with the rows and columns of masks.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Masked {
    /// The surfaces in the order of the file, masks among them.
    pub surfaces: Vec<EnclosureSurface>,
    /// Their areas, m²; those of bases with what masks cover.
    pub areas: Vec<f64>,
    /// Form factors, row by row.
    pub factors: Vec<f64>,
    /// Bounds of their errors; what masks and their bases see of each other is certain.
    pub errors: Vec<f32>,
}

impl Vs3 {
    /// Adds the masks to the enclosure's areas and form factors with their errors (row by row), as View3D reports them: a mask sees its base
    /// only, and the base sees its masks with what they cover.
    ///
    /// # Panics
    /// Where `areas`, `factors` or `errors` are not of this enclosure.
    pub fn with_masks(&self, areas: &[f64], factors: &[f64], errors: &[f32]) -> Masked {
        let n = self.enclosure.surfaces.len();
        assert_eq!((areas.len(), factors.len()), (n, n * n), "areas and factors of {n} surfaces");
        assert_eq!(errors.len(), n * n, "errors of {n} surfaces");
        let all = n + self.masks.len();
        let mut rows: Vec<usize> = (0..all).collect();
        rows.retain(|row| !self.masks.iter().any(|mask| mask.row == *row));

        let mut masked = Masked {
            surfaces: vec![EnclosureSurface::default(); all],
            areas: vec![0.0; all],
            factors: vec![0.0; all * all],
            errors: vec![0.0; all * all],
        };
        for (i, row) in rows.iter().enumerate() {
            masked.surfaces[*row] = self.enclosure.surfaces[i].clone();
            masked.areas[*row] = areas[i];
        }
        for mask in &self.masks {
            let emittance = Some(mask.emittance);
            masked.surfaces[mask.row] = EnclosureSurface { name: mask.name.clone(), emittance };
            masked.areas[mask.row] = mask.area;
            masked.areas[rows[mask.base]] += mask.area;
        }
        for (i, row) in rows.iter().enumerate() {
            let bare = areas[i] / masked.areas[*row];
            for (j, column) in rows.iter().enumerate() {
                masked.factors[row * all + column] = factors[i * n + j] * bare;
                // A bound stays one: that of the bare part bounds its share of the whole, rounded up.
                let error = f64::from(errors[i * n + j]) * bare;
                masked.errors[row * all + column] = if error > 0.0 { (error as f32).next_up() } else { 0.0 };
            }
        }
        for mask in &self.masks {
            let base = rows[mask.base];
            masked.factors[mask.row * all + base] = 1.0;
            masked.factors[base * all + mask.row] = mask.area / masked.areas[base];
        }
        masked
    }
}

/// Reads a View3D file from memory; `file` is its name for messages. The text may be UTF-8 or Latin-1.
///
/// ```
/// let text = b"T two squares\nF 3\nV 1 0 0 0\nV 2 1 0 0\nV 3 1 1 0\nV 4 0 1 0\nV 5 0 0 1\nV 6 1 0 1\nV 7 1 1 1\n\
///              V 8 0 1 1\nS 1 1 2 3 4 0 0 0.9 floor\nS 2 8 7 6 5 0 0 0.9 ceiling\nEnd of data\n";
/// let vs3 = radiosity_io::parse_vs3("squares.vs3", text).unwrap();
/// assert_eq!(vs3.enclosure.surfaces[1].name, "ceiling");
/// assert_eq!(vs3.enclosure.surface_areas(), [1.0, 1.0]);
/// ```
///
/// # Errors
/// [`LoadError::Faults`] with every fault found.
pub fn parse_vs3(file: &str, bytes: &[u8]) -> Result<Vs3, LoadError> {
    read(file, bytes, 1.0)
}

/// As [`parse_vs3`], with coordinates times `metres_per_unit`.
pub(crate) fn read(file: &str, bytes: &[u8], metres_per_unit: f64) -> Result<Vs3, LoadError> {
    if !(metres_per_unit.is_finite() && metres_per_unit > 0.0) {
        let what = format!("{metres_per_unit} metres per unit");
        return Err(LoadError::one(file, what, "the length of a unit must be above 0"));
    }
    let text = decoded(bytes);
    let mut report = Report::new(file);

    // First what surfaces refer to, so that lines may stand in any order.
    let (mut title, mut settings, mut vertices) = (String::new(), Settings::default(), Vertices::default());
    let (mut settings_line, mut in_planes) = (0, None);
    for record in records(&text) {
        match record.code {
            'T' => record.rest.clone_into(&mut title),
            'C' => {
                settings_line = record.line;
                settings.read(record.line, record.settings(), &mut report);
            }
            'F' => {
                let form = record.words.first().copied().unwrap_or_default();
                in_planes = Some(form.eq_ignore_ascii_case("3a"));
                if form != "3" && in_planes == Some(false) {
                    let hint = "3 and 3a are read; 2 is View2D's";
                    report.error(record.line, format!("the geometry is '{form}'"), hint);
                }
            }
            'V' => vertices.read(&record, metres_per_unit, &mut report),
            'S' | 'M' | 'N' | 'O' => {}
            'X' => report.warning(record.line, "X lines are passed over, as View3D does", ""),
            _ => {
                let what = format!("'{}' begins no line of a View3D file", shortened(record.keyword));
                report.error(
                    record.line,
                    what,
                    "lines begin with T, C, F, V, S, M, N, O or E, comments with '!' or '/'",
                );
            }
        }
    }
    vertices.warn(&mut report);
    let in_planes = in_planes.unwrap_or_else(|| {
        report.warning(1, "no F line says how surfaces are given; read as F 3", "add a line 'F 3'");
        false
    });

    let vertices = (!in_planes).then_some(&vertices);
    let is_surface = |code: char| matches!(code, 'S' | 'M' | 'N' | 'O');
    let (mut surfaces, mut unreadable): (Vec<Surface>, FxHashSet<u32>) = Default::default();
    for record in records(&text).filter(|record| is_surface(record.code)) {
        match read_surface(&record, vertices, metres_per_unit, &mut report) {
            Ok(surface) => surfaces.push(surface),
            Err(number) => unreadable.extend(number),
        }
    }
    let bare: Vec<&mut Surface> = surfaces.iter_mut().filter(|surface| surface.emittance == 0.0).collect();
    if let Some(first) = bare.first() {
        let what = format!(
            "{} no emittance, from here on; taken as {LEAST_EMITTANCE}, as View3D does",
            counted(bare.len(), "surface has", "surfaces have")
        );
        report.warning(first.line, what, "matters only where emittances are asked for");
    }
    bare.into_iter().for_each(|surface| surface.emittance = LEAST_EMITTANCE);
    let Built { mut enclosure, numbers, masks, rowless } = build(&surfaces, &unreadable, &mut report);
    if enclosure.surfaces.is_empty() && !report.has_errors() {
        report.error(1, "the file has no surfaces", "add a line 'S n v1 v2 v3 v4 base cmb emit name' for each");
    }
    let wanted = [("row", settings.row), ("col", settings.col)];
    for (name, number) in wanted {
        if number != 0 && !report.has_errors() && !surfaces.iter().any(|s| s.number == number) {
            report.error(settings_line, format!("{name} is {number}"), "there is no such surface; 0 for all");
        }
    }
    if settings.col != 0 && settings.row == 0 {
        report.error(settings_line, format!("col is {} and row is not given", settings.col), "give row as well");
    }

    enclosure.title = title;
    enclosure.is_closed = settings.encl;
    let failed = report.has_errors();
    let warnings = report.finish();
    if failed {
        return Err(LoadError::Faults(warnings));
    }
    Ok(Vs3 { enclosure, numbers, masks, rowless, settings, warnings })
}

/// The text of a file in UTF-8, or else in Latin-1.
fn decoded(bytes: &[u8]) -> Cow<'_, str> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    match std::str::from_utf8(bytes) {
        Ok(text) => text.into(),
        Err(_) => bytes.iter().copied().map(char::from).collect::<String>().into(),
    }
}

/// The beginning of a word, for messages.
fn shortened(word: &str) -> String {
    if word.chars().count() <= 20 { word.to_owned() } else { word.chars().take(20).chain(['…']).collect() }
}
