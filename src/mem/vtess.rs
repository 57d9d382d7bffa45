//! The solver of Cornwell and Evans: Newton steps in the image, with multipliers that change in each step.
//!
//! Each iteration forms the products of the gradients of chi squared (C), the flux (F) and the penalty in the metric of the inverse
//! Hessian. These predict how much a step changes chi squared and the flux, and how much each multiplier must change so that both reach
//! their targets. The change is bounded, because the quadratic model is not valid where the gradient of the Lagrangian exceeds a multiple
//! of its two terms. The step is taken in the image, kept positive, and shortened by interpolation between the gradients at its two ends.
//! Visibilities are linear in the image, so the interpolation needs no transform. An iteration takes exactly one evaluation of the data
//! term.
//!
//! Cornwell and Evans use only the diagonal of the Hessian. This solver applies the inverse of the Hessian by conjugate gradients with the
//! dirty beam, so its predictions are valid for beams with side lobes and for oversampled images.
//!
//! # Reference
//! Cornwell & Evans 1985, A&A 143, 77.

use super::control::Control;
use super::newton::NewtonSystem;
use super::objective::{Multipliers, Objective, Point};
use super::solver::{Advance, Course, dot};
use super::tuning::VtessControl;
use crate::{ChainError, Result};
use ndarray::{Array2, Zip};

/// The method: the bounds of its steps.
pub(super) struct Vtess {
    pub(super) tuning: VtessControl,
}

/// A step with the multipliers it leads to.
struct Step {
    /// Change of s.
    direction: Array2<f32>,
    multipliers: Multipliers,
}

/// Chi squared half as a function of the change of lambda, along the plane of the two directions.
struct Model {
    now: f64,
    slope: [f64; 2],
    curvature: [f64; 3],
}

impl Model {
    fn at(&self, change: f64) -> f64 {
        let [c00, c01, c11] = self.curvature;
        self.now + self.slope[0] + change * self.slope[1] + 0.5 * (c00 + change * (2.0 * c01 + change * c11))
    }

    /// Slope of the model by the change, at none.
    fn response(&self) -> f64 {
        self.slope[1] + self.curvature[1]
    }

    /// The change within `range` that comes nearest to `target`, on the side of the parabola where a larger lambda gives a better fit.
    fn change_for(&self, target: f64, range: (f64, f64)) -> f64 {
        let vertex = if self.curvature[2] > 0.0 { -self.response() / self.curvature[2] } else { f64::INFINITY };
        let (mut lo, mut hi) = (range.0.min(vertex), range.1.min(vertex));
        if self.at(hi) >= target {
            return hi;
        }
        if self.at(lo) <= target {
            return lo;
        }
        for _ in 0..60 {
            let middle = 0.5 * (lo + hi);
            if self.at(middle) > target {
                lo = middle;
            } else {
                hi = middle;
            }
        }
        0.5 * (lo + hi)
    }
}

/// An array times s / 2.
fn in_s(point: &Point, v: &Array2<f32>) -> Array2<f32> {
    Zip::from(v).and(&point.s).par_map_collect(|v, s| v * (0.5 * s))
}

fn add_scaled(to: &mut Array2<f32>, factor: f64, of: &Array2<f32>) {
    Zip::from(to).and(of).par_for_each(|to, of| *to += factor as f32 * of);
}

impl Vtess {
    /// The step and the multipliers from the products of the gradients.
    fn newton(&self, course: &mut Course<'_>, o: &Objective<'_>, point: &Point) -> Result<Step> {
        let Some(beam) = &o.beam else { return Err(ChainError::Internal("vtess needs a beam".into())) };
        let m = course.multipliers;
        let expected = o.chi2.expected();
        let residual = o.residual(point, &m);
        let gj = in_s(point, &residual);
        let system = NewtonSystem::new((beam, o.chi2.response(), o.smoothness.as_ref()), point, residual, &m)?;
        let (chi2, kkt) = (point.chi2 / expected, o.kkt(point, &m));
        let effort = course.steering.effort(chi2, kkt);
        let mut inner = 0;
        let mut solve = |g: &Array2<f32>| -> Result<Array2<f32>> {
            let (x, steps) = system.solve(Zip::from(g).par_map_collect(|v| -v), effort)?;
            inner += steps;
            Ok(x)
        };
        let gc = in_s(point, &point.slope);
        let (mut d0, mut d1) = (solve(&gj)?, solve(&gc)?);
        let range = self.bounds(m.lambda, &gj, &gc, (&d0, &d1));
        let mut beta = [0.0, 0.0];
        if o.flux.is_some() {
            // The flux reaches its value for every change of lambda.
            let mut ones = Array2::ones(point.s.dim());
            o.chi2.response().multiply_single(&mut ones);
            let gf = in_s(point, &ones);
            let df = solve(&gf)?;
            let ff = -dot(&gf, &df);
            if ff > 0.0 {
                beta = [(o.excess(point) + dot(&gf, &d0)) / ff, dot(&gf, &d1) / ff];
                add_scaled(&mut d0, beta[0], &df);
                add_scaled(&mut d1, beta[1], &df);
            }
        }
        let c00 = system.data_curvature(&d0, &d0)?;
        let (c01, c11) = (system.data_curvature(&d0, &d1)?, system.data_curvature(&d1, &d1)?);
        course.convolutions += inner + 3;
        let model = Model { now: 0.5 * point.chi2, slope: [dot(&gc, &d0), dot(&gc, &d1)], curvature: [c00, c01, c11] };
        let change = self.change(course, &model, range, (chi2, kkt), expected);
        add_scaled(&mut d0, change, &d1);
        let multipliers = Multipliers { lambda: m.lambda + change, beta: m.beta + beta[0] + change * beta[1], rho: 0.0 };
        Ok(Step { direction: d0, multipliers })
    }

    /// The change of lambda that leads chi squared to its target.
    fn change(&self, course: &mut Course<'_>, model: &Model, range: (f64, f64), (chi2, kkt): (f64, f64), expected: f64) -> f64 {
        let Control::Target { target, tolerance } = course.steering.control else { return 0.0 };
        let lambda = course.multipliers.lambda;
        let excess = chi2 / target;
        let by_rule = course.steering.next(lambda, chi2, kkt) - lambda;
        // Near the target the error of the model is as large as the difference from the target. With a flux constraint lambda may also have
        // no effect.
        if (excess - 1.0).abs() < self.tuning.close * tolerance || model.response() * lambda > -1e-3 * model.now {
            return by_rule;
        }
        model.change_for(0.5 * target * expected, range)
    }

    /// The range for the change of lambda. Within it the squared length of the gradient is at most `growth` times that of its terms.
    fn bounds(&self, lambda: f64, gj: &Array2<f32>, gc: &Array2<f32>, (d0, d1): (&Array2<f32>, &Array2<f32>)) -> (f64, f64) {
        let VtessControl { growth, rise, .. } = self.tuning;
        let (jj, cj, cc) = (-dot(gj, d0), -dot(gc, d0), -dot(gc, d1));
        if !(cc > 0.0) {
            return (0.0, 0.0);
        }
        // The term of the penalty is the gradient minus the term of the data.
        let rr = (jj - 2.0 * lambda * cj + lambda * lambda * cc).max(0.0);
        let sides = rr + lambda * lambda * cc;
        let root = (cj / cc).powi(2) - (jj - growth * sides) / cc;
        let reach = root.max(0.0).sqrt();
        let (lo, hi) = (-cj / cc - reach, -cj / cc + reach);
        (lo.max(-0.5 * lambda).min(0.0), hi.min((rise - 1.0) * lambda).max(0.0))
    }

    /// The new image of a step. It is positive, and the change of each pixel is limited to the range of the quadratic model.
    fn moved(&self, o: &Objective<'_>, point: &Point, direction: &Array2<f32>) -> Array2<f64> {
        let mut image = point.image();
        let (unit, VtessControl { loss, gain, .. }) = (o.unit, self.tuning);
        Zip::from(&mut image).and(&point.s).and(direction).par_for_each(|i, s, d| {
            let step = 0.5 * f64::from(*s) * f64::from(*d);
            *i += step.clamp(-loss * *i, gain * *i + 0.5 * unit);
        });
        o.darken(&mut image);
        image
    }
}

impl Advance for Vtess {
    const NAME: &'static str = "Cornwell-Evans";
    const STALLS: usize = 5;

    fn step(&mut self, course: &mut Course<'_>, o: &mut Objective<'_>, old: Point) -> Result<(Point, bool)> {
        let step = self.newton(course, o, &old)?;
        let m = step.multipliers;
        course.multipliers = m;
        let image = self.moved(o, &old, &step.direction);
        let before = old.image();
        let change = Zip::from(&image).and(&before).par_map_collect(|new, old| (new - old) as f32);
        let trial = course.evaluate(o, o.variable(&image))?;
        let (from, to) = (dot(&o.residual(&old, &m), &change), dot(&o.residual(&trial, &m), &change));
        // If the gradient along the step has changed its sign, the minimum lies between the two ends.
        let t = if from < 0.0 && to > 0.0 { from / (from - to) } else { 1.0 };
        if t > 0.8 {
            return Ok((trial, true));
        }
        let bend = dot(&trial.slope, &change) - dot(&old.slope, &change);
        let chi2 = old.chi2 + 2.0 * t * dot(&old.slope, &change) + t * t * bend;
        let (rest, part) = (1.0 - t as f32, t as f32);
        let slope = Zip::from(&old.slope).and(&trial.slope).par_map_collect(|old, trial| old * rest + part * trial);
        let mut image = before;
        Zip::from(&mut image).and(&change).par_for_each(|i, c| *i += t * f64::from(*c));
        // A step of almost zero length is no progress.
        Ok((o.assemble(o.variable(&image), chi2, slope), t >= 0.02))
    }
}
#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_model_finds_the_change_that_meets_the_target_or_comes_nearest() {
        // c(x) = 10 - 2 - 4 x + (1 + x^2) / 2: 6 at 4 - sqrt(11), again beyond the vertex at 4.
        let model = Model { now: 10.0, slope: [-2.0, -4.0], curvature: [1.0, 0.0, 1.0] };
        let x = model.change_for(6.0, (-1.0, 30.0));
        assert!((model.at(x) - 6.0).abs() < 1e-9 && (x - (4.0 - 11.0_f64.sqrt())).abs() < 1e-9, "{x}");
        assert_eq!(model.change_for(-100.0, (-1.0, 30.0)), 4.0);
        assert_eq!(model.change_for(-100.0, (-1.0, 3.0)), 3.0);
        assert_eq!(model.change_for(6.0, (0.0, 0.0)), 0.0);
    }
}
