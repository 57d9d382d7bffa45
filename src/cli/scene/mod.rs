//! `scene`: render scenes, and print the physics behind them as tables.

mod air;
mod attenuation;
mod bistatic;
mod convert;
mod emissivity;
mod fly;
mod image;
mod list;
mod material;
mod path;
mod permittivity;
mod probe;
mod render;
mod sky;
mod solids;
mod surface;
mod table;
mod values;

use super::context::{Context, Outcome};
use super::failure::Result;
use clap::Subcommand;

/// The subcommands of `scene`. Each is one row here and one file beside this one.
#[derive(Debug, Subcommand)]
pub(crate) enum SceneCommand {
    /// Render a scene description (or read a PNG or FITS scene) into a FITS image in K.
    Render(Box<image::RenderArgs>),
    /// Render the frames of a camera that moves through a scene of solids, and a film of them.
    Fly(Box<fly::FlyArgs>),
    /// Convert a scene of solids between TOML and the text of bodies and regions.
    Convert(convert::ConvertArgs),
    /// Print the JSON schema of a scene of solids.
    Schema,
    /// Print which surfaces rays hit, or in which regions points lie, as CSV.
    Probe(probe::ProbeArgs),
    /// Print sky temperatures against zenith angle as CSV.
    Sky(sky::SkyArgs),
    /// Print the specific attenuation of air, cloud, ice and rain as CSV.
    Attenuation(attenuation::AttenuationArgs),
    /// Print emission and optical depth of the air between two heights as CSV.
    Path(path::PathArgs),
    /// Print the permittivity of a material as CSV.
    Permittivity(permittivity::PermittivityArgs),
    /// Print emissivity and reflectivity of a surface as CSV.
    Emissivity(emissivity::EmissivityArgs),
    /// Print bistatic scattering coefficients of a rough surface as CSV.
    Bistatic(bistatic::BistaticArgs),
    /// List the built-in atmospheres, materials, models and surfaces.
    List(list::ListArgs),
}

/// Run a subcommand of `scene`.
///
/// # Errors
/// A scene or values that are wrong, or an error of the file system.
pub(super) fn run(command: &SceneCommand, context: &Context) -> Result<Outcome> {
    match command {
        SceneCommand::Render(args) => render::run(args, context),
        SceneCommand::Fly(args) => fly::run(args, context),
        SceneCommand::Convert(args) => convert::run(args, context),
        SceneCommand::Schema => convert::schema(),
        SceneCommand::Probe(args) => probe::run(args),
        SceneCommand::Sky(args) => sky::run(args),
        SceneCommand::Attenuation(args) => attenuation::run(args),
        SceneCommand::Path(args) => path::run(args),
        SceneCommand::Permittivity(args) => permittivity::run(args),
        SceneCommand::Emissivity(args) => emissivity::run(args),
        SceneCommand::Bistatic(args) => bistatic::run(args),
        SceneCommand::List(args) => list::run(args),
    }
}
