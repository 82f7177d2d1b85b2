//! Form factors for NumPy: a ZIP of arrays in its format `.npy` 1.0 (magic, a header in Python, numbers in little endian).
//!
//! Dense: `F` (N × N). Sparse: `indices`, `indptr`, `format`, `shape` and `data`, as `scipy.sparse.save_npz` has them for CSR.
//! Beside them `area`, and where they are known `error` (bounds of the errors, shaped as `F` or `data`), `names` and
//! `emittance`. All load without pickle.

use super::{FactorRows, FactorTable};
use std::io::{Result, Seek, Write};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// Values from which on a part of the ZIP needs 64-bit lengths; well below 4 GiB, for deflate may lengthen a little.
const LARGE: u64 = 1 << 31;

/// Writes the matrix as `.npz`. The dense matrix is stored plain, since factors hardly shrink; the rest is deflated.
///
/// # Errors
/// Those of `out`.
pub fn write_npz(out: &mut (impl Write + Seek), table: &FactorTable<'_>) -> Result<()> {
    table.check();
    let n = table.surfaces();
    let mut zip = ZipWriter::new(out);
    match table.rows {
        FactorRows::Dense(values) => {
            array(&mut zip, "F", "<f8", &[n, n], 8, CompressionMethod::Stored)?;
            numbers(&mut zip, values.iter().map(|value| value.to_le_bytes()))?;
        }
        FactorRows::Sparse { starts, columns, values } => {
            // SciPy wants both index arrays of one type, and 32 bits as long as they suffice.
            if i32::try_from(values.len().max(n)).is_ok() {
                array(&mut zip, "indices", "<i4", &[values.len()], 4, CompressionMethod::Deflated)?;
                numbers(&mut zip, columns.iter().map(|column| column.to_le_bytes()))?;
                array(&mut zip, "indptr", "<i4", &[n + 1], 4, CompressionMethod::Deflated)?;
                numbers(&mut zip, starts.iter().map(|start| (*start as i32).to_le_bytes()))?;
            } else {
                array(&mut zip, "indices", "<i8", &[values.len()], 8, CompressionMethod::Deflated)?;
                numbers(&mut zip, columns.iter().map(|column| i64::from(*column).to_le_bytes()))?;
                array(&mut zip, "indptr", "<i8", &[n + 1], 8, CompressionMethod::Deflated)?;
                numbers(&mut zip, starts.iter().map(|start| (*start as i64).to_le_bytes()))?;
            }
            array(&mut zip, "format", "|S3", &[], 3, CompressionMethod::Deflated)?;
            zip.write_all(b"csr")?;
            array(&mut zip, "shape", "<i8", &[2], 8, CompressionMethod::Deflated)?;
            numbers(&mut zip, [n as i64; 2].map(i64::to_le_bytes).into_iter())?;
            array(&mut zip, "data", "<f8", &[values.len()], 8, CompressionMethod::Deflated)?;
            numbers(&mut zip, values.iter().map(|value| value.to_le_bytes()))?;
        }
    }
    if let Some(errors) = table.errors {
        let shape = [n, n];
        let shape = if matches!(table.rows, FactorRows::Dense(_)) { &shape[..] } else { &[errors.len()] };
        array(&mut zip, "error", "<f4", shape, 4, CompressionMethod::Deflated)?;
        numbers(&mut zip, errors.iter().map(|error| error.to_le_bytes()))?;
    }
    array(&mut zip, "area", "<f8", &[n], 8, CompressionMethod::Deflated)?;
    numbers(&mut zip, table.areas.iter().map(|area| area.to_le_bytes()))?;
    if let Some(emittances) = table.emittances {
        array(&mut zip, "emittance", "<f8", &[n], 8, CompressionMethod::Deflated)?;
        numbers(&mut zip, emittances.iter().map(|emittance| emittance.to_le_bytes()))?;
    }
    if !table.names.is_empty() {
        // Characters of 32 bits, all names as long as the longest, the ends filled with zeros.
        let length = table.names.iter().map(|name| name.chars().count()).max().unwrap_or_default().max(1);
        array(&mut zip, "names", &format!("<U{length}"), &[n], 4 * length, CompressionMethod::Deflated)?;
        for name in table.names {
            let characters = name.chars().map(u32::from).chain(std::iter::repeat(0)).take(length);
            numbers(&mut zip, characters.map(u32::to_le_bytes))?;
        }
    }
    zip.finish()?;
    Ok(())
}

/// Begins an array: its file in the ZIP and its header, which ends at a multiple of 64 bytes.
fn array(
    zip: &mut ZipWriter<impl Write + Seek>,
    name: &str,
    kind: &str,
    shape: &[usize],
    bytes: usize,
    compression: CompressionMethod,
) -> Result<()> {
    let bytes = shape.iter().fold(bytes as u64, |product, extent| product.saturating_mul(*extent as u64));
    // No time of writing, so that the same factors make the same file.
    let options = SimpleFileOptions::default().compression_method(compression).large_file(bytes >= LARGE);
    zip.start_file(format!("{name}.npy"), options.last_modified_time(zip::DateTime::DEFAULT))?;
    let mut extents: String = shape.iter().map(|extent| format!("{extent}, ")).collect();
    if shape.len() > 1 {
        extents.truncate(extents.len() - 2);
    }
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({}), }}", extents.trim_end());
    let length = (10 + header.len() + 1).next_multiple_of(64) - 10;
    zip.write_all(b"\x93NUMPY\x01\x00")?;
    zip.write_all(&(length as u16).to_le_bytes())?;
    writeln!(zip, "{header:<width$}", width = length - 1)
}

/// Writes numbers, many at a time.
fn numbers<const BYTES: usize>(
    zip: &mut ZipWriter<impl Write + Seek>,
    numbers: impl Iterator<Item = [u8; BYTES]>,
) -> Result<()> {
    const AT_A_TIME: usize = 1 << 16;
    let mut buffer = Vec::with_capacity(AT_A_TIME);
    for number in numbers {
        buffer.extend_from_slice(&number);
        if buffer.len() + BYTES > AT_A_TIME {
            zip.write_all(&buffer)?;
            buffer.clear();
        }
    }
    zip.write_all(&buffer)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;
    use std::io::{Cursor, Read};

    fn arrays(table: &FactorTable<'_>) -> BTreeMap<String, (String, Vec<u8>)> {
        let mut out = Cursor::new(Vec::new());
        write_npz(&mut out, table).unwrap();
        let mut zip = zip::ZipArchive::new(out).unwrap();
        let files = zip.len();
        let read = |i: usize| {
            let mut file = zip.by_index(i).unwrap();
            let (name, mut bytes) = (file.name().unwrap().into_owned(), Vec::new());
            file.read_to_end(&mut bytes).unwrap();
            assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
            let end = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
            assert!(end % 64 == 0 && bytes[end - 1] == b'\n', "{end}");
            let header = String::from_utf8(bytes[10..end].to_vec()).unwrap().trim_end().to_owned();
            (name, (header, bytes[end..].to_vec()))
        };
        (0..files).map(read).collect()
    }

    fn doubles(bytes: &[u8]) -> Vec<f64> {
        bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect()
    }

    fn integers(bytes: &[u8]) -> Vec<i32> {
        bytes.chunks_exact(4).map(|b| i32::from_le_bytes(b.try_into().unwrap())).collect()
    }

    #[test]
    fn dense_and_sparse_have_the_arrays_that_numpy_and_scipy_read() {
        let names = ["fü".to_owned(), "b".to_owned()];
        let table = FactorTable {
            names: &names,
            areas: &[1.5, 2.0],
            emittances: Some(&[0.9, 0.5]),
            rows: FactorRows::Dense(&[0.0, 0.2, 0.15, 0.85]),
            is_closed: false,
            is_script_f: false,
            errors: None,
        };
        let dense = arrays(&table);
        assert_eq!(dense.keys().collect::<Vec<_>>(), ["F.npy", "area.npy", "emittance.npy", "names.npy"]);
        let (header, bytes) = &dense["F.npy"];
        assert_eq!(header, "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 2), }");
        assert_eq!(doubles(bytes), [0.0, 0.2, 0.15, 0.85]);
        let (header, bytes) = &dense["names.npy"];
        assert_eq!(header, "{'descr': '<U2', 'fortran_order': False, 'shape': (2,), }");
        assert_eq!(integers(bytes), [0x66, 0xfc, 0x62, 0]);
        assert_eq!(doubles(&dense["emittance.npy"].1), [0.9, 0.5]);

        let rows = FactorRows::Sparse { starts: &[0, 1, 3], columns: &[1, 0, 1], values: &[0.2, 0.15, 0.85] };
        let sparse = arrays(&FactorTable { names: &[], emittances: None, rows, ..table });
        let keys = ["area.npy", "data.npy", "format.npy", "indices.npy", "indptr.npy", "shape.npy"];
        assert_eq!(sparse.keys().collect::<Vec<_>>(), keys);
        let format = "{'descr': '|S3', 'fortran_order': False, 'shape': (), }";
        assert_eq!(sparse["format.npy"], (format.to_owned(), b"csr".to_vec()));
        assert_eq!(integers(&sparse["indices.npy"].1), [1, 0, 1]);
        assert_eq!(integers(&sparse["indptr.npy"].1), [0, 1, 3]);
        assert_eq!(doubles(&sparse["data.npy"].1), [0.2, 0.15, 0.85]);
        assert_eq!(sparse["shape.npy"].1, [2, 0, 0, 0, 0, 0, 0, 0].repeat(2));
    }

    #[test]
    fn the_same_factors_make_the_same_file() {
        let rows = FactorRows::Dense(&[1.0]);
        let table = FactorTable {
            names: &[],
            areas: &[1.0],
            emittances: None,
            rows,
            is_closed: true,
            is_script_f: false,
            errors: None,
        };
        let write = || {
            let mut out = Cursor::new(Vec::new());
            write_npz(&mut out, &table).unwrap();
            out.into_inner()
        };
        assert_eq!(write(), write());
    }
}
