//! `selfcal`: rounds of imaging, deconvolving, predicting and solving for antenna gains.

mod maker;
mod report;

use super::applycal::InterpName;
use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use super::options::{CleanArgs, ImagingArgs, OutputArgs, SolveArgs, prior};
use super::predict::{SkyPrediction, load_model};
use crate::calibrate::{
    ApplyOptions, CleanMaker, ImageMaker, JointGoals, JointMaker, JointOptions, Selfcal, SelfcalOptions, Start, apply, on_channels,
    schedule, selfcal,
};
use crate::imaging::{Imager, ImagingOptions};
use crate::simulate::SkyModel;
use cittert_arrays::{SkyGrid, VisibilityHeader, VisibilitySet, VisibilitySource};
use cittert_formats::fits::{ImageOptions, write_image};
use clap::{Args, ValueEnum};
use maker::{KeepingMaker, Seconds};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Options of `selfcal`.
#[derive(Debug, Args)]
pub struct SelfcalArgs {
    /// Visibilities.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// What the first gains are solved against.
    #[arg(long, value_enum, default_value_t = StartName::Data, conflicts_with = "model")]
    start: StartName,
    /// A model to solve the first gains against: FITS image (K, Jy/pixel or Jy/beam) or source list (CSV).
    #[arg(long, value_name = "FITS|CSV")]
    model: Option<PathBuf>,
    /// Rounds at most; with amplitudes the last third of them, before that phases alone.
    #[arg(long, value_name = "N", default_value_t = 10)]
    rounds: usize,
    /// Begin with solutions four and two times as long, for weak sources and slow errors.
    #[arg(long)]
    shrink: bool,
    /// A round counts as better when the dynamic range grows by this part.
    #[arg(long, value_name = "X", default_value_t = 0.01)]
    improvement: f64,
    /// Rounds that are not better after which a stage ends.
    #[arg(long, value_name = "N", default_value_t = 1)]
    patience: usize,
    #[command(flatten)]
    solve: SolveArgs,
    /// The gain between the middles of solution intervals.
    #[arg(long, value_enum, default_value_t = InterpName::Nearest)]
    interp: InterpName,
    /// Let data without a gain pass as they are instead of flagging them.
    #[arg(long)]
    keep_unsolved: bool,
    #[command(flatten)]
    imaging: ImagingArgs,
    #[command(flatten)]
    clean: CleanArgs,
    /// Prior of --deconvolver mem, which solves image and gains together: a temperature (250K), a flux density a pixel or a FITS image
    /// [default: flat, made of the data: see the book].
    #[arg(long, value_name = "PRIOR", help_heading = "CLEAN")]
    prior: Option<String>,
    #[command(flatten)]
    out: OutputArgs,
}

impl SelfcalArgs {
    /// True where image and gains are solved together.
    fn joint(&self) -> bool {
        self.clean.algorithm() == MEM
    }
}

/// What the first gains are solved against.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum StartName {
    /// A point at the phase centre.
    Point,
    /// The first image of the data as they are.
    Data,
}

/// The deconvolver that solves image and gains together.
const MEM: &str = "mem";
const IMAGES: [&str; 5] = ["-psf.fits", "-dirty.fits", "-model.fits", "-residual.fits", "-image.fits"];
const OTHERS: [&str; 4] = [".uvh5", ".calh5", "-rounds.jsonl", "-components.csv"];
/// Bytes of a set that is kept in memory at most.
const MEMORY: usize = 2 << 30;
/// Visibility, weight, number of samples and flag.
const BYTES_PER_SAMPLE: usize = 17;
/// More rounds than these are a slip of the keyboard.
const MOST_ROUNDS: usize = 1000;

fn round_file(round: usize, ending: &str) -> String {
    format!("-round{round}{ending}")
}

/// Self-calibrate and write PREFIX.uvh5, PREFIX.calh5, the images of the best round, and gains, image and metrics of each.
///
/// # Errors
/// Anything wrong with the file, the options or the disk; data that allow no solution.
pub fn run(args: &SelfcalArgs, context: &Context) -> Result<Outcome> {
    let begun = Instant::now();
    check(args)?;
    let what = format!("self-calibrating {}", args.input.display());
    let mut source = in_memory(cittert_formats::open_visibilities(&args.input)?).context(&what)?;
    let header = source.header().clone();
    let options = options(args, source.as_ref()).context(&what)?;
    let (imaging, grid) = imaging(args, source.as_mut(), context).context(&what)?;
    let unlike = (imaging.epsilon, imaging.w_term);
    let (inner, algorithm) = image_maker(args, imaging, (&grid, &header), &options)?;
    let mut maker = KeepingMaker::new(inner, args.start == StartName::Data && args.model.is_none(), |round, image| {
        let mut image = image.clone();
        image.history.push(context.history());
        let path = args.out.suffixed(&round_file(round, "-image.fits"));
        let written = write_image(&path, &image, ImageOptions { overwrite: args.out.overwrite, ..ImageOptions::default() });
        written.map_err(|e| crate::ChainError::Other(Box::new(e)))
    });
    let sky: SkyModel;
    let mut given;
    let start = match (&args.model, args.start) {
        (Some(path), _) => {
            sky = load_model(path, &header, context)?;
            given = SkyPrediction::new(&header, &sky, unlike, &context.console).context(format!("the model {}", path.display()))?;
            Start::Model(&mut given)
        }
        (None, StartName::Point) => Start::Point { flux: None, l: 0.0, m: 0.0 },
        (None, StartName::Data) => Start::Data,
    };
    // An image that belongs to no round: made before a failure, or the final one, which has its own name.
    let remove = |round| {
        let _ = std::fs::remove_file(args.out.suffixed(&round_file(round, "-image.fits")));
    };
    let before = old_rounds(args)?;
    let looped = selfcal(source.as_mut(), &mut maker, start, &options, &context.console);
    if looped.is_err() {
        maker.forget_from(0, remove);
    }
    let mut result = looped.context(&what)?;
    let mut seconds = Seconds { imaging: maker.seconds, ..Seconds::default() };
    seconds.solving = begun.elapsed().as_secs_f64() - seconds.imaging;
    maker.forget_from(result.rounds.len() + 1, remove);
    let writing = Instant::now();
    let counts = save_data(args, source.as_mut(), &mut result, &options.apply, context).context(&what)?;
    let rounds_from = usize::from(result.before.is_none());
    for path in before.iter().filter(|p| !(rounds_from..=result.rounds.len()).any(|k| is_of_round(args, p, k))) {
        // An earlier run had more rounds: they are not of this one. An image of no round had such a name and is gone already.
        match std::fs::remove_file(path) {
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => {
                return Err(e).context(format!("{}: cannot remove what an earlier run left", path.display()));
            }
            _ => {}
        }
    }
    let together = maker.joint();
    let Some(products) = maker.into_products() else {
        return Err(Failure::message(format!("{what}: no image was made")));
    };
    let rounds = report::rounds(&result);
    let lines: Vec<String> = rounds.iter().map(ToString::to_string).collect();
    args.out.write(&args.out.suffixed("-rounds.jsonl"), (lines.join("\n") + "\n").as_bytes())?;
    let components = super::clean::components(&products.components, header.unit);
    args.out.write(&args.out.suffixed("-components.csv"), components.as_bytes())?;
    let mut json = report::json(args.out.output.as_path(), &result, &products, rounds);
    (json["algorithm"], json["n_flagged_for_want_of_a_gain"]) = (algorithm.into(), counts.flagged.into());
    if let Some(together) = together {
        json["joint"] = together;
    }
    let text = report::text(&result, &products);
    let mut written: Vec<PathBuf> = OTHERS.iter().map(|s| args.out.suffixed(s)).collect();
    for (suffix, mut image) in IMAGES.iter().zip([products.psf, products.dirty, products.model, products.residual, products.restored]) {
        let path = args.out.suffixed(suffix);
        image.history.push(context.history());
        write_image(&path, &image, ImageOptions { overwrite: args.out.overwrite, ..ImageOptions::default() })?;
        written.push(path);
    }
    seconds.writing = writing.elapsed().as_secs_f64();
    json["seconds"] = seconds.json(begun.elapsed().as_secs_f64());
    Ok(written.into_iter().fold(Outcome::new(json, text), |o, path| o.wrote(path)))
}

/// What makes the model: CLEAN, or maximum entropy with gains of its own; and its name.
fn image_maker(
    args: &SelfcalArgs,
    imaging: ImagingOptions,
    (grid, header): (&SkyGrid, &VisibilityHeader),
    options: &SelfcalOptions,
) -> Result<(Box<dyn ImageMaker>, &'static str)> {
    if !args.joint() {
        if args.prior.is_some() {
            return Err(Failure::usage("--prior is for --deconvolver mem"));
        }
        let clean = args.clean.options(grid)?;
        let name = clean.algorithm.name;
        return Ok((Box::new(CleanMaker::new(imaging, clean)), name));
    }
    let prior = prior(args.prior.as_deref(), grid, (header.unit, header.spectrum.mean_hz()))?;
    let solve = options.solve.clone();
    let joint = JointOptions { solve, prior, mask: args.clean.mask(grid)?, goals: JointGoals::default() };
    Ok((Box::new(JointMaker::new(imaging, joint)), MEM))
}

/// The set in memory, where it fits: every round reads it twice.
fn in_memory(mut source: Box<dyn VisibilitySource>) -> Result<Box<dyn VisibilitySource>> {
    let header = source.header().clone();
    let samples = source.n_rows().saturating_mul(header.spectrum.n_chan()).saturating_mul(header.polarizations.len());
    if samples.saturating_mul(BYTES_PER_SAMPLE) > MEMORY {
        return Ok(source);
    }
    let data = source.read_rows(0..source.n_rows())?;
    Ok(Box::new(VisibilitySet::new(header, data)?))
}

fn is_of_round(args: &SelfcalArgs, path: &Path, round: usize) -> bool {
    [".calh5", "-image.fits"].iter().any(|e| args.out.suffixed(&round_file(round, e)).file_name() == path.file_name())
}

/// Gains and images of any round under this prefix.
fn old_rounds(args: &SelfcalArgs) -> Result<Vec<PathBuf>> {
    let prefix = args.out.suffixed("-round");
    let folder = prefix.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let Some(start) = prefix.file_name().map(|n| n.to_string_lossy().into_owned()) else { return Ok(Vec::new()) };
    let is_round = |name: &str| {
        let number = name.strip_prefix(&start).and_then(|n| n.strip_suffix(".calh5").or_else(|| n.strip_suffix("-image.fits")));
        number.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
    };
    let entries = std::fs::read_dir(folder).context(format!("{}", folder.display()))?;
    Ok(entries.flatten().filter(|e| is_round(&e.file_name().to_string_lossy())).map(|e| e.path()).collect())
}

/// Refuse at once what would be refused after hours.
fn check(args: &SelfcalArgs) -> Result<()> {
    if !(1..=MOST_ROUNDS).contains(&args.rounds) {
        return Err(Failure::usage(format!("--rounds is {}, expected 1 to {MOST_ROUNDS}", args.rounds)));
    }
    if !(args.improvement.is_finite() && args.improvement >= 0.0) {
        return Err(Failure::usage(format!("--improvement is {}, expected a number of at least 0", args.improvement)));
    }
    if args.patience == 0 {
        return Err(Failure::usage("--patience is 0, expected at least 1"));
    }
    let (data, input) = (args.out.suffixed(".uvh5").canonicalize(), args.input.canonicalize());
    if matches!((&data, &input), (Ok(a), Ok(b)) if a == b) {
        return Err(Failure::usage(format!("{}: the calibrated data would replace the input; use another -o", args.input.display())));
    }
    args.out.check_all(&IMAGES)?;
    args.out.check_all(&OTHERS)?;
    old_rounds(args)?.iter().try_for_each(|path| args.out.check(path))
}

fn options(args: &SelfcalArgs, source: &dyn VisibilitySource) -> Result<SelfcalOptions> {
    let solve = args.solve.options(&source.header().layout)?;
    let interpolation = args.interp.into();
    Ok(SelfcalOptions {
        // A joint solution is one round: there is nothing to take turns with.
        schedule: schedule(solve.mode, solve.solint, if args.joint() { 1 } else { args.rounds }, args.shrink),
        solve,
        apply: ApplyOptions { interpolation, flag_unsolved: !args.keep_unsolved, ..ApplyOptions::default() },
        improvement: args.improvement,
        patience: args.patience,
        tuning: crate::calibrate::SelfcalTuning::default(),
    })
}

/// Imaging options with a size and cell that hold for every round, and the grid they make.
fn imaging(args: &SelfcalArgs, source: &mut dyn VisibilitySource, context: &Context) -> Result<(ImagingOptions, SkyGrid)> {
    let mut options = args.imaging.options()?;
    let grid = match (options.size, options.cell_rad, source.header().phase_centers.first()) {
        (Some((n_l, n_m)), Some(cell_rad), Some(center)) => SkyGrid::new(n_l, n_m, cell_rad, SkyGrid::frame_of(center))?,
        // The coverage chooses, and says so once.
        _ => Imager::new(source, options.clone(), &context.console)?.grid().clone(),
    };
    (options.size, options.cell_rad) = (Some((grid.n_l, grid.n_m)), Some(grid.cell_rad));
    Ok((options, grid))
}

/// The gains of every round and of the best, and the calibrated set.
fn save_data(
    args: &SelfcalArgs,
    source: &mut dyn VisibilitySource,
    result: &mut Selfcal,
    options: &ApplyOptions,
    context: &Context,
) -> Result<crate::calibrate::ApplyCounts> {
    for (k, round) in result.rounds.iter_mut().enumerate() {
        round.gains.history.push(context.history());
        let path = args.out.suffixed(&round_file(k + 1, ".calh5"));
        cittert_formats::calh5::write_gains(&path, &on_channels(&round.gains, &source.header().spectrum), args.out.overwrite)?;
    }
    let gains = &result.best().gains;
    let on_all = on_channels(gains, &source.header().spectrum);
    cittert_formats::calh5::write_gains(&args.out.suffixed(".calh5"), &on_all, args.out.overwrite)?;
    let path = args.out.suffixed(".uvh5");
    let mut header = source.header().clone();
    header.history.push(context.history());
    let created = cittert_formats::create_visibilities(&path, &header, args.out.overwrite)?;
    created.notes.iter().for_each(|n| context.console.note(n));
    let mut sink = created.sink;
    let counts = apply(source, gains, *options, sink.as_mut(), &context.console)?;
    sink.finish().context(format!("{}", path.display()))?;
    Ok(counts)
}
