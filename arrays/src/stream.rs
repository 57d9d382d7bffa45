//! Visibility sets larger than memory, read and written in runs of rows.

use crate::ranks::{Alone, Ranks};
use crate::visibility::check_block;
use crate::{ArrayError, Result, UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySet};
use std::ops::Range;
use std::sync::Arc;

/// A source of visibilities. It can be read several times, in runs of rows.
pub trait VisibilitySource: Send {
    /// What all rows share.
    fn header(&self) -> &VisibilityHeader;

    /// Number of rows.
    fn n_rows(&self) -> usize;

    /// Read the rows of `range`.
    ///
    /// # Errors
    /// A range past the last row, or an error in the file.
    fn read_rows(&mut self, range: Range<usize>) -> Result<VisibilityBlock>;

    /// Read only which baselines and times the rows of `range` are. Formats that store them apart from the visibilities do this faster.
    ///
    /// # Errors
    /// As [`VisibilitySource::read_rows`].
    fn read_coverage(&mut self, range: Range<usize>) -> Result<UvCoverage> {
        Ok(self.read_rows(range)?.coverage)
    }

    /// The processes over which the rows of the set are shared out. This source then has only those of this process.
    fn ranks(&self) -> Arc<dyn Ranks> {
        Arc::new(Alone)
    }
}

/// An output of visibilities. Blocks are appended in order.
pub trait VisibilitySink: Send {
    /// Append a block.
    ///
    /// # Errors
    /// A block whose shape is not that of the header, or an error of the file system.
    fn write_block(&mut self, block: &VisibilityBlock) -> Result<()>;

    /// Complete the output and give it its final name.
    ///
    /// # Errors
    /// An error of the file system. The old output then stays in place.
    fn finish(self: Box<Self>) -> Result<()>;

    /// As [`VisibilitySink::finish`]. The result says what was changed or lost, one sentence each.
    ///
    /// # Errors
    /// As [`VisibilitySink::finish`].
    fn finish_with_notes(self: Box<Self>) -> Result<Vec<String>> {
        self.finish()?;
        Ok(Vec::new())
    }
}

impl VisibilitySource for VisibilitySet {
    fn header(&self) -> &VisibilityHeader {
        &self.header
    }

    fn n_rows(&self) -> usize {
        self.data.n_rows()
    }

    fn read_rows(&mut self, range: Range<usize>) -> Result<VisibilityBlock> {
        self.data.rows(range)
    }

    fn read_coverage(&mut self, range: Range<usize>) -> Result<UvCoverage> {
        self.data.coverage.rows(range)
    }
}

/// Blocks are appended to a set in memory. It may begin with an empty block.
impl VisibilitySink for VisibilitySet {
    fn write_block(&mut self, block: &VisibilityBlock) -> Result<()> {
        check_block(&self.header, block)?;
        self.data.append(block)
    }

    fn finish(self: Box<Self>) -> Result<()> {
        Ok(())
    }
}

/// Read a source from the first row to the last in blocks of about `target_bytes`. `work` gets each block with the index of its first row.
///
/// # Errors
/// The first error of the source or of `work`.
pub fn for_each_block<E: From<ArrayError>>(
    source: &mut dyn VisibilitySource,
    target_bytes: usize,
    mut work: impl FnMut(usize, VisibilityBlock) -> std::result::Result<(), E>,
) -> std::result::Result<(), E> {
    // 8 bytes of visibility, 4 of weight, 4 of nsamples, 1 of flag.
    let row_bytes = 17 * source.header().spectrum.n_chan() * source.header().polarizations.len() + 60;
    let step = (target_bytes / row_bytes).max(1);
    let n = source.n_rows();
    let mut start = 0;
    while start < n {
        let end = (start + step).min(n);
        work(start, source.read_rows(start..end)?)?;
        start = end;
    }
    Ok(())
}
