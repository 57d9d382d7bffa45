//! How the Lagrange multiplier of chi squared is found: raised while the data are not yet explained, trimmed once they are.
//!
//! The image starts at the prior, which explains nothing, with a multiplier so small that one step fits. Each step may raise it by a
//! factor, as soon as the image has followed the last one half way: an image that is far from its optimum is not worth polishing.
//! Near the target the multiplier moves with chi squared itself, and only when the image has settled. How much chi squared gives way
//! differs by orders of magnitude between scenes (near a few points in noise hardly at all), so it is measured between two images that
//! have settled, and the next multiplier follows from the power law through both.

/// How lambda changes from step to step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Control {
    /// It stays.
    Fixed,
    /// It is led to where chi2 is its expected value times `target`, within `tolerance`.
    Target {
        /// Chi squared over its expected value.
        target: f64,
        /// Largest departure of it, relative.
        tolerance: f64,
    },
}

/// Largest factor of a step.
const RISE: f64 = 4.0;
/// KKT residual at which the image has followed half way.
const FOLLOWED: f64 = 0.5;
/// KKT residual below which chi squared is what it will stay at this lambda.
const SETTLED: f64 = 0.03;
/// Departure of chi squared from its target within which a power law holds.
const NEAR: f64 = 0.2;
/// Largest factor by the power law.
const JUMP: f64 = 3.0;

impl Control {
    /// The next lambda, from chi squared over its expected value and the KKT residual.
    #[must_use]
    pub fn next(&self, lambda: f64, chi2: f64, kkt: f64) -> f64 {
        let Self::Target { target, tolerance } = *self else { return lambda };
        let excess = chi2 / target;
        if excess > 1.0 + tolerance && kkt < FOLLOWED {
            lambda * excess.clamp(1.03, RISE)
        } else if excess > 1.0 + 0.6 * tolerance && kkt < 0.05 {
            lambda * excess.powf(1.3)
        } else if excess < 1.0 - 0.6 * tolerance && kkt < 0.2 {
            lambda * excess.powf(1.5).max(0.5)
        } else {
            lambda
        }
    }

    /// True where chi squared is as it should be.
    #[must_use]
    pub fn met(&self, chi2: f64) -> bool {
        match *self {
            Self::Fixed => true,
            Self::Target { target, tolerance } => (chi2 / target - 1.0).abs() <= tolerance,
        }
    }

    /// How exactly a Newton step should be solved: the relative residual and the most steps of conjugate gradients.
    #[must_use]
    pub(super) fn effort(&self, chi2: f64, kkt: f64) -> (f64, usize) {
        let far = match *self {
            Self::Fixed => kkt > FOLLOWED,
            Self::Target { target, .. } => chi2 / target > 1.1,
        };
        if far { (0.3, 8) } else { (0.2, 30) }
    }
}

/// A control with what it has learnt: how chi squared answers to lambda.
#[derive(Debug, Clone, Copy)]
pub(super) struct Steering {
    pub(super) control: Control,
    /// Lambda and chi squared of the last image that had settled.
    settled: Option<(f64, f64)>,
    /// d ln(chi2) / d ln(lambda) between two of them.
    power: Option<f64>,
}

impl From<Control> for Steering {
    fn from(control: Control) -> Self {
        Self { control, settled: None, power: None }
    }
}

impl Steering {
    /// As [`Control::next`], with the secant where it is known.
    pub(super) fn next(&mut self, lambda: f64, chi2: f64, kkt: f64) -> f64 {
        let Control::Target { target, tolerance } = self.control else { return lambda };
        if kkt < SETTLED {
            self.learn(lambda, chi2);
        }
        let excess = chi2 / target;
        match self.power {
            Some(_) if (excess - 1.0).abs() <= 0.6 * tolerance => lambda,
            Some(_) if (excess - 1.0).abs() < NEAR && kkt >= SETTLED => lambda,
            Some(power) if (excess - 1.0).abs() < NEAR => lambda * excess.powf(-1.0 / power).clamp(1.0 / JUMP, JUMP),
            _ => self.control.next(lambda, chi2, kkt),
        }
    }

    fn learn(&mut self, lambda: f64, chi2: f64) {
        let Some((before, was)) = self.settled else {
            self.settled = Some((lambda, chi2));
            return;
        };
        let change = (lambda / before).ln();
        // Two images at nearly one lambda differ by what is left of their errors.
        if change.abs() > 0.02 {
            let power = (chi2 / was).ln() / change;
            self.power = (power < -0.01).then_some(power.max(-2.0));
            self.settled = Some((lambda, chi2));
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
        let mut steering = Steering::from(control);
        let mut lambda = 1.0;
        let mut steps = 0;
        while !control.met(chi2(lambda)) && steps < 50 {
            lambda = steering.next(lambda, chi2(lambda), 1e-3);
            steps += 1;
        }
        assert!(steps <= 5, "{steps} steps to {lambda}");
        let mut plain = 1.0;
        (0..5).for_each(|_| plain = control.next(plain, chi2(plain), 1e-3));
        assert!(!control.met(chi2(plain)), "the rule alone is as good: {plain}");
    }

    #[test]
    fn it_rises_falls_and_rests() {
        let c = Control::Target { target: 1.0, tolerance: 0.01 };
        assert_eq!(c.next(2.0, 100.0, 0.1), 8.0);
        assert_eq!(c.next(2.0, 100.0, 0.9), 2.0, "an image that has not followed");
        assert!((c.next(2.0, 1.5, 0.4) - 3.0).abs() < 1e-12);
        assert!(c.next(2.0, 0.5, 0.1) < 2.0);
        assert_eq!(c.next(2.0, 1.001, 0.01), 2.0);
        assert!(c.met(1.009) && !c.met(1.02) && !c.met(0.98));
        assert_eq!(Control::Fixed.next(2.0, 100.0, 0.0), 2.0);
        assert!(Control::Fixed.met(100.0));
    }
}
