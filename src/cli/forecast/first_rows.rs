//! The first rows of a set, on which a command is tried.

use cittert_arrays::{PartSource, Ranks, Result, UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySource};
use std::ops::Range;
use std::sync::Arc;

/// A set without its last rows.
pub(in crate::cli) struct FirstRows<'a> {
    source: &'a mut dyn VisibilitySource,
    rows: usize,
}

impl<'a> FirstRows<'a> {
    /// At most so many rows of a set.
    pub(in crate::cli) fn new(source: &'a mut dyn VisibilitySource, rows: usize) -> Self {
        let rows = rows.min(source.n_rows());
        Self { source, rows }
    }
}

impl VisibilitySource for FirstRows<'_> {
    fn header(&self) -> &VisibilityHeader {
        self.source.header()
    }

    fn n_rows(&self) -> usize {
        self.rows
    }

    fn read_rows(&mut self, range: Range<usize>) -> Result<VisibilityBlock> {
        self.source.read_rows(range)
    }

    fn read_runs(&mut self, runs: &[Range<usize>]) -> Result<Vec<VisibilityBlock>> {
        self.source.read_runs(runs)
    }

    fn read_coverage(&mut self, range: Range<usize>) -> Result<UvCoverage> {
        self.source.read_coverage(range)
    }

    fn in_parts(&mut self) -> Option<&mut dyn PartSource> {
        self.source.in_parts()
    }

    fn ranks(&self) -> Arc<dyn Ranks> {
        self.source.ranks()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{positions, snapshot};
    use cittert_arrays::{Polarization, VisUnit};

    #[test]
    fn the_first_rows_are_those_of_the_set() {
        let mut set = snapshot(&positions(5, 10.0, 0.0, 1), &[1e9], &[Polarization::I], &[(0.01, 0.0, 1.0)], (0.1, VisUnit::Jy));
        let all = set.read_rows(0..set.n_rows()).unwrap();
        let mut some = FirstRows::new(&mut set, 3);
        assert_eq!(some.n_rows(), 3);
        assert_eq!(some.read_rows(0..3).unwrap().vis, all.vis.slice(ndarray::s![..3, .., ..]));
        assert_eq!(some.read_coverage(1..3).unwrap(), all.coverage.rows(1..3).unwrap());
        assert_eq!(FirstRows::new(&mut set, usize::MAX).n_rows(), all.n_rows());
    }
}
