//! Normal equations of the gains: sums over the visibilities of each baseline and interval, from one pass over the data.
//!
//! The sums serve any number of solutions (phases, amplitudes, other thresholds), the test against closure phases, and chi^2.

use super::grouping::{ChannelPlan, FeedPlan};
use super::model::ModelVisibilities;
use super::normal_rows::{Added, RowsOfBlock};
use super::normal_sums::{Cell, IntervalSums, SampleCounts};
use super::options::{ChannelGroups, GainMode, Outliers, SolveOptions};
use super::over_ranks::{Numbers, begin, first_row, of_all};
use crate::closure::{TimeBins, TimeSpan, n_pairs};
use crate::memory::MemoryBudget;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use cittert_arrays::{Ranks, VisibilityBlock, VisibilityHeader, VisibilitySource, for_each_block};
use ndarray::Array3;
use num_complex::{Complex, Complex64};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Normal equations of a whole set.
#[derive(Debug, Clone)]
pub struct NormalEquations {
    pub(crate) header: VisibilityHeader,
    pub(crate) options: SolveOptions,
    pub(crate) channels: ChannelPlan,
    pub(crate) feeds: FeedPlan,
    pub(crate) intervals: BTreeMap<i64, IntervalSums>,
    pub(crate) counts: SampleCounts,
    /// Antennas with at least one usable cross-correlation.
    pub(crate) present: Vec<bool>,
    bins: TimeBins,
}

impl NormalEquations {
    /// Empty sums for sets of this header.
    ///
    /// # Errors
    /// Options out of range (see [`SolveOptions::check`]), no polarisation to solve on, delay mode with a single channel.
    pub fn new(header: &VisibilityHeader, options: &SolveOptions) -> Result<Self> {
        options.check(header.layout.n_ant())?;
        if options.mode == GainMode::Delay && header.spectrum.n_chan() < 2 {
            return Err(ChainError::BadOption {
                option: "mode",
                value: "delay".into(),
                expected: "phase or amp-phase: a delay needs at least 2 channels, the set has 1".into(),
            });
        }
        let groups = if options.mode == GainMode::Delay { ChannelGroups::Channel } else { options.channels };
        Ok(Self {
            channels: ChannelPlan::new(&header.spectrum, groups)?,
            feeds: FeedPlan::new(header, options.feeds)?,
            header: header.clone(),
            options: options.clone(),
            intervals: BTreeMap::new(),
            counts: SampleCounts::default(),
            present: vec![false; header.layout.n_ant()],
            bins: TimeBins::new(options.solint),
        })
    }

    /// Add the rows of a block with the visibilities of the model, \[blt, chan, pol\]. Autocorrelations are passed over.
    ///
    /// # Errors
    /// A model of another shape, an antenna that the header does not have, a solution interval shorter than an integration,
    /// more intervals than memory should hold.
    pub fn add(&mut self, block: &VisibilityBlock, model: &Array3<Complex<f32>>) -> Result<()> {
        let expected = self.header.shape(block.n_rows());
        if model.dim() != expected || block.vis.dim() != expected {
            return Err(ChainError::Incompatible(format!(
                "data of shape {:?} and a model of shape {:?}, both should be {expected:?} [row, channel, polarisation]",
                block.vis.dim(),
                model.dim()
            )));
        }
        let coverage = &block.coverage;
        let n_ant = self.header.layout.n_ant();
        let n_feed = self.feeds.names.len();
        let n_cells = self.channels.n_groups() * n_feed * n_pairs(n_ant);
        let n_pol = self.header.polarizations.len();
        let samples = expected.1 * n_pol;
        let (vis, weights) = (block.vis.as_standard_layout(), block.weights.as_standard_layout());
        let (flags, model) = (block.flags.as_standard_layout(), model.as_standard_layout());
        let (vis, weights, flags, model) = (vis.as_slice(), weights.as_slice(), flags.as_slice(), model.as_slice());
        let (Some(vis), Some(weights), Some(flags), Some(model)) = (vis, weights, flags, model) else {
            return Err(ChainError::Incompatible("a block whose arrays are not contiguous".into()));
        };
        let mut rows_of: BTreeMap<i64, Vec<usize>> = BTreeMap::new();
        // Most rows are of the interval of the row before.
        let mut last: (i64, Vec<usize>) = Default::default();
        for row in 0..block.n_rows() {
            let (a1, a2) = (coverage.ant1[row] as usize, coverage.ant2[row] as usize);
            if a1.max(a2) >= n_ant {
                return Err(ChainError::Incompatible(format!("a row names antenna {}, the array has {n_ant}", a1.max(a2))));
            }
            if a1 != a2 {
                let key = self.bins.key(coverage.time_jd[row], coverage.integration_s[row])?;
                if key != last.0 && !last.1.is_empty() {
                    rows_of.entry(last.0).or_default().append(&mut last.1);
                }
                last.0 = key;
                last.1.push(row);
            }
        }
        if !last.1.is_empty() {
            rows_of.entry(last.0).or_default().append(&mut last.1);
        }
        for key in rows_of.keys() {
            if !self.intervals.contains_key(key)
                && (self.intervals.len() + 1) * n_cells * size_of::<Cell>() > MemoryBudget::default().bytes()
            {
                return Err(ChainError::BadOption {
                    option: "solint",
                    value: format!("more than {} intervals of {n_cells} solutions", self.intervals.len()),
                    expected: "a longer interval, or fewer channels (average them first), so that the sums fit into 4 GiB".into(),
                });
            }
            let empty = || IntervalSums { span: TimeSpan::empty(), cells: vec![Cell::default(); n_cells], rows: Vec::new() };
            self.intervals.entry(*key).or_insert_with(empty);
        }
        // The rows of a baseline and interval are summed in their order, so the sums do not depend on the number of threads.
        let Self { feeds, channels, options, intervals, .. } = self;
        let by_row = options.outliers != Outliers::None;
        let of = RowsOfBlock { coverage, vis, weights, flags, model, samples, n_pol, n_ant, feeds, channels, by_row };
        let parts: Vec<_> = intervals.iter_mut().filter_map(|(key, sums)| rows_of.get(key).map(|rows| (sums, rows))).collect();
        let done: Vec<Added> = parts.into_par_iter().map(|(sums, rows)| of.add(rows, sums)).collect();
        for Added { counts, present, .. } in done {
            self.counts.add(counts);
            self.present.iter_mut().zip(present).for_each(|(all, part)| *all |= part);
        }
        Ok(())
    }

    /// One pass over a set. Where several processes share it, all get the sums over all rows.
    ///
    /// # Errors
    /// As [`NormalEquations::add`], errors of the source or the model, or [`ChainError::Cancelled`].
    pub fn of(
        source: &mut dyn VisibilitySource,
        model: &mut dyn ModelVisibilities,
        options: &SolveOptions,
        observer: &dyn Observer,
    ) -> Result<Self> {
        let header = source.header().clone();
        let mut sums = Self::new(&header, options)?;
        let ranks = source.ranks();
        if ranks.size() > 1 {
            begin(&mut sums.bins, &*ranks, first_row(source, |c, row| c.ant1[row] != c.ant2[row]))?;
        }
        observer.event(Event::Phase { name: "normal equations", total: Some(source.n_rows() as u64), unit: "rows" });
        let own = for_each_block(source, MemoryBudget::default().block(), |first_row, block| {
            if observer.cancelled() {
                return Err(ChainError::Cancelled);
            }
            let predicted = model.predict(&header, first_row, &block.coverage)?;
            sums.add(&block, &predicted)?;
            observer.event(Event::Advance(block.n_rows() as u64));
            Ok(())
        });
        observer.event(Event::Done);
        sums.over(&*ranks, own)
    }

    /// The sums over the rows of all processes, from those over the rows of this one.
    fn over(mut self, ranks: &dyn Ranks, own: Result<()>) -> Result<Self> {
        if ranks.size() == 1 {
            return own.map(|()| self);
        }
        let told = of_all(ranks, own.map(|()| self.numbers()))?;
        self.intervals.clear();
        self.counts = SampleCounts::default();
        self.present.fill(false);
        for numbers in &told {
            self.follow(numbers).ok_or_else(|| ChainError::Internal("sums of another process are cut short".into()))?;
        }
        Ok(self)
    }

    /// Everything that is summed, as numbers.
    fn numbers(&self) -> Vec<f64> {
        let c = &self.counts;
        let mut out: Vec<f64> = [c.used, c.flagged, c.not_finite, c.bad_model].map(|n| n as f64).to_vec();
        out.extend(self.present.iter().map(|p| f64::from(u8::from(*p))));
        out.push(self.intervals.len() as f64);
        for (key, sums) in &self.intervals {
            let filled: Vec<(u32, &Cell)> = (0..).zip(&sums.cells).filter(|(_, c)| c.n > 0).collect();
            out.push(*key as f64);
            out.extend(sums.span.ends_jd());
            out.extend([filled.len() as f64, sums.rows.len() as f64]);
            for (at, c) in filled.into_iter().chain(sums.rows.iter().map(|(at, c)| (*at, c))) {
                let n = f64::from(c.n);
                out.extend([f64::from(at), c.vm.re, c.vm.im, c.mm, c.vv, n, c.half_vm.re, c.half_vm.im, c.half_mm]);
            }
        }
        out
    }

    /// Add the sums over rows that follow, from their numbers; `None` if any are missing.
    fn follow(&mut self, numbers: &[f64]) -> Option<()> {
        let mut numbers = Numbers::of(numbers);
        let [used, flagged, not_finite, bad_model] = numbers.next()?.map(|n: f64| n as u64);
        self.counts.add(SampleCounts { used, flagged, not_finite, bad_model });
        for present in &mut self.present {
            let [here] = numbers.next()?;
            *present |= here > 0.0;
        }
        let n_cells = self.channels.n_groups() * self.feeds.names.len() * n_pairs(self.header.layout.n_ant());
        let empty = || IntervalSums { span: TimeSpan::empty(), cells: vec![Cell::default(); n_cells], rows: Vec::new() };
        let [intervals] = numbers.next()?;
        for _ in 0..intervals as usize {
            let [key, first_jd, last_jd, filled, rows] = numbers.next()?;
            let sums = self.intervals.entry(key as i64).or_insert_with(empty);
            sums.span.unite(TimeSpan::of(first_jd, last_jd));
            for k in 0..filled as usize + rows as usize {
                let [at, vm_re, vm_im, mm, vv, n, half_re, half_im, half_mm] = numbers.next()?;
                let (vm, half_vm) = (Complex64::new(vm_re, vm_im), Complex64::new(half_re, half_im));
                let cell = Cell { vm, mm, vv, n: n as u32, half_vm, half_mm };
                if k < filled as usize {
                    sums.cells.get_mut(at as usize)?.follow(&cell);
                } else {
                    sums.rows.push((at as u32, cell));
                }
            }
        }
        Some(())
    }

    /// Refuse sums without usable data or with a model of zero.
    pub(crate) fn check_usable(&self) -> Result<()> {
        let c = &self.counts;
        if c.used == 0 {
            return Err(ChainError::NoData(format!(
                "no usable cross-correlation to solve on: {} samples are flagged, {} not finite, {} without a finite model",
                c.flagged, c.not_finite, c.bad_model
            )));
        }
        if !self.intervals.values().any(|i| i.cells.iter().any(|c| c.mm > 0.0)) {
            return Err(ChainError::NoData(
                "the model is zero on every baseline: gains cannot be solved against it; give a model with flux".into(),
            ));
        }
        Ok(())
    }

    /// The sums of one group and feed of an interval, \[pair\].
    pub(crate) fn cells<'a>(&self, sums: &'a IntervalSums, group: usize, feed: usize) -> &'a [Cell] {
        let n = n_pairs(self.header.layout.n_ant());
        let start = (group * self.feeds.names.len() + feed) * n;
        &sums.cells[start..start + n]
    }
}
