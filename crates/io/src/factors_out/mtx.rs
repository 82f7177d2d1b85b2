//! Form factors in the coordinate form of MatrixMarket (Boisvert, Pozo & Remington, NISTIR 5935, 1996): a comment for each
//! surface, then a line `row column factor` for each factor that is not zero, counted from 1.

use super::{FactorRows, FactorTable};
use std::io::{Result, Write};

/// Most characters of a name in a comment: a line may have 1024, and readers in C rely on it.
const MAX_NAME: usize = 200;

/// Writes the matrix in MatrixMarket's coordinate form. Numbers have the fewest digits that read back as the same 64 bits.
///
/// # Errors
/// Those of `out`.
pub fn write_mtx(out: &mut impl Write, table: &FactorTable<'_>) -> Result<()> {
    table.check();
    let n = table.surfaces();
    writeln!(out, "%%MatrixMarket matrix coordinate real general")?;
    let kind = if table.is_script_f { "script-F" } else { "form factors" };
    writeln!(out, "% {kind} of {n} surfaces: F(i, j) of what leaves i arrives at j")?;
    writeln!(out, "% surface area{} name", if table.emittances.is_some() { " emittance" } else { "" })?;
    for (i, area) in table.areas.iter().enumerate() {
        write!(out, "% {} {area:?}", i + 1)?;
        if let Some(emittances) = table.emittances {
            write!(out, " {:?}", emittances[i])?;
        }
        let plain = |c: char| if c.is_control() { ' ' } else { c };
        let name: String = table.name(i).chars().take(MAX_NAME).map(plain).collect();
        writeln!(out, " {name}")?;
    }
    match table.rows {
        FactorRows::Dense(values) => {
            writeln!(out, "{n} {n} {}", values.iter().filter(|value| **value != 0.0).count())?;
            for (at, value) in values.iter().enumerate().filter(|(_, value)| **value != 0.0) {
                writeln!(out, "{} {} {value:?}", at / n + 1, at % n + 1)?;
            }
        }
        FactorRows::Sparse { starts, columns, values } => {
            writeln!(out, "{n} {n} {}", values.len())?;
            for (row, ends) in starts.windows(2).enumerate() {
                for at in ends[0]..ends[1] {
                    writeln!(out, "{} {} {:?}", row + 1, columns[at] + 1, values[at])?;
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_forms_write_the_same_entries() {
        let names = ["floor".to_owned(), "a\nb".to_owned()];
        let dense = FactorTable {
            names: &names,
            areas: &[1.5, 2.0],
            emittances: Some(&[0.9, 0.5]),
            rows: FactorRows::Dense(&[0.0, 0.2, 0.15, 1e-9]),
            is_closed: false,
            is_script_f: false,
            errors: None,
        };
        let rows = FactorRows::Sparse { starts: &[0, 1, 3], columns: &[1, 0, 1], values: &[0.2, 0.15, 1e-9] };
        let write = |table: &FactorTable<'_>| {
            let mut out = Vec::new();
            write_mtx(&mut out, table).unwrap();
            String::from_utf8(out).unwrap()
        };
        let expected = "%%MatrixMarket matrix coordinate real general\n\
                        % form factors of 2 surfaces: F(i, j) of what leaves i arrives at j\n\
                        % surface area emittance name\n% 1 1.5 0.9 floor\n% 2 2.0 0.5 a b\n\
                        2 2 3\n1 2 0.2\n2 1 0.15\n2 2 1e-9\n";
        assert_eq!(write(&dense), expected);
        assert_eq!(write(&FactorTable { rows, ..dense }), expected);
    }
}
