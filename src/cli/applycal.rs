//! `applycal`: remove gains from the data, or apply them.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Result};
use super::forecast::{Passing, Plan, Planner, Told};
use super::options::{OutputArgs, SetArgs};
use super::planned::check_room_for_set;
use crate::calibrate::{ApplyOptions, Direction, Interpolation, RoundOptions, apply};
use crate::cost::{self, Gained};
use cittert_arrays::VisibilitySink;
use cittert_formats::{Edit, format_of_output, visibility_format};
use clap::Args;
use std::path::{Path, PathBuf};

/// Options of `applycal`.
#[derive(Debug, Args)]
pub struct ApplycalArgs {
    #[command(flatten)]
    input: SetArgs,
    /// Gain table (CalH5).
    #[arg(value_name = "GAINS")]
    gains: PathBuf,
    /// Multiply by the gains instead of dividing. This puts the errors into the data again.
    #[arg(long)]
    invert: bool,
    /// The gain between the middles of solution intervals.
    #[arg(long, value_enum, default_value_t = RoundOptions::default().interp)]
    interp: Interpolation,
    /// Leave data without a gain as they are instead of flagging them.
    #[arg(long)]
    keep_unsolved: bool,
    /// Apply the gains also far from the times and frequencies for which they were solved.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    out: OutputArgs,
}

/// Apply gains to a set.
///
/// # Errors
/// The files do not belong together, or an error of the file system.
pub fn run(args: &ApplycalArgs, context: &Context) -> Result<Outcome> {
    let path = &args.out.output;
    // The data may be calibrated in place: with --overwrite, the new set replaces the old one when it is complete.
    let input = args.input.files()?;
    input.claim_or_edit(&args.out, &[&args.gains])?;
    let mut source = input.open(context)?;
    check_room_for_set(source.as_ref(), path)?;
    let mut header = source.header().clone();
    let table = cittert_formats::calh5::read_gains_for(&args.gains, &header.spectrum)?;
    let missing: Vec<&str> =
        header.layout.antennas().iter().filter(|a| table.layout.index_of(&a.name).is_none()).map(|a| a.name.as_str()).collect();
    let options = ApplyOptions {
        direction: if args.invert { Direction::Corrupt } else { Direction::Calibrate },
        interpolation: args.interp,
        flag_unsolved: !args.keep_unsolved,
        anywhere: args.force,
    };
    let what = format!("applying {} to {}", args.gains.display(), input);
    // Check that table and data match before the output is created.
    crate::calibrate::GainApplier::new(&table, &header, options).context(&what)?;
    if !missing.is_empty() {
        let fate = if args.keep_unsolved { "pass as they are" } else { "are flagged" };
        let shown = missing.iter().take(10).copied().collect::<Vec<_>>().join(", ");
        let more = if missing.len() > 10 { ", ..." } else { "" };
        context.console.warn(&format!("{} antennas have no gain in the table ({shown}{more}): their data {fate}", missing.len()));
    }
    header.history.push(context.history());
    let edit = Edit { overwrite: args.out.overwrite, data: true, columns: Vec::new(), history: vec![context.history()] };
    let columns = input.columns()?;
    let mut lost = Vec::new();
    let mut sink: Box<dyn VisibilitySink> =
        match input.one().map_or(Ok(None), |one| cittert_formats::edit_visibilities(one, path, &edit))? {
            Some(created) => {
                for column in &columns {
                    context.console.note(&format!("the column {:?} stays as it is: the gains go to the data alone", column.name()));
                }
                created.sink
            }
            None => {
                for column in &columns {
                    context.console.note(&format!("the column {:?} is not kept: only the data go to another file", column.name()));
                }
                lost = input.note_losses(path, &header, context)?;
                args.out.visibilities(&header, context)?
            }
        };
    let counts = apply(source.as_mut(), &table, options, sink.as_mut(), &context.console).context(&what)?;
    sink.finish().context(format!("{}", path.display()))?;
    let json = serde_json::json!({
        "output": path, "n_blts": source.n_rows(), "n_applied": counts.applied, "n_without_gain": counts.flagged,
        "n_antennas_without_gain": missing.len(), "inverted": args.invert, "lost": lost,
    });
    let verb = if args.invert { "multiplied by gains" } else { "calibrated" };
    let text = format!("{}: {} visibilities {verb}, {} flagged because they have no gain", path.display(), counts.applied, counts.flagged);
    Ok(Outcome::new(json, text).wrote(path))
}

/// Bytes of a value in a file of numbers of 32 bits, at most. Numbers of 64 bits take more.
const SINGLE_BYTES: f64 = 12.0;

impl Plan for ApplycalArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        let input = self.input.files()?;
        let source = input.open(planner.context)?;
        cittert_formats::calh5::read_gains_for(&self.gains, &source.header().spectrum)?;
        let (mut copied, mut double) = (false, false);
        if let Some(one) = input.one() {
            copied = format_of_output(one, &self.out.output)?.name() == visibility_format(one)?.name();
            let header = source.header();
            let values = source.n_rows() as f64 * (header.spectrum.n_chan() * header.polarizations.len()) as f64;
            double = copied && one.is_file() && std::fs::metadata(one).context(one.display())?.len() as f64 > SINGLE_BYTES * values;
        }
        let Passing { set, facts, .. } = Passing::of(&input, source.as_ref(), copied, planner)?;
        let mut forecast = cost::gained(Gained { set, double, readings: 1.0, gains: 0.0 });
        forecast.assumptions.push("every format is written as fast as UVH5".into());
        Ok(Told { command: "applycal", forecast, facts })
    }

    fn output(&self) -> &Path {
        &self.out.output
    }
}
