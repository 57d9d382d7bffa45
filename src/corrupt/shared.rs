//! What several kinds of errors share when they are made from their options.

use super::air::AirSource;
use super::screen::WindOptions;
use super::variation::Variation;
use cittert_arrays::VisUnit;

/// What the options of a kind may need beside their own.
#[derive(Clone, Copy)]
pub(super) struct Shared<'a> {
    /// How errors change in time, where a kind does not say otherwise.
    pub(super) variation: Variation,
    /// Unit of the set.
    pub(super) unit: VisUnit,
    /// The wind of the kinds that have a screen.
    pub(super) wind: &'a WindOptions,
    /// Where the air of a name is found.
    pub(super) airs: &'a dyn AirSource,
}
