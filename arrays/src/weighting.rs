//! The schemes of weights.

use serde::{Deserialize, Serialize};

/// Scheme of the weights of visibilities in an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum, schemars::JsonSchema))]
pub enum Weighting {
    /// By the noise alone: the best signal to noise ratio of a point.
    Natural,
    /// Every occupied cell of the u-v plane counts the same: the sharpest beam.
    Uniform,
    /// Between natural and uniform, by the robustness.
    Briggs,
}
