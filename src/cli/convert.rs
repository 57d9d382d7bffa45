//! `convert`: from one format to another.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use super::kind::{FileKind, kind_of};
use super::options::{ColumnArgs, OutputArgs};
use super::picture;
use crate::plot::ImagePlot;
use cittert_arrays::for_each_block;
use cittert_formats::fits::{ImageOptions, write_image};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Options of `convert`.
#[derive(Debug, Args)]
pub struct ConvertArgs {
    /// File to read; its content tells what it is.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// File to write; the ending of its name tells the form.
    #[arg(value_name = "OUT")]
    output: PathBuf,
    #[command(flatten)]
    column: ColumnArgs,
    /// Replace an output that exists.
    #[arg(long)]
    overwrite: bool,
}

/// Bytes of visibilities read at a time.
const BLOCK_BYTES: usize = 64 << 20;

/// Convert.
///
/// # Errors
/// A form that cannot hold what is in the file, a broken file, or what the disk says.
pub fn run(args: &ConvertArgs, context: &Context) -> Result<Outcome> {
    let out = OutputArgs { output: args.output.clone(), overwrite: args.overwrite };
    out.check(&args.output)?;
    match kind_of(&args.input)? {
        FileKind::Visibilities => visibilities(args, context),
        FileKind::Image => image(args, &out, context),
        FileKind::Gains => {
            Err(Failure::message(format!("{}: gain tables have one form here, CalH5; there is nothing to convert", args.input.display())))
        }
        FileKind::Layout => Err(Failure::usage(format!("{}: it is a layout; use `cittert layout convert`", args.input.display()))),
    }
}

fn visibilities(args: &ConvertArgs, context: &Context) -> Result<Outcome> {
    let mut source = args.column.open(&args.input)?;
    let mut header = source.header().clone();
    header.history.push(context.history());
    let created = cittert_formats::create_visibilities(&args.output, &header, args.overwrite)?;
    for note in &created.notes {
        context.console.note(note);
    }
    let mut sink = created.sink;
    let mut rows = 0;
    for_each_block(source.as_mut(), BLOCK_BYTES, |_, block| -> Result<()> {
        rows += block.n_rows();
        Ok(sink.write_block(&block)?)
    })
    .context(format!("converting {}", args.input.display()))?;
    let mut notes = created.notes;
    // What only the data could show is said at the end.
    for note in sink.finish_with_notes().context(format!("writing {}", args.output.display()))? {
        if !notes.contains(&note) {
            context.console.note(&note);
            notes.push(note);
        }
    }
    let text = format!("{}: {rows} rows", args.output.display());
    Ok(Outcome::new(json!({ "output": args.output, "n_blts": rows, "notes": notes }), text).wrote(&args.output))
}

fn image(args: &ConvertArgs, out: &OutputArgs, context: &Context) -> Result<Outcome> {
    let mut image = cittert_formats::open_image(&args.input)?;
    if args.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        let png = picture::image(&image, &ImagePlot { title: image.object.clone(), ..ImagePlot::default() })?;
        out.write(&args.output, &png)?;
    } else {
        image.history.push(context.history());
        write_image(&args.output, &image, ImageOptions { overwrite: args.overwrite, ..ImageOptions::default() })?;
    }
    Ok(Outcome::new(json!({ "output": args.output }), args.output.display().to_string()).wrote(&args.output))
}
