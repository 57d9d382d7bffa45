//! Phase errors of the antennas.

use super::context::Context;
use super::corruption::{Corruption, need_size};
use super::shared::Shared;
use super::variation::Variation;
use crate::Result;
use cittert_arrays::GainTable;
use cittert_arrays::quantity::Angle;
use ndarray::Axis;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// g = exp(i phi) with a Gaussian phi, the same over the band.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PhaseError {
    /// Standard deviation of the phase of an antenna, rad.
    pub rms_rad: f64,
    /// Its behaviour in time.
    pub variation: Variation,
}

/// Options of phase errors.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct PhaseOptions {
    /// Rms of the antenna phases.
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE"))]
    pub phase_rms: Option<Angle>,
    /// How phases change in time, where this differs from the other kinds.
    #[cfg_attr(feature = "cli", arg(long, value_name = "KIND[:TIME]"))]
    pub phase_variation: Option<Variation>,
}

impl PhaseOptions {
    /// The error, if the options select it.
    pub(super) fn error(&self, shared: &Shared<'_>) -> Result<Option<PhaseError>> {
        let variation = self.phase_variation.unwrap_or(shared.variation);
        Ok(self.phase_rms.map(|rms| PhaseError { rms_rad: rms.si(), variation }))
    }
}

impl Corruption for PhaseError {
    fn check(&self) -> Result<()> {
        need_size("phase rms in rad", self.rms_rad)?;
        self.variation.check()
    }

    fn gains(&self, context: &Context<'_>, table: &mut GainTable) -> Result<()> {
        multiply(context, table, &self.variation, |x, _| Complex64::cis(self.rms_rad * x));
        Ok(())
    }
}

/// Multiply the gains of each antenna and feed by `gain` of a random value with unit variance and of the frequency of each channel.
pub(super) fn multiply(context: &Context<'_>, table: &mut GainTable, variation: &Variation, gain: impl Fn(f64, f64) -> Complex64) {
    let (_, n_ant, _, n_feed) = table.gains.dim();
    for ant in 0..n_ant {
        for feed in 0..n_feed {
            let series = variation.series(context.seconds, &mut context.rng((2 * ant + feed) as u64));
            for (mut row, x) in table.gains.axis_iter_mut(Axis(0)).zip(series) {
                for (v, f) in row.slice_mut(ndarray::s![ant, .., feed]).iter_mut().zip(context.freq_hz) {
                    *v *= gain(x, *f);
                }
            }
        }
    }
}
