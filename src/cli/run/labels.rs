//! How the report shows the results of a step: for each key its label and its unit. Keys that are not here stay in `metrics.json`.

use serde_json::Value;

/// How a value is shown.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Show {
    /// A whole number, in groups of three digits.
    Count,
    /// Three significant digits.
    Number,
    /// A fraction as per cent.
    Percent,
    /// In the unit of the image.
    Brightness,
    /// In K.
    Kelvin,
    /// In m, km or mm.
    Length,
    /// An angle on the sky in rad.
    Angle,
    /// A phase in rad, as degrees.
    Phase,
    Decibel,
    Text,
    /// The reason why an iteration stopped.
    Stop,
    /// True or false.
    YesNo,
    /// Axes and position angle, from `bmaj_rad`, `bmin_rad` and `bpa_rad`.
    Beam,
    /// Pixels along each side and their size, from `size` and `cell_rad`.
    Pixels,
    /// From `shift_l_rad` and `shift_m_rad`.
    Shift,
}

/// One row of the table: the command whose key it is (empty for all others), the key, its label, and how it is shown.
struct Label(&'static str, &'static str, &'static str, Show);

/// In the order of the report.
const LABELS: &[Label] = &[
    Label("selfcal", "accepted", "Accepted", Show::YesNo),
    Label("selfcal", "verdict", "Verdict", Show::Text),
    Label("", "algorithm", "Algorithm", Show::Text),
    Label("", "n_antennas", "Antennas", Show::Count),
    Label("", "n_baselines", "Baselines", Show::Count),
    Label("", "shortest_m", "Shortest baseline", Show::Length),
    Label("", "longest_m", "Longest baseline", Show::Length),
    Label("", "largest_scale_rad", "Largest structure that is seen", Show::Angle),
    Label("layout", "bmaj_rad", "Beam, natural weights", Show::Beam),
    Label("", "bmaj_rad", "Beam", Show::Beam),
    Label("", "size", "Image", Show::Pixels),
    Label("", "psl_db", "Highest side lobe, natural weights", Show::Decibel),
    Label("", "rms_sidelobe", "Rms of the side lobes, natural weights", Show::Percent),
    Label("", "uv_fill", "Share of the u-v plane that is filled", Show::Percent),
    Label("scene", "min", "Lowest brightness", Show::Brightness),
    Label("scene", "max", "Highest brightness", Show::Brightness),
    Label("scene", "mean", "Mean brightness", Show::Brightness),
    Label("scene", "rays", "Rays traced", Show::Count),
    Label("mask", "cells_hit", "Cells with a visibility", Show::Count),
    Label("mask", "disc_fraction", "Share of the disc of the longest baseline that is filled", Show::Percent),
    Label("mask", "visibilities_per_cell", "Visibilities in a filled cell", Show::Number),
    Label("mask", "n_outside", "Visibilities outside of the grid", Show::Count),
    Label("", "n_visibilities", "Visibilities", Show::Count),
    Label("", "n_used", "Visibilities used", Show::Count),
    Label("", "pedestal_k", "Constant removed before the transform", Show::Kelvin),
    Label("corrupt", "rms_phase_rad", "Phase errors put in, rms", Show::Phase),
    Label("corrupt", "rms_amplitude", "Amplitude errors put in, rms", Show::Percent),
    Label("corrupt", "n_intervals", "Intervals with their own errors", Show::Count),
    Label("selfcal", "/feeds/leakage_rms", "Leakages that were solved, rms", Show::Percent),
    Label("selfcal", "/feeds/leakage_sigma", "Their standard deviation", Show::Percent),
    Label("selfcal", "/feeds/cross_phase_rad", "Phase between the feeds", Show::Phase),
    Label("compare", "rms_phase_rad", "Phase error left, rms", Show::Phase),
    Label("compare", "max_abs_phase_rad", "Largest phase error left", Show::Phase),
    Label("compare", "rms_amplitude", "Amplitude error left, rms", Show::Percent),
    Label("compare", "error_over_grey_card", "Error over grey card", Show::Number),
    Label("compare", "nrmse", "NRMSE", Show::Number),
    Label("compare", "rms_difference", "Rms difference from the truth", Show::Brightness),
    Label("compare", "fidelity", "Fidelity index", Show::Number),
    Label("compare", "ssim", "SSIM", Show::Number),
    Label("compare", "peak_ratio", "Peak over that of the truth", Show::Number),
    Label("compare", "flux_ratio", "Flux over that of the truth", Show::Number),
    Label("compare", "shift_l_rad", "Shift of the image (l, m)", Show::Shift),
    Label("", "peak", "Peak brightness", Show::Brightness),
    Label("dirty", "robust_rms", "Robust rms", Show::Brightness),
    Label("", "dynamic_range", "Dynamic range", Show::Number),
    Label("", "chi2_per_datum", "Chi squared per datum", Show::Number),
    Label("", "residual_rms", "Rms of the residual", Show::Brightness),
    Label("", "residual_peak", "Peak of the residual", Show::Brightness),
    Label("selfcal", "n_rounds", "Rounds", Show::Count),
    Label("selfcal", "best_round", "Best round", Show::Count),
    Label("selfcal", "refant", "Reference antenna", Show::Text),
    Label("", "iterations", "Iterations", Show::Count),
    Label("", "major_cycles", "Major cycles", Show::Count),
    Label("", "stop_reason", "Stopped because", Show::Stop),
];

/// The rows of a step's results: label and value. `command` is the first word of its command line.
pub(super) fn rows(command: &str, json: &Value) -> Vec<(&'static str, String)> {
    let own = |key: &str| LABELS.iter().any(|l| l.0 == command && l.1 == key);
    let of_step = |l: &&Label| l.0 == command || (l.0.is_empty() && !own(l.1));
    LABELS.iter().filter(of_step).filter_map(|l| Some((l.2, shown(l.3, json, l.1)?))).collect()
}

fn shown(how: Show, json: &Value, key: &str) -> Option<String> {
    // A key with a slash is the path to a value within an object.
    let value = if key.starts_with('/') { json.pointer(key)? } else { json.get(key)? };
    let number = |key: &str| json.get(key).and_then(Value::as_f64).filter(|v| v.is_finite());
    let x = value.as_f64().filter(|v| v.is_finite());
    let unit = json.get("unit").and_then(Value::as_str).unwrap_or_default();
    Some(match how {
        Show::Count => grouped(x?),
        Show::Number => digits(x?),
        // Rounding errors are no errors of amplitude.
        Show::Percent => format!("{} %", digits(100.0 * x.filter(|v| v.abs() > 1e-9)?)),
        Show::Brightness => brightness(x?, unit),
        Show::Kelvin => format!("{} K", digits(x?)),
        Show::Length => length(x?),
        Show::Angle => angle(x?),
        Show::Phase => format!("{} deg", digits(x?.to_degrees())),
        Show::Decibel => format!("{:.1} dB", x?),
        Show::Text => value.as_str().filter(|s| !s.is_empty())?.to_owned(),
        Show::Stop => stop(value.as_str()?),
        Show::YesNo => (if value.as_bool()? { "yes" } else { "no" }).to_owned(),
        Show::Beam => beam(x?, number("bmin_rad")?, number("bpa_rad")?),
        Show::Pixels => {
            let side = |k: usize| value.get(k).and_then(Value::as_u64);
            format!("{} x {} pixels of {}", side(0)?, side(1)?, angle(number("cell_rad")?))
        }
        Show::Shift => format!("{}, {}", angle(x?), angle(number("shift_m_rad")?)),
    })
}

/// Three significant digits, without an exponent where it can be avoided.
pub(in crate::cli) fn digits(x: f64) -> String {
    let size = x.abs();
    // Rounding errors of sums of order one are told as zero.
    if size < 1e-12 {
        return "0".into();
    }
    if !(1e-4..1e7).contains(&size) {
        return format!("{x:.2e}");
    }
    let decimals = (2 - size.log10().floor() as i32).clamp(0, 6) as usize;
    format!("{x:.decimals$}")
}

/// A whole number with a space after each group of three digits.
pub(in crate::cli) fn grouped(x: f64) -> String {
    let digits = format!("{:.0}", x.abs());
    let mut out = String::new();
    for (k, c) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) && digits.len() > 4 {
            out.push('\u{202f}');
        }
        out.push(c);
    }
    if x < 0.0 { format!("-{out}") } else { out }
}

/// A brightness with its unit: kelvin as they are, janskys with a prefix.
pub(in crate::cli) fn brightness(x: f64, unit: &str) -> String {
    if !unit.starts_with("Jy") {
        return format!("{} {unit}", digits(x)).trim_end().to_owned();
    }
    let (factor, prefix) = [(1.0, ""), (1e-3, "m"), (1e-6, "\u{b5}")].into_iter().find(|p| x.abs() >= p.0).unwrap_or((1e-9, "n"));
    if x.abs() >= 1e3 { format!("{} k{unit}", digits(x / 1e3)) } else { format!("{} {prefix}{unit}", digits(x / factor)) }
}

/// The unit in which an angle is told: its size in rad, and its name.
fn angle_unit(rad: f64) -> (f64, &'static str) {
    let arcsec = std::f64::consts::PI / 648_000.0;
    let units = [(3600.0 * arcsec, "deg"), (60.0 * arcsec, "arcmin"), (arcsec, "arcsec"), (1e-3 * arcsec, "mas")];
    units.into_iter().find(|u| rad.abs() >= u.0).unwrap_or((1e-6 * arcsec, "\u{b5}as"))
}

/// An angle with three significant digits, in deg, arcmin, arcsec, mas or microarcseconds.
pub(in crate::cli) fn angle(rad: f64) -> String {
    let (unit, name) = angle_unit(rad);
    format!("{} {name}", digits(rad / unit))
}

fn beam(major: f64, minor: f64, position: f64) -> String {
    let (unit, name) = angle_unit(minor);
    format!("{} x {} {name} at {:.0} deg", digits(major / unit), digits(minor / unit), position.to_degrees())
}

/// A length with three significant digits, in km, m or mm.
pub(in crate::cli) fn length(m: f64) -> String {
    let (unit, name) = [(1e3, "km"), (1.0, "m")].into_iter().find(|u| m.abs() >= u.0).unwrap_or((1e-3, "mm"));
    format!("{} {name}", digits(m / unit))
}

/// The reason why an iteration stopped, in words.
fn stop(reason: &str) -> String {
    match reason {
        "niter" => "the largest number of iterations was reached",
        "nsigma" => "the peak of the residual reached its limit in units of the noise",
        "threshold" => "the peak of the residual reached the threshold",
        "max-major" => "the largest number of major cycles was reached",
        "converged" => "the solution converged",
        "stalled" => "it came no closer to its goals",
        other => other,
    }
    .to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn results_are_told_in_words_and_units() {
        let json = json!({
            "peak": 312.04, "unit": "K", "bmaj_rad": 9.0e-4, "bmin_rad": 8.4e-4, "bpa_rad": 0.21, "size": [512, 256], "cell_rad": 8e-4,
            "chi2_per_datum": 1.0234, "lambda": 0.1, "rms_phase_rad": 0.0244, "n_visibilities": 145_920,
        });
        let told = rows("clean", &json);
        let of = |label: &str| told.iter().find(|r| r.0 == label).map(|r| r.1.clone());
        assert_eq!(of("Peak brightness").unwrap(), "312 K");
        assert_eq!(of("Beam").unwrap(), "3.09 x 2.89 arcmin at 12 deg");
        assert_eq!(of("Image").unwrap(), "512 x 256 pixels of 2.75 arcmin");
        assert_eq!(of("Chi squared per datum").unwrap(), "1.02");
        assert_eq!(of("Visibilities").unwrap(), "145\u{202f}920");
        assert!(told.iter().all(|r| !r.0.contains('_')) && told.len() == 5, "{told:?}");
        assert_eq!(rows("compare", &json).iter().find(|r| r.0.starts_with("Phase error left")).unwrap().1, "1.40 deg");
        assert_eq!(rows("corrupt", &json).iter().find(|r| r.0.starts_with("Phase errors put in")).unwrap().1, "1.40 deg");
    }

    #[test]
    fn brightness_has_a_prefix_in_jansky_only() {
        assert_eq!(brightness(2.1e-4, "Jy/beam"), "210 \u{b5}Jy/beam");
        assert_eq!(brightness(1.2e6, "Jy/beam"), "1200 kJy/beam");
        assert_eq!(brightness(0.0123, "K"), "0.0123 K");
        assert_eq!(digits(1.5e-16), "0");
    }
}
