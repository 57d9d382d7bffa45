//! Sharpening by the Laplacian.

use super::border::{by_rows, line, reflect};
use super::step::{Given, Step};
use crate::Result;
use ndarray::{Array2, ArrayView2, Zip};

#[derive(Debug)]
struct Sharpen {
    amount: f64,
}

impl Step for Sharpen {
    fn apply(&self, frame: Array2<f64>) -> Result<Array2<f64>> {
        Ok(sharpen(frame.view(), self.amount))
    }
}

pub(super) fn make(given: &Given<'_>) -> Result<Box<dyn Step>> {
    Ok(Box::new(Sharpen { amount: given.number(0) }))
}

/// The Laplacian from the four neighbours of each pixel.
#[must_use]
pub fn laplacian(plane: ArrayView2<'_, f64>) -> Array2<f64> {
    let plane = plane.as_standard_layout().into_owned();
    let (n_m, n_l) = plane.dim();
    by_rows((n_m, n_l), |r, out| {
        let at = |k: isize| line(&plane, reflect(r as isize + k, n_m));
        let (above, own, below) = (at(-1), at(0), at(1));
        for (c, o) in out.iter_mut().enumerate() {
            let beside = own[reflect(c as isize - 1, n_l)] + own[reflect(c as isize + 1, n_l)];
            *o = above[c] + below[c] + beside - 4.0 * own[c];
        }
    })
}

/// Subtract `amount` times the [`laplacian`].
///
/// # Reference
/// Gonzalez & Woods 2018, Digital Image Processing, 4th ed., section 3.6.
#[must_use]
pub fn sharpen(plane: ArrayView2<'_, f64>, amount: f64) -> Array2<f64> {
    Zip::from(&plane).and(&laplacian(plane)).map_collect(|v, l| v - amount * l)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_has_its_curvature_and_the_mean_is_kept() {
        let plane = Array2::from_shape_fn((9, 12), |(r, c)| (r * r) as f64 + 0.5 * (c * c) as f64);
        let found = laplacian(plane.view());
        assert!(found.slice(ndarray::s![1..8, 1..11]).iter().all(|v| (v - 3.0).abs() < 1e-12));
        assert!((sharpen(plane.view(), 0.7).mean().unwrap() - plane.mean().unwrap()).abs() < 1e-12);
    }
}
