//! Constants that steer the solvers of maximum entropy, each with its reason.
//!
//! The solvers stop where chi squared and the KKT residual meet their goals. These constants change the path to that point, and hardly the
//! point. `docs/algorithms/heuristics.md` lists how much the image changes when each is halved and doubled.

/// Constants of the solvers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MemTuning {
    /// How lambda moves from step to step.
    pub control: MemControl,
    /// Bounds of a step of the solver of Cornwell and Evans.
    pub vtess: VtessControl,
    /// Softening of the total variation, in units of the mean prior. Differences between pixels below it count as their square. It must be
    /// well below the brightness of the structure and well above the rounding errors. A hundredth of the mean meets both conditions.
    pub softening: f64,
    /// Solutions with the weights of Laplace's law after the first of a smooth scene. The second changes images by less than a tenth of what the first does.
    pub reweighted: usize,
}

impl Default for MemTuning {
    fn default() -> Self {
        Self { control: MemControl::default(), vtess: VtessControl::default(), softening: 0.01, reweighted: 2 }
    }
}

/// Constants for the change of lambda, the multiplier of chi squared, from step to step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MemControl {
    /// Largest factor of lambda in one step far from the target. A Newton step follows a change of this size to within `followed`.
    pub rise: f64,
    /// Smallest factor of such a step, so that an image near the target still makes progress.
    pub least_rise: f64,
    /// KKT residual below which the image has moved half of the way to the optimum of the present lambda, so that lambda may increase
    /// again.
    pub followed: f64,
    /// KKT residual below which chi squared has reached its final value for this lambda, so that its response to lambda can be measured.
    pub settled: f64,
    /// Relative difference between chi squared and its target below which the power law chi2 ~ lambda^p is used.
    pub near: f64,
    /// Largest factor of lambda by the power law: its exponent comes from two points alone.
    pub jump: f64,
    /// Part of the tolerance of chi squared within which lambda does not change, so that the goal is met with a margin.
    pub dead_band: f64,
    /// Exponent of the excess of chi squared by which lambda rises close to the target, while the power law is not known.
    pub trim_up: f64,
    /// KKT residual below which it does so.
    pub trim_up_kkt: f64,
    /// Exponent of the excess by which lambda falls, while the power law is not known.
    pub trim_down: f64,
    /// KKT residual below which it does so.
    pub trim_down_kkt: f64,
}

impl Default for MemControl {
    fn default() -> Self {
        Self {
            rise: 4.0,
            least_rise: 1.03,
            followed: 0.5,
            settled: 0.03,
            near: 0.2,
            jump: 3.0,
            dead_band: 0.6,
            trim_up: 1.3,
            trim_up_kkt: 0.05,
            trim_down: 1.5,
            trim_down_kkt: 0.2,
        }
    }
}

/// Bounds of a step of the solver of Cornwell and Evans. For longer steps the quadratic model is not valid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VtessControl {
    /// Squared length of the gradient after a change of the multipliers, divided by the sum of the squared lengths of its two terms.
    pub growth: f64,
    /// Largest factor of lambda in one step.
    pub rise: f64,
    /// Largest fraction of a pixel that a step may take away; below 1, so that the pixel stays positive.
    pub loss: f64,
    /// Largest increase of a pixel in one step, in units of its value.
    pub gain: f64,
    /// Departure of chi squared from its target, in units of the tolerance, below which the rule of [`MemControl`] replaces the
    /// prediction: there the error of the prediction is as large as the departure.
    pub close: f64,
}

impl Default for VtessControl {
    fn default() -> Self {
        Self { growth: 4.0, rise: 5.0, loss: 0.9, gain: 8.0, close: 20.0 }
    }
}
