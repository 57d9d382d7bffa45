//! One image, one set of channels and one range of uvw, for many passes in both directions.

use super::GridOptions;
use super::degridder::Degridder;
use super::gridder::Gridder;
use super::plan::{Plan, UvwExtent};
use super::real::Real;
use super::sort::SortedRows;
use crate::Result;
use cittert_arrays::SkyGrid;
use ndarray::ArrayView2;
use std::sync::Arc;

/// Makes gridders and predictors that share their kernels, their buffers and the order of the rows.
#[derive(Debug)]
pub struct Transform<T: Real> {
    pub(super) plan: Arc<Plan<T>>,
}

impl<T: Real> Transform<T> {
    /// A transform between an image and about `n_vis` visibilities, which decide how fine the grid is.
    ///
    /// # Errors
    /// An epsilon that no kernel reaches, frequencies that are not positive.
    pub fn new(grid: &SkyGrid, freq_hz: &[f64], extent: UvwExtent, opts: &GridOptions, n_vis: u64) -> Result<Self> {
        Ok(Self { plan: Arc::new(Plan::new(grid, freq_hz, extent, opts, Some(n_vis))?) })
    }

    /// Rows with these uvw in m \[row, 3\] in the order of the grid.
    ///
    /// # Errors
    /// uvw that are not finite or outside the announced extent.
    pub fn sort(&self, uvw_m: ArrayView2<'_, f64>) -> Result<SortedRows> {
        SortedRows::new(&self.plan, uvw_m)
    }

    /// An empty gridder.
    #[must_use]
    pub fn gridder(&self) -> Gridder<T> {
        Gridder::on(Arc::clone(&self.plan))
    }

    /// A predictor of the image `plane` \[m, l\].
    ///
    /// # Errors
    /// An image of another shape than the grid or with values that are not finite.
    pub fn degridder(&self, plane: ArrayView2<'_, f64>) -> Result<Degridder<T>> {
        Degridder::on(Arc::clone(&self.plan), plane)
    }
}
