//! A block of columns of the table of hit ids: rows one behind the other, in memory or in a file.
//!
//! The file has no name, or on Windows one that nobody else can open, and ends with the process, however that ends. Its bytes are those that memory would hold, in the order of
//! rows: each is written where it belongs as soon as it is traced, and sweeps read them in order, some [`BUFFER`] bytes at a time
//! and thread. It is read and not mapped, as mapped pages count as memory of the process. What the system keeps of it for itself
//! it gives up when others need the room; so reading costs a copy while there is room, and as much as the disk takes where there
//! is none. It is of no use where temporary files lie in memory themselves (`tmpfs`).

use radiosity_scene::size;
use std::fs::File;
use std::io;
use std::mem::take;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Bytes that a thread reads or writes at a time: so many that the disk is not asked for every few rows, and so few that those
/// of all threads are lost in what elements take. It has twice as much, as bytes and as ids.
const BUFFER: usize = 256 << 10;

/// What tells where temporary files lie.
const FOLDER: &str = if cfg!(windows) { "TMP" } else { "TMPDIR" };

/// The file of rows that memory does not hold failed.
#[derive(Debug, thiserror::Error)]
#[error(
    "the rays of the solution, {} that memory does not hold, cannot be {done} a temporary file in {}: {source} (allow more memory, \
     or set {FOLDER} to a folder with room for them)",
    size(*bytes),
    folder.display()
)]
pub struct FileError {
    /// Where the file is.
    pub folder: PathBuf,
    /// Bytes that it has when it is whole.
    pub bytes: usize,
    /// What failed: written to, or read from.
    done: &'static str,
    /// What the system says.
    source: io::Error,
}

/// Rays of one block of columns. Row i is `ids[starts[i]..starts[i + 1]]`, the first half of it from the first half
/// of the points.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    starts: Vec<usize>,
    ids: Ids,
}

#[derive(Clone, Debug)]
enum Ids {
    Memory(Vec<u32>),
    File(Arc<Spool>),
}

/// Ids in a file.
#[derive(Debug)]
struct Spool {
    file: File,
    folder: PathBuf,
    bytes: usize,
}

impl Block {
    /// Rows without ids yet, in memory where `room` bytes of it hold them, else in a file in `folder`.
    pub fn new(starts: Vec<usize>, room: usize, folder: &Path) -> Result<Block, FileError> {
        let len = starts[starts.len() - 1];
        let bytes = len * size_of::<u32>();
        let ids =
            if bytes <= room { Ids::Memory(vec![0; len]) } else { Ids::File(Arc::new(Spool::new(folder, bytes)?)) };
        Ok(Block { starts, ids })
    }

    /// Number of ids in a row.
    pub fn width(&self, i: usize) -> usize {
        self.starts[i + 1] - self.starts[i]
    }

    /// Bytes of the ids.
    pub fn bytes(&self) -> usize {
        self.starts[self.starts.len() - 1] * size_of::<u32>()
    }

    /// Whether they lie in a file.
    pub fn is_in_file(&self) -> bool {
        matches!(self.ids, Ids::File(_))
    }

    /// Who writes the rows, `count` after one another each.
    pub fn writers(&mut self, count: usize) -> Vec<Writer<'_>> {
        let Block { starts, ids } = self;
        let starts: &[usize] = starts;
        let n = starts.len() - 1;
        let chunks = (0..n).step_by(count).map(|first| first..(first + count).min(n));
        match ids {
            Ids::Memory(ids) => {
                let mut left = ids.as_mut_slice();
                let memory = |rows: Range<usize>| {
                    let own;
                    (own, left) = take(&mut left).split_at_mut(starts[rows.end] - starts[rows.start]);
                    Writer { rows, starts, target: Target::Memory(own) }
                };
                chunks.map(memory).collect()
            }
            Ids::File(spool) => {
                let file = |rows: Range<usize>| {
                    let at = starts[rows.start] * size_of::<u32>();
                    Writer { rows, starts, target: Target::File { spool, at, row: Vec::new(), bytes: Vec::new() } }
                };
                chunks.map(file).collect()
            }
        }
    }

    /// Lends some rows, read into `buffer` where they lie in a file.
    pub fn lend<'a>(&'a self, rows: &Range<usize>, buffer: &'a mut Buffer) -> Result<Lent<'a>, FileError> {
        let ids = self.starts[rows.start]..self.starts[rows.end];
        let first = ids.start;
        let ids = match &self.ids {
            Ids::Memory(all) => &all[ids],
            Ids::File(spool) => spool.read(ids, buffer)?,
        };
        Ok(Lent { starts: &self.starts, first, ids })
    }
}

/// The first of some rows, as many as are read at a time: all where their ids lie in memory, and one at least.
pub(crate) fn portion(blocks: &[Block], rows: &Range<usize>) -> Range<usize> {
    let ids = |end: usize| -> usize {
        let in_files = blocks.iter().filter(|block| block.is_in_file());
        in_files.map(|block| block.starts[end] - block.starts[rows.start]).sum()
    };
    let mut count = rows.len();
    while count > 1 && size_of::<u32>() * ids(rows.start + count) > BUFFER {
        count /= 2;
    }
    rows.start..rows.start + count
}

/// Writes some rows of a block, in their order.
pub(crate) struct Writer<'a> {
    /// Which rows.
    pub rows: Range<usize>,
    starts: &'a [usize],
    target: Target<'a>,
}

enum Target<'a> {
    /// What is left of the ids.
    Memory(&'a mut [u32]),
    /// A row, and what of those before it is still to be written, at some byte of the file.
    File { spool: &'a Spool, at: usize, row: Vec<u32>, bytes: Vec<u8> },
}

impl Writer<'_> {
    /// Has row i, the next one, filled in.
    pub fn write(&mut self, i: usize, fill: impl FnOnce(&mut [u32])) -> Result<(), FileError> {
        let width = self.starts[i + 1] - self.starts[i];
        match &mut self.target {
            Target::Memory(left) => {
                let row;
                (row, *left) = take(left).split_at_mut(width);
                fill(row);
            }
            Target::File { row, bytes, .. } => {
                row.resize(width, 0);
                fill(row);
                bytes.extend(row.iter().flat_map(|id| id.to_ne_bytes()));
                if bytes.len() >= BUFFER {
                    self.flush()?;
                }
            }
        }
        Ok(())
    }

    /// Writes what was not yet; to be called after the last row.
    pub fn flush(&mut self) -> Result<(), FileError> {
        if let Target::File { spool, at, bytes, .. } = &mut self.target {
            write_all_at(&spool.file, bytes, *at as u64).map_err(|source| spool.error("written to", source))?;
            *at += bytes.len();
            bytes.clear();
        }
        Ok(())
    }
}

/// Some rows of a block, as they lie in memory.
#[derive(Clone, Copy)]
pub(crate) struct Lent<'a> {
    starts: &'a [usize],
    /// Where the ids begin in those of the block.
    first: usize,
    ids: &'a [u32],
}

impl<'a> Lent<'a> {
    /// The ids of row i.
    #[inline]
    pub fn row(&self, i: usize) -> &'a [u32] {
        &self.ids[self.starts[i] - self.first..self.starts[i + 1] - self.first]
    }
}

/// What rows are read into.
#[derive(Default)]
pub(crate) struct Buffer {
    bytes: Vec<u8>,
    ids: Vec<u32>,
}

impl Spool {
    fn new(folder: &Path, bytes: usize) -> Result<Spool, FileError> {
        let failed = |source| FileError { folder: folder.to_owned(), bytes, done: "written to", source };
        Ok(Spool { file: tempfile::tempfile_in(folder).map_err(failed)?, folder: folder.to_owned(), bytes })
    }

    fn error(&self, done: &'static str, source: io::Error) -> FileError {
        FileError { folder: self.folder.clone(), bytes: self.bytes, done, source }
    }

    fn read<'a>(&self, ids: Range<usize>, buffer: &'a mut Buffer) -> Result<&'a [u32], FileError> {
        buffer.bytes.resize(ids.len() * size_of::<u32>(), 0);
        read_exact_at(&self.file, &mut buffer.bytes, (ids.start * size_of::<u32>()) as u64)
            .map_err(|source| self.error("read from", source))?;
        let (bytes, _) = buffer.bytes.as_chunks();
        buffer.ids.clear();
        buffer.ids.extend(bytes.iter().map(|id| u32::from_ne_bytes(*id)));
        Ok(&buffer.ids)
    }
}

// Threads read and write one file at places of their own, for which each system has calls of its own.

#[cfg(unix)]
fn read_exact_at(file: &File, bytes: &mut [u8], at: u64) -> io::Result<()> {
    use std::os::unix::fs::FileExt;
    file.read_exact_at(bytes, at)
}

#[cfg(unix)]
fn write_all_at(file: &File, bytes: &[u8], at: u64) -> io::Result<()> {
    use std::os::unix::fs::FileExt;
    file.write_all_at(bytes, at)
}

#[cfg(windows)]
fn read_exact_at(file: &File, mut bytes: &mut [u8], mut at: u64) -> io::Result<()> {
    use std::os::windows::fs::FileExt;
    while !bytes.is_empty() {
        match file.seek_read(bytes, at) {
            Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(count) => (bytes, at) = (&mut bytes[count..], at + count as u64),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}

#[cfg(windows)]
fn write_all_at(file: &File, mut bytes: &[u8], mut at: u64) -> io::Result<()> {
    use std::os::windows::fs::FileExt;
    while !bytes.is_empty() {
        match file.seek_write(bytes, at) {
            Ok(0) => return Err(io::ErrorKind::WriteZero.into()),
            Ok(count) => (bytes, at) = (&bytes[count..], at + count as u64),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(())
}
