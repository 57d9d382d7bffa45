//! The file that describes a study.

use crate::cli::sections::{SceneSection, Section, SimulateSection, StudySelfcalSection};
use crate::corrupt::ErrorOptions;
use crate::deconvolve::CleanOptions;
use crate::imaging::ImagingOptions;
use schemars::JsonSchema;
use serde::Deserialize;

/// A study: an observation, errors that are put into it, and parameters that vary.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Config {
    /// Title of the report.
    pub title: String,
    /// Number of seeds, and so of trials, of each point.
    pub seeds: usize,
    /// The first seed.
    #[serde(default = "one")]
    pub seed: u64,
    /// The array.
    pub layout: LayoutSection,
    /// What is observed.
    pub scene: Section<SceneSection>,
    /// How visibilities are made.
    pub simulate: Section<SimulateSection>,
    /// Options of every image.
    #[serde(default)]
    pub image: Section<ImagingOptions>,
    /// How images are deconvolved.
    #[serde(default)]
    pub clean: Section<CleanOptions>,
    /// Errors put into the visibilities.
    #[serde(default)]
    pub corrupt: Section<ErrorOptions>,
    /// The self-calibration. Left out, there is none.
    pub selfcal: Option<Section<StudySelfcalSection>>,
    /// Parameters that vary.
    #[serde(default, rename = "axis")]
    pub _axis: Vec<AxisSection>,
}

fn one() -> u64 {
    1
}

/// The array of a study.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct LayoutSection {
    /// Name of a built-in layout, or path of a layout file (relative to the configuration).
    pub name: String,
    /// Number of antennas that take part. Left out, all of them do.
    pub antennas: Option<usize>,
    /// Which antennas take part.
    #[serde(default)]
    pub choose: Choose,
}

/// Which antennas take part.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Choose {
    /// The first of the layout.
    #[default]
    First,
    /// Others for each seed, at random.
    Random,
}

/// One parameter that is varied: a list, or evenly spaced numbers.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct AxisSection {
    /// Place of a key in this file, such as `corrupt.phase-rms` or `layout.name`.
    pub parameter: String,
    /// The values, one after another.
    #[serde(default)]
    #[schemars(with = "Vec<serde_json::Value>")]
    pub values: Vec<toml::Value>,
    /// First of evenly spaced values, instead of a list.
    #[schemars(with = "Option<serde_json::Value>")]
    pub from: Option<toml::Value>,
    /// Last of evenly spaced values.
    #[schemars(with = "Option<serde_json::Value>")]
    pub to: Option<toml::Value>,
    /// Number of evenly spaced values.
    pub count: Option<usize>,
    /// Space the logarithms of the values evenly.
    #[serde(default)]
    pub log: bool,
}
