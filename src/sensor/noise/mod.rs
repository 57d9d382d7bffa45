//! What adds to the temperatures of samples. A new part is a file in this folder and a row of [`NOISE`].

mod drift;
mod flicker;
mod gain;
mod moment;
mod part;
mod pattern;
mod quantize;
mod radiometer;
mod step;
mod table;
mod thermal;

pub(super) use drift::Drifts;
pub(super) use moment::Moment;
pub(super) use part::NoisePart;
pub use part::{NoiseKind, Receiver};
pub use radiometer::{RADIOMETERS, Radiometer, RadiometerKind};
pub use table::NOISE;
