//! Images of maximum entropy: from the prior, a few steps at a fixed multiplier, or all steps to the target.

use super::control::{Control, Steering};
use super::objective::{Multipliers, Objective};
use super::quasi_newton::QuasiNewton;
use super::regulariser::check_prior;
use super::solver::{Found, Goals, Shared, Solves, State, has_stalled};
use super::tuning::MemTuning;
use super::vtess::Vtess;
use crate::progress::Observer;
use crate::{ChainError, Result};
use argmin::core::{Executor, Solver};
use ndarray::Array2;
use num_complex::Complex64;
use std::cell::RefCell;

/// An image between two calls, with its multipliers: the next call starts from it.
#[derive(Debug, Clone)]
pub struct MemState {
    /// The image, flux a pixel \[m, l\].
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

/// The work of a call of [`MemImager::improve`] or [`MemImager::solve`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Evaluations of the data term: pairs of transforms.
    pub evaluations: usize,
    /// Steps.
    pub iterations: usize,
    /// Convolutions with the beam.
    pub convolutions: usize,
    /// All goals are met.
    pub met: bool,
    /// No step in any direction improves the image any more, or many steps in a row have not brought it closer to the goals.
    pub stalled: bool,
}

/// When [`MemImager::solve`] is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MemGoals {
    /// Chi squared over its expected value.
    pub chi2: f64,
    /// Its largest departure, relative.
    pub chi2_tolerance: f64,
    /// Largest KKT residual.
    pub kkt: f64,
    /// Largest relative error of the flux, where the flux is known.
    pub flux: f64,
    /// Evaluations of the data term at most.
    pub evaluations: usize,
}

impl Default for MemGoals {
    fn default() -> Self {
        Self { chi2: 1.0, chi2_tolerance: 0.008, kkt: 1e-3, flux: 1e-3, evaluations: 150 }
    }
}

/// Makes maximum entropy images of one objective.
#[derive(Debug)]
pub struct MemImager {
    objective: Objective,
    prior: Array2<f64>,
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

/// Convert an error of argmin, which contains an error of this crate.
fn ours(e: argmin::core::Error) -> ChainError {
    e.downcast::<ChainError>().unwrap_or_else(|e| ChainError::Other(e.to_string().into()))
}

impl MemImager {
    /// For an objective. Images start at `prior` \[m, l\], flux a pixel.
    ///
    /// # Errors
    /// A prior that is not positive where the image may be bright, a flux that is not positive, a mask that leaves no pixel.
    pub fn new(objective: Objective, prior: Array2<f64>) -> Result<Self> {
        check_prior(&prior, objective.inside.as_ref())?;
        if let Some(flux) = objective.flux.filter(|f| !(*f > 0.0 && f.is_finite())) {
            let expected = "a positive total flux: entropy is that of a positive image".into();
            return Err(ChainError::BadOption { option: "flux", value: flux.to_string(), expected });
        }
        if objective.inside.as_ref().is_some_and(|m| !m.iter().any(|x| *x)) {
            return Err(ChainError::NoData("the mask leaves no pixel for the image".into()));
        }
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
    pub fn objective(&self) -> &Objective {
        &self.objective
    }

    /// Access to change the data term, the penalty or the flux between two calls.
    pub fn objective_mut(&mut self) -> &mut Objective {
        &mut self.objective
    }

    /// The objective, so that another imager can be made of it with another prior.
    #[must_use]
    pub fn into_objective(self) -> Objective {
        self.objective
    }

    /// The prior \[m, l\], flux a pixel.
    #[must_use]
    pub fn prior(&self) -> &Array2<f64> {
        &self.prior
    }

    /// The state before the first step: the prior.
    #[must_use]
    pub fn start(&self) -> MemState {
        self.start_at(self.prior.clone())
    }

    /// A state at any image, such as one of an earlier run. Pixels below a thousandth of the prior start at that value, because the
    /// gradient at s = 0 is zero.
    #[must_use]
    pub fn start_at(&self, mut image: Array2<f64>) -> MemState {
        ndarray::Zip::from(&mut image).and(&self.prior).for_each(|i, m| *i = i.max(1e-3 * m.max(0.0)));
        let s = self.objective.variable(&image);
        let image = s.mapv(|s| 0.25 * s * s);
        MemState { image, lambda: 0.0, beta: 0.0, chi2_per_datum: f64::NAN, kkt: f64::NAN, evaluations: 0 }
    }

    /// Visibilities \[row x chan\] of an image \[m, l\] in flux a pixel, with the offset of the objective taken away.
    ///
    /// # Errors
    /// An image of another size.
    pub fn predict(&mut self, image: &Array2<f64>) -> Result<&[Complex64]> {
        match &self.objective.offset {
            Some(offset) => self.objective.chi2.predict((image - offset).view()),
            None => self.objective.chi2.predict(image.view()),
        }
    }

    /// Make a few steps at this `lambda` (in units of the mean prior), from the present state. A calibration uses this between two gain
    /// solutions. Each step takes one evaluation of the data term, and rarely more.
    ///
    /// # Errors
    /// A lambda that is not positive; values that are not finite; a request to stop.
    pub fn improve(&mut self, state: &mut MemState, lambda: f64, iterations: usize, observer: &dyn Observer) -> Result<Progress> {
        if !(lambda > 0.0 && lambda.is_finite()) {
            let expected = "a positive number".into();
            return Err(ChainError::BadOption { option: "lambda", value: lambda.to_string(), expected });
        }
        state.lambda = lambda;
        let goals = Goals { kkt: 1e-5, flux: 1e-5, evaluations: usize::MAX };
        self.run(state, Control::Fixed, Method::QuasiNewton, goals, Limit { steps: iterations, observer })
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
        let inner = Goals { kkt: goals.kkt, flux: goals.flux, evaluations: goals.evaluations };
        self.run(state, control, method, inner, Limit { steps: goals.evaluations, observer })
    }

    /// A multiplier at which the data begin to outweigh the entropy, in units of the mean prior.
    fn first_lambda(&mut self, state: &MemState) -> Result<f64> {
        if let Some(beam) = &self.objective.beam {
            return Ok(0.1 / (beam.largest() * self.objective.unit * self.objective.unit));
        }
        // If the data have no beam, this is the lambda at which the gradient of the data is as long as the image in the metric of the
        // entropy.
        let point = self.objective.evaluate(self.objective.variable(&state.image))?;
        let (mut data, mut size) = (0.0, 0.0);
        ndarray::Zip::from(&point.image).and(&point.slope).for_each(|i, g| {
            data += i * g * g;
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

    /// Run a solver from the present state, for at most this number of steps.
    fn run(&mut self, state: &mut MemState, control: Control, method: Method, goals: Goals, limit: Limit<'_>) -> Result<Progress> {
        let rho = match method {
            Method::QuasiNewton => self.objective.rho(),
            Method::Vtess if self.objective.beam.is_none() => {
                return Err(ChainError::Incompatible("vtess needs visibilities with a dirty beam: use the quasi-Newton solver".into()));
            }
            Method::Vtess => 0.0,
        };
        let multipliers = Multipliers { lambda: state.lambda * self.objective.unit, beta: state.beta, rho };
        let (s, observer) = (self.objective.variable(&state.image), limit.observer);
        let (steering, vtess) = (Steering::new(control, self.tuning.control), self.tuning.vtess);
        let (found, progress) = match method {
            Method::QuasiNewton => self.execute(QuasiNewton::new(multipliers, steering, goals, observer), s, limit.steps)?,
            Method::Vtess => self.execute(Vtess::new(multipliers, steering, vtess, goals, observer), s, limit.steps)?,
        };
        let Some(point) = found.point else { return Err(ChainError::NoData("the solver made no step".into())) };
        state.lambda = found.multipliers.lambda / self.objective.unit;
        state.beta = found.multipliers.beta;
        state.chi2_per_datum = point.chi2 / self.objective.chi2.expected();
        state.kkt = self.objective.kkt(&point, &found.multipliers);
        state.evaluations += found.evaluations;
        state.image = point.image;
        Ok(progress)
    }

    fn execute<S>(&mut self, solver: S, s: Array2<f64>, steps: usize) -> Result<(Found, Progress)>
    where
        S: Solves + for<'a> Solver<Shared<'a>, State>,
    {
        let shared: Shared<'_> = RefCell::new(&mut self.objective);
        let result = Executor::new(shared, solver).configure(|s0| s0.param(s).max_iters(steps as u64)).run().map_err(ours)?;
        let (iterations, stalled) = (result.state.iter as usize, has_stalled(&result.state.termination_status));
        let found = result.solver.found();
        let (evaluations, convolutions, met) = (found.evaluations, found.convolutions, found.met);
        Ok((found, Progress { evaluations, iterations, convolutions, met, stalled }))
    }
}

/// How far a run may go, and to whom it reports.
struct Limit<'o> {
    steps: usize,
    observer: &'o dyn Observer,
}
