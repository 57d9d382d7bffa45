//! `scene`: render scenes, and print the physics behind them as tables.

mod air;
mod attenuation;
mod bistatic;
mod convert;
mod delay;
mod emissivity;
mod flight;
mod fly;
mod forecast;
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

pub(super) use air::load as profile;
pub(super) use flight::{FlightArgs, Flown};
pub(super) use image::Mode;

use super::context::{Context, Outcome, subcommands};
use super::failure::Result;

subcommands! {
    /// The subcommands of `scene`. Each is one row here and one file beside this one.
    SceneCommand {
        /// Render a scene description (or read a PNG or FITS scene) into a FITS image in K.
        Render(Box<image::RenderArgs>) => render::run;
        /// Render the frames of a camera that moves through a scene of solids, and a film of them.
        Fly(Box<fly::FlyArgs>) => fly::run;
        /// Convert a scene of solids between TOML and the text of bodies and regions.
        Convert(convert::ConvertArgs) => convert::run;
        /// Print the JSON schema of a scene of solids.
        Schema(convert::SchemaArgs) => |_, _| convert::schema();
        /// Print which surfaces rays hit, or in which regions points lie, as CSV.
        Probe(probe::ProbeArgs) => |args, _| probe::run(args);
        /// Print sky temperatures against zenith angle as CSV.
        Sky(sky::SkyArgs) => |args, _| sky::run(args);
        /// Print the specific attenuation of air, cloud, ice and rain as CSV.
        Attenuation(attenuation::AttenuationArgs) => |args, _| attenuation::run(args);
        /// Print emission and optical depth of the air between two heights as CSV.
        Path(path::PathArgs) => |args, _| path::run(args);
        /// Print the excess path length and phase of the air as CSV.
        Delay(delay::DelayArgs) => |args, _| delay::run(args);
        /// Print the permittivity of a material as CSV.
        Permittivity(permittivity::PermittivityArgs) => |args, _| permittivity::run(args);
        /// Print emissivity and reflectivity of a surface as CSV.
        Emissivity(emissivity::EmissivityArgs) => |args, _| emissivity::run(args);
        /// Print bistatic scattering coefficients of a rough surface as CSV.
        Bistatic(bistatic::BistaticArgs) => |args, _| bistatic::run(args);
        /// List the built-in atmospheres, materials, models and surfaces.
        List(list::ListArgs) => |args, _| list::run(args);
    }
}
