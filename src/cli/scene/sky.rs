//! `scene sky`: sky temperatures against zenith angle.

use super::air::AirArgs;
use super::table::{Picture, PlotArgs, Table};
use super::values::{check_rows, degrees, exact, ghz};
use crate::cli::context::Outcome;
use crate::cli::failure::Result;
use cittert_arrays::quantity::{Angle, Frequency, Length, Temperature};
use cittert_phenomenology::atmosphere::Geometry;
use clap::Args;

/// Options of `scene sky`.
#[derive(Debug, Args)]
pub(crate) struct SkyArgs {
    #[command(flatten)]
    air: AirArgs,
    /// Frequencies, 1 to 1000 GHz.
    #[arg(long, value_name = "FREQ", value_delimiter = ',', required = true, allow_hyphen_values = true)]
    freq: Vec<Frequency>,
    /// Zenith angles, 0 to below 90 degrees.
    #[arg(long, value_name = "ANGLE", value_delimiter = ',', default_value = "0deg", allow_hyphen_values = true)]
    zenith: Vec<Angle>,
    /// Shape of the atmosphere: plane, or spherical with refraction.
    #[arg(long, value_name = "NAME", default_value = "plane")]
    geometry: String,
    /// Height of the observer [default: the bottom of the profile].
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    height: Option<Length>,
    /// Temperature of the background behind the atmosphere [default: 2.728K, the cosmic background].
    #[arg(long, value_name = "TEMP", allow_hyphen_values = true)]
    background: Option<Temperature>,
    #[command(flatten)]
    plot: PlotArgs,
}

/// Print one row for each atmosphere, gas model, frequency and zenith angle.
///
/// # Errors
/// Values out of range, profiles that cannot be read, a picture that cannot be written.
pub(super) fn run(args: &SkyArgs) -> Result<Outcome> {
    args.plot.claim(args.air.names())?;
    check_rows(&[args.air.count(), args.freq.len(), args.zenith.len()])?;
    let geometry: Geometry = args.geometry.parse()?;
    let (freqs, zeniths) = (ghz(&args.freq), degrees(&args.zenith));
    let mut table = Table::default();
    for one in args.air.build()? {
        let names = one.cells();
        let air = match args.background {
            Some(t) => one.air.with_background(t.si())?,
            None => one.air,
        };
        let rows = match args.height {
            Some(h) => air.sky_from(exact(h.si() / 1e3), &freqs, &zeniths, geometry)?,
            None => air.sky(&freqs, &zeniths, geometry)?,
        };
        for row in rows {
            let mut values = row.columns().into_iter();
            let inputs = values.by_ref().take(2).map(|(name, value)| (name, value.into()));
            table.push(names.clone().into_iter().chain(inputs).collect::<Vec<_>>(), values)?;
        }
    }
    table.finish(&args.plot, &Picture { title: "Sky", columns: &["tb_planck_k"], label: "brightness temperature [K]" })
}
