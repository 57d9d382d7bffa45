//! The methods that transform images.

use crate::{ChainError, Result};
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
    /// All methods, with their names and one line for help texts.
    pub const TABLE: [(Self, &'static str, &'static str); 3] = [
        (Self::Dft, "dft", "exact sum over pixels and sources (slow)"),
        (Self::Degrid, "degrid", "FFT and interpolation, with the accuracy of epsilon"),
        (Self::Mask, "mask", "nearest cell of the FFT of the scene"),
    ];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::TABLE.iter().find(|t| t.0 == self).map_or("", |t| t.1)
    }
}

impl std::str::FromStr for Method {
    type Err = ChainError;

    fn from_str(text: &str) -> Result<Self> {
        Self::TABLE
            .iter()
            .find(|t| t.1 == text)
            .map(|t| t.0)
            .ok_or_else(|| ChainError::bad_option("method", text, Self::TABLE.map(|t| t.1).join(", ")))
    }
}
