//! Antennas that have no signal for some time.

use super::context::Context;
use super::corruption::Corruption;
use super::shared::Shared;
use super::variation::exponential;
use crate::Result;
use crate::values::need;
use cittert_arrays::quantity::Duration;
use cittert_arrays::{GainTable, VisibilityBlock};
use num_complex::Complex64;
use rand::RngExt;
use serde::{Deserialize, Serialize};

/// Each antenna is off at random times, for durations with an exponential distribution. Its gain is then 0 and flagged in the truth, and
/// its visibilities are 0 (plus noise).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Dropout {
    /// Part of the time that an antenna is off, 0 to below 1.
    pub fraction: f64,
    /// Mean length of a dropout, s.
    pub mean_s: f64,
    /// True if the array notices the dropout and flags the data. Otherwise the data count as good.
    pub noticed: bool,
}

/// Options of dropouts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct DropoutOptions {
    /// Fraction of the time for which an antenna is silent, 0 to below 1.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X"))]
    pub dropout: Option<f64>,
    /// Mean length of a silence.
    #[cfg_attr(feature = "cli", arg(long, value_name = "TIME", default_value_t = DropoutOptions::default().dropout_length))]
    pub dropout_length: Duration,
    /// The array notices silences and flags the data.
    #[cfg_attr(feature = "cli", arg(long))]
    pub dropout_noticed: bool,
}

impl Default for DropoutOptions {
    fn default() -> Self {
        Self { dropout: None, dropout_length: Duration(60.0), dropout_noticed: false }
    }
}

impl DropoutOptions {
    /// The error, if the options select it.
    pub(super) fn error(&self, _shared: &Shared<'_>) -> Result<Option<Dropout>> {
        let of = |fraction| Dropout { fraction, mean_s: self.dropout_length.si(), noticed: self.dropout_noticed };
        Ok(self.dropout.map(of))
    }
}

/// Most switches between two times. After so many the state does not depend on the one before.
const MOST_SWITCHES: u32 = 20_000;

impl Corruption for Dropout {
    fn check(&self) -> Result<()> {
        need("fraction of dropouts", self.fraction, (0.0..1.0).contains(&self.fraction), "a number from 0 to below 1")?;
        need("length of dropouts in s", self.mean_s, self.mean_s.is_finite() && self.mean_s > 0.0, "a positive time")
    }

    fn gains(&self, context: &Context<'_>, table: &mut GainTable) -> Result<()> {
        if self.fraction == 0.0 {
            return Ok(());
        }
        let mean_on = self.mean_s * (1.0 - self.fraction) / self.fraction;
        for ant in 0..table.gains.dim().1 {
            let mut rng = context.rng(ant as u64);
            let mut off = rng.random::<f64>() < self.fraction;
            let mean = |off: bool| if off { self.mean_s } else { mean_on };
            let mut until = exponential(mean(off), &mut rng);
            for (time, t) in context.seconds.iter().enumerate() {
                // After a long gap the state is drawn again, in the same way as at the start.
                if t - until > 1e4 * (self.mean_s + mean_on) {
                    off = rng.random::<f64>() < self.fraction;
                    until = t + exponential(mean(off), &mut rng);
                }
                let mut left = MOST_SWITCHES;
                while *t >= until {
                    off = !off;
                    until += exponential(mean(off), &mut rng);
                    left -= 1;
                    if left == 0 {
                        off = rng.random::<f64>() < self.fraction;
                        until = t.next_up() + exponential(mean(off), &mut rng);
                    }
                }
                if off {
                    table.gains.slice_mut(ndarray::s![time, ant, .., ..]).fill(Complex64::ZERO);
                    table.flags.slice_mut(ndarray::s![time, ant, .., ..]).fill(true);
                }
            }
        }
        Ok(())
    }

    fn data(&self, context: &Context<'_>, table: &GainTable, block: &mut VisibilityBlock, _first_row: u64) -> Result<()> {
        if !self.noticed {
            return Ok(());
        }
        for row in 0..block.n_rows() {
            let time = context.time_index(block.coverage.time_jd[row]);
            let off = |ant: u32| table.flags[[time, ant as usize, 0, 0]];
            if off(block.coverage.ant1[row]) || off(block.coverage.ant2[row]) {
                block.flags.slice_mut(ndarray::s![row, .., ..]).fill(true);
            }
        }
        Ok(())
    }
}
