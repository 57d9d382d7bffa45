//! `scene permittivity`: numbers of the dielectric database.

use super::material::{MaterialArgs, with_hint};
use super::table::{Cell, Picture, PlotArgs, Table};
use super::values::{check_rows, exact};
use crate::cli::context::Outcome;
use crate::cli::failure::Result;
use crate::cli::options::NOTHING;
use cittert_arrays::quantity::Frequency;
use cittert_phenomenology::dielectrics::Parameter;
use clap::Args;

/// Options of `scene permittivity`.
#[derive(Debug, Args)]
pub(crate) struct PermittivityArgs {
    #[command(flatten)]
    material: MaterialArgs,
    /// Frequencies.
    #[arg(long, value_name = "FREQ", value_delimiter = ',', required = true, allow_hyphen_values = true)]
    freq: Vec<Frequency>,
    #[command(flatten)]
    plot: PlotArgs,
}

/// Print one row for each state of the material and each frequency.
///
/// # Errors
/// Values out of range, unknown names, a picture that cannot be written.
pub(super) fn run(args: &PermittivityArgs) -> Result<Outcome> {
    args.plot.claim(NOTHING)?;
    check_rows(&[&[args.freq.len()][..], &args.material.lengths()].concat())?;
    let sample = args.material.sample()?;
    let freqs_hz: Vec<f64> = args.freq.iter().map(|f| exact(f.si())).collect();
    let mut table = Table::default();
    for state in &sample.states {
        for &freq_hz in &freqs_hz {
            let p = sample.material.evaluate(sample.model, state, freq_hz, args.material.extrapolation());
            let p = with_hint(p.map_err(Into::into))?;
            let inputs = [
                ("material", sample.material.name.into()),
                ("model", p.model.name.into()),
                ("freq_ghz", exact(freq_hz / 1e9).into()),
                ("temperature_k", state.temperature_k.into()),
                ("salinity_psu", sample.cell(state, Parameter::Salinity)),
                ("moisture", sample.cell(state, Parameter::Moisture)),
                ("density_kg_m3", sample.cell(state, Parameter::Density)),
                ("sand", sample.cell(state, Parameter::Sand)),
                ("clay", sample.cell(state, Parameter::Clay)),
                ("extended", Cell::Flag(p.extended)),
            ];
            table.push(inputs, [("eps_real", p.eps.re), ("eps_loss", -p.eps.im)])?;
        }
    }
    let title = format!("Permittivity of {}", sample.material.name);
    table.finish(&args.plot, &Picture { title: &title, columns: &["eps_real", "eps_loss"], label: "permittivity" })
}
