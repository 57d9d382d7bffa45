//! Antennas that do not point where they should.

use super::context::Context;
use super::corruption::{Corruption, need_size};
use super::shared::Shared;
use super::variation::Variation;
use crate::Result;
use cittert_arrays::pattern::Pointings;
use cittert_arrays::quantity::Angle;
use serde::{Deserialize, Serialize};

/// The axis of the pattern of each antenna has Gaussian direction cosines (l, m) instead of (0, 0).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PointingError {
    /// Standard deviation of the offset along each of l and m, rad.
    pub rms_rad: f64,
    /// Its behaviour in time.
    pub variation: Variation,
}

/// Options of pointing errors.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct PointingOptions {
    /// Rms of the pointing offsets of the antennas, along each of l and m.
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE"))]
    pub pointing_rms: Option<Angle>,
    /// How pointing offsets change in time, where this differs from the other kinds.
    #[cfg_attr(feature = "cli", arg(long, value_name = "KIND[:TIME]"))]
    pub pointing_variation: Option<Variation>,
}

impl PointingOptions {
    /// The error, if the options select it.
    pub(super) fn error(&self, shared: &Shared<'_>) -> Result<Option<PointingError>> {
        let variation = self.pointing_variation.unwrap_or(shared.variation);
        Ok(self.pointing_rms.map(|rms| PointingError { rms_rad: rms.si(), variation }))
    }
}

impl Corruption for PointingError {
    fn check(&self) -> Result<()> {
        need_size("pointing rms in rad", self.rms_rad)?;
        self.variation.check()
    }

    fn of_scene(&self) -> bool {
        true
    }

    fn pointings(&self, context: &Context<'_>, pointings: &mut Pointings) -> Result<()> {
        for ant in 0..pointings.antennas.ncols() {
            let [l, m] = [0, 1].map(|axis| self.variation.series(context.seconds, &mut context.rng((2 * ant + axis) as u64)));
            for (p, (l, m)) in pointings.antennas.column_mut(ant).iter_mut().zip(l.iter().zip(&m)) {
                p.l += self.rms_rad * l;
                p.m += self.rms_rad * m;
            }
        }
        Ok(())
    }
}
