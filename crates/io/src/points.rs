//! Points to measure at, from CSV: a header that names x, y, z, nx, ny, nz in any order; further columns are kept.

use crate::LoadError;
use crate::source::{read_bounded, read_plain_file};
use glam::DVec3;
use radiosity_scene::{Faults, counted};
use std::path::Path;

/// Most lines that are named; the rest is counted.
const MAX_LINES_NAMED: usize = 20;

/// Where to measure and which way the sensor looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Position, metres.
    pub position: DVec3,
    /// Unit normal of the sensor.
    pub normal: DVec3,
}

/// The points of a file and what else it says of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Points {
    /// The points.
    pub points: Vec<Point>,
    /// Names of the further columns, as they stand there but without quotes around them.
    pub names: Vec<String>,
    /// Their cells by point, each as many as names.
    pub cells: Vec<Vec<String>>,
}

/// Reads points from a CSV file. Every bad line is an error with its number.
pub fn read_points_csv(path: &Path) -> Result<Points, LoadError> {
    let bytes = read_plain_file(path).map_err(|error| LoadError::Io { path: path.to_owned(), error })?;
    let file = path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned());
    parse_points_csv(&file, &bytes)
}

/// As [`read_points_csv`], from a stream, as standard input is one; `name` is the name for messages.
pub fn read_points(name: &str, from: impl std::io::Read) -> Result<Points, LoadError> {
    let bytes = read_bounded(from).map_err(|error| LoadError::Io { path: name.into(), error })?;
    parse_points_csv(name, &bytes)
}

/// As [`read_points_csv`], from memory; `file` is the name for messages.
///
/// ```
/// let points = radiosity_io::parse_points_csv("p.csv", b"name,x,y,z,nx,ny,nz\ndesk,1,2,0.75,0,0,2\n").unwrap();
/// assert_eq!(points.points[0].normal, glam::DVec3::Z);
/// assert_eq!((points.names[0].as_str(), points.cells[0][0].as_str()), ("name", "desk"));
/// ```
pub fn parse_points_csv(file: &str, bytes: &[u8]) -> Result<Points, LoadError> {
    let text = String::from_utf8_lossy(bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes));
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let Some((at, header)) = lines.next() else {
        return Err(LoadError::one(file, "the file is empty", "the first line names x,y,z,nx,ny,nz"));
    };
    // Spreadsheets write semicolons where the comma is the decimal sign, and tabs when copied; of two that divide the header
    // as often, the last counts.
    let by = |separator: &char| split(header, *separator).len();
    let separator = [';', '\t', ','].into_iter().max_by_key(by).unwrap_or(',');
    let header = split(header, separator);
    let names: Vec<String> = header.iter().map(|name| name.to_ascii_lowercase()).collect();
    let wanted = ["x", "y", "z", "nx", "ny", "nz"];
    let columns = wanted.map(|name| names.iter().position(|given| given == name));
    let missing: Vec<&str> = wanted.iter().zip(columns).filter(|(_, at)| at.is_none()).map(|(name, _)| *name).collect();
    if !missing.is_empty() {
        let what = format!("the header has no column {}", missing.join(", "));
        return Err(LoadError::one(format!("{file}:{}", at + 1), what, "the first line names x,y,z,nx,ny,nz"));
    }
    let columns = columns.map(Option::unwrap_or_default);

    let further: Vec<usize> = (0..header.len()).filter(|column| !columns.contains(column)).collect();
    let names = further.iter().map(|&column| header[column].clone()).collect();

    let (mut all, mut bad, mut faults) = (Points { names, ..Points::default() }, 0_usize, Faults::default());
    for (at, line) in lines {
        let cells = split(line, separator);
        match fits(&cells, header.len()).and_then(|()| point(&cells, columns, separator == ';')) {
            Ok(point) => {
                all.points.push(point);
                // A line may end before its last columns do.
                all.cells.push(further.iter().map(|&column| cells.get(column).cloned().unwrap_or_default()).collect());
            }
            Err((what, hint)) => {
                bad += 1;
                if bad <= MAX_LINES_NAMED {
                    faults.error(format!("{file}:{}", at + 1), what, hint);
                }
            }
        }
    }
    if bad > MAX_LINES_NAMED {
        faults.error(file, format!("and {}", counted(bad - MAX_LINES_NAMED, "more bad line", "more bad lines")), "");
    }
    if all.points.is_empty() && bad == 0 {
        faults.error(file, "has a header and no points", "add a line per point");
    }
    if faults.has_errors() { Err(LoadError::Faults(faults)) } else { Ok(all) }
}

/// The cells of a line, without spaces and quotes around them. Between quotes a separator is text, and two quotes are one.
fn split(line: &str, separator: char) -> Vec<String> {
    // A quote counts in cells that begin with one; in others it is text, as inches are.
    let (mut is_quoted, mut in_quotes, mut is_start) = (false, false, true);
    let parts = line.split(|c: char| {
        in_quotes |= is_start && c == '"';
        is_quoted ^= in_quotes && c == '"';
        let ends = c == separator && !is_quoted;
        in_quotes &= !ends;
        is_start = ends || (is_start && c.is_whitespace());
        ends
    });
    let cell = |text: &str| match text.trim().strip_prefix('"').and_then(|text| text.strip_suffix('"')) {
        Some(inner) => inner.replace("\"\"", "\"").trim().to_owned(),
        None => text.trim().to_owned(),
    };
    parts.map(cell).collect()
}

/// Numbers with a decimal comma are two cells each where commas separate: no line has more cells than the header names.
fn fits(cells: &[String], columns: usize) -> Result<(), (String, &'static str)> {
    let given = cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1);
    let what = format!("{} where the header names {columns}", counted(given, "column", "columns"));
    if given <= columns { Ok(()) } else { Err((what, "write numbers with a decimal point, or name all columns")) }
}

fn point(cells: &[String], columns: [usize; 6], comma: bool) -> Result<Point, (String, &'static str)> {
    let is_line = |cell: &str| cell.split([',', ';', '\t']).count() > 2;
    let hint = |cell: &str, usual| if is_line(cell) { "separate columns as the header does" } else { usual };
    let mut values = [0.0; 6];
    for ((value, column), name) in values.iter_mut().zip(columns).zip(["x", "y", "z", "nx", "ny", "nz"]) {
        let Some(text) = cells.get(column) else {
            return Err((
                format!("only {}, none for {name}", counted(cells.len(), "column", "columns")),
                hint(&cells[0], "complete the line"),
            ));
        };
        let parsed = if comma { text.replace(',', ".").parse() } else { text.parse() };
        *value = parsed.map_err(|_| {
            let shown: String = text.chars().take(40).collect();
            (format!("{name} '{shown}' is not a number"), hint(text, "write a number with a decimal point"))
        })?;
        if !f64::is_finite(*value) {
            return Err((format!("{name} is {text}"), "write a finite number"));
        }
    }
    let [x, y, z, nx, ny, nz] = values;
    // The largest component is taken out first, so that no length over- or underflows.
    let normal = DVec3::new(nx, ny, nz);
    let normal = (normal / normal.abs().max_element()).try_normalize();
    match normal {
        Some(normal) => Ok(Point { position: DVec3::new(x, y, z), normal }),
        None => {
            Err((format!("the normal {nx}, {ny}, {nz} has no direction"), "give the direction the sensor looks to"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_found_by_name() {
        let text = "\u{feff}\"NZ\", nx ,ny,id,z,y,x\r\n-3,0,4,first,3,2,1\r\n\r\n1e-300,0,0,b,0,0,0\n";
        let read = parse_points_csv("p", text.as_bytes()).unwrap();
        assert_eq!(
            (read.names, read.cells),
            (vec!["id".to_owned()], vec![vec!["first".to_owned()], vec!["b".to_owned()]])
        );
        let points = read.points;
        assert_eq!(points[0].position, DVec3::new(1.0, 2.0, 3.0));
        assert!((points[0].normal - DVec3::new(0.0, 0.8, -0.6)).length() < 1e-15, "{}", points[0].normal);
        assert_eq!(points[1].normal, DVec3::Z);
        let german = parse_points_csv("p", b"x;y;z;nx;ny;nz\n1,5;0;0;0;1;0\n").unwrap();
        assert_eq!(german.points[0].position.x, 1.5);
        let inches = parse_points_csv("t", b"x,y,z,nx,ny,nz,a,\"b; c\"\n0,0,0,0,1,0,3\" pipe,foo\n").unwrap();
        assert_eq!(
            (inches.names, &inches.cells[0]),
            (vec!["a".into(), "b; c".into()], &vec!["3\" pipe".into(), "foo".into()])
        );
        let quoted =
            parse_points_csv("p", b"x,y,z,nx,ny,nz,\"the, place\",\n1,0,0,0,1,0,\"a \"\"b\"\", c\"\n").unwrap();
        assert_eq!(
            (quoted.names, &quoted.cells[0]),
            (vec!["the, place".to_owned(), String::new()], &vec!["a \"b\", c".to_owned(), String::new()])
        );
    }

    #[test]
    fn decimal_commas_are_not_read_as_separators() {
        let text = "x,y,z,nx,ny,nz\n1,5,2,25,0,75,0,0,1\n1,2,3,0,0,1,\n";
        let text = parse_points_csv("p.csv", text.as_bytes()).unwrap_err().to_string();
        assert!(text.contains("p.csv:2: 9 columns where the header names 6") && !text.contains("p.csv:3"), "{text}");
    }

    #[test]
    fn every_bad_line_is_named() {
        let text = "x,y,z,nx,ny,nz\n1,2,3,0,0,1\n1,2,3,0,0,0\n1,2,nan,0,0,1\n1,2\n1,x,3,0,0,1\n1,2,3,0,0,inf\n";
        let text = parse_points_csv("p.csv", text.as_bytes()).unwrap_err().to_string();
        for expected in [
            "p.csv:3: the normal 0, 0, 0",
            "p.csv:4: z is nan",
            "p.csv:5: only 2 columns",
            "p.csv:6: y 'x'",
            "p.csv:7: nz",
        ] {
            assert!(text.contains(expected), "{text}");
        }
        let text = parse_points_csv("p.csv", b"x,y,z,nx,ny,nz\n1;2;3;0;0;1\n").unwrap_err().to_string();
        assert!(text.contains("x '1;2;3;0;0;1' is not a number") && text.contains("as the header does"), "{text}");
        let many = format!("x,y,z,nx,ny,nz\n{}", "a\n".repeat(1000));
        let text = parse_points_csv("p.csv", many.as_bytes()).unwrap_err().to_string();
        assert!(text.lines().count() == 21 && text.contains("980 more"), "{text}");
        assert!(parse_points_csv("p.csv", b"x,y,z\n").unwrap_err().to_string().contains("no column nx, ny, nz"));
        assert!(parse_points_csv("p.csv", b"").unwrap_err().to_string().contains("empty"));
        assert!(parse_points_csv("p.csv", b"x,y,z,nx,ny,nz\n").unwrap_err().to_string().contains("no points"));
    }
}
