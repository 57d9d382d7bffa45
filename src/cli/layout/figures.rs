//! The figures of merit of a layout, as JSON and as text.

use super::told::Told;
use crate::cli::failure::{Failure, Result};
use crate::cli::text::{angle, round};
use cittert_arrays::quantity::{Duration, Frequency, Length};
use cittert_arrays::{
    ApertureFrom, ArrayLayout, CoveragePlan, FigureOptions, Ghosts, LOSS_FIGURES, LayoutFigures, LossFigures, LossSummary, Weighting,
};
use serde_json::{Map, Value, json};

/// Most elements whose loss is told as text. JSON has all.
const RANKED: usize = 5;

/// Figures at a frequency or over a band.
pub(super) fn tell(
    layout: &ArrayLayout,
    freq: Frequency,
    options: &FigureOptions,
    track: Option<&CoveragePlan>,
    told: &mut Told,
) -> Result<()> {
    let f = match track {
        Some(plan) => layout.figures_over(freq.si(), options, plan),
        None => layout.figures_with(freq.si(), options),
    };
    let f = f.map_err(|e| Failure::call(e.into()))?;
    told.add(json(&f, freq));
    told.heading(heading(freq, options, track.map(|_| &f)));
    lines(&f, told);
    Ok(())
}

/// The figures as the keys of an object.
pub(super) fn json(f: &LayoutFigures, freq: Frequency) -> Value {
    json!({
        "freq_hz": freq.si(), "bmaj_rad": f.bmaj_rad, "bmin_rad": f.bmin_rad, "bpa_rad": f.bpa_rad,
        "beam_equivalent_rad": (f.bmaj_rad * f.bmin_rad).sqrt(),
        "half_power_max_rad": f.half_power_rad[0], "half_power_min_rad": f.half_power_rad[1],
        "half_power_equivalent_rad": f.half_power_equivalent_rad,
        "largest_scale_rad": f.largest_scale_rad,
        "within": f.within, "within_rad": f.within_rad, "aperture_m": f.aperture.diameter_m, "aperture_from": from(f.aperture.from),
        "psl_within_db": f.psl_within_db, "rms_sidelobe_within": f.rms_sidelobe_within, "lowest_sidelobe_within": f.lowest_sidelobe_within,
        "field": f.field, "field_rad": f.field_rad,
        "psl_db": f.psl_db, "rms_sidelobe": f.rms_sidelobe, "lowest_sidelobe": f.lowest_sidelobe,
        "uv_fill": f.uv_fill, "uv_fill_cell_m": f.uv_fill_cell_m, "radial_uniformity": f.radial_uniformity,
        "azimuthal_uniformity": f.azimuthal_uniformity, "largest_hole_m": f.largest_hole_m,
        "redundancy": f.redundancy, "unique_baselines": f.unique_baselines,
        "alias_free_field_rad": f.ghosts.alias_free_field_rad, "ghosts_lm": f.ghosts.directions, "grid_steps_wavelengths": f.ghosts.steps,
        "n_integrations": f.n_integrations, "time_s": f.time_s, "point_source_jy": f.point_source_jy, "delta_t_k": f.delta_t_k,
    })
}

/// Elements, baselines and cable as the keys of an object.
pub(super) fn extent_json(layout: &ArrayLayout) -> Value {
    let extent = layout.extent();
    json!({
        "name": layout.name, "n_antennas": extent.n_antennas, "n_baselines": extent.n_baselines,
        "shortest_m": extent.shortest_m, "longest_m": extent.longest_m, "source": layout.source,
        "smallest_spacing_m": extent.shortest_m, "cable_m": layout.cable_m(),
        "frame": if layout.site().is_some() { "enu" } else { "boresight" },
        "antenna_names": layout.antennas().iter().map(|a| a.name.as_str()).collect::<Vec<_>>(),
    })
}

/// Band, weights and directions for which the figures hold; `over` holds those of a track.
pub(super) fn heading(freq: Frequency, options: &FigureOptions, over: Option<&LayoutFigures>) -> String {
    let weights = match (options.weighting, options.robust) {
        (Weighting::Natural, _) => "natural weights".to_owned(),
        (Weighting::Uniform, _) => "uniform weights".to_owned(),
        (Weighting::Briggs, robust) => format!("briggs weights of robustness {}", robust.unwrap_or(0.0)),
    };
    let band = match (options.bandwidth, options.channels) {
        (Some(width), channels) if channels > 1 => format!(", {channels} channels over {width}"),
        _ => String::new(),
    };
    let seen = over.map_or_else(
        || "one integration towards the zenith or boresight".to_owned(),
        |f| format!("a track of {} integrations, {:.3} in all", f.n_integrations, Duration(round(f.time_s))),
    );
    format!("at {freq}{band}, {weights}, {seen}:")
}

/// The directions in which side lobes count.
pub(super) fn range(f: &LayoutFigures) -> String {
    let length = Length(round(f.aperture.diameter_m));
    format!("from the first minimum to {} wavelengths over the {}, {length:.9}", f.within, f.aperture.from.in_words())
}

/// How far the whole field reaches.
fn field(f: &LayoutFigures) -> String {
    if f.field_rad < 1.0 {
        format!("to {:.0} wavelengths over the {}", f.field, f.aperture.from.in_words())
    } else {
        "to the horizon".to_owned()
    }
}

/// How the aperture is known, as a word.
fn from(known: ApertureFrom) -> &'static str {
    match known {
        ApertureFrom::Options => "options",
        ApertureFrom::Layout => "layout",
        ApertureFrom::LongestBaseline => "longest-baseline",
    }
}

fn lines(f: &LayoutFigures, told: &mut Told) {
    told.line(
        "resolution",
        format_args!("{} x {}, position angle {:.1} deg", angle(f.bmaj_rad), angle(f.bmin_rad), f.bpa_rad.to_degrees()),
    );
    told.line(
        "half power",
        format_args!("{} to {}, equivalent {}", angle(f.half_power_rad[1]), angle(f.half_power_rad[0]), angle(f.half_power_equivalent_rad)),
    );
    told.line("largest", angle(f.largest_scale_rad));
    told.line("side lobes", format_args!("peak {:.1} dB, rms {:.4}", f.psl_within_db, f.rms_sidelobe_within));
    told.line("", range(f));
    told.line("whole field", format_args!("peak {:.1} dB, rms {:.4}, {}", f.psl_db, f.rms_sidelobe, field(f)));
    told.line(
        "u-v plane",
        format_args!(
            "{:.2} % filled in cells of {:.9}, redundancy {:.2}, {} unique baselines",
            100.0 * f.uv_fill,
            Length(round(f.uv_fill_cell_m)),
            f.redundancy,
            f.unique_baselines
        ),
    );
    told.line(
        "",
        format_args!(
            "evenness {:.2} radial, {:.2} azimuthal; largest hole {:.9}",
            f.radial_uniformity,
            f.azimuthal_uniformity,
            Length(round(f.largest_hole_m))
        ),
    );
    told.line("ghosts", ghosts(&f.ghosts));
    if let (Some(jy), Some(kelvin)) = (f.point_source_jy, f.delta_t_k) {
        told.line("noise", format_args!("{kelvin:.4} K in a beam, {jy:.4e} Jy of a point source, in {:.3}", Duration(round(f.time_s))));
    }
}

fn ghosts(ghosts: &Ghosts) -> String {
    match ghosts.directions.first() {
        Some([l, m]) => {
            format!(
                "nearest {} from the source; the alias-free field is {} wide",
                angle(l.hypot(*m).min(1.0).asin()),
                angle(ghosts.alias_free_field_rad)
            )
        }
        None if ghosts.steps.is_empty() => "none: the spacings are not regular".to_owned(),
        None => format!("none around the zenith; the alias-free field is {} wide", angle(ghosts.alias_free_field_rad)),
    }
}

/// Figures with lost elements.
pub(super) fn tell_losses(layout: &ArrayLayout, freq: Frequency, options: &FigureOptions, pairs: bool, told: &mut Told) -> Result<()> {
    let losses = layout.figures_with_losses(freq.si(), options, pairs).map_err(|e| Failure::call(e.into()))?;
    let name = |i: usize| layout.antennas()[i].name.as_str();
    let ranking: Vec<Value> = losses.ranking.iter().map(|(i, f)| json!({ "antenna": name(*i), "figures": object(f) })).collect();
    told.add(json!({ "lost_none": object(&losses.intact), "lost_one": summary(&losses.one, 1, name), "lost_ranking": ranking }));
    told.heading("with lost elements, natural weights at one frequency, one integration towards the zenith or boresight:");
    told.line("intact", in_words(&losses.intact));
    for (count, label, s) in [(1, "one lost", Some(&losses.one)), (2, "two lost", losses.two.as_ref())] {
        let Some(s) = s else { continue };
        if count == 2 {
            told.add(json!({ "lost_two": summary(s, 2, name) }));
        }
        told.line(label, format_args!("worst {}", in_words(&s.worst)));
        told.line("", format_args!("mean  {}", in_words(&s.mean)));
    }
    let costly: Vec<String> = losses.ranking.iter().take(RANKED).map(|(i, f)| format!("{} ({:.2} dB)", name(*i), f[3])).collect();
    told.line("most costly", format_args!("{}: peak side lobe without each", costly.join(", ")));
    Ok(())
}

fn object(figures: &LossFigures) -> Value {
    Value::Object(LOSS_FIGURES.iter().zip(figures).map(|((name, _), value)| ((*name).to_owned(), json!(value))).collect::<Map<_, _>>())
}

fn summary<'a>(s: &LossSummary, count: usize, name: impl Fn(usize) -> &'a str) -> Value {
    let worst: Vec<&str> = s.worst_for_psl.iter().take(count).map(|i| name(*i)).collect();
    json!({ "worst": object(&s.worst), "mean": object(&s.mean), "worst_for_psl": worst })
}

fn in_words(f: &LossFigures) -> String {
    let [major, minor, _, psl, rms, fill, _, unique, noise] = f;
    format!(
        "beam {} x {}, side lobes {psl:.1} dB, rms {rms:.4}, {:.2} % filled, {unique:.0} baselines, noise x {noise:.3}",
        angle(*major),
        angle(*minor),
        100.0 * fill
    )
}
