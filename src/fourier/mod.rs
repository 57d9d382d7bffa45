//! Between images and visibilities: the only place of the crate that transforms.
//!
//! V = sum of I exp(+2 pi i (u l + v m + w (n - 1))) over the pixels, and its adjoint, each to a relative error that the caller asks for.
//! uvw are metres everywhere; wavelengths appear only in here. Planes are \[m, l\] in the order of [`SkyGrid`].
//!
//! [`dft`] is the direct sum, the truth. The fast way is: fold to v >= 0 (the image is real), represent the channels of a row by fewer
//! where the field allows it, cut the rows into runs that fall into one tile of the grid, spread each tile in cache with the kernel,
//! add the tiles to the planes of the w term, transform, and divide by the transform of the kernel.

mod channels;
mod convolve;
mod degridder;
pub mod dft;
mod fft;
mod gridder;
mod kernel;
mod lanes;
mod pair;
mod plan;
mod pool;
mod real;
mod series;
mod sort;
#[cfg(test)]
mod tests;
mod transform;
#[cfg(test)]
mod transform_tests;
mod uv_grid;
mod wplanes;

pub use convolve::{Convolver, Spectrum};
pub use degridder::Degridder;
pub use gridder::Gridder;
pub use kernel::Kernel;
pub use pair::Pair;
pub use plan::UvwExtent;
pub use real::Real;
pub use sort::SortedRows;
pub use transform::{PassWork, Transform};
pub use uv_grid::image_to_uv_grid;

use crate::Result;
use cittert_arrays::SkyGrid;
use ndarray::{Array2, ArrayView2, Zip};
use num_complex::{Complex, Complex64};

/// How exact a transform is and what it contains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridOptions {
    /// Relative l2 error, 1e-12 to 0.1.
    pub epsilon: f64,
    /// Include the term w (n - 1).
    pub w_term: bool,
    /// Divide each pixel by n, the measure of the direction cosines.
    pub divide_by_n: bool,
}

impl Default for GridOptions {
    fn default() -> Self {
        Self { epsilon: 1e-5, w_term: true, divide_by_n: false }
    }
}

impl GridOptions {
    /// True where single precision inside the transform reaches `epsilon`.
    #[must_use]
    pub fn single_precision_suffices(&self) -> bool {
        self.epsilon >= 0.99e-5
    }
}

/// Visibilities \[row, chan\] of an image `plane` \[m, l\] at `uvw_m` (m, \[row, 3\]) and `freq_hz` \[chan\].
///
/// The unit is that of the plane times pixels. Pixels behind the horizon count for nothing.
///
/// # Errors
/// Shapes that do not fit, values or uvw that are not finite, an epsilon outside 1e-13 to 0.5.
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
/// [`image_to_vis`]. It is not divided by the sum of weights.
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
