//! Samplers whose clocks tremble.

use super::context::Context;
use super::corruption::{Corruption, need_size};
use super::shared::Shared;
use crate::Result;
use crate::simulate::Receivers;
use crate::values::need;
use cittert_arrays::quantity::{Duration, Frequency};
use cittert_arrays::{GainTable, VisibilityBlock};
use ndarray::s;
use serde::{Deserialize, Serialize};

/// Each sample is taken early or late by a Gaussian time t of its own. A signal at the frequency f keeps the mean of exp(2 pi i f t) of its
/// amplitude, exp(-(2 pi f sigma)^2 / 2), and a visibility the product of two of them. The rest of the power becomes noise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct JitterError {
    /// Standard deviation sigma of the instants, s.
    pub rms_s: f64,
    /// Frequency at which the middle of the band is sampled, Hz. `None`: the sky frequency itself.
    pub sampler_hz: Option<f64>,
}

/// Options of sampling jitter.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct JitterOptions {
    /// Rms of the instants of the samplers, such as 0.2ps: a loss of coherence by exp(-(2 pi f t)^2).
    #[cfg_attr(feature = "cli", arg(long, value_name = "TIME"))]
    pub jitter_rms: Option<Duration>,
    /// Frequency at which the middle of the band is sampled, after the mixers [default: the frequency of the sky].
    #[cfg_attr(feature = "cli", arg(long, value_name = "FREQ"))]
    pub sampler_freq: Option<Frequency>,
}

impl JitterOptions {
    /// The error, if the options select it.
    pub(super) fn error(&self, _shared: &Shared<'_>) -> Result<Option<JitterError>> {
        Ok(self.jitter_rms.map(|rms| JitterError { rms_s: rms.si(), sampler_hz: self.sampler_freq.map(Frequency::si) }))
    }
}

impl Corruption for JitterError {
    fn check(&self) -> Result<()> {
        need_size("jitter rms in s", self.rms_s)?;
        let f = self.sampler_hz.unwrap_or(1.0);
        need("sampler-freq", f, f.is_finite() && f > 0.0, "a positive frequency")
    }

    fn chromatic(&self) -> bool {
        true
    }

    fn gains(&self, context: &Context<'_>, table: &mut GainTable) -> Result<()> {
        let mut receivers = Receivers::nominal(1);
        self.receivers(context, &mut receivers)?;
        let middle = context.header.spectrum.mean_hz();
        for (chan, freq) in context.freq_hz.iter().enumerate() {
            let left = receivers.coherence(0, *freq, middle);
            table.gains.slice_mut(s![.., .., chan, ..]).iter_mut().for_each(|g| *g *= left);
        }
        Ok(())
    }

    /// Autocorrelations keep their power: what a sampler takes from the signal is in its own noise.
    fn data(&self, context: &Context<'_>, _table: &GainTable, block: &mut VisibilityBlock, _first_row: u64) -> Result<()> {
        let mut receivers = Receivers::nominal(1);
        self.receivers(context, &mut receivers)?;
        let middle = context.header.spectrum.mean_hz();
        for row in (0..block.n_rows()).filter(|r| block.coverage.ant1[*r] == block.coverage.ant2[*r]) {
            for (chan, freq) in context.header.spectrum.freq_hz().iter().enumerate() {
                let power = receivers.coherence(0, *freq, middle).powi(2);
                block.vis.slice_mut(s![row, chan, ..]).mapv_inplace(|v| v / power as f32);
                block.weights.slice_mut(s![row, chan, ..]).mapv_inplace(|w| (f64::from(w) * power * power) as f32);
            }
        }
        Ok(())
    }

    fn receivers(&self, _context: &Context<'_>, receivers: &mut Receivers) -> Result<()> {
        receivers.sampler_hz = self.sampler_hz;
        receivers.of.iter_mut().for_each(|r| r.jitter_s = r.jitter_s.hypot(self.rms_s));
        Ok(())
    }
}
