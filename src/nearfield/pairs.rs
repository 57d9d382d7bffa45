//! Complex sums for every pair of antennas and every channel.
//!
//! In the near field of an array that is fixed to its boresight, the model visibility of a pair does not depend on the time. The rows of any number of
//! integrations are therefore summed over first, and the transforms work on this table.

use crate::memory::MemoryBudget;
use crate::{ChainError, Result, ensure};
use ndarray::{Array3, ArrayView2, Axis, Zip};
use num_complex::Complex64;

/// Sums \[chan, antenna 1, antenna 2\].
#[derive(Debug, Clone, PartialEq)]
pub struct Pairs {
    values: Array3<Complex64>,
}

impl Pairs {
    /// Zeros for some channels and antennas.
    #[must_use]
    pub fn zeros(n_chan: usize, n_ant: usize) -> Self {
        Self { values: Array3::zeros((n_chan, n_ant, n_ant)) }
    }

    /// Size in bytes of such a table.
    #[must_use]
    pub fn bytes(n_chan: usize, n_ant: usize) -> usize {
        n_chan.saturating_mul(n_ant).saturating_mul(n_ant).saturating_mul(size_of::<Complex64>())
    }

    /// Check that a few such tables fit into a memory budget.
    ///
    /// # Errors
    /// They do not; the message says what to do.
    pub fn check_memory(n_chan: usize, n_ant: usize, memory: MemoryBudget) -> Result<()> {
        let (needed, has) = (Self::bytes(n_chan, n_ant).saturating_mul(4), memory.bytes());
        let text = format!(
            "the near field of {n_ant} antennas in {n_chan} channels needs tables of {} MiB, but the memory budget is {} MiB: use fewer channels, or more memory (--memory)",
            needed >> 20,
            has >> 20
        );
        ensure!(needed <= has, ChainError::Incompatible(text));
        Ok(())
    }

    /// The sum of a pair in a channel. The pair in the opposite order has the conjugate.
    #[inline]
    #[must_use]
    pub fn at(&self, chan: usize, ant1: usize, ant2: usize) -> Complex64 {
        self.values[(chan, ant1, ant2)]
    }

    /// Add to the sum of a pair in a channel.
    #[inline]
    pub fn add(&mut self, chan: usize, ant1: usize, ant2: usize, value: Complex64) {
        self.values[(chan, ant1, ant2)] += value;
    }

    /// Add another table.
    pub(super) fn merge(&mut self, other: &Self) {
        Zip::from(&mut self.values).and(&other.values).par_for_each(|a, b| *a += b);
    }

    /// One channel \[antenna 1, antenna 2\].
    pub(super) fn channel(&self, chan: usize) -> ArrayView2<'_, Complex64> {
        self.values.index_axis(Axis(0), chan)
    }

    /// Number of channels.
    #[must_use]
    pub fn n_chan(&self) -> usize {
        self.values.dim().0
    }

    /// Number of antennas.
    #[must_use]
    pub fn n_ant(&self) -> usize {
        self.values.dim().1
    }
}
