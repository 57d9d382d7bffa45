//! What can be wrong with a file.

use crate::layouts::error::LayoutError;
use cittert_arrays::{ArrayError, BoxError};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Result of this crate.
pub type Result<T, E = FormatError> = std::result::Result<T, E>;

/// Why a file could not be read or written. Every variant names the file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FormatError {
    /// The operating system refused.
    #[error("{}: cannot {action}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried, such as `read` or `create`.
        action: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// The output is there already.
    #[error("{}: exists already; choose another name or ask to overwrite it (--overwrite)", path.display())]
    Exists {
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
    /// Valid, but outside what is read or written here.
    #[error("{}: expected what can be read or written here, found this: {what}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What is not supported, and what to do instead.
        what: String,
    },
    /// The values read make no valid set, image or table.
    #[error("{}: expected values that belong together, found this: {source}", path.display())]
    Values {
        /// The file.
        path: PathBuf,
        /// The broken invariant.
        source: ArrayError,
    },
    /// A layout could not be read or written.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// The HDF5 library refused.
    #[error("{}: {place}: expected {expected}, found the error of HDF5: {message}", path.display())]
    Hdf5 {
        /// The file.
        path: PathBuf,
        /// Dataset or group.
        place: String,
        /// What the library was to do.
        expected: &'static str,
        /// What the library said.
        message: String,
    },
}

impl FormatError {
    /// The system refused to `action` on `path`.
    #[must_use]
    pub fn io(path: &Path, action: &'static str, source: std::io::Error) -> Self {
        Self::Io { path: path.into(), action, source }
    }

    /// At `place`, `expected` was due but `found` was there.
    #[must_use]
    pub fn malformed(path: &Path, place: impl Into<String>, expected: impl Into<String>, found: impl Into<String>) -> Self {
        Self::Malformed { path: path.into(), place: place.into(), expected: expected.into(), found: found.into() }
    }

    /// `what` is beyond what is supported.
    #[must_use]
    pub fn unsupported(path: &Path, what: impl Into<String>) -> Self {
        Self::Unsupported { path: path.into(), what: what.into() }
    }

    /// A broken invariant of values from `path`.
    #[must_use]
    pub fn values(path: &Path, source: ArrayError) -> Self {
        Self::Values { path: path.into(), source }
    }

    /// The file this error is about; empty where a layout error names none.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::Io { path, .. }
            | Self::Exists { path }
            | Self::NotA { path, .. }
            | Self::Malformed { path, .. }
            | Self::Unsupported { path, .. }
            | Self::Values { path, .. }
            | Self::Hdf5 { path, .. }
            | Self::Layout(LayoutError::File { path, .. }) => path,
            Self::Layout(_) => Path::new(""),
        }
    }
}

/// Sources and sinks hand their errors on through the vocabulary's error.
impl From<FormatError> for ArrayError {
    fn from(error: FormatError) -> Self {
        Self::Stream(Box::new(error) as BoxError)
    }
}
