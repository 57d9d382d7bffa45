//! `scene list`: every atmosphere, model, material and kind of surface that has a name.

use crate::cli::context::Outcome;
use crate::cli::failure::Result;
use cittert_phenomenology::atmosphere::{ATMOSPHERES, GAS_MODELS, GEOMETRIES, LAYER_KINDS, RAIN_MODELS};
use cittert_phenomenology::dielectrics::{DielectricError, Material, Model, SoilTexture};
use cittert_phenomenology::surfaces::{ROUGHNESS_KINDS, SCATTER_KINDS};
use clap::{Args, ValueEnum};
use serde_json::{Map, Value, json};

/// Options of `scene list`.
#[derive(Debug, Args)]
pub(crate) struct ListArgs {
    /// What to list [default: everything].
    #[arg(value_enum)]
    kind: Option<Kind>,
}

/// What can be listed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Kind {
    /// Reference atmospheres.
    Atmospheres,
    /// Gas models.
    Gases,
    /// Rain models.
    Rain,
    /// Kinds of layer.
    Layers,
    /// Shapes of the atmosphere.
    Geometries,
    /// Materials.
    Materials,
    /// Permittivity models.
    Models,
    /// Soil textures.
    Textures,
    /// Kinds of roughness.
    Surfaces,
}

/// A line of a list: a name, its description, and further fields for `--json`.
struct Entry {
    name: String,
    describes: String,
    json: Value,
}

impl Entry {
    fn new(name: &str, describes: impl Into<String>, mut json: Value) -> Self {
        let describes = describes.into();
        (json["name"], json["describes"]) = (name.into(), describes.as_str().into());
        Self { name: name.to_owned(), describes, json }
    }

    fn sourced(name: &str, summary: &str, reference: &str) -> Self {
        Self::new(name, format!("{summary}; {reference}"), json!({ "reference": reference }))
    }
}

/// List one kind, or all.
///
/// # Errors
/// Only if a built-in table is damaged.
pub(super) fn run(args: &ListArgs) -> Result<Outcome> {
    let mut text = Vec::new();
    let mut json = Map::new();
    for kind in Kind::value_variants().iter().filter(|k| args.kind.is_none_or(|only| only == **k)) {
        let entries = entries(*kind)?;
        let width = entries.iter().map(|e| e.name.len()).max().unwrap_or(0);
        let lines: Vec<String> = entries.iter().map(|e| format!("{:width$}  {}", e.name, e.describes)).collect();
        let Some(value) = kind.to_possible_value() else { continue };
        let heading = if args.kind.is_none() { format!("{}:\n", value.get_name()) } else { String::new() };
        text.push(heading + &lines.join("\n"));
        json.insert(value.get_name().to_owned(), entries.into_iter().map(|e| e.json).collect());
    }
    Ok(Outcome::new(Value::Object(json), text.join("\n\n")))
}

fn entries(kind: Kind) -> Result<Vec<Entry>, DielectricError> {
    Ok(match kind {
        Kind::Atmospheres => ATMOSPHERES.iter().map(|a| Entry::sourced(a.name, a.summary, a.reference)).collect(),
        Kind::Gases => GAS_MODELS.iter().map(|m| Entry::sourced(m.name, m.summary, m.reference)).collect(),
        Kind::Rain => RAIN_MODELS.iter().map(|m| Entry::sourced(m.name, m.summary, m.reference)).collect(),
        Kind::Layers => LAYER_KINDS.iter().map(|l| Entry::new(l.name, l.summary, json!({ "unit": l.unit }))).collect(),
        Kind::Geometries => GEOMETRIES.iter().map(|(name, _, summary)| Entry::new(name, *summary, json!({}))).collect(),
        Kind::Materials => Material::all().iter().map(material).collect(),
        Kind::Models => Model::all().iter().map(model).collect(),
        Kind::Textures => SoilTexture::all()?.iter().map(texture).collect(),
        Kind::Surfaces => ROUGHNESS_KINDS
            .iter()
            .map(|k| (k.name, k.syntax, k.describes))
            .chain(SCATTER_KINDS.iter().map(|k| (k.name, k.syntax, k.describes)))
            .map(|(name, syntax, describes)| Entry::new(name, format!("{syntax}   {describes}"), json!({ "syntax": syntax })))
            .collect(),
    })
}

fn texture(t: &SoilTexture) -> Entry {
    let describes = format!("sand {}, silt {}, clay {}", t.sand, t.silt, t.clay);
    Entry::new(&t.name, describes, json!({ "sand": t.sand, "silt": t.silt, "clay": t.clay }))
}

fn material(m: &Material) -> Entry {
    let parameters: Vec<String> = m.parameters.iter().map(|p| format!("{} {} {}", p.parameter, p.default, p.parameter.unit())).collect();
    let models: Vec<&str> = m.model_names().collect();
    let defaults: Map<String, Value> = m.parameters.iter().map(|p| (p.parameter.key().to_owned(), p.default.into())).collect();
    let describes = format!("{}; models {}; {}", m.describes, models.join(", "), parameters.join(", "));
    Entry::new(m.name, describes, json!({ "aliases": m.aliases, "models": models, "parameters": defaults }))
}

fn model(m: &Model) -> Entry {
    let band = m.bands.first().map_or_else(|| "bands by material".to_owned(), |b| format!("{}-{} GHz", b.min_ghz, b.max_ghz));
    let ranges = m.ranges.iter().map(|r| format!("{} {} to {} {}", r.parameter, r.min, r.max, r.parameter.unit()));
    let range = std::iter::once(band).chain(ranges).collect::<Vec<_>>().join(", ");
    let describes = format!("{}; {range}; {}", m.describes, m.reference);
    Entry::new(m.name, describes, json!({ "reference": m.reference, "range": range, "extension": m.extension }))
}
