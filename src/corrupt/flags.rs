//! Wrong flags: flags on good data, and missing flags on bad data.

use super::context::Context;
use super::corruption::Corruption;
use super::shared::Shared;
use crate::Result;
use crate::values::need;
use cittert_arrays::{GainTable, VisibilityBlock};
use rand::RngExt;
use serde::{Deserialize, Serialize};

/// Each datum is drawn independently.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct WrongFlags {
    /// Part of the good data that is flagged, 0 to 1.
    pub good_flagged: f64,
    /// Part of the flagged data that loses its flag, 0 to 1.
    pub bad_unflagged: f64,
}

/// Options of wrong flags.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args, schemars::JsonSchema))]
pub struct FlagOptions {
    /// Fraction of the good data that is flagged.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X"))]
    pub flag_good: Option<f64>,
    /// Fraction of the flagged data that loses its flag.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X"))]
    pub unflag_bad: Option<f64>,
}

impl FlagOptions {
    /// The error, if the options select it.
    pub(super) fn error(&self, _shared: &Shared<'_>) -> Result<Option<WrongFlags>> {
        let model = WrongFlags { good_flagged: self.flag_good.unwrap_or(0.0), bad_unflagged: self.unflag_bad.unwrap_or(0.0) };
        Ok((self.flag_good.is_some() || self.unflag_bad.is_some()).then_some(model))
    }
}

impl Corruption for WrongFlags {
    fn check(&self) -> Result<()> {
        for (option, v) in [("fraction of good data flagged", self.good_flagged), ("fraction of bad data unflagged", self.bad_unflagged)] {
            need(option, v, (0.0..=1.0).contains(&v), "a number from 0 to 1")?;
        }
        Ok(())
    }

    fn data(&self, context: &Context<'_>, _table: &GainTable, block: &mut VisibilityBlock, first_row: u64) -> Result<()> {
        for row in 0..block.n_rows() {
            let mut rng = context.rng(first_row + row as u64);
            for flag in block.flags.slice_mut(ndarray::s![row, .., ..]) {
                let turn = rng.random::<f64>() < if *flag { self.bad_unflagged } else { self.good_flagged };
                *flag ^= turn;
            }
        }
        Ok(())
    }
}
