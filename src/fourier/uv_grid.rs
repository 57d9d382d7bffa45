//! The FFT of an image without kernel or padding. It gives the visibilities at the points of the conjugate grid.

use crate::Result;
use cittert_arrays::{ArrayError, SkyGrid};
use cittert_fourier_planner::{FftDirection, along};
use ndarray::{Array2, ArrayView2};
use num_complex::Complex64;

/// Visibilities \[v, u\] of an image plane \[m, l\] at u = (column - n_l / 2) / (n_l cell), v = (row - n_m / 2) / (n_m cell) wavelengths:
/// the sum of I exp(+2 pi i (u l + v m)) over the pixels, in the unit of the plane times pixels.
///
/// # Errors
/// The plane has another shape than the grid.
pub fn image_to_uv_grid(grid: &SkyGrid, plane: ArrayView2<'_, f64>) -> Result<Array2<Complex64>> {
    let (n_m, n_l) = (grid.n_m, grid.n_l);
    if plane.dim() != (n_m, n_l) {
        let found = plane.shape().to_vec();
        return Err(ArrayError::ShapeMismatch { what: "image to transform", expected: vec![n_m, n_l], found }.into());
    }
    // With the origin of both sides at n / 2, element k has the coordinate k - n / 2. This is a rotation before and after the transform.
    let place = |(i, j): (usize, usize)| ((i + n_m / 2) % n_m, (j + n_l / 2) % n_l);
    let mut vis = Array2::from_shape_fn((n_m, n_l), |at| Complex64::new(plane[place(at)], 0.0));
    along(&mut vis, 1, if grid.l_sign() < 0.0 { FftDirection::Forward } else { FftDirection::Inverse });
    along(&mut vis, 0, FftDirection::Inverse);
    Ok(Array2::from_shape_fn((n_m, n_l), |(i, j)| vis[((i + n_m - n_m / 2) % n_m, (j + n_l - n_l / 2) % n_l)]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::SkyFrame;

    #[test]
    fn agrees_with_the_sum_on_even_and_odd_grids_and_both_frames() {
        for (n_l, n_m) in [(8, 8), (7, 6), (9, 5)] {
            for frame in [SkyFrame::Boresight, SkyFrame::Sky { ra_rad: 0.0, dec_rad: 0.0, frame: "icrs".into() }] {
                let grid = SkyGrid::new(n_l, n_m, 1e-3, frame).unwrap();
                let plane = Array2::from_shape_fn((n_m, n_l), |(r, c)| ((5 * r + 3 * c) % 7) as f64);
                let vis = image_to_uv_grid(&grid, plane.view()).unwrap();
                for ((row, column), v) in vis.indexed_iter() {
                    let (u, w) = (column as f64 - (n_l / 2) as f64, row as f64 - (n_m / 2) as f64);
                    let (du, dv) = (1.0 / (n_l as f64 * 1e-3), 1.0 / (n_m as f64 * 1e-3));
                    let truth: Complex64 = plane
                        .indexed_iter()
                        .map(|((r, c), i)| {
                            let turns = u * du * grid.l_at(c as f64) + w * dv * grid.m_at(r as f64);
                            Complex64::from_polar(*i, std::f64::consts::TAU * turns)
                        })
                        .sum();
                    assert!((v - truth).norm() < 1e-11, "{n_l} {n_m} {row} {column}: {v} {truth}");
                }
            }
        }
    }
}
