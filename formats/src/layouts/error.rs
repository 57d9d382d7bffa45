//! Why a layout could not be read or written.

use cittert_arrays::ArrayError;
use std::path::PathBuf;
use thiserror::Error;

/// Why a layout could not be read or written.
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
    /// The disk refused.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// A folder that is not an OSKAR telescope model.
    #[error("it is a folder, expected a layout file (or an OSKAR telescope model with a layout.txt)")]
    Folder,
    /// A file too large to be a layout.
    #[error("it is larger than {limit} bytes, which no antenna layout is")]
    TooLarge {
        /// Largest size that is read.
        limit: u64,
    },
    /// Nothing in the file.
    #[error("the file is empty, expected an antenna layout")]
    Empty,
    /// Bytes that are not UTF-8 text.
    #[error("the file is not text, expected an antenna layout")]
    NotText,
    /// Text of no known format.
    #[error(
        "the text is none of the known layouts: TOML, CASA .cfg (with '# coordsys='), eht-imaging (NAME X Y Z SEFDR SEFDL), pyuvsim csv \
         (Name Number BeamID E N U), OSKAR or Miriad (columns of numbers)"
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
    /// Something the whole file lacks.
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
    #[error(transparent)]
    Array(#[from] ArrayError),
}
