//! Injects known errors into visibilities, so that the result of a calibration can be compared with the true gains.
//!
//! Errors of an antenna are gains in the convention V_corrupt = g1 conj(g2) V. Their product is returned as a
//! [`cittert_arrays::GainTable`]: the true gains. Other errors change only the data. Each kind of error has one file and one variant of
//! [`Error`]. Each draw uses a random stream of its own, so an error does not change when another error is added.
//!
//! The order is fixed: gains, then offsets, then noise, then flags.

mod amplitude;
mod bandpass;
mod baseline;
mod context;
mod corruption;
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
pub use corruption::Corruption;
pub(crate) use corruption::{need, need_size};
pub use delay::DelayError;
pub use dropout::Dropout;
pub use engine::{corrupt, corrupted_header};
pub use flags::WrongFlags;
pub use noise::ThermalNoise;
pub use phase::PhaseError;
pub use position::PositionError;
pub use troposphere::Troposphere;
pub use variation::Variation;

use serde::{Deserialize, Serialize};

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
