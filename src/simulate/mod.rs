//! From a scene and the coverage of an array to visibilities.
//!
//! A [`Simulator`] checks scene, layout and options once, then turns rows of coverage into blocks of visibilities, so that
//! a set of any length needs the memory of one block. Three methods share everything but the transform of images:
//!
//! | method | transform of images | error |
//! |---|---|---|
//! | [`Method::Dft`] | exact sum over the pixels | rounding |
//! | [`Method::Degrid`] | FFT and interpolation by a gridding kernel | at most [`SimulateOptions::epsilon`] of the total flux |
//! | [`Method::Mask`] | nearest cell of the FFT of the scene | that of moving each baseline by up to half a cell |
//!
//! Points and Gaussians are exact sums in all three (in `mask`, at the centres of the cells).

mod analytic;
mod degrid;
pub mod dft;
pub mod element;
mod engine;
#[cfg(test)]
mod engine_tests;
pub mod mask;
pub mod noise;
pub mod options;
pub mod pedestal;
mod phasor;
mod sky;

pub use element::ElementPattern;
pub use engine::{Simulator, Summary, simulate_set};
pub use mask::{UvMask, UvMaskBuilder};
pub use noise::{NoiseModel, NoiseOptions};
pub use options::{
    BandOptions, DataUnit, Direction, Element, HourAngles, PlannedTrack, SceneOptions, SimulateOptions, TrackOptions, UtcTime,
};
pub use pedestal::Pedestal;
pub use sky::{SkyModel, jy_per_kelvin_sr};

use serde::{Deserialize, Serialize};

/// How images are transformed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum, schemars::JsonSchema))]
pub enum Method {
    /// Exact sum over pixels: slow, and the truth for the others.
    Dft,
    /// FFT and interpolation, to a requested accuracy.
    #[default]
    Degrid,
    /// Nearest cell of the FFT of the scene.
    Mask,
}

impl Method {
    /// Every method with its name and one line for help texts.
    pub const TABLE: [(Self, &'static str, &'static str); 3] = [
        (Self::Dft, "dft", "exact sum over pixels and sources (slow; the truth for the others)"),
        (Self::Degrid, "degrid", "FFT and interpolation, to the accuracy of --epsilon"),
        (Self::Mask, "mask", "nearest cell of the FFT of the scene"),
    ];

    /// Name on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::TABLE.iter().find(|t| t.0 == self).map_or("", |t| t.1)
    }
}

impl std::str::FromStr for Method {
    type Err = crate::ChainError;

    fn from_str(text: &str) -> crate::Result<Self> {
        Self::TABLE.iter().find(|t| t.1 == text).map(|t| t.0).ok_or_else(|| crate::ChainError::BadOption {
            option: "method",
            value: text.into(),
            expected: Self::TABLE.map(|t| t.1).join(", "),
        })
    }
}
