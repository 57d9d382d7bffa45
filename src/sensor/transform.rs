//! Fourier transforms of complex planes whose sides are even.

use cittert_fourier_planner::{FftDirection, double};
use ndarray::{Array2, Axis};
use num_complex::Complex64;
use rayon::prelude::*;

/// Transform with exp(-2 pi i).
pub(super) fn forward(plane: Array2<Complex64>) -> Array2<Complex64> {
    along_both(plane, FftDirection::Forward)
}

/// Transform with exp(+2 pi i), divided by the number of values, so that it undoes [`forward`].
pub(super) fn back(plane: Array2<Complex64>) -> Array2<Complex64> {
    let scale = 1.0 / plane.len() as f64;
    along_both(plane, FftDirection::Inverse).mapv_into(|v| v * scale)
}

fn along_both(plane: Array2<Complex64>, direction: FftDirection) -> Array2<Complex64> {
    let rows = along_rows(plane, direction);
    let columns = along_rows(rows.reversed_axes().as_standard_layout().into_owned(), direction);
    columns.reversed_axes().as_standard_layout().into_owned()
}

fn along_rows(mut plane: Array2<Complex64>, direction: FftDirection) -> Array2<Complex64> {
    let plan = double(plane.ncols(), direction);
    plane.axis_iter_mut(Axis(0)).into_par_iter().for_each_init(
        || vec![Complex64::default(); plan.get_inplace_scratch_len()],
        |scratch, mut row| {
            if let Some(row) = row.as_slice_mut() {
                plan.process_with_scratch(row, scratch);
            }
        },
    );
    plane
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_becomes_a_point_and_comes_back() {
        let (rows, columns) = (6, 10);
        let wave = Array2::from_shape_fn((rows, columns), |(r, c)| {
            Complex64::cis(std::f64::consts::TAU * (2.0 * r as f64 / rows as f64 + 3.0 * c as f64 / columns as f64))
        });
        let found = forward(wave.clone());
        for ((r, c), v) in found.indexed_iter() {
            assert!((v - if (r, c) == (2, 3) { 60.0 } else { 0.0 }).norm() < 1e-12);
        }
        assert!(back(found).iter().zip(&wave).all(|(a, b)| (a - b).norm() < 1e-13));
    }
}
