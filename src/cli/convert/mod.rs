//! `convert`: convert a file from one format to another, join files of visibilities, and cut them into parts.

mod args;
mod cut;
mod forecast;
mod split;

pub use args::ConvertArgs;

use super::beside::Beside;
use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result, ensure};
use super::options::{OutputArgs, SetFiles};
use super::planned::check_room_for_set;
use super::ranks;
use crate::imaging::StillFeeds;
use crate::memory::MemoryBudget;
use crate::plot::{self, ImagePlot};
use cittert_arrays::{ArrayError, InTurn, VisibilityBlock, VisibilitySink, VisibilitySource, for_each_block, rows_of_block};
use cittert_formats::calh5::{read_gains, write_delays, write_gains};
use cittert_formats::{ColumnSink, Compression, CreateOptions, Edit, Holds, format_of};
use serde_json::json;
use std::path::Path;

/// Convert a file.
///
/// # Errors
/// A format that cannot hold the contents of the file, a damaged file, or an error of the file system.
pub fn run(args: &ConvertArgs, context: &Context) -> Result<Outcome> {
    let out = OutputArgs { output: args.output.clone(), overwrite: args.overwrite || args.append };
    let input = args.input.files()?;
    if args.split.is_empty() {
        out.claim([&args.output], input.all())?;
    }
    let first = &input.all()[0];
    let holds = format_of(first)?.holds();
    let of_visibilities =
        args.append || args.derotate || args.compression.is_some() || args.column.chosen().is_some() || !args.split.is_empty();
    if !matches!(holds, Holds::Visibilities(_)) && of_visibilities {
        return Err(Failure::usage(format!("{input}: --append, --compression, --derotate, --column and --split are for visibilities")));
    }
    ensure!(!args.delays || matches!(holds, Holds::Gains(_)), Failure::usage(format!("{input}: --delays is for gains")));
    match holds {
        Holds::Visibilities(_) => visibilities(args, &input, context),
        // Small files are for one process.
        Holds::Images(_) | Holds::Gains(_) if ranks::is_silent() => Ok(Outcome::default()),
        Holds::Images(_) => image(args, input.only("the first is an image")?, &out, context),
        Holds::Gains(_) => gains(args, input.only("the first is a gain table")?, context),
        Holds::Sources(_) => Err(Failure::usage(format!("{input}: this is a source list, which has no other format"))),
        Holds::Layouts(_) => Err(Failure::usage(format!("{input}: this is a layout; use `cittert layout convert`"))),
    }
}

fn visibilities(args: &ConvertArgs, input: &SetFiles, context: &Context) -> Result<Outcome> {
    let mut source = input.open_chosen_whole(&args.column, context)?;
    if args.derotate {
        source = Box::new(StillFeeds::new(source).context(format!("{input}"))?);
    }
    if !args.split.is_empty() {
        return split::split(args, input, source.as_mut(), context);
    }
    let changed = args.derotate || args.column.chosen().is_some();
    if let Some(one) = input.one()
        && !args.append
        && args.compression.is_none()
        && !changed
    {
        let edit = Edit { overwrite: args.overwrite, history: vec![context.history()], ..Edit::default() };
        let edited = || cittert_formats::edit_visibilities(one, &args.output, &edit);
        let copy = if ranks::is_silent() { None } else { edited()? };
        let is_copy = ranks::all().exchange(vec![u8::from(copy.is_some())]).first() == Some(&vec![1]);
        if is_copy {
            return copy.map_or_else(|| Ok(Outcome::default()), |copy| copied(args, input, source.as_mut(), copy.sink));
        }
    }
    if args.compression.is_none_or(|c| c == Compression::None) {
        check_room_for_set(source.as_ref(), &args.output)?;
    }
    let mut beside = if changed { Beside::default() } else { Beside::open(input, &args.output)? };
    let mut lost = std::mem::take(&mut beside.lost);
    lost.extend(input.losses(&args.output, source.header())?);
    let mut header = source.header().clone();
    header.history.push(context.history());
    header.history.extend(beside.notes.iter().cloned());
    let options =
        CreateOptions { overwrite: args.overwrite, append: args.append, compression: args.compression, columns: beside.columns.clone() };
    let create = || cittert_formats::create_visibilities_with(&args.output, &header, &options);
    let created = (!ranks::is_silent()).then(create).transpose()?;
    let mut notes = std::mem::take(&mut beside.notes);
    notes.extend(created.iter().flat_map(|c| c.notes.iter().cloned()));
    notes.iter().chain(&lost).for_each(|note| context.console.note(note));
    let mut sink = created.map(|created| WithColumns { sink: created.sink, beside, rows: 0 });
    in_turn(source.as_mut(), sink.as_mut()).context(format!("converting {input}"))?;
    let Some(WithColumns { sink, rows, .. }) = sink else { return Ok(Outcome::default()) };
    // Some notes depend on the data and exist only now.
    for note in sink.finish_with_notes().context(format!("writing {}", args.output.display()))? {
        if !notes.contains(&note) {
            context.console.note(&note);
            notes.push(note);
        }
    }
    let verb = if args.append { " appended" } else { "" };
    let text = format!("{}: {rows} rows{verb}", args.output.display());
    Ok(Outcome::new(json!({ "output": args.output, "n_blts": rows, "notes": notes, "lost": lost }), text).wrote(&args.output))
}

/// An output, and the columns that go into it beside the data.
struct WithColumns {
    sink: Box<dyn ColumnSink>,
    beside: Beside,
    rows: usize,
}

impl VisibilitySink for WithColumns {
    fn write_block(&mut self, block: &VisibilityBlock) -> Result<(), ArrayError> {
        let columns = self.beside.read(self.rows..self.rows + block.n_rows())?;
        self.rows += block.n_rows();
        let views: Vec<_> = columns.iter().map(|c| c.view()).collect();
        Ok(self.sink.write_columns(block, &views)?)
    }

    fn finish(self: Box<Self>) -> Result<(), ArrayError> {
        self.sink.finish()
    }
}

/// Read blocks by processes in turn; process 0 has the output, and writes them.
fn in_turn(source: &mut dyn VisibilitySource, out: Option<&mut WithColumns>) -> Result<()> {
    let mut turns = InTurn::new(ranks::all(), out.map(|out| out as &mut dyn VisibilitySink));
    let (n_rows, step) = (source.n_rows(), rows_of_block(source.header(), MemoryBudget::default().block()));
    for start in (0..n_rows).step_by(step) {
        let own = turns.is_own().then(|| source.read_rows(start..(start + step).min(n_rows))).transpose()?;
        turns.write(own)?;
    }
    Ok(())
}

/// A file of the same format is a copy with one more line of history. All rows are read, so that damage is found.
fn copied(args: &ConvertArgs, input: &SetFiles, source: &mut dyn VisibilitySource, mut sink: Box<dyn ColumnSink>) -> Result<Outcome> {
    for_each_block(source, MemoryBudget::default().block(), |_, block| -> Result<()> { Ok(sink.write_block(&block)?) })
        .context(format!("converting {input}"))?;
    sink.finish().context(format!("writing {}", args.output.display()))?;
    let (rows, none) = (source.n_rows(), Vec::<String>::new());
    let text = format!("{}: {rows} rows, copied as they are", args.output.display());
    Ok(Outcome::new(json!({ "output": args.output, "n_blts": rows, "notes": none, "lost": none }), text).wrote(&args.output))
}

fn gains(args: &ConvertArgs, input: &Path, context: &Context) -> Result<Outcome> {
    let calh5 = args.output.extension().is_some_and(|e| ["calh5", "h5", "hdf5"].iter().any(|end| e.eq_ignore_ascii_case(end)));
    if !calh5 {
        let what = "gain tables are written as CalH5 (.calh5); formats of visibilities, images and layouts cannot hold them";
        return Err(Failure::message(format!("{}: {what}", args.output.display())));
    }
    let mut table = read_gains(input)?;
    table.history.push(context.history());
    let write = if args.delays { write_delays } else { write_gains };
    write(&args.output, &table, args.overwrite)?;
    let kind = if args.delays { "delays" } else { "gains" };
    let text = format!("{}: {kind} of {} antennas in {} intervals", args.output.display(), table.layout.n_ant(), table.time_jd.len());
    Ok(Outcome::new(json!({ "output": args.output, "kind": kind }), text).wrote(&args.output))
}

fn image(args: &ConvertArgs, input: &Path, out: &OutputArgs, context: &Context) -> Result<Outcome> {
    let mut image = cittert_formats::open_image(input)?;
    if args.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        let png = plot::image(&image, &ImagePlot { title: image.object.clone(), ..ImagePlot::default() })?.png()?;
        out.write(&args.output, &png)?;
    } else {
        out.image(&args.output, &mut image, context)?;
    }
    Ok(Outcome::new(json!({ "output": args.output }), args.output.display().to_string()).wrote(&args.output))
}
