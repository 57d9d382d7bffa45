//! Gaussian slopes of a rough surface. They may differ along and across an axis.

use super::error::{SurfaceError, bounded};

/// Largest rms slope for which geometric optics is valid here.
const MAX_SLOPE: f64 = 1.0;

/// Rms slopes along two principal axes; azimuths count from the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slopes {
    /// Rms slope along the first axis (upwind).
    pub along: f64,
    /// Rms slope across it.
    pub across: f64,
}

impl Slopes {
    /// Checked slopes.
    ///
    /// # Errors
    /// [`SurfaceError::Value`] unless both lie above 0 and at most 1.
    pub fn new(along: f64, across: f64) -> Result<Self, SurfaceError> {
        let least = 1e-6;
        Ok(Self {
            along: bounded("rms slope along", along, least, MAX_SLOPE)?,
            across: bounded("rms slope across", across, least, MAX_SLOPE)?,
        })
    }

    /// The same rms slope in every direction.
    ///
    /// # Errors
    /// As [`Slopes::new`].
    pub fn isotropic(slope: f64) -> Result<Self, SurfaceError> {
        Self::new(slope, slope)
    }

    /// Slopes of a clean sea under wind, from its speed at 12.5 m in m/s; the first axis points
    /// along the wind.
    ///
    /// # Errors
    /// [`SurfaceError::Value`] for winds outside 0.01 to 60 m/s.
    ///
    /// # Reference
    /// Cox & Munk 1954, J. Opt. Soc. Am. 44, 838: `su^2 = 0.00316 U`, `sc^2 = 0.003 + 0.00192 U`.
    pub fn cox_munk54(wind_m_s: f64) -> Result<Self, SurfaceError> {
        let u = bounded("wind speed in m/s", wind_m_s, 0.01, 60.0)?;
        Self::new((0.003_16 * u).sqrt(), (0.003 + 0.001_92 * u).sqrt())
    }

    /// Whether both slopes are equal.
    #[must_use]
    pub fn is_isotropic(&self) -> bool {
        self.along == self.across
    }

    /// Slope variance along a horizontal direction `(x, y)`, not necessarily of unit length,
    /// times the square of that length.
    #[must_use]
    pub(super) fn variance(&self, x: f64, y: f64) -> f64 {
        (self.along * x).powi(2) + (self.across * y).powi(2)
    }

    /// Statistics along an azimuth: variance along, variance across, covariance.
    #[must_use]
    pub(super) fn in_frame(&self, cos_azimuth: f64, sin_azimuth: f64) -> SlopeFrame {
        let (c, s) = (cos_azimuth, sin_azimuth);
        let (u2, c2) = (self.along.powi(2), self.across.powi(2));
        let variance_a = u2 * c * c + c2 * s * s;
        let covariance = if self.is_isotropic() { 0.0 } else { (c2 - u2) * s * c };
        SlopeFrame { sigma_a: variance_a.sqrt(), covariance, area: self.along * self.across }
    }
}

/// Slope statistics in a frame turned to some azimuth: `a` along it, `b` across.
#[derive(Debug, Clone, Copy)]
pub(super) struct SlopeFrame {
    /// Standard deviation along.
    pub sigma_a: f64,
    /// Covariance.
    pub covariance: f64,
    /// Square root of the determinant, the same in every frame.
    pub area: f64,
}

impl SlopeFrame {
    /// Mean and standard deviation of `b` given `a`.
    pub(super) fn b_given_a(&self, a: f64) -> (f64, f64) {
        let mean = a * self.covariance / (self.sigma_a * self.sigma_a);
        (mean, self.area / self.sigma_a)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_keep_the_determinant_and_the_trace() {
        let slopes = Slopes::new(0.3, 0.1).unwrap();
        for degrees in [0.0f64, 20.0, 45.0, 90.0, 135.0] {
            let (s, c) = degrees.to_radians().sin_cos();
            let f = slopes.in_frame(c, s);
            let across = slopes.in_frame(-s, c);
            let trace = f.sigma_a.powi(2) + across.sigma_a.powi(2);
            let det = (f.sigma_a * across.sigma_a).powi(2) - f.covariance.powi(2);
            assert!((trace - 0.1).abs() < 1e-15 && (det - f.area * f.area).abs() < 1e-15);
            assert!((f.sigma_a.powi(2) - slopes.variance(c, s)).abs() < 1e-15);
        }
    }

    #[test]
    fn bad_slopes_are_refused() {
        for s in [0.0, -0.1, 2.0, f64::NAN] {
            assert!(Slopes::new(s, 0.1).is_err() && Slopes::new(0.1, s).is_err());
        }
        assert!(Slopes::cox_munk54(-3.0).is_err());
        let sea = Slopes::cox_munk54(10.0).unwrap();
        assert!((sea.along.powi(2) - 0.0316).abs() < 1e-15);
        assert!((sea.across.powi(2) - 0.0222).abs() < 1e-15);
    }
}
