//! `corrupt`: put known errors into visibilities, and keep the true gains.

use super::airs::Airs;
use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use super::forecast::{Grown, Passing, Plan, Planner, Told, grown};
use super::options::{OutputArgs, SceneArgs, SetArgs};
use super::planned::check_room_for_set;
use super::scene_errors::{TruthFiles, band_files, read_bands};
use super::sections::Section;
use crate::calibrate::spread_channels;
use crate::corrupt::{CorruptOptions, Error, ErrorOptions, Truth, corrupt_with, corrupted_header};
use crate::cost::{self, Gained, Stage};
use crate::progress::Silent;
use crate::simulate::{SceneOptions, SkyModel};
use cittert_arrays::{GainTable, UvCoverage, VisUnit, VisibilityBlock, VisibilityHeader, VisibilitySet, VisibilitySource};
use clap::Args;
use serde::Deserialize;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Options of `corrupt`.
#[derive(Debug, Args)]
pub struct CorruptArgs {
    #[command(flatten)]
    input: SetArgs,
    /// File of the true gains [default: the output with the extension .calh5].
    #[arg(long, value_name = "CALH5")]
    gains: Option<PathBuf>,
    /// Errors from a file: tables [[error]] with the names of these options as keys. The errors of the other options are added.
    #[arg(long, value_name = "TOML")]
    config: Option<PathBuf>,
    #[command(flatten)]
    errors: ErrorOptions,
    /// The scene that was observed, or a model image, for errors that change what each baseline sees of it: pointing, width and band.
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
    #[command(flatten)]
    how: SceneOptions,
    #[command(flatten)]
    out: OutputArgs,
}

/// The file of `--config`.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
struct Config {
    seed: Option<u64>,
    per_feed: bool,
    #[serde(rename = "error")]
    errors: Vec<Section<ErrorOptions>>,
}

impl Config {
    fn read(path: &Path) -> Result<Self> {
        let text = cittert_formats::read_text(path)?;
        super::numbers::read(&text, path)
    }
}

fn options(args: &CorruptArgs, unit: VisUnit) -> Result<CorruptOptions> {
    let config = args.config.as_deref().map_or(Ok(Config::default()), Config::read)?;
    let mut errors = Vec::new();
    let file = args.config.as_ref().map(|path| path.display().to_string()).unwrap_or_default();
    for section in &config.errors {
        let of_file = section.options.errors(unit, &Airs).context(&file)?;
        of_file.iter().try_for_each(|e| e.model().check()).context(&file)?;
        errors.extend(of_file);
    }
    errors.extend(args.errors.errors(unit, &Airs)?);
    if errors.is_empty() {
        let kinds: Vec<&str> = Error::TABLE.iter().map(|t| t.0).collect();
        let nothing = args.config.as_ref().map_or(String::new(), |_| format!("{file} has no table [[error]], and "));
        return Err(Failure::usage(format!(
            "{nothing}no error to inject was given: give one such as --phase-rms 30deg, or --config with tables [[error]]. The kinds are {}",
            kinds.join(", ")
        )));
    }
    Ok(CorruptOptions { seed: args.errors.seed.or(config.seed).unwrap_or(1), errors, per_feed: config.per_feed || args.errors.per_feed })
}

/// Put errors into a set, and write the set and the true gains.
///
/// # Errors
/// The file or an option is wrong, or an error of the file system.
pub fn run(args: &CorruptArgs, context: &Context) -> Result<Outcome> {
    let path = &args.out.output;
    let gains_path = args.gains.clone().unwrap_or_else(|| path.with_extension("calh5"));
    let input = args.input.files()?;
    args.out.claim([path, &gains_path], input.all().iter().chain(&args.config).chain(&args.scene))?;
    let mut source = input.open(context)?;
    check_room_for_set(source.as_ref(), path)?;
    let mut options = options(args, source.header().unit)?;
    let files = TruthFiles::beside(&gains_path);
    let reads = input.all().to_vec().into_iter().chain(args.config.clone()).chain(args.scene.clone()).chain(band_files(&options.errors));
    args.out.claim([path.as_path(), &gains_path].into_iter().chain(files.of(&options.errors)), reads)?;
    read_bands(&mut options.errors, Path::new(""))?;
    let scene = scene(args, &options, source.header(), context)?;
    let mut header = corrupted_header(source.header(), &options);
    header.history.push(context.history());
    let lost = input.note_losses(path, source.header(), context)?;
    let mut sink = args.out.visibilities(&header, context)?;
    let with = args.config.as_ref().map_or(String::new(), |path| format!(" with the errors of {}", path.display()));
    let what = format!("corrupting {input}{with}");
    let truth = corrupt_with(source.as_mut(), sink.as_mut(), &options, scene.as_ref(), &context.console);
    let Truth { gains: mut table, scene: truth } = truth.context(&what)?;
    table.history.push(context.history());
    // The true gains are written first: corrupted data without them would be useless.
    let channels = spread_channels(&table, &source.header().spectrum);
    cittert_formats::calh5::write_gains_on(&gains_path, &table, (&channels.0, &channels.1), args.out.overwrite)?;
    sink.finish().context(format!("{}", path.display()))?;
    let (rms_phase, rms_amplitude, flagged) = sizes(&table);
    let json = json!({
        "output": path, "gains": gains_path, "seed": options.seed, "per_feed": options.per_feed, "n_blts": source.n_rows(),
        "errors": serde_json::to_value(&options.errors)?, "n_intervals": table.time_jd.len(), "n_gains": table.gains.len(),
        "n_gains_flagged": flagged, "rms_phase_rad": rms_phase, "rms_amplitude": rms_amplitude, "lost": lost,
    });
    let names: Vec<&str> = options.errors.iter().map(Error::name).collect();
    let text = format!(
        "{}: {} rows with {}\n{}: {} gains, phases of {:.4} rad rms, amplitudes off by {:.4} rms",
        path.display(),
        source.n_rows(),
        names.join(", "),
        gains_path.display(),
        table.gains.len(),
        rms_phase,
        rms_amplitude
    );
    files.write(&truth, &table.layout, args.out.overwrite, Outcome::new(json, text).wrote(path).wrote(gains_path))
}

/// The scene, where an error needs it.
fn scene(args: &CorruptArgs, options: &CorruptOptions, header: &VisibilityHeader, context: &Context) -> Result<Option<SkyModel>> {
    let needed = options.errors.iter().find(|e| e.model().of_scene());
    match (&args.scene, needed) {
        (Some(path), Some(_)) => {
            let center = header.phase_centers.first().ok_or_else(|| Failure::message("the set has no phase centre"))?;
            let file = SceneArgs { scene: path.clone(), how: args.how.clone() };
            Ok(Some(file.load(center, &header.spectrum, context)?.sky))
        }
        (None, Some(error)) => Err(Failure::usage(format!(
            "--scene is missing: the error {} changes what each baseline sees of the scene. Give the scene that was observed, or a model image",
            error.name()
        ))),
        (Some(_), None) => {
            Err(Failure::usage("--scene is for errors that need the scene (pointing, width, band): give one, or leave --scene out"))
        }
        (None, None) => Ok(None),
    }
}

/// Rms phase, rms of amplitude minus 1, and number of flagged gains.
fn sizes(table: &GainTable) -> (f64, f64, usize) {
    let good = || table.gains.iter().zip(&table.flags).filter(|(_, f)| !**f).map(|(g, _)| g);
    let n = good().count().max(1) as f64;
    let phase = (good().map(|g| g.arg().powi(2)).sum::<f64>() / n).sqrt();
    let amplitude = (good().map(|g| (g.norm() - 1.0).powi(2)).sum::<f64>() / n).sqrt();
    (phase, amplitude, table.flags.iter().filter(|f| **f).count())
}

/// Rows of a set that are looked at first where the scene changes.
const FIRST_ROWS: usize = 64;

impl CorruptArgs {
    /// The change of the scene in so many rows of a set, where an error asks for it.
    fn changed(
        &self,
        source: &mut dyn VisibilitySource,
        options: &CorruptOptions,
        rows: f64,
        planner: &Planner<'_>,
    ) -> Result<Option<Grown>> {
        let mut of_scene = options.clone();
        of_scene.errors.retain(|e| e.model().of_scene());
        read_bands(&mut of_scene.errors, Path::new(""))?;
        let missing = self.scene.as_ref().filter(|path| !of_scene.errors.is_empty() && !path.exists());
        if let Some(path) = missing {
            return Err(Failure::unforeseen(format!(
                "--dry-run: {} does not exist, and without the scene there is no forecast",
                path.display()
            )));
        }
        let header = source.header().clone();
        let Some(sky) = scene(self, options, &header, planner.context)? else { return Ok(None) };
        let (n_chan, n_pol) = (header.spectrum.n_chan(), header.polarizations.len());
        let found = grown((rows, source.n_rows()), FIRST_ROWS, &mut |n| {
            let mut some = VisibilitySet::new(header.clone(), source.read_rows(0..n)?)?;
            let nothing = VisibilityBlock::zeros(UvCoverage::empty(), n_chan, n_pol);
            let mut changed = VisibilitySet::new(corrupted_header(&header, &of_scene), nothing)?;
            corrupt_with(&mut some, &mut changed, &of_scene, Some(&sky), &Silent)?;
            Ok(())
        })?;
        Ok(Some(found))
    }
}

impl Plan for CorruptArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        let input = self.input.files()?;
        let mut source = input.open(planner.context)?;
        let options = options(self, source.header().unit)?;
        let Passing { set, header, facts } = Passing::of(&input, source.as_ref(), false, planner)?;
        // Errors may change from integration to integration and from channel to channel.
        let n_ant = header.layout.n_ant() as f64;
        let times = set.rows / (0.5 * n_ant * (n_ant - 1.0)).max(1.0);
        let flat = options.errors.iter().all(|e| ["phase", "amplitude"].contains(&e.name()));
        let channels = if flat { 1.0 } else { header.spectrum.n_chan() as f64 };
        let gains = times * n_ant * channels * if options.per_feed { 2.0 } else { 1.0 };
        let changed = self.changed(source.as_mut(), &options, set.rows, planner)?;
        let mut forecast = cost::gained(Gained { set, double: false, readings: 2.0, gains });
        if let Some(found) = changed {
            forecast.stages.push(Stage { timed_s: found.seconds, ..Stage::new("scene", found.held_bytes) });
            forecast.assumptions.push(found.assumption("rows, which see the scene changed,"));
        }
        forecast.assumptions.push("a gain for each antenna and integration, drawn in the time of two multiplications of a value".into());
        Ok(Told { command: "corrupt", forecast, facts })
    }

    fn output(&self) -> &Path {
        &self.out.output
    }
}
