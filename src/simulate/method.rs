//! The methods that transform images.

use serde::{Deserialize, Serialize};

/// The transform of images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum, schemars::JsonSchema))]
pub enum Method {
    /// Exact sum over pixels. It is slow, and the other methods are tested against it.
    Dft,
    /// FFT and interpolation with a requested accuracy.
    #[default]
    Degrid,
    /// Nearest cell of the FFT of the scene.
    Mask,
}

impl Method {
    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Dft => "dft",
            Self::Degrid => "degrid",
            Self::Mask => "mask",
        }
    }
}
