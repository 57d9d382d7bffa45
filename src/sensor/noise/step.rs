//! The exact step of a mode over a pause and a dwell: its value at the end, and its mean over the dwell.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A mode of a drift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mode {
    /// Rate of relaxation, 1/s; 0 for a random walk.
    pub(super) rate: f64,
    /// Variance; of a random walk, that after a second.
    pub(super) variance: f64,
}

/// Mean of exp(-t) from 0 to x.
fn mean_kept(x: f64) -> f64 {
    if x < 1e-8 { 1.0 } else { -(-x).exp_m1() / x }
}

/// Variance of the mean over a dwell of x relaxation times, over that of the value: 2 (x - 1 + exp(-x)) / x^2.
fn mean_variance(x: f64) -> f64 {
    // The difference of nearly equal numbers would lose digits for slow modes.
    if x < 1e-3 { 1.0 - x / 3.0 + x * x / 12.0 - x.powi(3) / 60.0 } else { 2.0 * ((-x).exp_m1() / x + 1.0) / x }
}

/// Variance of the mean over a dwell whose first and last value are known, over that of the value: (2 x - 4 tanh(x / 2)) / x^2.
fn bridge(x: f64) -> f64 {
    if x < 1e-2 { x / 6.0 - x.powi(3) / 60.0 } else { (2.0 - 4.0 * (0.5 * x).tanh() / x) / x }
}

impl Mode {
    /// Variance of the mean over a dwell, of a mode that is no random walk.
    pub(super) fn of_mean(self, dwell_s: f64) -> f64 {
        self.variance * mean_variance(self.rate * dwell_s)
    }

    /// Variance of the difference of the means over two dwells with a pause between them. A random walk has no dwell.
    pub(super) fn structure(self, dwell_s: f64, pause_s: f64) -> f64 {
        if self.rate == 0.0 {
            return self.variance * pause_s;
        }
        let x = self.rate * dwell_s;
        let kept = mean_kept(x).powi(2);
        let at_once = if x < 1e-3 { 2.0 * x / 3.0 - x * x / 2.0 + 7.0 * x.powi(3) / 30.0 } else { mean_variance(x) - kept };
        2.0 * self.variance * (at_once - kept * (-self.rate * pause_s).exp_m1())
    }

    /// The step over a pause and then a dwell, and the variance of what the mean has besides.
    fn step(self, pause_s: f64, dwell_s: f64) -> (Step, f64) {
        if self.rate == 0.0 {
            let shaken = (self.variance * (pause_s + dwell_s)).sqrt();
            return (Step { kept: 1.0, shaken, mean_kept: 1.0, mean_shaken: shaken }, 0.0);
        }
        let change = |seconds: f64| ((-self.rate * seconds).exp(), (self.variance * -(-2.0 * self.rate * seconds).exp_m1()).sqrt());
        let (kept, shaken) = change(pause_s);
        if dwell_s == 0.0 {
            return (Step { kept, shaken, mean_kept: kept, mean_shaken: shaken }, 0.0);
        }
        let x = self.rate * dwell_s;
        // Over the dwell: what the end and the mean keep of the first value, and what the shaking of the end adds to both.
        let (end, end_shaken) = change(dwell_s);
        let mean = mean_kept(x);
        let mean_shaken = self.variance * mean * -(-x).exp_m1() / end_shaken;
        // The first value of the dwell was shaken in the pause.
        let both = (end * shaken).hypot(end_shaken);
        let with_end = (mean * end * shaken * shaken + mean_shaken * end_shaken) / both;
        let besides = ((mean * shaken * end_shaken - end * shaken * mean_shaken) / both).powi(2);
        let step = Step { kept: end * kept, shaken: both, mean_kept: mean * kept, mean_shaken: with_end };
        (step, self.variance * bridge(x) + besides)
    }
}

/// What a step does: value and mean keep a part of the old value, and are shaken by one normal number.
#[derive(Debug, Clone, Copy)]
struct Step {
    kept: f64,
    shaken: f64,
    mean_kept: f64,
    mean_shaken: f64,
}

/// Steps of all modes for the pauses that came up last.
pub(super) struct Steps<'a> {
    modes: &'a [Mode],
    dwell_s: f64,
    white: f64,
    /// Pause, step of each mode, and standard deviation of what the sum of the means has besides.
    known: Vec<(f64, Vec<Step>, f64)>,
}

/// Pauses that are kept: nearly all steps are of a few lengths.
const KNOWN: usize = 8;

impl<'a> Steps<'a> {
    /// No step is known yet. `white` is the variance of what is independent from reading to reading.
    pub(super) fn new(modes: &'a [Mode], dwell_s: f64, white: f64) -> Self {
        Self { modes, dwell_s, white, known: Vec::new() }
    }

    pub(super) fn dwell_s(&self) -> f64 {
        self.dwell_s
    }

    /// Take the modes over a pause and a dwell. Returns the sum of their means over the dwell.
    pub(super) fn reading(&mut self, values: &mut [f64], pause_s: f64, rng: &mut ChaCha8Rng) -> f64 {
        // Times of samples without a pause differ by rounding.
        let pause_s = if pause_s > 1e-9 * self.dwell_s { pause_s } else { 0.0 };
        if pause_s == 0.0 && self.dwell_s == 0.0 {
            return values.iter().sum();
        }
        let (_, steps, besides) = self.of(pause_s);
        let mut sum = 0.0;
        for (value, step) in values.iter_mut().zip(steps) {
            let normal: f64 = StandardNormal.sample(rng);
            sum += step.mean_kept * *value + step.mean_shaken * normal;
            *value = step.kept * *value + step.shaken * normal;
        }
        if *besides > 0.0 {
            let normal: f64 = StandardNormal.sample(rng);
            sum += besides * normal;
        }
        sum
    }

    fn of(&mut self, pause_s: f64) -> &(f64, Vec<Step>, f64) {
        let near = |known: f64| (known - pause_s).abs() <= 1e-9 * (known + self.dwell_s);
        let k = match self.known.iter().position(|(pause, ..)| near(*pause)) {
            Some(k) => k,
            None => {
                if self.known.len() >= KNOWN {
                    self.known.remove(0);
                }
                let (steps, besides): (Vec<Step>, Vec<f64>) = self.modes.iter().map(|mode| mode.step(pause_s, self.dwell_s)).unzip();
                self.known.push((pause_s, steps, (self.white + besides.iter().sum::<f64>()).sqrt()));
                self.known.len() - 1
            }
        };
        &self.known[k]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Value at the end and mean over the dwell, from many short steps without a dwell: what they keep of the first value, and their covariance.
    fn summed(mode: Mode, pause_s: f64, dwell_s: f64) -> ([f64; 2], [f64; 3]) {
        let n = 4000;
        let (mut kept, mut value, mut mean, mut mixed) = ((-mode.rate * pause_s).exp(), 0.0, 0.0, 0.0);
        value += mode.variance * (1.0 - kept * kept);
        let (mut mean_kept, short) = (0.0, dwell_s / f64::from(n));
        let e = (-mode.rate * short).exp();
        // Trapezoidal rule: half of the first and of the last value.
        for k in 0..=n {
            let weight = if k == 0 || k == n { 0.5 } else { 1.0 } / f64::from(n);
            mean += 2.0 * weight * mixed + weight * weight * value;
            mixed += weight * value;
            mean_kept += weight * kept;
            if k < n {
                (kept, mixed, value) = (kept * e, mixed * e, value * e * e + mode.variance * (1.0 - e * e));
            }
        }
        ([kept, mean_kept], [value, mixed, mean])
    }

    #[test]
    fn a_step_is_the_sum_of_many_short_ones() {
        for (rate, pause_s, dwell_s) in
            [(1.0, 0.0, 1.0), (1.0, 0.5, 2.0), (3.0, 0.1, 1.5), (0.02, 0.3, 0.4), (0.02, 0.0, 0.4), (7.0, 0.0, 1.0)]
        {
            let mode = Mode { rate, variance: 2.5 };
            let ([kept, mean_kept], [value, mixed, mean]) = summed(mode, pause_s, dwell_s);
            let (step, besides) = mode.step(pause_s, dwell_s);
            let near = |what: &str, found: f64, want: f64| {
                assert!((found - want).abs() <= 3e-6 * want.abs(), "{rate} {pause_s} {dwell_s}: {what} {found}, expected {want}");
            };
            near("kept", step.kept, kept);
            near("mean kept", step.mean_kept, mean_kept);
            near("variance", step.shaken.powi(2), value);
            near("covariance", step.shaken * step.mean_shaken, mixed);
            near("variance of the mean", step.mean_shaken.powi(2) + besides, mean);
            // The mode is stationary.
            near("of any mean", mode.of_mean(dwell_s), mode.variance * step.mean_kept.powi(2) + mean);
            // The mean over a dwell before the pause is `mean_kept(x)` of the value at its end, and more that the step does not remember.
            let before = mean_kept_of(mode, dwell_s);
            near("structure", mode.structure(dwell_s, pause_s), 2.0 * (mode.of_mean(dwell_s) - mode.variance * before * step.mean_kept));
        }
    }

    /// What a mean over a dwell has of the value at its end.
    fn mean_kept_of(mode: Mode, dwell_s: f64) -> f64 {
        mean_kept(mode.rate * dwell_s)
    }

    #[test]
    fn slow_modes_lose_no_digits() {
        for (function, limit) in [(mean_variance as fn(f64) -> f64, 1e-3), (bridge, 1e-2)] {
            let (below, above) = (function(limit * (1.0 - 1e-9)), function(limit * (1.0 + 1e-9)));
            assert!((below / above - 1.0).abs() < 1e-8, "{below} {above}");
        }
        let mode = |rate: f64| Mode { rate, variance: 1.0 };
        let (below, above) = (mode(9.999_999e-4).structure(1.0, 0.0), mode(1.000_000_1e-3).structure(1.0, 0.0));
        assert!((below / above - 1.0).abs() < 1e-6, "{below} {above}");
        // A mode of a year sampled for a millisecond.
        let (step, besides) = mode(3e-8).step(0.0, 1e-3);
        assert!((step.shaken.powi(2) / 6e-11 - 1.0).abs() < 1e-6 && (besides / 5e-12 - 1.0).abs() < 1e-6);
    }
}
