//! Dates as FITS headers write them.

use cittert_arrays::astrometry::{format_utc, parse_utc};

/// DATE-OBS of a Julian date in UTC; `None` for a date outside 1900 to 2200.
pub(crate) fn fits_date(jd: f64) -> Option<String> {
    format_utc(jd).ok()
}

/// Julian date of a DATE-OBS: ISO 8601, or the form `DD/MM/YY` of the years 1900 to 1999.
pub(crate) fn jd_of_fits_date(text: &str) -> Option<f64> {
    match text.split('/').collect::<Vec<_>>()[..] {
        [d, m, y] => parse_utc(&format!("19{y:0>2}-{m:0>2}-{d:0>2}")).ok(),
        _ => parse_utc(text).ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn old_and_new_dates() {
        assert_eq!(jd_of_fits_date("31/12/99"), Some(2_451_543.5));
        assert_eq!(jd_of_fits_date("2017-04-06"), Some(2_457_849.5));
        assert_eq!(jd_of_fits_date(&fits_date(2_457_849.75).unwrap()), Some(2_457_849.75));
        assert_eq!((jd_of_fits_date(""), jd_of_fits_date("a/b/c"), fits_date(f64::NAN)), (None, None, None));
    }
}
