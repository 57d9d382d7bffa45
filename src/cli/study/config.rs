//! The file that describes a study.

use cittert_arrays::quantity::{Angle, Duration, FluxDensity, Frequency, Temperature};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// One point of a study: every axis has put its value in.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Config {
    /// Title of the report.
    pub title: String,
    /// Seeds of each point.
    pub seeds: usize,
    /// The first seed.
    #[serde(default = "one")]
    pub seed: u64,
    pub layout: LayoutSection,
    pub scene: SceneSection,
    pub simulate: SimulateSection,
    #[serde(default)]
    pub image: ImageSection,
    #[serde(default)]
    pub clean: CleanSection,
    /// Errors by name; the name is the kind unless `kind` says otherwise.
    #[serde(default)]
    pub errors: BTreeMap<String, toml::Table>,
    pub selfcal: Option<SelfcalSection>,
    /// Read apart, from the file as it is.
    #[serde(default, rename = "axis")]
    pub _axis: Vec<AxisSection>,
}

fn one() -> u64 {
    1
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct LayoutSection {
    /// Built-in layout, or a file relative to the configuration.
    pub name: String,
    /// Number of antennas that take part.
    pub antennas: Option<usize>,
    /// `first` of the layout, or `random` for each seed.
    #[serde(default = "first")]
    pub choose: Choose,
}

fn first() -> Choose {
    Choose::First
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Choose {
    First,
    Random,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct SceneSection {
    /// FITS, PNG, CSV or TOML, relative to the configuration.
    pub file: Option<PathBuf>,
    pub scene_cell: Option<Angle>,
    pub scene_size: Option<usize>,
    pub scene_min: Option<Temperature>,
    pub scene_max: Option<Temperature>,
    /// Points, instead of a file.
    #[serde(default)]
    pub points: Vec<Point>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Point {
    pub flux: FluxDensity,
    pub l: Option<Angle>,
    pub m: Option<Angle>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct SimulateSection {
    pub freq: Frequency,
    pub bandwidth: Frequency,
    #[serde(default = "one_channel")]
    pub channels: usize,
    pub method: Option<String>,
    pub phase_center: Option<String>,
    pub start: Option<String>,
    pub duration: Option<Duration>,
    pub hour_angle: Option<String>,
    pub integration: Option<Duration>,
    pub elevation_limit: Option<Angle>,
}

fn one_channel() -> usize {
    1
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct ImageSection {
    pub size: Option<usize>,
    pub cell: Option<Angle>,
    /// `natural` (the default of a study), `uniform` or `briggs`.
    pub weighting: Option<String>,
    pub robust: Option<f64>,
    pub epsilon: Option<f64>,
    #[serde(default)]
    pub no_w: bool,
}

#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct CleanSection {
    pub algorithm: Option<String>,
    pub gain: Option<f64>,
    pub niter: Option<usize>,
    pub nsigma: Option<f64>,
    pub mgain: Option<f64>,
    pub max_major: Option<usize>,
    pub auto_mask: Option<f64>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct SelfcalSection {
    /// `phase` or `amp-phase`.
    #[serde(default = "phase")]
    pub mode: String,
    /// A time, `int` or `inf`.
    #[serde(default = "inf")]
    pub solint: String,
    #[serde(default = "three")]
    pub rounds: usize,
    #[serde(default = "snr")]
    pub minsnr: f64,
    pub refant: Option<String>,
    /// `point`, `data` or `truth`.
    #[serde(default = "point")]
    pub start: String,
}

fn phase() -> String {
    "phase".into()
}
fn inf() -> String {
    "inf".into()
}
fn point() -> String {
    "point".into()
}
fn three() -> usize {
    3
}
fn snr() -> f64 {
    3.0
}

/// One parameter that is varied: a list, or evenly spaced numbers.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct AxisSection {
    /// Place in this file, such as `errors.phase.rms` or `layout.name`.
    pub parameter: String,
    #[serde(default)]
    pub values: Vec<toml::Value>,
    pub from: Option<toml::Value>,
    pub to: Option<toml::Value>,
    pub count: Option<usize>,
    /// Space the logarithms evenly.
    #[serde(default)]
    pub log: bool,
}
