//! `scene path`: emission and transmission of the air between two heights.

use super::air::{Air, AirArgs};
use super::table::{Picture, PlotArgs, Table};
use super::values::{check_rows, combinations, degrees, exact, ghz};
use crate::cli::context::Outcome;
use crate::cli::failure::{Context as _, Failure, Result};
use cittert_arrays::quantity::{Angle, Frequency, Length};
use cittert_phenomenology::atmosphere::{PathEnds, PathExtent, PathTable};
use clap::{Args, ValueEnum};

/// How the path is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Method {
    /// The full integral, line by line.
    Integral,
    /// One temperature, that of the middle height, and optical depths from a table.
    Constant,
}

/// Options of `scene path`.
#[derive(Debug, Args)]
pub(crate) struct PathArgs {
    #[command(flatten)]
    air: AirArgs,
    /// Frequencies, 1 to 1000 GHz.
    #[arg(long, value_name = "FREQ", value_delimiter = ',', required = true, allow_hyphen_values = true)]
    freq: Vec<Frequency>,
    /// Heights of the observer, who receives the emission of the path.
    #[arg(long, value_name = "LENGTH", value_delimiter = ',', required = true, allow_hyphen_values = true)]
    observer: Vec<Length>,
    /// Heights of the target.
    #[arg(long, value_name = "LENGTH", value_delimiter = ',', default_value = "0km", allow_hyphen_values = true)]
    target: Vec<Length>,
    /// Angles between the path and the vertical [default: 0deg].
    #[arg(long, value_name = "ANGLE", value_delimiter = ',', allow_hyphen_values = true, conflicts_with = "length")]
    zenith: Vec<Angle>,
    /// Lengths of the path, for a horizontal path.
    #[arg(long, value_name = "LENGTH", value_delimiter = ',', allow_hyphen_values = true)]
    length: Vec<Length>,
    /// How the path is computed.
    #[arg(long, value_enum, default_value = "integral")]
    method: Method,
    /// Divide a path of constant temperature into pieces that rise by at most this much [default: one piece].
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    max_rise: Option<Length>,
    #[command(flatten)]
    plot: PlotArgs,
}

/// Print one row for each atmosphere, pair of heights, direction or length, and frequency.
///
/// # Errors
/// Values out of range, a path that is impossible, a picture that cannot be written.
pub(super) fn run(args: &PathArgs) -> Result<Outcome> {
    args.plot.claim(args.air.names())?;
    if args.max_rise.is_some() && args.method == Method::Integral {
        return Err(Failure::usage("--max-rise divides a path of constant temperature; add --method constant"));
    }
    let extents: Vec<PathExtent> = if !args.length.is_empty() {
        args.length.iter().map(|l| PathExtent::LengthKm(exact(l.si() / 1e3))).collect()
    } else if args.zenith.is_empty() {
        vec![PathExtent::ZenithDeg(0.0)]
    } else {
        degrees(&args.zenith).into_iter().map(PathExtent::ZenithDeg).collect()
    };
    check_rows(&[args.air.count(), args.freq.len(), args.observer.len(), args.target.len(), extents.len()])?;
    let mut table = Table::default();
    for air in args.air.build()? {
        rows(args, &air, &extents, &mut table).context(air.name())?;
    }
    table.finish(&args.plot, &Picture { title: "Path", columns: &["emission_rj_k"], label: "emission, Rayleigh-Jeans [K]" })
}

fn rows(args: &PathArgs, one: &Air, extents: &[PathExtent], table: &mut Table) -> Result<()> {
    let freqs = ghz(&args.freq);
    let depths = match (args.method, args.max_rise) {
        (Method::Integral, _) => None,
        (Method::Constant, None) => Some(PathTable::new(&one.air, &freqs)?),
        (Method::Constant, Some(rise)) => Some(PathTable::new(&one.air, &freqs)?.with_max_rise(exact(rise.si() / 1e3))?),
    };
    for [observer, target, extent] in combinations([args.observer.len(), args.target.len(), extents.len()]) {
        let height_km = |length: Length| exact(length.si() / 1e3);
        let ends = PathEnds::new(height_km(args.observer[observer]), height_km(args.target[target]), extents[extent])?;
        let zenith_deg = match extents[extent] {
            PathExtent::ZenithDeg(zenith) => zenith,
            PathExtent::LengthKm(0.0) => 0.0,
            // The length may round to just below the difference in height.
            PathExtent::LengthKm(km) => ((ends.target_km() - ends.observer_km()).abs() / km).min(1.0).acos().to_degrees(),
        };
        let paths = match &depths {
            Some(depths) => (0..freqs.len()).map(|channel| depths.radiation(channel, &ends)).collect::<Result<Vec<_>, _>>()?,
            None => one.air.path(&freqs, &ends)?,
        };
        for p in paths {
            let inputs = [
                ("freq_ghz", p.freq_ghz.into()),
                ("observer_km", ends.observer_km().into()),
                ("target_km", ends.target_km().into()),
                ("zenith_deg", zenith_deg.into()),
            ];
            let outputs = [
                ("length_km", ends.length_km()),
                ("emission_planck_k", p.emission_planck_k()),
                ("emission_rj_k", p.emission_rj_k()),
                ("tau_np", p.tau_np),
                ("transmission", p.transmission()),
                ("mean_radiating_k", p.mean_radiating_k()),
            ];
            table.push(one.cells().into_iter().chain(inputs), outputs)?;
        }
    }
    Ok(())
}
