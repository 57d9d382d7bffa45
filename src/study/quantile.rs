//! Quantiles of a sample that is known only in brackets, with confidence limits that assume nothing about its distribution.
//!
//! The k-th smallest of n values exceeds the quantile of level q if fewer than k of the values lie below that quantile. This number has a
//! binomial distribution with mean n q and variance n q (1 - q), whatever the distribution of the values is. The rank (n + 1) q is therefore
//! the estimate, and the ranks one standard deviation below and above are the limits that hold the quantile in 68 % of all samples. Values
//! between two ranks are interpolated.
//!
//! # Reference
//! Hutson 1999, J. Appl. Stat. 26, 343 (fractional order statistics).

/// A number that may lie outside the range that was searched.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Place {
    /// Below the range.
    Below,
    /// Inside.
    At(f64),
    /// Above the range.
    Above,
}

impl Place {
    /// The number, if it is inside the range.
    #[must_use]
    pub fn number(self) -> Option<f64> {
        match self {
            Self::At(x) => Some(x),
            Self::Below | Self::Above => None,
        }
    }
}

/// A quantile with its 68 % confidence limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The quantile.
    pub value: Place,
    /// Lower limit; `None` where the sample is too small for one.
    pub low: Option<Place>,
    /// Upper limit; `None` where the sample is too small for one.
    pub high: Option<Place>,
}

/// An interval that holds a value of the sample. An open end is infinite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bracket {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Bracket {
    fn middle(self) -> f64 {
        0.5 * (self.low + self.high)
    }
}

/// Rounding of a level such as 1 - 0.9, in ranks.
const ROUNDING: f64 = 1e-9;

/// Ranks (from 1) of the lower limit, the estimate and the upper limit of the quantile of level `q` in a sample of `n`.
fn ranks(n: usize, q: f64) -> [f64; 3] {
    let (middle, spread) = ((n as f64 + 1.0) * q, (n as f64 * q * (1.0 - q)).sqrt());
    [middle - spread, middle, middle + spread]
}

/// True if a sample of `n` has the rank.
fn exists(rank: f64, n: usize) -> bool {
    (1.0 - ROUNDING..=n as f64 + ROUNDING).contains(&rank)
}

/// The smallest number of seeds that gives a quantile of this level.
#[must_use]
pub fn least_seeds(q: f64) -> usize {
    (1..100_000).find(|n| exists(ranks(*n, q)[1], *n)).unwrap_or(100_000)
}

/// The smallest number of seeds that gives limits for a quantile of this level.
#[must_use]
pub fn enough_seeds(q: f64) -> usize {
    (1..100_000).find(|n| ranks(*n, q).iter().all(|r| exists(*r, *n))).unwrap_or(100_000)
}

/// The quantile of level `q` of the middles of some brackets.
pub(super) fn estimate(brackets: &[Bracket], q: f64) -> Estimate {
    let mut middles: Vec<f64> = brackets.iter().map(|b| b.middle()).collect();
    middles.sort_by(f64::total_cmp);
    let n = middles.len();
    let [low, value, high] = ranks(n, q).map(|r| exists(r, n).then(|| at_rank(&middles, r.clamp(1.0, n as f64))));
    // A sample without the rank of the estimate itself is refused before it is drawn.
    Estimate { value: value.unwrap_or(Place::Below), low, high }
}

/// The value of a rank in sorted values.
fn at_rank(sorted: &[f64], rank: f64) -> Place {
    let k = rank.floor();
    let (below, above) = (sorted[k as usize - 1], sorted[(k as usize).min(sorted.len() - 1)]);
    let share = rank - k;
    match (below.is_finite(), above.is_finite() || share == 0.0) {
        (true, true) => Place::At(if share == 0.0 { below } else { below + share * (above - below) }),
        (false, _) if below < 0.0 => Place::Below,
        _ => Place::Above,
    }
}

/// Indices of the brackets that still hide a value from which the estimate or its limits are made: those that are wider than `wide_enough`
/// allows and overlap the possible places of that value.
pub(super) fn unresolved(brackets: &[Bracket], q: f64, wide: impl Fn(&Bracket) -> bool) -> Vec<usize> {
    let n = brackets.len();
    let sorted = |pick: fn(&Bracket) -> f64| {
        let mut all: Vec<f64> = brackets.iter().map(pick).collect();
        all.sort_by(f64::total_cmp);
        all
    };
    let (lows, highs) = (sorted(|b| b.low), sorted(|b| b.high));
    let needed = ranks(n, q).into_iter().filter(|r| exists(*r, n)).map(|r| r.clamp(1.0, n as f64)).flat_map(|r| [r.floor(), r.ceil()]);
    // The k-th smallest value lies between the k-th smallest lower end and the k-th smallest upper end.
    let spans: Vec<(f64, f64)> = needed.map(|r| (lows[r as usize - 1], highs[r as usize - 1])).collect();
    let hides = |b: &Bracket| wide(b) && spans.iter().any(|(low, high)| b.low < *high && b.high > *low);
    (0..n).filter(|k| hides(&brackets[*k])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::stream;
    use rand::RngExt;

    fn exact(values: &[f64]) -> Vec<Bracket> {
        values.iter().map(|v| Bracket { low: *v, high: *v }).collect()
    }

    #[test]
    fn limits_of_the_median_hold_it_in_two_of_three_samples() {
        // Uniform values, whose median is 0.5: 68 % of 2000 samples, with a standard error of 1 %. Interpolation between ranks is not exact
        // for small samples.
        for (n, level) in [(5, 0.5), (20, 0.5), (21, 0.3)] {
            let held = (0..2000).filter(|k| {
                let mut rng = stream(*k, "samples of the test", n);
                let values: Vec<f64> = (0..n).map(|_| rng.random::<f64>()).collect();
                let e = estimate(&exact(&values), level);
                let limit = |p: Option<Place>| p.and_then(Place::number).unwrap();
                (limit(e.low)..limit(e.high)).contains(&level)
            });
            let share = held.count() as f64 / 2000.0;
            assert!((0.64..0.73).contains(&share), "{n} values, level {level}: {share}");
        }
    }

    #[test]
    fn values_outside_the_range_and_samples_that_are_too_small_are_said() {
        let (below, above) = (f64::NEG_INFINITY, f64::INFINITY);
        let e = estimate(&exact(&[1.0, 2.0, above, above, above]), 0.5);
        assert_eq!((e.value, e.high), (Place::Above, Some(Place::Above)));
        let e = estimate(&exact(&[below, below, below, 2.0, 3.0]), 0.5);
        assert_eq!((e.value, e.low), (Place::Below, Some(Place::Below)));
        let e = estimate(&exact(&[1.0, 2.0, 4.0]), 0.5);
        assert_eq!(e.value, Place::At(2.0));
        assert!(e.low.is_some() && e.high.is_some());
        let e = estimate(&exact(&[1.0, 4.0]), 0.5);
        assert_eq!((e.value, e.low, e.high), (Place::At(2.5), None, None));
        assert_eq!((enough_seeds(0.5), least_seeds(0.5), least_seeds(0.1)), (3, 1, 9));
    }

    #[test]
    fn only_brackets_around_the_ranks_are_refined() {
        let b = |low, high| Bracket { low, high };
        // The median of 13 values and its limits need the ranks 5 to 9.
        let mut brackets = vec![b(0.0, 1.0); 4];
        brackets.extend([b(4.0, 5.0), b(4.0, 6.0), b(4.5, 4.5), b(4.5, 4.5), b(4.5, 4.5)]);
        brackets.extend([b(9.0, 20.0); 4]);
        assert_eq!(unresolved(&brackets, 0.5, |b| b.high > b.low), [4, 5]);
        assert!(unresolved(&brackets, 0.5, |b| b.high > b.low + 3.0).is_empty());
    }
}
