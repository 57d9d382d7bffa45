//! The entropy of Gull and Skilling: S = sum I - M - I ln(I/M). It is 0 if the image equals its prior, and negative otherwise.

use super::penalty::Regulariser;
use super::relative::RelativeEntropy;
use ndarray::Array2;

/// The relative entropy minus its largest value. It differs from [`RelativeEntropy`] by the flux of the prior, so both lead to the same
/// image. Bayesian weights use the value of this form.
///
/// # Reference
/// Gull & Skilling 1984, IEE Proc. F 131, 646; Skilling & Bryan 1984, MNRAS 211, 111.
#[derive(Debug, Clone)]
pub struct GullSkilling {
    entropy: RelativeEntropy,
    flux: f64,
}

impl GullSkilling {
    /// With a prior \[m, l\], flux a pixel, positive.
    #[must_use]
    pub fn new(prior: Array2<f64>) -> Self {
        let flux = prior.iter().filter(|m| **m > 0.0).sum();
        Self { entropy: RelativeEntropy::new(prior), flux }
    }
}

impl Regulariser for GullSkilling {
    fn name(&self) -> &'static str {
        "gull-skilling"
    }

    fn add(&self, image: &Array2<f64>, weight: f64, gradient: &mut Array2<f64>, curvature: &mut Array2<f64>) -> f64 {
        self.entropy.add(image, weight, gradient, curvature) + self.flux
    }
}
