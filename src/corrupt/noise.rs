//! Thermal noise in addition to the other errors.

use super::{Context, Corruption, need_size};
use crate::Result;
use crate::simulate::{ElementPattern, NoiseModel, NoiseOptions};
use cittert_arrays::{GainTable, Sensitivity, VisibilityBlock};
use rand::Rng;
use serde::{Deserialize, Serialize};

/// Noise of the receivers, as in a simulation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ThermalNoise {
    /// SEFD or Tsys of every antenna; `None` takes the layout's.
    pub sensitivity: Option<Sensitivity>,
    /// Diameter of every antenna for Tsys, m; `None` takes the layout's.
    pub diameter_m: Option<f64>,
    /// True where the data have noise already, whose variance then adds; otherwise the weights become those of the new noise.
    pub data_have_noise: bool,
}

impl Corruption for ThermalNoise {
    fn check(&self) -> Result<()> {
        need_size("diameter for the noise in m", self.diameter_m.unwrap_or(0.0))
    }

    fn data(&self, context: &Context<'_>, _table: &GainTable, block: &mut VisibilityBlock, first_row: u64) -> Result<()> {
        let seed = context.rng(0).next_u64();
        let options = NoiseOptions { sensitivity: self.sensitivity, diameter_m: self.diameter_m, ..NoiseOptions::seeded(seed) };
        let before = self.data_have_noise.then(|| block.weights.clone());
        NoiseModel::new(context.header, &options, &ElementPattern::None)?.apply(block, first_row)?;
        if let Some(before) = before {
            ndarray::Zip::from(&mut block.weights).and(&before).for_each(|w, old| {
                *w = if *old > 0.0 { 1.0 / (1.0 / *w + 1.0 / *old) } else { *old };
            });
        }
        Ok(())
    }
}
