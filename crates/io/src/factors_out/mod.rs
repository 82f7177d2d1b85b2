//! Form factors that go out: for NumPy and SciPy, as MatrixMarket, CSV or View3D's text; whole or not at all.
//!
//! | ending | holds | numbers |
//! |---|---|---|
//! | `.npz` | dense: `F`; sparse: SciPy's CSR layout; with both `area`, `names`, `emittance`, `error` | 64 bits, errors 32 |
//! | `.mtx` | MatrixMarket coordinates; names, areas and emittances as comments | shortest that read back the same |
//! | `.csv` | a line per row, no header | shortest that read back the same |
//! | `.txt`, `.out` | areas, matrix and emittances as View3D writes them | 6 decimals |

mod csv;
mod mtx;
mod npz;
mod view3d_text;

pub use csv::write_csv;
pub use mtx::write_mtx;
pub use npz::write_npz;
pub use view3d_text::{View3dText, parse_view3d_text, write_view3d_text};

use crate::Staged;
use std::io::{Seek, Write};
use std::path::{Path, PathBuf};

/// Form factors between N surfaces and what is known of these.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FactorTable<'a> {
    /// Names by surface; none where they have none.
    pub names: &'a [String],
    /// Areas by surface, m².
    pub areas: &'a [f64],
    /// Emittances by surface, where they are known.
    pub emittances: Option<&'a [f64]>,
    /// The matrix.
    pub rows: FactorRows<'a>,
    /// Bounds of the errors, in the order of the matrix's numbers, where they are known.
    pub errors: Option<&'a [f32]>,
    /// Whether the surfaces form an enclosure, so that rows sum to one.
    pub is_closed: bool,
    /// Whether the factors are Hottel's script-F, with reflections by the emittances.
    pub is_script_f: bool,
}

/// A square matrix of factors, from the row's surface to the column's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FactorRows<'a> {
    /// Every factor, row by row.
    Dense(&'a [f64]),
    /// The factors that are not zero.
    Sparse {
        /// Where each row starts in the other two, and at last where they end: N + 1 numbers.
        starts: &'a [usize],
        /// The column of each factor.
        columns: &'a [u32],
        /// The factors.
        values: &'a [f64],
    },
}

impl FactorTable<'_> {
    /// How many surfaces there are.
    pub fn surfaces(&self) -> usize {
        self.areas.len()
    }

    /// Holds the promises that every writer relies on.
    fn check(&self) {
        let n = self.surfaces();
        assert!(self.names.is_empty() || self.names.len() == n, "{} names of {n} surfaces", self.names.len());
        if let Some(emittances) = self.emittances {
            assert_eq!(emittances.len(), n, "emittances of {n} surfaces");
        }
        if let Some(errors) = self.errors {
            let (FactorRows::Dense(values) | FactorRows::Sparse { values, .. }) = self.rows;
            assert_eq!(errors.len(), values.len(), "errors of factors");
        }
        match self.rows {
            FactorRows::Dense(values) => assert_eq!(values.len(), n * n, "factors of {n} surfaces"),
            FactorRows::Sparse { starts, columns, values } => {
                assert_eq!((starts.len(), columns.len()), (n + 1, values.len()), "starts and columns of {n} rows");
                assert_eq!((starts[0], starts[n]), (0, values.len()), "first start and last end");
                assert!(starts.is_sorted(), "starts of rows fall");
                assert!(columns.iter().all(|column| (*column as usize) < n), "a column beyond {n}");
            }
        }
    }

    /// Puts a row into `out`.
    fn row(&self, row: usize, out: &mut [f64]) {
        match self.rows {
            FactorRows::Dense(values) => out.copy_from_slice(&values[row * out.len()..(row + 1) * out.len()]),
            FactorRows::Sparse { starts, columns, values } => {
                out.fill(0.0);
                let range = starts[row]..starts[row + 1];
                for (column, value) in columns[range.clone()].iter().zip(&values[range]) {
                    out[*column as usize] += value;
                }
            }
        }
    }

    /// What the surface is called: its name, or nothing.
    fn name(&self, surface: usize) -> &str {
        self.names.get(surface).map_or("", String::as_str)
    }
}

/// A kind of file for form factors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FactorFormat {
    /// `.npz`: arrays of NumPy.
    Npz,
    /// `.mtx`: MatrixMarket.
    MatrixMarket,
    /// `.csv`: the numbers alone.
    Csv,
    /// `.txt` and `.out`: View3D's text.
    View3dText,
}

impl FactorFormat {
    /// The kind that a file's ending says.
    pub fn of(path: &Path) -> Option<FactorFormat> {
        match path.extension()?.to_ascii_lowercase().to_str()? {
            "npz" => Some(FactorFormat::Npz),
            "mtx" => Some(FactorFormat::MatrixMarket),
            "csv" => Some(FactorFormat::Csv),
            "txt" | "out" => Some(FactorFormat::View3dText),
            _ => None,
        }
    }

    /// Writes form factors in this form.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write(self, out: &mut (impl Write + Seek), table: &FactorTable<'_>) -> std::io::Result<()> {
        match self {
            FactorFormat::Npz => write_npz(out, table),
            FactorFormat::MatrixMarket => write_mtx(out, table),
            FactorFormat::Csv => write_csv(out, table),
            FactorFormat::View3dText => write_view3d_text(out, table),
        }
    }
}

/// Why form factors were not written.
#[derive(Debug, thiserror::Error)]
pub enum FactorsError {
    /// The file's ending says nothing.
    #[error("error: {}: no known kind of file for form factors (.npz, .mtx, .csv, .txt or .out)", .0.display())]
    Format(PathBuf),
    /// The file could not be written.
    #[error("error: {}: cannot be written: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        #[source]
        error: std::io::Error,
    },
}

/// Writes form factors in the kind of file that the path's ending says.
///
/// # Errors
/// [`FactorsError`].
///
/// # Panics
/// Where the lengths in the table do not fit.
pub fn write_factors(path: &Path, table: &FactorTable<'_>) -> Result<(), FactorsError> {
    let format = FactorFormat::of(path).ok_or_else(|| FactorsError::Format(path.to_owned()))?;
    let staged = Staged::new(path);
    let written = staged.write_with(|out| format.write(out, table));
    written.and_then(|()| staged.place()).map_err(|error| FactorsError::Io { path: path.to_owned(), error })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_written_by_their_endings() {
        let folder = std::env::temp_dir().join(format!("radiosity-factors-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let names = ["a".to_owned(), "b".to_owned()];
        let table = FactorTable {
            names: &names,
            areas: &[1.0, 2.0],
            emittances: None,
            rows: FactorRows::Dense(&[0.0, 1.0, 0.5, 0.5]),
            is_closed: true,
            is_script_f: false,
            errors: None,
        };
        for (name, starts_with) in [
            ("f.npz", &b"PK"[..]),
            ("f.MTX", b"%%MatrixMarket"),
            ("f.csv", b"0.0,1.0\n"),
            ("f.txt", b"View3D"),
            ("f.out", b"View3D"),
        ] {
            write_factors(&folder.join(name), &table).unwrap();
            assert!(std::fs::read(folder.join(name)).unwrap().starts_with(starts_with), "{name}");
        }
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 5);
        let error = write_factors(&folder.join("f.xls"), &table).unwrap_err().to_string();
        assert!(error.contains("f.xls: no known kind"), "{error}");
        let error = write_factors(&folder.join("none/f.csv"), &table).unwrap_err().to_string();
        assert!(error.contains("f.csv: cannot be written"), "{error}");
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    #[should_panic(expected = "factors of 2 surfaces")]
    fn lengths_must_fit() {
        let rows = FactorRows::Dense(&[1.0]);
        let table = FactorTable {
            names: &[],
            areas: &[1.0; 2],
            emittances: None,
            rows,
            is_closed: false,
            is_script_f: false,
            errors: None,
        };
        let _ = write_csv(&mut Vec::new(), &table);
    }
}
