//! `--split`: along which axes a set is cut, and into which parts.

use crate::cli::failure::{Failure, Result, ensure};
use cittert_arrays::{UvCoverage, VisibilitySource};
use std::collections::BTreeSet;
use std::ops::Range;
use std::str::FromStr;

/// Rows whose coverage is read at once.
const CHUNK: usize = 1 << 16;
/// Times that differ by less are one time, days (a millisecond).
const SAME_TIME_DAYS: f64 = 1e-3 / 86_400.0;
/// Largest number of files that one command writes.
const MOST_PARTS: usize = 10_000;

/// An axis along which a set is cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CutAxis {
    Time,
    Baseline,
    Channel,
    Pol,
}

const AXES: [(CutAxis, &str); 4] =
    [(CutAxis::Time, "time"), (CutAxis::Baseline, "baseline"), (CutAxis::Channel, "channel"), (CutAxis::Pol, "pol")];

/// A cut along an axis, into a number of parts or into single values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Cut {
    axis: CutAxis,
    parts: Option<usize>,
}

impl FromStr for Cut {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, parts) = text.split_once('=').map_or((text, None), |(name, n)| (name, Some(n)));
        let axis = AXES.iter().find(|a| a.1 == name).map(|a| a.0);
        let number = parts.map(|n| n.parse::<usize>().ok().filter(|n| *n > 0));
        match (axis, number) {
            (Some(axis), None) => Ok(Self { axis, parts: None }),
            (Some(axis), Some(Some(n))) => Ok(Self { axis, parts: Some(n) }),
            _ => Err("expected time, channel, baseline or pol, each alone or with a number of parts as in time=20".into()),
        }
    }
}

/// The parts of a set: every combination of a part of each axis. Time runs slowest, then baseline, channel and product.
#[derive(Debug)]
pub(super) struct Parts {
    /// First time of each part but the first.
    times: Vec<f64>,
    /// First pair of antennas of each part but the first.
    pairs: Vec<(u32, u32)>,
    /// Channels of each part.
    pub(super) channels: Vec<Range<usize>>,
    /// Products of each part.
    pub(super) products: Vec<Range<usize>>,
    /// The axes that are cut.
    cut: Vec<CutAxis>,
    /// Names of the products of each part.
    names: Vec<String>,
}

impl Parts {
    /// The parts of a set. Times and baselines are counted in one pass.
    ///
    /// # Errors
    /// An axis that is named twice or shorter than the number of its parts, too many parts, or damage to the file.
    pub(super) fn of(source: &mut dyn VisibilitySource, cuts: &[Cut]) -> Result<Self> {
        for (k, cut) in cuts.iter().enumerate() {
            let twice = cuts[..k].iter().any(|c| c.axis == cut.axis);
            ensure!(!twice, Failure::usage(format!("--split {} is given twice", name(cut.axis))));
        }
        let (mut times, mut pairs) = (Vec::new(), BTreeSet::new());
        let is_cut = |axis: CutAxis| cuts.iter().any(|c| c.axis == axis);
        if is_cut(CutAxis::Time) || is_cut(CutAxis::Baseline) {
            for start in (0..source.n_rows()).step_by(CHUNK) {
                let coverage = source.read_coverage(start..(start + CHUNK).min(source.n_rows()))?;
                times.extend_from_slice(&coverage.time_jd);
                times.sort_by(f64::total_cmp);
                times.dedup_by(|b, a| *b - *a <= SAME_TIME_DAYS);
                pairs.extend(coverage.ant1.iter().copied().zip(coverage.ant2.iter().copied()));
            }
        }
        let pairs: Vec<(u32, u32)> = pairs.into_iter().collect();
        let header = source.header();
        let runs = |axis: CutAxis, n: usize| -> Result<Vec<Range<usize>>> {
            let Some(cut) = cuts.iter().find(|c| c.axis == axis) else { return Ok(std::iter::once(0..n).collect()) };
            let parts = cut.parts.unwrap_or(n);
            let what = format!("--split {}={parts}: the set has {n} of them", name(axis));
            ensure!(parts <= n, Failure::usage(what));
            Ok((0..parts).map(|k| k * n / parts..(k + 1) * n / parts).collect())
        };
        let starts = |axis: CutAxis, n: usize| -> Result<Vec<usize>> { Ok(runs(axis, n)?.iter().skip(1).map(|r| r.start).collect()) };
        let products = runs(CutAxis::Pol, header.polarizations.len())?;
        let names = |r: &Range<usize>| header.polarizations[r.clone()].iter().map(|p| p.name()).collect::<String>();
        let parts = Self {
            times: starts(CutAxis::Time, times.len())?.into_iter().map(|k| times[k]).collect(),
            pairs: starts(CutAxis::Baseline, pairs.len())?.into_iter().map(|k| pairs[k]).collect(),
            channels: runs(CutAxis::Channel, header.spectrum.n_chan())?,
            names: products.iter().map(names).collect(),
            products,
            cut: AXES.iter().map(|a| a.0).filter(|a| is_cut(*a)).collect(),
        };
        let n = parts.n();
        ensure!(
            n <= MOST_PARTS,
            Failure::usage(format!("--split makes {n} files, expected at most {MOST_PARTS}: give numbers, as in time=20"))
        );
        Ok(parts)
    }

    /// Number of parts.
    pub(super) fn n(&self) -> usize {
        self.groups() * self.channels.len() * self.products.len()
    }

    /// Number of groups of rows.
    pub(super) fn groups(&self) -> usize {
        (self.times.len() + 1) * (self.pairs.len() + 1)
    }

    /// The group of each row.
    pub(super) fn group_of_rows(&self, c: &UvCoverage) -> Vec<usize> {
        let group = |r: usize| {
            let time = self.times.partition_point(|t| *t <= c.time_jd[r]);
            time * (self.pairs.len() + 1) + self.pairs.partition_point(|p| *p <= (c.ant1[r], c.ant2[r]))
        };
        (0..c.n_rows()).map(group).collect()
    }

    /// What the name of a part says, such as `-time03-polXX`.
    pub(super) fn suffix(&self, group: usize, channels: usize, products: usize) -> String {
        let baselines = self.pairs.len() + 1;
        let number = |k: usize, n: usize| format!("{k:0width$}", width = (n - 1).to_string().len());
        let named = |axis: &CutAxis| {
            let value = match axis {
                CutAxis::Time => number(group / baselines, self.times.len() + 1),
                CutAxis::Baseline => number(group % baselines, baselines),
                CutAxis::Channel => number(channels, self.channels.len()),
                CutAxis::Pol => self.names[products].clone(),
            };
            format!("-{}{value}", name(*axis))
        };
        self.cut.iter().map(named).collect()
    }
}

fn name(axis: CutAxis) -> &'static str {
    AXES.iter().find(|a| a.0 == axis).map_or("", |a| a.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_are_axes_with_numbers() {
        assert_eq!("time=20".parse(), Ok(Cut { axis: CutAxis::Time, parts: Some(20) }));
        assert_eq!("pol".parse(), Ok(Cut { axis: CutAxis::Pol, parts: None }));
        for wrong in ["", "time=0", "time=x", "time=", "freq", "time=-1"] {
            assert!(wrong.parse::<Cut>().is_err(), "{wrong}");
        }
    }
}
