//! What chi squared needs of the data: its value and its gradient for an image.

use crate::Result;
use crate::imaging::ImageMisfit;
use ndarray::{ArrayView2, CowArray, Ix2};
use num_complex::Complex64;

/// Chi squared as a function of the image.
pub(super) trait DataTerm {
    /// The number of real data, which is the expected value of chi squared.
    fn data(&self) -> f64;

    /// Chi squared and its gradient for a finite image \[m, l\] in flux per pixel. An image that is given away is dropped when it is not
    /// needed any more.
    fn misfit(&mut self, image: CowArray<'_, f64, Ix2>) -> Result<ImageMisfit>;

    /// Visibilities \[row x chan\] of an image \[m, l\] in flux per pixel.
    fn predict(&mut self, image: ArrayView2<'_, f64>) -> Result<&[Complex64]>;
}
