//! Unsharp masking.

use super::smooth::gaussian;
use super::step::{Given, Step};
use crate::Result;
use ndarray::{Array2, ArrayView2, Zip};

#[derive(Debug)]
struct Unsharp {
    sigma: f64,
    amount: f64,
    threshold: f64,
}

impl Step for Unsharp {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        Ok(unsharp(frame.view(), self.sigma, self.amount, self.threshold))
    }
}

pub(super) fn make(given: &Given<'_>) -> Result<Box<dyn Step>> {
    Ok(Box::new(Unsharp { sigma: given.number(0), amount: given.number(1), threshold: given.optional(2).unwrap_or(0.0) }))
}

/// Add `amount` times the difference from the plane smoothed with a Gaussian of `sigma` pixels, where that difference is larger than
/// `threshold`.
///
/// # Reference
/// Gonzalez & Woods 2018, Digital Image Processing, 4th ed., section 3.6, as `skimage.filters.unsharp_mask` has it.
#[must_use]
pub fn unsharp(plane: ArrayView2<'_, f64>, sigma: f64, amount: f64, threshold: f64) -> Array2<f64> {
    let soft = gaussian(plane, sigma);
    Zip::from(&plane).and(&soft).map_collect(|v, s| if (v - s).abs() < threshold { *v } else { v + amount * (v - s) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enhance::samples::noise;

    #[test]
    fn an_edge_is_steeper_and_noise_below_the_threshold_stays() {
        let edge = Array2::from_shape_fn((32, 32), |(_, c)| 280.0 + 20.0 / (1.0 + (-(c as f64 - 15.5)).exp()));
        let out = unsharp(edge.view(), 2.0, 1.0, 0.0);
        assert!(out[[9, 16]] - out[[9, 15]] > 1.3 * (edge[[9, 16]] - edge[[9, 15]]));
        let flat = noise(32, 32, 11) * 0.1;
        assert_eq!(unsharp(flat.view(), 2.0, 1.0, 1.0), flat);
    }
}
