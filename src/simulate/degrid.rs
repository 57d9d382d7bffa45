//! Visibilities of an image by FFT and interpolation. The transform is kept between blocks.

use crate::Result;
use crate::fourier::{Degridder, GridOptions, UvwExtent};
use cittert_arrays::{SPEED_OF_LIGHT_M_S, SkyGrid};
use ndarray::{Array2, ArrayView2};
use num_complex::Complex64;

/// One plane with its degridder. A new degridder is made if rows lie outside the uvw range of the present one.
pub(crate) struct DegridPlane {
    grid: SkyGrid,
    plane: Array2<f64>,
    freq_hz: Vec<f64>,
    options: GridOptions,
    n_vis: Option<u64>,
    /// The uvw range of the rows so far, with some room.
    extent: Option<UvwExtent>,
    ready: Option<(UvwExtent, Precision)>,
}

/// The precision of the degridder. Single precision is twice as fast, and is used for errors that it can reach.
enum Precision {
    Single(Degridder<f32>),
    Double(Degridder<f64>),
}

impl DegridPlane {
    /// A plane \[m, l\] of values per cell, for some frequencies, an error of at most `epsilon` of the total flux, and about `n_vis` visibilities.
    pub(crate) fn new(grid: &SkyGrid, plane: Array2<f64>, freq_hz: Vec<f64>, (epsilon, w_term): (f64, bool), n_vis: Option<u64>) -> Self {
        let options = GridOptions { epsilon, w_term, divide_by_n: false, ..GridOptions::default() };
        Self { grid: grid.clone(), plane, freq_hz, options, n_vis, extent: None, ready: None }
    }

    /// Approximate size in bytes.
    pub(crate) fn bytes(&self) -> usize {
        let w_planes = self.extent.map_or(0, |extent| {
            let f_max = self.freq_hz.iter().copied().fold(0.0, f64::max);
            let half = self.grid.cell_rad * (self.grid.n_l.max(self.grid.n_m) / 2) as f64;
            let turns = if self.options.w_term { extent.w_m * f_max / SPEED_OF_LIGHT_M_S * half * half } else { 0.0 };
            1 + if turns > 0.0 { 8 + (4.0 * turns) as usize } else { 0 }
        });
        let point = if self.options.single_precision_suffices() { 8 } else { 16 };
        // The transform is twice as large along each side, and half of it is kept.
        8 * self.plane.len() + 2 * point * self.plane.len() * w_planes
    }

    /// Let the range cover these rows, with some room.
    pub(crate) fn cover(&mut self, uvw_m: ArrayView2<'_, f64>) {
        let needed = UvwExtent::of(uvw_m);
        let covers = |e: &UvwExtent| e.u_m >= needed.u_m && e.v_m >= needed.v_m && e.w_m >= needed.w_m;
        let needed = match self.extent {
            Some(extent) if covers(&extent) => return,
            Some(extent) => needed.union(extent),
            None => needed,
        };
        self.extent = Some(needed.with_room());
    }

    /// Visibilities \[row, freq\] at uvw in m \[row, 3\].
    ///
    /// # Errors
    /// A uvw is not finite, or no transform reaches epsilon.
    pub(crate) fn predict(&mut self, uvw_m: ArrayView2<'_, f64>) -> Result<Array2<Complex64>> {
        self.cover(uvw_m);
        let extent = self.extent.unwrap_or_else(|| UvwExtent::of(uvw_m));
        let degridder = match self.ready.take() {
            Some((made_for, degridder)) if made_for == extent => degridder,
            _ => self.make(extent)?,
        };
        let shape = (uvw_m.nrows(), self.freq_hz.len());
        let mut vis = Array2::from_elem(shape, Complex64::default());
        match &degridder {
            Precision::Single(d) => d.predict_as(uvw_m, vis.view_mut(), |v| Complex64::new(v.re.into(), v.im.into()))?,
            Precision::Double(d) => d.predict(uvw_m, vis.view_mut())?,
        }
        self.ready = Some((extent, degridder));
        Ok(vis)
    }

    fn make(&self, extent: UvwExtent) -> Result<Precision> {
        let plane = self.plane.view();
        Ok(if self.options.single_precision_suffices() {
            Precision::Single(Degridder::new(&self.grid, plane, &self.freq_hz, extent, &self.options, self.n_vis)?)
        } else {
            Precision::Double(Degridder::new(&self.grid, plane, &self.freq_hz, extent, &self.options, self.n_vis)?)
        })
    }
}
