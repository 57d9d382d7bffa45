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

impl Default for QuasiNewton {
    fn default() -> Self {
        Self { memory: Memory::new(12) }
    }
}

impl QuasiNewton {
    /// The direction at a point, and the slope along it. If the data have a beam it is a Newton step, whose natural length is 1. Otherwise it is a step of L-BFGS.
    fn direction(&self, course: &mut Course<'_>, o: &Objective<'_>, point: &Point, (chi2, kkt): (f64, f64)) -> Result<(Array2<f32>, f64)> {
        let m = course.multipliers;
        let mut d = match &o.beam {
            Some(beam) => {
                let system = NewtonSystem::new((beam, o.chi2.response(), o.smoothness.as_ref()), point, o.residual(point, &m), &m)?;
                let (mut d, steps) = system.solve(-o.gradient(point, &m), course.steering.effort(chi2, kkt))?;
                course.convolutions += steps;
                let more = (0.5 * o.unit.sqrt()) as f32;
                // s keeps its sign and grows at most threefold, because the quadratic model is not valid for longer steps.
                Zip::from(&mut d).and(&point.s).for_each(|d, s| {
                    let towards = if *s < 0.0 { -1.0 } else { 1.0 };
                    *d = towards * (towards * *d).clamp(-0.9 * s.abs(), 2.0 * s.abs() + more);
                });
                d
            }
            None => {
                let mut d = self.memory.direction(&o.gradient(point, &m), m.lambda);
                if self.memory.is_empty() {
                    // The first step of L-BFGS has no natural length. It is limited so that no pixel changes by more than half the prior.
                    let top = d.iter().fold(0.0_f32, |a, v| a.max(v.abs()));
                    let factor = o.unit.sqrt() / f64::from(top.max(f32::MIN_POSITIVE));
                    d.mapv_inplace(|v| (f64::from(v) * factor) as f32);
                }
                d
            }
        };
        o.darken(&mut d);
        // The gradient is made again, because it would take the memory of an image while the system is solved.
        let gradient = o.gradient(point, &m);
        let slope = dot(&d, &gradient);
        if slope < 0.0 {
            return Ok((d, slope));
        }
        let damping = damped(o, point, &m) as f32;
        d.assign(&gradient);
        d.mapv_inplace(|g| -g * damping);
        let slope = dot(&d, &gradient);
        Ok((d, slope))
    }

    /// Keep the difference of two points for L-BFGS.
    fn remember(&mut self, o: &Objective<'_>, m: &Multipliers, old: &Point, new: &Point) {
        let side = |p: &Point, slope: &Array2<f32>, beta: f64| {
            let mut out = slope.clone();
            Zip::from(&mut out).and(&p.s).for_each(|o, s| *o = ((f64::from(*o) + beta) * 0.5 * f64::from(*s)) as f32);
            out
        };
        let penalty = |p: &Point| {
            let beta = m.beta + m.rho * o.excess(p);
            if o.chi2.response().is_one() {
                return side(p, &p.penalty_slope, beta);
            }
            let mut slope = p.penalty_slope.clone();
            o.chi2.response().add_to(beta, &mut slope);
            side(p, &slope, 0.0)
        };
        let data = side(new, &new.slope, 0.0) - side(old, &old.slope, 0.0);
        self.memory.push(&new.s - &old.s, data, penalty(new) - penalty(old));
    }
}

/// Length of a safe step down the gradient.
fn damped(o: &Objective<'_>, point: &Point, m: &Multipliers) -> f64 {
    let curvature = o.beam.as_ref().map_or(0.0, |b| m.lambda * b.largest() * point.flux / point.s.len() as f64);
    1.0 / (1.0 + curvature)
}

/// The point at which a search begins. Only L-BFGS needs all of it afterwards; without the rest a search takes the memory of three images less.
enum Start {
    Variable(Array2<f32>),
    Whole(Box<Point>),
}

impl Start {
    fn s(&self) -> &Array2<f32> {
        match self {
            Self::Variable(s) => s,
            Self::Whole(point) => &point.s,
        }
    }

    /// The point again.
    fn point(self, course: &mut Course<'_>, o: &mut Objective<'_>) -> Result<Point> {
        match self {
            Self::Variable(s) => course.evaluate(o, s),
            Self::Whole(point) => Ok(*point),
        }
    }
}

/// Search along a direction `d`, from a value of J that is known within `noise`; `None` if no better point was found.
fn search(
    course: &mut Course<'_>,
    o: &mut Objective<'_>,
    (from, value, noise): (&Array2<f32>, f64, f64),
    (d, slope): (&Array2<f32>, f64),
) -> Result<Option<Point>> {
    let m = course.multipliers;
    let mut length = 1.0;
    // The value and the length of the best trial. Its point would take the memory of four images, and is hardly ever needed.
    let mut best = (value, None);
    let moved = |length: f64| {
        let mut s = from.clone();
        s.scaled_add(length as f32, d);
        s
    };
    for _ in 0..TRIALS {
        let point = course.evaluate(o, moved(length))?;
        let (there, along) = (o.value(&point, &m), dot(&o.gradient(&point, &m), d));
        let descends = there <= value + 1e-4 * length * slope;
        // Hager & Zhang's test on slopes, where values differ by less than their rounding.
        let flat = there <= value + noise && along <= -0.9 * slope;
        if descends || flat {
            return Ok(Some(point));
        }
        if there < best.0 {
            best = (there, Some(length));
        }
        // Slopes are more accurate than values near the minimum. Values are more accurate where the step was far too long.
        let by_slopes = slope / (slope - along);
        let by_values = -0.5 * slope * length / (there - value - slope * length);
        let factor = if along > 0.0 && by_slopes.is_finite() { by_slopes } else { by_values / length };
        length *= factor.clamp(0.1, 0.6);
    }
    best.1.map(|length| course.evaluate(o, moved(length))).transpose()
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
        let (d, slope) = self.direction(course, o, &from, (chi2, kkt))?;
        let (value, noise) = (o.value(&from, &m), ROUNDING * (m.lambda * from.chi2 + from.penalty.abs()));
        let start = if o.beam.is_some() { Start::Variable(from.s) } else { Start::Whole(Box::new(from)) };
        match search(course, o, (start.s(), value, noise), (&d, slope))? {
            Some(next) => {
                if let Start::Whole(old) = start {
                    self.remember(o, &m, &old, &next);
                }
                Ok((next, true))
            }
            None => {
                self.memory.clear();
                Ok((start.point(course, o)?, false))
            }
        }
    }
}
