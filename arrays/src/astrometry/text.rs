//! Directions on the sky as texts: `19h59m28s,+40d44m02s` or `299.87deg,40.73deg`.

use crate::quantity::Angle;
use crate::{ArrayError, PhaseCenter, Result};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

const EXPECTED: &str = "right ascension and declination such as 19h59m28s,+40d44m02s or 299.87deg,40.73deg";

/// Right ascension (0 to 2 pi) and declination in rad from a text such as `19h59m28s,+40d44m02s` or `299.87deg,40.73deg`.
///
/// # Errors
/// A text of another form, minutes or seconds of 60 or more, hours beyond 24, or a declination beyond the poles.
pub fn parse_direction(text: &str) -> Result<(f64, f64)> {
    let bad = |what: &str, expected| ArrayError::BadValue { what: what.into(), value: format!("{text:?}"), expected };
    let Some((ra, dec)) = text.split_once(',') else { return Err(bad("direction", EXPECTED)) };
    let ra_rad = match sexagesimal(ra, 'h') {
        Some(hours) => hours * PI / 12.0,
        None => ra.trim().parse::<Angle>().map_err(|_| bad("right ascension", EXPECTED))?.si(),
    };
    let dec_rad = match sexagesimal(dec, 'd') {
        Some(degrees) => degrees.to_radians(),
        None => dec.trim().parse::<Angle>().map_err(|_| bad("declination", EXPECTED))?.si(),
    };
    if !(-TAU..=TAU).contains(&ra_rad) {
        return Err(bad("right ascension", "an angle between -360 and 360 deg, or 0h to 24h"));
    }
    if !(dec_rad.abs() <= FRAC_PI_2 + 1e-12) {
        return Err(bad("declination", "an angle between -90 and 90 deg"));
    }
    Ok((ra_rad.rem_euclid(TAU), dec_rad))
}

/// `[+-]<whole><unit>[<minutes>m[<seconds>s]]` in units of `unit`, or `None` where the text has another form.
fn sexagesimal(text: &str, unit: char) -> Option<f64> {
    let text = text.trim();
    let (sign, text) = match text.strip_prefix('-') {
        Some(rest) => (-1.0, rest),
        None => (1.0, text.strip_prefix('+').unwrap_or(text)),
    };
    let (whole, rest) = text.split_once(unit)?;
    let (minutes, rest) = if rest.is_empty() { ("0", "") } else { rest.split_once('m')? };
    let seconds = if rest.is_empty() { "0" } else { rest.strip_suffix('s')? };
    let plain = |s: &str| s.bytes().all(|b| b.is_ascii_digit() || b == b'.').then(|| s.parse::<f64>().ok()).flatten();
    let (whole, minutes, seconds) = (plain(whole)?, plain(minutes)?, plain(seconds)?);
    (minutes < 60.0 && seconds < 60.0 && whole <= 360.0).then_some(sign * (whole + minutes / 60.0 + seconds / 3600.0))
}

impl PhaseCenter {
    /// A sidereal phase centre in ICRS from a text such as `19h59m28s,+40d44m02s`. The text becomes its name.
    ///
    /// # Errors
    /// As [`parse_direction`].
    pub fn parse(text: &str) -> Result<Self> {
        let (ra_rad, dec_rad) = parse_direction(text)?;
        Self::sidereal(text.trim(), ra_rad, dec_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_of_writing_agree() {
        let (ra, dec) = parse_direction("19h59m28.35s,+40d44m02.1s").unwrap();
        assert!((ra.to_degrees() - 299.868_125).abs() < 1e-9 && (dec.to_degrees() - 40.733_916_667).abs() < 1e-9);
        let (ra, dec) = parse_direction("299.868125deg, 40.733916667deg").unwrap();
        assert!((ra.to_degrees() - 299.868_125).abs() < 1e-9 && (dec.to_degrees() - 40.733_916_667).abs() < 1e-9);
    }

    #[test]
    fn the_sign_of_a_declination_of_minus_zero_degrees_counts() {
        let (_, dec) = parse_direction("2h,-0d30m").unwrap();
        assert!((dec.to_degrees() + 0.5).abs() < 1e-12);
        assert!((parse_direction("-1h,0d").unwrap().0.to_degrees() - 345.0).abs() < 1e-12);
    }

    #[test]
    fn other_texts_are_refused_with_an_example() {
        for text in
            ["", "12h", "12h,", "12,13", "12h60m,3d", "12h3m4,3d", "1h2m3s,91d", "nanh,1d", "25h,1d", "1h,-inf", "1h,1d,2d", "∞h,1d"]
        {
            assert!(parse_direction(text).unwrap_err().to_string().contains("expected"), "{text}");
        }
    }
}
