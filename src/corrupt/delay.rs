//! Delay errors of the antennas.

use super::{Context, Corruption, Variation, need_size};
use crate::Result;
use cittert_arrays::GainTable;
use ndarray::Axis;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// g = exp(2 pi i (f - f0) tau) with a Gaussian tau; f0 is the mean of the channels, where the phase stays what it was.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DelayError {
    /// Standard deviation of the delay of an antenna, s.
    pub rms_s: f64,
    /// Its behaviour in time.
    #[serde(default, flatten)]
    pub variation: Variation,
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
        let (_, n_ant, _, n_feed) = table.gains.dim();
        let middle = context.header.spectrum.mean_hz();
        for ant in 0..n_ant {
            for feed in 0..n_feed {
                let series = self.variation.series(context.seconds, &mut context.rng((2 * ant + feed) as u64));
                for (mut row, x) in table.gains.axis_iter_mut(Axis(0)).zip(series) {
                    for (c, f) in context.freq_hz.iter().enumerate() {
                        row[[ant, c, feed]] *= Complex64::cis(std::f64::consts::TAU * (f - middle) * self.rms_s * x);
                    }
                }
            }
        }
        Ok(())
    }
}
