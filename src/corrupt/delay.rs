//! Delay errors of the antennas.

use super::context::Context;
use super::corruption::{Corruption, need_size};
use super::phase::multiply;
use super::shared::Shared;
use super::variation::Variation;
use crate::Result;
use cittert_arrays::GainTable;
use cittert_arrays::quantity::Duration;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// g = exp(2 pi i (f - f0) tau) with a Gaussian tau; f0 is the mean of the channels, where the phase does not change.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DelayError {
    /// Standard deviation of the delay of an antenna, s.
    pub rms_s: f64,
    /// Its behaviour in time.
    pub variation: Variation,
}

/// Options of delay errors.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct DelayOptions {
    /// Rms of the antenna delays, such as 1ns.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TIME"))]
    pub delay_rms: Option<Duration>,
    /// How delays change in time, where this differs from the other kinds.
    #[cfg_attr(feature = "cli", arg(long, value_name = "KIND[:TIME]"))]
    pub delay_variation: Option<Variation>,
}

impl DelayOptions {
    /// The error, if the options select it.
    pub(super) fn error(&self, shared: &Shared<'_>) -> Result<Option<DelayError>> {
        let variation = self.delay_variation.unwrap_or(shared.variation);
        Ok(self.delay_rms.map(|rms| DelayError { rms_s: rms.si(), variation }))
    }
}

impl Corruption for DelayError {
    fn check(&self) -> Result<()> {
        need_size("delay rms in s", self.rms_s)?;
        self.variation.check()
    }

    fn chromatic(&self) -> bool {
        true
    }

    fn gains(&self, context: &Context<'_>, table: &mut GainTable) -> Result<()> {
        let middle = context.header.spectrum.mean_hz();
        multiply(context, table, &self.variation, |x, f| Complex64::cis(std::f64::consts::TAU * (f - middle) * self.rms_s * x));
        Ok(())
    }
}
