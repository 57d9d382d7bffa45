//! The quasi-Newton solver in s. It takes Newton steps with the Hessian of the dirty beam, or L-BFGS steps if the data have no beam.
//!
//! One evaluation gives the value and the gradient, so each trial of the line search takes one pair of transforms. The Lagrange multipliers
//! change between the steps.

use super::control::Steering;
use super::memory::Memory;
use super::newton::NewtonSystem;
use super::objective::{Multipliers, Objective, Point};
use super::solver::{Found, Goals, Shared, Solves, State, accept, dot, evaluate, with};
use crate::progress::Observer;
use argmin::core::{Error, KV, Problem, Solver, TerminationStatus};
use ndarray::{Array2, Zip};

/// Trials of one line search.
const TRIALS: usize = 6;
/// Rounding of J in single precision, relative to its parts.
const ROUNDING: f64 = 1e-6;
/// Steps in a row without progress after which the solver gives up.
const STALLS: usize = 4;

/// The solver and what it has found so far.
pub(super) struct QuasiNewton<'o> {
    found: Found,
    steering: Steering,
    goals: Goals,
    memory: Memory,
    stalled: usize,
    observer: &'o dyn Observer,
}

/// A trial along a direction.
struct Trial {
    point: Point,
    value: f64,
    slope: f64,
}

impl<'o> QuasiNewton<'o> {
    /// With these multipliers at the start.
    pub(super) fn new(multipliers: Multipliers, steering: Steering, goals: Goals, observer: &'o dyn Observer) -> Self {
        let found = Found::new(multipliers);
        Self { found, steering, goals, memory: Memory::new(12), stalled: 0, observer }
    }

    /// The direction at a point. If the data have a beam it is a Newton step, whose natural length is 1. Otherwise it is a step of L-BFGS.
    fn direction(&mut self, o: &Objective, point: &Point, gradient: &Array2<f64>, chi2: f64, kkt: f64) -> crate::Result<Array2<f64>> {
        let m = &self.found.multipliers;
        let mut d = match &o.beam {
            Some(beam) => {
                let system = NewtonSystem::new(beam, point, &o.residual(point, m), m)?;
                let (d, steps) = system.solve(&gradient.mapv(|g| -g), self.steering.effort(chi2, kkt))?;
                self.found.convolutions += steps;
                d
            }
            None => {
                let mut d = self.memory.direction(gradient, m.lambda);
                if self.memory.is_empty() {
                    // The first step of L-BFGS has no natural length. It is limited so that no pixel changes by more than half the prior.
                    let top = d.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
                    d *= o.unit.sqrt() / top.max(f64::MIN_POSITIVE);
                }
                d
            }
        };
        if o.beam.is_some() {
            let more = 0.5 * o.unit.sqrt();
            // s keeps its sign and grows at most threefold, because the quadratic model is not valid for longer steps.
            Zip::from(&mut d).and(&point.s).for_each(|d, s| {
                let towards = if *s < 0.0 { -1.0 } else { 1.0 };
                *d = towards * (towards * *d).clamp(-0.9 * s.abs(), 2.0 * s.abs() + more);
            });
        }
        if let Some(inside) = &o.inside {
            Zip::from(&mut d).and(inside).for_each(|d, inside| *d *= f64::from(u8::from(*inside)));
        }
        Ok(if dot(&d, gradient) < 0.0 { d } else { gradient.mapv(|g| -g * self.damped(o, point)) })
    }

    /// Length of a safe step down the gradient.
    fn damped(&self, o: &Objective, point: &Point) -> f64 {
        let curvature =
            o.beam.as_ref().map_or(0.0, |b| self.found.multipliers.lambda * b.largest() * point.flux / point.image.len() as f64);
        1.0 / (1.0 + curvature)
    }

    /// Search along a direction; `None` if no better point was found.
    fn search(&mut self, problem: &mut Problem<Shared<'_>>, from: &Point, d: &Array2<f64>, slope: f64) -> Result<Option<Point>, Error> {
        let m = self.found.multipliers;
        let value = with(problem, |o| o.value(from, &m))?;
        let noise = ROUNDING * (m.lambda * from.chi2 + from.penalty.abs());
        let mut length = 1.0;
        let mut best: Option<Trial> = None;
        for _ in 0..TRIALS {
            let mut s = from.s.clone();
            s.scaled_add(length, d);
            let point = evaluate(&mut self.found, problem, s)?;
            let (new, gradient) = with(problem, |o| (o.value(&point, &m), o.gradient(&point, &m)))?;
            let trial = Trial { value: new, slope: dot(&gradient, d), point };
            let descends = trial.value <= value + 1e-4 * length * slope;
            // Hager & Zhang's test on slopes, where values differ by less than their rounding.
            let flat = trial.value <= value + noise && trial.slope <= -0.9 * slope;
            if descends || flat {
                return Ok(Some(trial.point));
            }
            // Slopes are more accurate than values near the minimum. Values are more accurate where the step was far too long.
            let by_slopes = slope / (slope - trial.slope);
            let by_values = -0.5 * slope * length / (trial.value - value - slope * length);
            let factor = if trial.slope > 0.0 && by_slopes.is_finite() { by_slopes } else { by_values / length };
            length *= factor.clamp(0.1, 0.6);
            if best.as_ref().is_none_or(|b| trial.value < b.value) {
                best = Some(trial);
            }
        }
        Ok(best.filter(|b| b.value < value).map(|b| b.point))
    }
}

impl<'a> Solver<Shared<'a>, State> for QuasiNewton<'_> {
    fn name(&self) -> &str {
        "quasi-Newton for maximum entropy"
    }

    fn init(&mut self, problem: &mut Problem<Shared<'a>>, mut state: State) -> Result<(State, Option<KV>), Error> {
        let start = state.take_param().ok_or_else(|| Error::msg("no image to start from"))?;
        self.found.point = Some(evaluate(&mut self.found, problem, start.clone())?);
        Ok((state.param(start), None))
    }

    fn next_iter(&mut self, problem: &mut Problem<Shared<'a>>, state: State) -> Result<(State, Option<KV>), Error> {
        if self.observer.cancelled() {
            return Err(crate::ChainError::Cancelled.into());
        }
        let Some(point) = self.found.point.take() else { return Err(Error::msg("the solver was not initialised")) };
        let expected = with(problem, |o| o.chi2.expected())?;
        let chi2 = point.chi2 / expected;
        let (kkt, excess) = with(problem, |o| (o.kkt(&point, &self.found.multipliers), o.excess(&point)))?;
        self.found.multipliers.lambda = self.steering.next(self.found.multipliers.lambda, chi2, kkt);
        // The first-order update of the augmented Lagrangian.
        self.found.multipliers.beta += self.found.multipliers.rho * excess;
        let m = self.found.multipliers;
        let gradient = with(problem, |o| o.gradient(&point, &m))?;
        let d = {
            let shared = problem.problem.as_ref().ok_or_else(|| Error::msg("the problem was taken away from the solver"))?;
            let guard = shared.borrow();
            self.direction(&guard, &point, &gradient, chi2, kkt)?
        };
        let slope = dot(&d, &gradient);
        let next = self.search(problem, &point, &d, slope)?;
        let point = match next {
            Some(next) => {
                self.stalled = 0;
                self.remember(problem, &point, &next)?;
                next
            }
            None => {
                self.stalled += 1;
                self.memory.clear();
                point
            }
        };
        let (s, value) = accept(&mut self.found, problem, (&self.steering.control, &self.goals), (state.iter + 1, point), self.observer)?;
        Ok((state.param(s).cost(value), None))
    }

    fn terminate(&mut self, _state: &State) -> TerminationStatus {
        self.goals.reached(&self.found, self.stalled >= STALLS)
    }
}

impl QuasiNewton<'_> {
    /// Keep the difference of two points for L-BFGS.
    fn remember(&mut self, problem: &Problem<Shared<'_>>, old: &Point, new: &Point) -> Result<(), Error> {
        if with(problem, |o| o.beam.is_some())? {
            return Ok(());
        }
        let m = self.found.multipliers;
        let beta = with(problem, |o| (m.beta + m.rho * o.excess(old), m.beta + m.rho * o.excess(new)))?;
        let side = |p: &Point, slope: &Array2<f64>, beta: f64| {
            let mut out = slope + beta;
            Zip::from(&mut out).and(&p.s).for_each(|o, s| *o *= 0.5 * s);
            out
        };
        let data = side(new, &new.slope, 0.0) - side(old, &old.slope, 0.0);
        let penalty = side(new, &new.penalty_slope, beta.1) - side(old, &old.penalty_slope, beta.0);
        self.memory.push(&new.s - &old.s, data, penalty);
        Ok(())
    }
}

impl Solves for QuasiNewton<'_> {
    fn found(self) -> Found {
        self.found
    }
}
