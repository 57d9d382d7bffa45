//! A weighted sum of penalties.

use super::penalty::Regulariser;
use crate::{ChainError, Result};
use ndarray::Array2;

/// A weighted sum of penalties.
#[derive(Debug, Default)]
pub struct WeightedSum(Vec<(f64, Box<dyn Regulariser>)>);

impl WeightedSum {
    /// The first penalty with weight 1.
    #[must_use]
    pub fn of(first: Box<dyn Regulariser>) -> Self {
        Self(vec![(1.0, first)])
    }

    /// Add a penalty with its weight.
    ///
    /// # Errors
    /// A weight that is negative or not finite.
    pub fn and(mut self, weight: f64, next: Box<dyn Regulariser>) -> Result<Self> {
        if !(weight >= 0.0 && weight.is_finite()) {
            let expected = format!("a weight of 0 or more for {}", next.name());
            return Err(ChainError::BadOption { option: "regulariser", value: weight.to_string(), expected });
        }
        self.0.push((weight, next));
        Ok(self)
    }

    /// Names and weights.
    pub fn parts(&self) -> impl Iterator<Item = (&'static str, f64)> + '_ {
        self.0.iter().map(|(w, r)| (r.name(), *w))
    }
}

impl Regulariser for WeightedSum {
    fn name(&self) -> &'static str {
        "sum"
    }

    fn add(&self, image: &Array2<f64>, weight: f64, gradient: &mut Array2<f64>, curvature: &mut Array2<f64>) -> f64 {
        self.0.iter().map(|(w, r)| w * r.add(image, weight * w, gradient, curvature)).sum()
    }
}
