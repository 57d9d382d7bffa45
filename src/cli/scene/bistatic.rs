//! `scene bistatic`: scattering coefficients of Gaussian facets.

use super::material::with_hint;
use super::surface::{COLUMNS, Pair, SurfaceArgs};
use super::table::{Picture, PlotArgs, Table};
use super::values::{check_rows, exact};
use crate::cli::context::Outcome;
use crate::cli::failure::Result;
use cittert_arrays::quantity::{Angle, Frequency};
use cittert_phenomenology::surfaces::{BistaticGeometry, Shadowing, Slopes, bistatic_coefficient};
use clap::{Args, ValueEnum};

/// Which facets hide others.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum Shadow {
    /// 1/(1 + L).
    Smith,
    /// (1 - exp(-L))/L.
    Wagner,
    /// None are hidden.
    None,
}

/// Options of `scene bistatic`.
#[derive(Debug, Args)]
pub(crate) struct BistaticArgs {
    #[command(flatten)]
    surface: SurfaceArgs,
    /// Frequencies.
    #[arg(long, value_name = "FREQ", value_delimiter = ',', required = true, allow_hyphen_values = true)]
    freq: Vec<Frequency>,
    /// Rms slopes along and across the first axis.
    #[arg(long, value_name = "SU,SC", allow_hyphen_values = true)]
    slopes: Pair,
    /// Shadowing.
    #[arg(long, value_enum, default_value = "smith")]
    shadowing: Shadow,
    /// Angles of incidence, from the normal.
    #[arg(long, value_name = "ANGLE", value_delimiter = ',', required = true, allow_hyphen_values = true)]
    incidence: Vec<Angle>,
    /// Angles of scattering, from the normal.
    #[arg(long, value_name = "ANGLE", value_delimiter = ',', required = true, allow_hyphen_values = true)]
    scattered: Vec<Angle>,
    /// Azimuths from the incident to the scattered direction of travel: 0deg forward, 180deg back.
    #[arg(long, value_name = "ANGLE", value_delimiter = ',', default_value = "0deg", allow_hyphen_values = true)]
    azimuth: Vec<Angle>,
    /// Azimuth along which the incident wave travels, from the first slope axis.
    #[arg(long, value_name = "ANGLE", default_value = "0deg", allow_hyphen_values = true)]
    incident_azimuth: Angle,
    #[command(flatten)]
    plot: PlotArgs,
}

const INPUTS: [&str; 4] = ["freq_ghz", "incidence_deg", "scattered_deg", "azimuth_deg"];
const OUTPUTS: [&str; 4] = ["gamma_vv", "gamma_vh", "gamma_hv", "gamma_hh"];

/// A row for each surface, frequency and pair of directions; the first letter is the scattered polarisation.
///
/// # Errors
/// Values out of range, unknown names, a stack file that cannot be read, a picture that cannot be written.
pub(super) fn run(args: &BistaticArgs) -> Result<Outcome> {
    args.plot.check()?;
    let lists = [args.freq.len(), args.incidence.len(), args.scattered.len(), args.azimuth.len()];
    check_rows(&[&lists[..], &args.surface.material.count()].concat())?;
    let slopes = Slopes::new(args.slopes.0, args.slopes.1)?;
    let shadowing = match args.shadowing {
        Shadow::Smith => Shadowing::Smith,
        Shadow::Wagner => Shadowing::Wagner,
        Shadow::None => Shadowing::None,
    };
    let inputs: Vec<&str> = INPUTS.into_iter().chain(COLUMNS).collect();
    let mut table = Table::new(&inputs, &OUTPUTS);
    for s in args.surface.surfaces()? {
        for freq in &args.freq {
            let stack = with_hint(s.description.resolve(exact(freq.si()), args.surface.material.extrapolation()))?;
            for incidence in &args.incidence {
                for scattered in &args.scattered {
                    for azimuth in &args.azimuth {
                        let geometry = BistaticGeometry {
                            incident_zenith_rad: incidence.si(),
                            incident_azimuth_rad: args.incident_azimuth.si(),
                            scattered_zenith_rad: scattered.si(),
                            scattered_azimuth_rad: args.incident_azimuth.si() + azimuth.si(),
                        };
                        let g = bistatic_coefficient(&stack, &slopes, shadowing, &geometry)?;
                        let angles = [incidence, scattered, azimuth].map(|a| exact(a.si().to_degrees()).into());
                        let mut cells = vec![exact(freq.si() / 1e9).into()];
                        cells.extend(angles);
                        cells.extend(s.cells.iter().cloned());
                        table.push(cells, [g.vv, g.vh, g.hv, g.hh]);
                    }
                }
            }
        }
    }
    table.finish(&args.plot, &Picture { title: "Bistatic coefficients", columns: &OUTPUTS, label: "gamma" })
}
