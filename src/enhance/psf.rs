//! The point spread function of the sensor, and convolution with it.

use super::border::{padded, reflect};
use crate::fourier::{Convolver, Spectrum};
use crate::{ChainError, Result, ensure};
use cittert_arrays::Image;
use ndarray::{Array2, ArrayView2, s};

/// Two cells are the same if they differ by at most this part.
const SAME_CELL: f64 = 1e-3;
/// Values below this part of the peak are rounding errors of the file.
const ROUNDING: f64 = 1e-7;

/// How the sensor spreads a point: weights \[m, l\] around their centre, the pixel n / 2 along each axis. Their sum is 1, so that the brightness of
/// a flat scene is kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Psf {
    weights: Array2<f64>,
    cell_rad: f64,
}

impl Psf {
    /// A PSF from weights around the pixel n / 2. They are divided by their sum, and borders of zeros are cut off.
    ///
    /// # Errors
    /// Weights that are not finite, or whose sum is not above 0.
    pub fn new(weights: ArrayView2<'_, f64>, cell_rad: f64) -> Result<Self> {
        let sum = weights.sum();
        ensure!(sum.is_finite(), ChainError::Incompatible("the PSF has blank pixels (NaN or infinite)".into()));
        ensure!(sum > 0.0, ChainError::Incompatible(format!("the sum of the PSF is {sum}, expected a positive one: is it a PSF?")));
        let (n_m, n_l) = weights.dim();
        let (c_m, c_l) = (n_m / 2, n_l / 2);
        let least = ROUNDING * weights.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
        let reach = |index: fn((usize, usize)) -> usize, center: usize| {
            let used = weights.indexed_iter().filter(|(_, v)| v.abs() > least);
            used.map(|(at, _)| index(at).abs_diff(center)).max().unwrap_or(0)
        };
        let (r_m, r_l) = (reach(|at| at.0, c_m), reach(|at| at.1, c_l));
        let mut kept = Array2::zeros((2 * r_m + 1, 2 * r_l + 1));
        for ((r, c), v) in kept.indexed_iter_mut() {
            if let Some(w) = (r + c_m).checked_sub(r_m).zip((c + c_l).checked_sub(r_l)).and_then(|at| weights.get(at)) {
                *v = w / sum;
            }
        }
        let kept_sum = kept.sum();
        Ok(Self { weights: kept / kept_sum, cell_rad })
    }

    /// The PSF in the first plane of an image.
    ///
    /// # Errors
    /// As [`Psf::new`].
    pub fn of(image: &Image) -> Result<Self> {
        Self::new(image.plane(0, 0), image.grid.cell_rad)
    }

    /// The weights \[m, l\]; both sides are odd and the centre is in the middle.
    #[must_use]
    pub fn weights(&self) -> ArrayView2<'_, f64> {
        self.weights.view()
    }

    /// Refuse an image whose cell is another one.
    ///
    /// # Errors
    /// The cells differ by more than a thousandth.
    pub(super) fn check_cell(&self, cell_rad: f64) -> Result<()> {
        let same = (self.cell_rad / cell_rad - 1.0).abs() <= SAME_CELL;
        ensure!(
            same,
            ChainError::Incompatible(format!(
                "the PSF has cells of {:.6e} rad, and the image has cells of {cell_rad:.6e} rad at this step: make both with one cell",
                self.cell_rad
            ))
        );
        Ok(())
    }

    /// Refuse a PSF with values below 0.
    ///
    /// # Errors
    /// There are some, beyond rounding.
    pub(super) fn check_positive(&self) -> Result<()> {
        let negative = self.weights.iter().filter(|w| **w < 0.0).count();
        ensure!(
            negative == 0,
            ChainError::Incompatible(format!(
                "{negative} values of the PSF are below 0, which richardson-lucy cannot use: use wiener-deconvolution, or CLEAN for a dirty beam"
            ))
        );
        Ok(())
    }

    /// The weights on a plane that repeats after `rows` and `columns`, with the centre at the first pixel.
    pub(super) fn wrapped(&self, rows: usize, columns: usize) -> Array2<f64> {
        let (c_m, c_l) = (self.weights.nrows() / 2, self.weights.ncols() / 2);
        let mut out = Array2::zeros((rows, columns));
        for ((r, c), w) in self.weights.indexed_iter() {
            let wrap = |k: usize, center: usize, n: usize| (k as isize - center as isize).rem_euclid(n as isize) as usize;
            out[[wrap(r, c_m, rows), wrap(c, c_l, columns)]] += w;
        }
        out
    }
}

/// Convolution of frames of one size with a PSF and with its mirror image, with reflected borders.
pub(super) struct Blur {
    reach: (usize, usize),
    convolver: Convolver<f64>,
    forward: Spectrum<f64>,
    back: Spectrum<f64>,
}

impl Blur {
    pub(super) fn new(psf: &Psf, (n_m, n_l): (usize, usize)) -> Self {
        let reach = (psf.weights.nrows() / 2, psf.weights.ncols() / 2);
        // What wraps around falls into the reflected border, which is cut off.
        let convolver = Convolver::new((n_m + 2 * reach.0, n_l + 2 * reach.1), 0);
        let (forward, back) = (convolver.kernel(psf.weights()), convolver.kernel(psf.weights.slice(s![..;-1, ..;-1])));
        Self { reach, convolver, forward, back }
    }

    fn with(&self, frame: &Array2<f64>, kernel: &Spectrum<f64>) -> Array2<f64> {
        let wide = padded(frame.view(), self.reach.0, self.reach.1);
        let (n_m, n_l) = frame.dim();
        let out = self.convolver.convolve(wide.view(), kernel);
        out.slice(s![self.reach.0..self.reach.0 + n_m, self.reach.1..self.reach.1 + n_l]).to_owned()
    }

    /// A frame as the sensor sees it.
    pub(super) fn forward(&self, frame: &Array2<f64>) -> Array2<f64> {
        self.with(frame, &self.forward)
    }

    /// A frame convolved with the mirrored PSF.
    pub(super) fn back(&self, frame: &Array2<f64>) -> Array2<f64> {
        self.with(frame, &self.back)
    }
}

/// A frame and its mirror images, which repeat without a jump.
pub(super) fn mirrored(frame: ArrayView2<'_, f64>) -> Array2<f64> {
    let (n_m, n_l) = frame.dim();
    Array2::from_shape_fn((2 * n_m, 2 * n_l), |(r, c)| frame[[reflect(r as isize, n_m), reflect(c as isize, n_l)]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enhance::samples::noise;

    #[test]
    fn the_sum_is_one_the_centre_stays_and_zeros_go() {
        let mut weights = Array2::zeros((16, 20));
        weights[[8, 10]] = 6.0;
        weights[[7, 12]] = 2.0;
        let psf = Psf::new(weights.view(), 1e-3).unwrap();
        assert_eq!(psf.weights().dim(), (3, 5));
        assert_eq!((psf.weights()[[1, 2]], psf.weights()[[0, 4]]), (0.75, 0.25));
        assert!(psf.check_cell(1.0005e-3).is_ok() && psf.check_cell(1.1e-3).is_err());
        assert!(Psf::new(Array2::zeros((4, 4)).view(), 1e-3).is_err());
    }

    #[test]
    fn blurring_is_the_double_sum_with_reflected_borders() {
        let psf = Psf::new(Array2::from_shape_fn((5, 7), |(r, c)| (1 + r * 2 + c) as f64).view(), 1.0).unwrap();
        let frame = noise(9, 11, 13);
        let blur = Blur::new(&psf, frame.dim());
        let (forward, back) = (blur.forward(&frame), blur.back(&frame));
        for ((r, c), v) in forward.indexed_iter() {
            let sum = |sign: isize| -> f64 {
                let term = |((y, x), w): ((usize, usize), &f64)| {
                    let at = |k: usize, o: usize, half: isize, n: usize| reflect(k as isize + sign * (o as isize - half), n);
                    w * frame[[at(r, y, 2, 9), at(c, x, 3, 11)]]
                };
                psf.weights().indexed_iter().map(term).sum()
            };
            assert!((v - sum(-1)).abs() < 1e-12 && (back[[r, c]] - sum(1)).abs() < 1e-12);
        }
    }
}
