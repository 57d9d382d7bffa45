//! Intervals of time over which gains are constant and closure quantities are averaged.

use crate::values::{bad_value, by_text};
use crate::{ChainError, Result, ensure};
use cittert_arrays::quantity::Duration;
use std::fmt;
use std::str::FromStr;

const DAY_S: f64 = 86_400.0;

/// How long one solution holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SolutionInterval {
    /// The whole set.
    Infinite,
    /// Each integration for itself.
    Integration,
    /// So many seconds from the start of the first integration.
    Seconds(f64),
}

by_text!(SolutionInterval, "string", "A time such as \"60s\", int (each integration) or inf (the whole set).");

impl fmt::Display for SolutionInterval {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Infinite => f.write_str("inf"),
            Self::Integration => f.write_str("int"),
            Self::Seconds(s) => Duration(*s).fmt(f),
        }
    }
}

impl FromStr for SolutionInterval {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "inf" => Ok(Self::Infinite),
            "int" => Ok(Self::Integration),
            _ => text.parse::<Duration>().map(|t| Self::Seconds(t.si())).map_err(|e| format!("{e}; or int, or inf")),
        }
    }
}

/// Numbers the time intervals. The first integration that is given to [`Self::key`] is the start of interval 0.
#[derive(Debug, Clone)]
pub(crate) struct TimeBins {
    solint: SolutionInterval,
    start_jd: Option<f64>,
}

impl TimeBins {
    pub(crate) fn new(solint: SolutionInterval) -> Self {
        Self { solint, start_jd: None }
    }

    /// Number of the interval of an integration; numbers grow with time and may be negative.
    ///
    /// # Errors
    /// A time that is not finite, an interval shorter than the integration.
    pub(crate) fn key(&mut self, time_jd: f64, integration_s: f64) -> Result<i64> {
        ensure!(time_jd.is_finite(), ChainError::NoData(format!("a row has the time {time_jd}: repair or remove it before calibrating")));
        let span = if integration_s.is_finite() { integration_s.max(0.0) } else { 0.0 };
        match self.solint {
            SolutionInterval::Infinite => Ok(0),
            SolutionInterval::Integration => {
                let start = *self.start_jd.get_or_insert(time_jd);
                // A Julian date resolves about 0.04 ms.
                Ok(((time_jd - start) * DAY_S * 1e3).round() as i64)
            }
            SolutionInterval::Seconds(s) => {
                if s < span * 0.999 {
                    return bad_value("solint", format!("{s} s"), format!("at least one integration, {span} s"));
                }
                let start = *self.start_jd.get_or_insert(time_jd - span / 2.0 / DAY_S);
                Ok(((time_jd - start) * DAY_S / s + 1e-6).floor() as i64)
            }
        }
    }
}

/// The time that the data of an interval span.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TimeSpan {
    first_jd: f64,
    last_jd: f64,
}

impl TimeSpan {
    pub(crate) fn empty() -> Self {
        Self { first_jd: f64::INFINITY, last_jd: f64::NEG_INFINITY }
    }

    /// From the first to the last time, Julian dates.
    pub(crate) fn of(first_jd: f64, last_jd: f64) -> Self {
        Self { first_jd, last_jd }
    }

    /// First and last time, Julian dates.
    pub(crate) fn ends_jd(&self) -> [f64; 2] {
        [self.first_jd, self.last_jd]
    }

    /// Make it span the times of another one too.
    pub(crate) fn unite(&mut self, other: Self) {
        self.first_jd = self.first_jd.min(other.first_jd);
        self.last_jd = self.last_jd.max(other.last_jd);
    }

    pub(crate) fn add(&mut self, time_jd: f64, integration_s: f64) {
        let half = if integration_s.is_finite() { integration_s.max(0.0) / 2.0 / DAY_S } else { 0.0 };
        self.first_jd = self.first_jd.min(time_jd - half);
        self.last_jd = self.last_jd.max(time_jd + half);
    }

    /// Middle, Julian date.
    pub(crate) fn middle_jd(&self) -> f64 {
        self.first_jd + (self.last_jd - self.first_jd) / 2.0
    }

    /// Length, s.
    pub(crate) fn length_s(&self) -> f64 {
        (self.last_jd - self.first_jd) * DAY_S
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrations_fall_into_their_interval() {
        let mut bins = TimeBins::new(SolutionInterval::Seconds(60.0));
        let t0 = 2_460_000.25;
        let keys: Vec<i64> = (0..18).map(|i| bins.key(t0 + f64::from(i) * 10.0 / DAY_S, 10.0).unwrap()).collect();
        assert_eq!(keys, [[0; 6], [1; 6], [2; 6]].concat());
        assert_eq!(bins.key(t0 - 10.0 / DAY_S, 10.0).unwrap(), -1);
    }

    #[test]
    fn an_interval_shorter_than_an_integration_is_refused() {
        let e = TimeBins::new(SolutionInterval::Seconds(1.0)).key(2_460_000.0, 10.0).unwrap_err().to_string();
        assert!(e.contains("solint") && e.contains("10 s"), "{e}");
    }
}
