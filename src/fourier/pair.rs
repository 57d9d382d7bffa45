//! A transform and its adjoint between one image and one fixed list of rows.
//!
//! Use it for iterations that predict and grid the same rows hundreds of times. The rows are sorted into tiles once, and their order and
//! the kernels are kept.

use super::grid_options::GridOptions;
use super::plan::UvwExtent;
use super::real::Real;
use super::sorted_rows::SortedRows;
use super::transform::Transform;
use crate::{ChainError, Result};
use cittert_arrays::{Alone, ArrayError, Ranks, SkyGrid};
use ndarray::{Array2, ArrayView2, ArrayViewMut2};
use num_complex::Complex;

/// A transform and its adjoint between an image and visibilities at fixed uvw.
#[derive(Debug)]
pub struct Pair<T: Real> {
    transform: Transform<T>,
    rows: SortedRows,
    n_rows: usize,
    shape: (usize, usize),
}

impl<T: Real> Pair<T> {
    /// A pair for rows with these uvw in m \[row, 3\] and for these channels.
    ///
    /// # Errors
    /// No kernel reaches epsilon, a frequency is not positive, or a uvw is not finite.
    pub fn new(grid: &SkyGrid, freq_hz: &[f64], uvw_m: ArrayView2<'_, f64>, opts: &GridOptions) -> Result<Self> {
        Self::shared(grid, (freq_hz, uvw_m), opts, &Alone)
    }

    /// The pair of one of several processes, each of which has some of the rows. All have the same grid and kernel.
    ///
    /// # Errors
    /// As [`Pair::new`].
    pub fn shared(grid: &SkyGrid, (freq_hz, uvw_m): (&[f64], ArrayView2<'_, f64>), opts: &GridOptions, ranks: &dyn Ranks) -> Result<Self> {
        let mut n_vis = [(uvw_m.nrows() * freq_hz.len()) as f64];
        ranks.sum(&mut n_vis);
        let transform = Transform::new(grid, freq_hz, UvwExtent::of(uvw_m).shared(ranks), opts, n_vis[0] as u64)?;
        let rows = transform.sort(uvw_m)?;
        Ok(Self { transform, rows, n_rows: uvw_m.nrows(), shape: (grid.n_m, grid.n_l) })
    }

    /// Number of visibilities: rows times channels.
    #[must_use]
    pub fn n_vis(&self) -> usize {
        self.n_rows * self.transform.plan.n_chan()
    }

    fn check(&self, n_vis: usize, plane: (usize, usize)) -> Result<()> {
        let expected = vec![self.n_vis(), self.shape.0, self.shape.1];
        let found = vec![n_vis, plane.0, plane.1];
        if expected == found { Ok(()) } else { Err(ArrayError::ShapeMismatch { what: "visibilities and image", expected, found }.into()) }
    }

    /// Visibilities \[row x chan\] of an image \[m, l\]: the sum of I exp(+2 pi i (u l + v m + w (n - 1))) over the pixels.
    ///
    /// # Errors
    /// The list or the image has another size.
    pub fn predict(&mut self, plane: ArrayView2<'_, f64>, out: &mut [Complex<f64>]) -> Result<()> {
        self.check(out.len(), plane.dim())?;
        let shape = (self.n_rows, self.transform.plan.n_chan());
        let out = ArrayViewMut2::from_shape(shape, out).map_err(|e| ChainError::Internal(e.to_string()))?;
        let model = self.transform.degridder(plane)?;
        model.predict_sorted(&self.rows, out, |v| Complex::new(v.re.to64(), v.im.to64()))
    }

    /// Image \[m, l\]: the real part of the sum of V exp(-2 pi i (u l + v m + w (n - 1))); the adjoint of [`Pair::predict`].
    ///
    /// `scale` multiplies the visibilities before they are rounded to `T`, so that a large unit cannot overflow it.
    ///
    /// # Errors
    /// The list has another size.
    pub fn adjoint(&mut self, vis: &[Complex<f64>], scale: f64) -> Result<Array2<f64>> {
        self.check(vis.len(), self.shape)?;
        let n_chan = self.transform.plan.n_chan();
        let mut gridder = self.transform.gridder();
        gridder.add_sorted(&self.rows, |row, out| {
            let from = &vis[row * n_chan..(row + 1) * n_chan];
            out.iter_mut().zip(from).for_each(|(o, v)| *o = Complex::new(T::of(v.re * scale), T::of(v.im * scale)));
        })?;
        Ok(gridder.finish())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::Noise;
    use crate::fourier::fixtures::{image_to_vis_exact, vis_to_image};
    use cittert_arrays::SkyFrame;
    use num_complex::Complex64;

    fn rows(n: usize, reach: [f64; 3]) -> Array2<f64> {
        Array2::from_shape_fn((n, 3), |(r, k)| reach[k] * ((((r * 37 + k * 11) * 7919) % 1009) as f64 / 504.0 - 1.0))
    }

    #[test]
    fn it_gives_what_the_single_transforms_give_time_after_time() {
        let grid = SkyGrid::new(40, 30, 2e-3, SkyFrame::Boresight).unwrap();
        let freq: Vec<f64> = (0..11).map(|c| 90e9 + 0.2e9 * f64::from(c)).collect();
        for reach in [[0.3, 0.4, 0.0], [0.3, 0.4, 0.2]] {
            let uvw = rows(200, reach);
            let opts = GridOptions { epsilon: 1e-9, ..GridOptions::default() };
            let mut pair = Pair::<f64>::new(&grid, &freq, uvw.view(), &opts).unwrap();
            let mut out = vec![Complex64::default(); pair.n_vis()];
            for turn in 0..2_u64 {
                let mut noise = Noise(turn);
                let plane = Array2::from_shape_fn((30, 40), |_| noise.next());
                let expected = image_to_vis_exact(&grid, plane.view(), uvw.view(), &freq, (true, false));
                pair.predict(plane.view(), &mut out).unwrap();
                let size = |z: &mut dyn Iterator<Item = Complex64>| z.map(|z| z.norm_sqr()).sum::<f64>().sqrt();
                let apart = size(&mut out.iter().zip(&expected).map(|(a, b)| a - b)) / size(&mut expected.iter().copied());
                assert!(apart < opts.epsilon, "{reach:?} {apart}");
                let vis = Array2::from_shape_vec((200, 11), out.clone()).unwrap();
                let ones = Array2::ones((200, 11));
                let back = vis_to_image(&grid, uvw.view(), &freq, vis.view(), ones.view(), &opts).unwrap();
                let mine = pair.adjoint(&out, 0.5).unwrap() * 2.0;
                let norm = |a: &Array2<f64>| a.iter().map(|v| v * v).sum::<f64>().sqrt();
                // The single transform chooses another grid. The two agree to the sum of their errors, which are relative to the whole
                // image.
                let error = norm(&(&mine - &back)) / norm(&back);
                assert!(error < 2.0 * opts.epsilon, "{reach:?} {error}");
            }
        }
    }

    #[test]
    fn lists_and_images_of_another_size_are_refused() {
        let grid = SkyGrid::new(8, 8, 1e-3, SkyFrame::Boresight).unwrap();
        let mut pair = Pair::<f32>::new(&grid, &[1e11], rows(5, [0.1, 0.1, 0.0]).view(), &GridOptions::default()).unwrap();
        assert!(pair.predict(Array2::zeros((8, 9)).view(), &mut [Complex64::default(); 5]).is_err());
        assert!(pair.adjoint(&[Complex64::default(); 4], 1.0).is_err());
        let mut bad = rows(5, [0.1, 0.1, 0.0]);
        bad[(3, 1)] = f64::NAN;
        assert!(Pair::<f32>::new(&grid, &[1e11], bad.view(), &GridOptions::default()).is_err());
    }
}
