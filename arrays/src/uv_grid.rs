//! Visibilities put into the cells of a Fourier grid.

use crate::{ArrayError, Polarization, Result, SpectralWindow, VisUnit};
use ndarray::Array3;
use num_complex::Complex64;

/// Weighted sums of visibilities in the cells of the Fourier grid of an image, \[chan, v, u\]; u = 0 is column n / 2, v = 0 row n / 2.
///
/// A real sky has V(-u) = conj V(u): every visibility is put into the half with v >= 0 (and u >= 0 on its edge).
#[derive(Debug, Clone, PartialEq)]
pub struct UvGrid {
    /// Sum of weight times visibility, in the unit of the set.
    pub sum: Array3<Complex64>,
    /// Sum of the weights.
    pub weights: Array3<f64>,
    /// Number of visibilities.
    pub counts: Array3<u32>,
    /// Width and height of a cell, wavelengths.
    pub cell_wl: [f64; 2],
    /// Channels.
    pub spectrum: SpectralWindow,
    /// Product.
    pub polarization: Polarization,
    /// Unit of the visibilities.
    pub unit: VisUnit,
    /// Number of visibilities outside the grid.
    pub n_outside: u64,
    /// History of the grid, oldest first.
    pub history: Vec<String>,
}

impl UvGrid {
    /// Check that the arrays have one shape and as many channels as the spectrum.
    ///
    /// # Errors
    /// The first array of another shape.
    pub fn check(&self) -> Result<()> {
        let (_, v, u) = self.sum.dim();
        let expected = [self.spectrum.n_chan(), v, u];
        for (what, shape) in [("grid sums", self.sum.shape()), ("grid weights", self.weights.shape()), ("grid counts", self.counts.shape())]
        {
            ArrayError::unless_shape(what, shape, &expected)?;
        }
        Ok(())
    }
}
