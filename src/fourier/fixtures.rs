//! Transforms of whole sets for tests: the direct sums, which are the truth, and the fast transforms in one call.

use super::degridder::Degridder;
use super::grid_options::GridOptions;
use super::gridder::Gridder;
use super::plan::UvwExtent;
use super::real::Real;
use crate::Result;
use cittert_arrays::{SPEED_OF_LIGHT_M_S, SkyGrid};
use ndarray::{Array2, ArrayView2, Zip};
use num_complex::{Complex, Complex64};
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

/// Visibilities \[row, chan\] of an image `plane` \[m, l\] at `uvw_m` (m, \[row, 3\]) and `freq_hz` \[chan\].
///
/// The unit is that of the plane times pixels. Pixels behind the horizon do not contribute.
///
/// # Errors
/// The shapes differ, a pixel or a uvw is not finite, or epsilon is outside 1e-13 to 0.5.
///
/// # Reference
/// Arras, Reinecke, Westermann & Ensslin 2021, A&A 646, A58.
pub(crate) fn image_to_vis(
    grid: &SkyGrid,
    plane: ArrayView2<'_, f64>,
    uvw_m: ArrayView2<'_, f64>,
    freq_hz: &[f64],
    opts: &GridOptions,
) -> Result<Array2<Complex64>> {
    fn run<T: Real>(
        grid: &SkyGrid,
        plane: ArrayView2<'_, f64>,
        uvw_m: ArrayView2<'_, f64>,
        freq_hz: &[f64],
        opts: &GridOptions,
    ) -> Result<Array2<Complex<T>>> {
        let n_vis = (uvw_m.nrows() * freq_hz.len()) as u64;
        let degridder = Degridder::<T>::new(grid, plane, freq_hz, UvwExtent::of(uvw_m), opts, Some(n_vis))?;
        let mut vis = Array2::from_elem((uvw_m.nrows(), freq_hz.len()), Complex::default());
        degridder.predict(uvw_m, vis.view_mut())?;
        Ok(vis)
    }
    if opts.single_precision_suffices() {
        Ok(run::<f32>(grid, plane, uvw_m, freq_hz, opts)?.mapv(|v| Complex64::new(v.re.into(), v.im.into())))
    } else {
        run::<f64>(grid, plane, uvw_m, freq_hz, opts)
    }
}

/// Image \[m, l\]: the real part of the sum of w V exp(-2 pi i (u l + v m + w (n - 1))) over rows and channels; the adjoint of
/// [`image_to_vis`]. The image is not divided by the sum of weights.
///
/// # Errors
/// As [`image_to_vis`].
pub(crate) fn vis_to_image(
    grid: &SkyGrid,
    uvw_m: ArrayView2<'_, f64>,
    freq_hz: &[f64],
    vis: ArrayView2<'_, Complex64>,
    weights: ArrayView2<'_, f64>,
    opts: &GridOptions,
) -> Result<Array2<f64>> {
    fn run<T: Real>(
        grid: &SkyGrid,
        uvw: ArrayView2<'_, f64>,
        freq: &[f64],
        vis: Array2<Complex<T>>,
        o: &GridOptions,
    ) -> Result<Array2<f64>> {
        let mut gridder = Gridder::<T>::new(grid, freq, UvwExtent::of(uvw), o)?;
        gridder.add(uvw, vis.view())?;
        Ok(gridder.finish())
    }
    if weights.dim() != vis.dim() {
        let (expected, found) = (vis.shape().to_vec(), weights.shape().to_vec());
        return Err(cittert_arrays::ArrayError::ShapeMismatch { what: "weights to grid", expected, found }.into());
    }
    let weighted = Zip::from(vis).and(weights).map_collect(|v, w| if *w == 0.0 { Complex64::default() } else { v * w });
    if opts.single_precision_suffices() {
        run::<f32>(grid, uvw_m, freq_hz, weighted.mapv(|v| Complex::new(f32::of(v.re), f32::of(v.im))), opts)
    } else {
        run::<f64>(grid, uvw_m, freq_hz, weighted, opts)
    }
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
