//! Separable smoothing: means over windows and Gaussians.

use super::border::{by_rows, by_rows_with, line, reflect};
use ndarray::{Array2, ArrayView2};

/// A Gaussian is cut off at this multiple of its standard deviation, as in `scipy.ndimage.gaussian_filter`. Beyond lie 6e-5 of it.
const TRUNCATE: f64 = 4.0;

/// Weights of a Gaussian of standard deviation `sigma` pixels. Their sum is 1.
pub(super) fn gaussian_taps(sigma: f64) -> Vec<f64> {
    let reach = (TRUNCATE * sigma + 0.5) as i64;
    let raw: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / sigma).powi(2)).exp()).collect();
    let sum: f64 = raw.iter().sum();
    raw.into_iter().map(|w| w / sum).collect()
}

/// A plane \[m, l\] convolved along both axes with the same symmetric weights, of odd number.
pub(super) fn separable(plane: ArrayView2<'_, f64>, taps: &[f64]) -> Array2<f64> {
    let plane = plane.as_standard_layout().into_owned();
    let (n_m, n_l) = plane.dim();
    let half = (taps.len() / 2) as isize;
    let down = by_rows((n_m, n_l), |r, out| {
        for (k, tap) in taps.iter().enumerate() {
            let from = line(&plane, reflect(r as isize + k as isize - half, n_m));
            out.iter_mut().zip(from).for_each(|(o, v)| *o += tap * v);
        }
    });
    let wide = || vec![0.0; n_l + taps.len()];
    by_rows_with((n_m, n_l), wide, |wide, r, out| {
        let from = line(&down, r);
        for (c, w) in wide.iter_mut().enumerate() {
            *w = from[reflect(c as isize - half, n_l)];
        }
        for (k, tap) in taps.iter().enumerate() {
            out.iter_mut().zip(&wide[k..]).for_each(|(o, v)| *o += tap * v);
        }
    })
}

/// A plane smoothed with a Gaussian of standard deviation `sigma` pixels.
///
/// # Reference
/// The definition of `scipy.ndimage.gaussian_filter` with mode `reflect`.
#[must_use]
pub fn gaussian(plane: ArrayView2<'_, f64>, sigma: f64) -> Array2<f64> {
    separable(plane, &gaussian_taps(sigma))
}

/// The mean over a square window of odd width around each pixel.
pub(super) fn window_mean(plane: ArrayView2<'_, f64>, window: usize) -> Array2<f64> {
    separable(plane, &vec![1.0 / window as f64; window])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_becomes_a_gaussian_and_a_constant_stays() {
        let mut plane = Array2::zeros((21, 25));
        plane[[10, 12]] = 1.0;
        let out = gaussian(plane.view(), 1.5);
        assert!((out.sum() - 1.0).abs() < 1e-14);
        let ratio = out[[12, 11]] / out[[10, 12]];
        assert!((ratio - (-5.0 / (2.0 * 2.25_f64)).exp()).abs() < 1e-14);
        let flat = gaussian(Array2::from_elem((9, 4), 287.3).view(), 3.0);
        assert!(flat.iter().all(|v| (v - 287.3).abs() < 1e-12));
    }
}
