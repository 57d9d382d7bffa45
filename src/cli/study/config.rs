//! The file that describes a study.

use crate::cli::failure::Result;
use crate::cli::made::{MakeSection, Origin};
use crate::cli::quality::Limits;
use crate::cli::sections::{SceneSection, Section, SimulateSection, StudySelfcalSection};
use crate::corrupt::ErrorOptions;
use crate::deconvolve::CleanOptions;
use crate::imaging::ImagingOptions;
use crate::study::Score;
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;

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
    /// A question that the study answers: up to which value of a parameter is a score kept?
    #[serde(rename = "question")]
    pub _question: Option<QuestionSection>,
    /// What the failure of each antenna costs.
    pub failures: Option<FailuresSection>,
    /// Numbers of metrics.json that the study must reach. A miss ends the command with exit code 1.
    #[serde(default)]
    pub quality: BTreeMap<String, Limits>,
}

fn one() -> u64 {
    1
}

/// The array of a study.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct LayoutSection {
    /// Name of a built-in layout, or path of a layout file (relative to the configuration).
    pub name: Option<String>,
    /// A layout that `layout make` makes, instead of a name. Axes can vary its keys, such as `layout.make.elements`.
    pub make: Option<Section<MakeSection>>,
    /// Number of antennas that take part. Left out, all of them do.
    pub antennas: Option<usize>,
    /// Which antennas take part.
    #[serde(default)]
    pub choose: Choose,
}

impl LayoutSection {
    /// Where the antennas stand.
    ///
    /// # Errors
    /// The section has a name and a generated layout, or neither.
    pub(super) fn origin(&self) -> Result<Origin<'_>> {
        Origin::of(self.name.as_deref(), self.make.as_ref())
    }
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

/// A question. If its parameter is no axis, it becomes one of five values.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct QuestionSection {
    /// The score that must be kept.
    pub keep: Score,
    /// The score must be at least this.
    pub at_least: Option<f64>,
    /// The score must be at most this.
    pub at_most: Option<f64>,
    /// Place of a numeric key in this file, such as `corrupt.phase-rms` or `layout.antennas`.
    pub parameter: String,
    /// Smallest value of the parameter.
    #[schemars(with = "serde_json::Value")]
    pub from: toml::Value,
    /// Largest value of the parameter.
    #[schemars(with = "serde_json::Value")]
    pub to: toml::Value,
    /// Halve the logarithms of the values.
    #[serde(default)]
    pub log: bool,
    /// Fraction of the trials that must keep the score.
    #[serde(default = "half")]
    pub fraction: f64,
    /// Half the width of the 68 % limits that is wanted, over the answer. The search ends at a third of it.
    #[serde(default = "tenth")]
    pub precision: f64,
}

fn half() -> f64 {
    0.5
}

fn tenth() -> f64 {
    0.1
}

/// Each antenna in turn has failed.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct FailuresSection {
    /// The score by which the antennas are ranked.
    pub score: Score,
    /// Names of the antennas, or each.
    pub antennas: Option<FailingAntennas>,
}

/// The antennas that fail in turn.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(untagged)]
pub(super) enum FailingAntennas {
    /// The word each, or the name of one antenna.
    Word(String),
    /// These.
    Named(Vec<String>),
}

/// One parameter that is varied: a list, or evenly spaced numbers.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct AxisSection {
    /// Place of a key in this file, such as `corrupt.phase-rms`, `layout.name` or `layout.make.elements`.
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
