//! Errors of layouts, and what a text of a layout may leave out.

use cittert_arrays::{ArrayError, Site};
use std::path::PathBuf;
use thiserror::Error;

/// An error of reading or writing a layout.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LayoutError {
    /// The file that the cause is about.
    #[error("{}", path.display())]
    File {
        /// Path of the file.
        path: PathBuf,
        /// What is wrong with it.
        source: Box<LayoutError>,
    },
    /// An error of the file system.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// A directory that is not an OSKAR telescope model.
    #[error("expected a layout file (or an OSKAR telescope model with a layout.txt), found a folder")]
    Folder,
    /// A pipe, a device or a socket.
    #[error("{0}")]
    Special(String),
    /// A file too large to be a layout.
    #[error("expected a layout of at most {limit} bytes, found a larger file")]
    TooLarge {
        /// Largest size that is read.
        limit: u64,
    },
    /// Nothing in the file.
    #[error("expected an antenna layout, found an empty file")]
    Empty,
    /// Bytes that are not UTF-8 text.
    #[error("expected an antenna layout, found a file that is not text")]
    NotText,
    /// Text of no known format.
    #[error(
        "expected a layout, found a text in none of the known formats: TOML, CASA .cfg (with '# coordsys='), eht-imaging (NAME X Y Z SEFDR SEFDL), pyuvsim csv \
         (Name Number BeamID E N U), a table with a head line (name, x_m, y_m), OSKAR or Miriad (columns of numbers)"
    )]
    Unknown,
    /// A line that does not fit the format.
    #[error("line {line}: expected {expected}, found {found:?}")]
    Line {
        /// Number of the line, from 1.
        line: usize,
        /// What should be there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// Something is missing in the file.
    #[error("{0}")]
    Missing(String),
    /// A layout that a format cannot hold.
    #[error("{format} cannot hold this layout: {reason}")]
    Cannot {
        /// Name of the format.
        format: &'static str,
        /// What is missing or would be lost.
        reason: String,
    },
    /// A layout that is not valid.
    #[error("expected a valid layout, found this: {0}")]
    Array(#[from] ArrayError),
}

/// Result of reading or writing a layout.
pub type Result<T, E = LayoutError> = std::result::Result<T, E>;

/// Properties that the text of a layout may not contain.
#[derive(Debug, Clone, Default)]
pub struct ReadContext {
    /// Name of the layout where the text holds none; for a file, the name of the file.
    pub name: String,
    /// Site for formats that hold none; it replaces the site that the text names.
    pub site: Option<Site>,
    /// Folder of the file, in which files that the text names are looked for. Without a folder they are refused.
    pub folder: Option<PathBuf>,
}
