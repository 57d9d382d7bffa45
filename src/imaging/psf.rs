//! The dirty beam.

use super::Imager;
use crate::progress::Observer;
use crate::{ChainError, Result};
use ndarray::Array2;
use num_complex::Complex;

impl Imager<'_> {
    /// Dirty beam of an output channel \[m, l\]: the dirty image of a point of 1 at the centre; exactly 1 there.
    /// For N antennas seen once with natural weights it is (|AF|^2 - N) / (N (N - 1)), with AF the array factor.
    ///
    /// # Errors
    /// An output channel without data; whatever the source says.
    pub fn psf(&mut self, channel: usize, observer: &dyn Observer) -> Result<Array2<f64>> {
        if !(self.sum_of_weights(channel) > 0.0) {
            return Err(ChainError::NoData(format!("output channel {channel} has no usable visibility, hence no beam")));
        }
        let mut psf = if self.options().grid_options().single_precision_suffices() {
            self.pass::<f32>(channel, observer, "beam", |_, w| Complex::new(w, 0.0))?
        } else {
            self.pass::<f64>(channel, observer, "beam", |_, w| Complex::new(w, 0.0))?
        };
        // The sum is 1 to the error of the transform; the peak is made exact so that CLEAN removes exactly what it takes.
        let center = (psf.nrows() / 2, psf.ncols() / 2);
        let peak = psf[center];
        psf /= peak;
        psf[center] = 1.0;
        Ok(psf)
    }
}
