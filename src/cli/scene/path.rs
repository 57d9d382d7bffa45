//! `scene path`: what the air between two heights emits and lets through.

use super::air::{Air, AirArgs};
use super::table::{Picture, PlotArgs, Table};
use super::values::{check_rows, degrees, exact, ghz};
use crate::cli::context::Outcome;
use crate::cli::failure::{Failure, Result};
use cittert_arrays::quantity::{Angle, Frequency, Length};
use cittert_phenomenology::atmosphere::{PathEnds, PathExtent, PathRadiation, PathTable};
use clap::{Args, ValueEnum};

/// How the path is worked out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Method {
    /// The full integral, line by line.
    Integral,
    /// One temperature, that of the middle height, and depths from a table.
    Constant,
}

/// Options of `scene path`.
#[derive(Debug, Args)]
pub(crate) struct PathArgs {
    #[command(flatten)]
    air: AirArgs,
    /// Frequencies, 1-1000 GHz.
    #[arg(long, value_name = "FREQ", value_delimiter = ',', required = true, allow_hyphen_values = true)]
    freq: Vec<Frequency>,
    /// Heights of the observer, who receives what the path emits.
    #[arg(long, value_name = "LENGTH", value_delimiter = ',', required = true, allow_hyphen_values = true)]
    observer: Vec<Length>,
    /// Heights of the target.
    #[arg(long, value_name = "LENGTH", value_delimiter = ',', default_value = "0km", allow_hyphen_values = true)]
    target: Vec<Length>,
    /// Angles between the path and the vertical [default: 0deg].
    #[arg(long, value_name = "ANGLE", value_delimiter = ',', allow_hyphen_values = true, conflicts_with = "length")]
    zenith: Vec<Angle>,
    /// Lengths of the path, for a horizontal one.
    #[arg(long, value_name = "LENGTH", value_delimiter = ',', allow_hyphen_values = true)]
    length: Vec<Length>,
    /// How the path is worked out.
    #[arg(long, value_enum, default_value = "integral")]
    method: Method,
    /// Cut a path of constant temperature into pieces of at most this rise [default: one piece].
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    max_rise: Option<Length>,
    #[command(flatten)]
    plot: PlotArgs,
}

const INPUTS: [&str; 6] = ["atmosphere", "model", "freq_ghz", "observer_km", "target_km", "zenith_deg"];
const OUTPUTS: [&str; 6] = ["length_km", "emission_planck_k", "emission_rj_k", "tau_np", "transmission", "mean_radiating_k"];

/// A row for each atmosphere, pair of heights, direction or length, and frequency.
///
/// # Errors
/// Values out of range, a path that cannot be, a picture that cannot be written.
pub(super) fn run(args: &PathArgs) -> Result<Outcome> {
    args.plot.check()?;
    if args.max_rise.is_some() && args.method == Method::Integral {
        return Err(Failure::usage("--max-rise cuts a path of constant temperature; add --method constant"));
    }
    let extents: Vec<PathExtent> = if args.length.is_empty() {
        let zeniths = if args.zenith.is_empty() { vec![0.0] } else { degrees(&args.zenith) };
        zeniths.into_iter().map(PathExtent::ZenithDeg).collect()
    } else {
        args.length.iter().map(|l| PathExtent::LengthKm(exact(l.si() / 1e3))).collect()
    };
    check_rows(&[args.air.count(), args.freq.len(), args.observer.len(), args.target.len(), extents.len()])?;
    let mut table = Table::new(&INPUTS, &OUTPUTS);
    for air in args.air.build()? {
        rows(args, &air, &extents, &mut table)?;
    }
    table.finish(&args.plot, &Picture { title: "Path", columns: &["emission_rj_k"], label: "emission, Rayleigh-Jeans [K]" })
}

fn rows(args: &PathArgs, one: &Air, extents: &[PathExtent], table: &mut Table) -> Result<()> {
    let freqs = ghz(&args.freq);
    let fast = match args.method {
        Method::Integral => None,
        Method::Constant => {
            let built = PathTable::new(&one.air, &freqs)?;
            Some(match args.max_rise {
                Some(rise) => built.with_max_rise(exact(rise.si() / 1e3))?,
                None => built,
            })
        }
    };
    for observer in &args.observer {
        for target in &args.target {
            for extent in extents {
                let ends = PathEnds::new(exact(observer.si() / 1e3), exact(target.si() / 1e3), *extent)?;
                let paths = match &fast {
                    Some(fast) => {
                        (0..freqs.len()).map(|channel| fast.radiation(channel, &ends)).collect::<Result<Vec<PathRadiation>, _>>()?
                    }
                    None => one.air.path(&freqs, &ends)?,
                };
                for p in paths {
                    let height = (ends.target_km() - ends.observer_km()).abs();
                    let zenith = match extent {
                        PathExtent::ZenithDeg(z) => *z,
                        PathExtent::LengthKm(l) if *l > 0.0 => (height / l).clamp(0.0, 1.0).acos().to_degrees(),
                        PathExtent::LengthKm(_) => 0.0,
                    };
                    let inputs = vec![
                        one.atmosphere.as_str().into(),
                        one.model.as_str().into(),
                        p.freq_ghz.into(),
                        ends.observer_km().into(),
                        ends.target_km().into(),
                        zenith.into(),
                    ];
                    let outputs =
                        [ends.length_km(), p.emission_planck_k(), p.emission_rj_k(), p.tau_np, p.transmission(), p.mean_radiating_k()];
                    table.push(inputs, outputs);
                }
            }
        }
    }
    Ok(())
}
