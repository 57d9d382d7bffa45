//! A question to a study: up to which value of a parameter is a score kept?

use super::score::{Quality, Score};
use crate::Result;
use crate::values::need;

/// What a trial must reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bound {
    /// The score.
    pub score: Score,
    /// Its limit.
    pub limit: f64,
    /// True if the score must be at least the limit, false if it must be at most that.
    pub at_least: bool,
}

impl Bound {
    /// True if a trial reaches it. A score that is not a number does not.
    #[must_use]
    pub fn kept(&self, quality: &Quality) -> bool {
        let value = quality.of(self.score);
        if self.at_least { value >= self.limit } else { value <= self.limit }
    }
}

/// The question.
#[derive(Debug, Clone, PartialEq)]
pub struct Question {
    /// What must be kept.
    pub bound: Bound,
    /// First value of the parameter.
    pub from: f64,
    /// Last value of the parameter.
    pub to: f64,
    /// The parameter takes only integers.
    pub whole: bool,
    /// Values are halved in their logarithms.
    pub log: bool,
    /// Fraction of the trials that must keep the score.
    pub fraction: f64,
    /// Half the width of the 68 % limits that is wanted, over the answer.
    pub precision: f64,
}

impl Question {
    /// Check every number.
    ///
    /// # Errors
    /// The first that is out of its range.
    pub fn check(&self) -> Result<()> {
        let ordered = self.from.is_finite() && self.to.is_finite() && self.from < self.to;
        need("from and to", format!("{} and {}", self.from, self.to), ordered, "finite numbers, from smaller than to")?;
        need("start of the range", self.from, !self.log || self.from > 0.0, "a positive number where log is true")?;
        need("limit of the score", self.bound.limit, self.bound.limit.is_finite(), "a finite number")?;
        need("fraction of the trials", self.fraction, self.fraction > 0.0 && self.fraction < 1.0, "a number between 0 and 1")?;
        need("precision of the answer", self.precision, (1e-3..=1.0).contains(&self.precision), "0.001 to 1")
    }

    /// A value on the scale on which intervals are halved.
    pub(super) fn scale(&self, value: f64) -> f64 {
        if self.log { value.ln() } else { value }
    }

    /// The value between two others at which to look next; `None` if they are too close for one. It has four digits, so that it can be
    /// written and read again.
    pub(super) fn between(&self, low: f64, high: f64) -> Option<f64> {
        let middle = if self.log { (low * high).sqrt() } else { 0.5 * (low + high) };
        let value = if self.whole { middle.round() } else { format!("{middle:.3e}").parse().unwrap_or(middle) };
        (value > low && value < high).then_some(value)
    }

    /// True if an interval is too wide for the precision.
    pub(super) fn too_wide(&self, low: f64, high: f64) -> bool {
        // A third of the precision hardly adds to the scatter of the seeds. An answer near 0 is known to a thousandth of the range.
        let narrow = (self.precision / 3.0 * low.abs().max(high.abs())).max(1e-3 * (self.to - self.from) * f64::from(u8::from(!self.log)));
        high - low > narrow
    }
}
