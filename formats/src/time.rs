//! Julian dates and ISO 8601 texts.

/// Julian date of midnight of a day of the Gregorian calendar.
///
/// # Reference
/// Fliegel & Van Flandern 1968, Communications of the ACM 11, 657.
fn jd_of_midnight(year: i64, month: i64, day: i64) -> f64 {
    let a = (month - 14) / 12;
    let jdn = (1461 * (year + 4800 + a)) / 4 + (367 * (month - 2 - 12 * a)) / 12 - (3 * ((year + 4900 + a) / 100)) / 4 + day - 32075;
    jdn as f64 - 0.5
}

/// Year, month, day and fraction of the day of a Julian date.
///
/// # Reference
/// Fliegel & Van Flandern 1968, Communications of the ACM 11, 657.
fn calendar(jd: f64) -> (i64, i64, i64, f64) {
    let midnight = (jd - 0.5).floor();
    let fraction = jd - 0.5 - midnight;
    let mut l = midnight as i64 + 1 + 68569;
    let n = 4 * l / 146_097;
    l -= (146_097 * n + 3) / 4;
    let i = 4000 * (l + 1) / 1_461_001;
    l = l - 1461 * i / 4 + 31;
    let j = 80 * l / 2447;
    let day = l - 2447 * j / 80;
    l = j / 11;
    (100 * (n - 49) + i + l, j + 2 - 12 * l, day, fraction)
}

/// ISO 8601 text of a Julian date, to the millisecond. Dates outside the years 0 to 9999 give `None`.
#[must_use]
pub fn iso_from_jd(jd: f64) -> Option<String> {
    if !(1_721_060.0..5_373_484.0).contains(&jd) {
        return None;
    }
    // Round to the millisecond first, so that 59.9996 s does not become 60.000.
    let (midnight, ms) = ((jd - 0.5).floor(), ((jd - 0.5).fract() * 86_400_000.0).round() as i64);
    let (year, month, day, _) = calendar(midnight + 0.5 + (ms / 86_400_000) as f64);
    let ms = ms % 86_400_000;
    let (h, m, s) = (ms / 3_600_000, ms / 60_000 % 60, ms % 60_000);
    Some(format!("{year:04}-{month:02}-{day:02}T{h:02}:{m:02}:{:02}.{:03}", s / 1000, s % 1000))
}

/// Julian date of `YYYY-MM-DD[Thh:mm:ss[.sss]]` or of the old FITS form `DD/MM/YY` (1900 to 1999).
#[must_use]
pub fn jd_from_iso(text: &str) -> Option<f64> {
    let text = text.trim().trim_end_matches('Z');
    if let [d, m, y] = text.split('/').collect::<Vec<_>>()[..] {
        return date(y.parse::<i64>().ok()? + 1900, m.parse().ok()?, d.parse().ok()?);
    }
    let (day, clock) = text.split_once(['T', ' ']).unwrap_or((text, ""));
    let [y, m, d] = day.split('-').collect::<Vec<_>>()[..] else { return None };
    let midnight = date(y.parse().ok()?, m.parse().ok()?, d.parse().ok()?)?;
    let mut seconds = 0.0;
    for (part, scale) in clock.split(':').filter(|p| !p.is_empty()).zip([3600.0, 60.0, 1.0]) {
        let value: f64 = part.parse().ok()?;
        if !(0.0..=60.999).contains(&value) {
            return None;
        }
        seconds += value * scale;
    }
    Some(midnight + seconds / 86_400.0)
}

fn date(year: i64, month: i64, day: i64) -> Option<f64> {
    ((0..=9999).contains(&year) && (1..=12).contains(&month) && (1..=31).contains(&day)).then(|| jd_of_midnight(year, month, day))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_dates() {
        assert_eq!(jd_from_iso("2000-01-01T12:00:00"), Some(2_451_545.0));
        assert_eq!(jd_from_iso("2017-04-06"), Some(2_457_849.5));
        assert_eq!(jd_from_iso("31/12/99"), Some(2_451_543.5));
        assert_eq!(iso_from_jd(2_451_545.0).as_deref(), Some("2000-01-01T12:00:00.000"));
        assert_eq!(iso_from_jd(2_457_850.499_999_999_9).as_deref(), Some("2017-04-07T00:00:00.000"));
        for bad in ["", "2017", "2017-13-01", "2017-01-01T99:00", "x/y/z", "NaN"] {
            assert_eq!(jd_from_iso(bad), None, "{bad}");
        }
        assert_eq!(iso_from_jd(f64::NAN), None);
    }

    #[test]
    fn dates_go_both_ways() {
        for k in 0..4000 {
            let jd = 2_440_000.5 + 7.377 * f64::from(k);
            let back = jd_from_iso(&iso_from_jd(jd).unwrap()).unwrap();
            assert!((back - jd).abs() < 1e-8, "{jd} {back}");
        }
    }
}
