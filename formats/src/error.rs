//! Errors of files.

use crate::layouts::error::LayoutError;
use cittert_arrays::{ArrayError, BoxError};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Result of this crate.
pub type Result<T, E = FormatError> = std::result::Result<T, E>;

/// An error of reading or writing a file. Every variant names the file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FormatError {
    /// An error of the operating system.
    #[error("{}: cannot {action}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried, such as `read` or `create`.
        action: &'static str,
        /// The error of the system.
        source: std::io::Error,
    },
    /// The output already exists.
    #[error("{}: exists already; choose another name, or allow it to be overwritten", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// Another process changes the file.
    #[error("{}: another process is changing this file; wait until it has ended, and run the command again", path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// The path leads to something that is not a file of the expected kind.
    #[error("{}: expected {expected}, found this: {found}", path.display())]
    NotA {
        /// The file.
        path: PathBuf,
        /// What should be there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// The content breaks the rules of its format.
    #[error("{}: {place}: expected {expected}, found {found}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Where in the file: a keyword, a dataset, a line.
        place: String,
        /// What should be there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// Valid, but not supported by this crate.
    #[error("{}: expected something that cittert supports, found this: {what}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What is not supported, and what to do instead.
        what: String,
    },
    /// The values do not make a valid set, image or table.
    #[error("{}: expected a valid set, image or table, found this: {source}", path.display())]
    Values {
        /// The file.
        path: PathBuf,
        /// The broken invariant.
        source: ArrayError,
    },
    /// Two files cannot be parts of one set.
    #[error("{} and {}: {what}", first.display(), second.display())]
    Apart {
        /// One of the files.
        first: PathBuf,
        /// The other.
        second: PathBuf,
        /// What differs, and what to do.
        what: String,
    },
    /// A layout could not be read or written.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// An error of the HDF5 library.
    #[error("{}: {place}: expected {expected}, found the error of HDF5: {message}", path.display())]
    Hdf5 {
        /// The file.
        path: PathBuf,
        /// Dataset or group.
        place: String,
        /// What was expected.
        expected: &'static str,
        /// The message of the library.
        message: String,
    },
}

impl FormatError {
    /// The operation `action` failed on `path`.
    #[must_use]
    pub fn io(path: &Path, action: &'static str, source: std::io::Error) -> Self {
        Self::Io { path: path.into(), action, source }
    }

    /// `path` leads to `found`, not to `expected`.
    #[must_use]
    pub fn not_a(path: &Path, expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self::NotA { path: path.into(), expected: expected.into(), found: found.into() }
    }

    /// At `place`, `expected` was expected but `found` was found.
    #[must_use]
    pub fn malformed(path: &Path, place: impl Into<String>, expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self::Malformed { path: path.into(), place: place.into(), expected: expected.into(), found: found.into() }
    }

    /// `what` is not supported.
    #[must_use]
    pub fn unsupported(path: &Path, what: impl Into<String>) -> Self {
        Self::Unsupported { path: path.into(), what: what.into() }
    }

    /// A broken invariant of values from `path`.
    #[must_use]
    pub fn values(path: &Path, source: ArrayError) -> Self {
        Self::Values { path: path.into(), source }
    }

    /// The file of this error; empty for a layout error without a file.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::Io { path, .. }
            | Self::Exists { path }
            | Self::InUse { path }
            | Self::NotA { path, .. }
            | Self::Malformed { path, .. }
            | Self::Unsupported { path, .. }
            | Self::Values { path, .. }
            | Self::Apart { second: path, .. }
            | Self::Hdf5 { path, .. }
            | Self::Layout(LayoutError::File { path, .. }) => path,
            Self::Layout(_) => Path::new(""),
        }
    }
}

/// Sources and sinks of visibilities return their errors as errors of the crate of arrays.
impl From<FormatError> for ArrayError {
    fn from(error: FormatError) -> Self {
        Self::Stream(Box::new(error) as BoxError)
    }
}
