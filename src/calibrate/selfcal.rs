//! Self-calibration: gains are solved against a model, a better model is made from the calibrated data, and so on.
//!
//! The loop holds the gains. A [`ModelMaker`] holds the model of the sky; every deconvolver can be a model maker. Each round solves the
//! total gains from the raw data, never increments to earlier gains. It then gives the calibrated data to the maker, which makes the next
//! model. Rounds follow a schedule. A stage ends when its rounds no longer improve the image. The result is the best round.
//!
//! # Reference
//! Cornwell & Wilkinson 1981, MNRAS 196, 1067; Pearson & Readhead 1984, ARA&A 22, 97.

use super::apply::CalibratedSource;
use super::held_out::{HeldOut, Prediction, Without};
use super::model::{ModelVisibilities, PointModel};
use super::normal::NormalEquations;
use super::normal_sums::Cell;
use super::options::{GainMode, RoundOptions, SolveOptions};
use super::over_ranks::ends_all;
use super::rounds::{ModelMaker, ModelMetrics, RoundPlan, schedule};
use super::selfcal_tuning::SelfcalTuning;
use super::solve::{Solution, SolveReport};
use super::support::ClosureSupport;
use crate::closure::SolutionInterval;
use crate::progress::{Event, Observer};
use crate::{ChainError, Result};
use cittert_arrays::{GainTable, VisibilitySource};

/// The model against which the first gains are solved.
pub enum Start<'a> {
    /// A point at the phase centre (or at l, m). Its flux is estimated from the data if it is not given.
    Point {
        /// Flux in the unit of the visibilities.
        flux: Option<f64>,
        /// Direction cosine l.
        l: f64,
        /// Direction cosine m.
        m: f64,
    },
    /// A given model.
    Model(&'a mut dyn ModelVisibilities),
    /// The first image of the data as they are.
    Data,
    /// The model that the maker holds already.
    Present,
}

/// Options of [`selfcal`].
#[derive(Debug, Clone, PartialEq)]
pub struct SelfcalOptions {
    /// Options of the gain solutions; the schedule sets mode and interval.
    pub solve: SolveOptions,
    /// The rounds.
    pub schedule: Vec<RoundPlan>,
    /// The criterion for a better round, and the way in which gains are applied to the data before imaging.
    pub rounds: RoundOptions,
    /// Depth of the models and precision of the short rounds.
    pub tuning: SelfcalTuning,
}

impl SelfcalOptions {
    /// Usual options for a mode, interval and number of rounds, with the same interval in all rounds.
    #[must_use]
    pub fn new(mode: GainMode, solint: SolutionInterval, rounds: usize) -> Self {
        Self::of(SolveOptions { mode, solint, ..SolveOptions::default() }, RoundOptions { rounds, ..RoundOptions::default() })
    }

    /// The schedule of these options.
    #[must_use]
    pub fn of(solve: SolveOptions, rounds: RoundOptions) -> Self {
        let schedule = schedule(solve.mode, solve.solint, rounds.rounds, rounds.shrink);
        Self { solve, schedule, rounds, tuning: SelfcalTuning::default() }
    }
}

/// The record of one round.
#[derive(Debug, Clone, PartialEq)]
pub struct RoundRecord {
    /// Its plan.
    pub plan: RoundPlan,
    /// Its gains.
    pub gains: GainTable,
    /// How they were solved.
    pub report: SolveReport,
    /// The image made with them.
    pub metrics: ModelMetrics,
    /// Test of the model, against which the gains were solved, by the closure phases.
    pub support: ClosureSupport,
    /// How its gains and image predict the baselines that were held out, if any were.
    pub prediction: Option<Prediction>,
}

impl RoundRecord {
    /// The number by which rounds are compared; larger is better. It is the part of the held-out power that is predicted over the part
    /// that is not. Without held-out baselines it is the dynamic range.
    fn score(&self) -> f64 {
        self.prediction.as_ref().map_or_else(|| self.metrics.dynamic_range(), |p| 1.0 / p.misfit().max(1e-9))
    }
}

/// Baselines that the rounds must not use, and by which they are judged.
#[derive(Debug, Clone, Copy)]
pub struct Judge<'a> {
    /// The baselines.
    pub held: &'a HeldOut,
    /// Variance of the data over that of the weights; 0 where it is not known.
    pub noise: f64,
}

/// Why the loop ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SelfcalStop {
    /// All rounds are done.
    Completed,
    /// Further rounds did not improve the image.
    NoImprovement,
    /// A later round could not be solved or imaged; the reason.
    Failed(String),
}

impl std::fmt::Display for SelfcalStop {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Completed => f.write_str("all rounds done"),
            Self::NoImprovement => f.write_str("the image no longer improved"),
            Self::Failed(why) => write!(f, "a later round failed: {why}"),
        }
    }
}

/// The end of the rounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Selfcal {
    /// Every round, in order.
    pub rounds: Vec<RoundRecord>,
    /// Index of the best round. The images of the maker come from its gains.
    pub best: usize,
    /// Metrics of the image before any calibration, where one was made.
    pub before: Option<ModelMetrics>,
    /// Metrics of the last image, if the image of the best round was made again to the full depth.
    pub deepened: Option<ModelMetrics>,
    /// Why it ended.
    pub stop: SelfcalStop,
    /// Sentences about what makes the result doubtful. The observer has received them too.
    pub warnings: Vec<String>,
}

impl Selfcal {
    /// Metrics of the image that the maker holds at the end.
    #[must_use]
    pub fn final_metrics(&self) -> ModelMetrics {
        self.deepened.unwrap_or(self.best().metrics)
    }

    /// The record of the best round.
    #[must_use]
    pub fn best(&self) -> &RoundRecord {
        &self.rounds[self.best]
    }
}

/// The rounds of self-calibration, without a judgement whether their result is better than the data as they are: see
/// [`super::calibrate()`]. The data are not changed: apply the gains of [`Selfcal::best`] with [`super::apply()`].
///
/// With a judge, the rounds do not use the baselines that it holds out, and the best round is the one that predicts them best. Without
/// one, it is the one with the largest dynamic range.
///
/// # Errors
/// An empty schedule, a first round that cannot be solved or imaged (see [`super::solve()`]), or [`ChainError::Cancelled`].
pub fn selfcal(
    data: &mut dyn VisibilitySource,
    maker: &mut dyn ModelMaker,
    start: Start<'_>,
    options: &SelfcalOptions,
    judge: Option<Judge<'_>>,
    observer: &dyn Observer,
) -> Result<Selfcal> {
    let Some(first) = options.schedule.first() else {
        return Err(ChainError::BadOption { option: "rounds", value: "0".into(), expected: "at least 1".into() });
    };
    let mut out = Selfcal { rounds: Vec::new(), best: 0, before: None, deepened: None, stop: SelfcalStop::Completed, warnings: Vec::new() };
    let mut start = Some(start);
    if matches!(start, Some(Start::Data)) {
        let plan = RoundPlan { last: false, depth: options.tuning.first_depth, ..*first };
        maker.begin_round(0);
        out.before = Some(maker.update(&mut seen(data, judge), &plan, observer)?);
    }
    if matches!(start, Some(Start::Present)) {
        maker.reopen(&mut seen(data, judge), observer)?;
    }
    let mut idle = 0;
    let mut next = 0;
    while let Some(plan) = options.schedule.get(next) {
        if observer.cancelled() {
            return Err(ChainError::Cancelled);
        }
        maker.begin_round(next + 1);
        let record = match round(data, maker, start.take(), plan, options, judge, observer) {
            Ok(record) => record,
            Err(e) if out.rounds.is_empty() || ends_all(&e, &*data.ranks()) => return Err(e),
            Err(e) => {
                out.stop = SelfcalStop::Failed(e.to_string());
                break;
            }
        };
        observer.event(Event::Cycle {
            channel: None,
            number: next + 1,
            iterations: record.metrics.iterations,
            peak: record.metrics.peak,
            flux: record.metrics.model_flux,
            rms: record.metrics.residual_rms,
        });
        let score = record.score();
        let so_far = out.rounds.get(out.best).map_or(0.0, RoundRecord::score);
        idle = if score > so_far * (1.0 + options.rounds.improvement) { 0 } else { idle + 1 };
        if out.rounds.is_empty() {
            judge_start(&record.support, &mut out.warnings, observer);
        }
        out.rounds.push(record);
        if score > so_far || out.rounds.len() == 1 {
            out.best = out.rounds.len() - 1;
            maker.remember();
        }
        next += 1;
        if idle >= options.rounds.patience {
            idle = 0;
            let stage = |p: &RoundPlan| (p.mode, p.solint);
            // Another stage, or the deep rounds of this one, may still improve the image.
            let later = options.schedule.iter().skip(next).position(|p| stage(p) != stage(plan) || (p.last && !plan.last));
            match later {
                Some(skip) => {
                    if skip > 0 && stage(&options.schedule[next + skip]) == stage(plan) {
                        out.stop = SelfcalStop::NoImprovement;
                    }
                    next += skip;
                }
                None if next < options.schedule.len() => {
                    out.stop = SelfcalStop::NoImprovement;
                    break;
                }
                None => {}
            }
        }
    }
    if out.best().plan.last {
        maker.recall();
    } else {
        // The image of the best gains is made again to the full depth, which the plan of their round did not allow.
        maker.recall();
        let best = &out.rounds[out.best];
        let plan = RoundPlan { last: true, depth: 0.0, ..best.plan };
        let mut source = seen(data, judge);
        match maker.update(&mut CalibratedSource::new(&mut source, &best.gains, options.rounds.apply())?, &plan, observer) {
            Ok(metrics) => out.deepened = Some(metrics),
            Err(e) if ends_all(&e, &*data.ranks()) => return Err(e),
            Err(e) => {
                maker.recall();
                let warning = format!("the image of the best round could not be made to its full depth: {e}");
                observer.event(Event::Warning(&warning));
                out.warnings.push(warning);
            }
        }
    }
    if let Some(warning) = out.rounds.last().and_then(|r| r.support.misfit_warning()) {
        observer.event(Event::Warning(&warning));
        out.warnings.push(warning);
    }
    Ok(out)
}

/// The data without the baselines that a judge holds out.
fn seen<'a>(data: &'a mut dyn VisibilitySource, judge: Option<Judge<'a>>) -> Without<'a> {
    Without::new(data, judge.map(|j| j.held))
}

fn judge_start(support: &ClosureSupport, warnings: &mut Vec<String>, observer: &dyn Observer) {
    if let Some(misfit) = support.misfit_rad.filter(|m| *m > 0.5) {
        observer.event(Event::Note(&format!(
            "the closure phases of the starting model are off by {misfit:.2} rad rms: if the rounds do not converge, start from the data or a better model"
        )));
    }
    if let Some(warning) = support.noise_warning() {
        observer.event(Event::Warning(&warning));
        warnings.push(warning);
    }
}

/// One round: solve gains against the present model, and image the data that these gains calibrate.
pub(super) fn round(
    data: &mut dyn VisibilitySource,
    maker: &mut dyn ModelMaker,
    start: Option<Start<'_>>,
    plan: &RoundPlan,
    options: &SelfcalOptions,
    judge: Option<Judge<'_>>,
    observer: &dyn Observer,
) -> Result<RoundRecord> {
    let mut source = seen(data, judge);
    let solve = SolveOptions { mode: plan.mode, solint: plan.solint, normalize: plan.mode == GainMode::AmpPhase, ..options.solve.clone() };
    let first = start.is_some();
    let (mut sums, independent_model) = match start {
        Some(Start::Point { flux, l, m }) => (point_sums(&mut source, flux, (l, m), &solve, observer)?, true),
        Some(Start::Model(model)) => (NormalEquations::of(&mut source, model, &solve, observer)?, true),
        Some(Start::Data) => {
            let sums = NormalEquations::of(&mut source, maker, &solve, observer)?;
            if sums.counts.used > 0 && sums.check_usable().is_err() {
                observer.event(Event::Note("the first image has no source above the noise: starting from a point at the phase centre"));
                (point_sums(&mut source, None, (0.0, 0.0), &solve, observer)?, true)
            } else {
                (sums, false)
            }
        }
        Some(Start::Present) | None => (NormalEquations::of(&mut source, maker, &solve, observer)?, false),
    };
    let support = ClosureSupport { independent_model, ..sums.closure_support() };
    let solved = match sums.solve(observer) {
        // Noise rarely reaches the least signal to noise ratio. The gains are solved without that limit, and a warning says that the data
        // may be noise.
        Err(ChainError::NoData(_)) if first && !support.is_signal() && solve.min_snr > 0.0 => {
            sums.options.min_snr = 0.0;
            sums.solve(observer)
        }
        other => other,
    };
    let Solution { gains, report } = solved?;
    drop(sums);
    let metrics = maker.update(&mut CalibratedSource::new(&mut source, &gains, options.rounds.apply())?, plan, observer)?;
    let predict = |j: Judge<'_>| Prediction::of(data, j.held, maker, Some(&gains), options.rounds.apply(), j.noise);
    let prediction = judge.map(predict).transpose()?;
    Ok(RoundRecord { plan: *plan, gains, report, metrics, support, prediction })
}

/// Sums against a point. If its flux is not given, the flux that explains the power of the data is used.
fn point_sums(
    data: &mut dyn VisibilitySource,
    flux: Option<f64>,
    (l, m): (f64, f64),
    solve: &SolveOptions,
    observer: &dyn Observer,
) -> Result<NormalEquations> {
    let mut sums = NormalEquations::of(data, &mut PointModel { flux: flux.unwrap_or(1.0), l, m }, solve, observer)?;
    if flux.is_none() {
        sums.scale_model(sums.flux_estimate());
    }
    Ok(sums)
}

impl NormalEquations {
    /// Flux of a source shaped like the model, in units of it, that explains the power of the cells beyond noise.
    fn flux_estimate(&self) -> f64 {
        let scale2 = self.noise_scale2();
        let (mut power, mut noise, mut unit) = (0.0, 0.0, 0.0);
        for c in self.intervals.values().flat_map(|i| &i.cells) {
            power += c.vm.norm_sqr();
            noise += 2.0 * scale2 * c.mm;
            unit += c.mm * c.mm;
        }
        // If the power does not exceed the noise, any flux is suitable. The flux of the noise is used.
        let signal = if power > noise { power - noise } else { noise };
        if unit > 0.0 && signal > 0.0 { (signal / unit).sqrt() } else { 1.0 }
    }

    /// Multiply the model by a number, after the fact.
    fn scale_model(&mut self, factor: f64) {
        let scale = |c: &mut Cell| {
            c.vm *= factor;
            c.mm *= factor * factor;
            c.half_vm *= factor;
            c.half_mm *= factor * factor;
        };
        for i in self.intervals.values_mut() {
            i.cells.iter_mut().for_each(scale);
            i.rows.iter_mut().for_each(|(_, c)| scale(c));
        }
    }
}
