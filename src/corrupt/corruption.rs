//! What every kind of error offers, and the checks that they share.

use super::context::Context;
use crate::Result;
use crate::values::bad_value;
use cittert_arrays::{GainTable, VisibilityBlock};

/// What a kind of error does. The methods that do not concern it stay empty.
pub trait Corruption: std::fmt::Debug + Send + Sync {
    /// Check the parameters.
    ///
    /// # Errors
    /// The first parameter that is outside its range.
    fn check(&self) -> Result<()>;

    /// True where the gains differ from channel to channel.
    fn chromatic(&self) -> bool {
        false
    }

    /// True where the direction of the phase centre over the array is needed.
    fn needs_direction(&self) -> bool {
        false
    }

    /// Multiply this error into the gains.
    ///
    /// # Errors
    /// What the layout does not tell (such as uncertainties of positions).
    fn gains(&self, _context: &Context<'_>, _table: &mut GainTable) -> Result<()> {
        Ok(())
    }

    /// Change data to which the gains have been applied; `first_row` rows of the set come before the block.
    ///
    /// # Errors
    /// As the kind of error says.
    fn data(&self, _context: &Context<'_>, _table: &GainTable, _block: &mut VisibilityBlock, _first_row: u64) -> Result<()> {
        Ok(())
    }
}

/// An error for a parameter outside its range.
pub(crate) fn need(option: &'static str, value: f64, good: bool, expected: &str) -> Result<()> {
    if good { Ok(()) } else { bad_value(option, value, expected) }
}

/// The check of a size: finite and not negative.
pub(crate) fn need_size(option: &'static str, value: f64) -> Result<()> {
    need(option, value, value.is_finite() && value >= 0.0, "a finite number of at least 0")
}
