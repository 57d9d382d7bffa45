//! `layout`: list, make, describe, compare and convert antenna layouts.

mod compare;
mod figures;
mod ghosts;
mod make;
mod show;
mod told;

use super::context::{Context, Outcome, subcommands};
use super::failure::{Context as _, Failure, Result};
use super::optimize::{self, OptimizeArgs};
use super::options::{OutputArgs, load_layout};
use cittert_arrays::quantity::Frequency;
use cittert_arrays::{ArrayLayout, BUILTIN_LAYOUTS, FigureOptions};
use cittert_formats::layout_formats;
use cittert_formats::layouts::layout_format;
use clap::Args;
use serde_json::json;

/// All that `layout show --json` says of a layout at a frequency.
///
/// # Errors
/// An option that is out of its range.
pub(super) fn figures_json(layout: &ArrayLayout, freq: Frequency, options: &FigureOptions) -> Result<serde_json::Value> {
    let mut told = told::Told::default();
    told.add(figures::extent_json(layout));
    figures::tell(layout, freq, options, None, &mut told)?;
    Ok(told.outcome().json)
}

subcommands! {
    /// The subcommands of `layout`.
    LayoutCommand {
        /// List the built-in layouts.
        List(ListArgs) => |_, _| Ok(list());
        /// Make a layout of a kind, such as a ring, a spiral or arms along Golomb rulers.
        #[command(visible_alias = "generate")]
        Make(make::MakeArgs) => make::run;
        /// Describe a layout: antennas, baselines, resolution, side lobes, and what the loss of elements costs.
        Show(Box<show::ShowArgs>) => |args: &show::ShowArgs, _| show::run(args);
        /// Compare layouts side by side: figures of merit, beams, and images of the same scene.
        Compare(Box<compare::CompareArgs>) => |args: &compare::CompareArgs, context| compare::run(args, context);
        /// Write a layout in another format, chosen by the ending of the output (.toml, .cfg, .txt, .csv, .tsv, .ant).
        Convert(ConvertArgs) => convert;
        /// Find the positions of elements, or choose among pads, so that the side lobes of the beam or other figures are low.
        Optimize(Box<OptimizeArgs>) => optimize::run;
    }
}

/// `layout list` has no options.
#[derive(Debug, Args)]
pub struct ListArgs {}

/// Options of `layout convert`.
#[derive(Debug, Args)]
pub struct ConvertArgs {
    /// Name of a built-in layout, or a layout file.
    #[arg(value_name = "LAYOUT")]
    layout: String,
    /// Format to write: toml, casa, ehtim, oskar, pyuvsim, miriad [default: by the ending of the output].
    #[arg(long, value_name = "FORMAT")]
    to: Option<String>,
    #[command(flatten)]
    out: OutputArgs,
}

fn list() -> Outcome {
    let rows: Vec<_> =
        BUILTIN_LAYOUTS.iter().map(|b| json!({ "name": b.name, "description": b.description, "freq_hz": b.freq_hz })).collect();
    let text: Vec<String> =
        BUILTIN_LAYOUTS.iter().map(|b| format!("{:14} {:>8}  {}", b.name, Frequency(b.freq_hz), b.description)).collect();
    Outcome::new(json!({ "layouts": rows }), text.join("\n"))
}

fn convert(args: &ConvertArgs, context: &Context) -> Result<Outcome> {
    let path = &args.out.output;
    args.out.claim([path], [&args.layout])?;
    let layout = load_layout(&args.layout)?;
    let wanted = args.to.clone().or_else(|| path.extension().map(|e| e.to_string_lossy().into_owned())).unwrap_or_default();
    let format = layout_format(&wanted).ok_or_else(|| {
        let known: Vec<String> = layout_formats().map(|f| format!("{} (.{})", f.name(), f.extension())).collect();
        Failure::usage(format!("{wanted:?} is not a layout format; use --to, or an output that ends in one of {}", known.join(", ")))
    })?;
    for lost in format.loses(&layout) {
        context.console.warn(&format!("{} cannot hold {lost}", format.name()));
    }
    args.out.write(path, format.write(&layout).context(&args.layout)?.as_bytes())?;
    let text = format!("{}: {} antennas", path.display(), layout.n_ant());
    Ok(Outcome::new(json!({ "output": path, "n_antennas": layout.n_ant() }), text).wrote(path))
}
