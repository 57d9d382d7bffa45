//! Model visibilities of a gain solution, kept for the image that follows it, and the residual visibilities.

use super::model::sees_unpolarized;
use crate::Result;
use crate::memory::MemoryBudget;
use cittert_arrays::{UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySource};
use ndarray::{Array2, ArrayView2, Axis};
use num_complex::Complex;
use rayon::prelude::*;

/// Predictions for the first rows of a set \[row, chan\], with the uvw of these rows.
#[derive(Default)]
pub(super) struct Predicted {
    vis: Vec<Complex<f32>>,
    uvw_m: Vec<f64>,
    n_chan: usize,
}

impl Predicted {
    /// Drop everything, since the model has changed.
    pub(super) fn clear(&mut self) {
        self.vis.clear();
        self.uvw_m.clear();
    }

    /// Keep the predictions of the rows that follow those kept.
    pub(super) fn keep(&mut self, first_row: usize, uvw_m: ArrayView2<'_, f64>, vis: &Array2<Complex<f32>>) {
        if self.of(first_row, uvw_m).is_some() {
            return;
        }
        if first_row == 0 {
            self.clear();
            self.n_chan = vis.ncols();
        }
        let follows = 3 * first_row == self.uvw_m.len() && vis.ncols() == self.n_chan;
        if follows && (self.vis.len() + vis.len()) * size_of::<Complex<f32>>() <= MemoryBudget::default().kept_model() {
            match vis.as_slice() {
                Some(values) => self.vis.extend_from_slice(values),
                None => self.vis.extend(vis),
            }
            self.uvw_m.extend(uvw_m.iter());
        }
    }

    /// The predictions of rows with exactly these uvw, where they are kept.
    pub(super) fn of(&self, first_row: usize, uvw_m: ArrayView2<'_, f64>) -> Option<ArrayView2<'_, Complex<f32>>> {
        let (n, places) = (uvw_m.nrows(), self.uvw_m.get(3 * first_row..3 * (first_row + uvw_m.nrows()))?);
        let same = places.iter().zip(uvw_m).all(|(a, b)| a.to_bits() == b.to_bits());
        let vis = self.vis.get(first_row * self.n_chan..(first_row + n) * self.n_chan)?;
        if same { ArrayView2::from_shape((n, self.n_chan), vis).ok() } else { None }
    }
}

/// Predicts the unpolarised part of a model \[row, chan\].
pub(super) trait Unpolarized: Send {
    /// Visibilities of the rows of `coverage`; NaN where a row has no place.
    ///
    /// # Errors
    /// A set that the model was not made for.
    fn one(&mut self, header: &VisibilityHeader, coverage: &UvCoverage) -> Result<Array2<Complex<f32>>>;
}

/// A set with the model subtracted. Only the parallel hands and Stokes I have a model.
pub(super) struct Left<'a> {
    /// The set.
    pub(super) inner: &'a mut dyn VisibilitySource,
    /// The model.
    pub(super) model: &'a mut dyn Unpolarized,
    /// Its predictions as far as they are kept.
    pub(super) known: &'a Predicted,
}

impl VisibilitySource for Left<'_> {
    fn header(&self) -> &VisibilityHeader {
        self.inner.header()
    }

    fn n_rows(&self) -> usize {
        self.inner.n_rows()
    }

    fn ranks(&self) -> std::sync::Arc<dyn cittert_arrays::Ranks> {
        self.inner.ranks()
    }

    fn read_rows(&mut self, range: std::ops::Range<usize>) -> cittert_arrays::Result<VisibilityBlock> {
        let first = range.start;
        let mut block = self.inner.read_rows(range)?;
        let header = self.inner.header();
        let made;
        let model = match self.known.of(first, block.coverage.uvw_m.view()) {
            Some(known) => known,
            None => {
                let one = self.model.one(header, &block.coverage);
                made = one.map_err(|e| cittert_arrays::ArrayError::Stream(Box::new(e)))?;
                made.view()
            }
        };
        let seen: Vec<bool> = header.polarizations.iter().map(|pol| sees_unpolarized(*pol)).collect();
        block.vis.axis_iter_mut(Axis(0)).into_par_iter().zip(model.axis_iter(Axis(0))).for_each(|(mut row, model)| {
            for (mut products, model) in row.rows_mut().into_iter().zip(model) {
                products.iter_mut().zip(&seen).filter(|(_, seen)| **seen).for_each(|(v, _)| *v -= model);
            }
        });
        Ok(block)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_rows_at_the_same_places_are_known() {
        let uvw = Array2::from_shape_fn((4, 3), |(r, k)| (10 * r + k) as f64);
        let vis = Array2::from_shape_fn((4, 2), |(r, c)| Complex::new(r as f32, c as f32));
        let mut p = Predicted::default();
        p.keep(0, uvw.slice(ndarray::s![..2, ..]), &vis.slice(ndarray::s![..2, ..]).to_owned());
        p.keep(2, uvw.slice(ndarray::s![2.., ..]), &vis.slice(ndarray::s![2.., ..]).to_owned());
        assert_eq!(p.of(1, uvw.slice(ndarray::s![1..4, ..])).unwrap(), vis.slice(ndarray::s![1.., ..]));
        assert!(p.of(0, uvw.slice(ndarray::s![1..4, ..])).is_none(), "other places");
        assert!(p.of(2, uvw.view()).is_none(), "rows beyond the last");
        p.clear();
        assert!(p.of(0, uvw.view()).is_none());
    }
}
