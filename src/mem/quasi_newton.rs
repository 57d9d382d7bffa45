//! The quasi-Newton solver in s: Newton steps on the beam's Hessian where the data have one, L-BFGS where not.
//!
//! Value and gradient come from one evaluation, so each trial of the line search costs one pair of transforms and nothing is computed
//! twice. The Lagrange multipliers move between the steps.

use super::control::{Control, Steering};
use super::memory::Memory;
use super::newton::NewtonSystem;
use super::objective::{Multipliers, Objective, Point};
use super::solver::{Goals, Shared, State, dot, with};
use crate::progress::{Event, Observer};
use argmin::core::{Error, KV, Problem, Solver, TerminationStatus};
use ndarray::{Array2, Zip};

/// Trials of one line search.
const TRIALS: usize = 6;
/// Rounding of J in single precision, relative to its parts.
const ROUNDING: f64 = 1e-6;
/// Steps in a row without progress after which the solver gives up.
const STALLS: usize = 4;

/// The solver and what it has found.
pub(super) struct QuasiNewton<'o> {
    pub(super) multipliers: Multipliers,
    pub(super) steering: Steering,
    pub(super) goals: Goals,
    pub(super) point: Option<Point>,
    /// Evaluations of this run.
    pub(super) evaluations: usize,
    /// Iterations of conjugate gradients.
    pub(super) inner: usize,
    pub(super) met: bool,
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
    /// With these multipliers at the start; `point` where it is known already.
    pub(super) fn new(multipliers: Multipliers, control: Control, goals: Goals, point: Option<Point>, observer: &'o dyn Observer) -> Self {
        let steering = control.into();
        Self { multipliers, steering, goals, point, evaluations: 0, inner: 0, met: false, memory: Memory::new(12), stalled: 0, observer }
    }

    fn evaluate(&mut self, problem: &mut Problem<Shared<'_>>, s: Array2<f64>) -> Result<Point, Error> {
        self.evaluations += 1;
        problem.problem("evaluations", |o| Ok(o.borrow_mut().evaluate(s)?))
    }

    /// The direction at a point, and whether it is a Newton step whose natural length is 1.
    fn direction(&mut self, o: &Objective, point: &Point, gradient: &Array2<f64>, chi2: f64, kkt: f64) -> Array2<f64> {
        let m = &self.multipliers;
        let mut d = match &o.beam {
            Some(beam) => {
                let system = NewtonSystem::new(beam, point, &o.residual(point, m), m);
                let (tolerance, limit) = self.steering.control.effort(chi2, kkt);
                let (d, steps) = system.solve(&gradient.mapv(|g| -g), tolerance, limit);
                self.inner += steps;
                d
            }
            None => {
                let mut d = self.memory.direction(gradient, m.lambda);
                if self.memory.is_empty() {
                    // The first step has no length of its own: change no pixel by more than half the prior.
                    let top = d.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
                    d *= o.unit.sqrt() / top.max(f64::MIN_POSITIVE);
                }
                d
            }
        };
        if o.beam.is_some() {
            let more = 0.5 * o.unit.sqrt();
            // s keeps its sign and grows at most threefold: further out the quadratic model means nothing.
            Zip::from(&mut d).and(&point.s).for_each(|d, s| {
                let towards = if *s < 0.0 { -1.0 } else { 1.0 };
                *d = towards * (towards * *d).clamp(-0.9 * s.abs(), 2.0 * s.abs() + more);
            });
        }
        if let Some(inside) = &o.inside {
            Zip::from(&mut d).and(inside).for_each(|d, inside| *d *= f64::from(u8::from(*inside)));
        }
        if dot(&d, gradient) < 0.0 { d } else { gradient.mapv(|g| -g * self.damped(o, point)) }
    }

    /// Length of a safe step down the gradient.
    fn damped(&self, o: &Objective, point: &Point) -> f64 {
        let curvature = o.beam.as_ref().map_or(0.0, |b| self.multipliers.lambda * b.largest() * point.flux / point.image.len() as f64);
        1.0 / (1.0 + curvature)
    }

    /// Search along a direction; `None` where nothing better was found.
    fn search(&mut self, problem: &mut Problem<Shared<'_>>, from: &Point, d: &Array2<f64>, slope: f64) -> Result<Option<Point>, Error> {
        let m = self.multipliers;
        let value = with(problem, |o| o.value(from, &m))?;
        let noise = ROUNDING * (m.lambda * from.chi2 + from.penalty.abs());
        let mut length = 1.0;
        let mut best: Option<Trial> = None;
        for _ in 0..TRIALS {
            let mut s = from.s.clone();
            s.scaled_add(length, d);
            let point = self.evaluate(problem, s)?;
            let (new, gradient) = with(problem, |o| (o.value(&point, &m), o.gradient(&point, &m)))?;
            let trial = Trial { value: new, slope: dot(&gradient, d), point };
            let descends = trial.value <= value + 1e-4 * length * slope;
            // Hager & Zhang's test on slopes, where values differ by less than their rounding.
            let flat = trial.value <= value + noise && trial.slope <= -0.9 * slope;
            if descends || flat {
                return Ok(Some(trial.point));
            }
            // Slopes say more than values near the minimum, values more where the step was far too long.
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

    fn report(&self, number: u64, point: &Point, chi2: f64, kkt: f64) {
        let (evaluations, lambda) = (self.evaluations, self.multipliers.lambda);
        self.observer.event(Event::Entropy { number: number as usize, evaluations, chi2, kkt, flux: point.flux, lambda });
    }
}

impl<'a> Solver<Shared<'a>, State> for QuasiNewton<'_> {
    fn name(&self) -> &str {
        "quasi-Newton for maximum entropy"
    }

    fn init(&mut self, problem: &mut Problem<Shared<'a>>, mut state: State) -> Result<(State, Option<KV>), Error> {
        let start = state.take_param().ok_or_else(|| Error::msg("no image to start from"))?;
        if self.point.is_none() {
            self.point = Some(self.evaluate(problem, start.clone())?);
        }
        Ok((state.param(start), None))
    }

    fn next_iter(&mut self, problem: &mut Problem<Shared<'a>>, state: State) -> Result<(State, Option<KV>), Error> {
        if self.observer.cancelled() {
            return Err(crate::ChainError::Cancelled.into());
        }
        let Some(point) = self.point.take() else { return Err(Error::msg("the solver was not initialised")) };
        let expected = with(problem, |o| o.chi2.expected())?;
        let chi2 = point.chi2 / expected;
        let (kkt, excess) = with(problem, |o| (o.kkt(&point, &self.multipliers), o.excess(&point)))?;
        self.multipliers.lambda = self.steering.next(self.multipliers.lambda, chi2, kkt);
        // The first-order update of the augmented Lagrangian.
        self.multipliers.beta += self.multipliers.rho * excess;
        let m = self.multipliers;
        let gradient = with(problem, |o| o.gradient(&point, &m))?;
        let d = {
            let shared = problem.problem.as_ref().ok_or_else(|| Error::msg("the problem was taken away from the solver"))?;
            let guard = shared.borrow();
            self.direction(&guard, &point, &gradient, chi2, kkt)
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
        let chi2 = point.chi2 / expected;
        let (kkt, error, value) = with(problem, |o| {
            (o.kkt(&point, &self.multipliers), o.flux.map_or(0.0, |f| o.excess(&point).abs() / f), o.value(&point, &self.multipliers))
        })?;
        self.report(state.iter + 1, &point, chi2, kkt);
        self.met = self.steering.control.met(chi2) && kkt <= self.goals.kkt && error <= self.goals.flux;
        let s = point.s.clone();
        self.point = Some(point);
        Ok((state.param(s).cost(value), None))
    }

    fn terminate(&mut self, _state: &State) -> TerminationStatus {
        self.goals.reached(self.met, self.stalled >= STALLS, self.evaluations)
    }
}

impl QuasiNewton<'_> {
    /// Keep the difference of two points for L-BFGS.
    fn remember(&mut self, problem: &Problem<Shared<'_>>, old: &Point, new: &Point) -> Result<(), Error> {
        if with(problem, |o| o.beam.is_some())? {
            return Ok(());
        }
        let m = self.multipliers;
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
