//! Builds the index of rows: one pass over the coverage of each file for its order, and one over files that share times.

use super::headers::Places;
use super::index::{RowIndex, Run};
use super::rows::{Major, Row, Scan, rows};
use super::shelf::Shelf;
use super::slots::stretches;
use crate::{FormatError, Result};
use cittert_arrays::astrometry::format_utc;
use cittert_arrays::quantity::{Duration, Frequency};
use cittert_arrays::{Ranks, VisibilityHeader};
use std::collections::VecDeque;
use std::path::PathBuf;

/// Rows whose coverage is in memory at once, over all files that are read side by side.
const ROWS_AHEAD: usize = 1 << 19;
/// Two files have a gap between them if their times are further apart than this many integrations.
const GAP_INTEGRATIONS: f64 = 1.5;
const DAY_S: f64 = 86_400.0;

/// The files of a set, as their headers describe them.
pub(super) struct Files<'a> {
    pub(super) names: &'a [PathBuf],
    pub(super) header: &'a VisibilityHeader,
    pub(super) places: &'a [Places],
    /// Number of rows of each file.
    pub(super) rows: &'a [usize],
}

/// The scan of each file. Each process reads its part of all rows.
fn scans(files: &Files<'_>, shelf: &mut Shelf, ranks: &dyn Ranks) -> Result<Vec<Scan>> {
    let all = files.rows.iter().sum::<usize>();
    let (first, end) = (all * ranks.rank() / ranks.size(), all * (ranks.rank() + 1) / ranks.size());
    let (mut own, mut start) = (vec![Scan::NOTHING; files.rows.len()], 0);
    for (k, n_rows) in files.rows.iter().enumerate() {
        let range = first.clamp(start, start + n_rows) - start..end.clamp(start, start + n_rows) - start;
        if !range.is_empty() {
            own[k] = Scan::of(shelf.take(k)?, &files.places[k], range).map_err(|e| FormatError::values(&files.names[k], e))?;
        }
        start += n_rows;
    }
    let of_each = ranks.exchange(bytemuck::cast_slice(&own).to_vec());
    let mut all = vec![Scan::NOTHING; own.len()];
    for bytes in &of_each {
        let scans: Vec<Scan> = bytemuck::pod_collect_to_vec(bytes);
        all.iter_mut().zip(&scans).for_each(|(scan, next)| *scan = scan.then(next));
    }
    Ok(all)
}

/// Which files hold each row, and sentences about gaps.
///
/// # Errors
/// Damage to a file, or two files that hold the same data or the same rows in different orders.
pub(super) fn index(files: &Files<'_>, shelf: &mut Shelf, ranks: &dyn Ranks) -> Result<(RowIndex, Vec<String>)> {
    let scans = scans(files, shelf, ranks)?;
    let major = Major::choose(&scans);
    let same = scans.iter().map(|s| s.tolerance_days).fold(f64::INFINITY, f64::min);
    let slack = if major == Major::Pair || major == Major::Swapped { 0.0 } else { same };
    let mut order: Vec<usize> = (0..scans.len()).filter(|k| files.rows[*k] > 0).collect();
    let range = |k: usize| scans[k].range[major as usize];
    order.sort_by(|a, b| range(*a)[0].total_cmp(&range(*b)[0]).then(a.cmp(b)));
    let mut build = Build { files, index: RowIndex::default(), same, slack, major };
    let mut gaps = Gaps::default();
    let mut k = 0;
    while k < order.len() {
        let (mut end, mut last) = (range(order[k])[1], k + 1);
        while last < order.len() && range(order[last])[0] <= end + slack {
            end = end.max(range(order[last])[1]);
            last += 1;
        }
        let mut group = order[k..last].to_vec();
        group.sort_unstable();
        match group[..] {
            [one] => build.whole(one, files.rows[one]),
            _ => build.group(&group, shelf)?,
        }
        if major == Major::Time && last < order.len() {
            let integration_s = group.iter().chain([&order[last]]).map(|f| scans[*f].integration_s).fold(0.0, f64::max);
            gaps.add(end, range(order[last])[0], integration_s);
        }
        k = last;
    }
    let mut notes = gaps.notes();
    notes.extend(build.holes());
    Ok((build.index.built(), notes))
}

struct Build<'a> {
    files: &'a Files<'a>,
    index: RowIndex,
    major: Major,
    /// Largest difference of times that are the same, days.
    same: f64,
    /// The same for the number by which rows are sorted.
    slack: f64,
}

/// A file that is read beside others.
struct Ahead {
    file: usize,
    next: usize,
    n_rows: usize,
    rows: VecDeque<Row>,
}

impl Build<'_> {
    /// All rows of a file.
    fn whole(&mut self, file: usize, n_rows: usize) {
        let set = self.index.set(&[file as u32]).0;
        let mut left = n_rows;
        while left > 0 {
            let run = u32::try_from(left).unwrap_or(u32::MAX);
            self.index.push(vec![(set, run)]);
            left -= run as usize;
        }
    }

    /// All rows of files that share times.
    fn group(&mut self, group: &[usize], shelf: &mut Shelf) -> Result<()> {
        let mut ahead = Vec::with_capacity(group.len());
        for file in group {
            ahead.push(Ahead { file: *file, next: 0, n_rows: shelf.take(*file)?.n_rows(), rows: VecDeque::new() });
        }
        let chunk = (ROWS_AHEAD / group.len()).max(64);
        loop {
            let mut low = f64::INFINITY;
            for a in &mut ahead {
                a.fill(chunk, self.files, shelf)?;
                low = a.rows.front().map_or(low, |row| low.min(self.major.of(row)));
            }
            if low.is_infinite() {
                return Ok(());
            }
            let end = if self.major == Major::Nothing { f64::INFINITY } else { low + self.slack };
            let mut lists = Vec::with_capacity(ahead.len());
            for a in &mut ahead {
                let mut list = Vec::new();
                while let Some(row) = a.rows.front().filter(|row| self.major.of(row) <= end) {
                    list.push(*row);
                    a.rows.pop_front();
                    a.fill(chunk, self.files, shelf)?;
                }
                lists.push((a.file as u32, list));
            }
            self.slot(&lists)?;
        }
    }

    fn slot(&mut self, lists: &[(u32, Vec<Row>)]) -> Result<()> {
        let found = stretches(lists, self.same).map_err(|crossed| {
            let first = lists.iter().find(|l| !l.1.is_empty()).map_or(0, |l| l.0 as usize);
            let what = format!(
                "they hold {} in different orders of rows: write one of them again in the order of the other",
                self.named(&crossed.item)
            );
            FormatError::Apart { first: self.files.names[first].clone(), second: self.files.names[crossed.list].clone(), what }
        })?;
        let mut runs: Vec<Run> = Vec::with_capacity(found.len());
        for stretch in found {
            let (set, is_new) = self.index.set(&stretch.files);
            if is_new {
                self.check(&stretch.files, &stretch.first)?;
            }
            runs.push((set, stretch.rows));
        }
        self.index.push(runs);
        Ok(())
    }

    /// Refuse files that hold the same data.
    fn check(&self, set: &[u32], row: &Row) -> Result<()> {
        let n_pol = self.files.header.polarizations.len();
        let mut owner = vec![u32::MAX; self.files.header.spectrum.n_chan() * n_pol];
        for &file in set {
            let places = &self.files.places[file as usize];
            for (chan, pol) in places.channels.iter().flat_map(|c| places.products.iter().map(move |p| (*c, *p))) {
                let other = std::mem::replace(&mut owner[chan * n_pol + pol], file);
                if other != u32::MAX {
                    let frequency = Frequency(self.files.header.spectrum.freq_hz()[chan]);
                    let what = format!(
                        "both hold {}, {frequency:.9}, {}: leave one of them out, as no datum may count twice",
                        self.named(row),
                        self.files.header.polarizations[pol]
                    );
                    let name = |file: u32| self.files.names[file as usize].clone();
                    return Err(FormatError::Apart { first: name(other), second: name(file), what });
                }
            }
        }
        Ok(())
    }

    fn named(&self, row: &Row) -> String {
        let name = |k: u32| self.files.header.layout.antennas().get(k as usize).map_or("?", |a| a.name.as_str());
        let time = format_utc(row.time_jd).unwrap_or_else(|_| format!("JD {}", row.time_jd));
        format!("the baseline {}-{} at {time}", name(row.ant1), name(row.ant2))
    }

    /// A sentence about data that no file holds.
    fn holes(&self) -> Option<String> {
        let (n_chan, n_pol) = (self.files.header.spectrum.n_chan(), self.files.header.polarizations.len());
        let all = self.index.n_rows() as f64 * (n_chan * n_pol) as f64;
        let held = |set: &[u32]| -> usize {
            let cells = |f: &u32| self.files.places[*f as usize].channels.len() * self.files.places[*f as usize].products.len();
            set.iter().map(cells).sum()
        };
        let there: f64 = self.index.sets().into_iter().map(|(set, rows)| held(set) as f64 * rows as f64).sum();
        let share = 100.0 * (1.0 - there / all);
        (all > 0.0 && there < all).then(|| format!("{share:.3} % of the joined set is in no file: these data are flagged"))
    }
}

impl Ahead {
    /// Read more rows if none are left.
    fn fill(&mut self, chunk: usize, files: &Files<'_>, shelf: &mut Shelf) -> Result<()> {
        if self.rows.is_empty() && self.next < self.n_rows {
            let end = (self.next + chunk).min(self.n_rows);
            let coverage = shelf.take(self.file)?.read_coverage(self.next..end);
            let coverage = coverage.map_err(|e| FormatError::values(&files.names[self.file], e))?;
            self.rows.extend(rows(&coverage, &files.places[self.file]));
            self.next = end;
        }
        Ok(())
    }
}

/// Times between files that no file holds.
#[derive(Default)]
struct Gaps {
    n: usize,
    /// Length in days, and the last time before it.
    longest: (f64, f64),
}

impl Gaps {
    fn add(&mut self, end: f64, start: f64, integration_s: f64) {
        let gap = start - end;
        if integration_s > 0.0 && gap * DAY_S > GAP_INTEGRATIONS * integration_s {
            self.n += 1;
            self.longest = if gap > self.longest.0 { (gap, end) } else { self.longest };
        }
    }

    fn notes(&self) -> Vec<String> {
        let (gap, end) = self.longest;
        let after = format_utc(end).unwrap_or_else(|_| format!("JD {end}"));
        let length = Duration((gap * DAY_S * 1e3).round() / 1e3);
        if self.n == 0 { Vec::new() } else { vec![format!("{} gaps in time between files, the longest of {length} after {after}", self.n)] }
    }
}
