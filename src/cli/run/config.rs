//! The file that describes a whole run. Every key of a section is the option of the same name of the subcommand that the section runs.

use super::calibration::{CorruptSection, SelfcalSection};
use cittert_arrays::quantity::{Angle, Duration, Frequency, Temperature};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// A quantity that is checked when the file is read, and passed on as it was typed.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Typed<T> {
    text: String,
    #[serde(skip)]
    value: std::marker::PhantomData<T>,
}

impl<'de, T: FromStr<Err: std::fmt::Display>> Deserialize<'de> for Typed<T> {
    fn deserialize<D: serde::Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        let text = String::deserialize(d)?;
        T::from_str(&text).map_err(serde::de::Error::custom)?;
        Ok(Self { text, value: std::marker::PhantomData })
    }
}

impl<T> JsonSchema for Typed<T> {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Quantity".into()
    }
    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({"type": "string", "description": "A number with its unit, such as \"94GHz\", \"1.2m\", \"30arcsec\", \"290K\", \"10s\"."})
    }
}

/// A whole run.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct Config {
    /// Title of the report.
    pub title: String,
    /// Seed of every random draw of the run.
    #[serde(default = "default_seed")]
    pub seed: u64,
    /// The array.
    pub layout: LayoutSection,
    /// What is looked at.
    pub scene: SceneSection,
    /// How visibilities are made.
    pub simulate: SimulateSection,
    /// The u-v mask on the FFT grid of the images.
    pub mask: Option<MaskSection>,
    /// Options of every image.
    #[serde(default)]
    pub image: ImageSection,
    /// Deconvolutions, one after another.
    #[serde(default)]
    pub clean: Vec<CleanSection>,
    /// Maximum entropy, after the deconvolutions.
    pub mem: Option<MemSection>,
    /// Errors put into the visibilities.
    pub corrupt: Option<CorruptSection>,
    /// Self-calibration of the corrupted visibilities, or of the visibilities as they are.
    pub selfcal: Option<SelfcalSection>,
}

fn default_seed() -> u64 {
    1
}

/// The array of a run.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct LayoutSection {
    /// Name of a built-in layout, or path of a layout file (relative to the configuration).
    pub name: String,
}

/// The scene of a run.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct SceneSection {
    /// Path (relative to the configuration) of a FITS image, a PNG, a source list (CSV) or a scene (TOML).
    pub file: String,
    /// Size of a pixel of a scene that has none of its own.
    pub scene_cell: Option<Typed<Angle>>,
    /// Number of pixels a side of a scene description; without scene-cell over the field of view of its camera.
    pub scene_size: Option<usize>,
    /// Temperatures of its own for every channel of a scene of solids.
    #[serde(default)]
    pub scene_channels: bool,
    /// Temperature of black in a PNG.
    pub scene_min: Option<Typed<Temperature>>,
    /// Temperature of white in a PNG.
    pub scene_max: Option<Typed<Temperature>>,
}

/// Options of `simulate`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct SimulateSection {
    /// Centre of the band.
    pub freq: Typed<Frequency>,
    /// Width of the band.
    pub bandwidth: Typed<Frequency>,
    /// Number of channels.
    #[serde(default = "one")]
    pub channels: usize,
    /// `degrid`, `dft` or `mask`.
    pub method: Option<String>,
    /// Accuracy of `degrid`.
    pub epsilon: Option<f64>,
    /// Sub-channels averaged into each channel (bandwidth smearing).
    pub subchannels: Option<usize>,
    /// Element pattern: `none`, `gaussian`, `airy`, `cos^N`.
    pub element: Option<String>,
    /// Constant removed from a scene in kelvin: `auto`, `none` or a temperature.
    pub pedestal: Option<String>,
    /// Add thermal noise.
    #[serde(default)]
    pub noise: bool,
    /// Phase centre, such as `19h59m28s,+40d44m02s`.
    pub phase_center: Option<String>,
    /// Start of the observation, ISO UTC.
    pub start: Option<String>,
    /// Hour angles of start and end, such as `-2h,2h`.
    pub hour_angle: Option<String>,
    /// Length of the observation.
    pub duration: Option<Typed<Duration>>,
    /// Length of one integration.
    pub integration: Option<Typed<Duration>>,
    /// Lowest elevation of an antenna.
    pub elevation_limit: Option<Typed<Angle>>,
}

fn one() -> usize {
    1
}

/// Options of `mask`; what is left out is that of the images.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct MaskSection {
    /// Number of pixels a side of the image that belongs to the grid.
    pub size: Option<usize>,
    /// Size of its pixels.
    pub cell: Option<Typed<Angle>>,
}

/// Options shared by every image of the run.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct ImageSection {
    /// Number of pixels a side.
    pub size: Option<usize>,
    /// Size of a pixel.
    pub cell: Option<Typed<Angle>>,
    /// `natural`, `uniform` or `briggs`.
    pub weighting: Option<String>,
    /// Robustness of `briggs`, -2 to 2.
    pub robust: Option<f64>,
    /// Gaussian taper, as the resolution it leads to.
    pub taper: Option<Typed<Angle>>,
    /// Stokes parameter or correlation to image.
    pub pol: Option<String>,
    /// Number of output channels.
    pub channels_out: Option<usize>,
    /// Accuracy of the gridder.
    pub epsilon: Option<f64>,
}

/// One deconvolution.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct CleanSection {
    /// Name in the table of deconvolvers, such as `hogbom`.
    pub algorithm: String,
    /// Loop gain.
    pub gain: Option<f64>,
    /// Largest number of components.
    pub niter: Option<usize>,
    /// Peak at which to stop: a flux density such as `1mJy` or a temperature such as `2K`.
    pub threshold: Option<String>,
    /// Stop at this multiple of the robust noise.
    pub nsigma: Option<f64>,
    /// Fraction of the peak removed between major cycles.
    pub mgain: Option<f64>,
    /// Depth of a minor cycle in units of the largest side lobe.
    pub cyclefactor: Option<f64>,
    /// Grow a mask around what exceeds this multiple of the noise.
    pub auto_mask: Option<f64>,
}

/// Options of `mem`.
#[derive(Debug, Clone, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct MemSection {
    /// Prior: a temperature, a flux density a pixel, a FITS image (relative to the configuration), or `smoothed`.
    pub prior: Option<String>,
    /// Total flux to keep, such as `2.5Jy` or `15.7Ksr`.
    pub flux: Option<String>,
    /// Visibility at zero spacing to keep.
    pub zero_spacing: Option<String>,
    /// `quasi-newton` or `vtess`.
    pub solver: Option<String>,
    /// Largest number of evaluations of the data term.
    pub niter: Option<usize>,
    /// `relative`, `gull-skilling` or `log`.
    pub entropy: Option<String>,
    /// `weights`, `estimate` or the standard deviation of the real part of a visibility.
    pub noise: Option<String>,
    /// Chi squared over its expected value to aim at.
    pub chi2: Option<f64>,
    /// Largest relative departure from it.
    pub tolerance: Option<f64>,
    /// Largest KKT residual.
    pub kkt: Option<f64>,
    /// Weight of the total variation beside the entropy.
    pub total_variation: Option<f64>,
    /// Weight of the l1 norm beside the entropy.
    pub l1: Option<f64>,
    /// FITS image on the same grid; brightness only where it is above 0 (relative to the configuration).
    pub mask: Option<String>,
    /// `none`, `beam` or a number of random probes.
    pub uncertainty: Option<String>,
}

/// Words of a command line from a section: `--key value`, `--key` for true, nothing for what is not set.
pub(crate) fn words(section: &impl Serialize) -> Vec<String> {
    let Ok(serde_json::Value::Object(map)) = serde_json::to_value(section) else { return Vec::new() };
    let mut words = Vec::new();
    for (key, value) in map {
        let text = match value {
            serde_json::Value::Null | serde_json::Value::Bool(false) => continue,
            serde_json::Value::Bool(true) => None,
            serde_json::Value::String(s) => Some(s),
            other => Some(other.to_string()),
        };
        // `--key=value`, so that a value may start with a minus sign.
        words.push(text.map_or_else(|| format!("--{key}"), |t| format!("--{key}={t}")));
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let words = words(&c.simulate);
        for w in ["--freq=1.4GHz", "--noise", "--channels=1", "--hour-angle=-2h,2h"] {
            assert!(words.iter().any(|x| x == w), "{w} in {words:?}");
        }
        assert!(!words.iter().any(|w| w.contains("subchannels")));
    }

    #[test]
    fn errors_point_at_the_line() {
        let wrong = TEXT.replace("\"64MHz\"", "\"64\"");
        let e = toml::from_str::<Config>(&wrong).unwrap_err().to_string();
        assert!(e.contains("line 7") && e.contains("no unit"), "{e}");
        let e = toml::from_str::<Config>(&TEXT.replace("hour-angle", "hour_angle")).unwrap_err().to_string();
        assert!(e.contains("line 9") && e.contains("hour_angle"), "{e}");
    }
}
