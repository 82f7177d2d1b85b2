//! View3D's text output (its `out=0`), as the program's manual has it: a header `View3D version out encl emit N` filled to
//! 30 characters, a line of areas (C's `%g`), N lines of factors (`%.6f`), a line of emittances (`%.3f`).
//!
//! With `emit` = 1 the factors are script-F. The version here is that of this library; programs that read the format skip it.

use super::FactorTable;
use crate::LoadError;
use radiosity_scene::Faults;
use std::io::{Result, Write};

/// Characters of the header without its line end, filled with blanks; longer ones stay as they are.
const HEADER: usize = 30;

/// What a View3D output says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct View3dText {
    /// The program and its version.
    pub version: String,
    /// Whether the surfaces form an enclosure.
    pub is_closed: bool,
    /// Whether the factors are script-F.
    pub is_script_f: bool,
    /// Areas by surface.
    pub areas: Vec<f64>,
    /// Factors, row by row.
    pub factors: Vec<f64>,
    /// Emittances by surface.
    pub emittances: Vec<f64>,
}

/// Writes View3D's text. Emittances that are not known are 1.
///
/// # Errors
/// Those of `out`.
pub fn write_view3d_text(out: &mut impl Write, table: &FactorTable<'_>) -> Result<()> {
    table.check();
    let n = table.surfaces();
    let version = concat!("radiosity-", env!("CARGO_PKG_VERSION_MAJOR"), ".", env!("CARGO_PKG_VERSION_MINOR"));
    let flags = [table.is_closed, table.is_script_f].map(u8::from);
    let header = format!("View3D {version} 0 {} {} {n}", flags[0], flags[1]);
    writeln!(out, "{header:<HEADER$}")?;
    line(out, table.areas.iter().map(|area| general(*area)))?;
    let mut row = vec![0.0; n];
    for i in 0..n {
        table.row(i, &mut row);
        line(out, row.iter().map(|factor| format!("{factor:.6}")))?;
    }
    let emittance = |i: usize| table.emittances.map_or(1.0, |emittances| emittances[i]);
    line(out, (0..n).map(|i| format!("{:.3}", emittance(i))))
}

/// Writes words with blanks between them.
fn line(out: &mut impl Write, words: impl Iterator<Item = String>) -> Result<()> {
    for (i, word) in words.enumerate() {
        write!(out, "{}{word}", if i > 0 { " " } else { "" })?;
    }
    writeln!(out)
}

/// A number as C's `%g` prints it: six digits, without zeros at the end, with an exponent below 1e-4 and from 1e6 on.
fn general(value: f64) -> String {
    let scientific = format!("{value:.5e}");
    let Some((digits, exponent)) = scientific.split_once('e') else { return scientific };
    let exponent: i32 = exponent.parse().unwrap_or_default();
    let trimmed = |number: &str| match number.contains('.') {
        true => number.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => number.to_owned(),
    };
    if (-4..6).contains(&exponent) {
        trimmed(&format!("{value:.*}", (5 - exponent) as usize))
    } else {
        let sign = if exponent < 0 { '-' } else { '+' };
        format!("{}e{sign}{:02}", trimmed(digits), exponent.abs())
    }
}

/// Reads View3D's text; `file` is its name for messages. Numbers may be parted by any white space, as View3D's own reader
/// takes them.
///
/// ```
/// let text = b"View3D 3.3.1 0 1 0 2          \n1 1\n0.000000 1.000000\n1.000000 0.000000\n0.900 0.900\n";
/// let output = radiosity_io::factors_out::parse_view3d_text("f.txt", text).unwrap();
/// assert_eq!(output.factors, [0.0, 1.0, 1.0, 0.0]);
/// ```
///
/// # Errors
/// [`LoadError::Faults`].
pub fn parse_view3d_text(file: &str, bytes: &[u8]) -> std::result::Result<View3dText, LoadError> {
    let end = bytes.iter().position(|b| *b == b'\n').unwrap_or(bytes.len());
    let header = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let words: Vec<&str> = header.split_whitespace().collect();
    let place = format!("{file}:1");
    let [program, version, ref settings @ ..] = words[..] else {
        return Err(LoadError::one(place, "there is no header", "it reads 'View3D version out encl emit N'"));
    };
    let settings: Vec<usize> = settings.iter().map_while(|word| word.parse().ok()).collect();
    let [form, encl, emit, n] = settings[..] else {
        return Err(LoadError::one(place, "the header does not end in 4 numbers", "they are out, encl, emit and N"));
    };
    if form != 0 {
        return Err(LoadError::one(place, format!("the form of the output is {form}"), "run View3D with out=0"));
    }
    let text = String::from_utf8_lossy(&bytes[end..]);
    let count = text.split_ascii_whitespace().count();
    let expected = n.checked_add(2).and_then(|more| n.checked_mul(more));
    if expected != Some(count) {
        let what = format!("{count} numbers follow the header of {n} surfaces");
        return Err(LoadError::one(place, what, "N areas, N × N factors and N emittances do"));
    }
    let (mut numbers, mut faults) = (Vec::with_capacity(count), Faults::default());
    for (i, word) in text.split_ascii_whitespace().enumerate() {
        match word.parse().ok().filter(|value: &f64| value.is_finite()) {
            Some(number) => numbers.push(number),
            None if faults.0.len() < 20 => {
                faults.error(format!("{file}: number {}", i + 1), format!("is '{word}'"), "")
            }
            None => {}
        }
    }
    if faults.has_errors() {
        return Err(LoadError::Faults(faults));
    }
    let emittances = numbers.split_off(n + n * n);
    let factors = numbers.split_off(n);
    let version = format!("{program} {version}");
    Ok(View3dText { version, is_closed: encl != 0, is_script_f: emit != 0, areas: numbers, factors, emittances })
}

#[cfg(test)]
mod tests {
    use super::super::FactorRows;
    use super::*;

    #[test]
    fn areas_are_printed_as_c_does() {
        for (value, expected) in [
            (0.0, "0"),
            (1.0, "1"),
            (0.1 + 0.2, "0.3"),
            (123_456.0, "123456"),
            (999_999.5, "1e+06"),
            (1_234_567.0, "1.23457e+06"),
            (0.0001, "0.0001"),
            (0.000_012_345_678, "1.23457e-05"),
            (2.5e-120, "2.5e-120"),
            (100.0, "100"),
            (27.182_818, "27.1828"),
        ] {
            assert_eq!(general(value), expected);
        }
    }

    #[test]
    fn a_cube_is_written_as_the_manual_shows_it() {
        let (opposite, beside) = (0.199_824_895_698_4, 0.200_043_776_075_4);
        let factor = |i: usize, j: usize| match (i, j) {
            _ if i == j => 0.0,
            _ if i / 2 == j / 2 => opposite,
            _ => beside,
        };
        let factors: Vec<f64> = (0..36).map(|k| factor(k / 6, k % 6)).collect();
        let table = FactorTable {
            names: &[],
            areas: &[1.0; 6],
            emittances: Some(&[0.5; 6]),
            rows: FactorRows::Dense(&factors),
            is_closed: true,
            is_script_f: false,
            errors: None,
        };
        let mut out = Vec::new();
        write_view3d_text(&mut out, &table).unwrap();
        let text = String::from_utf8(out).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "View3D radiosity-0.1 0 1 0 6  ");
        assert_eq!(lines[1], "1 1 1 1 1 1");
        assert_eq!(lines[2], "0.000000 0.199825 0.200044 0.200044 0.200044 0.200044");
        assert_eq!((lines[8], lines.len()), ("0.500 0.500 0.500 0.500 0.500 0.500", 9));

        let back = parse_view3d_text("cube.txt", text.as_bytes()).unwrap();
        assert_eq!((back.version.as_str(), back.is_closed, back.is_script_f), ("View3D radiosity-0.1", true, false));
        assert_eq!((back.areas, back.emittances), (vec![1.0; 6], vec![0.5; 6]));
        assert!(back.factors.iter().zip(&factors).all(|(a, b)| (a - b).abs() <= 0.5e-6));
    }

    #[test]
    fn script_f_is_marked_and_unknown_emittances_are_black() {
        let rows = FactorRows::Dense(&[0.25]);
        let table = FactorTable {
            names: &[],
            areas: &[2.0],
            emittances: None,
            rows,
            is_closed: false,
            is_script_f: true,
            errors: None,
        };
        let mut out = Vec::new();
        write_view3d_text(&mut out, &table).unwrap();
        let back = parse_view3d_text("f", &out).unwrap();
        assert_eq!((back.is_closed, back.is_script_f, back.emittances), (false, true, vec![1.0]));
    }

    #[test]
    fn damaged_outputs_are_refused() {
        for (text, expected) in [
            ("", "there is no header"),
            ("View3D 3.3", "does not end in 4 numbers"),
            ("View3D 3.3 0 1 0 x", "does not end in 4 numbers"),
            ("View3D 3.3 1 1 0 6\r\n\u{0}\u{1}", "out=0"),
            ("View3D 3.3 0 1 0 2\n1 1\n0 1\n1 0\n.9", "7 numbers follow the header of 2 surfaces"),
            ("View3D 3.3 0 1 0 18446744073709551615\n1", "1 numbers follow"),
            ("View3D 3.3 0 1 0 9223372036854775808\n1", "1 numbers follow"),
            ("View3D 3.3 0 1 0 1\n1 nan 0.9", "number 2: is 'nan'"),
        ] {
            let faults = parse_view3d_text("f", text.as_bytes()).unwrap_err().to_string();
            assert!(faults.contains(expected), "{text}: {faults}");
        }
    }
}
