//! The nodes of the rows of a block, which stay in memory while the rows are predicted and gridded by bands.

use super::gridder::turn_nodes;
use super::plan::Plan;
use super::real::Real;
use super::sorted_rows::SortedRows;
use crate::{ChainError, Result, ensure};
use num_complex::Complex;
use std::ops::AddAssign;
use std::sync::Arc;

/// The nodes of the rows of one block: the visibilities of few channels, which stand for those of all.
#[derive(Debug)]
pub struct Nodes<T: Real> {
    plan: Arc<Plan<T>>,
    /// Those of each chunk of rows.
    pub(super) chunks: Vec<Vec<Complex<T>>>,
}

impl<T: Real> Nodes<T> {
    pub(super) fn of(plan: Arc<Plan<T>>, rows: &SortedRows) -> Self {
        let chunks = rows.chunks.iter().map(|c| plan.pool.take(c.n_nodes)).collect();
        Self { plan, chunks }
    }

    /// Check that they are nodes of these rows and of this plan.
    pub(super) fn check(&self, plan: &Plan<T>, rows: &SortedRows) -> Result<()> {
        rows.check(plan)?;
        let same = self.plan.id == plan.id && self.chunks.iter().map(Vec::len).eq(rows.chunks.iter().map(|c| c.n_nodes));
        ensure!(same, ChainError::Incompatible("nodes of some rows were given for others".into()));
        Ok(())
    }

    /// Change predicted visibilities: `turn` receives those of one row \[chan\] and replaces them by the values to be gridded. What it returns is summed.
    ///
    /// # Errors
    /// They are nodes of other rows.
    pub fn turn<S: Default + AddAssign + Send>(
        &mut self,
        rows: &SortedRows,
        turn: impl Fn(usize, &mut [Complex<T>]) -> S + Sync,
    ) -> Result<S> {
        self.check(&self.plan, rows)?;
        Ok(turn_nodes(&self.plan, rows, &mut self.chunks, turn))
    }
}

impl<T: Real> Drop for Nodes<T> {
    fn drop(&mut self) {
        self.plan.pool.give(std::mem::take(&mut self.chunks));
    }
}
