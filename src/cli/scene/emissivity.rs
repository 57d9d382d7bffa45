//! `scene emissivity`: emission and reflection of surfaces.

use super::material::with_hint;
use super::surface::SurfaceArgs;
use super::table::{Picture, PlotArgs, Table};
use super::values::{check_rows, exact};
use crate::cli::context::Outcome;
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use cittert_arrays::quantity::{Angle, Frequency, Temperature};
use cittert_phenomenology::surfaces::{Roughness, Sky, SurfaceModel};
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
    /// Roughness, such as qh:Q,H,N, go:su,sc or sea:U,foam; `scene list surfaces` explains every kind and its options.
    #[arg(long, value_name = "KIND:VALUES", default_value = "smooth", allow_hyphen_values = true)]
    rough: Roughness,
    /// Azimuth of the observer from the first slope axis, for unequal slopes.
    #[arg(long, value_name = "ANGLE", default_value = "0deg", allow_hyphen_values = true)]
    azimuth: Angle,
    /// Temperature of a uniform sky, for the brightness of the surface and its reflected sky together.
    #[arg(long, value_name = "TEMP", default_value = "0K", allow_hyphen_values = true)]
    sky: Temperature,
    #[command(flatten)]
    plot: PlotArgs,
}

/// Print one row for each surface, frequency and angle.
///
/// # Errors
/// Values out of range, unknown names, a stack file that cannot be read, a picture that cannot be written.
pub(super) fn run(args: &EmissivityArgs) -> Result<Outcome> {
    args.plot.claim(args.surface.file())?;
    let sky_k = args.sky.si();
    ensure!(sky_k >= 0.0, Failure::message(format!("sky temperature is {sky_k} K, expected at least 0 K")));
    check_rows(&[&[args.freq.len(), args.angle.len()][..], &args.surface.material.lengths()].concat())?;
    let freqs_hz: Vec<f64> = args.freq.iter().map(|f| exact(f.si())).collect();
    let angles_rad: Vec<f64> = args.angle.iter().map(|a| a.si()).collect();
    let (sky, extrapolation) = (|_: f64| sky_k, args.surface.material.extrapolation());
    let mut table = Table::default();
    for s in args.surface.surfaces()? {
        for &freq_hz in &freqs_hz {
            let model =
                SurfaceModel::new(with_hint(s.description.resolve(freq_hz, extrapolation)).context(args.surface.named())?, args.rough);
            for angle_rad in &angles_rad {
                let r = with_hint(model.response(*angle_rad, args.azimuth.si(), Sky::Symmetric(&sky)))?;
                let [brightness_h_k, brightness_v_k] = r.brightness_k();
                let inputs = [("freq_ghz", exact(freq_hz / 1e9).into()), ("angle_deg", exact(angle_rad.to_degrees()).into())];
                let outputs = [
                    ("emissivity_h", r.emissivity[0]),
                    ("emissivity_v", r.emissivity[1]),
                    ("reflectivity_h", r.reflectivity[0]),
                    ("reflectivity_v", r.reflectivity[1]),
                    ("emitted_h_k", r.emitted_k[0]),
                    ("emitted_v_k", r.emitted_k[1]),
                    ("brightness_h_k", brightness_h_k),
                    ("brightness_v_k", brightness_v_k),
                ];
                table.push(inputs.into_iter().chain(s.cells.clone()), outputs)?;
            }
        }
    }
    table.finish(&args.plot, &Picture { title: "Emissivity", columns: &["emissivity_h", "emissivity_v"], label: "emissivity" })
}
