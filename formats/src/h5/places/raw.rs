//! The bytes of an HDF5 file as they lie there, and what an index tells of a chunk.

use std::fs::File;
use std::os::unix::fs::FileExt;

/// The first bytes of an HDF5 file without a user block.
pub(crate) const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";
/// Largest part of an index or of an object header, bytes.
const LARGEST: u64 = 1 << 22;

/// A chunk in the file. One that was never written has no bytes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Place {
    pub(crate) address: u64,
    pub(crate) bytes: u32,
    /// The filters that were not applied, one bit each.
    pub(crate) skipped: u32,
}

/// `n` bytes of a file from an address on.
pub(super) fn bytes(file: &File, address: u64, n: u64) -> Option<Vec<u8>> {
    if n > LARGEST {
        return None;
    }
    let mut out = vec![0; usize::try_from(n).ok()?];
    file.read_exact_at(&mut out, address).ok()?;
    Some(out)
}

/// The unsigned number of `n` bytes at a place.
pub(super) fn number(bytes: &[u8], at: usize, n: usize) -> Option<u64> {
    let part = bytes.get(at..at.checked_add(n)?)?;
    Some(part.iter().rev().fold(0, |all, b| all << 8 | u64::from(*b)))
}
