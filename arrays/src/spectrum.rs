//! Channels of a receiver.

use crate::{ArrayError, Result};
use serde::{Deserialize, Serialize};

/// Channel centres and widths, Hz \[chan\]; `spw` numbers the spectral window of each channel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SpectralWindow {
    freq_hz: Vec<f64>,
    width_hz: Vec<f64>,
    spw: Vec<u32>,
}

impl SpectralWindow {
    /// Channels of one spectral window with given centres and widths, Hz \[chan\].
    ///
    /// # Errors
    /// No channel, unequal lengths, a centre that is not positive, a width that is zero or not finite.
    pub fn new(freq_hz: Vec<f64>, width_hz: Vec<f64>) -> Result<Self> {
        let spw = vec![0; freq_hz.len()];
        Self::with_windows(freq_hz, width_hz, spw)
    }

    /// As [`SpectralWindow::new`], with the number of the spectral window of each channel.
    ///
    /// # Errors
    /// As [`SpectralWindow::new`].
    pub fn with_windows(freq_hz: Vec<f64>, width_hz: Vec<f64>, spw: Vec<u32>) -> Result<Self> {
        ArrayError::unless(!freq_hz.is_empty(), "number of channels", "0", "at least 1")?;
        for (what, len) in [("channel widths", width_hz.len()), ("spectral window numbers", spw.len())] {
            ArrayError::unless_shape(what, &[len], &[freq_hz.len()])?;
        }
        for (f, w) in freq_hz.iter().zip(&width_hz) {
            ArrayError::unless(f.is_finite() && *f > 0.0, "channel frequency in Hz", f, "a positive, finite number")?;
            ArrayError::unless(w.is_finite() && *w != 0.0, "channel width in Hz", w, "a finite number other than 0")?;
        }
        // The sign of a width is only the direction of the axis, which follows from the centres too.
        let width_hz = width_hz.into_iter().map(f64::abs).collect();
        Ok(Self { freq_hz, width_hz, spw })
    }

    /// `channels` equal channels that fill `bandwidth_hz` around `center_hz`.
    ///
    /// # Errors
    /// Zero channels, a bandwidth or centre that is not positive, or a band that reaches below 0 Hz.
    pub fn band(center_hz: f64, bandwidth_hz: f64, channels: usize) -> Result<Self> {
        let band = bandwidth_hz.is_finite() && bandwidth_hz > 0.0;
        ArrayError::unless(band, "bandwidth in Hz", bandwidth_hz, "a positive, finite number")?;
        let above = center_hz.is_finite() && center_hz > bandwidth_hz / 2.0;
        ArrayError::unless(above, "centre frequency in Hz", center_hz, "a finite number above half the bandwidth")?;
        ArrayError::unless(channels <= 1 << 20, "number of channels", channels, "at most 1048576")?;
        let width = bandwidth_hz / channels as f64;
        let first = center_hz - bandwidth_hz / 2.0 + width / 2.0;
        Self::new((0..channels).map(|c| first + width * c as f64).collect(), vec![width; channels])
    }

    /// Channel centres, Hz \[chan\].
    #[must_use]
    pub fn freq_hz(&self) -> &[f64] {
        &self.freq_hz
    }

    /// Channel widths, Hz \[chan\], positive.
    #[must_use]
    pub fn width_hz(&self) -> &[f64] {
        &self.width_hz
    }

    /// Number of the spectral window of each channel \[chan\].
    #[must_use]
    pub fn spw(&self) -> &[u32] {
        &self.spw
    }

    /// Number of channels, at least 1.
    #[must_use]
    pub fn n_chan(&self) -> usize {
        self.freq_hz.len()
    }

    /// Lowest and highest channel centre, Hz.
    #[must_use]
    pub fn range_hz(&self) -> (f64, f64) {
        self.freq_hz.iter().fold((f64::INFINITY, 0.0), |(lo, hi), f| (lo.min(*f), f64::max(hi, *f)))
    }

    /// Mean of the channel centres, Hz.
    #[must_use]
    pub fn mean_hz(&self) -> f64 {
        self.freq_hz.iter().sum::<f64>() / self.freq_hz.len() as f64
    }

    /// From the lower edge of the lowest to the upper edge of the highest channel, Hz.
    #[must_use]
    pub fn extent_hz(&self) -> f64 {
        let edges = self.freq_hz.iter().zip(&self.width_hz);
        let (lo, hi) = edges.fold((f64::INFINITY, 0.0_f64), |(lo, hi), (f, w)| (lo.min(f - w / 2.0), hi.max(f + w / 2.0)));
        hi - lo
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_is_filled_without_gaps() {
        let s = SpectralWindow::band(94e9, 8e9, 32).unwrap();
        assert_eq!(s.n_chan(), 32);
        assert_eq!(s.freq_hz()[0], 90.125e9);
        assert_eq!(s.extent_hz(), 8e9);
        assert!((s.mean_hz() - 94e9).abs() < 1.0);
    }

    #[test]
    fn impossible_bands_are_refused() {
        assert!(SpectralWindow::band(94e9, 8e9, 0).is_err());
        assert!(SpectralWindow::band(94e9, -8e9, 4).is_err());
        assert!(SpectralWindow::band(1e9, 4e9, 4).is_err());
        assert!(SpectralWindow::new(vec![f64::NAN], vec![1.0]).is_err());
    }
}
