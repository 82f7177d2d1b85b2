//! Points to measure at, from CSV: a header that names x, y, z, nx, ny, nz in any order, further columns allowed.

use crate::LoadError;
use crate::source::read_plain_file;
use glam::DVec3;
use radiosity_scene::Faults;
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

/// Reads points from a CSV file. Every bad line is an error with its number.
pub fn read_points_csv(path: &Path) -> Result<Vec<Point>, LoadError> {
    let bytes = read_plain_file(path).map_err(|error| LoadError::Io { path: path.to_owned(), error })?;
    let file = path.file_name().map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned());
    parse_points_csv(&file, &bytes)
}

/// As [`read_points_csv`], from memory; `file` is the name for messages.
///
/// ```
/// let points = radiosity_io::parse_points_csv("p.csv", b"name,x,y,z,nx,ny,nz\ndesk,1,2,0.75,0,0,2\n").unwrap();
/// assert_eq!(points[0].normal, glam::DVec3::Z);
/// ```
pub fn parse_points_csv(file: &str, bytes: &[u8]) -> Result<Vec<Point>, LoadError> {
    let text = String::from_utf8_lossy(bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes));
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let Some((at, header)) = lines.next() else {
        return Err(LoadError::one(file, "the file is empty", "the first line names x,y,z,nx,ny,nz"));
    };
    // Spreadsheets write semicolons where the comma is the decimal sign, and tabs when copied.
    let separator = [';', '\t'].into_iter().find(|&s| header.contains(s)).unwrap_or(',');
    let cell = |text: &str| text.trim().trim_matches('"').to_owned();
    let names: Vec<String> = header.split(separator).map(|name| cell(name).to_ascii_lowercase()).collect();
    let wanted = ["x", "y", "z", "nx", "ny", "nz"];
    let columns = wanted.map(|name| names.iter().position(|given| given == name));
    let missing: Vec<&str> = wanted.iter().zip(columns).filter(|(_, at)| at.is_none()).map(|(name, _)| *name).collect();
    if !missing.is_empty() {
        let what = format!("the header has no column {}", missing.join(", "));
        return Err(LoadError::one(format!("{file}:{}", at + 1), what, "the first line names x,y,z,nx,ny,nz"));
    }
    let columns = columns.map(Option::unwrap_or_default);

    let (mut points, mut bad, mut faults) = (Vec::new(), 0_usize, Faults::default());
    for (at, line) in lines {
        let cells: Vec<&str> = line.split(separator).collect();
        match point(&cells, columns, separator == ';') {
            Ok(point) => points.push(point),
            Err((what, hint)) => {
                bad += 1;
                if bad <= MAX_LINES_NAMED {
                    faults.error(format!("{file}:{}", at + 1), what, hint);
                }
            }
        }
    }
    if bad > MAX_LINES_NAMED {
        faults.error(file, format!("and {} more bad lines", bad - MAX_LINES_NAMED), "");
    }
    if points.is_empty() && bad == 0 {
        faults.error(file, "has a header and no points", "add a line per point");
    }
    if faults.has_errors() { Err(LoadError::Faults(faults)) } else { Ok(points) }
}

fn point(cells: &[&str], columns: [usize; 6], comma: bool) -> Result<Point, (String, &'static str)> {
    let mut values = [0.0; 6];
    for ((value, column), name) in values.iter_mut().zip(columns).zip(["x", "y", "z", "nx", "ny", "nz"]) {
        let Some(text) = cells.get(column).map(|text| text.trim().trim_matches('"').trim()) else {
            return Err((format!("only {} columns, none for {name}", cells.len()), "complete the line"));
        };
        let parsed = if comma { text.replace(',', ".").parse() } else { text.parse() };
        *value = parsed.map_err(|_| {
            let shown: String = text.chars().take(40).collect();
            (format!("{name} '{shown}' is not a number"), "write a number with a decimal point")
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
        let points = parse_points_csv("p", text.as_bytes()).unwrap();
        assert_eq!(points[0].position, DVec3::new(1.0, 2.0, 3.0));
        assert!((points[0].normal - DVec3::new(0.0, 0.8, -0.6)).length() < 1e-15, "{}", points[0].normal);
        assert_eq!(points[1].normal, DVec3::Z);
        let german = parse_points_csv("p", b"x;y;z;nx;ny;nz\n1,5;0;0;0;1;0\n").unwrap();
        assert_eq!(german[0].position.x, 1.5);
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
        let many = format!("x,y,z,nx,ny,nz\n{}", "a\n".repeat(1000));
        let text = parse_points_csv("p.csv", many.as_bytes()).unwrap_err().to_string();
        assert!(text.lines().count() == 21 && text.contains("980 more"), "{text}");
        assert!(parse_points_csv("p.csv", b"x,y,z\n").unwrap_err().to_string().contains("no column nx, ny, nz"));
        assert!(parse_points_csv("p.csv", b"").unwrap_err().to_string().contains("empty"));
        assert!(parse_points_csv("p.csv", b"x,y,z,nx,ny,nz\n").unwrap_err().to_string().contains("no points"));
    }
}
