//! Processes that wander in time, one for each detector, and their calibration.
//!
//! A drift is a sum of modes. A mode relaxes towards 0 with its rate and is shaken so that its variance stays the same (Ornstein-Uhlenbeck
//! process); a mode with the rate 0 is a random walk. A sample is the mean of the drift over a dwell. The steps are exact for any pause and any dwell.
//! A calibration takes a reading, as long as a sample, as the new zero.

use super::moment::Moment;
use super::step::{Mode, Steps};
use crate::sensor::scans::Samples;
use cittert_arrays::random::stream;
use ndarray::Array2;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// The drift of one detector.
#[derive(Debug, Clone)]
pub(in crate::sensor) struct Drift {
    values: Vec<f64>,
    zero: f64,
    /// End of the last sample or calibration, s.
    time_s: f64,
    /// Time of the last calibration, s.
    calibrated_s: f64,
}

/// The drifts of all detectors of a part \[detector\]; empty for a part that does not remember.
pub(in crate::sensor) type Drifts = Vec<Drift>;

/// What all drifts of one part have in common.
#[derive(Debug)]
pub(super) struct Wander {
    pub(super) modes: Vec<Mode>,
    /// Variance of what is independent from sample to sample.
    pub(super) white: f64,
    /// Length of a sample, s. Its value is the mean over this time; with 0, the value in its middle.
    pub(super) dwell_s: f64,
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
        let drift = Drift { values: vec![0.0; self.modes.len()], zero: 0.0, time_s: 0.0, calibrated_s: 0.0 };
        let mut drifts = vec![drift; detectors];
        drifts.par_chunks_mut(GROUP).enumerate().for_each(|(group, drifts)| {
            let mut rng = stream(seed, self.purpose, u64::MAX - (plane << 40 | group as u64));
            let mut steps = Steps::new(&self.modes, self.dwell_s, self.white);
            for drift in drifts {
                for (value, mode) in drift.values.iter_mut().zip(&self.modes).filter(|(_, mode)| mode.rate > 0.0) {
                    let normal: f64 = StandardNormal.sample(&mut rng);
                    *value = mode.variance.sqrt() * normal;
                }
                if self.calibrated {
                    drift.zero = steps.reading(&mut drift.values, 0.0, &mut rng);
                }
            }
        });
        drifts
    }

    /// Time of the last calibration before a time, s.
    pub(super) fn calibrated_s(&self, time_s: f64) -> f64 {
        self.calibration_s.map_or(0.0, |every| (time_s / every).floor() * every)
    }

    /// Expected variance of the sample in whose middle a time lies.
    pub(super) fn variance(&self, middle_s: f64) -> f64 {
        if !self.calibrated {
            return self.white + self.modes.iter().map(|mode| mode.of_mean(self.dwell_s)).sum::<f64>();
        }
        let pause_s = (middle_s - 0.5 * self.dwell_s - self.calibrated_s(middle_s)).max(0.0);
        2.0 * self.white + self.modes.iter().map(|mode| mode.structure(self.dwell_s, pause_s)).sum::<f64>()
    }

    /// The drift of each sample of a frame \[row, column\].
    pub(super) fn frame(&self, samples: &Samples, drifts: &mut Drifts, moment: Moment) -> Array2<f64> {
        let lists: Vec<Vec<((usize, usize), f64)>> = drifts
            .par_chunks_mut(GROUP)
            .enumerate()
            .map(|(group, drifts)| {
                let mut rng = stream(moment.seed, self.purpose, moment.index << 32 | group as u64);
                // Nearly all steps are of a few lengths.
                let mut steps = Steps::new(&self.modes, self.dwell_s, self.white);
                let mut out = Vec::new();
                for (k, drift) in drifts.iter_mut().enumerate() {
                    for at in samples.of_detector(group * GROUP + k) {
                        let time = moment.time_s + samples.middle_s(at.0, at.1);
                        let calibrated = self.calibrated_s(time);
                        if calibrated > drift.calibrated_s {
                            drift.zero = drift.read(calibrated, &mut steps, &mut rng);
                            drift.calibrated_s = calibrated;
                        }
                        out.push((at, drift.read(time + 0.5 * self.dwell_s, &mut steps, &mut rng) - drift.zero));
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

impl Drift {
    /// The mean over a dwell that ends at a time. It begins no sooner than the end of the one before: a calibration between two samples takes no time from them.
    fn read(&mut self, end_s: f64, steps: &mut Steps<'_>, rng: &mut ChaCha8Rng) -> f64 {
        let pause_s = end_s - steps.dwell_s() - self.time_s;
        self.time_s = end_s;
        steps.reading(&mut self.values, pause_s, rng)
    }
}
