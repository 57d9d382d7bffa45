//! The rounds of self-calibration: their plan, and the maker of their models.

use super::model::ModelVisibilities;
use super::options::GainMode;
use super::selfcal_tuning::SelfcalTuning;
use crate::Result;
use crate::closure::SolutionInterval;
use crate::progress::Observer;
use cittert_arrays::VisibilitySource;

/// Numbers by which the image of a round is judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelMetrics {
    /// Peak of the image.
    pub peak: f64,
    /// Rms of the residual image.
    pub residual_rms: f64,
    /// Flux in the model.
    pub model_flux: f64,
    /// Components or iterations that made the model.
    pub iterations: usize,
}

impl ModelMetrics {
    /// Peak over residual rms, by which rounds are judged.
    #[must_use]
    pub fn dynamic_range(&self) -> f64 {
        if self.residual_rms > 0.0 { self.peak / self.residual_rms } else { 0.0 }
    }
}

/// Something that makes a model of the sky from calibrated data, and predicts its visibilities.
pub trait ModelMaker: ModelVisibilities {
    /// Image and deconvolve. [`ModelVisibilities::predict`] uses the new model from then on.
    ///
    /// # Errors
    /// The image cannot be made.
    fn update(&mut self, data: &mut dyn VisibilitySource, plan: &RoundPlan, observer: &dyn Observer) -> Result<ModelMetrics>;

    /// Image the data as they are, as deep as a finished image, for a comparison with calibrated data. The first call has step 0. A maker
    /// that cannot know how far to go into data with errors makes a deeper image with each step, and `None` after the last.
    ///
    /// # Errors
    /// The image cannot be made.
    fn as_they_are(&mut self, data: &mut dyn VisibilitySource, step: usize, observer: &dyn Observer) -> Result<Option<ModelMetrics>> {
        let plan = RoundPlan { mode: GainMode::Phase, solint: SolutionInterval::Infinite, depth: 0.0, last: true };
        if step > 0 { Ok(None) } else { self.update(data, &plan, observer).map(Some) }
    }

    /// More data of the same sky have come: prepare to go on from the present model with them. The gains of `data` are not known.
    ///
    /// # Errors
    /// The model cannot be continued with these data.
    fn reopen(&mut self, _data: &mut dyn VisibilitySource, _observer: &dyn Observer) -> Result<()> {
        Ok(())
    }

    /// The next image belongs to this round; 0 is the image before any calibration.
    fn begin_round(&mut self, _number: usize) {}

    /// The present images are the best so far: keep them.
    fn remember(&mut self) {}

    /// Go back to the images last remembered.
    fn recall(&mut self) {}
}

/// The plan of one round.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RoundPlan {
    /// Phases, amplitudes and phases, or delays.
    pub mode: GainMode,
    /// The solution interval.
    pub solint: SolutionInterval,
    /// The model stops at this fraction of the peak of the image. The fraction is high at first, so that errors of the uncalibrated image
    /// do not enter the model. It decreases from round to round, so that more of the source enters the model. With 0 the maker chooses the
    /// depth.
    pub depth: f64,
    /// True in the last planned rounds, in which the model may go to its final depth. In all others a maker takes a short step from its
    /// present model. Many short steps, each followed by a gain solution, find both image and gains. A few deep images would turn errors
    /// into structure.
    pub last: bool,
}

/// Rounds of a mode at an interval. The first rounds solve for phases. With amplitudes, the last third of the rounds (at least one) solves
/// for amplitudes and phases.
///
/// With `shrink`, schedules of four phase rounds or more begin with intervals of four and two times `solint`. This improves the solution
/// for weak sources whose phases drift slowly. It makes it worse where the phases change within the longer intervals.
#[must_use]
pub fn schedule(mode: GainMode, solint: SolutionInterval, rounds: usize, shrink: bool) -> Vec<RoundPlan> {
    tuned_schedule(mode, solint, rounds, shrink, &SelfcalTuning::default())
}

/// As [`schedule`], with other depths.
#[must_use]
pub fn tuned_schedule(mode: GainMode, solint: SolutionInterval, rounds: usize, shrink: bool, tuning: &SelfcalTuning) -> Vec<RoundPlan> {
    let rounds = rounds.max(1);
    let amplitude = if mode == GainMode::AmpPhase && rounds > 1 { (rounds / 3).max(1) } else { 0 };
    let first = if mode == GainMode::AmpPhase && rounds > 1 { GainMode::Phase } else { mode };
    let phase = rounds - amplitude;
    (0..rounds)
        .map(|i| {
            let amp = i >= phase;
            let (at, of) = if amp { (i - phase, amplitude) } else { (i, phase) };
            let longer = if shrink && of >= 4 && !amp { [4.0, 2.0][..].get(at).copied().unwrap_or(1.0) } else { 1.0 };
            let solint = match solint {
                SolutionInterval::Seconds(s) => SolutionInterval::Seconds(s * longer),
                other => other,
            };
            // The last two images are deep, so that the final gains are solved against a deep model.
            let last = i + 1 == rounds || (rounds >= 3 && i + 2 == rounds);
            // Each round reduces the errors by a large factor, so its image is reliable to a lower level.
            let depth = if last { 0.0 } else { tuning.first_depth * tuning.deeper.powi(-(i.min(100) as i32) - 1) };
            RoundPlan { mode: if amp { mode } else { first }, solint, depth, last }
        })
        .collect()
}
