//! `scene emissivity`: what surfaces emit and reflect.

use super::material::with_hint;
use super::surface::{COLUMNS, SurfaceArgs};
use super::table::{Picture, PlotArgs, Table};
use super::values::{check_rows, exact};
use crate::cli::context::Outcome;
use crate::cli::failure::{Failure, Result};
use cittert_arrays::quantity::{Angle, Frequency, Temperature};
use cittert_phenomenology::surfaces::{Roughness, Sky, emissivity_rows};
use clap::Args;

/// Options of `scene emissivity`.
#[derive(Debug, Args)]
pub(crate) struct EmissivityArgs {
    #[command(flatten)]
    surface: SurfaceArgs,
    /// Frequencies.
    #[arg(long, value_name = "FREQ", value_delimiter = ',', required = true, allow_hyphen_values = true)]
    freq: Vec<Frequency>,
    /// Angles from the normal, 0 to below 90 degrees.
    #[arg(long, value_name = "ANGLE", value_delimiter = ',', default_value = "0deg", allow_hyphen_values = true)]
    angle: Vec<Angle>,
    /// Roughness: qh:Q,H,N or go:su,sc[,single|reemit|second-bounce][,smith|wagner]; `scene list surfaces` has all.
    #[arg(long, value_name = "KIND:VALUES", default_value = "smooth", allow_hyphen_values = true)]
    rough: Roughness,
    /// Azimuth of the observer from the first slope axis, for unequal slopes.
    #[arg(long, value_name = "ANGLE", default_value = "0deg", allow_hyphen_values = true)]
    azimuth: Angle,
    /// Temperature of a uniform sky, for the brightness of surface and sky together.
    #[arg(long, value_name = "TEMP", default_value = "0K", allow_hyphen_values = true)]
    sky: Temperature,
    #[command(flatten)]
    plot: PlotArgs,
}

const OUTPUTS: [&str; 8] =
    ["emissivity_h", "emissivity_v", "reflectivity_h", "reflectivity_v", "emitted_h_k", "emitted_v_k", "brightness_h_k", "brightness_v_k"];

/// A row for each surface, frequency and angle.
///
/// # Errors
/// Values out of range, unknown names, a stack file that cannot be read, a picture that cannot be written.
pub(super) fn run(args: &EmissivityArgs) -> Result<Outcome> {
    args.plot.check()?;
    let sky_k = args.sky.si();
    if !(sky_k >= 0.0) {
        return Err(Failure::message(format!("sky temperature is {sky_k} K; it must be at least 0 K")));
    }
    check_rows(&[&[args.freq.len(), args.angle.len()][..], &args.surface.material.count()].concat())?;
    let surfaces = args.surface.surfaces()?;
    let freqs_hz: Vec<f64> = args.freq.iter().map(|f| exact(f.si())).collect();
    let angles_rad: Vec<f64> = args.angle.iter().map(|a| a.si()).collect();
    let sky = |_: f64| sky_k;
    let extrapolation = args.surface.material.extrapolation();
    let inputs: Vec<&str> = ["freq_ghz", "angle_deg"].into_iter().chain(COLUMNS).collect();
    let mut table = Table::new(&inputs, &OUTPUTS);
    for s in surfaces {
        let rows =
            emissivity_rows(&s.description, args.rough, &freqs_hz, &angles_rad, args.azimuth.si(), Sky::Symmetric(&sky), extrapolation);
        for row in with_hint(rows)? {
            let mut cells = vec![exact(row.freq_ghz).into(), exact(row.angle_deg).into()];
            cells.extend(s.cells.iter().cloned());
            let values = [
                row.emissivity_h,
                row.emissivity_v,
                row.reflectivity_h,
                row.reflectivity_v,
                row.emitted_h_k,
                row.emitted_v_k,
                row.brightness_h_k,
                row.brightness_v_k,
            ];
            table.push(cells, values);
        }
    }
    table.finish(&args.plot, &Picture { title: "Emissivity", columns: &["emissivity_h", "emissivity_v"], label: "emissivity" })
}
