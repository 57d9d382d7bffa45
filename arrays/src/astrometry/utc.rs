//! Conversion between UTC as a text and UTC as a Julian date.
//!
//! A day with a leap second is one day of 86,401 s (SOFA's quasi Julian date, which astropy and UVH5 also use), so every
//! UTC instant has its own number.

use crate::{ArrayError, Result};
use sofars::ts::{d2dtf, dat, dtf2d};

const EXPECTED: &str = "an ISO 8601 time in UTC such as 2025-06-01T12:00:00 or 2025-06-01T12:00:00.250Z";

/// Julian date of an ISO 8601 time in UTC: `2025-06-01T12:00:00`, with optional fraction, `Z`, seconds, or time of day.
///
/// # Errors
/// A text of another form, an offset from UTC, or a date or time that does not exist (23:59:60 exists only on days with a leap second).
pub fn parse_utc(text: &str) -> Result<f64> {
    let bad = |expected: &'static str| ArrayError::BadValue { what: "time".into(), value: format!("{text:?}"), expected };
    let trimmed = text.trim();
    if !trimmed.is_ascii() {
        return Err(bad(EXPECTED));
    }
    let trimmed = trimmed.strip_suffix(['Z', 'z']).unwrap_or(trimmed);
    let (date, clock) = trimmed.split_once(['T', 't', ' ']).unwrap_or((trimmed, "00:00:00"));
    let field = |s: &str, digits: usize| (s.len() == digits).then(|| s.parse::<u32>().ok()).flatten().ok_or_else(|| bad(EXPECTED));
    let date: Vec<&str> = date.split('-').collect();
    let [year, month, day] = date[..] else { return Err(bad(EXPECTED)) };
    let (year, month, day) = (field(year, 4)? as i32, field(month, 2)? as i32, field(day, 2)? as i32);

    let clock: Vec<&str> = clock.split(':').collect();
    let (hour, minute, second) = match clock[..] {
        [h, m] => (h, m, "00"),
        [h, m, s] => (h, m, s),
        _ => return Err(bad(EXPECTED)),
    };
    let (hour, minute) = (field(hour, 2)? as i32, field(minute, 2)? as i32);
    let (whole, fraction) = second.split_once('.').unwrap_or((second, "0"));
    field(whole, 2)?;
    if fraction.is_empty() || !fraction.bytes().all(|b| b.is_ascii_digit()) {
        return Err(bad(EXPECTED));
    }
    let second: f64 = second.parse().map_err(|_| bad(EXPECTED))?;

    if !(1901..=2098).contains(&year) {
        return Err(bad("a year between 1901 and 2098"));
    }
    if hour > 23 || minute > 59 {
        return Err(bad("an hour up to 23 and a minute up to 59"));
    }
    let (day1, fraction) = dtf2d("UTC", year, month, day, hour, minute, second).map_err(|_| bad("a date that exists"))?;
    let last = if hour == 23 && minute == 59 { 60.0 + leap_second(day1)? } else { 60.0 };
    if second >= last {
        return Err(bad("a second below 60 (23:59:60 exists only on days that end with a leap second)"));
    }
    Ok(day1 + fraction)
}

/// Leap seconds at the end of the day that begins at this Julian date: 1 or 0.
fn leap_second(day_jd: f64) -> Result<f64> {
    let at = |jd: f64| sofars::cal::jd2cal(jd, 0.0).and_then(|(y, m, d, _)| dat(y, m, d, 0.0));
    match (at(day_jd), at(day_jd + 1.0)) {
        // Before 1972 UTC drifted against TAI and had no whole leap seconds.
        (Ok(today), Ok(tomorrow)) if today >= 10.0 => Ok((tomorrow - today).round()),
        (Ok(_), Ok(_)) => Ok(0.0),
        _ => Err(ArrayError::bad_value("time", format_args!("JD {day_jd}"), "a date that exists")),
    }
}

/// A Julian date in UTC as `2025-06-01T12:00:00.000`, rounded to milliseconds.
///
/// # Errors
/// A date that is not finite or not between 1901 and 2099.
pub fn format_utc(time_jd_utc: f64) -> Result<String> {
    let bad = || ArrayError::bad_value("time", format_args!("JD {time_jd_utc}"), "a Julian date between 1901 and 2099");
    if !(2_415_385.5..=2_487_704.5).contains(&time_jd_utc) {
        return Err(bad());
    }
    let (y, m, d, [h, min, s, ms]) = d2dtf("UTC", 3, time_jd_utc, 0.0).map_err(|_| bad())?;
    Ok(format!("{y:04}-{m:02}-{d:02}T{h:02}:{min:02}:{s:02}.{ms:03}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn iso_times_give_the_julian_dates_of_the_almanac() {
        assert_eq!(parse_utc("2000-01-01T12:00:00").unwrap(), 2_451_545.0);
        assert_eq!(parse_utc("2025-06-01").unwrap(), 2_460_827.5);
        assert_eq!(parse_utc("2025-06-01T18:00Z").unwrap(), 2_460_828.25);
        assert!((parse_utc("2025-06-01 12:00:00.250").unwrap() - 2_460_828.0 - 0.25 / 86400.0).abs() < 1e-9);
    }

    #[test]
    fn julian_dates_are_those_of_astropy() {
        for (text, jd) in [
            ("1975-03-04T05:06:07", 2_442_475.712_581_018_5),
            ("1999-12-31T23:59:59.999", 2_451_544.499_999_988_4),
            ("2016-12-31T12:00:00", 2_457_753.999_994_213),
            ("2016-12-31T23:59:60.5", 2_457_754.499_994_213),
            ("2025-06-01T12:00:00.25", 2_460_828.000_002_893_6),
        ] {
            // One step of a Julian date in f64 is 4.7e-10.
            assert!((parse_utc(text).unwrap() - jd).abs() < 5e-10, "{text}");
        }
    }

    #[test]
    fn a_leap_second_is_a_time_on_its_day_only() {
        // The day has 86,401 s, so its last second begins at 86400/86401 of it.
        let jd = parse_utc("2016-12-31T23:59:60").unwrap();
        assert!((jd - 2_457_753.5 - 86_400.0 / 86_401.0).abs() < 1e-9);
        assert_eq!(format_utc(jd).unwrap(), "2016-12-31T23:59:60.000");
        assert!(parse_utc("2016-12-30T23:59:60").is_err());
        assert!(parse_utc("2016-12-31T22:59:60").is_err());
    }

    #[test]
    fn what_is_not_utc_is_refused_with_an_example() {
        for text in [
            "",
            "yesterday",
            "2025-6-1T12:00:00",
            "2025-13-01",
            "2025-02-29",
            "2025-06-01T24:00:00",
            "2025-06-01T12:60:00",
            "2025-06-01T12:00:00+02:00",
            "2025-06-01T12:00:1e1",
            "2025-06-01T12:00:00.",
            "+025-06-01",
            "0001-01-01",
            "2025-06-01T١٢:00:00",
        ] {
            let e = parse_utc(text).unwrap_err().to_string();
            assert!(e.contains("expected"), "{text}: {e}");
        }
    }

    #[test]
    fn printing_and_reading_agree() {
        for text in ["1999-12-31T23:59:59.999", "2024-02-29T00:00:00.000", "2031-07-04T06:30:15.125"] {
            assert_eq!(format_utc(parse_utc(text).unwrap()).unwrap(), text);
        }
        assert_eq!(format_utc(parse_utc("2025-06-01T11:59:59.9999").unwrap()).unwrap(), "2025-06-01T12:00:00.000");
        assert!(format_utc(f64::NAN).is_err());
    }
}
