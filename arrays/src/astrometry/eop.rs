//! Earth orientation: UT1 and the pole for each day since 1973, from the IERS series.
//!
//! UT1-TAI is interpolated instead of UT1-UTC, because UT1-UTC has a step at each leap second. Outside the table the last (or first)
//! UT1-UTC and pole are used. UTC stays within 0.9 s of UT1, so the error of sidereal time is less than about 1.8 s; within a year after
//! the end of the table it is less than about 0.1 s.

use sofars::ts::dat;
use std::sync::LazyLock;

/// Rotation angle and pole of the Earth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EarthOrientation {
    /// UT1 minus UTC, s.
    pub ut1_utc_s: f64,
    /// Pole x, rad.
    pub pole_x_rad: f64,
    /// Pole y, rad.
    pub pole_y_rad: f64,
}

const MJD_JD: f64 = 2_400_000.5;
const ARCSEC: f64 = std::f64::consts::PI / 648_000.0;

/// UT1-TAI in s and the pole in arcsec, one entry per day.
struct Table {
    first_mjd: f64,
    days: Vec<[f64; 3]>,
}

static TABLE: LazyLock<Table> = LazyLock::new(|| read(include_str!("../../data/earth_orientation.txt")));

/// The table is part of the program; a test checks that every row of it can be read.
fn read(text: &str) -> Table {
    let mut first_mjd = 0.0;
    let mut days = Vec::new();
    for line in text.lines().filter(|l| !l.starts_with('#')) {
        let Some((mjd, series)) = line.split_once(' ') else { continue };
        if days.is_empty() {
            first_mjd = mjd.parse().unwrap_or(f64::NAN);
        }
        let columns: Vec<Vec<i64>> = series
            .split('|')
            .map(|s| {
                let mut sum = 0;
                s.split(' ')
                    .filter_map(|v| v.parse::<i64>().ok())
                    .map(|v| {
                        sum += v;
                        sum
                    })
                    .collect()
            })
            .collect();
        if let [ut1, x, y] = &columns[..] {
            for ((u, x), y) in ut1.iter().zip(x).zip(y) {
                days.push([*u as f64 * 1e-7, *x as f64 * 1e-4, *y as f64 * 1e-4]);
            }
        }
    }
    Table { first_mjd, days }
}

/// First and last Julian date of the table.
#[must_use]
pub fn range_jd() -> (f64, f64) {
    let first = TABLE.first_mjd + MJD_JD;
    (first, first + TABLE.days.len() as f64 - 1.0)
}

/// Earth orientation at a Julian date in UTC, interpolated linearly between days; constant outside [`range_jd`].
#[must_use]
pub fn at(time_jd_utc: f64) -> EarthOrientation {
    let (first, last) = range_jd();
    let inside = time_jd_utc.clamp(first, last);
    let day = inside - first;
    let i = (day as usize).min(TABLE.days.len().saturating_sub(2));
    let f = day - i as f64;
    let [ut1_tai_s, x, y] = match (TABLE.days.get(i), TABLE.days.get(i + 1)) {
        (Some(a), Some(b)) => [0, 1, 2].map(|k| a[k] + f * (b[k] - a[k])),
        _ => [0.0; 3],
    };
    EarthOrientation { ut1_utc_s: ut1_tai_s + tai_utc_s(inside), pole_x_rad: x * ARCSEC, pole_y_rad: y * ARCSEC }
}

/// TAI minus UTC on the day of a Julian date, s.
#[must_use]
pub fn tai_utc_s(time_jd_utc: f64) -> f64 {
    // A leap second day counts as one day, so its last second still belongs to it.
    sofars::cal::jd2cal(time_jd_utc, 0.0).and_then(|(y, m, d, _)| dat(y, m, d, 0.0)).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_table_is_whole() {
        let (first, last) = range_jd();
        assert_eq!(first, 2_441_684.5);
        assert_eq!(last, 2_461_707.5);
        assert!(TABLE.days.windows(2).all(|w| (w[1][0] - w[0][0]).abs() < 0.005), "UT1-TAI drifts by milliseconds a day, without steps");
        assert!(TABLE.days.iter().all(|d| d[1].abs() < 1.0 && d[2].abs() < 1.0));
    }

    #[test]
    fn a_leap_second_leaves_ut1_continuous() {
        // 2016-12-31 ended with a leap second: UT1-UTC jumps by one second, UT1-TAI does not.
        let midnight = 2_457_754.5;
        let (before, after) = (at(midnight - 0.001), at(midnight + 0.001));
        assert!((after.ut1_utc_s - before.ut1_utc_s - 1.0).abs() < 1e-4);
        // Bulletin B: UT1-UTC on 2017-01-01 is +0.5914 s.
        assert!((after.ut1_utc_s - 0.5914).abs() < 2e-4, "{}", after.ut1_utc_s);
    }

    #[test]
    fn outside_the_table_the_ends_are_held() {
        let (first, last) = range_jd();
        assert_eq!(at(first - 1000.0), at(first));
        assert_eq!(at(last + 1000.0), at(last));
    }
}
