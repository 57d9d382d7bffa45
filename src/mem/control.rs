//! How the Lagrange multiplier of chi squared is found: raised while the data are not yet explained, trimmed once they are.
//!
//! The image starts at the prior, which explains nothing, with a multiplier so small that one step fits. Each step may raise it by a
//! factor, as soon as the image has followed the last one half way: an image that is far from its optimum is not worth polishing.
//! Near the target the multiplier moves with chi squared itself, and only when the image has settled.

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

#[cfg(test)]
mod tests {
    use super::*;

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
