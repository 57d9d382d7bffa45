//! HDF5: the only place that speaks to the library, shared by UVH5 and CalH5.
//!
//! Everything that is read whole is bounded by the size of the file before memory is asked for it, because a file may claim any shape.

mod read;
mod strings;
mod write;

pub(crate) use read::H5In;
pub use write::Compression;
pub(crate) use write::{H5Out, Rows};

use crate::FormatError;
use std::path::Path;

/// The first bytes of an HDF5 file without a user block.
pub(crate) const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";

/// An error of the library, with its place in the file.
fn failed(path: &Path, place: &str, error: &hdf5::Error) -> FormatError {
    // The library's texts name its functions and the hidden temporary file; the last part says what is wrong.
    FormatError::Hdf5 { path: path.into(), place: place.into(), message: error.to_string() }
}

/// True where the file is HDF5 and has a dataset of that name.
pub(crate) fn has(path: &Path, dataset: &str) -> bool {
    H5In::open(path, "").is_ok_and(|f| f.has(dataset))
}
