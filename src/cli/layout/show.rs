//! `layout show`: describe a layout.

use super::figures;
use super::ghosts::GhostArgs;
use super::told::Told;
use crate::cli::context::Outcome;
use crate::cli::failure::{Failure, Result, ensure};
use crate::cli::options::{OutputArgs, load_array, load_layout};
use crate::cli::picture;
use crate::cli::text::round;
use crate::simulate::TrackOptions;
use cittert_arrays::quantity::{Frequency, Length};
use cittert_arrays::{ArrayLayout, CoveragePlan, FigureOptions, LayoutFrame};
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Options of `layout show`.
#[derive(Debug, Args)]
pub struct ShowArgs {
    /// Name of a built-in layout, or a layout file.
    #[arg(value_name = "LAYOUT")]
    layout: String,
    /// Frequency for which resolution, largest scale and side lobes are computed.
    #[arg(long, value_name = "FREQ")]
    freq: Option<Frequency>,
    /// Place to which each element has a cable: the name of an antenna, or X,Y or X,Y,Z such as 0m,0m.
    #[arg(long, value_name = "PLACE", allow_hyphen_values = true)]
    hub: Option<String>,
    /// Draw the antennas into this PNG file.
    #[arg(long, value_name = "PNG")]
    png: Option<PathBuf>,
    /// Replace a picture that exists.
    #[arg(long)]
    overwrite: bool,
    #[command(flatten)]
    figures: FigureOptions,
    /// Also give the figures with any one (1) or any two (2) elements lost.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=2), help_heading = "Figures of merit")]
    lost: u8,
    #[command(flatten)]
    ghosts: GhostArgs,
    #[command(flatten, next_help_heading = "Track of all figures and the shadows")]
    track: TrackOptions,
}

/// Describe the layout, and draw it if asked to.
///
/// # Errors
/// The layout or an option is wrong, or an error of the file system.
pub(super) fn run(args: &ShowArgs) -> Result<Outcome> {
    args.ghosts.check(args.freq.is_some())?;
    let layout = if args.freq.is_some() { load_array(&args.layout)? } else { load_layout(&args.layout)? };
    let mut told = Told::default();
    extent(&layout, args, &mut told)?;
    let track = (args.track != TrackOptions::default()).then(|| args.track.plan(&layout).map_err(Failure::call)).transpose()?;
    let plan = track.as_ref().map(|t| &t.plan);
    let mut map = None;
    match args.freq {
        Some(freq) => {
            figures::tell(&layout, freq, &args.figures, plan, &mut told)?;
            map = args.ghosts.tell((&layout, &args.layout), (freq, &args.figures, plan), args.overwrite, &mut told)?;
            if args.lost > 0 {
                figures::tell_losses(&layout, freq, &args.figures, args.lost > 1, &mut told)?;
            }
        }
        None => {
            let unused = args.figures == FigureOptions::default() && args.lost == 0;
            ensure!(unused, Failure::usage("the figures of merit need --freq"));
        }
    }
    if let Some(plan) = plan {
        shadows(&layout, args, plan, &mut told)?;
    }
    if let Some(source) = &layout.source {
        told.line("source", source);
    }
    let mut outcome = told.outcome();
    if let Some(file) = map {
        outcome = outcome.wrote(file);
    }
    if let Some(png) = &args.png {
        let out = OutputArgs { output: png.clone(), overwrite: args.overwrite };
        out.claim([png], [&args.layout])?;
        out.write(png, &picture::layout(&layout)?)?;
        outcome = outcome.wrote(png);
    }
    Ok(outcome)
}

fn extent(layout: &ArrayLayout, args: &ShowArgs, told: &mut Told) -> Result<()> {
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
    let cable_m = layout.cable_m();
    told.add(figures::extent_json(layout));
    told.heading(format_args!("{} ({} antennas, {} baselines)", layout.name, extent.n_antennas, extent.n_baselines));
    told.line("frame", frame);
    told.line("baselines", format_args!("{:.9} to {:.9}", Length(round(extent.shortest_m)), Length(round(extent.longest_m))));
    let mut cables = format!("{:.9} from antenna to antenna", Length(round(cable_m)));
    if let Some(hub) = &args.hub {
        let to_hub = layout.cable_to_m(place(hub, layout)?);
        told.add(json!({ "cable_to_hub_m": to_hub }));
        cables += &format!(", {:.9} to the hub {hub}", Length(round(to_hub)));
    }
    told.line("cables", cables);
    Ok(())
}

/// The position of an antenna, or the coordinates that a text gives.
fn place(text: &str, layout: &ArrayLayout) -> Result<[f64; 3]> {
    if let Some(i) = layout.index_of(text) {
        return Ok(layout.antennas()[i].position_m);
    }
    let wrong =
        |why: String| Failure::usage(format!("--hub is {text:?}, expected the name of an antenna, or X,Y or X,Y,Z such as 0m,0m{why}"));
    let parts: Vec<f64> =
        text.split(',').map(|p| p.parse::<Length>().map(Length::si)).collect::<Result<_, _>>().map_err(|e| wrong(format!(": {e}")))?;
    match parts.as_slice() {
        [x, y] => Ok([*x, *y, 0.0]),
        [x, y, z] => Ok([*x, *y, *z]),
        _ => Err(wrong(String::new())),
    }
}

/// Shadows over a track. Where a diameter is not known, a track is for the figures alone.
fn shadows(layout: &ArrayLayout, args: &ShowArgs, plan: &CoveragePlan, told: &mut Told) -> Result<()> {
    if args.freq.is_some() && layout.antennas().iter().any(|a| a.diameter_m.is_none()) {
        told.line("shadows", "not known: the layout gives no diameters");
        return Ok(());
    }
    let s = layout.shadowing(plan)?;
    told.add(json!({ "shadowed_fraction": s.fraction, "shadowed_at_once": s.most_at_once }));
    told.line(
        "shadows",
        format_args!("{:.2} % of the antennas and times, at most {} antennas at once", 100.0 * s.fraction, s.most_at_once),
    );
    Ok(())
}
