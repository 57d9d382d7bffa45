//! Collects the data of a set for [`UnknownGains`].

use super::antenna_fit::prune;
use super::gains_over_ranks::Sharing;
use super::grouping::{ChannelPlan, FeedPlan};
use super::least_squares::Pairs;
use super::options::{GainMode, Outliers, SolveOptions};
use super::over_ranks::begin;
use super::unknown_gains::{ONE, Problem, Row, UnknownGains};
use crate::closure::TimeBins;
use crate::{ChainError, Result};
use cittert_arrays::{Alone, Ranks, VisibilityBlock, VisibilityHeader};
use num_complex::{Complex, Complex32};
use std::fmt;
use std::sync::{Arc, Mutex, RwLock};

/// Collects the rows of a set for [`UnknownGains`].
pub struct UnknownGainsBuilder {
    ranks: Arc<dyn Ranks>,
    channels: ChannelPlan,
    feeds: FeedPlan,
    options: SolveOptions,
    n_ant: usize,
    bins: TimeBins,
    /// Antennas of each row.
    ends: Vec<(u32, u32)>,
    /// Time (JD) and integration (s) of each row.
    times: Vec<[f64; 2]>,
    vis: Vec<Complex32>,
    weight: Vec<f32>,
}

impl fmt::Debug for UnknownGainsBuilder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("UnknownGainsBuilder").field("rows", &self.ends.len()).field("options", &self.options).finish_non_exhaustive()
    }
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
            ranks: Arc::new(Alone),
            channels: ChannelPlan::new(&header.spectrum, options.channels)?,
            feeds: FeedPlan::new(header, options.feeds)?,
            options: options.clone(),
            n_ant: header.layout.n_ant(),
            bins: TimeBins::new(options.solint),
            ends: Vec::new(),
            times: Vec::new(),
            vis: Vec::new(),
            weight: Vec::new(),
        })
    }

    /// The rows that are added are those of one of these processes. All of them must finish.
    #[must_use]
    pub fn shared_by(mut self, ranks: Arc<dyn Ranks>) -> Self {
        self.ranks = ranks;
        self
    }

    /// Add a block. Returns the rows that were used, which are all rows except autocorrelations and rows without data.
    ///
    /// # Errors
    /// An antenna that the header does not have.
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
            self.ends.push((ant1, ant2));
            self.times.push([coverage.time_jd[row], coverage.integration_s[row]]);
            taken.push(row);
        }
        Ok(taken)
    }

    /// The intervals of all processes, and the rows of this one.
    fn rows(&mut self) -> Result<(Sharing, Vec<Row>)> {
        let times = std::mem::take(&mut self.times);
        begin(&mut self.bins, &*self.ranks, Ok(times.first().copied()))?;
        let keys = times.iter().map(|[time_jd, integration_s]| self.bins.key(*time_jd, *integration_s)).collect();
        let (sharing, intervals) = Sharing::of(self.ranks.clone(), keys)?;
        let ends = std::mem::take(&mut self.ends);
        Ok((sharing, ends.into_iter().zip(intervals).map(|((ant1, ant2), interval)| Row { ant1, ant2, interval }).collect()))
    }

    /// The term, with gains still unknown.
    ///
    /// # Errors
    /// No usable cross-correlation, an interval shorter than an integration, no antenna with enough baselines in any interval.
    pub fn finish(mut self) -> Result<UnknownGains> {
        let (sharing, rows) = self.rows()?;
        if sharing.n() == 0 {
            return Err(ChainError::NoData("no usable cross-correlation: nothing to image or calibrate".into()));
        }
        let hands: Vec<usize> = self.feeds.of_pol.iter().flatten().copied().collect();
        let (n_group, n_feed) = (self.channels.n_groups(), self.feeds.names.len());
        let per = n_group * n_feed;
        let n_problem = sharing.n() * per;
        let mut term = UnknownGains {
            sharing,
            rows,
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
        let has = |problem: usize| term.sharing.has(problem / per);
        let mut links: Vec<Pairs> = (0..n_problem).map(|problem| Pairs::new(if has(problem) { self.n_ant } else { 0 })).collect();
        let mut present = vec![false; self.n_ant];
        for (r, row) in term.rows.iter().enumerate() {
            let samples = term.samples(r);
            for (k, w) in term.weight[samples].iter().enumerate().filter(|(_, w)| **w > 0.0) {
                links[term.problem_of(row, k)].add(row.ant1 as usize, row.ant2 as usize, ONE, f64::from(*w));
                present[row.ant1 as usize] = true;
                present[row.ant2 as usize] = true;
            }
        }
        term.sharing.add_up(per, &mut links);
        term.sharing.any(&mut present);
        let needed = self.options.baselines_needed(present.iter().filter(|p| **p).count());
        let problems: Vec<Problem> = links
            .into_iter()
            .map(|pairs| {
                if pairs.n == 0 {
                    return Problem { place: Vec::new(), active: 0, gains: Vec::new() };
                }
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
        let counted = problems.iter().enumerate().filter(|(k, p)| p.active > 0 && term.sharing.counts(k / per));
        let unknowns: usize = counted.map(|(_, p)| p.active - 1 + if term.amplitudes { p.active } else { 0 }).sum();
        let [used, unknowns] = term.sharing.sum([used as f64, unknowns as f64]).map(|n| n as usize);
        if used == 0 {
            return Err(ChainError::NoData(format!("no antenna has {needed} baselines with data in any solution interval")));
        }
        term.data = (2 * used).saturating_sub(unknowns).max(1);
        term.problems = Mutex::new(problems);
        Ok(term)
    }
}
