//! Code that both solvers share: the form of the problem for argmin, and the conditions to stop.

use super::control::Control;
use super::objective::{Multipliers, Objective, Point};
use crate::progress::{Event, Observer};
use argmin::core::{Error, IterState, Problem, TerminationReason, TerminationStatus};
use ndarray::{Array2, Zip};
use std::cell::RefCell;

/// The form of the problem for argmin, which gives only shared references.
pub(super) type Shared<'a> = RefCell<&'a mut Objective>;
/// The state that argmin keeps: the variable s.
pub(super) type State = IterState<Array2<f64>, (), (), (), (), f64>;

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Goals {
    /// KKT residual.
    pub(super) kkt: f64,
    /// Relative error of the flux.
    pub(super) flux: f64,
    /// Evaluations of the data term at most.
    pub(super) evaluations: usize,
}

/// The result of a solver.
pub(super) struct Found {
    pub(super) multipliers: Multipliers,
    pub(super) point: Option<Point>,
    /// Evaluations of the data term in this run.
    pub(super) evaluations: usize,
    /// Convolutions with the beam.
    pub(super) convolutions: usize,
    /// All goals are met.
    pub(super) met: bool,
    /// The smallest departures from the three goals so far, and the number of steps since one of them became smaller.
    closest: [f64; 3],
    steps_since: usize,
}

/// A run ends after this many steps in a row that do not bring it closer to its goals. Runs that reach their goals come closer every few
/// steps.
const PATIENCE: usize = 100;
/// A step brings a run closer if one of its departures is below this fraction of the smallest one before.
const CLOSER: f64 = 0.99;

impl Found {
    /// Nothing yet, with these multipliers at the start.
    pub(super) fn new(multipliers: Multipliers) -> Self {
        Self { multipliers, point: None, evaluations: 0, convolutions: 0, met: false, closest: [f64::INFINITY; 3], steps_since: 0 }
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
}

/// A solver that returns its result.
pub(super) trait Solves {
    fn found(self) -> Found;
}

/// Reason of termination of a solver that no step brings closer to its goals any more.
const STALLED: &str = "stalled";

impl Goals {
    /// Whether and why a solver ends.
    pub(super) fn reached(&self, found: &Found, stalled: bool) -> TerminationStatus {
        let because = |text: &str| TerminationStatus::Terminated(TerminationReason::SolverExit(text.to_owned()));
        match (found.met, stalled || found.steps_since >= PATIENCE) {
            (true, _) => TerminationStatus::Terminated(TerminationReason::SolverConverged),
            (_, true) => because(STALLED),
            _ if found.evaluations >= self.evaluations => because("evaluations"),
            _ => TerminationStatus::NotTerminated,
        }
    }
}

/// True where a solver ended because no step improved the image.
pub(super) fn has_stalled(status: &TerminationStatus) -> bool {
    matches!(status, TerminationStatus::Terminated(r) if r.text() == STALLED)
}

/// Report a new point, note whether all goals are met there, and keep it. Returns the variable and the value of J.
pub(super) fn accept(
    found: &mut Found,
    problem: &Problem<Shared<'_>>,
    (control, goals): (&Control, &Goals),
    (number, point): (u64, Point),
    observer: &dyn Observer,
) -> Result<(Array2<f64>, f64), Error> {
    let m = found.multipliers;
    let (chi2, kkt, error, value) = with(problem, |o| {
        let error = o.flux.map_or(0.0, |f| o.excess(&point).abs() / f);
        (point.chi2 / o.chi2.expected(), o.kkt(&point, &m), error, o.value(&point, &m))
    })?;
    let (number, evaluations) = (number as usize, found.evaluations);
    observer.event(Event::Entropy { number, evaluations, chi2, kkt, flux: point.flux, lambda: m.lambda });
    found.met = control.met(chi2) && kkt <= goals.kkt && error <= goals.flux;
    found.compare([control.departure(chi2), kkt, error]);
    let s = point.s.clone();
    found.point = Some(point);
    Ok((s, value))
}

/// One evaluation of the objective, counted.
pub(super) fn evaluate(found: &mut Found, problem: &mut Problem<Shared<'_>>, s: Array2<f64>) -> Result<Point, Error> {
    found.evaluations += 1;
    problem.problem("evaluations", |o| Ok(o.borrow_mut().evaluate(s)?))
}

/// Scalar product of two images.
pub(super) fn dot(a: &Array2<f64>, b: &Array2<f64>) -> f64 {
    let mut sum = 0.0;
    Zip::from(a).and(b).for_each(|a, b| sum += a * b);
    sum
}

/// Call a function with the objective.
pub(super) fn with<T>(problem: &Problem<Shared<'_>>, work: impl FnOnce(&Objective) -> T) -> Result<T, Error> {
    let shared = problem.problem.as_ref().ok_or_else(|| Error::msg("the problem was taken away from the solver"))?;
    let guard = shared.borrow();
    Ok(work(&guard))
}
