//! The phase between the two feeds.

use super::context::Context;
use super::corruption::Corruption;
use super::leakage::needs_four;
use super::shared::Shared;
use crate::values::need;
use crate::{Result, ensure};
use cittert_arrays::GainTable;
use cittert_arrays::feeds::FourProducts;
use cittert_arrays::quantity::Angle;
use ndarray::{Axis, s};
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// The first feed (X or R) of every antenna is ahead of the second by the same phase, as the reference antenna of a calibration leaves it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CrossPhase {
    /// Phase of the first feed less that of the second, rad.
    pub phase_rad: f64,
}

/// Options of the phase between the feeds.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct CrossPhaseOptions {
    /// Phase of the first feed (X or R) less that of the second, the same at all antennas, for sets of four products.
    #[cfg_attr(feature = "cli", arg(long, value_name = "ANGLE", allow_hyphen_values = true))]
    pub cross_phase: Option<Angle>,
}

impl CrossPhaseOptions {
    /// The error, if the options select it.
    pub(super) fn error(&self, _shared: &Shared<'_>) -> Result<Option<CrossPhase>> {
        Ok(self.cross_phase.map(|phase| CrossPhase { phase_rad: phase.si() }))
    }
}

impl Corruption for CrossPhase {
    fn check(&self) -> Result<()> {
        need("cross-phase", self.phase_rad, self.phase_rad.is_finite(), "a finite angle")
    }

    fn tells_feeds_apart(&self) -> bool {
        true
    }

    fn gains(&self, context: &Context<'_>, table: &mut GainTable) -> Result<()> {
        ensure!(FourProducts::of(&context.header.polarizations).is_some(), needs_four("cross-phase"));
        let turn = Complex64::cis(self.phase_rad);
        for mut interval in table.gains.axis_iter_mut(Axis(0)) {
            interval.slice_mut(s![.., .., 0]).mapv_inplace(|g| g * turn);
        }
        Ok(())
    }
}
