//! Several files as one set of visibilities, without a copy: times, channels, products or baselines may be shared out over them in any way.
//!
//! The order of rows does not depend on how the set is shared out, so that images are the same to the last bit. Rows are sorted by time and baseline
//! if all files are (or by baseline and time, or by time with the order of baselines that the files have); otherwise files follow one another by their
//! times. Nothing but an index of rows is kept in memory, see [`index`].
//!
//! | file | what it does |
//! |---|---|
//! | `headers` | one header from several, which must agree |
//! | `axes` | the joined channels and products |
//! | `rows` | the order of the rows of a file |
//! | `slots` | the rows of one time in several files |
//! | `build` | the index of all rows; overlaps and gaps |
//! | `index` | which files hold each row |
//! | `sequence` | one list from several that share items |
//! | `shelf` | open files |
//! | `source` | reading |

mod axes;
mod build;
mod headers;
mod index;
mod parts;
mod rows;
mod sequence;
mod shelf;
mod slots;
mod source;
#[cfg(test)]
mod tests;

pub use source::JoinedSource;

use crate::h5::probe_together;
use crate::registry::open_column;
use crate::{FormatError, Result, VisColumn};
use cittert_arrays::{Alone, Ranks};
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;

impl JoinedSource {
    /// Open several files as one set. Their formats may differ.
    ///
    /// # Errors
    /// A file that cannot be read or lacks the column, a file that is named twice, headers that do not agree, or files that hold the same data.
    pub fn open(files: &[PathBuf], column: VisColumn) -> Result<Self> {
        Self::open_together(files, column, &Alone)
    }

    /// As [`JoinedSource::open`], by several processes that all call it. They share the trials of files that might be damaged, and the search for the order of the rows.
    ///
    /// # Errors
    /// As [`JoinedSource::open`]. A process may not meet the damage that another one meets.
    pub fn open_together(files: &[PathBuf], column: VisColumn, ranks: &dyn Ranks) -> Result<Self> {
        let mut files = files.to_vec();
        files.sort();
        refuse_twice(&files)?;
        probe_together(&files, ranks)?;
        Self::of(files.clone(), Box::new(move |k| open_column(&files[k], column)), ranks)
    }

    /// Another column of the same files.
    #[must_use]
    pub fn column(&self, column: VisColumn) -> Self {
        let files = self.names().to_vec();
        self.beside(Box::new(move |k| open_column(&files[k], column)))
    }
}

/// Refuse a file that is named twice, also by different names.
fn refuse_twice(files: &[PathBuf]) -> Result<()> {
    let mut places = std::collections::HashMap::new();
    for file in files {
        let meta = file.metadata().map_err(|e| FormatError::io(file, "open", e))?;
        if let Some(first) = places.insert((meta.dev(), meta.ino()), file) {
            let what = "this is one file, named twice: name it once".to_owned();
            return Err(FormatError::Apart { first: first.clone(), second: file.clone(), what });
        }
    }
    Ok(())
}
