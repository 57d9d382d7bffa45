//! Lanczos upsampling.

use super::resample::{Kernel, Placing, resample};
use super::step::{Given, Step};
use crate::Result;
use ndarray::{Array2, ArrayView2};
use std::f64::consts::PI;

#[derive(Debug)]
struct Lanczos {
    factor: usize,
    lobes: usize,
}

impl Step for Lanczos {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        Ok(lanczos(frame.view(), self.factor, self.lobes, Placing::Reference))
    }

    fn factor(&self) -> usize {
        self.factor
    }
}

pub(super) fn make(given: &Given<'_>) -> Result<Box<dyn Step>> {
    Ok(Box::new(Lanczos { factor: given.whole(0), lobes: given.whole(1) }))
}

/// A plane \[m, l\] with `factor` times as many pixels along each axis, by a sinc whose first `lobes` lobes are kept under the main lobe of a wider
/// sinc. The weights of each pixel are divided by their sum.
///
/// # Reference
/// Duchon 1979, J. Appl. Meteor. 18, 1016. OpenCV's `INTER_LANCZOS4` has 4 lobes.
#[must_use]
pub fn lanczos(plane: ArrayView2<'_, f64>, factor: usize, lobes: usize, placing: Placing) -> Array2<f64> {
    let sinc = |x: f64| if x < 1e-9 { 1.0 } else { (PI * x).sin() / (PI * x) };
    let wide = lobes as f64;
    let value = |x: f64| if x < wide { sinc(x) * sinc(x / wide) } else { 0.0 };
    resample(plane, factor, &Kernel { reach: lobes, value }, placing)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndarray::s;

    #[test]
    fn old_pixels_stay_and_a_slow_wave_is_continued() {
        let wave = |y: f64, x: f64| (0.5 * y).cos() + (0.4 * x + 0.3).sin();
        let plane = Array2::from_shape_fn((32, 30), |(r, c)| wave(r as f64, c as f64));
        let out = lanczos(plane.view(), 2, 4, Placing::Reference);
        assert!((&out.slice(s![..;2, ..;2]) - &plane).iter().all(|v| v.abs() < 1e-12));
        let inner = out.slice(s![8..56, 8..52]);
        assert!(inner.indexed_iter().all(|((r, c), v)| (v - wave((r + 8) as f64 / 2.0, (c + 8) as f64 / 2.0)).abs() < 5e-3));
    }
}
