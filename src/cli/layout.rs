//! `layout`: list, describe and convert antenna layouts.

use super::context::{Context, Outcome, subcommands};
use super::failure::{Failure, Result};
use super::optimize::{self, OptimizeArgs};
use super::options::{OutputArgs, load_layout};
use super::picture;
use super::text::{angle, round};
use cittert_arrays::quantity::{Frequency, Length};
use cittert_arrays::{ArrayLayout, BUILTIN_LAYOUTS, LayoutFrame};
use cittert_formats::layout_formats;
use cittert_formats::layouts::layout_format;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

subcommands! {
    /// The subcommands of `layout`.
    LayoutCommand {
        /// List the built-in layouts.
        List(ListArgs) => |_, _| Ok(list());
        /// Describe a layout: antennas, baselines, resolution, side lobes.
        Show(ShowArgs) => |args, _| show(args);
        /// Write a layout in another format, chosen by the ending of the output (.toml, .cfg, .txt, .csv, .ant).
        Convert(ConvertArgs) => convert;
        /// Find the positions of elements, or choose among pads, so that the side lobes of the beam or other figures are low.
        Optimize(Box<OptimizeArgs>) => optimize::run;
    }
}

/// `layout list` has no options.
#[derive(Debug, Args)]
pub struct ListArgs {}

/// Options of `layout show`.
#[derive(Debug, Args)]
pub struct ShowArgs {
    /// Name of a built-in layout, or a layout file.
    #[arg(value_name = "LAYOUT")]
    layout: String,
    /// Frequency for which resolution, largest scale and side lobes are computed.
    #[arg(long, value_name = "FREQ")]
    freq: Option<Frequency>,
    /// Draw the antennas into this PNG file.
    #[arg(long, value_name = "PNG")]
    png: Option<PathBuf>,
    /// Replace a picture that exists.
    #[arg(long)]
    overwrite: bool,
}

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

fn show(args: &ShowArgs) -> Result<Outcome> {
    let layout = load_layout(&args.layout)?;
    let extent = layout.extent();
    let frame = match layout.frame {
        LayoutFrame::Boresight => "boresight (aperture plane)".to_owned(),
        LayoutFrame::EastNorthUp(s) => format!(
            "east, north, up at {:.5} deg latitude, {:.5} deg longitude, {:.1} m",
            s.latitude_rad.to_degrees(),
            s.longitude_rad.to_degrees(),
            s.altitude_m
        ),
    };
    let mut json = json!({
        "name": layout.name, "n_antennas": extent.n_antennas, "n_baselines": extent.n_baselines,
        "shortest_m": extent.shortest_m, "longest_m": extent.longest_m, "source": layout.source,
        "frame": if layout.site().is_some() { "enu" } else { "boresight" },
        "antenna_names": layout.antennas().iter().map(|a| a.name.as_str()).collect::<Vec<_>>(),
    });
    let mut lines = vec![
        format!("{} ({} antennas, {} baselines)", layout.name, extent.n_antennas, extent.n_baselines),
        format!("frame        {frame}"),
        format!("baselines    {:.9} to {:.9}", Length(round(extent.shortest_m)), Length(round(extent.longest_m))),
    ];
    if let Some(freq) = args.freq {
        figures(&layout, freq, &mut json, &mut lines)?;
    }
    if let Some(source) = &layout.source {
        lines.push(format!("source       {source}"));
    }
    let mut outcome = Outcome::new(json, lines.join("\n"));
    if let Some(png) = &args.png {
        let out = OutputArgs { output: png.clone(), overwrite: args.overwrite };
        out.claim([png], [&args.layout])?;
        out.write(png, &picture::layout(&layout)?)?;
        outcome = outcome.wrote(png);
    }
    Ok(outcome)
}

fn figures(layout: &ArrayLayout, freq: Frequency, json: &mut serde_json::Value, lines: &mut Vec<String>) -> Result<()> {
    let f = layout.figures(freq.si())?;
    let more = json!({
        "freq_hz": freq.si(), "bmaj_rad": f.bmaj_rad, "bmin_rad": f.bmin_rad, "bpa_rad": f.bpa_rad,
        "largest_scale_rad": f.largest_scale_rad, "psl_db": f.psl_db, "rms_sidelobe": f.rms_sidelobe,
        "uv_fill": f.uv_fill, "uv_fill_cell_m": f.uv_fill_cell_m, "redundancy": f.redundancy, "unique_baselines": f.unique_baselines,
    });
    if let (Some(all), Some(more)) = (json.as_object_mut(), more.as_object()) {
        all.extend(more.clone());
    }
    lines.push(format!("at {freq}, natural weights, one integration towards the zenith or boresight:"));
    lines.push(format!("resolution   {} x {}, position angle {:.1} deg", angle(f.bmaj_rad), angle(f.bmin_rad), f.bpa_rad.to_degrees()));
    lines.push(format!("largest      {}", angle(f.largest_scale_rad)));
    lines.push(format!("side lobes   peak {:.1} dB, rms {:.4}", f.psl_db, f.rms_sidelobe));
    lines.push(format!(
        "u-v plane    {:.2} % filled in cells of {:.9}, redundancy {:.2}, {} unique baselines",
        100.0 * f.uv_fill,
        Length(round(f.uv_fill_cell_m)),
        f.redundancy,
        f.unique_baselines
    ));
    Ok(())
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
    args.out.write(path, format.write(&layout)?.as_bytes())?;
    let text = format!("{}: {} antennas", path.display(), layout.n_ant());
    Ok(Outcome::new(json!({ "output": path, "n_antennas": layout.n_ant() }), text).wrote(path))
}
