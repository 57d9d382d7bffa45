//! How the Lagrange multiplier of chi squared, lambda, is found.
//!
//! The image starts at the prior, with a lambda so small that one step can reach the optimum. While chi squared is above its target, each
//! step may raise lambda by a factor, as soon as the image has moved half of the way to the optimum of the present lambda. Better
//! convergence is not useful at a lambda that will change. Near the target, lambda follows from chi squared, and changes only when the
//! image has converged. The response of chi squared to lambda differs by orders of magnitude between scenes (with a few points in noise it
//! is nearly zero). It is therefore measured between two converged images, and the next lambda follows from the power law through both.

use super::tuning::MemControl;

/// How lambda changes from step to step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Control {
    /// It does not change.
    Fixed,
    /// It rises to this value as fast as the image can follow, and stays there.
    UpTo(f64),
    /// It moves until chi squared is its expected value times `target`, within `tolerance`.
    Target {
        /// Chi squared over its expected value.
        target: f64,
        /// Largest departure of chi squared from the target, relative.
        tolerance: f64,
    },
}

/// How exactly a Newton step is solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Effort {
    /// Residual of the linear system divided by its right-hand side.
    pub(super) tolerance: f64,
    /// Steps of conjugate gradients at most.
    pub(super) steps: usize,
}

/// Far from the target an exact step is not useful, because lambda will change. This affects the number of steps, but not the result.
const FAR: Effort = Effort { tolerance: 0.3, steps: 8 };
const CLOSE: Effort = Effort { tolerance: 0.2, steps: 30 };
/// With a smoothness the image of each lambda is wanted, and neighbours change together.
const SMOOTH: Effort = Effort { tolerance: 0.1, steps: 100 };

/// Growth of the exponent of the rule with each step on the same side of the target.
const CALM: f64 = 1.2;
/// Number of times that chi squared may cross its target before the exponent falls, because a few crossings belong to a search that converges.
const CROSSINGS: usize = 4;

impl Control {
    /// True where chi squared is at its target.
    #[must_use]
    pub fn met(&self, chi2: f64) -> bool {
        match *self {
            Self::Fixed | Self::UpTo(_) => true,
            Self::Target { target, tolerance } => (chi2 / target - 1.0).abs() <= tolerance,
        }
    }

    /// The relative departure of chi squared from its target.
    pub(super) fn departure(&self, chi2: f64) -> f64 {
        match *self {
            Self::Fixed | Self::UpTo(_) => 0.0,
            Self::Target { target, .. } => (chi2 / target - 1.0).abs(),
        }
    }
}

/// A control with the response of chi squared to lambda that it has measured.
#[derive(Debug, Clone, Copy)]
pub(super) struct Steering {
    pub(super) control: Control,
    tuning: MemControl,
    /// The last image that had settled.
    settled: Option<Settled>,
    /// d ln(chi2) / d ln(lambda) between two of them.
    power: Option<f64>,
    /// Exponent on the factors of the rule: 1, or less after chi squared has gone from one side of its target to the other many times.
    damping: f64,
    crossings: usize,
    /// True if chi squared was above its target at the last step.
    above: Option<bool>,
}

/// Chi squared over its expected value, of an image that has settled at this lambda.
#[derive(Debug, Clone, Copy)]
struct Settled {
    lambda: f64,
    chi2: f64,
}

impl Steering {
    pub(super) fn new(control: Control, tuning: MemControl) -> Self {
        Self { control, tuning, settled: None, power: None, damping: 1.0, crossings: 0, above: None }
    }

    /// The next lambda, from chi squared over its expected value and the KKT residual.
    pub(super) fn next(&mut self, lambda: f64, chi2: f64, kkt: f64) -> f64 {
        if let Control::UpTo(limit) = self.control {
            let factor = if kkt < self.tuning.followed { self.tuning.rise } else { 1.0 };
            return (lambda * factor).min(limit);
        }
        let Control::Target { target, tolerance } = self.control else { return lambda };
        let t = self.tuning;
        if kkt < t.settled {
            self.learn(Settled { lambda, chi2 });
        }
        let excess = chi2 / target;
        let departure = (excess - 1.0).abs();
        self.damp(excess > 1.0);
        match self.power {
            Some(_) if departure <= t.dead_band * tolerance => lambda,
            Some(_) if departure < t.near && kkt >= t.settled => lambda,
            Some(power) if departure < t.near => lambda * excess.powf(-1.0 / power).clamp(1.0 / t.jump, t.jump),
            _ => lambda * (self.by_rule(lambda, chi2, kkt) / lambda).powf(self.damping),
        }
    }

    /// Where chi squared answers to lambda more strongly than the rule expects, the rule would go to and fro across the target for ever.
    fn damp(&mut self, above: bool) {
        let crossed = self.above.replace(above).is_some_and(|before| before != above);
        self.crossings += usize::from(crossed);
        let fall = crossed && self.crossings > CROSSINGS;
        self.damping = if fall { 0.5 * self.damping } else { (CALM * self.damping).min(1.0) };
    }

    /// The next lambda while the power law is not known.
    fn by_rule(&self, lambda: f64, chi2: f64, kkt: f64) -> f64 {
        let Control::Target { target, tolerance } = self.control else { return lambda };
        let t = self.tuning;
        let excess = chi2 / target;
        if excess > 1.0 + tolerance && kkt < t.followed {
            lambda * excess.clamp(t.least_rise, t.rise)
        } else if excess > 1.0 + t.dead_band * tolerance && kkt < t.trim_up_kkt {
            lambda * excess.powf(t.trim_up)
        } else if excess < 1.0 - t.dead_band * tolerance && kkt < t.trim_down_kkt {
            lambda * excess.powf(t.trim_down).max(0.5)
        } else {
            lambda
        }
    }

    /// True where lambda has reached the value to which it rises.
    pub(super) fn arrived(&self, lambda: f64) -> bool {
        !matches!(self.control, Control::UpTo(limit) if lambda < limit * (1.0 - 1e-9))
    }

    /// How exactly the next Newton step should be solved.
    pub(super) fn effort(&self, chi2: f64, kkt: f64) -> Effort {
        let far = match self.control {
            Control::UpTo(_) => return SMOOTH,
            Control::Fixed => kkt > self.tuning.followed,
            Control::Target { target, .. } => chi2 / target > 1.1,
        };
        if far { FAR } else { CLOSE }
    }

    fn learn(&mut self, now: Settled) {
        let Some(before) = self.settled else {
            self.settled = Some(now);
            return;
        };
        let change = (now.lambda / before.lambda).ln();
        // Two images at nearly the same lambda differ by their remaining errors.
        if change.abs() > 0.02 {
            let power = (now.chi2 / before.chi2).ln() / change;
            self.power = (power < -0.01).then_some(power.max(-2.0));
            self.settled = Some(now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chi_squared_that_hardly_answers_is_led_to_its_target_in_a_few_steps() {
        // chi2 = 0.99 + 0.06 lambda^-1/2, the image always settled.
        let chi2 = |lambda: f64| 0.99 + 0.06 / lambda.sqrt();
        let control = Control::Target { target: 1.0, tolerance: 0.008 };
        let mut steering = Steering::new(control, MemControl::default());
        let mut lambda = 1.0;
        let mut steps = 0;
        while !control.met(chi2(lambda)) && steps < 50 {
            lambda = steering.next(lambda, chi2(lambda), 1e-3);
            steps += 1;
        }
        assert!(steps <= 5, "{steps} steps to {lambda}");
        let mut plain = 1.0;
        (0..5).for_each(|_| plain = Steering::new(control, MemControl::default()).by_rule(plain, chi2(plain), 1e-3));
        assert!(!control.met(chi2(plain)), "the rule alone is as good: {plain}");
    }

    #[test]
    fn a_chi_squared_that_answers_strongly_is_not_led_to_and_fro() {
        // An image that never settles, and a chi squared that answers with a power of the step, as with data that have hardly any noise.
        let control = Control::Target { target: 1.0, tolerance: 0.008 };
        for power in [-1.5, -2.0, -3.0] {
            let chi2 = |lambda: f64| lambda.powf(power);
            let mut steering = Steering::new(control, MemControl::default());
            let mut lambda = 1.3;
            let mut steps = 0;
            while steps < 60 && !control.met(chi2(lambda)) {
                lambda = steering.next(lambda, chi2(lambda), 0.04);
                steps += 1;
            }
            assert!(steps < 40, "power {power}: {steps} steps to {lambda}");
        }
    }

    #[test]
    fn it_rises_falls_and_rests() {
        let c = Control::Target { target: 1.0, tolerance: 0.01 };
        let next = |lambda, chi2, kkt| Steering::new(c, MemControl::default()).by_rule(lambda, chi2, kkt);
        assert_eq!(next(2.0, 100.0, 0.1), 8.0);
        assert_eq!(next(2.0, 100.0, 0.9), 2.0, "an image that has not followed");
        assert!((next(2.0, 1.5, 0.4) - 3.0).abs() < 1e-12);
        assert!(next(2.0, 0.5, 0.1) < 2.0);
        assert_eq!(next(2.0, 1.001, 0.01), 2.0);
        assert!(c.met(1.009) && !c.met(1.02) && !c.met(0.98));
        assert_eq!(Steering::new(Control::Fixed, MemControl::default()).next(2.0, 100.0, 0.0), 2.0);
        assert!(Control::Fixed.met(100.0));
    }
}
