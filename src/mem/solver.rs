//! The loop that both solvers share: an argmin solver around the steps of one method, and the conditions to stop.

use super::control::Steering;
use super::objective::{Multipliers, Objective, Point};
use crate::progress::{Event, Observer};
use crate::{ChainError, ensure};
use argmin::core::{Error, Executor, IterState, KV, Problem, Solver, TerminationReason, TerminationStatus};
use ndarray::{Array2, Axis};
use rayon::prelude::*;
use std::cell::{RefCell, RefMut};

/// The form of the problem for argmin, which gives only shared references.
type Shared<'p, 'a> = RefCell<&'p mut Objective<'a>>;

/// The state that argmin keeps. It holds no image: argmin would keep copies of the variable s of this step, of the one before and of the best,
/// and the method has its own in the point.
type State = IterState<(), (), (), (), (), f64>;

/// When a solution is done.
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

/// A way to go from one image to the next.
pub(super) trait Advance {
    /// Its name.
    const NAME: &'static str;
    /// Steps in a row without progress after which the solver gives up.
    const STALLS: usize;

    /// The next point, and whether the step has made progress.
    fn step(&mut self, course: &mut Course<'_>, o: &mut Objective<'_>, from: Point) -> crate::Result<(Point, bool)>;
}

/// The facts of a run, for all methods.
pub(super) struct Course<'o> {
    pub(super) multipliers: Multipliers,
    pub(super) steering: Steering,
    pub(super) point: Option<Point>,
    /// Evaluations of the data term in this run.
    pub(super) evaluations: usize,
    /// Convolutions with the beam.
    pub(super) convolutions: usize,
    /// All goals are met.
    pub(super) met: bool,
    goals: MemGoals,
    /// Steps in a row without progress.
    stalled: usize,
    /// The smallest departures from the three goals so far, and the number of steps since one of them became smaller.
    closest: [f64; 3],
    steps_since: usize,
    observer: &'o dyn Observer,
}

impl<'o> Course<'o> {
    /// With these multipliers at the start.
    pub(super) fn new(multipliers: Multipliers, steering: Steering, goals: MemGoals, observer: &'o dyn Observer) -> Self {
        let (point, closest) = (None, [f64::INFINITY; 3]);
        Self {
            multipliers,
            steering,
            point,
            evaluations: 0,
            convolutions: 0,
            met: false,
            goals,
            stalled: 0,
            closest,
            steps_since: 0,
            observer,
        }
    }

    /// One evaluation of the objective, counted.
    pub(super) fn evaluate(&mut self, o: &mut Objective<'_>, s: Array2<f32>) -> crate::Result<Point> {
        self.evaluations += 1;
        o.evaluate(s)
    }

    /// Report a new point, note whether all goals are met there, and keep it. Returns the value of J.
    fn accept(&mut self, o: &Objective<'_>, number: u64, point: Point) -> f64 {
        let (m, evaluations) = (self.multipliers, self.evaluations);
        let (chi2, kkt) = (point.chi2 / o.chi2.expected(), o.kkt(&point, &m));
        let error = o.flux.map_or(0.0, |f| o.excess(&point).abs() / f);
        self.observer.event(Event::Entropy { number: number as usize, evaluations, chi2, kkt, flux: point.flux, lambda: m.lambda });
        self.met = self.steering.control.met(chi2) && self.steering.arrived(m.lambda) && kkt <= self.goals.kkt && error <= self.goals.flux;
        self.compare([self.steering.control.departure(chi2), kkt, error]);
        let accepted = o.value(&point, &m);
        self.point = Some(point);
        accepted
    }

    /// Note the departures of a new point from the goals of chi squared, of the KKT residual and of the flux.
    fn compare(&mut self, departures: [f64; 3]) {
        self.steps_since += 1;
        for (closest, departure) in self.closest.iter_mut().zip(departures) {
            if departure < CLOSER * *closest {
                (*closest, self.steps_since) = (departure, 0);
            }
        }
    }

    /// True if the last steps of a method have led nowhere.
    fn has_stalled<A: Advance>(&self) -> bool {
        self.stalled >= A::STALLS || self.steps_since >= PATIENCE
    }
}

/// A run ends after this many steps in a row that do not bring it closer to its goals. Runs that reach their goals come closer every few
/// steps.
const PATIENCE: usize = 100;
/// A step brings a run closer if one of its departures is below this fraction of the smallest one before.
const CLOSER: f64 = 0.99;

/// A method on its course, as argmin sees it.
struct Run<'o, A> {
    /// The variable s of the first point, until the run begins.
    start: Option<Array2<f32>>,
    course: Course<'o>,
    method: A,
}

fn objective<'b, 'p, 'a>(problem: &'b Problem<Shared<'p, 'a>>) -> Result<RefMut<'b, &'p mut Objective<'a>>, Error> {
    let shared = problem.problem.as_ref().ok_or_else(|| Error::msg("the problem was taken away from the solver"))?;
    Ok(shared.borrow_mut())
}

impl<'p, 'a, A: Advance> Solver<Shared<'p, 'a>, State> for Run<'_, A> {
    fn name(&self) -> &str {
        A::NAME
    }

    fn init(&mut self, problem: &mut Problem<Shared<'p, 'a>>, state: State) -> Result<(State, Option<KV>), Error> {
        let start = self.start.take().ok_or_else(|| Error::msg("no image to start from"))?;
        let mut o = objective(problem)?;
        self.course.point = Some(self.course.evaluate(&mut o, start)?);
        Ok((state, None))
    }

    fn next_iter(&mut self, problem: &mut Problem<Shared<'p, 'a>>, state: State) -> Result<(State, Option<KV>), Error> {
        ensure!(!self.course.observer.cancelled(), ChainError::Cancelled.into());
        let from = self.course.point.take().ok_or_else(|| Error::msg("the solver was not initialised"))?;
        let mut o = objective(problem)?;
        let (point, moved) = self.method.step(&mut self.course, &mut o, from)?;
        self.course.stalled = if moved { 0 } else { self.course.stalled + 1 };
        let value = self.course.accept(&o, state.iter + 1, point);
        Ok((state.param(()).cost(value), None))
    }

    fn terminate(&mut self, _state: &State) -> TerminationStatus {
        let because = |text: &str| TerminationStatus::Terminated(TerminationReason::SolverExit(text.to_owned()));
        match &self.course {
            c if c.met => TerminationStatus::Terminated(TerminationReason::SolverConverged),
            c if c.has_stalled::<A>() => because("stalled"),
            c if c.evaluations >= c.goals.evaluations => because("evaluations"),
            _ => TerminationStatus::NotTerminated,
        }
    }
}

/// The work of a run.
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

impl Progress {
    /// Evaluations that the goals leave after this work.
    pub(super) fn left(&self, goals: &MemGoals) -> usize {
        goals.evaluations.saturating_sub(self.evaluations)
    }

    /// The work of this run and of one that went on from it.
    pub(super) fn and(&self, more: &Self) -> Self {
        Self {
            evaluations: self.evaluations + more.evaluations,
            iterations: self.iterations + more.iterations,
            convolutions: self.convolutions + more.convolutions,
            ..*more
        }
    }
}

/// Take steps of a method from `s` until its goals are met, no step improves the image, or `steps` are taken.
///
/// # Errors
/// Values that are not finite; a request to stop.
pub(super) fn run<'o, A: Advance>(
    o: &mut Objective<'_>,
    s: Array2<f32>,
    (method, course): (A, Course<'o>),
    steps: usize,
) -> crate::Result<(Course<'o>, Progress)> {
    // An error of argmin contains an error of this crate.
    let ours = |e: Error| e.downcast::<ChainError>().unwrap_or_else(|e| ChainError::Other(e.to_string().into()));
    let executor = Executor::new(RefCell::new(o), Run { start: Some(s), course, method });
    let result = executor.configure(|state| state.param(()).max_iters(steps as u64)).run().map_err(ours)?;
    let (course, iterations) = (result.solver.course, result.state.iter as usize);
    let Course { evaluations, convolutions, met, .. } = course;
    let stalled = !met && course.has_stalled::<A>();
    Ok((course, Progress { evaluations, iterations, convolutions, met, stalled }))
}

/// Scalar product of two images.
pub(super) fn dot(a: &Array2<f32>, b: &Array2<f32>) -> f64 {
    let lines = a.axis_iter(Axis(0)).into_par_iter().zip(b.axis_iter(Axis(0)));
    let sums: Vec<f64> = lines.map(|(a, b)| a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum()).collect();
    // The lines are added in their order, so that the sum does not depend on the number of threads.
    sums.iter().sum()
}
