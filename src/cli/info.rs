//! `info`: what is in a file.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Result};
use super::kind::{FileKind, kind_of};
use super::options::load_layout;
use super::text::{angle, number};
use cittert_arrays::astrometry::format_utc;
use cittert_arrays::quantity::{Duration, Frequency, Length};
use cittert_arrays::{BuiltinLayout, Image};
use cittert_formats::info::{ImageInfo, VisibilityInfo};
use clap::Args;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Options of `info`.
#[derive(Debug, Args)]
pub struct InfoArgs {
    /// Visibility set, image or layout.
    #[arg(value_name = "FILE")]
    file: PathBuf,
}

/// Tell what is in a file.
///
/// # Errors
/// A file that is nothing we read, or broken.
pub fn run(args: &InfoArgs, _context: &Context) -> Result<Outcome> {
    let name = args.file.to_string_lossy();
    let layout = || -> Result<Outcome> {
        let layout = load_layout(&name)?;
        let e = layout.extent();
        let names: Vec<&str> = layout.antennas().iter().map(|a| a.name.as_str()).collect();
        let text = format!("layout {}: {} antennas, baselines {} to {}", layout.name, e.n_antennas, Length(e.shortest_m), Length(e.longest_m));
        let json = json!({
            "kind": "layout", "name": layout.name, "n_antennas": e.n_antennas, "antenna_names": names,
            "shortest_m": e.shortest_m, "longest_m": e.longest_m, "source": layout.source,
        });
        Ok(Outcome::new(json, text))
    };
    if BuiltinLayout::find(&name).is_some() && !args.file.exists() {
        return layout();
    }
    match kind_of(&args.file)? {
        FileKind::Layout => layout(),
        FileKind::Image => image(&cittert_formats::open_image(&args.file)?),
        FileKind::Visibilities => {
            let mut source = cittert_formats::open_visibilities(&args.file)?;
            let info = VisibilityInfo::of(source.as_mut()).context(format!("reading {}", args.file.display()))?;
            visibilities(&info)
        }
    }
}

fn with_kind(kind: &str, value: Value) -> Value {
    let mut value = value;
    value["kind"] = kind.into();
    value
}

fn image(image: &Image) -> Result<Outcome> {
    let info = ImageInfo::of(image);
    let json = with_kind("image", serde_json::to_value(&info)?);
    let g = &image.grid;
    let mut lines = vec![
        format!("image {:?} in {}, {} x {} pixels of {}", image.object, image.unit.bunit(), g.n_l, g.n_m, angle(g.cell_rad)),
        format!("{} channel(s), {}", image.spectrum.n_chan(), Frequency(image.spectrum.mean_hz())),
    ];
    if let Some(b) = image.beams.first() {
        lines.push(format!("beam {} x {}, position angle {:.1} deg", angle(b.bmaj_rad), angle(b.bmin_rad), b.bpa_rad.to_degrees()));
    }
    Ok(Outcome::new(json, lines.join("\n")))
}

fn visibilities(i: &VisibilityInfo) -> Result<Outcome> {
    let json = with_kind("visibilities", serde_json::to_value(i)?);
    let (low, high) = i.freq_hz.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), f| (a.min(*f), b.max(*f)));
    let time = |jd: f64| format_utc(jd).unwrap_or_else(|_| format!("JD {jd}"));
    let mut lines = vec![
        format!("{} ({})", i.telescope, i.instrument),
        format!("antennas      {} ({} with data): {}", i.n_antennas, i.n_antennas_data, i.antenna_names.join(" ")),
        format!("rows          {} ({} baselines, {} times of {})", i.n_blts, i.n_bls, i.n_times, Duration(i.integration_s)),
        format!("time          {} to {}", time(i.time_jd[0]), time(i.time_jd[1])),
        format!("channels      {}, {} to {}", i.n_freqs, Frequency(low), Frequency(high)),
        format!("baselines     {} to {}", Length(super::text::round(i.shortest_baseline_m)), Length(super::text::round(i.longest_baseline_m))),
        format!("unit          {}", i.unit),
        format!("flagged       {:.3} %", 100.0 * i.flagged_fraction),
    ];
    for c in &i.phase_centers {
        let place = match (c.ra_rad, c.dec_rad) {
            (Some(ra), Some(dec)) => format!("RA {:.6} deg, Dec {:.6} deg ({})", ra.to_degrees(), dec.to_degrees(), c.frame),
            _ => c.kind.to_owned(),
        };
        lines.push(format!("phase centre  {}: {place}", c.name));
    }
    for p in &i.polarizations {
        let (n, mean) = (i.n_unflagged.get(p).copied().unwrap_or(0), i.mean_abs_unflagged.get(p).copied().unwrap_or(f64::NAN));
        lines.push(format!("{p:13} {n} unflagged, mean |V| {}", number(mean)));
    }
    if let Some(t) = i.pedestal_k {
        lines.push(format!("pedestal      {t} K was removed from the scene"));
    }
    if i.n_not_finite > 0 {
        lines.push(format!("not finite    {} unflagged data have no finite value or weight; imaging leaves them out", i.n_not_finite));
    }
    Ok(Outcome::new(json, lines.join("\n")))
}
