//! What the solvers share: the problem as argmin holds it, and when to stop.

use super::objective::Objective;
use argmin::core::{Error, IterState, Problem, TerminationReason, TerminationStatus};
use ndarray::{Array2, Zip};
use std::cell::RefCell;

/// The problem as argmin holds it: it hands out shared references only.
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

impl Goals {
    /// Whether and why a solver ends.
    pub(super) fn reached(&self, met: bool, stalled: bool, evaluations: usize) -> TerminationStatus {
        let because = |text: &str| TerminationStatus::Terminated(TerminationReason::SolverExit(text.to_owned()));
        match (met, stalled) {
            (true, _) => TerminationStatus::Terminated(TerminationReason::SolverConverged),
            (_, true) => because("stalled"),
            _ if evaluations >= self.evaluations => because("evaluations"),
            _ => TerminationStatus::NotTerminated,
        }
    }
}

pub(super) fn dot(a: &Array2<f64>, b: &Array2<f64>) -> f64 {
    let mut sum = 0.0;
    Zip::from(a).and(b).for_each(|a, b| sum += a * b);
    sum
}

pub(super) fn with<T>(problem: &Problem<Shared<'_>>, work: impl FnOnce(&Objective) -> T) -> Result<T, Error> {
    let shared = problem.problem.as_ref().ok_or_else(|| Error::msg("the problem was taken away from the solver"))?;
    let guard = shared.borrow();
    Ok(work(&guard))
}
