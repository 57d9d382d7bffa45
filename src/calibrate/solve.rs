//! Antenna gains of a whole set: one pass over the data, one least squares problem for each solution interval.

use super::antenna_fit::{AntennaFit, FlagReason, IntervalData, RowSums, solve_interval};
use super::model::ModelVisibilities;
use super::normal::NormalEquations;
use super::normal_sums::{IntervalSums, SampleCounts};
use super::options::{GainMode, SolveOptions};
use super::reference::{reference_phases, reference_priority};
use crate::closure::n_pairs;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use cittert_arrays::{GainTable, VisibilitySource};
use ndarray::{Array3, Array4};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The solution of one interval, channel group and feed in numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct IntervalReport {
    /// Index of the solution interval.
    pub interval: usize,
    /// Index of the channel group (0 in delay mode).
    pub group: usize,
    /// Index of the feed.
    pub feed: usize,
    /// Antennas with a gain.
    pub solved: usize,
    /// Iterations of the last solution.
    pub iterations: usize,
    /// True where the gains settled within the tolerance.
    pub converged: bool,
    /// Condition number of the least squares system without the common phase; infinite where it was not solved.
    pub condition: f64,
    /// chi^2 by the weights.
    pub chi2: f64,
    /// Degrees of freedom of `chi2`.
    pub freedom: f64,
}

/// The whole solution in numbers.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SolveReport {
    /// Every interval, channel group and feed.
    pub intervals: Vec<IntervalReport>,
    /// Gains flagged, by reason.
    pub flagged: BTreeMap<FlagReason, usize>,
    /// Gains solved.
    pub solved: usize,
    /// Samples used and not used.
    pub samples: SampleCounts,
    /// Intervals (of a channel group and feed) in which another antenna than the first choice was the reference.
    pub refant_fallbacks: usize,
}

impl SolveReport {
    /// Intervals that did not converge although antennas were solved.
    #[must_use]
    pub fn not_converged(&self) -> usize {
        self.intervals.iter().filter(|i| i.solved > 0 && !i.converged).count()
    }

    /// Largest condition number of a solved interval; 1 if there is none.
    #[must_use]
    pub fn worst_condition(&self) -> f64 {
        self.intervals.iter().filter(|i| i.solved > 0).map(|i| i.condition).fold(1.0, f64::max)
    }

    /// chi^2 over its degrees of freedom, over all intervals that were solved.
    #[must_use]
    pub fn reduced_chi2(&self) -> f64 {
        let solved = || self.intervals.iter().filter(|i| i.solved > 0);
        let freedom: f64 = solved().map(|i| i.freedom).sum();
        if freedom > 0.0 { solved().map(|i| i.chi2).sum::<f64>() / freedom } else { f64::NAN }
    }
}

/// Gains and the report of their solution.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// The gains, in the convention V = g1 conj(g2) M. Gains that could not be solved are flagged and have the value 1.
    pub gains: GainTable,
    /// Its numbers.
    pub report: SolveReport,
}

/// One solution of a set.
#[derive(Clone, Copy)]
struct Job {
    interval: usize,
    group: usize,
    feed: usize,
}

/// Solve antenna gains of a set against a model.
///
/// # Errors
/// Options out of range, an interval shorter than an integration, nothing usable (all flagged, model zero), no antenna
/// solvable in any interval, or an error of source or model.
///
/// # Reference
/// Salvini & Wijnholds 2014, A&A 571, A97; Cornwell & Wilkinson 1981, MNRAS 196, 1067.
pub fn solve(
    source: &mut dyn VisibilitySource,
    model: &mut dyn ModelVisibilities,
    options: &SolveOptions,
    observer: &dyn Observer,
) -> Result<Solution> {
    NormalEquations::of(source, model, options, observer)?.solve(observer)
}

impl NormalEquations {
    /// Solve every interval.
    ///
    /// # Errors
    /// Nothing usable, no antenna solvable in any interval, or [`ChainError::Cancelled`].
    pub fn solve(&self, observer: &dyn Observer) -> Result<Solution> {
        self.check_usable()?;
        let needed = self.options.baselines_needed(self.present.iter().filter(|p| **p).count());
        let delay = self.options.mode == GainMode::Delay;
        let n_feed = self.feeds.names.len();
        let groups = if delay { 1 } else { self.channels.n_groups() };
        let intervals: Vec<&IntervalSums> = self.intervals.values().filter(|i| i.cells.iter().any(|c| c.n > 0)).collect();
        let jobs: Vec<Job> = (0..intervals.len() * groups * n_feed)
            .map(|k| Job { interval: k / (groups * n_feed), group: k / n_feed % groups, feed: k % n_feed })
            .collect();
        observer.event(Event::Phase { name: "gain solutions", total: Some(jobs.len() as u64), unit: "solutions" });
        let fits: Vec<AntennaFit> = jobs
            .par_iter()
            .map(|job| {
                if observer.cancelled() {
                    return Err(ChainError::Cancelled);
                }
                let fit = solve_interval(&self.interval_data(intervals[job.interval], job.group, job.feed), &self.options, needed);
                observer.event(Event::Advance(1));
                Ok(fit)
            })
            .collect::<Result<_>>()?;
        observer.event(Event::Done);
        self.collect(&intervals, &jobs, &fits, observer)
    }

    /// The sums of one solution; in delay mode all channels of the feed.
    fn interval_data<'a>(&'a self, sums: &'a IntervalSums, group: usize, feed: usize) -> IntervalData<'a> {
        let n_ant = self.header.layout.n_ant();
        let chans = if self.options.mode == GainMode::Delay { 0..self.channels.n_groups() } else { group..group + 1 };
        let (n_feed, n) = (self.feeds.names.len(), n_pairs(n_ant));
        let rows = sums
            .rows
            .iter()
            .filter_map(|(index, cell)| {
                let (block, pair) = (*index as usize / n, *index as usize % n);
                let (g, f) = (block / n_feed, block % n_feed);
                (f == feed && chans.contains(&g)).then(|| RowSums { chan: g - chans.start, pair, cell: *cell })
            })
            .collect();
        let cells = chans.clone().map(|c| self.cells(sums, c, feed)).collect();
        IntervalData { n_ant, cells, rows, freq_hz: self.header.spectrum.freq_hz() }
    }

    /// Put the fits into a table, refer their phases to the reference antenna, and report.
    fn collect(&self, intervals: &[&IntervalSums], jobs: &[Job], fits: &[AntennaFit], observer: &dyn Observer) -> Result<Solution> {
        let layout = &self.header.layout;
        let n_feed = self.feeds.names.len();
        let mut table = GainTable::unity(
            layout.clone(),
            self.channels.spectrum.clone(),
            self.feeds.names.clone(),
            intervals.iter().map(|i| i.span.middle_jd()).collect(),
            intervals.iter().map(|i| i.span.length_s()).collect(),
        )?;
        let mut quality = Array4::zeros(table.gains.dim());
        let mut total = Array3::zeros((intervals.len(), self.channels.n_groups(), n_feed));
        let mut report = SolveReport {
            intervals: Vec::with_capacity(jobs.len()),
            flagged: BTreeMap::new(),
            solved: 0,
            samples: self.counts,
            refant_fallbacks: 0,
        };
        for (&Job { interval: t, group, feed: f }, fit) in jobs.iter().zip(fits) {
            for (c, gains) in fit.gains.iter().enumerate() {
                for (p, gain) in gains.iter().enumerate() {
                    let at = (t, p, group + c, f);
                    table.gains[at] = *gain;
                    table.flags[at] = fit.flagged[p].is_some();
                    quality[at] = fit.snr[p].max(0.0);
                }
                total[(t, group + c, f)] = if fit.freedom > 0.0 { fit.chi2 / fit.freedom } else { 0.0 };
            }
            for reason in fit.flagged.iter().flatten() {
                *report.flagged.entry(*reason).or_insert(0) += 1;
            }
            let solved = fit.flagged.iter().filter(|f| f.is_none()).count();
            report.solved += solved;
            report.intervals.push(IntervalReport {
                interval: t,
                group,
                feed: f,
                solved,
                iterations: fit.iterations,
                converged: fit.converged,
                condition: fit.condition,
                chi2: fit.chi2,
                freedom: fit.freedom,
            });
        }
        if report.solved == 0 {
            let reasons: Vec<String> = report.flagged.iter().map(|(r, n)| format!("{n} with {}", r.name())).collect();
            return Err(ChainError::NoData(format!("no antenna could be solved in any interval: {}", reasons.join(", "))));
        }
        let wanted = self.reference_antennas()?;
        let priority = reference_priority(&table.flags, &quality, &wanted);
        report.refant_fallbacks = reference_phases(&mut table, &quality, &priority);
        table.refant = priority.first().copied();
        self.tell(&report, (wanted.first(), priority.first()), &table, observer);
        if self.options.normalize && self.options.mode == GainMode::AmpPhase {
            normalize(&mut table);
        }
        table.quality = Some(quality);
        table.total_quality = Some(total);
        table.mode = self.options.mode.name().into();
        Ok(Solution { gains: table, report })
    }

    fn reference_antennas(&self) -> Result<Vec<usize>> {
        self.options.refant.as_ref().map_or(Ok(Vec::new()), |names| names.indices(&self.header.layout))
    }

    fn tell(&self, report: &SolveReport, reference: (Option<&usize>, Option<&usize>), table: &GainTable, observer: &dyn Observer) {
        let name = |a: usize| self.header.layout.antennas()[a].name.as_str();
        if let (Some(wanted), Some(got)) = reference
            && wanted != got
        {
            observer.event(Event::Warning(&format!("reference antenna {} has no solution, {} takes its place", name(*wanted), name(*got))));
        }
        if report.refant_fallbacks > 0 {
            observer.event(Event::Note(&format!(
                "{} solutions have another reference antenna than {}",
                report.refant_fallbacks,
                table.refant.map_or("none", name)
            )));
        }
        if !report.flagged.is_empty() {
            let reasons: Vec<String> = report.flagged.iter().map(|(r, n)| format!("{n} {}", r.name())).collect();
            let total: usize = report.flagged.values().sum();
            observer.event(Event::Note(&format!("{total} of {} gains flagged: {}", total + report.solved, reasons.join(", "))));
        }
        if self.counts.not_finite + self.counts.bad_model > 0 {
            observer.event(Event::Warning(&format!(
                "{} samples were not finite and {} had no finite model: left out",
                self.counts.not_finite, self.counts.bad_model
            )));
        }
        if report.not_converged() > 0 {
            observer.event(Event::Warning(&format!(
                "{} of {} solutions did not converge in {} iterations",
                report.not_converged(),
                report.intervals.len(),
                self.options.max_iterations
            )));
        }
    }
}

/// Scale each feed so that the mean power of its unflagged gains is 1.
fn normalize(table: &mut GainTable) {
    for feed in 0..table.feeds.len() {
        let gains = table.gains.index_axis(ndarray::Axis(3), feed);
        let flags = table.flags.index_axis(ndarray::Axis(3), feed);
        let good: Vec<f64> = gains.iter().zip(&flags).filter(|(_, f)| !**f).map(|(g, _)| g.norm_sqr()).collect();
        let mean = good.iter().sum::<f64>() / good.len().max(1) as f64;
        if mean > 0.0 {
            let factor = 1.0 / mean.sqrt();
            let flags = flags.to_owned();
            let mut gains = table.gains.index_axis_mut(ndarray::Axis(3), feed);
            ndarray::Zip::from(&mut gains).and(&flags).for_each(|g, f| *g *= if *f { 1.0 } else { factor });
        }
    }
}
