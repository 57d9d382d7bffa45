//! Sections of the files of `run` and `study`. A section is the options of a group, as the command line has them.

use super::context::Outcome;
use crate::calibrate::{FeedTerm, PointingSolveOptions, RoundOptions, SolveOptions};
use crate::corrupt::ErrorOptions;
use crate::deconvolve::CleanOptions;
use crate::design::DesignOptions;
use crate::imaging::ImagingOptions;
use crate::mem::{MemOptions, PriorChoice};
use crate::simulate::{BandOptions, SceneOptions, SimulateOptions, TrackOptions};
use cittert_arrays::quantity::{Angle, FluxDensity};
use schemars::JsonSchema;
use serde::de::{DeserializeOwned, DeserializeSeed, Deserializer, Error as _, MapAccess, Visitor};
use serde::{Deserialize, Serialize};
use std::marker::PhantomData;
use std::path::PathBuf;

/// Options of `simulate`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct SimulateSection {
    #[serde(flatten)]
    pub(super) track: TrackOptions,
    #[serde(flatten)]
    pub(super) how: SimulateOptions,
    #[serde(flatten)]
    pub(super) band: BandOptions,
}

/// What is observed.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct SceneSection {
    /// FITS image, PNG, source list (CSV) or scene description (TOML), relative to the configuration.
    pub(super) file: Option<PathBuf>,
    /// Points instead of a file, in a study.
    #[serde(default)]
    pub(super) points: Vec<ScenePoint>,
    #[serde(flatten)]
    pub(super) how: SceneOptions,
}

/// A point source.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ScenePoint {
    /// Flux density.
    pub(super) flux: FluxDensity,
    /// Direction cosine l as an angle. Left out, it is 0.
    pub(super) l: Option<Angle>,
    /// Direction cosine m as an angle. Left out, it is 0.
    pub(super) m: Option<Angle>,
}

/// Options of `selfcal` beside those of the images. Options of its deconvolver that are left out are those of the first `[[clean]]` with
/// the same algorithm.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct SelfcalSection {
    #[serde(flatten)]
    pub(super) rounds: RoundOptions,
    #[serde(flatten)]
    pub(super) solve: SolveOptions,
    #[serde(flatten)]
    pub(super) pointing: PointingSolveOptions,
    #[serde(flatten)]
    pub(super) clean: CleanOptions,
    /// Prior of deconvolver mem, which solves image and gains together: a temperature (250K), a flux density in a pixel or a FITS image
    /// [default: flat, made from the data as the book describes].
    pub(super) prior: Option<PriorChoice>,
    /// What is solved for after the gains, in sets of four products: leakage, cross-phase or both. The model is that of --model, or clean images of
    /// I, Q, U and V.
    #[serde(default, rename = "solve")]
    pub(super) feed_terms: Vec<FeedTerm>,
}

/// Options of the self-calibration of a study. Its images are those of the sections `[image]` and `[clean]`.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct StudySelfcalSection {
    #[serde(flatten)]
    pub(super) rounds: RoundOptions,
    #[serde(flatten)]
    pub(super) solve: SolveOptions,
}

/// A type of options that a section holds.
pub(super) trait Options: DeserializeOwned + JsonSchema {
    /// The required keys, with valid values. They are needed when a single key is checked.
    const REQUIRED: &'static str = "";
}

impl Options for SimulateSection {
    const REQUIRED: &'static str = "freq = \"1GHz\"\nbandwidth = \"1MHz\"";
}
impl Options for SceneSection {}
impl Options for ImagingOptions {}
impl Options for CleanOptions {}
impl Options for MemOptions {}
impl Options for ErrorOptions {}
impl Options for SelfcalSection {}
impl Options for StudySelfcalSection {}
impl Options for DesignOptions {}

/// A section: its options, and its keys as they were written.
#[derive(Debug, Clone)]
pub(super) struct Section<T> {
    /// The options.
    pub(super) options: T,
    /// The keys that the file gives.
    pub(super) keys: toml::Table,
}

impl<T: Default> Default for Section<T> {
    fn default() -> Self {
        Self { options: T::default(), keys: toml::Table::new() }
    }
}

impl<'de, T: Options> Deserialize<'de> for Section<T> {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_map(SectionVisitor(PhantomData))
    }
}

impl<T: JsonSchema> JsonSchema for Section<T> {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        T::schema_name()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        T::json_schema(generator)
    }
}

struct SectionVisitor<T>(PhantomData<T>);

impl<'de, T: Options> Visitor<'de> for SectionVisitor<T> {
    type Value = Section<T>;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a section with keys")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Section<T>, A::Error> {
        let mut keys = toml::Table::new();
        while let Some(key) = map.next_key::<String>()? {
            let value = map.next_value_seed(Checked::<T>(&key, PhantomData))?;
            keys.insert(key, value);
        }
        let options = toml::Value::Table(keys.clone()).try_into().map_err(|e: toml::de::Error| A::Error::custom(e.message()))?;
        Ok(Section { options, keys })
    }
}

/// The keys of a section, from its schema.
fn keys_of<T: JsonSchema>() -> Vec<String> {
    let schema = schemars::schema_for!(T);
    let properties = schema.get("properties").and_then(serde_json::Value::as_object);
    properties.map(|p| p.keys().cloned().collect()).unwrap_or_default()
}

/// Reads the value of a key and checks it at once, so that an error points at the line of the key.
struct Checked<'a, T>(&'a str, PhantomData<T>);

impl<'de, T: Options> DeserializeSeed<'de> for Checked<'_, T> {
    type Value = toml::Value;

    fn deserialize<D: Deserializer<'de>>(self, d: D) -> Result<toml::Value, D::Error> {
        let value = toml::Value::deserialize(d)?;
        let wrong = |e: toml::de::Error| match e.message().split_once(", expected") {
            // A section of several groups does not list its keys by itself.
            None if e.message().starts_with("unknown field") => {
                D::Error::custom(format!("{}, expected one of `{}`", e.message(), keys_of::<T>().join("`, `")))
            }
            _ => D::Error::custom(e.message()),
        };
        let mut alone: toml::Table = toml::from_str(T::REQUIRED).map_err(wrong)?;
        alone.insert(self.0.to_owned(), value.clone());
        toml::Value::Table(alone).try_into::<T>().map_err(wrong)?;
        Ok(value)
    }
}

/// The JSON schema of a file.
///
/// # Errors
/// None in practice: the schema is JSON.
pub(super) fn schema<T: JsonSchema>() -> super::failure::Result<Outcome> {
    let schema = serde_json::to_value(schemars::schema_for!(T))?;
    let text = serde_json::to_string_pretty(&schema)?;
    Ok(Outcome::new(schema, text))
}

/// Words of a command line from the keys of a section: `--key=value`, `--key` for true, nothing for false.
pub(super) fn words(keys: &toml::Table) -> Vec<String> {
    words_of(keys, |_| true)
}

/// The words of the keys that are `wanted`.
pub(super) fn words_of(keys: &toml::Table, wanted: impl Fn(&str) -> bool) -> Vec<String> {
    let text = |value: &toml::Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    let words = |(key, value): (&String, &toml::Value)| match value {
        toml::Value::Boolean(false) => Vec::new(),
        toml::Value::Boolean(true) => vec![format!("--{key}")],
        // `--key=value`, so that a value may start with a minus sign.
        toml::Value::Array(list) => list.iter().map(|v| format!("--{key}={}", text(v))).collect(),
        other => vec![format!("--{key}={}", text(other))],
    };
    keys.iter().filter(|(key, _)| wanted(key)).flat_map(words).collect()
}
