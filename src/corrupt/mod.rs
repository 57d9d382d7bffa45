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
mod kinds;
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
pub use delay::DelayError;
pub use dropout::Dropout;
pub use engine::{corrupt, corrupted_header};
pub use flags::WrongFlags;
pub use kinds::{CorruptOptions, Error, ErrorOptions};
pub use noise::ThermalNoise;
pub use phase::PhaseError;
pub use position::{PositionError, PositionRms};
pub use troposphere::Troposphere;
pub use variation::Variation;
