//! `selfcal`: rounds of imaging, deconvolving, predicting and solving for antenna gains.

mod after;
mod feeds;
mod forecast;
mod images;
mod maker;
mod pilot;
mod pointing;
mod report;

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use super::options::{OutputArgs, SetArgs, SetFiles, loaded, no_range, prior_file, prior_image};
use super::planned::check_room_for_set;
use super::predict::load_model;
use super::ranks;
use super::verdict::{self, Judged};
use crate::calibrate::{
    Accuracy, Beginning, Calibrated, CalibratedSource, Candidate, CandidateOptions, FeedTerm, GainMode, ImageMaker, LeakageSolution,
    PointingSolveOptions, RoundOptions, ScaleFrom, SkyPrediction, SolveOptions, StartFrom, amplitudes_from_power, apply, calibrate,
    candidates, spread_channels,
};
use crate::deconvolve::{Algorithm, CleanOptions};
use crate::imaging::{CleanProducts, Imager, ImagingOptions};
use crate::mem::{Prior, PriorChoice};
use crate::memory::MemoryBudget;
use crate::simulate::SkyModel;
use crate::verdict::{ImageFacts, not_determined, of_gains};
use cittert_arrays::{
    GainTable, Part, PartsSink, SkyGrid, SpectralWindow, VisibilityHeader, VisibilitySet, VisibilitySink, VisibilitySource,
};
use cittert_formats::atomic::{Drafts, beside, remove_at_the_end};
use clap::Args;
use images::{RoundImages, round_file};
use maker::{Keep, KeepingMaker, Seconds};
use std::cell::{Cell, RefCell};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Options of `selfcal`.
#[derive(Debug, Args)]
pub struct SelfcalArgs {
    #[command(flatten)]
    input: SetArgs,
    #[command(flatten)]
    rounds: RoundOptions,
    #[command(flatten)]
    solve: SolveOptions,
    #[command(flatten)]
    pointing: PointingSolveOptions,
    #[command(flatten)]
    imaging: ImagingOptions,
    #[command(flatten)]
    clean: CleanOptions,
    /// Prior of deconvolver mem, which solves image and gains together: a temperature (250K), a flux density in a pixel or a FITS image
    /// [default: flat, made from the data as the book describes].
    #[arg(long, value_name = "PRIOR", help_heading = "CLEAN")]
    prior: Option<PriorChoice>,
    /// What is solved for after the gains, in sets of four products: leakage, cross-phase or both. The model is that of --model, or clean images of
    /// I, Q, U and V.
    #[arg(
        long = "solve",
        id = "solve-feeds",
        value_name = "TERM",
        value_enum,
        hide_possible_values = true,
        value_delimiter = ',',
        help_heading = "Gains"
    )]
    feed_terms: Vec<FeedTerm>,
    #[command(flatten)]
    out: OutputArgs,
}

const IMAGES: [&str; 5] = ["-psf.fits", "-dirty.fits", "-model.fits", "-residual.fits", "-image.fits"];
/// Rounds whose files are claimed before the work. Later rounds are rare.
const MOST_CLAIMED: usize = 50;
const OTHERS: [&str; 4] = [".uvh5", ".calh5", "-rounds.jsonl", "-components.csv"];
/// Size in bytes of a visibility, its weight, its number of samples and its flag.
const BYTES_PER_SAMPLE: usize = 17;

/// Self-calibrate and write PREFIX.uvh5, PREFIX.calh5, the images of the best round, and gains, image and metrics of each.
///
/// # Errors
/// The file or an option is wrong, the data allow no solution, or an error of the file system.
pub fn run(args: &SelfcalArgs, context: &Context) -> Result<Outcome> {
    let begun = Instant::now();
    let input = args.input.files()?;
    check(args, &input)?;
    no_range(&args.imaging, "self-calibration images by Fourier transforms; focus the set first (cittert focus), which keeps its gains")?;
    let what = format!("self-calibrating {input}");
    let mut source = in_memory(input.open(context)?).context(&what)?;
    let header = source.header().clone();
    check_solve(args, source.as_ref()).context(&what)?;
    check_room_for_set(source.as_ref(), &args.out.suffixed(".uvh5"))?;
    let (imaging, grid) = imaging(args, source.as_mut(), context).context(&what)?;
    let accuracy = Accuracy { epsilon: imaging.epsilon, no_w: imaging.no_w };
    let drafts = (!ranks::is_silent()).then(|| Drafts::beside(&args.out.suffixed("-rounds.jsonl"))).transpose()?;
    let images = RoundImages { out: &args.out, drafts, history: context.history(), seconds: Cell::default(), kept: RefCell::default() };
    // Autocorrelations tell the amplitudes, so that only phases are left.
    let amplitudes = match args.solve.mode {
        GainMode::AmpPhase if args.rounds.model.is_none() => amplitudes_from_power(source.as_mut(), &args.solve).context(&what)?,
        _ => None,
    };
    amplitudes.iter().for_each(|a| a.say(&context.console));
    let solve = SolveOptions { mode: if amplitudes.is_some() { GainMode::Phase } else { args.solve.mode }, ..args.solve.clone() };
    let ways = ways(args, (imaging, solve), (&grid, &header), &images)?;
    let sky: SkyModel;
    let mut given;
    let beginning = match (&args.rounds.model, args.rounds.start) {
        (Some(path), _) => {
            sky = load_model(path, &header, context)?;
            given = SkyPrediction::new(&header, &sky, accuracy, &context.console).context(format!("the model {}", path.display()))?;
            Beginning::Model(&mut given)
        }
        (None, StartFrom::Point) => Beginning::Point,
        (None, StartFrom::Data) => Beginning::Data,
        (None, StartFrom::Truth) => return Err(Failure::usage("--start truth: only a study has the error-free visibilities")),
    };
    let before = old_rounds(args)?;
    let solved = match &amplitudes {
        Some(amplitudes) => {
            let mut powered = CalibratedSource::new(source.as_mut(), &amplitudes.gains, args.rounds.apply()).context(&what)?;
            calibrate(&mut powered, &ways, beginning, &args.rounds.judge(), &context.console)
        }
        None => calibrate(source.as_mut(), &ways, beginning, &args.rounds.judge(), &context.console),
    };
    let (mut result, maker) = solved.context(&what)?;
    if let Some(amplitudes) = &amplitudes {
        amplitudes.multiply(&mut result.gains);
        result.rounds.rounds.iter_mut().for_each(|r| amplitudes.multiply(&mut r.gains));
    }
    let mut seconds = Seconds { imaging: images.seconds.get(), ..Seconds::default() };
    seconds.solving = begun.elapsed().as_secs_f64() - seconds.imaging;
    images.choose(result.best, result.rounds.rounds.len())?;
    let between = between_feeds(args, source.as_mut(), &mut result, &grid, context).context(&what)?;
    let writing = Instant::now();
    result.rounds.rounds.iter_mut().for_each(|round| round.gains.history.push(context.history()));
    result.gains.history.push(context.history());
    let rounds_from = usize::from(result.rounds.before.is_none());
    for path in before.iter().filter(|p| !(rounds_from..=result.rounds.rounds.len()).any(|k| is_of_round(args, p, k))) {
        // Files of an earlier run with more rounds do not belong to this run.
        if !ranks::is_silent() {
            remove_at_the_end(path)?;
        }
    }
    let together = maker::joint(maker.as_ref());
    let Some(products) = maker::products(maker.as_ref()) else {
        return Err(Failure::message(format!("{what}: no image was made")));
    };
    let rounds = report::rounds(&result.rounds);
    let lines: Vec<String> = rounds.iter().map(ToString::to_string).collect();
    args.out.write(&args.out.suffixed("-rounds.jsonl"), (lines.join("\n") + "\n").as_bytes())?;
    let components = super::clean::components(&products.components, header.unit);
    args.out.write(&args.out.suffixed("-components.csv"), components.as_bytes())?;
    let data = || -> Result<_> {
        let counts = save_data(args, source.as_mut(), &result.gains, context)?;
        Ok((counts, judged(args, (source.as_mut(), &result), &products, context)?))
    };
    // One thread writes the files of gains while the others work on the data.
    let (of_data, saved) = beside(data, || save_gains(args, &result, &header.spectrum));
    saved.context(&what)?;
    let (counts, judged) = of_data.context(&what)?;
    let mut json = report::json(args.out.output.as_path(), &result, &products, rounds);
    json["n_flagged_for_want_of_a_gain"] = counts.flagged.into();
    if let Some(together) = together {
        json["joint"] = together;
    }
    let turned =
        pointing::solve((&args.pointing, &args.rounds, &args.out), (source.as_mut(), &result), &products, context).context(&what)?;
    if let Some(turned) = &turned {
        json["pointing"] = turned.json.clone();
    }
    let no_scale = amplitudes.as_ref().is_some_and(|a| a.scale_from == ScaleFrom::MeanGain);
    let amplitudes_solved = result.rounds.rounds.iter().any(|r| r.plan.mode == GainMode::AmpPhase);
    let free = not_determined(args.rounds.model.is_some(), amplitudes_solved || no_scale);
    json["amplitudes"] = match &amplitudes {
        Some(a) => serde_json::json!({ "from": "autocorrelations", "scale_from": a.scale_from.name(), "scale_sigma": a.scale_sigma }),
        None => serde_json::json!({ "from": "visibilities" }),
    };
    json["not_determined"] = free.clone().into();
    let between = between.map(|found| feeds::json(&found, &args.feed_terms));
    let feeds_line = between.as_ref().map_or(String::new(), feeds::line);
    if let Some(found) = between {
        json["feeds"] = found;
    }
    let verdict = verdict::report(&judged, "the image explains the calibrated visibilities", &mut json, context);
    let pointing_text = turned.as_ref().map_or(String::new(), |t| format!("\npointing      {}", t.text));
    let text = format!("{}{pointing_text}\n{feeds_line}free          {}\n{verdict}", report::text(&result, &products), free.join("; "));
    let mut written: Vec<PathBuf> = OTHERS.iter().map(|s| args.out.suffixed(s)).chain(turned.map(|t| t.path)).collect();
    for (suffix, mut image) in IMAGES.iter().zip([products.psf, products.dirty, products.model, products.residual, products.restored]) {
        let path = args.out.suffixed(suffix);
        args.out.image(&path, &mut image, context)?;
        written.push(path);
    }
    seconds.writing = writing.elapsed().as_secs_f64();
    json["seconds"] = seconds.json(begun.elapsed().as_secs_f64());
    Ok(written.into_iter().fold(Outcome::new(json, text), |o, path| o.wrote(path)))
}

/// Solve the terms between the feeds, if any are asked for, and put them into the gains.
fn between_feeds(
    args: &SelfcalArgs,
    source: &mut dyn VisibilitySource,
    result: &mut Calibrated,
    grid: &SkyGrid,
    context: &Context,
) -> Result<Option<LeakageSolution>> {
    if args.feed_terms.is_empty() {
        return Ok(None);
    }
    let sky = args.rounds.model.as_ref().map(|path| load_model(path, source.header(), context)).transpose()?;
    let mut clean = loaded(&args.clean, grid)?;
    if matches!(clean.algorithm, Algorithm::Mem) {
        // Q, U and V are negative in places, which maximum entropy does not allow.
        clean.algorithm = Algorithm::Auto;
    }
    let (table, found) = feeds::solve(
        (&args.feed_terms, args.rounds.apply(), &args.solve),
        (source, sky.as_ref()),
        &result.gains,
        (&args.imaging.on_grid(grid), &clean),
        context,
    )?;
    result.gains = table;
    Ok(Some(found))
}

/// What is doubtful about the gains, and about the image of the calibrated data.
fn judged(
    args: &SelfcalArgs,
    (source, result): (&mut dyn VisibilitySource, &Calibrated),
    products: &CleanProducts,
    context: &Context,
) -> Result<Judged> {
    let mut calibrated = CalibratedSource::new(source, &result.gains, args.rounds.apply())?;
    let mut judged = verdict::of_model(&mut calibrated, (products.model.clone(), &args.imaging), &ImageFacts::from(products), context)?;
    if let Some(finding) = report::doubt(result) {
        judged.findings.insert(0, finding);
    }
    judged.findings.extend(of_gains(&result.rounds.best().report));
    Ok(judged)
}

/// What the ways to self-calibrate share.
fn candidate_options(
    args: &SelfcalArgs,
    (imaging, solve): (ImagingOptions, SolveOptions),
    (grid, header): (&SkyGrid, &VisibilityHeader),
) -> Result<CandidateOptions> {
    let clean = loaded(&args.clean, grid)?;
    if args.prior.is_some() && !matches!(clean.algorithm, Algorithm::Mem | Algorithm::Auto) {
        return Err(Failure::usage("--prior is for --deconvolver mem"));
    }
    let prior = match &args.prior {
        Some(choice) => choice.prior(prior_image(Some(choice))?, grid, header.unit, header.spectrum.mean_hz())?,
        None => Prior::Auto,
    };
    let mut of = CandidateOptions::new(imaging, clean, solve, args.rounds.clone(), header.unit);
    of.joint.prior = prior;
    Ok(of)
}

/// The ways to self-calibrate. Their makers pass the image of each round to `images`.
fn ways<'a>(
    args: &SelfcalArgs,
    (imaging, solve): (ImagingOptions, SolveOptions),
    (grid, header): (&SkyGrid, &VisibilityHeader),
    images: &'a RoundImages<'a>,
) -> Result<Vec<Candidate<'a>>> {
    let of = candidate_options(args, (imaging, solve), (grid, header))?;
    let keeping = |way: Candidate<'a>| {
        let (name, make) = (way.name, way.make);
        let keep: &'a dyn Keep = images;
        let make = move || Box::new(KeepingMaker { inner: make(), candidate: name, round: None, keep }) as Box<dyn ImageMaker + 'a>;
        Candidate { name, options: way.options, make: Box::new(make) }
    };
    Ok(candidates(&of)?.into_iter().map(keeping).collect())
}

/// The set in memory, if it fits, because every round reads it twice.
fn in_memory(mut source: Box<dyn VisibilitySource>) -> Result<Box<dyn VisibilitySource>> {
    let header = source.header().clone();
    let samples = source.n_rows().saturating_mul(header.spectrum.n_chan()).saturating_mul(header.polarizations.len());
    if samples.saturating_mul(BYTES_PER_SAMPLE) > MemoryBudget::default().kept_visibilities() {
        return Ok(source);
    }
    let data = source.read_rows(0..source.n_rows())?;
    let set = Box::new(VisibilitySet::new(header, data)?);
    let ranks = source.ranks();
    Ok(if ranks.size() > 1 { Box::new(Part::own(set, ranks)) } else { set })
}

fn is_of_round(args: &SelfcalArgs, path: &Path, round: usize) -> bool {
    [".calh5", "-image.fits"].iter().any(|e| args.out.suffixed(&round_file(round, e)).file_name() == path.file_name())
}

/// Files of gains and images of any round with this prefix.
fn old_rounds(args: &SelfcalArgs) -> Result<Vec<PathBuf>> {
    let prefix = args.out.suffixed("-round");
    let folder = prefix.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let Some(start) = prefix.file_name().map(|n| n.to_string_lossy().into_owned()) else { return Ok(Vec::new()) };
    let is_round = |name: &str| {
        let number = name.strip_prefix(&start).and_then(|n| n.strip_suffix(".calh5").or_else(|| n.strip_suffix("-image.fits")));
        number.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
    };
    let entries = std::fs::read_dir(folder).context(format!("{}", folder.display()))?;
    Ok(entries.flatten().map(|e| e.file_name()).filter(|n| is_round(&n.to_string_lossy())).map(|n| prefix.with_file_name(n)).collect())
}

/// Check the options and outputs at once instead of after the calibration.
fn check(args: &SelfcalArgs, input: &SetFiles) -> Result<()> {
    if !args.feed_terms.is_empty() || args.pointing.pointing {
        ranks::refuse_several("selfcal then solves for gains only. Leave out --solve and --pointing, or start it without mpirun")?;
    }
    args.rounds.check().map_err(Failure::call)?;
    if args.feed_terms.contains(&FeedTerm::CrossPhase) && args.rounds.model.is_none() {
        // Images of the data turn their U and V, or Q and U, with this phase.
        return Err(Failure::usage(
            "--solve cross-phase needs a polarised model, as images of the data themselves do not tell the phase: give --model",
        ));
    }
    let mut outputs = args.out.all_suffixed(&IMAGES);
    outputs.extend(args.out.all_suffixed(&OTHERS));
    if args.pointing.pointing {
        outputs.push(args.out.suffixed(pointing::SUFFIX));
    }
    outputs.extend(old_rounds(args)?);
    // Each round may have a file of gains and an image.
    let rounds = (0..=args.rounds.rounds.min(MOST_CLAIMED)).flat_map(|k| [round_file(k, ".calh5"), round_file(k, "-image.fits")]);
    outputs.extend(rounds.map(|suffix| args.out.suffixed(&suffix)));
    outputs.sort();
    outputs.dedup();
    let prior = args.prior.as_ref().and_then(prior_file);
    args.out.claim(&outputs, input.all().iter().chain(&args.clean.mask).chain(&args.rounds.model).chain(prior))
}

fn check_solve(args: &SelfcalArgs, source: &dyn VisibilitySource) -> Result<()> {
    let layout = &source.header().layout;
    args.solve.check(layout.n_ant())?;
    if let Some(names) = &args.solve.refant {
        names.indices(layout)?;
    }
    Ok(())
}

/// Imaging options with the same size and cell for every round, and the grid that follows from them.
fn imaging(args: &SelfcalArgs, source: &mut dyn VisibilitySource, context: &Context) -> Result<(ImagingOptions, SkyGrid)> {
    let options = args.imaging.clone();
    // The imager notes which data it cannot use, and the size and cell if it chooses them. The rounds do not repeat these notes.
    let grid = Imager::grid_of(source, &options, &context.console)?;
    Ok((options.on_grid(&grid), grid))
}

/// Write the gains of every round and of the best.
fn save_gains(args: &SelfcalArgs, result: &Calibrated, spectrum: &SpectralWindow) -> Result<()> {
    if ranks::is_silent() {
        return Ok(());
    }
    let of_rounds = result.rounds.rounds.iter().enumerate().map(|(k, round)| (round_file(k + 1, ".calh5"), &round.gains));
    for (suffix, gains) in of_rounds.chain([(".calh5".into(), &result.gains)]) {
        let (channels, from) = spread_channels(gains, spectrum);
        cittert_formats::calh5::write_gains_on(&args.out.suffixed(&suffix), gains, (&channels, &from), args.out.overwrite)?;
    }
    Ok(())
}

/// Write the calibrated set.
fn save_data(
    args: &SelfcalArgs,
    source: &mut dyn VisibilitySource,
    gains: &GainTable,
    context: &Context,
) -> Result<crate::calibrate::ApplyCounts> {
    let path = args.out.suffixed(".uvh5");
    let mut header = source.header().clone();
    header.history.push(context.history());
    let processes = source.ranks();
    let create = || cittert_formats::create_visibilities(&path, &header, args.out.overwrite);
    let created = (!ranks::is_silent()).then(create).transpose()?;
    created.iter().flat_map(|c| &c.notes).for_each(|n| context.console.note(n));
    let mut sink = Box::new(PartsSink::new(processes.clone(), created.map(|c| c.sink as Box<dyn VisibilitySink>)));
    let mut counts = apply(source, gains, args.rounds.apply(), sink.as_mut(), &context.console)?;
    sink.finish().context(format!("{}", path.display()))?;
    let mut all = [counts.applied, counts.flagged].map(|n| n as f64);
    processes.sum(&mut all);
    [counts.applied, counts.flagged] = all.map(|n| n as u64);
    Ok(counts)
}
