//! Amplitude errors of the antennas.

use super::context::Context;
use super::corruption::{Corruption, need_size};
use super::phase::multiply;
use super::shared::Shared;
use super::variation::Variation;
use crate::Result;
use cittert_arrays::GainTable;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// g = exp(a) with a Gaussian a, so that amplitudes stay positive; for small errors `rms` is the relative error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AmplitudeError {
    /// Standard deviation of ln |g|.
    pub rms: f64,
    /// Its behaviour in time.
    pub variation: Variation,
}

/// Options of amplitude errors.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct AmplitudeOptions {
    /// Rms of ln |gain|.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X"))]
    pub amp_rms: Option<f64>,
    /// How amplitudes change in time, where this differs from the other kinds.
    #[cfg_attr(feature = "cli", arg(long, value_name = "KIND[:TIME]"))]
    pub amp_variation: Option<Variation>,
}

impl AmplitudeOptions {
    /// The error, if the options select it.
    pub(super) fn error(&self, shared: &Shared<'_>) -> Result<Option<AmplitudeError>> {
        let variation = self.amp_variation.unwrap_or(shared.variation);
        Ok(self.amp_rms.map(|rms| AmplitudeError { rms, variation }))
    }
}

impl Corruption for AmplitudeError {
    fn check(&self) -> Result<()> {
        need_size("amplitude rms", self.rms)?;
        self.variation.check()
    }

    fn gains(&self, context: &Context<'_>, table: &mut GainTable) -> Result<()> {
        multiply(context, table, &self.variation, |x, _| Complex64::new((self.rms * x).exp(), 0.0));
        Ok(())
    }
}
