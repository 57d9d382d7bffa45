//! Bilinear upsampling.

use super::resample::{Kernel, Placing, resample};
use super::step::{Given, Step};
use crate::Result;
use ndarray::{Array2, ArrayView2};

#[derive(Debug)]
struct Bilinear {
    factor: usize,
}

impl Step for Bilinear {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        Ok(bilinear(frame.view(), self.factor, Placing::Reference))
    }

    fn factor(&self) -> usize {
        self.factor
    }
}

pub(super) fn make(given: &Given<'_>) -> Result<Box<dyn Step>> {
    Ok(Box::new(Bilinear { factor: given.whole(0) }))
}

/// A plane \[m, l\] with `factor` times as many pixels along each axis, on straight lines between the old ones. It cannot overshoot.
#[must_use]
pub fn bilinear(plane: ArrayView2<'_, f64>, factor: usize, placing: Placing) -> Array2<f64> {
    resample(plane, factor, &Kernel { reach: 1, value: |x: f64| (1.0 - x).max(0.0) }, placing)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::s;

    #[test]
    fn a_plane_slope_is_continued_between_the_pixels() {
        let plane = Array2::from_shape_fn((10, 12), |(r, c)| 3.0 * r as f64 - 2.0 * c as f64);
        let out = bilinear(plane.view(), 4, Placing::Reference);
        let at = |(r, c): (usize, usize)| 3.0 * r as f64 / 4.0 - 2.0 * c as f64 / 4.0;
        // Three new rows and columns lie beyond the last old pixel.
        assert!(out.slice(s![..36, ..44]).indexed_iter().all(|(i, v)| (v - at(i)).abs() < 1e-12));
    }
}
