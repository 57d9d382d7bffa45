//! Prediction by bands of v, where several processes share a set: each transforms its own columns of the image, and gets the rows of one band from all.

use super::bands::{Bands, open_stripes};
use super::degridder::{check_image, degrid_units};
use super::fft::{BLOCK, image_to_columns, pixels_to_rows, used_rows};
use super::nodes::Nodes;
use super::own_columns::{columns_of, lines_at_once};
use super::plan::Plan;
use super::plane_rows::{PlaneRows, TILE};
use super::real::Real;
use super::sorted_rows::SortedRows;
use crate::Result;
use cittert_arrays::Ranks;
use ndarray::ArrayView2;
use num_complex::Complex;
use std::ops::Range;
use std::sync::Arc;

/// Predicts the nodes of many blocks of rows from one image that several processes have. The rows of all blocks are predicted when all bands have passed.
///
/// ```text
/// for each band { open; for each block { add_to } }
/// ```
#[derive(Debug)]
pub struct BandDegridder<T: Real> {
    plan: Arc<Plan<T>>,
    bands: Bands,
    /// Number of the next band.
    next: usize,
    /// The planes. Only the stripes that the band reaches have memory.
    planes: PlaneRows<T>,
    /// The columns of this process, transformed along v, in blocks \[plane, row, column\].
    blocks: Vec<Vec<Complex<T>>>,
}

impl<T: Real> BandDegridder<T> {
    pub(super) fn on<P: Real>(plan: Arc<Plan<T>>, bands: &Bands, image: ArrayView2<'_, P>) -> Result<Self> {
        check_image(&plan, image)?;
        let own = columns_of(plan.grid.n_l, bands.place.0, bands.place.1);
        let blocks = image_to_columns(&plan, image, (true, 0..plan.planes()), own.start / BLOCK..own.end.div_ceil(BLOCK));
        let planes = PlaneRows::unfilled(plan.n_rows, plan.planes(), plan.columns.width);
        Ok(Self { plan, bands: bands.clone(), next: 0, planes, blocks })
    }

    /// Make the rows that the next band reaches.
    pub fn open(&mut self, ranks: &dyn Ranks) {
        let Some(reach) = self.bands.tiles.get(self.next).map(|band| open_stripes(self.plan.n_rows, band)) else { return };
        self.next += 1;
        let (plan, per_row) = (&self.plan, self.plan.planes() * self.plan.columns.width);
        let mut stripes = self.planes.stripes_mut();
        let mut done: Vec<Vec<Complex<T>>> =
            stripes[..reach.start].iter_mut().map(|s| std::mem::take(*s)).filter(|s| !s.is_empty()).collect();
        for (s, stripe) in stripes.into_iter().enumerate().filter(|(s, stripe)| reach.contains(s) && stripe.is_empty()) {
            *stripe = done.pop().unwrap_or_default();
            stripe.resize(TILE * per_row, Complex::new(T::default(), T::default()));
            let pixels = gather(plan, (&self.blocks, &self.bands), s, ranks);
            pixels_to_rows(plan, &pixels, &mut stripe[..used_rows(plan, s) * per_row]);
        }
    }

    /// Write the nodes of sorted rows that lie in the band that is open.
    ///
    /// # Errors
    /// The rows were sorted by another transform, or the nodes are those of other rows.
    pub fn add_to(&self, rows: &SortedRows, nodes: &mut Nodes<T>) -> Result<()> {
        nodes.check(&self.plan, rows)?;
        let Some(band) = self.next.checked_sub(1).and_then(|at| self.bands.tiles.get(at)) else { return Ok(()) };
        degrid_units(&self.plan, (rows, band.clone()), (&self.planes, 0..self.plan.planes()), &mut nodes.chunks)
    }
}

impl<T: Real> Drop for BandDegridder<T> {
    fn drop(&mut self) {
        self.plan.pool.give(std::mem::take(&mut self.blocks));
    }
}

/// The pixels of a stripe \[row, plane, column\], from the columns of all processes.
fn gather<T: Real>(plan: &Plan<T>, (blocks, bands): (&[Vec<Complex<T>>], &Bands), stripe: usize, ranks: &dyn Ranks) -> Vec<Complex<T>> {
    let (planes, n_l, (rank, size)) = (plan.planes(), plan.grid.n_l, bands.place);
    let own = columns_of(n_l, rank, size);
    let mut mine: Vec<Complex<T>> = Vec::new();
    let lines = used_rows(plan, stripe) * planes;
    let at_once = lines_at_once::<T>(n_l);
    let mut all = vec![Complex::new(T::default(), T::default()); lines * n_l];
    for (k, part) in all.chunks_mut(at_once * n_l).enumerate() {
        mine.clear();
        for line in k * at_once..k * at_once + part.len() / n_l {
            let from = (line % planes * plan.n_rows + stripe * TILE + line / planes) * BLOCK;
            let pixels = blocks.iter().flat_map(|block| &block[from..from + BLOCK]);
            mine.extend(pixels.take(own.len()));
        }
        let of_all = ranks.exchange(bytemuck::cast_slice(&mine).to_vec());
        for (process, bytes) in of_all.iter().enumerate() {
            let columns: Range<usize> = columns_of(n_l, process, size);
            let pixels: Vec<Complex<T>> = bytemuck::pod_collect_to_vec(bytes);
            for (row, pixels) in part.chunks_exact_mut(n_l).zip(pixels.chunks_exact(columns.len().max(1))) {
                row[columns.clone()].copy_from_slice(pixels);
            }
        }
    }
    all
}
