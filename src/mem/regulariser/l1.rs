//! The sum of the image, which is its l1 norm since all pixels are positive.

use super::penalty::Regulariser;
use ndarray::Array2;

/// Favours few bright pixels.
///
/// # Reference
/// Donoho 2006, IEEE Trans. Inf. Theory 52, 1289.
#[derive(Debug, Clone, Copy)]
pub struct L1;

impl Regulariser for L1 {
    fn name(&self) -> &'static str {
        "l1"
    }

    fn add(&self, image: &Array2<f64>, weight: f64, gradient: &mut Array2<f64>, _curvature: &mut Array2<f64>) -> f64 {
        *gradient += weight;
        image.sum()
    }
}
