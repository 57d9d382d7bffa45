//! The pattern of an element: one of the kinds, or none.

use super::airy::Airy;
use super::cos_power::CosPower;
use super::gaussian::Gaussian;
use super::sampled::SampledPattern;
use super::shape::{Shape, Toward};
use crate::Result;
use std::sync::Arc;

/// Power pattern, 1 along the boresight.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum ElementPattern {
    /// 1 everywhere in front of the array.
    #[default]
    None,
    /// A Gaussian of the angle.
    Gaussian(Gaussian),
    /// A uniformly lit circular aperture.
    Airy(Airy),
    /// A power of the cosine.
    CosPower(CosPower),
    /// A table.
    Sampled(Arc<SampledPattern>),
}

impl ElementPattern {
    fn shape(&self) -> Option<&dyn Shape> {
        Some(match self {
            Self::None => return None,
            Self::Gaussian(g) => g,
            Self::Airy(a) => a,
            Self::CosPower(c) => c,
            Self::Sampled(s) => s.as_ref(),
        })
    }

    /// True if the power is 1 everywhere.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::None
    }

    /// Check the parameters.
    ///
    /// # Errors
    /// A width, a diameter or a frequency is not positive, the exponent is negative, the blockage is not below 1.
    pub fn check(&self) -> Result<()> {
        self.shape().map_or(Ok(()), Shape::check)
    }

    /// Check that the pattern is known from the lowest to the highest frequency of a band, Hz.
    ///
    /// # Errors
    /// A table that ends within the band.
    pub fn check_band(&self, range_hz: (f64, f64)) -> Result<()> {
        self.shape().map_or(Ok(()), |s| s.check_band(range_hz))
    }

    /// True if the pattern differs from channel to channel.
    #[must_use]
    pub fn varies_with_frequency(&self) -> bool {
        self.shape().is_some_and(Shape::varies_with_frequency)
    }

    /// Power response at direction cosines (l, m) and a frequency in Hz; 0 behind the horizon.
    #[must_use]
    pub fn power(&self, l: f64, m: f64, freq_hz: f64) -> f64 {
        let sin_theta = l.hypot(m);
        if sin_theta > 1.0 { 0.0 } else { self.shape().map_or(1.0, |s| s.power(Toward { l, m, sin_theta }, freq_hz)) }
    }

    /// Voltage response at direction cosines (l, m) and a frequency in Hz; 0 behind the horizon. Its square is the power. That of an airy
    /// element changes its sign from lobe to lobe; the other kinds know the power alone, and their voltage is its root.
    #[must_use]
    pub fn voltage(&self, l: f64, m: f64, freq_hz: f64) -> f64 {
        let sin_theta = l.hypot(m);
        if sin_theta > 1.0 { 0.0 } else { self.shape().map_or(1.0, |s| s.voltage(Toward { l, m, sin_theta }, freq_hz)) }
    }

    /// The same pattern, wider by a factor: a Gaussian or a table in its angles, an airy element by a smaller aperture, cos^n by a smaller n.
    #[must_use]
    pub fn widened(&self, factor: f64) -> Self {
        match self {
            Self::None => Self::None,
            Self::Gaussian(g) => Self::Gaussian(g.widened(factor)),
            Self::Airy(a) => Self::Airy(a.widened(factor)),
            Self::CosPower(c) => Self::CosPower(c.widened(factor)),
            Self::Sampled(s) => Self::Sampled(Arc::new(s.widened(factor))),
        }
    }

    /// Solid angle of the pattern, sr: the integral of the power over the half space. `None` for an element without a pattern.
    #[must_use]
    pub fn solid_angle_sr(&self, freq_hz: f64) -> Option<f64> {
        self.shape().map(|s| s.solid_angle_sr(freq_hz))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_have_their_known_widths() {
        let gauss = ElementPattern::Gaussian(Gaussian { fwhm_rad: 0.02, ref_freq_hz: Some(1e9) });
        assert!((gauss.power(0.01_f64.sin(), 0.0, 1e9) - 0.5).abs() < 1e-12);
        assert!((gauss.power(0.0, 0.005_f64.sin(), 2e9) - 0.5).abs() < 1e-12, "half as wide at twice the frequency");
        // First null at 1.2197 lambda / D, half power at 0.5145 lambda / D.
        let airy = ElementPattern::Airy(Airy { diameter_m: 25.0, blockage: 0.0 });
        let lambda_d = 299_792_458.0 / 1.4e9 / 25.0;
        assert!(airy.power(1.219_669_9 * lambda_d, 0.0, 1.4e9) < 1e-12);
        assert!((airy.power(0.514_497 * lambda_d, 0.0, 1.4e9) - 0.5).abs() < 1e-5);
        assert!((airy.power(1e-12, 0.0, 1.4e9) - 1.0).abs() < 1e-15);
        let side_lobe = 1.635 * lambda_d;
        assert!(airy.voltage(side_lobe, 0.0, 1.4e9) < -0.1 && gauss.voltage(0.01, 0.0, 1e9) > 0.0);
        assert_eq!(airy.voltage(side_lobe, 0.0, 1.4e9).powi(2), airy.power(side_lobe, 0.0, 1.4e9));
        assert!((ElementPattern::CosPower(CosPower { exponent: 2.0 }).power(0.6, 0.0, 1e9) - 0.64).abs() < 1e-15);
        assert_eq!(ElementPattern::None.power(0.8, 0.8, 1e9), 0.0);
    }
}
