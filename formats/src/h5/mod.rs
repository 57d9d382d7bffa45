//! HDF5: the only place that speaks to the library, shared by UVH5 and CalH5.
//!
//! Everything that is read whole is bounded by the size of the file before memory is asked for it, because a file may claim any shape.

mod child;
mod chunks;
mod convert;
mod probe;
mod read;
mod strings;
mod tiles;
mod types;
mod unpack;
mod write;

pub(crate) use read::H5In;
pub use write::Compression;
pub(crate) use write::{H5Out, Rows};

use crate::FormatError;
use std::path::Path;

/// The first bytes of an HDF5 file without a user block.
pub(crate) const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";

/// An error of the library, or of what is read here past it, with its place in the file.
fn failed(path: &Path, place: &str, expected: &'static str, error: &hdf5::Error) -> FormatError {
    if let hdf5::Error::Internal(found) = error {
        return FormatError::malformed(path, place, expected, found);
    }
    let text = error.to_string();
    // Where the system refused, the library wraps its words into file descriptors and the hidden name of the output.
    let system = text.split("error message = '").nth(1).and_then(|t| t.split('\'').next());
    let message = system.map_or_else(|| text.replace('\n', " "), String::from);
    FormatError::Hdf5 { path: path.into(), place: place.into(), expected, message }
}

/// True where the file is HDF5 and has a dataset of that name.
pub(crate) fn has(path: &Path, dataset: &str) -> bool {
    H5In::open(path, "").is_ok_and(|f| f.has(dataset))
}
