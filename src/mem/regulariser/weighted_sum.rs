//! A weighted sum of penalties.

use super::penalty::Regulariser;
use ndarray::Array2;

/// A weighted sum of penalties.
#[derive(Debug, Default)]
pub struct WeightedSum(pub Vec<(f64, Box<dyn Regulariser>)>);

impl Regulariser for WeightedSum {
    fn add(&self, image: &Array2<f64>, weight: f64, gradient: &mut Array2<f32>, stiffness: &mut Array2<f32>) -> f64 {
        self.0.iter().map(|(w, r)| w * r.add(image, weight * w, gradient, stiffness)).sum()
    }
}

/// Favours few bright pixels: the sum of the image, which is its l1 norm since all pixels are positive.
///
/// # Reference
/// Donoho 2006, IEEE Trans. Inf. Theory 52, 1289.
#[derive(Debug, Clone, Copy)]
pub struct L1;

impl Regulariser for L1 {
    fn add(&self, image: &Array2<f64>, weight: f64, gradient: &mut Array2<f32>, _stiffness: &mut Array2<f32>) -> f64 {
        *gradient += weight as f32;
        image.sum()
    }
}
