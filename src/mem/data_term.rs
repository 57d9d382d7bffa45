//! What chi squared needs of the data: its value and its gradient for an image.

use crate::Result;
use crate::imaging::ImageMisfit;
use ndarray::ArrayView2;
use num_complex::Complex64;

/// Chi squared as a function of the image.
pub(super) trait DataTerm {
    /// The number of real data, which is the expected value of chi squared.
    fn data(&self) -> f64;

    /// Chi squared and its gradient for a finite image \[m, l\] in flux per pixel.
    fn misfit(&mut self, image: ArrayView2<'_, f64>) -> Result<ImageMisfit>;

    /// Visibilities \[row x chan\] of an image \[m, l\] in flux per pixel.
    fn predict(&mut self, image: ArrayView2<'_, f64>) -> Result<&[Complex64]>;
}
