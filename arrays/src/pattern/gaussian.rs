//! A Gaussian of the angle from the boresight.

use super::shape::{Shape, Toward};
use crate::{ArrayError, Result};
use std::f64::consts::{FRAC_PI_2, LN_2, PI};

/// exp(-4 ln 2 theta^2 / fwhm^2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gaussian {
    /// Full width at half maximum of the power, rad.
    pub fwhm_rad: f64,
    /// Frequency at which the width holds, Hz: it then scales with the wavelength. `None`: the same width at all frequencies.
    pub ref_freq_hz: Option<f64>,
}

impl Gaussian {
    /// Wider by a factor.
    pub(super) fn widened(&self, factor: f64) -> Self {
        Self { fwhm_rad: self.fwhm_rad * factor, ..*self }
    }

    fn fwhm_rad(&self, freq_hz: f64) -> f64 {
        self.ref_freq_hz.map_or(self.fwhm_rad, |f| self.fwhm_rad * f / freq_hz)
    }
}

impl Shape for Gaussian {
    fn check(&self) -> Result<()> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        ArrayError::unless(positive(self.fwhm_rad), "width of the element pattern", self.fwhm_rad, "a positive angle")?;
        let freq = self.ref_freq_hz.unwrap_or(1.0);
        ArrayError::unless(positive(freq), "reference frequency of the element pattern", freq, "a positive frequency")
    }

    fn power(&self, toward: Toward, freq_hz: f64) -> f64 {
        (-4.0 * LN_2 * (toward.sin_theta.asin() / self.fwhm_rad(freq_hz)).powi(2)).exp()
    }

    fn solid_angle_sr(&self, freq_hz: f64) -> f64 {
        let fwhm = self.fwhm_rad(freq_hz);
        // Simpson's rule, out to an angle where the pattern is below 1e-19.
        let end = (4.0 * fwhm).min(FRAC_PI_2);
        let steps = 2000;
        let h = end / f64::from(steps);
        let sum: f64 = (0..=steps)
            .map(|k| {
                let theta = h * f64::from(k);
                let weight = if k == 0 || k == steps { 1.0 } else { 2.0 + 2.0 * f64::from(k % 2) };
                weight * theta.sin() * (-4.0 * LN_2 * (theta / fwhm).powi(2)).exp()
            })
            .sum();
        2.0 * PI * h / 3.0 * sum
    }

    fn varies_with_frequency(&self) -> bool {
        self.ref_freq_hz.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_solid_angle_of_a_narrow_beam_is_that_of_a_plane_gaussian() {
        let narrow = Gaussian { fwhm_rad: 1e-3, ref_freq_hz: None }.solid_angle_sr(1e9);
        assert!((narrow / (PI * 1e-6 / (4.0 * LN_2)) - 1.0).abs() < 1e-6);
    }
}
