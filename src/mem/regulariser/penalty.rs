//! The trait of all penalties.

use ndarray::Array2;
use std::fmt::Debug;

/// A penalty on a positive image.
pub trait Regulariser: Debug + Send + Sync {
    /// A short name for options and reports.
    fn name(&self) -> &'static str;

    /// The penalty of an image in flux a pixel \[m, l\], in flux.
    ///
    /// Adds `weight` times the derivative by each pixel to `gradient`, and `weight` times the second derivative, where that is not
    /// negative, to `curvature`.
    fn add(&self, image: &Array2<f64>, weight: f64, gradient: &mut Array2<f64>, curvature: &mut Array2<f64>) -> f64;
}
