//! Constants of self-calibration, each with its reason.
//!
//! `docs/algorithms/heuristics.md` lists how much image and phases change when each is halved and doubled.

use crate::fourier::GridOptions;

/// The depths of the models in the rounds, and the accuracy of the short rounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SelfcalTuning {
    /// Depth of the first image of data that are not calibrated, as a fraction of its peak. Phase errors of half a radian scatter less than
    /// a tenth of the peak into any other pixel of an array of a dozen antennas or more, so the model does not contain it.
    pub first_depth: f64,
    /// Factor between the depths of two rounds. It is the reduction of the peak in one minor cycle. A deeper cycle needs an exact residual
    /// first.
    pub deeper: f64,
    /// Error of the transforms in short rounds. These rounds grid residuals, which are already small compared with the source.
    pub short_epsilon: f64,
    /// Multiple of the noise at which short rounds of point sources stop. Lower components would be noise, and gains solved against them
    /// would fit it.
    pub short_nsigma: f64,
    /// Error of a prediction as a fraction of the depth of its model. It is well below the flux that the model does not contain.
    pub predicted_epsilon: f64,
}

impl Default for SelfcalTuning {
    fn default() -> Self {
        Self { first_depth: 0.1, deeper: 5.0, short_epsilon: 1e-4, short_nsigma: 3.0, predicted_epsilon: 0.01 }
    }
}

impl SelfcalTuning {
    /// Error of the transforms in short rounds, where the last one has that of `asked`. The precision is the same in all rounds, because images in double
    /// precision do not depend on the number of processes.
    #[must_use]
    pub fn epsilon_of_short_rounds(&self, asked: &GridOptions) -> f64 {
        asked.relaxed_to(self.short_epsilon)
    }
}
