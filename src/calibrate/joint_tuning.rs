//! Constants of the joint solution of image and gains, each with its reason.
//!
//! `docs/algorithms/heuristics.md` lists how much the image changes when each is halved and doubled.

/// One stage: some steps with a fixed strength of the data relative to the entropy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointStep {
    /// lambda times the sum of the weights times the square of the mean prior. At 1 the data and the entropy have equal weight in a mean
    /// pixel.
    pub strength: f64,
    /// Steps of the image.
    pub steps: usize,
}

/// The stages of a joint solution and the way to its prior.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointSchedule {
    /// The stages. In the first three the data have less weight than the entropy, so that the image is smooth and does not absorb errors of
    /// the phases. After the first stage the image is moved to the middle of the frame, and after the others to the position that the data
    /// determine. Then the strength grows tenfold from stage to stage. Chi squared follows lambda over about as many decades as the square
    /// of the signal to noise ratio of a visibility. The stages end as soon as chi squared is near its target.
    pub stages: [JointStep; 7],
    /// Chi squared divided by its target at which the stages end. The final solution then determines lambda.
    pub near: f64,
    /// Brightness of pixels that enter the frame when the image moves, in units of the prior. A darker pixel becomes bright only slowly,
    /// because its step is proportional to the root of its brightness.
    pub dark: f64,
    /// Largest number of evaluations of a final solution. It ends as soon as chi squared is at its target.
    pub final_evaluations: usize,
    /// Largest number of final solutions. Each except the first follows a move of the image by one cell or more.
    pub finals: usize,
    /// Error of the transforms. It is below the noise of a visibility wherever phases can be solved at all.
    pub epsilon: f64,
    /// Rms from 1 that is first expected of gains near 1, rad. It is below the errors that are worth a calibration. The estimate grows from
    /// stage to stage as far as the data ask for it.
    pub unity_rms: f64,
    /// Largest number of final solutions while the estimate of that rms grows.
    pub expectations: usize,
    /// Chi squared of a stage over that of the stage before, above which the image of the data as they are explains no more of them.
    pub deeper: f64,
    /// Factor on lambda where an image has fitted the noise.
    pub ease: f64,
    /// Largest rms from 1 of gains that are taken to be near it, rad. Beyond it the expectation costs more than it gives.
    pub near_rms: f64,
    /// Chi squared divided by its target up to which gains near 1 fit. Above it, the solution that knows nothing of the gains is tried.
    pub near_enough: f64,
    /// Estimates of an unknown prior at most.
    pub priors: usize,
    /// The prior is bright enough if the flux of the first faint image divided by that of the prior is at most this.
    pub prior_settled: f64,
    /// Factor on a prior that was estimated from the data. The value comes from one scene that fills most of its frame, seen by 96
    /// elements. There priors of 1.5 to 3.6 times the mean brightness give the same error, and darker ones a larger error. With 30
    /// elements that have few short baselines a darker prior is better, so a known prior should be given.
    pub brighter: f64,
}

impl Default for JointSchedule {
    fn default() -> Self {
        let stage = |strength, steps| JointStep { strength, steps };
        Self {
            stages: [stage(0.6, 15), stage(0.6, 15), stage(0.6, 8), stage(6.0, 15), stage(60.0, 20), stage(600.0, 20), stage(6000.0, 20)],
            near: 1.5,
            dark: 0.1,
            final_evaluations: 60,
            finals: 3,
            epsilon: 1e-4,
            unity_rms: 0.02,
            expectations: 4,
            ease: 0.1,
            near_rms: 0.35,
            deeper: 0.7,
            near_enough: 1.1,
            priors: 4,
            prior_settled: 1.1,
            brighter: 2.0,
        }
    }
}
