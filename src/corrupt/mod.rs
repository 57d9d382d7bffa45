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
