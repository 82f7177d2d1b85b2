//! Form factors as CSV: a line per row, commas between numbers, no header.

use super::FactorTable;
use std::io::{Result, Write};

/// Writes the matrix as CSV. Numbers have the fewest digits that read back as the same 64 bits.
///
/// # Errors
/// Those of `out`.
pub fn write_csv(out: &mut impl Write, table: &FactorTable<'_>) -> Result<()> {
    table.check();
    let mut row = vec![0.0; table.surfaces()];
    for i in 0..table.surfaces() {
        table.row(i, &mut row);
        for (j, value) in row.iter().enumerate() {
            write!(out, "{}{value:?}", if j > 0 { "," } else { "" })?;
        }
        writeln!(out)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::FactorRows;
    use super::*;

    #[test]
    fn numbers_come_back_the_same() {
        let rows = FactorRows::Sparse {
            starts: &[0, 2, 2, 3],
            columns: &[0, 2, 1],
            values: &[0.1 + 0.2, 1e-300, 0.199_824_895_7],
        };
        let table = FactorTable {
            names: &[],
            areas: &[1.0; 3],
            emittances: None,
            rows,
            is_closed: false,
            is_script_f: false,
            errors: None,
        };
        let mut out = Vec::new();
        write_csv(&mut out, &table).unwrap();
        let text = String::from_utf8(out).unwrap();
        assert_eq!(text, "0.30000000000000004,0.0,1e-300\n0.0,0.0,0.0\n0.0,0.1998248957,0.0\n");
    }
}
