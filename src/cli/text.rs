//! Numbers in a form that is easy to read.

use cittert_arrays::RestoringBeam;

/// Four significant digits.
pub(super) fn round(x: f64) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return x;
    }
    let step = 10f64.powf(x.abs().log10().floor() - 3.0);
    (x / step).round() * step
}

/// An angle with four digits, in the unit (degrees to microarcseconds) that suits its size.
pub(super) fn angle(rad: f64) -> String {
    let deg = rad.to_degrees();
    let (factor, name) = match deg.abs() {
        d if d >= 0.1 || d == 0.0 => (1.0, "deg"),
        d if d >= 0.1 / 3.6e3 => (3.6e3, "arcsec"),
        d if d >= 0.1 / 3.6e6 => (3.6e6, "mas"),
        _ => (3.6e9, "uas"),
    };
    let value = round(deg * factor);
    let digits = if value == 0.0 { 0 } else { (3 - value.abs().log10().floor() as i32).clamp(0, 6) as usize };
    let text = format!("{value:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text.as_str() };
    format!("{text} {name}")
}

/// An integer as it is, another number with six digits.
pub(super) fn number(x: f64) -> String {
    if x.fract() == 0.0 && x.abs() < 1e15 {
        format!("{x}")
    } else if (1e-3..1e6).contains(&x.abs()) {
        let text = format!("{x:.6}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        format!("{x:.5e}")
    }
}

/// Chi squared per datum, with a remark where it is so far from 1 that the weights of the data cannot be 1 over the variance of their noise.
pub(super) fn chi2(x: f64) -> String {
    let digits = if (1e-3..1e6).contains(&x) { format!("{x:.4}") } else { format!("{x:.3e}") };
    let remark = match x {
        _ if x < 0.01 => " (the weights do not fit the data: their noise is much smaller than the weights say)",
        _ if x > 1e4 => {
            " (the weights do not fit the data: their noise is much larger than the weights say, or the model lacks most of the source)"
        }
        _ if x > 30.0 => " (the model does not fit the data to their noise, or the weights are too large)",
        _ => "",
    };
    digits + remark
}

/// The axes and the position angle of a beam.
pub(super) fn beam(b: &RestoringBeam) -> String {
    format!("{} x {}, position angle {:.1} deg", angle(b.bmaj_rad), angle(b.bmin_rad), b.bpa_rad.to_degrees())
}

/// Add the axes of the first beam to the results of a command.
pub(super) fn note_beam(json: &mut serde_json::Value, beams: &[RestoringBeam]) {
    if let Some(b) = beams.first() {
        (json["bmaj_rad"], json["bmin_rad"], json["bpa_rad"]) = (b.bmaj_rad.into(), b.bmin_rad.into(), b.bpa_rad.into());
    }
}

/// One reason if all are the same, otherwise all of them.
pub(super) fn reasons(all: &[&str]) -> String {
    let first = all.first().copied().unwrap_or("nothing left");
    if all.iter().all(|r| *r == first) { first.to_owned() } else { all.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_read_well() {
        assert_eq!(angle(1.0_f64.to_radians()), "1 deg");
        assert_eq!(angle((30.0 / 3600.0_f64).to_radians()), "30 arcsec");
        assert_eq!(angle((20e-6 / 3600.0_f64).to_radians()), "20 uas");
        assert_eq!(angle(0.0018637), "0.1068 deg");
        assert_eq!(angle(0.0), "0 deg");
    }

    #[test]
    fn a_chi_squared_far_from_one_is_explained() {
        assert_eq!(chi2(1.0234), "1.0234");
        assert!(chi2(22_535_652_408.0).starts_with("2.254e10 (the weights do not fit the data"));
        assert!(chi2(0.0).starts_with("0.000e0 (the weights do not fit the data"));
        assert!(chi2(100.0).contains("the model does not fit"));
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!(number(32.0), "32");
        assert_eq!(number(0.25), "0.25");
        assert_eq!(number(2.00000001), "2");
        assert_eq!(number(1.5e-9), "1.50000e-9");
    }
}
