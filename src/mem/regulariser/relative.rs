//! Entropy relative to a prior: S = -sum I (ln(I/M) - 1).

use super::penalty::Regulariser;
use ndarray::{Array2, Zip};

/// Pixels below this fraction of the prior count as this fraction, so that the logarithm is always finite.
const FLOOR: f64 = 1e-250;

/// The entropy of configurations, with a prior image.
///
/// # Reference
/// Cornwell & Evans 1985, A&A 143, 77, eq. 4; Narayan & Nityananda 1986, ARA&A 24, 127.
#[derive(Debug, Clone)]
pub struct RelativeEntropy {
    prior: Array2<f64>,
}

impl RelativeEntropy {
    /// With a prior \[m, l\], flux a pixel, positive.
    #[must_use]
    pub fn new(prior: Array2<f64>) -> Self {
        Self { prior }
    }
}

impl Regulariser for RelativeEntropy {
    fn name(&self) -> &'static str {
        "relative"
    }

    fn add(&self, image: &Array2<f64>, weight: f64, gradient: &mut Array2<f64>, curvature: &mut Array2<f64>) -> f64 {
        let mut terms = Array2::zeros(image.dim());
        Zip::from(&mut terms).and(image).and(&self.prior).and(gradient).and(curvature).par_for_each(|t, i, m, g, c| {
            if *m > 0.0 {
                let i = i.max(FLOOR * m);
                let log = (i / m).ln();
                *t = i * (log - 1.0);
                *g += weight * log;
                *c += weight / i;
            }
        });
        terms.sum()
    }
}
