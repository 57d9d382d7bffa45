//! Self-calibration that does not harm: several ways are tried, held-out baselines choose among them, and the data are left as they are if
//! no way predicts these baselines better.
//!
//! Every candidate is a maker of models with its rounds. For each of them the data as they are, and the result of the rounds, predict the
//! baselines that were held out (see [`HeldOut`]). The best result is accepted if
//!
//! * it predicts them significantly better than the best image of the data as they are,
//! * it predicts most of their power,
//! * the misfit falls by about as much as gains of this size must make it fall, and
//! * the gains exceed their own uncertainty, which is seen when the held-out baselines are added.
//!
//! The final gains and image use all baselines.

use super::evidence::Evidence;
use super::held_out::{HeldOut, JudgeOptions, Prediction, Without};
use super::joint_model::ImageMaker;
use super::model::ModelVisibilities;
use super::over_ranks::ends_all;
use super::rounds::RoundPlan;
use super::selfcal::{Judge, Selfcal, SelfcalOptions, Start, round, selfcal};
use crate::mem::noise_from_hands;
use crate::progress::{Event, Observer, Quiet};
use crate::{ChainError, Result};
use cittert_arrays::{GainTable, VisibilitySource};

/// One way to self-calibrate.
pub struct Candidate<'a> {
    /// Name of its deconvolver.
    pub name: &'static str,
    /// Its rounds.
    pub options: SelfcalOptions,
    /// Makes a maker without a model.
    pub make: Box<dyn Fn() -> Box<dyn ImageMaker + 'a> + 'a>,
}

/// What the first gains are solved against, for every candidate.
pub enum Beginning<'a> {
    /// A point at the phase centre whose flux is estimated from the data.
    Point,
    /// A given model.
    Model(&'a mut dyn ModelVisibilities),
    /// The first image of the data as they are.
    Data,
}

impl Beginning<'_> {
    fn start(&mut self) -> Start<'_> {
        match self {
            Self::Point => Start::Point { flux: None, l: 0.0, m: 0.0 },
            Self::Model(model) => Start::Model(*model),
            Self::Data => Start::Data,
        }
    }
}

/// How a candidate did.
#[derive(Debug, Clone, PartialEq)]
pub struct CandidateRecord {
    /// Name of its deconvolver.
    pub name: &'static str,
    /// Misfit of the held-out baselines for the image of the data as they are.
    pub before: Option<f64>,
    /// Misfit of the held-out baselines for the best round.
    pub after: Option<f64>,
    /// Why it has no result.
    pub failure: Option<String>,
}

/// The decision about the gains.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// The held-out baselines support the gains.
    Accepted,
    /// They do not, but the caller wanted the best round anyway; the reason.
    Forced(String),
    /// They do not: gains are 1, and the image is that of the data as they are; the reason.
    Rejected(String),
    /// The array has too few baselines to hold any out, or the caller wants no judgement.
    NotJudged,
}

impl Verdict {
    /// False if the data are left as they are.
    #[must_use]
    pub fn accepted(&self) -> bool {
        !matches!(self, Self::Rejected(_))
    }
}

/// The end of a self-calibration.
pub struct Calibrated {
    /// The decision.
    pub verdict: Verdict,
    /// Its numbers, if baselines were held out and a candidate finished.
    pub evidence: Option<Evidence>,
    /// Every candidate that was tried.
    pub candidates: Vec<CandidateRecord>,
    /// Name of the deconvolver of the images.
    pub algorithm: &'static str,
    /// Name of the best candidate.
    pub best: &'static str,
    /// Every round of the best candidate. The best one is that of the final gains.
    pub rounds: Selfcal,
    /// The gains to apply: those of the best round, or 1.
    pub gains: GainTable,
}

/// The best candidate so far.
struct Best<'a> {
    index: usize,
    misfit: f64,
    prediction: Option<Prediction>,
    maker: Box<dyn ImageMaker + 'a>,
    rounds: Selfcal,
}

/// The best image of the data as they are.
struct AsTheyAre {
    index: usize,
    step: usize,
    prediction: Prediction,
}

/// Self-calibrate by the candidate that predicts held-out baselines best, or leave the data as they are. Returns the maker that holds the
/// final images too. The data are not changed: apply [`Calibrated::gains`] with [`super::apply()`].
///
/// # Errors
/// No candidate, no candidate that can be solved or imaged, or [`ChainError::Cancelled`].
pub fn calibrate<'a>(
    data: &mut dyn VisibilitySource,
    candidates: &[Candidate<'a>],
    mut beginning: Beginning<'_>,
    judging: &JudgeOptions,
    observer: &dyn Observer,
) -> Result<(Calibrated, Box<dyn ImageMaker + 'a>)> {
    // The gain solutions must still find enough baselines on each antenna.
    let n_ant = data.header().layout.n_ant();
    let least = candidates.iter().map(|c| c.options.solve.baselines_needed(n_ant)).max().unwrap_or(1);
    let held = HeldOut::draw(data, judging, least)?;
    let hands = noise_from_hands(data)?;
    let noise = hands.factor.unwrap_or(if hands.weights_are_counts { 0.0 } else { 1.0 });
    let judge = held.as_ref().map(|held| Judge { held, noise });
    let mut trials = Trials::default();
    for (index, candidate) in candidates.iter().enumerate() {
        if candidates.len() > 1 {
            observer.event(Event::Note(&format!("candidate {} of at most {}: {}", index + 1, candidates.len(), candidate.name)));
        }
        trials.add(data, (index, candidate), &mut beginning, judge, observer)?;
        if trials.best.as_ref().is_some_and(|b| b.misfit < judging.enough) {
            break;
        }
    }
    let Trials { records, before, best, first_error } = trials;
    let Some(mut best) = best else {
        return Err(first_error.unwrap_or_else(|| ChainError::NoData("no deconvolver is given to self-calibrate with".into())));
    };
    let candidate = &candidates[best.index];
    let mut calibrated = Calibrated {
        verdict: Verdict::NotJudged,
        evidence: None,
        candidates: records,
        algorithm: candidate.name,
        best: candidate.name,
        gains: best.rounds.best().gains.clone(),
        rounds: best.rounds,
    };
    let (Some(judge), Some(before), Some(after)) = (judge, before, best.prediction) else {
        if judging.fraction > 0.0 {
            let why = "the array has too few baselines to hold some out: whether the gains are right is not known";
            observer.event(Event::Warning(why));
            calibrated.rounds.warnings.push(why.to_owned());
        }
        return Ok((calibrated, best.maker));
    };
    let doubt =
        decide(data, (best.maker.as_mut(), candidate), &mut calibrated, (&before.prediction, &after, judge.held, judging), observer)?;
    let warnings = &mut calibrated.rounds.warnings;
    calibrated.verdict = match doubt {
        None => Verdict::Accepted,
        Some(why) if judging.force => {
            warnings.push(format!("the gains are applied against the evidence, because this was asked for: {why}"));
            Verdict::Forced(why)
        }
        Some(why) => {
            warnings.push(format!("self-calibration is not accepted, and the data are left as they are: {why}"));
            calibrated.gains.gains.fill(1.0.into());
            calibrated.gains.flags.fill(false);
            calibrated.algorithm = candidates[before.index].name;
            best.maker = (candidates[before.index].make)();
            for step in 0..=before.step {
                best.maker.as_they_are(data, step, &Quiet(observer))?;
            }
            Verdict::Rejected(why)
        }
    };
    Ok((calibrated, best.maker))
}

/// The candidates that were tried, and the best of them.
#[derive(Default)]
struct Trials<'a> {
    records: Vec<CandidateRecord>,
    before: Option<AsTheyAre>,
    best: Option<Best<'a>>,
    first_error: Option<ChainError>,
}

impl<'a> Trials<'a> {
    /// Try a candidate: predict the held-out baselines from its image of the data as they are, and from the result of its rounds.
    fn add(
        &mut self,
        data: &mut dyn VisibilitySource,
        (index, candidate): (usize, &Candidate<'a>),
        beginning: &mut Beginning<'_>,
        judge: Option<Judge<'_>>,
        observer: &dyn Observer,
    ) -> Result<()> {
        let mut record = CandidateRecord { name: candidate.name, before: None, after: None, failure: None };
        match judge.map_or(Ok(None), |judge| image_as_they_are(data, candidate, judge, observer)) {
            Ok(Some((step, prediction))) => {
                record.before = Some(prediction.misfit());
                if self.before.as_ref().is_none_or(|b| prediction.misfit() < b.prediction.misfit()) {
                    self.before = Some(AsTheyAre { index, step, prediction });
                }
            }
            Ok(None) => {}
            Err(e) if ends_all(&e, &*data.ranks()) => return Err(e),
            Err(e) => record.failure = Some(e.to_string()),
        }
        let mut maker = (candidate.make)();
        match selfcal(data, maker.as_mut(), beginning.start(), &candidate.options, judge, observer) {
            Ok(rounds) => {
                let prediction = rounds.best().prediction.clone();
                let misfit = prediction.as_ref().map_or(0.0, Prediction::misfit);
                record.after = prediction.as_ref().map(Prediction::misfit);
                if self.best.as_ref().is_none_or(|b| misfit < b.misfit) {
                    self.best = Some(Best { index, misfit, prediction, maker, rounds });
                }
            }
            Err(e) if ends_all(&e, &*data.ranks()) => return Err(e),
            Err(e) => {
                record.failure = Some(e.to_string());
                self.first_error.get_or_insert(e);
            }
        }
        if let (Some(after), Some(before)) = (record.after, record.before) {
            let name = candidate.name;
            let text = format!("{name}: the misfit of the held-out baselines is {before:.4} before and {after:.4} after self-calibration");
            observer.event(Event::Note(&text));
        }
        self.records.push(record);
        Ok(())
    }
}

/// Add the held-out baselines to the best candidate, and weigh the evidence. Returns why its gains are not to be believed, if they are not.
fn decide(
    data: &mut dyn VisibilitySource,
    (maker, candidate): (&mut dyn ImageMaker, &Candidate<'_>),
    calibrated: &mut Calibrated,
    (before, after, held, judging): (&Prediction, &Prediction, &HeldOut, &JudgeOptions),
    observer: &dyn Observer,
) -> Result<Option<String>> {
    let trained = calibrated.gains.clone();
    let added = match add_all_baselines(data, maker, candidate, calibrated, observer) {
        Err(e) if ends_all(&e, &*data.ranks()) => return Err(e),
        Err(e) => Some(format!("no gains can be solved when the held-out baselines are added: {e}")),
        Ok(()) => None,
    };
    let evidence = Evidence::of((before, after), (&trained, &calibrated.gains), held)?;
    calibrated.evidence = Some(evidence);
    Ok(added.or_else(|| evidence.doubt(judging)))
}

/// The step at which the image of the data as they are predicts the held-out baselines best, and this prediction.
fn image_as_they_are(
    data: &mut dyn VisibilitySource,
    candidate: &Candidate<'_>,
    judge: Judge<'_>,
    observer: &dyn Observer,
) -> Result<Option<(usize, Prediction)>> {
    let mut maker = (candidate.make)();
    let mut best: Option<(usize, Prediction)> = None;
    for step in 0.. {
        if maker.as_they_are(&mut Without::new(data, Some(judge.held)), step, &Quiet(observer))?.is_none() {
            break;
        }
        let now = Prediction::of(data, judge.held, maker.as_mut(), None, candidate.options.rounds.apply(), judge.noise)?;
        match &best {
            // Deeper images of data with errors predict worse and worse.
            Some((_, b)) if now.misfit() > 2.0 * b.misfit() => break,
            Some((_, b)) if now.misfit() >= b.misfit() => {}
            _ => best = Some((step, now)),
        }
    }
    Ok(best)
}

/// Two more rounds with all baselines, from the model of the best round.
fn add_all_baselines(
    data: &mut dyn VisibilitySource,
    maker: &mut dyn ImageMaker,
    candidate: &Candidate<'_>,
    calibrated: &mut Calibrated,
    observer: &dyn Observer,
) -> Result<()> {
    let best = calibrated.rounds.best();
    let plan = RoundPlan { depth: 0.0, last: true, ..best.plan };
    let first = calibrated.rounds.rounds.len();
    for k in 0..2 {
        maker.begin_round(first + k + 1);
        let start = (k == 0).then_some(Start::Present);
        let record = round(data, maker, start, &plan, &candidate.options, None, observer)?;
        calibrated.rounds.rounds.push(record);
    }
    calibrated.rounds.best = calibrated.rounds.rounds.len() - 1;
    calibrated.rounds.deepened = None;
    calibrated.gains = calibrated.rounds.best().gains.clone();
    Ok(())
}
