//! `scene permittivity`: the dielectric data base as numbers.

use super::material::{MaterialArgs, with_hint};
use super::table::{Cell, Picture, PlotArgs, Table};
use super::values::{check_rows, exact};
use crate::cli::context::Outcome;
use crate::cli::failure::Result;
use cittert_arrays::quantity::Frequency;
use cittert_phenomenology::dielectrics::{Parameter, permittivity_rows};
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

const INPUTS: [&str; 10] =
    ["material", "model", "freq_ghz", "temperature_k", "salinity_psu", "moisture", "density_kg_m3", "sand", "clay", "extended"];

/// A row for each state of the material and frequency.
///
/// # Errors
/// Values out of range, unknown names, a picture that cannot be written.
pub(super) fn run(args: &PermittivityArgs) -> Result<Outcome> {
    args.plot.check()?;
    check_rows(&[&[args.freq.len()][..], &args.material.count()].concat())?;
    let sample = args.material.sample()?;
    let freqs_hz: Vec<f64> = args.freq.iter().map(|f| exact(f.si())).collect();
    let mut table = Table::new(&INPUTS, &["eps_real", "eps_loss"]);
    for state in &sample.states {
        let rows = permittivity_rows(sample.material, sample.model, &[*state], &freqs_hz, args.material.extrapolation());
        for row in with_hint(rows.map_err(Into::into))? {
            // A parameter the material does not have says nothing.
            let value = |p: Parameter| match sample.material.spec(p) {
                Some(_) => Cell::Number(state.get(p)),
                None => Cell::Absent,
            };
            let inputs = vec![
                row.material.into(),
                row.model.into(),
                exact(row.freq_ghz).into(),
                row.temperature_k.into(),
                value(Parameter::Salinity),
                value(Parameter::Moisture),
                value(Parameter::Density),
                value(Parameter::Sand),
                value(Parameter::Clay),
                Cell::Flag(row.extended),
            ];
            table.push(inputs, [row.eps_real, row.eps_loss]);
        }
    }
    let title = format!("Permittivity of {}", sample.material.name);
    table.finish(&args.plot, &Picture { title: &title, columns: &["eps_real", "eps_loss"], label: "permittivity" })
}
