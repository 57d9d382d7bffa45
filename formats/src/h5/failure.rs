//! Errors of the HDF5 library as errors of this crate.

use crate::FormatError;
use std::path::Path;

/// An error of the library, or of the code that reads without the library, with the place in the file.
pub(super) fn failed(path: &Path, place: &str, expected: &'static str, error: &hdf5::Error) -> FormatError {
    if let hdf5::Error::Internal(found) = error {
        return FormatError::malformed(path, place, expected, found);
    }
    let text = error.to_string();
    if text.contains("unable to lock file") {
        let what = "another program has it open, and HDF5 has locked it: close it there, or wait until that program has ended";
        return FormatError::not_a(path, "a file that no other program writes", what);
    }
    // For an error of the system the library adds file descriptors and the hidden name of the output. Only the message is kept.
    let system = text.split("error message = '").nth(1).and_then(|t| t.split('\'').next());
    let message = system.map_or_else(|| text.replace('\n', " "), String::from);
    FormatError::Hdf5 { path: path.into(), place: place.into(), expected, message }
}
