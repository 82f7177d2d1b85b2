//! Bytes that several may hold without a copy: a file, or a stretch of one.

use std::fmt;
use std::ops::{Deref, Range};
use std::sync::Arc;

/// A stretch of shared bytes. A file of a few megabytes can name its own bytes, or one beside it, thousands of times;
/// all names together take the memory of the bytes once.
#[derive(Clone, Default)]
pub struct Bytes {
    shared: Arc<Vec<u8>>,
    range: Range<usize>,
}

impl Bytes {
    /// A stretch of these bytes; `None` where it leads beyond them.
    pub fn part(&self, range: Range<usize>) -> Option<Bytes> {
        self.get(range.clone())?;
        let start = self.range.start;
        Some(Bytes { shared: Arc::clone(&self.shared), range: start + range.start..start + range.end })
    }

    /// The bytes to be changed: copied where others hold them too.
    pub(crate) fn into_vec(self) -> Vec<u8> {
        let whole = self.range == (0..self.shared.len());
        match Arc::try_unwrap(self.shared) {
            Ok(all) if whole => all,
            Ok(all) => all[self.range].to_vec(),
            Err(shared) => shared[self.range].to_vec(),
        }
    }

    /// Where these bytes lie in memory: equal for two holders of the same stretch.
    pub(crate) fn place(&self) -> (*const u8, usize) {
        (self.as_ptr(), self.len())
    }
}

impl From<Vec<u8>> for Bytes {
    fn from(bytes: Vec<u8>) -> Bytes {
        Bytes { range: 0..bytes.len(), shared: Arc::new(bytes) }
    }
}

impl Deref for Bytes {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.shared[self.range.clone()]
    }
}

impl PartialEq for Bytes {
    fn eq(&self, other: &Bytes) -> bool {
        **self == **other
    }
}

impl Eq for Bytes {}

impl fmt::Debug for Bytes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} bytes", self.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_parts_lie_in_the_same_memory() {
        let all = Bytes::from(vec![1, 2, 3, 4, 5]);
        let part = all.part(1..5).unwrap().part(1..3).unwrap();
        assert_eq!(*part, [3, 4]);
        assert_eq!(part.place(), (all[2..].as_ptr(), 2));
        assert!(all.part(3..6).is_none() && part.part(0..3).is_none());
        assert_eq!(part.into_vec(), [3, 4]);
        assert_eq!(all.into_vec(), [1, 2, 3, 4, 5]);
    }
}
