//! `convert`: convert a file from one format to another.

use super::beside::Beside;
use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result, ensure};
use super::options::{ColumnArgs, OutputArgs};
use super::planned::check_room_for_set;
use crate::memory::MemoryBudget;
use crate::plot::{self, ImagePlot};
use cittert_arrays::{VisibilitySource, for_each_block};
use cittert_formats::calh5::{read_gains, write_delays, write_gains};
use cittert_formats::{ColumnSink, Compression, CreateOptions, Edit, Holds, format_of};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Options of `convert`.
#[derive(Debug, Args)]
pub struct ConvertArgs {
    /// File to read. Its format is recognised by its content.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// File to write. The ending of its name chooses the format.
    #[arg(value_name = "OUT")]
    output: PathBuf,
    #[command(flatten)]
    column: ColumnArgs,
    /// Compression of a UVH5 file: none, lzf, gzip, or gzip-1 to gzip-9.
    #[arg(long, value_name = "NAME", value_parser = compression)]
    compression: Option<Compression>,
    /// Append rows to an existing UVH5 file with the same antennas, channels and phase centres.
    #[arg(long, conflicts_with = "overwrite")]
    append: bool,
    /// Write gains that are pure delays as a table of delays.
    #[arg(long)]
    delays: bool,
    /// Replace an output that exists.
    #[arg(long)]
    overwrite: bool,
}

fn compression(name: &str) -> std::result::Result<Compression, String> {
    let level = |text: &str| text.parse::<u8>().ok().filter(|l| (1..=9).contains(l));
    match name {
        "none" => Ok(Compression::None),
        "lzf" => Ok(Compression::Lzf),
        "gzip" => Ok(Compression::Gzip(4)),
        _ => name
            .strip_prefix("gzip-")
            .and_then(level)
            .map(Compression::Gzip)
            .ok_or_else(|| "one of none, lzf, gzip, gzip-1 to gzip-9".into()),
    }
}

/// Convert a file.
///
/// # Errors
/// A format that cannot hold the contents of the file, a damaged file, or an error of the file system.
pub fn run(args: &ConvertArgs, context: &Context) -> Result<Outcome> {
    let out = OutputArgs { output: args.output.clone(), overwrite: args.overwrite || args.append };
    out.claim([&args.output], [&args.input])?;
    let holds = format_of(&args.input)?.holds();
    if !matches!(holds, Holds::Visibilities(_)) && (args.append || args.compression.is_some() || args.column.chosen().is_some()) {
        return Err(Failure::usage(format!("{}: --append, --compression and --column are for visibilities", args.input.display())));
    }
    ensure!(!args.delays || matches!(holds, Holds::Gains(_)), Failure::usage(format!("{}: --delays is for gains", args.input.display())));
    match holds {
        Holds::Visibilities(_) => visibilities(args, context),
        Holds::Images(_) => image(args, &out, context),
        Holds::Gains(_) => gains(args, context),
        Holds::Sources(_) => Err(Failure::usage(format!("{}: this is a source list, which has no other format", args.input.display()))),
        Holds::Layouts(_) => Err(Failure::usage(format!("{}: this is a layout; use `cittert layout convert`", args.input.display()))),
    }
}

fn visibilities(args: &ConvertArgs, context: &Context) -> Result<Outcome> {
    let mut source = args.column.open(&args.input)?;
    if !args.append && args.compression.is_none() && args.column.chosen().is_none() {
        let edit = Edit { overwrite: args.overwrite, history: vec![context.history()], ..Edit::default() };
        if let Some(copy) = cittert_formats::edit_visibilities(&args.input, &args.output, &edit)? {
            return copied(args, source.as_mut(), copy.sink);
        }
    }
    if args.compression.is_none_or(|c| c == Compression::None) {
        check_room_for_set(source.as_ref(), &args.output)?;
    }
    let mut beside = match args.column.chosen() {
        None => Beside::open(&args.input, &args.output)?,
        Some(_) => Beside::default(),
    };
    let mut lost = std::mem::take(&mut beside.lost);
    lost.extend(cittert_formats::losses(&args.input, &args.output, source.header())?);
    let mut header = source.header().clone();
    header.history.push(context.history());
    header.history.extend(beside.notes.iter().cloned());
    let options =
        CreateOptions { overwrite: args.overwrite, append: args.append, compression: args.compression, columns: beside.columns.clone() };
    let created = cittert_formats::create_visibilities_with(&args.output, &header, &options)?;
    let mut notes = std::mem::take(&mut beside.notes);
    notes.extend(created.notes);
    notes.iter().chain(&lost).for_each(|note| context.console.note(note));
    let mut sink = created.sink;
    let mut rows = 0;
    for_each_block(source.as_mut(), MemoryBudget::default().block(), |first, block| -> Result<()> {
        rows += block.n_rows();
        let columns = beside.read(first..first + block.n_rows())?;
        let views: Vec<_> = columns.iter().map(|c| c.view()).collect();
        Ok(sink.write_columns(&block, &views)?)
    })
    .context(format!("converting {}", args.input.display()))?;
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

/// A file of the same format is a copy with one more line of history. All rows are read, so that damage is found.
fn copied(args: &ConvertArgs, source: &mut dyn VisibilitySource, mut sink: Box<dyn ColumnSink>) -> Result<Outcome> {
    for_each_block(source, MemoryBudget::default().block(), |_, block| -> Result<()> { Ok(sink.write_block(&block)?) })
        .context(format!("converting {}", args.input.display()))?;
    sink.finish().context(format!("writing {}", args.output.display()))?;
    let (rows, none) = (source.n_rows(), Vec::<String>::new());
    let text = format!("{}: {rows} rows, copied as they are", args.output.display());
    Ok(Outcome::new(json!({ "output": args.output, "n_blts": rows, "notes": none, "lost": none }), text).wrote(&args.output))
}

fn gains(args: &ConvertArgs, context: &Context) -> Result<Outcome> {
    let calh5 = args.output.extension().is_some_and(|e| ["calh5", "h5", "hdf5"].iter().any(|end| e.eq_ignore_ascii_case(end)));
    if !calh5 {
        let what = "gain tables are written as CalH5 (.calh5); formats of visibilities, images and layouts cannot hold them";
        return Err(Failure::message(format!("{}: {what}", args.output.display())));
    }
    let mut table = read_gains(&args.input)?;
    table.history.push(context.history());
    let write = if args.delays { write_delays } else { write_gains };
    write(&args.output, &table, args.overwrite)?;
    let kind = if args.delays { "delays" } else { "gains" };
    let text = format!("{}: {kind} of {} antennas in {} intervals", args.output.display(), table.layout.n_ant(), table.time_jd.len());
    Ok(Outcome::new(json!({ "output": args.output, "kind": kind }), text).wrote(&args.output))
}

fn image(args: &ConvertArgs, out: &OutputArgs, context: &Context) -> Result<Outcome> {
    let mut image = cittert_formats::open_image(&args.input)?;
    if args.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        let png = plot::image(&image, &ImagePlot { title: image.object.clone(), ..ImagePlot::default() })?.png()?;
        out.write(&args.output, &png)?;
    } else {
        out.image(&args.output, &mut image, context)?;
    }
    Ok(Outcome::new(json!({ "output": args.output }), args.output.display().to_string()).wrote(&args.output))
}
