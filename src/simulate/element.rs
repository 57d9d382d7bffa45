//! The power pattern of an antenna or a receiving element. All elements have the same pattern.

use crate::values::need;
use crate::{ChainError, Result};
use cittert_arrays::{ArrayLayout, SPEED_OF_LIGHT_M_S};
use serde::{Deserialize, Serialize};

/// Power pattern with its peak of 1 along the boresight.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub enum ElementPattern {
    /// 1 everywhere in front of the array.
    #[default]
    None,
    /// exp(-4 ln 2 theta^2 / fwhm^2).
    Gaussian {
        /// Full width at half maximum of the power, rad.
        fwhm_rad: f64,
        /// Frequency at which the width holds, Hz: it then scales with the wavelength. `None`: the same width at all frequencies.
        ref_freq_hz: Option<f64>,
    },
    /// A uniformly lit circular aperture: (2 J1(x) / x)^2 with x = pi D sin(theta) / lambda.
    Airy {
        /// Diameter, m.
        diameter_m: f64,
    },
    /// cos(theta)^exponent.
    CosPower {
        /// Exponent of the power pattern.
        exponent: f64,
    },
}

impl ElementPattern {
    /// An Airy pattern for the diameter that all antennas of a layout share.
    ///
    /// # Errors
    /// The layout has no diameters, or different ones.
    pub fn airy_of(layout: &ArrayLayout) -> Result<Self> {
        let Some(diameter_m) = layout.antennas().first().and_then(|a| a.diameter_m) else {
            return Err(ChainError::Incompatible(format!("layout {:?} gives no antenna diameter: state one", layout.name)));
        };
        if let Some(other) = layout.antennas().iter().find(|a| a.diameter_m != Some(diameter_m)) {
            return Err(ChainError::Incompatible(format!(
                "antennas of layout {:?} have different diameters ({diameter_m} m, and {} for {:?}): state one diameter for the pattern",
                layout.name,
                other.diameter_m.map_or("none".to_owned(), |d| format!("{d} m")),
                other.name
            )));
        }
        Ok(Self::Airy { diameter_m })
    }

    /// Check the parameters.
    ///
    /// # Errors
    /// A width or a diameter is not positive, or the exponent is negative.
    pub fn check(&self) -> Result<()> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        let (option, value, good) = match *self {
            Self::None => return Ok(()),
            Self::Gaussian { fwhm_rad, ref_freq_hz } => {
                let freq = ref_freq_hz.unwrap_or(1.0);
                need("reference frequency of the element pattern", freq, positive(freq), "a positive frequency")?;
                ("width of the element pattern", fwhm_rad, positive(fwhm_rad))
            }
            Self::Airy { diameter_m } => ("diameter of the element pattern", diameter_m, positive(diameter_m)),
            Self::CosPower { exponent } => ("exponent of the element pattern", exponent, (0.0..=1e9).contains(&exponent)),
        };
        need(option, value, good, "a positive, finite number")
    }

    /// True if the pattern differs from channel to channel.
    #[must_use]
    pub fn varies_with_frequency(&self) -> bool {
        matches!(self, Self::Airy { .. } | Self::Gaussian { ref_freq_hz: Some(_), .. })
    }

    /// Power response at direction cosines (l, m) and a frequency; 0 behind the horizon.
    ///
    /// # Reference
    /// Thompson, Moran & Swenson 2017, eq. 17.4 for the circular aperture.
    #[must_use]
    pub fn power(&self, l: f64, m: f64, freq_hz: f64) -> f64 {
        let sin_theta = l.hypot(m);
        if sin_theta > 1.0 {
            return 0.0;
        }
        match *self {
            Self::None => 1.0,
            Self::Gaussian { fwhm_rad, ref_freq_hz } => {
                let fwhm = ref_freq_hz.map_or(fwhm_rad, |f| fwhm_rad * f / freq_hz);
                (-4.0 * std::f64::consts::LN_2 * (sin_theta.asin() / fwhm).powi(2)).exp()
            }
            Self::Airy { diameter_m } => {
                let x = std::f64::consts::PI * diameter_m * sin_theta * freq_hz / SPEED_OF_LIGHT_M_S;
                // Near the axis the quotient loses digits. The series is accurate to 1e-17 there.
                if x < 1e-4 { (1.0 - x * x / 8.0).powi(2) } else { (2.0 * libm::j1(x) / x).powi(2) }
            }
            Self::CosPower { exponent } => (1.0 - sin_theta * sin_theta).max(0.0).powf(exponent / 2.0),
        }
    }

    /// Solid angle of the pattern, sr: the integral of the power over the sphere. `None` for an element without a pattern.
    #[must_use]
    pub fn solid_angle_sr(&self, freq_hz: f64) -> Option<f64> {
        use std::f64::consts::{FRAC_PI_2, PI};
        match *self {
            Self::None => None,
            Self::CosPower { exponent } => Some(2.0 * PI / (exponent + 1.0)),
            // The product of effective area and solid angle is the square of the wavelength.
            Self::Airy { diameter_m } => Some((SPEED_OF_LIGHT_M_S / freq_hz).powi(2) / (PI * diameter_m * diameter_m / 4.0)),
            Self::Gaussian { fwhm_rad, ref_freq_hz } => {
                let fwhm = ref_freq_hz.map_or(fwhm_rad, |f| fwhm_rad * f / freq_hz);
                // Simpson's rule, out to an angle where the pattern is below 1e-19.
                let end = (4.0 * fwhm).min(FRAC_PI_2);
                let steps = 2000;
                let h = end / f64::from(steps);
                let sum: f64 = (0..=steps)
                    .map(|k| {
                        let theta = h * f64::from(k);
                        let weight = if k == 0 || k == steps { 1.0 } else { 2.0 + 2.0 * f64::from(k % 2) };
                        weight * theta.sin() * (-4.0 * std::f64::consts::LN_2 * (theta / fwhm).powi(2)).exp()
                    })
                    .sum();
                Some(2.0 * PI * h / 3.0 * sum)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use cittert_arrays::{Antenna, LayoutFrame};

    #[test]
    fn patterns_have_their_known_widths() {
        let gauss = ElementPattern::Gaussian { fwhm_rad: 0.02, ref_freq_hz: Some(1e9) };
        assert!((gauss.power(0.01_f64.sin(), 0.0, 1e9) - 0.5).abs() < 1e-12);
        assert!((gauss.power(0.0, 0.005_f64.sin(), 2e9) - 0.5).abs() < 1e-12, "half as wide at twice the frequency");
        // First null at 1.2197 lambda / D, half power at 0.5145 lambda / D.
        let airy = ElementPattern::Airy { diameter_m: 25.0 };
        let lambda_d = 299_792_458.0 / 1.4e9 / 25.0;
        assert!(airy.power(1.219_669_9 * lambda_d, 0.0, 1.4e9) < 1e-12);
        assert!((airy.power(0.514_497 * lambda_d, 0.0, 1.4e9) - 0.5).abs() < 1e-5);
        assert!((airy.power(1e-12, 0.0, 1.4e9) - 1.0).abs() < 1e-15);
        assert!((ElementPattern::CosPower { exponent: 2.0 }.power(0.6, 0.0, 1e9) - 0.64).abs() < 1e-15);
        assert_eq!(ElementPattern::None.power(0.8, 0.8, 1e9), 0.0);
    }

    #[test]
    fn solid_angles_agree_with_their_formulas() {
        let narrow = ElementPattern::Gaussian { fwhm_rad: 1e-3, ref_freq_hz: None }.solid_angle_sr(1e9).unwrap();
        assert!((narrow / (std::f64::consts::PI * 1e-6 / (4.0 * std::f64::consts::LN_2)) - 1.0).abs() < 1e-6);
        // The Airy pattern of a large aperture, integrated over the hemisphere, is lambda^2 / A.
        let airy = ElementPattern::Airy { diameter_m: 40.0 * 0.299_792_458 };
        let (steps, mut sum) = (200_000, 0.0);
        for k in 0..steps {
            let theta = (f64::from(k) + 0.5) / f64::from(steps) * std::f64::consts::FRAC_PI_2;
            sum += airy.power(theta.sin(), 0.0, 1e9) * theta.sin() * std::f64::consts::FRAC_PI_2 / f64::from(steps);
        }
        let ratio = sum * std::f64::consts::TAU / airy.solid_angle_sr(1e9).unwrap();
        assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
    }

    #[test]
    fn different_diameters_are_refused() {
        let mut antennas: Vec<Antenna> = (0..3_u32).map(|k| Antenna::new(format!("A{k}"), k, [f64::from(k), 0.0, 0.0])).collect();
        let of = |antennas: &[Antenna]| {
            let layout = ArrayLayout::new("t", LayoutFrame::Boresight, antennas.to_vec()).unwrap();
            ElementPattern::airy_of(&layout)
        };
        assert!(of(&antennas).is_err());
        antennas.iter_mut().for_each(|a| a.diameter_m = Some(2.0));
        assert_eq!(of(&antennas).unwrap(), ElementPattern::Airy { diameter_m: 2.0 });
        antennas[2].diameter_m = Some(3.0);
        assert!(of(&antennas).unwrap_err().to_string().contains("A2"));
    }
}
