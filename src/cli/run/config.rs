//! The file that describes a whole run. Every key of a section is the option of the same name of the subcommand that the section runs.

use crate::cli::failure::Result;
use crate::cli::made::{MakeSection, Origin};
use crate::cli::quality::Limits;
use crate::cli::sections::{SceneSection, Section, SelfcalSection, SimulateSection};
use crate::corrupt::ErrorOptions;
use crate::deconvolve::CleanOptions;
use crate::imaging::{ImageSize, ImagingOptions};
use crate::mem::MemOptions;
use cittert_arrays::quantity::Angle;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A whole run.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Config {
    /// Title of the report.
    pub title: String,
    /// Seed of every random draw of the run.
    #[serde(default = "default_seed")]
    pub seed: u64,
    /// The array.
    pub layout: LayoutSection,
    /// What is observed.
    pub scene: Section<SceneSection>,
    /// How visibilities are made.
    pub simulate: Section<SimulateSection>,
    /// The u-v mask on the FFT grid of the images.
    pub mask: Option<MaskSection>,
    /// Options of every image.
    #[serde(default)]
    pub image: Section<ImagingOptions>,
    /// Deconvolutions, one after another.
    #[serde(default)]
    pub clean: Vec<Section<CleanOptions>>,
    /// Maximum entropy, after the deconvolutions.
    pub mem: Option<Section<MemOptions>>,
    /// Errors put into the visibilities.
    pub corrupt: Option<Section<ErrorOptions>>,
    /// Self-calibration of the corrupted visibilities, or of the visibilities as they are.
    pub selfcal: Option<Section<SelfcalSection>>,
    /// Numbers of metrics.json that the run must reach. A miss ends the command with exit code 1.
    #[serde(default)]
    pub quality: BTreeMap<String, Limits>,
}

fn default_seed() -> u64 {
    1
}

/// The array of a run.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct LayoutSection {
    /// Name of a built-in layout, or path of a layout file (relative to the configuration).
    pub name: Option<String>,
    /// A layout that `layout make` makes, instead of a name.
    pub make: Option<Section<MakeSection>>,
}

impl LayoutSection {
    /// Where the antennas stand.
    ///
    /// # Errors
    /// The section has a name and a generated layout, or neither.
    pub fn origin(&self) -> Result<Origin<'_>> {
        Origin::of(self.name.as_deref(), self.make.as_ref())
    }
}

/// Options of `mask`. Keys that are left out are those of the images.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct MaskSection {
    /// Number of pixels along each side of the image whose Fourier grid is filled.
    pub size: Option<ImageSize>,
    /// Size of a pixel of that image.
    pub cell: Option<Angle>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::sections::words;

    const TEXT: &str = r#"
title = "t"
layout = { name = "vla-a" }
scene = { file = "s.csv" }
[simulate]
freq = "1.4GHz"
bandwidth = "64MHz"
noise = true
hour-angle = "-2h,2h"
[[clean]]
algorithm = "hogbom"
"#;

    #[test]
    fn a_section_becomes_the_words_of_its_command() {
        let c: Config = toml::from_str(TEXT).unwrap();
        let words = words(&c.simulate.keys);
        assert_eq!(words, ["--bandwidth=64MHz", "--freq=1.4GHz", "--hour-angle=-2h,2h", "--noise"]);
        assert!(c.simulate.options.how.noise && c.simulate.options.band.channels == 1);
    }

    #[test]
    fn errors_point_at_the_line() {
        let wrong = |from: &str, to: &str| toml::from_str::<Config>(&TEXT.replace(from, to)).unwrap_err().to_string();
        let e = wrong("\"64MHz\"", "\"64\"");
        assert!(e.contains("line 7") && e.contains("no unit"), "{e}");
        let e = wrong("hour-angle", "hour_angle");
        assert!(e.contains("line 9") && e.contains("hour_angle"), "{e}");
        let e = wrong("freq = \"1.4GHz\"", "");
        assert!(e.contains("freq"), "{e}");
    }
}
