//! Patterns that are wider or narrower than the common one.

use super::context::Context;
use super::corruption::{Corruption, need_size};
use super::shared::Shared;
use crate::Result;
use cittert_arrays::pattern::Pointings;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

/// The pattern of each antenna is wider by exp(a) with a Gaussian a, constant in time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WidthError {
    /// Standard deviation of a.
    pub rms: f64,
}

/// Options of widths of patterns.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct WidthOptions {
    /// Rms of the logarithm of the widths of the patterns: 0.05 makes them differ by 5 %.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X"))]
    pub width_rms: Option<f64>,
}

impl WidthOptions {
    /// The error, if the options select it.
    pub(super) fn error(&self, _shared: &Shared<'_>) -> Result<Option<WidthError>> {
        Ok(self.width_rms.map(|rms| WidthError { rms }))
    }
}

impl Corruption for WidthError {
    fn check(&self) -> Result<()> {
        need_size("width rms", self.rms)
    }

    fn of_scene(&self) -> bool {
        true
    }

    fn pointings(&self, context: &Context<'_>, pointings: &mut Pointings) -> Result<()> {
        for ant in 0..pointings.antennas.ncols() {
            let a: f64 = StandardNormal.sample(&mut context.rng(ant as u64));
            pointings.antennas.column_mut(ant).iter_mut().for_each(|p| p.width *= (self.rms * a).exp());
        }
        Ok(())
    }
}
