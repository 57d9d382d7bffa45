//! `simulate`: the visibilities that an array measures of a scene.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use super::options::{OutputArgs, SceneArgs, load_array};
use super::{planned, verdict};
use crate::simulate::{BandOptions, PlannedTrack, SimulateOptions, Simulator, TrackOptions};
use crate::verdict::{Finding, of_pedestal};
use clap::Args;
use std::path::Path;

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
    out: OutputArgs,
}

/// Number of rows in a block.
const BLOCK_ROWS: usize = 16_384;

/// Simulate and write UVH5.
///
/// # Errors
/// The layout, the scene or an option is wrong, or an error of the file system.
pub fn run(args: &SimulateArgs, context: &Context) -> Result<Outcome> {
    args.out.claim([&args.out.output], [Path::new(&args.layout), &args.scene.scene])?;
    let layout = load_array(&args.layout)?;
    let spectrum = args.band.spectrum()?;
    let PlannedTrack { mut center, plan } = args.track.plan(&layout).map_err(Failure::call)?;
    planned::warn(&plan, context);
    planned::check_size(&plan, spectrum.n_chan() * args.how.pols.len(), Some(&args.out.output), context)?;
    args.how.pattern(&layout).map_err(Failure::call)?;
    let scene = args.scene.load(&center, &spectrum, context)?;
    center.name.clone_from(&scene.name);
    let mut head = args.how.header(layout, spectrum, center, scene.unit);
    head.history.push(context.history());
    let mut simulator = Simulator::new(head, &scene.sky, &args.how, &context.console).context(format!("{}", args.scene.scene.display()))?;
    let path = &args.out.output;
    let mut sink = args.out.visibilities(simulator.header(), context)?;
    let summary = simulator.run(&mut plan.blocks(BLOCK_ROWS), Some(plan.n_rows() as u64), sink.as_mut(), &context.console);
    let summary = summary.context(format!("{}", args.scene.scene.display()))?;
    sink.finish().context(format!("{}", path.display()))?;
    let header = simulator.header();
    let findings: Vec<Finding> = of_pedestal(header).into_iter().collect();
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
        "findings": findings,
        "seed": args.how.seed,
    });
    let text = format!("{}: {} rows, {} visibilities in {}", path.display(), summary.rows, summary.visibilities, header.unit.name());
    Ok(Outcome::new(json, text).wrote(path))
}
