//! Bilateral filter.

use super::border::{by_rows, line, padded};
use super::step::{Given, Step};
use crate::Result;
use ndarray::{Array2, ArrayView2};

#[derive(Debug)]
struct Bilateral {
    sigma: f64,
    contrast: f64,
    window: usize,
}

impl Step for Bilateral {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        Ok(bilateral(frame.view(), self.sigma, self.contrast, self.window))
    }
}

pub(super) fn make(given: &Given<'_>) -> Result<Box<dyn Step>> {
    let sigma = given.number(0);
    let window = given.optional(2).map_or(2 * (2.0 * sigma).ceil() as usize + 1, |w| w as usize);
    Ok(Box::new(Bilateral { sigma, contrast: given.number(1), window }))
}

/// The mean over a disc around each pixel, with weights that fall with the distance (standard deviation `sigma` pixels) and with the difference in
/// brightness (standard deviation `contrast`, in the unit of the plane). The disc is `window` pixels wide.
///
/// # Reference
/// Tomasi & Manduchi 1998, ICCV, 839, with the disc of OpenCV's `bilateralFilter`.
#[must_use]
pub fn bilateral(plane: ArrayView2<'_, f64>, sigma: f64, contrast: f64, window: usize) -> Array2<f64> {
    let half = (window / 2) as isize;
    let square = |x: isize| (x * x) as f64;
    let disc: Vec<(usize, usize, f64)> = (-half..=half)
        .flat_map(|dy| (-half..=half).map(move |dx| (dy, dx)))
        .filter(|(dy, dx)| dy * dy + dx * dx <= half * half)
        .map(|(dy, dx)| ((dy + half) as usize, (dx + half) as usize, (square(dy) + square(dx)) / (-2.0 * sigma * sigma)))
        .collect();
    let wide = padded(plane, half as usize, half as usize);
    let steepness = -0.5 / (contrast * contrast);
    by_rows(plane.dim(), |r, out| {
        let own = &line(&wide, r + half as usize)[half as usize..];
        for (c, o) in out.iter_mut().enumerate() {
            // Differences are summed, so that a large mean costs no digits.
            let (sum, weight) = disc.iter().fold((0.0, 0.0), |(sum, weight), (dy, dx, exponent)| {
                let difference = line(&wide, r + dy)[c + dx] - own[c];
                let w = (exponent + steepness * difference * difference).exp();
                (sum + w * difference, weight + w)
            });
            *o = own[c] + sum / weight;
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::enhance::samples::{noise, rms};
    use crate::enhance::smooth::gaussian;

    #[test]
    fn an_edge_far_above_the_contrast_stays_and_noise_below_it_falls() {
        let edge = Array2::from_shape_fn((48, 48), |(r, _)| if r < 20 { 250.0 } else { 300.0 });
        let out = bilateral((&edge + &noise(48, 48, 2)).view(), 2.0, 5.0, 9);
        let error = rms(&out - &edge);
        assert!(error < 0.35, "{error}");
        assert!((out[[19, 24]] - 250.0).abs() < 1.5 && (out[[20, 24]] - 300.0).abs() < 1.5);
    }

    #[test]
    fn without_a_limit_of_contrast_it_is_a_gaussian() {
        let plane = noise(40, 40, 3);
        let (a, b) = (bilateral(plane.view(), 1.0, 1e9, 11), gaussian(plane.view(), 1.0));
        // The Gaussian is cut off at 4 sigma in a square, the other at 5 in a disc: 1e-4 of the weight.
        assert!(rms(&a - &b) < 1e-3);
    }
}
