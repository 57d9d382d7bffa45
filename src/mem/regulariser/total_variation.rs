//! Total variation: the sum of the lengths of the gradient, smoothed near zero so that it has a derivative.

use super::penalty::Regulariser;
use crate::Result;
use crate::values::need;
use ndarray::Array2;

/// Favours plateaus with sharp edges: sum of sqrt(dx^2 + dy^2 + softening^2) - softening over the differences to the next pixel.
///
/// # Reference
/// Rudin, Osher & Fatemi 1992, Physica D 60, 259; Vogel & Oman 1996, SIAM J. Sci. Comput. 17, 227 (the bound on the curvature).
#[derive(Debug, Clone, Copy)]
pub struct TotalVariation {
    softening: f64,
}

impl TotalVariation {
    /// A penalty with this softening in flux per pixel. Differences well below it count as their square.
    ///
    /// # Errors
    /// A softening that is not positive and finite.
    pub fn new(softening: f64) -> Result<Self> {
        need("total variation", softening, softening > 0.0 && softening.is_finite(), "a positive softening in flux a pixel")?;
        Ok(Self { softening })
    }
}

impl Regulariser for TotalVariation {
    fn add(&self, image: &Array2<f64>, weight: f64, gradient: &mut Array2<f32>, stiffness: &mut Array2<f32>) -> f64 {
        let (n_m, n_l) = image.dim();
        let mut sum = 0.0;
        for i in 0..n_m {
            for j in 0..n_l {
                let v = image[(i, j)];
                let dx = if j + 1 < n_l { image[(i, j + 1)] - v } else { 0.0 };
                let dy = if i + 1 < n_m { image[(i + 1, j)] - v } else { 0.0 };
                let length = (dx * dx + dy * dy + self.softening * self.softening).sqrt();
                sum += length - self.softening;
                let (a, b) = ((weight * dx / length) as f32, (weight * dy / length) as f32);
                let bend = weight / length;
                gradient[(i, j)] -= a + b;
                // The Hessian with the length held fixed is larger than the true one.
                if j + 1 < n_l {
                    gradient[(i, j + 1)] += a;
                    stiffness[(i, j + 1)] += (bend * image[(i, j + 1)]) as f32;
                    stiffness[(i, j)] += (bend * v) as f32;
                }
                if i + 1 < n_m {
                    gradient[(i + 1, j)] += b;
                    stiffness[(i + 1, j)] += (bend * image[(i + 1, j)]) as f32;
                    stiffness[(i, j)] += (bend * v) as f32;
                }
            }
        }
        sum
    }
}
