//! Transforms of one image and one list of rows in a single call.

use super::degridder::Degridder;
use super::grid_options::GridOptions;
use super::gridder::Gridder;
use super::plan::UvwExtent;
use super::real::Real;
use crate::Result;
use cittert_arrays::SkyGrid;
use ndarray::{Array2, ArrayView2, Zip};
use num_complex::{Complex, Complex64};

/// Visibilities \[row, chan\] of an image `plane` \[m, l\] at `uvw_m` (m, \[row, 3\]) and `freq_hz` \[chan\].
///
/// The unit is that of the plane times pixels. Pixels behind the horizon do not contribute.
///
/// # Errors
/// The shapes differ, a pixel or a uvw is not finite, or epsilon is outside 1e-13 to 0.5.
///
/// # Reference
/// Arras, Reinecke, Westermann & Ensslin 2021, A&A 646, A58.
pub fn image_to_vis(
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
        let degridder = Degridder::<T>::new(grid, plane, freq_hz, UvwExtent::of(uvw_m), opts)?;
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
pub fn vis_to_image(
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
