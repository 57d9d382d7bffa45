//! Options of a transform between an image and visibilities.

use crate::memory::MemoryBudget;

/// Smallest error for which single precision is accurate enough.
const SINGLE: f64 = 0.99e-5;

/// The error of a transform and the terms that it includes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridOptions {
    /// Relative l2 error, 1e-13 to 0.5.
    pub epsilon: f64,
    /// Include the term w (n - 1).
    pub w_term: bool,
    /// Divide each pixel by n, the measure of the direction cosines.
    pub divide_by_n: bool,
    /// Memory that the planes of the grid and their buffers share.
    pub memory: MemoryBudget,
}

impl Default for GridOptions {
    fn default() -> Self {
        Self { epsilon: 1e-5, w_term: true, divide_by_n: false, memory: MemoryBudget::default() }
    }
}

impl GridOptions {
    /// True if single precision inside the transform is accurate enough for `epsilon`.
    #[must_use]
    pub fn single_precision_suffices(&self) -> bool {
        self.epsilon >= SINGLE
    }

    /// `epsilon`, where it is larger than the error asked for, but not so large that the precision would change.
    #[must_use]
    pub fn relaxed_to(&self, epsilon: f64) -> f64 {
        let most = if self.single_precision_suffices() { f64::INFINITY } else { SINGLE.next_down() };
        self.epsilon.max(epsilon.min(most))
    }
}
