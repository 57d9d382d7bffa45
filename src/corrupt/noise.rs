//! Thermal noise in addition to the other errors.

use super::context::Context;
use super::corruption::{Corruption, need_size};
use super::shared::Shared;
use crate::Result;
use crate::simulate::options::sensitivity;
use crate::simulate::{NoiseModel, NoiseOptions};
use cittert_arrays::quantity::{FluxDensity, Length, Temperature};
use cittert_arrays::{GainTable, Sensitivity, VisibilityBlock};
use rand::Rng;
use serde::{Deserialize, Serialize};

/// Noise of the receivers, as in a simulation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ThermalNoise {
    /// SEFD or Tsys of every antenna; `None` takes the values of the layout.
    pub sensitivity: Option<Sensitivity>,
    /// Diameter of every antenna for Tsys, m; `None` takes the values of the layout.
    pub diameter_m: Option<f64>,
    /// True if the data have noise already. Its variance is then added. Otherwise the weights become those of the new noise.
    pub data_have_noise: bool,
}

/// Options of thermal noise.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct ThermalNoiseOptions {
    /// Add thermal noise by the SEFD or system temperature of each antenna.
    #[cfg_attr(feature = "cli", arg(long))]
    pub noise: bool,
    /// SEFD of every antenna. It turns the noise on.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FLUX", conflicts_with = "tsys"))]
    pub sefd: Option<FluxDensity>,
    /// System temperature of every antenna. It turns the noise on.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TEMP"))]
    pub tsys: Option<Temperature>,
    /// Diameter of every antenna, for noise from system temperatures.
    #[cfg_attr(feature = "cli", arg(long, value_name = "LENGTH"))]
    pub diameter: Option<Length>,
    /// The data have noise already: its variance is added to that of the new noise in the weights.
    #[cfg_attr(feature = "cli", arg(long))]
    pub data_have_noise: bool,
}

impl ThermalNoiseOptions {
    /// The error, if the options select it.
    pub(super) fn error(&self, _shared: &Shared<'_>) -> Result<Option<ThermalNoise>> {
        let sensitivity = sensitivity(self.sefd, self.tsys)?;
        let model = ThermalNoise { sensitivity, diameter_m: self.diameter.map(|d| d.si()), data_have_noise: self.data_have_noise };
        Ok((self.noise || sensitivity.is_some()).then_some(model))
    }
}

impl Corruption for ThermalNoise {
    fn check(&self) -> Result<()> {
        need_size("diameter for the noise in m", self.diameter_m.unwrap_or(0.0))
    }

    fn data(&self, context: &Context<'_>, _table: &GainTable, block: &mut VisibilityBlock, first_row: u64) -> Result<()> {
        let seed = context.rng(0).next_u64();
        let options = NoiseOptions { sensitivity: self.sensitivity, diameter_m: self.diameter_m, ..NoiseOptions::seeded(seed) };
        let before = self.data_have_noise.then(|| block.weights.clone());
        NoiseModel::new(context.header, &options, &context.header.layout.pattern)?.apply(block, first_row)?;
        if let Some(before) = before {
            ndarray::Zip::from(&mut block.weights).and(&before).for_each(|w, old| {
                *w = if *old > 0.0 { 1.0 / (1.0 / *w + 1.0 / *old) } else { *old };
            });
        }
        Ok(())
    }
}
