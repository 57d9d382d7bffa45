//! Constants of self-calibration, each with its reason.
//!
//! `docs/algorithms/heuristics.md` lists how far image and phases move when each is halved and doubled.

/// How deep the models of the rounds go, and how exactly the short rounds are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SelfcalTuning {
    /// Depth of the first image of data that are not calibrated, as a fraction of its peak. Phase errors of half a radian scatter less than
    /// a tenth of the peak into any other pixel of an array of a dozen antennas or more, so the model does not contain it.
    pub first_depth: f64,
    /// Factor between the depths of two rounds. It is the gain of one minor cycle: deeper needs an exact residual first.
    pub deeper: f64,
    /// Error of the transforms in short rounds. They grid residuals, which are small against the source already.
    pub short_epsilon: f64,
    /// Multiple of the noise at which short rounds stop to take points. Lower components would be noise, and gains solved against them
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
