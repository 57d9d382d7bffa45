//! The files of a joined set, of which only some are open at a time.

use crate::{FormatError, Result};
use cittert_arrays::{ArrayError, VisibilitySource};

/// Largest number of files that are open at a time. Systems allow a process about a thousand.
const MOST_OPEN: usize = 128;

/// Opens a file by its number.
pub(super) type Open = Box<dyn Fn(usize) -> Result<Box<dyn VisibilitySource>> + Send>;

/// Files by their numbers.
pub(super) struct Shelf {
    open: Open,
    files: Vec<Option<Box<dyn VisibilitySource>>>,
    /// When each file was last used.
    used: Vec<u64>,
    now: u64,
    n_open: usize,
}

impl Shelf {
    /// `n` files, none of them open.
    pub(super) fn new(n: usize, open: Open) -> Self {
        Self { open, files: (0..n).map(|_| None).collect(), used: vec![0; n], now: 0, n_open: 0 }
    }

    /// A file, which is opened if it is not open. The file that was not used for longest is closed for it.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub(super) fn take(&mut self, k: usize) -> Result<&mut dyn VisibilitySource> {
        self.now += 1;
        self.used[k] = self.now;
        if self.files[k].is_none() {
            if self.n_open >= MOST_OPEN
                && let Some(oldest) = (0..self.files.len()).filter(|f| self.files[*f].is_some()).min_by_key(|f| self.used[*f])
            {
                self.files[oldest] = None;
                self.n_open -= 1;
            }
            self.files[k] = Some((self.open)(k)?);
            self.n_open += 1;
        }
        match &mut self.files[k] {
            Some(file) => Ok(file.as_mut()),
            None => Err(FormatError::values(std::path::Path::new(""), ArrayError::Name("a file of the set is not open".into()))),
        }
    }
}
