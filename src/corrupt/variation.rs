//! How an error of an antenna changes in time.

use crate::Result;
use crate::values::{by_text, need};
use cittert_arrays::quantity::Duration;
use rand::{Rng, RngExt};
use rand_distr::{Distribution, StandardNormal};
use std::fmt;
use std::str::FromStr;

/// Behaviour in time of a quantity of zero mean and unit variance.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Variation {
    /// One draw for the whole set.
    #[default]
    Constant,
    /// A new draw for each integration.
    Integration,
    /// A new draw for each interval of this length, s.
    Interval {
        /// Length, s.
        length_s: f64,
    },
    /// Brownian motion that starts at 0; the unit variance is reached after this time.
    RandomWalk {
        /// Time, s.
        time_s: f64,
    },
    /// Constant between jumps, with a new random value after each jump. The jumps are a Poisson process with this mean interval.
    Jumps {
        /// Mean time between jumps, s.
        mean_s: f64,
    },
    /// A stationary Gaussian process whose correlation falls as exp(-|dt| / time).
    ///
    /// # Reference
    /// Uhlenbeck & Ornstein 1930, Phys. Rev. 36, 823.
    Coherent {
        /// Coherence time, s.
        time_s: f64,
    },
}

by_text!(Variation, "string", "constant, integration, interval:TIME, walk:TIME, jumps:TIME or coherent:TIME, such as \"walk:60s\".");

impl fmt::Display for Variation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Constant => f.write_str("constant"),
            Self::Integration => f.write_str("integration"),
            Self::Interval { length_s } => write!(f, "interval:{}", Duration(length_s)),
            Self::RandomWalk { time_s } => write!(f, "walk:{}", Duration(time_s)),
            Self::Jumps { mean_s } => write!(f, "jumps:{}", Duration(mean_s)),
            Self::Coherent { time_s } => write!(f, "coherent:{}", Duration(time_s)),
        }
    }
}

impl FromStr for Variation {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let (kind, time) = text.split_once(':').map_or((text, None), |(k, t)| (k, Some(t)));
        let seconds = || -> std::result::Result<f64, String> {
            let time = time.ok_or_else(|| format!("{kind} needs a time, such as {kind}:60s"))?;
            Ok(time.parse::<Duration>().map_err(|e| e.to_string())?.si())
        };
        match (kind, time) {
            ("constant", None) => Ok(Self::Constant),
            ("integration", None) => Ok(Self::Integration),
            ("interval", _) => Ok(Self::Interval { length_s: seconds()? }),
            ("walk" | "random-walk", _) => Ok(Self::RandomWalk { time_s: seconds()? }),
            ("jumps", _) => Ok(Self::Jumps { mean_s: seconds()? }),
            ("coherent", _) => Ok(Self::Coherent { time_s: seconds()? }),
            _ => Err(format!(
                "{text:?} is not a variation: use constant, integration, interval:TIME, walk:TIME (the rms is reached after TIME), \
                 jumps:TIME (mean distance) or coherent:TIME"
            )),
        }
    }
}

/// Most draws between two times. It limits the work for a time that is much shorter than an integration.
const MOST_DRAWS: u64 = 10_000;

impl Variation {
    /// Check the parameters.
    ///
    /// # Errors
    /// A time is not positive.
    pub fn check(&self) -> Result<()> {
        let (option, t) = match *self {
            Self::Constant | Self::Integration => return Ok(()),
            Self::Interval { length_s } => ("interval of the error", length_s),
            Self::RandomWalk { time_s } => ("time of the random walk", time_s),
            Self::Jumps { mean_s } => ("mean time between jumps", mean_s),
            Self::Coherent { time_s } => ("coherence time", time_s),
        };
        need(option, t, t.is_finite() && t > 0.0, "a positive time")
    }

    /// Values at times in ascending order, in s after the first one \[time\].
    pub fn series(&self, seconds: &[f64], rng: &mut impl Rng) -> Vec<f64> {
        let draw = |rng: &mut _| -> f64 { StandardNormal.sample(rng) };
        let mut value = if matches!(self, Self::RandomWalk { .. }) { 0.0 } else { draw(rng) };
        let mut last = seconds.first().copied().unwrap_or(0.0);
        let mut next_jump = f64::INFINITY;
        if let Self::Jumps { mean_s } = *self {
            next_jump = last + exponential(mean_s, rng);
        }
        seconds
            .iter()
            .enumerate()
            .map(|(k, &t)| {
                match *self {
                    Self::Constant => {}
                    Self::Integration if k > 0 => value = draw(rng),
                    Self::Integration => {}
                    Self::Interval { length_s } => {
                        // Every interval has its own draw, also in a gap, so that a gap does not change the later draws. The millisecond
                        // allows for Julian dates, which are accurate to 0.05 ms. After so many intervals a draw is random anyway.
                        let interval = |t: f64| ((t - seconds[0] + 1e-3) / length_s).floor();
                        let passed = interval(t) - interval(last);
                        for _ in 0..(passed as u64).min(MOST_DRAWS) {
                            value = draw(rng);
                        }
                    }
                    Self::RandomWalk { time_s } => value += ((t - last) / time_s).max(0.0).sqrt() * draw(rng),
                    Self::Jumps { mean_s } => {
                        let mut left = MOST_DRAWS;
                        while t >= next_jump {
                            value = draw(rng);
                            next_jump += exponential(mean_s, rng);
                            left -= 1;
                            if left == 0 {
                                // The value after so many jumps is independent of that before, and the process has no memory.
                                next_jump = t.next_up() + exponential(mean_s, rng);
                            }
                        }
                    }
                    Self::Coherent { time_s } => {
                        let keep = (-(t - last) / time_s).exp();
                        value = keep * value + (1.0 - keep * keep).max(0.0).sqrt() * draw(rng);
                    }
                }
                last = t;
                value
            })
            .collect()
    }
}

/// A waiting time with this mean.
pub(crate) fn exponential(mean: f64, rng: &mut impl Rng) -> f64 {
    -mean * (1.0 - rng.random::<f64>()).ln()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::stream;

    fn many(variation: Variation, seconds: &[f64], n: u64) -> Vec<Vec<f64>> {
        (0..n).map(|k| variation.series(seconds, &mut stream(11, "variation", k))).collect()
    }

    fn mean_product(series: &[Vec<f64>], i: usize, j: usize) -> f64 {
        series.iter().map(|s| s[i] * s[j]).sum::<f64>() / series.len() as f64
    }

    #[test]
    fn every_kind_has_unit_variance_and_its_own_correlation() {
        // With 4000 series, means of products of unit normals have an error of 1.4 / sqrt(4000) = 0.022 (one sigma).
        let seconds: Vec<f64> = (0..61).map(|k| 10.0 * f64::from(k)).collect();
        let limit = 0.08;
        for (variation, at_60, at_600) in [
            (Variation::Constant, 1.0, 1.0),
            (Variation::Integration, 0.0, 0.0),
            (Variation::Interval { length_s: 120.0 }, 1.0, 0.0),
            (Variation::Jumps { mean_s: 100.0 }, (-0.6_f64).exp(), (-6.0_f64).exp()),
            (Variation::Coherent { time_s: 100.0 }, (-0.6_f64).exp(), (-6.0_f64).exp()),
        ] {
            let series = many(variation, &seconds, 4000);
            for (i, j, truth) in [(0, 0, 1.0), (60, 60, 1.0), (0, 6, at_60), (0, 60, at_600)] {
                let found = mean_product(&series, i, j);
                assert!((found - truth).abs() < limit, "{variation:?} {i} {j}: {found} {truth}");
            }
        }
    }

    #[test]
    fn a_random_walk_spreads_with_the_square_root_of_time() {
        let seconds = [0.0, 15.0, 60.0, 240.0];
        let series = many(Variation::RandomWalk { time_s: 60.0 }, &seconds, 4000);
        for (k, variance) in [(0, 0.0), (1, 0.25), (2, 1.0), (3, 4.0)] {
            assert!((mean_product(&series, k, k) - variance).abs() < 0.08 * variance + 1e-12, "{k}");
        }
    }

    #[test]
    fn times_must_be_positive() {
        assert!(Variation::Coherent { time_s: 0.0 }.check().is_err());
        assert!(Variation::Interval { length_s: f64::NAN }.check().is_err());
        assert!(Variation::Integration.check().is_ok());
    }
}
