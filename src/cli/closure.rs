//! `closure`: closure phases and amplitudes with their errors.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result, ensure};
use super::forecast::{Passing, Plan, Planner, Scratch, Told, grown};
use super::options::{OutputArgs, SetArgs};
use crate::ChainError;
use crate::closure::{ClosureKey, ClosureOptions, ClosureTally, closure_amplitudes, closure_phases};
use crate::cost;
use crate::plot::{CurveOptions, Series, Style, curves};
use crate::progress::{Observer, Silent};
use cittert_arrays::{ArrayLayout, VisibilitySet, VisibilitySource};
use cittert_formats::FormatError;
use cittert_formats::atomic::{AtomicFile, write_file};
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Options of `closure`.
#[derive(Debug, Args)]
pub struct ClosureArgs {
    #[command(flatten)]
    input: SetArgs,
    /// Table of every quantity (CSV).
    #[arg(short, long, value_name = "CSV")]
    output: Option<PathBuf>,
    /// Picture of the closure phases against time (PNG).
    #[arg(long, value_name = "PNG")]
    plot: Option<PathBuf>,
    /// Picture of the logarithms of the closure amplitudes against time (PNG).
    #[arg(long, value_name = "PNG")]
    plot_amplitudes: Option<PathBuf>,
    #[command(flatten)]
    how: ClosureOptions,
    /// Replace an output that exists.
    #[arg(long)]
    overwrite: bool,
}

fn tally_json(t: &ClosureTally, unit: &str) -> Value {
    json!({
        "count": t.count, format!("rms{unit}"): t.rms(), format!("median_sigma{unit}"): t.median_sigma(),
        "chi2_per_datum_of_a_point": t.chi2_of_a_point(), "fraction_beyond_3_sigma": t.beyond_3_sigma(),
    })
}

fn tally_text(t: &ClosureTally, name: &str, unit: &str) -> String {
    let (rms, sigma, beyond) = (t.rms(), t.median_sigma(), 100.0 * t.beyond_3_sigma());
    format!("{name:20} {:8}   rms {rms:.5}{unit}, median error {sigma:.5}{unit}, {beyond:.1} % beyond 3 sigma of a point", t.count)
}

fn picture(t: &ClosureTally, title: &str, label: &str, scale: f64) -> Result<Vec<u8>> {
    let first = t.sample().map(|p| p.time_jd).fold(f64::INFINITY, f64::min);
    let series = Series {
        name: String::new(),
        points: t.sample().map(|p| ((p.time_jd - first) * 1440.0, p.value * scale)).collect(),
        errors: t.sample().map(|p| (p.sigma * scale, p.sigma * scale)).collect(),
    };
    let options = CurveOptions {
        title: title.into(),
        x_label: "Time (min)".into(),
        y_label: label.into(),
        styles: vec![Style { color: 0, line: false, dots: true }],
        ..CurveOptions::default()
    };
    Ok(curves(&[series], &options)?.png()?)
}

const COLUMNS: [&str; 13] =
    ["kind", "time_jd", "interval_s", "chan", "freq_hz", "pol", "ant1", "ant2", "ant3", "ant4", "value", "sigma", "samples"];

/// The table, line by line.
struct Table(Option<(AtomicFile, csv::Writer<std::fs::File>)>);

impl Table {
    fn create(path: Option<&Path>, overwrite: bool) -> Result<Self> {
        let Some(path) = path else { return Ok(Self(None)) };
        let file = AtomicFile::create(path, overwrite)?;
        let mut out = csv::Writer::from_writer(file.open()?);
        out.write_record(COLUMNS)?;
        Ok(Self(Some((file, out))))
    }

    fn line(
        &mut self,
        kind: &str,
        key: &ClosureKey,
        (layout, antennas): (&ArrayLayout, &[usize]),
        (value, sigma): (f64, f64),
    ) -> crate::Result<()> {
        let Some((file, out)) = &mut self.0 else { return Ok(()) };
        let name = |k: usize| antennas.get(k).and_then(|a| layout.antennas().get(*a)).map_or("", |a| a.name.as_str()).to_owned();
        let when = [kind.to_owned(), format!("{:.9}", key.time_jd), key.interval_s.to_string()];
        let band = [key.chan.to_string(), key.freq_hz.to_string(), key.polarization.to_string()];
        let numbers = [format!("{value:.9e}"), format!("{sigma:.6e}"), key.samples.to_string()];
        out.write_record(when.into_iter().chain(band).chain((0..4).map(name)).chain(numbers))
            .map_err(|e| ChainError::Other(Box::new(FormatError::io(file.target(), "write", e.into()))))
    }

    fn commit(self) -> Result<()> {
        if let Some((file, mut out)) = self.0 {
            out.flush().map_err(|e| FormatError::io(file.target(), "write", e))?;
            drop(out);
            file.commit()?;
        }
        Ok(())
    }
}

/// Form the closure phases and amplitudes of a set, and write them into a table.
fn formed(
    source: &mut dyn VisibilitySource,
    how: &ClosureOptions,
    table: &mut Table,
    observer: &dyn Observer,
) -> crate::Result<(ClosureTally, ClosureTally)> {
    let layout = source.header().layout.clone();
    let (mut phases, mut amplitudes) = (ClosureTally::default(), ClosureTally::default());
    closure_phases(source, how, observer, |c| {
        phases.add(c.key.time_jd, c.phase_rad, c.sigma_rad);
        table.line("phase_rad", &c.key, (&layout, &c.antennas), (c.phase_rad, c.sigma_rad))
    })?;
    if layout.n_ant() >= 4 {
        closure_amplitudes(source, how, observer, |c| {
            amplitudes.add(c.key.time_jd, c.log_amplitude, c.sigma);
            table.line("log_amplitude", &c.key, (&layout, &c.antennas), (c.log_amplitude, c.sigma))
        })?;
    }
    Ok((phases, amplitudes))
}

/// Form closure quantities, write them, and print a summary.
///
/// # Errors
/// The file or an option is wrong, the array has fewer than three antennas, or an error of the file system.
pub fn run(args: &ClosureArgs, context: &Context) -> Result<Outcome> {
    let outputs = [&args.output, &args.plot, &args.plot_amplitudes];
    let out = OutputArgs { output: PathBuf::new(), overwrite: args.overwrite };
    let input = args.input.files()?;
    out.claim(outputs.into_iter().flatten(), input.all())?;
    let mut source = input.open(context)?;
    let layout = source.header().layout.clone();
    let what = format!("closure quantities of {input}");
    let mut table = Table::create(args.output.as_deref(), args.overwrite)?;
    let (phases, amplitudes) = formed(source.as_mut(), &args.how, &mut table, &context.console).context(&what)?;
    if layout.n_ant() < 4 {
        context.console.note("closure amplitudes need at least 4 antennas: there are none");
    }
    ensure!(phases.count > 0, Failure::message(format!("{what}: no triangle of antennas has usable data (flagged, or of weight 0)")));
    table.commit()?;
    let name = input.all().first().and_then(|file| file.file_stem()).map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    if let Some(path) = &args.plot {
        write_file(path, args.overwrite, &picture(&phases, &name, "Closure phase (deg)", 1f64.to_degrees())?)?;
    }
    if let Some(path) = &args.plot_amplitudes {
        write_file(path, args.overwrite, &picture(&amplitudes, &name, "Log closure amplitude", 1.0)?)?;
    }
    let json = json!({
        "output": args.output, "n_antennas": layout.n_ant(), "phases": tally_json(&phases, "_rad"), "log_amplitudes": tally_json(&amplitudes, ""),
    });
    let text = format!("{}\n{}", tally_text(&phases, "closure phases", " rad"), tally_text(&amplitudes, "closure amplitudes", ""));
    let written = outputs.into_iter().flatten().fold(Outcome::new(json, text), |o, path| o.wrote(path));
    Ok(written)
}

/// Rows from which closure quantities are formed first for a forecast.
const FIRST_ROWS: usize = 1024;

impl Plan for ClosureArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        let input = self.input.files()?;
        let mut source = input.open(planner.context)?;
        let Passing { set, header, mut facts } = Passing::of(&input, source.as_ref(), false, planner)?;
        let scratch = Scratch::new()?;
        let path = scratch.path().join("table.csv");
        let mut lines = 0;
        let found = grown((set.rows, source.n_rows()), FIRST_ROWS, &mut |n| {
            let mut some = VisibilitySet::new(header.clone(), source.read_rows(0..n)?)?;
            let mut table = Table::create(self.output.as_ref().map(|_| path.as_path()), true)?;
            let (phases, amplitudes) = formed(&mut some, &self.how, &mut table, &Silent)?;
            table.commit()?;
            lines = phases.count + amplitudes.count;
            Ok(())
        })?;
        let all = set.rows / found.part.max(1) as f64;
        let written = std::fs::metadata(&path).map_or(0.0, |m| m.len() as f64);
        let pictures = [&self.plot, &self.plot_amplitudes].into_iter().flatten().count();
        let mut forecast = cost::timed("closure quantities", (found.seconds, set.block_bytes()), pictures as f64);
        forecast.output_bytes += all * written;
        forecast.assumptions.push(found.assumption("rows"));
        facts.insert("quantities".into(), (all * lines as f64).round().into());
        Ok(Told { command: "closure", forecast, facts })
    }

    fn output(&self) -> &Path {
        self.output.as_deref().unwrap_or(Path::new("."))
    }
}
