//! Statistics over the seeds of a point.

/// Statistics of a number over the seeds. Only finite values are used.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Statistics {
    /// Finite values.
    pub n: usize,
    /// Mean; NaN if there are no values.
    pub mean: f64,
    /// Standard deviation (with n - 1); NaN with fewer than two values.
    pub std: f64,
    /// Median.
    pub median: f64,
    /// 16th percentile.
    pub p16: f64,
    /// 84th percentile.
    pub p84: f64,
}

/// Statistics of some values.
#[must_use]
pub fn summarize(values: impl IntoIterator<Item = f64>) -> Statistics {
    let mut v: Vec<f64> = values.into_iter().filter(|x| x.is_finite()).collect();
    v.sort_by(f64::total_cmp);
    let n = v.len();
    // The values are summed in sorted order, so the sum does not depend on the order of the trials.
    let mean = if n > 0 { v.iter().sum::<f64>() / n as f64 } else { f64::NAN };
    let squares: f64 = v.iter().map(|x| (x - mean) * (x - mean)).sum();
    let std = if n > 1 { (squares / (n - 1) as f64).sqrt() } else { f64::NAN };
    Statistics { n, mean, std, median: quantile(&v, 0.5), p16: quantile(&v, 0.16), p84: quantile(&v, 0.84) }
}

/// Quantile of sorted values, linear between neighbours.
///
/// # Reference
/// Hyndman & Fan 1996, Am. Stat. 50, 361, definition 7.
fn quantile(sorted: &[f64], q: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = q * last as f64;
    let k = (at.floor() as usize).min(last);
    let high = sorted[(k + 1).min(last)];
    sorted[k] + (at - k as f64) * (high - sorted[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_are_those_of_the_finite_values() {
        let s = summarize([4.0, f64::NAN, 1.0, 3.0, f64::INFINITY, 2.0, 5.0]);
        assert_eq!((s.n, s.mean, s.median), (5, 3.0, 3.0));
        assert!((s.std - 2.5_f64.sqrt()).abs() < 1e-15 && (s.p16 - 1.64).abs() < 1e-12 && (s.p84 - 4.36).abs() < 1e-12);
        let none = summarize([f64::NAN]);
        assert!(none.n == 0 && none.mean.is_nan() && none.median.is_nan());
        let one = summarize([7.0]);
        assert!(one.mean == 7.0 && one.p84 == 7.0 && one.std.is_nan());
    }
}
