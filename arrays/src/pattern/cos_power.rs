//! A power of the cosine of the angle from the boresight: a model of small horns and patches.

use super::shape::{Shape, Toward};
use crate::{ArrayError, Result};
use std::f64::consts::PI;

/// cos(theta)^exponent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CosPower {
    /// Exponent of the power pattern.
    pub exponent: f64,
}

impl CosPower {
    /// Near the axis cos^n is a Gaussian whose width falls with the square root of n.
    pub(super) fn widened(&self, factor: f64) -> Self {
        Self { exponent: self.exponent / (factor * factor) }
    }
}

impl Shape for CosPower {
    fn check(&self) -> Result<()> {
        let good = (0.0..=1e9).contains(&self.exponent);
        ArrayError::unless(good, "exponent of the element pattern", self.exponent, "a finite number of at least 0")
    }

    fn power(&self, toward: Toward, _freq_hz: f64) -> f64 {
        (1.0 - toward.sin_theta * toward.sin_theta).max(0.0).powf(self.exponent / 2.0)
    }

    fn solid_angle_sr(&self, _freq_hz: f64) -> f64 {
        2.0 * PI / (self.exponent + 1.0)
    }

    fn varies_with_frequency(&self) -> bool {
        false
    }
}
