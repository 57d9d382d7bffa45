//! Known errors put into data: the first half of asking how much of the truth a calibration brings back.
//!
//! Errors of an antenna are gains in the convention V_corrupt = g1 conj(g2) V; their product is returned as a [`GainTable`], the truth
//! that a solution can be compared with. Other errors change the data alone. Each kind is one file and one variant of [`Error`];
//! every draw comes from a stream of random numbers of its own, so that one error does not change when another is added.
//!
//! The order is fixed: gains, then offsets, then noise, then flags.

mod amplitude;
mod bandpass;
mod baseline;
mod context;
mod delay;
mod dropout;
mod engine;
#[cfg(test)]
mod engine_tests;
mod flags;
mod noise;
mod phase;
mod position;
mod troposphere;
mod variation;

pub use amplitude::AmplitudeError;
pub use bandpass::BandpassError;
pub use baseline::BaselineOffset;
pub use context::Context;
pub use delay::DelayError;
pub use dropout::Dropout;
pub use engine::{corrupt, corrupted_header};
pub use flags::WrongFlags;
pub use noise::ThermalNoise;
pub use phase::PhaseError;
pub use position::PositionError;
pub use troposphere::Troposphere;
pub use variation::Variation;

use crate::Result;
use cittert_arrays::{GainTable, VisibilityBlock};
use serde::{Deserialize, Serialize};

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

/// One error to inject.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Error {
    /// Phases of the antennas.
    Phase(PhaseError),
    /// Amplitudes of the antennas.
    Amplitude(AmplitudeError),
    /// Delays: a phase slope over the channels.
    Delay(DelayError),
    /// Antennas that do not stand where the layout says.
    Position(PositionError),
    /// A turbulent atmosphere that the wind carries over the array.
    Troposphere(Troposphere),
    /// Ripple and mismatch of the receivers over the band.
    Bandpass(BandpassError),
    /// Constants added to the visibilities of a baseline.
    Baseline(BaselineOffset),
    /// Antennas that fall silent for a while.
    Dropout(Dropout),
    /// Thermal noise of the receivers.
    Noise(ThermalNoise),
    /// Flags on good data, and none on bad.
    Flags(WrongFlags),
}

impl Error {
    /// Every kind with its name and one line for help texts, in the order in which they act.
    pub const TABLE: [(&'static str, &'static str); 10] = [
        ("phase", "phases of the antennas: constant, per integration, walking, jumping or with a coherence time"),
        ("amplitude", "amplitudes of the antennas, with the same choices in time"),
        ("delay", "delays of the antennas: a phase slope over the channels"),
        ("position", "antennas that do not stand where the layout says"),
        ("troposphere", "a Kolmogorov screen of water vapour carried over the array by the wind"),
        ("bandpass", "standing waves and mismatch of the receivers over the band"),
        ("baseline", "constants added to the visibilities of each baseline"),
        ("dropout", "antennas that fall silent for a while"),
        ("noise", "thermal noise of the receivers, on top"),
        ("flags", "flags on good data, and none on bad"),
    ];

    /// The kind's place in [`Error::TABLE`], and what it does.
    fn row(&self) -> (usize, &dyn Corruption) {
        match self {
            Self::Phase(e) => (0, e),
            Self::Amplitude(e) => (1, e),
            Self::Delay(e) => (2, e),
            Self::Position(e) => (3, e),
            Self::Troposphere(e) => (4, e),
            Self::Bandpass(e) => (5, e),
            Self::Baseline(e) => (6, e),
            Self::Dropout(e) => (7, e),
            Self::Noise(e) => (8, e),
            Self::Flags(e) => (9, e),
        }
    }

    /// Name of the kind.
    #[must_use]
    pub fn name(&self) -> &'static str {
        Self::TABLE[self.row().0].0
    }

    /// What it does.
    #[must_use]
    pub fn model(&self) -> &dyn Corruption {
        self.row().1
    }
}

/// Which errors to inject.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CorruptOptions {
    /// Seed of all random numbers.
    pub seed: u64,
    /// The errors; several of one kind add up, each with numbers of its own.
    pub errors: Vec<Error>,
    /// Different errors for the two feeds of an antenna; otherwise both have the same.
    pub per_feed: bool,
}

/// An error for a parameter outside its range.
pub(crate) fn need(option: &'static str, value: f64, good: bool, expected: &str) -> Result<()> {
    if good { Ok(()) } else { Err(crate::ChainError::BadOption { option, value: value.to_string(), expected: expected.into() }) }
}

/// The check of a size: finite and not negative.
pub(crate) fn need_size(option: &'static str, value: f64) -> Result<()> {
    need(option, value, value.is_finite() && value >= 0.0, "a finite number of at least 0")
}
