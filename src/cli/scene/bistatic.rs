//! `scene bistatic`: scattering coefficients of a rough surface, modelled as Gaussian facets.

use super::material::with_hint;
use super::surface::{Pair, SurfaceArgs};
use super::table::{Picture, PlotArgs, Table};
use super::values::{check_rows, combinations, exact};
use crate::cli::context::Outcome;
use crate::cli::failure::{Context as _, Result};
use cittert_arrays::quantity::{Angle, Frequency};
use cittert_phenomenology::surfaces::{BistaticGeometry, Shadowing, Slopes, bistatic_coefficient};
use clap::{Args, ValueEnum};

/// How facets hide other facets.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum Shadow {
    /// Smith: 1/(1 + L).
    Smith,
    /// Wagner: (1 - exp(-L))/L.
    Wagner,
    /// No facet hides another.
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
    /// How facets hide other facets.
    #[arg(long, value_enum, default_value = "smith")]
    shadowing: Shadow,
    /// Angles of incidence, from the normal.
    #[arg(long, value_name = "ANGLE", value_delimiter = ',', required = true, allow_hyphen_values = true)]
    incidence: Vec<Angle>,
    /// Angles of scattering, from the normal.
    #[arg(long, value_name = "ANGLE", value_delimiter = ',', required = true, allow_hyphen_values = true)]
    scattered: Vec<Angle>,
    /// Azimuths from the incident to the scattered direction of travel: 0deg is forward, 180deg is back.
    #[arg(long, value_name = "ANGLE", value_delimiter = ',', default_value = "0deg", allow_hyphen_values = true)]
    azimuth: Vec<Angle>,
    /// Azimuth of the direction in which the incident wave travels, from the first slope axis.
    #[arg(long, value_name = "ANGLE", default_value = "0deg", allow_hyphen_values = true)]
    incident_azimuth: Angle,
    #[command(flatten)]
    plot: PlotArgs,
}

/// Print one row for each surface, frequency and pair of directions. The first letter of a coefficient is the scattered polarisation.
///
/// # Errors
/// Values out of range, unknown names, a stack file that cannot be read, a picture that cannot be written.
pub(super) fn run(args: &BistaticArgs) -> Result<Outcome> {
    args.plot.claim(args.surface.file())?;
    let lengths = [args.freq.len(), args.incidence.len(), args.scattered.len(), args.azimuth.len()];
    check_rows(&[&lengths[..], &args.surface.material.lengths()].concat())?;
    let slopes = Slopes::new(args.slopes.0, args.slopes.1)?;
    let shadowing = match args.shadowing {
        Shadow::Smith => Shadowing::Smith,
        Shadow::Wagner => Shadowing::Wagner,
        Shadow::None => Shadowing::None,
    };
    let from = args.incident_azimuth.si();
    let mut table = Table::default();
    for surface in args.surface.surfaces()? {
        for [f, i, s, a] in combinations(lengths) {
            let freq_hz = args.freq[f].si();
            let stack = with_hint(surface.description.resolve(exact(freq_hz), args.surface.material.extrapolation()))
                .context(args.surface.named())?;
            let [incidence, scattered, azimuth] = [args.incidence[i], args.scattered[s], args.azimuth[a]].map(Angle::si);
            let geometry = BistaticGeometry {
                incident_zenith_rad: incidence,
                incident_azimuth_rad: from,
                scattered_zenith_rad: scattered,
                scattered_azimuth_rad: from + azimuth,
            };
            let g = bistatic_coefficient(&stack, &slopes, shadowing, &geometry)?;
            let inputs = [
                ("freq_ghz", exact(freq_hz / 1e9).into()),
                ("incidence_deg", exact(incidence.to_degrees()).into()),
                ("scattered_deg", exact(scattered.to_degrees()).into()),
                ("azimuth_deg", exact(azimuth.to_degrees()).into()),
            ];
            let coefficients = [("gamma_vv", g.vv), ("gamma_vh", g.vh), ("gamma_hv", g.hv), ("gamma_hh", g.hh)];
            table.push(inputs.into_iter().chain(surface.cells.clone()), coefficients)?;
        }
    }
    let columns = &["gamma_vv", "gamma_vh", "gamma_hv", "gamma_hh"];
    table.finish(&args.plot, &Picture { title: "Bistatic coefficients", columns, label: "gamma" })
}
