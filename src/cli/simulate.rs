//! `simulate`: the visibilities that an array measures of a scene.

use super::ahead::SetAhead;
use super::airs::Airs;
use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result, ensure};
use super::forecast::{Plan, Planner, Sampling, Told, few_points};
use super::options::{LoadedScene, OutputArgs, SceneArgs, foreseen_surface, load_array, range_file, scene_surface};
use super::scene_errors::{TruthFiles, band_files, read_bands};
use super::{planned, ranks, verdict};
use crate::calibrate::spread_channels;
use crate::corrupt::{
    AtmosphereOptions, BandErrorOptions, CorruptOptions, ErrorOptions, GainedSink, JitterOptions, PointingOptions, SceneErrors,
    WidthOptions, WindOptions, corrupted_header, true_gains, true_scene_errors,
};
use crate::cost;
use crate::memory::MemoryBudget;
use crate::progress::Silent;
use crate::simulate::{BandOptions, PlannedTrack, SimulateOptions, Simulator, TrackOptions};
use crate::verdict::{Finding, of_pedestal};
use cittert_arrays::{InTurn, UvCoverage, VisUnit, VisibilitySink};
use clap::Args;
use std::path::{Path, PathBuf};

/// Options of `simulate`.
#[derive(Debug, Args)]
pub struct SimulateArgs {
    /// Name of a built-in layout, or a layout file.
    #[arg(long, value_name = "NAME|FILE")]
    layout: String,
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    band: BandOptions,
    #[command(flatten)]
    track: TrackOptions,
    #[command(flatten)]
    how: SimulateOptions,
    #[command(flatten)]
    air: AirArgs,
    #[command(flatten)]
    antennas: AntennaArgs,
    #[command(flatten)]
    out: OutputArgs,
}

/// The air over the array.
#[derive(Debug, Args)]
#[command(next_help_heading = "Air over the array")]
struct AirArgs {
    #[command(flatten)]
    atmosphere: AtmosphereOptions,
    #[command(flatten)]
    wind: WindOptions,
    /// File of the gains of the air [default: the output with the extension .calh5, with an atmosphere].
    #[arg(long, value_name = "CALH5")]
    gains: Option<PathBuf>,
}

impl AirArgs {
    /// The errors of the air, for a set in `unit`.
    fn errors(&self, seed: u64, unit: VisUnit) -> Result<Option<CorruptOptions>> {
        let options = ErrorOptions { atmosphere: self.atmosphere.clone(), wind: self.wind.clone(), ..ErrorOptions::default() };
        let errors = options.errors(unit, &Airs)?;
        let idle = errors.is_empty() && self.gains.is_some();
        ensure!(!idle, Failure::usage("--gains is the file of the gains of the air: give --atmosphere too, or leave --gains out"));
        Ok((!errors.is_empty()).then_some(CorruptOptions { seed, errors, per_feed: false }))
    }

    /// The file of the gains, where there are any.
    fn gains_path(&self, output: &Path) -> Option<PathBuf> {
        self.atmosphere.atmosphere.as_ref().map(|_| self.gains.clone().unwrap_or_else(|| output.with_extension("calh5")))
    }
}

/// Patterns and receivers that differ from antenna to antenna.
#[derive(Debug, Args)]
#[command(next_help_heading = "Antennas that differ")]
struct AntennaArgs {
    #[command(flatten)]
    pointing: PointingOptions,
    #[command(flatten)]
    width: WidthOptions,
    #[command(flatten)]
    band: BandErrorOptions,
    #[command(flatten)]
    jitter: JitterOptions,
}

impl AntennaArgs {
    /// The errors, for a set in `unit`.
    fn errors(&self, seed: u64, unit: VisUnit) -> Result<CorruptOptions> {
        let options = ErrorOptions {
            pointing: self.pointing.clone(),
            width: self.width.clone(),
            band: self.band.clone(),
            jitter: self.jitter.clone(),
            ..ErrorOptions::default()
        };
        Ok(CorruptOptions { seed, errors: options.errors(unit, &Airs).map_err(Failure::call)?, per_feed: false })
    }
}

/// Number of rows in a block.
const BLOCK_ROWS: usize = 16_384;

/// Simulate and write UVH5.
///
/// # Errors
/// The layout, the scene or an option is wrong, or an error of the file system.
pub fn run(args: &SimulateArgs, context: &Context) -> Result<Outcome> {
    let gains_path = args.air.gains_path(&args.out.output);
    // The unit matters to no error of the antennas.
    let mut antennas = args.antennas.errors(args.how.seed, VisUnit::Jy)?;
    let files = TruthFiles::beside(&args.out.output);
    let bands = band_files(&antennas.errors);
    let given = [Path::new(&args.layout), &args.scene.scene].into_iter().chain(args.how.element_file.as_deref());
    let given = given.chain(args.how.range.as_ref().and_then(range_file));
    let outputs = [args.out.output.as_path()].into_iter().chain(gains_path.as_deref()).chain(files.of(&antennas.errors));
    args.out.claim(outputs, given.chain(bands.iter().map(PathBuf::as_path)))?;
    read_bands(&mut antennas.errors, Path::new(""))?;
    let mut layout = load_array(&args.layout)?;
    if let Some(file) = &args.how.element_file {
        layout.pattern = cittert_formats::read_pattern(file)?;
    }
    let spectrum = args.band.spectrum()?;
    let PlannedTrack { mut center, plan } = args.track.plan(&layout).map_err(Failure::call)?;
    let plan = plan.with_autocorrelations(args.how.autos);
    planned::warn(&plan, context);
    planned::check_size(&plan, spectrum.n_chan() * args.how.pols.len(), Some(&args.out.output), context)?;
    args.how.pattern(&layout).map_err(Failure::call)?;
    let noise_left =
        args.how.noise_options().map_err(Failure::call)?.is_none() && layout.antennas().iter().all(|a| a.sensitivity.is_some());
    let mut scene = args.scene.load(&center, &spectrum, context)?;
    scene.sky.surface = scene_surface(args.how.range.as_ref(), &args.scene, &scene.sky, &spectrum)?;
    center.name.clone_from(&scene.name);
    let mut head = args.how.header(layout, spectrum, center, scene.unit);
    let air = args.air.errors(args.how.seed, scene.unit)?;
    let gains = air.as_ref().map(|air| true_gains(&head, &mut plan.blocks(BLOCK_ROWS), air)).transpose()?;
    if let Some(air) = &air {
        head = corrupted_header(&head, air);
    }
    let mut differing = SceneErrors::default();
    if !antennas.errors.is_empty() {
        differing = true_scene_errors(&head, &mut plan.blocks(BLOCK_ROWS), &antennas).map_err(Failure::call)?;
        head = corrupted_header(&head, &antennas);
    }
    head.history.push(context.history());
    let simulator = Simulator::new(head, &scene.sky, &args.how, &context.console).context(format!("{}", args.scene.scene.display()))?;
    let mut simulator = differing.put_into(simulator).map_err(Failure::call)?;
    let path = &args.out.output;
    // Other processes than 0 have no output.
    let mut sink = (!ranks::is_silent()).then(|| args.out.visibilities(simulator.header(), context)).transpose()?;
    let mut blocks = plan.blocks(BLOCK_ROWS);
    let n_rows = Some(plan.n_rows() as u64);
    let header = simulator.header().clone();
    let mut gained;
    let out: Option<&mut dyn VisibilitySink> = match (sink.as_deref_mut(), &gains) {
        (Some(sink), Some(table)) => {
            gained = GainedSink::new(sink, table, &header);
            Some(&mut gained)
        }
        (Some(sink), None) => Some(sink),
        (None, _) => None,
    };
    let summary = simulator.run_in_turn(&mut blocks, n_rows, &mut InTurn::new(ranks::all(), out), &context.console);
    let summary = summary.context(format!("{}", args.scene.scene.display()))?;
    let Some(sink) = sink else { return Ok(Outcome::new(serde_json::Value::Null, "")) };
    if let (Some(path), Some(mut table)) = (&gains_path, gains) {
        table.history.push(context.history());
        let channels = spread_channels(&table, &header.spectrum);
        cittert_formats::calh5::write_gains_on(path, &table, (&channels.0, &channels.1), args.out.overwrite)?;
    }
    sink.finish().context(format!("{}", path.display()))?;
    let findings: Vec<Finding> = of_pedestal(&header).into_iter().collect();
    verdict::warn(&findings, context);
    let json = serde_json::json!({
        "output": path,
        "n_blts": summary.rows,
        "n_visibilities": summary.visibilities,
        "n_flagged": summary.flagged,
        "unit": header.unit.name(),
        "pedestal_k": header.pedestal_k,
        "scene_pedestal_k": header.scene_pedestal_k,
        "scene_width_rad": header.scene_width_rad,
        "antenna_temperature_k": header.antenna_temperature_k,
        "scene_range": header.near_field.scene.as_ref().map(ToString::to_string),
        "element_pattern": header.layout.pattern.to_string(),
        "findings": findings,
        "seed": args.how.seed,
        "gains": gains_path,
    });
    let noise = if noise_left { "\nno noise is added: --noise adds that of the system temperatures or SEFDs of the layout" } else { "" };
    let text = format!("{}: {} rows, {} visibilities in {}{noise}", path.display(), summary.rows, summary.visibilities, header.unit.name());
    let outcome = Outcome::new(json, text).wrote(path);
    let outcome = match gains_path {
        Some(gains) => outcome.wrote(gains),
        None => outcome,
    };
    files.write(&differing, &header.layout, args.out.overwrite, outcome)
}

impl Plan for SimulateArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        let layout = load_array(&self.layout)?;
        let spectrum = self.band.spectrum()?;
        let PlannedTrack { mut center, plan } = self.track.plan(&layout).map_err(Failure::call)?;
        let plan = plan.with_autocorrelations(self.how.autos);
        let (LoadedScene { mut sky, unit, name }, traced) = self.scene.foreseen(&center, &spectrum, planner.context)?;
        let (surface, ranged) = foreseen_surface(self.how.range.as_ref(), &self.scene, &sky, &spectrum)?;
        sky.surface.clone_from(&surface);
        center.name = name;
        let header = self.how.header(layout, spectrum.clone(), center, unit);
        // A simulator of a scene near the array sums over all of its points at once.
        let few = surface.as_ref().map(|_| few_points(&sky));
        let simulator = Simulator::new(header, few.as_ref().unwrap_or(&sky), &self.how, &Silent);
        let simulator = simulator.context(format!("{}", self.scene.scene.display()))?;
        planner.context.ahead.promise(&self.out.output, SetAhead { header: simulator.header().clone(), plan: plan.clone() });
        let share = planner.stretch(plan.n_rows() as f64 * spectrum.n_chan() as f64)? / planner.ranks as f64;
        let rows = plan.n_rows() as f64 * share;
        let mut blocks = plan.blocks(BLOCK_ROWS);
        let coverage = blocks.next().transpose()?.ok_or_else(|| Failure::message("the observation has no rows"))?;
        let values = spectrum.n_chan() * (self.how.subchannels + 2 * self.how.pols.len());
        let how = Sampling {
            rows,
            channels: spectrum.freq_hz().to_vec(),
            subchannels: self.how.subchannels,
            products: self.how.pols.len(),
            block_rows: (MemoryBudget::default().simulated_block() / (16 * values)).clamp(1, BLOCK_ROWS),
            method: self.how.method,
            epsilon: self.how.epsilon,
            no_w: self.how.no_w,
        };
        let (work, facts) = match &surface {
            Some(surface) => how.near_work(&sky, surface, simulator.header())?,
            None => how.work(&sky, coverage.uvw_m)?,
        };
        let mut forecast = cost::simulate(&work, &traced.and(&ranged));
        if surface.is_none() {
            let of = |_: &mut (), n: usize| Ok(cost::simulate(&work.of_rows(n as f64), &traced.and(&ranged)));
            forecast = planner.tried((forecast, true), (&["simulate"], plan.n_rows()), &mut (), of, |_, n, (folder, watch)| {
                let mut simulator = Simulator::new(simulator.header().clone(), &sky, &self.how, watch)?;
                let mut sink = cittert_formats::create_visibilities(&folder.join("set.uvh5"), simulator.header(), false)?.sink;
                let mut left = n;
                let mut blocks = plan.blocks(BLOCK_ROWS.min(n)).take_while(|block| {
                    let more = left > 0;
                    left = left.saturating_sub(block.as_ref().map_or(0, UvCoverage::n_rows));
                    more
                });
                simulator.run(&mut blocks, None, sink.as_mut(), watch)?;
                Ok(sink.finish()?)
            })?;
        }
        if self.air.atmosphere.atmosphere.is_some() || !self.antennas.errors(self.how.seed, unit)?.errors.is_empty() {
            forecast.assumptions.push("air over the array and antennas that differ are not counted".into());
        }
        Ok(Told { command: "simulate", forecast, facts })
    }

    fn output(&self) -> &Path {
        &self.out.output
    }
}
