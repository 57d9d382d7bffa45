//! The evidence for the gains of a self-calibration, and what is doubtful about it.

use super::degeneracy::{CompareOptions, compare_gains};
use super::held_out::{HeldOut, JudgeOptions, Prediction};
use crate::Result;
use cittert_arrays::GainTable;

/// The errors of the data must exceed the uncertainty of the gains that correct them by the first factor, or by the second where the misfit falls by
/// less than [`SMALL_FALL`] of what gains of this size imply: the gains then hold more than these errors. The gains are the sum of both,
/// rms^2 = errors^2 + sigma^2, and the uncertainty comes from a single draw of baselines.
const SAFETY: (f64, f64) = (1.0, 2.0);
/// A fall by half is what right gains of any size give at least, because the misfit before is at most 1 and phases at random imply a fall of 2.
const SMALL_FALL: f64 = 0.5;

/// Numbers of the judgement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// Misfit of the held-out baselines for the best image of the data as they are.
    pub before: f64,
    /// The same for the best round.
    pub after: f64,
    /// Significance of the difference, in standard deviations.
    pub sigmas: f64,
    /// The fall of the misfit over the fall that gains of this size imply.
    pub explained: f64,
    /// Rms of the gains from 1 without common phase and phase gradient (rad), with all baselines.
    pub gain_rms: f64,
    /// Standard deviation of a gain, from the change that the held-out baselines make.
    pub gain_sigma: f64,
    /// Baselines held out.
    pub baselines: usize,
}

impl Evidence {
    /// Weigh the predictions of the data as they are and of the best round, the gains without the held-out baselines, and those with them.
    ///
    /// # Errors
    /// The tables of gains do not belong together.
    pub(super) fn of(
        (before, after): (&Prediction, &Prediction),
        (trained, last): (&GainTable, &GainTable),
        held: &HeldOut,
    ) -> Result<Self> {
        let free = CompareOptions { gradient: true, flux_scale: true };
        let mut unity = last.clone();
        unity.gains.fill(1.0.into());
        unity.flags.fill(false);
        let rms = |c: super::GainComparison| c.rms_phase_rad.hypot(c.rms_amplitude);
        let gain_rms = rms(compare_gains(last, &unity, free)?);
        let change = rms(compare_gains(trained, last, free)?);
        let trained_rms = rms(compare_gains(trained, &unity, free)?);
        // A phase of variance s^2 on each antenna lowers the coherence of a baseline to exp(-s^2).
        let expected = 2.0 * (1.0 - (-trained_rms * trained_rms).exp());
        let fall = before.misfit() - after.misfit();
        Ok(Self {
            before: before.misfit(),
            after: after.misfit(),
            sigmas: after.better_than(before),
            explained: if expected > 0.0 { fall / expected } else { 0.0 },
            gain_rms,
            // The variance of a fit to the part 1 - f of the data exceeds that of the whole by f / (1 - f), and so does their difference.
            gain_sigma: change * ((1.0 - held.fraction()) / held.fraction()).sqrt(),
            baselines: held.n_baselines(),
        })
    }

    /// Why the gains are not to be believed.
    #[must_use]
    pub(super) fn doubt(&self, judging: &JudgeOptions) -> Option<String> {
        let (least, most) = judging.explained;
        if self.after > judging.largest_misfit {
            return Some(format!(
                "the model leaves {:.0} % of the held-out baselines unexplained, more than {:.0} %, so it says nothing about gains",
                100.0 * self.after,
                100.0 * judging.largest_misfit
            ));
        }
        if !(self.sigmas >= judging.sigmas) {
            return Some(format!(
                "the held-out baselines are not predicted better with the gains than without them: the misfit is {:.4} with and {:.4} without, {:.1} sigma apart",
                self.after, self.before, self.sigmas
            ));
        }
        let safety = if self.explained < SMALL_FALL { SAFETY.1 } else { SAFETY.0 };
        if !(self.gain_rms * self.gain_rms > (1.0 + safety * safety) * self.gain_sigma * self.gain_sigma) {
            return Some(format!(
                "the gains differ from 1 by {:.3} rms, and their own uncertainty is {:.3}: the held-out baselines change them that much",
                self.gain_rms, self.gain_sigma
            ));
        }
        if !(self.after < judging.enough || (least..=most).contains(&self.explained)) {
            return Some(format!(
                "the misfit falls from {:.4} to {:.4}, and gains that differ from 1 by {:.3} rms must lower it by {:.1} times as much: the model is wrong",
                self.before,
                self.after,
                self.gain_rms,
                1.0 / self.explained
            ));
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SURE: Evidence =
        Evidence { before: 0.5, after: 0.01, sigmas: 5.0, explained: 1.0, gain_rms: 0.5, gain_sigma: 0.02, baselines: 60 };

    fn doubt(e: Evidence) -> String {
        e.doubt(&JudgeOptions::default()).unwrap_or_default()
    }

    #[test]
    fn each_doubt_is_named() {
        assert_eq!(doubt(SURE), "");
        assert!(doubt(Evidence { after: 0.45, ..SURE }).contains("leaves 45 % of the held-out baselines"));
        assert!(doubt(Evidence { sigmas: 1.0, ..SURE }).contains("1.0 sigma apart"));
        assert!(doubt(Evidence { gain_sigma: 0.4, ..SURE }).contains("their own uncertainty is 0.400"));
        assert!(doubt(Evidence { after: 0.1, explained: 0.1, ..SURE }).contains("the model is wrong"));
    }

    /// A Y of 33 elements in a thermal scene: one arm got a phase that grows along it, and the held-out baselines between the arms were too weak to
    /// tell. The gains became worse, 0.52 to 0.91 rad, though the misfit fell to 0.05.
    #[test]
    fn uncertain_gains_whose_misfit_falls_little_are_refused() {
        let y = Evidence { before: 0.448, after: 0.047, explained: 0.347, gain_rms: 0.887, gain_sigma: 0.430, ..SURE };
        assert!(doubt(y).contains("their own uncertainty is 0.430"));
        assert_eq!(doubt(Evidence { explained: 0.6, ..y }), "");
        assert_eq!(doubt(Evidence { gain_sigma: 0.3, ..y }), "");
    }
}
