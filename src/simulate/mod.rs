//! Simulation: the visibilities of a scene for the coverage of an array.
//!
//! A [`Simulator`] checks the scene, the layout and the options once. It then computes visibilities block by block, so a set of any length
//! needs the memory of one block. The three methods differ only in the transform of images:
//!
//! | method | transform of images | error |
//! |---|---|---|
//! | [`Method::Dft`] | exact sum over the pixels | rounding |
//! | [`Method::Degrid`] | FFT and interpolation by a gridding kernel | at most [`SimulateOptions::epsilon`] of the total flux |
//! | [`Method::Mask`] | nearest cell of the FFT of the scene | that of moving each baseline by up to half a cell |
//!
//! A scene on a surface near the array is an exact sum over spherical waves, whatever the method. Points and Gaussians are exact sums in all three methods (in `mask` at the centres of the cells).

mod analytic;
pub mod band;
mod components;
mod degrid;
pub mod dft;
mod differing;
mod element;
mod engine;
#[cfg(test)]
mod engine_tests;
pub mod fields;
pub mod mask;
mod method;
mod near;
mod near_scene;
#[cfg(test)]
mod near_tests;
pub mod noise;
pub mod options;
#[cfg(test)]
mod pattern_tests;
pub mod pedestal;
mod polarized;
#[cfg(test)]
mod polarized_tests;
mod run;
#[cfg(test)]
mod run_tests;
mod scene_noise;
#[cfg(test)]
mod scene_noise_tests;
mod sky;
mod through;
#[cfg(test)]
mod through_tests;
mod total_power;
#[cfg(test)]
mod total_power_tests;
mod whole_set;
mod zero_spacing;

pub use band::{BandShape, Receiver, Receivers};
pub use cittert_arrays::{ElementPattern, jy_per_kelvin_sr};
pub use element::Element;
pub use engine::Simulator;
pub use fields::Fields;
pub use mask::UvMask;
pub use method::Method;
pub use noise::{NoiseModel, NoiseOptions};
pub use options::{BandOptions, DataUnit, Direction, HourAngles, PlannedTrack, SceneOptions, SimulateOptions, TrackOptions, UtcTime};
pub use pedestal::Pedestal;
pub use polarized::FeedBasis;
pub use run::Summary;
pub use sky::SkyModel;
pub use whole_set::simulate_set;
