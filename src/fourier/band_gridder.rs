//! Gridding by bands of v, where several processes share a set: each holds the rows of one band, and then its own columns of these rows.

use super::bands::{Bands, open_stripes};
use super::fft::{rows_to_pixels, used_rows};
use super::gridder::{fill, grid_units, slices};
use super::nodes::Nodes;
use super::own_columns::OwnColumns;
use super::plan::Plan;
use super::plane_rows::{PlaneRows, TILE};
use super::real::Real;
use super::sorted_rows::SortedRows;
use crate::Result;
use cittert_arrays::Ranks;
use ndarray::Array2;
use num_complex::Complex;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

/// Sums the weighted visibilities of many blocks, and of several processes, into one image.
///
/// All blocks are added once for each band, and a visibility is gridded with the band that it lies in. At the end of a band all its rows are complete.
/// They are transformed, and each process keeps the sum over all processes of the columns of the image that are its own.
///
/// ```text
/// for each band { for each block { add_sorted or add_nodes } close }; finish
/// ```
#[derive(Debug)]
pub struct BandGridder<T: Real> {
    plan: Arc<Plan<T>>,
    /// The rows of tiles of each band.
    bands: Vec<Range<usize>>,
    /// Number of the band that is gridded.
    at: usize,
    /// The planes. Only the stripes that the band reaches have memory.
    planes: PlaneRows<T>,
    columns: OwnColumns<T>,
}

impl<T: Real> BandGridder<T> {
    pub(super) fn on(plan: Arc<Plan<T>>, bands: &Bands) -> Self {
        let planes = PlaneRows::unfilled(plan.n_rows, plan.planes(), plan.columns.width);
        let mut new = Self { columns: OwnColumns::new(&plan, bands.place), plan, bands: bands.tiles.clone(), at: 0, planes };
        new.open(Vec::new());
        new
    }

    /// Give memory to the stripes that the band reaches: that of stripes that are `done`, or new one.
    fn open(&mut self, mut done: Vec<Vec<Complex<T>>>) {
        let Some(band) = self.bands.get(self.at) else { return };
        let len = TILE * self.plan.planes() * self.plan.columns.width;
        let mut stripes = self.planes.stripes_mut();
        // The first stripe has what the band before has added to it.
        let without = stripes[open_stripes(self.plan.n_rows, band)].iter_mut().filter(|s| s.is_empty());
        let new: Vec<_> = without.map(|s| (s, done.pop().unwrap_or_else(|| Vec::with_capacity(len)))).collect();
        new.into_par_iter().for_each(|(stripe, mut memory)| {
            memory.clear();
            memory.resize(len, Complex::new(T::default(), T::default()));
            **stripe = memory;
        });
    }

    /// Add to the band the rows of this process that lie in it, of those that were sorted by the transform of this gridder. `values` writes the weighted
    /// visibilities of a row into a slice \[chan\].
    ///
    /// # Errors
    /// The rows were sorted by another transform.
    pub fn add_sorted(&mut self, rows: &SortedRows, values: impl Fn(usize, &mut [Complex<T>]) + Sync) -> Result<()> {
        rows.check(&self.plan)?;
        let (plan, Some(band)) = (&self.plan, self.bands.get(self.at)) else { return Ok(()) };
        let reach = rows.reaching(band);
        let chunks = rows.chunks.par_iter().zip(&reach);
        let nodes: Vec<Vec<Complex<T>>> = chunks.map(|(chunk, reach)| fill(plan, chunk, |k| reach[k], &values)).collect();
        grid_units(plan, (rows, &slices(&nodes)), (&self.planes, 0..plan.planes()), band.clone())?;
        plan.pool.give(nodes);
        Ok(())
    }

    /// Add to the band those nodes of rows that lie in it.
    ///
    /// # Errors
    /// The rows were sorted by another transform, or the nodes are those of other rows.
    pub fn add_nodes(&mut self, rows: &SortedRows, nodes: &Nodes<T>) -> Result<()> {
        nodes.check(&self.plan, rows)?;
        let Some(band) = self.bands.get(self.at) else { return Ok(()) };
        grid_units(&self.plan, (rows, &slices(&nodes.chunks)), (&self.planes, 0..self.plan.planes()), band.clone())
    }

    /// End the band, to which the rows of all processes are added.
    pub fn close(&mut self, ranks: &dyn Ranks) {
        let Some(band) = self.bands.get(self.at).cloned() else { return };
        let mut stripes = self.planes.stripes_mut();
        let (plan, per_row) = (&self.plan, self.plan.planes() * self.plan.columns.width);
        let done: Vec<Vec<Complex<T>>> = stripes[band.clone()].iter_mut().map(|stripe| std::mem::take(*stripe)).collect();
        for (s, stripe) in band.zip(&done) {
            self.columns.take(plan, &rows_to_pixels(plan, &stripe[..used_rows(plan, s) * per_row]), ranks);
        }
        self.at += 1;
        self.open(done);
    }

    /// The image \[m, l\] of everything that was added by all processes. All get the same bits.
    #[must_use]
    pub fn finish<P: Real>(self, ranks: &dyn Ranks) -> Array2<P> {
        let Self { plan, planes, columns, .. } = self;
        drop(planes);
        columns.image(&plan, ranks)
    }
}
