//! `scene convert`: convert a scene of solids between TOML and the text of bodies and regions. `scene schema`: the keys of the TOML.

use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cli::options::{OutputArgs, pictures_beside, read_scene_and_pictures, scene_text};
use cittert_phenomenology::SolidScene;
use cittert_phenomenology::geometry::{Geometry, looks_like_bodies, read_text, write_text};
use cittert_phenomenology::solids::SceneFile;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Options of `scene convert`.
#[derive(Debug, Args)]
pub(crate) struct ConvertArgs {
    /// Scene of solids (TOML), or text of bodies and regions. The format is recognised by the content.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// File to write: TOML if its name ends in .toml, otherwise the text of bodies and regions.
    #[arg(value_name = "OUT")]
    output: PathBuf,
    /// Name of the scene, where a text is converted to TOML [default: the name of the input].
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Replace an output that exists.
    #[arg(long)]
    overwrite: bool,
}

/// `scene schema` has no options.
#[derive(Debug, Args)]
pub(crate) struct SchemaArgs {}

/// Convert a scene. A text holds bodies, regions and the names of their surfaces. Assemblies are therefore written as placed bodies, and
/// camera, ground, atmosphere, weather, layers and the surfaces of single faces are not written.
///
/// # Errors
/// A scene that is wrong, with the line, or an error of the file system.
pub(super) fn run(args: &ConvertArgs, context: &Context) -> Result<Outcome> {
    let out = OutputArgs { output: args.output.clone(), overwrite: args.overwrite };
    out.claim([&args.output], [&args.input])?;
    let text = scene_text(&args.input)?;
    let named = || args.input.display().to_string();
    let to_toml = args.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    let (written, bodies, regions) = if looks_like_bodies(&text) {
        let model = read_text(&text, 1).context(named())?;
        // This checks the names before anything is written.
        Geometry::new(model.bodies.clone(), model.regions.clone()).context(named())?;
        let stem = || args.input.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        let name = args.name.clone().unwrap_or_else(stem);
        let written = if to_toml {
            context.console.note("the TOML has no camera, ground and atmosphere yet; surfaces whose names are no material are black");
            SceneFile::of_text(&name, &model).to_toml().context(named())?
        } else {
            write_text(&model.bodies, &model.regions, &model.surfaces)
        };
        (written, model.bodies.len(), model.regions.len())
    } else {
        ensure!(args.name.is_none(), Failure::usage("--name is for a text of bodies and regions; a scene in TOML has a name already"));
        out.claim([&args.output], read_scene_and_pictures(&args.input)?.1)?;
        let scene = SolidScene::from_toml_with(&text, &pictures_beside(&args.input)).context(named())?;
        let written = if to_toml { scene.to_toml().context(named())? } else { scene.to_text() };
        (written, scene.geometry().bodies().len(), scene.geometry().regions().len())
    };
    out.write(&args.output, written.as_bytes())?;
    let json = json!({ "output": args.output, "n_bodies": bodies, "n_regions": regions });
    let text = format!("{}: {bodies} bodies, {regions} regions", args.output.display());
    Ok(Outcome::new(json, text).wrote(&args.output))
}

/// The JSON schema of a scene of solids.
///
/// # Errors
/// None in practice: the schema is JSON.
pub(super) fn schema() -> Result<Outcome> {
    crate::cli::sections::schema::<SceneFile>()
}
