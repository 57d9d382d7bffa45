//! `layout make`: write a generated layout.

use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Failure, Result};
use crate::cli::options::{NOTHING, OutputArgs};
use cittert_arrays::{GenerateOptions, LAYOUT_KINDS, LayoutKind};
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use serde_json::json;

/// Options of `layout make`.
#[derive(Debug, Args)]
pub struct MakeArgs {
    /// Kind of the layout; `layout make --help` lists them.
    #[arg(value_name = "KIND", value_parser = kinds())]
    kind: String,
    #[command(flatten)]
    options: GenerateOptions,
    #[command(flatten)]
    out: OutputArgs,
}

/// The kinds with their descriptions, for the help.
fn kinds() -> impl TypedValueParser {
    let value = |kind: &LayoutKind| {
        let options: Vec<String> = kind.options().filter(|o| *o != "seed").map(|o| format!("--{o}")).collect();
        let takes = if options.is_empty() { String::new() } else { format!(" ({})", options.join(", ")) };
        PossibleValue::new(kind.name).help(format!("{}{takes}", kind.about))
    };
    PossibleValuesParser::new(LAYOUT_KINDS.iter().map(value))
}

/// Make the layout and write it as TOML.
///
/// # Errors
/// An option that the kind cannot take, or an error of the file system.
pub(super) fn run(args: &MakeArgs, _: &Context) -> Result<Outcome> {
    let path = &args.out.output;
    if path.extension().is_none_or(|e| e != "toml") {
        return Err(Failure::usage(format!(
            "-o {}: name a file that ends in .toml; `layout convert` writes other formats",
            path.display()
        )));
    }
    args.out.claim([path], NOTHING)?;
    let kind = LayoutKind::find(&args.kind)?;
    let layout = kind.layout(&args.options).map_err(|e| Failure::call(e.into()))?;
    args.out.write(path, layout.to_toml().as_bytes())?;
    let extent = layout.extent();
    let text = format!(
        "{}: {} elements, baselines from {:.9} to {:.9}",
        path.display(),
        extent.n_antennas,
        cittert_arrays::quantity::Length(crate::cli::text::round(extent.shortest_m)),
        cittert_arrays::quantity::Length(crate::cli::text::round(extent.longest_m))
    );
    let json = json!({
        "output": path, "kind": kind.name, "n_antennas": extent.n_antennas, "seed": args.options.seed,
        "smallest_spacing_m": extent.shortest_m, "longest_m": extent.longest_m, "source": layout.source,
    });
    Ok(Outcome::new(json, text).wrote(path))
}
