//! `scene delay`: excess path length and phase of the air.

use super::air::AirArgs;
use super::table::{Picture, PlotArgs, Table};
use super::values::{check_rows, degrees, exact, ghz};
use crate::cli::context::Outcome;
use crate::cli::failure::Result;
use cittert_arrays::quantity::{Angle, Frequency, Length};
use cittert_phenomenology::atmosphere::Geometry;
use clap::Args;

/// Options of `scene delay`.
#[derive(Debug, Args)]
pub(crate) struct DelayArgs {
    #[command(flatten)]
    air: AirArgs,
    /// Frequencies, 0 to 1000 GHz.
    #[arg(long, value_name = "FREQ", value_delimiter = ',', required = true, allow_hyphen_values = true)]
    freq: Vec<Frequency>,
    /// Apparent zenith angles, 0 to 89.9 degrees.
    #[arg(long, value_name = "ANGLE", value_delimiter = ',', default_value = "0deg", allow_hyphen_values = true)]
    zenith: Vec<Angle>,
    /// Shape of the atmosphere: plane, or spherical with refraction.
    #[arg(long, value_name = "NAME", default_value = "plane")]
    geometry: String,
    /// Height of the observer [default: the bottom of the profile].
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    height: Option<Length>,
    #[command(flatten)]
    plot: PlotArgs,
}

/// Print one row for each atmosphere, gas model, frequency and zenith angle.
///
/// # Errors
/// Values out of range, profiles that cannot be read, a picture that cannot be written.
pub(super) fn run(args: &DelayArgs) -> Result<Outcome> {
    args.plot.claim(args.air.names())?;
    check_rows(&[args.air.count(), args.freq.len(), args.zenith.len()])?;
    let geometry: Geometry = args.geometry.parse()?;
    let (freqs, zeniths) = (ghz(&args.freq), degrees(&args.zenith));
    let mut table = Table::default();
    for one in args.air.build()? {
        let bottom_km = one.air.profile().bottom_km();
        let height_km = args.height.map_or(bottom_km, |h| exact(h.si() / 1e3));
        for row in one.air.delay_from(height_km, &freqs, &zeniths, geometry)? {
            let mut values = row.columns().into_iter();
            let inputs = values.by_ref().take(2).map(|(name, value)| (name, value.into()));
            table.push(one.cells().into_iter().chain(inputs).collect::<Vec<_>>(), values)?;
        }
    }
    table.finish(&args.plot, &Picture { title: "Delay", columns: &["excess_m"], label: "excess path length [m]" })
}
