//! The order in which files store their rows.

use super::headers::Places;
use cittert_arrays::{Result, UvCoverage, VisibilitySource};

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
        [Self::Time, Self::Pair, Self::Swapped].into_iter().find(|m| scans.iter().all(|s| s.sorted[*m as usize])).unwrap_or(Self::Nothing)
    }
}

/// What one pass over the rows of a file tells.
#[derive(Debug, Clone)]
pub(super) struct Scan {
    pub(super) n_rows: usize,
    /// Lowest and highest number of each order.
    pub(super) range: [(f64, f64); 4],
    /// Whether the rows are sorted, by each order.
    sorted: [bool; 4],
    /// Largest difference of times that are the same, days.
    pub(super) tolerance_days: f64,
    /// Longest integration, s.
    pub(super) integration_s: f64,
}

impl Scan {
    /// Read where all rows of a file are.
    ///
    /// # Errors
    /// Damage to the file.
    pub(super) fn of(file: &mut dyn VisibilitySource, places: &Places) -> Result<Self> {
        let all = [Major::Time, Major::Pair, Major::Swapped, Major::Nothing];
        let mut scan = Self {
            n_rows: file.n_rows(),
            range: [(f64::INFINITY, f64::NEG_INFINITY); 4],
            sorted: [true; 4],
            tolerance_days: SAME_TIME_S / DAY_S,
            integration_s: 0.0,
        };
        let mut last: Option<Row> = None;
        for start in (0..scan.n_rows).step_by(CHUNK) {
            let coverage = file.read_coverage(start..(start + CHUNK).min(scan.n_rows))?;
            for (row, integration_s) in rows(&coverage, places).zip(&coverage.integration_s) {
                let same = tolerance_days(*integration_s);
                scan.tolerance_days = scan.tolerance_days.min(same);
                scan.integration_s = scan.integration_s.max(*integration_s);
                for major in all {
                    let (k, value) = (major as usize, major.of(&row));
                    let slack = if major == Major::Time { same } else { 0.0 };
                    scan.sorted[k] &= last.is_none_or(|last| value >= major.of(&last) - slack);
                    scan.range[k] = (scan.range[k].0.min(value), scan.range[k].1.max(value));
                }
                last = Some(row);
            }
        }
        Ok(scan)
    }
}
