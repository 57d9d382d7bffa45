//! Model visibilities of a gain solution, kept for the image that follows it, and the residual visibilities.

use super::model::sees_unpolarized;
use crate::Result;
use crate::memory::MemoryBudget;
use cittert_arrays::{UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySource, append_shared};
use ndarray::{Array2, Array3, ArrayView2, Axis};
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

    /// Keep the predictions of the rows that follow those kept. They are given back where they are not kept.
    pub(super) fn keep(&mut self, first_row: usize, uvw_m: ArrayView2<'_, f64>, vis: Array2<Complex<f32>>) -> Option<Array2<Complex<f32>>> {
        if first_row == 0 {
            self.clear();
            self.n_chan = vis.ncols();
        }
        let follows = 3 * first_row == self.uvw_m.len() && vis.ncols() == self.n_chan;
        if !follows || (self.vis.len() + vis.len()) * size_of::<Complex<f32>>() > MemoryBudget::default().kept_model() {
            return Some(vis);
        }
        match vis.as_slice() {
            Some(values) => append_shared(&mut self.vis, values),
            None => self.vis.extend(&vis),
        }
        self.uvw_m.extend(uvw_m.iter());
        None
    }

    /// The predictions of rows with exactly these uvw, where they are kept.
    pub(super) fn of(&self, first_row: usize, uvw_m: ArrayView2<'_, f64>) -> Option<ArrayView2<'_, Complex<f32>>> {
        let (n, places) = (uvw_m.nrows(), self.uvw_m.get(3 * first_row..3 * (first_row + uvw_m.nrows()))?);
        let same = match uvw_m.to_slice() {
            Some(uvw_m) => bytemuck::cast_slice::<f64, u64>(places) == bytemuck::cast_slice::<f64, u64>(uvw_m),
            None => places.iter().zip(uvw_m).all(|(a, b)| a.to_bits() == b.to_bits()),
        };
        let vis = self.vis.get(first_row * self.n_chan..(first_row + n) * self.n_chan)?;
        if same { ArrayView2::from_shape((n, self.n_chan), vis).ok() } else { None }
    }
}

/// Visibilities \[row, chan, pol\] of an unpolarised model \[row, chan\]: 0 in the products that do not see it.
pub(super) fn of_products(one: ArrayView2<'_, Complex<f32>>, header: &VisibilityHeader) -> Array3<Complex<f32>> {
    let seen: Vec<bool> = header.polarizations.iter().map(|pol| sees_unpolarized(*pol)).collect();
    let one = one.as_standard_layout();
    let values = match (one.as_slice(), seen.as_slice()) {
        (Some(one), [true]) => one.to_vec(),
        (Some(one), [a, b]) => repeated(one, [*a, *b]),
        (Some(one), [a, b, c, d]) => repeated(one, [*a, *b, *c, *d]),
        _ => one.iter().flat_map(|v| seen.iter().map(|seen| if *seen { *v } else { Complex::default() })).collect(),
    };
    // The vector has a value for each product of each value of `one`.
    Array3::from_shape_vec((one.nrows(), one.ncols(), seen.len()), values).unwrap_or_default()
}

/// Each value once for each of `N` products. All threads write, because the first touch of new memory takes longer than the copy.
fn repeated<const N: usize>(one: &[Complex<f32>], seen: [bool; N]) -> Vec<Complex<f32>>
where
    [Complex<f32>; N]: bytemuck::Pod,
{
    let of = |v: &Complex<f32>| seen.map(|seen| if seen { *v } else { Complex::default() });
    bytemuck::cast_vec(one.par_iter().map(of).collect::<Vec<[Complex<f32>; N]>>())
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
    fn products_that_do_not_see_the_model_are_0() {
        use cittert_arrays::Polarization::{self, I, LL, LR, RL, RR, XX, XY};
        let one = Array2::from_shape_fn((3, 2), |(r, c)| Complex::new(1.0 + r as f32, c as f32));
        let cases: [&[Polarization]; 5] = [&[I], &[RL], &[RR, LL], &[XX, XY, I], &[RR, RL, LR, LL]];
        for polarizations in cases {
            let header =
                VisibilityHeader { polarizations: polarizations.to_vec(), ..crate::closure::testdata::Scene::point(3, 2).header() };
            let all = of_products(one.view(), &header);
            assert_eq!(all.dim(), (3, 2, polarizations.len()));
            for ((r, c, p), v) in all.indexed_iter() {
                let expected = if sees_unpolarized(polarizations[p]) { one[(r, c)] } else { Complex::default() };
                assert_eq!(*v, expected, "{polarizations:?}");
            }
        }
    }

    #[test]
    fn only_rows_at_the_same_places_are_known() {
        let uvw = Array2::from_shape_fn((4, 3), |(r, k)| (10 * r + k) as f64);
        let vis = Array2::from_shape_fn((4, 2), |(r, c)| Complex::new(r as f32, c as f32));
        let mut p = Predicted::default();
        let rows = |a: usize, b: usize| (uvw.slice(ndarray::s![a..b, ..]), vis.slice(ndarray::s![a..b, ..]).to_owned());
        assert!(p.keep(0, rows(0, 2).0, rows(0, 2).1).is_none());
        assert_eq!(p.keep(3, rows(3, 4).0, rows(3, 4).1), Some(rows(3, 4).1), "a row is missing before these");
        assert!(p.keep(2, rows(2, 4).0, rows(2, 4).1).is_none());
        assert_eq!(p.of(1, uvw.slice(ndarray::s![1..4, ..])).unwrap(), vis.slice(ndarray::s![1.., ..]));
        assert!(p.of(0, uvw.slice(ndarray::s![1..4, ..])).is_none(), "other places");
        assert!(p.of(2, uvw.view()).is_none(), "rows beyond the last");
        p.clear();
        assert!(p.of(0, uvw.view()).is_none());
    }
}
