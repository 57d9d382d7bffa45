//! `scene`: brightness scenes, and the physics behind them as tables.

mod air;
mod attenuation;
mod bistatic;
mod convert;
mod emissivity;
mod fly;
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

/// What to do with a scene: one row each, one file each beside this one.
#[derive(Debug, Subcommand)]
pub(crate) enum SceneCommand {
    /// Render a scene description (or read a PNG or FITS scene) into a FITS image in K.
    Render(Box<render::RenderArgs>),
    /// The pictures of a camera that moves through a scene of solids, and a film of them.
    Fly(Box<fly::FlyArgs>),
    /// A scene of solids between TOML and the text of bodies and regions.
    Convert(convert::ConvertArgs),
    /// Print the JSON schema of a scene of solids.
    Schema,
    /// What rays hit and where points lie in a scene of solids, as CSV.
    Probe(probe::ProbeArgs),
    /// Sky temperatures against zenith angle, as CSV.
    Sky(sky::SkyArgs),
    /// Specific attenuation of air, cloud and rain, as CSV.
    Attenuation(attenuation::AttenuationArgs),
    /// Emission and depth of the air between two heights, as CSV.
    Path(path::PathArgs),
    /// Permittivity of a material, as CSV.
    Permittivity(permittivity::PermittivityArgs),
    /// Emissivity and reflectivity of a surface, as CSV.
    Emissivity(emissivity::EmissivityArgs),
    /// Bistatic scattering coefficients of a rough surface, as CSV.
    Bistatic(bistatic::BistaticArgs),
    /// Name the built-in atmospheres, materials, models and surfaces.
    List(list::ListArgs),
}

/// Run a subcommand of `scene`.
///
/// # Errors
/// Anything wrong with the scene, the values or the disk.
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
