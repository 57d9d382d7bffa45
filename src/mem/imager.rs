//! Images of maximum entropy: from the prior, a few steps at a fixed multiplier, or all steps to the target.

use super::control::{Control, Steering};
use super::objective::{Multipliers, Objective, brightness};
use super::quasi_newton::QuasiNewton;
use super::regulariser::check_prior;
use super::solver::{Course, MemGoals, Progress, run};
use super::tuning::MemTuning;
use super::vtess::Vtess;
use crate::progress::Observer;
use crate::values::need;
use crate::{ChainError, Result, ensure};
use ndarray::{ArcArray2, Array2};
use num_complex::Complex64;

/// An image between two calls, with its multipliers: the next call starts from it.
#[derive(Debug, Clone)]
pub struct MemState {
    /// The image, flux a pixel \[m, l\]. It is empty after an error.
    pub image: Array2<f64>,
    /// Multiplier of chi2 / 2 in units of the mean prior; 0 before the first step.
    pub lambda: f64,
    /// Multiplier of the total flux.
    pub beta: f64,
    /// Chi squared over its expected value, after the last step.
    pub chi2_per_datum: f64,
    /// The KKT residual after the last step: the length of the gradient divided by the sum of the lengths of its two terms.
    pub kkt: f64,
    /// Evaluations of the data term so far.
    pub evaluations: usize,
}

/// Makes maximum entropy images of one objective.
#[derive(Debug)]
pub struct MemImager<'a> {
    objective: Objective<'a>,
    prior: ArcArray2<f32>,
    tuning: MemTuning,
}

/// The solvers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum, schemars::JsonSchema))]
pub enum Method {
    /// Newton steps in s on the beam's Hessian, L-BFGS where there is none.
    #[default]
    QuasiNewton,
    /// The control of Cornwell and Evans: multipliers from the products of gradients, steps in the image with interpolation.
    Vtess,
}

impl<'a> MemImager<'a> {
    /// For an objective. Images start at `prior` \[m, l\], flux a pixel.
    ///
    /// # Errors
    /// A prior that is not positive where the image may be bright, a flux that is not positive, a mask that leaves no pixel.
    pub fn new(objective: Objective<'a>, prior: ArcArray2<f32>) -> Result<Self> {
        check_prior(&prior, objective.inside.as_ref())?;
        let flux = objective.flux.unwrap_or(1.0);
        need("flux", flux, flux > 0.0 && flux.is_finite(), "a positive total flux: entropy is that of a positive image")?;
        let some = objective.inside.as_ref().is_none_or(|m| m.iter().any(|x| *x));
        ensure!(some, ChainError::NoData("the mask leaves no pixel for the image".into()));
        Ok(Self { objective, prior, tuning: MemTuning::default() })
    }

    /// The same with other constants of the solvers.
    #[must_use]
    pub fn tuned(mut self, tuning: MemTuning) -> Self {
        self.tuning = tuning;
        self
    }

    /// The objective.
    #[must_use]
    pub fn objective(&self) -> &Objective<'a> {
        &self.objective
    }

    /// Access to change the data term, the penalty or the flux between two calls.
    pub fn objective_mut(&mut self) -> &mut Objective<'a> {
        &mut self.objective
    }

    /// The objective, so that another imager can be made of it with another prior.
    #[must_use]
    pub fn into_objective(self) -> Objective<'a> {
        self.objective
    }

    /// The prior \[m, l\], flux a pixel.
    #[must_use]
    pub fn prior(&self) -> &ArcArray2<f32> {
        &self.prior
    }

    /// The state before the first step: the prior.
    #[must_use]
    pub fn start(&self) -> MemState {
        self.start_at(self.prior.mapv(f64::from))
    }

    /// A state at any image, such as one of an earlier run. Pixels below a thousandth of the prior start at that value, because the
    /// gradient at s = 0 is zero.
    #[must_use]
    pub fn start_at(&self, mut image: Array2<f64>) -> MemState {
        ndarray::Zip::from(&mut image).and(&self.prior).for_each(|i, m| *i = i.max(1e-3 * f64::from(m.max(0.0))));
        let s = self.objective.variable(&image);
        let image = s.mapv(brightness);
        MemState { image, lambda: 0.0, beta: 0.0, chi2_per_datum: f64::NAN, kkt: f64::NAN, evaluations: 0 }
    }

    /// Visibilities \[row x chan\] of an image \[m, l\] in flux a pixel, with the offset of the objective taken away.
    ///
    /// # Errors
    /// An image of another size.
    pub fn predict(&mut self, image: &Array2<f64>) -> Result<&[Complex64]> {
        let model = self.objective.seen(image.clone());
        self.objective.chi2.predict(model.view())
    }

    /// Make a few steps at this `lambda` (in units of the mean prior), from the present state. A calibration uses this between two gain
    /// solutions. Each step takes one evaluation of the data term, and rarely more.
    ///
    /// # Errors
    /// A lambda that is not positive; values that are not finite; a request to stop.
    pub fn improve(&mut self, state: &mut MemState, lambda: f64, iterations: usize, observer: &dyn Observer) -> Result<Progress> {
        need("lambda", lambda, lambda > 0.0 && lambda.is_finite(), "a positive number")?;
        state.lambda = lambda;
        let goals = MemGoals { kkt: 1e-5, flux: 1e-5, evaluations: usize::MAX, ..MemGoals::default() };
        // The links between neighbours need exact steps.
        let control = if self.objective.smoothness.is_some() { Control::UpTo(lambda * self.objective.unit) } else { Control::Fixed };
        self.run(state, control, Method::QuasiNewton, (goals, iterations), observer)
    }

    /// Continue from the present state until chi squared is at its target, the flux has its value (if it is known), and the KKT residual is
    /// below its limit.
    ///
    /// # Errors
    /// Values that are not finite; a request to stop. A goal that is not reached is not an error: see [`Progress::met`].
    pub fn solve(&mut self, state: &mut MemState, goals: &MemGoals, method: Method, observer: &dyn Observer) -> Result<Progress> {
        if !(state.lambda > 0.0) {
            state.lambda = self.first_lambda(state)?;
        }
        let control = Control::Target { target: goals.chi2, tolerance: goals.chi2_tolerance };
        self.run(state, control, method, (*goals, goals.evaluations), observer)
    }

    /// Solve at the `lambda` (in units of the mean prior) that belongs to what is expected of the scene, and again with the weights of the smoothness that belong to
    /// the image.
    ///
    /// # Errors
    /// As [`MemImager::solve`].
    pub(crate) fn solve_at(
        &mut self,
        state: &mut MemState,
        lambda: f64,
        goals: &MemGoals,
        method: Method,
        observer: &dyn Observer,
    ) -> Result<Progress> {
        need("lambda", lambda, lambda > 0.0 && lambda.is_finite(), "a positive number")?;
        state.lambda = self.first_lambda(state)?.min(lambda);
        let control = Control::UpTo(lambda * self.objective.unit);
        let mut all = self.run(state, control, method, (*goals, goals.evaluations), observer)?;
        for _ in 0..self.tuning.reweighted {
            let left = all.left(goals);
            if !all.met || left < 2 {
                break;
            }
            self.reweight(state);
            let more = self.run(state, control, method, (MemGoals { evaluations: left, ..*goals }, left), observer)?;
            all = all.and(&more);
        }
        Ok(all)
    }

    /// Solve at the `lambda` that belongs to what is expected of the scene. Where chi squared stays above its target there, go on as [`MemImager::solve`]
    /// does: data that a smooth scene does not explain ask for more structure.
    ///
    /// # Errors
    /// As [`MemImager::solve`].
    pub fn solve_expected(
        &mut self,
        state: &mut MemState,
        lambda: f64,
        goals: &MemGoals,
        method: Method,
        observer: &dyn Observer,
    ) -> Result<Progress> {
        let all = self.solve_at(state, lambda, goals, method, observer)?;
        let explained = state.chi2_per_datum <= goals.chi2 * (1.0 + goals.chi2_tolerance);
        let left = all.left(goals);
        if explained || left < 2 {
            return Ok(Progress { met: all.met && explained, ..all });
        }
        let more = self.solve(state, &MemGoals { evaluations: left, ..*goals }, method, observer)?;
        Ok(all.and(&more))
    }

    /// Expect nothing of neighbours any more, and hold another total flux, if any.
    pub(super) fn with_entropy_alone(&mut self, flux: Option<f64>) {
        self.objective.smoothness = None;
        self.objective.flux = flux;
    }

    /// Give the smoothness, if there is one, the weights that belong to the present image.
    pub(crate) fn reweight(&mut self, state: &MemState) {
        if let Some(smoothness) = &mut self.objective.smoothness {
            smoothness.reweight(&state.image, state.lambda);
        }
    }

    /// Give the links of the smoothness equal weights.
    pub(crate) fn even_weights(&mut self) {
        if let Some(smoothness) = &mut self.objective.smoothness {
            smoothness.even();
        }
    }

    /// A multiplier at which the data begin to outweigh the entropy, in units of the mean prior.
    fn first_lambda(&mut self, state: &MemState) -> Result<f64> {
        if let Some(beam) = &self.objective.beam {
            return Ok(0.1 / (beam.largest() * self.objective.unit * self.objective.unit));
        }
        // If the data have no beam, this is the lambda at which the gradient of the data is as long as the image in the metric of the
        // entropy.
        let point = self.objective.evaluate(self.objective.variable(&state.image))?;
        let (mut data, mut size) = (0.0_f64, 0.0_f64);
        ndarray::Zip::from(&point.s).and(&point.slope).for_each(|s, g| {
            let i = brightness(*s);
            data += i * f64::from(*g).powi(2);
            size += i;
        });
        let lambda = 0.1 * size.sqrt() / data.sqrt() / self.objective.unit;
        if lambda.is_finite() && lambda > 0.0 {
            return Ok(lambda);
        }
        Err(ChainError::NoData(format!(
            "chi squared does not change with the first image (lambda would be {lambda}): nothing constrains it"
        )))
    }

    /// Run a solver from the present state, for at most this number of steps. After an error the state has no image.
    fn run(
        &mut self,
        state: &mut MemState,
        control: Control,
        method: Method,
        (goals, steps): (MemGoals, usize),
        observer: &dyn Observer,
    ) -> Result<Progress> {
        let o = &mut self.objective;
        let newton = method == Method::QuasiNewton;
        ensure!(
            newton || o.beam.is_some(),
            ChainError::Incompatible("vtess needs visibilities with a dirty beam: use the quasi-Newton solver".into())
        );
        let rho = if newton { o.rho() } else { 0.0 };
        let multipliers = Multipliers { lambda: state.lambda * o.unit, beta: state.beta, rho };
        let course = Course::new(multipliers, Steering::new(control, self.tuning.control), goals, observer);
        // The image is the state's again after the run, and takes no memory meanwhile.
        let s = o.variable(&std::mem::take(&mut state.image));
        let (course, progress) = match method {
            Method::QuasiNewton => run(o, s, (QuasiNewton::default(), course), steps)?,
            Method::Vtess => run(o, s, (Vtess { tuning: self.tuning.vtess }, course), steps)?,
        };
        let Some(point) = course.point else { return Err(ChainError::NoData("the solver made no step".into())) };
        state.lambda = course.multipliers.lambda / o.unit;
        state.beta = course.multipliers.beta;
        state.chi2_per_datum = point.chi2 / o.chi2.expected();
        state.kkt = o.kkt(&point, &course.multipliers);
        state.evaluations += course.evaluations;
        state.image = point.image();
        Ok(progress)
    }
}
