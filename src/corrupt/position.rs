//! Errors of the antenna positions.

use super::context::Context;
use super::corruption::{Corruption, need_size};
use super::shared::Shared;
use crate::values::word_or_quantity;
use crate::{ChainError, Result};
use cittert_arrays::quantity::Length;
use cittert_arrays::{GainTable, SPEED_OF_LIGHT_M_S};
use num_complex::Complex64;
use rand_distr::{Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

/// An antenna at a distance d from its nominal position receives the phase centre s earlier by d . s / c. The phase tracking does not
/// correct this: g = exp(-2 pi i f d . s / c), as V_corrupt = exp(+2 pi i f (d2 - d1) . s / c) V. Away from the phase centre, d also shifts
/// (u, v). In a field of a few degrees this effect is far smaller, and it is not included. A set that is simulated with the true layout
/// includes it.
///
/// # Reference
/// Thompson, Moran & Swenson 2017, sect. 4.1 and eq. 4.1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PositionError {
    /// Standard deviation of each coordinate, m; `None` takes the uncertainties of the layout.
    pub rms_m: Option<f64>,
}

impl PositionError {
    /// The injected offsets in m, in the axes of the layout \[ant\].
    ///
    /// # Errors
    /// `rms_m` is not given, and the layout has no uncertainty for an antenna.
    pub fn offsets(&self, context: &Context<'_>) -> Result<Vec<[f64; 3]>> {
        context
            .header
            .layout
            .antennas()
            .iter()
            .enumerate()
            .map(|(k, a)| {
                let sigma = self.rms_m.map(|r| [r; 3]).or(a.position_error_m).ok_or_else(|| {
                    ChainError::Incompatible(format!("antenna {:?} has no position uncertainty in the layout: state one for all", a.name))
                })?;
                let mut rng = context.rng(k as u64);
                Ok(sigma.map(|s| {
                    let x: f64 = StandardNormal.sample(&mut rng);
                    s * x
                }))
            })
            .collect()
    }
}

/// Rms of antenna positions: one length for all, or the uncertainties in the layout.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PositionRms {
    /// The uncertainties in the layout.
    Layout,
    /// This length for each coordinate.
    Each(Length),
}
word_or_quantity!(
    PositionRms,
    "layout" => Layout,
    Each(Length),
    "A length such as \"1mm\", or layout for the uncertainties in the layout."
);

/// Options of position errors.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct PositionOptions {
    /// Rms of each coordinate of the antenna positions, or layout for the uncertainties in the layout.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH|layout"))]
    pub position_rms: Option<PositionRms>,
}

impl PositionOptions {
    /// The error, if the options select it.
    pub(super) fn error(&self, _shared: &Shared<'_>) -> Result<Option<PositionError>> {
        let rms_m = |rms| match rms {
            PositionRms::Layout => None,
            PositionRms::Each(length) => Some(length.si()),
        };
        Ok(self.position_rms.map(|rms| PositionError { rms_m: rms_m(rms) }))
    }
}

impl Corruption for PositionError {
    fn check(&self) -> Result<()> {
        need_size("position rms in m", self.rms_m.unwrap_or(0.0))
    }

    fn chromatic(&self) -> bool {
        true
    }

    fn needs_direction(&self) -> bool {
        true
    }

    fn gains(&self, context: &Context<'_>, table: &mut GainTable) -> Result<()> {
        let offsets = self.offsets(context)?;
        for ((time, ant, chan, _), g) in table.gains.indexed_iter_mut() {
            let path: f64 = offsets[ant].iter().zip(&context.toward[time]).map(|(d, s)| d * s).sum();
            *g *= Complex64::cis(-std::f64::consts::TAU * context.freq_hz[chan] * path / SPEED_OF_LIGHT_M_S);
        }
        Ok(())
    }
}
