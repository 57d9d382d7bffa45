//! Entropies relative to a prior image M, each a sum over the pixels.
//!
//! # Reference
//! Relative: Cornwell & Evans 1985, A&A 143, 77, eq. 4; Narayan & Nityananda 1986, ARA&A 24, 127.
//! Gull and Skilling: Gull & Skilling 1984, IEE Proc. F 131, 646; Skilling & Bryan 1984, MNRAS 211, 111.
//! Logarithmic: Burg 1967, 37th meeting of the SEG; Narayan & Nityananda 1986, sect. 2.

use super::penalty::Regulariser;
use crate::{ChainError, Result};
use ndarray::{ArcArray2, Array1, Array2, Zip};
use serde::{Deserialize, Serialize};

/// Forms of the entropy S.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum, schemars::JsonSchema))]
pub enum Entropy {
    /// S = -sum I (ln(I/M) - 1), the entropy of configurations.
    #[default]
    Relative,
    /// S = sum I - M - I ln(I/M). It is 0 at the prior, and leads to the same image as the relative entropy.
    GullSkilling,
    /// S = sum M (ln(I/M) - I/M + 1), the entropy of a Gaussian field. It favours peaks more than the relative entropy does.
    Log,
}

/// Pixels below this fraction of the prior count as this fraction, so that the logarithm is always finite.
const FLOOR: f64 = 1e-250;
/// The same for the logarithmic entropy, whose second derivative grows as 1 / I^2.
const FLOOR_LOG: f64 = 1e-100;

impl Entropy {
    /// The entropy relative to a prior \[m, l\], flux a pixel, which [`check_prior`] has accepted.
    #[must_use]
    pub fn of(self, prior: ArcArray2<f32>) -> PriorEntropy {
        PriorEntropy { form: self, prior }
    }

    /// Minus the entropy of a pixel with its first and second derivative.
    fn pixel(self, i: f64, m: f64) -> [f64; 3] {
        match self {
            Self::Relative | Self::GullSkilling => {
                let i = i.max(FLOOR * m);
                let log = (i / m).ln();
                let most = if self == Self::GullSkilling { m } else { 0.0 };
                [i * (log - 1.0) + most, log, 1.0 / i]
            }
            Self::Log => {
                let x = (i / m).max(FLOOR_LOG);
                [m * (x - x.ln() - 1.0), 1.0 - 1.0 / x, 1.0 / (m * x * x)]
            }
        }
    }
}

/// An entropy relative to a prior.
#[derive(Debug, Clone)]
pub struct PriorEntropy {
    form: Entropy,
    prior: ArcArray2<f32>,
}

impl Regulariser for PriorEntropy {
    fn add(&self, image: &Array2<f64>, weight: f64, gradient: &mut Array2<f32>, stiffness: &mut Array2<f32>) -> f64 {
        // The sums of the rows have a fixed order, so that any number of threads gives the same sum.
        let mut sums = Array1::zeros(image.nrows());
        let rows = Zip::from(&mut sums).and(image.rows()).and(self.prior.rows()).and(gradient.rows_mut()).and(stiffness.rows_mut());
        rows.par_for_each(|sum, image, prior, gradient, stiffness| {
            Zip::from(image).and(prior).and(gradient).and(stiffness).for_each(|i, m, g, c| {
                if *m > 0.0 {
                    let [value, slope, bend] = self.form.pixel(*i, f64::from(*m));
                    *sum += value;
                    *g += (weight * slope) as f32;
                    *c += (weight * bend * i) as f32;
                }
            });
        });
        sums.sum()
    }
}

/// Refuse a prior with pixels that are not positive.
///
/// # Errors
/// A pixel (inside the mask, if there is one) is not positive and finite.
pub fn check_prior(prior: &ArcArray2<f32>, inside: Option<&Array2<bool>>) -> Result<()> {
    let bad = |((i, j), v): &((usize, usize), &f32)| !(**v > 0.0 && v.is_finite()) && inside.is_none_or(|m| m[(*i, *j)]);
    match prior.indexed_iter().find(bad) {
        None => Ok(()),
        Some(((row, column), v)) => {
            let value = format!("{v} at column {column}, row {row}");
            Err(ChainError::bad_option("prior", value, "a prior that is positive and finite in every pixel"))
        }
    }
}
