//! The dirty beam.

use super::beam_fit::LEVEL;
use super::imager::Imager;
use super::session::Gridded;
use crate::deconvolve::largest_where;
use crate::fourier::Real;
use crate::progress::Observer;
use crate::{ChainError, Result};
use cittert_arrays::{RestoringBeam, SkyGrid};
use ndarray::{Array2, ArrayView2};

/// Sides in pixels of the small fields in which the main lobe is looked for first. Most images have three to ten pixels across the main lobe, and the
/// smallest field takes the least time.
pub(super) const CORE_SIDES: [usize; 2] = [32, 128];

impl Imager<'_> {
    /// Dirty beam of an output channel \[m, l\]: the dirty image of a point source of 1 at the centre. Its value at the centre is exactly 1.
    /// For one integration of N antennas with natural weights it is (|AF|^2 - N) / (N (N - 1)), where AF is the array factor.
    ///
    /// # Errors
    /// The output channel has no usable visibility, or the source fails.
    pub fn psf(&mut self, channel: usize, observer: &dyn Observer) -> Result<Array2<f64>> {
        self.psf_in(channel, observer)
    }

    /// [`Imager::psf`] in this precision.
    pub(super) fn psf_in<P: Real>(&mut self, channel: usize, observer: &dyn Observer) -> Result<Array2<P>> {
        self.psf_on(None, channel, observer)
    }

    /// The restoring beam of an output channel, fitted to the central part of its dirty beam, which contains the main lobe. A small field needs
    /// few planes of w and few nodes along the spectrum, so it takes much less time than the whole beam.
    ///
    /// The inner result is that of [`Imager::beam_of`].
    ///
    /// # Errors
    /// As [`Imager::psf`].
    pub fn restoring_beam(&mut self, channel: usize, observer: &dyn Observer) -> Result<Result<RestoringBeam>> {
        if self.options().beam.is_some() {
            return Ok(self.beam_of(Array2::<f64>::zeros((0, 0)).view()));
        }
        if let Some(core) = self.psf_core(channel, observer)? {
            return Ok(self.beam_of(core.view()));
        }
        let whole = self.psf_in::<f32>(channel, observer)?;
        Ok(self.beam_of(whole.view()))
    }

    /// The central part of the dirty beam \[m, l\]; `None` where it does not contain the main lobe.
    pub(super) fn psf_core(&mut self, channel: usize, observer: &dyn Observer) -> Result<Option<Array2<f64>>> {
        let whole = self.grid().clone();
        if !(self.sum_of_weights(channel) > 0.0) {
            return Ok(None);
        }
        for side in CORE_SIDES.into_iter().filter(|side| whole.n_l > *side && whole.n_m > *side) {
            let field = SkyGrid::new(side, side, whole.cell_rad, whole.frame.clone())?;
            let core = self.psf_on::<f64>(Some(&field), channel, observer)?;
            let last = side - 1;
            let edge = |k: usize| core[(0, k)].max(core[(last, k)]).max(core[(k, 0)]).max(core[(k, last)]);
            // If the lobe extends beyond the small field, the edge is above the level of the fit.
            if (0..side).all(|k| edge(k) < LEVEL) {
                return Ok(Some(core));
            }
        }
        Ok(None)
    }

    /// The beam on a field, or on the grid of the image.
    fn psf_on<P: Real>(&mut self, field: Option<&SkyGrid>, channel: usize, observer: &dyn Observer) -> Result<Array2<P>> {
        if !(self.sum_of_weights(channel) > 0.0) {
            return Err(ChainError::NoData(format!("output channel {channel} has no usable visibility, and therefore no beam")));
        }
        let mut psf: Array2<P> = self.gridded((field, channel), Gridded::Beam, observer)?;
        // The peak is 1 to within the error of the transform. It is made exact, so that CLEAN subtracts exactly the flux of a component.
        let center = (psf.nrows() / 2, psf.ncols() / 2);
        let peak = psf[center].to64();
        psf.par_mapv_inplace(|v| P::of(v.to64() / peak));
        psf[center] = P::one();
        Ok(psf)
    }
}

/// Largest absolute value of a beam \[m, l\] outside its main lobe: an ellipse with the axes of the restoring beam, `main_lobe_fwhm` times as
/// large from its centre.
pub(super) fn side_lobe(grid: &SkyGrid, psf: ArrayView2<'_, f32>, beam: &RestoringBeam, main_lobe_fwhm: f64) -> f64 {
    let (sin, cos) = beam.bpa_rad.sin_cos();
    let outside = |(i, j): (usize, usize)| {
        let (l, m) = (grid.l_at(j as f64), grid.m_at(i as f64));
        let (along, across) = ((l * sin + m * cos) / beam.bmaj_rad, (l * cos - m * sin) / beam.bmin_rad);
        along * along + across * across > main_lobe_fwhm * main_lobe_fwhm
    };
    largest_where(psf, outside).into()
}
