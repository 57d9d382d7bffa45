//! Upsampling by the Fourier series of the frame.

use super::border::{by_rows, line};
use super::resample::{Placing, position};
use super::step::{Given, Step};
use crate::Result;
use cittert_fourier_planner::{Fft, FftDirection, double};
use ndarray::{Array2, ArrayView2};
use num_complex::Complex64;
use std::sync::Arc;

#[derive(Debug)]
struct BandLimited {
    factor: usize,
}

impl Step for BandLimited {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        Ok(band_limited(frame.view(), self.factor))
    }

    fn factor(&self) -> usize {
        self.factor
    }
}

pub(super) fn make(given: &Given<'_>) -> Result<Box<dyn Step>> {
    Ok(Box::new(BandLimited { factor: given.whole(0) }))
}

/// A plane \[m, l\] with `factor` times as many pixels along each axis: the series of the frame and its mirror images, evaluated at
/// the new pixels. No frequency is damped or added. The mirror images spare it the jump of a frame that is repeated as it is.
///
/// # Reference
/// Fraser 1989, IEEE Trans. ASSP 37, 668.
#[must_use]
pub fn band_limited(plane: ArrayView2<'_, f64>, factor: usize) -> Array2<f64> {
    let across = longer_rows(&plane.as_standard_layout().into_owned(), factor);
    let down = longer_rows(&across.t().as_standard_layout().into_owned(), factor);
    down.t().as_standard_layout().into_owned()
}

fn longer_rows(plane: &Array2<f64>, factor: usize) -> Array2<f64> {
    let (rows, n) = plane.dim();
    let (short, long) = (2 * n, 2 * n * factor);
    let forward: Arc<dyn Fft<f64>> = double(short, FftDirection::Forward);
    let back = double(long, FftDirection::Inverse);
    let start = (position(0, n, factor, Placing::Reference) * factor as f64).round() as isize;
    by_rows((rows, n * factor), |r, out| {
        let from = line(plane, r);
        let mut z: Vec<Complex64> = from.iter().chain(from.iter().rev()).map(|v| Complex64::from(*v)).collect();
        forward.process(&mut z);
        let mut fine = vec![Complex64::default(); long];
        fine[..n].copy_from_slice(&z[..n]);
        // The frequency of n turns is 0: the terms of a pixel and of its mirror image cancel.
        fine[long - n + 1..].copy_from_slice(&z[n + 1..]);
        back.process(&mut fine);
        for (i, o) in out.iter_mut().enumerate() {
            *o = fine[(i as isize + start).rem_euclid(long as isize) as usize].re / short as f64;
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enhance::samples::noise;
    use std::f64::consts::PI;

    #[test]
    fn it_is_the_cosine_series_of_the_line() {
        for (n, factor) in [(8, 2), (9, 2), (9, 3), (5, 4)] {
            let plane = noise(1, n, 7);
            let found = longer_rows(&plane, factor);
            for (i, v) in found.iter().enumerate() {
                let x = position(i, n, factor, Placing::Reference);
                let term = |k: usize| {
                    let c: f64 = (0..n).map(|j| plane[[0, j]] * (PI * k as f64 * (j as f64 + 0.5) / n as f64).cos()).sum();
                    let twice = if k == 0 { 1.0 } else { 2.0 };
                    twice * c / n as f64 * (PI * k as f64 * (x + 0.5) / n as f64).cos()
                };
                assert!((v - (0..n).map(term).sum::<f64>()).abs() < 1e-12, "{n} {factor} {i}");
            }
        }
    }
}
