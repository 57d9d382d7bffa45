//! Options of enhancement: one type for the library, the command line and its files.

use super::chain::StepList;
use super::target::Target;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Options of enhancement.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::Args))]
pub struct EnhanceOptions {
    /// Steps in their order with commas between, each with its values after "=" and with colons between: median=5,clahe,unsharp=1.5:0.8.
    #[cfg_attr(feature = "cli", arg(long, value_name = "STEPS", allow_hyphen_values = true))]
    pub steps: Option<StepList>,
    /// PSF of the sensor, a FITS image with the cell of the image and its centre at pixel n / 2. Deconvolution needs it.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FITS"))]
    pub psf: Option<PathBuf>,
    /// True image, a FITS image of the same field, for scores before and after.
    #[cfg_attr(feature = "cli", arg(long, value_name = "FITS"))]
    pub truth: Option<PathBuf>,
    /// Disc around a target, for its contrast before and after: column, row (from 0 at the lower left) and radius in pixels of the image.
    #[cfg_attr(feature = "cli", arg(long, value_name = "X,Y,R", allow_hyphen_values = true))]
    pub target: Option<Target>,
}

impl EnhanceOptions {
    /// These options, and those of `other` where one is missing here.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            steps: self.steps.or(other.steps),
            psf: self.psf.or(other.psf),
            truth: self.truth.or(other.truth),
            target: self.target.or(other.target),
        }
    }
}
