//! One trial: corrupt, image, self-calibrate, compare.

use super::base::{Antennas, Base, Deconvolution, Reference, image, seen};
use super::score::{Quality, quality};
use crate::calibrate::{
    AntennaNames, Beginning, CalibratedSource, CandidateOptions, CompareOptions, RoundOptions, SetModel, SolveOptions, StartFrom,
    calibrate, candidates, compare_gains,
};
use crate::corrupt::{CorruptOptions, Error, corrupt_with};
use crate::deconvolve::{Algorithm, CleanOptions};
use crate::fidelity::{find_shift, shifted};
use crate::progress::Silent;
use crate::{ChainError, Result};
use cittert_arrays::{GainTable, VisibilitySet};
use ndarray::Axis;
use std::sync::Arc;

/// One point of the grid, ready to run.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The error-free observation.
    pub base: Arc<Base>,
    /// The antennas of each seed, if a trial uses only some antennas of the base.
    pub antennas: Antennas,
    /// The errors that are injected.
    pub errors: Vec<Error>,
    /// The self-calibration; `None` images the corrupted data alone.
    pub selfcal: Option<SelfcalPlan>,
    /// The antenna of the base that has failed, by its index. Its data are flagged. The image is still compared with that of all antennas.
    pub silent: Option<usize>,
}

/// How trials are self-calibrated.
#[derive(Debug, Clone, PartialEq)]
pub struct SelfcalPlan {
    /// How gains are solved. The least signal to noise ratio counts only where thermal noise is among the errors. Reference antennas that
    /// are not in a trial are ignored.
    pub solve: SolveOptions,
    /// The start of the first gains, and the rounds.
    pub rounds: RoundOptions,
}

/// The result of a trial.
#[derive(Debug, Clone, PartialEq)]
pub struct TrialResult {
    /// The corrupted data as they are.
    pub before: Quality,
    /// After self-calibration; `None` if there was none or it failed.
    pub after: Option<Quality>,
    /// Whether the gains of self-calibration were applied; `None` if there was none. Where they are not accepted, the image `after` is that
    /// of the data as they are.
    pub accepted: Option<bool>,
    /// Rounds of self-calibration.
    pub rounds: usize,
    /// The reason why self-calibration failed or is doubtful; otherwise empty.
    pub note: String,
}

/// Run one trial. The result depends only on the arguments. It is the same to the last bit only if the caller runs it on a rayon pool of
/// one thread.
///
/// Errors are drawn only from `seed`, so that trials of one seed at neighbouring points have the same errors with another size.
///
/// # Errors
/// An option is out of range, or no image can be made of the data. A self-calibration that fails is a result, not an error.
pub fn trial(setup: &Setup, seed: u64) -> Result<TrialResult> {
    let base = match setup.antennas {
        Antennas::All => setup.base.clone(),
        some => Arc::new(setup.base.with(some, seed)?),
    };
    let mut reference = base.reference()?;
    if setup.silent.is_some() {
        // Without the antenna another beam would be fitted. All images have the beam of the reference, so that they can be compared.
        let mut alike = reference.as_ref().clone();
        alike.imaging.beam = alike.beam;
        reference = Arc::new(alike);
    }
    let options = CorruptOptions { seed, errors: setup.errors.clone(), per_feed: false };
    let mut data = VisibilitySet::new(base.set.header.clone(), base.set.data.rows(0..0)?)?;
    let mut truth = corrupt_with(&mut base.set.clone(), &mut data, &options, base.scene.as_deref(), &Silent)?.gains;
    if let Some(antenna) = setup.silent {
        silence(&mut data, &mut truth, antenna);
    }
    let first = image(&mut data, &reference.imaging, &base.deconvolution)?;
    let mut unity = truth.clone();
    unity.gains.fill(1.0.into());
    let before = quality(&first, &reference, phase_rms(&truth, &unity, false)?);
    let mut result = TrialResult { before, after: None, accepted: setup.selfcal.as_ref().map(|_| false), rounds: 0, note: String::new() };
    if let Some(plan) = &setup.selfcal {
        let mut error_free = base.set.clone();
        let mut truth_model = SetModel(&mut error_free);
        let ways = candidates(&candidate_options(&base, &reference, &data, setup, plan))?;
        let beginning = match plan.rounds.start {
            StartFrom::Point => Beginning::Point,
            StartFrom::Data => Beginning::Data,
            StartFrom::Truth => Beginning::Model(&mut truth_model),
        };
        match calibrate(&mut data, &ways, beginning, &plan.rounds.judge(), &Silent) {
            Ok((run, maker)) => {
                result.rounds = run.rounds.rounds.len();
                result.accepted = Some(run.verdict.accepted());
                result.note = run.rounds.warnings.join("; ");
                let from_data = plan.rounds.start == StartFrom::Data;
                let phase = phase_rms(&truth, &run.gains, from_data)?;
                let last = match (&base.deconvolution, maker.products()) {
                    (Deconvolution::Mem(_), Some(p)) if run.verdict.accepted() => {
                        let mut last = seen(p, &base.deconvolution);
                        if from_data {
                            let by = find_shift(last.image.view(), reference.image.view())?;
                            last.image = shifted(last.image.view(), by);
                        }
                        last
                    }
                    (Deconvolution::Mem(_), _) => image(&mut data, &reference.imaging, &base.deconvolution)?,
                    // One deconvolver makes all images of a study, so that they can be compared.
                    (how, _) => image(&mut CalibratedSource::new(&mut data, &run.gains, plan.rounds.apply())?, &reference.imaging, how)?,
                };
                result.after = Some(quality(&last, &reference, phase));
            }
            Err(ChainError::NoData(why) | ChainError::Incompatible(why)) => result.note = why,
            Err(e) => return Err(e),
        }
    }
    Ok(result)
}

/// Flag everything that an antenna takes part in, and its gains.
fn silence(data: &mut VisibilitySet, truth: &mut GainTable, antenna: usize) {
    let block = &mut data.data;
    for row in 0..block.n_rows() {
        if [block.coverage.ant1[row], block.coverage.ant2[row]].iter().any(|a| *a as usize == antenna) {
            block.flags.index_axis_mut(Axis(0), row).fill(true);
        }
    }
    truth.flags.index_axis_mut(Axis(1), antenna).fill(true);
}

fn candidate_options(base: &Base, reference: &Reference, data: &VisibilitySet, setup: &Setup, plan: &SelfcalPlan) -> CandidateOptions {
    let mut solve = plan.solve.clone();
    // The weights of data without noise have no scale, so there is no signal to noise ratio.
    let noisy = setup.errors.iter().any(|e| matches!(e, Error::Noise(_)));
    if !noisy {
        solve.min_snr = 0.0;
    }
    // Names of antennas that are not in this trial are ignored.
    let takes_part = |name: &String| data.header.layout.index_of(name).is_some();
    solve.refant = plan.solve.refant.as_ref().map(|names| AntennaNames(names.0.iter().filter(|n| takes_part(n)).cloned().collect()));
    let clean = match &base.deconvolution {
        Deconvolution::Clean(clean) => clean.as_ref().clone(),
        Deconvolution::Mem(_) => CleanOptions { algorithm: Algorithm::Mem, ..CleanOptions::default() },
    };
    CandidateOptions::new(reference.imaging.clone(), clean, solve, plan.rounds.clone(), data.header.unit)
}

/// Rms phase difference over the integrations of the truth; NaN if no gain is known.
fn phase_rms(truth: &GainTable, found: &GainTable, gradient: bool) -> Result<f64> {
    match compare_gains(truth, found, CompareOptions { gradient, flux_scale: false }) {
        Ok(c) => Ok(c.rms_phase_rad),
        Err(ChainError::Incompatible(_)) => Ok(f64::NAN),
        Err(e) => Err(e),
    }
}
