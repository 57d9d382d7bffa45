//! The quasi-Newton solver in s. It takes Newton steps with the Hessian of the dirty beam, or L-BFGS steps if the data have no beam.
//!
//! One evaluation gives the value and the gradient, so each trial of the line search takes one pair of transforms. The Lagrange multipliers
//! change between the steps.

use super::memory::Memory;
use super::newton::NewtonSystem;
use super::objective::{Multipliers, Objective, Point};
use super::solver::{Advance, Course, dot};
use crate::Result;
use ndarray::{Array2, Zip};

/// Trials of one line search.
const TRIALS: usize = 6;
/// Rounding of J in single precision, relative to its parts.
const ROUNDING: f64 = 1e-6;

/// The method: the steps that L-BFGS remembers.
pub(super) struct QuasiNewton {
    memory: Memory,
}

/// A trial along a direction.
struct Trial {
    point: Point,
    value: f64,
    slope: f64,
}

impl Default for QuasiNewton {
    fn default() -> Self {
        Self { memory: Memory::new(12) }
    }
}

impl QuasiNewton {
    /// The direction at a point. If the data have a beam it is a Newton step, whose natural length is 1. Otherwise it is a step of L-BFGS.
    fn direction(
        &self,
        course: &mut Course<'_>,
        o: &Objective<'_>,
        (point, gradient): (&Point, &Array2<f64>),
        (chi2, kkt): (f64, f64),
    ) -> Result<Array2<f64>> {
        let m = course.multipliers;
        let mut d = match &o.beam {
            Some(beam) => {
                let system = NewtonSystem::new(beam, point, &o.residual(point, &m), &m)?;
                let (mut d, steps) = system.solve(&gradient.mapv(|g| -g), course.steering.effort(chi2, kkt))?;
                course.convolutions += steps;
                let more = 0.5 * o.unit.sqrt();
                // s keeps its sign and grows at most threefold, because the quadratic model is not valid for longer steps.
                Zip::from(&mut d).and(&point.s).for_each(|d, s| {
                    let towards = if *s < 0.0 { -1.0 } else { 1.0 };
                    *d = towards * (towards * *d).clamp(-0.9 * s.abs(), 2.0 * s.abs() + more);
                });
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
        o.darken(&mut d);
        Ok(if dot(&d, gradient) < 0.0 { d } else { gradient.mapv(|g| -g * damped(o, point, &m)) })
    }

    /// Keep the difference of two points for L-BFGS.
    fn remember(&mut self, o: &Objective<'_>, m: &Multipliers, old: &Point, new: &Point) {
        if o.beam.is_some() {
            return;
        }
        let side = |p: &Point, slope: &Array2<f64>, beta: f64| {
            let mut out = slope + beta;
            Zip::from(&mut out).and(&p.s).for_each(|o, s| *o *= 0.5 * s);
            out
        };
        let penalty = |p: &Point| side(p, &p.penalty_slope, m.beta + m.rho * o.excess(p));
        let data = side(new, &new.slope, 0.0) - side(old, &old.slope, 0.0);
        self.memory.push(&new.s - &old.s, data, penalty(new) - penalty(old));
    }
}

/// Length of a safe step down the gradient.
fn damped(o: &Objective<'_>, point: &Point, m: &Multipliers) -> f64 {
    let curvature = o.beam.as_ref().map_or(0.0, |b| m.lambda * b.largest() * point.flux / point.image.len() as f64);
    1.0 / (1.0 + curvature)
}

/// Search along a direction; `None` if no better point was found.
fn search(course: &mut Course<'_>, o: &mut Objective<'_>, from: &Point, d: &Array2<f64>, slope: f64) -> Result<Option<Point>> {
    let m = course.multipliers;
    let value = o.value(from, &m);
    let noise = ROUNDING * (m.lambda * from.chi2 + from.penalty.abs());
    let mut length = 1.0;
    let mut best: Option<Trial> = None;
    for _ in 0..TRIALS {
        let mut s = from.s.clone();
        s.scaled_add(length, d);
        let point = course.evaluate(o, s)?;
        let trial = Trial { value: o.value(&point, &m), slope: dot(&o.gradient(&point, &m), d), point };
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

impl Advance for QuasiNewton {
    const NAME: &'static str = "quasi-Newton for maximum entropy";
    const STALLS: usize = 4;

    fn step(&mut self, course: &mut Course<'_>, o: &mut Objective<'_>, from: Point) -> Result<(Point, bool)> {
        let chi2 = from.chi2 / o.chi2.expected();
        let kkt = o.kkt(&from, &course.multipliers);
        course.multipliers.lambda = course.steering.next(course.multipliers.lambda, chi2, kkt);
        // The first-order update of the augmented Lagrangian.
        course.multipliers.beta += course.multipliers.rho * o.excess(&from);
        let m = course.multipliers;
        let gradient = o.gradient(&from, &m);
        let d = self.direction(course, o, (&from, &gradient), (chi2, kkt))?;
        match search(course, o, &from, &d, dot(&d, &gradient))? {
            Some(next) => {
                self.remember(o, &m, &from, &next);
                Ok((next, true))
            }
            None => {
                self.memory.clear();
                Ok((from, false))
            }
        }
    }
}
