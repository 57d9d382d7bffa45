//! The rows of one of several processes that share a set.

use crate::ranks::Ranks;
use crate::{PartSource, Result, RowPart, UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySource};
use std::ops::Range;
use std::sync::Arc;

/// The rows of a source that belong to one of several processes: a run of neighbours, so that files are read in order.
pub struct Part {
    inner: Box<dyn VisibilitySource>,
    ranks: Arc<dyn Ranks>,
    rows: Range<usize>,
}

impl Part {
    /// The part of this process.
    #[must_use]
    pub fn new(inner: Box<dyn VisibilitySource>, ranks: Arc<dyn Ranks>) -> Self {
        let (n, k, of) = (inner.n_rows() as u128, ranks.rank() as u128, ranks.size() as u128);
        let bound = |k: u128| (n * k / of) as usize;
        Self { rows: bound(k)..bound(k + 1), inner, ranks }
    }

    /// All rows of `inner`, which are only those of this process.
    #[must_use]
    pub fn own(inner: Box<dyn VisibilitySource>, ranks: Arc<dyn Ranks>) -> Self {
        Self { rows: 0..inner.n_rows(), inner, ranks }
    }

    fn place(&self, range: &Range<usize>) -> Range<usize> {
        self.rows.start + range.start..self.rows.start + range.end
    }
}

impl VisibilitySource for Part {
    fn header(&self) -> &VisibilityHeader {
        self.inner.header()
    }

    fn n_rows(&self) -> usize {
        self.rows.len()
    }

    fn read_rows(&mut self, range: Range<usize>) -> Result<VisibilityBlock> {
        self.inner.read_rows(self.place(&range))
    }

    fn read_runs(&mut self, runs: &[Range<usize>]) -> Result<Vec<VisibilityBlock>> {
        let places: Vec<Range<usize>> = runs.iter().map(|rows| self.place(rows)).collect();
        self.inner.read_runs(&places)
    }

    fn read_coverage(&mut self, range: Range<usize>) -> Result<UvCoverage> {
        self.inner.read_coverage(self.place(&range))
    }

    fn in_parts(&mut self) -> Option<&mut dyn PartSource> {
        if self.inner.in_parts().is_some() { Some(self) } else { None }
    }

    fn ranks(&self) -> Arc<dyn Ranks> {
        self.ranks.clone()
    }
}

impl PartSource for Part {
    fn read_parts(&mut self, range: Range<usize>, step: usize, take: &(dyn Fn(RowPart<'_>) + Sync)) -> Result<()> {
        let range = self.place(&range);
        match self.inner.in_parts() {
            Some(inner) => inner.read_parts(range, step, take),
            None => Err(crate::ArrayError::Stream("a source that no longer reads in parts".into())),
        }
    }

    fn held_bytes(&mut self) -> usize {
        self.inner.in_parts().map_or(0, |inner| inner.held_bytes())
    }
}
