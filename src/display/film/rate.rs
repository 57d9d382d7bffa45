//! Frames per second as a fraction, which is how files of films hold the time of a frame.

use crate::Result;
use crate::values::need;

/// Frames per second: the nearest fraction of two numbers of 16 bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameRate {
    frames: u16,
    seconds: u16,
}

impl FrameRate {
    /// The nearest fraction to a number of frames per second.
    ///
    /// # Errors
    /// A number that is not from 0.001 to 1000.
    pub fn new(hz: f64) -> Result<Self> {
        need("rate", hz, (1e-3..=1e3).contains(&hz), "0.001 to 1000 frames per second")?;
        // The denominators are small first, so that 25 is 25/1.
        let error = |seconds: u16| ((hz * f64::from(seconds)).round() / f64::from(seconds) - hz).abs();
        let fits = |seconds: &u16| (0.5..65_535.5).contains(&(hz * f64::from(*seconds)));
        let seconds = (1..=u16::MAX).filter(fits).min_by(|a, b| error(*a).total_cmp(&error(*b)));
        let seconds = seconds.unwrap_or(1);
        Ok(Self { frames: (hz * f64::from(seconds)).round().max(1.0) as u16, seconds })
    }

    /// Numerator and denominator of the frames per second.
    #[must_use]
    pub fn fraction(self) -> (u16, u16) {
        (self.frames, self.seconds)
    }

    /// Frames per second.
    #[must_use]
    pub fn hz(self) -> f64 {
        f64::from(self.frames) / f64::from(self.seconds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_rates_are_whole_and_others_the_nearest_fraction() {
        let of = |hz: f64| FrameRate::new(hz).unwrap().fraction();
        assert_eq!((of(25.0), of(1.0), of(0.5), of(12.5)), ((25, 1), (1, 1), (1, 2), (25, 2)));
        assert_eq!(of(30_000.0 / 1001.0), (30_000, 1001));
        for hz in [0.001, 0.0317, 1.0 / 3.0, 7.77, 99.99, 1000.0] {
            assert!((FrameRate::new(hz).unwrap().hz() / hz - 1.0).abs() < 1e-4, "{hz}");
        }
        for hz in [0.0, -1.0, f64::NAN, f64::INFINITY, 1001.0] {
            assert!(FrameRate::new(hz).unwrap_err().to_string().contains("0.001 to 1000"), "{hz}");
        }
    }
}
