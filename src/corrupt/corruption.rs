//! The interface of all kinds of errors.

use super::context::Context;
use crate::Result;
use crate::simulate::Receivers;
use crate::values::need;
use cittert_arrays::pattern::Pointings;
use cittert_arrays::{GainTable, VisibilityBlock};

/// One kind of error. It implements only the methods that concern it.
pub trait Corruption: std::fmt::Debug + Send + Sync {
    /// Check the parameters.
    ///
    /// # Errors
    /// A parameter is outside its range.
    fn check(&self) -> Result<()>;

    /// True if the gains differ from channel to channel.
    fn chromatic(&self) -> bool {
        false
    }

    /// True if the gains need the direction of the phase centre.
    fn needs_direction(&self) -> bool {
        false
    }

    /// True if a screen of turbulence blows over the array.
    fn blows(&self) -> bool {
        false
    }

    /// True if the error changes what each baseline sees of the scene, so that the scene is needed to put it into data.
    fn of_scene(&self) -> bool {
        false
    }

    /// Add this error to the patterns of the antennas.
    ///
    /// # Errors
    /// Those of the kind of error.
    fn pointings(&self, _context: &Context<'_>, _pointings: &mut Pointings) -> Result<()> {
        Ok(())
    }

    /// Add this error to the receivers.
    ///
    /// # Errors
    /// Those of the kind of error.
    fn receivers(&self, _context: &Context<'_>, _receivers: &mut Receivers) -> Result<()> {
        Ok(())
    }

    /// True if the two feeds of an antenna have different errors in any case.
    fn tells_feeds_apart(&self) -> bool {
        false
    }

    /// Multiply this error into the gains.
    ///
    /// # Errors
    /// The layout lacks a value that the error needs, such as the uncertainty of a position.
    fn gains(&self, _context: &Context<'_>, _table: &mut GainTable) -> Result<()> {
        Ok(())
    }

    /// Change the data of a block after the gains were applied. `first_row` is the index of its first row in the set.
    ///
    /// # Errors
    /// Those of the kind of error.
    fn data(&self, _context: &Context<'_>, _table: &GainTable, _block: &mut VisibilityBlock, _first_row: u64) -> Result<()> {
        Ok(())
    }
}

/// Check that a parameter is finite and not negative.
pub(crate) fn need_size(option: &'static str, value: f64) -> Result<()> {
    need(option, value, value.is_finite() && value >= 0.0, "a finite number of at least 0")
}
