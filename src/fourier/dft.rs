//! The direct sums of both directions. The tests compare every fast transform with them.

use cittert_arrays::{SPEED_OF_LIGHT_M_S, SkyGrid};
use ndarray::{Array2, ArrayView2};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Phase in rad of a pixel in the visibility of `uvw` (m) at `freq_hz`, and n of the pixel. `None` behind the horizon.
fn phase(grid: &SkyGrid, (row, column): (usize, usize), uvw: [f64; 3], freq_hz: f64, w_term: bool) -> Option<(f64, f64)> {
    let (l, m) = (grid.l_at(column as f64), grid.m_at(row as f64));
    let r2 = l * l + m * m;
    let n = (1.0 - r2).max(0.0).sqrt();
    let depth = if w_term { uvw[2] * (-r2 / (1.0 + n)) } else { 0.0 };
    (r2 < 1.0).then(|| (TAU * freq_hz / SPEED_OF_LIGHT_M_S * (uvw[0] * l + uvw[1] * m + depth), n))
}

/// V = sum of I exp(+2 pi i (u l + v m + w (n - 1))) over the pixels in front of the horizon, \[row, chan\].
#[must_use]
pub fn image_to_vis_exact(
    grid: &SkyGrid,
    plane: ArrayView2<'_, f64>,
    uvw_m: ArrayView2<'_, f64>,
    freq_hz: &[f64],
    (w_term, divide_by_n): (bool, bool),
) -> Array2<Complex64> {
    Array2::from_shape_fn((uvw_m.nrows(), freq_hz.len()), |(r, c)| {
        let uvw = [uvw_m[(r, 0)], uvw_m[(r, 1)], uvw_m[(r, 2)]];
        let pixels = plane.indexed_iter().filter(|(_, v)| **v != 0.0);
        let terms = pixels.filter_map(|(at, v)| phase(grid, at, uvw, freq_hz[c], w_term).map(|p| (p, v)));
        terms.map(|((a, n), v)| Complex64::from_polar(1.0, a) * if divide_by_n { v / n } else { *v }).sum()
    })
}

/// Real part of the sum of w V exp(-2 pi i (u l + v m + w (n - 1))) over the visibilities, \[m, l\]; 0 behind the horizon.
#[must_use]
pub fn vis_to_image_exact(
    grid: &SkyGrid,
    uvw_m: ArrayView2<'_, f64>,
    freq_hz: &[f64],
    (vis, weights): (ArrayView2<'_, Complex64>, ArrayView2<'_, f64>),
    (w_term, divide_by_n): (bool, bool),
) -> Array2<f64> {
    Array2::from_shape_fn((grid.n_m, grid.n_l), |at| {
        let mut sum = 0.0;
        for ((r, c), v) in vis.indexed_iter() {
            let uvw = [uvw_m[(r, 0)], uvw_m[(r, 1)], uvw_m[(r, 2)]];
            if let Some((a, n)) = phase(grid, at, uvw, freq_hz[c], w_term) {
                sum += weights[(r, c)] * (v * Complex64::from_polar(1.0, -a)).re / if divide_by_n { n } else { 1.0 };
            }
        }
        sum
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::SkyFrame;
    use ndarray::{Array2, array};

    #[test]
    fn one_pixel_gives_its_own_fringe_and_the_fringe_gives_it_back() {
        let grid = SkyGrid::new(8, 6, 0.01, SkyFrame::Sky { ra_rad: 0.0, dec_rad: 0.0, frame: "icrs".into() }).unwrap();
        let mut plane = Array2::zeros((6, 8));
        plane[(5, 1)] = 2.0; // l = +0.03 (left of the centre), m = +0.02
        let uvw = array![[3.0, -4.0, 5.0]];
        let freq = [SPEED_OF_LIGHT_M_S]; // one metre of wavelength
        let vis = image_to_vis_exact(&grid, plane.view(), uvw.view(), &freq, (true, true));
        let n = (1.0 - 0.0009 - 0.0004_f64).sqrt();
        let expected = Complex64::from_polar(2.0 / n, TAU * (3.0 * 0.03 - 4.0 * 0.02 + 5.0 * (n - 1.0)));
        assert!((vis[(0, 0)] - expected).norm() < 1e-13);
        let image = vis_to_image_exact(&grid, uvw.view(), &freq, (vis.view(), array![[0.5]].view()), (true, true));
        assert!((image[(5, 1)] - 1.0 / (n * n)).abs() < 1e-13);
    }
}
