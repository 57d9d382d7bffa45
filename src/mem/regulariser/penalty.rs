//! The trait of all penalties.

use ndarray::Array2;
use std::fmt::Debug;

/// A penalty on a positive image.
pub trait Regulariser: Debug + Send + Sync {
    /// The penalty of an image in flux per pixel \[m, l\]. Its unit is that of flux.
    ///
    /// Adds `weight` times the derivative with respect to each pixel to `gradient`. Adds `weight` times the second derivative and the
    /// pixel, if this is not negative, to `stiffness`: the derivative alone is out of the range of single precision at the darkest pixels.
    fn add(&self, image: &Array2<f64>, weight: f64, gradient: &mut Array2<f32>, stiffness: &mut Array2<f32>) -> f64;
}
