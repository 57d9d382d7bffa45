//! The logarithmic entropy: S = sum M (ln(I/M) - I/M + 1).

use super::penalty::Regulariser;
use ndarray::{Array2, Zip};

/// Pixels below this fraction of the prior count as this fraction: the second derivative grows as 1 / I^2.
const FLOOR: f64 = 1e-100;

/// The entropy of a Gaussian field whose variance is the image. It favours peaks more than the relative entropy does.
///
/// # Reference
/// Burg 1967, 37th meeting of the SEG; Narayan & Nityananda 1986, ARA&A 24, 127, sect. 2.
#[derive(Debug, Clone)]
pub struct Burg {
    prior: Array2<f64>,
}

impl Burg {
    /// With a prior \[m, l\], flux a pixel, positive.
    #[must_use]
    pub fn new(prior: Array2<f64>) -> Self {
        Self { prior }
    }
}

impl Regulariser for Burg {
    fn name(&self) -> &'static str {
        "log"
    }

    fn add(&self, image: &Array2<f64>, weight: f64, gradient: &mut Array2<f64>, curvature: &mut Array2<f64>) -> f64 {
        let mut terms = Array2::zeros(image.dim());
        Zip::from(&mut terms).and(image).and(&self.prior).and(gradient).and(curvature).par_for_each(|t, i, m, g, c| {
            if *m > 0.0 {
                let x = (i / m).max(FLOOR);
                *t = m * (x - x.ln() - 1.0);
                *g += weight * (1.0 - 1.0 / x);
                *c += weight / (m * x * x);
            }
        });
        terms.sum()
    }
}
