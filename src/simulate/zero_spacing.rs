//! What one element sees of the scene: the zero spacing.

use super::engine::Simulator;
use super::sky::{apparent_plane, holds_intensity};
use crate::Result;
use cittert_arrays::{BrightnessUnit, Image, UvCoverage, VisUnit};
use ndarray::{Array2, Axis};
use num_complex::Complex64;

impl Simulator<'_> {
    /// The temperature that one element sees in the middle of the band, if a warm scene is observed in K sr through a pattern: its zero spacing
    /// over the solid angle of the pattern, as an ideal measurement of total power gives it.
    pub(super) fn antenna_temperature_k(&self) -> Option<f64> {
        let freq = self.header.spectrum.mean_hz();
        let solid_angle = self.pattern.solid_angle_sr(freq)?;
        let thermal = self.header.unit == VisUnit::KelvinSr && self.header.pedestal_k.is_none() && self.sky.sources.is_empty();
        let intensity = |image: &Image| image.polarizations.iter().position(|p| holds_intensity(*p));
        let images: Option<Vec<(&Image, usize)>> = self.sky.images.iter().map(|i| Some((i, intensity(i)?))).collect();
        let images = images.filter(|i| thermal && !i.is_empty() && i.iter().all(|(i, _)| i.unit == BrightnessUnit::Kelvin))?;
        let seen = images.into_iter().map(|(image, pol)| {
            let chan = image.spectrum.n_chan() / 2;
            apparent_plane(image, (chan, pol), &self.pattern, freq, 0.0, self.options.one_over_n).sum()
        });
        Some(seen.sum::<f64>() / solid_angle)
    }

    /// The zero spacing \[chan, pol\] of the phase centre of some rows.
    pub(super) fn zero_spacing(&mut self, coverage: &UvCoverage) -> Result<Array2<Complex64>> {
        let center = coverage.phase_center.first().copied().unwrap_or(0);
        if let Some((of, zero)) = &self.zero
            && *of == center
        {
            return Ok(zero.clone());
        }
        let one = UvCoverage::new(Array2::zeros((1, 3)), vec![0], vec![0], vec![0.0], vec![1.0], vec![center])?;
        let zero = self.expected(&one)?.0.index_axis_move(Axis(0), 0);
        self.zero = Some((center, zero.clone()));
        Ok(zero)
    }
}
