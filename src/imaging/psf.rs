//! The dirty beam.

use super::Imager;
use super::beam_fit::LEVEL;
use crate::progress::Observer;
use crate::{ChainError, Result};
use cittert_arrays::SkyGrid;
use ndarray::Array2;
use num_complex::Complex;

/// Side of the field in which the main lobe is first looked for.
const CORE_SIDE: usize = 128;

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
        let single = self.options().grid_options().single_precision_suffices();
        let psf = if single {
            self.whole::<f32>(channel, observer, "beam", |_, w| Complex::new(w, 0.0))?
        } else {
            self.whole::<f64>(channel, observer, "beam", |_, w| Complex::new(w, 0.0))?
        };
        Ok(normalised(psf))
    }

    /// The middle of the dirty beam with all of its main lobe \[m, l\], which is what a restoring beam is fitted to. A small field needs
    /// few planes of w and few samples along the spectrum, so it costs far less than the whole beam.
    ///
    /// # Errors
    /// As [`Imager::psf`].
    pub fn psf_core(&mut self, channel: usize, observer: &dyn Observer) -> Result<Array2<f64>> {
        let whole = self.grid().clone();
        if whole.n_l <= CORE_SIDE || whole.n_m <= CORE_SIDE || !(self.sum_of_weights(channel) > 0.0) {
            return self.psf(channel, observer);
        }
        let core = self.psf_on(&SkyGrid::new(CORE_SIDE, CORE_SIDE, whole.cell_rad, whole.frame.clone())?, channel, observer)?;
        let last = CORE_SIDE - 1;
        let edge = |k: usize| core[(0, k)].max(core[(last, k)]).max(core[(k, 0)]).max(core[(k, last)]);
        // A lobe that goes on outside crosses the edge above the level of the fit.
        if (0..CORE_SIDE).all(|k| edge(k) < LEVEL) { Ok(core) } else { self.psf(channel, observer) }
    }

    fn psf_on(&mut self, grid: &SkyGrid, channel: usize, observer: &dyn Observer) -> Result<Array2<f64>> {
        let psf = if self.options().grid_options().single_precision_suffices() {
            self.field::<f32>((grid, channel), observer, "beam", |_, w| Complex::new(w, 0.0))?
        } else {
            self.field::<f64>((grid, channel), observer, "beam", |_, w| Complex::new(w, 0.0))?
        };
        Ok(normalised(psf))
    }
}

/// The sum is 1 to the error of the transform; the peak is made exact so that CLEAN removes exactly what it takes.
fn normalised(mut psf: Array2<f64>) -> Array2<f64> {
    let center = (psf.nrows() / 2, psf.ncols() / 2);
    let peak = psf[center];
    psf /= peak;
    psf[center] = 1.0;
    psf
}
