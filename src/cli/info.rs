//! `info`: the contents of a file.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Result};
use super::options::{SetFiles, load_layout};
use super::text::{angle, number, round};
use cittert_arrays::BuiltinLayout;
use cittert_arrays::astrometry::format_utc;
use cittert_arrays::quantity::{Duration, Frequency, Length};
use cittert_formats::info::{GainInfo, ImageInfo, VisibilityInfo};
use cittert_formats::{Contents, LayoutInfo};
use clap::Args;
use std::path::PathBuf;

/// Options of `info`.
#[derive(Debug, Args)]
pub struct InfoArgs {
    /// Visibility set, image, gain table, source list or layout (file or built-in name). Several files, a quoted pattern ('day*.uvh5') or a
    /// list (@files.txt) are visibilities of one set.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
}

/// Describe the contents of a file.
///
/// # Errors
/// A file of no known format, or a damaged file.
pub fn run(args: &InfoArgs, context: &Context) -> Result<Outcome> {
    let input = SetFiles::of(&args.files)?;
    let contents = match input.one() {
        Some(one) => {
            let name = one.to_string_lossy();
            let is_builtin = BuiltinLayout::find(&name).is_some() && !one.exists();
            if is_builtin { Contents::Layout(LayoutInfo::of(&load_layout(&name)?)) } else { Contents::of(one)? }
        }
        None => {
            let info = VisibilityInfo::of(input.open(context)?.as_mut()).context(format!("reading {input}"))?;
            Contents::Visibilities { format: "several files", info: Box::new(info) }
        }
    };
    let lines = match &contents {
        Contents::Visibilities { format, info } => visibilities(format, info),
        Contents::Image { format, info } => image(format, info),
        Contents::Gains { format, info } => gains(format, info),
        Contents::Layout(i) => vec![format!(
            "layout {}: {} antennas, {} baselines of {:.9} to {:.9}",
            i.name,
            i.n_antennas,
            i.n_baselines,
            Length(round(i.shortest_m)),
            Length(round(i.longest_m))
        )],
        Contents::Sources(i) => {
            vec![format!("source list: {} sources ({} Gaussians), total flux {} Jy", i.n_sources, i.n_gaussians, number(i.total_flux_jy))]
        }
    };
    Ok(Outcome::new(serde_json::to_value(&contents)?, lines.join("\n")))
}

fn image(format: &str, i: &ImageInfo) -> Vec<String> {
    let mut lines = vec![
        format!("{format} of {:?} in {}, {} x {} pixels of {}", i.object, i.unit, i.size[0], i.size[1], angle(i.cell_rad)),
        format!("range         {} to {}, rms {}", number(i.range[0]), number(i.range[1]), number(i.rms)),
        format!(
            "channels      {}, first {}",
            i.freq_hz.len(),
            i.freq_hz.first().map_or(String::new(), |f| format!("{:.9}", Frequency(*f)))
        ),
        format!("polarisation  {}", i.polarizations.join(" ")),
    ];
    if let Some([major, minor, pa]) = i.beam {
        lines.push(format!("beam          {} x {}, position angle {:.1} deg", angle(major), angle(minor), pa.to_degrees()));
    }
    lines
}

fn gains(format: &str, i: &GainInfo) -> Vec<String> {
    vec![
        format!("{format} gains of {}: {}", i.telescope, i.mode),
        format!("antennas      {}: {}", i.antenna_names.len(), i.antenna_names.join(" ")),
        format!("intervals     {} of {:.9}", i.n_times, Duration(i.interval_s)),
        format!("channels      {}, feeds {}", i.freq_hz.len(), i.feeds.join(" ")),
        format!("reference     {}", i.refant.as_deref().unwrap_or("none")),
        format!("flagged       {:.3} %", 100.0 * i.flagged_fraction),
        format!("amplitude     mean {}; phase rms {:.2} deg", number(i.mean_amplitude), i.rms_phase_rad.to_degrees()),
    ]
}

fn visibilities(format: &str, i: &VisibilityInfo) -> Vec<String> {
    let (low, high) = i.freq_hz.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), f| (a.min(*f), b.max(*f)));
    let time = |jd: f64| format_utc(jd).unwrap_or_else(|_| format!("JD {jd}"));
    let mut lines = vec![
        format!("{format} of {} ({})", i.telescope, i.instrument),
        format!("antennas      {} ({} with data): {}", i.n_antennas, i.n_antennas_data, i.antenna_names.join(" ")),
        format!("rows          {} ({} baselines, {} times of {:.9})", i.n_blts, i.n_bls, i.n_times, Duration(round(i.integration_s))),
        format!("time          {} to {}", time(i.time_jd[0]), time(i.time_jd[1])),
        format!("channels      {}, {:.9} to {:.9}", i.n_freqs, Frequency(low), Frequency(high)),
        format!("baselines     {:.9} to {:.9}", Length(round(i.shortest_baseline_m)), Length(round(i.longest_baseline_m))),
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
    if let Some(pattern) = &i.element_pattern {
        lines.push(format!("pattern       {pattern}"));
    }
    if let Some(range) = &i.scene_range {
        lines.push(format!("scene range   {range}"));
    }
    if let Some([l, m, range]) = i.focus {
        lines.push(format!("focus         l {l:.6}, m {m:.6}, at {:.9}", Length(range)));
    }
    if let Some(t) = i.antenna_temperature_k {
        lines.push(format!("total power   {t} K"));
    }
    if i.n_not_finite > 0 {
        lines.push(format!(
            "not finite    {} unflagged visibilities have no finite value or weight; imaging leaves them out",
            i.n_not_finite
        ));
    }
    lines
}
