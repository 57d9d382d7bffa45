//! Processes that wander in time, one for each detector, and their calibration.
//!
//! A drift is a sum of modes. A mode relaxes towards 0 with its rate and is shaken so that its variance stays the same (Ornstein-Uhlenbeck
//! process); a mode with the rate 0 is a random walk. Both have an exact step of any length. A calibration takes the present value as the new zero.

use super::moment::Moment;
use crate::sensor::scans::Samples;
use cittert_arrays::random::stream;
use ndarray::Array2;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// A mode of a drift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mode {
    /// Rate of relaxation, 1/s; 0 for a random walk.
    pub(super) rate: f64,
    /// Variance; of a random walk, that after a second.
    pub(super) variance: f64,
}

impl Mode {
    /// What is left of a value after a time, and the standard deviation of what is added.
    fn step(self, seconds: f64) -> (f64, f64) {
        if self.rate == 0.0 {
            return (1.0, (self.variance * seconds).sqrt());
        }
        let kept = (-self.rate * seconds).exp();
        (kept, (self.variance * -(-2.0 * self.rate * seconds).exp_m1()).sqrt())
    }

    /// Variance of the difference of two values at times this far apart.
    pub(super) fn structure(self, seconds: f64) -> f64 {
        if self.rate == 0.0 { self.variance * seconds } else { -2.0 * self.variance * (-self.rate * seconds).exp_m1() }
    }
}

/// The drift of one detector.
#[derive(Debug, Clone)]
pub(in crate::sensor) struct Drift {
    values: Vec<f64>,
    zero: f64,
    time_s: f64,
}

/// The drifts of all detectors of a part \[detector\]; empty for a part that does not remember.
pub(in crate::sensor) type Drifts = Vec<Drift>;

/// What all drifts of one part have in common.
#[derive(Debug)]
pub(super) struct Wander {
    pub(super) modes: Vec<Mode>,
    /// Time between calibrations; `None` for one at time 0 alone.
    pub(super) calibration_s: Option<f64>,
    /// The first value is the zero.
    pub(super) calibrated: bool,
    pub(super) purpose: &'static str,
}

/// Detectors that share a stream of random numbers, so that streams are few.
const GROUP: usize = 64;

impl Wander {
    /// Drifts of all detectors at time 0.
    pub(super) fn begin(&self, detectors: usize, seed: u64, plane: u64) -> Drifts {
        let mut drifts = vec![Drift { values: vec![0.0; self.modes.len()], zero: 0.0, time_s: 0.0 }; detectors];
        drifts.par_chunks_mut(GROUP).enumerate().for_each(|(group, drifts)| {
            let mut rng = stream(seed, self.purpose, u64::MAX - (plane << 40 | group as u64));
            for drift in drifts {
                for (value, mode) in drift.values.iter_mut().zip(&self.modes).filter(|(_, mode)| mode.rate > 0.0) {
                    let normal: f64 = StandardNormal.sample(&mut rng);
                    *value = mode.variance.sqrt() * normal;
                }
                drift.zero = if self.calibrated { drift.values.iter().sum() } else { 0.0 };
            }
        });
        drifts
    }

    /// Time of the last calibration before a time, s.
    pub(super) fn calibrated_s(&self, time_s: f64) -> f64 {
        self.calibration_s.map_or(0.0, |every| (time_s / every).floor() * every)
    }

    /// The drift of each sample of a frame \[row, column\].
    pub(super) fn frame(&self, samples: &Samples, drifts: &mut Drifts, moment: Moment) -> Array2<f64> {
        let lists: Vec<Vec<((usize, usize), f64)>> = drifts
            .par_chunks_mut(GROUP)
            .enumerate()
            .map(|(group, drifts)| {
                let mut rng = stream(moment.seed, self.purpose, moment.index << 32 | group as u64);
                // Nearly all steps are of a few lengths.
                let mut steps = Steps { modes: &self.modes, known: Vec::new() };
                let mut out = Vec::new();
                for (k, drift) in drifts.iter_mut().enumerate() {
                    for at in samples.of_detector(group * GROUP + k) {
                        let time = moment.time_s + samples.middle_s(at.0, at.1);
                        let calibrated = self.calibrated_s(time);
                        if calibrated > drift.time_s {
                            drift.advance(calibrated, &mut steps, &mut rng);
                            drift.zero = drift.values.iter().sum();
                        }
                        drift.advance(time, &mut steps, &mut rng);
                        out.push((at, drift.values.iter().sum::<f64>() - drift.zero));
                    }
                }
                out
            })
            .collect();
        let mut out = Array2::zeros((samples.rows, samples.columns));
        lists.into_iter().flatten().for_each(|(at, value)| out[at] = value);
        out
    }
}

/// Steps of all modes for the lengths that came up last.
struct Steps<'a> {
    modes: &'a [Mode],
    known: Vec<(f64, Vec<(f64, f64)>)>,
}

impl Steps<'_> {
    fn of(&mut self, seconds: f64) -> &[(f64, f64)] {
        let near = |known: f64| (known - seconds).abs() <= 1e-9 * known;
        let k = match self.known.iter().position(|(length, _)| near(*length)) {
            Some(k) => k,
            None => {
                if self.known.len() >= 8 {
                    self.known.remove(0);
                }
                self.known.push((seconds, self.modes.iter().map(|mode| mode.step(seconds)).collect()));
                self.known.len() - 1
            }
        };
        &self.known[k].1
    }
}

impl Drift {
    fn advance(&mut self, time_s: f64, steps: &mut Steps<'_>, rng: &mut rand_chacha::ChaCha8Rng) {
        let seconds = time_s - self.time_s;
        if seconds > 0.0 {
            for (value, (kept, shaken)) in self.values.iter_mut().zip(steps.of(seconds)) {
                let normal: f64 = StandardNormal.sample(rng);
                *value = kept * *value + shaken * normal;
            }
            self.time_s = time_s;
        }
    }
}
