//! Visibility sets larger than memory, read and written in runs of rows.

use crate::ranks::{Alone, Ranks};
use crate::visibility::check_block;
use crate::{ArrayError, Result, UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySet};
use num_complex::Complex32;
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

    /// Read several runs of rows, each as [`VisibilitySource::read_rows`] does. Formats that can read several runs side by side do this faster.
    ///
    /// # Errors
    /// As [`VisibilitySource::read_rows`].
    fn read_runs(&mut self, runs: &[Range<usize>]) -> Result<Vec<VisibilityBlock>> {
        runs.iter().map(|rows| self.read_rows(rows.clone())).collect()
    }

    /// Read only which baselines and times the rows of `range` are. Formats that store them apart from the visibilities do this faster.
    ///
    /// # Errors
    /// As [`VisibilitySource::read_rows`].
    fn read_coverage(&mut self, range: Range<usize>) -> Result<UvCoverage> {
        Ok(self.read_rows(range)?.coverage)
    }

    /// The same source as one that hands over its rows in small parts, where it can.
    fn in_parts(&mut self) -> Option<&mut dyn PartSource> {
        None
    }

    /// The processes over which the rows of the set are shared out. This source then has only those of this process.
    fn ranks(&self) -> Arc<dyn Ranks> {
        Arc::new(Alone)
    }
}

/// A few neighbouring rows. The arrays are \[row, chan, pol\] in row order.
#[derive(Debug, Clone)]
pub struct RowPart<'a> {
    /// The rows, counted from the first row that was asked for.
    pub rows: Range<usize>,
    /// Visibilities.
    pub vis: &'a [Complex32],
    /// Weights, 1/sigma^2.
    pub weights: &'a [f32],
    /// Flags; true: not to be used.
    pub flags: &'a [bool],
}

/// A source that reads rows on several threads and hands them over in small parts. A part is worked on while it is in cache, and no block of all
/// products is made.
pub trait PartSource {
    /// Read the rows of `range`. `take` gets each row once, in parts that lie between two multiples of `step`, in any order and on any thread.
    ///
    /// # Errors
    /// A range past the last row, or an error in the file.
    fn read_parts(&mut self, range: Range<usize>, step: usize, take: &(dyn Fn(RowPart<'_>) + Sync)) -> Result<()>;

    /// About how many bytes of the file are in memory at once while many rows are read.
    fn held_bytes(&mut self) -> usize {
        0
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

/// Number of rows of a block of about `target_bytes`.
#[must_use]
pub fn rows_of_block(header: &VisibilityHeader, target_bytes: usize) -> usize {
    // 8 bytes of visibility, 4 of weight, 4 of nsamples, 1 of flag.
    let row_bytes = 17 * header.spectrum.n_chan() * header.polarizations.len() + 60;
    (target_bytes / row_bytes).max(1)
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
    let step = rows_of_block(source.header(), target_bytes);
    let n = source.n_rows();
    let mut start = 0;
    while start < n {
        let end = (start + step).min(n);
        work(start, source.read_rows(start..end)?)?;
        start = end;
    }
    Ok(())
}
