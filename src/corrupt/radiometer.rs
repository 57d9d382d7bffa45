//! Water vapour radiometers, which measure the wet path of each antenna.

use super::context::Context;
use super::corruption::need_size;
use crate::Result;
use crate::values::need;
use rand_distr::{Distribution, StandardNormal};
use serde::Serialize;

/// A radiometer at each antenna measures the mean of the wet path along the line of sight over a time, and the correlator subtracts it. What is
/// left is the change of the path within that time, and the error of the measurement: a length that is the same at all frequencies, drawn anew
/// for each antenna and each measurement. An integration that holds n measurements has an error smaller by the square root of n.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Radiometer {
    /// Rms error of one measurement of the path, m.
    pub rms_m: f64,
    /// Time of one measurement, s.
    pub averaging_s: f64,
}

impl Radiometer {
    pub(super) fn check(&self) -> Result<()> {
        need_size("rms error of the radiometers in m", self.rms_m)?;
        let averaging = self.averaging_s;
        need("averaging time of the radiometers in s", averaging, averaging.is_finite() && averaging > 0.0, "a time above 0")
    }

    /// Number of the measurement at a time.
    fn number(&self, seconds: f64) -> f64 {
        (seconds / self.averaging_s).round()
    }

    /// Middle of the measurement at a time, s.
    pub(super) fn middle_s(&self, seconds: f64) -> f64 {
        self.number(seconds) * self.averaging_s
    }

    /// Error of an antenna in an integration, m.
    pub(super) fn error_m(&self, context: &Context<'_>, time: usize, ant: usize) -> f64 {
        let n_ant = context.header.layout.n_ant() as u64;
        let number = self.number(context.seconds[time]) as u64;
        // The first stream is that of the screen.
        let x: f64 = StandardNormal.sample(&mut context.rng(1 + ant as u64 + n_ant * number));
        let measurements = (context.length_s[time] / self.averaging_s).max(1.0);
        self.rms_m * x / measurements.sqrt()
    }
}
