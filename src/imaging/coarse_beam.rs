//! The dirty beam of a coarse image of the whole field, from the rows of a set that were looked at.
//!
//! It shows what the short baselines measure, such as which wide scales of a CLEAN, before a visibility is read.

use super::imager::Imager;
use super::options::{ImageSize, ImagingOptions};
use super::outlook::RowSample;
use crate::Result;
use crate::progress::Silent;
use cittert_arrays::quantity::Angle;
use cittert_arrays::{
    Polarization, SPEED_OF_LIGHT_M_S, SkyGrid, SpectralWindow, UvCoverage, VisibilityBlock, VisibilityHeader, VisibilitySet,
};
use ndarray::{Array2, s};

/// Most pixels along a side of the image, and most channels that are looked at.
const SIDE: usize = 512;
const CHANNELS: usize = 8;

impl RowSample {
    /// The beam \[m, l\], and how many pixels of `grid` one of its pixels is wide. Baselines that the coarse pixels cannot show are left out. `None` where no
    /// baseline is left.
    ///
    /// # Errors
    /// As [`Imager::new`].
    pub fn coarse_beam(&self, header: &VisibilityHeader, grid: &SkyGrid, options: &ImagingOptions) -> Result<Option<(Array2<f32>, f64)>> {
        let factor = (grid.n_l.max(grid.n_m) as f64 / SIDE as f64).max(1.0);
        let side = |n: usize| ((n as f64 / factor / 2.0).round() as usize).max(1) * 2;
        let cell_rad = grid.cell_rad * factor;
        let all = header.spectrum.freq_hz();
        let step = all.len().div_ceil(CHANNELS).max(1);
        let freq_hz: Vec<f64> = all.iter().copied().skip(step / 2).step_by(step).collect();
        let n = self.uvw_m.nrows();
        let coverage = UvCoverage::new(self.uvw_m.clone(), vec![0; n], vec![1; n], vec![2_451_545.0; n], vec![1.0; n], vec![0; n])?;
        let mut data = VisibilityBlock::zeros(coverage, freq_hz.len(), 1);
        for (uvw, mut flags) in self.uvw_m.outer_iter().zip(data.flags.outer_iter_mut()) {
            let length = uvw[0].abs().max(uvw[1].abs());
            for (freq, flag) in freq_hz.iter().zip(flags.slice_mut(s![.., 0])) {
                let cycles = length * freq / SPEED_OF_LIGHT_M_S * cell_rad;
                *flag = cycles == 0.0 || cycles >= 0.5;
            }
        }
        if data.flags.iter().all(|f| *f) {
            return Ok(None);
        }
        let width_hz = vec![header.spectrum.width_hz().first().copied().unwrap_or(1.0); freq_hz.len()];
        let spectrum = SpectralWindow::new(freq_hz, width_hz)?;
        let header = VisibilityHeader { spectrum, polarizations: vec![Polarization::I], ..header.clone() };
        let mut set = VisibilitySet::new(header, data)?;
        let options = ImagingOptions {
            size: Some(ImageSize { columns: side(grid.n_l), rows: side(grid.n_m) }),
            cell: Some(Angle(cell_rad)),
            channels_out: 1,
            pol: Polarization::I,
            range: None,
            surface: None,
            ..options.clone()
        };
        let beam = Imager::new(&mut set, options, &Silent)?.psf(0, &Silent)?;
        Ok(Some((beam.mapv(|v| v as f32), factor)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deconvolve::{CleanTuning, measured_scales};
    use crate::fixtures::{positions, snapshot};
    use crate::imaging::Outlook;
    use cittert_arrays::{VisUnit, Weighting};

    /// The wide scales that a coarse beam shows as measured are those that the beam of the image shows.
    #[test]
    fn a_coarse_beam_shows_which_wide_scales_are_measured() {
        let freq: Vec<f64> = (0..12).map(|c| 94e9 + 1e8 * f64::from(c)).collect();
        let mut left_out = 0;
        for (seed, radius_m) in [(3, 0.6), (4, 0.9), (5, 1.3), (6, 2.0)] {
            for weighting in [Weighting::Natural, Weighting::Uniform] {
                let options = ImagingOptions {
                    size: Some(ImageSize { columns: 1024, rows: 1024 }),
                    cell: Some(Angle(5e-4)),
                    weighting,
                    ..ImagingOptions::default()
                };
                let places = positions(40, radius_m, 0.003, seed);
                let mut set = snapshot(&places, &freq, &[Polarization::I], &[(0.0, 0.0, 1.0)], (0.0, VisUnit::Jy));
                let (outlook, sample) = Outlook::of(&mut set, &options, None, &Silent).unwrap();
                let (coarse, factor) = sample.coarse_beam(&set.header, &outlook.grid, &options).unwrap().unwrap();
                assert_eq!((coarse.dim(), factor), ((512, 512), 2.0));
                let widths = [16.0, 24.0, 48.0, 96.0, 192.0, 384.0];
                let scaled: Vec<f64> = widths.iter().map(|w| w / factor).collect();
                let beam = Imager::new(&mut set, options, &Silent).unwrap().psf(0, &Silent).unwrap().mapv(|v| v as f32);
                let tuning = CleanTuning::default();
                let found: Vec<f64> = measured_scales(coarse.view(), &scaled, &tuning).iter().map(|w| w * factor).collect();
                let exact = measured_scales(beam.view(), &widths, &tuning);
                left_out += widths.len() - exact.len();
                assert_eq!(found, exact, "{seed} {radius_m} {weighting:?}");
            }
        }
        assert!(left_out > 4, "{left_out}");
    }
}
