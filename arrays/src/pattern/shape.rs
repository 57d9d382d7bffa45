//! What every kind of pattern answers.

use crate::Result;

/// A direction in front of the array, by its direction cosines.
#[derive(Debug, Clone, Copy)]
pub(super) struct Toward {
    pub(super) l: f64,
    pub(super) m: f64,
    /// Sine of the angle from the boresight.
    pub(super) sin_theta: f64,
}

/// What every kind of pattern answers.
pub(super) trait Shape {
    /// Check the numbers.
    fn check(&self) -> Result<()>;

    /// Power relative to the boresight.
    fn power(&self, toward: Toward, freq_hz: f64) -> f64;

    /// Voltage relative to the boresight, whose square is the power. It changes its sign from lobe to lobe where the kind knows the sign.
    fn voltage(&self, toward: Toward, freq_hz: f64) -> f64 {
        self.power(toward, freq_hz).sqrt()
    }

    /// Integral of the power over the half space in front of the array, sr.
    fn solid_angle_sr(&self, freq_hz: f64) -> f64;

    /// True if the pattern differs from channel to channel.
    fn varies_with_frequency(&self) -> bool;

    /// Check that the pattern is known at these frequencies, Hz.
    fn check_band(&self, _range_hz: (f64, f64)) -> Result<()> {
        Ok(())
    }
}
