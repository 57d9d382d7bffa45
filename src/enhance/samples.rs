//! Frames for tests.

use crate::random::stream;
use ndarray::Array2;
use rand_distr::{Distribution, StandardNormal};

/// Normal noise of standard deviation 1, the same in every run.
pub(crate) fn noise(n_m: usize, n_l: usize, seed: u64) -> Array2<f64> {
    let mut rng = stream(seed, "enhance", 0);
    Array2::from_shape_simple_fn((n_m, n_l), || StandardNormal.sample(&mut rng))
}

/// Root mean square.
pub(crate) fn rms(values: Array2<f64>) -> f64 {
    (values.mapv(|v| v * v).sum() / values.len() as f64).sqrt()
}
