//! Collects the data of a set for [`UnknownGains`].

use super::antenna_fit::prune;
use super::grouping::{ChannelPlan, FeedPlan};
use super::least_squares::Pairs;
use super::options::{GainMode, Outliers, SolveOptions};
use super::unknown_gains::{ONE, Problem, Row, UnknownGains};
use crate::closure::TimeBins;
use crate::{ChainError, Result};
use cittert_arrays::{VisibilityBlock, VisibilityHeader};
use num_complex::{Complex, Complex32};
use std::collections::HashMap;
use std::sync::{Mutex, RwLock};

/// Collects the rows of a set for [`UnknownGains`].
#[derive(Debug)]
pub struct UnknownGainsBuilder {
    channels: ChannelPlan,
    feeds: FeedPlan,
    options: SolveOptions,
    n_ant: usize,
    bins: TimeBins,
    intervals: HashMap<i64, u32>,
    rows: Vec<Row>,
    vis: Vec<Complex32>,
    weight: Vec<f32>,
}

impl UnknownGainsBuilder {
    /// For sets of this header; `options` give mode, interval, channels, feeds and the number of baselines that an antenna needs.
    ///
    /// # Errors
    /// Options out of range, delay mode or robust weights (which this term does not have), no polarisation to solve on.
    pub fn new(header: &VisibilityHeader, options: &SolveOptions) -> Result<Self> {
        options.check(header.layout.n_ant())?;
        let unable = |option, value: &str, expected: &str| {
            Err(ChainError::BadOption {
                option,
                value: value.into(),
                expected: format!("{expected} in a joint solution of image and gains"),
            })
        };
        if options.mode == GainMode::Delay {
            return unable("mode", "delay", "phase or amp-phase");
        }
        if options.outliers != Outliers::None {
            return unable("outliers", "on", "none");
        }
        Ok(Self {
            channels: ChannelPlan::new(&header.spectrum, options.channels)?,
            feeds: FeedPlan::new(header, options.feeds)?,
            options: options.clone(),
            n_ant: header.layout.n_ant(),
            bins: TimeBins::new(options.solint),
            intervals: HashMap::new(),
            rows: Vec::new(),
            vis: Vec::new(),
            weight: Vec::new(),
        })
    }

    /// Add a block. Returns the rows that were used, which are all rows except autocorrelations and rows without data.
    ///
    /// # Errors
    /// An interval shorter than an integration, an antenna that the header does not have.
    pub fn add(&mut self, block: &VisibilityBlock) -> Result<Vec<usize>> {
        let coverage = &block.coverage;
        let hands: Vec<usize> = (0..self.feeds.of_pol.len()).filter(|p| self.feeds.of_pol[*p].is_some()).collect();
        let n_chan = self.channels.group_of.len();
        let mut taken = Vec::new();
        for row in 0..block.n_rows() {
            let (ant1, ant2) = (coverage.ant1[row], coverage.ant2[row]);
            if ant1.max(ant2) as usize >= self.n_ant {
                let message = format!("a row names antenna {}, the array has {}", ant1.max(ant2), self.n_ant);
                return Err(ChainError::Incompatible(message));
            }
            if ant1 == ant2 {
                continue;
            }
            let from = self.vis.len();
            let mut any = false;
            for chan in 0..n_chan {
                for &pol in &hands {
                    let at = (row, chan, pol);
                    let (v, w) = (block.vis[at], block.weights[at]);
                    let good = !block.flags[at] && w > 0.0 && w.is_finite() && v.re.is_finite() && v.im.is_finite();
                    any |= good;
                    self.vis.push(if good { v } else { Complex::default() });
                    self.weight.push(if good { w } else { 0.0 });
                }
            }
            if !any {
                self.vis.truncate(from);
                self.weight.truncate(from);
                continue;
            }
            let key = self.bins.key(coverage.time_jd[row], coverage.integration_s[row])?;
            let next = self.intervals.len() as u32;
            let interval = *self.intervals.entry(key).or_insert(next);
            self.rows.push(Row { ant1, ant2, interval });
            taken.push(row);
        }
        Ok(taken)
    }

    /// The term, with gains still unknown.
    ///
    /// # Errors
    /// No usable cross-correlation, no antenna with enough baselines in any interval.
    pub fn finish(self) -> Result<UnknownGains> {
        if self.rows.is_empty() {
            return Err(ChainError::NoData("no usable cross-correlation: nothing to image or calibrate".into()));
        }
        let hands: Vec<usize> = self.feeds.of_pol.iter().flatten().copied().collect();
        let (n_group, n_feed) = (self.channels.n_groups(), self.feeds.names.len());
        let n_problem = self.intervals.len() * n_group * n_feed;
        let mut term = UnknownGains {
            rows: self.rows,
            n_chan: self.channels.group_of.len(),
            group_of: self.channels.group_of,
            n_group,
            hands,
            n_feed,
            vis: self.vis,
            weight: self.weight,
            amplitudes: self.options.mode == GainMode::AmpPhase,
            data: 0,
            problems: Mutex::new(Vec::new()),
            prior: Mutex::new(0.0),
            held: Mutex::default(),
            frame: RwLock::default(),
        };
        let mut links = vec![Pairs::new(self.n_ant); n_problem];
        let mut present = vec![false; self.n_ant];
        for (r, row) in term.rows.iter().enumerate() {
            let samples = term.samples(r);
            for (k, w) in term.weight[samples].iter().enumerate().filter(|(_, w)| **w > 0.0) {
                links[term.problem_of(row, k)].add(row.ant1 as usize, row.ant2 as usize, ONE, f64::from(*w));
                present[row.ant1 as usize] = true;
                present[row.ant2 as usize] = true;
            }
        }
        let needed = self.options.baselines_needed(present.iter().filter(|p| **p).count());
        let problems: Vec<Problem> = links
            .into_iter()
            .map(|pairs| {
                let mut flagged = vec![None; self.n_ant];
                prune(&[pairs], &mut flagged, needed);
                let mut active = 0;
                let place = flagged.iter().map(|f| f.is_none().then(|| (active, active += 1).0)).collect();
                Problem { place, active: active as usize, gains: Vec::new() }
            })
            .collect();
        // Data of an antenna without a solution are not calibrated, so they are not used.
        let mut used = 0_usize;
        for r in 0..term.rows.len() {
            let row = term.rows[r];
            for k in 0..term.n_chan * term.hands.len() {
                let problem = &problems[term.problem_of(&row, k)];
                let at = term.samples(r).start + k;
                if problem.place[row.ant1 as usize].is_none() || problem.place[row.ant2 as usize].is_none() {
                    term.weight[at] = 0.0;
                }
                used += usize::from(term.weight[at] > 0.0);
            }
        }
        if used == 0 {
            return Err(ChainError::NoData(format!("no antenna has {needed} baselines with data in any solution interval")));
        }
        let unknowns: usize =
            problems.iter().filter(|p| p.active > 0).map(|p| p.active - 1 + if term.amplitudes { p.active } else { 0 }).sum();
        term.data = (2 * used).saturating_sub(unknowns).max(1);
        term.problems = Mutex::new(problems);
        Ok(term)
    }
}
