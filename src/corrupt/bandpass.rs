//! Errors of the receivers over the band.

use super::context::Context;
use super::corruption::{Corruption, need_size};
use super::shared::Shared;
use crate::Result;
use crate::values::need;
use cittert_arrays::GainTable;
use cittert_arrays::quantity::Frequency;
use num_complex::Complex64;
use rand::RngExt;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

/// g(f) = 1 + r exp(2 pi i (f / period + x)) + m(f): a standing wave of size r between reflections in the cable or the antenna, with
/// its own phase x in each antenna, and a mismatch m that is drawn for each channel. Both are constant in time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BandpassError {
    /// Size r of the ripple, 0 to below 1.
    pub ripple: f64,
    /// Period of the ripple, Hz: c / (2 length) for reflections at both ends of a length.
    pub period_hz: f64,
    /// Standard deviation of the real and of the imaginary part of the mismatch.
    pub mismatch: f64,
}

/// Options of bandpass errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct BandpassOptions {
    /// Size of the standing wave over the band, 0 to below 1.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X"))]
    pub bandpass_ripple: Option<f64>,
    /// Period of the standing wave.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FREQ", default_value_t = BandpassOptions::default().bandpass_period))]
    pub bandpass_period: Frequency,
    /// Rms of the mismatch of each channel.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X"))]
    pub bandpass_mismatch: Option<f64>,
}

impl Default for BandpassOptions {
    fn default() -> Self {
        Self { bandpass_ripple: None, bandpass_period: Frequency(100e6), bandpass_mismatch: None }
    }
}

impl BandpassOptions {
    /// The error, if the options select it.
    pub(super) fn error(&self, _shared: &Shared<'_>) -> Result<Option<BandpassError>> {
        let asked = self.bandpass_ripple.is_some() || self.bandpass_mismatch.is_some();
        Ok(asked.then(|| BandpassError {
            ripple: self.bandpass_ripple.unwrap_or(0.0),
            period_hz: self.bandpass_period.si(),
            mismatch: self.bandpass_mismatch.unwrap_or(0.0),
        }))
    }
}

impl Corruption for BandpassError {
    fn check(&self) -> Result<()> {
        need("bandpass-ripple", self.ripple, (0.0..1.0).contains(&self.ripple), "a number from 0 to below 1")?;
        need("ripple period in Hz", self.period_hz, self.period_hz.is_finite() && self.period_hz > 0.0, "a positive frequency")?;
        need_size("bandpass mismatch", self.mismatch)
    }

    fn chromatic(&self) -> bool {
        true
    }

    fn gains(&self, context: &Context<'_>, table: &mut GainTable) -> Result<()> {
        let (_, n_ant, n_chan, n_feed) = table.gains.dim();
        for ant in 0..n_ant {
            for feed in 0..n_feed {
                let mut rng = context.rng((2 * ant + feed) as u64);
                let x: f64 = rng.random();
                for chan in 0..n_chan {
                    let wave = Complex64::from_polar(self.ripple, std::f64::consts::TAU * (context.freq_hz[chan] / self.period_hz + x));
                    let (re, im): (f64, f64) = (StandardNormal.sample(&mut rng), StandardNormal.sample(&mut rng));
                    let g = Complex64::new(1.0 + self.mismatch * re, self.mismatch * im) + wave;
                    table.gains.slice_mut(ndarray::s![.., ant, chan, feed]).iter_mut().for_each(|v| *v *= g);
                }
            }
        }
        Ok(())
    }
}
