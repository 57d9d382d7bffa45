//! The order in which files store their rows.

use super::headers::Places;
use bytemuck::{Pod, Zeroable};
use cittert_arrays::{Result, UvCoverage, VisibilitySource};
use std::ops::Range;

/// Rows whose coverage is read at once.
const CHUNK: usize = 1 << 16;
/// Largest difference of the time of one row in two files, s. Formats round times.
const SAME_TIME_S: f64 = 1e-3;
/// The same as a part of the integration.
const SAME_TIME_PART: f64 = 0.1;
const DAY_S: f64 = 86_400.0;

/// What tells a row from others, in the numbers of the joined set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    pub(super) time_jd: f64,
    pub(super) ant1: u32,
    pub(super) ant2: u32,
    pub(super) center: u16,
}

/// Largest difference of times that are the same, days.
fn tolerance_days(integration_s: f64) -> f64 {
    if integration_s > 0.0 { SAME_TIME_S.min(SAME_TIME_PART * integration_s) / DAY_S } else { SAME_TIME_S / DAY_S }
}

/// The rows of a coverage in the numbers of the joined set.
pub(super) fn rows<'a>(coverage: &'a UvCoverage, places: &'a Places) -> impl Iterator<Item = Row> + 'a {
    let antenna = |k: u32| places.antennas.as_ref().map_or(k, |a| a[k as usize]);
    (0..coverage.n_rows()).map(move |r| Row {
        time_jd: coverage.time_jd[r],
        ant1: antenna(coverage.ant1[r]),
        ant2: antenna(coverage.ant2[r]),
        center: places.centers[usize::from(coverage.phase_center[r])],
    })
}

/// What the rows of a joined set are sorted by first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Major {
    /// Time.
    Time,
    /// First, then second antenna.
    Pair,
    /// Second, then first antenna.
    Swapped,
    /// Nothing: files with common times are put together as wholes.
    Nothing,
}

impl Major {
    /// The number by which rows are sorted.
    pub(super) fn of(self, row: &Row) -> f64 {
        let pair = |a: u32, b: u32| f64::from(a) * 65_536.0 + f64::from(b);
        match self {
            Self::Time | Self::Nothing => row.time_jd,
            Self::Pair => pair(row.ant1, row.ant2),
            Self::Swapped => pair(row.ant2, row.ant1),
        }
    }

    /// The order of all files: the first in which each of them is sorted.
    pub(super) fn choose(scans: &[Scan]) -> Self {
        [Self::Time, Self::Pair, Self::Swapped]
            .into_iter()
            .find(|m| scans.iter().all(|s| s.back[*m as usize] == 0))
            .unwrap_or(Self::Nothing)
    }
}

/// What one pass over some rows of a file tells. Processes exchange it as bytes.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Scan {
    pub(super) n_rows: u64,
    /// Lowest and highest number of each order.
    pub(super) range: [[f64; 2]; 4],
    /// How many rows come after one that should follow them, by each order.
    back: [u64; 4],
    /// Largest difference of times that are the same, days.
    pub(super) tolerance_days: f64,
    /// Longest integration, s.
    pub(super) integration_s: f64,
    /// The numbers of the first row and of the last one.
    first: [f64; 4],
    last: [f64; 4],
    /// How much the time of the first row may be lower than that of the row before it, days.
    first_slack_days: f64,
}

/// All orders, by their numbers.
const ORDERS: [Major; 4] = [Major::Time, Major::Pair, Major::Swapped, Major::Nothing];

impl Scan {
    /// No rows.
    pub(super) const NOTHING: Self = Self {
        n_rows: 0,
        range: [[f64::INFINITY, f64::NEG_INFINITY]; 4],
        back: [0; 4],
        tolerance_days: SAME_TIME_S / DAY_S,
        integration_s: 0.0,
        first: [0.0; 4],
        last: [0.0; 4],
        first_slack_days: 0.0,
    };

    /// Read where some rows of a file are.
    ///
    /// # Errors
    /// Damage to the file.
    pub(super) fn of(file: &mut dyn VisibilitySource, places: &Places, range: Range<usize>) -> Result<Self> {
        let mut scan = Self::NOTHING;
        for start in range.clone().step_by(CHUNK) {
            let coverage = file.read_coverage(start..(start + CHUNK).min(range.end))?;
            rows(&coverage, places).zip(&coverage.integration_s).for_each(|(row, integration_s)| scan.add(&row, *integration_s));
        }
        Ok(scan)
    }

    fn add(&mut self, row: &Row, integration_s: f64) {
        let (own, same) = (ORDERS.map(|major| major.of(row)), tolerance_days(integration_s));
        if self.n_rows == 0 {
            (self.first, self.first_slack_days, self.last) = (own, same, own);
        }
        self.n_rows += 1;
        self.tolerance_days = self.tolerance_days.min(same);
        self.integration_s = self.integration_s.max(integration_s);
        for (k, value) in own.into_iter().enumerate() {
            self.back[k] += u64::from(falls(k, (self.last[k], value), same));
            self.range[k] = [self.range[k][0].min(value), self.range[k][1].max(value)];
        }
        self.last = own;
    }

    /// The scan of rows and of those that follow them in the file.
    pub(super) fn then(self, next: &Self) -> Self {
        if self.n_rows == 0 || next.n_rows == 0 {
            return if self.n_rows == 0 { *next } else { self };
        }
        let falls = |k: usize| u64::from(falls(k, (self.last[k], next.first[k]), next.first_slack_days));
        let range = |k: usize| [self.range[k][0].min(next.range[k][0]), self.range[k][1].max(next.range[k][1])];
        Self {
            n_rows: self.n_rows + next.n_rows,
            range: [0, 1, 2, 3].map(range),
            back: [0, 1, 2, 3].map(|k| self.back[k] + next.back[k] + falls(k)),
            tolerance_days: self.tolerance_days.min(next.tolerance_days),
            integration_s: self.integration_s.max(next.integration_s),
            last: next.last,
            ..self
        }
    }
}

/// Whether a row should come before the one before it, by the order of that number.
fn falls(order: usize, (before, value): (f64, f64), slack_days: f64) -> bool {
    let slack = if order == Major::Time as usize { slack_days } else { 0.0 };
    !(value >= before - slack)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows in order, and rows of which some come too early, cut at every place.
    #[test]
    fn the_scans_of_parts_are_together_the_scan_of_all() {
        let rows: Vec<(Row, f64)> = [(0.0, 0, 1), (0.0, 1, 2), (10.0, 0, 2), (9.0, 0, 1), (20.0, 3, 4), (20.0, 1, 4)]
            .into_iter()
            .map(|(time_jd, ant1, ant2)| (Row { time_jd, ant1, ant2, center: 0 }, 1.0 + time_jd))
            .collect();
        let scan = |rows: &[(Row, f64)]| {
            let mut scan = Scan::NOTHING;
            rows.iter().for_each(|(row, integration_s)| scan.add(row, *integration_s));
            scan
        };
        let all = scan(&rows);
        assert_eq!((all.back, all.range[0]), ([1, 3, 3, 1], [0.0, 20.0]));
        for cut in 0..=rows.len() {
            assert_eq!(scan(&rows[..cut]).then(&scan(&rows[cut..])), all, "{cut}");
        }
        assert_eq!(Major::choose(&[scan(&rows[..3])]), Major::Time);
        assert_eq!(Major::choose(&[all]), Major::Nothing);
    }
}
