//! `closure`: closure phases and amplitudes with their errors.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use crate::ChainError;
use crate::closure::{ClosureChannels, ClosureKey, ClosureOptions, ClosureSet, SolutionInterval, closure_amplitudes, closure_phases};
use crate::plot::{CurveOptions, Series, Style, curves};
use cittert_arrays::ArrayLayout;
use cittert_formats::atomic::{AtomicFile, write_file};
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Options of `closure`.
#[derive(Debug, Args)]
pub struct ClosureArgs {
    /// Visibilities.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// Table of every quantity (CSV).
    #[arg(short, long, value_name = "CSV")]
    output: Option<PathBuf>,
    /// Picture of the closure phases against time (PNG).
    #[arg(long, value_name = "PNG")]
    plot: Option<PathBuf>,
    /// Picture of the logarithms of the closure amplitudes against time (PNG).
    #[arg(long, value_name = "PNG")]
    plot_amplitudes: Option<PathBuf>,
    /// Every triangle and quadrangle instead of an independent set of them.
    #[arg(long)]
    all: bool,
    /// Average over this time: a time, int (each integration) or inf (the whole set).
    #[arg(long, value_name = "TIME|int|inf", default_value = "int")]
    solint: SolutionInterval,
    /// What happens to the channels.
    #[arg(long, value_enum, default_value_t = Channels::Average)]
    channels: Channels,
    /// Replace an output that exists.
    #[arg(long)]
    overwrite: bool,
}

/// What happens to the channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Channels {
    /// Visibilities are averaged over the band first.
    Average,
    /// Quantities are formed for each and averaged.
    AverageClosures,
    /// One quantity for each.
    Each,
}

/// Largest number of points of a picture. More could not be distinguished.
const MOST_POINTS: usize = 20_000;

/// Sums over all quantities of one kind.
#[derive(Default)]
struct Tally {
    count: u64,
    square: f64,
    chi2: f64,
    beyond: u64,
    sigma: Vec<f64>,
    /// Every `stride`-th point (Julian date, value, sigma).
    points: Vec<(f64, f64, f64)>,
    stride: u64,
}

impl Tally {
    fn add(&mut self, time_jd: f64, value: f64, sigma: f64) {
        self.stride = self.stride.max(1);
        if self.count.is_multiple_of(self.stride) {
            self.points.push((time_jd, value, sigma));
            self.sigma.push(sigma);
            if self.points.len() >= 2 * MOST_POINTS {
                // From here on every second point is kept, and half of those that were kept before.
                self.stride *= 2;
                let mut keep = false;
                self.points.retain(|_| {
                    keep = !keep;
                    keep
                });
                self.sigma.clear();
                self.sigma.extend(self.points.iter().map(|p| p.2));
            }
        }
        self.count += 1;
        self.square += value * value;
        if sigma > 0.0 {
            self.chi2 += (value / sigma).powi(2);
            self.beyond += u64::from(value.abs() > 3.0 * sigma);
        }
    }

    fn rms(&self) -> f64 {
        (self.square / self.count.max(1) as f64).sqrt()
    }

    fn median_sigma(&self) -> f64 {
        let mut all = self.sigma.clone();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(0.0)
    }

    fn json(&self, unit: &str) -> Value {
        let n = self.count.max(1) as f64;
        json!({
            "count": self.count, format!("rms{unit}"): self.rms(), format!("median_sigma{unit}"): self.median_sigma(),
            "chi2_per_datum_of_a_point": self.chi2 / n, "fraction_beyond_3_sigma": self.beyond as f64 / n,
        })
    }

    fn text(&self, name: &str, unit: &str) -> String {
        let n = self.count.max(1) as f64;
        format!(
            "{name:20} {:8}   rms {:.5}{unit}, median error {:.5}{unit}, {:.1} % beyond 3 sigma of a point",
            self.count,
            self.rms(),
            self.median_sigma(),
            100.0 * self.beyond as f64 / n
        )
    }

    fn picture(&self, title: &str, label: &str, scale: f64) -> Result<Vec<u8>> {
        let first = self.points.iter().map(|p| p.0).fold(f64::INFINITY, f64::min);
        let step = self.points.len().div_ceil(MOST_POINTS).max(1);
        let shown = || self.points.iter().step_by(step);
        let series = Series {
            name: String::new(),
            points: shown().map(|p| ((p.0 - first) * 1440.0, p.1 * scale)).collect(),
            errors: shown().map(|p| (p.2 * scale, p.2 * scale)).collect(),
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
}

/// The table, line by line.
struct Table(Option<(AtomicFile, BufWriter<std::fs::File>)>);

impl Table {
    fn create(path: Option<&Path>, overwrite: bool) -> Result<Self> {
        let Some(path) = path else { return Ok(Self(None)) };
        let file = AtomicFile::create(path, overwrite)?;
        let mut out = BufWriter::new(file.open()?);
        writeln!(out, "kind,time_jd,interval_s,chan,freq_hz,pol,ant1,ant2,ant3,ant4,value,sigma,samples")?;
        Ok(Self(Some((file, out))))
    }

    fn line(
        &mut self,
        kind: &str,
        key: &ClosureKey,
        (layout, antennas): (&ArrayLayout, &[usize]),
        (value, sigma): (f64, f64),
    ) -> crate::Result<()> {
        let Some((_, out)) = &mut self.0 else { return Ok(()) };
        let name = |k: usize| antennas.get(k).and_then(|a| layout.antennas().get(*a)).map_or("", |a| a.name.as_str());
        writeln!(
            out,
            "{kind},{:.9},{},{},{},{},{},{},{},{},{value:.9e},{sigma:.6e},{}",
            key.time_jd,
            key.interval_s,
            key.chan,
            key.freq_hz,
            key.polarization,
            name(0),
            name(1),
            name(2),
            name(3),
            key.samples
        )
        .map_err(|e| ChainError::Other(Box::new(e)))
    }

    fn commit(self) -> Result<()> {
        if let Some((file, mut out)) = self.0 {
            out.flush()?;
            drop(out);
            file.commit()?;
        }
        Ok(())
    }
}

/// Form closure quantities, write them, and print a summary.
///
/// # Errors
/// The file or an option is wrong, the array has fewer than three antennas, or an error of the file system.
pub fn run(args: &ClosureArgs, context: &Context) -> Result<Outcome> {
    let outputs = [&args.output, &args.plot, &args.plot_amplitudes];
    for path in outputs.into_iter().flatten() {
        let out = super::options::OutputArgs { output: path.clone(), overwrite: args.overwrite };
        out.check(path)?;
    }
    let options = ClosureOptions {
        set: if args.all { ClosureSet::All } else { ClosureSet::Minimal },
        interval: args.solint,
        channels: match args.channels {
            Channels::Average => ClosureChannels::AverageVisibilities,
            Channels::AverageClosures => ClosureChannels::AverageClosures,
            Channels::Each => ClosureChannels::Each,
        },
    };
    let mut source = cittert_formats::open_visibilities(&args.input)?;
    let layout = source.header().layout.clone();
    let what = format!("closure quantities of {}", args.input.display());
    let mut table = Table::create(args.output.as_deref(), args.overwrite)?;
    let (mut phases, mut amplitudes) = (Tally::default(), Tally::default());
    closure_phases(source.as_mut(), &options, &context.console, |c| {
        phases.add(c.key.time_jd, c.phase_rad, c.sigma_rad);
        table.line("phase_rad", &c.key, (&layout, &c.antennas), (c.phase_rad, c.sigma_rad))
    })
    .context(&what)?;
    if layout.n_ant() < 4 {
        context.console.note("closure amplitudes need at least 4 antennas: there are none");
    } else {
        closure_amplitudes(source.as_mut(), &options, &context.console, |c| {
            amplitudes.add(c.key.time_jd, c.log_amplitude, c.sigma);
            table.line("log_amplitude", &c.key, (&layout, &c.antennas), (c.log_amplitude, c.sigma))
        })
        .context(&what)?;
    }
    if phases.count == 0 {
        return Err(Failure::message(format!("{what}: no triangle of antennas has usable data (flagged, or of weight 0)")));
    }
    table.commit()?;
    let name = args.input.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    if let Some(path) = &args.plot {
        write_file(path, args.overwrite, &phases.picture(&name, "Closure phase (deg)", 1f64.to_degrees())?)?;
    }
    if let Some(path) = &args.plot_amplitudes {
        write_file(path, args.overwrite, &amplitudes.picture(&name, "Log closure amplitude", 1.0)?)?;
    }
    let json = json!({
        "output": args.output, "n_antennas": layout.n_ant(), "phases": phases.json("_rad"), "log_amplitudes": amplitudes.json(""),
    });
    let text = format!("{}\n{}", phases.text("closure phases", " rad"), amplitudes.text("closure amplitudes", ""));
    let written = outputs.into_iter().flatten().fold(Outcome::new(json, text), |o, path| o.wrote(path));
    Ok(written)
}
